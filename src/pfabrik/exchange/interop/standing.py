"""A robot on its feet: what held or floated its trunk goes, and its feet stay where they touch the ground."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_finite, require_known
from ...errors import InvalidArgument
from ...kinematics import columns
from ...machine.description.contact import Contact, ContactType
from ...machine.description.joints import KINDS, Joint
from ...machine.description.structure import Structure
from ...machine.motion.displacements import displacements
from ...machine.motion.other_home import joints_at
from .couplings import Coupling
from .digits import Rounding
from .names import unique
from .notes import Note, note_names
from .opened import Loop, frame_along
from .robot_tree import Robot
from .simplify import merged_bodies

UP = np.array([0.0, 0.0, 1.0])
"""The normal of the ground."""

SAME_HEIGHT = 0.1
"""Share of a robot's height by which feet may be higher than its lowest one: by which they are told from hands."""


WORLD = "world"
"""The root of MuJoCo's models, and of descriptions that have one: the ground itself."""

LEAST_AFLOAT = 3
"""Freedoms of what floats, at least: in a plane."""

LEAST_DRIVES, WHOLE = 2, 6
"""Drives of the least limb that is a leg, and of one that places all of its foot."""


def posed(robot: Robot, values: Mapping[str, float]) -> Robot:
    """The robot with joints at other values [rad, m]; those that follow others follow, loops open as they may."""
    if not values:
        return robot
    tree = Structure(robot.name, tuple(robot.joints), robot.root, (0.0, 0.0, 0.0), robot.root, "m")
    scalar = [each.name for each in tree.coordinates if each.joint.name == each.name]
    require_known("joint", values, scalar)
    values = {name: require_finite(f"the value of joint '{name}'", value) for name, value in values.items()}
    q = np.zeros(len(tree.coordinates))
    for name, value in _followed(values, robot.couplings).items():
        q[columns(tree)[name]] = value - np.ravel(tree.home_coordinate(name))[0]
    motions = {body: motion[0] for body, motion in displacements(tree, q[None]).items()}
    return dataclasses.replace(
        robot,
        joints=joints_at(tree, q),
        loops=[_moved_loop(loop, motions) for loop in robot.loops],
        places={name: (body, motions.get(body, np.eye(4)) @ frame) for name, (body, frame) in robot.places.items()},
        collision=robot.collision.moved(motions),
    )


def _followed(values: Mapping[str, float], couplings: Sequence[Coupling]) -> dict[str, float]:
    """Values of joints, and of those that follow them."""
    found = dict(values)
    waiting = list(couplings)
    while ready := [each for each in waiting if each.leader in found]:
        waiting = [each for each in waiting if each not in ready]
        for each in ready:
            if each.follower not in found:
                found[each.follower] = float(np.polynomial.Polynomial(each.factors)(found[each.leader]))
    return found


def _moved_loop(loop: Loop, motions: Mapping[str, Floats]) -> Loop:
    """A loop whose two sides have moved with their bodies."""
    moves = np.array([motions.get(body, np.eye(4)) for body in loop.connects])
    points = np.einsum("bij,bj->bi", moves[:, :3, :3], loop.at) + moves[:, :3, 3]
    return dataclasses.replace(
        loop, points=points, frames=None if loop.frames is None else moves[:, :3, :3] @ loop.turned
    )


def standing(robot: Robot, feet: Mapping[str, Contact], body: str | None, notes: list[Note]) -> Robot:
    """The robot with its feet on the ground, and its trunk the end effector that nothing else holds.

    Parameters
    ----------
    feet : body, site, or named geom -> how it touches, lengths in metres.
    body : the trunk; None for the body from which the ways to the feet part.
    """
    require_known("body, site or geom to stand on", feet, _touching(robot))
    robot = _within_ranges(robot, notes)
    places, above = _touching(robot), {joint.connects[1]: joint for joint in robot.joints}
    ways = {foot: _way(places[foot][0], above) for foot in feet}
    trunk = _trunk(ways) if body is None else body
    require_known("body", [trunk], robot.places)
    end = robot.places[trunk][0]
    stands_for = merged_bodies(robot.joints, robot.root)[1]
    for foot, way in ways.items():
        if stands_for.get(way[0], way[0]) in (stands_for.get(end, end), WORLD):
            raise InvalidArgument("feet", f"'{foot}', which is fixed to '{trunk}'", f"what moves against '{trunk}'")
    taken = {*(joint.name for joint in robot.joints), *(loop.name for loop in robot.loops), *robot.places}
    base = WORLD if robot.root == WORLD else unique("ground", {*robot.places, robot.root})
    contacts = [
        contact.joint(unique(f"{foot}_contact", taken), (base, places[foot][0]), places[foot][1], UP)
        for foot, contact in feet.items()
    ]
    between = [{*way} ^ {*_way(end, above)} for way in ways.values()]
    legs = [above[each].name for way in between for each in way if each in above]
    holding = {name for way in (*ways.values(), _way(end, above)) for name in _holding(robot, way, above)}
    joints = [joint for joint in robot.joints if joint.name not in holding]
    if not any(joint.driven for joint in joints if joint.name in legs):
        joints, drives = _driven(joints, legs, {each.follower for each in robot.couplings})
        note_names(notes, "the file drives none of the legs' joints: all of them are driven", drives)
    exact = dict.fromkeys((each.name for each in contacts), Rounding(0.0, 0.0))
    return dataclasses.replace(
        robot,
        joints=[contacts[0], *joints],
        loops=[*robot.loops, *map(_as_loop, contacts[1:])],
        root=base,
        base=base,
        end_effector=trunk,
        places={base: (base, np.eye(4))} | dict(robot.places),
        roundings={**robot.roundings, **exact} if robot.roundings else {},
    )


