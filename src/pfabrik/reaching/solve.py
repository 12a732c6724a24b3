"""The reaching engine: rows of targets answered by its kernels, and their projections drawn near."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..closure.close import closure_of, platform_poses
from ..closure.descend import within_sight
from ..closure.projection import SAME, kept, project, ways_of
from ..decomposition.plan import Flat
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.reaching import plan as P
from ..kernels.threads import run_in_blocks
from ..options import Options
from ..tolerances import TOLERANCES
from .completion import coordinates_of, positions_of
from .rows import new_rows

Floats = NDArray[np.float64]

_HOLDS = {None: P.HOLD_NOTHING, "orientation": P.HOLD_ORIENTATION, "position": P.HOLD_POSITION}


@lru_cache(maxsize=256)
def settings_of(mechanism: Mechanism, options: Options, seeded: bool, chained: bool = False) -> P.Settings:
    """Options as the kernels take them."""
    length = mechanism.characteristic_length
    mode = options.working_mode or ("keep" if seeded or chained else "any")
    return P.Settings(
        tolerance=float(options.tolerance or TOLERANCES.position * length),
        rotation_tolerance=float(options.rotation_tolerance),
        slack=0.1 * TOLERANCES.limit * length,
        max_iterations=int(options.max_iterations),
        max_rounds=int(options.max_rounds),
        exact=int(options.exact),
        any_mode=int(mode == "any"),
        hold=_HOLDS[options.hold],
        nearest=int(options.projection == "nearest" and options.exact),
        rotation_length=float(options.rotation_length or mechanism.rotation_length),
        chained=int(chained),
    )


def solve_rows(flat: Flat, targets: NDArray[np.float64], seeds: P.Seeds, settings: P.Settings, rows: P.Rows) -> None:
    """Answer independent rows: directly where closed forms reach, by iteration where not."""
    from ..kernels.reaching.solve import solve_by_iteration, solve_directly

    if len(targets) == 1:
        if solve_directly(flat.plan, targets, seeds, settings, rows):
            solve_by_iteration(flat.plan, targets, seeds, settings, rows)
        return
    if run_in_blocks(solve_directly, flat.plan, targets, seeds, settings, rows, rows_a_block=4096):
        run_in_blocks(solve_by_iteration, flat.plan, targets, seeds, settings, rows, rows_a_block=64)


def leaves_projections(flat: Flat, settings: P.Settings) -> bool:
    """Whether the kernels leave projections to be drawn near: only platforms on struts they bring there themselves."""
    return settings.nearest == 1 and flat.plan.scalars[P.ON_STRUTS] == 0.0


def draw_near(
    mechanism: Mechanism,
    flat: Flat,
    targets: Floats,
    start: Callable[[], Floats],
    settings: P.Settings,
    options: Options,
    rows: P.Rows,
) -> None:
    """Bring projected rows to the nearest feasible poses, where the kernels leave that to be done.

    The closure engine looks for them, from where the projection ended and from where it started. An answer counts if
    the reaching engine reaches it too, from where the projection ended, and so in its working mode.

    Parameters
    ----------
    start : gives the joint coordinates (n, columns) or (1, columns) that the rows started from.
    """
    away = np.flatnonzero(rows.status == P.PROJECTED)
    if not len(away):
        return
    wanted, projected = targets[away], P.Rows._make(array[away] for array in rows)
    begin = start()
    starts = [coordinates_of(mechanism, projected), begin[away] if len(begin) > 1 else begin.repeat(len(away), axis=0)]
    ways = ways_of(mechanism, options.hold, options.rotation_length)
    sought = within_sight(mechanism, wanted)
    found = project(closure_of(mechanism), sought, starts, ways, corners=settings.any_mode == 1)
    reached = P.Rows._make(array.copy() for array in projected)
    seeds = P.Seeds(projected.poses, projected.nodes, projected.trunks)
    solve_rows(flat, found.closing.poses, seeds, settings._replace(chained=0), reached)
    near = np.isfinite(found.distances) & (reached.status == P.REACHED)
    for way in ways:  # what fell back to a way tried later is farther, however near
        ours, theirs = projected.counters[:, 2] == way.hold, found.holds == way.hold
        distances = way.distances(closure_of(mechanism), projected.poses, sought)
        near &= ~(ours & theirs & (found.distances > (1.0 - SAME) * distances))
        near &= ~(ours & ~theirs & (way is ways[0]))
    task = task_of(mechanism)
    reached.status[:] = P.PROJECTED
    reached.counters[:] = projected.counters
    reached.counters[:, 0] += found.closing.iterations
    reached.counters[:, 2] = kept(mechanism, found.holds, reached.poses, wanted)
    reached.measures[:, 0], reached.measures[:, 1] = task.errors(reached.poses, wanted)
    for array, own in zip(rows, reached, strict=True):
        array[away[near]] = own[near]


def answer_from(
    mechanism: Mechanism, flat: Flat, target: Floats, start: Floats, settings: P.Settings, options: Options
) -> P.Rows:
    """One target (1, 4, 4) answered from joint coordinates (1, columns)."""
    from ..kernels.reaching.solve import solve_by_iteration

    begin, found = new_rows(mechanism, flat, 1), new_rows(mechanism, flat, 1)
    begin.poses[:] = platform_poses(mechanism, start)
    positions_of(mechanism, flat, start, begin)
    solve_by_iteration(flat.plan, target, P.Seeds(begin.poses, begin.nodes, begin.trunks), settings, found)
    if leaves_projections(flat, settings):
        draw_near(mechanism, flat, target, lambda: start, settings, options, found)
    return found
