"""Every machine, every question, every promise: each measured from the description, or asked a second way."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, actuator_units, assert_feasible, assert_honest, task_errors
from machines import EVERY, FILES, machine
from oracles import any_values, targets_about
from pfabrik import Mechanism, Solution, Status
from pfabrik.model import model_of

pytestmark = [
    pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning"),
    pytest.mark.skipif(INTERPRETED, reason="many searches"),
]

NAMES = tuple(EVERY | FILES)
ROWS = 6


def _near(m: Mechanism) -> tuple[np.ndarray, Solution]:
    targets = targets_about(m, np.random.default_rng(1), ROWS, 0.05, 0.05)
    return targets, pf.solve_ik(m, targets)


def _far(m: Mechanism) -> tuple[np.ndarray, Solution]:
    targets = targets_about(m, np.random.default_rng(2), ROWS, 1.5, 0.8)
    return targets, pf.solve_ik(m, targets)


def _from_a_start(m: Mechanism) -> tuple[np.ndarray, Solution]:
    start = pf.solve_ik(m, targets_about(m, np.random.default_rng(3), 1, 0.05, 0.05)[0])
    targets = targets_about(m, np.random.default_rng(4), ROWS, 0.7, 0.4)
    return targets, pf.solve_ik(m, targets, start=start)


def _along_a_path(m: Mechanism) -> tuple[np.ndarray, Solution]:
    there = targets_about(m, np.random.default_rng(5), 1, 0.8, 0.0)[0]
    targets = np.repeat(m.home_pose[None], 2 * ROWS, axis=0)
    targets[:, :3, 3] += np.linspace(0, 1, 2 * ROWS)[:, None] * (there - m.home_pose)[:3, 3]
    return targets, pf.track(m, targets)


def _forward(m: Mechanism) -> tuple[np.ndarray, Solution]:
    values = any_values(m, ROWS, 1.2, seed=6)
    return values, pf.solve_fk(m, values)


def _forward_from_a_start(m: Mechanism) -> tuple[np.ndarray, Solution]:
    start = pf.solve_fk(m, any_values(m, 1, 0.1, seed=7)[0])
    values = any_values(m, ROWS, 0.6, seed=8)
    return values, pf.solve_fk(m, values, start=start)


QUESTIONS: dict[str, Callable[[Mechanism], tuple[np.ndarray, Solution]]] = {
    "near": _near,
    "far": _far,
    "from a start": _from_a_start,
    "along a path": _along_a_path,
    "forward": _forward,
    "forward from a start": _forward_from_a_start,
}


@cache
def asked(name: str, question: str) -> tuple[np.ndarray, Solution]:
    """What was asked, targets or actuator values, and the answers."""
    return QUESTIONS[question](machine(name))


every_answer = pytest.mark.parametrize(("name", "question"), [(n, q) for n in NAMES for q in QUESTIONS])


@every_answer
def test_a_configuration_is_closed_within_its_limits_and_is_what_the_answer_says(name: str, question: str) -> None:
    """Measured by the description alone, and by the library's own measure of a joint vector."""
    m, (_, answer) = machine(name), asked(name, question)
    assert_feasible(m, answer)
    again, length = pf.configuration(m, answer.q), m.characteristic_length
    assert (again.status == Status.REACHED).all()
    np.testing.assert_allclose(again.pose[..., :3, 3], answer.pose[..., :3, 3], rtol=0, atol=1e-8 * length)
    np.testing.assert_allclose(again.pose[..., :3, :3], answer.pose[..., :3, :3], rtol=0, atol=2e-8)
    off = (again.actuators - answer.actuators) / actuator_units(m)
    assert np.abs(off).max() <= 1e-8
    for joint, point in answer.points.items():
        np.testing.assert_allclose(again.points[joint], point, rtol=0, atol=2e-8 * length)
    for limit, margin in pf.margins(answer).items():
        np.testing.assert_allclose(pf.margins(again)[limit], margin, rtol=0, atol=1e-6)
        assert np.nanmin(margin) >= -1e-7


@every_answer
def test_reached_is_said_where_it_is_and_errors_are_what_they_are(name: str, question: str) -> None:
    m, (request, answer) = machine(name), asked(name, question)
    if question.startswith("forward"):
        off = (np.abs(answer.actuators - request) / actuator_units(m)).max(axis=1)
        np.testing.assert_allclose(answer.actuator_error, off, rtol=1e-9, atol=1e-9)
        assert np.array_equal(answer.status == Status.REACHED, off <= 1e-9)
        return
    assert_honest(m, request, answer)
    apart = answer.position_error / m.characteristic_length
    turned = 0.0 if m.end_effector_is_joint else answer.rotation_error
    np.testing.assert_allclose(np.hypot(apart, turned), task_errors(m, answer.pose, request), rtol=0, atol=1e-8)


