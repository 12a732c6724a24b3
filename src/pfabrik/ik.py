"""Inverse kinematics: from a target pose to a feasible configuration."""

from __future__ import annotations

import numpy as np

from .answers.answer_fields import PoseRequest
from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .closure.configurations import Configurations
from .description.mechanism import Mechanism
from .engine import inverse_engine_of
from .errors import InvalidArgument
from .kernels.rows import HOLD_NOTHING, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
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
    solutions = inverse_engine_of(mechanism, options).answer(
        targets, begin, options, keep_mode=keeps_mode(options, begin)
    )
    status = solutions.rows.status
    refuse_invalid(targets, shape, status, options)
    is_missed = status[0] != REACHED if len(status) == 1 else (status != REACHED).any()
    if not is_missed:
        return Solution(mechanism, solutions, shape)
    request = PoseRequest(targets.copy(), options.hold, options.rotation_length)
    if begin is not None and isinstance(start, Solution) and start._request is not None:
        solutions = _prefer_start(mechanism, solutions, request, begin, start._request)
    return Solution(mechanism, solutions, shape, request)


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
