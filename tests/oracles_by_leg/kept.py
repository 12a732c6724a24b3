"""Whether the joints of a leg close and keep their limits, once its bodies are placed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pfabrik.description.joint_types import KINDS
from pfabrik.description.joints import Joint
from pfabrik.description.mechanism import Mechanism
from pfabrik.tolerances import TOLERANCES

from .facts import Array
from .legs import Leg, Line
from .rods import TIP, Passage
from .turns import Placed, angle_about, angle_of, turns_about

Mask = NDArray[np.bool_]


class State(NamedTuple):
    """A joint between two placed bodies: its coordinates less home's, and how far the two are from allowing them."""

    coordinates: Array  # (n, freedoms) [rad or length]; none of a ball joint
    gap: Array  # (n,) [length]
    twist: Array  # (n,) [rad]


def judge(mechanism: Mechanism, leg: Leg, placed: dict[str, Placed], values: Array) -> tuple[Mask, Mask]:
    """Whether a leg closes, (n,), and whether it keeps all its limits as well; fills `values` (n,) of its actuator."""
    n = len(values)
    closes, keeps = np.ones(n, bool), np.ones(n, bool)
    for each in leg.passages:
        state = state_of(mechanism, each, placed)
        closes &= (state.gap <= TOLERANCES.position * mechanism.characteristic_length) & (
            state.twist <= TOLERANCES.rotation
        )
        coordinates = _counted(mechanism, each.joint, state.coordinates)
        keeps &= _within_ranges(mechanism, each.joint, coordinates)
        if each.joint.actuated:
            values[:] = coordinates[:, 0]
    for cone in leg.cones:
        keeps &= _within_cone(cone, placed)
    return closes, closes & keeps


def state_of(mechanism: Mechanism, each: Passage, placed: dict[str, Placed]) -> State:
    """The coordinates of a joint between the bodies it connects; of a joint that is the tip, only the gap."""
    joint = each.joint
    inner, outer = placed[each.inner], placed[each.outer]
    home = _point(mechanism, joint)
    if TIP in (each.inner, each.outer) or joint.type == "spherical":
        gap = np.linalg.norm(outer.point(home) - inner.point(home), axis=1)
        return State(np.empty((len(gap), 0)), gap, np.zeros(len(gap)))
    first, second = (inner, outer) if each.forward else (outer, inner)
    turn = np.swapaxes(first.turn, 1, 2) @ second.turn
    apart = np.einsum("nji,nj->ni", first.turn, second.point(home) - first.point(home))
    if joint.type == "prismatic":
        axis = np.array(mechanism.home_axis(joint.name))
        along = apart @ axis
        across = np.linalg.norm(apart - along[:, None] * axis, axis=1)
        return State(along[:, None], across, np.linalg.norm(turn - np.eye(3), axis=(1, 2)) / np.sqrt(2.0))
    gap = np.linalg.norm(apart, axis=1)
    if joint.type == "revolute":
        axis = np.array(joint.axis)
        return State(angle_of(turn, axis)[:, None], gap, np.linalg.norm(turn @ axis - axis, axis=1))
    axes = each.axes if each.forward else each.axes[::-1]
    angle = angle_about(axes[0], axes[1], turn @ axes[1])
    rest = np.swapaxes(turns_about(axes[0], angle), 1, 2) @ turn
    twist = np.linalg.norm(rest @ axes[1] - axes[1], axis=1)
    return State(np.stack([angle, angle_of(rest, axes[1])], axis=1), gap, twist)


def _point(mechanism: Mechanism, joint: Joint) -> Array:
    """A point at which the two bodies of a joint are compared: any would do for a slide."""
    if joint.at is not None:
        return np.array(joint.at)
    return np.array(mechanism.reference_point if joint.along is None else mechanism.joint(joint.along[0]).at)


def _counted(mechanism: Mechanism, joint: Joint, moved: Array) -> Array:
    """Coordinates as the joint counts them, angles of hinges by whole turns into their range where that is possible."""
    if not moved.shape[1]:
        return moved
    values = moved + np.ravel(mechanism.home_coordinate(joint.name))
    if joint.type != "revolute" or joint.range is None:
        return values
    low, high = np.ravel(joint.range) + (-TOLERANCES.limit, TOLERANCES.limit)
    least = values + 2.0 * np.pi * np.ceil((low - values) / (2.0 * np.pi))
    outside = (values < low) | (values > high)
    return np.where(outside & (least <= high), least, values)


def _within_ranges(mechanism: Mechanism, joint: Joint, coordinates: Array) -> Mask:
    if joint.range is None or not coordinates.shape[1]:
        return np.ones(len(coordinates), bool)
    low, high = np.reshape(joint.range, (-1, 2)).T
    lengths = np.array([kind == "length" for kind in KINDS[joint.type].coordinates])
    slack = TOLERANCES.limit * np.where(lengths, mechanism.characteristic_length, 1.0)
    return np.asarray(((coordinates >= low - slack) & (coordinates <= high + slack)).all(axis=1))


def _within_cone(cone: Line, placed: dict[str, Placed]) -> Mask:
    assert cone.joint.cone is not None
    (start_on, start), (end_on, end) = cone.start, cone.end
    line = placed[end_on].point(end) - placed[start_on].point(start)
    axis = placed[cone.axis_on].turn @ np.array(cone.joint.cone.axis)
    angle = np.arctan2(np.linalg.norm(np.cross(axis, line), axis=1), (axis * line).sum(axis=1))
    return np.asarray(angle <= cone.joint.cone.half_angle + TOLERANCES.limit)
