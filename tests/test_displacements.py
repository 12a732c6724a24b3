"""Where bodies are: against rotations of SciPy, central differences, and joints opened by a known amount."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import placed_bodies, with_axes
from machines import machine
from pfabrik import Joint, Mechanism
from pfabrik.machine.motion.displacements import (
    centres,
    columns,
    displacements,
    end_effector_pose,
    gaps,
    loop_errors,
    rate_units,
    screws,
    stepped,
)
from pfabrik.machine.motion.mobility import around_home
from pfabrik.machine.motion.outward import centres_at

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def arm() -> Mechanism:
    """One joint of every type in a row; the second, fourth and last are described from the far body."""
    joints = [
        Joint("R", "revolute", ("base", "b1"), at=(1, 2, 3), axis=(1, 1, 0), actuated=True),
        Joint("P", "prismatic", ("b2", "b1"), axis=(0, 1, 2), actuated=True),
        Joint("U", "universal", ("b2", "b3"), at=(4, 2, -1), axes=((1, 0, 0), (1, 2, 0))),
        Joint("C", "cylindrical", ("b4", "b3"), at=(0, 5, 1), axis=(0, 3, 1)),
        Joint("F", "fixed", ("b4", "b5"), at=(0, 5, 2)),
        Joint("S", "spherical", ("b6", "b5"), at=(2, 2, 7)),
    ]
    return Mechanism("arm", joints, "b6", (2, 3, 8))


def named(name: str) -> Mechanism:
    return arm() if name == "arm" else machine(name)


def anywhere(machine: Mechanism, n: int = 3, size: float = 0.3) -> np.ndarray:
    """Coordinates at random, with the loops open."""
    units = rate_units(machine)
    return size * np.random.default_rng(1).standard_normal((n, len(units))) * units


def test_joints_of_every_type_move_as_rotations_and_shifts_whichever_body_comes_first() -> None:
    machine = arm()
    q = anywhere(machine, 4, 0.8)
    expected, _ = placed_bodies(with_axes(machine), {name: q[:, column] for name, column in columns(machine).items()})
    found = displacements(machine, q)
    for body, placed in expected.items():
        np.testing.assert_allclose(found[body], placed, rtol=0, atol=1e-12)
    np.testing.assert_allclose(end_effector_pose(machine, q), expected["b6"] @ machine.home_pose, atol=1e-12)
    tiny = np.zeros((1, 9))
    tiny[0, 6:] = 1e-9, -2e-9, 3e-9
    turned = Rotation.from_rotvec(-tiny[0, 6:]).as_matrix()
    np.testing.assert_allclose(displacements(machine, tiny)["b6"][0, :3, :3], turned, rtol=0, atol=1e-24)


def test_coordinates_are_named_in_the_order_of_their_columns() -> None:
    machine = arm()
    assert machine.coordinate_names == ("R", "P", "U[0]", "U[1]", "C[0]", "C[1]", "S[0]", "S[1]", "S[2]")
    expected = {"R": (0, 1), "P": (1, 2), "U": (2, 4), "C": (4, 6), "F": (6, 6), "S": (6, 9)}
    assert {name: (each.start, each.stop) for name, each in columns(machine).items()} == expected


def rates_of(machine: Mechanism, q: np.ndarray, k: int, h: float = 1e-5) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Rates (n, 6) of all bodies by coordinate k, and (n, loops, 6) of what loops are open by: central differences."""
    step = np.zeros_like(q)
    step[:, k] = h
    ends = [stepped(machine, q, sign * step) for sign in (1, -1)]
    (ahead, behind), now = (displacements(machine, end) for end in ends), displacements(machine, q)
    rates = {}
    for body, placed in now.items():
        rate = (ahead[body] - behind[body]) / (2 * h) @ np.linalg.inv(placed)
        turning, moving = rate[:, [2, 0, 1], [1, 2, 0]], rate[:, :3, 3] / machine.characteristic_length
        rates[body] = np.concatenate([turning, moving], axis=1)
    opened = loop_errors(machine, ends[0]) - loop_errors(machine, ends[1])
    return rates, opened / (2 * h)


