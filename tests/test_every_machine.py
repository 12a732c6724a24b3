"""How calls answer, on every machine of the catalogue and of the tests: rows alone and in batches, stored, invalid."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

import pfabrik as pf
from checks import INTERPRETED, home_values, pose_errors
from machines import EVERY, machine
from oracles import any_targets, any_values, targets_about
from pfabrik import Options, Status
from pfabrik.engines.engine import engine_of
from pfabrik.engines.pose.legs_engine import LegsEngine
from pfabrik.errors import InvalidArgument
from pfabrik.machine.description.task import task_of

pytestmark = pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")

FEW = ("five_bar", "stewart", "rps", "positions.mixed", "closure.upu", "closure.four_bar_driven", "closure.hinge")
"""Enough for the interpreted run."""
NAMES = FEW if INTERPRETED else tuple(EVERY)
DISCONNECTED = {
    f"closure.{name}"
    for name in ("Par4", "H4", "exechon", "wandering_upu", "3-RRRS", "pinned_delta", "delta_uu", "delta with a shaft")
}
"""Machines whose poses fall into many components: searches miss the nearest now and then."""


@pytest.mark.parametrize("name", NAMES)
def test_a_row_alone_is_answered_as_in_a_batch_and_survives_being_stored(name: str) -> None:
    mechanism, rows = machine(name), 2
    length = mechanism.characteristic_length
    batches = {
        pf.solve_ik: any_targets(mechanism, rows, seed=2),
        pf.solve_fk: any_values(mechanism, rows, 1.2, seed=2),
    }
    for solve, asked in batches.items():
        together = solve(mechanism, asked)
        stored, joints = pickle.loads(pickle.dumps(together)), together.joints
        json.dumps(together.to_dict(), allow_nan=False)
        for row in range(rows):
            alone = solve(mechanism, asked[row])
            assert alone.status == together.status[row]
            np.testing.assert_allclose(alone.pose, together.pose[row], rtol=0, atol=1e-8 * length)
            one, again = together[row], stored[row].joints
            ours, theirs = ([(limit.joint, limit.bound) for limit in each.active_limits] for each in (alone, one))
            assert ours == theirs
            for each, value in alone.joints.items():
                np.testing.assert_allclose(value, one.joints[each], rtol=0, atol=1e-8 * max(length, 1.0))
                np.testing.assert_array_equal(again[each], joints[each][row])


@pytest.mark.parametrize("name", NAMES)
def test_rows_that_are_none_are_named_or_marked_and_spoil_nothing(name: str) -> None:
    mechanism = machine(name)
    targets = np.tile(mechanism.home_pose, (5, 1, 1))
    targets[1, 0, 0], targets[3, :3, :3] = np.nan, 1e200 * np.eye(3)
    assert pf.track(mechanism, targets, options=Options(on_invalid="mark")).jumps.tolist() == 5 * [False]
    values = np.tile(home_values(mechanism), (5, 1))
    values[1, 0], values[3, -1] = np.nan, np.inf
    bounded = Options(most_steps=16)
    questions = ((pf.solve_ik, targets, Options()), (pf.solve_ik, targets, bounded), (pf.solve_fk, values, Options()))
    for solve, asked, options in questions:
        with pytest.raises(InvalidArgument, match="target" if asked is targets else "actuators") as caught:
            solve(mechanism, asked, options=options)
        assert caught.value.rows == (1, 3)
        answer = solve(mechanism, asked, options=replace(options, on_invalid="mark"))
        assert answer.status.tolist() == [0, Status.INVALID, 0, Status.INVALID, 0] and not answer
        assert all(np.isnan(value[1]).all() and np.isfinite(value[4]).all() for value in answer.joints.values())
        assert np.isnan(answer.pose[3]).all() and answer.to_dict()["actuators"][3] == [None] * values.shape[1]
        assert np.isnan(pf.closure_residual(answer)).tolist() == [False, True, False, True, False]
        assert pose_errors(mechanism, answer.pose[[0, 2, 4]], mechanism.home_pose).max() <= 1e-7


@pytest.mark.campaign
@pytest.mark.parametrize("name", EVERY)
def test_hardly_any_answer_to_another_target_is_nearer_and_none_comes_nearer_asked_again(name: str) -> None:
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
    again = pf.solve_ik(mechanism, targets, start=answers, options=wide)
    far, as_far = (np.hypot(each.position_error, turning * each.rotation_error) for each in (answers, again))
    assert np.abs(far - as_far).max() <= 1e-9 * length
    assert (pf.solve_ik(mechanism, answers.pose, start=answers).status == Status.REACHED).all()
    beaten = 0
    for target, distance in zip(targets, far, strict=True):
        position, rotation = task_of(mechanism).errors(others, np.repeat(target[None], len(others), axis=0))
        beaten += np.hypot(position, turning * rotation).min() < distance - 1e-6 * length
    assert beaten <= most * few
