"""The collision geometry of a MuJoCo model: those of its geoms that touch something, as solids of their bodies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from .collision import EVERYTHING, MOST_SOLIDS, Collision, Solid, solid_shape
from .mjcf_model import MjcfModel, frame_of
from .mjcf_plain import IN_BODIES, kept
from .notes import Note, counted_names, note_names
from .xml_reading import number

SOLIDS = ("sphere", "capsule", "box", "cylinder")
"""Types of geoms that have a shape here. One more, and it is read: `solid_shape` says what becomes of it."""

UNBOUNDED = ("plane", "hfield")
"""Types of geoms that are no part of a robot."""

OWN_GROUP = 3
"""The group of geoms that `to_mjcf` writes shapes in, and in which others keep what collides, too."""


class Geom(NamedTuple):
    """A geom of the file.

    Attributes
    ----------
    kind : its type; "mesh" too where a primitive is fitted to one.
    touches : True if it collides with something, by its bits or by a pair.
    copies : how many `replicate` makes of it.
    weighs : False if its mass or density is 0.
    """

    element: ET.Element
    kind: str
    touches: bool
    group: str
    copies: int
    weighs: bool


def read_collision(root: ET.Element, model: MjcfModel, is_ours: bool, notes: list[Note]) -> Collision:
    """The collision geometry of a model [m], at its configuration; notes say what is left out.

    Geoms that touch nothing are there to be seen. But where all of them touch nothing, or where `to_mjcf` wrote the
    model, those of group 3 are the collision geometry.

    Parameters
    ----------
    model : the kinematics of the model, compiled; its bodies are those of the file.
    """
    named = [(pair.get("geom1", ""), pair.get("geom2", "")) for pair in root.iterfind("contact/pair")]
    pairs = frozenset(frozenset(pair) for pair in named if all(pair))
    paired = {name for pair in pairs for name in pair}
    geoms = list(geoms_of(root, paired))
    by_group = is_ours or not any(geom.touches and geom.kind not in UNBOUNDED for geom in geoms)
    colliding = [geom for geom in geoms if geom.touches or (by_group and geom.group == str(OWN_GROUP))]
    if len(colliding) < len(geoms) and not is_ours:
        notes.append(Note(f"geoms that touch nothing are left out ({len(geoms) - len(colliding)})"))
    other = Counter(geom.kind for geom in colliding if geom.kind not in SOLIDS)
    note_names(notes, "geoms of types that have no shape here are left out", counted_names(other))
    chosen = {id(geom.element) for geom in colliding if geom.kind in SOLIDS}
    count = sum(geom.copies for geom in colliding if geom.kind in SOLIDS)
    if count > MOST_SOLIDS:
        notes.append(Note(f"collision geometry is left out: {count} geoms, of which at most {MOST_SOLIDS} are read"))
        return Collision()
    excluded = tuple((each.get("body1", ""), each.get("body2", "")) for each in root.iterfind("contact/exclude"))
    solids = _solids(root, chosen, model, notes) if chosen else ()
    return Collision(tuple(each if each.name in paired else _with_bits(each) for each in solids), excluded, pairs)


def _with_bits(solid: Solid) -> Solid:
    """A solid that was chosen by its group as one that touches everything."""
    is_without = solid.contype == 0 and solid.conaffinity == 0
    return replace(solid, contype=EVERYTHING, conaffinity=EVERYTHING) if is_without else solid


def geoms_of(root: ET.Element, paired: set[str]) -> Iterator[Geom]:
    """Yield the geoms of all bodies, with what they inherit from classes."""
    classes: dict[str, Mapping[str, str]] = {"main": {}}
    for section in root.iterfind("default"):
        _read_classes(section, "main", classes)
    waiting = [(section, "main", 1) for section in root.iterfind("worldbody")]
    while waiting:
        element, class_, copies = waiting.pop()
        if element.tag == "replicate":
            copies *= max(1, int(number(element, "count")))
        for child in element:
            if child.tag == "geom":
                given = {**classes.get(child.get("class", class_), {}), **child.attrib}
                is_mesh = "mesh" in given or given.get("type") in ("mesh", "sdf")
                kind = "mesh" if is_mesh else "hfield" if "hfield" in given else given.get("type", "sphere")
                bits = [given.get(key, "1").strip() for key in ("contype", "conaffinity")]
                touches = bits != ["0", "0"] or given.get("name", "") in paired
                weighs = given.get("mass", given.get("density", "1")).strip().strip("0.") != ""
                yield Geom(child, kind, touches, given.get("group", "0").strip(), copies, weighs)
            elif child.tag in IN_BODIES:
                waiting.append((child, child.get("childclass", class_), copies))


def _read_classes(section: ET.Element, parent: str, classes: dict[str, Mapping[str, str]]) -> None:
    """Fill the attributes of geoms of a class and of the classes in it."""
    name = section.get("class", parent)
    attributes = {**classes.get(parent, {}), **classes.get(name, {})}
    for geom in section.iterfind("geom"):
        attributes |= geom.attrib
    classes[name] = attributes
    for inner in section.iterfind("default"):
        _read_classes(inner, name, classes)


def _solids(root: ET.Element, chosen: set[int], model: MjcfModel, notes: list[Note]) -> Iterator[Solid]:
    """Yield the chosen geoms as solids: MuJoCo places them on their bodies, in a model without joints and meshes."""
    mujoco = model.mujoco
    plain = ET.Element("mujoco")

    def is_kept(each: ET.Element, in_defaults: bool) -> bool:
        return each.tag in ("default", "geom") if in_defaults else each.tag in IN_BODIES or id(each) in chosen

    for section in root:
        if section.tag in ("compiler", "default", "worldbody"):
            plain.append(kept(section, Counter(), is_kept))
    try:
        geoms: Any = mujoco.MjModel.from_xml_string(ET.tostring(plain, encoding="unicode"))
    except ValueError as error:
        reason = str(error).replace("\n", " ").strip()
        notes.append(Note(f"collision geometry is left out, for MuJoCo does not compile it ({reason})"))
        return
    for index in range(geoms.ngeom):
        body = int(geoms.geom_bodyid[index])
        kind = mujoco.mjtGeom(int(geoms.geom_type[index])).name.removeprefix("mjGEOM_").lower()
        frame = frame_on(model, body, geoms.geom_pos[index], geoms.geom_quat[index])
        shape = solid_shape(model.body(body), kind, geoms.geom_size[index], frame)
        bits = int(geoms.geom_contype[index]), int(geoms.geom_conaffinity[index])
        yield Solid(shape, shape.body, str(geoms.geom(index).name), *bits)


def frame_on(model: MjcfModel, body: int, at: Floats, quat: Floats) -> Floats:
    """A frame (4, 4) in the world, from where it is on a body: its origin (3,) and its rotation (4,)."""
    turn = np.empty(9)
    model.mujoco.mju_quat2Mat(turn, quat)
    return frame_of(model.data.xpos[body], model.data.xmat[body]) @ frame_of(at, turn)
