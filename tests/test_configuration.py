"""Configurations that a caller gives: joint vectors q, named by their mechanism, measured and started from.

That the joint vector of an answer is the same configuration is in `test_matrix`.
"""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from machines import machine
from oracles import targets_about
from pfabrik import Mechanism, Solution, Status
from pfabrik.machine.description.joints import KINDS

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")


def near_home(mechanism: Mechanism, n: int = 3) -> Solution:
    """Feasible answers to targets around home."""
    return pf.solve_ik(mechanism, targets_about(mechanism, np.random.default_rng(3), n, 0.05, 0.05))


@pytest.mark.parametrize("name", ["five_bar", "nrpm", "rps", "delta", "cru", "mixed", "serial_spherical"])
def test_q_has_one_number_for_each_named_coordinate(name: str) -> None:
    """A joint's part of q is what `joints` tells, an actuator's what `actuators` tells."""
    mechanism = machine(name)
    answer, names = near_home(mechanism), mechanism.coordinate_names
    assert answer.q.shape == (3, len(names)) and len(set(names)) == len(names)
    place = 0
    for joint in mechanism.joints:
        freedoms = len(KINDS[joint.type].coordinates)
        columns = slice(place, place + freedoms)
        expected = [joint.name] if freedoms == 1 else [f"{joint.name}[{k}]" for k in range(freedoms)]
        assert list(names[columns]) == expected
        if freedoms:
            shape = (3,) if freedoms == 1 else (3, freedoms)
            np.testing.assert_array_equal(answer.joints[joint.name], answer.q[:, columns].reshape(shape))
        place += freedoms
    assert place == len(names)
    for column, actuator in enumerate(mechanism.actuator_names):
        first = np.reshape(answer.joints[actuator], (3, -1))[:, 0]
        np.testing.assert_allclose(first, answer.actuators[:, column], atol=1e-9 * mechanism.characteristic_length)
    one = pf.configuration(mechanism, answer[1].q)
    np.testing.assert_allclose(one.q, answer[1].q, rtol=0, atol=1e-12 * mechanism.characteristic_length)
    assert one.shape == () and one.status is Status.REACHED and set(one.points) == set(answer.points)


def test_a_configuration_beyond_a_limit_is_exceeded_and_names_it() -> None:
    """The same joint vector, for a machine with a shorter stroke."""
    mechanism = pf.load("stewart")
    answer = pf.solve_ik(mechanism, (10.0, 0.0, 205.0))
    longest = mechanism.actuator_names[int(np.argmax(answer.actuators))]
    tight = mechanism.with_limits({longest: (140.0, answer.actuators.max() - 0.5)})
    beyond = pf.configuration(tight, answer.q)
    assert beyond.status is Status.EXCEEDED and not beyond
    assert [(limit.joint, limit.bound) for limit in beyond.active_limits] == [(longest, "max")]
    assert beyond.limit_excess == pytest.approx(0.5 / mechanism.characteristic_length, rel=1e-6)
    assert pf.margins(beyond)[longest, "max"] < 0.0


def test_an_open_configuration_is_failed_and_tells_by_how_much() -> None:
    """A hexapod's strut, drawn out alone by 3, leaves a gap of 3 at the platform or shares it with others."""
    mechanism = pf.load("stewart")
    q = np.tile(pf.solve_ik(mechanism, mechanism.home_pose).q, (2, 1))
    q[1, mechanism.coordinate_names.index("BL1")] += 3.0
    answer = pf.configuration(mechanism, q)
    assert answer.status.tolist() == [Status.REACHED, Status.FAILED]
    assert 0.5 <= answer.residual[1] <= 10.0 and answer.residual[0] <= 1e-9 * mechanism.characteristic_length
    np.testing.assert_array_equal(answer.q, q)


@pytest.mark.parametrize("name", ["stewart", "servo_hexapod", "rps", "nrpm"])
def test_a_ball_joint_that_is_not_as_its_bodies_are_leaves_the_loops_open(name: str) -> None:
    """At the platform too, whose legs are closed wherever it is turned to: it is measured, not set right."""
    mechanism = machine(name)
    last = [joint.name for joint in mechanism.joints if joint.type == "spherical"][-1]
    columns = [k for k, each in enumerate(mechanism.coordinates) if each.joint.name == last]
    q = pf.solve_ik(mechanism, mechanism.home_pose).q
    q[columns] += (0.3, 0.2, -0.1)
    answer = pf.configuration(mechanism, q)
    assert answer.status is Status.FAILED and answer.residual > 0.01 * mechanism.characteristic_length
    np.testing.assert_allclose(answer.q, q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["five_bar", "nrpm", "delta", "rps", "ankle_ups"])
def test_a_joint_vector_starts_as_the_answer_it_comes_from(name: str) -> None:
    """Inverse, forward and along a path: the same configurations follow from both."""
    mechanism = machine(name)
    begin, size = near_home(mechanism, 1)[0], mechanism.characteristic_length
    path = np.repeat(begin.pose[None], 5, axis=0)
    path[:, :3, 3] += np.linspace(0.0, 1.0, 5)[:, None] * (mechanism.home_pose - begin.pose)[:3, 3]
    for solve in (
        lambda start: pf.solve_ik(mechanism, path, start=start),
        lambda start: pf.track(mechanism, path, start=start),
        lambda start: pf.solve_fk(mechanism, begin.actuators, start=start),
    ):
        by_answer, by_vector = solve(begin), solve(begin.q)
        np.testing.assert_array_equal(by_vector.status, by_answer.status)
        np.testing.assert_allclose(by_vector.pose, by_answer.pose, atol=1e-7 * size)
        np.testing.assert_allclose(by_vector.actuators, by_answer.actuators, atol=1e-7 * size)
