"""The command on good, odd and hostile words: JSON, starting files, completion, one table of what it refuses."""

from __future__ import annotations

import ast
import dataclasses
import json
import math
import os
import re
import subprocess
import warnings
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.shell_completion import BashComplete

import pfabrik as pf
from command import files, in_process, listed, pfabrik, write_files
from machines import closure
from pfabrik.answers.words import as_sentence
from pfabrik.cli import main
from pfabrik.cli.examples import EXAMPLES
from pfabrik.cli.printing import fitted
from pfabrik.common.rotations import to_rpy
from pfabrik.exchange.export.rod_lengths import uneven_rods
from pfabrik.machine.catalog import description, template, templates
from pfabrik.machine.files import loads
from pfabrik.machine.motion.fitting_task import task_hint
from test_calibration import klipper_settings

pytestmark = pytest.mark.usefixtures("folder")


# Machines


@pytest.mark.parametrize("name", pf.catalog())
def test_every_machine_supplied_is_shown_whole_and_checked_as_well(name: str) -> None:
    mechanism = pf.load(name)
    text = pfabrik(f"info {name}").stdout
    assert mechanism.name in text
    assert all(str(chain) in text for chain in pf.decompose(mechanism))
    assert all(joint.name in text for joint in mechanism.joints)
    assert "…" not in text and "\x1b" not in text
    is_measured = name in ("g1_ankle", "reachy_mini")  # axes of makers' drawings, off by a millionth here and there
    assert is_measured or re.findall(r"\d\.?\d*e-\d+|(?<![\d.])-0(?![\d.])", text) == []
    checked = pfabrik(f"check {name}")
    hint = task_hint(mechanism)
    assert (checked.exit_code, checked.stdout[:4]) == (0, "ok: ")
    assert checked.stderr == (f"pfabrik: note: {hint}\n" if hint else "")


def test_a_load_counts_before_the_limits_of_actuators() -> None:
    solution = pf.solve_ik(pf.load("stewart"), pf.pose([10.0, 5.0, 190.0], rpy=np.radians([5.0, 0.0, 0.0])))
    arm = solution.pose[:3, :3] @ np.array([0.0, 10.0, 20.0])
    weight = np.array([0.0, 0.0, -5.0 * 9.81])
    wrench = np.concatenate([weight + [3.0, 0.0, -20.0], np.cross(arm, weight)])
    centre = np.add(solution.mechanism.reference_point, [0.0, 10.0, 20.0])
    line = (
        f"forces stewart --position 10 5 190 --rpy 5 0 0 --force 3 0 -20 --load platform=5,{','.join(map(str, centre))}"
    )
    found = json.loads(pfabrik(f"{line} --limit 90 --limit BL1=-5:60 --json").stdout)
    limits = dict.fromkeys(solution.mechanism.actuator_names, 90.0) | {"BL1": (-5.0, 60.0)}
    assert found["capacity"]["radius"] == pytest.approx(pf.wrench_capacity(solution, limits, wrench=wrench).radius)
    assert found["actuators"] == pytest.approx(pf.forces(solution, wrench).actuators.tolist())
    most = float(np.max(found["actuators"]))
    beyond = pfabrik(f"{line} --limit {most - 1.0}")
    place = solution.mechanism.actuator_names[int(np.argmax(found["actuators"]))]
    assert beyond.exit_code == 1 and f"{place} would exert {most:.5g}, 1 above its limit" in beyond.stdout
    assert pfabrik(f"{line} --limit {most + 1.0}").exit_code == 0


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


def printed_json(line: str, code: int = 0) -> Any:
    """The one object that `--json` puts on stdout."""
    result = pfabrik(f"{line} --json")
    assert result.exit_code == code, result.output
    assert result.stdout.count("\n") == 1
    return json.loads(result.stdout, parse_constant=refuse)


@pytest.mark.parametrize("name", pf.catalog())
def test_info_as_json_is_what_the_library_knows_with_angles_in_radians(name: str) -> None:
    mechanism, found = pf.load(name), printed_json(f"info {name}")
    assert found["actuators"] == list(mechanism.actuator_names)
    assert found["coordinates"] == list(mechanism.coordinate_names)
    assert found["task"] == list(mechanism.task)
    assert found["mobility"]["platform"] == pf.mobility(mechanism).platform
    assert found["mobility"]["redundancy"] == pf.mobility(mechanism).redundancy
    assert [chain["notation"] for chain in found["sub_chains"]] == [str(chain) for chain in pf.decompose(mechanism)]
    assert {chain["engine"] for chain in found["sub_chains"]} <= {"reaching", "closure", "chains", "legs"}
    for shown, joint in zip(found["joints"], mechanism.joints, strict=True):
        assert (shown["name"], shown["type"], shown["actuated"]) == (joint.name, joint.type, joint.actuated)
        assert np.ravel(shown["home"]) == pytest.approx(np.ravel(mechanism.home_coordinate(joint.name)))
        assert np.ravel(shown["range"] or ()) == pytest.approx(np.ravel(joint.range or ()))
        assert (shown["cone"] or {}).get("half_angle") == (joint.cone.half_angle if joint.cone else None)


