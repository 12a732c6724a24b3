"""The collision geometry of a robot: solids on its bodies, and which of them never touch."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...machine.description.mechanism import Mass, Shape
from ...machine.description.moved_parts import moved_mass, moved_shape, plain_axes
from .imported_masses import mass_in_unit

LENGTHS = ("thickness", "ends", "at", "diameter", "size")
"""Fields of a shape that are lengths, or points."""

MOST_SOLIDS = 5000
"""Most solids that are read of one file: a humanoid with every bolt has some hundred."""

EVERYTHING = -1
"""The bits of a solid that touches whatever has bits."""


@dataclass(frozen=True)
class Solid:
    """A part of the collision geometry.

    Attributes
    ----------
    shape : of the body that its own has become a part of, with the joints at their home values, in base coordinates.
    owner : its own body, in the file.
    name : of the geom; empty where it has none.
    contype, conaffinity : bits, as of MuJoCo: two solids touch if one's contype has a bit of the other's conaffinity.
    """

    shape: Shape
    owner: str
    name: str = ""
    contype: int = EVERYTHING
    conaffinity: int = EVERYTHING

    def touches(self, other: Solid) -> bool:
        """True if the bits let the two touch."""
        return bool(self.contype & other.conaffinity or other.contype & self.conaffinity)


@dataclass(frozen=True)
class Collision:
    """The collision geometry of a robot, and what the file says of pairs.

    Attributes
    ----------
    excluded : pairs of bodies, by their names in the file, that never touch.
    paired : pairs of geoms that touch whatever bits and bodies they have.
    clearance : as of a `Mechanism`.
    masses : of bodies, which go where solids go.
    """

    solids: tuple[Solid, ...] = ()
    excluded: tuple[tuple[str, str], ...] = ()
    paired: frozenset[frozenset[str]] = frozenset()
    clearance: float | None = None
    masses: tuple[Mass, ...] = ()

    def merged(self, stands_for: Mapping[str, str]) -> Collision:
        """With the solids of merged bodies on the body that stands for them."""
        return self._with_parts(
            [replace(each.shape, body=stands_for.get(each.shape.body, each.shape.body)) for each in self.solids],
            [replace(each, body=stands_for.get(each.body, each.body)) for each in self.masses],
        )

    def moved(self, motions: Mapping[str, Floats]) -> Collision:
        """With bodies moved, each by a transform (4, 4) in base coordinates; those that are not named stay."""
        still = np.eye(4)
        return self._with_parts(
            [
                moved_shape(each.shape, motions[each.shape.body]) if each.shape.body in motions else each.shape
                for each in self.solids
            ],
            [moved_mass(each, motions.get(each.body, still)) for each in self.masses],
        )

    def in_unit(self, metres: float) -> Collision:
        """With lengths in a unit, from metres."""
        clearance = None if self.clearance is None else self.clearance / metres
        shapes = [shape_in_unit(each.shape, metres) for each in self.solids]
        parts = self._with_parts(shapes, [mass_in_unit(each, metres) for each in self.masses])
        return replace(parts, clearance=clearance)

    def on(self, bodies: Collection[str]) -> Collision:
        """The solids and masses on some bodies."""
        masses = tuple(each for each in self.masses if each.body in bodies)
        return replace(self, solids=tuple(each for each in self.solids if each.shape.body in bodies), masses=masses)

    def _with_parts(self, shapes: Sequence[Shape], masses: Sequence[Mass]) -> Collision:
        solids = (replace(each, shape=shape) for each, shape in zip(self.solids, shapes, strict=True))
        return replace(self, solids=tuple(solids), masses=tuple(masses))


NO_COLLISION = Collision()


def shape_in_unit(shape: Shape, metres: float) -> Shape:
    """A shape in a unit of length, from metres."""
    lengths = {name: getattr(shape, name) for name in LENGTHS}
    changes: dict[str, Any] = {name: np.divide(value, metres) for name, value in lengths.items() if value is not None}
    return replace(shape, **changes)


def solid_shape(body: str, kind: str, size: Floats, frame: Floats) -> Shape:
    """A solid that is along the axes of a frame (4, 4) [length], its middle there.

    Parameters
    ----------
    kind : "sphere", "capsule", "box", or "cylinder", which is a disc.
    size : as of MuJoCo, (3,) [length]: the radius, then half the length along z; of a box half its edges.
    """
    at, along = frame[:3, 3], frame[:3, 2]
    if kind == "sphere":
        return Shape(body, "sphere", at=at, diameter=2.0 * size[0])
    if kind == "capsule":
        return Shape(body, "capsule", thickness=2.0 * size[0], ends=[at + size[1] * along, at - size[1] * along])
    if kind == "box":
        return Shape(body, "box", at=at, size=2.0 * size, axes=plain_axes(frame[:3, :3]))
    return Shape(body, "disc", at=at, axis=along, diameter=2.0 * size[0], thickness=2.0 * size[1])
