"""A robot description (URDF) as a mechanism: a tree of links, and loops that a second file or the caller tells."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from ..arrays import Floats
from ..description.joint_types import KINDS
from ..description.joints import Joint
from ..errors import Fault, InvalidMechanism
from ..rotations import from_rpy, square_to
from .assembling import Imported
from .closing_frames import closing_loops
from .couplings import Coupling
from .digits import FEWEST, NOTHING, Rounding, digits_of, worst
from .driving import Rates
from .loops_file import LoopsFile, read_loops
from .opened import Note, noting
from .robots import Robot, mechanism_of
from .xml_reading import fault, read_xml

UNTOLD = ("link", "joint", "transmission", "material", "gazebo")
TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


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
    """The mechanism in a robot description, with the loops that URDF cannot tell.

    Home is the zero configuration, closed: where the description is open there, passive joints are moved until its
    loops meet, within their ranges. Base coordinates are those of the root link.

    Parameters
    ----------
    source : the path of a URDF file, or its text.
    loops : the path of a YAML file, or what such a file holds: which links meet where, and which joints are driven; in
        the plain form of the documentation, or that of Gepetto's example-parallel-robots (`closed_loop`, `type`,
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
    root = read_xml(source, "robot")
    told: list[Note] = []
    with noting(told):
        closing = read_loops(loops)
        links = _Links(root, closing)
        driven = _with_transmission(root)
        joints = [
            dataclasses.replace(part, actuated=part.name in driven and KINDS[part.type].actuatable)
            for element in links.joints
            for part in links.parts(element, told)
        ]
        unknown = tuple(name for name in (*closing.retyped, *closing.actuated) if name not in links.link_of)
        if unknown:
            told.append(Note("told of in the loops, but no joint of the robot", unknown))
        own = [name for name in closing.actuated if name in links.link_of]
        places = {link: (link, frame[:3, 3]) for link, frame in links.frames.items()}
        frames = {joint: places[link] for joint, link in links.link_of.items()} | places
        told_of = closing.loops(links.frames, links.link_of)
        taken = [*links.link_of, *(loop.name for loop in told_of)]
        named = closing_loops(frames, told_of, taken, told)
        roundings = links.roundings | closing.roundings(links.of_links, links.frames, links.link_of)
        coarsest = worst(roundings.values())
        robot = Robot(
            root.get("name", "mechanism"),
            joints,
            [*told_of, *named],
            links.root,
            places,
            order=driven,
            rates={element.get("name", ""): Rates(_speed(element)) for element in links.joints},
            roundings=roundings | {loop.name: coarsest for loop in named},
            couplings=tuple(_couplings(links.joints)),
            undriven="no transmission, and no motor in a file of loops",
        )
        return mechanism_of(
            robot, told, base, end_effector, own or None if actuated is None else actuated, fixed, length_unit, task
        )


def _couplings(joints: Iterable[ET.Element]) -> Iterator[Coupling]:
    """Joints that mimic others."""
    for joint in joints:
        mimic = joint.find("mimic")
        if mimic is not None:
            factors = (
                float(_numbers(mimic, key, default)[0]) for key, default in (("offset", "0"), ("multiplier", "1"))
            )
            yield Coupling(joint.get("name", ""), mimic.get("joint", ""), tuple(factors))


