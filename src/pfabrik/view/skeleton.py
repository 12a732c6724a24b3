"""The drawing of a mechanism as plain points, for pictures and the viewer: bodies, joints, rails, reference point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..answers.solution import Solution
from ..capabilities.clearance.solid_meshes import SolidMesh, solids_of
from ..common.arrays import Floats
from ..common.checks import require_type
from ..errors import InvalidArgument
from ..machine.common_centre import arc, common_centre
from ..machine.description.mechanism import Joint, Mechanism
from ..machine.description.sketch import Places, joint_places, joints_on, middle
from .drawn_parts import Part, Place, home_rail, is_flat, order_around, parts_of

ARC_STEPS = 12
"""Straight pieces that an arc is drawn with."""


@dataclass(frozen=True)
class Line:
    """A part of a body where it is.

    Attributes
    ----------
    part : the rule that it is drawn by.
    corners : its places, (k, 3) [length].
    outline : points (n, 3) [length] of the line between two corners, or around a plate, back to the first. Of a
        spherical linkage, an arc about its centre.
    """

    part: Part
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
    ground : corners (k, 3) [length] of the base, in order around it; none where fewer than three joints that have no
        rail are on it, or these are not in a plane.
    solids : the shapes of bodies that have one.
    """

    mechanism: Mechanism
    parts: tuple[Line, ...]
    marks: tuple[Mark, ...]
    rails: Floats
    reference: Floats
    ground: Floats
    solids: tuple[SolidMesh, ...] = ()

    @property
    def points(self) -> Floats:
        """Every point that is drawn, (n, 3) [length]; lines end at joints."""
        outlines = [line.outline for line in self.parts if line.part.kind == "arc" or line.part.role == "base"]
        places = [mark.place for mark in self.marks]
        solids = [solid.vertices for solid in self.solids]
        return np.concatenate([places, *outlines, self.rails.reshape(-1, 3), [self.reference], *solids])

    @property
    def joints_and_reference(self) -> Floats:
        """The places of all joints, then the reference point, (n, 3) [length]."""
        return np.array([*(mark.place for mark in self.marks), self.reference])

    @property
    def held(self) -> set[str]:
        """The joints whose limits are active."""
        return {mark.joint.name for mark in self.marks if mark.held_by}

    @property
    def lines(self) -> Floats:
        """Both ends of every line that is drawn, (k, 2, 3) [length]."""
        edges = [np.stack([line.outline[:-1], line.outline[1:]], axis=1) for line in self.parts]
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
    rails = [rail for joint in mechanism.joints if (rail := home_rail(mechanism, joint)) is not None]
    held: dict[str, list[str]] = {}
    for limit in () if solution is None else solution._limits[0]:
        held.setdefault(limit.joint, []).append(limit.bound)
    return Skeleton(
        mechanism,
        tuple(_line(mechanism, part, places, reference) for part in parts_of(mechanism) if part.kind in LINES),
        tuple(Mark(joint, places[joint.name], tuple(held.get(joint.name, ()))) for joint in mechanism.joints),
        np.reshape(rails, (-1, 2, 3)),
        np.array(reference),
        _ground(mechanism, places),
        solids_of(mechanism, solution) if mechanism.shapes else (),
    )


def _ground(mechanism: Mechanism, places: Places) -> Floats:
    """The corners of the base that is drawn as the ground; none where it has no plane."""
    on_base = [mechanism.joint(name) for name in joints_on(mechanism, mechanism.base)]
    corners = [places[joint.name] for joint in on_base if home_rail(mechanism, joint) is None]
    return np.array([corners[k] for k in order_around(corners)] if is_flat(mechanism, corners) else []).reshape(-1, 3)


def checked_shown(shown: object) -> tuple[Mechanism, Solution | None]:
    """The mechanism, and the answer if it is one."""
    if isinstance(shown, Mechanism):
        return shown, None
    solution = require_type("shown", shown, Solution, "a Mechanism, or one Solution of it")
    if solution.shape != ():
        raise InvalidArgument("shown", f"a batch of shape {solution.shape}", "one answer, such as solution[0]")
    if not np.isfinite(solution.pose).all():
        raise InvalidArgument("shown", "an answer that is INVALID", "a Mechanism, or one Solution of it")
    return solution.mechanism, solution


LINES = ("bar", "arc", "barrel", "plate")
"""Parts that are drawn as lines, and as faces; joints have marks, and rails are drawn as such."""


def _line(mechanism: Mechanism, part: Part, places: Places, reference: Floats) -> Line:
    """A part between its places."""
    corners = np.array([_place(end, places, reference) for end in part.ends])
    outline = corners
    if part.kind == "plate":
        outline = np.vstack([corners, corners[:1]])
    elif part.kind == "barrel":
        along = corners[1] - corners[0]
        corners = outline = corners[0] + np.array([[0.0], [part.length / (np.linalg.norm(along) or 1.0)]]) * along
    elif part.kind == "arc":
        centre = common_centre(mechanism)
        assert centre is not None
        outline = arc(corners[0], corners[1], centre, ARC_STEPS)
    return Line(part, corners, outline)


def _place(end: Place, places: Places, reference: Floats) -> Floats:
    if isinstance(end, np.ndarray):
        return end
    return middle([places[name] for name in end]) if end else reference
