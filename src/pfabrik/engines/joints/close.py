"""Closing the loops of a mechanism to machine precision, on the coordinates of all its joints.

Bodies are posed by products of exponentials along the paths from the base to the end effector. Nothing here is shared
with the reaching engine, so that each can check the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Ints, Mask
from ...common.batch import put, take
from ...common.derived import derived
from ...kernels.handle import Handle, Scratch
from ...kernels.joints import loops as K
from ...kernels.threads import in_blocks
from ...machine.description.home_mobility import column_moves
from ...machine.description.mechanism import Mechanism
from ...machine.model import Model
from ...machine.motion.displacements import displacements
from ...machine.motion.loops import Closure
from ...tolerances import TOLERANCES

if TYPE_CHECKING:
    from ...kernels.joints.close import ClosingScratch

EVERYTHING_FREE = (0.0,) * 6
HELD = (K.LOCKED,) * 6

CLOSED = 0.3 * TOLERANCES.position
"""Gap up to which a path counts as closed [L or rad]: a loop consists of two paths, whose gaps add up."""


@derived
def locking(closure: Closure, locked: frozenset[int]) -> tuple[Handle[K.Layout], Scratch[ClosingScratch]]:
    """The layout with the coordinates of some columns locked, and scratch memory to close loops in it."""
    from ...kernels.joints.close import new_closing_scratch

    loops = closure.loops
    free = column_moves(closure.mechanism) > 0.0
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
    """Poses (n, 4, 4) of the end effector, or of the body to which a joint end effector belongs."""
    if not coordinates.any():
        return np.repeat(mechanism.home_pose[None], len(coordinates), axis=0)
    return np.asarray(displacements(mechanism, coordinates)[mechanism.end_effector_body] @ mechanism.home_pose)


class Closing(NamedTuple):
    """The results of closing loops, row by row; lengths in the mechanism's unit.

    Attributes
    ----------
    coordinates : deviations from home, (n, columns).
    poses : of the platform, (n, 4, 4).
    gaps : largest gap of the loops of each group of paths, (n, groups) [L or rad].
    excesses : largest excess over the limits of each group, (n, groups) [L or rad].
    misses : largest distance of a joint centre from its target, per group, (n, groups) [L].
    iterations : steps taken, (n,).
    """

    coordinates: Floats
    poses: Floats
    gaps: Floats
    excesses: Floats
    misses: Floats
    iterations: Ints

    @property
    def gap(self) -> Floats:
        """Largest gap of each row, (n,) [L or rad]."""
        return np.asarray(self.gaps.max(axis=1, initial=0.0))

    @property
    def excess(self) -> Floats:
        """Largest excess over any limit of each row, (n,) [L or rad]."""
        return np.asarray(self.excesses.max(axis=1, initial=0.0))

    @property
    def feasible(self) -> Mask:
        """Mask of rows that are closed within every limit, (n,)."""
        return np.asarray((self.gap <= CLOSED) & (self.excess <= TOLERANCES.limit))

    @property
    def off(self) -> Floats:
        """Infeasibility of each group: the larger of gap and excess, (n, groups) [L or rad]."""
        return np.maximum(self.gaps, self.excesses)

    def put_better(self, places: NDArray[np.intp], trial: Closing) -> None:
        """Write the rows of a trial that are feasible, or less infeasible, at these places."""
        better = np.flatnonzero(trial.feasible | (trial.off.max(axis=1) < self.off[places].max(axis=1)))
        put(self, places[better], trial, better)


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
    stays: bool = False,
    closeness: float = 1e-13,
    max_iterations: int = 100,
) -> Closing:
    """Close loops by least squares from given configurations; rigid joints are set to their locked value.

    Parameters
    ----------
    coordinates, poses : of the start, (n, columns) and (n, 4, 4).
    locked : columns of the coordinates that stay fixed.
    platform : `LOCKED` for each component of the platform's pose, position then rotation, that stays fixed; else 0.
    frame : axes of this rotation: those of the base, those of the pose (the first two tilt), or axes of which the
        third yaws; one of `K.BASE_AXES`, `K.TARGET_AXES`, `K.HALF_WAY`.
    centres : target positions of joint centres, (n, joints, 3); NaN for none.
    limits : keep all limits too, with `margin` to spare.
    undamped : take undamped steps, also uphill: finds more of many solutions, but not the nearest.
    stays : end, open, where Newton's steps do not contract: what closes otherwise may be in any assembly mode.
    max_iterations : most steps; with 0 configurations are measured, not changed.
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
        undamped=int(undamped or stays),
        stays=int(stays),
        patience=-1,
        closeness=closeness,
        max_iterations=max_iterations,
    )
    _run(closure, locked | closure.last_balls if follow else locked, problem, closed)
    return closing_of(closure, closed)


def new_closed(closure: Closure, coordinates: Floats, poses: Floats, gap: float) -> K.Closed:
    """Allocate the kernels' results from coordinates (n, columns) and poses (n, 4, 4) [L] of the start."""
    n, groups = len(coordinates), len(closure.loops.groups) - 1
    gaps, excesses, misses = np.full((3, n, groups), gap)
    return K.Closed(coordinates * closure.scale, poses, gaps, excesses, misses, np.zeros(n, np.int64))


def closing_of(closure: Closure, closed: K.Closed) -> Closing:
    """The kernels' results in the mechanism's unit."""
    poses = in_lengths(closed.poses, closure.mechanism.characteristic_length)
    return Closing(closed.coordinates / closure.scale, poses, *closed[2:])


def measure_configurations(model: Model, coordinates: Floats) -> Closing:
    """Measure loop gaps and limit excesses at joint coordinates (n, columns), deviations from home."""
    return close(model.closure, coordinates, platform_poses(model.mechanism, coordinates), max_iterations=0)


ROWS_A_BLOCK = 64


def _run(closure: Closure, locked: frozenset[int], problem: K.ClosureProblem, closed: K.Closed) -> None:
    """Run the kernel on all rows, on all cores."""
    from ...kernels.joints.close import close as close_rows

    machine = closure.machine.address
    layout, scratch = locking(closure, locked)

    def run(block: slice) -> None:
        part = problem._replace(centres=problem.centres[block])
        close_rows(machine, layout.address, scratch.address, part, take(closed, block))

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
    """The factors (4, 4) of the entries of a pose."""
    factors = np.ones((4, 4))
    factors[:3, 3] = scale
    return factors
