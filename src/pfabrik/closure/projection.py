"""Projection: the feasible configurations nearest to targets that are not reached."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Mask
from ..description.mechanism import Mechanism
from ..description.task import Weights, task_of
from ..kernels.closure.loops import LOCKED
from ..kernels.rows import HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION
from ..motion.displacements import displacements
from ..tolerances import TOLERANCES
from .close import Closing, Closure, close, closure_of, platform_poses
from .descend import MOST_STEPS, limit_multipliers, nearest_configurations
from .effort import descents_within
from .multistart import SEEDS, seeds_of
from .parasitic import is_flipped

SAME = 1e-7
"""Share by which a later start must come nearer to be preferred to an earlier one."""

AGREEMENTS = 7
"""How many searches must end at the nearest configuration found before no other is looked for."""


RESTING = 20
"""Steps in which a start of a long chain is brought within its limits."""

DRAGGED = 1.0
"""How much farther than where it starts an answer may be that holds part of its target, for each unit by which that
part differs at the start [L per rad, or rad per L]: a turn about the middle of a machine moves no joint by more."""


class ProjectionMode(NamedTuple):
    """A way to project: weights of the platform's position [L] and rotation [rad], and what of them is held."""

    weights: Weights
    hold: int

    @property
    def held(self) -> Weights:
        """What is held alone."""
        return tuple(LOCKED if weight == LOCKED else 0.0 for weight in self.weights)

    def distances(self, closure: Closure, poses: Floats, targets: Floats) -> Floats:
        """How far poses (n, 4, 4) are from targets in what counts, (n,) [L]."""
        position, rotation = task_of(closure.mechanism).errors(poses, targets)
        turning = np.sqrt(max((weight for weight in self.weights[3:] if weight != LOCKED), default=0.0))
        return np.asarray(np.hypot(position / closure.mechanism.characteristic_length, turning * rotation))

    def is_too_far(self, closure: Closure, distances: Floats, starts: Floats, targets: Floats) -> Mask:
        """Whether answers that hold part of their targets are farther than the poses (n, 4, 4) where searches start,
        and by more than holding it may cost, (n,).

        With d the distance of an answer and d0 that of its start in what is not held, and e0 how far the start is from
        having what is: d > d0 + e0.
        """
        position, rotation = task_of(closure.mechanism).errors(starts, targets)
        position = position / closure.mechanism.characteristic_length
        lacking = rotation if self.hold == HOLD_ORIENTATION else position
        allowed = self.distances(closure, starts, targets) + DRAGGED * lacking
        return np.asarray((distances < np.inf) & (distances > (1.0 + SAME) * allowed))


class Projected(NamedTuple):
    """Answers: configurations, how far they are from their targets (inf where none was found), and what they hold."""

    closing: Closing
    distances: Floats
    holds: Ints


@lru_cache(maxsize=256)
def projection_modes(
    mechanism: Mechanism, hold: str | None, rotation_length: float | None
) -> tuple[ProjectionMode, ...]:
    """The ways to project, in the order in which they are tried: what is to be held, then everything free."""
    task = task_of(mechanism)
    turning = ((rotation_length or mechanism.rotation_length) / mechanism.characteristic_length) ** 2
    free = ProjectionMode(task.weights(1.0, turning), HOLD_NOTHING)
    if hold is None or not any(task.axes) or task.rotations == 0:
        return (free,)  # nothing is to be held, or nothing else could give way
    if hold == "orientation":
        return ProjectionMode(task.weights(1.0, LOCKED), HOLD_ORIENTATION), free
    return ProjectionMode(task.weights(LOCKED, turning), HOLD_POSITION), free


def projection_multipliers(mechanism: Mechanism, coordinates: Floats, targets: Floats, way: ProjectionMode) -> Floats:
    """How hard every limit holds projected configurations (n, columns) back from targets: see `limit_multipliers`."""
    closure, frame = closure_of(mechanism), task_of(mechanism).frame
    return limit_multipliers(closure, coordinates, targets, platform=way.weights, frame=frame)


def held_parts(mechanism: Mechanism, holds: Ints, position: Floats, rotation: Floats) -> Ints:
    """What poses have of their targets, of what they were to hold, by how far they are: targets out of sight were not
    sought."""
    turned = (holds == HOLD_ORIENTATION) & (rotation > TOLERANCES.held)
    moved = (holds == HOLD_POSITION) & (position > TOLERANCES.held * mechanism.characteristic_length)
    return np.where(turned | moved, HOLD_NOTHING, holds)


