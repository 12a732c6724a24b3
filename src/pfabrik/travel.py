"""Travel: the distances that the end effector can move in each direction, and the limits that stop it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .answers.active_limits import ActiveLimit, active_limits, dead_point
from .answers.solution import Solution, checked_solution
from .answers.status import Status
from .answers.words import DEAD_POINT, NO_FREEDOM, STRETCHED, has_freedom, short_names
from .common.arguments import array
from .common.arrays import Floats, Mask
from .common.printed import Printed, ResultTable, plain
from .common.rotations import from_rotvec
from .engines.engine import engine_of
from .engines.joints.first_order import are_stretched, is_at_dead_point
from .errors import InvalidArgument, counted
from .kernels.rows import REACHED
from .machine.description.mechanism import Mechanism
from .machine.description.task import task_of
from .machine.model import model_of
from .machine.motion.fitting_task import has_dependent_coordinates, task_remark, tilt_axis
from .machine.motion.singularities import are_opposite, assembly_signs
from .tolerances import TOLERANCES

STEP = 1.0 / 32.0
"""First step [L or rad]: narrower obstacles may be missed."""

NEARBY, LONGEST, HORIZON = 4.0, 64.0, 1e3
"""Distance up to which steps keep the length `STEP`, and beyond which they double; the longest step, which an engine
with limited steps can follow; the largest distance [L]."""

SHORTEST = 1e-12
"""Shortest step, which is not halved again [L or rad]: a joint is then on the limit that stops it, even if it turns a
hundred thousand times as fast as the end effector moves. If it turns faster, links are practically stretched out."""

IN_SHORT = {STRETCHED: "links stretched", NO_FREEDOM: "no freedom that way", DEAD_POINT: "dead point"}
"""Short names of causes, for tables and pictures."""

FULL_TURN = 2.0 * np.pi
"""Largest rotation about an axis [rad]: after a full turn the poses repeat."""


@dataclass(frozen=True)
class Reach:
    """The travel in one direction.

    Attributes
    ----------
    kind : {"along", "about"}
        "along" an axis, or "about" it.
    direction : array (3,)
        Unit vector in the base frame.
    distance : float
        Distance that the end effector can move [length or rad]; inf where nothing stops it.
    stopped_by : tuple of ActiveLimit
        The limits that stop it, or the dead point; empty if nothing stops it, or none of these.
    end : Solution or None
        The last configuration in this direction; None if nothing stops it.
    cause : str
        Cause of the stop if no limit stops it, in words: the links are stretched out, the drive of a linkage with one
        freedom is at a dead point or the linkage at a change point, the mechanism has no freedom that way, or its task
        asks for more than it can do, whatever limits are active; else empty.
    """

    kind: Literal["along", "about"]
    direction: tuple[float, float, float]
    distance: float
    stopped_by: tuple[ActiveLimit, ...]
    end: Solution | None
    cause: str = ""

    @property
    def why(self) -> str:
        """The cause of the stop in a few words, for a table; empty if nothing stops it."""
        by_limits = not self.cause or (self.cause == STRETCHED and self.stopped_by)
        return short_names(self.stopped_by) if by_limits else IN_SHORT.get(self.cause, "the task")


@dataclass(frozen=True, repr=False)
class Travel(Printed, Sequence[Reach]):
    """The result of `travel`: one `Reach` per direction, in the order of the arguments.

    Attributes
    ----------
    origin : Solution
        The configuration that the end effector moves from.
    reaches : tuple of Reach
        The travel in each direction.
    """

    origin: Solution
    reaches: tuple[Reach, ...]

    @property
    def distances(self) -> Floats:
        """Distance in every direction, (n,) [length or rad]."""
        return np.array([reach.distance for reach in self.reaches])

    def __len__(self) -> int:
        return len(self.reaches)

    @overload
    def __getitem__(self, index: int) -> Reach: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Reach, ...]: ...
    def __getitem__(self, index: int | slice) -> Reach | tuple[Reach, ...]:
        return self.reaches[index]

    def __iter__(self) -> Iterator[Reach]:
        return iter(self.reaches)

    def __repr__(self) -> str:
        return f"<Travel of '{self.origin.mechanism.name}': {counted(len(self), 'direction')}>"

    def table(self) -> ResultTable:
        """All directions, angles in degrees, and what stops the end effector; a cause that is too long for it below."""
        remark, title = task_remark(self.origin.mechanism), f"Travel of {self.origin.mechanism.name}"
        rows = [(*_direction(reach), *self._distance(reach), reach.why) for reach in self]
        return ResultTable(title, (), _HEADER, rows, [remark] * any(reach.cause == remark for reach in self))

    def _distance(self, reach: Reach) -> tuple[str, str]:
        """Distance and unit as text; degrees about an axis."""
        mechanism = self.origin.mechanism
        unit = "deg" if reach.kind == "about" else mechanism.length_unit
        if not np.isfinite(reach.distance):
            return "unlimited", unit
        if reach.kind == "about":
            return plain(float(np.degrees(reach.distance)), 1e-6), unit
        return plain(reach.distance, 2.0 * TOLERANCES.position * mechanism.characteristic_length), unit

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and dicts, ready for JSON; an endless distance becomes None."""
        rows = [
            {
                "kind": reach.kind,
                "direction": list(reach.direction),
                "distance": reach.distance if np.isfinite(reach.distance) else None,
                "stopped_by": [{"joint": limit.joint, "bound": limit.bound} for limit in reach.stopped_by],
                "cause": reach.cause,
            }
            for reach in self
        ]
        return {"from": self.origin.pose.tolist(), "travel": rows}


