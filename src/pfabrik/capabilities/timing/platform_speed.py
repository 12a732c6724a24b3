"""The highest speeds of a platform at a pose, and the actuators that limit them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ...answers.differential import forward_jacobian, inverse_jacobian
from ...answers.solution import Solution, checked_solution
from ...answers.status import Status
from ...common.arrays import Floats
from ...common.printed import Printed, ResultTable, plain
from ...errors import InvalidArgument
from ...kinematics import drive_limits, internal_rates, task_of
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES

ROUNDED = 1e-12
"""Shares of limits that differ by no more differ by rounding."""


class PlatformSpeed(NamedTuple):
    """The highest speed in a direction.

    Attributes
    ----------
    kind : {"along", "about"}
        Along a direction, or about it.
    direction : tuple of float
        Unit vector (3,) in the base frame.
    speed : float
        The speed [length/s or rad/s]; 0 where the machine cannot move so, infinite where no actuator would be limited.
        Where it cannot do so without moving in what its task leaves out, that follows.
    limited_by : str
        The actuator that limits it, of a redundant machine the one that does so the most; "" where none does.
    is_slowest : bool
        True of the direction along which the reference point is slowest of all.
    """

    kind: str
    direction: tuple[float, float, float]
    speed: float
    limited_by: str
    is_slowest: bool = False


class PlatformSpeeds(Printed, tuple[PlatformSpeed, ...]):
    """The highest speeds in several directions, of one mechanism.

    Attributes
    ----------
    mechanism : Mechanism
        The machine.
    """

    mechanism: Mechanism

    def __new__(cls, mechanism: Mechanism, speeds: Iterable[PlatformSpeed]) -> PlatformSpeeds:
        new = super().__new__(cls, speeds)
        new.mechanism = mechanism
        return new

    def __getnewargs__(self) -> tuple[Mechanism, tuple[PlatformSpeed, ...]]:
        return self.mechanism, tuple(self)

    def table(self) -> ResultTable:
        """Kind and direction, the speed, and the actuator that limits it."""
        rows = []
        for motion in self:
            turns = motion.kind == "about"
            value = math.degrees(motion.speed) if turns else motion.speed
            speed = plain(value, 1e-9) if math.isfinite(value) else "unlimited"
            unit = f"{'deg' if turns else self.mechanism.length_unit}/s"
            kind = "slowest along" if motion.is_slowest else motion.kind
            rows.append((kind, *(plain(part, 1e-9) for part in motion.direction), speed, unit, motion.limited_by))
        return ResultTable(f"Platform speed of {self.mechanism.name}", (), _HEADER, rows)

    def to_dict(self) -> dict[str, Any]:
        """Every motion as plain numbers, ready for JSON; None where nothing limits its speed."""
        finite = [each.speed if math.isfinite(each.speed) else None for each in self]
        return {"speeds": [each._asdict() | {"speed": value} for each, value in zip(self, finite, strict=True)]}


_HEADER = ("", "x", "y", "z", "speed", "unit", "limited by")


def platform_speed(solution: Solution, *, speed: float | Mapping[str, float] | None = None) -> PlatformSpeeds:
    """The highest speeds of a platform along and about each axis of its task, and along the slowest direction of all.

    Axes are those of the base; of a tilt, the platform's x and y axes.

    Speeds are instantaneous, so they are equal both ways along a direction. Internal motions of a redundant machine are
    used where they help. The last direction is the one in which the reference point is slowest, of all in which the
    machine can move it without turning; it is omitted if there is none.

    Parameters
    ----------
    solution : Solution
        A single configuration.
    speed : float or mapping of str to float, optional
        Highest speed of the actuators, by name or the same for all [length/s or rad/s]; those not named have the
        `max_speed` of their joints.

    Raises
    ------
    InvalidArgument
        A batch, or no configuration; actuators without any limit.
    """
    mechanism = checked_solution(solution).mechanism
    if solution.shape:
        raise InvalidArgument("solution", f"batch shape {solution.shape}", "a single configuration")
    if solution.status == Status.INVALID:
        raise InvalidArgument("solution", "an answer that is INVALID", "one with a configuration")
    limits = drive_limits(mechanism, "speed", speed)
    if not np.isfinite(limits).any():
        raise InvalidArgument(
            "speed", f"'{mechanism.name}' without max_speed", "a limit of speed, given or in the mechanism"
        )
    inverse, forward = inverse_jacobian(solution), forward_jacobian(solution)
    sizes = np.repeat([mechanism.characteristic_length, 1.0], 3)[: inverse.shape[1]]
    twists = task_of(mechanism).twists(solution.pose)[:, : len(sizes)]
    kept = twists @ (forward / sizes[:, None])
    following = np.linalg.pinv(kept, rcond=TOLERANCES.alignment)
    shares, speeds = _Shares(internal_rates(mechanism, solution._coordinates) / limits[:, None]), []
    for twist in twists:
        rates = inverse @ twist
        if not _is_made(twist, forward @ rates, sizes):
            target_rates = twists @ (twist / sizes)
            rates = following @ target_rates
            if not _is_made(target_rates, kept @ rates, np.ones(len(target_rates))):
                rates = np.full(len(limits), np.nan)
        speeds.append(_fastest(twist, rates / limits, shares, mechanism.actuator_names))
    slowest = _slowest(_translations(inverse, forward, sizes), inverse / limits[:, None], shares)
    if slowest is not None:
        found = _fastest(slowest, inverse @ slowest / limits, shares, mechanism.actuator_names)
        speeds.append(found._replace(is_slowest=True))
    return PlatformSpeeds(solution.mechanism, speeds)


class _Shares:
    """The least share of their limits that actuators need for a motion, over all internal motions.

    By duality it is the largest weighted share over weights that are orthogonal to all internal motions and whose
    magnitudes sum to one: a linear programme, solved by the simplex method. Feasible weights do not depend on the
    motion, so each search starts from the basis of the last one; the first starts from an added actuator without limit.

    Attributes
    ----------
    motions : orthonormal internal motions, in shares of the limits, (n_a + 1, k).
    basis, signs : the actuators that have weights, and the signs of these, (k + 1,).
    """

    def __init__(self, internal: Floats) -> None:
        present = np.pad(internal, ((0, 1), (0, 0)))
        motions, sizes, _ = np.linalg.svd(present, full_matrices=False)
        self.motions = remaining = motions[:, sizes > TOLERANCES.rank * sizes.max(initial=0.0)]
        self.signs, self.basis = np.ones(remaining.shape[1] + 1), np.full(remaining.shape[1] + 1, len(internal))
        for k in range(remaining.shape[1]):
            lengths = np.linalg.norm(remaining, axis=1)
            self.basis[k] = np.argmax(lengths)
            axis = remaining[self.basis[k]] / lengths.max()
            remaining = remaining - np.outer(remaining @ axis, axis)

    def weights(self, rates: Floats) -> Floats:
        """The weights (n_a,) with the largest weighted sum of actuator rates (n_a,), in shares of the limits."""
        target, is_stuck = np.append(rates, 0.0), False
        rounded = ROUNDED * np.abs(target).max()
        while True:
            inverse = np.linalg.inv(np.column_stack([self.motions[self.basis], self.signs]))
            *moves, share = inverse @ target[self.basis]
            residual = target - self.motions @ moves
            over = np.abs(residual) - share
            over[self.basis] = -2.0 * share
            # the first where nothing is gained, of what leaves too: Bland's rule, by which no basis comes back
            enters = np.argmax(over > rounded if is_stuck else over)
            if over[enters] <= rounded:
                break
            sign = np.copysign(1.0, residual[enters])
            falls = sign * self.signs * (np.append(self.motions[enters], sign) @ inverse)
            until = np.full(len(falls), np.inf)
            np.divide(self.signs * inverse[-1], falls, out=until, where=falls > TOLERANCES.rank)
            leaving = np.flatnonzero(until <= until.min() + ROUNDED)
            leaves = leaving[np.argmin(self.basis[leaving] if is_stuck else -falls[leaving])]
            is_stuck = until.min() <= ROUNDED
            self.basis[leaves], self.signs[leaves] = enters, sign
        weights = np.zeros(len(target))
        weights[self.basis] = inverse[-1]
        return weights[:-1]


def _fastest(twist: Floats, rates: Floats, shares: _Shares, names: tuple[str, ...]) -> PlatformSpeed:
    """The highest speed along or about an axis, from actuator rates in shares of the limits; NaN if it cannot move."""
    kind = "along" if twist[:3].any() else "about"
    x, y, z = (twist[:3] if kind == "along" else twist[3:]).tolist()
    if np.isnan(rates).any():
        return PlatformSpeed(kind, (x, y, z), 0.0, "")
    weights = shares.weights(rates)
    taken = float(weights @ rates)
    if not taken > ROUNDED * np.abs(rates).max():
        return PlatformSpeed(kind, (x, y, z), np.inf, "")
    return PlatformSpeed(kind, (x, y, z), 1.0 / taken, names[np.argmax(np.abs(weights))])


def _is_made(wanted: Floats, made: Floats, sizes: Floats) -> bool:
    return bool(np.linalg.norm((made - wanted) / sizes) <= TOLERANCES.alignment * np.linalg.norm(wanted / sizes))


def _translations(inverse: Floats, forward: Floats, sizes: Floats) -> Floats:
    """The directions in which the machine moves without turning, orthonormal, (m, 3)."""
    keeps = (forward @ inverse - np.eye(len(sizes)))[:, :3] / sizes[:, None] * sizes[0]
    _, values, right = np.linalg.svd(keeps)
    return right[values <= TOLERANCES.alignment]


def _slowest(free: Floats, inverse: Floats, shares: _Shares) -> Floats | None:
    """The unit translation in the span of `free` (m, 3) that takes the largest share, as a twist; None without any.

    Shares are convex: in a cone of m directions a linear function with the same values at these is no less, nor is the
    largest of their values where it is scaled to the plane through these. The cone is halved if that is more than has
    been met.
    """
    m, rates, largest = len(free), inverse[:, :3] @ free.T, np.zeros(len(free))

    def corner(direction: Floats) -> Floats:
        """A unit vector, and the share that it takes."""
        unit = direction / np.linalg.norm(direction)
        return np.append(unit, shares.weights(rates @ unit) @ rates @ unit)

    quarters = product((1.0, -1.0), repeat=m - 1) if m else ()
    cones = [np.array([corner(axis) for axis in np.diag((1.0, *signs))]) for signs in quarters]
    while cones:
        cone = cones.pop()
        units, taken = cone[:, :-1], cone[:, -1]
        linear, across = np.linalg.solve(units, np.column_stack([taken, np.ones(m)])).T
        bound = min(np.linalg.norm(linear), taken.max() * np.linalg.norm(across))
        if bound <= (1.0 + ROUNDED) * np.linalg.norm(largest):
            continue
        largest = max(largest, shares.weights(rates @ linear) @ rates, key=np.linalg.norm)
        ends = np.unravel_index(np.argmin(units @ units.T), (m, m))
        middle = corner(units[list(ends)].sum(axis=0))
        cones += [np.where(np.arange(m)[:, None] == end, middle, cone) for end in set(ends)]
    size = np.linalg.norm(largest)
    return None if size == 0.0 else np.append(largest @ free / size, np.zeros(inverse.shape[1] - 3))
