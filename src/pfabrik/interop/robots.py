"""A robot of another program, and the mechanism in it: between a base and an end effector, with what moves both."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Floats
from ..checks import require_names
from ..description.graph import welded
from ..description.joint_types import KINDS
from ..description.joints import Cone, Joint
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument, UnknownName
from ..files.units import metres_of
from .assembling import Imported, assemble
from .cuts import unique
from .opened import Loop, Note, OpenMechanism
from .pruning import prune
from .tasks import with_task


class Rates(NamedTuple):
    """The highest speed and acceleration of a coordinate, None where not known."""

    speed: float | None = None
    acceleration: float | None = None


@dataclass(frozen=True)
class Robot:
    """A tree of bodies and what closes its loops, in metres and radians, in the frame of its root.

    Attributes
    ----------
    joints : from the root outward, each from its parent to its child; bodies welded to each other have a fixed one.
    root : the body that the others hang on.
    places : what an end effector may be called besides a joint -> its body, and the point of it that targets place [m].
    base, end_effector, task, cones : what the file says of a mechanism in it, if anything.
    order : coordinates that are driven, in the order of the actuators; those that are not named come behind.
    rates : coordinate -> its highest speed and acceleration [rad or m, per s and per s^2], None where not known.
    """

    name: str
    joints: Sequence[Joint]
    loops: Sequence[Loop]
    root: str
    places: Mapping[str, tuple[str, Floats]]
    base: str | None = None
    end_effector: str | None = None
    task: tuple[str, ...] | None = None
    cones: Mapping[str, Cone] = field(default_factory=dict)
    order: Sequence[str] = ()
    rates: Mapping[str, Rates] = field(default_factory=dict)


def mechanism_of(
    robot: Robot,
    told: list[Note],
    base: str | None,
    end_effector: str | None,
    actuated: Iterable[str] | None,
    fixed: Iterable[str],
    length_unit: str,
    task: Sequence[str] | None,
) -> Imported:
    """The mechanism between the base and the end effector of a robot, its loops closed; asked for as of `from_mjcf`."""
    metres = metres_of(length_unit)
    robot = _driven(_locked(robot, fixed), actuated)
    base = _base(robot, base)
    end_effector = _end_effector(robot, end_effector, base, told)
    tip, point = _place(robot, end_effector)
    as_told = (base, end_effector) == (robot.base, robot.end_effector)
    joints, loops, cones = _merged(robot, base, tip)
    if point is not None:
        joints, loops = _not_called(tip, joints, loops, told)
    opened = OpenMechanism(
        robot.name,
        tuple(_in_unit(joint, metres) for joint in joints),
        tuple(dataclasses.replace(loop, points=loop.at / metres) for loop in loops),
        tip,
        None if point is None else tuple((point / metres).tolist()),
        base,
        length_unit,
        require_names("task", task) if task is not None else robot.task if as_told else None,
        cones,
    )
    found = assemble(prune(opened, told), told)
    mechanism = _as_driven(found.mechanism, robot, metres)
    notes = list(found.notes)
    mechanism = with_task(mechanism, opened.task is not None, notes)
    return dataclasses.replace(found, mechanism=mechanism, notes=tuple(notes))


def _as_driven(mechanism: Mechanism, robot: Robot, metres: float) -> Mechanism:
    """With its actuators in the order of the file, and as fast as it says."""
    place = {name: index for index, name in enumerate(robot.order)}
    drives = {joint.name: [each for each in mechanism.drives if each.joint is joint] for joint in mechanism.joints}

    def rank(joint: Joint) -> int:
        return min(place.get(drive.name, len(place)) for drive in drives[joint.name])

    def most(joint: Joint, what: int) -> tuple[float, ...] | float | None:
        found = []
        for drive in drives[joint.name]:
            value = robot.rates.get(drive.name, Rates())[what]
            if value is None:
                return None
            found.append(value if drive.kind == "angle" else value / metres)
        return tuple(found) if len(found) > 1 else found[0]

    def rated(joint: Joint) -> Joint:
        rates: dict[str, Any] = {"max_speed": most(joint, 0), "max_acceleration": most(joint, 1)}
        return dataclasses.replace(joint, **rates)

    driven = iter(sorted((joint for joint in mechanism.joints if joint.driven), key=rank))
    return mechanism._with_joints(rated(next(driven)) if joint.driven else joint for joint in mechanism.joints)


def _names(what: str, names: Iterable[str], known: Iterable[str]) -> set[str]:
    """Names that are all known; UnknownName for the first that is not."""
    listed, every = require_names(what, names), list(known)
    for name in listed:
        if name not in every:
            raise UnknownName(f"joint to be {what}", name, every)
    return set(listed)


def _locked(robot: Robot, fixed: Iterable[str]) -> Robot:
    """With some joints held where they are."""
    held = _names("fixed", fixed, (joint.name for joint in robot.joints))
    joints = [Joint(each.name, "fixed", each.connects) if each.name in held else each for each in robot.joints]
    return dataclasses.replace(robot, joints=joints)


def _driven(robot: Robot, actuated: Iterable[str] | None) -> Robot:
    """With other joints actuated than the file says, in the order in which they are named."""
    if actuated is None:
        return robot
    order = require_names("actuated", actuated)
    able = [joint.name for joint in robot.joints if KINDS[joint.type].actuatable]
    driven = _names("actuated", order, able)
    joints = [dataclasses.replace(joint, actuated=joint.name in driven) for joint in robot.joints]
    return dataclasses.replace(robot, joints=joints, order=order)


def _bodies(robot: Robot) -> dict[str, None]:
    """All bodies, in order."""
    return dict.fromkeys([robot.root, *(body for joint in robot.joints for body in joint.connects)])


def _base(robot: Robot, base: str | None) -> str:
    """The body asked for, else the file's own, else the root."""
    if base is None:
        return robot.base or robot.root
    if not isinstance(base, str) or base not in _bodies(robot):
        raise UnknownName("body", base, _bodies(robot))
    return base


