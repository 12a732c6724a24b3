"""A robot description (URDF) as a mechanism: a tree of links, and loops that a second file or the caller describes."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_mapping, require_names
from ...errors import Fault, InvalidMechanism
from ...machine.description.contact import ContactLike
from ...machine.description.joints import KINDS, Joint
from .assembling import Imported
from .driving import Rates
from .known_elements import SDF, URDF, note_ranges, require_known
from .loops_file import LinkLoop, LoopsFile, placed_loops, read_loops, roundings_of_loops
from .notes import Note, note_names, noting
from .opened import loops_by_name
from .robot_tree import Robot
from .robots import ImportOptions, mechanism_of
from .sdf_links import Poses, closing, only_model, read_sdf, sdf_joint
from .standing import posed
from .told_loops import DIALECTS, SPRING, attached_by, links_named, told_joint, unread_loops
from .urdf_collision import read_collision, read_masses
from .urdf_links import MOST_FAULTS, UrdfJoint, UrdfLinks, read_links
from .xml_reading import fault, read_xml

FAR = 50.0
"""Distance of a link from the root [m] at which an import asks for the unit: a robot in millimetres has hundreds."""


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
    within: float | None = None,
    leave_out: Iterable[str] = (),
    configuration: Mapping[str, float] | None = None,
    feet: Mapping[str, ContactLike] | Sequence[str] | None = None,
) -> Imported:
    """The mechanism in a robot description, with the loops that URDF cannot express.

    Home is the zero configuration, or that asked for, closed: where the description is open there, passive joints are
    moved until its loops meet, within their ranges. Base coordinates are those of the root link. Boxes, spheres,
    cylinders and capsules of `collision` become shapes; links that overlap at home may touch (`ignore`).

    Parameters
    ----------
    source : str or PathLike
        The path of a URDF file, or its text.
    loops : str or PathLike or mapping, optional
        The path of a YAML file, or the content of such a file: which links meet where, and which joints are driven; in
        the plain form of the documentation, or that of Gepetto's example-parallel-robots (`closed_loop`, `type`,
        `name_mot`). Frames that are called `closing_<name>_1` and `closing_<name>_2` meet in balls, or in hinges where
        there are frames of the same names with `_z` behind them, unless this file says how they meet.
    base : str, optional
        The link that rests. Default: the root.
    end_effector : str, optional
        A link, or a joint or loop (whose centre is moved).
    actuated : iterable of str, optional
        Names of the joints that are driven, in the order of the actuators; a `velocity` that is not 0 is their highest
        speed. Default: those of `loops`, else those with a transmission.
    fixed : iterable of str, optional
        As in `from_mjcf`.
    length_unit : str, optional
        As in `from_mjcf`.
    task : sequence of str, optional
        As in `from_mjcf`.
    within : float, optional
        As in `from_mjcf`.
    leave_out : iterable of str, optional
        As in `from_mjcf`.
    configuration : mapping of str to float, optional
        Home: joint -> its value [rad, m]; others are at zero.
    feet : mapping of str to str or sequence of str, optional
        As in `from_mjcf`.

    Returns
    -------
    Imported
        The mechanism, how far its loops were open, and notes of all that was left out or changed, by name.

    Raises
    ------
    MissingLibrary
        PyYAML is not installed, and `loops` is a file.
    InvalidMechanism
        No URDF, or one that cannot be closed, with every fault that was found; else as in `from_mjcf`.
    UnknownName or NoEndEffector
        As in `from_mjcf`.
    """
    notes: list[Note] = []
    with noting(notes):
        element = read_xml(source, "urdf", "sdf")
        loops_file = read_loops(loops)
        chosen = None if actuated is None else require_names("actuated", actuated)
        asked = {*(chosen or ()), *require_names("fixed", fixed), *loops_file.actuated}
        links, link_loops = read_description(element, loops_file, asked, notes)
        solids, masses = read_collision(element, links, notes), tuple(read_masses(element, links, notes))
        whole = replace(
            _robot(links, link_loops, loops_file, notes),
            collision=replace(solids, masses=masses),
            order=tuple(dict.fromkeys([*links.driven, *(each.get("name", "") for each in element.iter("joint"))])),
        )
        robot = posed(whole, require_mapping("configuration", configuration, "values by the names of joints"))
        motors = [name for name in loops_file.actuated if any(joint.name == name for joint in links.joints)] or None
        wanted = ImportOptions(motors if chosen is None else chosen, length_unit, task, within, feet)
        return mechanism_of(robot, base, end_effector, wanted, notes, fixed, leave_out)


from_sdf = from_urdf
"""The same function: what a file is follows from its first element."""


def read_description(
    root: ET.Element, loops_file: LoopsFile, asked: Collection[str], notes: list[Note]
) -> tuple[UrdfLinks, list[LinkLoop]]:
    """The links of a description, and all loops: those of a file of loops, then those that the description tells.

    Parameters
    ----------
    asked : names of the joints that a caller drives or holds.
    """
    is_sdf = root.tag == "sdf"
    links = read_sdf(root, asked, notes) if is_sdf else read_links(root, loops_file.retyped, asked)
    written = loops_file.loops(links.frames, links.frame_joints)
    known = {frozenset(loop.links) for loop in written}
    links = links.closed_by(list(_told_joints(root, links, known, notes)), asked)
    told = [loop for loop in links.loops if frozenset(loop.links) not in known]
    _require_known(root, links, notes)
    for kind, plural in (("spherical", "balls"), ("revolute", "hinges"), ("fixed", "welds")):
        of_kind = (loop.name for loop in told if loop.type == kind)
        note_names(notes, f"loops that the description tells, as {plural}", of_kind)
    counts = Counter([*(joint.name for joint in links.joints), *(loop.name for loop in (*written, *told))])
    for name in (name for name, count in counts.items() if count > 1):
        raise fault(f"loop '{name}'", "a name that a joint or another loop has too", "a name of its own")
    farthest = max(float(np.linalg.norm(frame[:3, 3])) for frame in links.frames.values())
    if farthest > FAR:
        meant = 'if millimetres were meant, write length = "mm" in `units` of the mechanism file'
        notes.append(Note(f"links are up to {farthest:.4g} m away, as a description has metres; {meant}"))
    return links, [*written, *told]


def _require_known(root: ET.Element, links: UrdfLinks, notes: list[Note]) -> None:
    """Refuse what is not known in a description; notes name what is left out."""
    parts = {*links.frames, *(joint.name for joint in links.joints)}
    if root.tag == "sdf":
        for world in root.iterfind("world"):
            require_known(world, SDF, "world", notes, parts)
        require_known(only_model(root, []), SDF, "model", notes, parts)
    else:
        require_known(root, URDF, "robot", notes, parts)
        for joint in root.iterfind("gazebo/joint"):
            require_known(joint, SDF, "joint", notes)
    note_ranges(root, notes)


def _told_joints(
    root: ET.Element, links: UrdfLinks, known: Collection[frozenset[str]], notes: list[Note]
) -> Iterator[tuple[UrdfJoint, Floats]]:
    """Yield the joints that elements beside links and joints tell; a fault for each that binds two links otherwise."""
    remedy = "the loop in a file of loops (--loops), or a description without this element"
    springs: list[str] = []
    twice = [loop.name for loop in links.loops if frozenset(loop.links) in known]
    faults: list[Fault] = []
    tops = [each for model in ([root] if root.tag == "robot" else root.iter("model")) for each in model]
    parts = [part for each in tops for part in (each if each.tag in ("link", "joint", "gazebo") else [each])]
    count = 0
    child = {joint.name: joint.child for joint in links.joints}
    coupled = {frozenset(child.get(name, name) for name in joint.mimic.names) for joint in links.joints if joint.mimic}
    for part in parts:
        part = attached_by(part) if part.tag == "plugin" else part
        names = links_named(part, links.frames)
        is_read = part.tag == "frame" or (part.tag == "coupling" and frozenset(names) in coupled)
        if is_read or set(names) == {links.root}:
            continue
        if frozenset(names) in known:
            twice += [part.get("name") or part.tag] if part.tag in (*DIALECTS, "joint") else []
            continue
        try:
            if part.tag == SPRING:
                springs.append(part.get("name") or " and ".join(names))
            elif part.tag in DIALECTS and len(part):
                count += 1
                yield told_joint(part, links.frames, count)
            elif part.tag == "joint" and part.find("child") is not None:
                model = ET.Element("model")
                model.append(part)
                yield closing(sdf_joint(part, Poses(model, links.frames)), links.frames)
            else:
                faults += unread_loops(part, links.frames, links.root, known, remedy)
        except InvalidMechanism as error:
            faults += error.faults
    if faults:
        raise InvalidMechanism(faults[:MOST_FAULTS])
    note_names(notes, "springs between links are left out", springs)
    note_names(notes, "loops that the file of loops tells too, which counts", twice)


def _robot(links: UrdfLinks, link_loops: Sequence[LinkLoop], loops_file: LoopsFile, notes: list[Note]) -> Robot:
    """The links as a robot, with its loops."""
    joints = [part for joint in links.joints for part in _parts(joint, links, notes)]
    names = [joint.name for joint in links.joints]
    known = {*names, *(loop.name for loop in links.loops)}
    for where, said in (
        ("told of in the loops", [*loops_file.retyped, *loops_file.actuated]),
        ("what the description drives", links.driven),
    ):
        unknown = tuple(name for name in said if name not in known)
        note_names(notes, f"{where}, but no joint of the robot", unknown)
    loops = placed_loops(link_loops, links.frames)
    places = {link: (link, frame) for link, frame in links.frames.items()}
    frames = {joint: places[link] for joint, link in links.frame_joints.items()} | places
    taken = [*names, *(loop.name for loop in loops)]
    return Robot(
        links.name,
        joints,
        [*loops, *loops_by_name(frames, loops, taken, notes)],
        links.root,
        places,
        rates={
            joint.name: Rates(
                joint.max_speed, joint.max_acceleration, joint.max_torque, *joint.rotor, friction=joint.friction
            )
            for joint in links.joints
        },
        roundings={**links.joint_roundings, **roundings_of_loops(link_loops, links.roundings)},
        couplings=[joint.mimic for joint in links.joints if joint.mimic is not None],
        undriven="no transmission, no controller, and no motor in a file of loops",
    )


def _parts(joint: UrdfJoint, links: UrdfLinks, notes: list[Note]) -> Iterator[Joint]:
    """The joints of a mechanism that one of the description is, in series, where they are at zero."""
    frame, parts = links.frames[joint.child], joint.elementary()
    bodies = [joint.parent, *(f"{joint.child}:{name}" for name, _, _ in parts[:-1]), joint.child]
    for (name, kind, axis), connects in zip(parts, pairwise(bodies), strict=True):
        yield Joint(
            name,
            kind,
            connects,
            None if kind in ("prismatic", "fixed") else frame[:3, :3] @ joint.point + frame[:3, 3],
            None if axis is None else frame[:3, :3] @ axis,
            actuated=name in links.driven and KINDS[kind].actuatable,
            range=_range(joint, notes),
        )


def _range(joint: UrdfJoint, notes: list[Note]) -> tuple[float, float] | None:
    """A joint's range; None where it has none, or none that lets it move."""
    if joint.limits is None or joint.limits[0] < joint.limits[1]:
        return joint.limits
    notes.append(Note("a range in which nothing moves is left out, of", (joint.name,)))
    return None
