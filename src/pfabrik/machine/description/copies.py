"""Rotational copies: one joint of a file stands for several, turned about an axis through the origin."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import Fault, near_miss
from .body_masses import Mass, as_matrix, as_moments
from .body_shapes import Shape
from .coercion import numbers, unit_vector
from .form_faults import direction_faults, is_name, is_numbers, is_pair_of_names, is_point, shown, table_faults
from .joints import Joint, Vector

PLACED = ("at", "ends", "axis", "axes", "file", "centre", "inertia")
"""Fields of a shape or a mass in base coordinates at home, which another copy has elsewhere unless it is turned."""

MOST_COPIES = 100
"""Most copies of one joint: a typing error beyond it, and a file of one line must not ask for a million joints."""


def read_copies(place: str, copies: Any, faults: list[Fault]) -> tuple[int, Vector] | None:
    """Number and unit axis of what is said of copies, `count` and `axis`; None with faults, added to the list."""
    found = list(table_faults(place, copies, ("count", "axis")))
    if not isinstance(copies, Mapping):
        faults += found
        return None
    count, axis = numbers(copies.get("count")), unit_vector(copies.get("axis"))
    if not isinstance(count, float) or not 1.0 <= count <= MOST_COPIES or count % 1.0 != 0.0:
        found.append(Fault(f"{place}.count", shown(count), f"a whole number from 1 to {MOST_COPIES}"))
    found += direction_faults(f"{place}.axis", axis)
    faults += found
    return None if found else (int(count), axis)


@dataclass(frozen=True)
class Turn:
    """`step` of `steps` equal parts of a full turn about a unit vector through the origin; by default none."""

    axis: Vector = (0.0, 0.0, 1.0)
    step: int = 0
    steps: int = 1


@dataclass(frozen=True)
class BodyCopy:
    """One of the bodies that a name stands for: `number` is behind its name, and behind those of its joints."""

    body: str
    number: int
    turn: Turn


@dataclass(frozen=True)
class Pattern:
    """A joint as its file writes it, with the number of its copies and the unit vector that they are turned about.

    Without copies, `count` and `axis` are None, and the pattern stands for its joint alone.
    """

    joint: Joint
    count: int | None = None
    axis: Vector | None = None


@dataclass(frozen=True)
class Copy:
    """One of the joints that a pattern stands for: copy `number` (from 1; 0 without copies) of pattern `index`."""

    index: int
    number: int
    joint: Joint


@dataclass(frozen=True)
class Patterns:
    """The patterns of a file, with the base and the end effector, which are never copied.

    Attributes
    ----------
    leg_bodies : the bodies of legs, by their names without a number; leg_joints : such names of their joints.
    """

    patterns: tuple[Pattern, ...]
    base: str
    end_effector: str
    leg_bodies: Mapping[str, Sequence[BodyCopy]] = field(default_factory=dict)
    leg_joints: frozenset[str] = frozenset()

    def copied_bodies(self) -> dict[str, Pattern]:
        """The bodies that have copies, each with the first pattern that says so."""
        bodies: dict[str, Pattern] = {}
        for pattern in self.patterns:
            if pattern.count is not None:
                for body in self._own_bodies(pattern):
                    bodies.setdefault(body, pattern)
        return bodies

    def copied_joints(self) -> frozenset[str]:
        """The names of the joints that have copies."""
        return frozenset(
            each.joint.name for each in self.patterns if each.count is not None and is_name(each.joint.name)
        )

    def _own_bodies(self, pattern: Pattern) -> list[str]:
        bodies = pattern.joint.connects if is_pair_of_names(pattern.joint.connects) else ()
        return [body for body in bodies if body not in (self.base, self.end_effector)]

    def expanded(self) -> list[Copy]:
        """All joints that the patterns stand for, pattern by pattern.

        The number of a copy is put behind the names of its joint, of the bodies that it connects, and of the joints
        that it runs along where these have copies.
        """
        bodies, joints = frozenset(self.copied_bodies()), self.copied_joints()
        return [copy for index, pattern in enumerate(self.patterns) for copy in _copies(index, pattern, bodies, joints)]

    @cached_property
    def families(self) -> dict[str, Sequence[BodyCopy]]:
        """The bodies that one name stands for: those with copies, and those of legs."""
        own = {body for pattern in self.patterns for body in self._own_bodies(pattern)}
        families = {name: bodies for name, bodies in self.leg_bodies.items() if name not in own}
        for body, pattern in self.copied_bodies().items():
            count, axis = pattern.count or 0, pattern.axis or Turn.axis
            turns = [Turn(axis, step, count) for step in range(count)]
            families[body] = [BodyCopy(f"{body}{k}", k, turn) for k, turn in enumerate(turns, 1)]
        return families

    def copies_of(self, body: Any) -> Sequence[BodyCopy]:
        """The bodies that a name stands for; none where it is that of one body, or of none."""
        return self.families.get(body, ()) if isinstance(body, str) else ()

    def copied_shapes(self, shape: Shape) -> list[Shape]:
        """The shapes that one stands for: a copy for each copy of its body, turned and renamed as that is."""
        joints = self.copied_joints() | self.leg_joints
        return [
            dataclasses.replace(
                _turned_shape(shape, copy.turn), body=copy.body, between=_numbered(shape.between, copy.number, joints)
            )
            for copy in self.copies_of(shape.body)
        ] or [shape]

    def copied_masses(self, mass: Mass) -> list[Mass]:
        """The masses that one stands for, as of shapes."""
        return [
            dataclasses.replace(turned_mass(mass, copy.turn), body=copy.body) for copy in self.copies_of(mass.body)
        ] or [mass]

    def place_faults(self, place: str, of_body: Shape | Mass) -> Iterator[Fault]:
        """Faults of what has one place at home, said of bodies that are not turned copies of one: legs at their own
        points."""
        copies = self.copies_of(of_body.body)
        if not copies or len(copies) == copies[0].turn.steps:
            return
        for key in PLACED:
            value = getattr(of_body, key, None)
            if value is not None:
                found = f"{shown(value)}, and '{of_body.body}' stands for {len(copies)} bodies, each at its own place"
                yield Fault(f"{place}.{key}", found, f"a table for each of them: '{copies[0].body}', …")

    def by_family(self, found: str) -> str:
        """What is found in place of a body, with the near miss that stands for all copies, not for one of them."""
        match = re.match(r"'(.*)': no such body", found)
        if match is None:
            return found
        numbered = {copy.body for copies in self.families.values() for copy in copies}
        bodies = {body for copy in self.expanded() for body in copy.joint.connects} - numbered
        return f"{match[0]}{near_miss(match[1], [*self.families, *sorted(bodies)])}"

    def as_written(self, text: str, copy: Copy) -> str:
        """A text about a copy with the names as its file writes them, without the copy's number."""
        if copy.number > 0:
            for name in (*self.copied_bodies(), *self.copied_joints()):
                text = text.replace(f"'{name}{copy.number}'", f"'{name}'")
        return text

    def faults(self) -> Iterator[Fault]:
        """What keeps the patterns from being expanded: ends that name nothing, copies that do not fit together."""
        yield from self._end_faults()
        shared = self.copied_bodies()
        for index, pattern in enumerate(self.patterns):
            for body in self._own_bodies(pattern):
                if body in shared and shared[body].count != pattern.count:
                    yield _misfit(index, pattern, body, shared[body])

    def _end_faults(self) -> Iterator[Fault]:
        """A base or end effector that names nothing, in the file or among the copies: any body could be meant."""
        joints = [each.joint for each in self.patterns] + [copy.joint for copy in self.expanded()]
        if not joints or not all(is_pair_of_names(joint.connects) and is_name(joint.name) for joint in joints):
            return
        bodies = dict.fromkeys(body for joint in joints for body in joint.connects)
        names = dict.fromkeys(joint.name for joint in joints)
        if self.base not in bodies:
            found = f"'{self.base}', which no joint connects{near_miss(self.base, bodies)}"
            yield Fault("base", found, "a body that a joint connects")
        if self.end_effector not in bodies | names:
            found = f"'{self.end_effector}', neither a body nor a joint{near_miss(self.end_effector, bodies | names)}"
            yield Fault("end_effector", found, "a body or a joint")


