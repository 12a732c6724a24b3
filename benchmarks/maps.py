"""What maps of forces, stiffness and accuracy cost, next to the struts' lines in plain NumPy."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

import pfabrik as pf
from closed_forms import Array, Struts
from table import Row
from timing import best_times, draw

DOWN = np.array([0.0, 0.0, -100.0, 0.0, 0.0, 0.0])


def forces_on_lines(struts: Struts, poses: Array) -> Array:
    """Forces of struts against a weight, (n, k), from their lines."""
    arms = struts.tops @ np.swapaxes(poses[:, :3, :3], -1, -2)
    lines = arms + (poses[:, None, :3, 3] - struts.feet)
    units = lines / np.linalg.norm(lines, axis=-1, keepdims=True)
    rates = np.concatenate([units, np.cross(arms, units)], axis=-1)
    return np.asarray(-np.linalg.solve(np.swapaxes(rates, -1, -2), DOWN[:, None])[..., 0])


def maps(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """Maps over poses that are there: the answers themselves have rows of their own."""
    for name, what in (("stewart", "6-UPS"), ("delta", "delta")):
        machine = pf.load(name)
        answers = pf.solve_ik(machine, draw(machine, rng, 2 * n, 0.2, 0.2))
        answers = answers[np.flatnonzero(answers.status == pf.Status.REACHED)[:n]]
        count = len(answers)
        questions = {
            "forces": partial(pf.forces, answers, DOWN),
            "what can be held": partial(pf.wrench_capacity, answers, 500.0),
            "factors": partial(pf.transmission, answers),
            "stiffness": partial(pf.stiffness, answers, 1e4),
            "worst error": partial(pf.accuracy, answers, 1e-3),
        }
        rows = [
            Row(f"{what}, map of {question}", count, seconds / count)
            for question, seconds in zip(questions, best_times(runs, *questions.values()), strict=True)
        ]
        if name == "stewart":
            (lines,) = best_times(runs, partial(forces_on_lines, Struts(machine), answers.pose))
            rows[0] = rows[0]._replace(baseline="NumPy, lines of struts", baseline_seconds=lines / count)
        yield from rows
