"""Every machine, every question, every promise: each measured from the description, or asked a second way."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Literal

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, actuator_units, assert_feasible, assert_honest, home_values, pose_errors, task_errors
from machines import EVERY, FILES, machine
from oracles import any_targets, any_values, targets_about
from oracles.nearest import conditions, priced
from pfabrik import Mechanism, Options, Solution, Status
from pfabrik.engines.engine import engine_of
from pfabrik.engines.joints.closure_engine import ClosureEngine
from pfabrik.machine.description.task import task_of
from pfabrik.machine.model import model_of

pytestmark = [
    pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning"),
    pytest.mark.skipif(INTERPRETED, reason="many searches"),
]

NAMES = tuple(EVERY | FILES)
ROWS = 3
NEARER = 1e-6
"""By how much one pose must be nearer than another to count [L]."""
ENDS_EARLY = "snake60"
"""Its searches end while they still come nearer, slowly."""
SINGULAR = "closure.H4"
"""Its home is singular twice over: there slopes say little, and searches from it are lost now and then."""
IN_PARTS = {f"closure.{name}" for name in ("upu", "wandering_upu", "delta_ss", "delta_su", "linear_delta", "3-RRRS")}
"""Machines whose feasible poses fall into parts, of which searches miss the nearest now and then."""
LEANING = {"closure.upu", "closure.wandering_upu"}
"""Two of these that lean in a part that only searches in joint coordinates find."""


def _near(m: Mechanism) -> tuple[np.ndarray, Solution]:
    targets = targets_about(m, np.random.default_rng(1), ROWS, 0.05, 0.05)
    return targets, pf.solve_ik(m, targets)


def _far(m: Mechanism) -> tuple[np.ndarray, Solution]:
    targets = targets_about(m, np.random.default_rng(2), ROWS, 1.5, 0.8)
    return targets, pf.solve_ik(m, targets)


def _far_with(hold: str | None, m: Mechanism) -> tuple[np.ndarray, Solution]:
    targets = targets_about(m, np.random.default_rng(2), ROWS, 0.7, 1.2)
    return targets, pf.solve_ik(m, targets, options=Options(hold=hold))


def _anywhere(m: Mechanism) -> tuple[np.ndarray, Solution]:
    targets = any_targets(m, 2 * ROWS)
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


def _forward_anywhere(m: Mechanism) -> tuple[np.ndarray, Solution]:
    rng = np.random.default_rng(13)
    size = rng.choice([0.1, 1.0, 10.0, 1e4], (ROWS, 1)) * actuator_units(m)
    values = home_values(m) + size * rng.uniform(-1, 1, size.shape)
    return values, pf.solve_fk(m, values)


def _forward_from_a_start(m: Mechanism) -> tuple[np.ndarray, Solution]:
    start = pf.solve_fk(m, any_values(m, 1, 0.1, seed=7)[0])
    values = any_values(m, ROWS, 0.6, seed=8)
    return values, pf.solve_fk(m, values, start=start)


QUESTIONS: dict[str, Callable[[Mechanism], tuple[np.ndarray, Solution]]] = {
    "near": _near,
    "far": _far,
    "held position": partial(_far_with, "position"),
    "nothing held": partial(_far_with, None),
    "anywhere": _anywhere,
    "from a start": _from_a_start,
    "along a path": _along_a_path,
    "forward": _forward,
    "forward anywhere": _forward_anywhere,
    "forward from a start": _forward_from_a_start,
}


@cache
def asked(name: str, question: str) -> tuple[np.ndarray, Solution]:
    """What was asked, targets or actuator values, and the answers."""
    return QUESTIONS[question](machine(name))


TO_TARGETS = [question for question in QUESTIONS if "forward" not in question]


@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize("name", NAMES)
def test_an_answer_is_a_closed_configuration_as_near_as_it_says_and_has_reasons(name: str, question: str) -> None:
    m, (request, answer) = machine(name), asked(name, question)
    assert_configuration_is_what_the_answer_says(m, answer)
    if question.startswith("forward"):
        assert_feasible(m, answer)
        off = (np.abs(answer.actuators - request) / actuator_units(m)).max(axis=1)
        np.testing.assert_allclose(answer.actuator_error, off, rtol=1e-9, atol=1e-9)
        assert np.array_equal(answer.status == Status.REACHED, off <= 1e-9)
    else:
        assert_distance_from_targets_is_what_the_answer_says(m, request, answer)
    assert_nothing_is_out_of_reach_without_a_reason(answer)


def assert_configuration_is_what_the_answer_says(m: Mechanism, answer: Solution) -> None:
    """By the library's own measure of a joint vector."""
    again, length = pf.configuration(m, answer.q), m.characteristic_length
    assert (
        again.status < Status.FAILED
    ).all() and again.limit_excess.max() <= 2e-8  # by loops open as far as they may be
    np.testing.assert_allclose(again.pose[..., :3, 3], answer.pose[..., :3, 3], rtol=0, atol=1e-8 * length)
    np.testing.assert_allclose(again.pose[..., :3, :3], answer.pose[..., :3, :3], rtol=0, atol=2e-8)
    off = (again.actuators - answer.actuators) / actuator_units(m)
    assert np.abs(off).max() <= 1e-8
    for joint, point in answer.points.items():
        np.testing.assert_allclose(again.points[joint], point, rtol=0, atol=2e-8 * length)
    measured = pf.margins(again)
    for limit, margin in pf.margins(answer).items():
        np.testing.assert_allclose(measured[limit], margin, rtol=0, atol=1e-6)
        assert np.nanmin(margin) >= -1e-7