class _Links:
    """The links of a description, where they are at zero, and the joints in the order of the tree.

    Attributes
    ----------
    frames : link -> where it is at zero, (4, 4) [m], in the frame of the root.
    link_of : joint -> its child, whose frame is the joint's.
    of_links, roundings : link, and joint -> how exactly the digits of the file place it [m, rad].
    """

    def __init__(self, root: ET.Element, closing: LoopsFile) -> None:
        self.closing = closing
        every = {joint.get("name", ""): joint for joint in root.iterfind("joint")}
        faults = list(_faults(root))
        if faults:
            raise InvalidMechanism(faults)
        self.link_of = {name: _link(joint, "child") for name, joint in every.items()}
        names = [link.get("name", "") for link in root.iterfind("link")]
        roots = [name for name in names if name not in self.link_of.values()]
        if len(roots) != 1:
            found = f"{len(roots)} links that are no child" + (f" ({', '.join(roots[:5])})" if roots else "")
            raise fault("robot", found, "one, from which all others hang")
        self.root = roots[0]
        self.frames: dict[str, Floats] = {self.root: np.eye(4)}
        self.joints: list[ET.Element] = []
        ends = [self.root]
        children: dict[str, list[ET.Element]] = {}
        for joint in every.values():
            children.setdefault(_link(joint, "parent"), []).append(joint)
        for link in ends:  # grows while it is looked through
            for joint in children.get(link, []):
                self.joints.append(joint)
                self.frames[_link(joint, "child")] = self.frames[link] @ _origin(joint)
                ends.append(_link(joint, "child"))
        self.of_links: dict[str, Rounding] = {self.root: NOTHING}
        self.roundings = dict(self._rounded())

    def _rounded(self) -> Iterator[tuple[str, Rounding]]:
        """How exactly each joint is placed, from the root outward; links on the way."""
        origins = [origin for joint in self.joints if (origin := joint.find("origin")) is not None]
        places, turns = (digits_of(each.get(key, "") for each in origins) for key in ("xyz", "rpy"))
        along = digits_of(each.get("xyz", "") for joint in self.joints if (each := joint.find("axis")) is not None)
        for joint in self.joints:
            origin, parent, child = joint.find("origin"), _link(joint, "parent"), _link(joint, "child")
            offset, turn, axis = _numbers(origin, "xyz", "0 0 0"), _numbers(origin, "rpy", "0 0 0"), _axis(joint)
            by, angle = np.linalg.norm(places.errors(offset)), np.linalg.norm(turns.errors(turn, FEWEST - 1))
            own = self.of_links[child] = self.of_links[parent].on(offset, float(by), float(angle))
            skew = np.linalg.norm(along.errors(axis)) if np.count_nonzero(axis) > 1 else 0.0
            size = np.linalg.norm(axis) or 1.0
            yield joint.get("name", ""), own._replace(angle=own.angle + float(skew / size))

    def parts(self, element: ET.Element, told: list[Note]) -> Iterator[Joint]:
        """What one joint is: one of ours, or several in a row."""
        name, parent, child = element.get("name", ""), _link(element, "parent"), _link(element, "child")
        frame = self.frames[child]
        if element.find("mimic") is not None:
            told.append(Note("a coupling is left out: this joint moves freely", (name,)))
        made = list(self._made(element, name, frame, told))
        for place, part in enumerate(made):
            outer = parent if place == 0 else f"{child}:{made[place - 1]['name']}"
            inner = child if place == len(made) - 1 else f"{child}:{part['name']}"
            yield Joint(connects=(outer, inner), **part)

    def _made(self, element: ET.Element, name: str, frame: Floats, told: list[Note]) -> Iterator[dict[str, Any]]:
        at, turned = frame[:3, 3], frame[:3, :3]
        kind = self.closing.retyped.get(name, element.get("type", "")).upper()
        if kind == "FIXED":
            yield {"name": name, "type": "fixed"}
        elif kind in ("SPHERICAL", "FLOATING"):
            for letter, axis in zip("xyz", turned.T, strict=True) if kind == "FLOATING" else ():
                yield {"name": f"{name}_{letter}", "type": "prismatic", "axis": axis}
            yield {"name": name, "type": "spherical", "at": at}
        elif kind.startswith("UJOINT_"):
            for letter in kind[-2:]:
                yield {"name": f"{name}_{letter}", "type": "revolute", "at": at, "axis": turned[:, "XYZ".index(letter)]}
        elif kind == "PLANAR":
            normal = turned @ _axis(element)
            for letter, axis in zip("xy", square_to(normal), strict=True):
                yield {"name": f"{name}_{letter}", "type": "prismatic", "axis": axis}
            yield {"name": name, "type": "revolute", "at": at, "axis": normal}
        else:
            slides = kind == "PRISMATIC"
            part = {"name": name, "type": "prismatic" if slides else "revolute", "axis": turned @ _axis(element)}
            limited = None if kind == "CONTINUOUS" else _range(element, name, told)
            yield part | {"at": None if slides else at, "range": limited}