def _misfit(index: int, pattern: Pattern, body: str, first: Pattern) -> Fault:
    """A joint that shares a copied body and has no copies, or another number of them."""
    if pattern.count is None:
        found = f"'{body}', which has {_copies_of(first)}; did you mean '{body}1'?"
        return Fault(f"joint[{index}].connects", found, "bodies without copies, or one of the copies")
    found = f"{pattern.count}, but '{body}' has {_copies_of(first)} at joint '{first.joint.name}'"
    return Fault(f"joint[{index}].copies.count", found, str(first.count))


def _copies_of(pattern: Pattern) -> str:
    return "1 copy" if pattern.count == 1 else f"{pattern.count} copies"


def _copies(index: int, pattern: Pattern, bodies: frozenset[str], joints: frozenset[str]) -> Iterator[Copy]:
    if pattern.count is None or pattern.axis is None:
        yield Copy(index, 0, pattern.joint)
        return
    for number in range(1, pattern.count + 1):
        copied = turned(pattern.joint, Turn(pattern.axis, number - 1, pattern.count))
        yield Copy(index, number, _renamed(copied, number, bodies, joints))


def _renamed(joint: Joint, number: int, bodies: frozenset[str], joints: frozenset[str]) -> Joint:
    cone = joint.cone and dataclasses.replace(joint.cone, fixed_to=_numbered(joint.cone.fixed_to, number, bodies))
    return dataclasses.replace(
        joint,
        name=_numbered(joint.name, number, joints),
        connects=_numbered(joint.connects, number, bodies),
        along=_numbered(joint.along, number, joints),
        cone=cone,
    )


