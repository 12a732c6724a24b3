"""Forward kinematics of legs in closed form."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..batch import take, take_each
from ..closure.configurations import new_rows
from ..kernels.handle import Handle
from ..kernels.platform.search_records import Starts
from ..kernels.platform.tables import EXACTLY, IN_OTHER_MODES, NEAREST, Start
from ..kernels.rows import Rows
from ..kernels.threads import in_blocks
from ..model import Model
from ..options import Options
from .rows_one_by_one import Answers, answer_places
from .single import AssemblyOutputs, scratch_of
from .table import search_table
from .tables import handle_of, question

ROWS_A_BLOCK = 256


def forward_kinematics(
    model: Model,
    values: Floats,
    start: Start,
    starts: Starts,
    tolerance: float,
    given: tuple[Rows, AssemblyOutputs] | None,
    *,
    has_start: bool,
    keep_mode: bool,
) -> Answers:
    """Configurations within all limits at actuated values (n, n_a), as of `assemble_row`; rows may be PENDING.

    Parameters
    ----------
    starts : as `start`, for `assemble`.
    keep_mode : stay in the assembly mode of the start. Readings of more actuators than freedoms, which fit nowhere
        else, are looked for everywhere.
    given : the outputs of a single row whose assembly from the start failed already.
    """
    rows, (_, q, sides) = given or _assembled(model, values, starts)
    answers, missed = Answers(rows, q, sides), np.flatnonzero(rows.status)
    if len(missed):
        from ..kernels.platform.assemble_row import assemble_rows

        tables = handle_of(model, Options(), with_seeds=not (has_start and keep_mode))
        modes = {"has_start": has_start, "keeps_mode": keep_mode, "is_nearby": False}
        asked = question(IN_OTHER_MODES, EXACTLY, tolerance, **modes)
        answer_places(assemble_rows, tables, asked, values, start, answers, missed)
    return answers


def project_values(model: Model, values: Floats, start: Start, tolerance: float, *, has_start: bool) -> Answers:
    """The feasible configurations whose actuators are nearest to values (n, n_a); the rest as `forward_kinematics`."""
    from ..kernels.platform.assemble_row import assemble_rows

    shape = len(values), len(model.legs.legs)
    answers = Answers(new_rows(model, len(values)), np.empty(shape), np.empty(shape))
    tables = handle_of(model, Options(), with_seeds=not has_start)
    asked = question(NEAREST, NEAREST, tolerance, has_start=has_start, keeps_mode=False, is_nearby=False)
    answer_places(assemble_rows, tables, asked, values, start, answers, np.arange(len(values)))
    return answers


def _assembled(model: Model, values: Floats, starts: Starts) -> tuple[Rows, AssemblyOutputs]:
    """Rows assembled at actuated values (n, n_a) from one start each, or one for all, on all cores."""
    from ..kernels.platform.forward import assemble

    rows, shape = new_rows(model, len(values)), (len(values), len(model.legs.legs))
    outputs = AssemblyOutputs(np.zeros_like(values), np.zeros(shape), np.zeros(shape))
    rows.actuators[:] = values
    legs, scratch = search_table(model.legs), scratch_of(model)

    def run(block: slice) -> None:
        own, found = Handle(take_each(starts, block)), take(rows, block)
        deviations, q, sides = take(outputs, block)
        ends = deviations, found.poses, q, sides, found.measures
        assemble(legs.address, scratch.address, found.actuators, own.address, found.status, *ends)

    in_blocks(run, len(values), ROWS_A_BLOCK)
    return rows, outputs
