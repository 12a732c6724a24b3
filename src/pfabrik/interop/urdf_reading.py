"""A robot description (URDF) as a mechanism: a tree of links, and loops that a second file or the caller describes."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ..arrays import Floats
from ..description.joint_types import KINDS
from ..description.joints import Joint
from ..errors import InvalidMechanism
from .assembling import Imported
from .digits import FEWEST, NOTHING, Rounding, digits_of
from .driving import Rates
from .loops_file import LoopsFile, placed_loops, read_loops, roundings_of_loops
from .notes import Note, noting
from .opened import Loop, loops_by_name
from .robots import Robot, mechanism_of
from .unread_loops import unread_loops
from .urdf_collision import read_collision
from .urdf_links import UrdfJoint, UrdfLinks, numbers_in, read_links
from .xml_reading import read_xml


def from_urdf(
    source: str | os.PathLike[str],
    loops: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    *,
    base: str | None = None,
    end_effector: str | None = None,
    actuated: Iterable[str] | None = None,
    fixed: Iterable[str] = (),
    length_unit: str = "m",
    task: Sequence[str] | None = None,
) -> Imported:
    """The mechanism in a robot description, with the loops that URDF cannot express.

    Home is the zero configuration, closed: where the description is open there, passive joints are moved until its
    loops meet, within their ranges. Base coordinates are those of the root link. Boxes, spheres, cylinders and capsules
    of `collision` become shapes; links that overlap at home may touch (`ignore`).

    Parameters
    ----------
    source : the path of a URDF file, or its text.
    loops : the path of a YAML file, or the content of such a file: which links meet where, and which joints are driven;
        in the plain form of the documentation, or that of Gepetto's example-parallel-robots (`closed_loop`, `type`,
        `name_mot`). Frames that are called `closing_<name>_1` and `closing_<name>_2` meet in balls, or in hinges where
        there are frames of the same names with `_z` behind them, unless this file says how they meet.
    base : the link that rests. Default: the root.
    end_effector : a link, or a joint or loop (whose centre is moved). Default: the link at which most joints meet.
    actuated : names of the joints that are driven, in the order of the actuators; a `velocity` that is not 0 is their
        highest speed. Default: those of `loops`, else those with a transmission.
    fixed, length_unit, task : as of `from_mjcf`.

    Returns
    -------
    Imported : the mechanism, how far its loops were open, and notes of all that was left out or changed, by name.

    Raises
    ------
    MissingLibrary : PyYAML is not installed, and `loops` is a file.
    InvalidMechanism : no URDF, or one that cannot be closed, with every fault that was found; else as of `from_mjcf`.
    UnknownName, InvalidArgument : as of `from_mjcf`.
    """
    element = read_xml(source, "robot")
    notes: list[Note] = []
    with noting(notes):
        loops_file = read_loops(loops)
        links = read_links(element, loops_file.retyped)
        robot = replace(_robot(links, loops_file, notes), collision=read_collision(element, links, notes))
        _require_read_loops(element, links, robot.loops)
        motors = [name for name in loops_file.actuated if name in links.link_of] or None
        drives = motors if actuated is None else actuated
        return mechanism_of(robot, notes, base, end_effector, drives, fixed, length_unit, task)


def _require_read_loops(element: ET.Element, links: UrdfLinks, loops: Sequence[Loop]) -> None:
    """Refuse elements beside links and joints that bind two links, unless a file of loops says how."""
    known = {frozenset(loop.connects) for loop in loops}
    parts = [part for each in element for part in (each if each.tag in ("link", "joint") else [each])]
    remedy = "the loop in a file of loops (--loops), or a description without this element"
    faults = [fault for part in parts for fault in unread_loops(part, links.frames, links.root, known, remedy)]
    if faults:
        raise InvalidMechanism(faults)


def _robot(links: UrdfLinks, loops_file: LoopsFile, notes: list[Note]) -> Robot:
    """The links as a robot, with its loops."""
    joints = [part for joint in links.joints for part in _parts(joint, links, notes)]
    unknown = tuple(name for name in (*loops_file.retyped, *loops_file.actuated) if name not in links.link_of)
    if unknown:
        notes.append(Note("told of in the loops, but no joint of the robot", unknown))
    link_loops = loops_file.loops(links.frames, links.link_of)
    loops = placed_loops(link_loops, links.frames)
    places = {link: (link, frame[:3, 3]) for link, frame in links.frames.items()}
    frames = {joint: places[link] for joint, link in links.link_of.items()} | places
    taken = [*links.link_of, *(loop.name for loop in loops)]
    of_links, of_joints = _roundings(links.joints, links.root)
    return Robot(
        links.name,
        joints,
        [*loops, *loops_by_name(frames, loops, taken, notes)],
        links.root,
        places,
        order=links.driven,
        rates={joint.name: Rates(joint.max_speed) for joint in links.joints},
        roundings=of_joints | roundings_of_loops(link_loops, of_links),
        couplings=[joint.mimic for joint in links.joints if joint.mimic is not None],
        undriven="no transmission, and no motor in a file of loops",
    )


def _parts(joint: UrdfJoint, links: UrdfLinks, notes: list[Note]) -> Iterator[Joint]:
    """The joints of a mechanism that one of the description is, in series, where they are at zero."""
    if joint.mimic is not None:
        notes.append(Note("a coupling is left out: this joint moves freely", (joint.name,)))
    frame, parts = links.frames[joint.child], joint.elementary()
    bodies = [joint.parent, *(f"{joint.child}:{name}" for name, _, _ in parts[:-1]), joint.child]
    for (name, kind, axis), connects in zip(parts, pairwise(bodies), strict=True):
        yield Joint(
            name,
            kind,
            connects,
            None if kind in ("prismatic", "fixed") else frame[:3, 3],
            None if axis is None else frame[:3, :3] @ axis,
            actuated=name in links.driven and KINDS[kind].actuatable,
            range=_range(joint, notes) if joint.type in ("REVOLUTE", "PRISMATIC") else None,
        )


def _range(joint: UrdfJoint, notes: list[Note]) -> tuple[float, float] | None:
    """A joint's range; None where it has none, or none that lets it move."""
    if joint.limits is None or joint.limits[0] < joint.limits[1]:
        return joint.limits
    notes.append(Note("a range in which nothing moves is left out, of", (joint.name,)))
    return None


def _roundings(joints: Sequence[UrdfJoint], root: str) -> tuple[dict[str, Rounding], dict[str, Rounding]]:
    """Link, and joint -> how exactly the digits of the file place it [m, rad], from the root outward."""
    lengths, turns, axes = (digits_of(getattr(each, key) for each in joints) for key in ("xyz", "rpy", "axis_text"))
    of_links, of_joints = {root: NOTHING}, {}
    for joint in joints:
        offset, axis = numbers_in(joint.xyz), joint.axis
        length = _norm(lengths.errors(offset))
        angle = _norm(turns.errors(numbers_in(joint.rpy), FEWEST - 1))
        rounding = of_links[joint.child] = of_links[joint.parent].on(offset, length, angle)
        skew = _norm(axes.errors(axis)) / (_norm(axis) or 1.0) if np.count_nonzero(axis) > 1 else 0.0
        of_joints[joint.name] = rounding._replace(angle=rounding.angle + skew)
    return of_links, of_joints


def _norm(vector: Floats) -> float:
    return float(np.linalg.norm(vector))