def _numbered(names: Any, number: int, copied: frozenset[str]) -> Any:
    """The name, or each of the names, with the number behind it when it is copied; anything else as it is."""
    if isinstance(names, tuple):
        return tuple(_numbered(name, number, copied) for name in names)
    return f"{names}{number}" if isinstance(names, str) and names in copied else names


def turned(joint: Joint, turn: Turn) -> Joint:
    """The joint turned; by none, it is the same to the last bit."""
    if turn.step == 0:
        return joint
    at, along, axes = (_turned(value, turn) for value in (joint.at, joint.axis, joint.axes))
    cone = joint.cone and dataclasses.replace(joint.cone, axis=_turned(joint.cone.axis, turn))
    return dataclasses.replace(joint, at=at, axis=along, axes=axes, cone=cone)


def _turned_shape(shape: Shape, turn: Turn) -> Shape:
    if turn.step == 0:
        return shape
    at_home = {field: getattr(shape, field) for field in ("at", "axis", "ends", "axes")}
    if shape.kind in ("box", "mesh") and shape.axes is None:
        at_home["axes"] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    return dataclasses.replace(shape, **{name: _turned(each, turn) for name, each in at_home.items()})


def turned_mass(mass: Mass, turn: Turn) -> Mass:
    """The mass turned; by none, it is the same to the last bit."""
    if turn.step == 0:
        return mass
    inertia = mass.inertia
    if inertia is not None and is_numbers(inertia, 6):
        rows = [rotated(row, turn) for row in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        inertia = as_moments(np.transpose(rows) @ as_matrix(inertia) @ np.array(rows))
    return dataclasses.replace(mass, centre=_turned(mass.centre, turn), inertia=inertia)


def _turned(value: Any, turn: Turn) -> Any:
    """A vector, or those in a tuple, turned; anything else as it is."""
    if is_point(value):
        return rotated(value, turn)
    return tuple(_turned(each, turn) for each in value) if isinstance(value, tuple) else value


def rotated(vector: Vector, turn: Turn) -> Vector:
    """The vector turned, right-handed."""
    cosine, sine = cos_sin(turn.step, turn.steps)
    (x, y, z), (a, b, c) = vector, turn.axis
    parallel = x * a + y * b + z * c
    cross = (b * z - c * y, c * x - a * z, a * y - b * x)
    rotated = (
        parallel * k + cosine * (v - parallel * k) + sine * w for v, k, w in zip(vector, turn.axis, cross, strict=True)
    )
    first, second, third = rotated
    return first, second, third


def cos_sin(step: int, steps: int) -> tuple[float, float]:
    """Cosine and sine of `step` of `steps` equal parts of a full turn, exact for multiples of 30 degrees that allow it.

    So a point with three-fold or four-fold copies does not leave its plane of symmetry by a rounding error of pi.
    """
    quarters, rest = divmod(4 * step, steps)
    angle = math.pi / 2 * rest / steps
    cosine = 0.5 if 3 * rest == 2 * steps else math.cos(angle)
    sine = 0.5 if 3 * rest == steps else math.sin(angle)
    turns = ((cosine, sine), (-sine, cosine), (-cosine, -sine), (sine, -cosine))
    return turns[quarters % 4]
