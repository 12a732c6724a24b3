"""Sub-chains in positions: nodes at joint centres, segments between them, restrictions on them; parallelograms.

A sub-chain is expressible when every arrangement of nodes that keeps the restrictions can be assembled: leading
parallel revolutes keep the first nodes in a plane, universal joints let the next link point anywhere, a spherical joint
frees the twist, a last revolute keeps the last link in a plane of the platform, a first prismatic joint is a rail.
Any other chain carries orientation, and is rejected with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from ...common.arrays import Floats, Record, Records
from ...kernels.passes import plan as P
from ...tolerances import TOLERANCES
from ..description.graph import Step
from ..description.mechanism import Joint, Mechanism
from ..noted_numbers import largest
from ..noted_vectors import Vector, area, norm
from .home_numbers import HomeNumbers
from .joint_nodes import JointNode, NotExpressible, joint_nodes_along


@dataclass(frozen=True)
class Parallelogram:
    """Two equal and parallel rods between the same two bodies.

    Attributes
    ----------
    rods : tuple of tuple of str
        Names of the joints at the inner and the outer end of either rod.
    length : float
        Length of the rods [length].
    width : float
        Distance between the joints of either body [length].
    pinned : bool
        True if its joints are revolutes with parallel axes: it then moves in its plane alone, and its outer body only
        shifts, along a circle whose radius is the rods' length. With ball joints the outer body may also turn.
    """

    rods: tuple[tuple[str, str], tuple[str, str]]
    length: float
    width: float
    pinned: bool

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of its four joints, rod by rod."""
        return self.rods[0] + self.rods[1]


def parallelogram_of(paths: Sequence[Sequence[Joint]], home: HomeNumbers) -> Parallelogram | None:
    """The parallelogram that the paths between two bodies form at home, or None.

    Parameters
    ----------
    paths : the joints of each path, from the inner body outward.
    """
    if len(paths) != 2 or any(len(path) != 2 for path in paths):
        return None
    types = {joint.type for path in paths for joint in path}
    if not (types == {"revolute"} or types <= {"universal", "spherical"}):
        return None
    pinned = types == {"revolute"}
    axis = home.axis(paths[0][0]) if pinned else Vector((0.0, 0.0, 0.0))
    if pinned and any(area(home.axis(joint), axis) > TOLERANCES.alignment for path in paths for joint in path):
        return None
    (a, b), (c, d) = ([_across(home.centre(joint), axis) for joint in path] for path in paths)
    rod, side = b - a, c - a
    if norm((d - c) - rod) > home.length * TOLERANCES.alignment or not _spans(rod, side):
        return None
    (inner, outer), (inner_beside, outer_beside) = paths
    rods = ((inner.name, outer.name), (inner_beside.name, outer_beside.name))
    return Parallelogram(rods, float(norm(rod)), float(norm(side)), pinned)


def _across(point: Vector, axis: Vector) -> Vector:
    """A point without its component along an axis: where on its axis a pin is does not matter."""
    return point - axis * (point @ axis)


def _spans(rod: Vector, side: Vector) -> bool:
    """True if two sides are not parallel: a flat parallelogram may open into one whose rods cross."""
    return bool(area(rod, side) > largest([rod @ rod, side @ side]) * TOLERANCES.alignment)


Interval: TypeAlias = tuple[float, float]
FREE: Interval = (-math.inf, math.inf)


@dataclass(frozen=True)
class JointMeasure:
    """A joint whose coordinate q follows from positions.

    Attributes
    ----------
    joint : its name.
    what : "stroke", the length of the segment to `node` from the one before; "hinge", the angle from home at `node`;
        "rail", the distance from home of the first node; "end", the angle of the platform to the last segment.
    node : a node, numbered within the branch.
    origin, sign : the length, angle or distance is sign * (q - origin); 0 for an "end".
    """

    joint: str
    what: Literal["stroke", "hinge", "rail", "end"]
    node: int
    origin: float = 0.0
    sign: float = 0.0


@dataclass(frozen=True, eq=False)
class BranchForm:
    """One branch as the kernels take it, at home, in base coordinates; its parts are numbered within the branch.

    Attributes
    ----------
    joints : names of the joints at each node; several where they act as one.
    shifts : from each node to the centre of its joints, along the axis of its hinge, (nodes,) [length].
    nodes, record, cones : as of `kernels.passes.plan`.
    measures : joints whose coordinates follow from the nodes.
    """

    joints: tuple[tuple[str, ...], ...]
    shifts: Floats
    nodes: Records
    record: Record
    cones: Records
    measures: tuple[JointMeasure, ...]


