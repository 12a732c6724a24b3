"""Mechanisms as robot descriptions with a file of loops: read back, they answer as the mechanism does."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import pfabrik as pf
from pfabrik.errors import InvalidArgument
from pfabrik.exchange.interop import from_urdf, to_mjcf, to_urdf, verify
from pfabrik.machine.description.joints import DRIVE_FIELDS
from test_dynamics import motorised, somewhere, weighed
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


def moved_by_motors(name: str) -> pf.Mechanism:
    return motorised(weighed(pf.load(name)))


@pytest.mark.parametrize("name", ["delta", "five_bar", "hexaglide", "linear_delta", "prs", "serial_arm", "stewart"])
def test_masses_and_motors_come_back(name: str) -> None:
    """What the machine says of them, and so the same efforts; a body that is doubled, too."""
    machine = moved_by_motors(name)
    options: dict[str, Any] = {key: getattr(machine, key) for key in ("base", "end_effector", "task", "length_unit")}
    again = from_urdf(*to_urdf(machine), **options).mechanism
    masses = {each.body: each for each in again.masses}
    for mass in machine.masses:
        found, size = masses[mass.body], machine.characteristic_length
        np.testing.assert_allclose(found.mass, mass.mass, rtol=1e-12)
        np.testing.assert_allclose(found.centre, mass.centre, atol=1e-9 * size)
        np.testing.assert_allclose(found.inertia, mass.inertia, atol=1e-9 * max(mass.inertia or ()))
    for one, other in zip(machine.drives, again.drives, strict=True):
        for field in DRIVE_FIELDS:
            if one.said(field) is not None:
                np.testing.assert_allclose(other.said(field), one.said(field), rtol=1e-12, err_msg=field)
    solution, rates, gains = somewhere(machine)
    from_home = solution.actuators - [drive.home for drive in machine.drives]
    here = pf.solve_fk(again, from_home)
    motion: dict[str, Any] = {"twists": 0.0 * rates, "accelerations": gains, "gravity": (1.0, -2.0, -9.0)}
    efforts = [pf.inverse_dynamics(each, at="actuators", **motion).actuators for each in (solution, here)]
    np.testing.assert_allclose(efforts[1], efforts[0], atol=1e-9 * np.abs(efforts[0]).max())


@pytest.mark.parametrize("name", ["delta", "five_bar", "servo_hexapod", "serial_arm", "stewart", "ucu"])
def test_pinocchio_has_of_the_description_what_mujoco_has_of_the_model(name: str) -> None:
    """Of the trees, whose loops are cut alike: mass matrix without rotors, weights and limits of effort."""
    pin = pytest.importorskip("pinocchio")
    mujoco = pytest.importorskip("mujoco")
    machine = moved_by_motors(name)
    one = pin.buildModelFromXML(to_urdf(machine)[0])
    other = mujoco.MjModel.from_xml_string(to_mjcf(machine, gravity=(0.0, 0.0, -9.81)))
    here, there = one.createData(), mujoco.MjData(other)
    mujoco.mj_forward(other, there)
    upper = np.triu(pin.crba(one, here, pin.neutral(one)))
    weights = pin.computeGeneralizedGravity(one, here, pin.neutral(one))
    mass = np.zeros((other.nv, other.nv))
    for k, row in enumerate(np.eye(other.nv)):
        mujoco.mj_mulM(other, there, mass[k], row)
    mass -= np.diag(other.dof_armature)
    single = [joint for joint in map(other.joint, range(other.njnt)) if joint.type[0] >= 2]  # no balls
    rows = [one.joints[one.getJointId(joint.name)].idx_v for joint in single]
    columns = [int(joint.dofadr[0]) for joint in single]
    expected = mass[np.ix_(columns, columns)]
    found = (upper + np.triu(upper, 1).T)[np.ix_(rows, rows)]
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(weights[rows], there.qfrc_bias[columns], atol=1e-12 * np.abs(weights).max(initial=1.0))
    for drive in machine.drives:
        row = one.joints[one.getJointId(drive.name)].idx_v
        assert one.effortLimit[row] == drive.said("max_torque")
        np.testing.assert_allclose([one.friction[row], one.damping[row]], drive.said("friction"))


def test_what_is_not_known_of_masses_and_motors_is_said() -> None:
    text, _ = to_urdf(pf.load("five_bar"))
    assert "<inertial>" not in text and "<dynamics" not in text and "<transmission" not in text
    assert f"no mass is known of {', '.join(pf.load('five_bar').bodies[1:])}" in text
    drives = ", ".join(pf.load("five_bar").actuator_names)
    assert f"effort is 0, which stands for no limit that is known, of {drives}" in text
    assert "stands for no limit" not in to_urdf(moved_by_motors("five_bar"))[0]