@pytest.mark.parametrize("name", ["arm", "mixed", "planar_rrr", "serial_spherical", "five_bar", "stewart", "nrpm"])
def test_screws_are_the_rates_of_the_bodies_and_open_loops(name: str) -> None:
    """A joint in the tree moves its bodies apart along its screw, and one that closes a loop opens that along it."""
    machine = named(name)
    q, home = anywhere(machine), np.zeros((1, len(rate_units(machine))))
    exact, at_home = screws(machine, q), screws(machine, home)[0]
    for joint in machine.joints:
        for k in range(columns(machine)[joint.name].start, columns(machine)[joint.name].stop):
            rates, _ = rates_of(machine, q, k)
            first, second = (rates[body] for body in joint.connects)
            if max(np.abs(first).max(), np.abs(second).max()) > 1e-6:  # else it closes a loop
                np.testing.assert_allclose(second - first, exact[:, k], rtol=0, atol=1e-8)
            for rate in rates_of(machine, home, k)[1][0]:
                np.testing.assert_allclose(rate, np.sign(rate @ at_home[k]) * at_home[k], rtol=0, atol=1e-8)


def test_a_ball_joint_composes_its_steps_through_half_a_turn() -> None:
    joints = [Joint("P", "prismatic", ("base", "a"), axis=(1, 0, 0), actuated=True)]
    joints += [Joint("S", "spherical", ("a", "b"), at=(1, 2, 3))]
    machine = Mechanism("ball", joints, "b", (0, 0, 0))
    q, step = np.zeros((1, 4)), np.zeros((1, 4))
    step[0, 1:] = np.pi / 8 * np.array([2, 1, 2]) / 3
    for k in range(1, 30):
        q = stepped(machine, q, step)
        expected = Rotation.from_rotvec(k * step[0, 1:])
        assert (Rotation.from_rotvec(q[0, 1:]) * expected.inv()).magnitude() == pytest.approx(0, abs=1e-13)
        assert np.linalg.norm(q[0, 1:]) <= np.pi + 1e-12


def test_rows_do_not_depend_on_their_batch_and_nan_stays_in_its_row() -> None:
    machine = pf.load("stewart")
    q = anywhere(machine)
    alone = screws(machine, q[2:])
    q[1, 5] = np.nan
    np.testing.assert_allclose(screws(machine, q)[2], alone[0], rtol=0, atol=1e-15)
    for values in (screws(machine, q), gaps(machine, q), end_effector_pose(machine, q)[:, :3]):
        assert np.isnan(values[1]).any() and np.isfinite(values[[0, 2]]).all()
    assert gaps(machine, q[:0]).shape == (0,) and screws(machine, q[:0]).shape == (0, 36, 6)


