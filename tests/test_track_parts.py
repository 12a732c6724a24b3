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
from click.testing import Result

import pfabrik as pf
from command import pfabrik
from pfabrik.capabilities.paths.follow import follow_parts
from pfabrik.capabilities.paths.path import Path as Targets
from pfabrik.machine import files
from test_track import CIRCLES, arm, circle, turned_by

Run = Callable[..., Result]


# --- parts -----------------------------------------------------------------------------------------------------------


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
    times, limits = 0.1 * np.arange(len(points)) ** 1.5, dict.fromkeys(mechanism.actuator_names, 0.5)
    whole = pf.track(mechanism, targets, times=times, speed_limits=limits)
    blocks = in_parts(Targets.of(targets)._replace(times=times), *bounds)
    parts = list(follow_parts(mechanism, blocks, speed_limits=limits))
    size = mechanism.characteristic_length
    for field, unit in (("actuators", size), ("jumps", 1), ("status", 1), ("speeds", size), ("accelerations", size)):
        expected = np.asarray(getattr(whole, field), float)
        joined = np.concatenate([np.asarray(getattr(part.track, field), float)[part.first :] for part in parts])
        np.testing.assert_allclose(joined / unit, expected / unit, rtol=0, atol=2e-6, err_msg=field)
    assert [names for part in parts for names in (part.track.too_fast or [])[part.first :]] == whole.too_fast


def test_turns_are_counted_on_over_parts() -> None:
    mechanism, targets = arm(None), np.tile(np.eye(4), (90, 1, 1))
    targets[:, :3, 3] = turned_by(np.linspace(0.0, 6.0 * np.pi, 90))
    *_, last = follow_parts(mechanism, in_parts(Targets.of(targets), 10, 31, 62))
    np.testing.assert_allclose(last.track.actuators[-1], (6.0 * np.pi, 0.0), atol=1e-7)


def test_no_more_than_a_part_is_held() -> None:
    mechanism, seen = pf.load("linear_delta"), []
    path = Targets.of(np.repeat(mechanism.home_pose[None], 60, axis=0))
    gc.freeze()  # what other tests left is not looked through at each collection
    for part in follow_parts(mechanism, in_parts(path, *range(10, 60, 10))):
        np.testing.assert_array_less(0.0, pf.margins(part.track)["A1", "max"])
        seen += [weakref.ref(part.track), weakref.ref(part.track._rows.poses)]
        gc.collect()
        assert sum(each() is not None for each in seen) <= 4
    gc.unfreeze()


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


# --- at the command line ---------------------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run a command line in a folder of its own, with parts of 16 steps and paths of at most 200."""
    monkeypatch.chdir(tmp_path)
    for module in ("csv_table", "read_path", "sampling"):
        monkeypatch.setattr(f"pfabrik.capabilities.paths.{module}.BLOCK", 16)
    for module in ("read_path", "sampling"):
        monkeypatch.setattr(f"pfabrik.capabilities.paths.{module}.MOST_STEPS", 200)
    monkeypatch.setattr(importlib.import_module("pfabrik.cli.track"), "MOST_TARGETS", 200)

    return lambda *line, given=None: pfabrik(line, given)


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def column(rows: list[dict[str, str]], name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in rows])


def test_a_table_goes_through_with_times_speeds_room_and_tilt(run: Run, tmp_path: Path) -> None:
    lines = [f"first {k},{0.4 * k:.6g},{5 + 0.1 * k},{3 * np.sin(0.2 * k):.6g},{0.02 * k:.4g}" for k in range(40)]
    (tmp_path / "path.csv").write_text("label,x,z,y,t\n" + "\n".join(lines) + "\n")
    result = run("track", "linear_delta", "path.csv", "-o", "-")
    rows, mechanism = rows_of(result.stdout), pf.load("linear_delta")
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
    x, y, z = mechanism.home_pose[:3, 3]
    targets = [(x, y, z), (x + 0.1 * mechanism.characteristic_length, y, z)]
    (tmp_path / "path.csv").write_text("x,y,z\n" + "".join(f"{a},{b},{c}\n" for a, b, c in targets))
    rows = rows_of(run("track", name, "path.csv", "-o", "-").stdout)
    followed, worst = pf.track(mechanism, targets), np.zeros(2)
    for joint in (each.name for each in mechanism.joints if each.name.startswith("B")):
        foot, head = followed.points[joint], followed.points[joint.replace("B", "C", 1)]
        way = np.array([0.0, 0.0, 1.0])
        if driven == "R":
            crank = mechanism.joint(joint.replace("B", "A", 1))
            way = np.cross(crank.axis, foot - crank.at)
        cosine = np.abs(((head - foot) * way).sum(axis=1)) / np.linalg.norm(head - foot, axis=1)
        worst = np.maximum(worst, np.degrees(np.arccos(cosine / np.linalg.norm(way, axis=-1))))
    np.testing.assert_allclose(column(rows, "tilt_deg"), worst, atol=1e-6)
    assert rows[1]["tilt_of"].startswith("rod")