def assert_distance_from_targets_is_what_the_answer_says(m: Mechanism, request: np.ndarray, answer: Solution) -> None:
    assert_honest(m, request, answer)
    apart = answer.position_error / m.characteristic_length
    turned = 0.0 if m.end_effector_is_joint else answer.rotation_error
    np.testing.assert_allclose(np.hypot(apart, turned), task_errors(m, answer.pose, request), rtol=1e-8, atol=1e-8)
    held = np.array(answer.held)
    assert np.all(answer.rotation_error[held == "orientation"] <= 1e-8)
    assert np.all(apart[held == "position"] <= 1e-8)


def assert_nothing_is_out_of_reach_without_a_reason(answer: Solution) -> None:
    """A limit that lies where the answer is, or a sentence that says what else stops it."""
    for row, one in enumerate(answer):
        assert bool(one.reason) is (one.status != Status.REACHED), f"row {row}"
        measured = pf.margins(one)
        for limit in one.active_limits:
            if (limit.joint, limit.bound) in measured:
                assert abs(measured[limit.joint, limit.bound]) <= 1e-5, (row, limit)


def distances(m: Mechanism, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Distances from targets as projections count them [L]."""
    return np.hypot(position, m.rotation_length * rotation * (not m.end_effector_is_joint)) / m.characteristic_length


@pytest.mark.parametrize("question", ["far", "held position", "nothing held", "from a start"])
@pytest.mark.parametrize("name", NAMES)
def test_no_small_motion_leads_nearer_for_the_limits_that_are_named(name: str, question: str) -> None:
    """By slopes of the description: limits push back by their multipliers, and nothing of the way is left open."""
    m, (targets, answer) = machine(name), asked(name, question)
    if name == SINGULAR:
        pytest.skip("its home is singular")
    share = 0.1 if name == ENDS_EARLY else 1e-4
    options = {"held position": Options(hold="position"), "nothing held": Options(hold=None)}.get(question, Options())
    for row in np.flatnonzero(answer.status == Status.PROJECTED):
        found = conditions(m, targets[row], answer[int(row)], options)
        assert np.linalg.norm(found.rest) <= share * np.linalg.norm(found.slope) + 2e-5 * m.characteristic_length, row
        assert all((limit.multiplier or 0.0) >= 0.0 for limit in answer[int(row)].active_limits)


@pytest.mark.parametrize("name", NAMES)
def test_no_pose_that_is_known_is_nearer(name: str) -> None:
    """Those of all other answers: every one is feasible."""
    m, (targets, answer) = machine(name), asked(name, "nothing held")
    known = np.concatenate([asked(name, question)[1].pose for question in QUESTIONS])
    own, n_beaten = distances(m, answer.position_error, answer.rotation_error), 0
    for target, distance in zip(targets, own, strict=True):
        others = task_of(m).errors(known, np.repeat(target[None], len(known), axis=0))
        n_beaten += distances(m, *others).min() < distance - NEARER
    assert n_beaten <= (1 if name in IN_PARTS else 0)


@pytest.mark.parametrize("question", [pytest.param("near", marks=pytest.mark.campaign), "far"])
@pytest.mark.parametrize("name", NAMES)
def test_joint_space_reaches_the_same_and_is_no_nearer(name: str, question: str) -> None:
    """Poses and chains are searched by engines of their own; one on all joints' coordinates answers every machine."""
    m, (targets, answer) = machine(name), asked(name, question)
    if isinstance(engine_of(m), ClosureEngine):
        pytest.skip("its engine is this one")
    rows = ClosureEngine(model_of(m)).answer(targets, None, Options(), keep_mode=False).rows
    np.testing.assert_array_equal(answer.status, rows.status)
    own, other = (
        distances(m, *off) + priced(m, Options(), distances(m, *off), off[1] * (not m.end_effector_is_joint))
        for off in ((answer.position_error, answer.rotation_error), rows.measures[:, :2].T)
    )
    farther = own > other + NEARER
    most = ROWS if name in LEANING else ROWS // 2 if name in IN_PARTS else 0
    assert farther.sum() <= most


Hold = Literal["orientation", "position"]
HELD: tuple[Hold, ...] = ("orientation", "position")


@pytest.mark.parametrize("hold", HELD)
@pytest.mark.parametrize("name", NAMES)
def test_what_a_known_pose_has_is_not_given_up_for_less_than_its_price(name: str, hold: Hold) -> None:
    """Each target has the part that is to be held from a pose that answers another one."""
    m, rng = machine(name), np.random.default_rng(5)
    if not (any(task_of(m).axes) and task_of(m).rotations):
        pytest.skip("nothing else to give up")
    known, options = asked(name, "nothing held")[1].pose, Options(hold=hold)
    targets = known.copy()
    if hold == "orientation":
        targets[:, :3, 3] += rng.uniform(-0.8, 0.8, (ROWS, 3)) * task_of(m).axes * m.characteristic_length
    else:
        targets[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.9, 0.9, (ROWS, 3))).as_matrix() @ targets[:, :3, :3]
    answer = pf.solve_ik(m, targets, options=options)
    away, known_away = (
        distances(m, *errors)
        for errors in ((answer.position_error, answer.rotation_error), task_of(m).errors(known, targets))
    )
    off = answer.rotation_error if hold == "orientation" else answer.position_error / m.characteristic_length
    costs = away + priced(m, options, away, off)
    assert (costs > known_away + NEARER).sum() <= (2 if name == "closure.canfield" else 0)  # whose search misses some
    assert np.equal(answer.held, hold)[(answer.status == Status.PROJECTED) & (off <= 1e-9)].all()


