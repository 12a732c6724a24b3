"""Forward kinematics: from actuator values to the configuration that has them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .answers.differential import mobility
from .answers.solution import Solution
from .closure.close import Closing, Closure, close, closure_of, platform_poses
from .closure.nearest import is_feasible, nearest
from .closure.starts import same_random_starts
from .decomposition.plan import flat_of
from .description.mechanism import Mechanism, checked_mechanism
from .errors import InvalidArgument
from .ik import checked, seed_rows
from .kernels.reaching import plan as P
from .options import Options
from .poses import as_floats
from .reaching.completion import actuators_of, coordinates_of, positions_of, set_actuators
from .reaching.locked import reached_with_locked_legs
from .reaching.rows import new_rows
from .tolerances import TOLERANCES

Floats = NDArray[np.float64]

STRIDES = 8
"""Steps in which actuators are taken from the seed's values to the asked ones where one step strays."""

STARTS = 48
"""Random starts where nothing else assembles and no seed says in which mode to stay."""

SAME = 1e-3
"""Share by which distances or gaps may differ and still count as the same: those of mirror images are."""

NEAR = 1e-6
"""Actuators this near to the asked values need no search from elsewhere for nearer ones [L or rad]."""

PROJECTIONS = 12
"""Random starts of the search for feasible values near those that no configuration has."""

HORIZON = 1e100
"""Values beyond this count as there while a search goes on: their squares are still numbers [length or rad]."""

SIGHT = 3.0
"""How far off asked values are at most looked for, where they are too far for a search to end [L or rad]."""


def solve_fk(
    mechanism: Mechanism, actuators: Any, *, seed: Solution | None = None, options: Options | None = None
) -> Solution:
    """The pose of the end effector, and all joints, at given actuator values.

    Newton's method closes the loops from the seed with the actuators locked. Where it strays, the actuators are led to
    their values in steps, then the reaching engine assembles the legs with the actuators locked; without a seed other
    starts follow. The assembly mode is the seed's wherever the first two succeed: see `assembly_modes` for all.

    Parameters
    ----------
    actuators : actuated coordinates (..., n_a) in the order of `mechanism.actuators` [length or rad].
    seed : an answer to start from, single or one for each row. Default: home.
    options : of these, `actuator_tolerance` and `on_invalid`.

    Returns
    -------
    Solution : REACHED, assembled at these values within every limit; or PROJECTED, where no such configuration is
        found: a feasible one whose actuators are as near as a local search brings them, by least squares (lengths
        relative to L, angles in rad). `actuator_error` is the largest difference; more actuators than freedoms
        disagree by as much. FAILED where not even that is found: pose and residual are those of the attempt.

    Raises
    ------
    InvalidArgument : values of the wrong shape or, unless marked, not finite; a seed that does not fit.
    """
    options = checked(mechanism, options)
    values, shape = as_values(mechanism, actuators)
    known = np.asarray(np.isfinite(values).all(axis=1))
    if options.on_invalid == "raise" and not known.all():
        bad = np.flatnonzero(~known)[:5].tolist() if shape else ()
        raise InvalidArgument("actuators", "a value that is not finite", "finite values", rows=bad)
    coordinates, poses = _starts(mechanism, seed, shape, len(values))
    asked = np.clip(values[known], -HORIZON, HORIZON)
    closing = _assemble(mechanism, coordinates[known], poses[known], asked, seeded=seed is not None)
    return _as_solution(mechanism, closing, values, known, shape, options.actuator_tolerance)


def answered(mechanism: Mechanism, coordinates: Floats, values: Floats) -> Solution:
    """Joint coordinates (n, columns) as the answer to actuated values (n, n_a): measured, not changed."""
    closing = close(closure_of(mechanism), coordinates, platform_poses(mechanism, coordinates), max_iterations=0)
    return _as_solution(mechanism, closing, values, np.ones(len(values), bool), (len(values),), TOLERANCES.position)


def as_values(mechanism: Mechanism, actuators: Any) -> tuple[Floats, tuple[int, ...]]:
    """Actuated values (n, n_a), and the batch shape they came in."""
    n = len(checked_mechanism(mechanism).actuators)
    expected = f"shape (..., {n}): {', '.join(mechanism.actuators)}"
    array = as_floats("actuators", actuators, expected)
    if array.shape[-1:] != (n,):
        raise InvalidArgument("actuators", f"shape {array.shape}", expected)
    return array.reshape(-1, n), array.shape[:-1]


def _starts(mechanism: Mechanism, seed: Solution | None, shape: tuple[int, ...], n: int) -> tuple[Floats, Floats]:
    """Coordinates (n, columns) and platform poses (n, 4, 4) where the rows start."""
    if seed is None:
        start = np.zeros((1, len(closure_of(mechanism).scale)))
        poses = mechanism.home_pose[None]
    else:
        poses = seed_rows(mechanism, seed, shape).poses
        start = seed._coordinates
        if mechanism.end_effector_is_joint:
            poses = platform_poses(mechanism, start)
    if len(start) == n:
        return start.copy(), poses.copy()
    return np.repeat(start, n, axis=0), np.repeat(poses, n, axis=0)


