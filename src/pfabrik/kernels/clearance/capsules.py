"""The least distance between capsules and spheres: axes against axes, in closed form, for rows of poses at once."""

from __future__ import annotations

from ...arrays import Floats, Ints
from .._jit import inlined, kernel, routine
from ..vectors import Vec
from .link_records import BASE, PLATFORM
from .segments import between_axes


@kernel
def place_ends(home: Floats, bodies: Ints, poses: Floats, ends: Floats) -> None:
    """Fill the ends of the axes of capsules that are on the base or the platform.

    Parameters
    ----------
    home : ends of their axes, (s, 2, 3) [length], of a sphere twice the same: of those on the platform from its
        reference point, along its axes.
    bodies : that the ends are on, (s, 2): BASE, PLATFORM or others.
    poses : of the platform, (n, 4, 4) [length].
    ends : ends of the axes, (s, 6, n) [length]; those on other bodies are left.
    """
    for i in range(bodies.shape[0]):
        for e in range(2):
            if bodies[i, e] == PLATFORM or bodies[i, e] == BASE:
                place_end(home[i, e], bodies[i, e], poses, ends[i, 3 * e : 3 * e + 3])


@kernel
def capsule_clearance(rounds: Floats, ends: Floats, pairs: Ints, clearances: Floats, nearest: Floats) -> None:
    """Lower the least clearances of poses by those of pairs of capsules.

    Parameters
    ----------
    rounds : radii, (s,) [length].
    ends : ends of their axes, (s, 6, n) [length], of a sphere twice the same.
    pairs : two capsules each, (k, 2).
    clearances, nearest : least clearances so far, infinite at first, and the places of the pairs that have them, (n,).
    """
    for k in range(pairs.shape[0]):
        one, other, size = ends[pairs[k, 0]], ends[pairs[k, 1]], rounds[pairs[k, 0]] + rounds[pairs[k, 1]]
        for row in range(ends.shape[2]):
            p, q, x, y = end(one, 0, row), end(one, 3, row), end(other, 0, row), end(other, 3, row)
            clearance = between_axes(p, q, x, y) - size
            is_less = clearance < clearances[row]
            clearances[row] = clearance if is_less else clearances[row]
            nearest[row] = k if is_less else nearest[row]


@routine
def place_end(home: Floats, body: int, poses: Floats, end: Floats) -> None:
    """Fill a point of the base or of the platform at all poses, (3, n)."""
    for i in range(3):
        for row in range(poses.shape[0] if body == BASE else 0):
            end[i, row] = home[i]
        for row in range(poses.shape[0] if body == PLATFORM else 0):
            pose = poses[row, i]
            end[i, row] = pose[0] * home[0] + pose[1] * home[1] + pose[2] * home[2] + pose[3]


@inlined
def end(ends: Floats, first: int, row: int) -> Vec:
    return (ends[first, row], ends[first + 1, row], ends[first + 2, row])