@pytest.mark.parametrize("name", NAMES)
def test_home_is_reached_with_the_coordinates_of_the_description(name: str) -> None:
    m, length = machine(name), machine(name).characteristic_length
    for answer in (pf.solve_ik(m, m.home_pose), pf.solve_fk(m, home_values(m))):
        assert answer.status is Status.REACHED
        assert pose_errors(m, answer.pose, m.home_pose) <= 1e-8
        for joint, value in answer.joints.items():
            np.testing.assert_allclose(value, m.home_coordinate(joint), rtol=0, atol=1e-8 * max(length, 1.0))
        for joint, point in answer.points.items():
            np.testing.assert_allclose(point, m.joint(joint).at, rtol=0, atol=1e-8 * length)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_assembled_is_reached_and_assembles_to_the_same_pose(name: str) -> None:
    m, (_, there) = machine(name), asked(name, "forward from a start")
    for start in (None, there):
        answer = pf.solve_ik(m, there.pose, start=start)
        assert (answer.status == Status.REACHED).all()
        assert_honest(m, there.pose, answer)
        again = pf.solve_fk(m, answer.actuators, start=answer)
        assert (again.status == Status.REACHED).all()
        assert pose_errors(m, again.pose, answer.pose).max() <= 1e-8


@pytest.mark.parametrize("question", ["far", "nothing held"])
@pytest.mark.parametrize("name", NAMES)
def test_answers_asked_again_from_themselves_stay(name: str, question: str) -> None:
    """No answer comes nearer when it is asked again, none goes farther, and its pose is reached from it as it is."""
    m, (targets, answer) = machine(name), asked(name, question)
    away = np.flatnonzero(answer.status == Status.PROJECTED)
    if not len(away):
        return
    answer, length = answer[away], m.characteristic_length
    again = pf.solve_ik(
        m, targets[away], start=answer, options=Options(hold=None if "nothing" in question else HELD[0])
    )
    there = pf.solve_ik(m, answer.pose, start=answer)
    assert (again.status == Status.PROJECTED).all() and (there.status == Status.REACHED).all()
    stays = np.equal(again.held, answer.held)
    assert np.equal(np.array(answer.held)[~stays], None).all()
    for other, rows in ((again, stays), (there, np.full(len(away), True))):
        apart = np.abs(answer.pose - other.pose)[rows]
        apart[:, :3, 3] /= length
        gives_way = np.equal(answer.held, None) if "nothing" not in question else np.full(len(away), False)
        most = np.where(gives_way[rows] & (other is again), 1e-5, 1e-9)  # where the price bends sharply
        assert (apart.max(axis=(1, 2), initial=0.0) <= most).all()
    off = np.abs(there.actuators - answer.actuators) / actuator_units(m)
    assert off.max() <= 5e-5  # at dead points a pose tells of its actuators by the root of what it is known to


