"""Mechanisms as robot descriptions with a file of loops: read back, they answer as the mechanism does."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.errors import InvalidArgument
from pfabrik.exchange.interop import from_urdf, to_urdf, verify
from test_interop_writing import NAMES


@pytest.mark.parametrize("name", NAMES)
def test_what_is_written_answers_as_the_machine_does(name: str, tmp_path: Path) -> None:
    """At poses around home, from files: all limits that URDF has are in it, all drives by their names, from home."""
    machine = pf.load(name)
    to_urdf(machine, tmp_path / "robot.urdf", tmp_path / "loops.yaml")
    again = from_urdf(
        tmp_path / "robot.urdf",
        tmp_path / "loops.yaml",
        base=machine.base,
        end_effector=machine.end_effector,
        task=machine.task,
        length_unit=machine.length_unit,
    ).mechanism
    assert again.actuator_names == machine.actuator_names
    rng, size = np.random.default_rng(0), machine.characteristic_length
    around = machine.reference_point + rng.uniform(-0.05, 0.05, (20, 3)) * size
    poses = pf.solve_ik(machine, pf.pose(around, rpy=rng.uniform(-0.1, 0.1, (20, 3)))).pose
    expected, answers = pf.solve_ik(machine, poses), pf.solve_ik(again, poses)
    np.testing.assert_array_equal(answers.status, expected.status)
    assert (expected.status == pf.Status.REACHED).any()
    from_home = expected.actuators - [drive.home for drive in machine.drives]
    np.testing.assert_allclose(answers.actuators, from_home, rtol=0, atol=1e-9 * max(size, 1.0))
    for drive, other in zip(machine.drives, again.drives, strict=True):
        np.testing.assert_allclose(other.limits, np.array(drive.limits) - drive.home, rtol=1e-12, atol=1e-12 * size)
    if name in ("stewart", "delta"):  # MuJoCo closes the loops of the description itself, and lands on our poses
        against = verify(again, poses=3, original=tmp_path / "robot.urdf", loops=tmp_path / "loops.yaml").original
        assert against and against.position_tolerance <= 1e-8 * size


def test_the_loops_do_not_replace_the_description(tmp_path: Path) -> None:
    with pytest.raises(InvalidArgument, match=r"loops: found .*, where the description goes"):
        to_urdf(pf.load("delta"), tmp_path / "same", str(tmp_path / "." / "same"))
    assert not (tmp_path / "same").exists()


def test_the_description_is_a_tree_that_says_what_it_leaves_out() -> None:
    text, loops = to_urdf(pf.load("stewart"))
    root = ET.fromstring(text)
    children = [joint.find("child").get("link") for joint in root.iterfind("joint")]  # type: ignore[union-attr]
    assert len(children) == len(set(children)) == len(root.findall("link")) - 1
    assert "a limit that URDF has no word for: the cone of AL1" in text
    assert loops["name_mot"] == list(pf.load("stewart").actuator_names)
