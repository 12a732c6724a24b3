"""The feasible poses nearest to targets, by searches from the last answer and from seeds."""

from __future__ import annotations

from typing import NamedTuple

from ...common.arrays import Floats, Ints, Records
from .._jit import routine
from ..legs.complete_poses import is_pose
from ..pose.answer_row import answer_row, errors
from ..pose.search_records import PoseSolutions
from ..pose.tables import AnswerScratch, Question, Start, Tables
from ..projecting import PRICED, weighted_distance
from ..rows import CERTAIN, HOLD, REACHED, UNSURE
from ..rows import PROJECTED as IS_PROJECTED
from ..search_constants import MOVED, SUSPICIOUS, UNDONE
from ..vectors import copy_row, copy_table
from .reached import BUDGET, JUMPED, NO_POSE, PROJECTED, Reaching, rest

WHOLE, NOT_FOUND = -1, -2
"""All of a target is reached; no feasible pose was found."""


class Projecting(NamedTuple):
    """A machine whose nearest feasible poses are searched for, and the memory of a call."""

    tables: Tables
    scratch: AnswerScratch
    question: Question
    start: Start
    targets: Floats  # (1, 4, 4) [length]
    answer: PoseSolutions  # one
    back: PoseSolutions  # one: where the way back to the target before leads
    last: Start  # the last answer
    last_targets: Floats  # (1, 4, 4) [length]: that it answers
    notes: Ints  # (2,): what of the target is held (HOLD_...), WHOLE, or NOT_FOUND; the steps of all searches


@routine
def project_target(
    own: Projecting,
    reaching: Reaching,
    target: Floats,
    pose: Floats,
    actuators: Floats,
    steps: int,
    seeds: int,
    most: int,
) -> int:
    """The feasible pose nearest to a target (4, 4) [length], from a pose, which it replaces; its actuators; a code.

    PROJECTED where the target is not reached, JUMPED if drives jump there from the last answer; BUDGET where the steps
    were spent before the search ended, or no feasible pose was found: then nothing is written.

    Parameters
    ----------
    steps, seeds : most steps of a search, and how many seeds follow the start.
    most : most steps of all searches together; 0 if there is no bound.
    """
    asked, start = own.question.asked[0], own.start
    if not is_pose(target) or not is_pose(pose):
        return NO_POSE
    copy_row(reaching.home.sides[0], start.sides[0])
    if reaching.near.task[0]["implicit"] == 1:
        rest(reaching, pose)
        copy_row(reaching.scratch.sides, start.sides[0])
    copy_table(pose, start.poses[0])
    copy_table(target, own.targets[0])
    copy_row(actuators, start.actuators[0])
    asked["seeds"], asked["steps"], asked["effort"] = seeds, steps, steps * (seeds + 1)
    remembers = is_last(own)
    asked["has_start"], asked["most_steps"] = 1 if remembers or seeds == 0 else 0, most
    own.notes[0], effort = NOT_FOUND, own.scratch.nearest.search.effort[0]
    status = answer_row(own.tables, own.scratch, start, own.targets, own.question.asked[0], own.answer)
    own.notes[1] = effort["linearised"]
    if status != REACHED and status != IS_PROJECTED and status != UNSURE:
        return BUDGET
    is_cut = own.scratch.nearest.search.control[0]["steps"] >= steps or effort["is_cut"] == 1
    code = BUDGET if is_cut else PROJECTED
    code = 0 if status == REACHED else code
    own.notes[0] = own.answer.counters[0, HOLD] % CERTAIN if code != 0 else WHOLE
    if code == PROJECTED and remembers and jumps(own):
        code = JUMPED
    copy_table(own.answer.poses[0], pose)
    copy_row(own.answer.actuators[0], actuators)
    copy_table(own.answer.poses[0], own.last.poses[0])
    copy_row(own.answer.actuators[0], own.last.actuators[0])
    copy_table(target, own.last_targets[0])
    return code


@routine
def is_last(own: Projecting) -> bool:
    """True if the start is the last answer: it is then followed from there, else searched for from seeds too."""
    start, last = own.start, own.last
    for i in range(3):
        for j in range(4):
            if start.poses[0, i, j] != last.poses[0, i, j]:
                return False
    return True


@routine
def jumps(own: Projecting) -> bool:
    """True if no motion leads from the last answer: the way back to the target before does not undo the step.

    True too if no steps are left to find out.
    """
    last, answer, driven = own.last, own.answer, own.tables.legs.driven
    before, moved = own.last_targets, largest_step(driven, last.actuators, answer.actuators)
    turn = own.scratch.nearest.search.gradient.turn
    position, rotation = errors(own.tables.legs.task[0], own.targets[0], before[0], turn)
    aim = PRICED if own.tables.machine[0]["projections"] > 1 else 0
    if moved <= max(SUSPICIOUS * weighted_distance(own.tables.plan.weights[aim], position, rotation), MOVED):
        return False
    asked = own.question.asked[0]
    if asked["most_steps"] > 0:
        if own.notes[1] >= asked["most_steps"]:
            return True
        asked["most_steps"] -= own.notes[1]
    begin = Start(answer.poses, answer.sides, answer.actuators)
    answer_row(own.tables, own.scratch, begin, before, own.question.asked[0], own.back)
    own.notes[1] += own.scratch.nearest.search.effort[0]["linearised"]
    return largest_step(driven, last.actuators, own.back.actuators) > UNDONE * moved


@routine
def largest_step(driven: Records, before: Floats, after: Floats) -> float:
    """The largest difference of actuators (1, n_a) [L or rad]."""
    largest = 0.0
    for i in range(driven.shape[0]):
        column = driven[i]["column"]
        largest = max(largest, abs(after[0, column] - before[0, column]) / driven[i]["unit"])
    return largest
