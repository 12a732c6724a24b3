"""What a mechanism as a whole may not be: its head, names, graph and shapes, and where its joints are at home."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from string import digits
from typing import Any

import numpy as np

from ...errors import Fault, near_miss
from ...tolerances import TOLERANCES
from ..meshes import UnusableMesh, hull_of
from .body_masses import INERTIA_SLACK, Mass, as_matrix, lamina
from .body_shapes import SHAPE_FIELDS, SHAPE_KINDS, Shape
from .enclosing import enclosing_radius
from .form_faults import (
    angle_text,
    choice_faults,
    coordinate_text,
    direction_faults,
    is_name,
    is_numbers,
    is_pair_of_names,
    is_point,
    name_faults,
    number_faults,
    range_text,
    shown,
)
from .graph import components, edges_of, joints_with_centre, leaves, next_joints, opposite, sliding_along
from .joints import TASK_COORDINATES, TASK_TURNS, WHOLE_TASK, Cone, Joint
from .rules import Rule, each_of, faults_by, form, is_pair, kind_of, wrong
from .structure import Structure

MOST_SHAPES = 300
"""Most shapes of one mechanism, copies included: all pairs of them are checked at home, in about a second."""

SQUARE = TOLERANCES.rotation_matrix
"""Cosine of the angle between the axes of a box up to which they count as square, as the rows of a rotation do."""

_FIELDS = tuple(field.name for field in dataclasses.fields(Shape))[2:]
_POSITIVE = ("thickness", "diameter", "scale", "density")
_WORDS = {
    "thickness": "a number",
    "diameter": "a number",
    "at": "three numbers, its centre",
    "size": "three numbers, the lengths of its edges",
    "axis": "three numbers, the direction of its axis",
    "file": "the path of a mesh file",
}


def _field_rules(field: str) -> Iterator[Rule]:
    """Each kind of shape needs some fields, and may have others beside."""
    if field in _WORDS:
        yield wrong(
            field, lambda v, s, needed, known: v is None and field in needed, f"{_WORDS[field]}, for a {{0.kind}}"
        )
    yield wrong(f"{field}?", lambda v, s, needed, known: field not in known, f"nothing: a {{0.kind}} has no {field}")


def _mesh_faults(place: str, shape: Shape) -> Iterator[Fault]:
    try:
        hull_of(str(shape.file))
    except UnusableMesh as error:
        yield Fault(place, error.found, error.expected)


OF_SHAPES = (
    *(rule for field in _FIELDS for rule in _field_rules(field)),
    *(form(f"{field}?", number_faults, 1) for field in _POSITIVE),
    *(wrong(f"{field}?", lambda v, *_: v <= 0.0, "more than 0") for field in _POSITIVE),
    form("size?", number_faults, 3),
    wrong("size?", lambda v, *_: min(v) <= 0.0, "more than 0"),
    form("at?", number_faults, 3),
    form("axis?", direction_faults),
    wrong("file?", lambda v, *_: not isinstance(v, str) or not v or "\0" in v, _WORDS["file"]),
    wrong("between?", lambda v, *_: not is_pair_of_names(v) or v[0] == v[1], "the names of two joints"),
    wrong("ends?", lambda v, *_: not is_pair(v), "two points"),
    form("ends?", each_of, number_faults, 3),
    wrong("ends?", lambda v, s, *_: s.between is not None and "both `between` and `ends`", "one of them"),
    wrong("axes?", lambda v, *_: not is_pair(v), "two directions"),
    form("axes?", each_of, direction_faults),
    wrong("axes?", lambda v, *_: abs(sum(a * b for a, b in zip(*v, strict=True))) > SQUARE,
          "two directions square to each other"),
)  # fmt: skip
"""Of a shape, of the fields that its kind needs, and of those that it may have."""


def form_of_shapes(shapes: Any) -> Iterator[Fault]:
    """Faults of shapes by themselves."""
    if not isinstance(shapes, tuple) or not all(isinstance(shape, Shape) for shape in shapes):
        yield Fault("body", shown(shapes), "a list of Shape")
        return
    if len(shapes) > MOST_SHAPES:
        yield Fault("body", f"{len(shapes)} shapes, with copies and links of legs", f"at most {MOST_SHAPES}")
        return
    for index, shape in enumerate(shapes):
        yield from _form_faults(f"body[{index}]", shape)


def _form_faults(place: str, shape: Shape) -> Iterator[Fault]:
    body: Any = shape.body
    if not isinstance(body, str):
        yield Fault(f"{place}.name", shown(body), "the name of a body")
    unknown = list(choice_faults(f"{place}.shape", shape.kind, SHAPE_KINDS))
    yield from unknown
    if not unknown:
        needed, optional = SHAPE_FIELDS[shape.kind]
        faults = faults_by(OF_SHAPES, place, shape, needed, needed + optional)
        yield from faults or (_mesh_faults(f"{place}.file", shape) if shape.kind == "mesh" else ())


def form_of_clearance(clearance: Any) -> Iterator[Fault]:
    """Faults of a clearance by itself."""
    faults = [] if clearance is None else list(number_faults("clearance", clearance, 1))
    yield from faults
    if clearance is not None and not faults and clearance < 0.0:
        yield Fault("clearance", shown(clearance), "0 or more")


def shape_faults(mechanism: Structure) -> Iterator[Fault]:
    """Faults of what shapes and `ignore` name, in a mechanism of which all else is sound."""
    for index, shape in enumerate(mechanism.shapes):
        place = f"body[{index}]"
        if shape.body not in mechanism.bodies:
            found = f"'{shape.body}': no such body{near_miss(shape.body, mechanism.bodies)}"
            yield Fault(f"{place}.name", found, "a body that a joint connects")
        elif shape.between is not None:
            yield from _between_faults(f"{place}.between", shape, mechanism)
        elif shape.kind == "capsule" and shape.ends is None:
            joints = joints_with_centre(mechanism, shape.body)
            if len(joints) != 2:
                found = f"nothing, and '{shape.body}' has {len(joints)} joints with a centre"
                yield Fault(f"{place}.between", found, "the names of two of its joints, or `ends`, two points")
    yield from _ignore_faults(mechanism)


def mass_faults(mechanism: Structure) -> Iterator[Fault]:
    """Faults of the masses of bodies, in a mechanism whose joints and shapes are sound."""
    masses: Any = mechanism.masses
    if not isinstance(masses, tuple) or not all(isinstance(each, Mass) for each in masses):
        yield Fault("masses", shown(masses), "a list of Mass")
        return
    bodies = [each.body for each in masses]
    for index, each in enumerate(masses):
        yield from faults_by(OF_MASSES, f"mass[{index}]", each, mechanism, bodies[:index])


def is_impossible(moments: Any, joints: Iterable[Joint] = ()) -> str | bool:
    """What is wrong with moments of inertia that no body can have, if anything is.

    Between `joints` that let bodies turn about one axis alone, the moment about that suffices.
    """
    if not is_numbers(moments, 6) or not all(map(math.isfinite, moments)):
        return True
    if lamina(joints, moments) is not None:
        return False
    least, middle, most = np.linalg.eigvalsh(as_matrix(moments)).tolist()
    principal = f"principal moments {least:.6g}, {middle:.6g} and {most:.6g}"
    return principal if least < -INERTIA_SLACK * most or most > (1.0 + INERTIA_SLACK) * (least + middle) else False


OF_MASSES = (
    wrong("body", lambda v, each, m, before: v not in m.bodies and f"{shown(v)}: no such body"
          f"{near_miss(v, m.bodies) if isinstance(v, str) else ''}", "a body that a joint connects"),
    wrong("body", lambda v, each, m, before: v in before and f"'{v}' twice", "one mass of a body"),
    wrong("mass", lambda v, *_: not isinstance(v, float) or not 0.0 <= v < math.inf, "kilograms, 0 or more"),
    wrong("mass", lambda v, each, m, before: any(s.body == each.body and s.density is not None for s in m.shapes)
          and f"a mass beside the density of a shape of '{each.body}'", "one of them"),
    form("centre?", number_faults, 3),
    wrong("centre", lambda v, each, m, before: v is None and each.mass != 0.0
          and not any(s.body == each.body and s.is_filled for s in m.shapes),
          "three numbers, the centre of mass: the body has no shape to take it from"),
    wrong("inertia?", lambda v, each, m, before: is_impossible(v, m.joints),
          "Ixx, Iyy, Izz and, if not 0, Ixy, Ixz, Iyz of a body: its principal moments are not negative, "
          "and none is more than the other two together"),
)  # fmt: skip
"""Of a mass, of the mechanism, and of the bodies of the masses before."""


def _between_faults(place: str, shape: Shape, mechanism: Structure) -> Iterator[Fault]:
    joints = {joint.name: joint for joint in mechanism.joints}
    bodies = sliding_along(mechanism, shape.body)
    for name in shape.between or ():
        if name not in joints:
            yield Fault(place, f"'{name}': no such joint{near_miss(name, joints)}", "the names of two joints")
        elif joints[name].at is None:
            yield Fault(place, f"'{name}', a joint without a centre", "joints with a centre")
        elif not bodies.intersection(joints[name].connects):
            between = " and ".join(f"'{body}'" for body in joints[name].connects)
            yield Fault(
                place, f"'{name}', between {between}", f"joints of '{shape.body}', or of a body that slides along it"
            )


def _ignore_faults(mechanism: Structure) -> Iterator[Fault]:
    ignore: Any = mechanism.ignore
    if not isinstance(ignore, tuple):
        yield Fault("ignore", shown(ignore), "pairs of bodies that may touch")
        return
    for pair in ignore:
        strangers = [name for name in pair if name not in mechanism.bodies] if is_pair_of_names(pair) else [None]
        for name in strangers:
            found = shown(pair) if name is None else f"'{name}': no such body{near_miss(name, mechanism.bodies)}"
            yield Fault("ignore", found, "the names of two bodies that may touch")


SMALLEST_LENGTH = 1e-9
"""Smallest characteristic length accepted: below it, a unit is wrong or joints are meant to coincide."""

FARTHEST = 1e6
"""How far from the origin joints may be, in sizes of the machine: coordinates of 16 digits then tell places apart to
1e-10 of it, and loops close to 1e-9."""

MISSPELT = 0.8
"""Likeness from which the name of a body that one joint alone connects is taken for another one, misspelt: that of two
names of five letters which differ in one."""


def _task_faults(task: Any, mechanism: Structure) -> Iterator[Fault]:
    """Faults of what targets set: at least one coordinate, none twice, and of the rotation all, the tilt or the yaw."""
    expected = f"some of {', '.join(TASK_COORDINATES)}"
    if not isinstance(task, tuple) or not task:
        yield Fault("task", shown(task), expected)
        return
    for each in task:
        if each not in TASK_COORDINATES:
            yield Fault("task", f"{shown(each)}{near_miss(each, TASK_COORDINATES)}", expected)
    if len(set(map(str, task))) < len(task):
        yield Fault("task", shown(list(task)), f"{expected}, none of them twice")
    turns = list(dict.fromkeys(each for each in map(str, task) if each in TASK_TURNS))
    if len(turns) > 1:
        expected = "one of the two: tilt and yaw are parts of the rotation, together all of it"
        yield Fault("task", f"both {turns[0]} and {turns[1]}", expected)
    if turns and mechanism.whole_task == WHOLE_TASK[:3]:
        yield Fault("task", turns[0], "some of x, y, z: the end effector is a joint, of which only the position counts")


OF_POINTS = (
    wrong("reference_point", lambda v, m, *_: m.end_effector_joint is not None and v != m.end_effector_joint.at,
          "nothing: it is the centre of the joint '{0.end_effector}'"),
    wrong("reference_point", lambda v, m, joints, bodies: v is None and m.end_effector_joint is None
          and is_name(m.end_effector) and m.end_effector != m.base and m.end_effector in bodies,
          "three numbers, the point of the end effector that targets place"),
)  # fmt: skip
"""Of a mechanism, its joints by name, and how many of them mention each body."""

OF_ENDS = (
    wrong("base", lambda v, m, joints, bodies: v not in bodies
          and f"'{v}', which no joint connects{near_miss(v, bodies)}", "a body that a joint connects"),
    wrong("end_effector", lambda v, m, *_: v == m.base and f"'{v}', which is the base",
          "a body that moves, or a joint"),
    wrong("end_effector", lambda v, m, joints, bodies: v in bodies and v in joints
          and f"'{v}', which names both a body and a joint", "a name that only one has"),
    wrong("end_effector", lambda v, m, joints, bodies: v in joints
          and joints[v].type in ("prismatic", "cylindrical") and f"'{v}', a {joints[v].type} joint",
          "a joint whose centre is the same point of both its bodies"),
    wrong("end_effector", lambda v, m, joints, bodies: v not in {*bodies, *joints} and len(joints) == len(m.joints)
          and f"'{v}', neither a body nor a joint{near_miss(v, [*bodies, *joints])}", "a body or a joint"),
)  # fmt: skip
"""Of the same, where joints connect bodies."""


def head_faults(mechanism: Structure) -> Iterator[Fault]:
    """All faults of what describes a mechanism beside its joints and shapes."""
    for field in ("name", "base", "end_effector"):
        yield from name_faults(field, getattr(mechanism, field))
    yield from name_faults("units.length", mechanism.length_unit)
    if mechanism.angle_unit not in ("deg", "rad"):
        yield Fault("units.angle", shown(mechanism.angle_unit), "'deg' or 'rad'")
    yield from _task_faults(mechanism.task, mechanism)
    point: Any = mechanism.reference_point
    if mechanism.end_effector_joint is None and point is not None:
        yield from number_faults("reference_point", point, 3)


def graph_faults(mechanism: Structure) -> Iterator[Fault]:
    """All faults of how the joints, the base and the end effector refer to each other.

    Where a name could not be read, whatever depends on it is left out: a fault is reported once, where it is.
    """
    joints = {joint.name: joint for joint in mechanism.joints if is_name(joint.name)}
    pairs = [joint.connects for joint in mechanism.joints if is_pair_of_names(joint.connects)]
    bodies = Counter(body for pair in pairs for body in pair)
    yield from faults_by(OF_POINTS, "", mechanism, joints, bodies)
    has_names = all(is_name(joint.name) for joint in mechanism.joints)
    has_bodies = len(pairs) == len(mechanism.joints)
    yield from _duplicate_faults(mechanism, joints)
    if all(joint.actuated is False for joint in mechanism.joints):
        yield Fault("joint", "no actuated joint", "at least one joint with `actuated = true`, or `*` in a chain")
    for index, joint in enumerate(mechanism.joints if has_names else ()):
        if joint.type == "prismatic" and is_pair_of_names(joint.along) and len({*(joint.along or ())}) == 2:
            yield from _along_faults(f"joint[{index}].along", joint, joints)
    if has_bodies and is_name(mechanism.base) and is_name(mechanism.end_effector):
        ends = [*faults_by(OF_ENDS, "", mechanism, joints, bodies), *_leaf_faults(mechanism, bodies)]
        yield from ends or _connection_faults(mechanism)
        yield from _cone_faults(mechanism) if has_names else ()


def _duplicate_faults(mechanism: Structure, joints: dict[str, Joint]) -> Iterator[Fault]:
    """Faults of joints that are called as another one, or as a coordinate of one with several."""
    kinds = {name: kind for name, joint in joints.items() if (kind := kind_of(joint)) is not None}
    owners = {f"{name}[{place}]": name for name, kind in kinds.items() for place in range(len(kind.coordinates))}
    seen: set[str] = set()
    for index, joint in enumerate(mechanism.joints):
        place, expected = f"joint[{index}].name", "a name of its own"
        if not is_name(joint.name):
            continue
        if joint.name in seen:
            yield Fault(place, f"'{joint.name}', the name of an earlier joint", expected)
        owner = owners.get(joint.name)
        if owner is not None and len(kinds[owner].coordinates) > 1:
            yield Fault(place, f"'{joint.name}', the name of a coordinate of joint '{owner}'", expected)
        seen.add(joint.name)


def _along_faults(place: str, joint: Joint, joints: dict[str, Joint]) -> Iterator[Fault]:
    """Faults of the two joints that a prismatic one runs along, of all that have a name."""
    faults = []
    for name in joint.along or ():
        if name == joint.name:
            faults.append(Fault(place, f"'{name}', the joint itself", "two other joints"))
        elif name not in joints:
            hint = near_miss(name, [other for other in joints if other != joint.name])
            faults.append(Fault(place, f"'{name}': no such joint{hint}", "the names of two joints"))
        elif joints[name].at is None and joints[name].type == "prismatic":
            faults.append(Fault(place, f"'{name}', a joint without a centre", "joints with a centre"))
    yield from faults
    sides = [joint.connects, *(joints[name].connects for name in joint.along or () if not faults)]
    if faults or not all(map(is_pair_of_names, sides)):
        return
    (first, second), one, other = sides
    if not ((first in one and second in other) or (first in other and second in one)):
        found = f"{shown(joint.along)}, not one on each side of the joint"
        yield Fault(place, found, f"one joint of '{first}' and one joint of '{second}'")


def _leaf_faults(mechanism: Structure, bodies: Counter[str]) -> Iterator[Fault]:
    """Faults of bodies that one joint alone connects, and whose name is like that of another.

    Not one that differs in a number at its end, nor one on the same body as the leaf: left and right are alike.
    """
    for index, joint, body in leaves(mechanism):
        (beside,) = {*joint.connects} - {body}
        together = {each for other in mechanism.joints if beside in other.connects for each in other.connects}
        known = dict.fromkeys([mechanism.end_effector, *bodies])
        others = [each for each in known if each not in together and each.rstrip(digits) != body.rstrip(digits)]
        meant = near_miss(body, others, MISSPELT)
        if meant:
            found = f"'{body}', which no other joint connects{meant}"
            yield Fault(
                f"joint[{index}].connects",
                found,
                "a body that other joints connect too, or a name less like that of another body",
            )


def _connection_faults(mechanism: Structure) -> Iterator[Fault]:
    """Parts of the graph with no connection to the base; the end effector's is named as such."""
    for part in components(edges_of(mechanism.joints)):
        bodies = {body for edge in part for body in edge.bodies}
        if mechanism.base in bodies:
            continue
        if mechanism.end_effector in bodies | {edge.joint.name for edge in part if is_name(edge.joint.name)}:
            found = f"'{mechanism.end_effector}', to which no joints lead from the base '{mechanism.base}'"
            yield Fault("end_effector", found, "an end effector connected to the base")
        else:
            index = mechanism.joints.index(part[0].joint)
            names = ", ".join(f"'{body}'" for body in sorted(bodies))
            yield Fault(f"joint[{index}].connects", f"{names}, apart from the rest", "bodies connected to the base")


