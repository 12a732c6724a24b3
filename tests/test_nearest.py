"""Projections are the nearest feasible poses: an optimiser that knows nothing of the solver finds none nearer."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, excess_of_joints, excess_of_points, gap_of_joints, gap_of_points
from machines import closure, five_bar
from oracles import targets_about
from oracles.nearest import Problem, drawn_targets, nearest
from pfabrik import Joint, Leg, Mechanism, Options, Solution, Status
from pfabrik.closure.close import close
from pfabrik.closure.closure_engine import ClosureEngine
from pfabrik.closure.projection import projection_modes
from pfabrik.description.task import task_of
from pfabrik.engine import engine_of
from pfabrik.model import model_of
from pfabrik.platform.legs_engine import LegsEngine
from pfabrik.rotations import angles_between

FEASIBLE = 1e-9
"""What loops may be open, and limits exceeded, as every answer promises [L or rad]."""
SAME = 1e-6
"""Share of the distance by which an answer may be farther than the best: answers stay 1e-10 inside their limits, and
one limit may hold back by more than it gives way."""
ALIKE = 0.999
"""Multipliers that differ by less come in the order of the description."""
CASES = [
    ("five_bar", None),
    ("stewart", "orientation"),
    ("stewart", None),
    ("nrpm", "orientation"),
    ("nrpm", None),
    ("servo_hexapod", "orientation"),
    ("servo_hexapod", None),
    ("delta", None),
]
"""Machines, and what is to be held; a 5-bar's tip and a delta's platform have no orientation to give up."""
QUICK = ("five_bar", "stewart")
NAMES = tuple(dict.fromkeys(name for name, _ in CASES))


def projections(name: str, hold: str | None, n: int, seed: int = 0) -> tuple[Mechanism, np.ndarray, Solution]:
    """A machine, `n` targets that it does not reach, (n, 4, 4), and its answers."""
    mechanism, rng = pf.load(name), np.random.default_rng(seed)
    targets = np.concatenate([drawn_targets(mechanism, rng, 10) for _ in range(1 + n // 2)])
    answers = pf.solve_ik(mechanism, targets, options=Options(hold=hold))
    away = np.flatnonzero(answers.status == Status.PROJECTED)[:n]
    assert len(away) == n
    return mechanism, targets[away], answers[away]


def few(name: str) -> int:
    """As many targets as two seconds allow."""
    if INTERPRETED:
        return 2 if name in QUICK else 1
    return 10 if name in QUICK else 4


def distances(mechanism: Mechanism, answers: Solution, rotation_length: float | None = None) -> np.ndarray:
    """How far answers are from their targets, as projections count it, (n,) [length]."""
    lever = rotation_length or mechanism.rotation_length
    return np.hypot(answers.position_error, lever * np.asarray(answers.rotation_error))


def check_feasible(mechanism: Mechanism, targets: np.ndarray, answers: Solution) -> None:
    """Closed, within all limits, and finite: measured from the description alone, and by the closure engine."""
    assert np.isin(answers.status, (Status.REACHED, Status.PROJECTED)).all()
    assert all(np.isfinite(array).all() for array in (answers.pose, answers.actuators, *answers.joints.values()))
    assert gap_of_points(mechanism, answers).max() <= FEASIBLE
    assert excess_of_points(mechanism, answers).max() <= FEASIBLE
    assert pf.closure_residual(answers).max() <= FEASIBLE * mechanism.characteristic_length
    problems = [Problem(mechanism, target, None, answer) for target, answer in zip(targets, answers, strict=True)]
    assert max(problem.excess(problem.answer) for problem in problems) <= FEASIBLE


# --- feasibility -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [None, pytest.param(300, marks=pytest.mark.campaign)])
@pytest.mark.parametrize(("name", "hold"), CASES)
def test_limits_are_kept_and_loops_closed_however_far_the_target(name: str, hold: str | None, n: int | None) -> None:
    mechanism, targets, answers = projections(name, hold, n or few(name))
    check_feasible(mechanism, targets, answers)
    targets[:, :3, 3] *= 1e6
    answers = pf.solve_ik(mechanism, targets, options=Options(hold=hold))
    assert (answers.status == Status.PROJECTED).all()
    check_feasible(mechanism, targets, answers)


# --- nearness --------------------------------------------------------------------------------------------------------


def gains(mechanism: Mechanism, targets: np.ndarray, answers: Solution, starts: int) -> np.ndarray:
    """By what share of their distances the nearest poses found are nearer than answers that hold as much, (n,)."""
    found = []
    for target, answer in zip(targets, answers, strict=True):
        problem = Problem(mechanism, target, answer.held, answer)
        best = nearest(problem, starts)
        assert best is not None, "not even the search that starts from the answer ends at a feasible pose"
        found.append(best.gain / (problem.distance * problem.model.length))
    return np.array(found)


@pytest.mark.parametrize(("name", "hold"), CASES)
def test_no_feasible_pose_is_nearer(name: str, hold: str | None) -> None:
    assert gains(*projections(name, hold, few(name)), starts=1).max() <= SAME


@pytest.mark.campaign
@pytest.mark.parametrize(("name", "hold"), CASES)
def test_hardly_any_feasible_pose_is_nearer_and_none_by_much(name: str, hold: str | None) -> None:
    farther = gains(*projections(name, hold, 100, seed=1), starts=6)
    assert (farther <= SAME).mean() >= 0.99
    assert farther.max() <= 0.01


def turned_targets(mechanism: Mechanism, n: int, move: float, turn: float) -> np.ndarray:
    """Targets (n, 4, 4) about home, moved by about `move` [L] and turned by about `turn` [rad]."""
    rng, targets = np.random.default_rng(2), np.tile(mechanism.home_pose, (n, 1, 1))
    targets[:, :3, 3] += move * mechanism.characteristic_length * rng.normal(size=(n, 3))
    targets[:, :3, :3] = Rotation.from_rotvec(turn * rng.normal(size=(n, 3))).as_matrix()
    return targets


@pytest.mark.parametrize("name", ["stewart", pytest.param("nrpm", marks=pytest.mark.slow)])
def test_no_feasible_pose_at_the_same_place_is_turned_less(name: str) -> None:
    mechanism = pf.load(name)
    targets = turned_targets(mechanism, few(name), 0.05, 1.0)
    answers = pf.solve_ik(mechanism, targets, options=Options(hold="position"))
    held = answers.held == "position"
    assert held.any()
    assert answers.position_error[held].max() <= FEASIBLE * mechanism.characteristic_length
    away = np.flatnonzero(answers.status == Status.PROJECTED)
    assert gains(mechanism, targets[away], answers[away], starts=1).max() <= SAME


@pytest.mark.parametrize("share", [0.1, 10.0])
def test_what_a_rotation_counts_is_for_the_caller_to_say(share: float) -> None:
    """The less it counts, the more the platform turns toward a far target."""
    mechanism, targets, answers = projections("stewart", None, few("stewart"))
    length = share * mechanism.rotation_length
    ours = pf.solve_ik(mechanism, targets, options=Options(hold=None, rotation_length=length))
    for target, answer in zip(targets, ours, strict=True):
        problem = Problem(mechanism, target, None, answer, rotation_length=length)
        best = nearest(problem, 1)
        assert best is not None
        assert best.gain <= SAME * problem.distance * mechanism.characteristic_length
    more = np.greater(ours.rotation_error, answers.rotation_error)
    assert (more if share < 1.0 else ~more).all()


@pytest.mark.parametrize(("name", "hold"), CASES)
def test_the_centroid_is_never_nearer(name: str, hold: str | None) -> None:
    mechanism, targets, answers = projections(name, hold, few(name))
    centred = pf.passes.solve(mechanism, targets, replace(pf.passes.Options.centroid(), hold=hold))
    check_feasible(mechanism, targets, centred)
    alike = np.equal(centred.held, answers.held)
    ours, theirs = distances(mechanism, answers)[alike], distances(mechanism, centred)[alike]
    assert (ours <= theirs * (1.0 + SAME)).all()


@pytest.mark.parametrize("name", ["five_bar", "delta"])
def test_what_has_no_orientation_has_none_to_hold(name: str) -> None:
    mechanism, targets, answers = projections(name, None, 2)
    for hold in ("orientation", "position"):
        held = pf.solve_ik(mechanism, targets, options=Options(hold=hold))
        np.testing.assert_allclose(held.pose, answers.pose, atol=FEASIBLE * mechanism.characteristic_length)
        assert list(held.held) == [None] * len(targets)


# --- special targets -------------------------------------------------------------------------------------------------


def special_targets(mechanism: Mechanism) -> np.ndarray:
    """The centre of the base, home turned by half a turn and by a quarter, and places 1e6 L and 1e12 L away."""
    half_turns = [pf.pose(mechanism.reference_point, rotvec=np.pi * axis) for axis in np.eye(3)]
    quarter = pf.pose(mechanism.reference_point, rotvec=(0, 0, np.pi / 2))
    rng = np.random.default_rng(3)
    away = [*np.eye(3), *-np.eye(3), *rng.normal(size=(2, 3))]
    far = [pf.pose(mechanism.characteristic_length * size * each) for each in away for size in (1e6, 1e12)]
    targets = np.array([pf.pose((0, 0, 0)), *half_turns, quarter, *far])
    return targets[:: 4 if INTERPRETED else 1]


@pytest.mark.parametrize("name", ["ucu", "nrpm"])
def test_where_the_reference_point_is_does_not_change_what_is_held(name: str) -> None:
    """Platforms turn about their middle on the way to a target, not about a point far away."""
    near, rng = pf.load(name), np.random.default_rng(3)
    lever = 300.0 * near.characteristic_length * np.array([0.6, 0.0, 0.8])
    far = dataclasses.replace(near, reference_point=near.reference_point + lever)
    moves = pf.pose(
        rng.normal(size=(30, 3)) * 0.3 * near.characteristic_length,
        rotation=Rotation.from_rotvec(0.1 * rng.normal(size=(30, 3))).as_matrix(),
    )
    targets = near.home_pose @ moves
    answers = pf.solve_ik(near, targets)
    others = pf.solve_ik(far, targets @ pf.pose(lever))
    np.testing.assert_array_equal(others.status, answers.status)
    np.testing.assert_array_equal(others.held, answers.held)
    held = answers.held == "orientation"
    assert held.sum() >= 2
    away = answers.position_error[held] / near.characteristic_length
    np.testing.assert_allclose(others.position_error[held] / near.characteristic_length, away, atol=1e-6)


IN_A_PLANE = {"five_bar": (0.0, 1.0, 1.0), "rrr": (1.0, 1.0, 0.0), "rpr": (1.0, 1.0, 0.0)}
"""Directions in which machines move that cannot in others."""


@pytest.mark.parametrize("count", [8 if INTERPRETED else 40, pytest.param(5000, marks=pytest.mark.campaign)])
@pytest.mark.parametrize(
    "name",
    [*IN_A_PLANE, "delta", "linear_delta", "orthoglide", "psu", "stewart", "ucu", "servo_hexapod", "hexaglide", "nrpm"],
)
def test_nothing_is_reached_that_is_nearer_than_what_is_certified(name: str, count: int) -> None:
    mechanism, rng, axes = pf.load(name), np.random.default_rng(1), IN_A_PLANE.get(name, 1.0)
    targets = np.repeat(mechanism.home_pose[None], count, axis=0)
    targets[:, :3, 3] += rng.uniform(-1.5, 1.5, (count, 3)) * axes * mechanism.characteristic_length
    targets[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.3, 0.3, (count, 1)) * (0, 0, 1)).as_matrix()
    answers = pf.solve_ik(mechanism, targets)
    certain = answers.certified & (answers.status == Status.PROJECTED)
    assert certain.sum() >= 0.4 * (answers.status == Status.PROJECTED).sum() or INTERPRETED
    away, nearer = answers.position_error[certain, None], np.repeat(answers.pose[certain][:, None], 40, axis=1)
    shifts = rng.normal(size=(*nearer.shape[:2], 3)) * axes
    sizes = away * 10.0 ** rng.uniform(-4.0, 0.3, nearer.shape[:2])
    nearer[..., :3, 3] += shifts * (sizes / np.linalg.norm(shifts, axis=2))[..., None]
    inside = np.linalg.norm(nearer[..., :3, 3] - targets[certain, None, :3, 3], axis=2) < (1.0 - SAME) * away
    assert inside.any() and not np.any(pf.solve_ik(mechanism, nearer[inside]).status == Status.REACHED)


@pytest.mark.parametrize(("name", "hold"), [("five_bar", None), ("stewart", "orientation"), ("stewart", None)])
def test_hardly_any_feasible_pose_is_nearer_to_a_special_target(name: str, hold: str | None) -> None:
    """Far away a share of the distance says little: answers are as far out as the machine goes."""
    mechanism = pf.load(name)
    length, targets = mechanism.characteristic_length, special_targets(mechanism)
    targets = targets[np.linalg.norm(targets[:, :3, 3], axis=1) < 1e9 * length]  # beyond, rounding is a share of L
    answers = pf.solve_ik(mechanism, targets, options=Options(hold=hold))
    shorter = []
    for row in np.flatnonzero(answers.status == Status.PROJECTED):
        best = nearest(Problem(mechanism, targets[row], answers[int(row)].held, answers[int(row)]), 2)
        assert best is not None
        shorter.append(best.gain <= SAME * length)
    assert np.mean(shorter) > 0.9


@pytest.mark.parametrize("name", NAMES)
def test_beside_the_border_answers_stay_at_the_border(name: str) -> None:
    """A ten-millionth of L outside it, that is how far they are; as much inside, they are reached if any can be."""
    mechanism, targets, answers = projections(name, "orientation", few(name))
    outward = (targets - answers.pose)[:, :3, 3]
    if mechanism.end_effector_is_joint:
        normal = np.array(mechanism.joint(mechanism.end_effector).axis)
        outward -= (outward @ normal)[:, None] * normal
    far = np.linalg.norm(outward, axis=1)
    rows = (far > FEASIBLE) & (answers.rotation_error <= FEASIBLE)
    step = 1e-7 * mechanism.characteristic_length
    for side in (step, -step):
        beside = targets[rows]
        beside[:, :3, 3] = answers.pose[rows, :3, 3] + side * outward[rows] / far[rows, None]
        found = pf.solve_ik(mechanism, beside)
        check_feasible(mechanism, beside, found)
        assert found.position_error.max() <= 1.01 * step
        if side > 0.0:
            np.testing.assert_allclose(found.position_error, step, rtol=0.01)
            continue
        for row in np.flatnonzero(found.status == Status.PROJECTED):
            best = nearest(Problem(mechanism, beside[row], "orientation", found[int(row)]), 1)
            assert best is not None
            assert best.gain <= 0.1 * step


def test_an_answer_at_a_singular_pose_is_the_nearest() -> None:
    """Without limits, both arms of a 5-bar stretch toward a target above it: their tip is where two circles meet."""
    mechanism = pf.load("five_bar").without_limits()
    shoulder, elbow = (np.array(mechanism.joint(joint).at) for joint in ("p1", "p2"))
    reach = np.linalg.norm(elbow - shoulder) + np.linalg.norm(mechanism.reference_point - elbow)
    height = np.sqrt(reach**2 - shoulder[1] ** 2)
    for above in (1e-3, 1.0, 1e3):
        answer = pf.solve_ik(mechanism, (0.0, 0.0, height + above * mechanism.characteristic_length))
        assert answer.status == Status.PROJECTED
        np.testing.assert_allclose(answer.position_error, above * mechanism.characteristic_length, rtol=SAME)


# --- what is held ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("hold", ["orientation", "position"])
@pytest.mark.parametrize(
    "name",
    ["stewart", pytest.param("nrpm", marks=pytest.mark.slow), pytest.param("servo_hexapod", marks=pytest.mark.slow)],
)
@pytest.mark.parametrize("count", [6, pytest.param(20, marks=pytest.mark.campaign)])
def test_what_is_held_is_given_up_only_where_no_pose_has_it(name: str, hold: str, count: int) -> None:
    mechanism = pf.load(name)
    sizes = (0.3, 0.5) if hold == "orientation" else (0.3, 0.3)
    targets = turned_targets(mechanism, count, *sizes)
    answers = pf.solve_ik(mechanism, targets, options=Options(hold=hold))
    away = np.flatnonzero(answers.status == Status.PROJECTED)
    kept = np.equal(answers.held[away], hold)
    assert 0 < kept.sum() < len(kept)
    error = (
        answers.rotation_error if hold == "orientation" else answers.position_error / mechanism.characteristic_length
    )
    assert np.array_equal(error[away] <= FEASIBLE, kept)
    for row in away[~kept].tolist():
        assert nearest(Problem(mechanism, targets[row], hold, answers[row])) is None


HOLDING = {"2-PRU/UPR": closure.pru_upr, "rotopod": closure.rotopod, "angled 3-PRR": closure.angled_prr}
"""Machines whose platforms have fewer places for what is held than they have others."""


@pytest.mark.filterwarnings("ignore:(divide by zero|invalid value):RuntimeWarning")  # dead points, where interpreted
@pytest.mark.parametrize("count", [2 if INTERPRETED else 150, pytest.param(800, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("hold", ["orientation", "position"])
@pytest.mark.parametrize("name", HOLDING)
def test_what_a_known_pose_holds_is_not_given_up_and_hardly_ever_farther(name: str, hold: str, count: int) -> None:
    """Poses that answer other targets have the part of these that is to be held, and hardly any of them is nearer."""
    mechanism, rng = HOLDING[name](), np.random.default_rng(5)
    length = mechanism.characteristic_length
    known = pf.solve_ik(mechanism, targets_about(mechanism, rng, count, 0.6, 0.7), options=Options(hold=None)).pose
    targets = known.copy()
    if hold == "orientation":
        counting = np.array(task_of(mechanism).axes)
        targets[:, :3, 3] += rng.uniform(-0.8, 0.8, (count, 3)) * counting * length
    else:
        targets[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.9, 0.9, (count, 3))).as_matrix() @ targets[:, :3, :3]
    answers = pf.solve_ik(mechanism, targets, options=Options(hold=hold))
    away = answers.status == Status.PROJECTED
    assert all(held == hold for held in np.array(answers.held)[away])
    position, rotation = task_of(mechanism).errors(known, targets)
    far = np.hypot(answers.position_error, mechanism.rotation_length * answers.rotation_error)
    farther = far > np.hypot(position, mechanism.rotation_length * rotation) + 1e-6 * length
    assert np.mean(farther) <= (0.0 if name == "2-PRU/UPR" else 0.06)


@pytest.mark.parametrize("by_legs", [True, False])
def test_without_a_start_nothing_is_given_up_for_home(by_legs: bool) -> None:
    """Upright targets at heights of poses that lean: home, upright and beside them, is nearer than what holds one."""
    mechanism, count = closure.rotopod(), 1 if INTERPRETED else 40
    leaning = targets_about(mechanism, np.random.default_rng(5), count, 0.6, 0.7)
    heights = pf.solve_ik(mechanism, leaning, options=Options(hold=None)).pose[:, 2, 3]
    targets = np.tile(mechanism.home_pose, (count, 1, 1))
    targets[:, 2, 3] = heights
    engine = engine_of(mechanism) if by_legs else ClosureEngine(model_of(mechanism))
    assert isinstance(engine, LegsEngine) == by_legs
    rows = engine.answer(targets, None, Options(hold="position"), keep_mode=False).rows
    assert (rows.status == Status.PROJECTED).all()
    assert (np.abs(rows.poses[:, 2, 3] - heights) <= FEASIBLE * mechanism.characteristic_length).all()


# --- what holds answers back -----------------------------------------------------------------------------------------

GIVEN_WAY = 1e-5
"""By how much a limit gives way in these tests [L or rad]."""
CURVATURE = 0.02
"""How far gains may be from proportional: what a limit holds changes as it gives way."""
INEXACT = 1e-3
"""What multipliers may be off by [L per L or rad]: an answer is as near as one can tell before they have settled."""


def moved(mechanism: Mechanism, name: str, bound: str, share: float) -> tuple[Mechanism, float]:
    """A machine one of whose limits is wider by `share` [L or rad], or narrower; and in its unit, by how much."""
    joint = mechanism.joint(name)
    if bound == "cone":
        return mechanism.with_limits({name: replace(joint.cone, half_angle=joint.cone.half_angle + share)}), share
    amount = share * (mechanism.characteristic_length if joint.type == "prismatic" else 1.0)
    low, high = joint.range
    return mechanism.with_limits({name: (low - amount, high) if bound == "min" else (low, high + amount)}), amount


def limits_of(mechanism: Mechanism) -> list[tuple[str, str]]:
    """Joint and bound of every limit."""
    ranged = [(joint.name, bound) for joint in mechanism.joints if joint.range is not None for bound in ("min", "max")]
    return ranged + [(joint.name, "cone") for joint in mechanism.joints if joint.cone is not None]


def distance_with(
    mechanism: Mechanism, limits: Sequence[tuple[str, str]], share: float, target: np.ndarray, answer: Solution
) -> float:
    """Distance from a target to the answer with limits moved, searched for around the answer without [length]."""
    for name, bound in limits:
        mechanism, _ = moved(mechanism, name, bound, share)
    followed = pf.track(mechanism, target[None], start=answer.q, options=Options(hold=answer.held))
    return float(distances(mechanism, followed)[0])


def unnamed(mechanism: Mechanism, answer: Solution) -> list[tuple[str, str]]:
    """Three limits that are not said to hold the answer back: those with the least room."""
    named = {(limit.joint, limit.bound) for limit in answer.active_limits}
    room = {limit: room_of(mechanism, answer, *limit) for limit in limits_of(mechanism) if limit not in named}
    return sorted(room, key=room.__getitem__)[:3]


def room_of(mechanism: Mechanism, answer: Solution, name: str, bound: str) -> float:
    """How far a coordinate is from its bound, as a share of its range; cones come last."""
    if bound == "cone":
        return 1.0
    (low, high), value = mechanism.joint(name).range, float(answer.joints[name])
    return (value - low if bound == "min" else high - value) / (high - low)


@pytest.mark.parametrize(("n", "seed"), [(1 if INTERPRETED else 2, 4), pytest.param(25, 5, marks=pytest.mark.campaign)])
@pytest.mark.parametrize(("name", "hold"), CASES)
def test_answers_come_nearer_as_their_limits_give_way(name: str, hold: str | None, n: int, seed: int) -> None:
    """Relaxing a limit gains no more than its multiplier says, tightening it costs no less; unnamed limits do nothing.

    Where the limits that are met are independent, gain and cost are the same, and so the multiplier is both. Where they
    are not, such as the cones of a parallelogram's two rods, a limit that gives way alone gains less.
    """
    mechanism, targets, answers = projections(name, hold, n, seed)
    lengths = distances(mechanism, answers)
    for target, answer, distance in zip(targets, answers, lengths, strict=True):
        for limit in answer.active_limits:
            gain, cost = (
                abs(distance - distance_with(mechanism, [(limit.joint, limit.bound)], side * GIVEN_WAY, target, answer))
                for side in (1.0, -1.0)
            )
            unit = moved(mechanism, limit.joint, limit.bound, GIVEN_WAY)[1]
            expected, inexact = limit.multiplier * unit, INEXACT * GIVEN_WAY * mechanism.characteristic_length
            assert gain <= expected * (1.0 + CURVATURE) + inexact
            assert cost >= expected * (1.0 - CURVATURE) - inexact
        closer = distance - distance_with(mechanism, unnamed(mechanism, answer), GIVEN_WAY, target, answer)
        assert closer <= INEXACT * GIVEN_WAY * mechanism.characteristic_length


def test_the_hardest_limit_is_named_first_in_any_unit() -> None:
    """A multiplier of an angle grows with the unit of length; which limit is the hardest does not."""
    mechanism, _, answers = projections("nrpm", "orientation", 3)
    for answer in answers:
        scale = [
            1.0
            if limit.bound == "cone" or mechanism.joint(limit.joint).type == "revolute"
            else mechanism.characteristic_length
            for limit in answer.active_limits
        ]
        hardness = [limit.multiplier * size for limit, size in zip(answer.active_limits, scale, strict=True)]
        assert all(ALIKE * later <= earlier for earlier, later in pairwise(hardness))


@pytest.mark.parametrize("away", [5e2, 1e4, 1e9, 1e160, 1e300])
def test_limits_that_hold_alike_are_named_as_the_description_lists_them(away: float) -> None:
    mechanism = pf.load("stewart")
    limits = pf.solve_ik(mechanism, (0, 0, away)).active_limits
    struts = [joint.name for joint in mechanism.joints if joint.actuated]
    assert [limit.joint for limit in limits] == struts
    assert all(limit.bound == "max" for limit in limits)


@pytest.mark.parametrize("name", pf.catalog())
def test_however_far_a_target_is_no_answer_is_no_number(name: str) -> None:
    mechanism = pf.load(name)
    for away in (1e155, 1e200, 1e308):
        target = mechanism.home_pose.copy()
        target[int(np.argmax(task_of(mechanism).axes)), 3] = away
        answer = pf.solve_ik(mechanism, target)
        assert np.isfinite(answer.actuators).all() and np.isfinite(answer.pose).all()
        assert answer.status is Status.PROJECTED or not any(task_of(mechanism).axes)


@pytest.mark.parametrize("away", [1e160, 1e300])
def test_however_far_a_target_is_no_square_of_it_overflows(away: float) -> None:
    answer = pf.solve_ik(closure.five_bar_with_tool(), (away, 0, 10))
    assert answer.status is pf.Status.PROJECTED
    assert answer.position_error == pytest.approx(away)


def test_a_limit_says_which_coordinate_of_a_joint_it_is() -> None:
    pivot = {"type": "universal", "connects": ("base", "table"), "at": (0, 0, 10), "axes": ((1, 0, 0), (0, 1, 0))}
    post = Joint("pivot", **pivot, range=((-0.5, 0.5), (-0.5, 0.5)))
    legs = [Leg("U-P*-S", base=[at], platform=[(at[0], at[1], 10)]) for at in ((10, 0, 0), (0, 10, 0))]
    table = Mechanism.from_legs(legs, joints=[post], end_effector="table", reference_point=(0, 0, 10), task=("tilt",))
    for coordinate, turn in enumerate([(1, 0, 0), (0, 1, 0)]):
        (limit,) = pf.solve_ik(table, pf.pose((0, 0, 10), rotvec=turn)).active_limits
        assert (limit.joint, limit.bound, limit.coordinate) == ("pivot", "max", coordinate)
        assert limit.value == pytest.approx(0.5, abs=1e-8)


@pytest.mark.parametrize("degrees", [100, 160, 179, 180])
@pytest.mark.parametrize("name", ["rps", "prs"])
def test_a_platform_that_is_told_to_hold_its_tilt_does_not_stand_on_its_head(name: str, degrees: float) -> None:
    mechanism = pf.load(name)
    turns = [pf.pose(mechanism.home_pose[:3, 3], rotvec=np.radians(degrees) * np.array(axis)) for axis in np.eye(3)[:2]]
    for hold in ("orientation", None):
        for answer in pf.solve_ik(mechanism, np.array(turns), options=Options(hold=hold)):
            assert answer.status is Status.PROJECTED
            assert answer.held is None
            assert 0.1 < answer.rotation_error < np.radians(degrees) - 0.1
            assert answer.active_limits


@pytest.mark.parametrize("name", ["stewart", "delta", "ankle_rss", "five_bar", "ucu"])
def test_what_holds_a_projection_back_is_the_same_in_the_platforms_pose_and_on_all_joints(name: str) -> None:
    machine = pf.load(name)
    engine, rng = engine_of(machine), np.random.default_rng(5)
    assert isinstance(engine, LegsEngine)
    targets = np.repeat(machine.home_pose[None], 12, axis=0)
    targets[:, :3, 3] += rng.normal(size=(12, 3)) * machine.characteristic_length
    targets[:, :3, :3] = Rotation.from_rotvec(rng.normal(size=(12, 3))).as_matrix()
    answers = pf.solve_ik(machine, targets, options=pf.Options(hold=None))
    (way,) = projection_modes(model_of(machine).closure, None, None)
    rows = np.flatnonzero(answers.status == Status.PROJECTED)
    found = answers._configurations.at(rows)
    told = engine.limit_multipliers(found, targets[rows], way)
    assert (told > 0).any(axis=1).sum() >= 4
    on_joints = ClosureEngine(model_of(machine)).limit_multipliers(found, targets[rows], way)
    np.testing.assert_allclose(told, on_joints, atol=1e-5 * on_joints.max())


@pytest.mark.parametrize("name", ["delta", "linear_delta"])
def test_the_second_forearm_of_a_parallelogram_keeps_its_own_cone(name: str) -> None:
    """Both have one line, so a cone is worth the same on either."""
    mechanism = pf.load(name)
    first, second = (mechanism.joint(joint) for joint in ("BL1", "BR1"))
    assert first.cone is not None and second.cone is not None
    narrow = [mechanism.with_limits({j.name: replace(j.cone, half_angle=0.5)}) for j in (first, second) if j.cone]
    rng, length = np.random.default_rng(0), mechanism.characteristic_length
    targets = mechanism.home_pose[:3, 3] + length * rng.uniform(-1.5, 1.5, (60, 3))
    on_first, on_second, wide = (pf.solve_ik(each, targets) for each in (*narrow, mechanism))
    assert (on_first.position_error > wide.position_error + 1e-3 * length).any()
    np.testing.assert_allclose(on_second.position_error, on_first.position_error, atol=1e-6 * length)
    assert all(margin.min() >= -1e-8 for margin in pf.margins(on_second).values())


@pytest.mark.parametrize(
    ("mechanism", "strut"),
    [(pf.load("stewart"), "BL1"), (closure.gripper_on_platform(), "P1.2")],
    ids=["in the pose", "on joint coordinates"],
)
def test_the_nearest_with_a_joint_locked_is_that_with_it_fixed(mechanism: Mechanism, strut: str) -> None:
    at, length = mechanism.joint(strut), float(mechanism.home_coordinate(strut))
    locked = mechanism.with_limits({strut: (length, length)})
    weld = Joint(strut, "fixed", at.connects, at=mechanism.reference_point)
    fixed = replace(mechanism, joints=tuple(weld if joint.name == strut else joint for joint in mechanism.joints))
    targets = drawn_targets(mechanism, np.random.default_rng(3), 2 if INTERPRETED else 12)
    answers, others = (pf.solve_ik(each, targets, options=Options(hold=None)) for each in (locked, fixed))
    assert gap_of_joints(locked, answers).max() <= FEASIBLE
    assert excess_of_joints(locked, answers).max() <= FEASIBLE
    np.testing.assert_allclose(distances(locked, answers), distances(mechanism, others), rtol=SAME)
    assert (answers.status == Status.PROJECTED).any()


@pytest.mark.parametrize("count", [4 if INTERPRETED else 60])
def test_a_tool_that_rods_keep_upright_is_never_answered_lying_down(count: int) -> None:
    """Loops of a delta with a shaft close with its platform turned over too: no answer, though the tool may yaw."""
    mechanism = closure.picker()
    shifts = np.random.default_rng(0).uniform(-1.0, 1.0, (count, 3)) * mechanism.characteristic_length
    answers = pf.solve_ik(mechanism, mechanism.reference_point + shifts)
    np.testing.assert_allclose(answers.pose[:, 2, 2], 1.0, atol=1e-9)
    assert set(answers.status.tolist()) == {Status.REACHED, Status.PROJECTED}


def test_a_working_mode_with_a_small_room_of_its_own_is_searched() -> None:
    """A delta's platform can be above its base, where nothing leads from below: a target under that room is nearest to
    it."""
    mechanism = pf.load("delta")
    targets = [[-0.07, -0.26, 0.2], [0.04, -0.27, 0.13], [0.11, 0.02, 0.13], [0.08, 0.12, 0.16], [-0.16, 0.11, 0.19]]
    answers = pf.solve_ik(mechanism, mechanism.characteristic_length * np.array(targets))
    assert (answers.status == Status.PROJECTED).all()
    assert (answers.pose[:, 2, 3] > 0.0).all()
    assert (answers.position_error < 0.35 * mechanism.characteristic_length).all()


def test_a_search_that_passes_by_the_nearest_yet_goes_on_to_one_nearer() -> None:
    """Two of a hexaglide's poses are nearest to a target among those about them, and the way to one leads by the
    other."""
    mechanism = pf.load("hexaglide")
    target = np.eye(4)
    target[:3, :3] = Rotation.from_rotvec([-0.362, -0.415, -0.202]).as_matrix()
    target[:3, 3] = [-5.8, -19.9, 231.3]
    answer = pf.solve_ik(mechanism, target, options=Options(hold=None))
    assert np.hypot(answer.position_error, mechanism.rotation_length * answer.rotation_error) < 31.92


def test_a_foot_that_is_asked_to_tilt_too_far_tilts_as_far_as_it_can() -> None:
    """An ankle's motors pass their dead points on the way: no search may be lost there. Of all tilts, every third of a
    degree, that the foot can have, none is nearer."""
    mechanism = pf.load("g1_ankle")

    def tilted(angles: np.ndarray) -> np.ndarray:
        return np.array([pf.pose(mechanism.reference_point, rpy=(roll, pitch, 0.0)) for pitch, roll in angles])

    grid = np.stack(np.meshgrid(np.linspace(-0.87, 0.5235, 240), np.linspace(-0.2617, 0.2617, 90)), axis=-1)
    every = tilted(grid.reshape(-1, 2))
    upright = every[pf.solve_ik(mechanism, every).status == Status.REACHED][:, :3, 2]
    targets = tilted(np.random.default_rng(0).uniform((-1.4, -0.6), (1.1, 0.6), (300, 2)))
    answers = pf.solve_ik(mechanism, targets)
    nearest = np.arccos(np.clip(targets[:, :3, 2] @ upright.T, -1.0, 1.0)).min(axis=1)
    assert np.count_nonzero(answers.status == Status.PROJECTED) > 200
    np.testing.assert_array_less(answers.rotation_error, nearest + 1e-9)


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
def test_a_target_that_a_search_starts_on_is_reached() -> None:
    """A 3-URU that turns about the middle of its base: all legs are at dead points there, however they stand."""
    joints = []
    for k, angle in enumerate(np.radians([0, 120, 240])):
        out, across = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        hip, knee, ankle = 120 * out, 160 * out + (0, 0, 70), 40 * out + (0, 0, 130)
        joints += [
            Joint(f"A{k}", "universal", ("base", f"u{k}"), hip, axes=(out, across)),
            Joint(f"B{k}", "revolute", (f"u{k}", f"l{k}"), knee, across, actuated=True, range=(-0.9, 0.8)),
            Joint(f"C{k}", "universal", (f"l{k}", "platform"), ankle, axes=(across, out)),
        ]
    mechanism = Mechanism("3-URU", joints, "platform", (0, 0, 130), task=("x", "y", "z"))
    turned, lowest = np.array([0.327, -0.306, -0.9, 1.508, 0.206]), [-0.03, -0.029, -0.802, 0.22, 0.03]
    count, rng = 2 if INTERPRETED else 200, np.random.default_rng(0)
    around = [*turned, *lowest, *turned[[4, 1, 2, 3, 0]] * (-1, 1, 1, 1, -1)] + 0.05 * rng.normal(size=(count, 15))
    closed = close(
        model_of(mechanism).closure, around, np.repeat(mechanism.home_pose[None], count, axis=0), limits=True
    )
    starts = pf.configuration(mechanism, closed.coordinates)
    assert (starts.status == Status.REACHED).all()
    assert (pf.solve_ik(mechanism, starts.pose, start=starts).status == Status.REACHED).all()


def test_searches_mind_where_three_hinges_point_the_platform() -> None:
    """Where two hinges of a leg cannot point the third, no search ends; and both ways to point it are searched."""
    mechanism, rng = closure.coaxial_rrr(), np.random.default_rng(2)
    targets = targets_about(mechanism, rng, 3 if INTERPRETED else 300, 0.0, 1.0)
    answers = pf.solve_ik(mechanism, targets)
    least = angles_between(answers.pose[:, None, :3, :3], targets[None, :, :3, :3]).min(axis=0)
    assert np.mean(answers.rotation_error > least + 1e-6) <= 0.01


@pytest.mark.parametrize(
    ("name", "turned"), [("delta", "yaw"), ("linear_delta", "yaw"), ("orthoglide", "tilt"), ("delta", "tilt")]
)
def test_a_platform_that_never_turns_is_not_looked_for_turned(
    name: str, turned: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It goes where it goes if it is not asked to turn; and that is told in the pose of the platform alone."""
    plain = pf.load(name)
    asked = Mechanism(plain.name, plain.joints, plain.end_effector, plain.reference_point, task=("x", "y", "z", turned))
    offsets = np.random.default_rng(0).uniform(-0.6, 0.6, (12, 3)) * plain.characteristic_length
    angles = np.linspace(0.1, 2.0, 12)
    axis = np.array([0.0, 0.0, 1.0] if turned == "yaw" else [0.8, 0.6, 0.0])
    targets = pf.pose(np.array(plain.reference_point) + offsets, rotvec=angles[:, None] * axis)
    monkeypatch.setattr(ClosureEngine, "answer", None)
    found, expected = pf.solve_ik(asked, targets), pf.solve_ik(plain, targets)
    assert {Status.REACHED, Status.PROJECTED} == set(expected.status)
    assert (found.status == Status.PROJECTED).all()
    np.testing.assert_allclose(found.rotation_error, angles, atol=1e-9)
    np.testing.assert_allclose(found.position_error, expected.position_error, atol=1e-6 * plain.characteristic_length)


