"""The closure engine: the joint coordinates of a whole mechanism, its loops closed to machine precision.

Bodies are posed by products of exponentials along the paths from the base to the end effector; nothing here is shared
with the reaching engine, so that each can check the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Mask
from ..description.home_mobility import column_moves
from ..description.mechanism import Mechanism
from ..kernels.closure import loops as K
from ..kernels.handle import Handle, Scratch
from ..kernels.threads import in_blocks
from ..motion.displacements import displacements
from ..tolerances import TOLERANCES
from .loops import loops_of

if TYPE_CHECKING:
    from ..kernels.closure.close import ClosingScratch

EVERYTHING_FREE = (0.0,) * 6
HELD = (K.LOCKED,) * 6

CLOSED = 0.3 * TOLERANCES.position
"""Gap of a path that counts as closed [L or rad]: loops, which lead along two paths, may add their gaps up."""


@dataclass(frozen=True)
class Closure:
    """A mechanism as the closure kernel takes it.

    Attributes
    ----------
    scale : what a coordinate is multiplied by to be dimensionless: 1 / L for lengths, 1 for angles, (columns,).
    turning : 1 for angles, 0 for lengths, (columns,).
    last_balls : columns of ball joints at the platform, each at the end of a path that shares no joint.
    actuated, home : columns of the actuators, and their values at home, (n_a,).
    driven : the columns of the actuators and of locked joints: they stay where they are put.
    """

    mechanism: Mechanism
    loops: K.Loops
    scale: Floats
    turning: Floats
    actuated: Ints
    driven: frozenset[int]
    last_balls: frozenset[int]
    home: Floats
    whole: bool

    @property
    def idle(self) -> Mask:
        """Which coordinates are on no path (a tool's hinge): they rest, and nothing but their limits counts."""
        idle = np.ones(len(self.scale), bool)
        idle[self.loops.row_columns] = False
        return idle

    @cached_property
    def cubes(self) -> float:
        """Sum of the cubes of how many coordinates each group has, at least 1: what a step of closing takes."""
        on_paths = self.loops.group_of[~self.idle]
        return float(max(1.0, (np.bincount(on_paths).astype(float) ** 3).sum()))

    def actuators(self, coordinates: Floats) -> Floats:
        """The actuated values (n, n_a) in coordinates (n, columns) [length or rad]."""
        return np.asarray(coordinates[:, self.actuated] + self.home)

    def put_actuators(self, coordinates: Floats, values: Floats) -> None:
        """Write actuated values (n, n_a), and where locked joints are, into coordinates (n, columns)."""
        coordinates[:, list(self.driven)] = 0.0
        coordinates[:, self.actuated] = values - self.home

    @cached_property
    def machine(self) -> Handle[K.Loops]:
        """What kernels are given of the loops."""
        return Handle(self.loops)


@lru_cache(maxsize=64)
def closure_of(mechanism: Mechanism, whole: bool = True) -> Closure:
    """Compile a mechanism for the closure kernel.

    Parameters
    ----------
    whole : with all loops; else with those alone that the pose of the end effector has to do with. The joints of the
        others (a gripper's) are idle then.
    """
    loops = loops_of(mechanism, whole=whole)
    turning = np.array([float(each.kind == "angle") for each in mechanism.coordinates])
    scale = np.where(turning, 1.0, 1.0 / mechanism.characteristic_length)
    actuated = np.array([drive.column for drive in mechanism.drives], np.int64)
    home = np.array([drive.home for drive in mechanism.drives])
    ending = loops.columns[loops.visits[loops.paths[1:][loops.last_balls == 1] - 1, 0]]
    balls = frozenset((ending[:, None] + np.arange(3)).ravel().tolist())
    locked = [each.column for each in mechanism.coordinates if each.joint.is_rigid]
    driven = frozenset([*actuated.tolist(), *locked])
    return Closure(mechanism, loops, scale, turning, actuated, driven, balls, home, whole)


@lru_cache(maxsize=256)
def _locking(
    mechanism: Mechanism, whole: bool, locked: frozenset[int]
) -> tuple[Handle[K.Layout], Scratch[ClosingScratch]]:
    """The layout in which the coordinates of some columns do not move, and memory to close loops in it."""
    from ..kernels.closure.close import new_closing_scratch

    loops = closure_of(mechanism, whole).loops
    free = column_moves(mechanism) > 0.0
    free[list(locked)] = False
    slots = np.full(len(free), -1)
    sizes = np.zeros(len(loops.groups) - 1, np.int64)
    for j in np.flatnonzero(free):
        group = loops.group_of[j]
        slots[j] = sizes[group]
        sizes[group] += 1
    layout = K.Layout(slots, sizes)
    return Handle(layout), Scratch(new_closing_scratch, loops, layout)


def platform_poses(mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Poses (n, 4, 4) of the end effector, or of the body that carries it where it is a joint."""
    if not coordinates.any():
        return np.repeat(mechanism.home_pose[None], len(coordinates), axis=0)
    return np.asarray(displacements(mechanism, coordinates)[mechanism.end_effector_body] @ mechanism.home_pose)


class Closing(NamedTuple):
    """What a search for closed loops found, row by row; lengths in the mechanism's unit.

    Attributes
    ----------
    coordinates : deviations from home, (n, columns).
    poses : of the platform, (n, 4, 4).
    gaps : largest gap of the loops of each group of paths, (n, groups) [L or rad].
    excesses : largest excess over the limits of each group, likewise.
    misses : largest distance of a joint's centre from where it was wished, likewise.
    iterations : (n,).
    """

    coordinates: Floats
    poses: Floats
    gaps: Floats
    excesses: Floats
    misses: Floats
    iterations: Ints

    @property
    def gap(self) -> Floats:
        """The largest gap of each row [L or rad]."""
        return np.asarray(self.gaps.max(axis=1, initial=0.0))

    @property
    def excess(self) -> Floats:
        """The largest excess over any limit of each row [L or rad]."""
        return np.asarray(self.excesses.max(axis=1, initial=0.0))

    @property
    def feasible(self) -> Mask:
        """Which rows are closed within every limit, (n,)."""
        return np.asarray((self.gap <= CLOSED) & (self.excess <= TOLERANCES.limit))

    @property
    def off(self) -> Floats:
        """What keeps each group of each row from being feasible: its gap or its excess, (n, groups) [L or rad]."""
        return np.maximum(self.gaps, self.excesses)

    def put_better(self, places: NDArray[np.intp], tried: Closing) -> None:
        """Put rows of another search in these places where they are feasible, or less far from it."""
        better = np.flatnonzero(tried.feasible | (tried.off.max(axis=1) < self.off[places].max(axis=1)))
        self.put(places[better], tried, better)

    def put(self, places: NDArray[np.intp], found: Closing, rows: Any = slice(None)) -> None:
        """Put rows of another search in some places of this one."""
        for array, own in zip(self, found, strict=True):
            array[places] = own[rows]


def close(
    closure: Closure,
    coordinates: Floats,
    poses: Floats,
    *,
    locked: frozenset[int] = frozenset(),
    platform: Sequence[float] = EVERYTHING_FREE,
    frame: int = K.BASE_AXES,
    centres: Floats | None = None,
    limits: bool = False,
    margin: float = 0.0,
    undamped: bool = False,
    closeness: float = 1e-13,
    max_iterations: int = 100,
) -> Closing:
    """Close loops from given configurations, nearest to what is wished; locked joints are put where they are locked.

    Parameters
    ----------
    coordinates, poses : where to start, (n, columns) and (n, 4, 4).
    locked : columns of the coordinates that stay as they are.
    platform : `LOCKED` for what of the platform's pose, position then rotation, stays where it starts; else 0.
    frame : the axes of this rotation: those of the base, those of the pose (of which the first two tilt), or axes of
        which the third yaws; one of `K.BASE_AXES`, `K.TARGET_AXES`, `K.HALF_WAY`.
    centres : wished joint centres, (n, joints, 3); NaN for none.
    limits : keep all limits too, by `margin` inside.
    undamped : undamped steps, up and down: finds more of many solutions, but not the nearest.
    max_iterations : with 0 configurations are measured as they are.
    closeness : largest gap, excess and miss that ends the search [L or rad].
    """
    n, length = len(coordinates), closure.mechanism.characteristic_length
    if max_iterations:
        coordinates = coordinates * column_moves(closure.mechanism)
    follow = centres is None and not limits and max_iterations > 0
    closed = new_closed(closure, coordinates, in_lengths(poses, 1.0 / length), np.inf)
    problem = K.ClosureProblem(
        platform=np.array(platform, dtype=float),
        frame=frame,
        centres=np.zeros((n, 0, 3)) if centres is None else centres / length,
        limits=int(limits),
        margin=margin,
        balls_follow=int(follow),
        undamped=int(undamped),
        closeness=closeness,
        max_iterations=max_iterations,
    )
    _run(closure, locked | closure.last_balls if follow else locked, problem, closed)
    return closing_of(closure, closed)


def new_closed(closure: Closure, coordinates: Floats, poses: Floats, gap: float) -> K.Closed:
    """What the kernels fill, from coordinates (n, columns), poses (n, 4, 4) [L], and gaps before anything is known."""
    n, groups = len(coordinates), len(closure.loops.groups) - 1
    gaps, excesses, misses = np.full((3, n, groups), gap)
    return K.Closed(coordinates * closure.scale, poses, gaps, excesses, misses, np.zeros(n, np.int64))


def closing_of(closure: Closure, closed: K.Closed) -> Closing:
    """What they have filled, in the mechanism's unit."""
    poses = in_lengths(closed.poses, closure.mechanism.characteristic_length)
    return Closing(closed.coordinates / closure.scale, poses, *closed[2:])


def measure_configurations(mechanism: Mechanism, coordinates: Floats) -> Closing:
    """Joint coordinates (n, columns), deviations from home, as they are: their loop gaps and limit excesses."""
    return close(closure_of(mechanism), coordinates, platform_poses(mechanism, coordinates), max_iterations=0)


ROWS_A_BLOCK = 64


def _run(closure: Closure, locked: frozenset[int], problem: K.ClosureProblem, closed: K.Closed) -> None:
    """The kernel over all rows, on all cores."""
    from ..kernels.closure.close import close as close_rows

    machine = closure.machine.address
    layout, scratch = _locking(closure.mechanism, closure.whole, locked)

    def run(block: slice) -> None:
        own = problem._replace(centres=problem.centres[block])
        close_rows(machine, layout.address, scratch.address, own, K.Closed._make(array[block] for array in closed))

    n = len(closed.poses)
    if n <= ROWS_A_BLOCK:
        close_rows(machine, layout.address, scratch.address, problem, closed)
    else:
        in_blocks(run, n, ROWS_A_BLOCK)


def in_lengths(poses: Floats, scale: float) -> Floats:
    """Poses with their positions scaled, copied."""
    return np.asarray(poses * _scaling(scale))


@lru_cache(maxsize=64)
def _scaling(scale: float) -> Floats:
    """What the numbers of a pose are multiplied with."""
    factors = np.ones((4, 4))
    factors[:3, 3] = scale
    return factors