@dataclass
class _Draft:
    """A branch being expressed.

    Attributes
    ----------
    joints : names of the joints at each joint node; of a tip that is cut, the end effector itself.
    nodes, shifts : as of `BranchForm`.
    """

    joint_nodes: list[JointNode]
    joints: tuple[tuple[str, ...], ...]
    nodes: Records
    shifts: Floats
    rail: Step | None = None
    planar: int = 0
    normal: Floats = field(default_factory=lambda: np.zeros(3))
    ends_in_plane: bool = False
    align: bool = False
    measures: list[JointMeasure] = field(default_factory=list)


def express_trunk(mechanism: Mechanism, steps: Sequence[Step]) -> Records:
    """The trunk of a branched chain: revolute and prismatic joints in any order, as records of `TRUNK_JOINT`."""
    records = np.zeros(len(steps), P.TRUNK_JOINT)
    for record, step in zip(records, steps, strict=True):
        joint = step.joint
        if joint.type not in ("revolute", "prismatic"):
            raise NotExpressible(f"joint {joint.name}, below a branching body, is {joint.type}")
        record["turns"] = joint.type == "revolute"
        record["unit"] = 1.0 if record["turns"] else mechanism.characteristic_length
        record["point"], record["axis"] = joint.at or 0.0, np.array(mechanism.home_axis(joint.name)) * step.sign
        record["lo"], record["hi"] = _from_home(mechanism, joint)
    return records


def express_branch(mechanism: Mechanism, steps: Sequence[Step], on_base: bool) -> BranchForm:
    """One branch, from the base (or from the body it hangs on) to the end effector."""
    joint_nodes = joint_nodes_along(mechanism, steps)
    joints = tuple(
        tuple(step.joint.name for step in joint_node.steps) or (mechanism.end_effector,) for joint_node in joint_nodes
    )
    draft = _Draft(joint_nodes, joints, np.zeros(len(joint_nodes), P.NODE), np.zeros(len(joint_nodes)))
    if steps[0].joint.type == "prismatic" and len(joint_nodes) > 0:
        if not on_base:
            raise NotExpressible(f"joint {steps[0].joint.name} slides on a moving body")
        draft.rail, joint_nodes[0].slide = joint_nodes[0].slide, None
    _classify(draft)
    _place_nodes(mechanism, draft)
    if (draft.align or draft.ends_in_plane) and len(joint_nodes) > 1:
        draft.measures.append(JointMeasure(joint_nodes[-1].steps[0].joint.name, "end", len(joint_nodes) - 1))
    tolerance = TOLERANCES.alignment * mechanism.characteristic_length
    cones = [
        _cone(draft, k, step, tolerance)
        for k, joint_node in enumerate(joint_nodes)
        for step in joint_node.steps
        if step.joint.cone
    ]
    record = _record(mechanism, draft)
    return BranchForm(joints, draft.shifts, draft.nodes, record, np.array(cones, P.CONE), tuple(draft.measures))


def _record(mechanism: Mechanism, draft: _Draft) -> Record:
    """The record of the branch as a whole."""
    record, places = np.zeros((), P.BRANCH), draft.nodes["home"]
    record["planar"], record["normal"] = draft.planar, draft.normal
    if len(places) > 1 and draft.planar:
        record["reference"] = (places[1] - places[0]) / np.linalg.norm(places[1] - places[0])
    record["end"] = places[-1] - mechanism.reference_point
    record["end_plane"] = draft.ends_in_plane
    if draft.align or draft.ends_in_plane:
        record["end_normal"] = draft.normal if draft.align else draft.joint_nodes[-1].axis
    record["rail_lo"], record["rail_hi"] = FREE
    if draft.rail is not None:
        joint = draft.rail.joint
        draft.measures.append(JointMeasure(joint.name, "rail", 0, _home(mechanism, joint), 1.0))
        record["rail"], record["rail_axis"] = 1, np.array(mechanism.home_axis(joint.name)) * draft.rail.sign
        record["rail_lo"], record["rail_hi"] = _from_home(mechanism, joint)
    return record