def _end_effector(robot: Robot, end_effector: str | None, base: str, told: list[Note]) -> str:
    """What was asked for, else the file's own, else the one body at which most joints and loops meet."""
    joints = [each.name for each in robot.joints] + [each.name for each in robot.loops]
    if end_effector is not None:
        if not isinstance(end_effector, str) or end_effector not in [*robot.places, *joints]:
            raise UnknownName("body, site or joint", end_effector, [*robot.places, *joints])
        return end_effector
    if robot.end_effector is not None:
        return robot.end_effector
    merged, loops, _ = _merged(robot, base, base)
    pairs = [each.connects for each in merged] + [each.connects for each in loops]
    touching = Counter(body for pair in pairs for body in pair if body != base)
    counts = touching.most_common()
    if not loops or len(counts) < 2 or counts[0][1] == counts[1][1]:
        raise InvalidArgument("end_effector", "none, and no body where most legs meet", f"one of {', '.join(touching)}")
    told.append(Note("taken for the end effector, for most joints meet there", (counts[0][0],)))
    return counts[0][0]


def _place(robot: Robot, end_effector: str) -> tuple[str, Floats | None]:
    """The body of an end effector and its point there [m]; of a joint that moves, its own name, and None."""
    for joint in robot.joints:
        if joint.name == end_effector and joint.type == "fixed":
            return robot.places[joint.connects[1]]
    is_joint = end_effector in [each.name for each in robot.joints] + [each.name for each in robot.loops]
    if end_effector in _bodies(robot) or not is_joint:
        return robot.places[end_effector]
    return end_effector, None


def _merged(robot: Robot, base: str, tip: str) -> tuple[list[Joint], list[Loop], dict[str, Cone]]:
    """Joints, loops and cones with the bodies that are welded to each other as one, called as asked for."""
    weld = welded([joint for joint in robot.joints if joint.type == "fixed"], base, tip)

    def named(pair: tuple[str, str]) -> tuple[str, str]:
        return weld.get(pair[0], pair[0]), weld.get(pair[1], pair[1])

    joints = [dataclasses.replace(each, connects=named(each.connects)) for each in robot.joints if each.type != "fixed"]
    loops = [dataclasses.replace(each, connects=named(each.connects)) for each in robot.loops]
    cones = {
        name: dataclasses.replace(cone, fixed_to=weld.get(cone.fixed_to, cone.fixed_to))
        for name, cone in robot.cones.items()
    }
    return joints, [loop for loop in loops if loop.connects[0] != loop.connects[1]], cones


def _not_called(tip: str, joints: list[Joint], loops: list[Loop], told: list[Note]) -> tuple[list[Joint], list[Loop]]:
    """With another name for a joint that is called as the end effector, a body."""
    taken = {tip, *(joint.name for joint in joints), *(loop.name for loop in loops)}
    name = unique(f"{tip}_joint", taken)
    if any(each.name == tip for each in joints) or any(each.name == tip for each in loops):
        told.append(Note(f"a joint is called as the end effector, '{tip}', and here", (name,)))
    renamed = [dataclasses.replace(each, name=name) if each.name == tip else each for each in joints]
    return renamed, [dataclasses.replace(each, name=name) if each.name == tip else each for each in loops]


def _in_unit(joint: Joint, metres: float) -> Joint:
    """A joint in the unit of the mechanism."""
    changes: dict[str, Any] = {"at": None if joint.at is None else np.array(joint.at) / metres}
    if joint.type != "prismatic":
        return dataclasses.replace(joint, **changes)
    changes |= {"home": np.divide(joint.home, metres)}
    for name in ("range", "max_speed"):
        value = getattr(joint, name)
        changes[name] = None if value is None else np.divide(value, metres)
    return dataclasses.replace(joint, **changes)
