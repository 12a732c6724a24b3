"""The collision geometry of a robot description (URDF) as solids of its links."""

from __future__ import annotations

from collections import Counter
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...errors import InvalidMechanism
from ...machine.description.body_masses import Mass, as_matrix
from .collision import MOST_SOLIDS, Collision, Solid, solid_shape
from .imported_masses import placed_mass
from .notes import Note, counted_names, note_names
from .sdf_links import pose_in
from .urdf_links import UrdfLinks, origin_of
from .xml_reading import numbers_in

SIZES: dict[str, tuple[str, ...]] = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}
"""Geometries that have a shape here -> the attributes that say how large they are. One more, and it is read."""


def read_collision(root: ET.Element, links: UrdfLinks, notes: list[Note]) -> Collision:
    """The collision geometry of a description [m], at zero, in the frame of the root; notes say what is left out."""
    parts = [(link.get("name", ""), part) for link in root.iter("link") for part in link.iterfind("collision")]
    count = len(parts)
    if count > MOST_SOLIDS:
        notes.append(Note(f"collision geometry is left out: {count} parts, of which at most {MOST_SOLIDS} are read"))
        return Collision()
    solids: list[Solid] = []
    left_out: Counter[str] = Counter()
    for name, element in parts:
        geometry, pose = element.find("geometry/*"), element.find("pose")
        kind = "geometry" if geometry is None else geometry.tag
        try:
            local, size = origin_of(element.find("origin")) @ pose_in(pose, "pose"), _size(geometry)
        except (ValueError, InvalidMechanism):
            left_out[f"{kind} without its numbers"] += 1
            continue
        if size is None or (pose is not None and pose.get("relative_to", name) != name):
            left_out[kind] += 1
        else:
            solids.append(Solid(solid_shape(name, kind, size, links.frames[name] @ local), name))
    note_names(notes, "collision geometry that has no shape here is left out", counted_names(left_out))
    return Collision(tuple(solids))


def read_masses(root: ET.Element, links: UrdfLinks, notes: list[Note]) -> list[Mass]:
    """The masses of a description [m], as of `read_collision`; links without one weigh nothing beside those with."""
    masses, left_out = [], []
    for link in root.iter("link"):
        name, element = link.get("name", ""), link.find("inertial")
        if element is None:
            masses.append(Mass(name, 0.0))
            continue
        place, moments = element.find("pose"), element.find("inertia")
        values = [_said(element.find("mass"), "value"), *(_said(moments, key) for key in MOMENTS)]
        numbers = numbers_in(" ".join(values), 7)
        try:
            frame = links.frames[name] @ origin_of(element.find("origin")) @ pose_in(place, "pose")
        except (ValueError, InvalidMechanism):
            numbers = None
        if numbers is None or (place is not None and place.get("relative_to", name) != name):
            left_out.append(name)
        else:
            masses.append(placed_mass(name, float(numbers[0]), frame, as_matrix(tuple(numbers[1:].tolist()))))
    note_names(notes, "masses without their numbers are left out, of", left_out)
    return masses if any(each.mass for each in masses) else []


MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def _said(element: ET.Element | None, key: str) -> str:
    """The text of an attribute, of an element within or of the element itself; 0 where there is none."""
    if element is None:
        return "0"
    return element.get(key) or element.findtext(key) or (element.text or "0" if key == "value" else "0")


def _size(geometry: ET.Element | None) -> Floats | None:
    """The size of a geometry, (3,), as `solid_shape` has it; None of another one, ValueError where it is no number."""
    if geometry is None or geometry.tag not in SIZES:
        return None
    texts = [geometry.get(key) or geometry.findtext(key) or "" for key in SIZES[geometry.tag]]
    values = numbers_in(" ".join(texts), 3 if geometry.tag == "box" else len(texts))
    if values is None:
        raise ValueError
    size = np.zeros(3)
    size[: len(values)] = values
    return size * (0.5 if geometry.tag == "box" else np.array([1.0, 0.5, 0.5]))
