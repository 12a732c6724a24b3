"""Paths followed part by part: the same answers as in one go, in bounded memory, with what a machine has left."""

from __future__ import annotations

import csv
import gc
import importlib
import io
import json
import os
import subprocess
import sys
import weakref
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import pfabrik as pf
from pfabrik.cli import main
from pfabrik.paths.follow import follow_parts
from pfabrik.paths.path import Path as Targets
from test_track import CIRCLES, arm, circle

Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run a command line in a folder of its own, with parts of 16 steps and paths of at most 200."""
    monkeypatch.chdir(tmp_path)
    for module in ("csv_table", "read_path", "sampling"):
        monkeypatch.setattr(f"pfabrik.paths.{module}.BLOCK", 16)
    for module in ("read_path", "sampling"):
        monkeypatch.setattr(f"pfabrik.paths.{module}.MOST_STEPS", 200)
    monkeypatch.setattr(importlib.import_module("pfabrik.cli.track"), "MOST_TARGETS", 200)

    def run(*line: object, given: str | None = None) -> Result:
        result = CliRunner().invoke(main, [str(word) for word in line], input=given)
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        return result

    return run


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def column(rows: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in rows])


# Parts


def in_parts(path: Targets, *bounds: int) -> Iterator[Targets]:
    for begin, end in pairwise([0, *bounds, len(path.lines)]):
        yield path.after(begin)._replace(
            targets=path.targets[begin:end],
            times=None if path.times is None else path.times[begin:end],
            feeds=path.feeds[begin:end],
            lines=path.lines[begin:end],
        )


def past_a_hole() -> np.ndarray:
    """Across the hole in the workspace of a two-link arm, where its links are stretched out, or folded."""
    x = np.linspace(3.0, -3.0, 41)
    return np.stack([x, 0.0 * x + 0.1, 0.0 * x], axis=1)


@pytest.mark.parametrize("name", ["five_bar", "stewart", "nrpm", "arm"])
@pytest.mark.parametrize("bounds", [(1, 2, 9, 25), (20,)])
def test_answers_in_parts_are_those_of_the_whole(name: str, bounds: tuple[int, ...]) -> None:
    """Half of these targets are out of reach; one of the paths has a leap."""
    mechanism = arm(None) if name == "arm" else pf.load(name)
    points = past_a_hole() if name == "arm" else circle(*CIRCLES[name], steps=40)
    targets = np.tile(mechanism.home_pose, (len(points), 1, 1))
    targets[:, :3, 3] = points
    times = 0.1 * np.arange(len(points)) ** 1.5
    whole = pf.track(mechanism, targets, times=times, speed_limits=0.5)
    parts = list(
        follow_parts(
            mechanism,
            in_parts(Targets.of(targets)._replace(times=times), *bounds),
            speed_limits=dict.fromkeys(mechanism.actuator_names, 0.5),
        )
    )
    size = mechanism.characteristic_length
    for field, scale in (
        ("actuators", size),
        ("jumps", 1.0),
        ("status", 1.0),
        ("speeds", size),
        ("accelerations", size),
    ):
        expected = np.asarray(getattr(whole, field), float)
        found = np.concatenate([np.asarray(getattr(part.track, field), float)[part.first :] for part in parts])
        np.testing.assert_allclose(found / scale, expected / scale, rtol=0, atol=2e-6, err_msg=field)
    assert [names for part in parts for names in (part.track.too_fast or [])[part.first :]] == whole.too_fast


def test_turns_are_counted_on_over_parts() -> None:
    angle = np.linspace(0.0, 6.0 * np.pi, 90)
    mechanism = arm(None)
    points = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) * 3.6
    targets = np.tile(mechanism.home_pose, (90, 1, 1))
    targets[:, :3, 3] = points
    *_, last = follow_parts(mechanism, in_parts(Targets.of(targets), 10, 31, 62))
    whole = pf.track(mechanism, targets)
    np.testing.assert_allclose(last.track.actuators[-1], whole.actuators[-1], atol=1e-7)
    assert abs(whole.actuators[-1, 0]) > 4.0 * np.pi


@pytest.fixture
def only_new_garbage() -> Iterator[None]:
    """Keeps what other tests left from being looked through at each collection."""
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.mark.usefixtures("only_new_garbage")
def test_no_more_than_a_part_is_held() -> None:
    mechanism = pf.load("linear_delta")
    path = Targets.of(np.repeat(mechanism.home_pose[None], 60, axis=0))
    seen: list[weakref.ref[object]] = []
    for part in follow_parts(mechanism, in_parts(path, *range(10, 60, 10))):
        np.testing.assert_array_less(0.0, pf.margins(part.track)["A1", "max"])
        seen += [weakref.ref(part.track), weakref.ref(part.track._rows.poses)]
        gc.collect()
        assert sum(each() is not None for each in seen) <= 4


@pytest.mark.campaign
def test_a_million_steps_take_no_more_memory_than_ten_thousand(tmp_path: Path) -> None:
    peaks = []
    for count in (10_000, 1_000_000):
        x = 30.0 * np.cos(1e-3 * np.arange(count))
        (tmp_path / "path.csv").write_text("x,y,z\n" + "".join(f"{each:.6f},0,5\n" for each in x))
        command = [sys.executable, "-m", "pfabrik", "track", "linear_delta", "path.csv", "-o", "answers.csv"]
        with (tmp_path / "told").open("w") as told:
            process = subprocess.Popen(command, cwd=tmp_path, stdout=told, stderr=told)
            _, code, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(code)
        assert process.returncode == 0
        with (tmp_path / "answers.csv").open() as handle:
            assert sum(1 for _ in handle) == count + 1
        peaks.append(used.ru_maxrss)
    assert peaks[1] < 1.2 * peaks[0]


# At the command line


def test_a_table_goes_through_with_times_speeds_room_and_tilt(run: Run, tmp_path: Path) -> None:
    lines = [f"first {k},{0.4 * k:.6g},{5 + 0.1 * k},{3 * np.sin(0.2 * k):.6g},{0.02 * k:.4g}" for k in range(40)]
    (tmp_path / "path.csv").write_text("label,x,z,y,t\n" + "\n".join(lines) + "\n")
    result = run("track", "linear_delta", "path.csv", "-o", "-")
    rows = rows_of(result.stdout)
    mechanism = pf.load("linear_delta")
    path = pf.read_path(tmp_path / "path.csv", mechanism)
    followed = pf.track(mechanism, path.targets, times=path.times)
    assert [row["label"] for row in rows] == [f"first {k}" for k in range(40)]
    np.testing.assert_allclose(column(rows, "t"), 0.02 * np.arange(40))
    for number, name in enumerate(mechanism.actuator_names):
        values = column(rows, f"actuator_{name}")
        np.testing.assert_allclose(values, followed.actuators[:, number], atol=1e-9)
        np.testing.assert_allclose(column(rows, f"speed_{name}")[1:], np.abs(np.diff(values)) / 0.02, atol=1e-6)
        bends = np.diff(values, 2) / 0.02**2
        np.testing.assert_allclose(column(rows, f"acceleration_{name}")[2:], bends, atol=1e-3)
    least = min(pf.margins(followed).items(), key=lambda each: each[1][7])
    assert column(rows, "margin")[7] == pytest.approx(least[1][7])
    assert rows[7]["margin_of"] == " ".join(least[0])
    worst = int(column(rows, "margin").argmin())
    assert f"worst step: target {worst + 1} (line {worst + 2}), margin " in result.stderr
    assert "40 reached" in result.stderr


@pytest.mark.parametrize(("name", "driven"), [("linear_delta", "P"), ("servo_hexapod", "R")])
def test_rods_are_tilted_against_the_way_their_feet_are_moved(run: Run, tmp_path: Path, name: str, driven: str) -> None:
    """By the joints' centres: upright rails; cranks whose axes their own joints name."""
    mechanism = pf.load(name)
    size, (x, y, z) = mechanism.characteristic_length, mechanism.home_pose[:3, 3]
    (tmp_path / "path.csv").write_text("".join(["x,y,z\n", f"{x},{y},{z}\n", f"{x + 0.1 * size},{y},{z}\n"]))
    rows = rows_of(run("track", name, "path.csv", "-o", "-").stdout)
    followed = pf.track(mechanism, [[x, y, z], [x + 0.1 * size, y, z]])
    worst = np.zeros(2)
    for joint in mechanism.joints:
        if not joint.name.startswith("B"):
            continue
        foot, head = followed.points[joint.name], followed.points[joint.name.replace("B", "C", 1)]
        way = np.array([0.0, 0.0, 1.0])
        if driven == "R":
            crank = mechanism.joint(joint.name.replace("B", "A", 1))
            way = np.cross(crank.axis, foot - crank.at)
        cosine = np.abs(((head - foot) * way).sum(axis=1)) / np.linalg.norm(head - foot, axis=1)
        worst = np.maximum(worst, np.degrees(np.arccos(cosine / np.linalg.norm(way, axis=-1))))
    np.testing.assert_allclose(column(rows, "tilt_deg"), worst, atol=1e-6)
    assert rows[1]["tilt_of"].startswith("rod")


