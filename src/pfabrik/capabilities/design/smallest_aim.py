"""The smallest aim with all rows at least 0, at the poses that are looked at."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats

STEP = 1e-6
"""Step of differences by dimensions, as a share of their bounds."""

FAR = 0.5
"""Rows above this at the start of a search are left out of it, until its end breaks them."""

KEPT = 1e-7
"""Least value of a row that counts as kept, below 0."""

NEAR = 1e-5
"""Rows up to this bind where they have a multiplier."""

MOST_STEPS = 100
"""Steps of one search."""


class Found(NamedTuple):
    """The end of a search.

    Attributes
    ----------
    z : dimensions as shares of their bounds, (p,).
    aim : its value; violation : the largest of a row, 0 where all are kept.
    """

    z: Floats
    aim: float
    violation: float


Function = Callable[[Floats], Any]


def slopes(function: Function, z: Floats) -> Floats:
    """Differences within the bounds, (..., p)."""
    columns, value = [], function(z)
    for k in range(len(z)):
        moved = z.copy()
        moved[k] += STEP if z[k] < 0.5 else -STEP
        columns.append((function(moved) - value) / (moved[k] - z[k]))
    return np.asarray(np.nan_to_num(np.stack(columns, axis=-1), nan=0.0, posinf=0.0, neginf=0.0))


def smallest(aim: Function, rows: Function, z: Floats) -> Found:
    """The smallest aim near a start; where rows contradict, the least violation near there."""
    found = _searched(aim, rows, z)
    if found.violation <= KEPT:
        return found
    found = _least_violation(aim, rows, found.z)
    return _searched(aim, rows, found.z) if found.violation <= KEPT else found


def _searched(aim: Function, rows: Function, z: Floats) -> Found:
    return _ended(aim, rows, _slsqp(aim, lambda x: slopes(aim, x), rows, lambda x: slopes(rows, x), z))


def _least_violation(aim: Function, rows: Function, z: Floats) -> Found:
    """The least t with all rows at least -t."""
    unit = np.append(np.zeros(len(z)), 1.0)

    def eased(x: Floats) -> Floats:
        return np.asarray(rows(x[:-1]) + x[-1])

    def eased_slopes(x: Floats) -> Floats:
        own = slopes(rows, x[:-1])
        return np.concatenate([own, np.ones((len(own), 1))], axis=1)

    start = np.append(z, max(0.0, -rows(z).min(initial=0.0)))
    return _ended(aim, rows, _slsqp(lambda x: x[-1], lambda x: unit, eased, eased_slopes, start)[:-1])


def _slsqp(aim: Function, aim_slopes: Function, rows: Function, row_slopes: Function, x: Floats) -> Floats:
    """Where a search ends, whose numbers stay where the aim and the rows are: within 0 to 1, above that if x is."""
    from scipy.optimize import minimize

    high = np.where(x > 1.0, np.inf, 1.0)
    chosen = rows(x) < FAR
    while True:
        used = np.flatnonzero(chosen)
        constraint = {
            "type": "ineq",
            "fun": lambda x, used=used: rows(x)[used],
            "jac": lambda x, used=used: row_slopes(x)[used],
        }
        with np.errstate(all="ignore"):
            ended: Any = minimize(
                lambda x: float(aim(x)),
                x,
                jac=aim_slopes,
                bounds=np.stack([np.zeros(len(x)), high], axis=1),
                constraints=[constraint] if len(used) else [],
                method="SLSQP",
                options={"maxiter": MOST_STEPS, "ftol": 1e-9},
            )
        x = np.clip(np.nan_to_num(ended.x, nan=0.5), 0.0, high)
        missed = ~chosen & (rows(x) < -KEPT)
        if not missed.any():
            return x
        chosen |= rows(x) < FAR


def _ended(aim: Function, rows: Function, z: Floats) -> Found:
    return Found(z, float(aim(z)), max(0.0, -float(rows(z).min(initial=0.0))))


class Multipliers(NamedTuple):
    """Lagrange multipliers of rows and bounds at a point.

    Attributes
    ----------
    rows : of each row, (m,); low, high : of the bounds, (p,).
    """

    rows: Floats
    low: Floats
    high: Floats


def multipliers(aim: Function | None, rows: Function, z: Floats, near: float) -> Multipliers:
    """Multipliers of the rows below `near`, and of bounds; without an aim, of the largest violation.

    With slopes g of the aim and G of the rows, g = G' l + bounds for l >= 0, in least squares; of a violation, whose
    slope by itself is 1, the shares l sum up to 1.
    """
    from scipy.optimize import nnls

    values, n = rows(z), len(z)
    close = np.flatnonzero(values <= near)
    own = slopes(rows, z)[close].T
    at_low, at_high = np.flatnonzero(z <= KEPT), np.flatnonzero(z >= 1.0 - KEPT)
    columns = np.concatenate([own, np.eye(n)[:, at_low], -np.eye(n)[:, at_high]], axis=1)
    wanted = np.zeros(n) if aim is None else slopes(aim, z)
    if aim is None:
        sums = np.concatenate([np.ones(len(close)), np.zeros(len(at_low) + len(at_high))])
        columns, wanted = np.vstack([columns, sums]), np.append(wanted, 1.0)
    shares = np.zeros(columns.shape[1])
    if columns.shape[1]:
        shares = nnls(columns, wanted)[0]
    found = Multipliers(np.zeros(len(values)), np.zeros(n), np.zeros(n))
    found.rows[close], rest = shares[: len(close)], shares[len(close) :]
    found.low[at_low], found.high[at_high] = rest[: len(at_low)], rest[len(at_low) :]
    return found


def spread(count: int, p: int, rng: np.random.Generator) -> Floats:
    """Points spread over the unit cube, (count, p): of each coordinate one in every share of it (Latin hypercube)."""
    order = np.stack([rng.permutation(count) for _ in range(p)], axis=1)
    return np.asarray((order + rng.random((count, p))) / count)
