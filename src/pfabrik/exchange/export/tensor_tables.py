"""A machine as its file of tensors knows it: coordinates, groups of legs that are alike, dimensions by name, limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...errors import UnsupportedMechanism, counted
from ...kernels.legs import records as K
from ...kinematics import JointPath
from ...machine.description.mechanism import Mechanism
from .machine_data import Coordinate, ExportedLeg, Machine, fitting_path
from .source import targets_around_home


class TensorMachine:
    """A machine whose legs the routines of tensors know, and the coordinates that its file takes.

    Attributes
    ----------
    path : the named joints; None where poses of the platform are the coordinates.
    """

    def __init__(self, mechanism: Mechanism, joints: Sequence[str] | None) -> None:
        self.mechanism, self.machine = mechanism, Machine(mechanism)
        self.path = None if joints is None else fitting_path(mechanism, joints)
        if reason := self._refused():
            raise UnsupportedMechanism(mechanism.name, [reason], "exported")

    def _refused(self) -> str:
        machine = self.machine
        if arms := arms_of(machine):
            return f"legs on joints {', '.join(arms)}, which poses do not set in one step"
        if self.path is None and machine.uncontrolled:
            return f"its actuators leave the end effector {counted(machine.uncontrolled, 'freedom')}"
        if self.path is None and machine.rotations == 1:
            return "its task sets a yaw alone: name joints in series instead"
        return ""

    @cached_property
    def groups(self) -> list[LegGroup]:
        """The legs by their kind."""
        return groups_of(self.machine)

    @cached_property
    def driven(self) -> list[Place]:
        """Where the routines find the actuators."""
        return [place_of(driven, self.machine, self.groups) for driven in self.machine.driven]

    @cached_property
    def proximal(self) -> list[tuple[str, int, float]]:
        """All proximal joints: group, leg, and the unit of their coordinate [L or rad]."""
        size = self.mechanism.characteristic_length
        return [
            (group.name, leg, size if group.kind["proximal"] == "carriage" else 1.0)
            for group in self.groups
            if group.kind["proximal"]
            for leg in range(group.kind["n"])
        ]

    @cached_property
    def open(self) -> list[tuple[str, int, float]]:
        """Proximal joints without a motor: forward kinematics solve for them too."""
        driven = {place[:2] for place in self.driven if place[2] == "proximal"}
        return [each for each in self.proximal if each[:2] not in driven]

    @property
    def completes(self) -> bool:
        """True if the task leaves some of a pose open."""
        return self.path is None and self.machine.unset > 0

    @property
    def is_point(self) -> bool:
        return self.mechanism.end_effector_is_joint

    def samples(self, n: int) -> Floats:
        """Coordinates of joints (n, k) all over their ranges, around home where they have none; or poses (n, 4, 4)."""
        random = np.random.default_rng(0)
        if self.path is None:
            return targets_around_home(self.mechanism, n, random)
        reach = np.array(
            [0.5 if c.kind == "angle" else 0.3 * self.mechanism.characteristic_length for c in self.path.coordinates]
        )
        low = np.where(np.isfinite(self.path.low), self.path.low, self.path.home - reach)
        high = np.where(np.isfinite(self.path.high), self.path.high, self.path.home + reach)
        return np.asarray(random.uniform(low, high, (n, len(reach))))


ENDS = {K.WELD: "weld", K.HINGE: "hinge", K.CROSS: "cross", K.TRIPLE: "triple", K.BALL: "ball"}
HINGES = {"weld": 0, "hinge": 1, "cross": 2, "triple": 3, "ball": 0}
"""The number of hinges of an ending whose axes count."""

PROXIMAL = {K.CRANK: "crank", K.CARRIAGE: "carriage"}

FAR = 1e30
"""The bound of a coordinate without one [L or rad]: finite, so that no derivative of what is beyond is NaN."""

Rows = tuple[Any, ...] | float
"""Numbers, nested in tuples."""

Place = tuple[str, int, str, int]
"""A coordinate: its group, its leg there, what it is of that leg, and which of these."""


class LegGroup(NamedTuple):
    """Legs that are alike.

    Attributes
    ----------
    name : what its dimensions are named by.
    kind : what the routines know of it.
    legs : places of its legs in the machine.
    """

    name: str
    kind: dict[str, Any]
    legs: list[int]


def groups_of(machine: Machine) -> list[LegGroup]:
    """The legs of a machine by their kind, a rod on the proximal joint of another after that one."""
    alike: dict[tuple[Any, ...], list[int]] = {}
    for place, leg in enumerate(machine.legs):
        alike.setdefault(_likeness(leg), []).append(place)
    order = sorted(alike.values(), key=lambda legs: machine.legs[legs[0]].main != legs[0])
    groups: list[LegGroup] = []
    for legs in order:
        name = _name(machine.legs[legs[0]])
        n_so_named = sum(group.name.rstrip("0123456789_") == name for group in groups)
        name = f"{name}_{n_so_named + 1}" if n_so_named else name
        groups.append(LegGroup(name, {}, legs))
    by_leg = {leg: (group.name, place) for group in groups for place, leg in enumerate(group.legs)}
    for group in groups:
        group.kind.update(_kind(machine, group, by_leg))
    return groups


def _likeness(leg: ExportedLeg) -> tuple[Any, ...]:
    names = ("kind", "frame", "proximal", "base_end", "platform_end", "slides", "twists", "n_rows", "upright")
    return tuple(int(leg.record[name]) for name in names)


def _name(leg: ExportedLeg) -> str:
    record = leg.record
    if leg.is_pivot:
        return "pivots"
    if record["proximal"] == K.SHARED:
        return "shared"
    if record["proximal"] in PROXIMAL:
        return f"{PROXIMAL[int(record['proximal'])]}s"
    return "struts" if record["slides"] else "rods"


def _kind(machine: Machine, group: LegGroup, by_leg: dict[int, tuple[str, int]]) -> dict[str, Any]:
    legs = [machine.legs[place] for place in group.legs]
    record = legs[0].record
    is_pivot = legs[0].is_pivot
    kind: dict[str, Any] = {
        "kind": "pivot" if is_pivot else "rod",
        "n": len(legs),
        "is_back": bool(record["reversed"]),
        "base_end": ENDS[int(record["base_end"])],
        "slides": int(record["slides"]),
        "proximal": PROXIMAL.get(int(record["proximal"])),
        "main": None,
    }
    if kind["proximal"] or kind["base_end"] == "triple":
        kind["side"] = tuple(float(leg.record["side"]) for leg in legs)
    if is_pivot:
        kind["square"] = nested([leg.numbers["square"] for leg in legs])
        kind["pairs"] = _pairs(legs, kind["base_end"])
        return kind
    kind |= {"platform_end": ENDS[int(record["platform_end"])], "twists": bool(record["twists"])}
    if record["proximal"] == K.SHARED:
        mains = [by_leg[leg.main] for leg in legs]
        kind["main"] = (mains[0][0], tuple(place for _, place in mains))
    for end in ("base", "platform"):
        if kind[f"{end}_end"] == "cross":
            kind[f"{end}_side"] = tuple(float(leg.record[f"{end}_end_side"]) for leg in legs)
    return kind


def _pairs(legs: list[ExportedLeg], ending: str) -> tuple[Any, ...]:
    """Pairs of directions that keep their angle: numbers of hinges, or vectors of every leg."""
    if ending == "cross":
        return ((0, 1),)
    n = int(legs[0].record["n_rows"] + legs[0].record["slides"]) - 3
    kept, moved = (np.array([leg.record[name] for leg in legs]) for name in ("kept", "moved"))
    if ending == "hinge":
        return tuple((nested(kept[:, place]), 0) for place in range(n))
    return tuple((nested(kept[:, place]), nested(moved[:, place])) for place in range(n))


def dimensions_of(machine: Machine, groups: list[LegGroup], path: JointPath | None) -> dict[str, Rows]:
    """The machine's dimensions by name, at home, in base coordinates."""
    table: dict[str, Rows] = {"reference_point": nested(machine.mechanism.reference_point)}
    for group in groups:
        for name, rows in _dimensions(machine, group):
            table[f"{group.name}.{name}"] = rows
    table["actuators.home"] = nested([driven.home for driven in machine.driven])
    if path is not None:
        table["joints.axis"] = nested([motion.axis for motion in path.motions])
        table["joints.point"] = nested([motion.point for motion in path.motions])
        table["joints.home"] = nested(path.home)
    return table


