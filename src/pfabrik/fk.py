"""Forward kinematics: from actuator values to the configuration that has them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .answers.solution import Solution, Status
from .answers.starts import Start, start_of
from .closure.close import Closing, Closure, close, closure_of, measured, platform_poses
from .closure.configurations import Configurations, joint_coordinates
from .closure.nearest import is_feasible, nearest
from .closure.starts import same_random_starts
from .description.mechanism import Mechanism, checked_mechanism
from .engine import engine_of
from .errors import InvalidArgument, UnknownName
from .motion.first_order import generic_of
from .options import Options, checked_options
from .poses import as_floats
from .tolerances import TOLERANCES

Floats = NDArray[np.float64]

Actuators: TypeAlias = ArrayLike | Mapping[str, ArrayLike]
"""Actuated coordinates (..., n_a) in the order of `mechanism.actuator_names`, or joint name -> values (...,)."""

STRIDES = 8
"""Steps in which actuators are taken from the start's values to the asked ones where one step strays."""

STARTS = 48
"""Random starts where nothing else assembles and no start says in which mode to stay."""

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
    mechanism: Mechanism, actuators: Actuators, *, start: Start | None = None, options: Options | None = None
) -> Solution:
    """The pose of the end effector, and all joints, at given actuator values.

    Newton's method closes the loops from the start with the actuators locked. Where it strays, the actuators are led to
    their values in steps, then the reaching engine assembles the legs with the actuators locked; without a start other
    starts follow. The assembly mode is the start's wherever the first two succeed: see `assembly_modes` for all.

    Parameters
    ----------
    actuators : actuated coordinates (..., n_a) in the order of `mechanism.actuator_names` [length or rad]; or joint
        name -> its values (...,), for every actuator.
    start : a Solution or joint vector q to start from, single or one for each row. Default: home.
    options : of these, `actuator_tolerance` and `on_invalid`.

    Returns
    -------
    Solution : REACHED, assembled at these values within every limit; or PROJECTED, where no such configuration is
        found: a feasible one whose actuators are as near as a local search brings them, by least squares (lengths
        relative to L, angles in rad). `actuator_error` is the largest difference; more actuators than freedoms
        disagree by as much. FAILED where not even that is found: pose and residual are those of the attempt.

    Raises
    ------
    InvalidArgument : values of the wrong shape or, unless marked, not finite; a start that does not fit.
    """
    options = checked_options(options)
    values, shape = as_values(mechanism, actuators)
    known = np.asarray(np.isfinite(values).all(axis=1))
    if options.on_invalid == "raise" and not known.all():
        bad = np.flatnonzero(~known)[:5].tolist() if shape else ()
        raise InvalidArgument("actuators", "a value that is not finite", "finite values", rows=bad)
    begin = start_of(mechanism, start, shape)
    coordinates = np.repeat(joint_coordinates(mechanism, begin), 1 if begin and len(begin) > 1 else len(values), axis=0)
    asked = np.clip(values[known], -HORIZON, HORIZON)
    closing = _assemble(mechanism, coordinates[known], asked, seeded=start is not None)
    found = _judged(mechanism, closing, values[known], options.actuator_tolerance)
    return Solution(mechanism, found.among(known), shape)


def assembled(mechanism: Mechanism, coordinates: Floats, values: Floats) -> Solution:
    """Joint coordinates (n, columns) as the answer to actuated values (n, n_a): measured, not changed."""
    found = _judged(mechanism, measured(mechanism, coordinates), values, TOLERANCES.position)
    return Solution(mechanism, found, (len(values),))


def as_values(mechanism: Mechanism, actuators: Actuators) -> tuple[Floats, tuple[int, ...]]:
    """Actuated values (n, n_a), and the batch shape they came in."""
    names = checked_mechanism(mechanism).actuator_names
    expected = f"shape (..., {len(names)}): {', '.join(names)}"
    if isinstance(actuators, Mapping):
        actuators = _by_name(names, actuators)
    array = as_floats("actuators", actuators, expected)
    if array.shape[-1:] != (len(names),):
        raise InvalidArgument("actuators", f"shape {array.shape}", expected)
    return array.reshape(-1, len(names)), array.shape[:-1]


