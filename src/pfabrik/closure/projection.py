"""Projection: the feasible configurations nearest to unreachable targets, by multistart local searches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Mask
from ..batch import put
from ..derived import derived
from ..description.task import Weights
from ..kernels.closure.loops import LOCKED
from ..kernels.projecting import HOLD_COST, SAME
from ..kernels.rows import HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION
from ..motion.closure import Closure
from ..motion.displacements import displacements
from ..tolerances import TOLERANCES
from .close import Closing, close, platform_poses
from .descend import MOST_STEPS, limit_multipliers, nearest_configurations
from .effort import descents_within
from .multistart import SEEDS, seeds_of
from .parasitic import is_flipped

AGREEMENTS = 7
"""Searches that must end at the nearest configuration found before the multistart stops."""

LONG_CHAIN_STEPS = 20
"""Steps that bring a start of a long chain within its limits."""


class ProjectionMode(NamedTuple):
    """The objective of a projection.

    Attributes
    ----------
    weights : of the squares of position [L] and rotation [rad]; LOCKED for components that are held.
    hold : the part of the target that is held: HOLD_NOTHING, HOLD_ORIENTATION or HOLD_POSITION.
    """

    weights: Weights
    hold: int

    @property
    def held(self) -> Weights:
        """The weights without an objective: LOCKED for held components, else 0."""
        return tuple(LOCKED if weight == LOCKED else 0.0 for weight in self.weights)

    def distances(self, closure: Closure, poses: Floats, targets: Floats) -> Floats:
        """Weighted distances of poses (n, 4, 4) from targets, (n,) [L]; held components do not count."""
        position, rotation = closure.task.errors(poses, targets)
        turning = np.sqrt(max((weight for weight in self.weights[3:] if weight != LOCKED), default=0.0))
        return np.asarray(np.hypot(position / closure.mechanism.characteristic_length, turning * rotation))

    def is_too_far(self, closure: Closure, distances: Floats, starts: Floats, targets: Floats) -> Mask:
        """Mask of answers that are farther from their targets than holding a part of these may cost, (n,).

        That is d > d0 + e0, where d and d0 are the distances of the answer and of the start (n, 4, 4) in components
        that are not held, and e0 is the error of the start in those that are.
        """
        position, rotation = closure.task.errors(starts, targets)
        position = position / closure.mechanism.characteristic_length
        held_error = rotation if self.hold == HOLD_ORIENTATION else position
        allowed = self.distances(closure, starts, targets) + HOLD_COST * held_error
        return np.asarray((distances < np.inf) & (distances > (1.0 + SAME) * allowed))


class Projected(NamedTuple):
    """Projected configurations, their distances from the targets (inf if there is none), and what they hold."""

    closing: Closing
    distances: Floats
    holds: Ints


@derived
def projection_modes(closure: Closure, hold: str | None, rotation_length: float | None) -> tuple[ProjectionMode, ...]:
    """The projection modes in the order in which they are tried: first with the held part, then with nothing held."""
    task, mechanism = closure.task, closure.mechanism
    turning = ((rotation_length or mechanism.rotation_length) / mechanism.characteristic_length) ** 2
    free = ProjectionMode(task.weights(1.0, turning), HOLD_NOTHING)
    if hold is None or not any(task.axes) or task.rotations == 0:
        return (free,)  # nothing to hold, or no other component
    if hold == "orientation":
        return ProjectionMode(task.weights(1.0, LOCKED), HOLD_ORIENTATION), free
    return ProjectionMode(task.weights(LOCKED, turning), HOLD_POSITION), free


def projection_multipliers(
    closure: Closure, coordinates: Floats, targets: Floats, projection: ProjectionMode
) -> Floats:
    """Multipliers of all limits, as of `limit_multipliers`, at projected configurations (n, columns) of targets."""
    return limit_multipliers(closure, coordinates, targets, platform=projection.weights, frame=closure.task.frame)


def held_parts(closure: Closure, holds: Ints, position: Floats, rotation: Floats) -> Ints:
    """The parts of targets that poses really hold, (n,), from their errors [length], [rad]; else HOLD_NOTHING.

    An answer to a clipped target may miss the part that it was to hold.
    """
    is_turned = (holds == HOLD_ORIENTATION) & (rotation > TOLERANCES.held)
    is_moved = (holds == HOLD_POSITION) & (position > TOLERANCES.held * closure.mechanism.characteristic_length)
    return np.where(is_turned | is_moved, HOLD_NOTHING, holds)


def project(
    closure: Closure,
    targets: Floats,
    starts: Sequence[Floats],
    projections: Sequence[ProjectionMode],
    *,
    seeds: bool,
    has_start: bool,
) -> Projected:
    """The nearest feasible configurations that local searches from several starts find.

    Parameters
    ----------
    targets : (n, 4, 4); components without weight are free.
    starts : joint coordinates (n, columns) each, feasible or nearly; of equal results that of the first start is taken.
    projections : tried in turn, until one has an answer.
    seeds : search from the seeds of the workspace too, moved there to hold what is to be held. Without them the search
        stays near its starts.
    has_start : the first start was given: nothing held leads farther away than it is.
    """
    n, frame = len(targets), closure.task.frame
    best = Projected(close(closure, starts[0], targets, max_iterations=0), np.full(n, np.inf), np.full(n, HOLD_NOTHING))
    count, steps = descents_within(closure, len(starts) + (SEEDS if seeds else 0), MOST_STEPS)
    is_long = count < len(starts) or steps == 0
    seed_coordinates = seeds_of(closure) if seeds and count == len(starts) + SEEDS else ()
    if is_long:
        starts = [_nearest_start(closure, targets, starts, projections[-1])]
    all_starts = [*starts, *(np.where(closure.idle, starts[0], seed) for seed in seed_coordinates)]
    for projection in projections if steps else ():
        is_open, agreements = np.isinf(best.distances), np.zeros(n, np.int64)
        for place, start in enumerate(all_starts):
            pending = np.flatnonzero(is_open & (agreements < AGREEMENTS))
            if len(pending):
                begin = start[pending]
                if place >= len(starts):
                    begin = _move_to_held(closure, begin, targets[pending], projection)
                trial = nearest_configurations(
                    closure, begin, targets[pending], platform=projection.weights, frame=frame, steps=steps
                )
                agreements[pending] = _put_nearer(
                    closure, best, pending, trial, targets, projection, agreements[pending]
                )
        unsolved = np.flatnonzero(np.isinf(best.distances))
        if len(unsolved) and LOCKED in projection.weights and not is_long:
            begin = _move_to_held(closure, starts[0][unsolved], targets[unsolved], projection)
            trial = nearest_configurations(
                closure, begin, targets[unsolved], platform=projection.weights, frame=frame, steps=steps
            )
            _put_nearer(closure, best, unsolved, trial, targets, projection, np.zeros(len(unsolved), np.int64))
    unsolved = np.flatnonzero(np.isinf(best.distances))
    if len(unsolved):  # the fallback is the start, which is feasible, or nearly
        fallback, agreements = _measure(closure, starts[0][unsolved]), np.zeros(len(unsolved), np.int64)
        _put_nearer(closure, best, unsolved, fallback, targets, projections[-1], agreements)
    if has_start and len(projections) > 1:
        _release_holds(closure, best, targets, starts, projections)
    return best


def _measure(closure: Closure, coordinates: Floats) -> Closing:
    """Measure joint coordinates (n, columns), without changing them."""
    return close(closure, coordinates, platform_poses(closure.mechanism, coordinates), max_iterations=0)


def _nearest_start(closure: Closure, targets: Floats, starts: Sequence[Floats], projection: ProjectionMode) -> Floats:
    """The start nearest to its target once closed within limits, row by row; the first if none is feasible.

    Used for long chains, for which a search from each start takes too long.
    """
    n = len(targets)
    best = Projected(_measure(closure, starts[0]), np.full(n, np.inf), np.full(n, HOLD_NOTHING))
    rows = np.arange(n)
    for start in starts:
        poses = platform_poses(closure.mechanism, start)
        closed = close(closure, start, poses, limits=True, margin=TOLERANCES.inside, max_iterations=LONG_CHAIN_STEPS)
        _put_nearer(closure, best, rows, closed, targets, projection, np.zeros(n, np.int64))
    return best.closing.coordinates


def _release_holds(
    closure: Closure, best: Projected, targets: Floats, starts: Sequence[Floats], projections: Sequence[ProjectionMode]
) -> None:
    """Hold nothing in rows whose held part leads farther from the target than the start, if that leads nearer."""
    holding, free = projections[0], projections[-1]
    poses = platform_poses(closure.mechanism, starts[0])
    far = np.flatnonzero((best.holds == holding.hold) & holding.is_too_far(closure, best.distances, poses, targets))
    if not len(far):
        return
    released = project(
        closure, targets[far], [start[far] for start in starts], projections[-1:], seeds=False, has_start=True
    )
    is_nearer = released.distances <= (1.0 + SAME) * free.distances(closure, poses[far], targets[far])
    put(best.closing, far[is_nearer], released.closing, is_nearer)
    best.distances[far[is_nearer]] = released.distances[is_nearer]
    best.holds[far[is_nearer]] = released.holds[is_nearer]


def _put_nearer(
    closure: Closure,
    best: Projected,
    rows: NDArray[np.intp],
    trial: Closing,
    targets: Floats,
    projection: ProjectionMode,
    agreements: Ints,
) -> Ints:
    """Put the rows of a trial that are feasible and nearer than the best so far; the new agreement counts, (n,)."""
    is_valid = trial.feasible & ~is_flipped(closure, trial.poses)
    distances = np.where(is_valid, projection.distances(closure, trial.poses, targets[rows]), np.inf)
    least = best.distances[rows]
    is_better = distances < (1.0 - SAME) * least
    agrees = np.isfinite(distances) & (distances <= (1.0 + SAME) * least)
    best.distances[rows[is_better]], best.holds[rows[is_better]] = distances[is_better], projection.hold
    put(best.closing, rows[is_better], trial, is_better)
    return np.where(is_better, 1, agreements + agrees)


def _move_to_held(closure: Closure, start: Floats, targets: Floats, projection: ProjectionMode) -> Floats:
    """Joint coordinates with the loops closed on an end effector that has the held part of its target.

    A search from there keeps what is held, even if no search leads to it from the start.
    """
    if LOCKED not in projection.weights:
        return start
    task = closure.task
    begin = displacements(closure.mechanism, start)[closure.mechanism.end_effector_body] @ closure.mechanism.home_pose
    is_held = np.zeros((4, 4), bool)
    is_held[:3, 3], is_held[:3, :3] = np.array(projection.weights[:3]) == LOCKED, LOCKED in projection.weights[3:]
    poses = np.where(is_held, task.completed(targets, begin), begin)
    margin = TOLERANCES.inside
    return close(
        closure, start, poses, platform=projection.held, frame=task.frame, limits=True, margin=margin
    ).coordinates
