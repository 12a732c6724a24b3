"""What a chain of joints means for the positions of its joint centres: nodes, segments, and restrictions on them.

A sub-chain is expressible when every arrangement of nodes that keeps the restrictions can be assembled: leading
parallel revolutes keep the first nodes in a plane, universal joints let the next link point anywhere, a spherical joint
frees the twist, a last revolute keeps the last link in a plane of the platform, a first prismatic joint is a rail.
Anything else carries orientation through the chain, and is said not to be expressible, with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..arrays import Floats
from ..description.graph import Step
from ..description.mechanism import Joint, Mechanism
from ..tolerances import TOLERANCES
from .forms import FREE, BranchForm, ConeForm, Interval, NodeForm, NotExpressible, TrunkJoint
from .spots import Spot, spots_along


@dataclass
class _Draft:
    """A branch being expressed."""

    spots: list[Spot]
    rail: Step | None = None
    planar: int = 0
    normal: Floats = field(default_factory=lambda: np.zeros(3))
    ends_in_plane: bool = False
    align: bool = False
    told: list[str] = field(default_factory=list)


def express_trunk(mechanism: Mechanism, steps: Sequence[Step]) -> tuple[TrunkJoint, ...]:
    """The trunk of a branched chain: revolute and prismatic joints in any order."""
    found = []
    for step in steps:
        joint = step.joint
        if joint.type not in ("revolute", "prismatic"):
            raise NotExpressible(f"joint {joint.name}, below a branching body, is {joint.type}")
        point, axis = np.array(joint.at or (0.0, 0.0, 0.0)), np.array(mechanism.home_axis(joint.name)) * step.sign
        found.append(TrunkJoint(joint.name, point, axis, joint.type == "prismatic", _from_home(mechanism, joint)))
    return tuple(found)


def express_branch(mechanism: Mechanism, steps: Sequence[Step], on_base: bool) -> BranchForm:
    """One branch, from the base (or from the body it hangs on) to the end effector."""
    near = TOLERANCES.alignment * mechanism.characteristic_length
    draft = _Draft(spots_along(mechanism, steps))
    if steps[0].joint.type == "prismatic" and len(draft.spots) > 0:
        if not on_base:
            raise NotExpressible(f"joint {steps[0].joint.name} slides on a moving body")
        draft.rail, draft.spots[0].slider = draft.spots[0].slider, None
    _classify(draft)
    nodes = _place_nodes(mechanism, draft)
    if (draft.align or draft.ends_in_plane) and len(draft.spots) > 1:
        draft.told.append(draft.spots[-1].steps[0].joint.name)
    cones = tuple(
        _cone(draft, nodes, k, step, near)
        for k, spot in enumerate(draft.spots)
        for step in spot.steps
        if step.joint.cone
    )
    rail, rail_range = _rail(mechanism, draft)
    return BranchForm(
        nodes=tuple(nodes),
        planar=draft.planar,
        normal=draft.normal,
        end_normal=draft.normal if draft.align else (draft.spots[-1].axis if draft.ends_in_plane else None),
        align=draft.align,
        rail=rail,
        rail_range=rail_range,
        cones=cones,
        told=tuple(draft.told),
    )


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
    """The range of a joint, which contains home: a description may be off by the rounding of its numbers."""
    if joint.range is None:
        return FREE
    lo, hi = joint.range
    if isinstance(lo, tuple) or isinstance(hi, tuple):
        raise NotExpressible(f"joint {joint.name} has ranges about two axes")
    return min(lo, home), max(hi, home)


def _classify(draft: _Draft) -> None:
    """Count the leading hinges, and see that nothing else carries orientation through the chain."""
    spots = draft.spots
    if len(spots) == 1 and spots[0].kind in ("R", "U"):
        raise NotExpressible(f"joint {spots[0].steps[0].joint.name} ties the end effector to the base by orientation")
    if spots[0].axis is not None:
        draft.normal = spots[0].axis
        while draft.planar < len(spots) and _is_parallel(spots[draft.planar].axis, draft.normal):
            draft.planar += 1
    rest = spots[draft.planar :]
    if spots[-1].kind == "point":
        draft.planar = min(draft.planar, len(spots) - 1)
        rest = spots[draft.planar : -1]
    elif not rest:
        draft.align = True
    elif all(spot.kind != "S" for spot in spots):
        names = "-".join(spot.kind for spot in spots)
        raise NotExpressible(f"carries orientation to the end effector ({names}): no spherical joint frees the twist")
    elif rest[-1].kind == "R" and len(rest) > 1:
        draft.ends_in_plane = True
        rest = rest[:-1]
    for spot in rest:
        if spot.kind == "R":
            raise NotExpressible(
                f"revolute joint {spot.steps[0].joint.name} turns about an axis that a moving link carries"
            )


def _is_parallel(axis: Floats | None, normal: Floats) -> bool:
    return axis is not None and float(np.linalg.norm(np.cross(axis, normal))) <= TOLERANCES.alignment


def _place_nodes(mechanism: Mechanism, draft: _Draft) -> list[NodeForm]:
    """The nodes: centres of hinges moved along their axes into one plane, segments with their strokes."""
    spots, planar = draft.spots, draft.planar
    names = [tuple(step.joint.name for step in spot.steps) or (mechanism.end_effector,) for spot in spots]
    nodes = [NodeForm(joints, spot.at) for joints, spot in zip(names, spots, strict=True)]
    in_plane = spots[min(planar, len(spots) - 1)].at if not draft.align else spots[0].at
    for k in range(planar):
        shift = float(draft.normal @ (spots[k].at - in_plane))
        nodes[k] = replace(nodes[k], at=spots[k].at - shift * draft.normal, shift=shift, hinge=k + 1 < len(spots))
    if draft.ends_in_plane:
        axis = spots[-1].axis
        assert axis is not None
        shift = float(axis @ (spots[-1].at - nodes[-2].at))
        nodes[-1] = replace(nodes[-1], at=spots[-1].at - shift * axis, shift=shift)
    for k in range(1, len(nodes)):
        nodes[k] = replace(nodes[k], stroke=_stroke(mechanism, draft, nodes, k))
    for k in range(planar):
        if nodes[k].hinge:
            nodes[k] = _range_hinge(mechanism, draft, nodes, k)
    return nodes


def _stroke(mechanism: Mechanism, draft: _Draft, nodes: list[NodeForm], k: int) -> Interval:
    """Lengths allowed between nodes k - 1 and k."""
    step = nodes[k].at - nodes[k - 1].at
    length = float(np.linalg.norm(step))
    slider = draft.spots[k].slider
    if length <= TOLERANCES.alignment * mechanism.characteristic_length:
        raise NotExpressible(f"joints {nodes[k - 1].joint} and {nodes[k].joint} coincide")
    if slider is None:
        return length, length
    joint = slider.joint
    cosine = float(np.array(mechanism.home_axis(joint.name)) @ step) / length * slider.sign
    if abs(cosine) < math.cos(2.0 * TOLERANCES.alignment):
        raise NotExpressible(
            f"prismatic joint {joint.name} does not point from {nodes[k - 1].joint} to {nodes[k].joint}"
        )
    sign = math.copysign(1.0, cosine)
    home = _home(mechanism, joint)
    limits = _limits(joint, home)
    if joint.along is not None:
        own = {each.joint.name for spot in draft.spots[k - 1 : k + 1] for each in spot.steps} | {nodes[k].joint}
        if not set(joint.along) <= own:
            raise NotExpressible(f"prismatic joint {joint.name} is measured along joints that are not its neighbours")
        sign = 1.0
    offset = home - sign * length
    draft.told.append(joint.name)
    lo, hi = sorted(((limits[0] - offset) * sign, (limits[1] - offset) * sign))
    return max(lo, 0.0), hi


def _range_hinge(mechanism: Mechanism, draft: _Draft, nodes: list[NodeForm], k: int) -> NodeForm:
    """Node k with the range of its hinge, as deviation from home about the branch's normal."""
    step = draft.spots[k].steps[0]
    sense = _sense(step, draft.normal)
    draft.told.append(step.joint.name)
    lo, hi = sorted(bound * sense for bound in _from_home(mechanism, step.joint))
    before = nodes[k].at - nodes[k - 1].at if k > 0 else None
    angle_home = _angle_about(draft.normal, before, nodes[k + 1].at - nodes[k].at) if before is not None else 0.0
    return replace(nodes[k], turn=(lo, hi), angle_home=angle_home)


