"""Limits of a configuration: which of them it lies on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .cones import cone_line
from .displacements import centres, columns, displacements
from .joint_types import KINDS
from .mechanism import Joint, Mechanism
from .tolerances import TOLERANCES

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that holds an answer back.

    Attributes
    ----------
    joint, bound : which limit of which joint.
    value, limit : the coordinate (or the angle at the cone) and its bound [length or rad].
    """

    joint: str
    bound: Literal["min", "max", "cone"]
    value: float
    limit: float


def active_limits(mechanism: Mechanism, coordinates: Floats) -> list[tuple[ActiveLimit, ...]]:
    """The limits that each row of joint coordinates (n, columns), deviations from home, lies on; ranges first."""
    found: list[list[ActiveLimit]] = [[] for _ in coordinates]
    for joint in mechanism.joints:
        for values, bounds, scale in _ranged(mechanism, joint, coordinates):
            near = TOLERANCES.active * scale
            low, high = values - bounds[0] <= near, bounds[1] - values <= near
            for row in np.flatnonzero(low):
                found[row].append(ActiveLimit(joint.name, "min", float(values[row]), bounds[0]))
            for row in np.flatnonzero(high & ~low):
                found[row].append(ActiveLimit(joint.name, "max", float(values[row]), bounds[1]))
    for joint, angles, half_angle in _coned(mechanism, coordinates):
        for row in np.flatnonzero(half_angle - angles <= TOLERANCES.active):
            found[row].append(ActiveLimit(joint.name, "cone", float(angles[row]), half_angle))
    return [tuple(each) for each in found]


def within_turns(mechanism: Mechanism, coordinates: Floats) -> None:
    """Count the angles of ranged revolute joints by whole turns into their ranges, where that is possible, in place."""
    for joint in mechanism.joints:
        if joint.type != "revolute" or joint.range is None:
            continue
        low, high = np.ravel(joint.range) - np.ravel(mechanism.home_coordinate(joint.name))
        values = coordinates[:, columns(mechanism)[joint.name].start]  # a view
        low, high = low - TOLERANCES.limit, high + TOLERANCES.limit
        least = values + 2.0 * np.pi * np.ceil((low - values) / (2.0 * np.pi))
        outside = (values < low) | (values > high)
        values[:] = np.where(outside & (least <= high), least, values)


def _ranged(
    mechanism: Mechanism, joint: Joint, coordinates: Floats
) -> Iterator[tuple[Floats, tuple[float, float], float]]:
    """Values (n,), bounds and unit of every ranged coordinate of a joint."""
    if joint.range is None:
        return
    own = coordinates[:, columns(mechanism)[joint.name]] + np.ravel(mechanism.home_coordinate(joint.name))
    for values, bounds, kind in zip(
        own.T, np.reshape(joint.range, (-1, 2)).tolist(), KINDS[joint.type].coordinates, strict=True
    ):
        yield values, (bounds[0], bounds[1]), mechanism.characteristic_length if kind == "length" else 1.0


def _coned(mechanism: Mechanism, coordinates: Floats) -> Iterator[tuple[Joint, Floats, float]]:
    """Every joint with a cone, the angles (n,) of its line to the cone's axis, and the half angle."""
    joints = [joint for joint in mechanism.joints if joint.cone is not None]
    if not joints:
        return
    bodies, points = displacements(mechanism, coordinates), centres(mechanism, coordinates)
    for joint in joints:
        if joint.cone is not None:
            start, end = cone_line(mechanism, joint)
            line = points[end.name] - points[start.name]
            axis = bodies[joint.cone.fixed_to][:, :3, :3] @ np.asarray(joint.cone.axis)
            across = np.linalg.norm(np.cross(axis, line), axis=1)
            yield joint, np.arctan2(across, (axis * line).sum(axis=1)), joint.cone.half_angle
