"""Inverse kinematics: from a target pose to a feasible configuration."""

from __future__ import annotations

import numpy as np

from .answers.answer_fields import PoseRequest
from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .arrays import Floats
from .closure.closure_engine import close_on_targets, to_answers
from .closure.configurations import Configurations
from .closure.parasitic import has_parasitic_motion
from .description.mechanism import Mechanism
from .engine import engine_of, inverse_engine_of, knows_all_modes
from .errors import InvalidArgument
from .kernels.rows import HOLD_NOTHING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
from .model import model_of
from .options import Options, checked_options
from .targets import Target, as_targets, refuse_invalid
from .tolerances import TOLERANCES


def solve_ik(
    mechanism: Mechanism,
    target: Target,
    *misplaced: object,
    start: Start | None = None,
    options: Options | None = None,
) -> Solution:
    """Actuator values that put the end effector on a target, or as near as possible, with every limit kept.

    Parameters
    ----------
    target : pose (..., 4, 4) of the end effector in the base frame [length], position (..., 3) at home orientation, a
        SciPy RigidTransform, or the coordinates of the joint that carries the end effector on the base,
        ``{"pivot": [0.1, 0.05]}``; leading axes are a batch, whose rows are answered independently, on all cores.
    start : a Solution or joint vector q to start from, single or one for each target; its working mode is kept.
        Default: home, and any working mode.

    Returns
    -------
    Solution : REACHED, or PROJECTED to the nearest feasible pose found; see `Solution`.

    Raises
    ------
    InvalidArgument : a target or start of the wrong shape, or (unless marked) rows that are no poses.
    """
    if misplaced:
        expected = "one target, such as [x, y, z], and the rest by name: solve_ik(m, target, start=..., options=...)"
        raise InvalidArgument("target", f"{1 + len(misplaced)} arguments", expected)
    options = checked_options(options)
    targets, shape = as_targets(mechanism, target)
    begin = start_of(mechanism, start, shape)
    keep_mode = keeps_mode(options, begin)
    solutions = inverse_engine_of(mechanism, options).answer(targets, begin, options, keep_mode=keep_mode)
    status = solutions.rows.status
    refuse_invalid(targets, shape, status, options)
    is_missed = status[0] != REACHED if len(status) == 1 else (status != REACHED).any()
    if not is_missed:
        return Solution(mechanism, solutions, shape)
    if not keep_mode and not knows_all_modes(mechanism):
        solutions = _reach_missed(mechanism, solutions, targets, begin, options)
        if (solutions.rows.status == REACHED).all():
            return Solution(mechanism, solutions, shape)
    request = PoseRequest(targets.copy(), options.hold, options.rotation_length)
    if begin is not None and isinstance(start, Solution) and start._request is not None:
        solutions = _prefer_start(mechanism, solutions, request, begin, start._request)
    return Solution(mechanism, solutions, shape, request)


def _reach_missed(
    mechanism: Mechanism, solutions: Configurations, targets: Floats, start: Configurations | None, options: Options
) -> Configurations:
    """The solutions, with the targets reached that closing the loops in joint coordinates reaches.

    From the start, then from the answers, these leg by leg. For machines with modes that no engine enumerates.
    """
    model, engine = model_of(mechanism), engine_of(mechanism)
    for from_answers in (False, True):
        rows = np.flatnonzero((solutions.rows.status == PROJECTED) & ~solutions.rows.certain)
        if not len(rows):
            break
        begin = solutions.at(rows) if from_answers else start if start is None or len(start) == 1 else start.at(rows)
        leg_by_leg = from_answers and not model.has_legs and has_parasitic_motion(model.path_closure)
        closing = close_on_targets(model, targets[rows], begin, leg_by_leg=leg_by_leg)
        found = to_answers(model, closing, targets[rows], np.full(len(rows), HOLD_NOTHING), options)
        reached = np.flatnonzero((found.rows.status == REACHED) & engine.as_configurations(closing).is_within_limits)
        if len(reached):
            solutions = solutions.with_rows(rows[reached], found.at(reached))
    return solutions


def _prefer_start(
    mechanism: Mechanism,
    solutions: Configurations,
    request: PoseRequest,
    start: Configurations,
    start_request: PoseRequest,
) -> Configurations:
    """The solutions, with rows of the start in place of those that are no nearer to the same target.

    A target that is asked for again, from its own answer, keeps this answer unless a nearer one is found.
    """
    if (request.hold, request.rotation_length) != (start_request.hold, start_request.rotation_length):
        return solutions
    lever = request.rotation_length or mechanism.rotation_length
    start_distances, distances = (
        np.hypot(rows.measures[:, POSITION_ERROR], lever * rows.measures[:, ROTATION_ERROR])
        for rows in (start.rows, solutions.rows)
    )
    is_same = (request.targets == start_request.targets).all(axis=(1, 2)) & (start.rows.status == PROJECTED)
    is_same &= solutions.rows.status != REACHED
    is_no_farther = start_distances <= distances + TOLERANCES.position * mechanism.characteristic_length
    has_same_hold = start.rows.holds == solutions.rows.holds
    rows = np.flatnonzero(is_same & np.where(has_same_hold, is_no_farther, solutions.rows.holds == HOLD_NOTHING))
    if not len(rows):
        return solutions
    start_rows = np.zeros(len(rows), np.intp) if len(start) == 1 else rows
    return solutions.with_rows(rows, start.at(start_rows))


def keeps_mode(options: Options, start: object) -> bool:
    """True if answers stay in the working mode of the start, or of home without a start."""
    return (options.working_mode or ("any" if start is None else "keep")) == "keep"