STEWART, FIVE_BAR = pf.load("stewart"), pf.load("five_bar")


def ankle() -> pf.Solution:
    return pf.solve_ik(pf.load("ankle_ups"), {"pivot": np.radians([5, 10])})


def g1_ankle() -> pf.Solution:
    return pf.solve_ik(pf.load("g1_ankle"), {"pitch_joint": np.radians(-8), "roll_joint": np.radians(4)})


def travelled() -> pf.Travel:
    start = pf.solve_ik(STEWART, pf.pose([10, 0, 200], rpy=[0, 5, 0], degrees=True))
    return pf.travel(start, along=[[0, -1, -1], [1, 0, 0]], about=[0, 0, 1], pivot=[5, 5, 0])


def far() -> dict[str, Any]:
    answer = pf.solve_ik(FIVE_BAR, (0, 10, 900))
    return answer.to_dict() | {"reason": answer.reason}


def fastest() -> pf.PlatformSpeed:
    return pf.platform_speed(pf.solve_ik(FIVE_BAR, (0, 10, 180)), speed=np.radians(30.0))


def singular() -> dict[str, Any]:
    found = pf.singularity(pf.solve_ik(FIVE_BAR, (0, 10, 180)))
    assert len(found.motions) == 2
    return found.to_dict() | {"mobility": pf.mobility(FIVE_BAR).to_dict()}


def loaded() -> dict[str, Any]:
    answer, wrench = pf.solve_ik(STEWART, [0, 5, 190]), [0, 0, -200, 0, 500, 0]
    limits = dict.fromkeys(STEWART.actuator_names, 90.0) | {"BL1": (-5.0, 90.0)}
    used = pf.forces(answer, wrench).actuators[:, None]
    left = np.array([limits[name] if name == "BL1" else (-90.0, 90.0) for name in STEWART.actuator_names]) - used
    capacity = pf.wrench_capacity(answer, left)
    return pf.forces(answer, wrench, limits=limits).to_dict() | {"capacity": capacity.to_dict()}


def carried() -> dict[str, Any]:
    held = pf.forces(ankle(), loads={"foot": (3.0, (20, 10, 60))}, gravity=(0, 0, -9.8))
    reactions = {name: wrench.tolist() for name, wrench in held.reactions.items()}
    rods = {name: float(pull) for name, pull in held.rods.items()}
    more = {"joints": reactions, "rods": rods, "undetermined": held.undetermined}
    return held.to_dict() | {"reactions": more}


ALONG = "--along 0 -1 -1 --along 1 0 0 --about 0 0 1 --pivot 5 5 0"
JSON: dict[str, Callable[[], Any]] = {
    "catalog": lambda: {name: description(name) for name in pf.catalog()},
    "new --list": lambda: {name: template(name).partition("\n")[0].partition(": ")[2] for name in templates()},
    "ik stewart --position 10 0 190 --rpy 0 5 0": lambda: pf.solve_ik(
        STEWART, pf.pose([10, 0, 190], rpy=[0, 5, 0], degrees=True)
    ),
    "ik ankle_ups --joint pivot=5,10": ankle,
    "ik g1_ankle --joint roll_joint=4 --joint pitch_joint=-8": g1_ankle,
    "ik five_bar --position 0 10 900": far,
    "fk stewart 197 200 202 197 202 200": lambda: pf.solve_fk(STEWART, [197, 200, 202, 197, 202, 200]),
    "fk five_bar -2e1 -.3": lambda: pf.solve_fk(FIVE_BAR, [math.radians(-20), math.radians(-0.3)]),
    "ik five_bar --position 0 10 180 --all": lambda: pf.working_modes(FIVE_BAR, (0, 10, 180)),
    "fk five_bar -20 20 --all": lambda: pf.assembly_modes(FIVE_BAR, np.radians([-20, 20])),
    "travel endless.toml --along 0 0 1": lambda: pf.travel(
        pf.solve_ik(STEWART.without_limits(), STEWART.home_pose), along=[0, 0, 1]
    ),
    f"travel stewart --position 10 0 200 --rpy 0 5 0 {ALONG}": travelled,
    "travel ankle_ups --joint pivot=5,10": lambda: pf.travel(ankle()),
    "speed five_bar --position 0 10 180 --speed 30": fastest,
    "workspace five_bar --resolution 16": lambda: pf.workspace(FIVE_BAR, resolution=16.0),
    "singularities five_bar --position 0 10 180": singular,
    "singularities five_bar --resolution 16": lambda: pf.singularity_map(
        FIVE_BAR, pf.workspace(FIVE_BAR, resolution=16.0)
    ),
    "forces stewart --position 0 5 190 --force 0 0 -200 --moment 0 500 0 --limit 90 --limit BL1=-5:90": loaded,
    "forces ankle_ups --joint pivot=5,10 --load foot=3,20,10,60 --gravity 0 0 -9.8 --reactions": carried,
    "stiffness five_bar --position 0 10 180 --k 500 --k p1=100": lambda: pf.stiffness(
        pf.solve_ik(FIVE_BAR, (0, 10, 180)), [100.0, 500.0]
    ),
    "stiffness five_bar --position 0 10 180 --k 500 --force 0 0 -1": lambda: pf.stiffness(
        bar := pf.solve_ik(FIVE_BAR, (0, 10, 180)), 500.0, forces=pf.forces(bar, (0, 0, -1))
    ),
    "accuracy five_bar --position 0 10 180 --error 0.5 --error p3=0.1 --rms": lambda: pf.accuracy(
        pf.solve_ik(FIVE_BAR, (0, 10, 180)), dict.fromkeys(("p1", "p5"), math.radians(0.5)) | {"p3": 0.1}, "rms"
    ),
    "transmission five_bar --position 0 10 180": lambda: pf.transmission(pf.solve_ik(FIVE_BAR, (0, 10, 180))),
}


