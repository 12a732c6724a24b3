"""The region within reach: its border, the limits that form it, and the parts that it encloses."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats, Ints, Mask
from ...errors import InvalidArgument
from .parts import Parts
from .surface import BorderMesh, closeness
from .verdicts import Limits, MapQuestion

EXPONENTS = {1: "", 2: "²", 3: "³"}


def product_of(units: Sequence[str]) -> str:
    """The product of units: "mm³", or "rad² mm"."""
    counts = {unit: units.count(unit) for unit in sorted(set(units), reverse=True)}
    return " ".join(unit + EXPONENTS[count] for unit, count in counts.items())


class Region:
    """The fields of a `Workspace`, which documents them; functions that draw, write or fill a workspace read these."""

    def __init__(
        self, question: MapQuestion, resolution: Floats, mesh: BorderMesh, parts: Parts, part: int | None = None
    ) -> None:
        self._question, self._mesh, self._parts, self._part = question, mesh, parts, part
        self.mechanism, self.names, self.units = question.mechanism, question.space.names, question.space.units
        self.vertices, self.faces, self.vertex_limit = mesh.vertices, mesh.faces, mesh.limits
        self.resolution = resolution
        self.limits: Limits = question.limits
        for each in (*mesh, resolution):
            each.setflags(write=False)

    @cached_property
    def face_limit(self) -> Ints:
        """The limit of most vertices of each face, (f,)."""
        limits = self._mesh.limits[self.faces]
        most = np.where((limits[:, 1:2] == limits[:, 2:]).any(axis=1), limits[:, 1], limits[:, 0])
        most.setflags(write=False)
        return most

    @cached_property
    def size(self) -> float:
        """Area or volume [`size_unit`]; of a tilt and a length, say, their product."""
        return self._mesh.size

    @cached_property
    def uncertainty(self) -> float:
        """The most that `size` is off where nothing is smaller than a cell [`size_unit`]."""
        return self._mesh.error(self.resolution, closeness(self._question))

    @property
    def size_unit(self) -> str:
        """Unit of `size`, such as "mm³", or "rad² mm"."""
        return product_of(self.units)

    @property
    def volume(self) -> float:
        """Volume over three coordinates [`size_unit`]."""
        return self._size_of(3, "volume")

    @property
    def area(self) -> float:
        """Area over two coordinates [`size_unit`]."""
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
        """(joint, bound) -> share of the border that this limit forms, the greatest first.

        Both ranges of a joint that has two count together, as in `margins`, and all legs on one proximal joint.
        """
        sizes, total = self._mesh.face_sizes, dict.fromkeys(self.limits, 0.0)
        for limit, size in zip(self.face_limit.tolist(), sizes.tolist(), strict=True):
            total[self.limits[limit]] += size
        order = sorted((limit for limit, size in total.items() if size > 0.0), key=lambda limit: -total[limit])
        return {limit: float(total[limit] / sizes.sum()) for limit in order}

    def contains(self, points: ArrayLike) -> bool | Mask:
        """True where points (..., d) [length or rad] are within reach; solved anew, not read off the mesh; bools (...).

        For one of several `components`, True where they are within it.
        """
        given = self._points(points)
        rows = given.reshape(-1, given.shape[-1])
        inside = self._parts.reached(self._question, rows)
        if self._part is not None:
            inside[inside] = self._parts.of(rows[inside]) == self._part
        return inside.reshape(given.shape[:-1]) if given.ndim > 1 else bool(inside[0])

    def poses(self, points: ArrayLike) -> Floats:
        """The targets (..., 4, 4) in the base frame that points (..., d) stand for."""
        given = self._points(points)
        return self._question.space.poses(given.reshape(-1, given.shape[-1])).reshape(*given.shape[:-1], 4, 4)

    def _points(self, points: ArrayLike) -> Floats:
        return array("points", points, f"... {len(self.names)}", note=f": {', '.join(self.names)}")
