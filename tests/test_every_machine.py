"""What answers promise, on every machine of the catalogue and of the tests."""

from __future__ import annotations

import json
import pickle
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pfabrik as pf
from checks import INTERPRETED, actuator_units, assert_feasible, assert_honest, home_values, pose_errors
from machines import EVERY, closure, machine, redescribed
from oracles import any_targets, any_values, targets_about
from pfabrik import Mechanism, Options, Status
from pfabrik.description.task import task_of
from pfabrik.engine import engine_of
from pfabrik.errors import InvalidArgument
from pfabrik.model import model_of
from pfabrik.platform.legs_engine import LegsEngine

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

FEW = ("five_bar", "stewart", "rps", "positions.mixed", "closure.upu", "closure.four_bar_driven", "closure.hinge")
"""Enough for the interpreted run."""
NAMES = tuple(FEW if INTERPRETED else EVERY)
DISCONNECTED = {
    f"closure.{name}"
    for name in ("Par4", "H4", "exechon", "wandering_upu", "3-RRRS", "pinned_delta", "delta_uu", "delta with a shaft")
}
"""Machines whose poses fall into many components: searches miss the nearest now and then."""
NEARER = 1e-9
"""By how much an answer that is asked again may come nearer [L]."""


def names(*but: str) -> list[str]:
    return [name for name in NAMES if name not in but]


@pytest.mark.parametrize("name", names())
def test_home_is_reached_with_the_coordinates_of_the_description(name: str) -> None:
    mechanism = machine(name)
    length = mechanism.characteristic_length
    for answer in (pf.solve_ik(mechanism, mechanism.home_pose), pf.solve_fk(mechanism, home_values(mechanism))):
        assert answer.status is Status.REACHED
        assert pose_errors(mechanism, answer.pose, mechanism.home_pose) <= 1e-8
        for each, value in answer.joints.items():
            np.testing.assert_allclose(value, mechanism.home_coordinate(each), rtol=0, atol=1e-8 * max(length, 1.0))
        for each, point in answer.points.items():
            np.testing.assert_allclose(point, mechanism.joint(each).at, rtol=0, atol=1e-8 * length)


@pytest.mark.parametrize("name", names("closure.delta_small_cones"))
def test_what_forward_kinematics_assembles_is_reached_and_gives_the_same_pose_again(name: str) -> None:
    mechanism, count = machine(name), 4 if INTERPRETED or name in ("closure.H4", "closure.Par4") else 12  # as slow
    there = pf.solve_fk(mechanism, any_values(mechanism, count, 0.6))
    assert_feasible(mechanism, there)
    for start in (None, there):
        answer = pf.solve_ik(mechanism, there.pose, start=start)
        assert np.all(answer.status == Status.REACHED)
        assert_honest(mechanism, there.pose, answer)
        again = pf.solve_fk(mechanism, answer.actuators, start=answer)
        assert np.all(again.status == Status.REACHED)
        assert np.max(pose_errors(mechanism, again.pose, answer.pose)) <= 1e-8


HOLDS = ["orientation", *(pytest.param(hold, marks=pytest.mark.slow) for hold in ("position", None))]


