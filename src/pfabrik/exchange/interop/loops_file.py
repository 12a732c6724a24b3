"""The loops of a robot description, and its motors, in YAML: in our plain form, or in that of Gepetto's examples.

loops:                                  closed_loop: [[frame_a, frame_b], ...]
  - name: left                          type: [3d, ...]
    type: ball                          name_mot: [motor_1, ...]
    links: [rod, platform]              joint_name: [ankle, ...]
    at: [[0, 0, 0.2], [0.1, 0, 0]]      joint_type: [SPHERICAL, ...]
actuated: [motor_1, motor_2]
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...common.extras import require
from ...errors import Fault, InvalidArgument, InvalidMechanism, counted, near_miss
from ...machine.description.coercion import numbers
from ...machine.description.form_faults import is_numbers, key_faults, shown
from .digits import Rounding, digits_of, worst
from .opened import Loop, LoopType, frame_along
from .xml_reading import fault, require_file

LARGEST = 1_000_000
"""Largest file read [bytes]."""

DEEPEST = 20
"""Deepest nesting of values."""

KINDS: dict[str, LoopType] = {
    "ball": "spherical",
    "spherical": "spherical",
    "3d": "spherical",
    "hinge": "revolute",
    "revolute": "revolute",
    "pin": "revolute",
    "weld": "fixed",
    "fixed": "fixed",
    "6d": "fixed",
}
"""Names of loop types in a file -> the type."""

PLAIN = ("loops", "actuated")
GEPETTO = ("closed_loop", "type", "name_mot", "joint_name", "joint_type")
LOOP = ("name", "type", "links", "at", "axis", "frames")
RETYPED = r"SPHERICAL|FIXED|UJOINT_(XY|XZ|YX|YZ|ZX|ZY)"


@dataclass(frozen=True)
class LinkLoop:
    """Two links that are to meet, described in the frame of each.

    Attributes
    ----------
    links : the two.
    sides : the frame on each, (2, 4, 4) [m]; a hinge's axis is its third column.
    is_pin : the two may be apart along the axis, as far as they are at home.
    """

    name: str
    type: LoopType
    links: tuple[str, str]
    sides: Floats
    is_pin: bool = False


@dataclass(frozen=True)
class LoopsFile:
    """The content of such a file.

    Attributes
    ----------
    entries : the loops, each as a table of our plain form, not checked yet.
    actuated : names of joints.
    retyped : joint -> its type, in place of that of the description.
    """

    entries: Sequence[Mapping[str, Any]] = ()
    actuated: Sequence[str] = ()
    retyped: Mapping[str, str] = field(default_factory=dict)

    def loops(self, links: Iterable[str], link_of: Mapping[str, str]) -> list[LinkLoop]:
        """The loops of a robot; InvalidMechanism with every fault of the entries.

        Parameters
        ----------
        links : names of all links.
        link_of : joint -> the link whose frame it is.
        """
        places = {link: link for link in links}
        faults = [each for number, entry in enumerate(self.entries) for each in _faults(number, entry, places, link_of)]
        if faults:
            raise InvalidMechanism(faults)
        return [_loop(number, entry, {**link_of, **places}) for number, entry in enumerate(self.entries)]


def placed_loops(loops: Iterable[LinkLoop], frames: Mapping[str, Floats]) -> list[Loop]:
    """Loops where their sides are.

    Parameters
    ----------
    frames : link -> where it is, (4, 4) [m].
    """
    placed = []
    for loop in loops:
        sides = np.array([frames[link] for link in loop.links]) @ loop.sides
        points, turned = sides[:, :3, 3], sides[:, :3, :3]
        if loop.is_pin:
            points[1] -= (points[1] - points[0]) @ turned[0, :, 2] * turned[0, :, 2]
        placed.append(Loop(loop.name, loop.type, loop.links, points, None if loop.type == "spherical" else turned))
    return placed


def roundings_of_loops(loops: Sequence[LinkLoop], of_links: Mapping[str, Rounding]) -> dict[str, Rounding]:
    """Loop -> how exactly the worse of its sides is placed [m, rad], on links that are placed so exactly."""
    digits = digits_of(repr(float(value)) for loop in loops for value in loop.sides[:, :3, 3].ravel())
    return {
        loop.name: worst(
            of_links[link].on(point, digits.error(point), 0.0)
            for link, point in zip(loop.links, loop.sides[:, :3, 3], strict=True)
        )
        for loop in loops
    }


def read_loops(source: str | os.PathLike[str] | Mapping[str, Any] | None) -> LoopsFile:
    """The content of a file or table of loops; InvalidMechanism with every fault of its form."""
    if source is None:
        return LoopsFile()
    table = source if isinstance(source, Mapping) else _parsed(source)
    if not isinstance(table, Mapping):
        raise fault("loops", shown(table), f"a table of {', '.join(PLAIN)}, or of {', '.join(GEPETTO)}")
    gepetto = any(key in table for key in GEPETTO)
    faults = [*key_faults("loops", table, GEPETTO if gepetto else PLAIN)]
    for key, value in table.items():
        if not isinstance(value, Sequence) or isinstance(value, str):
            faults.append(Fault(f"loops.{key}", shown(value), "a list"))
    if faults:
        raise InvalidMechanism(faults)
    return _gepetto(table) if gepetto else _plain(table)


def _parsed(path: str | os.PathLike[str]) -> Any:
    """The content of a YAML file, of plain values: no tags, no aliases, of which a few lines can make gigabytes."""
    if not isinstance(path, str | os.PathLike):
        raise InvalidArgument("loops", shown(path), "a path, or a table")
    require("loops in YAML", "yaml", "urdf")
    import yaml

    place = os.fspath(path)
    require_file(Path(path), "a YAML file")
    with Path(path).open("rb") as file:
        content = file.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise fault(place, f"more than {LARGEST} bytes", f"at most {LARGEST}")
    try:
        depth = 0
        for event in yaml.parse(content, Loader=yaml.SafeLoader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if isinstance(event, yaml.AliasEvent) or depth > DEEPEST:
                raise fault(place, "an alias, or values nested too deeply", "every value written out")
        return yaml.safe_load(content)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        if isinstance(error, InvalidMechanism):
            raise
        reason = " ".join(str(error).split()) or "nested too deeply"
        raise fault(place, f"no YAML: {reason}", "YAML") from None


def _plain(table: Mapping[str, Any]) -> LoopsFile:
    faults: list[Fault] = []
    for place, entry in enumerate(table.get("loops", [])):
        if isinstance(entry, Mapping):
            faults += key_faults(f"loops[{place}]", entry, LOOP)
        else:
            faults.append(Fault(f"loops[{place}]", shown(entry), f"a table of {', '.join(LOOP)}"))
    names = table.get("actuated", [])
    faults += [Fault("actuated", shown(name), "names of joints") for name in names if not isinstance(name, str)]
    if faults:
        raise InvalidMechanism(faults)
    return LoopsFile(table.get("loops", []), names)


def _gepetto(table: Mapping[str, Any]) -> LoopsFile:
    pairs, kinds = table.get("closed_loop", []), table.get("type", [])
    names, types = table.get("joint_name", []), table.get("joint_type", [])
    faults = []
    if kinds and len(kinds) != len(pairs):
        faults.append(
            Fault("loops.type", counted(len(kinds), "type"), f"one for each of {counted(len(pairs), 'loop')}")
        )
    if len(names) != len(types):
        faults.append(
            Fault("loops.joint_type", counted(len(types), "type"), f"one for each of {counted(len(names), 'joint')}")
        )
    for kind in types:
        if not (isinstance(kind, str) and re.fullmatch(RETYPED, kind.upper())):
            faults.append(Fault("loops.joint_type", shown(kind), "SPHERICAL, FIXED, or UJOINT_XY and the like"))
    if faults:
        raise InvalidMechanism(faults)
    every = zip(pairs, kinds or ["6d"] * len(pairs), strict=True)
    entries = [{"frames": pair, "type": str(kind).lower()} for pair, kind in every]
    retyped = {str(name): str(kind).upper() for name, kind in zip(names, types, strict=True)}
    return LoopsFile(entries, [str(name) for name in table.get("name_mot", [])], retyped)


def _loop(number: int, entry: Mapping[str, Any], link_at: Mapping[str, str]) -> LinkLoop:
    """One entry without faults; `link_at` has the link of every name that an end may have."""
    one, other = (link_at[end] for end in entry.get("links") or entry["frames"])
    sides, kind = np.array([np.eye(4)] * 2), entry.get("type", "ball")
    sides[:, :3, 3] = entry.get("at", 0.0)
    if KINDS[kind] == "revolute":
        sides[:, :3, :3] = [frame_along(np.array(axis, float)) for axis in entry.get("axis", [[0, 0, 1]] * 2)]
    name = str(entry.get("name", f"closure_{number + 1}"))
    return LinkLoop(name, KINDS[kind], (one, other), sides, is_pin=kind == "pin")


def _faults(number: int, entry: Mapping[str, Any], links: Iterable[str], link_of: Mapping[str, str]) -> Iterator[Fault]:
    place, kind = f"loops[{number}]", entry.get("type", "ball")
    if not isinstance(kind, str) or kind not in KINDS:
        yield Fault(f"{place}.type", shown(kind), f"one of {', '.join(KINDS)}")
    key, known = ("links", [*links]) if "links" in entry else ("frames", [*links, *link_of])
    ends = entry.get(key)
    if not (isinstance(ends, Sequence) and len(ends) == 2 and all(isinstance(end, str) for end in ends)):
        yield Fault(f"{place}.{key}", shown(ends), "two names")
    else:
        for end in ends:
            if end not in known:
                yield Fault(f"{place}.{key}", f"'{end}'{near_miss(end, known)}", "a link, or a joint for its frame")
    for name in ("at", "axis"):
        value = numbers(entry.get(name, [[0, 0, 1]] * 2))
        if not (isinstance(value, tuple) and len(value) == 2 and all(is_numbers(part, 3) for part in value)):
            yield Fault(f"{place}.{name}", shown(entry.get(name)), "two lists of three numbers, one for each link")
        elif not np.isfinite(value).all() or (name == "axis" and not np.any(value, axis=1).all()):
            yield Fault(f"{place}.{name}", shown(entry.get(name)), "finite numbers, of an axis not all zero")
