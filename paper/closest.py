"""The feasible pose nearest to a target, by exact projection and by a general optimiser: what the paper's projection
is measured against.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from pfabrik import Solution, Status, Track

from .arrays import Floats
from .feasible import Model, model_of
from .study import Tick
from .tolerances import POSITION, ROTATION

FEASIBLE = 1e-8
"""How far the optimiser may exceed a limit or open a loop and still count [L or rad]."""

RANDOM_STARTS = 4
"""Starts besides the answer that is judged, and home."""

SPREAD = 0.3
"""How far positions of random starts are from the answer's [L]."""


class Comparison(NamedTuple):
    """One projected step, and how far from its target poses of the target's orientation are [length].

    Attributes
    ----------
    distance : of the answer.
    exact : of the answer by exact projection; NaN if it gives up the orientation.
    accelerated : the same of the projection by half-spaces.
    searched : of the nearest feasible pose that the optimiser finds; NaN if it finds none.
    """

    step: int
    distance: float
    exact: float
    accelerated: float
    searched: float

    @property
    def nearest(self) -> float:
        """Distance of the nearest feasible pose found in either way."""
        return float(np.fmin(self.exact, self.searched))


def compare(
    targets: Floats, solution: Track, exact: Solution, accelerated: Solution, searches: int, tick: Tick
) -> list[Comparison]:
    """Projected answers, in three ways, next to the nearest feasible poses of the same orientation.

    Left out are answers that gave up the target's orientation.
    """
    held = (np.asarray(solution.status) == Status.PROJECTED) & (solution.rotation_error <= ROTATION)
    steps = np.flatnonzero(held)
    steps = steps[np.unique(np.linspace(0, len(steps) - 1, min(searches, len(steps))).astype(int))]
    nearest, by_half_spaces = (
        np.where(each.rotation_error <= ROTATION, each.position_error, np.nan) for each in (exact, accelerated)
    )
    model, found = model_of(solution.mechanism), []
    for step, x in zip(steps.tolist(), model.variables(solution[steps]), strict=True):
        searched = nearest_distance(model, targets[step], x)
        distance, exactly = float(solution.position_error[step]), float(nearest[step])
        found.append(Comparison(step, distance, exactly, float(by_half_spaces[step]), searched))
        tick()
    return found


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
