"""What to bear in mind of the motion that a path with times makes: how it starts, and what its digits add to it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...answers.tracked import Track
from ...common.arrays import Floats
from ...errors import counted
from ...kinematics import actuator_units
from .asked_motion import NEIGHBOURS
from .drives import drives_of
from .moving_rows import MovingRows

MOVES = 0.02
"""Share of the fastest rate from which a path is in motion where it starts or ends: less is what a polynomial makes of
a rest."""

MOST_DIGITS, LATTICE = 8, 1e-3
"""Decimals of positions that are looked for, at most; and by what they may be off such places, by the last digit."""

LEAST_ROWS = 12
"""Rows from which digits can be told."""

LIKE_ROUNDING = (0.3, 3.0)
"""Size of fourth differences, by that which rounding makes, within which they are taken for rounding."""

TOLD = 0.02
"""Share of the largest effort from which the part of rounding is told."""


def path_notes(rows: MovingRows, efforts: Floats) -> Iterator[str]:
    """Sentences on the motion of a path with times, whose actuators exert `efforts` (n, n_a)."""
    if rows.at != "path" or rows.rates is None or not isinstance(rows.solution, Track):
        return
    units = actuator_units(rows.solution.mechanism)
    sizes = np.abs(rows.rates[:, -len(units) :] / units).max(axis=1)
    shares = {"starts": sizes[0] / max(sizes.max(), np.finfo(float).tiny)}
    shares["ends"] = sizes[-1] / max(sizes.max(), np.finfo(float).tiny)
    moving = [f"{name} at {share:.0%} of its fastest rate" for name, share in shares.items() if share > MOVES]
    if moving:
        yield (
            f"the path {' and '.join(moving)}, by polynomials through {NEIGHBOURS} steps: to start and end at rest it "
            "needs shorter steps there, or a limit to time it by"
        )
    yield from _of_digits(rows, efforts)


def _of_digits(rows: MovingRows, efforts: Floats) -> Iterator[str]:
    """The sentence on what the digits of positions add to efforts."""
    track = rows.solution
    assert isinstance(track, Track)
    times, digits = track.times, digits_of(track.targets[:, :3, 3])
    if digits is None or times is None or rows.gains is None:
        return
    k = min(NEIGHBOURS, len(times))
    step, late = float(np.median(np.diff(times))), np.arange(k) - k // 2
    curving = 2.0 * np.linalg.norm(np.linalg.inv(late[:, None] ** np.arange(k))[2]) / step**2
    noise = 2.0 * curving * 10.0**-digits / np.sqrt(12.0)
    exerted = noise * _of_accelerations(rows, len(times) // 2)
    place = int(exerted.argmax())
    if exerted[place] > TOLD * np.nanmax(np.abs(efforts), initial=0.0):
        unit = drives_of(track.mechanism).forces[place]
        yield (
            f"the digits of this path make ±{exerted[place]:.2g} {unit} of that: its positions have "
            f"{counted(digits, 'decimal')}, and are {step:.3g} s apart"
        )


def _of_accelerations(rows: MovingRows, row: int) -> Floats:
    """What each actuator exerts by an acceleration of 1 of the reference point, in any direction, at a row, (n_a,)."""
    gains = np.zeros((4, 6))
    gains[1:, :3] = np.eye(3)
    solution = rows.solution[np.full(4, row)]
    found = replace(
        rows, solution=solution, at="task", rates=np.zeros((4, 6)), gains=gains, times=None, still=None
    ).efforts()
    return np.asarray(np.linalg.norm(found.actuators[1:] - found.actuators[0], axis=0))


def digits_of(positions: Floats) -> int | None:
    """The decimals of positions (n, 3) whose last digit is rounded; None where no digit is, or that does not show."""
    apart = positions - positions[:1]
    varies = np.ptp(apart, axis=0) > 0.0
    if len(positions) < LEAST_ROWS or not varies.any():
        return None
    fourth = np.diff(apart[:, varies], 4, axis=0)
    for digits in range(MOST_DIGITS + 1):
        places = apart * 10.0**digits
        if np.abs(places - np.round(places)).max() <= LATTICE:
            size = np.sqrt(np.mean(fourth**2)) * 10.0**digits / np.sqrt(70.0 / 12.0)
            return digits if LIKE_ROUNDING[0] < size < LIKE_ROUNDING[1] else None
    return None
