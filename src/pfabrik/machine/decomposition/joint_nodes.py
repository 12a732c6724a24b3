"""Joint nodes: the centres of joints along a chain, with neighbours that act as one joint merged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from ...common.arrays import Floats
from ...tolerances import TOLERANCES
from ..description.graph import Step
from ..description.home_mobility import universal_axes
from ..description.mechanism import Joint, Mechanism

_KINDS: dict[str, Literal["R", "U", "S"]] = {"revolute": "R", "universal": "U", "spherical": "S"}


class NotExpressible(Exception):
    """Positions alone cannot express this chain; the text says why."""


@dataclass
class JointNode:
    """A joint centre along a chain, and the prismatic joint between it and the node before, if any.

    Attributes
    ----------
    kind : of what turns there: revolute, universal, spherical, or the point that the chain ends in.
    steps : the joints merged there.
    at : the centre at home [length].
    axis : of a revolute, a unit vector.
    """

    kind: Literal["R", "U", "S", "point"]
    steps: list[Step]
    at: Floats
    axis: Floats | None = None
    slide: Step | None = None


def joint_nodes_along(mechanism: Mechanism, steps: Sequence[Step]) -> list[JointNode]:
    """The joint nodes along a branch, neighbours that act as one joint merged."""
    tolerance = TOLERANCES.alignment * mechanism.characteristic_length
    nodes = _merge(mechanism, _joint_nodes(steps, mechanism.end_effector_is_joint), tolerance)
    _require_pointing(mechanism, nodes)
    return nodes


def _joint_nodes(steps: Sequence[Step], ends_in_point: bool) -> list[JointNode]:
    """The joint nodes along a branch, each with the prismatic joint before it."""
    nodes: list[JointNode] = []
    slide: Step | None = None
    for i, step in enumerate(steps):
        joint = step.joint
        if ends_in_point and i == len(steps) - 1:
            if joint.range is not None or joint.cone is not None:
                raise NotExpressible(f"joint {joint.name}, the end effector, has a limit that ties its chains together")
            nodes.append(JointNode("point", [], np.array(joint.at), None, slide))
            slide = None
        elif joint.type == "prismatic":
            if slide is not None:
                raise NotExpressible(f"two prismatic joints in a row, {slide.joint.name} and {joint.name}")
            slide = step
        elif joint.type == "cylindrical":
            raise NotExpressible(f"joint {joint.name} is cylindrical")
        else:
            if joint.type == "universal" and joint.range is not None:
                raise NotExpressible(f"joint {joint.name} has ranges about two axes")
            if joint.axes is not None and not _are_square(*map(np.array, joint.axes)):
                raise NotExpressible(f"joint {joint.name} turns about axes that are not square to each other")
            kind = _KINDS[joint.type]
            axis = np.array(joint.axis) if joint.type == "revolute" else None
            nodes.append(JointNode(kind, [step], np.array(joint.at), axis, slide))
            slide = None
    if slide is not None:
        raise NotExpressible(f"prismatic joint {slide.joint.name} carries the end effector")
    return nodes


def _merge(mechanism: Mechanism, nodes: list[JointNode], tolerance: float) -> list[JointNode]:
    """Merge joints whose centres are within `tolerance`: R+R = U, R+R+R = U+R = R+U = S.

    Each axis must be square to the next: otherwise some directions are out of their reach.
    """
    merged: list[JointNode] = []
    for node in nodes:
        previous = merged[-1] if merged else None
        centre = _common_centre(previous, node, tolerance) if previous is not None and node.slide is None else None
        if previous is None or centre is None:
            merged.append(node)
            continue
        for step in previous.steps + node.steps:
            if step.joint.actuated or step.joint.range is not None or step.joint.cone is not None:
                raise NotExpressible(
                    f"joint {step.joint.name} shares its centre with a neighbour and has a motor or a limit of its own"
                )
        for (name, axis), (next_name, next_axis) in pairwise(_rotation_axes(mechanism, previous.steps + node.steps)):
            if not _are_square(axis, next_axis):
                raise NotExpressible(f"joints {name} and {next_name} turn about axes that are not square to each other")
        kind: Literal["U", "S"] = "U" if previous.kind == node.kind == "R" else "S"
        merged[-1] = JointNode(kind, previous.steps + node.steps, centre, None, previous.slide)
    return merged


def _common_centre(a: JointNode, b: JointNode, tolerance: float) -> Floats | None:
    """The centre of two neighbouring joints that act as one, or None."""
    if "point" in (a.kind, b.kind) or (a.kind == "S" and b.kind == "S"):
        return None
    if a.kind == b.kind == "R":
        assert a.axis is not None
        assert b.axis is not None
        across = np.cross(a.axis, b.axis)
        sine = float(np.linalg.norm(across))
        offset = b.at - a.at
        if sine < TOLERANCES.alignment or abs(float(offset @ across)) / sine > tolerance:
            return None
        along_a = float(np.cross(offset, b.axis) @ across) / sine**2
        return np.asarray(a.at + along_a * a.axis)
    if {a.kind, b.kind} == {"R", "U"} and float(np.linalg.norm(a.at - b.at)) <= tolerance:
        return a.at
    return None


def _require_pointing(mechanism: Mechanism, nodes: Sequence[JointNode]) -> None:
    """Require that universal joints, and joints that act as one, can point their links anywhere in their cones.

    A link at 90 degrees - a to the axis that it carries cannot come nearer than a to the other axis. Axes that are not
    given may be square to the link on the other side of the joint.
    """
    for k, node in enumerate(nodes):
        if node.kind != "U" or len(nodes) < 2:
            continue
        first_step, is_last = node.steps[0], k == len(nodes) - 1
        line = nodes[k - 1 if is_last else k + 1].at - node.at
        axes = [axis for _, axis in _rotation_axes(mechanism, node.steps)]
        other_axis, carried_axis = reversed(axes) if is_last else axes
        projection, length = abs(float(carried_axis @ line)), float(np.linalg.norm(line))
        if length == 0.0 or projection <= TOLERANCES.alignment * length:
            continue
        body = first_step.back.inward if is_last else first_step.inward
        if _least_angle(first_step.joint, body, other_axis) < math.asin(min(projection / length, 1.0)):
            name = node.steps[-1].joint.name
            raise NotExpressible(f"joint {name} does not point anywhere: its link is not square to its axis")


def _least_angle(joint: Joint, body: str, axis: Floats) -> float:
    """The least angle to a body's axis that a universal joint's cone allows its line [rad]; 0 without such a cone."""
    cone = joint.cone
    if cone is None or cone.fixed_to != body:
        return 0.0
    return math.acos(min(abs(float(np.array(cone.axis) @ axis)), 1.0)) - cone.half_angle


def _rotation_axes(mechanism: Mechanism, steps: Sequence[Step]) -> list[tuple[str, Floats]]:
    """The axes of revolute and universal joints in series, from the base outward, with the names of their joints."""
    rotations: list[tuple[str, Floats]] = []
    for step in steps:
        joint = step.joint
        axes = [np.array(joint.axis)] if joint.type == "revolute" else list(universal_axes(mechanism, joint))
        rotations += [(joint.name, axis) for axis in (axes if step.forward else reversed(axes))]
    return rotations


def _are_square(axis: Floats, other: Floats) -> bool:
    return abs(float(axis @ other)) <= TOLERANCES.alignment
