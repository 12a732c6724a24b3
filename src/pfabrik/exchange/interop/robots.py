"""A robot of another program, and the mechanism in it: between a base and an end effector, with what moves both."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_known, require_names, require_positive
from ...errors import InvalidArgument, PfabrikError, counted
from ...kinematics import generic_of
from ...machine.description.contact import ContactLike, as_contacts
from ...machine.description.joints import KINDS, Joint
from ...machine.description.mechanism import Mechanism
from ...machine.files.units import metres_of
from .assembling import Imported, closed
from .choices import Build, Choice, Moved, NoEndEffector, choices_of, enough_drives
from .collision import NO_COLLISION
from .couplings import with_coupled_drives
from .digits import Rounding, worst
from .driving import no_drives, with_actuators
from .imported_masses import with_masses
from .imported_shapes import with_collision
from .names import unique
from .notes import Note, note_names, with_task
from .opened import OpenMechanism
from .robot_tree import Robot
from .simplify import merged_bodies, merged_pair, prune
from .standing import feet_of, standing
from .stuck_drives import stuck_drives

PROPOSED = (1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3)
"""Values of `within` [m and rad] that are tried, where loops all but move, to propose the least that lets them."""


class ImportOptions(NamedTuple):
    """Options of an import, besides base and end effector; see `from_mjcf`."""

    actuated: Sequence[str] | None = None
    length_unit: str = "m"
    task: Sequence[str] | None = None
    within: float | None = None
    feet: Mapping[str, ContactLike] | Sequence[str] | None = None


def mechanism_of(
    robot: Robot,
    base: str | None,
    end_effector: str | None,
    asked: ImportOptions,
    notes: list[Note],
    fixed: Iterable[str] = (),
    leave_out: Iterable[str] = (),
) -> Imported:
    """The mechanism between the base and the end effector of a robot, its loops closed; arguments as in `from_mjcf`."""
    metres_of(asked.length_unit)
    robot = _with_drives(_with_held(_without(robot, leave_out, notes), fixed), asked.actuated)
    if asked.feet is not None:
        if base is not None:
            raise InvalidArgument("base", repr(base), "none beside `feet`, which are on the ground")
        metres = metres_of(asked.length_unit)
        feet = {name: each.scaled(metres) for name, each in as_contacts("feet", asked.feet).items()}
        robot, end_effector = standing(robot, feet, end_effector, notes), None
    base = _base(robot, base)
    end_effector = _end_effector(robot, end_effector, base)
    if asked.task is not None:
        asked = asked._replace(task=require_names("task", asked.task))
    if asked.within is not None:
        asked = asked._replace(within=require_positive("within", asked.within))
    found = _between(robot, base, end_effector, asked, notes)
    if asked.within is None:
        plain = dataclasses.replace(robot, collision=NO_COLLISION)

        def made(within: float) -> Mechanism:
            return _between(plain, base, end_effector, asked._replace(within=within), []).mechanism

        notes += _proposals(found.mechanism, made)
    return dataclasses.replace(found, notes=tuple(notes))


def _between(robot: Robot, base: str, end_effector: str, asked: ImportOptions, notes: list[Note]) -> Imported:
    """The mechanism between two bodies of a robot with drives."""
    tip, point = _place(robot, end_effector)
    if tip != base and merged_bodies(robot.joints, base)[1].get(tip) == base:
        raise InvalidArgument("end_effector", f"'{tip}', which is fixed to '{base}'", "a body that moves")
    rigid = _with_merged_bodies(robot, base, tip)
    moving = {loop.name for loop in rigid.loops}
    if still := tuple(loop.name for loop in robot.loops if loop.name not in moving):
        notes.append(Note("loops between bodies that are fixed to each other are left out", still))
    if point is not None:
        rigid = _without_joint_named(tip, rigid, notes)
    if asked.task is None and (base, end_effector) == (robot.base, robot.end_effector):
        asked = asked._replace(task=robot.task)
    opened = prune(_opened(rigid, base, tip, point, asked), notes)
    opened = with_coupled_drives(opened, rigid.joints, rigid.couplings, asked.actuated or (), notes)
    if not any(joint.driven for joint in opened.joints):
        enough = () if robot.unread else _enough(rigid, opened, end_effector)
        raise no_drives(opened, robot.joints, robot.undriven, enough)
    home = closed(opened, notes)
    mechanism = with_actuators(home.mechanism, robot.order, robot.rates, metres_of(asked.length_unit))
    passive = (joint.name for joint in opened.joints if not joint.driven)
    rubbing = [name for name in passive if (said := robot.rates.get(name)) and (said.friction or said.rotor_inertia)]
    note_names(notes, "friction and armature of joints that are not driven are left out, of", rubbing)
    mechanism = with_task(mechanism, asked.task is not None, notes)
    mechanism = with_masses(mechanism, home.collision.masses, robot.places, notes)
    mechanism = with_collision(mechanism, home.collision, notes)
    return Imported(mechanism, home.gap, tuple(notes))


def _enough(robot: Robot, opened: OpenMechanism, end_effector: str) -> tuple[str, ...]:
    """Drives that move all of a machine within a robot; none where they cannot be found."""
    with suppress(PfabrikError):
        if any(KINDS[joint.type].actuatable for joint in opened.joints):
            return enough_drives(opened.base, end_effector, opened.joints, _build(robot))
    return ()


def _build(robot: Robot) -> Build:
    """What makes mechanisms of a robot, for choices among them."""
    plain = dataclasses.replace(robot, collision=NO_COLLISION)

    def build(base: str, end_effector: str, drives: Sequence[str] | None) -> Mechanism:
        driven = _with_drives(plain, drives)
        return _between(driven, base, end_effector, ImportOptions(drives), []).mechanism

    return build


def _proposals(mechanism: Mechanism, made: Callable[[float], Mechanism]) -> Iterator[Note]:
    """Drives that move nothing; the least `within` that gives more motions, where loops all but let it have them."""
    counts, stuck = generic_of(mechanism).mobility, stuck_drives(mechanism)
    if stuck:
        what = "no drive moves anything" if len(stuck) == len(mechanism.drives) else "drives that move nothing"
        yield Note(f"{what}: forward kinematics does not follow 10 deg, or a tenth of a range, from home", stuck)
    if not (stuck or counts.nearly_free) and counts.platform > 0:
        return
    for within in PROPOSED:
        with suppress(PfabrikError):
            again = made(within)
            more = generic_of(again).mobility.platform
            if more > counts.platform or (stuck and not stuck_drives(again)):
                wins = f"{counted(more, 'freedom')} of the end effector for {counts.platform}"
                wins = wins if more > counts.platform else "drives that move it"
                what = f"the loops lock by little: making what is off by less parallel, equal, or meet gives {wins}"
                yield Note(f"{what}: try --within {within:g}")
                return


def _joints_to_be(argument: str, names: Iterable[str], known: list[str]) -> set[str]:
    """The names of joints, if all are known."""
    names = require_names(argument, names)
    require_known(f"joint to be {argument}", names, known)
    return set(names)


def _without(robot: Robot, names: Iterable[str], notes: list[Note]) -> Robot:
    """Without the loops of these names, and the couplings of joints of these names."""
    known = [*(loop.name for loop in robot.loops), *(each.follower for each in robot.couplings)]
    omitted = require_names("leave_out", names)
    require_known("loop, or joint that follows another, to leave out", omitted, known)
    note_names(notes, "left out as asked for", omitted)
    loops = [loop for loop in robot.loops if loop.name not in omitted]
    couplings = [each for each in robot.couplings if each.follower not in omitted]
    return dataclasses.replace(robot, loops=loops, couplings=couplings)


def _with_held(robot: Robot, fixed: Iterable[str]) -> Robot:
    """With some joints held where they are."""
    held = _joints_to_be("fixed", fixed, [joint.name for joint in robot.joints])
    joints = [Joint(each.name, "fixed", each.connects) if each.name in held else each for each in robot.joints]
    return dataclasses.replace(robot, joints=joints)


def _with_drives(robot: Robot, actuated: Sequence[str] | None) -> Robot:
    """With other joints actuated than in the file, in the order in which they are named."""
    if actuated is None:
        return robot
    actuatable = [joint.name for joint in robot.joints if KINDS[joint.type].actuatable]
    driven = _joints_to_be("actuated", actuated, actuatable)
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
    require_known("body", [base], _bodies(robot))
    return base


def _end_effector(robot: Robot, end_effector: str | None, base: str) -> str:
    """The given end effector, else that of the file; else the error has what may be chosen."""
    if end_effector is not None:
        known = [*robot.places, *_joint_names(robot)]
        require_known("body, site or joint", [end_effector], known)
        return end_effector
    if robot.end_effector is not None:
        return robot.end_effector
    rigid = _with_merged_bodies(robot, base, base)
    chains = choices_of(rigid.joints, rigid.loops, base, _build(rigid), robot.unread)
    raise NoEndEffector([*_stances(robot), *chains])


def _stances(robot: Robot) -> Iterator[Choice]:
    """The robot on its feet, where it has some."""
    feet = feet_of(robot)
    if not feet:
        return
    try:
        plain = dataclasses.replace(standing(robot, as_contacts("feet", feet), None, []), collision=NO_COLLISION)
        base, trunk = _base(plain, None), _end_effector(plain, None, "")
        machine = _between(plain, base, trunk, ImportOptions(), []).mechanism
        moved = Moved(trunk, generic_of(machine).mobility.platform, 0, machine.actuator_names)
        yield Choice(base, (), trunk, None, (moved,), feet=feet)
    except PfabrikError as error:
        yield Choice(robot.root, feet=feet, refusal=f"refused: {str(error).splitlines()[0]}")


def _place(robot: Robot, end_effector: str) -> tuple[str, Floats | None]:
    """The body of an end effector and its point there [m]; of a joint that moves, its own name, and None."""
    for joint in robot.joints:
        if joint.name == end_effector and joint.type == "fixed":
            return _origin(robot.places[joint.connects[1]])
    if end_effector in _bodies(robot) or end_effector not in _joint_names(robot):
        return _origin(robot.places[end_effector])
    return end_effector, None


def _origin(place: tuple[str, Floats]) -> tuple[str, Floats]:
    """A body, and the origin (3,) of a frame of it."""
    return place[0], place[1][:3, 3]


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


def _opened(robot: Robot, base: str, tip: str, point: Floats | None, asked: ImportOptions) -> OpenMechanism:
    """The robot in the unit of the mechanism."""
    metres, within = metres_of(asked.length_unit), asked.within
    roundings = dict(robot.roundings)
    if within is not None:
        roundings = dict.fromkeys([joint.name for joint in robot.joints], Rounding(within, within))
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
        asked.length_unit,
        None if asked.task is None else tuple(asked.task),
        robot.cones,
        {name: Rounding(each.length / metres, each.angle) for name, each in roundings.items()},
        robot.collision.in_unit(metres),
        within is not None,
        robot.spans,
    )


def _in_unit(joint: Joint, metres: float) -> Joint:
    """A joint in the unit of the mechanism."""
    changes: dict[str, Any] = {"at": None if joint.at is None else np.array(joint.at) / metres}
    if joint.type == "prismatic":
        changes["home"] = np.divide(joint.home, metres)
        changes["range"] = None if joint.range is None else np.divide(joint.range, metres)
    return dataclasses.replace(joint, **changes)
