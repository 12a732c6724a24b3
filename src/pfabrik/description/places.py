"""Where joints are drawn: at their centres, or near by where they have none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .joints import Joint
from .structure import Structure

Floats = NDArray[np.float64]
Places = dict[str, Floats]


def joint_places(mechanism: Structure, points: Mapping[str, Floats] | None, reference: Floats) -> Places:
    """Where each joint is drawn [length]: at its centre or, if it is prismatic and has none, near by.

    Parameters
    ----------
    points : joint centres of an answer, as `Solution.points`; None is home.
    reference : where the reference point is: a place for joints in a machine that has no centre at all.
    """
    if points is None:
        places = {joint.name: np.array(joint.at) for joint in mechanism.joints if joint.at is not None}
    else:
        places = {name: np.asarray(point) for name, point in points.items()}
    waiting = [joint for joint in mechanism.joints if joint.name not in places]
    while waiting:
        found = {joint.name: slider_place(mechanism, joint, places) for joint in waiting}
        placed = {name: place for name, place in found.items() if place is not None}
        places |= placed or dict.fromkeys(found, reference)  # a gantry of slides has no centre at all
        waiting = [joint for joint in waiting if joint.name not in places]
    return {joint.name: places[joint.name] for joint in mechanism.joints}


def slider_place(mechanism: Structure, joint: Joint, places: Places) -> Floats | None:
    """Where a prismatic joint is drawn: amid the joints of its larger moving body, or between two of equal size."""
    if joint.along is not None:
        return middle([places[name] for name in joint.along])
    moving = [body for body in joint.connects if body != mechanism.base]
    sides = [[places[name] for name in joints_on(mechanism, body) if name in places] for body in moving]
    most = max(map(len, sides))
    return middle([middle(side) for side in sides if len(side) == most]) if most else None


def joints_on(mechanism: Structure, body: str) -> list[str]:
    """Names of the joints of a body."""
    return [joint.name for joint in mechanism.joints if body in joint.connects]


def middle(points: list[Floats]) -> Floats:
    """The mean of some points."""
    return np.asarray(np.mean(points, axis=0))