@pytest.mark.parametrize("line", JSON)
def test_json_is_one_object_that_says_what_the_library_does(line: str) -> None:
    write_files("endless.toml")
    expected = JSON[line]()
    plain = expected if isinstance(expected, dict) else expected.to_dict()
    assert printed_json(line, code=int("900" in line)) == json.loads(json.dumps(plain))


def test_json_of_margins_is_what_the_library_says() -> None:
    answer = pf.solve_ik(STEWART, [0, 5, 190])
    found = printed_json("ik stewart --position 0 5 190 --margins")
    assert {(each["joint"], each["bound"]): each["margin"] for each in found["margins"]} == dict(pf.margins(answer))
    listed_margins = [each["margin"] for each in found["margins"]]
    assert listed_margins == sorted(listed_margins)


def test_json_of_check_and_time_is_one_object() -> None:
    write_files("revolving.toml", "untasked.toml", "edge.csv", "hundred_legs.toml")
    found = printed_json("check five_bar")
    assert (found["ok"], found["joints"], found["actuators"], found["sub_chains"]) == (True, 5, 2, 2)
    (note,) = found["notes"]
    assert "a task that fits is y z" in note
    assert printed_json("check delta")["notes"] == []
    (note,) = printed_json("check untasked.toml")["notes"]
    assert "asks for 6 coordinates" in note
    with pytest.raises(pf.errors.InvalidMechanism) as raised:
        loads(files()["revolving.toml"])
    found = printed_json("check revolving.toml", code=2)
    assert [(each["place"], each["found"]) for each in found["faults"]] == [
        (fault.place, fault.found) for fault in raised.value.faults
    ]
    assert not found["ok"] and len(found["faults"]) == 5
    assert printed_json("info hundred_legs.toml")["mobility"] is None
    timed = printed_json("time linear_delta edge.csv --speed 300")
    assert set(timed) == {"duration", "samples", "held_back", "exceeded"}


# Numbers


def test_rpy_is_the_inverse_of_pose() -> None:
    for rpy in ([0.1, -0.7, 2.0], [3.0, 1.5, -3.0], [0, math.pi / 2, 0.4], [0, -math.pi / 2, 0.4]):
        rotated = pf.pose([0, 0, 0], rpy=rpy)
        np.testing.assert_allclose(pf.pose([0, 0, 0], rpy=to_rpy(rotated[:3, :3])), rotated, atol=1e-12)


@pytest.mark.parametrize("position", ["1e300 0 0", "0 0 -1e6", "0 0 0", "5e-324 0 0"])
@pytest.mark.parametrize("name", ["five_bar", "nrpm", "stewart"])
def test_any_finite_target_gets_an_answer(name: str, position: str) -> None:
    found = printed_json(f"ik {name} --position {position}", code=1)
    assert found["status"] in ("PROJECTED", "FAILED")


@pytest.mark.compiled
@pytest.mark.parametrize("value", ["1e150", "0", pytest.param("-1e12", marks=pytest.mark.campaign), "5e-324"])
@pytest.mark.parametrize("name", pf.catalog())
def test_any_finite_actuator_values_get_an_answer(name: str, value: str) -> None:
    result = pfabrik(["fk", name, *[value] * len(pf.load(name).actuator_names), "--json"])
    status = json.loads(result.stdout)["status"]
    assert (result.exit_code, status) in ((0, "REACHED"), (1, "PROJECTED"), (1, "FAILED"))


