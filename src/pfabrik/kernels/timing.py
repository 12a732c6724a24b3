"""Time-optimal timing of a path: splines through samples, and the fastest speed within limits.

With s along the path, q(s) the actuators, x = s'^2 and u = s'', their velocities are q' sqrt(x) and their accelerations
q' u + q'' x, linear in (x, u), as their torques are, beside those of rest; the next x is x + 2 u (step). Backward pass:
the largest x at every point from which the end can be reached; forward pass: the largest u that stays below it.
"""

from __future__ import annotations

import math

import numpy as np

from ..common.arrays import Floats
from ._jit import inlined, kernel, routine


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


@inlined
def largest_between(begin: float, end: float, rise: float) -> float:
    """The largest magnitude of a parabola, of which `rise` is the slope at the begin, by the share of the way."""
    largest, bend = max(abs(begin), abs(end)), end - begin - rise
    if rise * (2.0 * bend + rise) < 0.0:
        largest = max(largest, abs(begin - 0.25 * rise * rise / bend))
    return largest


@kernel
def speed_shares(s: Floats, slopes: Floats, bends: Floats, speeds: Floats, platform: float, shares: Floats) -> None:
    """Fill the largest share of any speed's limit between each two of n points at s' = 1, (n - 1,).

    Parameters
    ----------
    slopes, bends : of actuators and reference point, (n, m).
    speeds, platform : limits of the actuators and of the reference point.
    """
    for i in range(len(s) - 1):
        square, shares[i] = 0.0, 0.0
        for j in range(slopes.shape[1]):
            largest = largest_between(slopes[i, j], slopes[i + 1, j], bends[i, j] * (s[i + 1] - s[i]))
            if j < len(speeds):
                shares[i] = max(shares[i], largest / speeds[j])
            else:
                square += largest**2
        shares[i] = max(shares[i], math.sqrt(square) / platform)


@kernel
def acceleration_shares(s: Floats, x: Floats, slopes: Floats, bends: Floats, most: Floats, shares: Floats) -> None:
    """Fill the largest share of any acceleration's limit, most (m,), between each two of n points, (n - 1,).

    There s'' is even and the actuators' third derivatives are, so that accelerations are parabolas in s.
    """
    for i in range(len(s) - 1):
        step, shares[i] = s[i + 1] - s[i], 0.0
        push = (x[i + 1] - x[i]) / (2.0 * step)
        for j in range(len(most)):
            begin, end = slopes[i, j] * push + bends[i, j] * x[i], slopes[i + 1, j] * push + bends[i + 1, j] * x[i + 1]
            rise = (bends[i + 1, j] - bends[i, j]) * x[i] + 3.0 * step * bends[i, j] * push
            shares[i] = max(shares[i], largest_between(begin, end, rise) / most[j])


@routine
def put_line(k: int, rate: float, curve: float, low: float, high: float, lines: Floats) -> tuple[int, float]:
    """Add low <= rate u + curve x <= high as bounds of u, lines[k] = (low, high, slope by x); the count, a bound of x.

    0 is within the bounds.
    """
    if high == math.inf and low == -math.inf:
        return k, math.inf
    if abs(rate) * 1e12 <= abs(curve) or rate == 0.0:
        return k, (high if curve > 0.0 else low) / curve if curve != 0.0 else math.inf
    share = 1.0 / rate
    lines[k, 0], lines[k, 1] = (low * share, high * share) if rate > 0.0 else (high * share, low * share)
    lines[k, 2] = -curve * share
    return k + 1, math.inf


@routine
def put_lines(
    i: int, step: float, slopes: Floats, curves: Floats, most: Floats, held: Floats, lines: Floats
) -> tuple[int, float]:
    """Fill the bounds of u from point i to the next, at both ends; their number, and the largest x they allow."""
    count, largest = 0, math.inf
    for j in range(most.shape[1]):
        for k in (i, i + 1):
            rate = slopes[k, j] + 2.0 * step * (k - i) * curves[k, j]
            low, high = min(-most[k, j] - held[k, j], 0.0), max(most[k, j] - held[k, j], 0.0)
            count, bound = put_line(count, rate, curves[k, j], low, high, lines)
            largest = min(largest, bound)
    return count, largest


@kernel
def fastest(
    s: Floats, slopes: Floats, curves: Floats, most: Floats, held: Floats, caps: Floats, at_rest: bool, x: Floats
) -> None:
    """Fill the largest squared speeds x (n,) along s (n,).

    Parameters
    ----------
    slopes, curves : of what is limited, by u and by x, (n, m): first and second derivatives of the actuators by s.
    most, held : its limits, infinite without one, and how much of them is taken at rest, (n, m).
    caps : largest x by the velocity limits, (n,).
    at_rest : True if the path begins and ends at rest.
    """
    n = s.shape[0]
    reach, lines = np.zeros(n), np.zeros((2 * most.shape[1] + 1, 3))
    reach[n - 1] = 0.0 if at_rest else caps[n - 1]
    for i in range(n - 2, -1, -1):
        step = s[i + 1] - s[i]
        count, bound = put_lines(i, step, slopes, curves, most, held, lines)
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
        count, _ = put_lines(i, step, slopes, curves, most, held, lines)
        u = (reach[i + 1] - x[i]) / (2.0 * step)
        for a in range(count):
            u = min(u, lines[a, 1] + lines[a, 2] * x[i])
        x[i + 1] = min(max(x[i] + 2.0 * step * u, 0.0), reach[i + 1])