def _faults(root: ET.Element) -> Iterator[Fault]:
    """What keeps the links and joints from being read, each at its joint."""
    links = [link.get("name", "") for link in root.iterfind("link")]
    names = [joint.get("name", "") for joint in root.iterfind("joint")]
    for what, listed in (("link", links), ("joint", names)):
        for name in sorted({name for name in listed if not name or listed.count(name) > 1}):
            yield Fault(f"{what} '{name}'", "a name that is empty, or used twice", "a name of its own")
    children: set[str] = set()
    for joint in root.iterfind("joint"):
        place = f"joint '{joint.get('name', '')}'"
        if joint.get("type") not in TYPES:
            yield Fault(place, f"type '{joint.get('type')}'", f"one of {', '.join(TYPES)}")
        for end in ("parent", "child"):
            if _link(joint, end) not in links:
                yield Fault(f"{place}.{end}", f"'{_link(joint, end)}'", "a link of the robot")
        if _link(joint, "child") in children:
            yield Fault(f"{place}.child", f"'{_link(joint, 'child')}', which hangs on another joint too", "a tree")
        children.add(_link(joint, "child"))
        found = (joint.find("origin"), joint.find("axis"), joint.find("limit"))
        for element in (each for each in found if each is not None):
            for key, text in element.attrib.items():
                count = 3 if key in ("xyz", "rpy") else 1
                if not _is_numbers(text, count):
                    yield Fault(f"{place}.{element.tag}.{key}", f"'{text}'", f"{count} numbers; xacro files want xacro")
        yield from _mimic_faults(place, joint.find("mimic"), names)
        if joint.get("type") not in ("fixed", "floating") and not _axis(joint).any():
            yield Fault(f"{place}.axis", "no direction", "three numbers, not all zero")


def _mimic_faults(place: str, mimic: ET.Element | None, names: Sequence[str]) -> Iterator[Fault]:
    if mimic is None:
        return
    if mimic.get("joint", "") not in names:
        yield Fault(f"{place}.mimic.joint", f"'{mimic.get('joint', '')}'", "a joint of the robot")
    for key in ("multiplier", "offset"):
        if not _is_numbers(mimic.get(key, "0"), 1):
            yield Fault(f"{place}.mimic.{key}", f"'{mimic.get(key)}'", "a number")


def _is_numbers(text: str, count: int) -> bool:
    try:
        values = [float(part) for part in text.split()]
    except ValueError:
        return False
    return len(values) == count and bool(np.isfinite(values).all())


def _numbers(element: ET.Element | None, key: str, default: str) -> Floats:
    text = default if element is None else element.get(key, default)
    return np.array([float(part) for part in text.split()]) if _is_numbers(text, len(default.split())) else np.zeros(3)


def _link(joint: ET.Element, end: str) -> str:
    """Name of a joint's parent or child."""
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _origin(joint: ET.Element) -> Floats:
    """Where a joint is in the frame of its parent, (4, 4) [m]."""
    origin, frame = joint.find("origin"), np.eye(4)
    frame[:3, :3] = from_rpy(_numbers(origin, "rpy", "0 0 0"))
    frame[:3, 3] = _numbers(origin, "xyz", "0 0 0")
    return frame


def _axis(joint: ET.Element) -> Floats:
    return _numbers(joint.find("axis"), "xyz", "1 0 0")


def _range(joint: ET.Element, name: str, told: list[Note]) -> tuple[float, float] | None:
    """A joint's range; None where it has none, or none that lets it move."""
    limit = joint.find("limit")
    if limit is None or not ("lower" in limit.attrib or "upper" in limit.attrib):
        return None
    low, high = float(_numbers(limit, "lower", "0")[0]), float(_numbers(limit, "upper", "0")[0])
    if low < high:
        return low, high
    told.append(Note("a range in which nothing moves is left out, of", (name,)))
    return None


def _speed(joint: ET.Element) -> float | None:
    """A joint's highest speed [rad/s or m/s]; None where the file says none, or 0, which stands for none."""
    speed = float(_numbers(joint.find("limit"), "velocity", "0")[0])
    return speed if speed > 0.0 else None


def _with_transmission(root: ET.Element) -> list[str]:
    """Names of the joints that a transmission drives."""
    driven = (joint.get("name", "") for joint in root.iterfind("transmission/joint"))
    known = {joint.get("name", "") for joint in root.iterfind("joint")}
    return [name for name in dict.fromkeys(driven) if name in known]
