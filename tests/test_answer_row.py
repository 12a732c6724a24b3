"""Answers of single rows by tables alone, as controllers and pages ask for them: bounded effort, limits by number."""

from __future__ import annotations

import numpy as np
import pytest

import pfabrik as pf
from oracles import targets_about
from pfabrik import Options
from pfabrik.engines.pose.tables import limit_names, tables_of
from pfabrik.kernels.handle import Handle
from pfabrik.kernels.pose import tables as T
from pfabrik.kernels.pose.answer_row import weigh_limits
from pfabrik.kernels.pose.answer_rows import answer_rows
from pfabrik.kernels.pose.search_records import PoseSolutions, new_solutions
from pfabrik.kernels.projecting import UNBOUNDED
from pfabrik.kernels.rows import PENDING, PROJECTED, REACHED, UNSURE
from pfabrik.kernels.search_constants import MOST_STEPS
from pfabrik.machine.model import model_of
from pfabrik.tolerances import TOLERANCES

MACHINES = ("stewart", "delta", "servo_hexapod", "orthoglide", "agile_eye")


def answered(
    name: str, targets: np.ndarray, effort: int, most_steps: int = 0, counted: str = "steps"
) -> tuple[T.Tables, T.AnswerScratch, PoseSolutions, list[int]]:
    """Answers from home to targets one by one, and the steps that each took."""
    tables = tables_of(model_of(pf.load(name)), Options())
    scratch, question = T.new_answer_scratch(tables), T.Question(np.zeros(1, T.QUESTION))
    question.asked[0] = 0, T.BY_LEGS, T.EXACTLY, 0, 0, 0, UNBOUNDED, UNBOUNDED, effort, most_steps, 0.0
    handles = [Handle(each) for each in (tables, scratch, question)]
    answers, steps = new_solutions(len(targets), len(tables.legs.legs), len(tables.legs.driven)), []
    for row in range(len(targets)):
        own = PoseSolutions(*(array[row : row + 1] for array in answers))
        answer_rows(*(each.address for each in handles), targets[row : row + 1], tables.home, own)
        steps.append(int(scratch.nearest.search.effort[counted][0]))
    return tables, scratch, answers, steps


def far(name: str, n: int) -> np.ndarray:
    return targets_about(pf.load(name), np.random.default_rng(2), n, 1.5, 0.8)


@pytest.mark.parametrize("name", MACHINES)
def test_no_search_begins_once_the_effort_is_spent(name: str) -> None:
    """What is found until then is feasible, and no nearer than what all searches find."""
    targets, solution = far(name, 6), pf.solve_ik(pf.load(name), far(name, 6))
    *_, whole, steps = answered(name, targets, UNBOUNDED)
    told = np.isin(whole.status, (REACHED, PROJECTED))
    np.testing.assert_array_equal(whole.poses[told], solution.pose[told])
    for effort in (1, max(steps) // 2 + 1):
        *_, cut, spent = answered(name, targets, effort)
        assert max(spent) < effort + MOST_STEPS
        assert np.isin(cut.status, (REACHED, PROJECTED, PENDING, UNSURE)).all()
        found = cut.distances < np.inf
        assert (cut.measures[found, 3] <= TOLERANCES.limit).all()
        assert (cut.distances >= whole.distances - 1e-9).all()
    assert np.array_equal(answered(name, targets, max(steps) + 1)[2].poses, whole.poses)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("most", [1, 7, 64])
def test_no_more_configurations_are_linearised_than_given(name: str, most: int) -> None:
    *_, answers, linearised = answered(name, far(name, 6), UNBOUNDED, most, "linearised")
    assert 0 < max(linearised) <= most
    assert np.isin(answers.status, (REACHED, PROJECTED)).all()


@pytest.mark.parametrize("name", MACHINES)
def test_limits_that_hold_a_projection_are_named_by_their_numbers(name: str) -> None:
    targets, solution = far(name, 3), pf.solve_ik(pf.load(name), far(name, 3))
    tables, scratch, answers, _ = answered(name, targets, UNBOUNDED)
    names, weighing = limit_names(model_of(pf.load(name))), T.new_weighing_scratch(tables)
    for row in np.flatnonzero(answers.status == PROJECTED):
        weights = np.zeros(len(weighing.search.first.linear.h))
        own = PoseSolutions(*(array[row : row + 1] for array in answers))
        weigh_limits(tables, scratch, weighing, targets[row : row + 1], own, weights)
        named = {names[k] for k in np.flatnonzero(weights[: len(names)] > TOLERANCES.holding)}
        assert named == {(limit.joint, limit.bound) for limit in solution.active_limits[row] if limit.multiplier}