def _sense(step: Step, normal: Floats) -> float:
    """+1 if the joint's coordinate grows when the outward body turns right-handed about `normal`."""
    return math.copysign(1.0, float(np.array(step.joint.axis) @ normal) * step.sign)


def _angle_about(normal: Floats, a: Floats, b: Floats) -> float:
    return math.atan2(float(normal @ np.cross(a, b)), float(a @ b))


def _rail(mechanism: Mechanism, draft: _Draft) -> tuple[Floats | None, Interval]:
    if draft.rail is None:
        return None, FREE
    joint = draft.rail.joint
    draft.told.append(joint.name)
    return np.array(mechanism.home_axis(joint.name)) * draft.rail.sign, _from_home(mechanism, joint)


def _cone(draft: _Draft, nodes: list[NodeForm], k: int, step: Step, near: float) -> ConeForm:
    """The cone of the joint at node k."""
    cone, name = step.joint.cone, step.joint.name
    assert cone is not None
    axis, last = np.array(cone.axis), len(nodes) - 1
    seen = k - 1 if cone.fixed_to != step.inward else k + 1
    if 0 <= seen <= last and abs(nodes[seen].shift) > near:
        raise NotExpressible(f"the cone of joint {name} is about a line to {nodes[seen].joint}, off the chain's plane")
    outward = nodes[k + 1].at - nodes[k].at if k < last else None
    if cone.fixed_to != step.inward:
        if k == last and k > 0:
            return ConeForm(name, "platform", k, axis, cone.half_angle)
        if outward is not None and k > 0 and _is_parallel(axis, outward / np.linalg.norm(outward)):
            sign = math.copysign(1.0, float(axis @ outward))
            return ConeForm(name, "link", k, np.array([-sign, 0.0, 0.0]), cone.half_angle)
        raise NotExpressible(f"the cone of joint {name} turns with a link whose twist positions do not show")
    if outward is None:
        raise NotExpressible(f"the cone of joint {name} limits a line of the end effector")
    if k == 0:
        return ConeForm(name, "carrier", k, axis, cone.half_angle)
    link = nodes[k].at - nodes[k - 1].at
    link = link / np.linalg.norm(link)
    if k <= draft.planar:
        across = np.cross(draft.normal, link)
        parts = np.array([axis @ link, axis @ across, axis @ draft.normal])
        return ConeForm(name, "link", k, parts, cone.half_angle)
    if _is_parallel(axis, link):
        parts = np.array([math.copysign(1.0, float(axis @ link)), 0.0, 0.0])
        return ConeForm(name, "link", k, parts, cone.half_angle)
    raise NotExpressible(f"the cone of joint {name} turns with a link whose twist positions do not show")
