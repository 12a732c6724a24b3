"""Forward kinematics on joint coordinates: loops closed at given actuator values, or at the nearest feasible ones."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import chain, islice

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..kernels.rows import ACTUATOR_ERROR, EXCEEDED, FAILED, PROJECTED, REACHED
from ..motion.mobility import generic_of
from ..tolerances import TOLERANCES
from .close import CLOSED, Closing, Closure, close, closure_of, platform_poses
from .configurations import Configurations
from .descend import MOST_STEPS, nearest_actuators
from .effort import descents_within
from .starts import same_random_starts

STRIDES = 8
"""Steps in which actuators are taken from the start's values to the asked ones where one step strays."""

STARTS = 48
"""Random starts where nothing else assembles and no start says in which mode to stay."""

SAME = 1e-3
"""Share by which distances or gaps may differ and still count as the same: those of mirror images are."""

NEAR = 1e-6
"""Actuators this near to the asked values need no search from elsewhere for nearer ones [L or rad]."""

NOISE = 1e-4
"""How far readings of more actuators than freedoms are off for noise alone [L or rad]: those that fit as well from a
start contradict each other, and fit exactly nowhere else."""

PROJECTIONS = 12
"""Random starts of the search for feasible values near those that no configuration has."""

SIGHT = 3.0
"""How far off asked values are at most looked for, where they are too far for a search to end [L or rad]."""


def assemble(mechanism: Mechanism, coordinates: Floats, values: Floats, *, seeded: bool) -> Closing:
    """Close the loops at actuated values (n, n_a), or at feasible ones as near as a search brings them.

    Newton's method with the actuators locked; where it strays, the actuators led to their values in steps; then random
    starts; then the nearest feasible values.

    Parameters
    ----------
    coordinates : joint coordinates to start from, (n, columns), deviations from home.
    seeded : they are to stay in their mode where they assemble in it, within limits or not. Other starts, home the
        first, only replace a projection.

    Returns
    -------
    Closing : judge by `feasible`, and by `actuator_errors`.
    """
    closure, poses = closure_of(mechanism), platform_poses(mechanism, coordinates)
    best = _locked(closure, coordinates, poses, values)
    if not best.feasible.all():
        attempts = [] if is_over_determined(mechanism) else [_led]
        for attempt in attempts if seeded else [*attempts, _scattered]:
            rest = np.flatnonzero(~best.feasible)
            if len(rest):
                best.put_better(rest, attempt(closure, coordinates[rest], poses[rest], values[rest]))
    rest = np.flatnonzero(~best.feasible)
    if not len(rest):
        return best
    strayed = best.gap[rest] > CLOSED
    _project(closure, best, rest, (coordinates[rest], poses[rest]), values[rest], seeded)
    if seeded:
        off = np.abs(actuator_errors(closure, best.coordinates[rest], values[rest])).max(axis=1, initial=0.0)
        near = NOISE if is_over_determined(mechanism) else NEAR
        missed = rest[strayed & ((off > near) | ~best.feasible[rest])]
        if len(missed):
            _assemble_elsewhere(closure, best, missed, poses[missed], values[missed])
    return best


def _assemble_elsewhere(closure: Closure, best: Closing, rows: NDArray[np.intp], poses: Floats, values: Floats) -> None:
    """Assemble rows from home, or else from random starts, nearest to their own poses (n, 4, 4); where that fails they
    stay as they are."""
    home = np.zeros_like(best.coordinates[rows]), np.repeat(closure.mechanism.home_pose[None], len(rows), axis=0)
    tried = _locked(closure, *home, values)
    missed = np.flatnonzero(~tried.feasible)
    if len(missed):
        tried.put_better(missed, _scattered(closure, home[0][missed], poses[missed], values[missed]))
    reached = np.flatnonzero(tried.feasible)
    best.put(rows[reached], tried, reached)


@lru_cache(maxsize=64)
def is_over_determined(mechanism: Mechanism) -> bool:
    """Whether there are more actuators than motions: then most values contradict each other. Never without loops."""
    if len(closure_of(mechanism).loops.paths) <= 2:
        return False
    counted = generic_of(mechanism).mobility
    return counted.actuators > counted.mobility - counted.idle


