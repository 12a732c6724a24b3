"""Inverse kinematics: from a target pose to a feasible, honest answer."""

from __future__ import annotations

from .answers.answer import Wanted
from .answers.solution import Solution
from .answers.starts import Start, start_of
from .description.mechanism import Mechanism
from .engine import inverse_engine_of
from .errors import InvalidArgument
from .kernels.rows import REACHED
from .options import Options, checked_options
from .targets import Target, as_targets, refuse_invalid


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
    wanted = Wanted(targets.copy(), options.hold, options.rotation_length) if is_missed else None
    return Solution(mechanism, found, shape, wanted)


def keeps_mode(options: Options, start: object) -> bool:
    """Whether answers stay in the working mode of a start, or of home where there is none."""
    return (options.working_mode or ("any" if start is None else "keep")) == "keep"