def _cone_faults(mechanism: Structure) -> Iterator[Fault]:
    for index, joint in enumerate(mechanism.joints):
        kind, cone = kind_of(joint), joint.cone
        if cone is None or kind is None or not kind.coned or getattr(cone, "fixed_to", None) not in joint.connects:
            continue
        body = opposite(joint)
        ends = [f"'{each.name}'" for each in next_joints(mechanism.joints, joint, body)]
        if len(ends) != 1:
            several = f"several joints ({', '.join(ends)})" if ends else "no other joint"
            found = f"'{body}', which leads to {several}, on the other side"
            yield Fault(f"joint[{index}].cone", found, "one next joint, so that the limited line is defined")


def home_faults(mechanism: Structure, sound: dict[str, Joint]) -> Iterator[Fault]:
    """All faults of the home configuration that can be seen in the joints that have no other fault.

    Parameters
    ----------
    sound : the joints without a fault of their own, by name; only they are looked at.
    """
    radius = enclosing_radius([joint.at for joint in sound.values() if joint.at is not None])
    if 0.0 < radius < SMALLEST_LENGTH:
        yield Fault("joint", f"joint centres within {radius:.3g} of each other", f"at least {SMALLEST_LENGTH:g}")
        return
    if len(sound) == len(mechanism.joints) and is_point(mechanism.reference_point):
        yield from _distance_faults(mechanism)
    has_bodies = all(is_pair_of_names(each.connects) for each in mechanism.joints)
    are_sound = {id(joint) for joint in sound.values()}
    for index, joint in enumerate(mechanism.joints):
        if id(joint) in are_sound:
            yield from _stroke_faults(f"joint[{index}]", joint, sound, radius or 1.0)
            if joint.cone is not None and has_bodies:
                ends = next_joints(mechanism.joints, joint, opposite(joint))
                if len(ends) == 1 and id(ends[0]) in are_sound:
                    yield from _angle_faults(f"joint[{index}].cone", joint, joint.cone, ends[0])