@pytest.mark.parametrize("name", NAMES)
def test_a_pose_that_is_answered_is_reached_without_a_start(name: str) -> None:
    """But now and then where redundant joints are to be searched for, which at a border have but one place."""
    m, model = machine(name), model_of(machine(name))
    is_redundant = name == ENDS_EARLY or (model.has_legs and len(model.legs.redundant) > 0)
    poses = np.concatenate([asked(name, question)[1].pose for question in TO_TARGETS])
    again = pf.solve_ik(m, poses)
    n_missed = np.count_nonzero(again.position_error / m.characteristic_length + again.rotation_error > 1e-6)
    assert n_missed <= (0.2 * len(poses) if is_redundant else 0)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.campaign] * (n in EVERY and "." in n)) for n in NAMES]
)
def test_no_attempt_reaches_what_is_said_to_be_out_of_reach(name: str) -> None:
    m = machine(name)
    targets, answer = asked(name, "far")
    for row in np.flatnonzero((answer.status == Status.PROJECTED) & ~answer.certified)[:1]:
        log = pf.search_log(m, targets[row])
        assert not any(attempt.ending == "reached" for attempt in log.attempts), row


@pytest.mark.parametrize("name", [name for name in NAMES if name != SINGULAR])
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
    steps, is_on_the_way = np.linspace(0.0, 1.0, 81)[1:, None, None], np.full(ROWS, True)
    here: Solution = start
    for share in steps:
        there = start.actuators + share[0] * (values - start.actuators)
        here = pf.solve_fk(m, there, start=here)
        is_on_the_way &= here.status == Status.REACHED
    rows = is_on_the_way & (answer.status == Status.REACHED)
    apart = np.abs(answer.pose - here.pose)[rows]
    apart[:, :3, 3] /= m.characteristic_length
    assert apart.max(initial=0.0) <= 1e-6


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.campaign] * (n == "files.four_bar_tripod")) for n in NAMES]
)
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