@every_answer
def test_nothing_is_out_of_reach_without_a_reason(name: str, question: str) -> None:
    """A limit that lies where the answer is, or a sentence that says what else stops it."""
    _, answer = asked(name, question)
    for row in np.flatnonzero(answer.status == Status.PROJECTED):
        one = answer[row]
        assert one.reason, f"row {row}"
        measured = pf.margins(one)
        for limit in one.active_limits:
            if (limit.joint, limit.bound) in measured:
                assert abs(measured[limit.joint, limit.bound]) <= 1e-5, (row, limit)


@pytest.mark.parametrize("name", NAMES)
def test_no_attempt_reaches_what_is_said_to_be_out_of_reach(name: str) -> None:
    """Neither those of the search's log, nor the working modes that closed forms list."""
    m = machine(name)
    targets, answer = asked(name, "far")
    for row in np.flatnonzero((answer.status == Status.PROJECTED) & ~answer.certified)[:2]:
        log = pf.search_log(m, targets[row])
        assert not any(attempt.ending == "reached" for attempt in log.attempts), row


@pytest.mark.parametrize("name", [name for name in NAMES if name != "closure.H4"])  # its home is singular twice over
def test_feasibility_is_what_a_start_at_home_reaches(name: str) -> None:
    m = machine(name)
    if model_of(m).why_poses_do_not_suffice:
        pytest.skip("no closed forms")
    targets = np.concatenate([targets_about(m, np.random.default_rng(9), 3 * ROWS, size, size) for size in (0.1, 0.4)])
    kept = pf.solve_ik(m, targets, start=pf.solve_ik(m, m.home_pose))
    margin = pf.feasibility(m, targets).margin
    clear = np.abs(margin) > 1e-7
    assert np.array_equal((margin >= 0.0)[clear], (kept.status == Status.REACHED)[clear])


@pytest.mark.parametrize("name", NAMES)
def test_forward_kinematics_from_a_start_is_where_small_steps_lead(name: str) -> None:
    """A start's mode is the one that small steps end in; of a way that ends at a dead point nothing is said."""
    m = machine(name)
    if pf.mobility(m).uncontrolled:
        pytest.skip("what no actuator holds stays where the way has led it")
    values, answer = asked(name, "forward from a start")
    start = pf.solve_fk(m, any_values(m, 1, 0.1, seed=7)[0])
    steps, is_on_the_way = np.linspace(0.0, 1.0, 201)[1:, None, None], np.full(ROWS, True)
    here: Solution = start
    for share in steps:
        there = start.actuators + share[0] * (values - start.actuators)
        here = pf.solve_fk(m, there, start=here)
        is_on_the_way &= here.status == Status.REACHED
    rows = is_on_the_way & (answer.status == Status.REACHED)
    apart = np.abs(answer.pose - here.pose)[rows]
    apart[:, :3, 3] /= m.characteristic_length
    assert apart.max(initial=0.0) <= 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_an_eighth_of_the_step_is_a_small_part_of_the_largest_change(name: str) -> None:
    """Along a straight way, in and out of reach: what does not jump, and says so, is continuous.

    At a fold an actuator goes as the square root of the way: its largest change becomes 0.2 to 0.61 of what it was, as
    the steps fall. A leap stays as large as it is.
    """
    m = machine(name)
    end = targets_about(m, np.random.default_rng(5), 1, 0.6, 0.2)[0]
    turn = Rotation.from_matrix(end[:3, :3] @ m.home_pose[:3, :3].T).as_rotvec()
    largest = []
    for n_steps in (12, 96):
        share = np.linspace(0.0, 1.0, n_steps + 1)[:, None]
        targets = np.repeat(m.home_pose[None], n_steps + 1, axis=0)
        targets[:, :3, 3] += share * (end - m.home_pose)[:3, 3]
        targets[:, :3, :3] = Rotation.from_rotvec(share * turn).as_matrix() @ m.home_pose[:3, :3]
        track = pf.track(m, targets)
        changes = np.abs(np.diff(track.actuators, axis=0) / actuator_units(m)).max(axis=1)
        largest.append(changes[~track.jumps[1:]].max() if largest else changes.max())
    assert largest[1] <= max(0.7 * largest[0], 2e-3)


@pytest.mark.parametrize("name", NAMES)
def test_a_path_that_comes_home_ends_there(name: str) -> None:
    """Out of reach and back: home is reached, and but for a jump that is said the actuators are home's."""
    m = machine(name)
    end = targets_about(m, np.random.default_rng(5), 1, 0.6, 0.0)[0]
    share = np.concatenate([np.linspace(0, 1, 13), np.linspace(1, 0, 13)])[:, None]
    targets = np.repeat(m.home_pose[None], len(share), axis=0)
    targets[:, :3, 3] += share * (end - m.home_pose)[:3, 3]
    track = pf.track(m, targets)
    assert track.status[-1] == Status.REACHED
    mobility = pf.mobility(m)
    if track.jumps.any() or mobility.uncontrolled or mobility.actuators > mobility.platform:
        return
    assert (np.abs(track.actuators[-1] - track.actuators[0]) / actuator_units(m)).max() <= 1e-5
