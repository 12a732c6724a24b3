"""Volumes of cells cut by half-spaces."""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine
from .affine_forms import BELOW, CENTRE

# Slope, as a share of the largest, below which one counts as part of the remainder: the volume divides by all of them.
FLAT = 1e-4
# Error of a volume by rounding, as a share of its cell's.
ROUNDED = 1e-9


@routine
def share_above(row: Floats, n: int, bound: int) -> float:
    """Share of a cell where the linear part of a row, plus one of its bounds, is positive; rounded to that side.

    Of the unit cube, {sum w_i u_i <= t} has the volume sum (-1)^|S| max(t - w(S), 0)^m / (m! prod w), over all sets S
    of axes.
    """
    side = -1.0 if bound == BELOW else 1.0
    total, largest = row[CENTRE] + row[bound], 0.0
    if not abs(total) < math.inf:
        return 1.0 if total > 0.0 else 0.0
    for i in range(n):
        largest = max(largest, abs(row[i]))
    first, second, third = 0.0, 0.0, 0.0  # the widths of up to three slopes; 0 if there are fewer
    for i in range(n):
        width = abs(row[i])
        if width <= FLAT * largest or third > 0.0:
            total += side * width
        elif first == 0.0:
            first = width
        elif second == 0.0:
            second = width
        else:
            third = width
    span = first + second + third
    if total >= span:
        return 1.0
    if total <= -span:
        return 0.0
    t = 0.5 * (total + span)
    if second == 0.0:
        volume = t / first
    elif third == 0.0:
        volume = (square(t) - square(t - first) - square(t - second) + square(t - span)) / (2.0 * first * second)
    else:
        volume = cube(t) - cube(t - first) - cube(t - second) - cube(t - third) - cube(t - span)
        volume += cube(t - first - second) + cube(t - first - third) + cube(t - second - third)
        volume /= 6.0 * first * second * third
    return min(max(volume + side * ROUNDED, 0.0), 1.0)


@routine
def square(t: float) -> float:
    """t^2 if t is positive, else 0."""
    return t * t if t > 0.0 else 0.0


@routine
def cube(t: float) -> float:
    """t^3 if t is positive, else 0."""
    return t * t * t if t > 0.0 else 0.0
