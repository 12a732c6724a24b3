"""Joints that stand in series between the base and the end effector: found by their names, or without names."""

from __future__ import annotations

from ..description.graph import Step, edges_of, welded
from ..description.joint_coordinates import JointCoordinate
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument, UnknownName


def passive_series(mechanism: Mechanism) -> tuple[str, ...]:
    """Names of passive joints in series from base to end effector, the fewest; none if there are no such joints."""
    passive = [joint for joint in mechanism.joints if not joint.actuated]
    stands_for = welded([joint for joint in passive if joint.type == "fixed"], mechanism.base)
    ways: dict[str, tuple[str, ...]] = {stands_for.get(mechanism.base, mechanism.base): ()}
    bodies = list(ways)
    for body in bodies:  # grows while it is looked through
        for joint in passive:
            ends = [stands_for.get(end, end) for end in joint.connects]
            if body in ends and joint.type != "fixed":
                other = ends[1] if ends[0] == body else ends[0]
                if other not in ways:
                    ways[other] = (*ways[body], joint.name)
                    bodies.append(other)
    return min((ways[end] for end in _ends(mechanism, stands_for) if end in ways), key=len, default=())


def named_coordinates(mechanism: Mechanism, names: tuple[str, ...]) -> list[JointCoordinate]:
    """The coordinates that names of joints or coordinates stand for, in their order."""
    if not names:
        raise InvalidArgument("joints", "no joint", _expected(mechanism))
    by_name = {each.name: [each] for each in mechanism.coordinates}
    for joint in mechanism.joints:
        by_name[joint.name] = [each for each in mechanism.coordinates if each.joint.name == joint.name]
    for name in names:
        if not isinstance(name, str) or name not in by_name:
            raise UnknownName("joint", name, [joint.name for joint in mechanism.joints])
        if not by_name[name]:
            raise InvalidArgument("joints", f"'{name}', which is fixed", "joints that move")
    named = [each for name in names for each in by_name[name]]
    twice = [each.name for place, each in enumerate(named) if each in named[:place]]
    if twice:
        raise InvalidArgument("joints", f"'{twice[0]}' twice", "each joint once")
    return named


def in_series(mechanism: Mechanism, names: set[str]) -> list[Step]:
    """The named joints as steps from the base to the end effector."""
    stands_for = welded([joint for joint in mechanism.joints if joint.type == "fixed"], mechanism.base)
    edges = [edge for edge in edges_of(mechanism.joints) if edge.joint.name in names]
    body, passed = stands_for.get(mechanism.base, mechanism.base), set[str]()
    steps: list[Step] = []
    while len(steps) < len(edges):
        ways = [
            (edge.joint, other)
            for edge in edges
            if edge.joint.name not in {step.joint.name for step in steps}
            for here, other in (_ends_of(edge.bodies, stands_for), _ends_of(edge.bodies[::-1], stands_for))
            if here == body
        ]
        passed.add(body)
        if len(ways) != 1 or ways[0][1] in passed:
            raise _no_series(mechanism, names)
        joint, body = ways[0]
        steps.append(Step(joint, stands_for.get(joint.connects[1], joint.connects[1]) == body))
    if body not in _ends(mechanism, stands_for):
        raise _no_series(mechanism, names)
    return steps


def _ends_of(bodies: tuple[str, ...], stands_for: dict[str, str]) -> tuple[str, str]:
    return stands_for.get(bodies[0], bodies[0]), stands_for.get(bodies[1], bodies[1])


def _ends(mechanism: Mechanism, stands_for: dict[str, str]) -> set[str]:
    """The bodies that end a path: the end effector, or both that it joins."""
    bodies: tuple[str, ...] = (mechanism.end_effector,)
    if mechanism.end_effector_is_joint:
        bodies = mechanism.joint(mechanism.end_effector).connects
    return {stands_for.get(body, body) for body in bodies}


def _no_series(mechanism: Mechanism, names: set[str]) -> InvalidArgument:
    listed = ", ".join(joint.name for joint in mechanism.joints if joint.name in names)
    return InvalidArgument("joints", listed, _expected(mechanism))


def _expected(mechanism: Mechanism) -> str:
    passive = passive_series(mechanism)
    hint = f", such as {', '.join(passive)}" if passive else ""
    return f"joints in series from '{mechanism.base}' to '{mechanism.end_effector}'{hint}"