@pytest.mark.parametrize(
    "line",
    [
        "ik stewart --position 10 0 190",
        "ik stewart --position 0 0 300",
        "ik delta --position 10 0 -90",
        "plot stewart --position 10 0 190",
        "plot five_bar --position 0 20 170",
        "plot nrpm --position 10 0 200",
        "fk five_bar -20 20",
    ],
)
def test_what_is_printed_asks_for_no_joints_that_it_does_not_show(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """After installing, their kernels would be compiled for it: longer than all else takes."""

    def unasked(*_: object) -> None:
        raise AssertionError("joint coordinates are worked out")

    monkeypatch.setattr("pfabrik.engines.pose.coordinates.read_coordinates", unasked)
    monkeypatch.setattr("pfabrik.engines.pose.coordinates._closed", unasked)
    assert pfabrik(line).exit_code in (0, 1)


@pytest.mark.compiled
def test_a_mode_beyond_limits_says_which() -> None:
    _, below = pf.assembly_modes(FIVE_BAR, np.radians([-20, 20]))
    assert as_sentence(below) == "exceeded: assembled, but beyond limits: p2 min; p4 max"


def test_a_list_that_was_cut_says_so() -> None:
    found = pf.working_modes(pf.load("serial_arm"), pf.load("serial_arm").home_pose, most_starts=512)
    cut = dataclasses.replace(found, modes=found.modes[:1], hits=found.hits[:1])
    assert str(cut).startswith("2 working modes, of the 1 nearest to home 1 within all limits\n")


# Workspaces


def test_a_workspace_tells_its_size_its_border_and_angles_in_degrees() -> None:
    text = pfabrik("workspace stewart --resolution 16").stdout
    assert "mm³" in text.splitlines()[0]
    assert re.search(r"^\d+\.\d% +B\w+ (min|max) +prismatic, actuated$", text, re.MULTILINE)
    assert re.search(r"^\d+\.\d% +A\w+ cone +universal$", text, re.MULTILINE)
    slice_ = "workspace stewart --fix x=0 --fix y=0 --fix z=200 --resolution 16"
    rows = {line.split()[0]: line.split() for line in pfabrik(slice_).stdout.splitlines() if line[:3] in ("til", "yaw")}
    told = printed_json(slice_)
    assert told["units"] == ["rad"] * 3
    for name, (low, high) in told["bounds"].items():
        assert [float(number) for number in rows[name][2:5:2]] == pytest.approx(np.degrees([low, high]), rel=1e-5)
        assert rows[name][5] == "deg"
    nothing = pfabrik("workspace stewart --fix z=5000")
    assert (nothing.exit_code, nothing.stdout) == (1, "nothing within reach\n")


def test_a_machine_without_closed_forms_is_told_of_at_once_and_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pfabrik.common.telling.PATIENCE", 0.0)
    pf.save(closure.with_hinges_apart(pf.load("delta").without_limits()), "apart.toml")
    result = pfabrik("workspace apart.toml --fix z=-200 --within x=-60:60 --within y=-60:60 --resolution 30 --json")
    assert result.exit_code == 0 and json.loads(result.stdout)["size"] == pytest.approx(120.0**2)
    first, *lines = result.stderr.splitlines()
    assert "no closed forms, " in first and "points are tried one by one" in first
    shares = [int(line.partition("workspace: ")[2].partition("%")[0]) for line in lines]
    assert shares and all(after // 10 > before // 10 for before, after in pairwise(shares))  # a line in ten per cent
    assert all(line.endswith(" left") for line in lines)


# A file to start from


@pytest.mark.parametrize("name", templates())
def test_every_starting_file_is_a_sound_machine_with_room_around_home(name: str) -> None:
    result = pfabrik(f"new {name} -o my.toml")
    assert (result.exit_code, result.stdout) == (0, "")
    assert result.stderr == "wrote my.toml; next: edit it, then pfabrik check my.toml\n"
    checked = pfabrik("check my.toml")
    assert checked.stdout.startswith("ok: My ") and checked.stderr == ""
    assert listed() == ["my.toml"]
    mechanism = pf.load("my.toml")  # warnings are errors here: its actuators hold it
    assert pf.mobility(mechanism).uncontrolled == 0
    step, moved = 0.02 * mechanism.characteristic_length, np.array(mechanism.home_pose)
    if "tilt" in mechanism.task:
        moved = pf.pose(mechanism.reference_point, rpy=[0.02, 0.02, 0])
        moved[2, 3] += step
    else:
        moved[:2, 3] += step
    low, high = np.array([mechanism.joint(actuator).range for actuator in mechanism.actuator_names]).T
    for target in (mechanism.home_pose, moved):
        solution = pf.solve_ik(mechanism, target)
        assert solution.status == pf.Status.REACHED
        assert (solution.actuators > low).all() and (solution.actuators < high).all()


def test_a_starting_file_is_named_as_its_text_begins_and_printed_where_no_file_is_named() -> None:
    kinds = {"6-UPS", "6-RUS", "6-PUS", "3-RPS", "3-PRS", "3-RRS", "3-RPR", "3-RRR", "5-bar", "ankle"}
    assert kinds <= set(templates())
    rows = pfabrik("new --list").stdout.splitlines()[1:]
    assert [row.split()[0] for row in rows] == list(templates())
    for name, row in zip(templates(), rows, strict=True):
        assert template(name).startswith(f"# {name}: {row.split(maxsplit=1)[1]}\n")
        if name[1:2] == "-" and name[2:].isupper():
            chains = [str(chain) for chain in pf.decompose(loads(template(name)))]
            assert [chain.replace("-", "").replace("*", "") for chain in chains] == [name[2:]] * int(name[0])
    assert pfabrik("new 6-ups").stdout == pfabrik("new hexapod").stdout == template("6-UPS")
    alone = pfabrik("new")
    assert (alone.exit_code, alone.stdout) == (0, pfabrik("new --list").stdout)
    assert "pfabrik new KIND -o FILE" in alone.stderr
    assert listed() == []


def test_dimensions_of_a_starting_file_are_options() -> None:
    line = "new linear-delta --arm-length 300 --platform-radius=30 --position-endstop -5 -o my.toml"
    assert pfabrik(line).exit_code == 0
    machine, usual = pf.load("my.toml"), loads(template("linear-delta"))
    assert machine == usual.with_dimensions(arm_length=300, platform_radius=30, position_endstop=-5)
    upper, lower = (np.array(machine.joint(name).at) for name in ("UpperL1", "LowerL1"))
    assert np.linalg.norm(upper - lower) == pytest.approx(300)


@pytest.mark.parametrize("given", ["", "--crank 90 --forearm 160", "--crank 130 --crank-angle 110"])
def test_elbows_of_a_starting_file_stop_before_they_are_stretched_or_folded(given: str) -> None:
    """The angle between crank and forearm, measured on the points of the joints, is 40 and 170 degrees at the stops."""
    machine = loads(pfabrik(f"new 5-bar {given}").stdout)
    shaft, elbow, tip = (np.array(machine.joint(name).at) for name in ("MotorL", "ElbowL", "Tip"))
    crank, forearm = elbow - shaft, tip - elbow
    bend = math.degrees(math.acos(crank @ forearm / (np.linalg.norm(crank) * np.linalg.norm(forearm))))
    assert np.degrees(machine.joint("ElbowL").range) + 170.0 == pytest.approx([bend, bend + 170.0 - 40.0])
    assert machine.joint("ElbowR").range == pytest.approx(-np.array(machine.joint("ElbowL").range)[::-1])


def test_a_starting_file_of_a_printer_has_klipper_s_words() -> None:
    settings = {"delta_radius": 105.5, "arm_length": 262.25, "position_endstop": 141.75}
    options = " ".join(f"--{name.replace('_', '-')} {value}" for name, value in settings.items())
    pfabrik(f"new linear-delta {options} -o my.toml")
    written = dict(re.findall(r"^(\w+): (\S+)", pfabrik("export my.toml klipper").stdout, re.MULTILINE))
    assert {name: float(written[name]) for name in settings} == settings


def test_rods_between_crosses_of_hinges_are_rods() -> None:
    joints = [pf.Joint("P", "prismatic", ("base", "carriage"), axis=(0, 0, 1), actuated=True)]
    for side, y, height in (("L", 20.0, 100.0), ("R", -20.0, 93.0)):
        foot, cross, rod = (0, y, height), f"cross{side}", f"rod{side}"
        joints += [
            pf.Joint(f"A{side}", "revolute", ("carriage", cross), at=foot, axis=(1, 0, 0)),
            pf.Joint(f"B{side}", "revolute", (cross, rod), at=foot, axis=(0, 1, 0)),
            pf.Joint(f"C{side}", "spherical", (rod, "platform"), at=(0, y, 0)),
        ]
    with warnings.catch_warnings(action="ignore"):
        mechanism = pf.Mechanism("pair", joints, "platform", (0, 0, 0))
    (pair,) = uneven_rods(mechanism)
    between = ("carriage", "platform")
    assert [(rod.name, rod.between, rod.length) for rod in pair] == [("rodL", between, 100.0), ("rodR", between, 93.0)]


def test_rods_that_differ_are_no_printer_of_klipper_s() -> None:
    write_files("one_rod.toml", "one_carriage_rod.toml")
    for name, rods in (("one_rod", "'rodL2' (255 mm)"), ("one_carriage_rod", "'rodL1' (273 mm) and 'rodR1' (296 mm)")):
        refused = pfabrik(f"export {name}.toml klipper")
        assert refused.exit_code == 2 and rods in refused.stderr


def test_parts_of_an_export_are_chosen() -> None:
    assert "stewart_fk" not in pfabrik("export stewart c --parts ik,limits --name stewart").stdout


# What is refused


ONE_STEWART = "ik stewart --position 10 0 190"
REFUSED = [
    ("chek stewart", "did you mean 'check'"),
    ("--wrong", "--wrong"),
    ("info stewrt", "did you mean 'stewart'"),
    ("info nowhere/machine.toml", "machine.toml"),
    ("info .", "."),
    ("info ''", ""),
    ("info 'a\nb'", ""),
    # targets
    ("ik stewart", "no target: give --position, --rpy or both, or --joint (for example: pfabrik ik stewart --position"),
    ("ik stewart --position nan 0 0", "'--position': found 'nan'; expected a finite number"),
    ("ik stewart --rpy 0 1e999 0", "'--rpy': found '1e999'; expected a finite number"),
    (f"{ONE_STEWART} --hold both", "orientation"),
    (f"{ONE_STEWART} --all --margins", "--margins is of one answer"),
    ("ik ankle_ups --joint pivot", "found 'pivot'; expected NAME=VALUE"),
    ("ik ankle_ups --joint pivot=5,nan", "expected NAME=VALUE[,VALUE...] with finite numbers"),
    ("ik ankle_ups --joint pivot=5", "found 1 value; expected 2"),
    ("ik ankle_ups --joint pivt=5,10", "did you mean 'pivot'"),
    ("ik ankle_ups --joint BL=100", "expected a pose, or those of joints in series"),
    ("ik ankle_ups --joint pivot=5,10 --joint pivot=5,10", "found 'pivot' twice"),
    ("ik ankle_ups --joint pivot=5,10 --rpy 0 0 0", "--joint says it all"),
    # a machine at rest at a pose
    ("forces stewart", "no load: give --force, --moment or --load"),
    ("forces stewart --force 0 0 nan", "'--force': found 'nan'; expected a finite number"),
    ("forces five_bar --position 0 0 190 --moment 0 0 1", "the end effector is a joint"),
    ("forces stewart --load platform", "--load BODY=MASS,X,Y,Z: found 'platform'; expected 4 finite numbers"),
    ("forces stewart --load platfrm=5,0,0,190", "did you mean 'platform'?"),
    ("forces stewart --limit BL1=5", "--limit: found no value of BL2, BL3"),
    ("forces stewart --limit 5:x", "found '5:x'; expected a positive number, or MIN:MAX"),
    ("stiffness stewart", "Missing option '--k' (for example: pfabrik stiffness stewart --k 500; see"),
    ("stiffness stewart --k 5 --rod 5", "--rod 5: no rod '' (known: none)"),
    ("accuracy stewart --error BR9=5", "no actuator or joint 'BR9'; did you mean 'BR"),
    ("clearance stewart", "no link has a thickness: give legs one, or add [[body]] tables"),
    ("speed five_bar", "--speed: found 'Planar 5-bar' without max_speed; expected a limit of speed, given or in"),
    ("singularities stewart --fix z=190 --position 0 0 190", "--position and --joint are of one pose"),
    ("singularities stewart -o map.stl", "'map.stl'; expected a name that ends in .png, .svg or .pdf"),
    # travel
    ("travel stewart --position 0 0 900", "cannot start there: projected"),
    ("travel stewart --along 0 0 0", "along"),
    ("travel stewart --along 1", "travel --help')\n"),
    ("travel stewart --about 0 nan 0", "'--about': found 'nan'"),
    ("travel stewart --pivot 0 0", "--pivot"),
    ("travel agile_eye --along 0 0 1", "within the task"),
    # actuator values
    ("fk", "MECH"),
    ("fk stewrt 1", "did you mean 'stewart'"),
    ("fk five_bar", "found 0 values; expected 2: p1 [deg], p5 [deg]"),
    ("fk five_bar 1 2 3", "found 3 values; expected 2: p1 [deg], p5 [deg]"),
    ("fk stewart 1", "expected 6: BL1 [mm], BL2 [mm]"),
    ("fk five_bar 1 abc", "found 'abc'; expected a finite number"),
    ("fk five_bar 1 ''", "found ''"),
    ("fk five_bar 1 -inf", "found '-inf'"),
    ("fk five_bar 1 1e999", "found '1e999'"),
    ("fk five_bar 1 2,5", "found '2,5'"),
    ("fk five_bar 1 2 --jsn", "found '--jsn'; expected a finite number, or an option"),
    # paths
    ("track stewart missing.csv -o out.csv", "missing.csv"),
    ("track five_bar path.csv --speed 10", "--speed says nothing without --sample-time"),
    ("track five_bar path.csv --sample-time 1 --speed p2=10", "no actuator 'p2' (known: p1, p5)"),
    ("track five_bar path.csv --sample-time 1 --speed p1=", "found ''; expected a positive number"),
    ("track five_bar path.csv --sample-time 1 --speed 0", "found '0'; expected a positive number"),
    ("track five_bar path.csv --sample-time 1 --speed p1=-3", "found '-3'; expected a positive number"),
    ("track five_bar path.csv --sample-time 1 --speed p1=nan", "found 'nan'; expected a positive number"),
    ("track five_bar path.csv --sample-time 0 -o a.csv", "--sample-time: found 0.0; expected a positive number"),
    ("time five_bar path.csv", "--speed: found 'Planar 5-bar' without max_speed and max_acceleration; expected"),
    ("time five_bar path.csv --speed 9", "PATH: found 1 step not reached, first at target 2 (line 3); expected a path"),
    ("track five_bar path.csv --sample-time inf", "--sample-time"),
    ("calibrate nothere.cfg", "nothere.cfg"),
    ("track five_bar path.csv --animate a.png", "expected a name that ends in .gif or .mp4"),
    ("track five_bar path.csv --plot a.gif", "--plot: found 'a.gif'; expected a name that ends in .png, .svg or .pdf"),
    # pictures
    ("plot stewart --view up", "--view: found 'up'; expected top, front, side, iso, or EL,AZ"),
    ("plot stewart --view 95,0", "elevation from -90 to 90 and azimuth [deg]"),
    ("plot stewart --size 6", "--size: found '6'; expected WxH in inches, such as 6x4"),
    ("travel stewart --size 6x-1", "expected WxH in inches"),
    ("plot stewart --size 400x400 --dpi 600", "expected a picture of at most 100,000,000 pixels"),
    ("plot ankle_ups --torque-map --view top", "it does not go with --view or --theme"),
    ("plot five_bar -o a.bmp", "'a.bmp'; expected a name that ends in .png, .svg or .pdf"),
    ("plot five_bar -o none/a.png", "none/a.png: No such file or directory"),
    ("plot mine.toml -o mine.png", "mine.png: found a file that was read"),
    ("plot five_bar --position 0 0", "--position"),
    ("plot stewart --torque-map", "no passive joints in series from base to end effector; give --joints"),
    ("plot g1_ankle --torque 3", "--joints and --torque belong to --torque-map"),
    ("plot g1_ankle roll_joint --torque-map", "names after --joints"),
    ("plot g1_ankle --torque-map --joints a b --joints c", "--joints once with all names"),
    ("plot g1_ankle --torque-map --names", "does not go with a target or --names"),
    ("plot tricept --torque-map", "two angles, or two lengths, for a torque map"),
    ("demo --steps 2", "steps"),
    # workspaces
    ("workspace rps --fix q=1", "no coordinate named 'q' (known: z, tilt_x, tilt_y)"),
    ("workspace stewart --within z=9:2", "--within z: found (9.0, 2.0); expected two numbers"),
    ("workspace five_bar --largest cylinder", "--largest: found 'cylinder'; expected a sphere or a box"),
    ("workspace stewart --fix z=nan", "expected NAME=VALUE with finite numbers"),
    ("workspace stewart --within z=1", "expected NAME=MIN:MAX"),
    ("workspace stewart --resolution 0", "expected a positive number"),
    ("workspace stewart --tilt 200", "expected an angle from 0 to 180 degrees"),
    ("workspace stewart -o a.bmp", "-o: found 'a.bmp'; expected a name that ends in"),
    ("workspace stewart --centre 1,2,3", "says nothing without --largest"),
    ("workspace stewart --any-orientation --rpy 0 0 1", "give one of them"),
    ("time five_bar swing.csv --torque 0.01 --load link1=1,0,0,200", "--torque: found 0.01, where 'p1' must exert"),
    # starting files and exports
    ("new 6-UPX", "no kind of machine named '6-UPX'; did you mean '6-UPS'? (known: 3-PRS, "),
    ("new dleta -o my.toml", "did you mean 'delta'?"),
    ("new -o my.toml", "one KIND of 3-PRS, "),
    ("new delta --json", "--json goes with --list"),
    ("new delta -o no/such/my.toml", "no/such/my.toml: No such file or directory"),
    ("new 3-PRS --rod -130", "--rod: found -130; expected a positive length"),
    ("new delta --rods 3", "no dimension or option named '--rods'; did you mean '--rod'?"),
    ("new delta --fore", "did you mean '--force'?"),
    ("new delta --rod long", "--rod: found 'long'; expected a number"),
    ("new delta --rod", "--rod: found ''; expected a number"),
    ("new delta --rod 100", "dimensions.height: found 'sqrt(rod**2 - across**2)': rod ** 2 - across ** 2 is -"),
    ("new delta more", "unexpected extra argument (more)"),
    ("export stewart c --parts dynamics", "expected some of 'ik'"),
    ("export stewart mjcf --parts ik", "--parts is of c, c-float"),
]


@pytest.mark.parametrize(("line", "told"), REFUSED, ids=[line for line, _ in REFUSED])
def test_wrong_words_are_told_on_stderr_with_exit_code_2_and_write_nothing(line: str, told: str) -> None:
    write_files("path.csv", "swing.csv")
    pf.save(FIVE_BAR, "mine.toml")
    Path("mine.png").symlink_to("mine.toml")
    result = pfabrik(line)
    assert (result.exit_code, result.stdout) == (2, "")
    assert told in result.stderr
    assert all(text.startswith("pfabrik: ") for text in result.stderr.splitlines())
    assert listed() == ["mine.png", "mine.toml", "path.csv", "swing.csv"]


# Words and columns


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("info st", ["stewart"]),
        ("ik serv", ["servo_hexapod"]),
        ("new 6-", ["6-PUS", "6-RUS", "6-UPS"]),
        ("new --from agi", ["agile_eye"]),
        ("tra", ["track", "travel", "transmission"]),
        ("new linear-delta --arm", ["--arm-length"]),
        ("export stewart m", ["mjcf", "marlin"]),
        ("workspace five_bar --fix ", ["y=", "z="]),
        ("singularities stewart --over x,y,t", ["x,y,tilt_x", "x,y,tilt_y"]),
        ("certify stewart --limits AL1,BL", ["AL1,BL1", "AL1,BL2", "AL1,BL3"]),
        ("design stewart my.toml --vary plat", ["platform_radius=", "platform_angle="]),
        ("ik g1_ankle --joint ", ["pitch_joint=", "roll_joint="]),
        ("plot g1_ankle --joints r", ["roll_joint"]),
        ("speed five_bar --speed ", ["p1=", "p5="]),
        ("stiffness delta --rod rodR", ["rodR1=", "rodR2=", "rodR3="]),
        ("forces stewart --load p", ["platform="]),
        ("time five_bar path.csv --torque p", ["p1=", "p5="]),
        ("workspace nowhere.toml --fix ", []),
    ],
)
def test_names_of_machines_and_of_what_they_have_are_completed(line: str, found: list[str]) -> None:
    Path("my.toml").write_text(template("6-UPS"), encoding="utf-8")
    *words, incomplete = line.split(" ")
    completions = BashComplete(main, {}, "pfabrik", "_PFABRIK_COMPLETE").get_completions(words, incomplete)
    assert [each.value for each in completions] == found