def _locked(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Newton's method with the actuators locked."""
    start = coordinates.copy()
    closure.put_actuators(start, values)
    return close(closure, start, poses, locked=closure.driven)


def _led(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """The actuators led from where they are to the asked values."""
    begin = closure.actuators(coordinates)
    for stride in range(1, STRIDES + 1):
        found = _locked(closure, coordinates, poses, begin + (values - begin) * stride / STRIDES)
        coordinates, poses = found.coordinates, found.poses
    return found


def _scattered(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Random starts; of each row's answers the best: the least open, of equals the nearest to where the row started."""
    best = _locked(closure, coordinates, poses, values)
    off, from_start = _least_off(best), _distances(closure, best.poses, poses)
    for start in same_random_starts(closure, STARTS, len(values)):
        tried = _locked(closure, *start, values)
        tried_off, distance = _least_off(tried), _distances(closure, tried.poses, poses)
        equal = np.abs(tried_off - off) <= SAME * off
        better = np.flatnonzero(np.where(equal, distance < from_start, tried_off < off))
        off[better], from_start[better] = tried_off[better], distance[better]
        best.put(better, tried, better)
    return best


def _least_off(closing: Closing) -> Floats:
    """What keeps rows from being feasible, (n,) [L or rad]; the least tolerance where nothing does."""
    return np.asarray(np.maximum(closing.off.max(axis=1), min(TOLERANCES.position, TOLERANCES.limit)))


def _distances(closure: Closure, poses: Floats, others: Floats) -> Floats:
    """How far poses are apart, (n,): lengths relative to L, rotations as the chord of their angle."""
    offset = (poses - others)[:, :3, :]
    offset[:, :, 3] /= closure.mechanism.characteristic_length
    return np.asarray(np.sqrt((offset**2).sum(axis=(1, 2))))


def _project(
    closure: Closure, best: Closing, rest: NDArray[np.intp], start: tuple[Floats, Floats], values: Floats, seeded: bool
) -> None:
    """Feasible configurations with actuators near the asked values, for the rows `rest` of the best so far.

    The search is local, so it begins from several places: where Newton ended, where the row started, and without a
    start from random ones; the nearest is taken. The start itself, which is feasible, stands in for none at all.
    """
    ended = best.coordinates[rest], best.poses[rest]
    found = close(closure, *start, max_iterations=0)
    distance = np.full(len(rest), np.inf)
    ranged = np.isfinite(closure.loops.lo[closure.actuated]) | np.isfinite(closure.loops.hi[closure.actuated])
    n, steps = descents_within(closure, 2 if seeded else 2 + PROJECTIONS, MOST_STEPS, int(np.count_nonzero(ranged)))
    others = () if seeded else _newton_ends(closure, values)
    for coordinates, poses in islice(chain([ended, start], others), n):
        waiting = np.flatnonzero(distance > NEAR)
        if not len(waiting):
            break
        tried = nearest_actuators(closure, coordinates[waiting], poses[waiting], values[waiting], steps)
        _take_nearer(closure, found, distance, waiting, tried, values)
    waiting = np.flatnonzero(np.isinf(distance))
    if len(waiting):
        asked = _within_sight(closure, start[0][waiting], values[waiting])
        tried = nearest_actuators(closure, start[0][waiting], start[1][waiting], asked, steps)
        _take_nearer(closure, found, distance, waiting, tried, values)
    feasible = np.flatnonzero(found.feasible)
    best.put(rest[feasible], found, feasible)


def _newton_ends(closure: Closure, values: Floats) -> Iterator[tuple[Floats, Floats]]:
    """Where Newton's method leads from random starts: nearer, in fewer steps, than the search that follows."""
    for start in same_random_starts(closure, PROJECTIONS, len(values)):
        ended = _locked(closure, *start, values)
        yield ended.coordinates, ended.poses


def _take_nearer(
    closure: Closure, found: Closing, distance: Floats, rows: NDArray[np.intp], tried: Closing, values: Floats
) -> None:
    """Take over the rows that are feasible with actuators clearly nearer to the values, and how near they are."""
    errors = np.linalg.norm(actuator_errors(closure, tried.coordinates, values[rows]), axis=1)
    better = np.flatnonzero(tried.feasible & (errors < (1.0 - SAME) * distance[rows]))
    distance[rows[better]] = errors[better]
    found.put(rows[better], tried, better)


def _within_sight(closure: Closure, coordinates: Floats, values: Floats) -> Floats:
    """Values no further than a few sizes of the machine, or radians, from where they are."""
    far = SIGHT / closure.scale[closure.actuated]
    present = closure.actuators(coordinates)
    return np.asarray(np.clip(values, present - far, present + far))


def actuator_errors(closure: Closure, coordinates: Floats, values: Floats) -> Floats:
    """How far actuators are from values, (n, n_a) [L or rad]."""
    off = closure.actuators(coordinates) - values
    return np.asarray(off * closure.scale[closure.actuated])


def forward_answers(
    mechanism: Mechanism, found: Configurations, closing: Closing, values: Floats, tolerance: float
) -> Configurations:
    """Configurations as answers to actuated values (n, n_a): which are what was asked for, and which are feasible."""
    error = np.abs(actuator_errors(closure_of(mechanism), closing.coordinates, values)).max(axis=1, initial=0.0)
    found.rows.measures[:, ACTUATOR_ERROR] = error
    asked, feasible = error <= tolerance, closing.feasible
    open_or_beyond = np.where((closing.gap <= TOLERANCES.position) & asked, EXCEEDED, FAILED)
    found.rows.status[:] = np.where(feasible, np.where(asked, REACHED, PROJECTED), open_or_beyond)
    return found
