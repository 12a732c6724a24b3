"""The feasible poses nearest to targets, by searches from the last answer and from seeds."""

from __future__ import annotations

from typing import NamedTuple

from ...common.arrays import Floats
from .._jit import routine
from ..legs.complete_poses import is_pose
from ..pose.answer_row import answer_row
from ..pose.search_records import PoseSolutions
from ..pose.tables import AnswerScratch, Question, Start, Tables
from ..rows import PROJECTED as IS_PROJECTED
from ..rows import REACHED, UNSURE
from ..vectors import copy_row, copy_table
from .reached import BUDGET, NO_POSE, PROJECTED, Reaching, rest


class Projecting(NamedTuple):
    """A machine whose nearest feasible poses are searched for, and the memory of a call."""

    tables: Tables
    scratch: AnswerScratch
    question: Question
    start: Start
    targets: Floats  # (1, 4, 4) [length]
    answer: PoseSolutions  # one


@routine
def project_target(
    own: Projecting, reaching: Reaching, target: Floats, pose: Floats, actuators: Floats, steps: int, seeds: int
) -> int:
    """The feasible pose nearest to a target (4, 4) [length], from a pose, which it replaces; its actuators; a code.

    PROJECTED where the target is not reached; BUDGET where the steps were spent before the search ended, or no feasible
    pose was found: then nothing is written.

    Parameters
    ----------
    steps, seeds : most steps of a search, and how many seeds follow the start.
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
    status = answer_row(own.tables, own.scratch, start, own.targets, own.question.asked[0], own.answer)
    if status != REACHED and status != IS_PROJECTED and status != UNSURE:
        return BUDGET
    copy_table(own.answer.poses[0], pose)
    copy_row(own.answer.actuators[0], actuators)
    if status == REACHED:
        return 0
    return BUDGET if own.scratch.nearest.search.control[0]["steps"] >= steps else PROJECTED
