"""The geometry of a mechanism as arrays: the numbers of its description, without names and types."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats
from .coercion import unit_vector
from .home_mobility import universal_axes
from .joints import KINDS, Joint, set_fields
from .mechanism import Mechanism
from .structure import Structure

__all__ = ["Geometry", "geometry_of", "home_numbers", "numbers_with", "with_geometry", "with_numbers"]


class Geometry(NamedTuple):
    """Points, axes and values of the joints of a mechanism at home, in base coordinates, in their order.

    Values that follow from others are included, but `with_geometry` ignores them: axis and home of a prismatic joint
    that is `along` two others, axes of a universal joint that are left out, a joint end effector's reference point.

    Attributes
    ----------
    points : (joints, 3) [length] centres; NaN of a joint that has none.
    axes : (joints, 2, 3) unit vectors: one of R, P and C, two of U; zero where there is none.
    home : (columns,) values of all coordinates [length or rad].
    reference_point : (3,) [length].
    """

    points: Floats
    axes: Floats
    home: Floats
    reference_point: Floats


def geometry_of(mechanism: Structure) -> Geometry:
    """The geometry of a mechanism, in arrays of its own."""
    points = np.array([(np.nan,) * 3 if joint.at is None else joint.at for joint in mechanism.joints])
    axes = np.zeros((len(points), 2, 3))
    for own, joint in zip(axes, mechanism.joints, strict=True):
        if joint.type == "universal":
            own[:] = universal_axes(mechanism, joint)
        elif KINDS[joint.type].direction is not None:
            own[0] = mechanism.home_axis(joint.name)
    home = np.array([coordinate.home for coordinate in mechanism.coordinates])
    return Geometry(points, axes, home, np.array(mechanism.reference_point))


AT_REFERENCE, AT_POINTS = 1, 4
"""Places in a row of home numbers: behind L the reference point, then all points, all axes, and all home values."""


def home_numbers(mechanism: Mechanism) -> Floats:
    """The geometry of a mechanism in one row, behind its characteristic length: 4 + 9 joints + columns numbers."""
    kept: Floats | None = mechanism.__dict__.get("_home_numbers")
    if kept is None:
        points, axes, home, reference_point = geometry_of(mechanism)
        parts = [mechanism.characteristic_length], reference_point, points.ravel(), axes.ravel(), home
        kept = np.concatenate(parts)
        set_fields(mechanism, _home_numbers=kept)
    return kept


def numbers_with(mechanism: Mechanism, geometry: Geometry) -> Floats:
    """The home numbers of a mechanism with another geometry. Directions become unit vectors, as in a new mechanism."""
    from ...kernels.enclosing import N_PLACES
    from ...kernels.home import measure_home

    n_joints = len(mechanism.joints)
    at_axes, at_home = AT_POINTS + 3 * n_joints, AT_POINTS + 9 * n_joints
    numbers = np.empty(at_home + len(mechanism.coordinate_names))
    numbers[AT_REFERENCE:AT_POINTS] = geometry.reference_point
    numbers[AT_POINTS:at_axes].reshape(n_joints, 3)[:] = geometry.points
    numbers[at_axes:at_home].reshape(n_joints, 2, 3)[:] = geometry.axes
    np.add(geometry.home, 0.0, out=numbers[at_home:])  # -0 becomes 0
    if mechanism.end_effector_is_joint:
        tip = [joint.name for joint in mechanism.joints].index(mechanism.end_effector)
        numbers[AT_REFERENCE:AT_POINTS] = geometry.points[tip]
    if not measure_home(numbers, n_joints, np.empty(6 * n_joints + 8), np.empty(N_PLACES, int)):
        axes = numbers[at_axes:at_home].reshape(-1, 3)
        axes[:] = [unit_vector(axis) for axis in axes]
    if not numbers[0] > 0.0:  # all centres coincide
        numbers[0] = with_numbers(mechanism, numbers).characteristic_length
    return numbers


def with_geometry(mechanism: Mechanism, geometry: Geometry) -> Mechanism:
    """The description with other numbers, unchecked for faults and for mobility."""
    return with_numbers(mechanism, numbers_with(mechanism, geometry))


def described_numbers(mechanism: Structure) -> list[float]:
    """The reference point, and all numbers of the joints as they are described, as in `home_numbers` from there on.

    What is computed from others, axes left out and values of a joint that is along two others, is zero.
    """
    joints, nowhere, none = mechanism.joints, (math.nan,) * 3, (0.0,) * 3
    axes = [axis for joint in joints for axis in joint.axes or (joint.axis or none, none)]
    parts = [mechanism.reference_point, *(joint.at or nowhere for joint in joints), *axes]
    return [x for part in [*parts, *map(_described_home, joints)] for x in part]


def _described_home(joint: Joint) -> tuple[float, ...]:
    n = len(KINDS[joint.type].coordinates)
    if n not in (1, 2) or joint.along is not None:
        return (0.0,) * n
    return joint.home if isinstance(joint.home, tuple) else (joint.home,)


def limit_numbers(mechanism: Structure) -> list[float]:
    """The limits of all coordinates, two each, infinite where there are none; then of all joints the cone's axis and
    half angle, zeros where there is none."""
    cones = [joint.cone for joint in mechanism.joints]
    limits = [bound for joint in mechanism.joints for bound in _limits(joint)]
    return limits + [x for cone in cones for x in ((*cone.axis, cone.half_angle) if cone else (0.0,) * 4)]


def _limits(joint: Joint) -> tuple[Any, ...]:
    if joint.range is None:
        return (-math.inf, math.inf) * len(KINDS[joint.type].coordinates)
    return tuple(bound for pair in joint.range for bound in (pair if isinstance(pair, tuple) else (pair,)))


_FIELDS = tuple(each.name for each in fields(Mechanism) if each.name not in ("joints", "reference_point"))
_KEPT = ("bodies", "end_effector_is_joint", "end_effector_body", "whole_task", "actuator_names", "coordinate_names")
"""What is derived from a description without its numbers."""


def with_numbers(mechanism: Mechanism, numbers: Floats) -> Mechanism:
    """The same description with other home numbers, unchecked; the row is kept, and must not change any more."""
    before, row = mechanism.__dict__, numbers.tolist()
    made = object.__new__(Mechanism)
    values = made.__dict__
    values.update({name: before[name] for name in _FIELDS})
    values.update({name: before[name] for name in _KEPT if name in before})
    values["joints"] = tuple(_joints(mechanism.joints, row))
    values["reference_point"] = tuple(row[AT_REFERENCE:AT_POINTS])
    if row[0] > 0.0:
        values["characteristic_length"], values["_home_numbers"] = row[0], numbers
    return made


def _joints(joints: tuple[Joint, ...], row: list[float]) -> Iterator[Joint]:
    """Joints with other numbers."""
    at_axes, home = AT_POINTS + 3 * len(joints), AT_POINTS + 9 * len(joints)
    points, axes = iter(row[AT_POINTS:at_axes]), iter(row[at_axes:home])
    for joint in joints:
        point = next(points), next(points), next(points)
        axis, second = (next(axes), next(axes), next(axes)), (next(axes), next(axes), next(axes))
        n_columns = len(KINDS[joint.type].coordinates)
        if joint.at is None and joint.axis is None:  # it is along two others
            yield joint
        else:
            made = object.__new__(Joint)
            values = made.__dict__
            values.update(joint.__dict__)
            if joint.at is not None:
                values["at"] = point
            if joint.axis is not None:
                values["axis"] = axis
            elif joint.axes is not None:
                values["axes"] = axis, second
            if n_columns == 2:
                values["home"] = row[home], row[home + 1]
            elif n_columns == 1:
                values["home"] = row[home]
            yield made
        home += n_columns
