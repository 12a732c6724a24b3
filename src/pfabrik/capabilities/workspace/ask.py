"""`workspace`: checks its arguments, and searches for the border."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, Literal

import numpy as np

from ...answers.solution import Solution
from ...answers.start_configuration import Start, joint_vectors, start_of
from ...common.arguments import any_values, array
from ...common.arrays import Floats
from ...common.checks import require_angle, require_known, require_mapping, require_positive
from ...common.telling import OnProgress, telling
from ...configuration import configuration
from ...errors import InvalidArgument, UnsupportedMechanism
from ...kinematics import model_of, task_of
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.poses import SupportsMatrix
from ..certify.enclosure import Enclosure, enclose
from ..certify.question import require_no_clearance
from .border_search import searched, step_of
from .measuring import Measure
from .result import Workspace
from .space import Space, space_of
from .verdicts import MapQuestion, tilts_up_to

FEWEST_CELLS = 24
"""Cells across the shortest side of a workspace; where the default resolution gives fewer, it is halved."""

MOST_HALVINGS = 5

ENCLOSED, MOST_CELLS = 1e-3, 1_000_000
"""Gap between both bounds of an enclosed size, as a share of it, and the most cells that are looked at for it."""


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
    certified: bool | float = False,
    executor: Executor | None = None,
    on_progress: OnProgress | None = None,
) -> Workspace:
    """The workspace of one working mode: its size, its ends, and the limits that form its border.

    By default it spans the positions at home's orientation. With "z" in `fixed` it is a slice, with "x", "y" and "z" it
    spans the orientations at that position. For a machine with at most one translation it spans rotations too; for one
    whose end effector a universal joint carries, the two angles of this joint.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    over : sequence of str, optional
        Two or three coordinates, of "x", "y", "z" (of the reference point, in the base frame) and "tilt_x", "tilt_y",
        "yaw": R = from_rotvec([tilt_x, tilt_y, 0]) Rz(yaw) R_0, with R_0 the orientation held.
    fixed : mapping of str to float, optional
        Values of other coordinates [length or rad]; those in neither are as at the start.
    orientation : array (3, 3) or Rotation or str, optional
        R_0, by default the start's; or "any": positions that are reached with some orientation or other (the reachable
        workspace), without a start in any working mode; each from the configurations of neighbouring ones, and what
        they do not lead to from the machine's seeds.
    tilt : float, optional
        The largest angle by which the platform must be able to lean to every side [rad]: only positions count where it
        can ("total" workspace up to a tilt).
    within : mapping of str to tuple of float, optional
        Coordinate -> (least, greatest), the range searched; default: as far as anything is within reach.
    resolution : float, optional
        Size of the smallest cells, at the border [length; rad where all coordinates are angles]; angles beside lengths:
        that divided by L. Default: L/100 or 0.01 rad, L/50 with a tilt, L/25 where no closed forms answer; halved where
        a workspace would be smaller than 24 cells.
    start : Solution or array (nq,), optional
        A single Solution or joint vector q, which sets the working mode; the component that contains it is `at_start`;
        default home.
    certified : bool or float, optional
        True to enclose the size between two proved bounds too, `Workspace.enclosure`, to 0.1 %; or the share to which
        it is to be enclosed. For closed forms, in home's working mode.
    executor : Executor, optional
        Executor of `concurrent.futures`, or one like it, that measures points; default: here, on all cores. Without
        closed forms, points are explored, each from one within reach; a separate component is found if one of 96
        samples, spread over the points not yet reached, is within it.
    on_progress : callable, optional
        Called with (points done, points in all, about): their ratio is the share of the time, and never falls. Default:
        a line on a terminal, if it takes more than two seconds.

    Returns
    -------
    Workspace

    Raises
    ------
    InvalidArgument or UnknownName
        Coordinates or values that make no sense, or that do not change while the others are held; a workspace that
        nothing ends.
    UnsupportedMechanism
        `certified`, of a machine without closed forms, or with a clearance.
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
    question = MapQuestion(space, begin, _turns(space, tilt), hold, *_ends(space, within))
    accuracy = _accuracy(question, certified)
    with telling("workspace", on_progress) as tell:
        space_found = _refined_workspace(question, resolution, executor, tell)
    if accuracy > 0.0:
        with telling("enclosure of the size", on_progress) as tell:
            space_found.enclosure = _enclosure(question, accuracy, tell)
    return space_found


