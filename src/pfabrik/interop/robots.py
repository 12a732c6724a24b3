"""A robot of another program, and the mechanism in it: between a base and an end effector, with what moves both."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Floats
from ..checks import require_names
from ..description.joint_types import KINDS
from ..description.joints import Cone, Joint
from ..errors import InvalidArgument, UnknownName
from ..files.units import metres_of
from .assembling import Imported, closed
from .collision import NO_COLLISION, Collision
from .couplings import Coupling, with_coupled_drives
from .digits import Rounding, worst
from .driving import Rates, require_drives, with_actuators
from .imported_shapes import with_collision
from .names import unique
from .notes import Note
from .opened import Loop, OpenMechanism
from .simplify import merged_bodies, merged_pair, prune
from .tasks import with_task


@dataclass(frozen=True)
class Robot:
    """A tree of bodies and what closes its loops, in metres and radians, in the frame of its root.

    Attributes
    ----------
    joints : from the root outward, each from its parent to its child; bodies welded to each other have a fixed one.
    root : the body that the others hang on.
    places : what an end effector may be called besides a joint -> its body, and the point of it that targets place [m].
    base, end_effector, task, cones : those of a mechanism that the file describes, if any.
    order : coordinates that are driven, in the order of the actuators; those that are not named come behind.
    rates : coordinate -> its highest speed and acceleration [rad or m, per s and per s^2], None where not known.
    roundings : joint or loop -> how exactly the digits of the file place it [m, rad]; other loops are as the worst.
    couplings : joints that follow others.
    undriven : what the file has in place of driven joints, for the refusal of a machine without any.
    collision : its collision geometry [m].
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
    roundings: Mapping[str, Rounding] = field(default_factory=dict)
    couplings: Sequence[Coupling] = ()
    undriven: str = "none in the file"
    collision: Collision = NO_COLLISION


def mechanism_of(
    robot: Robot,
    notes: list[Note],
    base: str | None,
    end_effector: str | None,
    actuated: Iterable[str] | None,
    fixed: Iterable[str],
    length_unit: str,
    task: Sequence[str] | None,
) -> Imported:
    """The mechanism between the base and the end effector of a robot, its loops closed; arguments as of `from_mjcf`."""
    metres = metres_of(length_unit)
    chosen = None if actuated is None else require_names("actuated", actuated)
    robot = _with_drives(_with_held(robot, fixed), chosen)
    base = _base(robot, base)
    end_effector = _end_effector(robot, end_effector, base, notes)
    tip, point = _place(robot, end_effector)
    if tip != base and merged_bodies(robot.joints, base)[1].get(tip) == base:
        raise InvalidArgument("end_effector", f"'{tip}', which is fixed to '{base}'", "a body that moves")
    rigid = _with_merged_bodies(robot, base, tip)
    if point is not None:
        rigid = _without_joint_named(tip, rigid, notes)
    if task is not None:
        task = require_names("task", task)
    elif (base, end_effector) == (robot.base, robot.end_effector):
        task = robot.task
    opened = prune(_opened(rigid, base, tip, point, length_unit, task), notes)
    opened = with_coupled_drives(opened, rigid.joints, rigid.couplings, chosen or (), notes)
    require_drives(opened, robot.joints, robot.undriven)
    home = closed(opened, notes)
    mechanism = with_actuators(home.mechanism, robot.order, robot.rates, metres)
    mechanism = with_task(mechanism, task is not None, notes)
    mechanism = with_collision(mechanism, home.collision, notes)
    return Imported(mechanism, home.gap, tuple(notes))


def _require_known(argument: str, names: Iterable[str], known: Iterable[str]) -> set[str]:
    """The names, if all are known; UnknownName for the first that is not."""
    names, known = require_names(argument, names), list(known)
    for name in names:
        if name not in known:
            raise UnknownName(f"joint to be {argument}", name, known)
    return set(names)


def _with_held(robot: Robot, fixed: Iterable[str]) -> Robot:
    """With some joints held where they are."""
    held = _require_known("fixed", fixed, (joint.name for joint in robot.joints))
    joints = [Joint(each.name, "fixed", each.connects) if each.name in held else each for each in robot.joints]
    return dataclasses.replace(robot, joints=joints)


def _with_drives(robot: Robot, actuated: Sequence[str] | None) -> Robot:
    """With other joints actuated than in the file, in the order in which they are named."""
    if actuated is None:
        return robot
    actuatable = [joint.name for joint in robot.joints if KINDS[joint.type].actuatable]
    driven = _require_known("actuated", actuated, actuatable)
    joints = [dataclasses.replace(joint, actuated=joint.name in driven) for joint in robot.joints]
    return dataclasses.replace(robot, joints=joints, order=actuated)


def _bodies(robot: Robot) -> dict[str, None]:
    """All bodies, in order."""
    return dict.fromkeys([robot.root, *(body for joint in robot.joints for body in joint.connects)])


