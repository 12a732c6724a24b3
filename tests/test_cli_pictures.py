"""Pictures and films from the command line: written whole, told of, refused before the work where they cannot be."""

from __future__ import annotations

import importlib
import os
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import pfabrik as pf
from pfabrik.cli import main

pytest.importorskip("matplotlib")


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("path.csv").write_text("x,y,z\n0,0,200\n0,20,230\n0,0,300\n", encoding="utf-8")


def run(*words: str) -> Result:
    """The command, as a shell runs it."""
    return CliRunner().invoke(main, words)


def test_plot_draws_home_by_default_under_the_machines_name() -> None:
    result = run("plot", "five_bar")
    assert (result.exit_code, result.stdout) == (0, "wrote five_bar.png\n")
    assert Path("five_bar.png").read_bytes().startswith(b"\x89PNG")


def test_plot_draws_the_answer_to_a_target_and_its_exit_code_says_what_became_of_it() -> None:
    assert run("plot", "five_bar", "--position", "0", "0", "180", "-o", "a.svg").exit_code == 0
    assert run("plot", "five_bar", "--position", "0", "0", "300", "-o", "a.pdf").exit_code == 1
    assert Path("a.svg").read_text(encoding="utf-8").startswith("<?xml")
    assert Path("a.pdf").read_bytes().startswith(b"%PDF")


def test_track_draws_and_films_without_a_file_of_answers() -> None:
    result = run("track", "five_bar", "path.csv", "--plot", "a.png", "--animate", "a.gif")
    assert result.exit_code == 1, result.stderr
    assert sorted(os.listdir()) == ["a.gif", "a.png", "path.csv"]
    assert "wrote a.png" in result.stderr
    assert "2 reached, 1 projected" in result.stdout


def test_plot_writes_the_names_of_all_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[set[str]] = []
    drawing = importlib.import_module("pfabrik.view.machine")
    monkeypatch.setattr(drawing, "write_names", lambda _canvas, _skeleton, named: written.append(named))
    assert run("plot", "five_bar", "--names", "-o", "a.svg").exit_code == 0
    assert run("plot", "five_bar", "-o", "b.svg").exit_code == 0
    assert written == [{joint.name for joint in pf.load("five_bar").joints}, set()]


@pytest.mark.slow
def test_plot_draws_the_torques_of_joints_in_series() -> None:
    result = run("plot", "g1_ankle", "--torque-map", "--torque", "25")
    assert (result.exit_code, result.stdout) == (0, "wrote g1_ankle.png\n")
    for joints in (["--joints", "p1,p2"], ["--joints", "p1", "p2"], ["--joints", "p1", "--joints", "p2"]):
        assert run("plot", "five_bar", "--torque-map", *joints, "-o", "a.svg").exit_code == 0
    axes = pf.actuation(pf.load("g1_ankle"), ("roll_joint", "pitch_joint")).plot_torques(25.0)
    assert axes.get_xlabel() == "roll_joint [deg]" and "by actuators of 25" in axes.get_title()
    assert len(axes.patches) > 30  # polygons


def test_travel_prints_its_table_and_draws_it() -> None:
    result = run("travel", "five_bar", "--plot", "a.png")
    assert result.exit_code == 0
    home = pf.load("five_bar").home_pose
    assert result.stdout.rstrip() == str(pf.travel(pf.solve_ik(pf.load("five_bar"), home)))
    assert Path("a.png").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("plot", "five_bar", "-o", "a.bmp"), "'a.bmp'; expected a name that ends in .png, .svg or .pdf"),
        (("plot", "five_bar", "-o", "none/a.png"), "none/a.png: No such file or directory"),
        (("plot", "mine.toml", "-o", "mine.png"), "mine.png: found a file that was read"),
        (("plot", "five_bar", "--position", "0", "0"), "--position"),
        (("plot", "stewart", "--torque-map"), "no passive joints in series from base to end effector; give --joints"),
        (("plot", "g1_ankle", "--torque", "3"), "--joints and --torque belong to --torque-map"),
        (("plot", "g1_ankle", "roll_joint", "--torque-map"), "names after --joints"),
        (("plot", "g1_ankle", "--torque-map", "--joints", "a", "b", "--joints", "c"), "--joints once with all names"),
        (("plot", "g1_ankle", "--torque-map", "--names"), "does not go with a target or --names"),
        (("plot", "tricept", "--torque-map"), "two angles, or two lengths, for a torque map"),
        (("track", "five_bar", "path.csv", "--animate", "a.png"), "expected a name that ends in .gif or .mp4"),
        (("track", "five_bar", "path.csv", "--plot", "a.gif"), "expected a name that ends in .png, .svg or .pdf"),
    ],
)
def test_what_cannot_be_written_is_told_in_a_line(words: tuple[str, ...], told: str) -> None:
    pf.save(pf.load("five_bar"), "mine.toml")
    Path("mine.png").symlink_to("mine.toml")
    result = run(*words)
    assert result.exit_code == 2
    assert told in result.stderr
    assert "Traceback" not in result.stderr
    assert sorted(os.listdir()) == ["mine.png", "mine.toml", "path.csv"]


def test_a_missing_library_is_named_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pfabrik.extras.find_spec", lambda _: None)
    for words in (("plot", "five_bar"), ("track", "five_bar", "path.csv", "--animate", "a.gif")):
        result = run(*words)
        assert result.exit_code == 2
        assert "install it with: pip install '.[plot]'" in result.stderr
