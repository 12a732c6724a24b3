"""The command: what it prints, what it writes, how it leaves; on good, odd and hostile input."""

from __future__ import annotations

import csv
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import pfabrik as pf
from pfabrik.cli import main
from pfabrik.report import rpy_angles

WITHIN_REACH = ["--position", "10", "0", "190"]
BEYOND_REACH = ["--position", "0", "0", "300"]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Run a command line in a folder of its own; a Python exception fails the test."""
    monkeypatch.chdir(tmp_path)

    def run(*line: object) -> Result:
        result = CliRunner().invoke(main, [str(word) for word in line])
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        return result

    return run


def in_process(*line: object, **options: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "pfabrik", *map(str, line)]
    return subprocess.Popen(command, text=True, stderr=subprocess.PIPE, **options)  # type: ignore[call-overload, no-any-return]


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as handle:
        return list(csv.DictReader(handle))


# What it says


def test_catalog_lists_every_machine(run: Callable[..., Result]) -> None:
    result = run("catalog")
    assert result.exit_code == 0
    assert [line.split()[0] for line in result.stdout.splitlines()[1:]] == list(pf.catalog())


@pytest.mark.parametrize("name", pf.catalog())
def test_info_shows_every_joint_chain_and_actuator(run: Callable[..., Result], name: str) -> None:
    mechanism = pf.load(name)
    text = run("info", name).stdout
    assert mechanism.name in text
    assert all(str(chain) in text for chain in pf.decompose(mechanism))
    assert all(joint.name in text for joint in mechanism.joints)
    assert "…" not in text and "\x1b" not in text


@pytest.mark.parametrize("name", pf.catalog())
def test_check_says_ok_of_every_machine_supplied(run: Callable[..., Result], name: str) -> None:
    result = run("check", name)
    assert result.exit_code == 0
    assert result.stdout.startswith("ok: ")
    assert result.stderr == ""


def test_check_names_every_fault_on_a_line_of_its_own(run: Callable[..., Result], tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    pf.save(pf.load("five_bar"), path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("actuated = true", 'actuated = "yes"'), encoding="utf-8")
    result = run("check", path)
    assert result.exit_code == 2
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert all(line.startswith(f"pfabrik: {path}: ") for line in lines)
    assert [sum(f"joint[{index}].actuated" in line for line in lines) for index in (0, 4)] == [1, 1]


def test_ik_tells_reached_from_projected_by_its_exit_code(run: Callable[..., Result]) -> None:
    assert run("ik", "stewart", *WITHIN_REACH).exit_code == 0
    assert run("ik", "stewart", *BEYOND_REACH).exit_code == 1


def test_a_projection_names_its_distance_and_the_limits_that_hold_it(run: Callable[..., Result]) -> None:
    first_line = run("ik", "stewart", *BEYOND_REACH).stdout.splitlines()[0]
    solution = pf.solve_ik(pf.load("stewart"), pf.pose([0, 0, 300]))
    assert first_line.startswith(f"projected: {solution.position_error:.3g} mm from the target; ")
    assert all(limit.joint in first_line for limit in solution.active_limits)


def test_json_is_one_object_that_says_what_the_solution_says(run: Callable[..., Result]) -> None:
    result = run("ik", "stewart", *WITHIN_REACH, "--rpy", 0, 5, 0, "--json")
    solution = pf.solve_ik(pf.load("stewart"), pf.pose([10, 0, 190], rpy=[0, math.radians(5), 0]))
    assert json.loads(result.stdout) == json.loads(json.dumps(solution.to_dict()))
    assert result.stdout.count("\n") == 1


def test_angles_are_degrees_for_people(run: Callable[..., Result]) -> None:
    solution = pf.solve_ik(pf.load("five_bar"), pf.pose([0, 10, 200]))
    text = run("ik", "five_bar", "--position", 0, 10, 200).stdout
    assert all(f"{math.degrees(angle):.6g}" in text for angle in solution.actuators)


def test_a_rotation_that_the_task_leaves_out_is_not_dropped_silently(run: Callable[..., Result]) -> None:
    assert "--rpy has no effect" in run("ik", "five_bar", "--rpy", 10, 0, 0).stderr


def test_rpy_is_the_inverse_of_pose() -> None:
    for rpy in ([0.1, -0.7, 2.0], [3.0, 1.5, -3.0], [0, math.pi / 2, 0.4], [0, -math.pi / 2, 0.4]):
        rotated = pf.pose([0, 0, 0], rpy=rpy)
        np.testing.assert_allclose(pf.pose([0, 0, 0], rpy=rpy_angles(rotated)), rotated, atol=1e-12)


# Paths


def test_track_answers_every_target(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z,roll,pitch,yaw\n0,0,190,0,0,0\n5,0,190,0,5,0\n\n0,0,300,0,0,0\n")
    result = run("track", "stewart", "path.csv", "-o", "answers.csv")
    assert result.exit_code == 1
    assert result.stdout.splitlines() == [result.stdout.strip()]
    rows = rows_of(tmp_path / "answers.csv")
    assert [row["status"] for row in rows] == ["REACHED", "REACHED", "PROJECTED"]
    assert float(rows[1]["target_pitch_rad"]) == pytest.approx(math.radians(5), abs=1e-12)
    assert float(rows[1]["pitch_rad"]) == pytest.approx(math.radians(5), abs=1e-9)
    assert "max" in rows[2]["active_limits"]
    assert set(os.listdir(tmp_path)) == {"answers.csv", "path.csv"}


def test_track_writes_angles_in_radians(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("\ufeffx, y, z\r\n0, 10, 200\r\n", encoding="utf-8")
    assert run("track", "five_bar", "path.csv", "-o", "answers.csv").exit_code == 0
    answer = pf.track(pf.load("five_bar"), np.array([[0.0, 10.0, 200.0]]))
    row = rows_of(tmp_path / "answers.csv")[0]
    assert [float(row[f"actuator_{name}_rad"]) for name in ("p1", "p5")] == answer.actuators[0].tolist()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "empty"),
        ("\n\n", "empty"),
        ("x,y,z\n", "no targets"),
        ("x,y\n1,2\n", "no column z"),
        ("x,y,z,rol\n1,2,3,4\n", "line 1: unknown column 'rol'; did you mean 'roll'?"),
        ("x,y,z,roll\n1,2,3,4\n", "no column pitch, yaw"),
        ("x,y,z,x\n1,2,3,4\n", "'x' appears twice"),
        ("x,y,z\n1,2,3\n1,b,3\n", "line 3: column 'y': found 'b'"),
        ("x,y,z\n1,2,nan\n", "line 2: column 'z': found 'nan'"),
        ("x,y,z\n1,2,1e999\n", "found '1e999'"),
        ("x,y,z\n1,2\n", "line 2: found 2 cells; expected 3"),
        ("1,2,3\n", "unknown column '1'"),
        ('x,y,z\n1,2,"' + "9" * 200_000 + '"\n', "not a CSV text file"),
    ],
)
def test_a_wrong_path_file_is_told_by_line_and_column(
    run: Callable[..., Result], tmp_path: Path, text: str, told: str
) -> None:
    (tmp_path / "path.csv").write_text(text, encoding="utf-8")
    result = run("track", "five_bar", "path.csv", "-o", "answers.csv")
    assert result.exit_code == 2
    assert told in result.stderr
    assert os.listdir(tmp_path) == ["path.csv"]


def test_a_path_file_that_is_no_text_is_refused(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_bytes(bytes(range(256)))
    result = run("track", "five_bar", "path.csv", "-o", "answers.csv")
    assert result.exit_code == 2
    assert "not a CSV text file" in result.stderr


def test_many_faults_are_told_in_few_lines(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n" + "1,2,?\n" * 1000)
    result = run("track", "five_bar", "path.csv", "-o", "answers.csv")
    assert result.stderr.splitlines()[-1].endswith("and 990 more faults")
    assert len(result.stderr.splitlines()) == 11


def test_what_stood_in_the_output_stays_when_the_work_fails(
    run: Callable[..., Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    (tmp_path / "answers.csv").write_text("precious")

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pfabrik.cli.pathfile.write_track", interrupted)
    assert run("track", "five_bar", "path.csv", "-o", "answers.csv").exit_code == 130
    assert (tmp_path / "answers.csv").read_text() == "precious"
    assert set(os.listdir(tmp_path)) == {"path.csv", "answers.csv"}


@pytest.mark.parametrize("output", ["missing/answers.csv", ".", "path.csv/answers.csv"])
def test_an_unwritable_output_is_told_by_its_name(run: Callable[..., Result], tmp_path: Path, output: str) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    result = run("track", "five_bar", "path.csv", "-o", output)
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert ".part" not in result.stderr


def test_an_output_that_is_a_link_or_a_device_stays_one(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    (tmp_path / "link.csv").symlink_to("answers.csv")
    assert run("track", "five_bar", "path.csv", "-o", "link.csv").exit_code == 0
    assert (tmp_path / "link.csv").is_symlink()
    assert len(rows_of(tmp_path / "answers.csv")) == 1
    assert run("track", "five_bar", "path.csv", "-o", os.devnull).exit_code == 0
    assert not Path(os.devnull).is_file()


# Wrong input


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (["chek", "stewart"], "did you mean 'check'"),
        (["info", "stewrt"], "did you mean 'stewart'"),
        (["info", "nowhere/machine.toml"], "machine.toml"),
        (["info", "."], "."),
        (["info", ""], ""),
        (["info", "a\nb"], ""),
        (["ik", "stewart"], "no target"),
        (["ik", "stewart", "--position", "nan", "0", "0"], "finite"),
        (["ik", "stewart", "--position", "0", "0", "-inf"], "finite"),
        (["ik", "stewart", *WITHIN_REACH, "--rpy", "0", "nan", "0"], "finite"),
        (["ik", "stewart", *WITHIN_REACH, "--hold", "both"], "orientation"),
        (["track", "stewart", "missing.csv", "-o", "out.csv"], "missing.csv"),
        (["demo", "--steps", "2"], "steps"),
        (["--wrong"], "--wrong"),
    ],
)
def test_wrong_input_is_told_on_stderr_with_exit_code_2(
    run: Callable[..., Result], tmp_path: Path, line: list[str], told: str
) -> None:
    result = run(*line)
    assert result.exit_code == 2
    assert told in result.stderr
    assert all(text.startswith("pfabrik: ") for text in result.stderr.splitlines())
    assert result.stdout == ""
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("position", [(1e300, 0, 0), (0, 0, -1e6), (0, 0, 0), (5e-324, 0, 0)])
@pytest.mark.parametrize("name", pf.catalog())
def test_any_finite_target_gets_an_answer(run: Callable[..., Result], name: str, position: tuple[float, ...]) -> None:
    result = run("ik", name, "--position", *position, "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["status"] in ("PROJECTED", "FAILED")


# Leaving


def test_a_reader_who_has_gone_is_no_error_worth_words() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    process = in_process("catalog", stdout=writer)
    os.close(writer)
    assert process.communicate(timeout=60)[1] == ""
    assert process.returncode == 141


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_told_in_one_line() -> None:
    with open("/dev/full", "w") as full:
        process = in_process("catalog", stdout=full)
        assert process.communicate(timeout=60)[1] == "pfabrik: No space left on device\n"
    assert process.returncode == 2


@pytest.mark.slow
def test_an_interrupted_demo_leaves_nothing_behind(tmp_path: Path) -> None:
    process = in_process("demo", "--steps", 2_000_000, "--out", tmp_path / "out", stdout=subprocess.PIPE)
    deadline = time.monotonic() + 60
    while not os.listdir(tmp_path) and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert "Traceback" not in process.communicate(timeout=120)[1]
    # a shell calls both 130; Python sends itself the signal again if it arrived in code that it was just generating
    assert process.returncode in (130, -signal.SIGINT)
    assert os.listdir(tmp_path) == []


# The demo


@pytest.mark.slow
def test_demo_writes_a_picture_and_a_table_for_each_machine(run: Callable[..., Result], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    result = run("demo", "--quick", "--out", "pictures")
    assert result.exit_code == 0
    assert {path.suffix for path in (tmp_path / "pictures").iterdir()} == {".png", ".csv"}
    for path in (tmp_path / "pictures").glob("*.csv"):
        statuses = {row["status"] for row in rows_of(path)}
        assert statuses == {"REACHED", "PROJECTED"}, path.name
        assert path.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


def test_demo_says_how_to_get_what_it_needs(run: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pfabrik.cli.demo.find_spec", lambda _: None)
    result = run("demo")
    assert result.exit_code == 2
    assert "pip install 'pfabrik[view]'" in result.stderr


def test_demo_refuses_a_file_where_its_folder_should_be(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "out").write_text("precious")
    assert run("demo", "--quick").exit_code == 2
    assert (tmp_path / "out").read_text() == "precious"
