"""The numbers of a home configuration, measured by compiled code: the same text as new machines run interpreted."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from ..common.arrays import Floats, Ints
from . import enclosing
from ._jit import routine, search


def _part(function: Callable[..., Any], **parts: Any) -> Any:
    """A function of plain Python as a part of kernels, with parts in the place of the functions that it calls."""
    return routine(FunctionType(function.__code__, function.__globals__ | parts, function.__name__))


_distance = _part(enclosing.distance)
_circumscribe = _part(enclosing.circumscribe)
_candidates = _part(enclosing.enclose_candidates, distance=_distance, circumscribe=_circumscribe)
_enclose = _part(enclosing.enclose, distance=_distance, enclose_candidates=_candidates)
_radius = _part(enclosing.enclosing_radius, enclose=_enclose)

UNIT_SLACK = 4.0 * float(np.finfo(float).eps)
"""How far the square of a norm may be from 1 for a vector to count as a unit vector: nearer than `coercion` asks."""


@search
def measure_home(numbers: Floats, n_joints: int, scratch: Floats, places: Ints) -> bool:
    """Put the radius of the smallest sphere around joint centres first; True if all axes are unit vectors, or zero.

    Parameters
    ----------
    numbers : as of `description.geometry.home_numbers`.
    scratch, places : 6 `n_joints` + 8 and `N_PLACES` numbers.
    """
    n, points, cloud = 0, scratch[: 3 * n_joints], scratch[3 * n_joints : 6 * n_joints]
    sphere, best = scratch[6 * n_joints : 6 * n_joints + 4], scratch[6 * n_joints + 4 :]
    for joint in range(n_joints):
        at = 4 + 3 * joint
        if numbers[at] == numbers[at]:  # it has a centre
            for i in range(3):
                points[3 * n + i] = numbers[at + i]
            n += 1
    numbers[0] = _radius(points, n, cloud, places, sphere, best)
    for k in range(2 * n_joints):
        at = 4 + 3 * n_joints + 3 * k
        square = numbers[at] * numbers[at] + numbers[at + 1] * numbers[at + 1] + numbers[at + 2] * numbers[at + 2]
        if square != 0.0 and not abs(square - 1.0) <= UNIT_SLACK:
            return False
    return True