def test_machines_without_rods_have_no_tilt(run: Run, tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,0,190\n0,0,195\n")
    result = run("track", "stewart", "path.csv", "-o", "-")
    assert not {"tilt_deg", "t", "speed_BL1"} & set(rows_of(result.stdout)[0])
    assert "tilt" not in result.stderr
    told = json.loads(run("track", "stewart", "path.csv", "--json").stdout)
    assert told["tilt"] is None
    assert told["margin"] == pytest.approx(
        [
            min(each)
            for each in zip(*pf.margins(pf.track(pf.load("stewart"), [(0, 0, 190), (0, 0, 195)])).values(), strict=True)
        ]
    )


def test_gcode_goes_through_a_pipe_at_a_rate(run: Run) -> None:
    text = "; by hand, with a comma\nG21\nG0 X10 Y0 Z5\nG1 X20 F600\nG2 X0 Y-20 I-20 J0\n"
    result = run("track", "linear_delta", "-", "-o", "-", "--rate", 20, "--rapid", 100, given=text)
    rows = rows_of(result.stdout)
    assert result.exit_code == 0
    np.testing.assert_allclose(np.diff(column(rows, "t"))[:-1], 0.05, atol=1e-9)
    total = np.hypot(10.0, 5.0) / 100.0 + 1.0 + 0.5 * np.pi * 20.0 / 10.0
    assert column(rows, "t")[-1] == pytest.approx(total, rel=1e-4)
    x, y = column(rows, "target_x"), column(rows, "target_y")
    late = column(rows, "t") > np.hypot(10.0, 5.0) / 100.0 + 1.0
    np.testing.assert_allclose(np.hypot(x, y)[late], 20.0, atol=2e-2)
    without = run("track", "linear_delta", "-", "-o", "-", given=text)
    assert [row["t"] != "" for row in rows_of(without.stdout)][:3] == [True, False, False]
    refused = run("track", "linear_delta", "-", "-o", "-", "--rate", 20, given=text)
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "line 3: a step without a time" in refused.stderr


def test_the_speeds_of_the_file_count_where_the_path_has_times(run: Run, tmp_path: Path) -> None:
    text = pf.files.dumps(pf.load("linear_delta")).replace("actuated = true", "actuated = true\nmax_speed = 20")
    (tmp_path / "slow.toml").write_text(text)
    (tmp_path / "path.csv").write_text("x,y,z,feed\n0,0,5,\n".replace(",\n", ",10\n") + "0,0,15,25\n0,0,10,15\n")
    result = run("track", "slow.toml", "path.csv", "-o", "answers.csv")
    assert result.exit_code == 1
    assert [row["too_fast"] for row in rows_of((tmp_path / "answers.csv").read_text())] == ["", "A1; A2; A3", ""]
    assert "A1 too fast: 25 mm/s (target 2)" in result.stdout


@pytest.mark.parametrize("to", ["answers.csv", "-"])
@pytest.mark.parametrize(
    ("bad", "told"),
    [("1,2,nan", "line 152: column 'z': found 'nan'"), ("\0", "line 152: no text"), ("1,2", "line 152: found 2 cells")],
)
def test_what_is_wrong_far_down_in_a_file_leaves_nothing_behind(
    run: Run, tmp_path: Path, bad: str, told: str, to: str
) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n" + "1,2,5\n" * 150 + bad + "\n")
    result = run("track", "linear_delta", "path.csv", "-o", to)
    assert (result.exit_code, result.stdout) == (2, "")
    assert told in result.stderr
    assert result.stderr.count("\n") == 1
    assert os.listdir(tmp_path) == ["path.csv"]


def test_an_endless_path_ends(run: Run, tmp_path: Path) -> None:
    """What comes through a pipe is answered as it comes: a file that was begun does not stay."""
    text = "x,y,z\n" + "1,2,5\n" * 10_000
    result = run("track", "linear_delta", "-", "-o", "answers.csv", given=text)
    assert (result.exit_code, result.stdout, os.listdir(tmp_path)) == (2, "", [])
    assert "more than 200 targets" in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_path_is_summed_up_where_no_answers_are_wanted(run: Run, tmp_path: Path) -> None:
    lines = ["START_PRINT", "G1 Z10 F3000", *(f"G1 X{k} Y0" for k in range(0, 240, 8)), "G29", "G1 X230"]
    (tmp_path / "part.gcode").write_text("\n".join(lines))
    result = run("track", "linear_delta", "part.gcode")
    answers = pf.track(pf.load("linear_delta"), pf.read_path(tmp_path / "part.gcode", pf.load("linear_delta")).targets)
    off = np.flatnonzero(answers.status != pf.Status.REACHED)
    assert (result.exit_code, os.listdir(tmp_path)) == (1, ["part.gcode"])
    assert (
        f"{len(answers) - len(off)} reached, {len(off)} projected; first at target {off[0] + 1} (line " in result.stdout
    )
    assert (
        "note: passed over: START_PRINT (line 1), G29 (line 33): levelling and macros are not modelled" in result.stderr
    )
    assert "worst step: " in result.stderr


def test_failures_are_named(run: Run, tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,0,190\n0,0,300\n0,0,190\n")
    result = run("track", "stewart", "path.csv", "-o", "-")
    assert "2 reached, 1 projected; first at target 2 (line 3); farthest from its target 27.2 mm" in result.stderr
    assert "worst step: target 2 (line 3), margin" in result.stderr
