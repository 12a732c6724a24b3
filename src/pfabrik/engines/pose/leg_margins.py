"""Margins of poses from the limits of legs, by closed forms alone."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Ints
from ...kernels.threads import in_blocks
from ...machine.model import Model
from ..joints.parasitic import has_parasitic_motion
from .table import table_handle

ROWS_A_BLOCK, ROWS_A_RUN = 1024, 4096
"""Rows of one call of the kernel for single rows, and of the kernel for blocks."""

UNKNOWN = -2
"""Binding of rows that `kernels.legs.margin_blocks` leaves unsolved."""


def leg_margins(model: Model, poses: Floats, start_pose: Floats, sides: Floats) -> tuple[Floats, Ints]:
    """Margins (n,) of poses (n, 4, 4), and the indices of their limits: in blocks, then unsolved rows one by one."""
    margin, binding = np.empty(len(poses)), np.empty(len(poses), np.int64)
    table = model.legs
    legs, unsolved = table_handle(table), np.arange(len(poses))
    if table.is_for_blocks:
        from ...kernels.legs.margin_blocks import margins_in_blocks

        follows = int(table.task["unset"][0] > 0 and has_parasitic_motion(model.path_closure))

        def run(block: slice) -> int:
            return margins_in_blocks(
                legs.address, poses[block], start_pose, sides, follows, margin[block], binding[block]
            )

        if not sum(in_blocks(run, len(poses), ROWS_A_RUN)):
            return margin, binding
        unsolved = np.flatnonzero(binding == UNKNOWN)
    from ...kernels.legs.margin_rows import feasibility as measure

    unsolved_poses, margins, bindings = poses[unsolved], np.empty(len(unsolved)), np.empty(len(unsolved), np.int64)
    nothing = np.empty((0, 0))

    def run_unsolved(block: slice) -> None:
        measure(legs.address, unsolved_poses[block], start_pose, sides, margins[block], bindings[block], nothing)

    in_blocks(run_unsolved, len(unsolved), ROWS_A_BLOCK)
    margin[unsolved], binding[unsolved] = margins, bindings
    return margin, binding