def _within_ranges(robot: Robot, notes: list[Note]) -> Robot:
    """The robot with joints that are beyond their ranges at the nearest ends, before its feet touch the ground."""
    moved: dict[str, float] = {}
    for joint in robot.joints:
        if joint.range is not None and joint.type in ("revolute", "prismatic"):
            (low, high), value = np.ravel(joint.range).tolist(), float(np.ravel(joint.home)[0])
            if not low <= value <= high:
                moved[joint.name] = min(max(value, low), high)
    note_names(notes, "home was outside the range, and is moved into it", moved)
    return posed(robot, moved)


def _holding(robot: Robot, way: Sequence[str], above: Mapping[str, Joint]) -> Iterator[str]:
    """Yield the joints that hold the robot, or let it float, above its first body.

    They are those of the world; of another root those that let the robot float, where the root weighs nothing: any
    other is a part of it.
    """
    masses = {each.body for each in robot.collision.masses if each.mass > 0.0}
    first = next((place for place in range(len(way) - 2, -1, -1) if way[place] in robot.places), -1)
    joints = [above[each] for each in way[first:-1]] if first >= 0 and way[-1] == robot.root else []
    is_afloat = sum(len(KINDS[joint.type].coordinates) for joint in joints) >= LEAST_AFLOAT
    is_afloat &= not any(joint.driven or joint.range for joint in joints)
    if robot.root == WORLD or (is_afloat and robot.root not in masses):
        yield from (joint.name for joint in joints)


def feet_of(robot: Robot) -> dict[str, ContactType]:
    """The ends of a robot's lowest limbs, by the names of what is lowest there, and how they touch; none without two.

    A limb is what drives move, or would, in two freedoms or more, unlike a wheel; its end is flat with six, else a
    point.
    """
    above = {joint.connects[1]: joint for joint in robot.joints}
    stands_for = merged_bodies(robot.joints, robot.root)[1]
    parents = {stands_for.get(joint.connects[0], joint.connects[0]) for joint in robot.joints if joint.type != "fixed"}
    is_driven = any(joint.driven for joint in robot.joints)
    ends: dict[str, tuple[float, str, ContactType]] = {}
    for name, (body, frame) in _touching(robot).items():
        rigid = stands_for.get(body, body)
        joints = [above[each] for each in _way(body, above) if each in above]
        drives = sum(bool(each.driven) if is_driven else KINDS[each.type].actuatable for each in joints)
        if rigid in parents or drives < LEAST_DRIVES:
            continue
        found: tuple[float, str, ContactType] = float(frame[2, 3]), name, "flat" if drives >= WHOLE else "point"
        ends[rigid] = min(ends.get(rigid, found), found)
    heights = [frame[2, 3] for _, frame in robot.places.values()]
    most = min((end[0] for end in ends.values()), default=0.0) + SAME_HEIGHT * (max(heights) - min(heights))
    lowest = {name: touch for height, name, touch in ends.values() if height <= most}
    return lowest if len(lowest) > 1 else {}


def _touching(robot: Robot) -> dict[str, tuple[str, Floats]]:
    """What may be a foot -> its body and frame (4, 4) [m]: bodies, sites, and named solids at their middles."""
    found: dict[str, tuple[str, Floats]] = {}
    for solid in robot.collision.solids:
        frame, shape = np.eye(4), solid.shape
        middle = shape.at if shape.at is not None else None if shape.ends is None else np.mean(shape.ends, axis=0)
        if solid.name and middle is not None:
            frame[:3, 3] = middle
            found[solid.name] = shape.body, frame
    return found | dict(robot.places)


def _way(body: str, above: Mapping[str, Joint]) -> list[str]:
    """A body, and those that it hangs on, up to the root."""
    way = [body]
    while way[-1] in above:
        way.append(above[way[-1]].connects[0])
    return way


def _trunk(ways: Mapping[str, Sequence[str]]) -> str:
    """The body from which the ways to the feet part."""
    shared = set.intersection(*map(set, ways.values())) - {WORLD}
    trunk = next((each for each in next(iter(ways.values())) if each in shared), None)
    if len(ways) < 2 or trunk is None:
        raise InvalidArgument("body", "none", "the body to be moved over the feet (--end-effector)")
    return trunk


def _driven(joints: list[Joint], legs: list[str], following: set[str]) -> tuple[list[Joint], list[str]]:
    """The joints with all drives there can be in the legs, and the names of these."""
    drives = [
        joint.name
        for joint in joints
        if joint.name in legs and KINDS[joint.type].actuatable and joint.name not in following
    ]
    return [dataclasses.replace(each, actuated=each.actuated or each.name in drives) for each in joints], drives


def _as_loop(joint: Joint) -> Loop:
    """A contact as a loop that is closed."""
    at = np.zeros(3) if joint.at is None else np.array(joint.at)
    frame = np.eye(3) if joint.axis is None else frame_along(np.array(joint.axis))
    kind = joint.type
    return Loop(joint.name, kind, joint.connects, [at, at], None if kind == "spherical" else [frame, frame])  # type: ignore[arg-type]
