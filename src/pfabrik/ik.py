"""Inverse kinematics: from a target pose to a feasible, honest answer."""

from __future__ import annotations

import numpy as np

from .answers.answer import PoseRequest
from .answers.solution import Solution
from .answers.starts import Start, start_of
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
    found = inverse_engine_of(mechanism, options).answer(targets, begin, options, keep_mode=keeps_mode(options, begin))
    refuse_invalid(targets, shape, found.rows.status, options)
    status = found.rows.status
    is_missed = status[0] != REACHED if len(status) == 1 else (status != REACHED).any()
    if not is_missed:
        return Solution(mechanism, found, shape)
    wanted = PoseRequest(targets.copy(), options.hold, options.rotation_length)
    if begin is not None and isinstance(start, Solution) and start._request is not None:
        found = _unless_nearer(mechanism, found, wanted, begin, start._request)
    return Solution(mechanism, found, shape, wanted)


def _unless_nearer(
    mechanism: Mechanism, found: Configurations, wanted: PoseRequest, start: Configurations, before: PoseRequest
) -> Configurations:
    """What was found, with the start where that is the answer to the same target, and not farther: asked again, an
    answer stays as it is unless something nearer is found."""
    if (wanted.hold, wanted.rotation_length) != (before.hold, before.rotation_length):
        return found
    lever = wanted.rotation_length or mechanism.rotation_length
    others, rows = start.rows, found.rows
    distances, farthest = (
        np.hypot(each.measures[:, POSITION_ERROR], lever * each.measures[:, ROTATION_ERROR]) for each in (others, rows)
    )
    same = (wanted.targets == before.targets).all(axis=(1, 2)) & (others.status == PROJECTED)
    same &= rows.status != REACHED
    no_nearer = distances <= farthest + TOLERANCES.position * mechanism.characteristic_length
    stays = same & np.where(others.holds == rows.holds, no_nearer, rows.holds == HOLD_NOTHING)
    places = np.flatnonzero(stays)
    if not len(places):
        return found
    own = np.zeros(len(places), np.intp) if len(start) == 1 else places
    return found.with_rows(places, start.at(own))


def keeps_mode(options: Options, start: object) -> bool:
    """Whether answers stay in the working mode of a start, or of home where there is none."""
    return (options.working_mode or ("any" if start is None else "keep")) == "keep"