def project(
    closure: Closure, targets: Floats, starts: Sequence[Floats], ways: Sequence[ProjectionMode], *, seeds: bool
) -> Projected:
    """The nearest feasible configurations that local searches from several starts find.

    Parameters
    ----------
    targets : (n, 4, 4); what does not count in them is as it may stay.
    starts : joint coordinates (n, columns) each, feasible or nearly; of equal answers the first start's is taken.
    ways : tried in turn, until one has an answer.
    corners : search from the corners of the workspace too, there with what is held put in its place. Without, the
        search stays about where it starts.
    """
    n, frame = len(targets), task_of(closure.mechanism).frame
    best = Projected(close(closure, starts[0], targets, max_iterations=0), np.full(n, np.inf), np.full(n, HOLD_NOTHING))
    count, steps = descents_within(closure, len(starts) + (SEEDS if seeds else 0), MOST_STEPS)
    is_long = count < len(starts) or steps == 0
    elsewhere = seeds_of(closure.mechanism) if seeds and count == len(starts) + SEEDS else ()
    if is_long:
        starts = [_nearest_at_rest(closure, targets, starts, ways[-1])]
    everywhere = [*starts, *(np.where(closure.idle, starts[0], corner) for corner in elsewhere)]
    for way in ways if steps else ():
        open_to_it, agreements = np.isinf(best.distances), np.zeros(n, np.int64)
        for place, start in enumerate(everywhere):
            waiting = np.flatnonzero(open_to_it & (agreements < AGREEMENTS))
            if len(waiting):
                begin = start[waiting]
                if place >= len(starts):
                    begin = _placed(closure, begin, targets[waiting], way)
                found = nearest_configurations(
                    closure, begin, targets[waiting], platform=way.weights, frame=frame, steps=steps
                )
                agreements[waiting] = _take_nearer(closure, best, waiting, found, targets, way, agreements[waiting])
        lost = np.flatnonzero(np.isinf(best.distances))
        if len(lost) and LOCKED in way.weights and not is_long:
            begin = _placed(closure, starts[0][lost], targets[lost], way)
            found = nearest_configurations(
                closure, begin, targets[lost], platform=way.weights, frame=frame, steps=steps
            )
            _take_nearer(closure, best, lost, found, targets, way, np.zeros(len(lost), np.int64))
    lost = np.flatnonzero(np.isinf(best.distances))
    if len(lost):  # where a search starts is feasible, or nearly: better than no answer
        _take_nearer(
            closure, best, lost, _at_rest(closure, starts[0][lost]), targets, ways[-1], np.zeros(len(lost), np.int64)
        )
    if len(ways) > 1:
        _let_go(closure, best, targets, starts, ways)
    return best


def _at_rest(closure: Closure, coordinates: Floats) -> Closing:
    """Joint coordinates as they are."""
    return close(closure, coordinates, platform_poses(closure.mechanism, coordinates), max_iterations=0)


def _nearest_at_rest(closure: Closure, targets: Floats, starts: Sequence[Floats], way: ProjectionMode) -> Floats:
    """The starts that are nearest to targets once they are closed within limits, row by row; the first where none is.

    There is no time to search from each of them.
    """
    best = Projected(_at_rest(closure, starts[0]), np.full(len(targets), np.inf), np.full(len(targets), HOLD_NOTHING))
    every = np.arange(len(targets))
    for start in starts:
        poses = platform_poses(closure.mechanism, start)
        closed = close(closure, start, poses, limits=True, margin=TOLERANCES.inside, max_iterations=RESTING)
        _take_nearer(closure, best, every, closed, targets, way, np.zeros(len(every), np.int64))
    return best.closing.coordinates


def _let_go(
    closure: Closure, best: Projected, targets: Floats, starts: Sequence[Floats], ways: Sequence[ProjectionMode]
) -> None:
    """Hold nothing where what was held leads farther from targets than the start is, and nothing held does not."""
    begun = platform_poses(closure.mechanism, starts[0])
    far = np.flatnonzero((best.holds == ways[0].hold) & ways[0].is_too_far(closure, best.distances, begun, targets))
    if not len(far):
        return
    other = project(closure, targets[far], [start[far] for start in starts], ways[-1:], seeds=False)
    nearer = other.distances <= (1.0 + SAME) * ways[-1].distances(closure, begun[far], targets[far])
    best.closing.put(far[nearer], other.closing, nearer)
    best.distances[far[nearer]], best.holds[far[nearer]] = other.distances[nearer], other.holds[nearer]


def _take_nearer(
    closure: Closure,
    best: Projected,
    rows: NDArray[np.intp],
    found: Closing,
    targets: Floats,
    way: ProjectionMode,
    agreements: Ints,
) -> Ints:
    """Take over the rows that are feasible, and nearer than the best so far; how often each best was found by now."""
    counts = found.feasible & ~is_flipped(closure.mechanism, found.poses)
    distances = np.where(counts, way.distances(closure, found.poses, targets[rows]), np.inf)
    least = best.distances[rows]
    better = distances < (1.0 - SAME) * least
    again = np.isfinite(distances) & (distances <= (1.0 + SAME) * least)
    best.distances[rows[better]], best.holds[rows[better]] = distances[better], way.hold
    best.closing.put(rows[better], found, better)
    return np.where(better, 1, agreements + again)


def _placed(closure: Closure, start: Floats, targets: Floats, way: ProjectionMode) -> Floats:
    """Joint coordinates with the end effector put as it is to be held, and the loops closed on it.

    A search from there finds what is held where no short way leads to it.
    """
    if LOCKED not in way.weights:
        return start
    task = task_of(closure.mechanism)
    begin = displacements(closure.mechanism, start)[closure.mechanism.end_effector_body] @ closure.mechanism.home_pose
    held = np.zeros((4, 4), bool)
    held[:3, 3], held[:3, :3] = np.array(way.weights[:3]) == LOCKED, LOCKED in way.weights[3:]
    placed = np.where(held, task.completed(targets, begin), begin)
    closed = close(closure, start, placed, platform=way.held, frame=task.frame, limits=True, margin=TOLERANCES.inside)
    return closed.coordinates
