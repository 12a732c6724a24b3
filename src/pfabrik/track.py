"""Tracking: a path of targets, each answered from the answer before it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from .answers.answer_fields import PoseRequest
from .answers.pace import pace_of
from .answers.start_configuration import Start, start_of
from .answers.status import Status
from .answers.tracked import Track
from .common.arrays import Floats
from .common.batch import put
from .common.rotations import whole_turns
from .common.telling import telling
from .engines.engine import engine_of
from .engines.joints.configurations import Configurations
from .engines.joints.engine_contract import InverseEngine, OnProgress
from .engines.kept_assembly import start_or_home, up_to_dead_point
from .engines.targets import Target, as_targets, refuse_invalid
from .errors import InvalidArgument, counted
from .kernels.rows import PROJECTED, REACHED, Rows
from .machine.description.mechanism import Mechanism
from .machine.motion.singularities import are_opposite, assembly_signs
from .options import Options, checked_options
from .tolerances import TOLERANCES


def track(
    mechanism: Mechanism,
    targets: Target,
    *,
    start: Start | None = None,
    options: Options | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    sample_time: float | None = None,
    times: ArrayLike | None = None,
    speed_limits: float | Mapping[str, float] | None = None,
) -> Track:
    """Solve a path of targets, each from the answer before it, in the working mode of the start.

    Links that are stretched out at an unreachable target bend back to the side from which they came. A linkage with one
    freedom stops at dead points of its drive, and at change points.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    targets : array or RigidTransform or mapping
        Targets as in `solve_ik`, with one batch axis: poses (n, 4, 4), positions (n, 3), joint coordinates.
    start : Solution or array (nq,), optional
        A single Solution or joint vector q to start from; default home.
    options : Options, optional
        As in `solve_ik`; the working mode is always kept.
    on_progress : callable, optional
        Called with (steps done, steps in all) every few steps; default: a line on a terminal, if it takes more than two
        seconds.
    sample_time : float, optional
        Time from one target to the next [s].
    times : array (n,), optional
        In place of `sample_time`, the time of each target [s], as `read_path` returns them: never falling; equal where
        the machine waits, NaN where unknown.
    speed_limits : float or mapping of str to float, optional
        Highest speeds of the actuators, by name or one for all [length/s or rad/s]; actuators that are not named have
        no limit.

    Returns
    -------
    Track
        A Solution of batch shape (n,), with the steps at which answers jump and the actuators that would exceed their
        speed limits. Angles of revolute actuators that may turn more than once continue through full turns, as far as
        the range allows.

    Raises
    ------
    InvalidArgument
        As in `solve_ik`; also for targets that are no path, and for options that change the working mode.
    """
    options = checked_options(options)
    poses = as_path(mechanism, targets, options)
    pace = pace_of(mechanism, len(poses), sample_time, times, speed_limits)
    with telling(f"tracking {counted(len(poses), 'target')}", on_progress) as tell:
        solutions, request = follow_by(engine_of(mechanism), mechanism, poses, start, options, tell)
    return Track(mechanism, solutions, request, pace, engine_of(mechanism))


def as_path(mechanism: Mechanism, targets: Target, options: Options) -> Floats:
    """The targets of a path, (n, 4, 4); InvalidArgument for others, and for options that change the working mode."""
    poses, shape = as_targets(mechanism, targets)
    if len(shape) != 1:
        raise InvalidArgument("targets", f"batch shape {shape}", "a path: shape (n, 4, 4) or (n, 3)")
    if options.working_mode == "any":
        raise InvalidArgument("options.working_mode", "'any'", "'keep' or None: a machine cannot change it on its way")
    return poses


def follow_by(
    engine: InverseEngine,
    mechanism: Mechanism,
    poses: Floats,
    start: Start | None,
    options: Options,
    on_progress: OnProgress | None,
) -> tuple[Configurations, PoseRequest]:
    """Solve for a path (n, 4, 4) as `track` does, by an engine; and what was asked."""
    begin = start_of(mechanism, start, ())
    solutions = engine.follow(poses, begin, options, on_progress)
    solutions = _kept_assembly(mechanism, poses, begin, solutions, options)
    if begin is not None:
        _continue_turns(mechanism, solutions.rows, begin.rows.actuators[0])
    refuse_invalid(poses, poses.shape[:1], solutions.rows.status, options)
    return solutions, PoseRequest(poses.copy(), options)


def _kept_assembly(
    mechanism: Mechanism, targets: Floats, start: Configurations | None, solutions: Configurations, options: Options
) -> Configurations:
    """The solutions along targets (n, 4, 4); rows beyond a dead point of a linkage stop at it, on the start's side."""
    engine = engine_of(mechanism)
    kept = start_or_home(engine, mechanism, start)
    signs = assembly_signs(mechanism, kept.coordinates)[0]
    if not signs.any():
        return solutions
    is_beyond = are_opposite(assembly_signs(mechanism, solutions.coordinates), signs)
    crossed = np.flatnonzero(is_beyond | (solutions.rows.status == PROJECTED))
    if not len(crossed):
        return solutions
    solutions = solutions.with_rows(crossed[:0], solutions.at(crossed[:0]))
    before = np.flatnonzero(solutions.rows.status[: crossed[0]] == REACHED)[-1:]
    kept = solutions.at(before) if len(before) else kept
    for row in range(crossed[0], len(targets)):  # the others were answered from a dead point, or beyond it
        target = targets[row : row + 1]
        answer = engine.answer(target, kept, options, keep_mode=True)
        is_kept = not are_opposite(assembly_signs(mechanism, answer.coordinates), signs)[0]
        if answer.rows.status[0] == REACHED and is_kept:
            kept = answer
        elif answer.rows.status[0] <= PROJECTED and not is_kept:
            answer = up_to_dead_point(engine, mechanism, target, kept, signs, options)
        put(solutions.rows, [row], answer.rows)
        solutions.coordinates[row] = answer.coordinates[0]
    return solutions


def _continue_turns(mechanism: Mechanism, rows: Rows, start: Floats) -> None:
    """Shift angles of actuators by full turns towards their values at the start, (n_a,), if their ranges allow it."""
    valid = np.flatnonzero(rows.status != Status.INVALID)
    for column, drive in enumerate(mechanism.drives):
        low, high = drive.limits
        if drive.kind != "angle" or high - low <= 2.0 * np.pi or not len(valid):
            continue
        values = rows.actuators[valid, column]
        values += whole_turns(values[0], start[column])
        if (values >= low - TOLERANCES.limit).all() and (values <= high + TOLERANCES.limit).all():
            rows.actuators[valid, column] = values
