"""The command: what it prints, what it writes, how it leaves; on good, odd and hostile input."""

from __future__ import annotations

import ast
import contextlib
import csv
import dataclasses
import itertools
import json
import math
import os
import re
import shlex
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner, Result

import pfabrik as pf
from machines import closure
from pfabrik.answers.words import as_sentence
from pfabrik.catalog import template, templates
from pfabrik.cli import main, outputs
from pfabrik.cli.fitted import fitted
from pfabrik.cli.group import exit_code
from pfabrik.cli.outputs import ignores_case, new_folder
from pfabrik.cli.stops import AGAIN
from pfabrik.export.rod_lengths import uneven_rods
from pfabrik.files import loads
from pfabrik.rotations import to_rpy

WITHIN_REACH = ["--position", "10", "0", "190"]
BEYOND_REACH = ["--position", "0", "0", "300"]
STRUTS = [197, 200, 202, 197, 202, 200]
CLI_PAGE = Path(__file__).parents[1] / "docs" / "cli.md"


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


def upu(path: Path) -> Path:
    """A file of a 3-UPU that translates; positions alone cannot express its legs."""
    joints = []
    for i, angle in enumerate(np.radians([0, 120, 240]), 1):
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        foot, head, tangent = 100 * out, 50 * out + [0, 0, 130], np.cross([0, 0, 1], out)
        inner = np.cross(tangent, head - foot)
        joints += [
            pf.Joint(f"A{i}", "universal", ("base", f"c{i}"), at=foot, axes=(tangent, inner)),
            pf.Joint(
                f"B{i}", "prismatic", (f"c{i}", f"r{i}"), along=(f"A{i}", f"C{i}"), actuated=True, range=(90, 200)
            ),
            pf.Joint(f"C{i}", "universal", (f"r{i}", "platform"), at=head, axes=(inner, tangent)),
        ]
    pf.save(pf.Mechanism("3-UPU", joints, "platform", (0, 0, 130)), path)
    return path


def hexagons(path: Path) -> Path:
    """A file of a 6-UPS whose platform is its base, smaller: it moves with its struts locked."""
    joints = []
    for i, angle in enumerate(np.radians([0, 40, 120, 160, 240, 280]), 1):
        corner = np.array([np.cos(angle), np.sin(angle), 0.0])
        joints += [
            pf.Joint(f"A{i}", "universal", ("base", f"c{i}"), at=100 * corner),
            pf.Joint(f"B{i}", "prismatic", (f"c{i}", f"r{i}"), along=(f"A{i}", f"C{i}"), actuated=True),
            pf.Joint(f"C{i}", "spherical", (f"r{i}", "platform"), at=60 * corner + [0, 0, 150]),
        ]
    with pytest.warns(pf.errors.MobilityWarning):
        pf.save(pf.Mechanism("similar hexagons", joints, "platform", (0, 0, 150)), path)
    return path


# What is said, wording and all; more than this is told by what follows