def _assemble(mechanism: Mechanism, coordinates: Floats, poses: Floats, values: Floats, seeded: bool) -> Closing:
    """Close the loops at the asked values, or as near to them as can be."""
    closure = closure_of(mechanism)
    best = _locked(closure, coordinates, poses, values)
    if not is_feasible(best).all():
        attempts = [] if _over_determined(mechanism) else [_led, _reached]
        for attempt in attempts if seeded else [*attempts, _scattered]:
            rest = np.flatnonzero(~is_feasible(best))
            if len(rest):
                _improve(best, rest, attempt(closure, coordinates[rest], poses[rest], values[rest]))
    rest = np.flatnonzero(~is_feasible(best))
    if len(rest):
        _project(closure, best, rest, (coordinates[rest], poses[rest]), values[rest], seeded)
    return best


def _over_determined(mechanism: Mechanism) -> bool:
    """Whether there are more actuators than motions: then most values contradict each other."""
    counted = mobility(mechanism)
    return counted.actuators > counted.mobility - counted.idle


def _locked(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Newton's method with the actuators locked."""
    start = coordinates.copy()
    set_actuators(closure.mechanism, start, values)
    return close(closure, start, poses, locked=frozenset(closure.mechanism.actuators))


def _led(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """The actuators led from where they are to the asked values."""
    begin = actuators_of(closure.mechanism, coordinates)
    for stride in range(1, STRIDES + 1):
        found = _locked(closure, coordinates, poses, begin + (values - begin) * stride / STRIDES)
        coordinates, poses = found.coordinates, found.poses
    return found


def _reached(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Legs of locked length, assembled by the reaching engine around the platform of the start."""
    mechanism = closure.mechanism
    rows = reached_with_locked_legs(mechanism, coordinates, poses, values)
    if rows is not None:
        coordinates = coordinates_of(mechanism, rows)
        poses = rows.poses if not mechanism.end_effector_is_joint else platform_poses(mechanism, coordinates)
    return _locked(closure, coordinates, poses, values)


def _scattered(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Random starts; of each row's answers the best: the least open, of equals the nearest to where the row started."""
    best = _locked(closure, coordinates, poses, values)
    off, from_start = _off(best), _distances(closure, best.poses, poses)
    for start in same_random_starts(closure, STARTS, len(values)):
        tried = _locked(closure, *start, values)
        tried_off, distance = _off(tried), _distances(closure, tried.poses, poses)
        equal = np.abs(tried_off - off) <= SAME * off
        better = np.flatnonzero(np.where(equal, distance < from_start, tried_off < off))
        off[better], from_start[better] = tried_off[better], distance[better]
        _take(best, better, tried, better)
    return best


def _off(closing: Closing) -> Floats:
    """What keeps rows from being feasible, (n,) [L or rad]; the least tolerance where nothing does."""
    least = min(TOLERANCES.position, TOLERANCES.limit)
    return np.maximum(np.maximum(closing.gap, closing.excess), least)


def _distances(closure: Closure, poses: Floats, others: Floats) -> Floats:
    """How far poses are apart, (n,): lengths relative to L, rotations as the chord of their angle."""
    offset = (poses - others)[:, :3, :]
    offset[:, :, 3] /= closure.mechanism.characteristic_length
    return np.asarray(np.sqrt((offset**2).sum(axis=(1, 2))))


def _improve(best: Closing, rest: NDArray[np.intp], tried: Closing) -> None:
    """Take over the rows that are feasible, or are less open."""
    is_open = best.gap[rest] > TOLERANCES.position
    better = np.flatnonzero(is_feasible(tried) | (is_open & (tried.gap < best.gap[rest])))
    _take(best, rest[better], tried, better)


def _take(best: Closing, places: NDArray[np.intp], found: Closing, rows: NDArray[np.intp]) -> None:
    for array, own in zip(best, found, strict=True):
        array[places] = own[rows]


def _project(
    closure: Closure, best: Closing, rest: NDArray[np.intp], start: tuple[Floats, Floats], values: Floats, seeded: bool
) -> None:
    """Feasible configurations with actuators near the asked values, for the rows `rest` of the best so far.

    The search is local, so it begins from several places: where Newton ended, where the row started, and without a
    seed from random ones; the nearest is taken. The start itself, which is feasible, stands in for none at all.
    """
    ended = best.coordinates[rest], best.poses[rest]
    found = close(closure, *start, max_iterations=0)
    distance = np.full(len(rest), np.inf)
    others = () if seeded else _newton_ends(closure, values)
    for coordinates, poses in chain([ended, start], others):
        waiting = np.flatnonzero(distance > NEAR)
        if not len(waiting):
            break
        tried = _nearest_actuators(closure, coordinates[waiting], poses[waiting], values[waiting])
        _take_nearer(closure, found, distance, waiting, tried, values)
    waiting = np.flatnonzero(np.isinf(distance))
    if len(waiting):
        asked = _within_sight(closure, start[0][waiting], values[waiting])
        tried = _nearest_actuators(closure, start[0][waiting], start[1][waiting], asked)
        _take_nearer(closure, found, distance, waiting, tried, values)
    feasible = np.flatnonzero(is_feasible(found))
    _take(best, rest[feasible], found, feasible)


def _newton_ends(closure: Closure, values: Floats) -> Iterator[tuple[Floats, Floats]]:
    """Where Newton's method leads from random starts: nearer, in fewer steps, than the search that follows."""
    for start in same_random_starts(closure, PROJECTIONS, len(values)):
        ended = _locked(closure, *start, values)
        yield ended.coordinates, ended.poses


def _take_nearer(
    closure: Closure, found: Closing, distance: Floats, rows: NDArray[np.intp], tried: Closing, values: Floats
) -> None:
    """Take over the rows that are feasible with actuators clearly nearer to the values, and how near they are."""
    errors = np.linalg.norm(_actuator_errors(closure, tried.coordinates, values[rows]), axis=1)
    better = np.flatnonzero(is_feasible(tried) & (errors < (1.0 - SAME) * distance[rows]))
    distance[rows[better]] = errors[better]
    _take(found, rows[better], tried, better)


def _nearest_actuators(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Feasible configurations whose actuators differ least from the values, by least squares; a local search."""
    anchors = coordinates.copy()
    set_actuators(closure.mechanism, anchors, values)
    weights = np.zeros(len(closure.scale))
    weights[closure.actuated] = 1.0
    return nearest(closure, anchors, poses, weights=weights, anchors=anchors)


def _within_sight(closure: Closure, coordinates: Floats, values: Floats) -> Floats:
    """Values no further than a few sizes of the machine, or radians, from where they are."""
    far = SIGHT / closure.scale[closure.actuated]
    present = actuators_of(closure.mechanism, coordinates)
    return np.asarray(np.clip(values, present - far, present + far))


def _actuator_errors(closure: Closure, coordinates: Floats, values: Floats) -> Floats:
    """How far actuators are from values, (n, n_a) [L or rad]."""
    off = actuators_of(closure.mechanism, coordinates) - values
    return np.asarray(off * closure.scale[closure.actuated])


def _as_solution(
    mechanism: Mechanism,
    closing: Closing,
    values: Floats,
    known: NDArray[np.bool_],
    shape: tuple[int, ...],
    tolerance: float,
) -> Solution:
    """Wrap what was found for the values that are known; the other rows are INVALID, and NaN."""
    flat = flat_of(mechanism)
    rows = new_rows(mechanism, flat, len(values))
    coordinates = np.full((len(values), len(closure_of(mechanism).scale)), np.nan)
    for array in (rows.poses, rows.nodes, rows.trunks, rows.actuators, rows.measures):
        array[:] = np.nan
    rows.status[:], rows.counters[:] = P.INVALID, 0
    own = P.Rows._make(array[known] for array in rows)
    _fill(mechanism, closing, values[known], tolerance, own)
    if flat is not None:
        positions_of(mechanism, flat, closing.coordinates, own)
    for array, part in zip((*rows, coordinates), (*own, closing.coordinates), strict=True):
        array[known] = part
    return Solution(mechanism, rows, shape, lambda: coordinates)


def _fill(mechanism: Mechanism, closing: Closing, values: Floats, tolerance: float, rows: P.Rows) -> None:
    """Write answers with what was measured of them."""
    rows.counters[:, 0] = closing.iterations
    rows.poses[:] = closing.poses
    if mechanism.end_effector_is_joint:
        rows.poses[:, :3, :3] = np.eye(3)
    rows.actuators[:] = actuators_of(mechanism, closing.coordinates)
    rows.measures[:, :2] = 0.0
    rows.measures[:, 2] = closing.gap * mechanism.characteristic_length
    rows.measures[:, 3] = np.maximum(closing.excess, 0.0)
    error = _actuator_errors(closure_of(mechanism), closing.coordinates, values)
    rows.measures[:, 4] = np.abs(error).max(axis=1, initial=0.0)
    asked = rows.measures[:, 4] <= tolerance
    closed = closing.gap <= TOLERANCES.position
    rows.status[:] = np.where(closed & asked, P.EXCEEDED, P.FAILED)
    rows.status[is_feasible(closing)] = P.PROJECTED
    rows.status[is_feasible(closing) & asked] = P.REACHED
