"""Elements and attributes of files: those that are read, those that only look or sense, and all others by name.

A table has an entry for each kind of element that can move, limit or weigh something: its words, attributes with `@`.

    word            read, or harmless: what looks, senses, touches, or is a setting of a simulation
    word~value      left out with a note, unless it says this value; of several, `a|b`
    word!value      refused, unless it says this value

What is in no entry is refused by its name. A child is looked into if there is an entry `parent/child`, or `child`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from functools import lru_cache
from itertools import islice
from typing import NamedTuple
from xml.etree import ElementTree as ET

from ...errors import Fault, InvalidMechanism, near_miss
from ...machine.description.form_faults import shown
from .notes import Note, note_names
from .told_loops import links_named
from .xml_reading import numbers_in

Table = Mapping[str, str | None]
"""Kind of element -> its words; None of one that is looked into elsewhere."""

MOST_FAULTS = 20
"""Most faults that are told at once."""

MOST_LISTED = 12
"""Most known words that a fault lists."""

NAMING = ("name", "id", "comment")
"""Attributes that any element may have."""

FLAGS = {"1": "true", "0": "false"}

IN_SDF = {
    "joint": "@type parent child parent_frame child_frame pose axis axis2 mimic sensor plugin physics provide_feedback"
    " gear_ratio rotor_inertia controller_gains gearbox_ratio gearbox_reference_body thread_pitch screw_thread_pitch",
    "joint/parent": "",
    "joint/child": "",
    "joint/parent_frame": "",
    "joint/child_frame": "",
    "pose": "@relative_to @rotation_format @degrees @frame!|",
    "axis": "xyz dynamics limit mimic initial_position use_parent_model_frame",
    "axis2": "xyz dynamics limit mimic! initial_position~0 use_parent_model_frame",
    "xyz": "@expressed_in",
    "axis/dynamics": "damping friction spring_reference spring_stiffness~0",
    "axis2/dynamics": "damping~0 friction~0 spring_reference spring_stiffness~0",
    "axis/limit": "lower upper effort velocity acceleration stiffness dissipation",
    "axis2/limit": "lower~-1e16|-inf upper~1e16|inf effort~-1|inf velocity~-1|inf acceleration~inf stiffness"
    " dissipation",
    "mimic": "@joint @axis!axis @multiplier @offset @reference multiplier offset reference",
}
"""Joints of SDF, which a URDF may have too."""

SDF: Table = {
    **IN_SDF,
    "model": "@canonical_link @placement_frame @namespace static~false self_collide allow_auto_disable enable_wind"
    " pose frame link joint plugin gripper include model ball_constraint weld_constraint loop_joint constraint loop"
    " linear_spring_damper linear_bushing_rpy~ collision_filter_group sensor",
    "world": "include model light physics scene gui plugin road population actor wind atmosphere magnetic_field audio"
    " spherical_coordinates gravity~0_0_-9.8|0_0_-9.81|0_0_-9.80665 state~ frame joint!",
    "world/model": None,
    "world/frame": None,
    "frame": "@attached_to pose",
    "link": "gravity~true enable_wind self_collide kinematic~false must_be_base_link velocity_decay~ pose inertial"
    " collision visual sensor projector audio_sink audio_source battery light particle_emitter plugin",
    "inertial": "@auto mass density auto_inertia_params pose inertia fluid_added_mass~",
    "inertia": "ixx iyy izz ixy ixz iyz",
}
"""A <model> of SDF, versions 1.2 to 1.12, and what Drake adds."""

URDF: Table = {
    "robot": "@version @type link joint material transmission gazebo ros2_control sensor plugin frame coupling"
    " loop_joint constraint loop ball_constraint weld_constraint linear_spring_damper linear_bushing_rpy~"
    " collision_filter_group group disable_collisions mujoco",
    "link": "@type @concave visual collision inertial sensor contact contact_coefficients self_collision_checking"
    " collision_checking self_filter surface verbose material plugin gravity~true kinematic~false"
    " origin~",
    "inertial": "origin mass inertia",
    "mass": "@value",
    "inertia": "@ixx @iyy @izz @ixy @ixz @iyz @iyx~0 @izx~0 @izy~0",
    "origin": "@xyz @rpy",
    "joint": "@type @dont_collapse @dontCollapse parent child origin axis limit dynamics mimic calibration"
    " safety_controller~ controller_gains traits~ anchor~ joint_properties hardwareInterface sensor plugin",
    "joint_properties": "@friction~0 @damping~0",
    "joint/parent": "@link",
    "joint/child": "@link",
    "joint/axis": "@xyz @rpy!0_0_0",
    "joint/limit": "@lower @upper @effort @velocity @acceleration @deceleration~ @jerk~"
    " @command_effort~ @gear_velocity~ @current~ @k_velocity~",
    "joint/dynamics": "@damping @friction @spring_reference @spring_stiffness~0 @mu_coulomb~0 @mu_viscous~0 @K~0 @D~0",
    "joint/mimic": "@joint @multiplier @offset",
    "gazebo/joint": None,
    "gazebo": "@reference joint turnGravityOff~false gravity~true springStiffness~0 springReference"
    " initial_joint_position~0 dampingFactor~0 velocity_decay~ static~false kinematic~false pose~ axis! axis2!"
    " limit! dynamics! inertial! mass! link~ model! frame! include! parent! child!",
    "mujoco": "compiler option size",
    "mujoco/compiler": "@angle @strippath @meshdir @assetdir @texturedir @discardvisual @fusestatic @balanceinertia"
    " @autolimits @eulerseq @boundmass~0 @boundinertia~0 @settotalmass~-1 @inertiafromgeom~auto|false",
}
"""A <robot> of URDF, with what Drake, Gazebo, MuJoCo and exporters add."""

FREE_FORM = ("gazebo", "mujoco")
"""Elements that hold settings of a simulation of any name; those that are known to move something are refused."""

OF_TYPES = {
    "universal": "ranges of universal joints are left out, of",
    "ball": "ranges of balls are left out, of",
    "spherical": "ranges of balls are left out, of",
    "planar": "ranges of planar joints are left out, of",
    "floating": "ranges of floating joints are left out, of",
}
"""Types of joints whose limits are not read -> the note that says so."""


class Word(NamedTuple):
    """A word of an entry; `sign` is "", "~" or "!", `values` those that say nothing."""

    sign: str
    values: tuple[str, ...]


@lru_cache
def _words(entry: str) -> dict[str, Word]:
    words = {f"@{name}": Word("", ()) for name in NAMING}
    for text in entry.split():
        sign = next((each for each in "~!" if each in text), "")
        name, _, values = text.partition(sign) if sign else (text, "", "")
        words[name] = Word(sign, tuple(values.split("|")) if values else ())
    return words


def require_known(element: ET.Element, table: Table, kind: str, notes: list[Note], parts: Collection[str] = ()) -> None:
    """Refuse what is not known in an element, with every fault; notes name what is left out.

    Parameters
    ----------
    kind : the entry of the element.
    parts : names of links and joints. An unknown child of a whole file is refused if it names one of them; what names
        more is a bond, which `unread_loops` judges.
    """
    left_out: dict[str, list[str]] = defaultdict(list)
    whole = {child.tag: links_named(child, parts) for child in element if child.tag not in _words(table[kind] or "")}
    faults = list(islice(_faults(element, table, kind, "", left_out, whole if parts else {}), MOST_FAULTS))
    if faults:
        raise InvalidMechanism(faults)
    for what, places in left_out.items():
        note_names(notes, f"{what} is left out, for nothing here reads it, of", dict.fromkeys(places))


def note_ranges(root: ET.Element, notes: list[Note]) -> None:
    """Note the joints of a description that have ranges, and a type whose ranges are not read."""
    named: dict[str, list[str]] = defaultdict(list)
    for joint in root.iter("joint"):
        limits = [each for path in ("limit", "axis/limit") for each in joint.iterfind(path)]
        said = [each.get(key) or each.findtext(key) for each in limits for key in ("lower", "upper")]
        if joint.get("type") in OF_TYPES and any(text and not _says(text, ("-1e16", "1e16", "0")) for text in said):
            named[OF_TYPES[joint.get("type", "")]].append(joint.get("name", ""))
    for note, names in named.items():
        note_names(notes, note, names)


def _faults(
    element: ET.Element,
    table: Table,
    kind: str,
    place: str,
    left_out: dict[str, list[str]],
    whole: Mapping[str, list[str]],
) -> Iterator[Fault]:
    """Yield what is refused in an element, and collect what is left out, with the names of where it is.

    Parameters
    ----------
    whole : unknown children of a whole file -> the links and joints that they name.
    """
    words = _words(table[kind] or "")
    name = element.get("name") or element.get("reference") or ""
    place = f"{place}.{element.tag}" if place and not name else f"{element.tag} '{name}'" if name else element.tag
    attributes = [(f"@{key}", key, text) for key, text in element.attrib.items()]
    children = [(child.tag, child.tag, _value(child)) for child in element]
    for word, key, text in attributes + children:
        known = words.get(word)
        if known is None and (kind in FREE_FORM or len(whole.get(word, ())) > 1):
            known = Word("", ())
        if known is None and word in whole and not whole[word]:
            known = Word("~", ())
        if known is not None and (not known.sign or _says(text, known.values)):
            continue
        what = f"{key} of {element.tag}" if word[0] == "@" else f"<{key}>"
        if known is not None and known.sign == "~":
            left_out[what].append(name or place)
            continue
        others = [each.removeprefix("@") for each, of in words.items() if of.sign != "!" and each[1:] not in NAMING]
        said = f" ({shown(text)})" if text and known is not None else near_miss(key, others)
        kind_of = "an attribute" if word[0] == "@" else "an element"
        listed = ", ".join([*others[:MOST_LISTED], *(["..."] if len(others) > MOST_LISTED else [])])
        expected = f"none, or one of what is known here: {listed}" if others else "none"
        if known is not None and any(known.values):
            expected = " or ".join(known.values)
        yield Fault(f"{place}.{key}", f"{kind_of} that is not read{said}", expected)
    for child in element:
        inner = next((each for each in (f"{kind.rpartition('/')[2]}/{child.tag}", child.tag) if each in table), None)
        if inner is not None and table[inner] is not None and child.tag in words and not words[child.tag].sign:
            yield from _faults(child, table, inner, place, left_out, {})


def _value(element: ET.Element) -> str:
    """The text of an element, or its attribute `value`; "..." where it has more within."""
    return "..." if len(element) else (element.get("value") or element.text or "").strip()


def _says(text: str, values: tuple[str, ...]) -> bool:
    """True if a text says one of some values; numbers and flags however they are written."""
    text = text.strip()
    if FLAGS.get(text.lower(), text.lower()) in values or (not text and not values):
        return bool(values)
    words = len(text.split())
    said = numbers_in(text.replace("inf", "1e16"), words)
    others = [numbers_in(value.replace("inf", "1e16").replace("_", " "), words) for value in values]
    return said is not None and any(other is not None and (said == other).all() for other in others)
