"""Forward kinematics by passes, which the paper leaves to future work, next to Newton's method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pfabrik import Status, passes, solve_fk

from .arrays import Floats, Ints
from .efficiency import Efficiency
from .study import Tick
from .timing import median_times, one_core
from .tolerances import ASSEMBLED

MOST = 200
"""Poses of the random targets whose actuator values are answered."""


@dataclass(frozen=True)
class Forward:
    """Both methods on one machine, from home, at the actuator values of random poses.

    Attributes
    ----------
    made : passes of each row (n,).
    found, newton : how many rows end in the pose that the values were taken from; others are in another assembly mode.
    by_fallback : rows that passes did not answer.
    seconds : of a row [s], by "passes" and "newton".
    """

    key: str
    made: Ints
    found: int
    newton: int
    by_fallback: int
    seconds: dict[str, float]


def run(random: Efficiency, repeats: int, tick: Tick) -> Forward:
    """Forward kinematics of the actuator values that inverse kinematics has for random targets."""
    mechanism, known = random.case.mechanism, random.answers["default", "cold"].solution[:MOST]
    values, length = known.actuators, mechanism.characteristic_length
    by_passes, by_newton = passes.solve_fk(mechanism, values), solve_fk(mechanism, values)
    calls = {
        "passes": lambda: passes.solve_fk(mechanism, values),
        "newton": lambda: solve_fk(mechanism, values),
    }
    with one_core():
        seconds = median_times(calls, min(repeats, 5))
    tick()
    return Forward(
        key=random.case.key,
        made=np.asarray(by_passes.iterations),
        found=same(by_passes, known.pose, length),
        newton=same(by_newton, known.pose, length),
        by_fallback=int(np.sum(passes.by_fallback(by_passes))),
        seconds={name: taken / len(values) for name, taken in seconds.items()},
    )


def same(answers: Any, poses: Floats, length: float) -> int:
    """How many answers are in the poses, and are not those of a fallback."""
    off = np.abs(answers.pose - poses)
    off[:, :3, 3] /= length
    is_there = (off.max(axis=(1, 2)) <= ASSEMBLED) & (answers.status == Status.REACHED) & ~passes.by_fallback(answers)
    return int(is_there.sum())


def summary(found: Forward) -> dict[str, Any]:
    """One row."""
    return {
        "mechanism": found.key,
        "rows": len(found.made),
        "found_by_passes": found.found,
        "found_by_newton": found.newton,
        "by_fallback": found.by_fallback,
        "passes_median": float(np.median(found.made)),
        "passes_most": int(found.made.max()),
    }


def time_row(found: Forward) -> dict[str, Any]:
    """How long a row takes by either method."""
    return {"mechanism": found.key, **{f"{name}_microseconds": 1e6 * s for name, s in found.seconds.items()}}
