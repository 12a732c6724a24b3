"""The drawing of a mechanism as plain points, for pictures and the viewer: bodies, joints, rails, reference point."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np

from .answers.solution import Solution
from .arrays import Floats
from .clearance.solid_meshes import SolidMesh, solids_of
from .description.common_centre import arc, common_centre, is_around
from .description.mechanism import Joint, Mechanism
from .description.places import Places, joint_places, joints_on, middle
from .errors import InvalidArgument

Role: TypeAlias = Literal["base", "platform", "link"]

SAME_ANGLE = 6
"""Digits to which angles about a body's middle count [rad]: equal ones keep the order of the description."""

ARC_STEPS = 12
"""Straight pieces that an arc is drawn with."""


@dataclass(frozen=True)
class BodyShape:
    """A body through its joints.

    Attributes
    ----------
    corners : where its joints are, (k, 3) [length], in order.
    outline : points (n, 3) [length] of a line between two corners, or around a face of three and more, back to the
        first. Of a spherical linkage, arcs about its centre.
    """

    body: str
    role: Role
    corners: Floats
    outline: Floats


@dataclass(frozen=True)
class Mark:
    """A joint where it is drawn, (3,) [length], with the limits that hold the answer back there: "max", "cone"."""

    joint: Joint
    place: Floats
    held_by: tuple[str, ...]


@dataclass(frozen=True)
class Skeleton:
    """One configuration as it is drawn, in the base frame.

    Attributes
    ----------
    rails : both ends of the travel of every prismatic joint on the base, (k, 2, 3) [length].
    stem : from amid the joints that carry the reference point to it, (2, 3); None where the end effector is a joint.
    solids : the shapes of bodies that have one.
    """

    mechanism: Mechanism
    parts: tuple[BodyShape, ...]
    marks: tuple[Mark, ...]
    rails: Floats
    reference: Floats
    stem: Floats | None
    solids: tuple[SolidMesh, ...] = ()

    @property
    def points(self) -> Floats:
        """Every point that is drawn, (n, 3) [length]."""
        outlines = [part.outline for part in self.parts]
        places = [mark.place for mark in self.marks]
        solids = [solid.vertices for solid in self.solids]
        return np.concatenate([places, *outlines, self.rails.reshape(-1, 3), [self.reference], *solids])

    @property
    def is_held(self) -> bool:
        """True if a limit is active."""
        return any(mark.held_by for mark in self.marks)

    @property
    def lines(self) -> Floats:
        """Both ends of every line that is drawn, (k, 2, 3) [length]."""
        edges = [np.stack([part.outline[:-1], part.outline[1:]], axis=1) for part in self.parts]
        return np.concatenate([*edges, self.rails])


def skeleton_of(shown: Mechanism | Solution) -> Skeleton:
    """The skeleton of a mechanism at home, or of one answer.

    A prismatic joint without a centre is drawn at its carriage, or between its neighbours; one on the base has a rail.

    Raises
    ------
    InvalidArgument : what is neither, a batch, or an answer without a configuration (INVALID).
    """
    mechanism, solution = checked_shown(shown)
    reference = mechanism.home_pose[:3, 3] if solution is None else solution.pose[:3, 3]
    places = joint_places(mechanism, None if solution is None else solution.points, reference)
    rails = {joint.name: rail for joint in mechanism.joints if (rail := rail_of(joint, places, shown)) is not None}
    held: dict[str, list[str]] = {}
    for limit in () if solution is None else solution._limits[0]:
        held.setdefault(limit.joint, []).append(limit.bound)
    ends = [places[name] for name in joints_on(mechanism, mechanism.end_effector)]
    centre = common_centre(mechanism)
    return Skeleton(
        mechanism,
        tuple(_shape(mechanism, body, places, rails, centre) for body in mechanism.bodies),
        tuple(Mark(joint, places[joint.name], tuple(held.get(joint.name, ()))) for joint in mechanism.joints),
        np.reshape(list(rails.values()), (-1, 2, 3)),
        np.array(reference),
        None if mechanism.end_effector_is_joint else np.array([middle(ends), reference]),
        solids_of(mechanism, solution) if mechanism.shapes else (),
    )


def checked_shown(shown: object) -> tuple[Mechanism, Solution | None]:
    """The mechanism, and the answer if it is one."""
    if isinstance(shown, Mechanism):
        return shown, None
    expected = "a Mechanism, or one Solution of it"
    if not isinstance(shown, Solution):
        raise InvalidArgument("shown", type(shown).__name__, expected)
    if shown.shape != ():
        raise InvalidArgument("shown", f"a batch of shape {shown.shape}", "one answer, such as solution[0]")
    if not np.isfinite(shown.pose).all():
        raise InvalidArgument("shown", "an answer that is INVALID", expected)
    return shown.mechanism, shown


def rail_of(joint: Joint, places: Places, shown: Mechanism | Solution) -> Floats | None:
    """Both ends (2, 3) of the travel of a prismatic joint on the base; None for any other, and without limits."""
    mechanism = shown if isinstance(shown, Mechanism) else shown.mechanism
    if joint.type != "prismatic" or joint.along or joint.range is None or mechanism.base not in joint.connects:
        return None
    bounds = np.array(joint.range, float)
    if not np.isfinite(bounds).all():
        return None
    value = mechanism.home_coordinate(joint.name) if isinstance(shown, Mechanism) else shown.joints[joint.name]
    outward = np.array(mechanism.home_axis(joint.name)) * (1.0 if joint.connects[0] == mechanism.base else -1.0)
    return np.asarray(places[joint.name] + (bounds - value)[:, None] * outward)


def around(points: list[Floats]) -> list[Floats]:
    """Points in the order of their angles about their middle, in the plane that they span most of."""
    offsets = np.array(points) - middle(points)
    first, second = np.linalg.svd(offsets, full_matrices=False)[2][:2]
    angles = np.arctan2(offsets @ second, offsets @ first)
    return [points[index] for index in np.argsort(angles.round(SAME_ANGLE), kind="stable")]


def _shape(
    mechanism: Mechanism, body: str, places: Places, rails: dict[str, Floats], centre: Floats | None
) -> BodyShape:
    """A body between its joints; the base is held at the middle of its rails, so that it rests where they move."""
    is_base = body == mechanism.base
    names = joints_on(mechanism, body)
    points = [rails[name].mean(axis=0) if is_base and name in rails else places[name] for name in names]
    corners = np.array(around(points) if len(points) >= 3 else points)
    turns = centre if centre is not None and is_around(mechanism, names, centre) else None
    return BodyShape(body, _role(mechanism, body), corners, _outline(corners, turns))


def _outline(corners: Floats, centre: Floats | None) -> Floats:
    """Lines from corner to corner (k, 3), or arcs about a centre; back to the first where there are three and more."""
    ends = np.vstack([corners, corners[:1]]) if len(corners) > 2 else corners
    if centre is None:
        return ends
    arcs = [arc(start, end, centre, ARC_STEPS) for start, end in pairwise(ends)]
    return np.vstack([ends[:1], *[points[1:] for points in arcs]])


def _role(mechanism: Mechanism, body: str) -> Role:
    if body == mechanism.base:
        return "base"
    return "platform" if body == mechanism.end_effector else "link"
