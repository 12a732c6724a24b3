"""A machine as one page: its answers are the library's, and it needs nothing but a browser."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import actuator_units
from oracles import no_poses
from pfabrik.cli import main
from pfabrik.common.memory_image import packed
from pfabrik.common.rotations import from_rotvec
from pfabrik.errors import InvalidArgument
from pfabrik.machine.model import model_of
from pfabrik.view.page.export_web import FOLDER, SCRIPTS, web_page
from pfabrik.view.page.page_data import page_data
from test_streams import smooth

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="needs Node.js, which is not installed")

N, MOST = 12, 400
NEAR = 1e-6
"""Difference of poses that two searches may end at [L, or entries of rotations]: the sines of JavaScript differ in the
last digits, which far poses at flat optima show a thousandfold."""

NEAR_DRIVES = 1e-5
"""Difference of actuators [L or rad], which is as large as that of poses times their slopes."""

NEAR_RATIO = 1e-4
"""Relative difference of measures of singularity: a page takes differences of answers."""

AT_EDGE = 1e-4
"""Difference of travel along an edge where links are stretched out [L]: the library goes beyond it by the root of the
tolerance of a pose."""

NO_ICON = '<link rel="icon" href="data:,">'
LARGEST = 260_000
"""Of a page [bytes]."""


LONG = ("panda", "snake60")
"""Machines of the catalogue that have no closed form."""

FEW = ("stewart", "delta", "canfield", "nrpm", "serial_arm", "prs")
MACHINES = [name for name in pf.catalog() if name not in LONG]
MANY = [name for name in MACHINES if name not in FEW]


def targets_of(machine: pf.Mechanism, n: int, seed: int) -> Any:
    """Poses about home, near and far, within the freedoms that the machine has."""
    rng, task, length = np.random.default_rng(seed), model_of(machine).task, machine.characteristic_length
    data = page_data(machine)["task"]
    targets = np.repeat(machine.home_pose[None], n, axis=0)
    moves = np.isin(np.arange(3), data["slides"])
    turns = np.isin(np.arange(3), data["turns"]) if task.rotations else np.zeros(3, bool)
    targets[:, :3, 3] += rng.normal(size=(n, 3)) * moves * length * rng.choice([0.03, 0.1, 0.5], (n, 1))
    rotations = from_rotvec(rng.normal(size=(n, 3)) * turns * rng.choice([0.03, 0.15, 0.5], (n, 1)))
    targets[:, :3, :3] = rotations @ targets[:, :3, :3]
    return targets


PRINTER = """
[printer]
kinematics: delta
delta_radius: 148
minimum_z_position: -5
[stepper_a]
arm_length: 330
position_endstop: 300
[stepper_b]
[stepper_c]
"""


@cache
def loaded(name: str) -> pf.Mechanism:
    """A machine of the catalogue, or the printer, whose positions end where rods are level."""
    if name != "printer":
        return pf.load(name)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "printer.cfg"
        file.write_text(PRINTER, encoding="utf-8")
        return pf.load(file)


def edges_of(machine: pf.Mechanism) -> Any:
    """Targets far beyond reach, along the axes of the task, both ways."""
    length, home = machine.characteristic_length, machine.home_pose
    slides = page_data(machine)["task"]["slides"]
    targets = np.repeat(home[None], 2 * len(slides), axis=0)
    for k, axis in enumerate(slides):
        for sign in (0, 1):
            targets[2 * k + sign, axis, 3] += (2 * sign - 1) * 3.0 * length
    return targets


@cache
def asked(name: str) -> tuple[Any, Any, Any]:
    """Targets, a path and actuator values."""
    machine = loaded(name)
    targets, path = targets_of(machine, N, 7), targets_of(machine, N // 2, 8)
    lengths = [machine.characteristic_length if drive.kind == "length" else 1.0 for drive in machine.drives]
    near = pf.solve_ik(machine, targets).actuators
    values = near + 0.05 * np.random.default_rng(9).normal(size=near.shape) * lengths
    return targets, path, values


@cache
def answered(name: str) -> dict[str, Any]:
    """What the page of a machine answers, in Node.js."""
    targets, path, values = asked(name)
    spoiled = no_poses(loaded(name).home_pose)
    return ask(
        name,
        targets,
        path=path.reshape(-1, 16).tolist(),
        values=values.tolist(),
        link=link_to(path[0]),
        edges=edges_of(loaded(name)).reshape(-1, 16).tolist(),
        spoiled=np.where(np.isnan(spoiled), None, spoiled).reshape(-1, 16).tolist(),
    )


def ask(name: str, targets: Any, **more: Any) -> dict[str, Any]:
    """What the page of a machine answers to targets, and to more."""
    question = {
        "kernels": packed((FOLDER / "kernels.wasm").read_bytes()),
        "machine": page_data(loaded(name)),
        "targets": targets.reshape(-1, 16).tolist(),
        "listed": targets_of(loaded(name), 1, 5).ravel().tolist(),
        "link": link_to(loaded(name).home_pose),
        **{what: [] for what in ("path", "values", "edges", "spoiled", "stream")},
        **more,
    }
    scripts = [str(FOLDER / "web" / f"{each}.js") for each in SCRIPTS[: SCRIPTS.index("session") + 1]]
    text = re.sub(r"\bInfinity\b", "1e999", json.dumps(question))
    command = [str(NODE), str(Path(__file__).with_name("page_in_node.js")), *scripts]
    ran = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return dict(json.loads(ran.stdout))


def link_to(pose: Any) -> str:
    """The part of an address that asks for a pose."""
    angles = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz", degrees=True)
    return "#p=" + ",".join(map(repr, [*pose[:3, 3].tolist(), *angles.tolist()]))


def assert_same(machine: pf.Mechanism, answers: list[dict[str, Any]], expected: pf.Solution) -> None:
    """Statuses equal, poses within `NEAR`, actuators within `NEAR_DRIVES`."""
    assert [answer["status"] for answer in answers] == np.atleast_1d(expected.status).astype(int).tolist()
    poses = np.array([answer["pose"] for answer in answers]).reshape(-1, 4, 4)
    scale = np.ones((4, 4))
    scale[:3, 3] = machine.characteristic_length
    assert (np.abs(poses - expected.pose) / scale).max() <= NEAR
    given = [each or [np.nan] * len(machine.drives) for each in (answer["actuators"] for answer in answers)]
    off = np.abs(np.array(given) - expected.actuators) / actuator_units(machine)
    assert np.nanmax(off, initial=0.0) <= NEAR_DRIVES


def assert_limits(answers: list[dict[str, Any]], expected: pf.Solution) -> None:
    """What holds projections back is named as in the library, but for stretched links: pages name no joint of these."""
    for answer, limits in zip(answers, expected.active_limits, strict=True):
        if answer["status"] == pf.Status.PROJECTED:
            named = [f"{limit.joint} {limit.bound}" for limit in limits if limit.bound != "stretched"]
            assert answer["limits"] == named


@needs_node
@pytest.mark.parametrize(
    "name", ["nrpm", *(pytest.param(name, marks=pytest.mark.campaign) for name in MACHINES if name != "nrpm")]
)
def test_pages_answer_many_targets_as_the_library_does(name: str) -> None:
    """Arms of redundant machines too: they rest where their start has them."""
    targets = targets_of(loaded(name), MOST, 11)
    expected, told = pf.solve_ik(loaded(name), targets), ask(name, targets)["inverse"]
    assert_same(loaded(name), told, expected)
    assert_limits(told, expected)


@needs_node
@pytest.mark.parametrize("name", [*FEW, *(pytest.param(name, marks=pytest.mark.campaign) for name in MANY)])
def test_a_page_answers_as_the_library_does(name: str) -> None:
    """Targets, with the limits that are reached; actuators; a drag in one mode; travel; nearness to singularities."""
    machine, told, (targets, path, values) = pf.load(name), answered(name), asked(name)
    expected = pf.solve_ik(machine, targets)
    assert_same(machine, told["inverse"], expected)
    assert_limits(told["inverse"], expected)
    assert_same(machine, told["forward"], pf.solve_fk(machine, values))
    home = last = pf.solve_ik(machine, machine.home_pose)
    reached = [home]
    for answer, target, has_jumped in zip(told["followed"], path, told["jumped"], strict=True):
        last = pf.solve_ik(machine, target, start=last)
        assert_same(machine, [answer], last)
        assert has_jumped or not last.jumped
        reached += [last] if last else []
    for measures, there in zip(told["singular"], reached, strict=True):
        expected = pf.singularity(there)
        if measures is not None:  # as for redundant machines
            assert [measures["serial"], measures["parallel"]] == pytest.approx(
                [expected.serial, expected.parallel], rel=NEAR_RATIO
            )
    for reach in told["travel"]:
        axis = reach["sign"] * np.eye(3)[reach["axis"]]
        distance = pf.travel(home, **{reach["kind"]: axis})[0].distance
        found = np.inf if reach["distance"] is None else reach["distance"]
        assert found == pytest.approx(distance, rel=1e-6, abs=1e-6 * machine.characteristic_length)
    # what is no pose is no pose with a start and without, also in what the task leaves out
    assert {status for statuses in told["spoiled"] for status in statuses} == {pf.Status.INVALID}
    # a link keeps the pose, and steps are undone
    steps, scale = told["steps"], max(machine.characteristic_length, 1.0)
    assert np.abs(np.subtract(steps["asked"], steps["kept"])).max() <= NEAR * scale
    assert steps["redone"] == steps["asked"]
    assert np.abs(np.reshape(steps["undone"], (4, 4)) - home.pose).max() <= NEAR * scale


@needs_node
@pytest.mark.parametrize("name", ["printer", "five_bar", "delta"])
def test_at_the_edge_of_reach_a_page_travels_as_the_library_does(name: str) -> None:
    """Also along an edge where links are stretched out, and rounding decides if legs reach it."""
    machine = loaded(name)
    length, home = machine.characteristic_length, pf.solve_ik(machine, machine.home_pose)
    for answer, target in zip(answered(name)["edges"], edges_of(machine), strict=True):
        expected = pf.solve_ik(machine, target, start=home)
        assert_same(machine, [answer], expected)
        for reach in answer["travel"]:
            axis = reach["sign"] * np.eye(3)[reach["axis"]]
            distance = pf.travel(expected, **{reach["kind"]: axis})[0].distance
            found = np.inf if reach["distance"] is None else reach["distance"]
            assert found == pytest.approx(distance, rel=1e-6, abs=AT_EDGE * length)
        serial = pf.singularity(expected).serial
        assert answer["singular"]["serial"] == pytest.approx(serial, rel=NEAR_RATIO, abs=NEAR_RATIO)


@needs_node
@pytest.mark.parametrize("name", ["stewart", "delta", "rps", "ankle_rss", "nrpm"])
def test_a_page_drives_a_machine_along_a_stream_as_live_does(name: str) -> None:
    """In and out of reach, then at rest: statuses, drives, and at rest the limits that hold it."""
    machine = loaded(name)
    poses = smooth(machine, 300)
    stream = np.concatenate([poses, np.repeat(poses[-1:], 500, axis=0)])
    speeds = np.full(len(machine.drives), 0.5) * actuator_units(machine)
    live = pf.Live(machine, speed=dict(zip(machine.actuator_names, speeds.tolist(), strict=True)))
    track = live.follow(stream, sample_time=0.01)
    told = ask(name, targets_of(machine, 0, 0), stream=stream.reshape(-1, 16).tolist(), speeds=speeds.tolist())["ticks"]
    assert [answer["status"] for answer in told] == track.status.astype(int).tolist()
    off = np.abs([answer["actuators"] for answer in told] - track.actuators) / actuator_units(machine)
    assert off.max() <= NEAR_DRIVES
    assert not told[-1]["isMoving"]
    assert told[-1]["status"] == pf.Status.PROJECTED
    held = {f"{limit['joint']} {limit['bound']}" for limit in told[-1]["limits"]}
    assert held == {name for name in live.holding if not name.endswith(" stretched")}  # pages name no joint of these


@needs_node
@pytest.mark.parametrize("name", ["five_bar", "rrr", "prs"])
def test_modes_keep_the_numbers_of_the_library_s_list_from_each_of_them(name: str) -> None:
    machine = loaded(name)
    expected = pf.working_modes(machine, targets_of(machine, 1, 5)[0])
    for modes in answered(name)["modes"]:
        assert [mode["status"] for mode in modes] == [int(mode.status) for mode in expected]
        for mode, other in zip(modes, expected, strict=True):
            assert np.cos(mode["actuators"]) == pytest.approx(np.cos(other.actuators), abs=NEAR)


@needs_node
def test_the_border_of_a_slice_is_as_round_as_the_workspace() -> None:
    """Of a ring over a grid of 40 cells: each point of the border is on a circle to a 100th of a cell."""
    scripts = [(FOLDER / "web" / f"{name}.js").read_text(encoding="utf-8") for name in ("vectors", "slice")]
    ask = """
    const ring = (x, y) => Math.hypot(x - 0.31, y + 0.17) < 1.5 && Math.hypot(x - 0.31, y + 0.17) > 0.6;
    const { area, border } = areaOf(ring, [[-2, 2], [-2, 2]], 41, 0);
    console.log(JSON.stringify([area, border]));
    """
    ran = subprocess.run([str(NODE), "-"], input="\n".join([*scripts, ask]), capture_output=True, text=True, check=True)
    area, border = (np.reshape(each, (-1, 3, 6))[..., :2] for each in json.loads(ran.stdout))
    far = np.linalg.norm(border.reshape(-1, 2) - [0.31, -0.17], axis=1)
    assert np.minimum(np.abs(far - 1.5), np.abs(far - 0.6)).max() < 1e-3
    (u, v) = np.moveaxis(np.diff(area, axis=1), 1, 0)
    spanned = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum()
    assert spanned == pytest.approx(np.pi * (1.5**2 - 0.6**2), rel=3e-3)


@pytest.mark.parametrize("name", MACHINES)
def test_a_page_is_small_and_asks_for_nothing(name: str) -> None:
    """Not for an icon either, for it says that it has an empty one."""
    text = web_page(pf.load(name))
    assert len(text.encode()) <= LARGEST
    assert text.count(NO_ICON) == 1
    text = text.replace(NO_ICON, "")
    assert not re.search(r"https?://|\bfetch\(|XMLHttpRequest|\bimport\(|<link|@import|\bsrc=", text)


@pytest.mark.parametrize("name", LONG)
def test_machines_without_closed_forms_are_refused_with_the_reason(name: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidArgument, match="closed forms") as refused:
        pf.export_web(pf.load(name), tmp_path / "machine.html")
    assert "sub-chain" in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_the_command_writes_a_page(tmp_path: Path) -> None:
    file = tmp_path / "machine.html"
    written = CliRunner().invoke(main, ["export", "stewart", "--web", str(file)])
    assert written.exit_code == 0
    assert file.read_text(encoding="utf-8") == web_page(pf.load("stewart"))
    refused = CliRunner().invoke(main, ["export", "panda", "--web", str(tmp_path / "panda.html")])
    assert refused.exit_code == 2
    assert "closed forms" in refused.stderr


def test_a_name_cannot_end_the_script() -> None:
    text = web_page(dataclasses.replace(pf.load("five_bar"), name="</script><b>5 bars & more"))
    assert "</script><b>" not in text
    assert "&lt;/script&gt;&lt;b&gt;5 bars &amp; more" in text


@pytest.mark.skipif(not (shutil.which("clang") and shutil.which("wasm-ld")), reason="needs clang and wasm-ld")
def test_the_kernels_of_pages_are_those_of_today() -> None:
    command = [sys.executable, "tools/kernels/compile_web.py", "--check"]
    ran = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr  # run: make web