@pytest.mark.parametrize("angle", [1e-13, 1e-9, 1e-3, 3.0, np.pi])
def test_a_gap_of_an_angle_counts_by_the_characteristic_length_and_is_accurate_when_tiny(angle: float) -> None:
    joints = [
        Joint("A", "revolute", ("base", "link"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        Joint("B", "revolute", ("base", "link"), at=(0, 0, 8), axis=(0, 0, 1)),
    ]
    machine = Mechanism("two hinges", joints, "link", (1, 0, 0))
    assert gaps(machine, np.array([[angle, 0.0]])) == pytest.approx(4 * angle, rel=1e-6)
    assert gaps(machine, np.array([[angle, angle]])) == pytest.approx(0, abs=1e-14)
    assert np.array_equal(gaps(arm(), anywhere(arm())), np.zeros(3))  # which has no loops


def test_a_gap_of_a_distance_is_measured_at_the_closing_joint_or_at_the_reference_point() -> None:
    joints = [
        Joint("A", "revolute", ("base", "link"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        Joint("B", "prismatic", ("link", "base"), axis=(1, 0, 0)),
    ]
    q = np.array([[0.3, 0.0], [0.0, 0.25]])
    for closing, radius in ((joints[1], 10), (dataclasses.replace(joints[1], at=(30, 0, 0)), 30)):
        machine = Mechanism("hinge and slide", [joints[0], closing], "link", (10, 0, 0))
        assert gaps(machine, q) == pytest.approx([2 * radius * np.sin(0.15), 0.25], rel=1e-12)


@pytest.mark.parametrize("connects", [("base", "rocker"), ("rocker", "base")])
def test_a_joint_end_effector_on_the_base_goes_with_its_other_body(connects: tuple[str, str]) -> None:
    """Also with the loop open: a quarter turn of the crank about the origin takes all that hangs on it along."""
    joints = [
        Joint("o", "revolute", ("base", "crank"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
        Joint("p", "revolute", ("crank", "rocker"), at=(1, 2, 0), axis=(0, 0, 1)),
        Joint("tip", "revolute", connects, at=(3, 0, 0), axis=(0, 0, 1)),
    ]
    machine = Mechanism("triangle", joints, "tip")
    assert machine.end_effector_body == "rocker"
    pose = end_effector_pose(machine, np.array([[np.pi / 2, 0.0, 0.0]]))[0]
    np.testing.assert_allclose(pose[:3, 3], [0.0, 3.0, 0.0], atol=1e-12)
    assert np.array_equal(pose[:3, :3], np.eye(3))  # a joint has no orientation


@pytest.mark.parametrize("name", pf.catalog())
def test_poses_and_actuators_tell_the_same_centres_as_all_joints(name: str) -> None:
    machine = pf.load(name)
    q = around_home(machine)
    actuators = np.stack([q[:, drive.column] + drive.home for drive in machine.drives], axis=1)
    found, expected = centres_at(machine, end_effector_pose(machine, q), actuators), centres(machine, q)
    if name == "orthoglide":  # a joint in the middle of a passive leg
        assert found is None
        return
    assert found is not None and list(found) == list(expected)
    off = max(float(np.abs(found[joint] - expected[joint]).max()) for joint in expected)
    assert off <= 1e-8 * machine.characteristic_length  # to which the loops are closed


def test_centres_are_told_through_driven_and_locked_joints_described_from_either_body() -> None:
    joints = [
        Joint("R", "revolute", ("base", "b1"), at=(1, 2, 3), axis=(1, 1, 0), actuated=True, home=0.4),
        Joint("P", "prismatic", ("b2", "b1"), axis=(0, 1, 2), actuated=True),
        Joint("F", "fixed", ("b3", "b2"), at=(0, 5, 2)),
        Joint("U", "universal", ("b4", "b3"), at=(4, 2, -1), axes=((1, 0, 0), (1, 2, 0))),
        Joint("S", "spherical", ("b4", "b5"), at=(2, 2, 7)),
    ]
    machine = Mechanism("arm", joints, "b5", (2, 3, 8))
    q = anywhere(machine)
    actuators = q[:, [drive.column for drive in machine.drives]] + [0.4, 0.0]
    found = centres_at(machine, end_effector_pose(machine, q), actuators)
    assert found is not None
    for joint, expected in centres(machine, q).items():
        np.testing.assert_allclose(found[joint], expected, atol=1e-12)


def test_the_centre_of_a_sliding_joint_is_told_by_its_first_body_alone() -> None:
    def machine(actuated: bool | tuple[bool, bool]) -> Mechanism:
        joints = [
            Joint("C", "cylindrical", ("b1", "base"), at=(1, 2, 3), axis=(1, 1, 0), actuated=actuated),
            Joint("S", "spherical", ("b1", "b2"), at=(2, 2, 7)),
        ]
        return Mechanism("slide", joints, "b2", (2, 3, 8))

    whole, half = machine(True), machine((True, False))
    q = anywhere(whole)
    poses = end_effector_pose(whole, q)
    assert centres_at(half, poses, q[:, :1]) is None
    found = centres_at(whole, poses, q[:, :2])
    assert found is not None
    np.testing.assert_allclose(found["C"], centres(whole, q)["C"], atol=1e-12)
