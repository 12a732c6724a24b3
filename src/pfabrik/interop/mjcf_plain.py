"""A MuJoCo model reduced to its kinematics: no file but its own is needed to compile what is left of it."""

from __future__ import annotations

from collections import Counter
from typing import Any
from xml.etree import ElementTree as ET

from .opened import Note
from .xml_reading import fault

PLACE = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler")
KEPT: dict[str, tuple[str, ...]] = {
    "compiler": ("angle", "autolimits", "eulerseq"),
    "default": ("class",),
    "body": ("name", "childclass", *PLACE),
    "frame": ("name", "childclass", *PLACE),
    "replicate": ("count", "offset", "euler", "sep", "childclass"),
    "joint": ("name", "class", "type", "pos", "axis", "range", "limited", "ref"),
    "freejoint": ("name",),
    "site": ("name", "class", "type", "size", "fromto", *PLACE),
    "connect": ("name", "body1", "body2", "anchor", "site1", "site2", "active"),
    "weld": ("name", "body1", "body2", "anchor", "relpose", "site1", "site2", "active", "torquescale"),
    "key": ("name", "qpos"),
}
"""Elements that say something of the kinematics, and those of their attributes that do."""

IN_DEFAULTS = ("default", "joint", "site")
REFUSED = {
    "attach": "a model that attaches others",
    "composite": "a composite body",
    "flexcomp": "a flexible body",
}
"""Elements that make bodies in a way that is not followed."""

MOST_COPIES = 1000
"""Most copies that `replicate` may make, of copies too."""

UNTOLD = ("inertial", "light", "camera", "plugin")
"""Elements inside bodies that nobody would look for in a mechanism."""


def plain_model(root: ET.Element, told: list[Note]) -> ET.Element:
    """The kinematics of a model, and the notes of what is left out, by name."""
    plain = ET.Element("mujoco")
    compiler = ET.SubElement(plain, "compiler")
    left: Counter[str] = Counter()
    for section in root:
        if section.tag == "compiler":
            compiler.attrib.update(_attributes(section))
        elif section.tag == "default":
            plain.append(_kept(section, left, IN_DEFAULTS))
        elif section.tag in ("worldbody", "keyframe"):
            plain.append(_kept(section, left))
        elif section.tag == "equality":
            plain.append(_equalities(section, told))
        elif section.tag == "actuator":
            plain.append(_actuators(section, told))
        elif section.tag in ("tendon", "contact", "deformable", "sensor"):
            names = tuple(child.get("name", f"a {child.tag}") for child in section)
            if names:
                told.append(Note(f"{section.tag}s are left out", names))
        elif section.tag == "asset":
            left.update(child.tag for child in section)
    compiler.attrib |= {"boundmass": "1", "boundinertia": "1"}  # what moves has a mass; which one does not matter
    shown = [f"{tag} ({count})" for tag, count in sorted(left.items()) if tag not in UNTOLD]
    if shown:
        told.append(Note("left out, for they do not move anything", tuple(shown)))
    springs = tuple(joint.get("name", "a joint") for joint in root.iter("joint") if _number(joint, "stiffness"))
    if springs:
        told.append(Note("springs are left out, of", springs))
    return plain


def compiled(text: str) -> Any:
    """The MuJoCo model of a text, whose sites are where it puts them.

    MuJoCo takes frames that are less than 1e-6 apart, in whatever unit, for one; asked not to, it computes both.
    """
    import mujoco

    model: Any = mujoco.MjModel.from_xml_string(text)
    model.site_sameframe[:] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
    return model


def _kept(element: ET.Element, left: Counter[str], tags: tuple[str, ...] = tuple(KEPT), copies: int = 1) -> ET.Element:
    """An element with what counts of it and inside it."""
    if element.tag == "replicate":
        copies *= max(1, int(_number(element, "count")))
        if copies > MOST_COPIES:
            raise fault("replicate", f"{copies} copies", f"at most {MOST_COPIES}")
    kept = ET.Element(element.tag, _attributes(element))
    for child in element:
        if child.tag in REFUSED:
            raise fault(str(child.tag), REFUSED[child.tag], "bodies one by one, as MuJoCo saves a compiled model")
        if child.tag in tags:
            kept.append(_kept(child, left, tags, copies))
        elif tags != IN_DEFAULTS:
            left[child.tag] += 1
    return kept


def _attributes(element: ET.Element) -> dict[str, str]:
    return {key: value for key, value in element.attrib.items() if key in KEPT.get(element.tag, ())}


def _equalities(section: ET.Element, told: list[Note]) -> ET.Element:
    """Those that close loops; couplings of joints and the rest are told."""
    kept = ET.Element("equality")
    for child in section:
        if child.tag in ("connect", "weld"):
            kept.append(ET.Element(child.tag, _attributes(child)))
        elif child.tag == "joint":
            pair = tuple(child.get(key, "") for key in ("joint1", "joint2") if child.get(key))
            what = "a coupling is left out: these joints move freely" if len(pair) > 1 else "is not held where it was"
            told.append(Note(what, pair))
        else:
            told.append(Note(f"an equality of a {child.tag} is left out", (child.get("name", "without a name"),)))
    return kept


def _actuators(section: ET.Element, told: list[Note]) -> ET.Element:
    """Every actuator of a joint, whatever its gains; the others are told."""
    kept = ET.Element("actuator")
    for child in section:
        joint = child.get("joint") or child.get("jointinparent")
        if joint:
            ET.SubElement(kept, "general", joint=joint)
        else:
            told.append(Note("an actuator of no joint is left out", (child.get("name", f"a {child.tag}"),)))
    return kept


def _number(element: ET.Element, key: str) -> float:
    """The value of an attribute; 0 where it is none."""
    try:
        return float(element.get(key, "0").split()[0])
    except (ValueError, IndexError):
        return 0.0