@pytest.mark.skipif(INTERPRETED, reason="many searches")
@pytest.mark.parametrize("count", [8, pytest.param(64, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("hold", HOLDS)
@pytest.mark.parametrize("name", names())
def test_any_finite_target_has_an_honest_answer(name: str, hold: str | None, count: int) -> None:
    mechanism = machine(name)
    targets = any_targets(mechanism, count)
    home = pf.solve_ik(mechanism, mechanism.home_pose)
    for start in (None, home)[: 1 if hold == "orientation" else 2]:
        assert_honest(mechanism, targets, pf.solve_ik(mechanism, targets, start=start, options=Options(hold=hold)))


@pytest.mark.parametrize("count", [2 if INTERPRETED else 8, pytest.param(200, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("name", names())
def test_any_finite_actuator_values_have_an_honest_answer(name: str, count: int) -> None:
    mechanism, rng = machine(name), np.random.default_rng(13)
    size = rng.choice([0.1, 1.0, 10.0, 1e4], (count, 1)) * actuator_units(mechanism)
    wild = home_values(mechanism) + size * rng.uniform(-1, 1, size.shape)
    asked = np.concatenate([wild, any_values(mechanism, count, share=1.5)])
    answer = pf.solve_fk(mechanism, asked)
    assert_feasible(mechanism, answer)
    off = (np.abs(answer.actuators - asked) / actuator_units(mechanism)).max(axis=1)
    np.testing.assert_allclose(answer.actuator_error, off, rtol=1e-9, atol=1e-9)
    assert np.array_equal(answer.status == Status.REACHED, off <= 1e-9)


@pytest.mark.parametrize("name", names())
def test_a_row_alone_is_answered_as_in_a_batch_and_survives_being_stored(name: str) -> None:
    mechanism = machine(name)
    rows, length = 2 if INTERPRETED else 4, mechanism.characteristic_length
    batches = {
        pf.solve_ik: any_targets(mechanism, rows, seed=2),
        pf.solve_fk: any_values(mechanism, rows, 1.2, seed=2),
    }
    for solve, asked in batches.items():
        together = solve(mechanism, asked)
        stored = pickle.loads(pickle.dumps(together))
        json.dumps(together.to_dict(), allow_nan=False)
        for row in range(rows):
            alone = solve(mechanism, asked[row])
            assert alone.status == together.status[row]
            np.testing.assert_allclose(alone.pose, together.pose[row], rtol=0, atol=1e-8 * length)
            assert [(limit.joint, limit.bound) for limit in alone.active_limits] == [
                (limit.joint, limit.bound) for limit in together[row].active_limits
            ]
            for each, value in alone.joints.items():
                np.testing.assert_allclose(value, together[row].joints[each], rtol=0, atol=1e-8 * max(length, 1.0))
                np.testing.assert_array_equal(stored[row].joints[each], together.joints[each][row])


@pytest.mark.parametrize("name", names())
def test_rows_that_are_none_are_named_or_marked_and_spoil_nothing(name: str) -> None:
    mechanism = machine(name)
    targets = np.tile(mechanism.home_pose, (5, 1, 1))
    targets[1, 0, 0], targets[3, :3, :3] = np.nan, 1e200 * np.eye(3)
    assert pf.track(mechanism, targets, options=Options(on_invalid="mark")).jumps.tolist() == 5 * [False]
    values = np.tile(home_values(mechanism), (5, 1))
    values[1, 0], values[3, -1] = np.nan, np.inf
    for solve, asked, argument in ((pf.solve_ik, targets, "target"), (pf.solve_fk, values, "actuators")):
        with pytest.raises(InvalidArgument, match=argument) as caught:
            solve(mechanism, asked)
        assert caught.value.rows == (1, 3)
        answer = solve(mechanism, asked, options=Options(on_invalid="mark"))
        assert answer.status.tolist() == [0, Status.INVALID, 0, Status.INVALID, 0] and not answer
        assert all(np.isnan(value[1]).all() and np.isfinite(value[4]).all() for value in answer.joints.values())
        assert np.isnan(answer.pose[3]).all() and answer.to_dict()["actuators"][3] == [None] * values.shape[1]
        assert np.isnan(pf.closure_residual(answer)).tolist() == [False, True, False, True, False]
        assert pose_errors(mechanism, answer.pose[[0, 2, 4]], mechanism.home_pose).max() <= 1e-7


@cache
def five_answered(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Two targets that a machine of closed loops assembles at, three anywhere, and the statuses of all."""
    mechanism = machine(f"closure.{name}")
    assembled = pf.solve_fk(mechanism, any_values(mechanism, 2, 0.4)).pose
    targets = np.concatenate([assembled, any_targets(mechanism, 3, seed=3)])
    return targets, np.asarray(pf.solve_ik(mechanism, targets).status)


@pytest.mark.skipif(INTERPRETED, reason="many searches")
@pytest.mark.parametrize("change", ["reversed and smaller", "shuffled and larger"])
@pytest.mark.parametrize("name", [each for each in closure.MACHINES if each not in ("agile_eye", "slider")])
def test_how_a_machine_is_described_does_not_change_what_it_reaches(name: str, change: str) -> None:
    mechanism, factor = machine(f"closure.{name}"), 1e-3 if "smaller" in change else 1e6
    if "reversed" in change:
        other = redescribed.reversed_joints(mechanism)
    else:
        other = redescribed.relabelled(mechanism, np.random.default_rng(0), swaps=0.0)[0]
    other = redescribed.scaled(other, factor)
    targets, statuses = five_answered(name)
    moved = targets.copy()
    moved[:, :3, 3] *= factor
    answer = pf.solve_ik(other, moved)
    assert_honest(other, moved, answer)
    assert np.array_equal(answer.status, statuses)


# --- nearest ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1 if INTERPRETED else 40, pytest.param(1500, marks=pytest.mark.campaign)])
@pytest.mark.parametrize("name", EVERY)
def test_a_pose_that_is_answered_is_reached_when_it_is_asked_for(name: str, count: int) -> None:
    """In whatever working mode it is, and at a dead point if it is at one: what was answered once is not refused.

    But now and then where redundant joints are to be searched for, which at a border have but one place.
    """
    mechanism, model = machine(name), model_of(machine(name))
    count, is_redundant = (count, len(model.legs.redundant) > 0) if model.has_legs else (1 + count // 20, False)
    targets = targets_about(mechanism, np.random.default_rng(2), count, 2.0, 1.2)
    answers = pf.solve_ik(mechanism, targets, options=Options(hold=None))
    again = pf.solve_ik(mechanism, answers.pose)
    off = again.position_error / mechanism.characteristic_length + again.rotation_error
    most = 0.15 if count > 100 else 0.2  # of few rows more by chance
    assert np.mean(off > 1e-6) <= (most if is_redundant else 0.0)
    assert (pf.solve_ik(mechanism, answers.pose, start=answers).status == Status.REACHED).all()


@pytest.mark.campaign
@pytest.mark.parametrize("name", EVERY)
def test_hardly_any_answer_to_another_target_is_nearer(name: str) -> None:
    """Every answer is a feasible pose: of 6,000 none may be nearer to a target than its own, but for a few."""
    mechanism, rng, wide = machine(name), np.random.default_rng(2), Options(hold=None)
    length, turning = mechanism.characteristic_length, mechanism.rotation_length
    turning = 0.0 if mechanism.end_effector_is_joint else turning
    many, few, most = (2000, 300, 0.01) if isinstance(engine_of(mechanism), LegsEngine) else (60, 40, 0.05)
    most = 0.1 if name in DISCONNECTED else most
    sizes = ((0.3, 0.3), (1.0, 0.8), (2.0, 1.2))
    others = np.concatenate([targets_about(mechanism, rng, many, *size) for size in sizes])
    others = pf.solve_ik(mechanism, others, options=wide).pose
    targets = targets_about(mechanism, rng, few, *sizes[-1])
    answers = pf.solve_ik(mechanism, targets, options=wide)
    far, beaten = np.hypot(answers.position_error, turning * answers.rotation_error), 0
    for target, distance in zip(targets, far, strict=True):
        position, rotation = task_of(mechanism).errors(others, np.repeat(target[None], len(others), axis=0))
        beaten += np.hypot(position, turning * rotation).min() < distance - 1e-6 * length
    assert beaten <= most * few


def targets_beside_the_border(mechanism: Mechanism, n: int, seed: int = 0) -> np.ndarray:
    """Targets (2 n, 4, 4) in and out of the workspace, and just outside: beyond answers to those far out."""
    rng, length = np.random.default_rng(seed), mechanism.characteristic_length
    far, away = np.repeat(mechanism.home_pose[None], n, axis=0), rng.normal(size=(n, 3))
    away *= rng.uniform(0.1, 2.0, (n, 1)) * length / np.linalg.norm(away, axis=1)[:, None]
    far[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, (n, 3))).as_matrix() @ far[:, :3, :3]
    far[:, :3, 3] += away
    border = pf.solve_ik(mechanism, far).pose
    outward = far[:, :3, 3] - border[:, :3, 3]
    size = np.linalg.norm(outward, axis=1)[:, None]
    step = length * 10.0 ** rng.uniform(-5, -2, (n, 1))
    border[:, :3, 3] += np.where(size > 1e-6 * length, outward / np.maximum(size, 1e-300), 0.0) * step
    return np.concatenate([far, border])


@pytest.mark.parametrize(
    ("count", "seed"), [(2 if INTERPRETED else 6, 0), pytest.param(200, 1, marks=pytest.mark.campaign)]
)
@pytest.mark.parametrize("name", EVERY)
def test_answers_asked_again_from_themselves_stay(name: str, count: int, seed: int) -> None:
    """No answer is nearer when it is asked again, none is farther, and its pose is reached from it as it is."""
    mechanism, length = machine(name), machine(name).characteristic_length
    targets = targets_beside_the_border(mechanism, count, seed)
    answers = pf.solve_ik(mechanism, targets)
    away = np.flatnonzero(answers.status == Status.PROJECTED)
    answers, targets = answers[away], targets[away]
    if not len(away):
        return
    again = pf.solve_ik(mechanism, targets, start=answers)
    assert (again.status == Status.PROJECTED).all()
    more = [own is None and other is not None for own, other in zip(answers.held, again.held, strict=True)]
    same = again.held == answers.held
    assert (same | more).all()
    here, there = (
        np.hypot(each.position_error, mechanism.rotation_length * each.rotation_error) for each in (answers, again)
    )
    assert np.abs(here - there)[same].max(initial=0.0) <= NEARER * length
    there = pf.solve_ik(mechanism, answers.pose, start=answers)
    assert (there.status == Status.REACHED).all()
    for other, rows in ((again, same), (there, np.full(len(away), True))):
        apart = np.abs(answers.pose - other.pose)[rows]
        apart[:, :3, 3] /= length
        assert apart.max(initial=0.0) <= NEARER
    closed = model_of(mechanism).closure
    turned = np.abs(there.actuators - answers.actuators) * closed.scale[closed.actuated]
    assert turned.max() <= 10.0 * NEARER  # next to dead points a pose tells of its actuators less well than of itself
