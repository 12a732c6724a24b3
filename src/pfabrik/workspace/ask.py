"""The question how big a workspace is."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, Literal

import numpy as np

from ..answers.solution import Solution
from ..answers.starts import Start, start_of
from ..arrays import Floats
from ..configuration import configuration
from ..description.mechanism import Mechanism, checked_mechanism
from ..description.task import task_of
from ..errors import InvalidArgument, UnknownName
from ..poses import SupportsMatrix
from ..telling import OnProgress, telling
from .blocks import Measure
from .lattice import Lattice
from .orientations import tilts_up_to
from .parts import Parts
from .refining import refined
from .result import Workspace
from .space import Space, space_of
from .surface import mesh_of
from .verdicts import Question

FINENESS, FINENESS_OF_SETS, FINENESS_ONE_BY_ONE = 1 / 100, 1 / 50, 1 / 25
"""Resolutions [L or rad]: where closed forms tell margins; where they do for each of many tilts; elsewhere."""

FIRST_CELLS = {(2, True): 1 / 48, (3, True): 1 / 12, (2, False): 1 / 12, (3, False): 1 / 5}
"""How wide the first cells are [L or rad], by coordinates, and whether closed forms tell margins."""

FIRST_REACH = {True: 2.5, False: 1.5}
"""How far the first look goes to each side [L or rad], likewise."""

FEWEST_CELLS = 24
"""Cells across the shortest side of a workspace; where the default resolution gives fewer, it is halved."""

MOST_HALVINGS = 6


def workspace(
    mechanism: Mechanism,
    *,
    over: Sequence[str] | None = None,
    fixed: Mapping[str, float] | None = None,
    orientation: Floats | SupportsMatrix | Literal["any"] | None = None,
    tilt: float | None = None,
    within: Mapping[str, tuple[float, float]] | None = None,
    resolution: float | None = None,
    start: Start | None = None,
    executor: Executor | None = None,
    on_progress: OnProgress | None = None,
) -> Workspace:
    """Where the end effector can go, in one working mode: how far, how much, and what stops it.

    By default over the positions at home's orientation. What `fixed` holds is taken out: with "z" it is a slice, with
    "x", "y" and "z" the orientations at that position. A machine that has one position or none is looked at over its
    rotations too; one that a universal joint carries, over the two angles of this joint.

    Parameters
    ----------
    over : two or three coordinates to look over, of "x", "y", "z" (of the reference point, in the base frame) and
        "tilt_x", "tilt_y", "yaw": R = from_rotvec([tilt_x, tilt_y, 0]) Rz(yaw) R_0, with R_0 the orientation held.
    fixed : values of other coordinates [length or rad]; what is neither is as at the start.
    orientation : R_0, a matrix (3, 3) or a SciPy Rotation, by default the start's; or "any": positions that are reached
        with some orientation or other (the reachable workspace), without a start in any working mode.
    tilt : the largest angle by which the platform must be able to lean to every side [rad]: only positions count where
        it can ("total" workspace up to a tilt).
    within : coordinate -> (least, greatest), where to look; default: as far as anything is within reach.
    resolution : size of the smallest cells, at the border [length; rad where all coordinates are angles]; angles beside
        lengths: that divided by L. Default: L/100 or 0.01 rad, L/50 with a tilt, L/25 where no closed
        forms answer; halved where a workspace would be smaller than 24 cells.
    start : a single Solution or joint vector q: whose working mode is meant, and what hangs together with it is
        `at_start`; default home.
    executor : of `concurrent.futures`, or one like it: where points are measured; default: here, on all cores.
    on_progress : called with (points done, points in all, about); default: a bar on a terminal, if it takes more than
        two seconds.

    Returns
    -------
    Workspace

    Raises
    ------
    InvalidArgument, UnknownName : coordinates or values that make no sense; a workspace that nothing ends.
    """
    begin = _start(checked_mechanism(mechanism), start)
    pose = mechanism.home_pose if begin is None else begin.pose
    is_any = isinstance(orientation, str) and orientation == "any"
    space = space_of(mechanism, over, fixed, None if is_any else orientation, pose)
    if is_any:
        _require_turning(space, "orientation")
        if tilt is not None:
            raise InvalidArgument("tilt", "an angle", "None with orientation='any'")
    hold: Literal["orientation", "position"] = "position" if is_any else "orientation"
    question = Question(space, begin, _turns(space, tilt), hold, *_ends(space, within))
    step = _step(question, resolution)
    with telling("workspace", on_progress) as tell:
        for _ in range(MOST_HALVINGS):
            found = _found(question, step, Measure(question, executor, tell))
            size = (found.bounds[1] - found.bounds[0]) / step if len(found.faces) else np.inf
            if resolution is not None or np.min(size) >= FEWEST_CELLS:
                break
            step = 0.5 * step
    return found


def _found(question: Question, step: Floats, measure: Measure) -> Workspace:
    space, exact = question.space, question.has_margins
    lattice = Lattice(space.start, step, measure)
    unit = np.where(space.is_angle, 1.0, question.mechanism.characteristic_length)
    widest = float((step / unit).max())
    levels = max(1, round(math.log2(FIRST_CELLS[len(step), exact] / widest)))
    reach = math.ceil(FIRST_REACH[exact] / (widest * 2**levels))
    cells = refined(lattice, levels, max(reach, 2))
    mesh, coarser = mesh_of(lattice, cells.border), mesh_of(lattice, cells.coarser)
    return Workspace(question, step, mesh, coarser, Parts(lattice, cells))


def _start(mechanism: Mechanism, start: Start | None) -> Solution | None:
    if start is None:
        return None
    start_of(mechanism, start, np.shape(start)[:-1] if not isinstance(start, Solution) else start.shape)
    begin = start if isinstance(start, Solution) else configuration(mechanism, start)
    if begin.shape != () or begin.status > 1:
        found = f"batch shape {begin.shape}" if begin.shape else f"an answer that is {begin.status}"
        raise InvalidArgument("start", found, "one feasible configuration")
    return begin


def _turns(space: Space, tilt: float | None) -> Floats:
    """Rotations (k, 3, 3) that all are asked of each pose."""
    if tilt is None:
        return np.eye(3)[None]
    if isinstance(tilt, bool) or not isinstance(tilt, int | float | np.number) or not 0.0 <= tilt <= math.pi:
        raise InvalidArgument("tilt", repr(tilt), "an angle from 0 to pi [rad]")
    _require_turning(space, "tilt")
    return tilts_up_to(float(tilt))


def _require_turning(space: Space, argument: str) -> None:
    if any(space.is_angle) or not task_of(space.mechanism).rotations:
        expected = "None: it is for positions, of a machine whose task has a rotation"
        raise InvalidArgument(argument, f"a value, for a workspace over {', '.join(space.names)}", expected)


def _ends(space: Space, within: Mapping[str, tuple[float, float]] | None) -> tuple[Floats, Floats]:
    """Where the map ends, (d,) each: half a turn either way for angles, if not said otherwise."""
    half_turn = np.where(space.is_angle, math.pi, np.inf)
    lowest, highest = -half_turn, half_turn
    for name, ends in (within or {}).items():
        if name not in space.names:
            raise UnknownName("coordinate", name, space.names)
        low, high = _pair(f"within['{name}']", ends)
        axis = space.names.index(name)
        lowest[axis], highest[axis] = max(low, lowest[axis]), min(high, highest[axis])
    return lowest, highest


def _pair(name: str, ends: Any) -> tuple[float, float]:
    expected = "two numbers, the smaller one first"
    try:
        low, high = (float(end) for end in ends)
    except (TypeError, ValueError):
        raise InvalidArgument(name, repr(ends), expected) from None
    if not low < high:
        raise InvalidArgument(name, repr(ends), expected)
    return low, high


def _step(question: Question, resolution: float | None) -> Floats:
    """The size of the smallest cells, (d,) [length or rad]."""
    space, length = question.space, question.mechanism.characteristic_length
    unit = np.where(space.is_angle, 1.0, length)
    if resolution is None:
        many = len(question.turns) > 1
        return unit * (FINENESS_ONE_BY_ONE if not question.has_margins else FINENESS_OF_SETS if many else FINENESS)
    if isinstance(resolution, bool) or not isinstance(resolution, int | float | np.number):
        raise InvalidArgument("resolution", repr(resolution), "a positive number")
    if not 0.0 < resolution < np.inf:
        raise InvalidArgument("resolution", repr(resolution), "a positive number")
    relative = resolution if all(space.is_angle) else resolution / length
    if not 1e-4 <= relative <= 0.5:
        expected = "between 1e-4 and 0.5 of the characteristic length, or rad"
        raise InvalidArgument("resolution", repr(resolution), expected)
    return unit * relative


def sliced(question: Question, fixed: Mapping[str, float], resolution: Floats | float) -> Workspace:
    """The workspace of a question with further coordinates fixed."""
    space = question.space.with_fixed(fixed)
    kept = [question.space.names.index(name) for name in space.names]
    asked = dataclasses.replace(question, space=space, lowest=question.lowest[kept], highest=question.highest[kept])
    step = resolution[kept] if isinstance(resolution, np.ndarray) else _step(asked, resolution)
    with telling("slice", None) as tell:
        return _found(asked, step, Measure(asked, None, tell))
