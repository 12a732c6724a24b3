"""Tracking: a path of targets, each answered from the answer before it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from .closure_ik import follow_by_closure
from .errors import InvalidArgument
from .flatten import Flat, flat_of
from .ik import checked, handle_invalid, joints_near, seeds_of, settings_of, start_coordinates
from .kernels import plan as P
from .mechanism import Mechanism
from .options import Options
from .poses import as_targets
from .rows import new_rows
from .solution import Solution
from .tolerances import TOLERANCES

_STEPS_A_REPORT = 16


def track(
    mechanism: Mechanism,
    targets: Any,
    seed: Solution | None = None,
    options: Options | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> Solution:
    """Follow a path: warm-started from step to step, in the working mode it starts in.

    Parameters
    ----------
    targets : poses (n, 4, 4) in the base frame [length], or positions (n, 3) at home orientation.
    seed : a single answer to start from; default home.
    on_progress : called with (steps done, steps in all) every few steps.

    Returns
    -------
    Solution : batch shape (n,). Revolute actuators that may turn more than once are counted on through
        full turns, as far as their range goes.

    Raises
    ------
    As `solve_ik`; also InvalidArgument for targets that are no path, and for options that change the working mode.
    """
    poses, shape = as_targets(targets)
    options = checked(mechanism, options)
    if len(shape) != 1:
        raise InvalidArgument("targets", f"batch shape {shape}", "a path: shape (n, 4, 4) or (n, 3)")
    if options.working_mode == "any":
        raise InvalidArgument("options.working_mode", "'any'", "'keep' or None: a machine cannot change it on its way")
    flat = flat_of(mechanism)
    rows = new_rows(mechanism, flat, len(poses))
    if flat is None:
        found = follow_by_closure(mechanism, poses, start_coordinates(mechanism, seed, ()), options, rows, on_progress)
        handle_invalid(poses, rows, options)
        return Solution(mechanism, rows, shape, partial(np.asarray, found))
    seeds = seeds_of(mechanism, flat, seed, ())
    settings = settings_of(mechanism, options, seeded=True, chained=True)
    _follow(flat, poses, seeds, settings, rows, on_progress)
    handle_invalid(poses, rows, options)
    _count_turns(flat, rows)
    begin = None if seed is None else seed._rows
    return Solution(mechanism, rows, shape, partial(joints_near, mechanism, rows, begin, chained=True))


def _follow(
    flat: Flat,
    poses: P.Floats,
    seeds: P.Seeds,
    settings: P.Settings,
    rows: P.Rows,
    on_progress: Callable[[int, int], None] | None,
) -> None:
    """Run the chained kernel, in pieces where progress is reported."""
    from .kernels.solve import solve_by_iteration

    piece = _STEPS_A_REPORT if on_progress is not None else max(len(poses), 1)
    for start in range(0, len(poses), piece):
        block = slice(start, start + piece)
        own = P.Rows._make(array[block] for array in rows)
        solve_by_iteration(flat.plan, poses[block], seeds, settings, own)
        answered = np.flatnonzero(own.status != P.INVALID)
        if len(answered):
            last = slice(answered[-1], answered[-1] + 1)
            seeds = P.Seeds(own.poses[last], own.nodes[last], own.trunks[last])
        if on_progress is not None:
            on_progress(min(start + piece, len(poses)), len(poses))


def _count_turns(flat: Flat, rows: P.Rows) -> None:
    """Make the angles of revolute actuators that may turn more than once continuous along the path."""
    known = rows.status != P.INVALID
    for j in range(flat.n_actuators):
        coordinate = flat.plan.coordinates[j]
        lo, hi = coordinate["lo"], coordinate["hi"]
        if coordinate["kind"] in (P.HINGE, P.END_HINGE) and hi - lo > 2 * np.pi:
            counted = np.unwrap(rows.actuators[known, j])
            if (counted >= lo - TOLERANCES.limit).all() and (counted <= hi + TOLERANCES.limit).all():
                rows.actuators[known, j] = counted
