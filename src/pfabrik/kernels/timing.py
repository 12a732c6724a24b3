"""Time-optimal timing of a path: splines through samples, and the fastest speed within limits.

With s along the path, q(s) the actuators, x = s'^2 and u = s'', their velocities are q' sqrt(x) and their accelerations
q' u + q'' x, linear in (x, u), as their torques are, beside those of rest; the next x is x + 2 u (step). Backward pass:
the largest x at every point from which the end can be reached; forward pass: the largest u that stays below it.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Floats
from ._jit import kernel, routine


@kernel
def second_derivatives(s: Floats, values: Floats, curves: Floats) -> None:
    """Fill the second derivatives of natural cubic splines through values (n, m) at s (n,)."""
    n, m = values.shape
    share = np.zeros(n)
    for j in range(m):
        curves[0, j] = 0.0
        share[0] = 0.0
        for i in range(1, n - 1):
            before, after = s[i] - s[i - 1], s[i + 1] - s[i]
            turn = (values[i + 1, j] - values[i, j]) / after - (values[i, j] - values[i - 1, j]) / before
            pivot = 2.0 * (before + after) - before * share[i - 1]
            share[i] = after / pivot
            curves[i, j] = (6.0 * turn - before * curves[i - 1, j]) / pivot
        curves[n - 1, j] = 0.0
        for i in range(n - 2, 0, -1):
            curves[i, j] -= share[i] * curves[i + 1, j]


@kernel
def spline_at(s: Floats, values: Floats, curves: Floats, at: Floats, order: int, derivatives: Floats) -> None:
    """Fill the derivatives (p, m) of an order, 0 to 2, of cubic splines at places (p,).

    Parameters
    ----------
    s, values, curves : of the splines, (n,) and (n, m), as `second_derivatives` has them.
    """
    k = 0
    for i in range(len(at)):
        while k < len(s) - 2 and at[i] >= s[k + 1]:
            k += 1
        while k > 0 and at[i] < s[k]:
            k -= 1
        step = s[k + 1] - s[k]
        after = (at[i] - s[k]) / step
        before = 1.0 - after
        begin, rise, bend, bend_after = 0.0, 0.0, before, after
        if order == 1:
            rise, bend, bend_after = (
                1.0 / step,
                step / 6.0 * (1.0 - 3.0 * before**2),
                step / 6.0 * (3.0 * after**2 - 1.0),
            )
        elif order == 0:
            begin, rise = 1.0, after
            bend, bend_after = step**2 / 6.0 * (before**3 - before), step**2 / 6.0 * (after**3 - after)
        for j in range(values.shape[1]):
            line = begin * values[k, j] + rise * (values[k + 1, j] - values[k, j])
            derivatives[i, j] = line + bend * curves[k, j] + bend_after * curves[k + 1, j]


@kernel
def largest_between(begin: Floats, end: Floats, rise: Floats, largest: Floats) -> None:
    """Fill the largest magnitudes of parabolas, (n, m), from begin to end, by the share of the way, of which `rise` is
    the slope at the begin."""
    for i in range(begin.shape[0]):
        for j in range(begin.shape[1]):
            a, b, slope = begin[i, j], end[i, j], rise[i, j]
            largest[i, j] = max(abs(a), abs(b))
            if slope * (2.0 * (b - a) - slope) < 0.0:
                largest[i, j] = max(largest[i, j], abs(a - 0.25 * slope**2 / (b - a - slope)))


@routine
def put_line(k: int, rate: float, curve: float, low: float, high: float, lines: Floats) -> tuple[int, float]:
    """Add low <= rate u + curve x <= high as bounds of u, lines[k] = (low, high, slope by x); the count, a bound of x.

    0 is within the bounds.
    """
    if high == math.inf and low == -math.inf:
        return k, math.inf
    if abs(rate) * 1e12 <= abs(curve) or rate == 0.0:
        return k, (high if curve > 0.0 else low) / curve if curve != 0.0 else math.inf
    lines[k, 0] = low / rate if rate > 0.0 else high / rate
    lines[k, 1] = high / rate if rate > 0.0 else low / rate
    lines[k, 2] = -curve / rate
    return k + 1, math.inf


@routine
def put_lines(
    i: int, step: float, slopes: Floats, curves: Floats, low: Floats, high: Floats, lines: Floats
) -> tuple[int, float]:
    """Fill the bounds of u from point i to the next, at both ends; their number, and the largest x they allow."""
    count, largest = 0, math.inf
    for j in range(low.shape[1]):
        count, bound = put_line(count, slopes[i, j], curves[i, j], low[i, j], high[i, j], lines)
        largest = min(largest, bound)
        ahead = slopes[i + 1, j] + 2.0 * step * curves[i + 1, j]
        count, bound = put_line(count, ahead, curves[i + 1, j], low[i + 1, j], high[i + 1, j], lines)
        largest = min(largest, bound)
    return count, largest


@kernel
def fastest(
    s: Floats, slopes: Floats, curves: Floats, low: Floats, high: Floats, caps: Floats, at_rest: bool, x: Floats
) -> None:
    """Fill the largest squared speeds x (n,) along s (n,).

    Parameters
    ----------
    slopes, curves : of what is limited, by u and by x, (n, m): first and second derivatives of the actuators by s.
    low, high : its bounds, (n, m), 0 between them; infinite without a limit.
    caps : largest x by the velocity limits, (n,).
    at_rest : True if the path begins and ends at rest.
    """
    n = s.shape[0]
    reach, lines = np.zeros(n), np.zeros((2 * low.shape[1] + 1, 3))
    reach[n - 1] = 0.0 if at_rest else caps[n - 1]
    for i in range(n - 2, -1, -1):
        step = s[i + 1] - s[i]
        count, bound = put_lines(i, step, slopes, curves, low, high, lines)
        largest, before = min(caps[i], bound), math.inf
        # what brings x to the next point: - x <= 2 step u <= reach - x
        lines[count, 0], lines[count, 1], lines[count, 2] = 0.0, reach[i + 1] / (2.0 * step), -0.5 / step
        # Newton's method: the highest lower and the lowest upper bound of u meet at the next x, until they leave one
        while largest < before:
            before, below, above = largest, 0, 0
            for a in range(1, count + 1):
                if lines[a, 0] + lines[a, 2] * largest > lines[below, 0] + lines[below, 2] * largest:
                    below = a
                if lines[a, 1] + lines[a, 2] * largest < lines[above, 1] + lines[above, 2] * largest:
                    above = a
            slope, room = lines[below, 2] - lines[above, 2], lines[above, 1] - lines[below, 0]
            if slope * largest > room:
                largest = room / slope
        reach[i] = largest
    x[0] = 0.0 if at_rest else reach[0]
    for i in range(n - 1):
        step = s[i + 1] - s[i]
        count, _ = put_lines(i, step, slopes, curves, low, high, lines)
        u = (reach[i + 1] - x[i]) / (2.0 * step)
        for a in range(count):
            u = min(u, lines[a, 1] + lines[a, 2] * x[i])
        x[i + 1] = min(max(x[i] + 2.0 * step * u, 0.0), reach[i + 1])
