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
from ..description.graph import welded
from ..description.joint_types import KINDS
from ..description.joints import Cone, Joint
from ..errors import InvalidArgument, UnknownName
from ..files.units import metres_of
from .assembling import Imported, assemble
from .couplings import Coupling, coupled
from .cuts import unique
from .digits import Rounding
from .driving import Rates, as_driven, require_drives
from .opened import Loop, Note, OpenMechanism
from .pruning import prune
from .tasks import with_task

MOST_NAMES = 24
"""Most candidates that a refusal lists."""


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
    roundings : joint or loop -> how exactly the digits of the file place it [m, rad].
    couplings : joints that follow others.
    undriven : what the file has in place of driven joints, for the refusal of a machine without any.
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
    chosen = () if actuated is None else require_names("actuated", actuated)
    robot = _driven(_locked(robot, fixed), None if actuated is None else chosen)
    base = _base(robot, base)
    end_effector = _end_effector(robot, end_effector, base, told)
    tip, point = _place(robot, end_effector)
    as_told = (base, end_effector) == (robot.base, robot.end_effector)
    joints, loops, cones = _merged(robot, base, tip)
    couplings = robot.couplings
    if point is not None:
        joints, loops, couplings = _not_called(tip, joints, loops, couplings, told)
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
        {name: Rounding(each.length / metres, each.angle) for name, each in robot.roundings.items()},
    )
    opened = coupled(prune(opened, told), joints, couplings, chosen, told)
    require_drives(opened, robot.joints, robot.undriven)
    found = assemble(opened, told)
    notes = list(found.notes)
    mechanism = with_task(as_driven(found.mechanism, robot.order, robot.rates, metres), opened.task is not None, notes)
    return dataclasses.replace(found, mechanism=mechanism, notes=tuple(notes))


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
        raise InvalidArgument(
            "end_effector", "none, and no body where most legs meet", f"one of {', '.join(touching)} (--end-effector)"
        )
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


def _not_called(
    tip: str, joints: list[Joint], loops: list[Loop], couplings: Sequence[Coupling], told: list[Note]
) -> tuple[list[Joint], list[Loop], Sequence[Coupling]]:
    """With another name for a joint that is called as the end effector, a body."""
    taken = {tip, *(joint.name for joint in joints), *(loop.name for loop in loops)}
    name = unique(f"{tip}_joint", taken)
    if tip not in [*(each.name for each in joints), *(each.name for each in loops)]:
        return joints, loops, couplings
    told.append(Note(f"a joint is called as the end effector, '{tip}', and here", (name,)))
    renamed = [dataclasses.replace(each, name=name) if each.name == tip else each for each in joints]
    loops = [dataclasses.replace(each, name=name) if each.name == tip else each for each in loops]
    return renamed, loops, [each.renamed(tip, name) for each in couplings]


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
