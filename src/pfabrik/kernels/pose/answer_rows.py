"""The kernel that answers rows one by one: inverse and forward kinematics of what vectorised kernels leave."""

from __future__ import annotations

from numpy import zeros

from ...common.arrays import Floats, Ints
from .._jit import opener, search
from ..legs.records import SAMPLE
from ..rows import PROJECTED, REACHED, TOO_NEAR
from .answer_row import answer_row, are_apart
from .assemble_row import assemble_row
from .nearest import NO_STARTS, PLAN
from .redundant_sets import RedundantSet, RedundantSets
from .search_records import PoseSolutions
from .tables import MACHINE, QUESTION, Question, RestingLegs, Start, Tables, new_answer_scratch


def _sample() -> Tables:
    """Tables of the array types that kernels are compiled for."""
    start, count = Start(zeros((1, 4, 4)), zeros((1, 1)), zeros((1, 1))), zeros(1, int)
    resting = RestingLegs(SAMPLE, zeros((1, 1)), zeros((1, 1)))
    sets = RedundantSets(*(RedundantSet(SAMPLE, PLAN, count),) * 6)
    return Tables(zeros(1, MACHINE), SAMPLE, SAMPLE, resting, SAMPLE, SAMPLE, PLAN, NO_STARTS, sets, start)


_TABLES = _sample()
open_tables, open_scratch = opener(_TABLES), opener(new_answer_scratch(_TABLES))
open_question = opener(Question(zeros(1, QUESTION)))
"""The arguments of `answer_rows` at the addresses of their handles."""


@search
def answer_rows(
    tables_address: int,
    scratch_address: int,
    question_address: int,
    asked: Floats,
    starts: Start,
    answers: PoseSolutions,
) -> int:
    """Answer rows one by one: targets as `answer_row` does, or actuated values as `assemble_row` does.

    Parameters
    ----------
    tables_address, scratch_address, question_address : of `Tables`, of `AnswerScratch`, and of a QUESTION.
    asked : targets (n, 4, 4) [length], or values (n, 1, n_a) [length or rad] where the question is to assemble them.
    starts : one for each row, or one for all.

    Returns
    -------
    The number of rows that are not REACHED or PROJECTED.
    """
    tables, scratch, question, n_left = (
        open_tables(tables_address),
        open_scratch(scratch_address),
        open_question(question_address).asked[0],
        0,
    )
    for row in range(asked.shape[0]):
        own, end = row if starts.poses.shape[0] > 1 else 0, row + 1
        start = Start(starts.poses[own : own + 1], starts.sides[own : own + 1], starts.actuators[own : own + 1])
        answer = PoseSolutions(
            answers.distances[row:end],
            answers.poses[row:end],
            answers.q[row:end],
            answers.sides[row:end],
            answers.counters[row:end],
            answers.actuators[row:end],
            answers.measures[row:end],
            answers.status[row:end],
        )
        if question["assembles"] == 1:
            found = assemble_row(tables, scratch, start, asked[row], question, answer)
        else:
            found = answer_row(tables, scratch, start, asked[row:end], question, answer)
        n_left += 1 if found > PROJECTED else 0
    return n_left


@search
def mark_near(tables_address: int, scratch_address: int, poses: Floats, sides: Floats, status: Ints) -> int:
    """Make rows TOO_NEAR that are REACHED with links nearer than the clearance; their number.

    Parameters
    ----------
    poses, sides, status : (n, 4, 4) [length], (n or 1, legs), (n,).
    """
    tables, scratch, n_near = open_tables(tables_address), open_scratch(scratch_address), 0
    for row in range(status.shape[0]):
        own = row if sides.shape[0] > 1 else 0
        if status[row] == REACHED and not are_apart(tables, scratch, poses[row], sides[own]):
            status[row] = TOO_NEAR
            n_near += 1
    return n_near
