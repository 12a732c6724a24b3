"""How fast a platform may move at a pose, and which actuator limits it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..answers.differential import forward_jacobian, inverse_jacobian
from ..answers.solution import Solution, checked_solution
from ..arrays import Floats, Ints
from ..description.task import task_of
from ..errors import InvalidArgument
from ..motion.displacements import rate_units
from ..motion.first_order import actuated_columns, first_order, right_singular
from ..motion.mobility import generic_of
from ..tolerances import TOLERANCES
from .time_path import limits_of


class PlatformSpeed(NamedTuple):
    """The highest speed in a direction.

    Attributes
    ----------
    kind : "along" or "about".
    direction : unit vector (3,) in the base frame.
    speed : [length/s or rad/s]; 0 where the machine cannot move so, infinite where no actuator would be limited. Where
        it cannot do so without moving in what its task leaves out, that follows.
    limited_by : the actuator that limits it, of a redundant machine the one that does so the most; "" where none does.
    """

    kind: str
    direction: tuple[float, float, float]
    speed: float
    limited_by: str


def platform_speed(
    solution: Solution, *, speed: float | Mapping[str, float] | None = None
) -> tuple[PlatformSpeed, ...]:
    """The highest speeds of a platform along and about each axis of its task, and along the slowest direction of all.

    Axes are those of the base; of a tilt, the platform's x and y axes.

    They are those of the present moment: both ways along a direction they are the same. Internal motions of a redundant
    machine help where they can. The last one is the direction
    in which the reference point is slowest of all that the machine can move it in without turning; it is left out
    where there is none.

    Parameters
    ----------
    solution : a single configuration.
    speed : highest of the actuators, by name or the same for all [length/s or rad/s]; those not named have the
        `max_speed` of their joints.

    Raises
    ------
    InvalidArgument : a batch; actuators without any limit.
    """
    mechanism = checked_solution(solution).mechanism
    if solution.shape:
        raise InvalidArgument("solution", f"batch shape {solution.shape}", "a single configuration")
    limits = limits_of(mechanism, "speed", speed)
    if not np.isfinite(limits).any():
        raise InvalidArgument("speed", f"'{mechanism.name}' without max_speed", "a limit: in the mechanism, or speed")
    inverse, forward = inverse_jacobian(solution), forward_jacobian(solution)
    sizes = np.repeat([mechanism.characteristic_length, 1.0], 3)[: inverse.shape[1]]
    twists = _twists(solution)[:, : len(sizes)]
    kept = twists @ (forward / sizes[:, None])
    following = np.linalg.pinv(kept, rcond=TOLERANCES.alignment)
    shares, found = _shares(_internal_rates(solution), limits), []
    for twist in twists:
        rates = inverse @ twist
        if not _is_made(twist, forward @ rates, sizes):
            wanted = twists @ (twist / sizes)
            rates = following @ wanted
            if not _is_made(wanted, kept @ rates, np.ones(len(wanted))):
                rates = np.full(len(limits), np.nan)
        found.append(_fastest(twist, rates, shares, mechanism.actuator_names))
    slowest = _slowest(inverse, forward, sizes, shares)
    if slowest is not None:
        found.append(_fastest(slowest, inverse @ slowest, shares, mechanism.actuator_names))
    return tuple(found)


def _twists(solution: Solution) -> Floats:
    """The motions that a task sets, unit vectors (m, 6), each along or about one axis."""
    task = task_of(solution.mechanism)
    lines, turns = np.eye(3)[list(task.axes)], task.turning_axes(solution.pose)
    return np.block([[lines, np.zeros((len(lines), 3))], [np.zeros((len(turns), 3)), turns]])


def _internal_rates(solution: Solution) -> Floats:
    """Rates of the actuators in internal motions, (n_a, k)."""
    mechanism, generic = solution.mechanism, generic_of(solution.mechanism)
    closure, twist = first_order(mechanism, solution._coordinates)
    motions = right_singular(closure)[1][0, generic.rank :].T
    still = motions @ right_singular(twist @ motions)[1][0, generic.mobility.platform :].T
    actuated = actuated_columns(mechanism)
    rates = np.linalg.svd(still[actuated])[0][:, : generic.mobility.internal]
    return np.asarray(rates * rate_units(mechanism)[actuated, None])


class _Shares(NamedTuple):
    """How much of their limits rates take, whatever internal motions go with them: the most of |rows @ rates|.

    Attributes
    ----------
    rows : (rows, n_a).
    hardest : which actuator counts most in each row, (rows,).
    """

    rows: Floats
    hardest: Ints


def _shares(internal: Floats, limits: Floats) -> _Shares:
    """The shares of limits (n_a,) beside internal motions (n_a, k).

    Without internal motions a row is one actuator. Else it is a mean of k + 1 that none of them changes: where each of
    these takes as much as the mean does, none can take less but for another that takes more.
    """
    limited = np.flatnonzero(np.isfinite(limits))
    present = internal[limited] / limits[limited, None]
    k = int(np.linalg.matrix_rank(present, TOLERANCES.rank * np.abs(present).max(initial=0.0))) if present.size else 0
    which = np.array(list(combinations(range(len(limited)), k + 1)), np.intp).reshape(-1, k + 1)
    weights = np.linalg.svd(present[which])[0][:, :, -1] if k else np.ones(which.shape)
    weights /= np.abs(weights).sum(axis=1, keepdims=True)
    rows = np.zeros((len(which), len(limits)))
    np.put_along_axis(rows, limited[which], weights / limits[limited[which]], axis=1)
    return _Shares(rows, limited[which[np.arange(len(which)), np.abs(weights).argmax(axis=1)]])


def _fastest(twist: Floats, rates: Floats, shares: _Shares, names: tuple[str, ...]) -> PlatformSpeed:
    """The highest speed along or about an axis, by the rates of the actuators that it asks for; NaN for none."""
    kind = "along" if twist[:3].any() else "about"
    x, y, z = (twist[:3] if kind == "along" else twist[3:]).tolist()
    if np.isnan(rates).any():
        return PlatformSpeed(kind, (x, y, z), 0.0, "")
    taken = np.abs(shares.rows @ rates)
    if not taken.max(initial=0.0) > 0.0:
        return PlatformSpeed(kind, (x, y, z), np.inf, "")
    place = int(np.argmax(taken))
    return PlatformSpeed(kind, (x, y, z), float(1.0 / taken[place]), names[int(shares.hardest[place])])


def _is_made(wanted: Floats, made: Floats, sizes: Floats) -> bool:
    return bool(np.linalg.norm((made - wanted) / sizes) <= TOLERANCES.alignment * np.linalg.norm(wanted / sizes))


def _slowest(inverse: Floats, forward: Floats, sizes: Floats, shares: _Shares) -> Floats | None:
    """The translation at which some actuator meets its limit first, among those that the machine makes."""
    keeps = (forward @ inverse - np.eye(len(sizes)))[:, :3] / sizes[:, None] * sizes[0]
    _, values, right = np.linalg.svd(keeps)
    free = right[values <= TOLERANCES.alignment]
    if not len(free):
        return None
    rows = shares.rows @ inverse[:, :3] @ free.T
    direction = rows[np.argmax(np.linalg.norm(rows, axis=1))] @ free
    size = np.linalg.norm(direction)
    return None if size == 0.0 else np.concatenate([direction / size, np.zeros(len(sizes) - 3)])
