"""Faults of the graph: names that must agree between joints, bodies that must hang together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from string import digits

from ..errors import Fault, near_miss
from .form_faults import is_name, is_pair_of_names, kind_of, shown
from .graph import components, edges_of, next_joints, opposite
from .joints import Joint
from .structure import Structure


def graph_faults(mechanism: Structure) -> Iterator[Fault]:
    """All faults of how the joints, the base and the end effector refer to each other.

    Where a name could not be read, whatever depends on it is left out: a fault is reported once, where it is.
    """
    yield from _duplicate_faults(mechanism)
    yield from _actuator_faults(mechanism)
    if all(is_name(joint.name) for joint in mechanism.joints):
        yield from _along_faults(mechanism)
    if not all(is_pair_of_names(joint.connects) for joint in mechanism.joints):
        return
    if not (is_name(mechanism.base) and is_name(mechanism.end_effector)):
        return
    names = list(_base_faults(mechanism)) + list(_end_effector_faults(mechanism)) + list(_dangling_faults(mechanism))
    yield from names
    if not names:
        yield from _connection_faults(mechanism)
    if all(is_name(joint.name) for joint in mechanism.joints):
        yield from _cone_faults(mechanism)


def _duplicate_faults(mechanism: Structure) -> Iterator[Fault]:
    seen: set[str] = set()
    for index, joint in enumerate(mechanism.joints):
        if is_name(joint.name) and joint.name in seen:
            yield Fault(f"joint[{index}].name", f"'{joint.name}', the name of an earlier joint", "a name of its own")
        elif is_name(joint.name):
            seen.add(joint.name)
    owners = {name: joint.name for joint in mechanism.joints for name in _names_of_several(joint)}
    for index, joint in enumerate(mechanism.joints):
        if is_name(joint.name) and joint.name in owners:
            found = f"'{joint.name}', the name of a coordinate of joint '{owners[joint.name]}'"
            yield Fault(f"joint[{index}].name", found, "a name of its own")


def _names_of_several(joint: Joint) -> list[str]:
    """The names of a joint's coordinates, where it has several."""
    kind = kind_of(joint) if is_name(joint.name) else None
    count = 0 if kind is None else len(kind.coordinates)
    return [f"{joint.name}[{place}]" for place in range(count)] if count > 1 else []


def _actuator_faults(mechanism: Structure) -> Iterator[Fault]:
    if mechanism.joints and all(joint.actuated is False for joint in mechanism.joints):
        yield Fault("joint", "no actuated joint", "at least one joint with `actuated = true`, or `*` in a chain")


def _bodies(mechanism: Structure) -> Counter[str]:
    """How many joints mention each body."""
    return Counter(body for joint in mechanism.joints for body in joint.connects)


def _base_faults(mechanism: Structure) -> Iterator[Fault]:
    bodies = _bodies(mechanism)
    if mechanism.base not in bodies:
        hint = near_miss(mechanism.base, bodies)
        yield Fault("base", f"'{mechanism.base}', which no joint connects{hint}", "a body that a joint connects")


def _end_effector_faults(mechanism: Structure) -> Iterator[Fault]:
    bodies, name = _bodies(mechanism), mechanism.end_effector
    joints = {joint.name: joint for joint in mechanism.joints if is_name(joint.name)}
    if name == mechanism.base:
        yield Fault("end_effector", f"'{name}', which is the base", "a body that moves, or a joint")
    elif name in bodies and name in joints:
        yield Fault("end_effector", f"'{name}', which names both a body and a joint", "a name that only one has")
    elif name in joints:
        yield from _tip_faults(joints[name])
    elif name not in bodies and len(joints) == len(mechanism.joints):
        hint = near_miss(name, [*bodies, *joints])
        yield Fault("end_effector", f"'{name}', neither a body nor a joint{hint}", "a body or a joint")


def _tip_faults(joint: Joint) -> Iterator[Fault]:
    if joint.type in ("prismatic", "cylindrical"):
        expected = "a joint whose centre is the same point of both its bodies"
        yield Fault("end_effector", f"'{joint.name}', a {joint.type} joint", expected)