def test_a_shell_asks_for_completions_by_the_name_that_the_page_gives() -> None:
    asked = {"_PFABRIK_COMPLETE": "bash_complete", "COMP_WORDS": "pfabrik tra", "COMP_CWORD": "1"}
    with in_process("", env=os.environ | asked, stdout=subprocess.PIPE) as process:
        assert process.communicate(timeout=60)[0].split() == ["plain,track", "plain,travel", "plain,transmission"]
    page = Path(__file__).parents[1] / "docs" / "cli.md"
    assert "_PFABRIK_COMPLETE=bash_source" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "line",
    [
        *("catalog", "new", "info nrpm", "check stewart", "travel five_bar"),
        *("ik stewart --position 0 0 300", "ik prr --all --rpy 0 0 0"),
    ],
)
def test_tables_fit_the_terminal(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What one line has no room for goes on in the next; no word is lost."""
    free = pfabrik(line).stdout
    for columns in (60, 100):
        monkeypatch.setenv("COLUMNS", str(columns))
        narrow = pfabrik(line).stdout
        assert max(map(len, narrow.splitlines())) <= columns
        assert narrow.split() == free.split()
        assert all(row in narrow for row in free.splitlines() if len(row) <= columns)


LINES = [line for name, lines in EXAMPLES.items() if name != "demo" for line in lines]  # whose tests run it just so


@pytest.mark.compiled
def test_examples_of_the_help_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the order of the help, one after the other: what one writes another may read."""
    for needed in ("matplotlib", "mujoco"):
        pytest.importorskip(needed)
    monkeypatch.setattr(pf.Viewer, "wait", lambda _: None)
    monkeypatch.setattr("webbrowser.open", lambda _: None)
    Path("printer.cfg").write_text(klipper_settings(), encoding="utf-8")
    Path("robot.xml").write_text(pf.interop.to_mjcf(STEWART), encoding="utf-8")
    Path("path.csv").write_text("x,y,z\n0,0,190\n5,0,195\n", encoding="utf-8")
    Path("part.gcode").write_text("G1 X0 Y0 Z5 F3000\nG1 X5 Y0\nG1 X5 Y5 Z6\n", encoding="utf-8")
    rows = [f"{k / 50},{k / 50},{5 * np.sin(k / 9):.6f},0,{5 * np.cos(k / 7):.6f},1,2,3,1" for k in range(60)]
    Path("measured.csv").write_text(
        "\n".join(["t,time,x,y,z,effort_A1,effort_A2,effort_A3,tau1", *rows]) + "\n", encoding="utf-8"
    )
    delta = pf.load("linear_delta")
    pf.save(delta.with_masses([pf.Mass(body, 0.5, (0.0, 0.0, 100.0)) for body in delta.bodies[1:]]), "delta.toml")
    for line in LINES:
        done = pfabrik(line)
        assert done.exit_code in (0, 1) and done.output, (line, done.stderr)


def test_help_ends_with_examples_of_its_command() -> None:
    assert list(EXAMPLES) == list(main.subcommands)
    for name, lines in EXAMPLES.items():
        assert pfabrik(f"{name} --help").stdout.endswith("".join(f"\n    pfabrik {line}" for line in lines) + "\n")
        assert all(line.split()[0] == name for line in lines)


def test_text_that_goes_on_is_below_its_column() -> None:
    table = "name  what it is\na     short\nb     one two three four five six seven"
    assert fitted(table, 30) == "name  what it is\na     short\nb     one two three four five\n      six seven"
    assert fitted(table, 24) == "name  what it is\na     short\nb\n    one two three four\n    five six seven"
    assert fitted(table, None) == table == fitted(table, 100)
    assert fitted("one two three four", 10) == "one two\n    three\n    four"
    assert fitted("https://" + "x" * 30, 10) == "https://" + "x" * 30  # no word is cut


def test_every_command_and_option_that_is_named_exists() -> None:
    """In all texts of the library: messages, help, docstrings."""
    context = click.Context(main)
    commands = {name: main.get_command(context, name) for name in main.list_commands(context)}
    options = {option for each in commands.values() for param in each.params for option in param.opts}
    known = options | {"--arm", "--arm-length", "--delta-radius", "--help"}  # the first three of starting files
    known |= {"--once", "--packages-select"}  # of the commands of ROS 2
    named, called = re.compile(r"(?<![\w-])(?<!halcompile )--(?!pf-)[a-z][a-z0-9-]*"), re.compile(r"`pfabrik ([a-z]+)")
    for path in (Path(pf.__file__).parent).rglob("*.py"):
        source = path.read_text(encoding="utf-8")
        assert set(called.findall(source)) <= set(commands), path
        if set(named.findall(source)) <= known:
            continue
        constants = (node.value for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Constant))
        texts = [text for text in constants if isinstance(text, str)]
        assert {word for text in texts for word in named.findall(text)} <= known, path
