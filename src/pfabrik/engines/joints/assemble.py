"""Forward kinematics on joint coordinates: loops closed at given actuator values, or at the nearest feasible ones."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...common.batch import put, take
from ...common.derived import derived
from ...kernels.joints.joint_constants import ASSEMBLY_STARTS, LONGEST_SEARCH, NEAR_VALUES, NOISE, PROJECTIONS, SAME_GAP
from ...kernels.rows import ACTUATOR_ERROR, EXCEEDED, FAILED, PROJECTED, REACHED
from ...kernels.search_constants import BELIEVED, MOST_STEPS
from ...machine.motion.loops import Closure
from ...machine.motion.mobility import generic_of
from ...tolerances import TOLERANCES
from .close import CLOSED, Closing, close, platform_poses
from .configurations import Configurations
from .descend import nearest_actuators
from .effort import continued, descents_within
from .multistart import same_random_starts

TANGENT, NOTHING = 1e-4, 1e-6
"""Part of the way whose closing is the motion's tangent; way of the passive joints that may be left whatever it is."""


def assemble(
    closure: Closure, coordinates: Floats, values: Floats, *, has_start: bool, keep_mode: bool = True
) -> Closing:
    """Close the loops at actuated values (n, n_a), or at the nearest feasible values that a local search finds.

    First Newton's method with the actuators locked, then continuation of the actuators to their values, in the assembly
    mode of the start; without a start, in any mode, then random starts; then the nearest feasible values.

    Parameters
    ----------
    coordinates : joint coordinates of the start, (n, columns), deviations from home.
    has_start : the start was given, and is not home. Other starts, home first, then only replace a projection.
    keep_mode : stay in the assembly mode of the start; values to which it does not lead are answered on the way.
        Readings of more actuators than freedoms, which fit nowhere else, are looked for everywhere.

    Returns
    -------
    Closing : judge by `feasible`, and by `actuator_errors`.
    """
    poses = platform_poses(closure.mechanism, coordinates)
    best = _locked(closure, coordinates, poses, values, stays=True)
    unsolved = np.flatnonzero(best.gap > CLOSED)
    if len(unsolved):
        lead = _locked if is_over_determined(closure) else _continue_to
        put(best, unsolved, lead(closure, coordinates[unsolved], poses[unsolved], values[unsolved]))
    unsolved = np.flatnonzero(~best.feasible)
    if len(unsolved) and not has_start and (not keep_mode or is_over_determined(closure)):
        solutions = _from_random_starts(closure, coordinates[unsolved], poses[unsolved], values[unsolved])
        best.put_better(unsolved, solutions)
        unsolved = np.flatnonzero(~best.feasible)
    if not len(unsolved):
        return best
    is_over, last = is_over_determined(closure), take(best, unsolved)
    stays = keep_mode and not is_over
    was_open = best.gap[unsolved] > CLOSED
    begin = coordinates[unsolved], poses[unsolved]
    _project(closure, best, unsolved, begin, values[unsolved], has_start or stays)
    errors = np.abs(actuator_errors(closure, best.coordinates[unsolved], values[unsolved])).max(axis=1, initial=0.0)
    if stays:  # values that assemble after all do so in another mode
        elsewhere = np.flatnonzero(errors <= NEAR_VALUES)
        for on_the_way in (close(closure, *begin, max_iterations=0), last):
            on_the_way.gaps[:] = close(closure, on_the_way.coordinates, on_the_way.poses, max_iterations=0).gaps
            kept = elsewhere[on_the_way.feasible[elsewhere]]
            put(best, unsolved[kept], on_the_way, kept)
    elif has_start:
        near = NOISE if is_over else NEAR_VALUES
        missed = unsolved[was_open & ((errors > near) | ~best.feasible[unsolved])]
        if len(missed):
            _assemble_elsewhere(closure, best, missed, poses[missed], values[missed])
    return best


def nearest_values(closure: Closure, coordinates: Floats, values: Floats, *, has_start: bool) -> Closing:
    """Configurations at the feasible values nearest to (n, n_a) that searches find; arguments as of `assemble`."""
    poses = platform_poses(closure.mechanism, coordinates)
    best = _locked(closure, coordinates, poses, values)
    _project(closure, best, np.arange(len(values)), (coordinates, poses), values, has_start)
    return best


