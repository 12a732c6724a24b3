"""The shape of a body, or a part of it: how thick a link is, for clearances and pictures."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, cast, get_args

from numpy.typing import ArrayLike

from .coercion import numbers, text, texts, unit_vector, unit_vectors
from .joints import Vector, set_fields

ShapeKind: TypeAlias = Literal["capsule", "sphere", "box", "disc", "mesh"]
SHAPE_KINDS: tuple[ShapeKind, ...] = get_args(ShapeKind)

SHAPE_FIELDS: dict[ShapeKind, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "capsule": (("thickness",), ("between", "ends", "density")),
    "sphere": (("at", "diameter"), ("density",)),
    "box": (("at", "size"), ("axes", "density")),
    "disc": (("at", "axis", "diameter", "thickness"), ("density",)),
    "mesh": (("file",), ("scale", "at", "axes")),
}
"""What each shape needs, and what it may have beside."""


@dataclass(frozen=True)
class Shape:
    """A solid that moves with a body, at home, in base coordinates. A body may have several.

    Attributes
    ----------
    body : str
        The body that it belongs to.
    kind : {"capsule", "sphere", "box", "disc", "mesh"}
        A capsule is a rod with round ends, a disc a round plate or a cylinder, a mesh the convex hull of a file of
        triangles. A part that is not convex is several meshes, one for each convex piece.
    thickness : float
        Diameter of a capsule; height of a disc [length].
    between : tuple of str or None
        The two joints between whose centres the axis of a capsule runs: joints of the body, or of one that slides along
        it, as the two parts of a strut. By default the two joints of the body, where it has just two.
    ends : tuple of array (3,) or None
        In place of joints, both ends of the axis of a capsule, points of the body.
    at : array (3,) or None
        Centre of a sphere, box or disc; of a mesh where the origin of its file is, by default that of the base.
    diameter : float or None
        Diameter of a sphere or disc [length].
    axis : array (3,) or None
        Axis of a disc.
    size : array (3,) or None
        Lengths of the edges of a box.
    axes : tuple of array (3,) or None
        Directions of the first two edges of a box, or of the x and y axes of a mesh's file, square to each other; by
        default x and y.
    file : str or None
        Path of the file of a mesh: STL, OBJ, PLY and others.
    scale : float or None
        Factor on the numbers of a mesh's file; 1 by default.
    density : float or None
        Mass per volume [kg/m³] of what the shape is filled with, from which the mass of its body follows, in place of a
        `Mass`; not of a mesh. A strut is as long as at home, and weighs on its `body` alone.
    """

    body: str
    kind: ShapeKind = "capsule"
    thickness: float = cast(float, None)  # None where the kind has none
    between: tuple[str, str] | None = None
    ends: tuple[Vector, Vector] | None = None
    at: Vector | None = None
    diameter: float | None = None
    axis: Vector | None = None
    size: Vector | None = None
    axes: tuple[Vector, Vector] | None = None
    file: str | None = None
    scale: float | None = None
    density: float | None = None

    if TYPE_CHECKING:  # what may be given, which is more than what the fields then are

        def __init__(
            self,
            body: str,
            kind: ShapeKind = "capsule",
            thickness: float | None = None,
            between: Sequence[str] | None = None,
            ends: ArrayLike | None = None,
            at: ArrayLike | None = None,
            diameter: float | None = None,
            axis: ArrayLike | None = None,
            size: ArrayLike | None = None,
            axes: ArrayLike | None = None,
            file: str | os.PathLike[str] | None = None,
            scale: float | None = None,
            density: float | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        plain = {name: numbers(getattr(self, name)) for name in _NUMBERS}
        named = {"body": text(self.body), "kind": text(self.kind), "between": texts(self.between)}
        named["file"] = _whole_path(self.file)
        set_fields(self, **plain, **named, axis=unit_vector(self.axis), axes=unit_vectors(self.axes))

    @property
    def is_filled(self) -> bool:
        """True if its volume can weigh something: that of any kind but a mesh."""
        return self.kind != "mesh"


_NUMBERS = ("thickness", "ends", "at", "diameter", "size", "scale", "density")


def _whole_path(file: Any) -> Any:
    """A path from the root, which stands for the same file wherever it is read; anything else as it is."""
    return os.path.abspath(os.fspath(file)) if isinstance(file, str | os.PathLike) and os.fspath(file) else file