def _dimensions(machine: Machine, group: LegGroup) -> Iterator[tuple[str, Rows]]:
    legs, kind = [machine.legs[place] for place in group.legs], group.kind
    at_platform = np.zeros(3) if kind["is_back"] else np.asarray(machine.mechanism.reference_point)

    def numbers(name: str) -> np.ndarray[Any, Any]:
        return np.array([leg.numbers[name] for leg in legs])

    if legs[0].is_pivot:
        yield "centre", nested(numbers("base_end"))
        if hinges := HINGES[kind["base_end"]]:
            yield "axes", nested(numbers("base_end_axes")[:, :hinges])
        yield "rows", nested(numbers("rows"))
        return
    yield "base_end", nested(numbers("base_end"))
    yield "platform_end", nested(numbers("platform_end") + at_platform)
    yield "length", nested(numbers("length"))
    if kind["proximal"]:
        yield "axis", nested(numbers("axis"))
    if kind["proximal"] == "crank":
        yield "centre", nested(numbers("centre"))
    for end in ("base", "platform"):
        if kind[f"{end}_end"] in ("hinge", "cross"):
            yield f"{end}_axes", nested(numbers(f"{end}_end_axes")[:, : HINGES[kind[f"{end}_end"]]])


def nested(values: Any) -> Rows:
    """Numbers of an array in nested tuples, without negative zeros."""
    array = np.asarray(values, dtype=float) + 0.0
    return tuple(nested(each) for each in array) if array.ndim else float(array)