def _assemble_elsewhere(closure: Closure, best: Closing, rows: NDArray[np.intp], poses: Floats, values: Floats) -> None:
    """Assemble rows from home, or from random starts, nearest to their poses (n, 4, 4), and leave rows that fail."""
    home = np.zeros_like(best.coordinates[rows]), np.repeat(closure.mechanism.home_pose[None], len(rows), axis=0)
    solutions = _locked(closure, *home, values)
    unsolved = np.flatnonzero(~solutions.feasible)
    if len(unsolved):
        scattered = _from_random_starts(closure, home[0][unsolved], poses[unsolved], values[unsolved])
        solutions.put_better(unsolved, scattered)
    reached = np.flatnonzero(solutions.feasible)
    put(best, rows[reached], solutions, reached)


@derived
def is_over_determined(closure: Closure) -> bool:
    """True if there are more actuators than motions, so that most values contradict each other; False without loops."""
    if len(closure.loops.paths) <= 2:
        return False
    counted = generic_of(closure.mechanism).mobility
    return counted.actuators > counted.mobility - counted.idle


def _locked(closure: Closure, coordinates: Floats, poses: Floats, values: Floats, *, stays: bool = False) -> Closing:
    """Close the loops by Newton's method with the actuators locked at values (n, n_a); `stays` as of `_follow`."""
    if stays:
        return _follow(closure, coordinates, poses, values)
    start = coordinates.copy()
    closure.put_actuators(start, values)
    return close(closure, start, poses, locked=closure.driven)


