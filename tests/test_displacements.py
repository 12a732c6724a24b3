"""Where bodies are: against matrix exponentials, central differences, and joints opened by a known amount."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import pfabrik as pf
from machines import MACHINES
from pfabrik import Joint, Mechanism
from pfabrik.description.home_mobility import universal_axes
from pfabrik.motion.displacements import (
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
from pfabrik.motion.outward import centres_at
from pfabrik.motion.walks import around_home

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

CATALOGUE = ("five_bar", "nrpm", "stewart")
EVERY = {**MACHINES, **{name: lambda name=name: pf.load(name) for name in CATALOGUE}}


def anywhere(machine: Mechanism, n: int = 3, size: float = 0.3) -> np.ndarray:
    """Coordinates at random, with the loops open."""
    random = np.random.default_rng(1)
    units = rate_units(machine)
    return size * random.standard_normal((n, len(units))) * units


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


def twist(angular, velocity) -> np.ndarray:
    """The (4, 4) matrix of a twist."""
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = np.cross(np.eye(3), angular)
    matrix[:3, 3] = velocity
    return matrix


def turn(axis, at, angle) -> np.ndarray:
    return expm(twist(axis, np.cross(at, axis)) * angle)


def motion(machine: Mechanism, joint: Joint, q: np.ndarray) -> np.ndarray:
    """Second body relative to first, in home coordinates, by matrix exponentials."""
    if joint.type == "fixed":
        return np.eye(4)
    if joint.type == "spherical":
        return turn(q, joint.at, 1.0)
    if joint.type == "universal":
        first, second = universal_axes(machine, joint)
        return turn(first, joint.at, q[0]) @ turn(second, joint.at, q[1])
    axis = machine.home_axis(joint.name)
    slide = expm(twist((0, 0, 0), axis) * q[-1])
    if joint.type == "prismatic":
        return slide
    return turn(axis, joint.at, q[0]) @ (slide if joint.type == "cylindrical" else np.eye(4))


def vee(matrix: np.ndarray) -> np.ndarray:
    return np.concatenate([matrix[..., [2, 0, 1], [1, 2, 0]], matrix[..., :3, 3]], axis=-1)


class TestDisplacements:
    @pytest.mark.parametrize("name", EVERY)
    def test_home_moves_nothing_and_closes_all_loops(self, name):
        machine = EVERY[name]()
        home = np.zeros((1, len(rate_units(machine))))
        assert all(np.array_equal(each, np.eye(4)[None]) for each in displacements(machine, home).values())
        assert gaps(machine, home) == 0.0
        assert np.array_equal(end_effector_pose(machine, home)[0], machine.home_pose)
        for joint, centre in centres(machine, home).items():
            assert centre[0] == pytest.approx(machine.joint(joint).at, abs=1e-12)

    def test_columns_follow_the_joints(self):
        expected = {"R": (0, 1), "P": (1, 2), "U": (2, 4), "C": (4, 6), "F": (6, 6), "S": (6, 9)}
        assert {name: (each.start, each.stop) for name, each in columns(arm()).items()} == expected

    def test_joints_of_every_type_move_as_exponentials_whichever_body_comes_first(self):
        machine = arm()
        q = anywhere(machine, 4, 0.8)
        found = displacements(machine, q)
        for row in range(4):
            T = np.eye(4)
            for joint, body in zip(machine.joints, ("b1", "b2", "b3", "b4", "b5", "b6"), strict=True):
                step = motion(machine, joint, q[row, columns(machine)[joint.name]])
                T = T @ (step if joint.connects[1] == body else np.linalg.inv(step))
                assert found[body][row] == pytest.approx(T, abs=1e-12)
            assert end_effector_pose(machine, q)[row] == pytest.approx(T @ machine.home_pose, abs=1e-12)

    def test_angles_near_zero_are_exact(self):
        machine = arm()
        q = np.zeros((1, 9))
        q[0, 6:] = 1e-9, -2e-9, 3e-9
        turned = displacements(machine, q)["b6"][0, :3, :3]
        assert turned == pytest.approx(Rotation.from_rotvec(-q[0, 6:]).as_matrix(), rel=0, abs=1e-24)

    @pytest.mark.parametrize("name", EVERY)
    def test_a_tree_joint_keeps_its_centre_on_both_bodies(self, name):
        machine = EVERY[name]()
        q = anywhere(machine)
        found, points = displacements(machine, q), centres(machine, q)
        for joint in machine.joints:
            if joint.type in ("revolute", "universal", "spherical"):
                a, b = (each[:, :3, :3] @ joint.at + each[:, :3, 3] for each in map(found.get, joint.connects))
                assert points[joint.name] == pytest.approx(a, abs=1e-9)
                assert np.linalg.norm(a - b, axis=1) == pytest.approx(0, abs=gaps(machine, q).max() + 1e-9)

    def test_a_joint_end_effector_is_its_centre_unrotated(self):
        machine = pf.load("five_bar")
        q = anywhere(machine)
        pose = end_effector_pose(machine, q)
        assert np.array_equal(pose[:, :3, :3], np.broadcast_to(np.eye(3), (3, 3, 3)))
        assert pose[:, :3, 3] == pytest.approx(centres(machine, q)["p3"], abs=1e-12)

    def test_rows_do_not_depend_on_their_batch_and_nan_stays_in_its_row(self):
        machine = pf.load("stewart")
        q = anywhere(machine)
        alone = screws(machine, q[2:])
        q[1, 5] = np.nan
        assert screws(machine, q)[2] == pytest.approx(alone[0], abs=1e-15)
        for values in (screws(machine, q), gaps(machine, q), end_effector_pose(machine, q)[:, :3]):
            assert np.isnan(values[1]).any()
            assert np.isfinite(values[[0, 2]]).all()

    def test_no_rows_give_no_rows(self):
        machine = pf.load("stewart")
        q = np.zeros((0, 36))
        assert gaps(machine, q).shape == (0,)
        assert screws(machine, q).shape == (0, 36, 6)


class TestScrews:
    @pytest.mark.parametrize("name", ["arm", *EVERY])
    def test_screws_are_the_rates_of_the_bodies(self, name):
        machine = arm() if name == "arm" else EVERY[name]()
        q, h, L = anywhere(machine), 1e-5, machine.characteristic_length
        exact, now = screws(machine, q), displacements(machine, q)
        for k in range(q.shape[1]):
            joint = next(joint for joint in machine.joints if k in range(*columns(machine)[joint.name].indices(99)))
            step = np.zeros_like(q)
            step[:, k] = h
            ahead, behind = (displacements(machine, stepped(machine, q, sign * step)) for sign in (1, -1))
            moved = []
            for body in joint.connects:
                rate = vee((ahead[body] - behind[body]) / (2 * h) @ np.linalg.inv(now[body]))
                moved.append(rate / ([1] * 3 + [L] * 3))
            if np.abs(moved).max() > 1e-6:  # else the joint closes a loop, and its coordinate moves no body
                assert moved[1] - moved[0] == pytest.approx(exact[:, k], abs=1e-8)

    @pytest.mark.parametrize("name", EVERY)
    def test_joints_that_close_loops_open_them_along_their_screws(self, name):
        machine = EVERY[name]()
        home, h = np.zeros((1, len(rate_units(machine)))), 1e-5
        exact = screws(machine, home)[0]
        for k in range(home.shape[1]):
            step = np.zeros_like(home)
            step[0, k] = h
            ahead, behind = (loop_errors(machine, stepped(machine, home, sign * step)) for sign in (1, -1))
            for rate in (ahead - behind)[0] / (2 * h):
                sign = np.sign(rate @ exact[k])
                assert rate == pytest.approx(sign * exact[k], abs=1e-8)

    def test_a_ball_joint_composes_its_steps_through_half_a_turn(self):
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


class TestGaps:
    @pytest.mark.parametrize("angle", [1e-13, 1e-9, 1e-3, 3.0, np.pi])
    def test_an_angle_counts_by_the_characteristic_length_and_is_accurate_when_tiny(self, angle):
        joints = [
            Joint("A", "revolute", ("base", "link"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
            Joint("B", "revolute", ("base", "link"), at=(0, 0, 8), axis=(0, 0, 1)),
        ]
        machine = Mechanism("two hinges", joints, "link", (1, 0, 0))
        assert gaps(machine, np.array([[angle, 0.0]])) == pytest.approx(4 * angle, rel=1e-6)
        assert gaps(machine, np.array([[angle, angle]])) == pytest.approx(0, abs=1e-14)

    def test_a_distance_is_measured_at_the_closing_joint_or_at_the_reference_point(self):
        joints = [
            Joint("A", "revolute", ("base", "link"), at=(0, 0, 0), axis=(0, 0, 1), actuated=True),
            Joint("B", "prismatic", ("link", "base"), axis=(1, 0, 0)),
        ]
        machine = Mechanism("hinge and slide", joints, "link", (10, 0, 0))
        q = np.array([[0.3, 0.0], [0.0, 0.25]])
        assert gaps(machine, q) == pytest.approx([2 * 10 * np.sin(0.15), 0.25], rel=1e-12)
        placed = Mechanism("placed", [joints[0], dataclasses.replace(joints[1], at=(30, 0, 0))], "link", (10, 0, 0))
        assert gaps(placed, q) == pytest.approx([2 * 30 * np.sin(0.15), 0.25], rel=1e-12)

    def test_a_machine_without_loops_has_no_gap(self):
        assert np.array_equal(gaps(arm(), anywhere(arm())), np.zeros(3))


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


def test_coordinates_are_named_in_the_order_of_their_columns() -> None:
    machine = arm()
    assert machine.coordinate_names == ("R", "P", "U[0]", "U[1]", "C[0]", "C[1]", "S[0]", "S[1]", "S[2]")
    for name, place in columns(machine).items():
        owned = machine.coordinate_names[place]
        assert len(owned) == place.stop - place.start and all(each.partition("[")[0] == name for each in owned)


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