def _distance_faults(mechanism: Structure) -> Iterator[Fault]:
    """The place that is farthest from the origin, where that is too far for the size of the machine."""
    places = {f"joint[{index}].at": joint.at for index, joint in enumerate(mechanism.joints) if joint.at is not None}
    places["reference_point"] = mechanism.reference_point
    place, farthest = max(places.items(), key=lambda item: math.hypot(*item[1]))
    distance = math.hypot(*farthest) / mechanism.characteristic_length
    if distance > FARTHEST:
        found = f"{shown(farthest)}, {distance:.3g} times the size of the machine from the origin"
        expected = f"at most {FARTHEST:g} times, so that coordinates tell its places apart: move the origin"
        yield Fault(place, found, expected)


def _stroke_faults(place: str, joint: Joint, sound: dict[str, Joint], scale: float) -> Iterator[Fault]:
    """Home outside the joint's range; two joints at one place, which leave `along` without a direction."""
    home: Any = joint.home
    if joint.along is not None:
        ends = [sound[name].at for name in joint.along if name in sound]
        if len(ends) < 2 or not all(map(is_point, ends)):
            return
        home = math.dist(*(end or () for end in ends))
        if home <= TOLERANCES.home_slack * scale:
            yield Fault(f"{place}.along", "two joints at the same place", "two joints at some distance")
            return
    kind = kind_of(joint)
    if joint.range is None or kind is None:
        return
    one = len(kind.coordinates) == 1
    ranges: Any = (joint.range,) if one else joint.range
    values = (home,) if one else home
    for number, (value, bounds, coordinate) in enumerate(zip(values, ranges, kind.coordinates, strict=True)):
        slack = TOLERANCES.home_slack * (scale if coordinate == "length" else 1.0)
        if not bounds[0] - slack <= value <= bounds[1] + slack:
            where = f"{place}.range" if one else f"{place}.range[{number}]"
            expected = f"a range that contains home, {coordinate_text(value, coordinate)}"
            yield Fault(where, range_text(bounds, coordinate), expected)


def _angle_faults(place: str, joint: Joint, cone: Cone, end: Joint) -> Iterator[Fault]:
    """Home outside the joint's cone, or no line to measure."""
    axis, line = np.asarray(cone.axis), np.asarray(end.at) - np.asarray(joint.at)
    if not line.any():
        yield Fault(place, f"'{end.name}' at the same place", "a next joint at some distance")
        return
    angle = math.atan2(float(np.linalg.norm(np.cross(axis, line))), float(axis @ line))
    if angle > cone.half_angle + TOLERANCES.home_slack:
        expected = f"at least the angle at home to '{end.name}', {angle_text(angle)}"
        yield Fault(f"{place}.half_angle", angle_text(cone.half_angle), expected)