MISSPELT = 0.8
"""Likeness from which the name of a body that one joint alone connects is taken for another one, misspelt: that of two
names of five letters which differ in one."""


def leaves(mechanism: Structure) -> Iterator[tuple[int, Joint, str]]:
    """Bodies that one joint alone connects, as a finger of a gripper, with that joint and its index.

    Not the base, nor the end effector, nor what hangs on an end effector that is a joint: that is the tool.
    """
    counts = Counter(body for joint in mechanism.joints for body in joint.connects)
    for index, joint in enumerate(mechanism.joints):
        if joint.name == mechanism.end_effector and mechanism.end_effector not in counts:
            continue
        for body in joint.connects:
            if counts[body] == 1 and body not in (mechanism.base, mechanism.end_effector):
                yield index, joint, body


def _dangling_faults(mechanism: Structure) -> Iterator[Fault]:
    for index, joint, body in leaves(mechanism):
        meant = _meant(body, joint, mechanism)
        if meant:
            found = f"'{body}', which no other joint connects{meant}"
            yield Fault(f"joint[{index}].connects", found, "the name of a body, or one that is less like it")


def _meant(body: str, joint: Joint, mechanism: Structure) -> str:
    """The body that was probably meant by the name of a leaf.

    Neither one that differs in a number at its end, nor one on the same body as the leaf: left and right are alike.
    """
    (beside,) = {*joint.connects} - {body}
    together = {each for other in mechanism.joints if beside in other.connects for each in other.connects}
    bodies = dict.fromkeys([mechanism.end_effector, *_bodies(mechanism)])
    others = [each for each in bodies if each not in together and each.rstrip(digits) != body.rstrip(digits)]
    return near_miss(body, others, MISSPELT)


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


def _along_faults(mechanism: Structure) -> Iterator[Fault]:
    joints = {joint.name: joint for joint in mechanism.joints}
    for index, joint in enumerate(mechanism.joints):
        if (
            joint.type != "prismatic"
            or not is_pair_of_names(joint.along)
            or joint.along is None
            or joint.along[0] == joint.along[1]
        ):
            continue
        faults = [fault for name in joint.along for fault in _end_faults(f"joint[{index}].along", joint, name, joints)]
        yield from faults
        ends = [joints[name].connects for name in joint.along if name in joints]
        if not faults and all(map(is_pair_of_names, [joint.connects, *ends])) and not _on_both_sides(joint, ends):
            found = f"{shown(joint.along)}, not one on each side of the joint"
            first, second = joint.connects
            yield Fault(f"joint[{index}].along", found, f"one joint of '{first}' and one joint of '{second}'")


def _end_faults(place: str, joint: Joint, name: str, joints: dict[str, Joint]) -> Iterator[Fault]:
    if name == joint.name:
        yield Fault(place, f"'{name}', the joint itself", "two other joints")
    elif name not in joints:
        others = [other for other in joints if other != joint.name]
        yield Fault(place, f"'{name}': no such joint{near_miss(name, others)}", "the names of two joints")
    elif joints[name].at is None and joints[name].type == "prismatic":
        yield Fault(place, f"'{name}', a joint without a centre", "joints with a centre")


def _on_both_sides(joint: Joint, ends: list[tuple[str, str]]) -> bool:
    (first, second), (one, other) = joint.connects, ends
    return (first in one and second in other) or (first in other and second in one)


def _cone_faults(mechanism: Structure) -> Iterator[Fault]:
    for index, joint in enumerate(mechanism.joints):
        kind, cone = kind_of(joint), joint.cone
        if cone is None or kind is None or not kind.coned or getattr(cone, "fixed_to", None) not in joint.connects:
            continue
        body = opposite(joint)
        ends = [each.name for each in next_joints(mechanism.joints, joint, body)]
        if len(ends) != 1:
            found = f"'{body}', which leads to {_several(ends)}, on the other side"
            yield Fault(f"joint[{index}].cone", found, "one next joint, so that the limited line is defined")


def _several(names: list[str]) -> str:
    return "several joints (" + ", ".join(f"'{name}'" for name in names) + ")" if names else "no other joint"
