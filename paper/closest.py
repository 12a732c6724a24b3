"""The feasible pose nearest to a target, by a general optimiser: what projections are measured against."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from pfabrik import Track

from .arrays import Floats, Mask
from .feasible import Model, model_of
from .study import Tick
from .tolerances import POSITION

FEASIBLE = 1e-8
"""How far the optimiser may exceed a limit or open a loop and still count [L or rad]."""

RANDOM_STARTS = 4
"""Starts besides the answer that is judged, and home."""

SPREAD = 0.3
"""How far positions of random starts are from the answer's [L]."""


def nearest_distances(default: Track, targets: Floats, beyond: Mask, searches: int, tick: Tick) -> Floats:
    """Distance from targets beyond reach to the nearest feasible pose of their orientation that the optimiser finds.

    Parameters
    ----------
    default : the answers by default, from which the optimiser starts among others.
    searches : how many are searched at most, evenly spread.

    Returns
    -------
    array (n,) [length]; NaN where nothing is searched, or found.
    """
    steps = np.flatnonzero(beyond)
    steps = steps[np.unique(np.linspace(0, len(steps) - 1, min(searches, len(steps))).astype(int))]
    model, distances = model_of(default.mechanism), np.full(len(targets), np.nan)
    for step, x in zip(steps.tolist(), model.variables(default[steps]), strict=True):
        distances[step] = nearest_distance(model, targets[step], x)
        tick()
    return distances


def nearest_distance(model: Model, target: Floats, start: Floats) -> float:
    """Distance from a target to the nearest feasible pose of its orientation [length], by SLSQP from several starts.

    NaN where no start led to a feasible pose.
    """
    wanted = model.axes @ target[:3, 3] / model.length
    scale = max(float(np.linalg.norm(start[: len(wanted)] - wanted)), POSITION)
    best = np.nan
    for begin in _starts(model, start):
        distance = _descend(model, wanted, target[:3, :3], begin, scale)
        best = np.fmin(best, distance)
    return float(best * model.length)


def _starts(model: Model, start: Floats) -> list[Floats]:
    rng = np.random.default_rng(1)
    low, high = model.bounds.T
    scattered = rng.uniform(np.maximum(low, start - np.pi), np.minimum(high, start + np.pi), (RANDOM_STARTS, len(low)))
    near = len(model.axes)
    scattered[:, :near] = start[:near] + rng.uniform(-SPREAD, SPREAD, (RANDOM_STARTS, near))
    return [start, model.home, *scattered]


def _descend(model: Model, wanted: Floats, rotation: Floats, begin: Floats, scale: float) -> float:
    """Distance [L] that SLSQP ends at from one start; NaN if it ends outside the limits.

    The objective is the squared distance over the square of `scale`, so that its exactness is relative.
    """
    m = len(wanted)

    def objective(x: Floats) -> tuple[float, Floats]:
        gradient = np.zeros(len(x))
        gradient[:m] = 2.0 * (x[:m] - wanted) / scale**2
        return float(((x[:m] - wanted) ** 2).sum() / scale**2), gradient

    constraints = [
        {"type": "ineq", "fun": lambda x: model.slacks(x, rotation)},
        {"type": "eq", "fun": lambda x: model.gaps(x, rotation)},
    ]
    found = minimize(
        objective,
        begin,
        jac=True,
        bounds=model.bounds,
        constraints=constraints if len(model.gaps(begin, rotation)) else constraints[:1],
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-10},
    )
    exceeded = max(-model.slacks(found.x, rotation).min(), np.abs(model.gaps(found.x, rotation)).max(initial=0.0))
    return float(np.linalg.norm(found.x[:m] - wanted)) if exceeded <= FEASIBLE else float("nan")