def _home(mechanism: Mechanism, joint: Joint) -> float:
    home = mechanism.home_coordinate(joint.name)
    if not isinstance(home, float):
        raise NotExpressible(f"joint {joint.name} has more than one coordinate")
    return home


def _from_home(mechanism: Mechanism, joint: Joint) -> Interval:
    """The range of a joint as deviations from home."""
    home = _home(mechanism, joint)
    lo, hi = _limits(joint, home)
    return lo - home, hi - home


def _limits(joint: Joint, home: float) -> Interval:
    """The range of a joint, widened to contain home: a description has rounded numbers."""
    if joint.range is None:
        return FREE
    lo, hi = joint.range
    if isinstance(lo, tuple) or isinstance(hi, tuple):
        raise NotExpressible(f"joint {joint.name} has ranges about two axes")
    return min(lo, home), max(hi, home)


def _classify(draft: _Draft) -> None:
    """Count the leading parallel hinges; raise if another joint carries orientation through the chain."""
    joint_nodes = draft.joint_nodes
    if len(joint_nodes) == 1 and joint_nodes[0].kind in ("R", "U"):
        raise NotExpressible(
            f"joint {joint_nodes[0].steps[0].joint.name} ties the end effector to the base by orientation"
        )
    if joint_nodes[0].axis is not None:
        draft.normal = joint_nodes[0].axis
        while draft.planar < len(joint_nodes) and _is_parallel(joint_nodes[draft.planar].axis, draft.normal):
            draft.planar += 1
    middle = joint_nodes[draft.planar :]
    if joint_nodes[-1].kind == "point":
        draft.planar = min(draft.planar, len(joint_nodes) - 1)
        middle = joint_nodes[draft.planar : -1]
    elif not middle:
        draft.align = True
    elif all(joint_node.kind != "S" for joint_node in joint_nodes):
        names = "-".join(joint_node.kind for joint_node in joint_nodes)
        raise NotExpressible(f"carries orientation to the end effector ({names}): no spherical joint frees the twist")
    elif middle[-1].kind == "R" and len(middle) > 1:
        draft.ends_in_plane = True
        middle = middle[:-1]
    for joint_node in middle:
        if joint_node.kind == "R":
            raise NotExpressible(
                f"revolute joint {joint_node.steps[0].joint.name} turns about an axis that a moving link carries"
            )


def _is_parallel(axis: Floats | None, normal: Floats) -> bool:
    return axis is not None and float(np.linalg.norm(np.cross(axis, normal))) <= TOLERANCES.alignment


def _place_nodes(mechanism: Mechanism, draft: _Draft) -> None:
    """Fill the nodes: centres of hinges moved along their axes into one plane, and segments with their strokes."""
    joint_nodes, planar, nodes = draft.joint_nodes, draft.planar, draft.nodes
    nodes["home"] = [joint_node.at for joint_node in joint_nodes]
    nodes["angle_lo"], nodes["angle_hi"] = FREE
    nodes["hinge"][: min(planar, len(joint_nodes) - 1)] = 1
    in_plane = joint_nodes[min(planar, len(joint_nodes) - 1)].at if not draft.align else joint_nodes[0].at
    for k in range(planar):
        _shift(draft, k, draft.normal, in_plane)
    if draft.ends_in_plane:
        axis = joint_nodes[-1].axis
        assert axis is not None
        _shift(draft, -1, axis, nodes["home"][-2])
    for k in range(1, len(nodes)):
        nodes["lo"][k], nodes["hi"][k] = _stroke(mechanism, draft, k)
    for k in np.flatnonzero(nodes["hinge"]).tolist():
        _range_hinge(mechanism, draft, k)


def _shift(draft: _Draft, k: int, axis: Floats, level: Floats) -> None:
    """Move node k along its axis to the height of a point."""
    centre = draft.joint_nodes[k].at
    draft.shifts[k] = shift = float(axis @ (centre - level))
    draft.nodes["home"][k] = centre - shift * axis


