"""Configurations that a caller gives: joint vectors q, named by their mechanism, measured and started from."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from machines import machine
from pfabrik import Mechanism, Solution, Status
from pfabrik.description.joint_types import KINDS

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
NAMES = (
    "five_bar",
    "stewart",
    "nrpm",
    "rps",
    "delta",
    "ankle_ups",
    "ranged_stewart",
    "cru",
    "mixed",
    "serial_spherical",
)


def near_home(mechanism: Mechanism, n: int = 3) -> Solution:
    """Feasible answers to targets around home."""
    rng = np.random.default_rng(3)
    steps = 0.05 * mechanism.characteristic_length * rng.uniform(-1, 1, (n, 3))
    poses = [pf.pose(mechanism.reference_point + d, rotvec=0.05 * rng.uniform(-1, 1, 3)) for d in steps]
    return pf.solve_ik(mechanism, np.array(poses))


@pytest.mark.parametrize("name", NAMES)
def test_q_has_one_number_for_each_named_coordinate(name: str) -> None:
    """A joint's part of q is what `joints` tells, an actuator's what `actuators` tells."""
    mechanism = machine(name)
    answer = near_home(mechanism)
    names = mechanism.coordinate_names
    assert answer.q.shape == (3, len(names)) and len(set(names)) == len(names)
    place = 0
    for joint in mechanism.joints:
        freedoms = len(KINDS[joint.type].coordinates)
        own = answer.q[:, place : place + freedoms]
        expected = [joint.name] if freedoms == 1 else [f"{joint.name}[{k}]" for k in range(freedoms)]
        assert list(names[place : place + freedoms]) == expected
        if freedoms:
            np.testing.assert_array_equal(np.reshape(answer.joints[joint.name], (3, freedoms)), own)
            assert np.shape(answer.joints[joint.name]) == ((3,) if freedoms == 1 else (3, freedoms))
        place += freedoms
    assert place == len(names)
    for column, actuator in enumerate(mechanism.actuator_names):
        own = np.reshape(answer.joints[actuator], (3, -1))[:, 0]
        np.testing.assert_allclose(own, answer.actuators[:, column], atol=1e-9 * mechanism.characteristic_length)
    np.testing.assert_array_equal(answer[1].q, answer.q[1])


@pytest.mark.parametrize("name", NAMES)
def test_the_joint_vector_of_an_answer_is_the_same_configuration(name: str) -> None:
    mechanism = machine(name)
    answer = near_home(mechanism)
    found = pf.configuration(mechanism, answer.q)
    size = mechanism.characteristic_length
    assert found  # closed and within every limit
    np.testing.assert_allclose(found.q, answer.q, atol=1e-12 * size)
    np.testing.assert_allclose(found.pose, answer.pose, atol=1e-8 * size)
    np.testing.assert_allclose(found.actuators, answer.actuators, atol=1e-8 * size)
    assert set(found.points) == set(answer.points)
    for joint, point in answer.points.items():
        np.testing.assert_allclose(found.points[joint], point, atol=1e-7 * size)
    assert np.max(found.residual) <= 1e-9 * size and np.max(found.limit_excess) <= 1e-9
    one = pf.configuration(mechanism, answer.q[0])
    assert one.shape == () and one.status is Status.REACHED
    np.testing.assert_array_equal(one.pose, found.pose[0])


def test_a_configuration_beyond_a_limit_is_exceeded_and_names_it() -> None:
    """The same joint vector, for a machine with a shorter stroke."""
    mechanism = pf.load("stewart")
    answer = pf.solve_ik(mechanism, (10.0, 0.0, 205.0))
    longest = mechanism.actuator_names[int(np.argmax(answer.actuators))]
    tight = mechanism.with_limits({longest: (140.0, answer.actuators.max() - 0.5)})
    found = pf.configuration(tight, answer.q)
    assert found.status is Status.EXCEEDED
    assert [(limit.joint, limit.bound) for limit in found.active_limits] == [(longest, "max")]
    assert found.limit_excess == pytest.approx(0.5 / mechanism.characteristic_length, rel=1e-6)
    assert pf.margins(found)[longest, "max"] < 0.0
    assert not found


def test_an_open_configuration_is_failed_and_tells_by_how_much() -> None:
    """A hexapod's strut, drawn out alone by 3, leaves a gap of 3 at the platform or shares it with others."""
    mechanism = pf.load("stewart")
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    q = np.tile(home.q, (2, 1))
    q[1, mechanism.coordinate_names.index("BL1")] += 3.0
    found = pf.configuration(mechanism, q)
    assert found.status.tolist() == [Status.REACHED, Status.FAILED]
    assert 0.5 <= found.residual[1] <= 10.0 and found.residual[0] <= 1e-9 * mechanism.characteristic_length
    np.testing.assert_array_equal(found.q, q)


