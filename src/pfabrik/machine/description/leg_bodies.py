"""The bodies of legs: what they are called together, how thick they are, and what they weigh."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise
from typing import Any, TypeAlias

from ...errors import Fault
from .body_masses import Mass
from .body_shapes import Shape
from .copies import BodyCopy, Patterns, turned_mass
from .leg_joints import LegJoint
from .legs import Leg, neighbours, read_chain

PlaceOf: TypeAlias = Callable[[str], str]
"""Where a description has a field of a shape or a mass."""


@dataclass(frozen=True)
class LegBody:
    """A body between two joints of a leg.

    Attributes
    ----------
    family : its name without the number of its leg.
    said : what its leg says of it, by key; of centres its own.
    ends : names of the two joints that its link runs between; None where it is no link.
    thickness : its own, or that of the leg.
    is_last : True if it is the last body of its link, which the leg's thickness gives a shape.
    place, leg_place : where the description has it, and its leg.
    """

    copy: BodyCopy
    family: str
    said: Mapping[str, Any]
    ends: tuple[str, str] | None
    thickness: float | None
    is_last: bool
    place: str
    leg_place: str

    def place_of(self, field: str) -> str:
        """Where a field of its shape or mass is said."""
        if field in self.said or field == "centre":
            return f"{self.place}.{field}"
        if field in ("body", "mass"):
            return f"{self.place}.mass"
        inherits = self.thickness is not None and "thickness" not in self.said
        return f"{self.leg_place if inherits else self.place}.thickness"

    @property
    def has_link(self) -> bool:
        """True if the leg says itself how thick or dense its link is."""
        return "thickness" in self.said or "density" in self.said

    def is_link(self, shape: Shape) -> bool:
        """True if a shape of the body is its link: it runs between the same joints, or says nothing else."""
        between = self.ends if shape.between is None else shape.between
        return shape.kind == "capsule" and shape.ends is None and between in (self.ends, (self.ends or ())[::-1])

    def shape(self) -> Shape | None:
        """Its link; None where nothing asks for one, or says how thick it is."""
        asks = self.has_link or self.is_last or ("mass" in self.said and "centre" not in self.said)
        if not self.ends or not asks or (self.thickness is None and "density" not in self.said):
            return None
        return Shape(self.copy.body, thickness=self.thickness, between=self.ends, density=self.said.get("density"))

    def mass(self) -> Mass | None:
        """What it weighs; None where nothing says so."""
        if "mass" not in self.said and "centre" not in self.said:
            return None
        mass = Mass(self.copy.body, self.said.get("mass"), self.said.get("centre"))  # type: ignore[arg-type]
        return turned_mass(mass, self.copy.turn)


def bodies_of_legs(legs: Sequence[Leg], placed: Sequence[LegJoint]) -> list[LegBody]:
    """The bodies of all legs, leg by leg."""
    bodies: list[LegBody] = []
    for index, leg in enumerate(legs):
        own = [part for part in placed if part.place.startswith(f"leg[{index}].")]
        for count, (_, parts) in enumerate(groupby(own, lambda part: part.leg)):
            bodies += _bodies(leg, list(parts), f"leg[{index}]", count)
    return bodies


def _bodies(leg: Leg, parts: Sequence[LegJoint], place: str, count: int) -> Iterator[LegBody]:
    """The bodies of one leg.

    Parameters
    ----------
    parts : its joints, from the base outward.
    count : how many legs of the same table are before it.
    """
    steps = read_chain(leg.chain)
    names = {step.letter: part.joint.name for step, part in zip(steps, parts, strict=True)}
    for (first, second), part in zip(pairwise(names), parts[1:], strict=True):
        said = _said(leg, first + second)
        centre = said.get("centre")
        if isinstance(centre, tuple) and any(isinstance(part, tuple) for part in centre):
            said["centre"] = centre[count % len(centre)]
        near = neighbours(steps, first + second)
        ends = (names[near[0]], names[near[1]]) if len(near) == 2 else None
        copy = BodyCopy(part.joint.connects[0], part.leg, part.turn)
        thickness: Any = said.get("thickness", leg.thickness)
        family, own_place = f"{leg.name}{first}{second}", f"{place}.{first}{second}"
        yield LegBody(copy, family, said, ends, thickness, second in near, own_place, place)


def _said(leg: Leg, letters: str) -> dict[str, Any]:
    """What a leg says of a body, as far as it is a table."""
    by_letter: Any = leg.by_letter
    said = by_letter.get(letters) if isinstance(by_letter, Mapping) else None
    return dict(said) if isinstance(said, Mapping) else {}


def families_of(bodies: Iterable[LegBody]) -> dict[str, list[BodyCopy]]:
    """The bodies of legs by their names without a number."""
    families: dict[str, list[BodyCopy]] = {}
    for body in bodies:
        families.setdefault(body.family, []).append(body.copy)
    return families


def all_shapes(
    layout: Patterns, shapes: Sequence[Shape | None], bodies: Sequence[LegBody], faults: list[Fault]
) -> list[tuple[Shape, PlaceOf]]:
    """The shapes of tables, copies included, then those of legs; faults of tables are added to the list.

    A table of a link stands for that of the leg: it has the leg's thickness where it has none of its own.
    """
    links = {body.copy.body: body for body in bodies if body.ends}
    found: list[tuple[Shape, PlaceOf]] = []
    for index, shape in enumerate(shapes):
        if shape is None:
            continue
        faults += layout.place_faults(f"body[{index}]", shape)
        for copied in layout.copied_shapes(shape):
            body = links.get(copied.body)
            if body is not None and body.is_link(copied):
                thickness = body.thickness if copied.thickness is None else copied.thickness
                copied = dataclasses.replace(copied, between=body.ends, thickness=thickness)
                del links[copied.body]
                if body.has_link:
                    said = f"'{shape.body}', whose thickness or density {body.place} has too"
                    faults += [Fault(f"body[{index}].name", said, "one of them")] if body.copy.number < 2 else []
            found.append((copied, partial(_table_place, f"body[{index}]")))
    of_legs = ((body, body.shape()) for body in bodies if body.copy.body in links)
    return found + [(shape, body.place_of) for body, shape in of_legs if shape is not None]


def all_masses(
    layout: Patterns, masses: Sequence[Mass | None], bodies: Sequence[LegBody], faults: list[Fault]
) -> list[tuple[Mass, PlaceOf]]:
    """The masses of tables, copies included, then those of legs; faults of tables are added to the list."""
    found: list[tuple[Mass, PlaceOf]] = []
    for index, mass in enumerate(masses):
        if mass is not None:
            faults += layout.place_faults(f"body[{index}]", mass)
            place = partial(_table_place, f"body[{index}]")
            found += [(copied, place) for copied in layout.copied_masses(mass)]
    of_legs = ((body, body.mass()) for body in bodies)
    return found + [(mass, body.place_of) for body, mass in of_legs if mass is not None]


def _table_place(table: str, field: str) -> str:
    return f"{table}.{'name' if field == 'body' else field}".rstrip(".")
