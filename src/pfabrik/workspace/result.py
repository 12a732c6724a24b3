"""A workspace that was found: its size, its border and what forms it, its parts."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Ints, Mask
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..poses import as_floats
from .parts import Parts
from .surface import Mesh
from .verdicts import Limits, Question
from .words import in_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .inscribed import Inscribed, Kind

EXPONENTS = {1: "", 2: "²", 3: "³"}


class Workspace:
    """Where a mechanism can go, over two or three coordinates.

    Attributes
    ----------
    names : of the d coordinates: of "x", "y", "z", "tilt_x", "tilt_y", "yaw", or "pivot[0]", "pivot[1]".
    units : of each coordinate: that of lengths, or "rad".
    resolution : size of the cells that the border was looked for in, (d,) [length or rad].
    vertices : points on the border, just inside, (v, d) [length or rad].
    faces : places of vertices, (f, d): triangles, right-handed as seen from outside; in a plane, segments with the
        inside on their left. They are closed.
    limits : (joint, bound) of what may form the border, as of `Feasibility`; a coordinate and "min" or "max" where
        `within` cut the workspace off.
    face_limit : which of `limits` forms each face, (f,).
    """

    def __init__(
        self, question: Question, resolution: Floats, mesh: Mesh, coarser: Mesh, parts: Parts, part: int | None = None
    ) -> None:
        self._question, self._mesh, self._coarser, self._parts, self._part = question, mesh, coarser, parts, part
        self.resolution = resolution
        self.limits: Limits = question.limits
        for array in (*mesh, resolution):
            array.setflags(write=False)

    @property
    def mechanism(self) -> Mechanism:
        return self._question.mechanism

    @property
    def names(self) -> tuple[str, ...]:
        return self._question.space.names

    @property
    def units(self) -> tuple[str, ...]:
        return self._question.space.units

    @property
    def vertices(self) -> Floats:
        return self._mesh.vertices

    @property
    def faces(self) -> Ints:
        return self._mesh.faces

    @cached_property
    def face_limit(self) -> Ints:
        """The limit of most of its vertices."""
        own = self._mesh.limits[self.faces]
        found = np.where((own[:, 1:2] == own[:, 2:]).any(axis=1), own[:, 1], own[:, 0])
        found.setflags(write=False)
        return found

    @property
    def vertex_limit(self) -> Ints:
        """Which of `limits` forms the border at each vertex, (v,)."""
        return self._mesh.limits

    @property
    def size(self) -> float:
        """Area or volume [`size_unit`]; of a tilt and a length, say, their product."""
        return self._mesh.size

    @property
    def uncertainty(self) -> float:
        """By how much `size` differs from that at twice the resolution [`size_unit`]."""
        return abs(self._mesh.size - self._coarser.size)

    @property
    def size_unit(self) -> str:
        """Such as "mm³", or "rad² mm"."""
        counts = {unit: self.units.count(unit) for unit in sorted(set(self.units), reverse=True)}
        return " ".join(unit + EXPONENTS[count] for unit, count in counts.items())

    @property
    def volume(self) -> float:
        """Of three coordinates [`size_unit`]."""
        return self._size_of(3, "volume")

    @property
    def area(self) -> float:
        """Of two coordinates [`size_unit`]."""
        return self._size_of(2, "area")

    def _size_of(self, d: int, what: str) -> float:
        if len(self.names) != d:
            raise InvalidArgument(what, f"a workspace over {', '.join(self.names)}", f"{d} coordinates; or `size`")
        return self.size

    @property
    def bounds(self) -> Floats:
        """Least and greatest value of each coordinate, (2, d) [length or rad]; NaN where nothing is within reach."""
        if not len(self.vertices):
            return np.full((2, len(self.names)), np.nan)
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @cached_property
    def shares(self) -> dict[tuple[str, str], float]:
        """(joint, bound) -> share of the border that this limit forms, the greatest first."""
        sizes = self._mesh.face_sizes
        total = np.bincount(self.face_limit, sizes, minlength=len(self.limits))
        order = [index for index in np.argsort(-total, kind="stable").tolist() if total[index] > 0.0]
        return {self.limits[index]: float(total[index] / sizes.sum()) for index in order}

    @cached_property
    def components(self) -> tuple[Workspace, ...]:
        """The parts that do not hang together, each a workspace of its own: the start's first, then by size."""
        if self._part is not None:
            return (self,)
        labels, coarse = (self._parts.labels[mesh.inner] for mesh in (self._mesh, self._coarser))
        found = []
        for part in range(self._parts.count):
            mesh = self._mesh.among(labels == part)
            if len(mesh.faces):
                coarser = self._coarser.among(coarse == part)
                found.append(Workspace(self._question, self.resolution, mesh, coarser, self._parts, part))
        start = self._start_part
        return tuple(sorted(found, key=lambda each: (each._part != start, -each.size)))

    @property
    def at_start(self) -> Workspace | None:
        """The part that the start is in; None where the start, with what is fixed, is not within reach."""
        first = self.components[0] if self.components else None
        return first if first is not None and first._part == self._start_part else None

    @property
    def _start_part(self) -> int:
        start = self._question.space.start[None]
        return int(self._parts.of(start)[0]) if self._question.measure(start)[0][0] >= 0.0 else -1

    def contains(self, points: ArrayLike) -> bool | Mask:
        """Whether points (..., d) are within reach [length or rad]: asked anew, not read off the mesh; bools (...).

        Of one of several `components`, whether they are within it.
        """
        array = self._points("points", points)
        rows = array.reshape(-1, array.shape[-1])
        inside: Mask = self._question.measure(rows)[0] >= 0.0
        if self._part is not None:
            inside[inside] = self._parts.of(rows[inside]) == self._part
        return inside.reshape(array.shape[:-1]) if array.ndim > 1 else bool(inside[0])

    def poses(self, points: ArrayLike) -> Floats:
        """The targets (..., 4, 4) in the base frame that points (..., d) stand for."""
        array = self._points("points", points)
        return self._question.space.poses(array.reshape(-1, array.shape[-1])).reshape(*array.shape[:-1], 4, 4)

    def _points(self, name: str, points: ArrayLike) -> Floats:
        expected = f"finite numbers of shape (..., {len(self.names)}): {', '.join(self.names)}"
        array = as_floats(name, points, expected)
        if array.shape[-1:] != (len(self.names),) or not np.isfinite(array).all():
            raise InvalidArgument(name, f"shape {array.shape}", expected)
        return array

    def slice(self, fixed: Mapping[str, float], *, resolution: float | None = None) -> Workspace:
        """The workspace with further coordinates fixed, looked for anew.

        Parameters
        ----------
        fixed : such as {"z": 200} [length or rad].
        resolution : as of `workspace`; default: this one's.
        """
        from .ask import sliced

        return sliced(self._question, fixed, self.resolution if resolution is None else resolution)

    def inscribed(
        self,
        kind: Kind,
        centre: ArrayLike | None = None,
        *,
        proportions: ArrayLike | None = None,
    ) -> Inscribed:
        """The largest sphere (in a plane: circle), box or cylinder within reach.

        Parameters
        ----------
        centre : (d,); default: where the largest has its own, as far as a search finds.
        proportions : sides of the box, (d,), default all equal; diameter and height of the cylinder, which stands along
            the last coordinate, default equal.
        """
        from .inscribed import inscribed

        return inscribed(self, kind, centre, proportions)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the border, each face in the colour of the limit that forms it, and return the axes.

        Parameters
        ----------
        ax : matplotlib axes to draw on, three-dimensional ones for three coordinates. Default: those of a new figure.

        Raises
        ------
        InvalidArgument : two-dimensional axes for three coordinates.
        MissingLibrary : matplotlib is not installed.
        """
        from .picture import plot

        return plot(self, ax)

    def save(self, path: str | PathLike[str]) -> None:
        """Write .npz (all arrays), .stl or .ply (the mesh; .ply with limits), or .csv (points of the border)."""
        from .saving import save

        save(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and dicts, ready for JSON: sizes, ends, limits and parts, without the mesh."""
        shares = [{"joint": joint, "bound": bound, "share": share} for (joint, bound), share in self.shares.items()]
        ends = dict(zip(self.names, self.bounds.T.tolist(), strict=True))
        return {
            "coordinates": list(self.names),
            "units": list(self.units),
            "size": self.size,
            "uncertainty": self.uncertainty,
            "size_unit": self.size_unit,
            "resolution": self.resolution.tolist(),
            "bounds": ends if len(self.faces) else None,
            "limits": shares,
            "components": [{"size": each.size, "at_start": each is self.at_start} for each in self.components],
        }

    def __repr__(self) -> str:
        over = ", ".join(self.names)
        return f"<Workspace of '{self.mechanism.name}' over {over}: {in_words(self)}>"