def _joint_names(robot: Robot) -> list[str]:
    """Names of joints, then of loops."""
    return [joint.name for joint in robot.joints] + [loop.name for loop in robot.loops]


def _base(robot: Robot, base: str | None) -> str:
    """The given base, else that of the file, else the root."""
    if base is None:
        return robot.base or robot.root
    if not isinstance(base, str) or base not in _bodies(robot):
        raise UnknownName("body", base, _bodies(robot))
    return base


def _end_effector(robot: Robot, end_effector: str | None, base: str, notes: list[Note]) -> str:
    """The given end effector, else that of the file, else the one body at which most joints and loops meet."""
    if end_effector is not None:
        known = [*robot.places, *_joint_names(robot)]
        if not isinstance(end_effector, str) or end_effector not in known:
            raise UnknownName("body, site or joint", end_effector, known)
        return end_effector
    if robot.end_effector is not None:
        return robot.end_effector
    rigid = _with_merged_bodies(robot, base, base)
    pairs = [joint.connects for joint in rigid.joints] + [loop.connects for loop in rigid.loops]
    joints_at = Counter(body for pair in pairs for body in pair if body != base)
    counts = joints_at.most_common()
    if not rigid.loops or len(counts) < 2 or counts[0][1] == counts[1][1]:
        raise InvalidArgument(
            "end_effector", "none, and no body where most legs meet", f"one of {', '.join(joints_at)} (--end-effector)"
        )
    notes.append(Note("taken for the end effector, for most joints meet there", (counts[0][0],)))
    return counts[0][0]


def _place(robot: Robot, end_effector: str) -> tuple[str, Floats | None]:
    """The body of an end effector and its point there [m]; of a joint that moves, its own name, and None."""
    for joint in robot.joints:
        if joint.name == end_effector and joint.type == "fixed":
            return robot.places[joint.connects[1]]
    if end_effector in _bodies(robot) or end_effector not in _joint_names(robot):
        return robot.places[end_effector]
    return end_effector, None


def _with_merged_bodies(robot: Robot, base: str, tip: str) -> Robot:
    """With bodies that are welded to each other as one, called as the base or the tip where it is one of them."""
    joints, stands_for = merged_bodies(robot.joints, base, tip)
    loops = [dataclasses.replace(loop, connects=merged_pair(loop.connects, stands_for)) for loop in robot.loops]
    cones = {
        name: dataclasses.replace(cone, fixed_to=stands_for.get(cone.fixed_to, cone.fixed_to))
        for name, cone in robot.cones.items()
    }
    return dataclasses.replace(
        robot,
        joints=[joint for joint in joints if joint.type != "fixed"],
        loops=[loop for loop in loops if loop.connects[0] != loop.connects[1]],
        cones=cones,
        collision=robot.collision.merged(stands_for),
    )


def _without_joint_named(tip: str, robot: Robot, notes: list[Note]) -> Robot:
    """With another name for a joint that is called as the end effector, a body."""
    name = unique(f"{tip}_joint", {tip, *_joint_names(robot)})
    if tip not in _joint_names(robot):
        return robot
    notes.append(Note(f"a joint is called as the end effector, '{tip}', and here", (name,)))
    return dataclasses.replace(
        robot,
        joints=[dataclasses.replace(each, name=name) if each.name == tip else each for each in robot.joints],
        loops=[dataclasses.replace(each, name=name) if each.name == tip else each for each in robot.loops],
        couplings=[each.renamed(tip, name) for each in robot.couplings],
    )


def _opened(
    robot: Robot, base: str, tip: str, point: Floats | None, length_unit: str, task: Sequence[str] | None
) -> OpenMechanism:
    """The robot in the unit of the mechanism."""
    metres = metres_of(length_unit)
    roundings = dict(robot.roundings)
    if roundings:
        coarsest = worst(roundings.values())
        roundings = {loop.name: coarsest for loop in robot.loops} | roundings
    return OpenMechanism(
        robot.name,
        tuple(_in_unit(joint, metres) for joint in robot.joints),
        tuple(dataclasses.replace(loop, points=loop.at / metres) for loop in robot.loops),
        tip,
        None if point is None else tuple((point / metres).tolist()),
        base,
        length_unit,
        None if task is None else tuple(task),
        robot.cones,
        {name: Rounding(each.length / metres, each.angle) for name, each in roundings.items()},
        robot.collision.in_unit(metres),
    )


def _in_unit(joint: Joint, metres: float) -> Joint:
    """A joint in the unit of the mechanism."""
    changes: dict[str, Any] = {"at": None if joint.at is None else np.array(joint.at) / metres}
    if joint.type == "prismatic":
        changes["home"] = np.divide(joint.home, metres)
        changes["range"] = None if joint.range is None else np.divide(joint.range, metres)
    return dataclasses.replace(joint, **changes)
