"""The joints that legs stand for, and the name that the field has for them."""

from __future__ import annotations

import dataclasses
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ...errors import Fault, counted, near_miss
from .copies import MOST_COPIES, Turn, read_copies, turned
from .form_faults import is_pair_of_names, shown, table_faults
from .joints import DRIVE_FIELDS, Cone, Joint, Vector
from .leg_points import EXPECTED, PLACEHOLDER, Point, axis_pairs, count_legs, directions, leg_points, points_of_legs
from .legs import BODY_KEYS, CONE_KEYS, JOINT_KEYS, Leg, chain_faults, is_listed, neighbours, read_chain
from .rules import faults_by, form, wrong


@dataclass(frozen=True)
class LegJoint:
    """One of the joints that legs stand for.

    Attributes
    ----------
    leg : the number of its leg, from 1.
    turn : what its leg is turned by, as a copy.
    place, places : where the description says things of the joint, and of single fields of it.
    """

    joint: Joint
    leg: int
    turn: Turn
    place: str
    places: Mapping[str, str]


class LegMaker:
    """Makes the joints of one description of legs, and notes its faults."""

    def __init__(self, leg: Leg, place: str, ends: tuple[str, str], faults: list[Fault]) -> None:
        self.leg, self.place, self.ends, self.faults = leg, place, ends, faults
        self.steps = read_chain(leg.chain)
        self.slides = [step.letter for step in self.steps if not step.centred]
        self.ranges = ", ".join(f"{letter}.range" for letter in self.slides)
        self.said = self._said()
        faults += faults_by(OF_LEGS, place, leg, self)
        self.points = leg_points(leg, self.steps, place, faults)
        self.legs = len(self.points[0]) if self.points else 1
        for letters, values in self.said.items():
            if values.get("centre") is not None and len(letters) == 2:
                points_of_legs(f"{place}.{letters}.centre", values["centre"], self.legs, faults)
        copies = None if leg.copies is None else read_copies(f"{place}.copies", leg.copies, faults)
        self.turns, self.about = copies or (1, PLACEHOLDER)
        self.count = self.legs * self.turns if self.steps else 0
        self.centres = dict(zip((step.letter for step in self.steps if step.centred), self.points, strict=True))

    def joints(self, number: int) -> Iterator[LegJoint]:
        """The joints of all legs, of which the first has this number."""
        patterns = [self._pattern(index) for index in range(len(self.steps))]
        values = [self._values(index) for index in range(len(self.steps))]
        for step in range(self.turns):
            turn = Turn(self.about, step, self.turns)
            for leg in range(self.legs):
                for index, pattern in enumerate(patterns):
                    placed = self._numbered(pattern[leg], index, number)
                    own, places = values[index][step * self.legs + leg]
                    joint = dataclasses.replace(turned(placed.joint, turn), **own)
                    yield dataclasses.replace(placed, joint=joint, turn=turn, places={**placed.places, **places})
                number += 1

    def _values(self, index: int) -> list[tuple[dict[str, Any], dict[str, str]]]:
        """Home and range of a joint in every leg, copies included, and where they are said."""
        step, place = self.steps[index], f"{self.place}.{self.steps[index].letter}"
        said = self.said.get(step.letter, {})
        given = {"home": (said.get("home", 0.0), f"{place}.home"), "range": (said.get("range"), f"{place}.range")}
        if said.get("range") is None and self.slides == [step.letter]:
            given["range"] = self.leg.stroke, f"{self.place}.stroke"
        found: list[tuple[dict[str, Any], dict[str, str]]] = [({}, {}) for _ in range(self.count)]
        for field, (value, where) in given.items():
            is_list = is_listed(field, step.type, value)
            if is_list and len(value) not in (self.legs, self.count):
                legs = f"one for each leg: {self.count}"
                self.faults.append(Fault(where, counted(len(value), "value"), f"one, or {legs}"))
                value, is_list = value[0], False
            for leg, (fields, places) in enumerate(found):
                fields[field] = value[leg % len(value)] if is_list else value
                places[field] = f"{where}[{leg % len(value)}]" if is_list else where
        return found

    def _said(self) -> dict[str, Mapping[str, Any]]:
        """What is said of single joints and bodies, by letters, as far as it makes sense."""
        letters = [step.letter for step in self.steps]
        bodies = [first + second for first, second in pairwise(letters)]
        said: dict[str, Mapping[str, Any]] = {}
        by_letter: Any = self.leg.by_letter
        if not isinstance(by_letter, Mapping):
            self.faults.append(Fault(self.place, shown(by_letter), "what is said of joints, by their letters"))
            return said
        for letter, values in by_letter.items():
            where = f"{self.place}.{letter}"
            is_body = isinstance(letter, str) and len(letter) == 2
            known, what = (bodies, "body") if is_body else (letters, "joint")
            if self.steps and letter not in known:
                of_chain = f"{'between ' if is_body else ''}the joints of '{self.leg.chain}'"
                expected = f"one of {', '.join(known)}, {of_chain}" if known else f"none: it has none {of_chain}"
                self.faults.append(Fault(where, f"a {what} that the chain does not have", expected))
                continue
            self.faults += table_faults(where, values, BODY_KEYS if is_body else JOINT_KEYS)
            if isinstance(values, Mapping):
                said[letter] = values
        self.faults += [*self._star_faults(said), *self._link_faults(said)]
        return said

    def _link_faults(self, said: Mapping[str, Mapping[str, Any]]) -> Iterator[Fault]:
        """What only a link between two joints with a centre can have."""
        for letters, values in said.items():
            for key in ("thickness", "density"):
                if len(letters) == 2 and values.get(key) is not None and len(neighbours(self.steps, letters)) < 2:
                    expected = f"nothing: '{letters}' is not between two joints with a centre; it has `mass`, `centre`"
                    yield Fault(f"{self.place}.{letters}.{key}", shown(values[key]), expected)

    def _star_faults(self, said: Mapping[str, Mapping[str, Any]]) -> Iterator[Fault]:
        """What is said of actuators against the stars of the chain."""
        for step in self.steps:
            actuated = said.get(step.letter, {}).get("actuated")
            where = f"{self.place}.{step.letter}.actuated"
            if actuated is not None and not step.actuated:
                yield Fault(where, shown(actuated), f"nothing: '{self.leg.chain}' has no `*` behind the joint")
            elif actuated in (False, (False, False)):
                yield Fault(where, shown(actuated), f"what is driven: '{self.leg.chain}' has a `*` behind the joint")

    def _pattern(self, index: int) -> list[LegJoint]:
        """The joint at one place in the chain, once for each leg, with names that have no number yet."""
        step = self.steps[index]
        said = self.said.get(step.letter, {})
        bodies = self._bodies(index)
        places = dict.fromkeys(("type", "actuated", "connects"), f"{self.place}.chain")
        places["name"] = f"{self.place}.name"
        if said.get("actuated") is not None:
            places["actuated"] = f"{self.place}.{step.letter}.actuated"
        fields: list[dict[str, Any]] = [{each: said.get(each) for each in DRIVE_FIELDS} for _ in range(self.legs)]
        self._give_axes(index, said, fields, places)
        cones = self._cones(index, said.get("cone"), bodies)
        made = []
        for leg in range(self.legs):
            at = self.centres[step.letter][leg] if step.centred else Point(None, self.place)
            joint = Joint(
                step.letter,
                step.type,
                bodies,
                at=at.at or (PLACEHOLDER if step.centred else None),
                actuated=said.get("actuated", step.actuated) if step.actuated else False,
                cone=cones[leg],
                **fields[leg],
            )
            end = self._next_place(index, leg)
            places_of = places | {"at": at.place, "along": end}
            made.append(LegJoint(joint, leg, Turn(), f"{self.place}.{step.letter}", places_of))
        return made

    def _next_place(self, index: int, leg: int) -> str:
        """Where the point of the next joint is said."""
        after = self.steps[index + 1 : index + 2]
        return self.centres[after[0].letter][leg].place if after and after[0].centred else f"{self.place}.chain"

    def _bodies(self, index: int) -> tuple[str, str]:
        """The two bodies of a joint: those between joints A and B are called AB."""
        letters = [step.letter for step in self.steps]
        inner = [a + b for a, b in pairwise(letters)]
        bodies = [self.ends[0], *inner, self.ends[1]]
        return bodies[index], bodies[index + 1]

    def _is_strut(self, index: int) -> bool:
        """True if the joint is a prismatic one that runs along the line of its neighbours."""
        own_axis = self.said.get(self.steps[index].letter, {}).get("axis")
        around = self.steps[index - 1 : index] + self.steps[index + 1 : index + 2]
        return not self.steps[index].centred and own_axis is None and [each.centred for each in around] == [True, True]

    def takes_axis(self, index: int) -> bool:
        """True if the leg's own `axis` holds for the joint."""
        step = self.steps[index]
        one = step.type in ("revolute", "prismatic", "cylindrical")
        return one and not self._is_strut(index) and self.said.get(step.letter, {}).get("axis") is None

    def _give_axes(
        self, index: int, said: Mapping[str, Any], fields: list[dict[str, Any]], places: dict[str, str]
    ) -> None:
        step = self.steps[index]
        if said.get("axes") is not None:
            pairs = axis_pairs(f"{self.place}.{step.letter}.axes", said["axes"], self._near(index), self.faults)
            for leg, pair in enumerate(pairs):
                fields[leg]["axes"] = pair
        if self._is_strut(index):
            for each in fields:
                each["along"] = (self.steps[index - 1].letter, self.steps[index + 1].letter)
            return
        axis, place = said.get("axis"), f"{self.place}.{step.letter}.axis"
        if self.takes_axis(index):
            if self.leg.axis is None:
                self.faults.append(Fault(place, f"nothing, for a {step.type} joint", EXPECTED))
                axis = PLACEHOLDER
            else:
                axis, places["axis"] = self.leg.axis, f"{self.place}.axis"
        if axis is not None:
            found: list[Fault] = []
            for leg, vector in enumerate(directions(places.get("axis", place), axis, self._near(index), found)):
                fields[leg]["axis"] = vector
            self.faults += [fault for fault in found if fault not in self.faults]

    def _near(self, index: int) -> list[Vector | None]:
        """For each leg the centre of the joint, or of the nearest one that has a centre."""
        near = sorted(range(len(self.steps)), key=lambda other: abs(other - index))
        found = next((self.centres[self.steps[each].letter] for each in near if self.steps[each].centred), None)
        return [point.at for point in found] if found else [(0.0, 0.0, 0.0)] * self.legs

    def _cones(self, index: int, cone: Any, bodies: tuple[str, str]) -> list[Cone | None]:
        if cone is None:
            return [None] * self.legs
        place = f"{self.place}.{self.steps[index].letter}.cone"
        self.faults += table_faults(place, cone, CONE_KEYS)
        if not isinstance(cone, Mapping):
            return [None] * self.legs
        last = index == len(self.steps) - 1 and index > 0
        fixed_to: Any = cone.get("fixed_to")
        if fixed_to is not None and fixed_to not in bodies:
            hint = near_miss(fixed_to, bodies) if isinstance(fixed_to, str) else ""
            self.faults.append(Fault(f"{place}.fixed_to", f"{shown(fixed_to)}{hint}", " or ".join(map(shown, bodies))))
        if fixed_to not in bodies:
            fixed_to = bodies[1 if last else 0]
        axes = self._cone_axes(index, cone.get("axis"), f"{place}.axis", outward=fixed_to != bodies[1])
        half_angle: Any = cone.get("half_angle")
        return [Cone(axis, half_angle, fixed_to) for axis in axes]

    def _cone_axes(self, index: int, axis: Any, place: str, outward: bool) -> list[Vector]:
        """The axes of a joint's cones; by default the lines to the next joint, outward or inward, at home."""
        if axis is not None:
            return directions(place, axis, self._near(index), self.faults)
        others = self.steps[index + 1 :] if outward else self.steps[:index][::-1]
        step = self.steps[index]
        ends = next((self.centres[other.letter] for other in others if other.centred), None)
        if not step.centred or ends is None:
            if step.centred:
                self.faults.append(Fault(place, "nothing, and no next joint that it could point at", EXPECTED))
            return [PLACEHOLDER] * self.legs
        lines = zip(self.centres[step.letter], ends, strict=True)
        return [_line(start.at, end.at) for start, end in lines]

    def _numbered(self, part: LegJoint, index: int, number: int) -> LegJoint:
        """The joint with the number of its leg behind its name and those of the leg's own bodies."""

        def name(own: str) -> str:
            return f"{self.leg.name}{own}{number}"

        joint = part.joint
        first = self.ends[0] if index == 0 else name(joint.connects[0])
        second = self.ends[1] if index == len(self.steps) - 1 else name(joint.connects[1])
        along = joint.along and (name(joint.along[0]), name(joint.along[1]))
        cone = joint.cone
        if cone is not None:
            fixed_to = first if cone.fixed_to == joint.connects[0] else second
            cone = dataclasses.replace(cone, fixed_to=fixed_to)
        changed = dataclasses.replace(joint, name=name(joint.name), connects=(first, second), along=along, cone=cone)
        return dataclasses.replace(part, joint=changed, leg=number)


