"""Forward kinematics of legs in closed form."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats
from ...common.batch import take, take_each
from ...kernels.handle import Handle
from ...kernels.pose.search_records import Starts
from ...kernels.pose.tables import EXACTLY, IN_OTHER_MODES
from ...kernels.rows import Rows
from ...kernels.threads import in_blocks
from ...machine.model import Model
from ..joints.configurations import new_rows
from .single import Answers, Request, answer_phases, assembly_of, mark_near

ROWS_A_BLOCK = 1024


def forward_kinematics(request: Request, values: Floats, starts: Starts, given: tuple[Rows, Starts] | None) -> Answers:
    """Configurations within all limits at actuated values (n, n_a), by `assemble_row`; rows may be PENDING.

    Readings of more actuators than freedoms, which fit nowhere else, are looked for in every assembly mode.

    Parameters
    ----------
    starts : the start of the request, for `assemble`.
    given : a single row and its end, whose assembly from the start failed already.
    """
    rows, ends = given or _assembled(request.model, values, starts)
    answers, missed = Answers(rows, ends.q, ends.sides), np.flatnonzero(rows.status)
    if len(missed):
        answer_phases(request, values, answers, missed, IN_OTHER_MODES, EXACTLY)
    return answers


def _assembled(model: Model, values: Floats, starts: Starts) -> tuple[Rows, Starts]:
    """Rows assembled at actuated values (n, n_a) from one start each, or one for all, on all cores."""
    assembly, rows = assembly_of(model), new_rows(model, len(values))
    ends = assembly.new_ends(rows)
    rows.actuators[:] = values

    def run(block: slice) -> None:
        own = Handle(take_each(starts, block))
        assembly.prepared(own, take(rows, block), take(ends, block), assembly.scratch)()

    in_blocks(run, len(values), ROWS_A_BLOCK)
    mark_near(model, rows, ends.sides)
    return rows, ends