def test_machines_without_rods_have_no_tilt_and_failures_are_named(run: Run, tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,0,190\n0,0,300\n0,0,190\n")
    result = run("track", "stewart", "path.csv", "-o", "-")
    assert not {"tilt_deg", "t", "speed_BL1"} & set(rows_of(result.stdout)[0])
    assert "tilt" not in result.stderr
    assert "2 reached, 1 projected; first at target 2 (line 3); farthest from its target 27.2 mm" in result.stderr
    assert "worst step: target 2 (line 3), margin" in result.stderr
    told = json.loads(run("track", "stewart", "path.csv", "--json").stdout)
    margins = pf.margins(pf.track(pf.load("stewart"), [(0, 0, 190), (0, 0, 300), (0, 0, 190)]))
    assert told["tilt"] is None
    assert told["margin"] == pytest.approx(np.min(list(margins.values()), axis=0), abs=1e-12)


def test_gcode_goes_through_a_pipe_at_a_rate(run: Run) -> None:
    text = "; by hand, with a comma\nG21\nG0 X10 Y0 Z5\nG1 X20 F600\nG2 X0 Y-20 I-20 J0\n"
    result = run("track", "linear_delta", "-", "-o", "-", "--rate", 20, "--rapid", 100, given=text)
    rows, approach = rows_of(result.stdout), np.hypot(10.0, 5.0) / 100.0
    times, radius = column(rows, "t"), np.hypot(column(rows, "target_x"), column(rows, "target_y"))
    assert result.exit_code == 0
    np.testing.assert_allclose(np.diff(times)[:-1], 0.05, atol=1e-9)
    assert times[-1] == pytest.approx(approach + 1.0 + 0.5 * np.pi * 20.0 / 10.0, rel=1e-4)
    np.testing.assert_allclose(radius[times > approach + 1.0], 20.0, atol=2e-2)
    without = run("track", "linear_delta", "-", "-o", "-", given=text)
    assert [row["t"] != "" for row in rows_of(without.stdout)][:3] == [True, False, False]
    refused = run("track", "linear_delta", "-", "-o", "-", "--rate", 20, given=text)
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "line 3: a step without a time" in refused.stderr


def test_the_speeds_of_the_file_count_where_the_path_has_times(run: Run, tmp_path: Path) -> None:
    text = files.dumps(pf.load("linear_delta")).replace("actuated = true", "actuated = true\nmax_speed = 20")
    (tmp_path / "slow.toml").write_text(text)
    (tmp_path / "path.csv").write_text("x,y,z,feed\n0,0,5,10\n0,0,15,25\n0,0,10,15\n")
    result = run("track", "slow.toml", "path.csv", "-o", "answers.csv")
    assert result.exit_code == 1
    assert [row["too_fast"] for row in rows_of((tmp_path / "answers.csv").read_text())] == ["", "A1; A2; A3", ""]
    assert "A1 too fast: 25 mm/s (target 2)" in result.stdout


BAD_LINES = {
    "1,2,nan": "line 152: column 'z': found 'nan'",
    "\0": "line 152: no text",
    "1,2": "line 152: found 2 cells",
    "1,2,5\n" * 10_000: "more than 200 targets",
}


@pytest.mark.parametrize("to", ["answers.csv", "-"])
@pytest.mark.parametrize(("bad", "told"), BAD_LINES.items(), ids=["a number", "no text", "a cell", "endless"])
def test_what_is_wrong_far_down_in_a_path_leaves_nothing_behind(
    run: Run, tmp_path: Path, bad: str, told: str, to: str
) -> None:
    """From a file; what comes through a pipe is answered as it comes, but a file that was begun does not stay."""
    text = "x,y,z\n" + "1,2,5\n" * 150 + bad + "\n"
    (tmp_path / "path.csv").write_text(text)
    for name in ("path.csv", "-") if to == "answers.csv" else ("path.csv",):
        result = run("track", "linear_delta", name, "-o", to, given=text)
        assert (result.exit_code, result.stdout) == (2, "")
        assert told in result.stderr
        assert result.stderr.count("\n") == 1
        assert os.listdir(tmp_path) == ["path.csv"]


def test_a_path_is_summed_up_where_no_answers_are_wanted(run: Run, tmp_path: Path) -> None:
    lines = ["START_PRINT", "G1 Z10 F3000", *(f"G1 X{k} Y0" for k in range(0, 240, 8)), "G29", "G1 X230"]
    (tmp_path / "part.gcode").write_text("\n".join(lines))
    result = run("track", "linear_delta", "part.gcode")
    answers = pf.track(pf.load("linear_delta"), pf.read_path(tmp_path / "part.gcode", pf.load("linear_delta")).targets)
    off = np.flatnonzero(answers.status != pf.Status.REACHED)
    assert (result.exit_code, os.listdir(tmp_path)) == (1, ["part.gcode"])
    counts = f"{len(answers) - len(off)} reached, {len(off)} projected; first at target {off[0] + 1} (line "
    assert counts in result.stdout
    unread = "passed over: START_PRINT (line 1), G29 (line 33): levelling and macros are not modelled"
    assert f"note: {unread}" in result.stderr
    assert "worst step: " in result.stderr