_HEADER = ("", "x", "y", "z", "travel", "unit", "stopped by")


def _direction(reach: Reach) -> tuple[str, ...]:
    return (reach.kind, *(plain(part, 1e-9) for part in reach.direction))


def travel(
    solution: Solution,
    *,
    along: ArrayLike | None = None,
    about: ArrayLike | None = None,
    pivot: ArrayLike | None = None,
) -> Travel:
    """Distances that the end effector can move from a configuration, in its working mode, until something stops it.

    A search takes steps of L/32 or 1/32 rad in each direction, each from the configuration before it, and halves steps
    that are not reached, far below the tolerance of a pose. All directions are searched at once.

    Parameters
    ----------
    solution : Solution
        One feasible configuration.
    along : array (n, 3) or (3,), optional
        Directions of any length but zero, in the base frame, within the axes that the task has; the orientation is
        kept. Default: both ways along each axis of the task, unless `about` is given.
    about : array (n, 3) or (3,), optional
        Axes of rotation, right-handed, in the base frame. Default, unless `along` is given: both ways about each axis
        of the base where the task has a rotation, about the platform's x and y axes where it has a tilt, about the
        base's z axis, which alone is then allowed, where it has a yaw.
    pivot : array (3,), optional
        Point in the base frame that stays where it is as the end effector turns [length]; default: its reference point.

    Returns
    -------
    Travel
        Distance in each direction and the limits that stop it; first along, then about. Distances are inf where nothing
        stops it within 1000 L, or a full turn. Coordinates that the task leaves out follow from the mechanism.

    Raises
    ------
    InvalidArgument
        A batch, or a configuration that is not feasible; directions that are none or that the task leaves out.
    """
    mechanism = checked_solution(solution).mechanism
    if solution.shape != () or solution.status > Status.PROJECTED:
        found = f"batch shape {solution.shape}" if solution.shape else f"an answer that is {solution.status}"
        raise InvalidArgument("solution", found, "one feasible configuration")
    default = along is None and about is None
    lines = _lines(mechanism, along, default)
    centre = solution.pose[:3, 3] if pivot is None else array("pivot", pivot, "3")
    axes = _axes(mechanism, solution, about, centre, default)
    search = _TravelSearch(solution, lines, axes, centre)
    distances = search.run()
    ends = Solution(mechanism, search.farthest, (len(distances),))
    named = active_limits(mechanism, ends._coordinates)
    reaches = []
    for row, (distance, direction) in enumerate(zip(distances.tolist(), search.directions.tolist(), strict=True)):
        kind: Literal["along", "about"] = "along" if row < len(lines) else "about"
        bounded = np.isfinite(distance)
        stop, end = (named[row], ends[row]) if bounded else ((), None)
        x, y, z = direction
        cause = ""
        if end is not None:
            motion = search.twist(row, end.pose)
            cause = _cause(end, bool(stop), *motion)
            stop = dead_point(model_of(mechanism), end._configurations, [motion]) if cause == STRETCHED else stop
        reaches.append(Reach(kind, (x, y, z), distance, stop, end, cause))
    return Travel(solution, tuple(reaches))


