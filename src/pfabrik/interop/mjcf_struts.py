"""Struts in a MuJoCo model: capsules whose length changes, as two geoms of fixed length, and as notes."""

from __future__ import annotations

import json
from collections.abc import Container, Iterator
from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..description.form_faults import shown
from ..description.graph import sliding_along
from ..description.joints import Joint
from ..description.mechanism import Mechanism, Shape
from ..kinematics import links_of
from ..tolerances import TOLERANCES
from .collision import Solid
from .xml_reading import fault

SLIDING = ("prismatic", "cylindrical")
"""Joints whose centre rests on one of their bodies only."""

STRUT = "strut"
"""What notes and geoms of struts are called: the note `strut.3` has the geoms `strut_3_1` and `strut_3_2`."""


class Half(NamedTuple):
    """The part of a strut that moves with one of its two bodies: its ends at home (2, 3), and its radius [length]."""

    name: str
    body: str
    ends: Floats
    radius: float


def struts_of(mechanism: Mechanism) -> dict[int, tuple[Joint, Joint]]:
    """Index of a shape -> the two joints that it is between, of capsules whose two ends do not move with one body."""
    links = links_of(mechanism) if mechanism.shapes else None
    struts = {}
    for k, names in enumerate(() if links is None else links.joints):
        joints = [mechanism.joint(name) for name in names]
        body = mechanism.shapes[k].body
        if any(body not in joint.connects or joint.type in SLIDING for joint in joints):
            struts[k] = (joints[0], joints[1])
    return struts


def halves_of(mechanism: Mechanism) -> Iterator[Half]:
    """Yield the halves of the struts that two capsules are exactly, at any length within the range.

    Each is as long as half the longest strut. Together they are the strut unless it is shorter than one of them: so the
    longest is at most twice the shortest.
    """
    for k, joints in struts_of(mechanism).items():
        length, bodies = _half_length(mechanism, mechanism.shapes[k], joints)
        if length == 0.0:
            continue
        ends = np.array([joint.at for joint in joints])
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        for side, (body, sign) in enumerate(zip(bodies, (1.0, -1.0), strict=True)):
            half = np.array([ends[side], ends[side] + sign * length * along])
            yield Half(f"{STRUT}_{k}_{side + 1}", body, half, 0.5 * mechanism.shapes[k].thickness)


def _half_length(mechanism: Mechanism, shape: Shape, joints: tuple[Joint, Joint]) -> tuple[float, tuple[str, ...]]:
    """Half of a strut's greatest length, and its two bodies; 0 where two halves would not be it."""
    nothing: tuple[float, tuple[str, ...]] = (0.0, ())
    parts = sliding_along(mechanism, shape.body)
    bodies = tuple(next((body for body in joint.connects if body in parts), "") for joint in joints)
    slides = [each for each in mechanism.joints if each.type == "prismatic" and set(each.connects) == set(bodies)]
    if any(joint.type in SLIDING for joint in joints) or len(set(bodies)) < 2 or len(slides) != 1:
        return nothing
    span = np.subtract(*(np.array(joint.at) for joint in reversed(joints)))
    length, axis = float(np.linalg.norm(span)), np.array(mechanism.home_axis(slides[0].name))
    if np.linalg.norm(np.cross(span, axis)) > TOLERANCES.alignment * length or slides[0].range is None:
        return nothing
    sign = np.sign(span @ axis) * (1.0 if slides[0].connects[1] == bodies[1] else -1.0)
    change = sign * (np.array(slides[0].range) - mechanism.home_coordinate(slides[0].name))
    shortest, longest = length + change.min(), length + change.max()
    return (0.5 * float(longest), bodies) if 0.5 * longest <= shortest else nothing


def strut_notes(mechanism: Mechanism, metres: float) -> Iterator[tuple[str, str]]:
    """Yield names and texts of the custom elements that tell of struts."""
    for k, joints in struts_of(mechanism).items():
        shape = mechanism.shapes[k]
        data = [shape.body, shape.thickness * metres, *(joint.name for joint in joints)]
        yield f"{STRUT}.{k}", json.dumps(data)


def read_struts(notes: dict[str, str]) -> Iterator[tuple[str, Solid]]:
    """Yield the number of each strut of a model's notes, and the strut as a solid [m]."""
    for name, text in notes.items():
        prefix, _, number = name.partition(".")
        if prefix == STRUT:
            try:
                body, thickness, first, second = json.loads(text)
                strut = Shape(str(body), thickness=float(thickness), between=(str(first), str(second)))
            except (ValueError, TypeError):
                expected = '["body", thickness in metres, "joint", "joint"]'
                raise fault(f"custom text '{name}'", shown(text), expected) from None
            yield number, Solid(strut, strut.body)


def is_half(name: str, struts: Container[str]) -> bool:
    """True if a geom is called as half of one of some struts, by their numbers."""
    prefix, _, rest = name.partition("_")
    return prefix == STRUT and rest.rpartition("_")[0] in struts
