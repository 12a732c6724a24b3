"""The smallest sphere around points, in plain Python, which `kernels.home` compiles.

At most four of the points carry the sphere. Starting from one point, the farthest point outside joins the carriers,
and the smallest sphere around them is found among all their subsets with it, until no point is outside. The radius
grows in every round, so no set of carriers returns.

Points are numbers in a row, three for each; a sphere is its centre and its radius.
"""

from __future__ import annotations

import math
import sys
from typing import Any

ROUNDING = 64 * sys.float_info.epsilon
"""How far outside a sphere a point may lie and count as on it [radius]: what a handful of operations round off."""

MOST_CARRIERS = 4
N_PLACES = 14
"""Integers of scratch: up to five candidates, the chosen among them, the best choice yet and its number."""
CHOSEN, BEST, N_BEST = 5, 9, 13


def distance(cloud: Any, i: int, sphere: Any) -> float:
    """The distance of a point from the centre of a sphere."""
    x, y, z = cloud[3 * i] - sphere[0], cloud[3 * i + 1] - sphere[1], cloud[3 * i + 2] - sphere[2]
    return math.sqrt(x * x + y * y + z * z)


def circumscribe(cloud: Any, places: Any, count: int, sphere: Any) -> bool:
    """The smallest sphere through the chosen points, two to four; False if there is none.

    With a, b, c from the first point to the others, the centre is from there at a / 2, or at
    (|b|^2 n x a + |a|^2 b x n) / (2 n . n) with n = a x b, or at
    (|a|^2 b x c + |b|^2 c x a + |c|^2 a x b) / (2 a . b x c).
    """
    o, p = 3 * places[CHOSEN], 3 * places[CHOSEN + 1]
    a0, a1, a2 = cloud[p] - cloud[o], cloud[p + 1] - cloud[o + 1], cloud[p + 2] - cloud[o + 2]
    if count == 2:
        x, y, z = 0.5 * a0, 0.5 * a1, 0.5 * a2
    else:
        p = 3 * places[CHOSEN + 2]
        b0, b1, b2 = cloud[p] - cloud[o], cloud[p + 1] - cloud[o + 1], cloud[p + 2] - cloud[o + 2]
        n0, n1, n2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
        aa, bb = a0 * a0 + a1 * a1 + a2 * a2, b0 * b0 + b1 * b1 + b2 * b2
        if count == 3:
            over = 2.0 * (n0 * n0 + n1 * n1 + n2 * n2)
            x = bb * (n1 * a2 - n2 * a1) + aa * (b1 * n2 - b2 * n1)
            y = bb * (n2 * a0 - n0 * a2) + aa * (b2 * n0 - b0 * n2)
            z = bb * (n0 * a1 - n1 * a0) + aa * (b0 * n1 - b1 * n0)
        else:
            p = 3 * places[CHOSEN + 3]
            c0, c1, c2 = cloud[p] - cloud[o], cloud[p + 1] - cloud[o + 1], cloud[p + 2] - cloud[o + 2]
            cc, over = c0 * c0 + c1 * c1 + c2 * c2, 2.0 * (c0 * n0 + c1 * n1 + c2 * n2)
            x = aa * (b1 * c2 - b2 * c1) + bb * (c1 * a2 - c2 * a1) + cc * n0
            y = aa * (b2 * c0 - b0 * c2) + bb * (c2 * a0 - c0 * a2) + cc * n1
            z = aa * (b0 * c1 - b1 * c0) + bb * (c0 * a1 - c1 * a0) + cc * n2
        if over == 0.0:
            return False
        x, y, z = x / over, y / over, z / over
    sphere[0], sphere[1], sphere[2] = cloud[o] + x, cloud[o + 1] + y, cloud[o + 2] + z
    sphere[3] = math.sqrt(x * x + y * y + z * z)
    return math.isfinite(sphere[3])


def enclose_candidates(cloud: Any, places: Any, count: int, sphere: Any, best: Any) -> None:
    """The smallest sphere around at most five points, the last of which it goes through."""
    best[3] = math.inf
    for chosen in range(1, 2 ** (count - 1)):
        n = 0
        for k in range(count - 1):
            if chosen >> k & 1 and n < MOST_CARRIERS:
                places[CHOSEN + n] = places[k]
                n += 1
        if n == MOST_CARRIERS:
            continue
        places[CHOSEN + n] = places[count - 1]
        if not circumscribe(cloud, places, n + 1, sphere):
            continue
        reach = 0.0
        for k in range(count):
            reach = max(reach, distance(cloud, places[k], sphere))
        if reach <= sphere[3] * (1.0 + ROUNDING) and sphere[3] < best[3]:
            for k in range(4):
                best[k], places[BEST + k] = sphere[k], places[CHOSEN + k]
            places[N_BEST] = n + 1


def enclose(cloud: Any, n_points: int, places: Any, sphere: Any, best: Any) -> float:
    """The radius of the smallest sphere around points whose coordinates are at most 1."""
    places[0], count = 0, 1
    for k in range(3):
        sphere[k] = cloud[k]
    radius = 0.0
    while True:
        farthest, reach = 0, -1.0
        for i in range(n_points):
            away = distance(cloud, i, sphere)
            if away > reach:
                farthest, reach = i, away
        if reach <= radius * (1.0 + ROUNDING):
            return radius
        places[count] = farthest
        enclose_candidates(cloud, places, count + 1, sphere, best)
        if not radius < best[3] < math.inf:  # rounding is all that is left to gain
            return reach
        radius, count = best[3], places[N_BEST]
        for k in range(count):
            places[k] = places[BEST + k]
        for k in range(3):
            sphere[k] = best[k]


def enclosing_radius(points: Any, n_points: int, cloud: Any, places: Any, sphere: Any, best: Any) -> float:
    """The radius of the smallest sphere around points; 0 for none, or coincident ones.

    Parameters
    ----------
    cloud, places, sphere, best : scratch: 3 `n_points`, `N_PLACES`, 4 and 4 numbers.
    """
    size = 0.0
    for i in range(3 * n_points):
        cloud[i] = points[i] - points[i % 3]
        size = max(size, abs(cloud[i]))
    if size == 0.0:
        return 0.0
    for i in range(3 * n_points):
        cloud[i] = cloud[i] / size
    return size * enclose(cloud, n_points, places, sphere, best)