# --- asked again ------------------------------------------------------------------------------------------------------
NEARER = 1e-9
"""By how much an answer that is asked again may come nearer [L]."""


def unlimited_five_bar(base: float, inner: float, outer: float) -> Mechanism:
    """A 5-bar without limits: feet at +- base / 2, links of these lengths, elbows out."""
    tip, feet, elbows = np.array([0.03 * base, 0.75 * (inner + outer)]), np.array([[-1.0, 0], [1, 0]]) * base / 2, []
    for side, foot in zip((-1.0, 1.0), feet, strict=True):
        away = np.linalg.norm(tip - foot)
        turn = np.arctan2(*(tip - foot)[::-1]) - side * np.arccos((inner**2 + away**2 - outer**2) / (2 * inner * away))
        elbows.append(foot + inner * np.array([np.cos(turn), np.sin(turn)]))
    return five_bar(feet, elbows, tip)


def nearest_of_rings(targets: np.ndarray, feet: np.ndarray, radii: tuple[float, float]) -> np.ndarray:
    """How far targets (n, 2) are from what is within both of two rings: feet on four circles, and their crossings."""
    candidates = [targets]
    for foot in feet:
        out = (targets - foot) / np.linalg.norm(targets - foot, axis=1)[:, None]
        candidates += [foot + radius * out for radius in radii]
    span = np.linalg.norm(feet[1] - feet[0])
    along = (feet[1] - feet[0]) / span
    for first in radii:
        for second in radii:
            x = (span**2 + first**2 - second**2) / (2 * span)
            if abs(x) <= first:
                for y in (1.0, -1.0):
                    corner = feet[0] + x * along + y * np.sqrt(first**2 - x**2) * np.array([-along[1], along[0]])
                    candidates.append(np.broadcast_to(corner, targets.shape))
    every = np.stack(candidates)
    from_feet = np.linalg.norm(every[:, :, None] - feet, axis=-1)
    inside = ((from_feet <= radii[1] + 1e-9) & (from_feet >= radii[0] - 1e-9)).all(axis=-1)
    return np.where(inside, np.linalg.norm(every - targets, axis=-1), np.inf).min(axis=0)


@pytest.mark.parametrize(("base", "inner", "outer"), [(0.6472, 1.14, 0.9), (0.3, 0.46, 0.46), (118.0, 90.0, 90.0)])
def test_just_outside_two_rings_answers_are_their_nearest_points(base: float, inner: float, outer: float) -> None:
    """Links stretch out at the border, where elbows tell of the tip with half their digits: no search stops there."""
    machine = unlimited_five_bar(base, inner, outer)
    feet, radii = np.array([[-base / 2, 0.0], [base / 2, 0.0]]), (abs(inner - outer), inner + outer)
    rng, length = np.random.default_rng(0), machine.characteristic_length
    n = 20 if INTERPRETED else 1500
    foot = feet[rng.integers(0, 2, n)]
    angle, radius = rng.uniform(-np.pi, np.pi, n), radii[1] + length * 10.0 ** rng.uniform(-6, -2, n)
    targets = foot + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    distances = nearest_of_rings(targets, feet, radii)
    answers = pf.solve_ik(machine, np.c_[targets, np.zeros(n)])
    assert (answers.status == Status.PROJECTED).all()
    assert np.abs(answers.position_error - distances).max() <= NEARER * length
    assert answers.certified.mean() > 0.98
