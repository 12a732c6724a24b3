"""How far the end effector can go from where it is, along and about each axis, and what stops it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .answers.limits import ActiveLimit, active_limits
from .answers.solution import Solution, checked_solution
from .answers.status import Status
from .answers.table import aligned, plain
from .answers.words import NO_FREEDOM, STRETCHED, short_names
from .arrays import Floats, Mask
from .closure.first_order import are_stretched
from .description.mechanism import Mechanism
from .description.mechanism_html import card
from .description.task import task_of
from .engine import engine_of
from .errors import InvalidArgument, counted
from .kernels.rows import REACHED
from .motion.fitting_task import has_dependent_coordinates, motions_at, task_remark
from .poses import as_floats
from .rotations import from_rotvec
from .tolerances import TOLERANCES

STEP = 1.0 / 32.0
"""How far one look ahead goes at first [L or rad]: what is narrower may be stepped over."""

NEARBY, LONGEST, HORIZON = 4.0, 64.0, 1e3
"""How far looks along a line are so short, beyond which each goes twice as far as the one before; how far one goes at
most, as an engine that takes limited steps can follow; and beyond which none goes [L]."""

SHORTEST = 1e-12
"""How short a step is not halved again [L or rad]: so near to where a limit stops it, a joint is on that limit even if
it turns a hundred thousand times as fast as the end effector goes. Beyond, its links are as good as stretched out."""

IN_SHORT = {STRETCHED: "links stretched", NO_FREEDOM: "no freedom that way"}
"""Causes as there is room for in a table or a picture."""

FULL_TURN = 2.0 * np.pi
"""How far is looked about an axis [rad]: after a full turn the poses repeat."""


@dataclass(frozen=True)
class Reach:
    """How far it is in one direction.

    Attributes
    ----------
    kind : "along" an axis, or "about" it.
    direction : unit vector in the base frame.
    distance : how far the end effector can go [length or rad]; inf where nothing stops it.
    stopped_by : the limits met there, and which of their bounds; empty where the links are stretched out, or nothing
        stops it.
    end : the last configuration on the way; None where nothing stops it.
    cause : in words, what stops it where no limit does: the links are stretched out, the mechanism has no freedom that
        way, or its task asks for more than it can do, on whatever limits it is there; else empty.
    """

    kind: Literal["along", "about"]
    direction: tuple[float, float, float]
    distance: float
    stopped_by: tuple[ActiveLimit, ...]
    end: Solution | None
    cause: str = ""

    @property
    def why(self) -> str:
        """What stops it, in a few words that a table has room for; empty where nothing does."""
        return IN_SHORT.get(self.cause, "the task") if self.cause else short_names(self.stopped_by)


@dataclass(frozen=True, repr=False)
class Travel(Sequence[Reach]):
    """What `travel` found, one `Reach` a direction, in the order they were asked for."""

    origin: Solution
    reaches: tuple[Reach, ...]

    @property
    def distances(self) -> Floats:
        """How far it is in every direction, (n,) [length or rad]."""
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

    def __str__(self) -> str:
        """A table of them, angles in degrees, and what stops it where no limit does."""
        return "\n\n".join([aligned(_HEADER, self._rows()), *self._remarks()])

    def _repr_html_(self) -> str:
        """The same for notebooks."""
        return card(
            self.origin.mechanism.name, ["how far the end effector can go", *self._remarks()], _HEADER, self._rows(), ""
        )

    def _rows(self) -> list[tuple[str, ...]]:
        return [(*_direction(each), *self._distance(each), each.why) for each in self]

    def _remarks(self) -> list[str]:
        """What there is no room for in a table."""
        said = task_remark(self.origin.mechanism)
        return [said] if any(each.cause == said for each in self) else []

    def _distance(self, reach: Reach) -> tuple[str, str]:
        """How far it is, and the unit: degrees about an axis."""
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
    """How far the end effector can go from a configuration, in its working mode, until a limit or a link stops it.

    Directions are looked along in steps of L/32 or 1/32 rad, each from the configuration before it; steps that are not
    reached are halved, far below the tolerance of a pose. All are followed at once.

    Parameters
    ----------
    solution : one feasible configuration.
    along : directions (n, 3) or (3,) of any length but zero, in the base frame, within the axes that the task has; the
        orientation is kept. Default: both ways along each axis of the task, unless `about` is given.
    about : axes of rotation (n, 3) or (3,), right-handed, in the base frame. Default, unless `along` is given: both
        ways about each axis of the base where the task has a rotation, about the platform's x and y axes where it has a
        tilt, about the base's z axis, which alone is then allowed, where it has a yaw.
    pivot : point (3,) in the base frame that stays where it is as the end effector turns [length]; default: its
        reference point.

    Returns
    -------
    Travel : how far in each direction and what stops it; first along, then about. Distances are inf where nothing stops
        it within 1000 L, or a full turn. Where a task leaves coordinates out, these follow from the mechanism.

    Raises
    ------
    InvalidArgument : a batch, or a configuration that is not feasible; directions that are none or that the task
        leaves out.
    """
    mechanism = checked_solution(solution).mechanism
    if solution.shape != () or solution.status > Status.PROJECTED:
        found = f"batch shape {solution.shape}" if solution.shape else f"an answer that is {solution.status}"
        raise InvalidArgument("solution", found, "one feasible configuration")
    default = along is None and about is None
    lines = _lines(mechanism, along, default)
    axes = _axes(mechanism, solution, about, default)
    centre = solution.pose[:3, 3] if pivot is None else _vector("pivot", pivot)
    search = _TravelSearch(solution, lines, axes, centre)
    distances = search.run()
    ends = Solution(mechanism, search.best, (len(distances),))
    named = active_limits(mechanism, ends._coordinates)
    reaches = []
    for row, (distance, direction) in enumerate(zip(distances.tolist(), search.directions.tolist(), strict=True)):
        kind: Literal["along", "about"] = "along" if row < len(lines) else "about"
        bounded = np.isfinite(distance)
        stop, end = (named[row], ends[row]) if bounded else ((), None)
        x, y, z = direction
        cause = "" if end is None else _cause(end, bool(stop), *search.twist(row, end.pose))
        reaches.append(Reach(kind, (x, y, z), distance, stop, end, cause))
    return Travel(solution, tuple(reaches))


def _cause(end: Solution, is_at_limit: bool, velocity: Floats, turn: Floats) -> str:
    """What stops an end effector besides limits, as far as first order tells: where it is at one, that may be the task.

    Parameters
    ----------
    velocity, turn : how it would go on, (3,) each: velocity of the reference point [L], and angular velocity.
    """
    mechanism, task = end.mechanism, task_of(end.mechanism)
    if is_at_limit and not has_dependent_coordinates(mechanism):
        return ""
    motions, axes = motions_at(mechanism, end._coordinates), list(task.axes)
    about = task.turning_axes(end.pose) if len(motions) > 3 else np.zeros((0, 3))
    able = np.concatenate([motions[:3][axes], about @ motions[3:] if len(about) else motions[:0]])
    wanted = np.concatenate([velocity[axes], about @ turn])
    left = wanted - able @ np.linalg.lstsq(able, wanted, rcond=TOLERANCES.alignment)[0]
    is_able = bool(np.linalg.norm(left) <= TOLERANCES.stretched * np.linalg.norm(wanted))
    if has_dependent_coordinates(mechanism):
        return "" if is_able else task_remark(mechanism)
    if are_stretched(mechanism, end._coordinates).any():
        return STRETCHED
    return "" if is_able else NO_FREEDOM


def _lines(mechanism: Mechanism, along: ArrayLike | None, default: bool) -> Floats:
    """Directions to go along, unit vectors (n, 3)."""
    counts = task_of(mechanism).axes
    if along is None:
        chosen = np.eye(3)[list(counts)] if default else np.zeros((0, 3))
        return np.stack([chosen, -chosen], axis=1).reshape(-1, 3)
    lines = _directions("along", along)
    off = np.abs(lines[:, [not each for each in counts]]).max(axis=1, initial=0.0)
    _require_task(mechanism, "along", lines, off > TOLERANCES.alignment)
    return lines


def _axes(mechanism: Mechanism, solution: Solution, about: ArrayLike | None, default: bool) -> Floats:
    """Axes to turn about, unit vectors (n, 3)."""
    task = task_of(mechanism)
    rotations = task.rotations
    if about is None:
        chosen = task.turning_axes(solution.pose) if default else np.zeros((0, 3))
        return np.stack([chosen, -chosen], axis=1).reshape(-1, 3)
    axes = _directions("about", about)
    off = np.abs(axes[:, :2]).max(axis=1, initial=0.0) > TOLERANCES.alignment
    _require_task(mechanism, "about", axes, off if rotations == 1 else np.full(len(axes), rotations == 0))
    return axes


def _directions(name: str, given: ArrayLike) -> Floats:
    """Unit vectors (n, 3)."""
    expected = "finite directions of shape (n, 3) or (3,) that are not zero"
    array = as_floats(name, given, expected)
    if array.ndim not in (1, 2) or array.shape[-1] != 3:
        raise InvalidArgument(name, f"shape {array.shape}", expected)
    vectors = array.reshape(-1, 3)
    sizes = np.abs(vectors).max(axis=1, initial=0.0)  # however long, no square is too large to be represented
    bad = np.flatnonzero(~(np.isfinite(sizes) & (sizes > 0.0)))
    if len(bad):
        raise InvalidArgument(name, f"{vectors[bad[0]].tolist()}", expected, rows=bad[:5].tolist())
    vectors = vectors / sizes[:, None]
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def _require_task(mechanism: Mechanism, name: str, vectors: Floats, bad: Mask) -> None:
    rows = np.flatnonzero(bad)
    if len(rows):
        expected = f"directions within the task, {' '.join(mechanism.task)}: what it leaves out follows by itself"
        raise InvalidArgument(name, f"{vectors[rows[0]].tolist()}", expected, rows=rows[:5].tolist())


def _vector(name: str, given: ArrayLike) -> Floats:
    vector = as_floats(name, given, "a finite point of shape (3,)")
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InvalidArgument(name, f"{np.asarray(given).tolist()}", "a finite point of shape (3,)")
    return vector


class _TravelSearch:
    """All directions from one pose, and the farthest configuration reached yet on each.

    Attributes
    ----------
    directions : unit vectors (n, 3): lines first, then axes.
    best : the farthest configurations, (n,).
    """

    def __init__(self, solution: Solution, lines: Floats, axes: Floats, pivot: Floats) -> None:
        self.directions = np.concatenate([lines, axes]) + 0.0  # no negative zeros
        self._turns = np.arange(len(self.directions)) >= len(lines)
        self._pose, self._pivot = solution.pose, pivot
        self._engine = engine_of(solution.mechanism)
        self._length = solution.mechanism.characteristic_length
        every = np.arange(len(self.directions))
        start = solution._found.at(0 * every)
        self.best = self._engine.advance(self._targets(every, np.zeros(len(every))), start)

    def run(self) -> Floats:
        """How far each goes, (n,) [length or rad].

        Steps that are not reached are halved, until they are the shortest; two in a row that are reached
        after all, for they begin nearer, are doubled again.
        """
        units = np.where(self._turns, 1.0, self._length)
        farthest = np.where(self._turns, FULL_TURN, HORIZON * self._length)
        near, step, longest = np.zeros(len(units)), STEP * units, STEP * units
        streak = np.zeros(len(units), np.int64)
        moving = np.arange(len(units))
        while len(moving):
            reached = self._go_on(moving, near[moving] + step[moving])
            near[moving[reached]] += step[moving[reached]]
            streak[moving] = np.where(reached, streak[moving] + 1, 0)
            step[moving[~reached]] *= 0.5
            distant = (near > NEARBY * self._length) & ~self._turns
            longest[distant] = LONGEST * self._length
            steady = moving[streak[moving] >= 2]
            step[steady] = np.minimum(2.0 * step[steady], longest[steady])
            streak[steady] = 0
            near[near > farthest] = np.inf
            moving = moving[np.isfinite(near[moving]) & (step[moving] > SHORTEST * units[moving])]
        return near

    def twist(self, row: int, pose: Floats) -> tuple[Floats, Floats]:
        """How the end effector goes on in a direction at a pose (4, 4): its velocity [L], and its angular velocity."""
        direction = self.directions[row]
        if not self._turns[row]:
            return direction, np.zeros(3)
        return np.cross(direction, pose[:3, 3] - self._pivot) / self._length, direction

    def _go_on(self, which: NDArray[np.intp], distances: Floats) -> Mask:
        """Whether poses so far out in some directions are reached; where they are, the next go on from them."""
        found = self._engine.advance(self._targets(which, distances), self.best.at(which))
        reached = np.asarray(found.rows.status == REACHED)
        self.best.replace(which[reached], found, reached)
        return reached

    def _targets(self, which: NDArray[np.intp], distances: Floats) -> Floats:
        """Poses (k, 4, 4) so far along, or turned so far about, some of the directions."""
        steps = distances[:, None] * self.directions[which]
        turned = from_rotvec(np.where(self._turns[which, None], steps, 0.0))
        targets = np.repeat(self._pose[None], len(which), axis=0)
        targets[:, :3, :3] = turned @ targets[:, :3, :3]
        targets[:, :3, 3] = self._pivot + turned @ (self._pose[:3, 3] - self._pivot)
        targets[:, :3, 3] += np.where(self._turns[which, None], 0.0, steps)
        return targets