def _stroke(mechanism: Mechanism, draft: _Draft, k: int) -> Interval:
    """The least and largest length between nodes k - 1 and k."""
    step, (before, after) = draft.nodes["home"][k] - draft.nodes["home"][k - 1], draft.joints[k - 1 : k + 1]
    length = float(np.linalg.norm(step))
    slide = draft.joint_nodes[k].slide
    if length <= TOLERANCES.alignment * mechanism.characteristic_length:
        raise NotExpressible(f"joints {before[0]} and {after[0]} coincide")
    if slide is None:
        return length, length
    joint = slide.joint
    cosine = float(np.array(mechanism.home_axis(joint.name)) @ step) / length * slide.sign
    if abs(cosine) < math.cos(2.0 * TOLERANCES.alignment):
        raise NotExpressible(f"prismatic joint {joint.name} does not point from {before[0]} to {after[0]}")
    sign = math.copysign(1.0, cosine)
    home = _home(mechanism, joint)
    limits = _limits(joint, home)
    if joint.along is not None:
        if not set(joint.along) <= {*before, *after}:
            raise NotExpressible(f"prismatic joint {joint.name} is measured along joints that are not its neighbours")
        sign = 1.0
    offset = home - sign * length
    draft.measures.append(JointMeasure(joint.name, "stroke", k, offset, sign))
    lo, hi = sorted(((limits[0] - offset) * sign, (limits[1] - offset) * sign))
    return max(lo, 0.0), hi


def _range_hinge(mechanism: Mechanism, draft: _Draft, k: int) -> None:
    """Fill the range of the hinge in node k: deviations from home, about the branch's normal."""
    step, node, places = draft.joint_nodes[k].steps[0], draft.nodes[k], draft.nodes["home"]
    sense = _sense(step, draft.normal)
    draft.measures.append(JointMeasure(step.joint.name, "hinge", k, _home(mechanism, step.joint), sense))
    node["angle_lo"], node["angle_hi"] = sorted(bound * sense for bound in _from_home(mechanism, step.joint))
    node["ranged"] = np.isfinite([node["angle_lo"], node["angle_hi"]]).any()
    if k > 0:
        node["angle_home"] = _angle_about(draft.normal, places[k] - places[k - 1], places[k + 1] - places[k])


def _sense(step: Step, normal: Floats) -> float:
    """+1 if the joint's coordinate grows when the outward body turns right-handed about `normal`."""
    return math.copysign(1.0, float(np.array(step.joint.axis) @ normal) * step.sign)


def _angle_about(normal: Floats, a: Floats, b: Floats) -> float:
    return math.atan2(float(normal @ np.cross(a, b)), float(a @ b))


def _cone(draft: _Draft, k: int, step: Step, tolerance: float) -> tuple[int, int, Floats, float, float, float]:
    """The cone of the joint at node k, a record of `CONE`."""
    cone, name, places = step.joint.cone, step.joint.name, draft.nodes["home"]
    assert cone is not None
    axis, last = np.array(cone.axis), len(places) - 1
    opening = cone.half_angle, math.cos(cone.half_angle), math.sin(cone.half_angle)
    line_end = k - 1 if cone.fixed_to != step.inward else k + 1
    if 0 <= line_end <= last and abs(draft.shifts[line_end]) > tolerance:
        raise NotExpressible(
            f"the cone of joint {name} is about a line to {draft.joints[line_end][0]}, off the chain's plane"
        )
    outward = places[k + 1] - places[k] if k < last else None
    if cone.fixed_to != step.inward:
        if k == last and k > 0:
            return P.PLATFORM_CONE, k, axis, *opening
        if outward is not None and k > 0 and _is_parallel(axis, outward / np.linalg.norm(outward)):
            sign = math.copysign(1.0, float(axis @ outward))
            return P.LINK_CONE, k, np.array([-sign, 0.0, 0.0]), *opening
        raise NotExpressible(f"the cone of joint {name} turns with a link whose twist positions do not show")
    if outward is None:
        raise NotExpressible(f"the cone of joint {name} limits a line of the end effector")
    if k == 0:
        return P.CARRIER_CONE, k, axis, *opening
    link = places[k] - places[k - 1]
    link = link / np.linalg.norm(link)
    if k <= draft.planar:
        across = np.cross(draft.normal, link)
        return P.LINK_CONE, k, np.array([axis @ link, axis @ across, axis @ draft.normal]), *opening
    if _is_parallel(axis, link):
        return P.LINK_CONE, k, np.array([math.copysign(1.0, float(axis @ link)), 0.0, 0.0]), *opening
    raise NotExpressible(f"the cone of joint {name} turns with a link whose twist positions do not show")