def _follow(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Close the loops where the actuators lead from a start (n, columns) to values (n, n_a); else gaps are infinite.

    The passive joints go along the motion's tangent at the start, which Newton's method finds from a small part of the
    way. Then its steps must contract, and undo no more than a share of the tangent: `BELIEVED`.
    """
    start = coordinates.copy()
    closure.put_actuators(start, values)
    change = start - coordinates
    part = coordinates + TANGENT * change
    begun = close(closure, part, poses, locked=closure.driven, stays=True, max_iterations=1)
    tangent = np.where(np.isfinite(begun.coordinates), (begun.coordinates - coordinates) / TANGENT, 0.0)
    tangent[:, list(closure.driven)] = change[:, list(closure.driven)]
    predicted = coordinates + tangent
    closing = close(closure, predicted, platform_poses(closure.mechanism, predicted), locked=closure.driven, stays=True)
    passive = np.ones(closure.scale.shape, bool)
    passive[list(closure.driven)] = False
    size, left = (
        np.linalg.norm((each * closure.scale)[:, passive], axis=1)
        for each in (tangent, closing.coordinates - predicted)
    )
    closing.gaps[~(left <= BELIEVED * np.maximum(size, NOTHING))] = np.inf
    return closing


def _continue_to(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Lead the actuators from their present values to (n, n_a), in steps that halve where Newton's does not contract.

    Rows whose assembly mode a parallel singularity ends have the last configuration on the way, and infinite gaps.
    """
    begin, present = closure.actuators(coordinates), close(closure, coordinates, poses, max_iterations=0)

    def advance(rows: NDArray[np.intp], shares: Floats) -> Mask:
        wanted = begin[rows] + (values - begin)[rows] * shares[:, None]
        trial = _locked(closure, present.coordinates[rows], present.poses[rows], wanted, stays=True)
        is_closed = np.asarray(trial.gap <= CLOSED)
        put(present, rows[is_closed], trial, is_closed)
        return is_closed

    present.gaps[continued(len(values), advance) < 1.0] = np.inf
    return present


def _from_random_starts(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """The best of several random starts for each row: the least infeasible, of equals the nearest to its start."""
    best = _locked(closure, coordinates, poses, values)
    least, nearest = _infeasibility(best), _distances(closure, best.poses, poses)
    for start in same_random_starts(closure, ASSEMBLY_STARTS, len(values)):
        trial = _locked(closure, *start, values)
        infeasibility, distances = _infeasibility(trial), _distances(closure, trial.poses, poses)
        is_equal = np.abs(infeasibility - least) <= SAME_GAP * least
        better = np.flatnonzero(np.where(is_equal, distances < nearest, infeasibility < least))
        least[better], nearest[better] = infeasibility[better], distances[better]
        put(best, better, trial, better)
    return best


def _infeasibility(closing: Closing) -> Floats:
    """Largest gap or excess of each row, (n,) [L or rad], at least the smaller of the two tolerances."""
    return np.asarray(np.maximum(closing.off.max(axis=1), min(TOLERANCES.position, TOLERANCES.limit)))


def _distances(closure: Closure, poses: Floats, other_poses: Floats) -> Floats:
    """Distances between poses, (n,): lengths relative to L, rotations as the chord of their angle."""
    offset = (poses - other_poses)[:, :3, :]
    offset[:, :, 3] /= closure.mechanism.characteristic_length
    return np.asarray(np.sqrt((offset**2).sum(axis=(1, 2))))


def _project(
    closure: Closure,
    best: Closing,
    rows: NDArray[np.intp],
    start: tuple[Floats, Floats],
    values: Floats,
    has_start: bool,
) -> None:
    """Put the feasible configurations with actuators nearest to the target values into some rows of the best so far.

    The search is local, so it starts from several configurations: the end of Newton's method, the start of the row,
    and without a given start random ones; the nearest result is taken. The fallback is the start, which is feasible.
    """
    newton_end = best.coordinates[rows], best.poses[rows]
    solutions = close(closure, *start, max_iterations=0)
    distances = np.full(len(rows), np.inf)
    ranged = np.isfinite(closure.loops.lo[closure.actuated]) | np.isfinite(closure.loops.hi[closure.actuated])
    n, steps = descents_within(closure, 2 if has_start else 2 + PROJECTIONS, MOST_STEPS, int(np.count_nonzero(ranged)))
    random_ends = () if has_start else _newton_ends(closure, values)
    for coordinates, poses in islice(chain([newton_end, start], random_ends), n):
        pending = np.flatnonzero(distances > NEAR_VALUES)
        if not len(pending):
            break
        trial = nearest_actuators(closure, coordinates[pending], poses[pending], values[pending], steps)
        _put_nearer(closure, solutions, distances, pending, trial, values)
    pending = np.flatnonzero(np.isinf(distances))
    if len(pending):
        clipped = _clip_values(closure, start[0][pending], values[pending])
        trial = nearest_actuators(closure, start[0][pending], start[1][pending], clipped, steps)
        _put_nearer(closure, solutions, distances, pending, trial, values)
    feasible = np.flatnonzero(solutions.feasible)
    put(best, rows[feasible], solutions, feasible)


def _newton_ends(closure: Closure, values: Floats) -> Iterator[tuple[Floats, Floats]]:
    """Coordinates and poses where Newton's method ends from random starts: in fewer steps than the search after it."""
    for start in same_random_starts(closure, PROJECTIONS, len(values)):
        closing = _locked(closure, *start, values)
        yield closing.coordinates, closing.poses


def _put_nearer(
    closure: Closure, best: Closing, distances: Floats, rows: NDArray[np.intp], trial: Closing, values: Floats
) -> None:
    """Put the rows of a trial that are feasible with actuators clearly nearer to the values, and their distances."""
    errors = np.linalg.norm(actuator_errors(closure, trial.coordinates, values[rows]), axis=1)
    better = np.flatnonzero(trial.feasible & (errors < (1.0 - SAME_GAP) * distances[rows]))
    distances[rows[better]] = errors[better]
    put(best, rows[better], trial, better)


def _clip_values(closure: Closure, coordinates: Floats, values: Floats) -> Floats:
    """Actuated values (n, n_a), clipped to within `LONGEST_SEARCH` of the present ones."""
    most = LONGEST_SEARCH / closure.scale[closure.actuated]
    present = closure.actuators(coordinates)
    return np.asarray(np.clip(values, present - most, present + most))


def actuator_errors(closure: Closure, coordinates: Floats, values: Floats) -> Floats:
    """Actuated coordinates less target values, (n, n_a) [L or rad]."""
    errors = closure.actuators(coordinates) - values
    return np.asarray(errors * closure.scale[closure.actuated])


def forward_answers(
    closure: Closure, configurations: Configurations, closing: Closing, values: Floats, tolerance: float
) -> Configurations:
    """Set status and actuator error of configurations that answer actuated values (n, n_a); the same object."""
    error = np.abs(actuator_errors(closure, closing.coordinates, values)).max(axis=1, initial=0.0)
    configurations.rows.measures[:, ACTUATOR_ERROR] = error
    has_values, feasible = error <= tolerance, (closing.gap <= CLOSED) & configurations.is_within_limits
    infeasible_status = np.where((closing.gap <= TOLERANCES.position) & has_values, EXCEEDED, FAILED)
    configurations.rows.status[:] = np.where(feasible, np.where(has_values, REACHED, PROJECTED), infeasible_status)
    return configurations
