"""MuJoCo models of kinematics alone: of a MuJoCo model, or of a robot description and its loops."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Iterable, Mapping
from copy import deepcopy
from xml.etree import ElementTree as ET

from ...common.arrays import Floats
from ...errors import InvalidMechanism
from .loops_file import LinkLoop
from .notes import Note, counted_names, note_names
from .told_loops import unread_loops
from .urdf_links import UrdfJoint, UrdfLinks
from .xml_reading import fault, number, number_text

PLACE = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler")
BY_GEOMS = ("inertiafromgeom", "inertiagrouprange")
WEIGHING = ("mass", "density", "shellinertia", "group")
OWN = ("armature", "frictionloss", "damping", "actuatorfrcrange", "actuatorfrclimited")
DRIVING = ("class", "gear", "ctrlrange", "ctrllimited", "forcerange", "forcelimited", "armature", "damping")
TENDON = ("name", "class", "limited", "range", "frictionloss", "damping", "armature")
KEPT: dict[str, tuple[str, ...]] = {
    "compiler": ("angle", "autolimits", "balanceinertia", "boundinertia", "boundmass", "eulerseq", *BY_GEOMS),
    "default": ("class",),
    "body": ("name", "childclass", *PLACE),
    "frame": ("name", "childclass", *PLACE),
    "replicate": ("count", "offset", "euler", "sep", "childclass"),
    "joint": ("name", "class", "type", "pos", "axis", "range", "limited", "ref", *OWN),
    "freejoint": ("name",),
    "inertial": ("mass", "diaginertia", "fullinertia", *PLACE),
    "geom": ("name", "class", "type", "size", "fromto", "contype", "conaffinity", *WEIGHING, *PLACE),
    "site": ("name", "class", "type", "size", "fromto", *PLACE),
    "equality": ("active",),
    "connect": ("name", "class", "body1", "body2", "anchor", "site1", "site2", "active"),
    "weld": ("name", "class", "body1", "body2", "anchor", "relpose", "site1", "site2", "active", "torquescale"),
    "joint of equality": ("name", "class", "joint1", "joint2", "polycoef", "active"),
    "general": (*DRIVING, "dyntype", "gaintype", "biastype", "gainprm"),
    "motor": DRIVING,
    "position": DRIVING,
    "velocity": DRIVING,
    "tendon": TENDON,
    "spatial": TENDON,
    "key": ("name", "qpos"),
}
"""Elements of the kinematics, and geoms -> their attributes that are kept."""

ACTUATORS = ("general", "motor", "position", "velocity")
"""Actuators whose limits are read."""

ALL_ACTUATORS = (
    *ACTUATORS, "intvelocity", "orientation", "pid", "damper", "cylinder", "muscle", "adhesion", "dcmotor"
)  # fmt: skip
"""Kinds of actuators, but for those of plugins."""

IN_DEFAULTS = ("default", "joint", "site", "equality", "tendon", *ACTUATORS)
IN_BODIES = ("body", "frame", "replicate")
REFUSED = {"attach": "a model that attaches others", "composite": "a composite body", "flexcomp": "a flexible body"}
"""Elements that make bodies in ways that are not read -> their description."""

TRANSMISSIONS = ("tendon", "site", "body", "slidersite", "cranksite")
"""Attributes that say what an actuator drives in place of a joint."""

LEAST = "1e-9"
"""Mass [kg], and moment of inertia [kg m²], of a body for which the file has none."""

STILL = ("option", "size", "visual", "statistic", "custom", "extension", "include")
"""Sections that neither move nor hold anything."""

UNNOTED = ("light", "camera", "plugin", "geom")
"""Elements inside bodies that nobody would look for in a mechanism, and geoms, which `mjcf_geoms` reads."""


def plain_model(root: ET.Element, notes: list[Note]) -> ET.Element:
    """The kinematics of a model; notes name what is left out."""
    plain = ET.Element("mujoco")
    compiler = ET.SubElement(plain, "compiler")
    ET.SubElement(compiler, "lengthrange", mode="none")  # of muscles, which MuJoCo would simulate
    omitted: Counter[str] = Counter()
    straight = straight_tendons(root)
    for section in root:
        if section.tag == "compiler":
            compiler.attrib.update(_attributes(section))
        elif section.tag in ("default", "worldbody", "keyframe"):
            plain.append(kept(section, omitted, _is_kinematic))
        elif section.tag == "equality":
            plain.append(_equalities(section, notes))
        elif section.tag == "actuator":
            plain.append(_actuators(section, {each.get("name", "") for each in straight}, notes))
        elif section.tag in ("tendon", "contact", "deformable", "sensor"):
            others = [child for child in section if child.tag not in ("pair", "exclude") and child not in straight]
            for child in others if section.tag == "tendon" else []:
                _require_unlimited(child, root)
            nameless = Counter(child.tag for child in others if not child.get("name"))
            names = (*filter(None, (child.get("name") for child in others)), *counted_names(nameless))
            note_names(notes, f"{section.tag}s are left out", names)
        elif section.tag == "asset":
            omitted.update(child.tag for child in section)
        elif section.tag not in STILL:
            bodies = {body.get("name", "") for body in root.iter("body")} | {"world"}
            for each in unread_loops(section, bodies, "world", (), "connect, weld or joint of an equality"):
                raise InvalidMechanism([each])
    plain.append(_tendons(straight))
    compiler.attrib |= {"boundmass": LEAST, "boundinertia": LEAST}  # what moves has a mass; which one does not matter
    noted = Counter({tag: count for tag, count in omitted.items() if tag not in UNNOTED})
    note_names(notes, "left out, for they do not move anything", counted_names(noted))
    springs = (joint.get("name", "a joint") for joint in root.iter("joint") if number(joint, "stiffness"))
    note_names(notes, "springs are left out, of", springs)
    return plain


SEEN = ("geom", "camera", "light", "plugin", "mesh", "material", "texture", "pair", "tendon")
"""Elements that need other files, or are seen, touched or pulled."""


def bare_model(root: ET.Element) -> ET.Element:
    """A model with all that it says of bodies, joints and equalities, as MuJoCo itself reads it.

    What is left out is listed here, and not what is kept, as `plain_model` does: so `verify` does not read with the
    eyes of the importer.
    """
    bare = ET.Element("mujoco")
    for section in root:
        if section.tag in ("compiler", "default", "worldbody", "equality", "keyframe"):
            bare.append(deepcopy(section))
    for element in list(bare.iter()):
        for child in [each for each in element if each.tag in (*SEEN, *ALL_ACTUATORS)]:
            if element.tag != "equality":
                element.remove(child)
        if element.tag == "site":
            element.attrib = {key: text for key, text in element.attrib.items() if key not in ("material", "mesh")}
    for section in bare.iterfind("equality"):
        for child in [each for each in section if each.tag not in ("connect", "weld", "joint")]:
            section.remove(child)
    for key in bare.iter("key"):
        key.attrib = {name: text for name, text in key.attrib.items() if name in KEPT["key"]}
    kept = ET.SubElement(bare, "actuator")
    for joint in filter(None, (each.get("joint") for each in root.iterfind("actuator/*"))):
        ET.SubElement(kept, "motor", joint=joint)
    ET.SubElement(bare, "compiler", boundmass=LEAST, boundinertia=LEAST, fusestatic="false", settotalmass="-1")
    return bare


def kept(element: ET.Element, omitted: Counter[str], is_kept: Callable[[ET.Element, bool], bool]) -> ET.Element:
    """An element, with its attributes that are known and those of its descendants that are kept.

    Parameters
    ----------
    omitted : the others, which are counted.
    is_kept : of an element, and whether it is one of defaults.
    """
    copy = ET.Element(element.tag, _attributes(element))
    for child in element:
        if child.tag in REFUSED:
            raise fault(str(child.tag), REFUSED[child.tag], "bodies one by one, as MuJoCo saves a compiled model")
        if is_kept(child, element.tag == "default"):
            copy.append(kept(child, omitted, is_kept))
        elif element.tag != "default":
            omitted[child.tag] += 1
    return copy


def _is_kinematic(element: ET.Element, in_defaults: bool) -> bool:
    return element.tag in (IN_DEFAULTS if in_defaults else KEPT) and element.tag != "geom"


def _attributes(element: ET.Element, kind: str | None = None) -> dict[str, str]:
    """Attributes that are kept: of an element of a kind, or of its tag."""
    known = KEPT.get(kind or "", KEPT.get(element.tag, ()))
    return {key: value for key, value in element.attrib.items() if key in known}


def _equalities(section: ET.Element, notes: list[Note]) -> ET.Element:
    """The equalities that close loops or couple joints; notes name the rest."""
    kept = ET.Element("equality")
    for child in section:
        if child.tag in ("connect", "weld", "joint"):
            kept.append(ET.Element(child.tag, _attributes(child, f"{child.tag} of equality")))
        elif child.get("active") == "false":
            notes.append(Note(f"an equality of a {child.tag} is left out", (child.get("name", "without a name"),)))
        else:
            place = f"equality <{child.tag}> '{child.get('name', '')}'"
            raise fault(place, "a bond that is not read", "connect, weld or joint, or a model without it")
    return kept


def straight_tendons(root: ET.Element) -> list[ET.Element]:
    """The tendons between two sites alone that an actuator pulls, or whose length is limited; no sites that meet."""
    driven = {each.get("tendon") for each in root.iterfind("actuator/*")}
    meeting = [{each.get("site1"), each.get("site2")} for each in root.iterfind("equality/*")]
    straight = [each for each in root.iterfind("tendon/spatial") if [child.tag for child in each] == ["site", "site"]]
    apart = [each for each in straight if {site.get("site") for site in each} not in meeting]
    return [each for each in apart if each.get("name", "") in driven or _is_limited(each, root)]


def _tendons(straight: Iterable[ET.Element]) -> ET.Element:
    """Straight tendons, with what limits and brakes them."""
    kept = ET.Element("tendon")
    for tendon in straight:
        copy = ET.SubElement(kept, "spatial", _attributes(tendon))
        for site in tendon:
            ET.SubElement(copy, "site", site=site.get("site", ""))
    return kept


def _is_limited(tendon: ET.Element, root: ET.Element) -> bool:
    """True for a tendon whose length is limited: it holds its joints or bodies together."""
    defaults = [each for each in root.iter("default") if each.get("class", "main") == tendon.get("class", "main")]
    said = {key: text for each in defaults for kind in each.iterfind("tendon") for key, text in kind.attrib.items()}
    said |= tendon.attrib
    return said.get("limited", "auto") == "true" or ("range" in said and said.get("limited") != "false")


def _require_unlimited(tendon: ET.Element, root: ET.Element) -> None:
    """Refuse a tendon whose length is limited, and which is not read."""
    if _is_limited(tendon, root):
        place, way = f"tendon <{tendon.tag}> '{tendon.get('name', '')}'", "a straight tendon between two sites"
        raise fault(place, "a limit of its length, which is not read", f"connect, weld or joint, or {way}")


def _actuators(section: ET.Element, straight: Container[str], notes: list[Note]) -> ET.Element:
    """The actuators of joints and of straight tendons, with what limits their forces; notes name the others."""
    kept = ET.Element("actuator")
    for child in section:
        target = target_of(child, straight)
        if target:
            kind = child.tag if child.tag in ACTUATORS else "position"  # whose control is no force either
            ET.SubElement(kept, kind, _attributes(child, kind) | target)
        else:
            notes.append(Note("an actuator of what is not read is left out", (transmission_text(child),)))
    return kept


def target_of(actuator: ET.Element, straight: Container[str]) -> dict[str, str]:
    """The joint, or the straight tendon, that an actuator drives, as its attribute; empty where it is neither."""
    joint, tendon = actuator.get("joint") or actuator.get("jointinparent"), actuator.get("tendon", "")
    return {"joint": joint} if joint else {"tendon": tendon} if tendon and tendon in straight else {}


def transmission_text(actuator: ET.Element) -> str:
    """Name of an actuator, and what it drives: ``winch (through tendon cable)``."""
    name = actuator.get("name", f"a {actuator.tag}")
    driven = [f"{key} {actuator.get(key)}" for key in TRANSMISSIONS if actuator.get(key)]
    return f"{name} (through {' and '.join(driven)})" if driven else name


MUJOCO_TYPES = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball"}


def plain_robot(links: UrdfLinks, loops: Iterable[LinkLoop]) -> ET.Element:
    """A description as a MuJoCo model; its loops as `connect` and `weld`."""
    plain = ET.Element("mujoco")
    # roll, pitch and yaw are about fixed axes; what moves has a mass, which one does not matter
    ET.SubElement(plain, "compiler", angle="radian", eulerseq="XYZ", boundmass="1", boundinertia="1")
    world, equality = ET.SubElement(plain, "worldbody"), ET.SubElement(plain, "equality")
    root = {"name": links.root, **_place(links.frames[links.root])}
    bodies = {links.root: world if links.root == "world" else ET.SubElement(world, "body", root)}
    for joint in links.joints:
        bodies[joint.child] = _body(bodies[joint.parent], joint)
    for k, loop in enumerate(loops):
        for part in range(2 if loop.type == "revolute" else 1):  # of a hinge, a second pair of points along its axis
            sites = [f"loop {k} {part} {side}" for side in range(2)]
            for link, site, side in zip(loop.links, sites, loop.sides, strict=True):
                point = number_text(side[:3, 3] + part * side[:3, 2])
                ET.SubElement(bodies[link], "site", {"name": site, **_place(side), "pos": point})
            tag = "weld" if loop.type == "fixed" else "connect"
            ET.SubElement(equality, tag, site1=sites[0], site2=sites[1])
    return plain


def _place(frame: Floats) -> Mapping[str, str]:
    """A frame (4, 4) [m] as attributes of MuJoCo."""
    return {"pos": number_text(frame[:3, 3]), "xyaxes": number_text(frame[:3, :2].T.ravel())}


def _body(parent: ET.Element, joint: UrdfJoint) -> ET.Element:
    """The child of a joint, with the joints of MuJoCo that the joint is."""
    body = ET.SubElement(parent, "body", {"name": joint.child, **(joint.written or _place(joint.frame))})
    for name, kind, axis in joint.elementary():
        if kind != "fixed":
            attributes = {} if axis is None else {"axis": number_text(axis)}
            at = number_text(joint.point)
            ET.SubElement(body, "joint", {"name": name, "type": MUJOCO_TYPES[kind], "pos": at, **attributes})
    return body