def _accuracy(question: MapQuestion, certified: Any) -> float:
    """The share to which the size is to be enclosed; 0 if it is not."""
    if certified is False or certified is None:
        return 0.0
    accuracy = ENCLOSED if certified is True else require_positive("certified", certified)
    require_no_clearance(question.mechanism, "enclosed")
    expected = "False: sizes are proved of positions and tilts, at home's working mode"
    if question.start is not None or len(question.turns) > 1 or question.hold == "position":
        raise InvalidArgument("certified", f"{certified!r}, with a start, a tilt or any orientation", expected)
    if question.space.joint is not None:
        raise InvalidArgument("certified", f"{certified!r}, over the coordinates of a joint", expected)
    return accuracy


def _enclosure(question: MapQuestion, accuracy: float, tell: OnProgress | None) -> Enclosure:
    """The size of a workspace between two proved bounds."""
    model, space = model_of(question.mechanism), question.space
    if model.why_poses_do_not_suffice:
        reason = model.why_poses_do_not_suffice
        raise UnsupportedMechanism(question.mechanism.name, [reason], "enclosed")
    ends = question.lowest, question.highest
    return enclose(
        model, space.names, space.held, space.rotation, ends, accuracy=accuracy, budget=MOST_CELLS, tell=tell
    )


def _refined_workspace(
    question: MapQuestion, resolution: float | None, executor: Executor | None, tell: OnProgress | None
) -> Workspace:
    """The workspace at a resolution; by default one that is refined until enough cells span its shortest side."""
    measure = Measure(question, executor, tell, FEWEST_CELLS if resolution is None else 0)
    step, left = step_of(question, resolution), MOST_HALVINGS
    while True:
        space = Workspace(question, step, *searched(question, step, measure))
        halvings = min(measure.halvings(np.ptp(space.bounds, axis=0) / step), left) if len(space.faces) else 0
        if not halvings:
            measure.progress.end()
            return space
        step, left = step * 0.5**halvings, left - halvings


def _start(mechanism: Mechanism, start: Start | None) -> Solution | None:
    if start is None:
        return None
    shape = start.shape if isinstance(start, Solution) else joint_vectors(mechanism, start, "start")[1]
    start_of(mechanism, start, shape)
    begin = start if isinstance(start, Solution) else configuration(mechanism, start)
    if begin.shape != () or begin.status > 1:
        found = f"batch shape {begin.shape}" if begin.shape else f"an answer that is {begin.status}"
        raise InvalidArgument("start", found, "one feasible configuration")
    return begin


def _turns(space: Space, tilt: float | None) -> Floats:
    """Rotations (k, 3, 3) by all of which each pose must be within reach."""
    if tilt is None:
        return np.eye(3)[None]
    angle = require_angle("tilt", tilt)
    _require_turning(space, "tilt", "tilt")
    return tilts_up_to(angle)


def _require_turning(space: Space, argument: str, kind: Literal["rotation", "tilt"] = "rotation") -> None:
    rotations = task_of(space.mechanism).rotations
    if any(space.is_angle) or rotations == 0 or (kind == "tilt" and rotations == 1):
        expected = f"None: it is for positions, of a machine whose task has a {kind}"
        raise InvalidArgument(argument, f"a value, for a workspace over {', '.join(space.names)}", expected)


def _ends(space: Space, within: Mapping[str, tuple[float, float]] | None) -> tuple[Floats, Floats]:
    """The ends of the map, (d,) each; by default half a turn either way for angles, infinite for lengths."""
    half_turn = np.where(space.is_angle, math.pi, np.inf)
    lowest, highest = -half_turn, half_turn
    given = require_mapping("within", within, "ends by coordinate, such as {'z': (100, 200)}")
    require_known("coordinate", given, space.names)
    for name, ends in given.items():
        low, high = _pair(f"within['{name}']", ends)
        axis = space.names.index(name)
        lowest[axis], highest[axis] = max(low, lowest[axis]), min(high, highest[axis])
    return lowest, highest


def _pair(name: str, ends: Any) -> tuple[float, float]:
    low, high = array(name, ends, "2", "numbers", ", the smaller one first", any_values).tolist()
    if not low < high:
        raise InvalidArgument(name, repr(ends), "two numbers, the smaller one first")
    return low, high
