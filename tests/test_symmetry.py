"""What is probably a slip: a joint that is nearly a copy of others, copies that go round the other way."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import pfabrik as pf
from pfabrik.cli import main
from pfabrik.machine.catalog import template, templates
from pfabrik.machine.description.symmetry import crossed_rounds, near_copies
from pfabrik.machine.files import dumps, loads

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def hexapod(n: int = 6, centre: tuple[float, float, float] = (0, 0, 0), spread: float = 0.2) -> pf.Mechanism:
    """Struts in pairs, which fall onto each other by thirds of a turn; or n evenly where `spread` is 0."""
    joints = []
    for k in range(n):
        foot = head = 2 * np.pi * k / n
        if spread:
            side = spread if k % 2 else -spread
            foot, head = 2 * np.pi * (k // 2) / 3 + side, 2 * np.pi * (k // 2 + (k % 2) - 0.5) / 3 - side
        at = np.array(centre) + [100 * np.cos(foot), 100 * np.sin(foot), 0]
        to = np.array(centre) + [60 * np.cos(head), 60 * np.sin(head), 150]
        ends = (f"A{k + 1}", f"C{k + 1}")
        joints += [
            pf.Joint(ends[0], "universal", ("base", f"cylinder{k + 1}"), at=at),
            pf.Joint(f"B{k + 1}", "prismatic", (f"cylinder{k + 1}", f"rod{k + 1}"), along=ends, actuated=True),
            pf.Joint(ends[1], "spherical", (f"rod{k + 1}", "platform"), at=to),
        ]
    return pf.Mechanism("hexapod", joints, "platform", reference_point=np.array(centre) + [0, 0, 150])


def moved(mechanism: pf.Mechanism, offsets: Mapping[str, tuple[float, float, float]]) -> pf.Mechanism:
    joints = [
        dataclasses.replace(joint, at=np.array(joint.at) + offsets[joint.name]) if joint.name in offsets else joint
        for joint in mechanism.joints
    ]
    return dataclasses.replace(mechanism, joints=joints)


@pytest.mark.parametrize("centre", [(0, 0, 0), (300, -40, 20)])
@pytest.mark.parametrize(("name", "spread"), [("C3", 0.2), ("A4", 0.2), ("A6", 0.05)])
def test_a_joint_that_is_nearly_a_copy_is_named_with_its_distance(
    name: str, spread: float, centre: tuple[float, float, float]
) -> None:
    machine = hexapod(centre=centre, spread=spread)
    assert near_copies(machine) == []
    (slip,) = near_copies(moved(machine, {name: (0, 0.9, 1.2)}))
    assert slip.joint == name and slip.like[0] == name[0] and slip.like != name
    assert slip.distance == pytest.approx(1.5)
    assert (slip.n_turns, slip.n_exact, slip.n_joints) == (3, 11, 12)
    # by hand: turned about the axis, the other joint comes to where this one was
    foot = np.array(machine.joint(slip.like).at) - centre
    cosine, sine = np.cos(slip.angle) * np.ones(2), np.sin(slip.angle)
    sine *= np.sign(slip.axis[2])
    there = [cosine[0] * foot[0] - sine * foot[1], sine * foot[0] + cosine[0] * foot[1], foot[2]]
    assert there == pytest.approx(np.array(machine.joint(name).at) - centre, abs=1e-9)


@pytest.mark.parametrize(("share", "n_slips"), [(5e-4, 0), (2e-3, 1), (1.9e-2, 1), (2.1e-2, 0)])
def test_the_distance_decides_whether_it_is_a_slip(share: float, n_slips: int) -> None:
    machine = hexapod()
    assert len(near_copies(moved(machine, {"A1": (0, 0, share * machine.characteristic_length)}))) == n_slips


def test_rounded_and_measured_machines_are_not_remarked() -> None:
    random = np.random.default_rng(0)
    machine = hexapod()
    names = [joint.name for joint in machine.joints if joint.at is not None]
    for scale in (1e-5, 3e-4, 3e-3):
        offsets = {name: tuple(scale * machine.characteristic_length * random.normal(size=3)) for name in names}
        assert near_copies(moved(machine, offsets)) == []
    rounding = {name: tuple(np.round(machine.joint(name).at) - machine.joint(name).at) for name in names}
    assert near_copies(moved(machine, rounding)) == []


def test_machines_that_have_another_symmetry_by_design_are_not_remarked() -> None:
    assert near_copies(hexapod(spread=0.52)) == []  # nearly even: six feet 60.4 and 59.6 degrees apart
    stretched = hexapod(n=4, spread=0.0)  # a rectangle, nearly a square
    offsets = {joint.name: (0.01 * joint.at[0], 0, 0) for joint in stretched.joints if joint.at is not None}
    assert near_copies(moved(stretched, offsets)) == []
    lines = dict.fromkeys(("A1", "A2", "C3", "C4"), (0.7, 0.9, 0))  # one of three in each polygon is off
    assert near_copies(moved(hexapod(), lines)) != []
    lines |= dict.fromkeys(("A3", "A4"), (-0.8, 0.5, 0))  # two of three: nobody knows which is right
    assert near_copies(moved(hexapod(), lines)) == []
    off = moved(hexapod(), dict.fromkeys(("A5", "A6", "C5", "C6"), (1.0, 0, 0)))  # a whole leg, joint by joint
    assert {slip.joint for slip in near_copies(off)} == {"A5", "A6", "C5", "C6"}


def test_machines_and_templates_of_the_library_are_not_remarked() -> None:
    for machine in [*map(pf.load, pf.catalog()), *(loads(template(name)) for name in templates())]:
        assert near_copies(machine) == [] and crossed_rounds(machine) == [], machine.name


HEAD = 'schema = 1\nname = "three cranks"\nend_effector = "platform"\nreference_point = [0, 0, 0]\n'


def three_cranks(axis: str) -> str:
    """The text of a planar machine whose second joints are copied about an axis of their own."""
    text = HEAD
    for name, bodies, at, around in (
        ("A", '["base", "crank"]', [100, 0, 0], "[0, 0, 1]"),
        ("B", '["crank", "rod"]', [80, 50, 0], axis),
        ("C", '["rod", "platform"]', [30, 10, 0], "[0, 0, 1]"),
    ):
        text += f'[[joint]]\nname = "{name}"\ntype = "revolute"\nconnects = {bodies}\nat = {at}\naxis = [0, 0, 1]\n'
        text += f"actuated = {str(name == 'A').lower()}\ncopies = {{ count = 3, axis = {around} }}\n"
    return text


def test_copies_that_go_round_the_other_way_are_remarked(tmp_path: Path) -> None:
    assert crossed_rounds(loads(three_cranks("[0, 0, 1]"))) == []
    (tmp_path / "cranks.toml").write_text(three_cranks("[0, 0, -1]"), encoding="utf-8")
    result = CliRunner().invoke(main, ["check", str(tmp_path / "cranks.toml")])
    assert result.exit_code == 0
    assert "joints 'A1', 'A2', 'A3' go round (0, 0, 1), and 'B1', 'B2', 'B3' round (0, 0, -1): " in result.stderr


def test_check_names_both_joints_and_the_distance(tmp_path: Path) -> None:
    (tmp_path / "off.toml").write_text(dumps(moved(hexapod(), {"C2": (0, 0, 1.25)})), encoding="utf-8")
    result = CliRunner().invoke(main, ["check", str(tmp_path / "off.toml")])
    assert result.exit_code == 0
    (note,) = [line for line in result.stderr.splitlines() if "fall onto each other" in line]
    assert note.startswith("pfabrik: note: joint 'C2' is 1.25 mm off the place where a turn of ")
    assert "takes joint 'C" in note and note.endswith("11 of 12 joints fall onto each other by such turns")