@pytest.mark.parametrize("name", ["five_bar", "stewart", "nrpm", "delta", "rps", "ankle_ups"])
def test_a_joint_vector_starts_as_the_answer_it_comes_from(name: str) -> None:
    """Inverse, forward and along a path: the same configurations follow from both."""
    mechanism = machine(name)
    begin = near_home(mechanism, 1)[0]
    path = np.linspace(begin.pose, mechanism.home_pose, 5)
    path = pf.pose(path[:, :3, 3], rotation=np.linalg.svd(path[:, :3, :3])[0] @ np.linalg.svd(path[:, :3, :3])[2])
    size = mechanism.characteristic_length
    for solve in (
        lambda start: pf.solve_ik(mechanism, path, start=start),
        lambda start: pf.track(mechanism, path, start=start),
        lambda start: pf.solve_fk(mechanism, begin.actuators, start=start),
    ):
        by_answer, by_vector = solve(begin), solve(begin.q)
        np.testing.assert_array_equal(by_vector.status, by_answer.status)
        np.testing.assert_allclose(by_vector.pose, by_answer.pose, atol=1e-7 * size)
        np.testing.assert_allclose(by_vector.actuators, by_answer.actuators, atol=1e-7 * size)


def test_a_joint_vector_keeps_its_working_mode() -> None:
    """Each of a 5-bar's four, by the way its elbows are bent; one start for all targets, or one for each."""
    mechanism = pf.load("five_bar").without_limits()
    modes = list(pf.working_modes(mechanism, (0.0, 10.0, 180.0)))
    targets = np.array([(0.0, -10.0, 170.0), (0.0, 30.0, 190.0)])
    assert len(modes) == 4
    seen = set()
    for mode in modes:
        one = pf.solve_ik(mechanism, targets, start=mode.q)
        each = pf.solve_ik(mechanism, targets, start=np.tile(mode.q, (2, 1)))
        bends = [tuple(bent(mode))] + [tuple(bent(one[row])) for row in (0, 1)]
        assert one and len(set(bends)) == 1
        np.testing.assert_array_equal(each.actuators, one.actuators)
        seen.add(bends[0])
    assert len(seen) == 4


def bent(answer: Solution) -> list[bool]:
    p = answer.points
    return [bool(np.cross(p[b] - p[a], p["p3"] - p[b])[0] > 0) for a, b in (("p1", "p2"), ("p5", "p4"))]


@pytest.mark.parametrize("name", ["stewart", "servo_hexapod", "rps", "nrpm"])
def test_a_ball_joint_that_is_not_as_its_bodies_are_leaves_the_loops_open(name: str) -> None:
    """At the platform too, whose legs are closed wherever it is turned to: it is measured, not set right."""
    mechanism = machine(name)
    last = [joint.name for joint in mechanism.joints if joint.type == "spherical"][-1]
    columns = [k for k, each in enumerate(mechanism.coordinates) if each.joint.name == last]
    q = pf.solve_ik(mechanism, mechanism.home_pose).q
    q[columns] += (0.3, 0.2, -0.1)
    found = pf.configuration(mechanism, q)
    assert found.status is Status.FAILED and found.residual > 0.01 * mechanism.characteristic_length
    np.testing.assert_allclose(found.q, q, rtol=0, atol=1e-9)
