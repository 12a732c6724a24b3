"""The limited coordinates and cone angles of configurations, and angles counted into their ranges."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import Floats
from ..description.graph import cone_line
from ..description.joint_types import KINDS
from ..description.mechanism import Joint, Mechanism
from ..tolerances import TOLERANCES
from .displacements import centres, columns, displacements


def within_turns(mechanism: Mechanism, coordinates: Floats) -> None:
    """Count the angles of ranged joints about one axis by whole turns into their ranges, if possible, in place."""
    for joint in mechanism.joints:
        if joint.type not in ("revolute", "cylindrical") or joint.range is None:
            continue
        low, high = np.ravel(joint.range)[:2] - np.ravel(mechanism.home_coordinate(joint.name))[0]
        values = coordinates[:, columns(mechanism)[joint.name].start]  # a view
        low, high = low - TOLERANCES.limit, high + TOLERANCES.limit
        least = values + 2.0 * np.pi * np.ceil((low - values) / (2.0 * np.pi))
        outside = (values < low) | (values > high)
        values[:] = np.where(outside & (least <= high), least, values)


def ranged(
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


def coned(mechanism: Mechanism, coordinates: Floats) -> Iterator[tuple[Joint, Floats, float]]:
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
