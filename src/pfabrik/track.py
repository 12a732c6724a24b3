"""Tracking: a path of targets, each answered from the answer before it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any

import numpy as np

from .answers.solution import Solution, Wanted
from .answers.tracked import Track, pace_of
from .closure.solve import follow_by_closure
from .closure.stretched import Bends
from .decomposition.plan import Flat, flat_of
from .description.mechanism import Mechanism
from .errors import InvalidArgument
from .ik import checked, handle_invalid, joints_near, seeds_of, start_coordinates
from .kernels.reaching import plan as P
from .options import Options
from .poses import as_targets
from .reaching.completion import coordinates_of
from .reaching.rows import new_rows
from .reaching.solve import answer_from, draw_near, leaves_projections, settings_of
from .tolerances import TOLERANCES

_STEPS_A_REPORT = 16


def track(
    mechanism: Mechanism,
    targets: Any,
    seed: Solution | None = None,
    options: Options | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    *,
    sample_time: float | None = None,
    speed_limits: float | Mapping[str, float] | None = None,
) -> Track:
    """Follow a path: warm-started from step to step, in the working mode it starts in.

    Links that are stretched out where a target is beyond reach bend back the way they did.

    Parameters
    ----------
    targets : poses (n, 4, 4) in the base frame [length], or positions (n, 3) at home orientation.
    seed : a single answer to start from; default home.
    on_progress : called with (steps done, steps in all) every few steps.
    sample_time : from one target to the next [s].
    speed_limits : highest speeds of the actuators, by name or the same for all [length/s or rad/s]; those not named may
        be as fast as they like.

    Returns
    -------
    Track : a Solution of batch shape (n,), which also tells where answers leap, and which actuators would have to be
        too fast. Revolute actuators that may turn more than once are counted on through full turns, as far as their
        range goes.

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
    pace = pace_of(mechanism, sample_time, speed_limits)
    flat = flat_of(mechanism)
    rows, wanted = new_rows(mechanism, flat, len(poses)), Wanted(poses.copy(), options.hold, options.rotation_length)
    if flat is None:
        found = follow_by_closure(mechanism, poses, start_coordinates(mechanism, seed, ()), options, rows, on_progress)
        joints: Callable[[], Any] = partial(np.asarray, found)
    else:
        _follow(mechanism, flat, poses, seed, options, rows, on_progress)
        joints = partial(joints_near, mechanism, rows, None if seed is None else seed._rows, chained=True)
    handle_invalid(poses, shape, rows, options)
    if flat is not None:
        _count_turns(flat, rows)
    again = partial(_tracked, mechanism, options)
    return Track(mechanism, rows, joints, wanted, again, pace)


def _tracked(mechanism: Mechanism, options: Options, targets: P.Floats, seed: Solution) -> Track:
    return track(mechanism, targets, seed, options)


def _follow(
    mechanism: Mechanism,
    flat: Flat,
    poses: P.Floats,
    seed: Solution | None,
    options: Options,
    rows: P.Rows,
    on_progress: Callable[[int, int], None] | None,
) -> None:
    """Run the chained kernel in pieces: where progress is reported, and where an answer is still to be drawn near.

    After such an answer, the steps that follow it are made again from where it ends.
    """
    from .kernels.reaching.solve import solve_by_iteration

    settings = settings_of(mechanism, options, seeded=True, chained=True)
    seeds = seeds_of(mechanism, flat, seed, ())
    begin: Callable[[], P.Floats] = partial(start_coordinates, mechanism, seed, ())
    bends = Bends(mechanism, options)
    longest = _STEPS_A_REPORT if on_progress is not None else max(len(poses), 1)
    done, piece = 0, longest
    while done < len(poses):
        block = slice(done, done + piece)
        own = P.Rows._make(array[block] for array in rows)
        solve_by_iteration(flat.plan, poses[block], seeds, settings, own)
        away = _drawn_after(flat, settings, own)[:1]
        for row in away:
            before = _last_answer(own, row)
            begin = begin if before is None else cache(partial(coordinates_of, mechanism, before))
            alone = P.Rows._make(array[row : row + 1] for array in own)
            draw_near(mechanism, flat, poses[block][row : row + 1], begin, settings, options, alone)
            own = P.Rows._make(array[: row + 1] for array in own)
        if bends.before is not None:
            bends.settle(poses[block], own, answer_from(mechanism, flat, poses[block], bends.before, settings, options))
        last = _last_answer(own, len(own.status))
        if last is not None:
            seeds, after = P.Seeds(last.poses, last.nodes, last.trunks), cache(partial(coordinates_of, mechanism, last))
            if bends.before is not None or (last.status[0] == P.PROJECTED and leaves_projections(flat, settings)):
                bends.note(last.status[0], begin(), after())
            begin = after
        piece = 1 if away or bends.before is not None else min(2 * piece, longest)
        done += len(own.status)
        if on_progress is not None:
            on_progress(done, len(poses))


def _drawn_after(flat: Flat, settings: P.Settings, rows: P.Rows) -> list[int]:
    """Rows whose projections the kernels leave to be drawn near."""
    return np.flatnonzero(rows.status == P.PROJECTED).tolist() if leaves_projections(flat, settings) else []


def _last_answer(rows: P.Rows, before: int) -> P.Rows | None:
    """The last answer before a row, alone; None where there is none."""
    answered = np.flatnonzero(rows.status[:before] != P.INVALID)
    return P.Rows._make(array[answered[-1] : answered[-1] + 1] for array in rows) if len(answered) else None


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
