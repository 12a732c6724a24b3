"""The ROS 2 node of a platform, compiled against stubs of the documented interface: it answers as the library does."""

from __future__ import annotations

import ast
import json
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

import machines
import pfabrik as pf
from checks import actuator_units
from command import pfabrik
from exported import KEEP, STRICT, home_of
from pfabrik.errors import InvalidArgument, UnsupportedMechanism
from pfabrik.exchange.export.source import targets_around_home
from pfabrik.machine.files.units import metres_of
from test_export_clearance import hexapod
from test_streams import smooth

Array = np.ndarray
DATA = Path(__file__).parent / "data"
needs_compilers = pytest.mark.skipif(
    not (shutil.which("gcc") and shutil.which("g++")), reason="no compilers of C and C++ here: gcc, g++"
)
AT_ONCE = "out_of_reach=project"
FAR = "open_loop=true", "largest_step=0", AT_ONCE
"""Parameters with which targets anywhere are commanded at once, from home on."""

SURE = *FAR, "steps=200", "starts=24"
"""And the search finds what the library does."""

MACHINES = ("stewart", "linear_delta", "five_bar")
"""Struts between U and S; carriages with rods between balls, whose orientation is not set; a tip that is a joint."""

MORE = "delta", "serial_arm", "thick", "ucu"
OFTEN = [*MACHINES, *(pytest.param(name, marks=pytest.mark.campaign) for name in MORE)]

_FOLDER = TemporaryDirectory()


@cache
def machine(name: str) -> pf.Mechanism:
    """A machine of the tables, or a hexapod whose struts are kept apart."""
    return hexapod() if name == "thick" else machines.machine(name)


def package(name: str) -> Path:
    return pf.export_ros2_node(machine(name), Path(_FOLDER.name) / name / "rig_node")