def _by_name(names: Sequence[str], actuators: Mapping[str, ArrayLike]) -> Floats:
    """Values (..., n_a) from values by name; each name once, all of them, of shapes that agree."""
    for name in actuators:
        if name not in names:
            raise UnknownName("actuator", name, names)
    missing = [name for name in names if name not in actuators]
    if missing:
        raise InvalidArgument("actuators", f"no value of {', '.join(missing)}", f"one for each of {', '.join(names)}")
    values = [as_floats(f"actuators['{name}']", actuators[name], "values of shape (...)") for name in names]
    try:
        return np.stack(np.broadcast_arrays(*values), axis=-1)
    except ValueError:
        found = f"shapes {', '.join(str(value.shape) for value in values)}"
        raise InvalidArgument("actuators", found, "shapes that agree") from None


def _assemble(mechanism: Mechanism, coordinates: Floats, values: Floats, seeded: bool) -> Closing:
    """Close the loops at the asked values, or as near to them as can be."""
    closure, poses = closure_of(mechanism), platform_poses(mechanism, coordinates)
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
    counted = generic_of(mechanism).mobility
    return counted.actuators > counted.mobility - counted.idle


def _locked(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Newton's method with the actuators locked."""
    start = coordinates.copy()
    closure.put_actuators(start, values)
    return close(closure, start, poses, locked=frozenset(closure.mechanism.actuator_names))


def _led(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """The actuators led from where they are to the asked values."""
    begin = closure.actuators(coordinates)
    for stride in range(1, STRIDES + 1):
        found = _locked(closure, coordinates, poses, begin + (values - begin) * stride / STRIDES)
        coordinates, poses = found.coordinates, found.poses
    return found


def _reached(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Legs of locked length, assembled in positions around the platform of the start, where these express them."""
    assembled = engine_of(closure.mechanism).assemble(coordinates, poses, values)
    return _locked(closure, *(assembled or (coordinates, poses)), values)


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
        best.take(better, tried, better)
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
    best.take(rest[better], tried, better)


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
    best.take(rest[feasible], found, feasible)


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
    found.take(rows[better], tried, better)


def _nearest_actuators(closure: Closure, coordinates: Floats, poses: Floats, values: Floats) -> Closing:
    """Feasible configurations whose actuators differ least from the values, by least squares; a local search."""
    anchors = coordinates.copy()
    closure.put_actuators(anchors, values)
    weights = np.zeros(len(closure.scale))
    weights[closure.actuated] = 1.0
    return nearest(closure, anchors, poses, weights=weights, anchors=anchors)


def _within_sight(closure: Closure, coordinates: Floats, values: Floats) -> Floats:
    """Values no further than a few sizes of the machine, or radians, from where they are."""
    far = SIGHT / closure.scale[closure.actuated]
    present = closure.actuators(coordinates)
    return np.asarray(np.clip(values, present - far, present + far))


def _actuator_errors(closure: Closure, coordinates: Floats, values: Floats) -> Floats:
    """How far actuators are from values, (n, n_a) [L or rad]."""
    off = closure.actuators(coordinates) - values
    return np.asarray(off * closure.scale[closure.actuated])


def _judged(mechanism: Mechanism, closing: Closing, values: Floats, tolerance: float) -> Configurations:
    """Configurations as answers to actuated values (n, n_a): which are what was asked for, and which are feasible."""
    found = engine_of(mechanism).at(closing)
    error = np.abs(_actuator_errors(closure_of(mechanism), closing.coordinates, values)).max(axis=1, initial=0.0)
    found.rows.measures[:, 4] = error
    asked, feasible = error <= tolerance, is_feasible(closing)
    open_or_beyond = np.where((closing.gap <= TOLERANCES.position) & asked, Status.EXCEEDED, Status.FAILED)
    found.rows.status[:] = np.where(feasible, np.where(asked, Status.REACHED, Status.PROJECTED), open_or_beyond)
    return found
