"""Joint centres along a chain: what turns at each, and which neighbours act as one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from ..arrays import Floats
from ..description.graph import Step
from ..description.home_mobility import universal_axes
from ..description.mechanism import Joint, Mechanism
from ..tolerances import TOLERANCES

_KINDS: dict[str, Literal["R", "U", "S"]] = {"revolute": "R", "universal": "U", "spherical": "S"}


class NotExpressible(Exception):
    """Positions alone cannot express this chain; the text says why."""


@dataclass
class Spot:
    """A joint centre on the way: what turns there, and the prismatic joint (if any) between it and the spot before."""

    kind: Literal["R", "U", "S", "point"]
    steps: list[Step]
    at: Floats
    axis: Floats | None = None
    slider: Step | None = None


def spots_along(mechanism: Mechanism, steps: Sequence[Step]) -> list[Spot]:
    """The joint centres along a branch, joints that act as one merged into one."""
    near = TOLERANCES.alignment * mechanism.characteristic_length
    spots = _merge(mechanism, _spots(steps, mechanism.end_effector_is_joint), near)
    _check_pointing(mechanism, spots)
    return spots


def _spots(steps: Sequence[Step], ends_in_point: bool) -> list[Spot]:
    """The joint centres along a branch, each with the prismatic joint before it."""
    spots: list[Spot] = []
    slider: Step | None = None
    for position, step in enumerate(steps):
        joint = step.joint
        if ends_in_point and position == len(steps) - 1:
            if joint.range is not None or joint.cone is not None:
                raise NotExpressible(f"joint {joint.name}, the end effector, has a limit that ties its chains together")
            spots.append(Spot("point", [], np.array(joint.at), None, slider))
            slider = None
        elif joint.type == "prismatic":
            if slider is not None:
                raise NotExpressible(f"two prismatic joints in a row, {slider.joint.name} and {joint.name}")
            slider = step
        elif joint.type == "cylindrical":
            raise NotExpressible(f"joint {joint.name} is cylindrical")
        else:
            if joint.type == "universal" and joint.range is not None:
                raise NotExpressible(f"joint {joint.name} has ranges about two axes")
            if joint.axes is not None and not _are_square(*map(np.array, joint.axes)):
                raise NotExpressible(f"joint {joint.name} turns about axes that are not square to each other")
            kind = _KINDS[joint.type]
            axis = np.array(joint.axis) if joint.type == "revolute" else None
            spots.append(Spot(kind, [step], np.array(joint.at), axis, slider))
            slider = None
    if slider is not None:
        raise NotExpressible(f"prismatic joint {slider.joint.name} carries the end effector")
    return spots


def _merge(mechanism: Mechanism, spots: list[Spot], near: float) -> list[Spot]:
    """Joints whose centres are no farther apart than `near` act as one: R+R = U, R+R+R = U+R = R+U = S.

    They do only if each axis is square to the next: about others they do not turn everywhere.
    """
    merged: list[Spot] = []
    for spot in spots:
        last = merged[-1] if merged else None
        centre = _common_centre(last, spot, near) if last is not None and spot.slider is None else None
        if last is None or centre is None:
            merged.append(spot)
            continue
        for step in last.steps + spot.steps:
            if step.joint.actuated or step.joint.range is not None or step.joint.cone is not None:
                raise NotExpressible(
                    f"joint {step.joint.name} shares its centre with a neighbour and has a motor or a limit of its own"
                )
        for (one, axis), (other, next_axis) in pairwise(_turns(mechanism, last.steps + spot.steps)):
            if not _are_square(axis, next_axis):
                raise NotExpressible(f"joints {one} and {other} turn about axes that are not square to each other")
        kind: Literal["U", "S"] = "U" if last.kind == spot.kind == "R" else "S"
        merged[-1] = Spot(kind, last.steps + spot.steps, centre, None, last.slider)
    return merged


def _common_centre(a: Spot, b: Spot, near: float) -> Floats | None:
    """Where two neighbouring joints act as one, or None."""
    if "point" in (a.kind, b.kind) or (a.kind == "S" and b.kind == "S"):
        return None
    if a.kind == b.kind == "R":
        assert a.axis is not None
        assert b.axis is not None
        across = np.cross(a.axis, b.axis)
        sine = float(np.linalg.norm(across))
        apart = b.at - a.at
        if sine < TOLERANCES.alignment or abs(float(apart @ across)) / sine > near:
            return None
        along_a = float(np.cross(apart, b.axis) @ across) / sine**2
        return np.asarray(a.at + along_a * a.axis)
    if {a.kind, b.kind} == {"R", "U"} and float(np.linalg.norm(a.at - b.at)) <= near:
        return a.at
    return None


def _check_pointing(mechanism: Mechanism, spots: Sequence[Spot]) -> None:
    """See that universal joints, and what acts as one, let their links point wherever their cones do.

    A link that is not square to the axis it carries, off by an angle, cannot come nearer than that angle to the other
    axis. Axes that are not given may be square to the link on the other side of the joint.
    """
    for k, spot in enumerate(spots):
        if spot.kind != "U" or len(spots) < 2:
            continue
        first, is_last = spot.steps[0], k == len(spots) - 1
        line = spots[k - 1 if is_last else k + 1].at - spot.at
        axes = [axis for _, axis in _turns(mechanism, spot.steps)]
        other, carried = reversed(axes) if is_last else axes
        along, length = abs(float(carried @ line)), float(np.linalg.norm(line))
        if length == 0.0 or along <= TOLERANCES.alignment * length:
            continue
        body = first.back.inward if is_last else first.inward
        if _nearest_to(first.joint, body, other) < math.asin(min(along / length, 1.0)):
            name = spot.steps[-1].joint.name
            raise NotExpressible(f"joint {name} does not point anywhere: its link is not square to its axis")


def _nearest_to(joint: Joint, body: str, axis: Floats) -> float:
    """How near the cone of a universal joint lets its line come to the axis on a body [rad]; 0 where nothing does."""
    cone = joint.cone
    if cone is None or cone.fixed_to != body:
        return 0.0
    return math.acos(min(abs(float(np.array(cone.axis) @ axis)), 1.0)) - cone.half_angle


def _turns(mechanism: Mechanism, steps: Sequence[Step]) -> list[tuple[str, Floats]]:
    """The axes of revolute and universal joints in a row, outward, with the names of their joints."""
    turns: list[tuple[str, Floats]] = []
    for step in steps:
        joint = step.joint
        axes = [np.array(joint.axis)] if joint.type == "revolute" else list(universal_axes(mechanism, joint))
        turns += [(joint.name, axis) for axis in (axes if step.forward else reversed(axes))]
    return turns


def _are_square(axis: Floats, other: Floats) -> bool:
    return abs(float(axis @ other)) <= TOLERANCES.alignment