def _cause(end: Solution, is_at_limit: bool, velocity: Floats, turn: Floats) -> str:
    """The cause that stops an end effector if no limit does, to first order; at a limit, only the task can be one.

    Parameters
    ----------
    velocity, turn : of the blocked motion, (3,) each: velocity of the reference point [L], and angular velocity.
    """
    mechanism, q = end.mechanism, end._coordinates
    if has_dependent_coordinates(mechanism):
        is_able = is_at_limit and has_freedom(mechanism, q, end.pose, velocity, turn)
        return "" if is_able else task_remark(mechanism)
    if is_at_limit:
        return ""
    if is_at_dead_point(model_of(mechanism), q):
        return DEAD_POINT
    is_stretched = are_stretched(model_of(mechanism), q)[0] or has_freedom(mechanism, q, end.pose, velocity, turn)
    return STRETCHED if is_stretched else NO_FREEDOM


def _lines(mechanism: Mechanism, along: ArrayLike | None, default: bool) -> Floats:
    """Checked directions of translation, unit vectors (n, 3)."""
    counts = task_of(mechanism).axes
    if along is None:
        chosen = np.eye(3)[list(counts)] if default else np.zeros((0, 3))
        return np.stack([chosen, -chosen], axis=1).reshape(-1, 3)
    lines = _directions("along", along)
    off = np.abs(lines[:, [not axis for axis in counts]]).max(axis=1, initial=0.0)
    _require_task(mechanism, "along", lines, off > TOLERANCES.alignment)
    return lines


def _axes(mechanism: Mechanism, solution: Solution, about: ArrayLike | None, pivot: Floats, default: bool) -> Floats:
    """Checked axes of rotation, unit vectors (n, 3)."""
    task, only = task_of(mechanism), tilt_axis(mechanism)
    rotations = task.rotations
    if about is None:
        turning = task.turning_axes(solution.pose) if only is None else only[None]
        chosen = turning if default else np.zeros((0, 3))
        return np.stack([chosen, -chosen], axis=1).reshape(-1, 3)
    axes = _directions("about", about)
    if rotations == 1:
        off = np.abs(axes[:, :2]).max(axis=1, initial=0.0) > TOLERANCES.alignment
    elif rotations == 2:  # about the platform's own axis a turn is no tilt, and moves at most the reference point
        ways = np.cross(axes, (solution.pose[:3, 3] - pivot) / mechanism.characteristic_length)[:, list(task.axes)]
        across = np.cross(axes, solution.pose[:3, 2])
        off = np.abs(np.hstack([across, ways])).max(axis=1) <= TOLERANCES.alignment
    else:
        off = np.full(len(axes), rotations == 0)
    _require_task(mechanism, "about", axes, off)
    if only is not None:  # meant, if typed to a few digits
        is_only = np.linalg.norm(np.cross(axes, only), axis=1) <= TOLERANCES.file_angle
        axes[is_only] = np.sign(axes[is_only] @ only)[:, None] * only
    return axes


def _directions(name: str, given: ArrayLike) -> Floats:
    """Unit vectors (n, 3)."""
    vectors = array(name, given, "n 3 | 3", "finite directions", " that are not zero").reshape(-1, 3)
    sizes = np.abs(vectors).max(axis=1, initial=0.0)  # however long, no square is too large to be represented
    zero = np.flatnonzero(sizes == 0.0)
    if len(zero):
        raise InvalidArgument(name, "[0, 0, 0]", "directions that are not zero", rows=zero[:5].tolist())
    vectors = vectors / sizes[:, None]
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def _require_task(mechanism: Mechanism, name: str, vectors: Floats, bad: Mask) -> None:
    rows = np.flatnonzero(bad)
    if len(rows):
        expected = f"directions within the task, {' '.join(mechanism.task)}: what it leaves out follows by itself"
        raise InvalidArgument(name, f"{vectors[rows[0]].tolist()}", expected, rows=rows[:5].tolist())