def place_of(coordinate: Coordinate, machine: Machine, groups: list[LegGroup]) -> Place:
    """Where the routines find a coordinate."""
    name, leg = next((g.name, g.legs.index(coordinate.leg)) for g in groups if coordinate.leg in g.legs)
    if coordinate.place == K.Q_PROXIMAL:
        return name, leg, "proximal", 0
    if coordinate.place == K.SLIDE:
        return name, leg, "slide", 0
    if coordinate.place >= K.PLATFORM_END:
        what = "pivot slide" if machine.legs[coordinate.leg].is_pivot else "platform"
        return name, leg, what, coordinate.place - K.PLATFORM_END
    return name, leg, "base", coordinate.place - K.BASE_END


def counting_of(coordinate: Coordinate) -> tuple[bool, float, float]:
    """True if a coordinate is counted into its range by whole turns, and that range, from home."""
    low, high = np.clip([coordinate.lo, coordinate.hi], -FAR, FAR).tolist()
    return coordinate.turns, low, high


def cones_of(machine: Machine, groups: list[LegGroup]) -> Iterator[tuple[Any, ...]]:
    """Of every cone: the group, the leg there, the end, the axis and the half angle."""
    for cone in machine.cones:
        group = next(group for group in groups if int(cone["leg"]) in group.legs)
        end = "platform" if cone["place"] == K.PLATFORM_LINE else "base"
        yield group.name, group.legs.index(int(cone["leg"])), end, nested(cone["axis"]), float(cone["half_angle"])


def arms_of(machine: Machine) -> list[str]:
    """Names of the joints that legs are on, whose coordinates poses do not set in one step."""
    return list(dict.fromkeys(leg.joints[0] for leg in machine.legs if leg.record["makes"] > 0))
