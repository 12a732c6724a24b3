"""The collision geometry of a robot description (URDF) as solids of its links."""

from __future__ import annotations

from collections import Counter
from xml.etree import ElementTree as ET

import numpy as np

from ..arrays import Floats
from .collision import MOST_SOLIDS, Collision, Solid, solid_shape
from .notes import Note
from .urdf_links import UrdfLinks, frame_at, numbers_in

SIZES: dict[str, tuple[str, ...]] = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}
"""Geometries that have a shape here -> the attributes that say how large they are. One more, and it is read."""


def read_collision(root: ET.Element, links: UrdfLinks, notes: list[Note]) -> Collision:
    """The collision geometry of a description [m], at zero, in the frame of the root; notes say what is left out."""
    count = sum(1 for _ in root.iterfind("link/collision"))
    if count > MOST_SOLIDS:
        notes.append(Note(f"collision geometry is left out: {count} parts, of which at most {MOST_SOLIDS} are read"))
        return Collision()
    solids: list[Solid] = []
    left_out: Counter[str] = Counter()
    for link in root.iterfind("link"):
        name = link.get("name", "")
        for element in link.iterfind("collision"):
            geometry = element.find("geometry/*")
            kind = "geometry" if geometry is None else str(geometry.tag)
            try:
                local, size = _frame(element.find("origin")), _size(geometry)
            except ValueError:
                left_out[f"{kind} without its numbers"] += 1
                continue
            if size is None:
                left_out[kind] += 1
            else:
                solids.append(Solid(solid_shape(name, kind, size, links.frames[name] @ local), name))
    if left_out:
        counts = tuple(f"{kind} ({count})" for kind, count in sorted(left_out.items()))
        notes.append(Note("collision geometry that has no shape here is left out", counts))
    return Collision(tuple(solids))


def _frame(origin: ET.Element | None) -> Floats:
    """The frame of a geometry in that of its link, (4, 4) [m]; ValueError where it has other than three numbers."""
    texts = [(origin.get(key) if origin is not None else None) or "0 0 0" for key in ("xyz", "rpy")]
    if any(_finite(text).shape != (3,) for text in texts):
        raise ValueError
    return frame_at(*texts)


def _size(geometry: ET.Element | None) -> Floats | None:
    """The size of a geometry, (3,), as `solid_shape` has it; None of another one, ValueError where it is no number."""
    if geometry is None or geometry.tag not in SIZES:
        return None
    values = np.concatenate([_finite(geometry.get(key, "")) for key in SIZES[geometry.tag]])
    if len(values) != (3 if geometry.tag == "box" else len(SIZES[geometry.tag])):
        raise ValueError
    size = np.zeros(3)
    size[: len(values)] = values
    return size * (0.5 if geometry.tag == "box" else np.array([1.0, 0.5, 0.5]))


def _finite(text: str) -> Floats:
    """The numbers of a text; ValueError where one is none, or not finite."""
    values = numbers_in(text)
    if not np.isfinite(values).all():
        raise ValueError
    return values