STRUTS_OUT = "struts BL1, BL2, BL3, BR1, BR2, BR3 at their maximum 280 mm"
NO_LIMIT = "mm from the target; no limit is active: "
NO_EFFECT = "has no effect: the task is"
SAID: dict[str, tuple[int, str, str]] = {
    # of six struts that hold alike, rounding decides which holds hardest, and not what is printed
    "ik stewart --position 0 0 300": (1, f"; {STRUTS_OUT}\n", ""),
    "ik free.toml --position 0 0 400": (1, "; the links are stretched out or folded at joint p4\n", ""),
    "ik free.toml --position 30 10 180": (1, f"{NO_LIMIT}the mechanism has no freedom that way\n", ""),
    "ik free.toml --position 30 0 400": (
        1, "stretched out or folded at joint p4; the mechanism has no freedom that way\n", "",
    ),
    "ik free.toml --position 0 10 180 --margins": (0, "\n\nno limits\n", ""),
    "ik plotter.toml --position 0 0 60": (1, "joint C at its maximum 5 mm\n", ""),
    "ik plotter.toml --rpy 0 0 -40 --hold position": (1, "joint C at its minimum -28.6479 deg\n", ""),
    "ik five_bar --rpy 10 0 0": (0, "reached\n", "pfabrik: note: --rpy has no effect: the task is x y z\n"),
    "ik rps --position 5 0 203.835 --rpy 0 0 4": (
        0, "reached\n", f"note: x of --position {NO_EFFECT} z tilt\npfabrik: note: the yaw of --rpy {NO_EFFECT} z tilt",
    ),
    "ik rps --position 0 0 203.835 --rpy 3 0 4": (0, "reached\n", ""),
    "ik stewart --position 0 0 300 --all": (1, "1 working mode, none within all limits\n", ""),
    "ik five_bar --position 0 0 900 --all --hold none": (
        1, "no working mode found\n", "pfabrik: note: --hold has no effect with --all: nothing is projected\n",
    ),
    "ik nrpm --rpy 0 0 0 --all": (
        1, "", "still moves with its end effector on the target (6 freedoms of the actuators A1",
    ),
    "fk stewart 300 300 300 300 300 300": (
        1, f"projected: actuators up to 20 mm from the values asked for; {STRUTS_OUT}\n", "",
    ),
    # the elbows are 320 apart, the forearms reach 290
    "fk free.toml 53 -53": (1, "a parallel singularity\n", ""),
    "fk stewart 20 20 20 20 20 20 --all": (1, "no assembly mode found\n", ""),
    "fk stewart 300 300 300 300 300 300 --all": (1, ", none within all limits\n", ""),
    "fk stewart 280 280 280 280 280 280 --all": (0, "  nothing\n", ""),  # on its limit, not beyond it
    "fk stewart 280.001 280 280 280 280 280 --all": (1, "max of BL1;", ""),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize("line", [pytest.param(line, marks=[pytest.mark.slow] * ("--all" in line)) for line in SAID])
def test_the_command_says_it_in_these_words(run: Callable[..., Result], tmp_path: Path, line: str) -> None:
    pf.save(pf.load("five_bar").without_limits(), tmp_path / "free.toml")
    joints = [
        pf.Joint("X", "prismatic", ("base", "cart"), axis=(1, 0, 0), actuated=True, range=(-50, 50)),
        pf.Joint("C", "cylindrical", ("cart", "tool"), at=(0, 0, 9), axis=(0, 0, 1), range=((-0.5, 0.5), (-5, 5))),
    ]
    pf.save(pf.Mechanism("plotter", joints, "tool", (0, 0, 30)), tmp_path / "plotter.toml")
    result = run(*line.split())
    code, stdout, stderr = SAID[line]
    assert result.exit_code == code
    assert stdout in result.stdout and bool(stdout) == bool(result.stdout)
    told = "".join(line for line in result.stderr.splitlines(keepends=True) if "compiling" not in line)
    assert stderr in told and bool(stderr) == bool(told)


PAGE = re.findall(
    r"^```\n\$ pfabrik ((?:ik|fk|travel) [^\n]*)\n(.*?)^```$", CLI_PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE
)


@pytest.mark.slow
@pytest.mark.parametrize(("line", "expected"), PAGE, ids=[line for line, _ in PAGE])
def test_the_page_of_the_command_line_shows_what_it_prints(
    run: Callable[..., Result], line: str, expected: str
) -> None:
    assert {shown.split()[0] for shown, _ in PAGE} == {"ik", "fk", "travel"}
    assert without_chance(run(*shlex.split(line)).stdout) == without_chance(expected)


def without_chance(text: str) -> list[str]:
    """The lines without the luck of random starts."""
    lucky = re.compile(r"^\d+ starts;.*|\s+\d+(?=\s+(nothing|min of|max of|cone of))")
    return [lucky.sub("", line) for line in text.splitlines()]


@pytest.mark.slow
def test_the_page_of_the_command_line_lists_every_command_with_every_option() -> None:
    rows = [line for line in CLI_PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| `pfabrik ")]
    context = click.Context(main)
    for name in main.list_commands(context):
        command = main.get_command(context, name)
        (row,) = (row.partition("` | ")[0] for row in rows if re.match(rf"\| `pfabrik {name}\b", row))
        for option in (each for each in command.params if isinstance(each, click.Option)):
            assert any(re.search(rf"(?<![-\w]){re.escape(said)}(?![-\w])", row) for said in option.opts), option.opts


def test_json_is_one_object_that_says_what_the_library_does(run: Callable[..., Result]) -> None:
    stewart, bar = pf.load("stewart"), pf.load("five_bar")
    answers = {
        "ik stewart --position 10 0 190 --rpy 0 5 0": pf.solve_ik(
            stewart, pf.pose([10, 0, 190], rpy=[0, 5, 0], degrees=True)
        ),
        f"fk stewart {' '.join(map(str, STRUTS))}": pf.solve_fk(stewart, STRUTS),
    }
    for line, solution in answers.items():
        result = run(*line.split(), "--json")
        assert json.loads(result.stdout) == json.loads(json.dumps(solution.to_dict()))
        assert result.stdout.count("\n") == 1
        assert [np.shape(solution.to_dict()["joints"][name]) for name in ("AL1", "BL1", "CL1")] == [(2,), (), (3,)]
    lists = {
        "ik five_bar --position 0 10 180 --all": pf.working_modes(bar, (0, 10, 180)),
        "fk five_bar -20 20 --all": pf.assembly_modes(bar, np.radians([-20, 20])),
    }
    for line, found in lists.items():
        result = run(*line.split(), "--json")
        answer = json.loads(result.stdout)
        assert answer["modes"] == json.loads(json.dumps([mode.to_dict() for mode in found]))
        assert (answer["hits"], answer["starts"], answer["unseen"]) == (list(found.hits), found.starts, found.unseen)
        assert answer.get("total") == getattr(found, "total", None)
        assert result.stdout.count("\n") == 1


# What it tells


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


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("five_bar", ["2: 2 of the end effector, 0 internal, 0 idle", "0: actuators 2, freedoms 2"]),
        ("stewart", ["6: 6 of the end effector, 0 internal, 0 idle", "0: actuators 6, freedoms 6"]),
        ("nrpm", ["12: 6 of the end effector, 6 internal, 0 idle", "6: actuators 12, freedoms 6"]),
    ],
)
def test_info_counts_mobility_and_redundancy(run: Callable[..., Result], name: str, lines: list[str]) -> None:
    told = dict(line.split(maxsplit=1) for line in run("info", name).stdout.split("\n\n")[0].splitlines()[1:])
    assert [told["mobility"], told["redundancy"]] == lines
    assert "uncontrolled" not in told


@pytest.mark.filterwarnings("always::pfabrik.errors.MobilityWarning")
def test_info_says_what_the_actuators_do_not_hold(run: Callable[..., Result], tmp_path: Path) -> None:
    result = run("info", hexagons(tmp_path / "hexagons.toml"))
    assert re.search(r"^uncontrolled +1 of the freedoms", result.stdout, re.MULTILINE)
    assert "6 actuators leave the end effector 3 freedoms at home" in result.stderr


@pytest.mark.parametrize("name", pf.catalog())
def test_check_says_ok_of_every_machine_supplied(run: Callable[..., Result], name: str) -> None:
    result = run("check", name)
    assert result.exit_code == 0
    assert result.stdout.startswith("ok: ")
    assert result.stderr == ""


FLAP = """
schema = 1
name = "flap"
units = { length = "mm", angle = "deg" }
end_effector = "flap"
reference_point = [100, 0, 0]
task = ["tilt"]

[[joint]]
name = "hinge"
type = "revolute"
connects = ["base", "flap"]
at = [0, 0, 0]
axis = [0, 1, 0]
actuated = true
range = [-30, 30]
"""


def edited(name: str, *changes: tuple[str, str]) -> str:
    """A template's text with some of its lines replaced."""
    text = template(name)
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, flags=re.MULTILINE)
        assert count
    return text


@pytest.mark.parametrize(
    ("name", "changes", "note"),
    [
        (
            "3-RPS",
            [("^task.*$", "")],
            "asks for 6 coordinates, of which the mechanism can vary 3 independently: a task that fits is z tilt",
        ),
        ("5-bar", [(r"range = \[.*\]", "range = [-1, 1]")], "wider than 2 degrees; were radians meant?"),
        ("5-bar", [('angle = "deg"', 'angle = "rad"')], r"were degrees meant?"),
    ],
)
def test_check_notes_what_may_not_be_meant(
    run: Callable[..., Result], tmp_path: Path, name: str, changes: list[tuple[str, str]], note: str
) -> None:
    (tmp_path / "my.toml").write_text(edited(name, *changes), encoding="utf-8")
    result = run("check", "my.toml")
    assert result.exit_code == 0
    assert result.stdout.startswith("ok: ")
    assert note in result.stderr


def with_joints_moved(name: str, offset: float, *joints: str) -> pf.Mechanism:
    """A delta with the feet of some rods moved along them, so that they are longer [length]."""
    mechanism = pf.load(name)
    moved = []
    for joint in mechanism.joints:
        if joint.name in joints:
            foot, head = np.array(joint.at), np.array(mechanism.joint(f"C{joint.name[1:]}").at)
            along = (foot - head) / np.linalg.norm(foot - head)
            joint = dataclasses.replace(joint, at=tuple((foot + offset * along).tolist()))
        moved.append(joint)
    return dataclasses.replace(mechanism, joints=moved)


@pytest.mark.parametrize(
    ("name", "joints", "note"),
    [
        ("delta", ["BL2"], "rods 'rodL2' (255 mm) and 'rodR2' (232 mm) are side by side between 'arm2' and 'platform'"),
        ("linear_delta", ["BR1"], "'rodL1' (273 mm) and 'rodR1' (296 mm) are side by side between 'carriage1'"),
        (
            "linear_delta",
            ["BL3", "BR3"],
            "'rodL3' (296 mm) and 'rodR3' (296 mm): the 4 others alike are 273 mm",
        ),
        ("servo_hexapod", ["BL1"], "rod 'rodL1' (LONGER cm): the 5 others alike are LENGTH cm long"),
    ],
)
def test_check_names_rods_that_are_not_as_long_as_their_neighbours_or_copies(
    run: Callable[..., Result], tmp_path: Path, name: str, joints: list[str], note: str
) -> None:
    mechanism = with_joints_moved(name, 23.0, *joints)
    pf.save(mechanism, tmp_path / "my.toml")
    for what, leg in (("LENGTH", "L2"), ("LONGER", "L1")):
        ends = [mechanism.joint(f"{letter}{leg}").at for letter in "BC"]
        note = note.replace(what, f"{math.dist(*ends):.9g}")
    result = run("check", "my.toml")
    assert result.exit_code == 0
    assert note in result.stderr
    assert result.stderr.count("note:") == 1
    assert note in json.loads(run("check", "my.toml", "--json").stdout)["notes"][0]
    if len(joints) == 1 and name.endswith("delta"):
        refused = run("export", "my.toml", "klipper")
        told = note.removeprefix("rods ").partition(" are side")[0]
        assert refused.exit_code == 2 and told in refused.stderr


def test_rods_between_crosses_of_hinges_are_rods(tmp_path: Path) -> None:
    arm = [pf.Joint("P", "prismatic", ("base", "carriage"), axis=(0, 0, 1), actuated=True)]
    for side, height in (("L", 0.0), ("R", -7.0)):
        y = 20.0 if side == "L" else -20.0
        foot, head = (0, y, 100 + height), (0, y, 0)
        arm += [
            pf.Joint(f"A{side}", "revolute", ("carriage", f"cross{side}"), at=foot, axis=(1, 0, 0)),
            pf.Joint(f"B{side}", "revolute", (f"cross{side}", f"rod{side}"), at=foot, axis=(0, 1, 0)),
            pf.Joint(f"C{side}", "spherical", (f"rod{side}", "platform"), at=head),
        ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mechanism = pf.Mechanism("pair", arm, "platform", (0, 0, 0))
    (pair,) = uneven_rods(mechanism)
    assert [(rod.name, rod.between, rod.length) for rod in pair] == [
        ("rodL", ("carriage", "platform"), 100.0),
        ("rodR", ("carriage", "platform"), 93.0),
    ]


def test_check_does_not_mind_a_hinge_that_tilts_about_one_axis(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "flap.toml").write_text(FLAP, encoding="utf-8")
    assert run("check", "flap.toml").stderr == ""


@pytest.mark.parametrize("name", templates())
def test_check_has_nothing_to_note_of_a_starting_file(run: Callable[..., Result], tmp_path: Path, name: str) -> None:
    (tmp_path / "my.toml").write_text(template(name), encoding="utf-8")
    assert run("check", "my.toml").stderr == ""


def test_machines_of_hundreds_of_legs_are_checked_and_shown_at_once(run: Callable[..., Result], tmp_path: Path) -> None:
    """Freedoms are counted at a cost that grows with the cube of the joints: of so many, they are not."""
    leg = pf.Leg("U-P*-S", base=[100, 0, 0], platform=[50, 10, 180], copies={"count": 100, "axis": (0, 0, 1)})
    machine = pf.Mechanism.from_legs(leg, reference_point=(0, 0, 180))
    pf.save(machine, tmp_path / "many.toml")
    checked = run("check", tmp_path / "many.toml")
    assert checked.exit_code == 0 and checked.stdout.startswith("ok: ")
    assert "freedoms are not counted with more than 200 joints" in checked.stderr
    assert "not counted with more than 200 joints" in run("info", tmp_path / "many.toml").stdout
    assert json.loads(run("info", tmp_path / "many.toml", "--json").stdout)["mobility"] is None


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


@pytest.mark.parametrize(
    "line",
    [
        "ik stewart --position 10 0 190",
        "ik stewart --position 0 0 300",
        "ik delta --position 10 0 -90",
        "plot stewart --position 10 0 190",
        "plot five_bar --position 0 20 170",
        "plot nrpm --position 10 0 200",
        "plot delta --position 10 0 -90",
        "fk five_bar -20 20",
    ],
)
def test_what_is_printed_asks_for_no_joints_that_it_does_not_show(
    run: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    """After installing, their kernels would be compiled for it: longer than all else takes."""

    def unasked(*_: object) -> None:
        raise AssertionError("joint coordinates are worked out")

    monkeypatch.setattr("pfabrik.platform.coordinates.read_coordinates", unasked)
    monkeypatch.setattr("pfabrik.platform.coordinates._closed", unasked)
    assert run(*line.split()).exit_code in (0, 1)


def test_a_projection_names_its_distance_and_the_limits_that_hold_it(run: Callable[..., Result]) -> None:
    first_line = run("ik", "stewart", *BEYOND_REACH).stdout.splitlines()[0]
    solution = pf.solve_ik(pf.load("stewart"), pf.pose([0, 0, 300]))
    assert first_line.startswith(f"projected: {solution.position_error:.3g} mm from the target; ")
    assert all(limit.joint in first_line for limit in solution.active_limits)


def test_the_limits_that_hold_an_answer_back_are_named_the_hardest_first(run: Callable[..., Result]) -> None:
    target = pf.pose([0, 150, 120], rpy=np.radians([8, -5, 0]))
    answer = pf.solve_ik(pf.load("stewart"), target)
    first_line = run("ik", "stewart", "--position", 0, 150, 120, "--rpy", 8, -5, 0).stdout.splitlines()[0]
    named = re.findall(r"\b[ABC][LR][123]\b", first_line)
    hardness = {limit.joint: limit.multiplier for limit in answer.active_limits}
    assert set(named) == set(hardness) and len(named) >= 2
    phrases = [re.findall(r"\b[ABC][LR][123]\b", phrase) for phrase in first_line.split("; ")[1:]]
    hardest = [max(hardness[joint] for joint in phrase) for phrase in phrases]
    assert hardest == sorted(hardest, reverse=True)


def test_what_was_to_be_held_and_is_not_is_said(run: Callable[..., Result]) -> None:
    line = ["ik", "stewart", "--rpy", 70, 0, 0]
    fell_back, free, turned = (
        run(*line, "--hold", hold).stdout.splitlines()[0] for hold in ("orientation", "none", "position")
    )
    said = "no position was found that suits the orientation: both give way"
    assert said in fell_back and " mm and " in fell_back.split(";")[0]
    assert fell_back.replace(f"{said}; ", "") == free
    assert "give way" not in turned and " mm" not in turned.split(";")[0]
    assert run("ik", "five_bar", "--position", 0, 0, 300).stdout.count("give way") == 0


def test_margins_are_listed_the_nearest_limit_first(run: Callable[..., Result]) -> None:
    result = run("ik", "stewart", *BEYOND_REACH, "--margins")
    table = result.stdout.split("\n\n")[-1].splitlines()
    assert table[0].split() == ["joint", "bound", "margin"]
    rows = [(joint, bound, float(margin)) for joint, bound, margin in map(str.split, table[1:])]
    assert [margin for *_, margin in rows] == sorted(margin for *_, margin in rows)
    assert {(joint, bound) for joint, bound, margin in rows if margin == 0.0} == {
        (f"B{side}{leg}", "max") for side in "LR" for leg in (1, 2, 3)
    }
    listed = json.loads(run("ik", "stewart", *BEYOND_REACH, "--margins", "--json").stdout)["margins"]
    assert [limit["joint"] for limit in listed[6:]] == [joint for joint, *_ in rows[6:]]
    assert [limit["margin"] for limit in listed] == pytest.approx([margin for *_, margin in rows], rel=1e-5, abs=1e-7)
    assert len(rows) == 24  # of six strokes, both ends, and twelve cones


def test_forces_that_hold_a_load_are_listed(run: Callable[..., Result]) -> None:
    expected = pf.forces(pf.solve_ik(pf.load("stewart"), [0, 0, 190]), [0, 0, -200, 0, 500, 0]).actuators
    line = ["ik", "stewart", "--position", 0, 0, 190, "--force", 0, 0, -200, "--moment", 0, 500, 0]
    table = run(*line).stdout.split("\n\n")[-1].splitlines()
    assert table[0].split() == ["actuator", "exerts", "unit"]
    assert [float(row.split()[1]) for row in table[1:]] == pytest.approx(expected, rel=1e-5)
    forces = json.loads(run(*line, "--json").stdout)["forces"]
    assert (forces["actuators"], forces["reason"]) == (pytest.approx(expected), "")
    torques = run("ik", "five_bar", "--position", 0, 0, 190, "--force", 0, 0, -20).stdout
    assert torques.rstrip().endswith("force mm")


# Travel


def test_travel_tells_what_the_library_does_in_degrees_and_the_unit_of_length(run: Callable[..., Result]) -> None:
    result = run("travel", "stewart")
    header, *rows = [re.split(r" {2,}", line) for line in result.stdout.splitlines()]
    assert (result.exit_code, header[1:]) == (0, ["x", "y", "z", "travel", "unit", "stopped by"])
    home = pf.solve_ik(pf.load("stewart"), pf.load("stewart").home_pose)
    for row, reach in zip(rows, pf.travel(home), strict=True):
        assert (row[0], [float(part) for part in row[1:4]]) == (reach.kind, list(reach.direction))
        unit, size = ("mm", 1.0) if reach.kind == "along" else ("deg", math.degrees(1.0))
        assert (float(row[4]), row[5]) == (pytest.approx(size * reach.distance, rel=1e-5), unit)
        assert all(limit.joint in row[6] and limit.bound in row[6] for limit in reach.stopped_by)


def test_travel_says_why_where_no_limit_stops_it(run: Callable[..., Result], tmp_path: Path) -> None:
    pf.save(pf.load("five_bar").without_limits(), tmp_path / "free.toml")
    assert run("travel", "free.toml", "--along", 0, 0, 1).stdout.splitlines()[1].endswith("mm    links stretched")
    assert run("travel", "five_bar", "--along", 1, 0, 0).stdout.splitlines()[1].endswith("0  mm    no freedom that way")


def test_travel_starts_where_it_is_told_and_goes_where_it_is_told(run: Callable[..., Result]) -> None:
    line = "travel stewart --position 10 0 200 --rpy 0 5 0 --along 0 -1 -1 --along 1 0 0 --about 0 0 1 --pivot 5 5 0"
    start = pf.solve_ik(pf.load("stewart"), pf.pose([10, 0, 200], rpy=[0, 5, 0], degrees=True))
    expected = pf.travel(start, along=[[0, -1, -1], [1, 0, 0]], about=[0, 0, 1], pivot=[5, 5, 0])
    assert json.loads(run(*line.split(), "--json").stdout) == expected.to_dict()
    ankle = pf.solve_ik(pf.load("ankle_ups"), {"pivot": np.radians([5, 10])})
    found = json.loads(run("travel", "ankle_ups", "--joint", "pivot=5,10", "--json").stdout)
    assert found == pf.travel(ankle).to_dict()
    assert "e-" not in run("travel", "ankle_ups", "--joint", "pivot=5,10").stdout  # directions without dust


def test_travel_without_end_is_unlimited_and_without_freedom_0(run: Callable[..., Result], tmp_path: Path) -> None:
    pf.save(pf.load("stewart").without_limits(), tmp_path / "free.toml")
    line = ("travel", "free.toml", "--along", 0, 0, 1)
    assert run(*line).stdout.splitlines()[1].split() == ["along", "0", "0", "1", "unlimited", "mm"]
    assert json.loads(run(*line, "--json").stdout)["travel"][0]["distance"] is None
    assert run("travel", "five_bar", "--along", 1, 0, 0).stdout.splitlines()[1].split()[4] == "0"


def test_ik_takes_the_coordinates_of_the_joint_that_carries_the_end_effector(run: Callable[..., Result]) -> None:
    result = run("ik", "ankle_ups", "--joint", "pivot=5,10", "--json")
    expected = pf.solve_ik(pf.load("ankle_ups"), {"pivot": np.radians([5, 10])})
    assert (result.exit_code, json.loads(result.stdout)) == (0, json.loads(json.dumps(expected.to_dict())))


def test_ik_takes_the_coordinates_of_joints_in_series(run: Callable[..., Result]) -> None:
    result = run("ik", "g1_ankle", "--joint", "roll_joint=4", "--joint", "pitch_joint=-8", "--json")
    expected = pf.solve_ik(pf.load("g1_ankle"), {"pitch_joint": np.radians(-8), "roll_joint": np.radians(4)})
    assert (result.exit_code, json.loads(result.stdout)) == (0, json.loads(json.dumps(expected.to_dict())))


def test_angles_are_degrees_for_people(run: Callable[..., Result]) -> None:
    solution = pf.solve_ik(pf.load("five_bar"), pf.pose([0, 10, 200]))
    text = run("ik", "five_bar", "--position", 0, 10, 200).stdout
    assert all(f"{math.degrees(angle):.6g}" in text for angle in solution.actuators)


@pytest.mark.parametrize("number", ["nan", "inf", "1e999"])
def test_a_number_that_is_not_finite_is_told_with_its_option(run: Callable[..., Result], number: str) -> None:
    for line in (("ik", "stewart", "--position"), ("ik", "stewart", "--rpy"), ("travel", "stewart", "--along")):
        result = run(*line, 0, number, 0)
        assert result.exit_code == 2
        assert f"'{line[-1]}': found '{number}'; expected a finite number" in result.stderr


def test_rpy_is_the_inverse_of_pose() -> None:
    for rpy in ([0.1, -0.7, 2.0], [3.0, 1.5, -3.0], [0, math.pi / 2, 0.4], [0, -math.pi / 2, 0.4]):
        rotated = pf.pose([0, 0, 0], rpy=rpy)
        np.testing.assert_allclose(pf.pose([0, 0, 0], rpy=to_rpy(rotated[:3, :3])), rotated, atol=1e-12)


def test_a_machine_for_the_closure_engine_is_shown_checked_solved_and_tracked(
    run: Callable[..., Result], tmp_path: Path
) -> None:
    path = upu(tmp_path / "upu.toml")
    (tmp_path / "path.csv").write_text("x,y,z\n0,0,131\n3,4,135\n")
    assert re.search(r"3 +U-P\*-U +legs", run("info", path).stdout)
    checked = run("check", path)
    assert (checked.exit_code, checked.stderr) == (0, "")
    ik, fk = run("ik", path, "--position", 3, 4, 135), run("fk", path, 143.003, 143.365, 145.761)
    assert [result.stdout.splitlines()[0] for result in (ik, fk)] == ["reached"] * 2
    assert run("ik", path, "--position", 0, 0, 400).exit_code == 1
    tracked = run("track", path, "path.csv", "-o", "answers.csv")
    assert (tracked.exit_code, tracked.stdout) == (0, "2 reached\n")
    foot, head = np.array([100, 0, 0]), np.array([50 + 3, 4, 135])
    assert float(rows_of(tmp_path / "answers.csv")[1]["actuator_B1"]) == pytest.approx(np.linalg.norm(head - foot))


# Forward kinematics


@pytest.mark.parametrize("target", [(10, 0, 190), (0, -15, 200)])
@pytest.mark.parametrize("name", ["stewart", "five_bar"])
def test_fk_undoes_ik(run: Callable[..., Result], name: str, target: tuple[float, ...]) -> None:
    target = (0, *target[1:]) if name == "five_bar" else target
    solution = pf.solve_ik(pf.load(name), pf.pose(target))
    shown = np.degrees(solution.actuators) if name == "five_bar" else solution.actuators
    result = run("fk", name, *map(repr, shown.tolist()), "--json")
    assert result.exit_code == 0
    np.testing.assert_allclose(json.loads(result.stdout)["pose"], solution.pose, rtol=0, atol=1e-6)


def test_fk_takes_negative_numbers_for_numbers(run: Callable[..., Result]) -> None:
    expected = run("fk", "five_bar", "--json", "--", -20, "-3e-1")
    assert expected.exit_code == 0
    for line in ([-20, -0.3, "--json"], ["--json", "-2e1", "-.3"]):
        assert run("fk", "five_bar", *line).stdout == expected.stdout
    p1, p5 = json.loads(expected.stdout)["actuators"]
    assert (p1, p5) == pytest.approx((math.radians(-20), math.radians(-0.3)), abs=1e-12)


@pytest.mark.slow
def test_fk_tells_lengths_and_angles_apart(run: Callable[..., Result]) -> None:
    first_line = run("fk", "nrpm", *[0] * 12).stdout.splitlines()[0]
    solution = pf.solve_fk(pf.load("nrpm"), np.zeros(12))
    turned, moved = math.degrees(abs(solution.actuators[:3]).max()), abs(solution.actuators[3:]).max()
    assert f"actuators up to {turned:.3g} deg and {moved:.3g} mm from the values asked for; " in first_line
    assert all(limit.joint in first_line for limit in solution.active_limits)


@pytest.mark.slow
@pytest.mark.parametrize("value", ["1e150", "-1e12", "0", "5e-324"])
@pytest.mark.parametrize("name", pf.catalog())
def test_any_finite_actuator_values_get_an_answer(run: Callable[..., Result], name: str, value: str) -> None:
    result = run("fk", name, *[value] * len(pf.load(name).actuator_names), "--json")
    status = json.loads(result.stdout)["status"]
    assert (result.exit_code, status) in ((0, "REACHED"), (1, "PROJECTED"), (1, "FAILED"))


@pytest.mark.slow
def test_fk_lists_every_assembly_mode_and_the_limits_it_exceeds(run: Callable[..., Result]) -> None:
    result = run("fk", "five_bar", -20, 20, "--all")
    assert result.exit_code == 0
    count, table, searched = result.stdout.strip().split("\n\n")
    assert count == "2 assembly modes, 1 within all limits"
    turn = math.radians(-20)  # of a crank of (-66, 88) about (-50, 0); the forearms, of 145, meet on the z axis
    y = -50 - 66 * math.cos(turn) - 88 * math.sin(turn)
    z = -66 * math.sin(turn) + 88 * math.cos(turn)
    heights = [f"{z + side * math.sqrt(145**2 - y**2):.6g}" for side in (1, -1)]
    modes = [line.split(maxsplit=8) for line in table.splitlines()[1:]]
    assert [mode[:4] for mode in modes] == [["1", "0", "0", heights[0]], ["2", "0", "0", heights[1]]]
    assert [mode[8] for mode in modes] == ["nothing", "min of p2; max of p4"]
    found = pf.assembly_modes(pf.load("five_bar"), np.radians([-20, 20]))
    assert [int(mode[7]) for mode in modes] == list(found.hits)
    assert searched.startswith(f"{found.starts} starts; ")
    assert searched.endswith(f" {found.unseen:.2%}")


@pytest.mark.slow
def test_a_mode_beyond_limits_says_which() -> None:
    _, below = pf.assembly_modes(pf.load("five_bar"), np.radians([-20, 20]))
    expected = "exceeded: assembled, but beyond limits: min of p2; max of p4"
    assert as_sentence(below) == expected


@pytest.mark.slow
@pytest.mark.filterwarnings("always::pfabrik.errors.MobilityWarning")
def test_a_continuum_of_solutions_is_told_in_one_line(run: Callable[..., Result], tmp_path: Path) -> None:
    path = hexagons(tmp_path / "hexagons.toml")
    for options in (["--all"], ["--all", "--json"]):
        result = run("fk", path, *[157] * 6, *options)
        assert (result.exit_code, result.stdout) == (1, "")
        warning, told = result.stderr.splitlines()
        assert warning.startswith("pfabrik: warning: ")
        assert told.startswith("pfabrik: 'similar hexagons' still moves with its actuators locked")


@pytest.mark.slow
def test_ik_lists_every_working_mode_and_the_limits_it_exceeds(run: Callable[..., Result]) -> None:
    result = run("ik", "five_bar", "--position", 0, 10, 180, "--all")
    assert result.exit_code == 0
    count, table, searched = result.stdout.strip().split("\n\n")
    assert count == "4 working modes, 1 within all limits"
    turns = []  # of cranks of (∓66, 88) about (∓50, 0), whose forearms of 145 end in (10, 180)
    for side in (-1, 1):
        reach = np.array([10 - 50 * side, 180])
        bend = math.acos((110**2 + reach @ reach - 145**2) / (2 * 110 * np.linalg.norm(reach)))
        angles = math.atan2(reach[1], reach[0]) + np.array([bend, -bend]) - math.atan2(88, 66 * side)
        turns.append([f"{math.degrees((angle + math.pi) % math.tau - math.pi):.6g}" for angle in angles])
    rows = [line.split(maxsplit=4) for line in table.splitlines()[1:]]
    assert {(row[1], row[2]) for row in rows} == set(itertools.product(*turns))
    assert [row[0] for row in rows] == ["1", "2", "3", "4"]
    assert rows[0][4] == "nothing"
    assert all("p" in row[4] for row in rows[1:])
    found = pf.working_modes(pf.load("five_bar"), (0, 10, 180))
    assert [int(row[3]) for row in rows] == list(found.hits)
    assert searched.startswith(f"{found.starts} starts; ")


@pytest.mark.slow
def test_ik_all_shows_the_pose_that_a_task_leaves_open(run: Callable[..., Result]) -> None:
    result = run("ik", "rps", "--rpy", 3, 0, 0, "--all")
    header, first, *_ = result.stdout.split("\n\n")[1].splitlines()
    assert header.split()[:9:2] == ["mode", "[mm]", "[mm]", "[mm]", "[mm]"]
    assert first.endswith("nothing")
    for column in ("x [mm]", "z [mm]", "roll [deg]", "yaw [deg]"):
        assert column in header


def test_a_list_that_was_cut_says_so() -> None:
    found = pf.working_modes(pf.load("serial_arm"), pf.load("serial_arm").home_pose, most_starts=512)
    cut = dataclasses.replace(found, modes=found.modes[:1], hits=found.hits[:1])
    assert str(cut).startswith("2 working modes, of the 1 nearest to home 1 within all limits\n")


# A file to start from


@pytest.mark.parametrize("name", templates())
def test_every_starting_file_is_a_machine_that_stands_at_home(
    run: Callable[..., Result], tmp_path: Path, name: str
) -> None:
    result = run("new", name, "-o", "my.toml")
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout == "wrote my.toml; next: edit it, then pfabrik check my.toml\n"
    checked = run("check", "my.toml")
    assert checked.stdout.startswith("ok: My ") and checked.stderr == ""
    mechanism = pf.load("my.toml")  # warnings are errors here: its actuators hold it
    assert pf.solve_ik(mechanism, mechanism.home_pose).status == pf.Status.REACHED
    assert os.listdir(tmp_path) == ["my.toml"]


@pytest.mark.parametrize("name", templates())
def test_every_starting_file_has_room_around_home(name: str) -> None:
    mechanism = loads(template(name))
    if "rotation" in mechanism.task:
        moved = np.array(mechanism.home_pose)
        moved[:2, 3] += 0.02 * mechanism.characteristic_length
    elif "tilt" in mechanism.task:
        moved = pf.pose(mechanism.reference_point, rpy=[0.02, 0.02, 0])
        moved[2, 3] += 0.02 * mechanism.characteristic_length
    else:
        moved = np.array(mechanism.home_pose)
        moved[:2, 3] += 0.02 * mechanism.characteristic_length
    solution = pf.solve_ik(mechanism, moved)
    assert solution.status == pf.Status.REACHED
    low, high = np.array([mechanism.joint(actuator).range for actuator in mechanism.actuator_names]).T
    assert (solution.actuators > low).all() and (solution.actuators < high).all()
    assert pf.mobility(mechanism).uncontrolled == 0


def test_a_starting_file_is_named_as_its_text_begins(run: Callable[..., Result]) -> None:
    assert {"6-UPS", "6-RUS", "6-PUS", "3-RPS", "3-PRS", "3-RRS", "3-RPR", "3-RRR", "5-bar", "ankle"} <= set(
        templates()
    )
    rows = run("new", "--list").stdout.splitlines()[1:]
    assert [row.split()[0] for row in rows] == list(templates())
    for name, row in zip(templates(), rows, strict=True):
        assert template(name).startswith(f"# {name}: {row.split(maxsplit=1)[1]}\n")
        if name[1:2] == "-" and name[2:].isupper():
            chains = [str(chain) for chain in pf.decompose(loads(template(name)))]
            assert [chain.replace("-", "").replace("*", "") for chain in chains] == [name[2:]] * int(name[0])


def test_a_starting_file_is_printed_where_no_file_is_named(run: Callable[..., Result], tmp_path: Path) -> None:
    result = run("new", "6-ups")
    assert result.stdout == template("6-UPS") and os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    "line, found",
    [
        ("info st", ["stewart"]),
        ("ik serv", ["servo_hexapod"]),
        ("new 6-", ["6-PUS", "6-RUS", "6-UPS"]),
        ("new --from agi", ["agile_eye"]),
        ("tra", ["track", "travel"]),
    ],
)
def test_names_of_machines_and_kinds_are_completed(line: str, found: list[str]) -> None:
    words = ["pfabrik", *line.split(" ")]
    asked = {"_PFABRIK_COMPLETE": "bash_complete", "COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
    with in_process(env=os.environ | asked, stdout=subprocess.PIPE) as process:
        told = process.communicate()[0]
    assert [each.removeprefix("plain,") for each in told.split()] == found
    assert "_PFABRIK_COMPLETE=bash_source" in (Path(__file__).parents[1] / "docs" / "cli.md").read_text()


def test_dimensions_of_a_starting_file_are_options(run: Callable[..., Result], tmp_path: Path) -> None:
    assert (
        run(
            "new",
            "linear-delta",
            "--arm-length",
            "300",
            "--platform-radius=30",
            "--position-endstop",
            "-5",
            "-o",
            "my.toml",
        ).exit_code
        == 0
    )
    machine, usual = pf.load("my.toml"), loads(template("linear-delta"))
    assert machine == usual.with_dimensions(arm_length=300, platform_radius=30, position_endstop=-5)
    upper, lower = (np.array(machine.joint(name).at) for name in ("UpperL1", "LowerL1"))
    assert np.linalg.norm(upper - lower) == pytest.approx(300)
    assert run("new", "hexapod").stdout == template("6-UPS")


@pytest.mark.parametrize("given", [{}, {"--crank": 90, "--forearm": 160}, {"--crank": 130, "--crank-angle": 110}])
def test_elbows_of_a_starting_file_stop_before_they_are_stretched_or_folded(
    run: Callable[..., Result], given: dict[str, float]
) -> None:
    """The angle between crank and forearm, measured on the points of the joints, is 40 and 170 degrees at the stops."""
    machine = loads(run("new", "5-bar", *(str(word) for pair in given.items() for word in pair)).stdout)
    shaft, elbow, tip = (np.array(machine.joint(name).at) for name in ("MotorL", "ElbowL", "Tip"))
    crank, forearm = elbow - shaft, tip - elbow
    bend = math.degrees(math.acos(crank @ forearm / (np.linalg.norm(crank) * np.linalg.norm(forearm))))
    assert np.degrees(machine.joint("ElbowL").range) + 170.0 == pytest.approx([bend, bend + 170.0 - 40.0])
    assert machine.joint("ElbowR").range == pytest.approx(-np.array(machine.joint("ElbowL").range)[::-1])


def test_a_starting_file_of_a_printer_has_klipper_s_words(run: Callable[..., Result], tmp_path: Path) -> None:
    settings = {"delta_radius": 105.5, "arm_length": 262.25, "position_endstop": 141.75}
    options = [str(word) for name, value in settings.items() for word in ("--" + name.replace("_", "-"), value)]
    run("new", "linear-delta", *options, "-o", "my.toml")
    written = dict(re.findall(r"^(\w+): (\S+)", run("export", "my.toml", "klipper").stdout, re.MULTILINE))
    assert {name: float(written[name]) for name in settings} == settings


def test_kinds_are_listed_for_programs_too(run: Callable[..., Result]) -> None:
    assert list(json.loads(run("new", "--list", "--json").stdout)) == list(templates())
    assert run("new", "delta", "--json").exit_code == 2


def test_new_alone_lists_the_kinds(run: Callable[..., Result], tmp_path: Path) -> None:
    result = run("new")
    assert (result.exit_code, result.stdout) == (0, run("new", "--list").stdout)
    assert "pfabrik new KIND -o FILE" in result.stderr
    assert os.listdir(tmp_path) == []


def test_an_option_without_its_values_is_told_as_its_commands(run: Callable[..., Result]) -> None:
    assert run("travel", "stewart", "--along", "1").stderr.endswith("travel --help')\n")


def test_a_file_that_exists_is_kept_unless_forced(run: Callable[..., Result], tmp_path: Path) -> None:
    path = tmp_path / "my.toml"
    path.write_text("mine")
    result = run("new", "delta", "-o", path)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"pfabrik: {path}: exists already; --force replaces it\n"
    assert path.read_text() == "mine"
    assert run("new", "delta", "-o", path, "--force").exit_code == 0
    assert path.read_text(encoding="utf-8") == template("delta")


@pytest.mark.parametrize(
    ("line", "told"),
    [
        (["6-UPX"], "no template named '6-UPX'; did you mean '6-UPS'? (known: 3-PRS, "),
        (["dleta", "-o", "my.toml"], "did you mean 'delta'?"),
        (["-o", "my.toml"], "one KIND of 3-PRS, "),
        (["delta", "-o", "no/such/my.toml"], "no/such/my.toml: No such file or directory"),
        (["delta", "--rods", "3"], "no dimension or option named '--rods'; did you mean '--rod'?"),
        (["delta", "--fore"], "did you mean '--force'?"),
        (["delta", "--rod", "long"], "--rod: found 'long'; expected a number"),
        (["delta", "--rod"], "--rod: found ''; expected a number"),
        (["delta", "--rod", "100"], "dimensions.height: found 'sqrt(rod**2 - across**2)', which has no finite value"),
        (["delta", "more"], "unexpected extra argument (more)"),
    ],
)
def test_wrong_starting_files_are_told_in_a_line(
    run: Callable[..., Result], tmp_path: Path, line: list[str], told: str
) -> None:
    result = run("new", *line)
    assert (result.exit_code, result.stdout) == (2, "")
    assert len(result.stderr.splitlines()) == 1 and told in result.stderr
    assert os.listdir(tmp_path) == []


def test_the_page_of_the_command_line_lists_the_starting_files(run: Callable[..., Result]) -> None:
    (shown,) = re.findall(
        r"^```\n\$ pfabrik new --list\n(.*?)^```$", CLI_PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE
    )
    assert run("new", "--list").stdout == shown


# Paths


def test_track_answers_every_target(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z,roll,pitch,yaw\n0,0,190,0,0,0\n5,0,190,0,5,0\n\n0,0,300,0,0,0\n")
    result = run("track", "stewart", "path.csv", "-o", "answers.csv")
    assert result.exit_code == 1
    assert result.stdout.splitlines() == [result.stdout.strip()]
    rows = rows_of(tmp_path / "answers.csv")
    assert [row["status"] for row in rows] == ["REACHED", "REACHED", "PROJECTED"]
    assert float(rows[1]["target_pitch_deg"]) == pytest.approx(5, abs=1e-12)
    assert float(rows[1]["pitch_deg"]) == pytest.approx(5, abs=1e-7)
    assert "max" in rows[2]["active_limits"]
    assert set(os.listdir(tmp_path)) == {"answers.csv", "path.csv"}


def test_track_writes_angles_in_the_unit_they_came_in(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "deg.csv").write_text("\ufeffx, y, z\r\n0, 10, 200\r\n", encoding="utf-8")
    (tmp_path / "rad.csv").write_text("x,y,z,roll_rad,pitch_rad,yaw_rad\n0,10,200,0,0,0\n")
    answer = pf.track(pf.load("five_bar"), np.array([[0.0, 10.0, 200.0]]))
    for unit, expected in (("deg", np.degrees(answer.actuators[0])), ("rad", answer.actuators[0])):
        assert run("track", "five_bar", f"{unit}.csv", "-o", "answers.csv").exit_code == 0
        row = rows_of(tmp_path / "answers.csv")[0]
        np.testing.assert_allclose([float(row[f"actuator_{name}_{unit}"]) for name in ("p1", "p5")], expected, 1e-15)


def quick_path(folder: Path) -> Path:
    """Two places 10 apart: the struts of a Stewart platform differ there by what Pythagoras says."""
    path = folder / "path.csv"
    path.write_text("x,y,z\n0,0,195\n0,0,205\n0,0,205\n")
    return path


def test_text_that_a_spreadsheet_would_run_goes_out_as_text(run: Callable[..., Result], tmp_path: Path) -> None:
    joints = [dataclasses.replace(joint, name=f"={joint.name}") for joint in pf.load("five_bar").joints]
    along = [dataclasses.replace(joint, along=None) for joint in joints]
    pf.save(dataclasses.replace(pf.load("five_bar"), joints=along, end_effector="=p3"), tmp_path / "arm.toml")
    (tmp_path / "path.csv").write_text("x,y,z,@note\n0,10,200,=1+1\n0,10,900,-5\n")
    assert run("track", "arm.toml", "path.csv", "-o", "answers.csv").exit_code == 1
    with (tmp_path / "answers.csv").open(newline="", encoding="utf-8") as handle:
        cells = {cell for row in csv.reader(handle) for cell in row if cell[:1] in ("=", "@", "+", "-")}
    assert all(math.isfinite(float(cell)) for cell in cells)
    rows = rows_of(tmp_path / "answers.csv")
    assert [row["'@note"] for row in rows] == ["'=1+1", "-5"]
    assert {row["margin_of"][:2] for row in rows} == {"'="}
    again = pf.read_path(tmp_path / "answers.csv", pf.load("five_bar"))
    assert list(again.others["@note"]) == ["=1+1", "-5"]
    assert {name[:1] for name in again.others["margin_of"]} == {"="}


def test_track_names_the_actuators_that_are_too_fast(run: Callable[..., Result], tmp_path: Path) -> None:
    path = quick_path(tmp_path)
    foot, head = np.array([100, 20]), np.array([40, 40])
    lengths = [math.hypot(*(head - foot), height) for height in (195, 205)]
    fastest = (lengths[1] - lengths[0]) / 0.5
    line = ["track", "stewart", path, "-o", "answers.csv", "--sample-time", 0.5]
    for speeds, named in (
        ([f"{1.001 * fastest}"], []),
        ([f"BL2={0.999 * fastest}"], ["BL2"]),
        ([f"{0.999 * fastest}", f"BL2={1.001 * fastest}"], ["BL1", "BL3", "BR1", "BR2", "BR3"]),
        ([f"BL2={1.001 * fastest}", f"{0.999 * fastest}"], ["BL1", "BL3", "BR1", "BR2", "BR3"]),
    ):
        result = run(*line, *(word for speed in speeds for word in ("--speed", speed)))
        rows = rows_of(tmp_path / "answers.csv")
        assert [row["too_fast"] for row in rows] == ["", "; ".join(named), ""]
        assert result.exit_code == (1 if named else 0)
        assert result.stdout.strip().split("; ") == [
            "3 reached",
            *(f"{name} too fast: {fastest:.3g} mm/s (target 2)" for name in named),
        ]


def test_speeds_of_angles_are_in_degrees(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,0,175\n0,10,180\n")
    p1, p5 = np.degrees(pf.solve_ik(pf.load("five_bar"), (0, 10, 180)).actuators)  # from home, where both are 0
    line = ["track", "five_bar", "path.csv", "-o", "answers.csv", "--sample-time", 1]
    between = 0.5 * (abs(p1) + abs(p5))
    name, fastest = ("p1", abs(p1)) if abs(p1) > abs(p5) else ("p5", abs(p5))
    result = run(*line, "--speed", between)
    assert result.stdout == f"2 reached; {name} too fast: {fastest:.3g} deg/s (target 2)\n"
    assert run(*line, "--speed", f"{name}={1.001 * fastest}").exit_code == 0


@pytest.mark.slow
def test_track_tells_where_answers_leap(run: Callable[..., Result], tmp_path: Path) -> None:
    """A two-link arm, whose hole of radius 1 a target crosses along a diameter."""
    joints = [
        pf.Joint("j1", "revolute", ("base", "upper"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        pf.Joint("j2", "revolute", ("upper", "lower"), at=(3, 0, 0), axis=(0, 0, -1), actuated=True),
        pf.Joint("tip", "revolute", ("lower", "tool"), at=(3, 2, 0), axis=(0, 0, 1)),
    ]
    pf.save(pf.Mechanism("two-link arm", joints, "tip"), tmp_path / "arm.toml")
    x = [3, 2, 1.5, 1.1, 0.75, 0.5, 0.25, -0.25, -0.5, -0.75]
    (tmp_path / "path.csv").write_text("x,y,z\n" + "".join(f"{each},0,0\n" for each in x))
    result = run("track", "arm.toml", "path.csv", "-o", "answers.csv")
    assert [row["jump"] for row in rows_of(tmp_path / "answers.csv")] == ["0"] * 7 + ["1"] + ["0"] * 2
    assert "; 1 jump (target 8)" in result.stdout


def test_a_tilt_that_a_yaw_leaves_out_is_not_dropped_silently(run: Callable[..., Result], tmp_path: Path) -> None:
    pf.save(closure.scara(), tmp_path / "scara.toml")
    at = ("ik", "scara.toml", "--position", 350, 50, 0, "--rpy")
    assert run(*at, 0, 0, 20).stderr == ""
    assert "the tilt in --rpy has no effect: the task is x y z yaw" in run(*at, 5, 0, 20).stderr
    (tmp_path / "path.csv").write_text("x,y,z,roll,pitch,yaw\n350,50,0,0,0,5\n350,50,0,0,3,5\n")
    said = run("track", "scara.toml", "path.csv", "-o", "answers.csv").stderr
    assert [name for name in ("roll", "pitch", "yaw") if f"column {name} has no effect" in said] == ["roll", "pitch"]
    assert run("check", "scara.toml").stderr == ""


def test_columns_that_the_task_leaves_out_are_not_dropped_silently(run: Callable[..., Result], tmp_path: Path) -> None:
    height = pf.load("rps").reference_point[2]
    (tmp_path / "path.csv").write_text(f"x,y,z\n0,0,{height}\n0,3,{height + 1}\n")
    said = run("track", "rps", "path.csv", "-o", "answers.csv").stderr
    assert "pfabrik: note: column y has no effect: the task is z tilt\n" in said
    (tmp_path / "path.csv").write_text("x,y,z,roll,pitch,yaw\n0,0,190,0,0,5\n")
    said = run("track", "delta", "path.csv", "-o", "answers.csv").stderr
    for name in ("roll", "pitch", "yaw"):
        assert f"pfabrik: note: column {name} has no effect: the task is x y z\n" in said
    assert "note" not in run("track", "stewart", "path.csv", "-o", "answers.csv").stderr


@pytest.mark.parametrize(
    ("speed", "told"),
    [
        (["--speed", "10"], "--speed says nothing without --sample-time"),
        (["--sample-time", "1", "--speed", "p2=10"], "no actuator 'p2' (known: p1, p5)"),
        (["--sample-time", "1", "--speed", "p1="], "found ''; expected a positive number"),
        (["--sample-time", "1", "--speed", "fast"], "found 'fast'; expected a positive number"),
        (["--sample-time", "1", "--speed", "0"], "found '0'; expected a positive number"),
        (["--sample-time", "1", "--speed", "p1=-3"], "found '-3'; expected a positive number"),
        (["--sample-time", "1", "--speed", "p1=nan"], "found 'nan'; expected a positive number"),
        (["--sample-time", "0"], "sample_time"),
        (["--sample-time", "inf"], "--sample-time"),
        (["--sample-time", "soon"], "--sample-time"),
    ],
)
def test_wrong_speeds_are_told_in_a_line(
    run: Callable[..., Result], tmp_path: Path, speed: list[str], told: str
) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    result = run("track", "five_bar", "path.csv", "-o", "answers.csv", *speed)
    assert (result.exit_code, result.stdout) == (2, "")
    assert told in result.stderr and result.stderr.count("\n") == 1
    assert os.listdir(tmp_path) == ["path.csv"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "empty"),
        ("\n\n", "empty"),
        ("x,y,z\n", "no targets"),
        ("x,y\n1,2\n", "no column z"),
        ("x y z\n1 2 3\n", "with commas between"),
        ("x,y,z,x\n1,2,3,4\n", "'x' appears twice"),
        ("x,y,z\n1,2,3\n1,b,3\n", "line 3: column 'y': found 'b'"),
        ("x,y,z\n1,2,nan\n", "line 2: column 'z': found 'nan'"),
        ("x,y,z\n1,2,1e999\n", "found '1e999'"),
        ("x,y,z\n1,2\n", "line 2: found 2 cells; expected 3"),
        ("1,2,3\n", "line 1: no column y, z"),
        ('x,y,z\n1,2,"' + "9" * 200_000 + '"\n', "line 2: no text of a path"),
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
    assert "no text of a path" in result.stderr


def test_many_faults_are_told_in_one_line(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n" + "1,2,?\n" * 1000)
    result = run("track", "five_bar", "path.csv", "-o", "answers.csv")
    assert result.stderr.splitlines() == [result.stderr.strip()]
    assert "line 2: column 'z': found '?'" in result.stderr


def test_what_stood_in_the_output_stays_when_the_work_fails(
    run: Callable[..., Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    (tmp_path / "answers.csv").write_text("precious")

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pfabrik.cli.track_report.TrackRows.write", interrupted)
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


@pytest.fixture
def linked(tmp_path: Path) -> dict[str, bytes]:
    """A machine and a path with links to them, and what they hold."""
    pf.save(pf.load("five_bar"), tmp_path / "arm.toml")
    (tmp_path / "path.csv").write_text("y,z\n0,170\n")
    (tmp_path / "soft.csv").symlink_to("path.csv")
    (tmp_path / "soft.toml").symlink_to("arm.toml")
    os.link(tmp_path / "path.csv", tmp_path / "hard.csv")
    return {each.name: each.read_bytes() for each in tmp_path.iterdir()}


@pytest.mark.parametrize("output", ["path.csv", "./path.csv", "soft.csv", "hard.csv", "arm.toml", "soft.toml"])
@pytest.mark.parametrize("read", [("arm.toml", "path.csv"), ("soft.toml", "soft.csv")])
def test_nothing_that_is_read_is_overwritten(
    run: Callable[..., Result], tmp_path: Path, linked: dict[str, bytes], read: tuple[str, str], output: str
) -> None:
    result = run("track", *read, "-o", output)
    assert result.exit_code == 2
    assert "found a file that was read" in result.stderr
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == linked


@pytest.mark.parametrize("line", [("arm.toml", "-", "-o", "hard.csv"), ("-", "path.csv", "-o", "soft.toml")])
def test_a_file_on_standard_input_is_not_overwritten(
    tmp_path: Path, linked: dict[str, bytes], line: tuple[str, ...]
) -> None:
    name = "arm.toml" if line[0] == "-" else "path.csv"
    with (tmp_path / name).open() as file, in_process("track", *line, stdin=file, cwd=tmp_path) as process:
        told = process.communicate()[1]
    assert process.returncode == 2
    assert "found a file that was read" in told
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == linked


def test_an_output_that_is_a_link_or_a_device_stays_one(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    (tmp_path / "link.csv").symlink_to("answers.csv")
    assert run("track", "five_bar", "path.csv", "-o", "link.csv").exit_code == 0
    assert (tmp_path / "link.csv").is_symlink()
    assert len(rows_of(tmp_path / "answers.csv")) == 1
    assert run("track", "five_bar", "path.csv", "-o", os.devnull).exit_code == 0
    assert not Path(os.devnull).is_file()


def test_a_link_that_is_written_through_is_told_and_one_in_circles_refused(
    run: Callable[..., Result], tmp_path: Path
) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    (tmp_path / "link.csv").symlink_to("answers.csv")
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    said = run("track", "five_bar", "path.csv", "-o", "link.csv").stderr
    assert f"pfabrik: note: link.csv is a link; {tmp_path / 'answers.csv'} is written\n" in said
    assert "is a link" not in run("track", "five_bar", "path.csv", "-o", "answers.csv").stderr
    refused = run("track", "five_bar", "path.csv", "-o", "loop.csv")
    assert (refused.exit_code, (tmp_path / "loop.csv").is_symlink()) == (2, True)
    assert "loop.csv: Too many levels of symbolic links" in refused.stderr


@pytest.mark.parametrize(
    "line",
    [
        "track five_bar path.csv -o a.png --plot a.png",
        "track five_bar path.csv -o a.png --plot ./a.png",
        "track five_bar path.csv -o {folder}/a.png --plot a.png",
        "track five_bar path.csv -o same/a.png --plot a.png",
        "track five_bar path.csv -o a.png --plot link.png",
        "track five_bar path.csv -o there.png --plot hard.png",
        "track five_bar path.csv --plot a.png --animate link.gif",
        "workspace five_bar -o a.csv -o ./a.csv",
    ],
)
def test_two_outputs_to_one_place_are_refused(run: Callable[..., Result], tmp_path: Path, line: str) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    (tmp_path / "there.png").write_text("precious")
    os.link(tmp_path / "there.png", tmp_path / "hard.png")
    (tmp_path / "same").symlink_to(".")
    for link in ("link.png", "link.gif"):
        (tmp_path / link).symlink_to("a.png")
    before = sorted(os.listdir(tmp_path))
    result = run(*line.format(folder=tmp_path).split())
    assert result.exit_code == 2
    assert "found one place for two outputs" in result.stderr
    assert sorted(os.listdir(tmp_path)) == before
    assert (tmp_path / "there.png").read_text() == "precious"


def test_names_that_differ_by_case_are_one_place_where_the_file_system_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blind = (tmp_path / "A.Png").exists() if (tmp_path / "a.png").write_text("") == 0 else False
    assert ignores_case(tmp_path) == blind
    for answer in (False, True):
        monkeypatch.setattr(outputs, "ignores_case", lambda _, answer=answer: answer)
        assert outputs.is_one_place(tmp_path / "out.csv", tmp_path / "OUT.csv") == answer
        assert not outputs.is_one_place(tmp_path / "out.csv", tmp_path / "other.csv")


def test_standard_output_that_is_a_file_is_not_written_twice(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n0,10,200\n")
    with (tmp_path / "a.csv").open("w") as handle:
        line = ("track", "five_bar", "path.csv", "-o", "a.csv", "--json")
        with in_process(*line, stdout=handle, cwd=tmp_path) as process:
            assert "found one place for two outputs" in process.communicate(timeout=60)[1]
    assert process.returncode == 2


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
        (["ik", "stewart", *WITHIN_REACH, "--all", "--margins"], "--margins is of one answer"),
        (["ik", "stewart", *WITHIN_REACH, "--all", "--force", "0", "0", "1"], "--force and --moment are of one answer"),
        (["ik", "stewart", *WITHIN_REACH, "--force", "0", "0", "nan"], "a number that is not finite"),
        (["ik", "five_bar", "--position", "0", "0", "190", "--moment", "0", "0", "1"], "the end effector is a joint"),
        (["ik", "ankle_ups", "--joint", "pivot"], "found 'pivot'; expected NAME=VALUE"),
        (["ik", "ankle_ups", "--joint", "pivot=5,nan"], "expected NAME=VALUE[,VALUE...] with finite numbers"),
        (["ik", "ankle_ups", "--joint", "pivot=5"], "found 1 value; expected 2"),
        (["ik", "ankle_ups", "--joint", "pivt=5,10"], "did you mean 'pivot'"),
        (["ik", "ankle_ups", "--joint", "BL=100"], "expected a pose, or those of joints in series"),
        (["ik", "ankle_ups", "--joint", "pivot=5,10", "--joint", "pivot=5,10"], "found 'pivot' twice"),
        (["ik", "ankle_ups", "--joint", "pivot=5,10", "--rpy", "0", "0", "0"], "--joint says it all"),
        (["travel", "stewart", "--position", "0", "0", "900"], "cannot start there: projected"),
        (["travel", "stewart", "--along", "0", "0", "0"], "along"),
        (["travel", "stewart", "--about", "0", "nan", "0"], "--about"),
        (["travel", "stewart", "--pivot", "0", "0"], "--pivot"),
        (["travel", "agile_eye", "--along", "0", "0", "1"], "within the task"),
        (["fk"], "MECH"),
        (["fk", "stewrt", "1"], "did you mean 'stewart'"),
        (["fk", "nowhere/machine.toml", "1"], "machine.toml"),
        (["fk", "five_bar"], "found 0 values; expected 2: p1 [deg], p5 [deg]"),
        (["fk", "five_bar", "1", "2", "3"], "found 3 values; expected 2: p1 [deg], p5 [deg]"),
        (["fk", "stewart", "1"], "expected 6: BL1 [mm], BL2 [mm]"),
        (["fk", "five_bar", "1", "abc"], "found 'abc'; expected a finite number"),
        (["fk", "five_bar", "1", ""], "found ''"),
        (["fk", "five_bar", "1", "nan"], "found 'nan'"),
        (["fk", "five_bar", "1", "-inf"], "found '-inf'"),
        (["fk", "five_bar", "1", "1e999"], "found '1e999'"),
        (["fk", "five_bar", "1", "2,5"], "found '2,5'"),
        (["fk", "five_bar", "1", "2", "--jsn"], "found '--jsn'; expected a finite number, or an option"),
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
@pytest.mark.parametrize("name", ["five_bar", "nrpm", "stewart"])
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
@pytest.mark.parametrize(
    ("line", "closed", "code", "said"),
    [
        ("catalog", ">&-", 2, "pfabrik: Bad file descriptor\n"),
        ("new 6-UPS", ">&-", 2, "pfabrik: Bad file descriptor\n"),
        ("info - --json", "<&-", 2, "pfabrik: Bad file descriptor\n"),
        ("catalog", "2>&-", 0, ""),
        ("info nowhere.toml", "2>&-", 2, ""),
        ("new 6-UPS", "> /dev/full", 2, "pfabrik: No space left on device\n"),
    ],
)
@pytest.mark.skipif(sys.platform != "linux", reason="needs a shell, and /dev/full")
def test_closed_streams_and_full_disks_are_told_in_a_line(line: str, closed: str, code: int, said: str) -> None:
    command = f"{shlex.quote(sys.executable)} -m pfabrik {line} {closed}"
    ran = subprocess.run(["sh", "-c", command], text=True, capture_output=True)
    assert (ran.returncode, ran.stderr) == (code, said)


@pytest.mark.skipif(sys.platform == "win32", reason="needs /dev/stdout")
def test_dev_stdout_is_standard_output(tmp_path: Path) -> None:
    plain, named = (
        subprocess.run(
            [sys.executable, "-m", "pfabrik", "new", "delta", *output], capture_output=True, text=True, cwd=tmp_path
        )
        for output in ((), ("-o", "/dev/stdout"))
    )
    assert named.returncode == 0 and named.stdout == plain.stdout
    with (tmp_path / "out.toml").open("w") as handle:
        in_process("new", "delta", "-o", "/dev/stdout", stdout=handle).communicate(timeout=60)
    assert (tmp_path / "out.toml").read_text() == plain.stdout


def test_an_interrupted_demo_leaves_nothing_behind(tmp_path: Path) -> None:
    def interruptible() -> None:  # a shell starts what runs in its background with interrupts ignored
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    line = ("demo", "--steps", 20_000, "-o", tmp_path / "out")
    with in_process(*line, stdout=subprocess.PIPE, preexec_fn=interruptible) as process:
        deadline = time.monotonic() + 5
        while not os.listdir(tmp_path) and time.monotonic() < deadline:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        try:
            said = process.communicate(timeout=90)[1]
        finally:
            process.kill()  # where it has ended, nothing happens
    assert "Traceback" not in said
    assert process.returncode == 130, said
    assert os.listdir(tmp_path) == []


def test_an_interruption_while_a_folder_is_removed_is_told_as_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    close = os.close

    def interrupted(descriptor: int) -> None:  # Python's `rmtree` then closes it once more, which fails
        monkeypatch.setattr(os, "close", close)
        close(descriptor)
        raise KeyboardInterrupt

    def work() -> None:
        with new_folder(tmp_path / "out"):
            monkeypatch.setattr(os, "close", interrupted)

    assert exit_code(work) == 130
    assert capsys.readouterr().err == "pfabrik: interrupted\n"
    assert os.listdir(tmp_path) == []


def test_an_interruption_that_is_swallowed_comes_again(capsys: pytest.CaptureFixture[str]) -> None:
    def work() -> None:
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(5)
        time.sleep(5)
        pytest.fail("nobody was interrupted")

    assert exit_code(work) == 130
    assert capsys.readouterr().err == "pfabrik: interrupted\n"


def test_an_interruption_while_the_command_is_loaded_is_told_as_one() -> None:
    code = (
        "import sys\nclass Interrupting:\n    def find_spec(self, name, *_):\n"
        "        if name == 'click':\n            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupting())\nfrom pfabrik.__main__ import main\nmain()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "pfabrik: interrupted\n")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_cleans_up_is_not_disturbed_by_further_signals(number: int) -> None:
    cleaned = []

    def work() -> None:
        try:
            os.kill(os.getpid(), number)
            time.sleep(5)
        finally:
            os.kill(os.getpid(), number)
            time.sleep(3 * AGAIN)
            cleaned.append(True)

    before = signal.getsignal(number)
    assert exit_code(work) == 128 + number
    assert cleaned
    assert signal.getsignal(number) == before


def test_a_signal_in_code_that_was_just_generated_has_its_own_exit_code(tmp_path: Path) -> None:
    (tmp_path / "ends.py").write_text(
        "import os, signal, sys, time\nfrom pfabrik.cli.group import exit_code\n"
        "sys.exit(exit_code(lambda: exec('os.kill(os.getpid(), signal.SIGTERM); time.sleep(5)')))\n"
    )
    ran = subprocess.run([sys.executable, tmp_path / "ends.py"], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (143, "pfabrik: terminated\n")


def test_a_track_that_is_told_to_end_leaves_no_parts_of_files(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y,z\n" + "0,10,200\n5,10,201\n" * 50_000)
    with in_process("track", "five_bar", "path.csv", "-o", "answers.csv", cwd=tmp_path) as process:
        deadline = time.monotonic() + 60
        while not list(tmp_path.glob(".*.part*")) and time.monotonic() < deadline:
            time.sleep(0.02)
        process.terminate()
        said = process.communicate(timeout=60)[1]
    assert (process.returncode, said.splitlines()[-1]) == (143, "pfabrik: terminated")
    assert os.listdir(tmp_path) == ["path.csv"]


@pytest.mark.slow
@pytest.mark.parametrize("after", [1.5, 4.0])
def test_a_view_is_interrupted_at_any_moment(after: float) -> None:
    pytest.importorskip("viser")

    def interruptible() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    line = ("view", "stewart", "--no-browser", "--port", 9100 + int(10 * after))
    with in_process(*line, stdout=subprocess.PIPE, preexec_fn=interruptible) as process:
        time.sleep(after)
        process.send_signal(signal.SIGINT)
        try:
            said = process.communicate(timeout=30)[1]
        finally:
            process.kill()  # where it has ended, nothing happens
    assert process.returncode == 130, said
    assert said.strip() == "pfabrik: interrupted"


# The demo


@pytest.mark.slow
def test_demo_writes_a_picture_and_a_table_for_each_machine(run: Callable[..., Result], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    result = run("demo", "--quick", "-o", "pictures")
    assert result.exit_code == 0
    assert {path.suffix for path in (tmp_path / "pictures").iterdir()} == {".png", ".csv"}
    for path in (tmp_path / "pictures").glob("*.csv"):
        statuses = {row["status"] for row in rows_of(path)}
        assert statuses == {"REACHED", "PROJECTED"}, path.name
        assert path.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


def test_demo_says_how_to_get_what_it_needs(run: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pfabrik.extras.find_spec", lambda _: None)
    result = run("demo")
    assert result.exit_code == 2
    assert "pip install '.[plot]'" in result.stderr


def test_demo_refuses_a_file_where_its_folder_should_be(run: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "out").write_text("precious")
    assert run("demo", "--quick").exit_code == 2
    assert (tmp_path / "out").read_text() == "precious"


@pytest.mark.parametrize("columns", [60, 100])
def test_tables_fit_the_terminal(run: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, columns: int) -> None:
    """What one line has no room for goes on in the next; no word is lost."""
    lines = [
        *(["catalog"], ["new"], ["info", "nrpm"], ["check", "stewart"], ["travel", "five_bar"]),
        *(["ik", "stewart", "--position", "0", "0", "300"], ["ik", "prr", "--all", "--rpy", *"000"]),
    ]
    for line in lines:
        monkeypatch.delenv("COLUMNS", raising=False)
        free = run(*line).stdout
        monkeypatch.setenv("COLUMNS", str(columns))
        narrow = run(*line).stdout
        assert max(map(len, narrow.splitlines())) <= columns, line
        assert narrow.split() == free.split(), line
        assert all(row in narrow for row in free.splitlines() if len(row) <= columns), line


def test_text_that_goes_on_is_below_its_column() -> None:
    table = "name  what it is\na     short\nb     one two three four five six seven"
    assert fitted(table, 30) == "name  what it is\na     short\nb     one two three four five\n      six seven"
    assert fitted(table, 24) == "name  what it is\na     short\nb\n    one two three four\n    five six seven"
    assert fitted(table, None) == table == fitted(table, 100)
    assert fitted("one two three four", 10) == "one two\n    three\n    four"
    assert fitted("https://" + "x" * 30, 10) == "https://" + "x" * 30  # no word is cut


def test_every_command_and_option_that_is_named_exists() -> None:
    """In all texts of the library: messages, help, docstrings."""
    context, templated = click.Context(main), {"--rod", "--arm"}
    commands = {name: main.get_command(context, name) for name in main.list_commands(context)}
    known = (
        {option for each in commands.values() for param in each.params for option in param.opts}
        | templated
        | {"--help"}
    )
    for path in (Path(pf.__file__).parent).rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        texts = [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
        named = {word for text in texts for word in re.findall(r"(?<![\w-])(?<!halcompile )--[a-z][a-z0-9-]*", text)}
        called = {word for text in texts for word in re.findall(r"`pfabrik ([a-z]+)", text)}
        assert (named - known, called - set(commands)) == (set(), set()), path


def test_parts_of_an_export_are_chosen(run: Callable[..., Result]) -> None:
    assert "stewart_fk" not in run("export", "stewart", "c", "--parts", "ik,limits", "--name", "stewart").stdout
    assert "expected some of 'ik'" in run("export", "stewart", "c", "--parts", "dynamics").stderr
    assert "--parts is of c, c-float" in run("export", "stewart", "mjcf", "--parts", "ik").stderr