@cache
def node(name: str) -> Path:
    """The program of a machine's node in the stubs, compiled without one warning."""
    source = package(name) / "src"
    program, stubs = source / "run", f"-I{DATA / 'ros2_stubs'}"
    commands = [
        ["gcc", "-std=c99", *STRICT, "-c", str(source / "rig_kinematics.c"), "-o", str(source / "c.o")],
        ["g++", "-std=c++17", *STRICT, stubs, f'-DNODE="{source / "rig_node.cpp"}"', str(DATA / "run_node.cpp"),
         str(source / "c.o"), "-o", str(program), "-lm"],
    ]  # fmt: skip
    for command in commands:
        run = subprocess.run(command, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
    return program


def answers(name: str, lines: list[str], *parameters: str) -> list[dict[str, Any]]:
    """What the node says to each line."""
    text = "\n".join(lines) + "\n"
    run = subprocess.run([str(node(name)), *parameters], input=text, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    return [json.loads(line) for line in run.stdout.splitlines()]


def line_of(target: Array, metres: float, frame: str = "base") -> str:
    numbers = [*target[:3, 3] * metres, *Rotation.from_matrix(target[:3, :3]).as_quat()]
    return " ".join([frame, *map(repr, map(float, numbers))])


def matrix(numbers: list[float], metres: float) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_quat(numbers[3:]).as_matrix(), np.array(numbers[:3]) / metres
    return T


def targets_of(mechanism: pf.Mechanism) -> Array:
    """A hundred targets around home, half of them mostly out of reach."""
    rng = np.random.default_rng(3)
    targets = targets_around_home(mechanism, 100, rng)
    targets[50:, :3, 3] += 0.6 * mechanism.characteristic_length * rng.uniform(-1.0, 1.0, (50, 3))
    return rng.permutation(targets)


class Urdf:
    """A description, and where its links are: by the pose of the end effector and the values of joints."""

    def __init__(self, text: str) -> None:
        self.root: Any = ET.fromstring(text)
        self.joints = list(self.root.iterfind("joint"))
        self.moving = [each for each in self.joints if each.get("type") not in ("fixed", "floating")]

    def places(self, base: str, tip: Array, values: dict[str, float]) -> dict[str, Array]:
        """The frame of every link, (4, 4) [m]."""
        frames, waiting = {base: np.eye(4)}, list(self.joints)
        while waiting:
            joint = next(each for each in waiting if each.find("parent").get("link") in frames)
            waiting.remove(joint)
            parent, child = (joint.find(end).get("link") for end in ("parent", "child"))
            assert child not in frames
            frames[child] = frames[parent] @ (tip if joint.get("type") == "floating" else self._step(joint, values))
        assert len(frames) == len(self.root.findall("link"))
        return frames

    @staticmethod
    def _step(joint: Any, values: dict[str, float]) -> Array:
        step, moved = np.eye(4), np.eye(4)
        xyz, rpy = (np.array(joint.find("origin").get(each).split(), float) for each in ("xyz", "rpy"))
        step[:3, :3], step[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), xyz
        if joint.get("type") != "fixed":
            along = values[joint.get("name")] * np.array(joint.find("axis").get("xyz").split(), float)
            if joint.get("type") == "prismatic":
                moved[:3, 3] = along
            else:
                moved[:3, :3] = Rotation.from_rotvec(along).as_matrix()
        return step @ moved


@needs_compilers
@pytest.mark.parametrize("name", OFTEN)
def test_a_node_answers_as_the_library_does_in_reach_and_out_of_it(name: str) -> None:
    """From its last answer, in one working mode; and measured actuators are where the pose is that they were for."""
    mechanism, metres = machine(name), metres_of(machine(name).length_unit)
    size, targets = mechanism.characteristic_length, targets_of(mechanism)
    units = np.where([drive.kind == "angle" for drive in mechanism.drives], 1.0, metres)
    lines = [line for each in targets for line in (line_of(each, metres, mechanism.base), "measure")]
    said = answers(name, lines, *SURE)
    start, reached = home_of(mechanism), []
    for target, answer, measured in zip(targets, said[::2], said[1::2], strict=True):
        expected = pf.solve_ik(mechanism, target, start=start, options=KEEP)
        start, report = expected.q, answer["rig: target"]
        assert report["message"].partition(":")[0] == expected.status.name
        assert report["level"] == int(not expected)
        for limit in expected.active_limits:  # of stretched legs one alone is named, of links the nearest two
            active, named = answer["rig: limits"]["message"], f"{limit.joint} {limit.bound} "
            of_links = limit.bound == "clearance" and " clearance " in active
            assert named in active or of_links or active.startswith("stretched: the leg of ")
        assert answer["rig: limits"]["level"] == int(answer["rig: limits"]["message"] != "none is active")
        far = float(report["distance from target [m]"]), float(report["rotation from target [rad]"])
        expected_far = expected.position_error * metres, expected.rotation_error
        np.testing.assert_allclose(far, expected_far, rtol=1e-5, atol=1e-6 * size * metres)
        difference = np.array(answer["command"]) / units - expected.actuators
        assert np.abs(difference / actuator_units(mechanism)).max() <= 1e-6  # where the price bends, F is flat beside
        for key in ("achieved", "tf"):
            difference = matrix(answer[key], metres) - expected.pose
            assert max(np.abs(difference[:3, 3]).max() / size, np.abs(difference[:3, :3]).max()) <= 1e-6
        if expected:  # at a dead point a pose has half its digits
            np.testing.assert_allclose(measured["pose"], answer["achieved"], atol=1e-8)
        assert answer["frame"] == mechanism.base and answer["child"] == mechanism.end_effector
        reached.append(bool(expected))
    assert 20 < sum(reached) < 95


@needs_compilers
@pytest.mark.parametrize("name", OFTEN)
def test_the_description_with_the_published_joints_is_the_machine(name: str) -> None:
    """The centres of joints, on both bodies that meet there, are those of the library's answer; loops are closed."""
    mechanism, metres = machine(name), metres_of(machine(name).length_unit)
    urdf, base = Urdf((package(name) / "urdf/rig.urdf").read_text()), mechanism.base
    homes = {each.name: each.home * (1.0 if each.kind == "angle" else metres) for each in mechanism.coordinates}
    tip = mechanism.home_pose.copy()
    tip[:3, 3] *= metres
    home = urdf.places(base, tip, dict.fromkeys((joint.get("name") for joint in urdf.moving), 0.0) | homes)
    for frame in home.values():
        np.testing.assert_allclose(frame[:3, :3], np.eye(3), atol=1e-12)
    said = answers(name, [line_of(target, metres, base) for target in targets_of(mechanism)[:40]], *SURE)
    reached = [answer for answer in said if answer["rig: target"]["message"] == "REACHED"]
    points = pf.solve_ik(mechanism, np.array([matrix(answer["tf"], metres) for answer in reached]), options=KEEP).points
    n_compared = 0
    for row, answer in enumerate(reached):
        values = dict(zip(answer["names"], answer["joints"], strict=True))
        at = urdf.places(base, matrix(answer["tf"], 1.0), values)
        for each in mechanism.joints:
            bodies = each.connects[:1] if each.type in ("prismatic", "cylindrical") else each.connects
            for body in {*bodies} & {*at} if each.at is not None else ():
                point = at[body][:3] @ np.append(np.array(each.at) * metres - home[body][:3, 3], 1.0)
                off = np.abs(point / metres - points[each.name][row]).max()
                assert off <= 1e-9 * mechanism.characteristic_length, (each.name, body)
                n_compared += 1
    assert n_compared >= 100
    coordinates = {each.name: each for each in mechanism.coordinates if each.joint.range is not None}
    for joint in urdf.moving:
        if (named := coordinates.get(joint.get("name"))) is not None:
            bounds = [float(joint.find("limit").get(end)) for end in ("lower", "upper")]
            unit = 1.0 if named.kind == "angle" else metres
            np.testing.assert_allclose(bounds, np.array(named.limits) * unit, rtol=1e-12)


@needs_compilers
def test_what_is_no_target_is_refused_and_out_of_reach_may_hold() -> None:
    """Neither is commanded, and both are said; what follows is answered as if they had not been."""
    mechanism, metres = machine("stewart"), 1e-3
    near, away = mechanism.home_pose.copy(), mechanism.home_pose.copy()
    near[0, 3] += 5.0
    away[2, 3] += 500.0
    good, far = line_of(near, metres), line_of(away, metres)
    bad = [good.replace("base", "world"), "base nan 0 0.2 0 0 0 1", "base 0 0 inf 0 0 0 1", "base 0 0 0.2 0 0 0 0"]
    bad += ["base 0 0 0.2 0 0 nan 1", "base 0 0 0.2 0 0 0 1.1"]
    said = answers("stewart", [*bad, far, good, "measure", far], *FAR, "out_of_reach=hold")
    for answer in said[: len(bad)]:
        assert answer["rig: target"]["message"].startswith("REFUSED: ") and answer["rig: target"]["level"] == 2
        assert not {"command", "achieved"} & {*answer}
    assert said[0]["rig: target"]["message"] == "REFUSED: found frame 'world'; expected 'base'"
    for held in (said[len(bad)], said[-1]):
        assert held["rig: target"]["message"].startswith("HELD: beyond a limit: joint B")
        assert not {"command", "achieved"} & {*held}
    (alone,) = answers("stewart", [good], *FAR)
    kept = said[len(bad) + 1]
    assert kept["rig: target"]["message"] == "REACHED" and kept["command"] == alone["command"]
    assert said[-1]["rig: target"]["REFUSED"] == "6" and said[-1]["rig: target"]["HELD"] == "2"
    assert said[-1]["tf"] == kept["achieved"] and said[-1]["rig: actuators"]["level"] == 0
    (measured,) = answers("stewart", ["measure"], "show=measured")
    assert measured["rig: actuators"]["message"] == "no position of BL1"
    for wrong, expected in (
        ("command=both", "expected one of array, joint_state"),
        ("show_rate=0", "show_rate: found 0; expected 0.001 to 1000"),
        ("largest_step=-1", "largest_step: found -1; expected 0 to 1e+06"),
        ("largest_step=nan", "largest_step: found nan"),
        ("states_timeout=-1", "states_timeout: found -1; expected 0 to 1e+06"),
        ("steps=0", "steps: found 0; expected 1 to 10000"),
        ("starts=-1", "starts: found -1; expected 0 to 10000"),
        ("starts=3000000000", "starts: found 3000000000"),
    ):
        run = subprocess.run([str(node("stewart")), wrong], capture_output=True, text=True)
        assert run.returncode == 2 and expected in run.stdout


@needs_compilers
@pytest.mark.parametrize("name", MACHINES)
def test_a_node_that_is_live_commands_what_live_does_at_each_tick(name: str) -> None:
    """In reach and out of it; a target that is no pose stops it, one in another frame is as if it had not been."""
    mechanism, metres = machine(name), metres_of(machine(name).length_unit)
    units = np.where([drive.kind == "angle" for drive in mechanism.drives], 1.0, metres)
    back = np.repeat(mechanism.home_pose[None], 60, axis=0)
    targets, size = np.concatenate([smooth(mechanism, 120), back]), mechanism.characteristic_length
    speeds = 0.4 * actuator_units(mechanism)
    live = pf.Live(mechanism, speed=dict(zip(mechanism.actuator_names, speeds.tolist(), strict=True)))
    lost, elsewhere = [f"{mechanism.base} nan 0 0 0 0 0 1"], [line_of(targets[-1], metres, "elsewhere")]
    lines = [line_of(each, metres, mechanism.base) for each in targets] + elsewhere + lost
    said = answers(name, lines, "open_loop=true", "rate=50", "speed=0.4")
    statuses = []
    for target, answer in zip([*targets, targets[-1]], said, strict=False):
        statuses.append(live.tick(target, 0.02))
        assert np.abs((np.array(answer["command"]) / units - live.actuators) / actuator_units(mechanism)).max() < 1e-7
        off = matrix(answer["achieved"], metres) - live.pose
        assert max(np.abs(off[:3, 3]).max() / size, np.abs(off[:3, :3]).max()) < 1e-7
        if answer is said[-2]:
            continue
        assert answer["rig: target"]["message"].partition(":")[0] == statuses[-1].name
        assert float(answer["rig: target"]["distance from target [m]"]) < 2.0 * live.lag * metres + 1e-9
    assert {*statuses} == {pf.Status.REACHED, pf.Status.PROJECTED}
    assert said[-2]["rig: target"]["REFUSED"] == "1"
    assert said[-1]["command"] == said[-2]["command"] and said[-1]["rig: target"]["message"].startswith("REFUSED")
    assert sum(int(said[-1]["rig: target"][each.name]) for each in {*statuses}) == len(targets)


@needs_compilers
def test_a_node_that_is_live_begins_where_the_machine_stands_and_waits_for_states_that_stop() -> None:
    mechanism, metres = machine("stewart"), 1e-3
    away, size = mechanism.home_pose.copy(), mechanism.characteristic_length
    away[2, 3] += 0.1 * size
    there = pf.solve_ik(mechanism, away).actuators * metres
    states, line = "states " + " ".join(map(repr, there.tolist())), line_of(mechanism.home_pose, metres)
    said = answers("stewart", [line, states, line, "wait 0.01", "wait 0.6", states, line], "speed=0.2")
    assert "command" not in said[0] and said[0]["rig: target"]["message"].startswith("REFUSED: no position of")
    step = 0.2 * size * metres * 0.01
    for first in (said[2], said[6]):
        assert 0.5 * step < np.abs(np.array(first["command"]) - there).max() <= step * (1.0 + 1e-9)
    assert np.abs(np.array(said[3]["command"]) - there).max() <= 2.0 * step * (1.0 + 1e-9)
    assert "command" not in said[4] and "command" not in said[5]
    longest = 0.28 * np.ones(6)  # beyond its range by a hair, as measured
    hair = "states " + " ".join(map(repr, (longest + 1e-7).tolist()))
    (_, begun) = answers("stewart", [hair, line], "speed=0.2")
    assert np.abs(np.array(begun["command"]) - longest).max() <= step * (1.0 + 1e-9)
    (_, refused) = answers("stewart", [hair, line], "speed=0.2", "largest_step=1e-9")
    assert "command" not in refused and "largest_step allows" in refused["rig: target"]["message"]


@needs_compilers
def test_actuators_may_be_measured_in_parts() -> None:
    """By several broadcasters on one topic: what one of them leaves out, or another machine's, is no fault."""
    mechanism = machine("stewart")
    parts = ["BL1 BL2", "another", "BR3 another BL3 BR1 BR2", "another", "BL1"]
    lines = [line_of(mechanism.home_pose, 1e-3), *(f"measure {part}" for part in parts)]
    good, *said = answers("stewart", lines, *FAR)
    for answer in said[:2]:
        assert answer["rig: actuators"] == {"level": 2, "message": "no position of BL3"} and "pose" not in answer
    for answer in said[2:]:
        assert answer["rig: actuators"] == {"level": 0, "message": "measured"}
    assert ["pose" in answer for answer in said[2:]] == [True, False, True]
    np.testing.assert_allclose([said[2]["pose"], said[4]["pose"]], [good["achieved"]] * 2, atol=1e-12)


@needs_compilers
@pytest.mark.parametrize("name", MACHINES)
def test_a_node_begins_where_the_machine_stands_and_refuses_leaps_and_states_that_stop(name: str) -> None:
    """From measured actuators, not from home; after states have stopped it begins from them anew."""
    mechanism, metres = machine(name), metres_of(machine(name).length_unit)
    lengths, length = np.array([drive.kind != "angle" for drive in mechanism.drives]), mechanism.characteristic_length
    near, away = mechanism.home_pose.copy(), mechanism.home_pose.copy()
    at, size = int(mechanism.drives[0].kind == "angle"), 0.04 * length  # a five-bar stands in its plane
    near[at, 3] += 2.0 * size
    away[at, 3] += 3.0 * size
    there, here = (pf.solve_ik(mechanism, place).actuators * np.where(lengths, metres, 1.0) for place in (away, near))
    states = "states " + " ".join(map(repr, there.tolist()))
    line = line_of(near, metres, mechanism.base)
    allowed = 1.01 * np.abs((there - here) / np.where(lengths, length * metres, 1.0)).max()
    guard, first = f"largest_step={allowed}", mechanism.actuator_names[0]
    said = answers(name, [line, states, line, "wait 0.6", line, states, line], guard, AT_ONCE)
    assert said[0]["rig: target"]["message"] == f"REFUSED: no position of {first}"
    assert said[0]["rig: actuators"] == {"level": 2, "message": f"no position of {first}"}
    np.testing.assert_allclose(matrix(said[1]["tf"], metres), away, atol=1e-6 * length)  # it shows where that is
    for answer in (said[2], said[6]):
        assert answer["rig: target"]["message"] == "REACHED", answer
        np.testing.assert_allclose(answer["command"], here, atol=1e-9 * length)
    assert said[3]["rig: actuators"] == {"level": 3, "message": f"no position of {first} for 0.6 s"}
    assert said[4]["rig: target"]["message"] == f"REFUSED: no position of {first} for 0.6 s"
    assert not {"command", "achieved"} & ({*said[0]} | {*said[4]})
    back = line_of(mechanism.home_pose, metres, mechanism.base)
    _, leap = answers(name, [states, back], guard, AT_ONCE)
    assert leap["rig: target"]["message"].startswith("REFUSED: a jump of an actuator: ") and "command" not in leap
    assert "; largest_step allows " in leap["rig: target"]["message"]
    *_, kept = answers(name, [states, line, "wait 0.6", line], guard, AT_ONCE, "states_timeout=0")
    assert kept["rig: target"]["message"] == "REACHED"


def test_a_package_is_complete_and_names_are_one(tmp_path: Path) -> None:
    folder = pf.export_ros2_node(machine("linear_delta"), tmp_path / "my_delta")
    files = {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}
    assert not [place for place, text in files.items() if "@" in text.replace("maintainer@example.com", "")]
    assert ET.fromstring(files["package.xml"]).findtext("name") == "my_delta_node"
    assert ET.fromstring(files["urdf/my_delta.urdf"]).get("name") == "Linear delta"
    assert "project(my_delta_node " in files["CMakeLists.txt"]
    ast.parse(files["launch/my_delta.launch.py"])
    parameters = yaml.safe_load(files["config/params.yaml"])["/**/my_delta"]["ros__parameters"]
    assert {name for name in parameters if f'"{name}"' in files["src/my_delta_node.cpp"]} == {*parameters}
    assert parameters["largest_step"] == 0.1 and parameters["states_timeout"] == 0.5
    assert parameters["base_frame"] == "base" and parameters["out_of_reach"] == "live"


def test_names_stand_in_a_package_as_they_are(tmp_path: Path) -> None:
    """Of bodies and machines, in any language, whatever they mean in a template, in Markdown or in XML."""
    pf.save(machine("stewart"), tmp_path / "it.toml")
    text = (tmp_path / "it.toml").read_text(encoding="utf-8")
    (tmp_path / "it.toml").write_text(text.replace('"base"', '"@ACTUATORS_XML@"'), encoding="utf-8")
    rig = replace(pf.load(tmp_path / "it.toml"), name="plâteau <b>|`x_1` 台")
    folder = pf.export_ros2_node(rig, tmp_path / "rig_node")
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert r"'plâteau \<b\>\|\`x\_1\` 台'" in readme and r"the frame '@ACTUATORS\_XML@'" in readme
    parameters = yaml.safe_load((folder / "config/params.yaml").read_text(encoding="utf-8"))
    assert parameters["/**/rig"]["ros__parameters"]["base_frame"] == "@ACTUATORS_XML@"
    described = ET.fromstring((folder / "package.xml").read_text(encoding="utf-8")).findtext("description")
    assert rig.name in described and "BL1, " in described


def test_the_command_writes_a_package_and_says_how_to_run_it(tmp_path: Path) -> None:
    line = ["export", "five_bar", "--ros2-node", str(tmp_path / "rig_node")]
    result = pfabrik(line)
    assert result.exit_code == 0 and "ros2 launch rig_node rig.launch.py" in result.output
    assert "colcon build --packages-select rig_node" in result.output and "ros2 topic pub" in result.output
    again = pfabrik(line)
    assert again.exit_code == 2 and "exists already" in again.output
    elsewhere = ["--ros2-node", str(tmp_path / "x")]
    refused = [pfabrik(["export", "panda", *rest]).output for rest in (["c"], elsewhere)]
    assert refused[0] == refused[1] and not (tmp_path / "x").exists()
    for rest, said in (
        ([*elsewhere, "--joints", "p1"], "not of --ros2-node"),
        (["--ros2-control", str(tmp_path / "x")], "for poses of a platform use --ros2-node"),
    ):
        result = pfabrik(["export", "five_bar", *rest])
        assert result.exit_code == 2 and said in result.output, result.output
    with pytest.raises(InvalidArgument, match="lower-case"):
        pf.export_ros2_node(machine("five_bar"), tmp_path / "x", name="Rig")
    with pytest.raises(UnsupportedMechanism):
        pf.export_ros2_node(machine("panda"), tmp_path / "x")
    assert not (tmp_path / "x").exists()