class _TravelSearch:
    """A line search from one pose in several directions at once.

    Attributes
    ----------
    directions : unit vectors (n, 3): lines first, then axes.
    farthest : the farthest configuration reached yet in each direction, (n,).
    signs : of the assembly that is kept, as of `assembly_signs`.
    """

    def __init__(self, solution: Solution, lines: Floats, axes: Floats, pivot: Floats) -> None:
        self.directions = np.concatenate([lines, axes]) + 0.0  # no negative zeros
        self._turns = np.arange(len(self.directions)) >= len(lines)
        self._pose, self._pivot = solution.pose, pivot
        self._engine = engine_of(solution.mechanism)
        self._length = solution.mechanism.characteristic_length
        rows = np.arange(len(self.directions))
        start = solution._configurations.at(0 * rows)
        self.farthest = self._engine.advance(self._targets(rows, np.zeros(len(rows))), start)
        self._mechanism = solution.mechanism
        self.signs = assembly_signs(solution.mechanism, solution._coordinates)[0]

    def run(self) -> Floats:
        """Distance in each direction, (n,) [length or rad].

        A step that is not reached is halved, down to the shortest; after two in a row that are reached, the step is
        doubled again.
        """
        units = np.where(self._turns, 1.0, self._length)
        most = np.where(self._turns, FULL_TURN, HORIZON * self._length)
        distances, step, longest = np.zeros(len(units)), STEP * units, STEP * units
        streak = np.zeros(len(units), np.int64)
        moving = np.arange(len(units))
        while len(moving):
            reached = self._advance(moving, distances[moving] + step[moving])
            distances[moving[reached]] += step[moving[reached]]
            streak[moving] = np.where(reached, streak[moving] + 1, 0)
            step[moving[~reached]] *= 0.5
            is_distant = (distances > NEARBY * self._length) & ~self._turns
            longest[is_distant] = LONGEST * self._length
            steady = moving[streak[moving] >= 2]
            step[steady] = np.minimum(2.0 * step[steady], longest[steady])
            streak[steady] = 0
            distances[distances > most] = np.inf
            moving = moving[np.isfinite(distances[moving]) & (step[moving] > SHORTEST * units[moving])]
        return distances

    def twist(self, row: int, pose: Floats) -> tuple[Floats, Floats]:
        """Velocity [L] and angular velocity of the end effector that moves in a direction, at a pose (4, 4)."""
        direction = self.directions[row]
        if not self._turns[row]:
            return direction, np.zeros(3)
        return np.cross(direction, pose[:3, 3] - self._pivot) / self._length, direction

    def _advance(self, rows: NDArray[np.intp], distances: Floats) -> Mask:
        """True for directions whose pose at the given distance is reached; the next step starts there."""
        solutions = self._engine.advance(self._targets(rows, distances), self.farthest.at(rows))
        reached = np.asarray(solutions.rows.status == REACHED)
        if self.signs.any():
            reached &= ~are_opposite(assembly_signs(self._mechanism, solutions.coordinates), self.signs)
        self.farthest.put(rows[reached], solutions, reached)
        return reached

    def _targets(self, rows: NDArray[np.intp], distances: Floats) -> Floats:
        """Poses (k, 4, 4), displaced along or turned about some of the directions by the given distances."""
        steps = distances[:, None] * self.directions[rows]
        rotations = from_rotvec(np.where(self._turns[rows, None], steps, 0.0))
        targets = np.repeat(self._pose[None], len(rows), axis=0)
        targets[:, :3, :3] = rotations @ targets[:, :3, :3]
        targets[:, :3, 3] = self._pivot + rotations @ (self._pose[:3, 3] - self._pivot)
        targets[:, :3, 3] += np.where(self._turns[rows, None], 0.0, steps)
        return targets