OF_LEGS = (
    form("chain", chain_faults),
    wrong("name", lambda v, *_: not isinstance(v, str), "a text"),
    wrong("connects?", lambda v, *_: not is_pair_of_names(v), "the names of two bodies"),
    wrong("axis?", lambda v, _, maker: maker.steps and not any(map(maker.takes_axis, range(len(maker.steps)))),
          "nothing: no joint needs it"),
    wrong("stroke?", lambda v, _, maker: maker.steps and not maker.slides,
          "nothing: no joint of '{0.chain}' is prismatic"),
    wrong("stroke?", lambda v, _, maker: len(maker.slides) > 1, "the ranges of single joints: {1.ranges}"),
    wrong("stroke?", lambda v, _, maker: maker.slides and maker.said.get(maker.slides[0], {}).get("range") is not None
          and f"both `stroke` and `{maker.ranges}`", "one of them"),
)  # fmt: skip
"""Of legs, and of what makes their joints."""


def _line(start: Vector | None, end: Vector | None) -> Vector:
    if start is None or end is None or start == end:
        return PLACEHOLDER
    x, y, z = (b - a for a, b in zip(start, end, strict=True))
    return (x, y, z)


def placed_joints(
    legs: Sequence[Leg], base: str, end_effector: str, tips: Collection[str] = ()
) -> tuple[list[LegJoint], list[Fault]]:
    """All joints that the legs stand for, leg by leg, and the faults of what they are made from.

    Legs are counted on from one description to the next, by the name that comes before theirs.

    Parameters
    ----------
    tips : names of other joints, in which no leg can end.
    """
    placed: list[LegJoint] = []
    faults: list[Fault] = []
    number: Counter[str] = Counter()
    for index, leg in enumerate(legs):
        place = f"leg[{index}]"
        if leg.connects is None and end_effector in tips:
            found = f"nothing, but the end effector '{end_effector}' is a joint"
            faults.append(Fault(f"{place}.connects", found, "the two bodies that the legs lead from and to"))
        ends = leg.connects if leg.connects is not None and is_pair_of_names(leg.connects) else (base, end_effector)
        maker = LegMaker(leg, place, ends, faults)
        placed += maker.joints(number[str(leg.name)] + 1)
        number[str(leg.name)] += maker.count
    return placed, faults


def count_joints(leg: Leg) -> int:
    """Number of joints that legs stand for, as far as they can be read."""
    copies = leg.copies.get("count") if isinstance(leg.copies, Mapping) else 1.0
    turns = int(copies) if isinstance(copies, float) and 1.0 <= copies <= MOST_COPIES else 1
    return count_legs(leg.base, leg.platform) * len(read_chain(leg.chain)) * turns


def legs_name(legs: Sequence[Leg]) -> str:
    """What the field calls a machine of such legs: `6-UPS`, `2-UPS/1-U`."""
    kinds: Counter[str] = Counter()
    for leg in legs:
        kinds[re.sub(r"[^A-Z]", "", str(leg.chain))] += count_joints(leg) // (len(read_chain(leg.chain)) or 1)
    return "/".join(f"{count}-{kind}" for kind, count in kinds.items())
