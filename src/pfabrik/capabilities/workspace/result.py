"""A workspace: its size, its border and the limits that form it, its components."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from ...common.drawing import Theme, View, drawn
from ...common.printed import Printed, ResultTable
from ...errors import counted
from ..certify.enclosure import Enclosure
from .border_search import sliced
from .inscribed import Inscribed, Kind, inscribed
from .region import Region
from .saving import save
from .workspace_table import LEAST_SHARE, in_words, workspace_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Workspace(Printed, Region):
    """The workspace of a mechanism over two or three coordinates.

    Attributes
    ----------
    names : tuple of str
        Names of the d coordinates: of "x", "y", "z", "tilt_x", "tilt_y", "yaw", or "pivot[0]", "pivot[1]".
    units : tuple of str
        Unit of each coordinate: that of lengths, or "rad".
    resolution : array (d,)
        Size of the cells at the border [length or rad].
    vertices : array (v, d)
        Points on the border, just inside [length or rad].
    faces : array of int (f, d)
        Indices of vertices: triangles, right-handed as seen from outside; in a plane, segments with the inside on their
        left. They are closed.
    limits : tuple of tuple of str
        Pairs (joint, bound) of what may form the border, as in `Feasibility`; a coordinate and "min" or "max" where
        `within` cut the workspace off.
    enclosure : Enclosure or None
        Its size between two proved bounds, if it was asked for; else None.
    face_limit : array of int (f,)
        Index in `limits` of the limit that forms each face.
    vertex_limit : array of int (v,)
        Index in `limits` of the limit that forms the border at each vertex.
    """

    enclosure: Enclosure | None = None

    @cached_property
    def components(self) -> tuple[Workspace, ...]:
        """The connected components, each a workspace of its own: that of the start first, then by size."""
        if self._part is not None:
            return (self,)
        labels = self._parts.labels[self._mesh.inner]
        components = []
        for part in range(self._parts.count):
            mesh = self._mesh.among(labels == part)
            if len(mesh.faces):
                components.append(Workspace(self._question, self.resolution, mesh, self._parts, part))
        start = self._start_part
        return tuple(sorted(components, key=lambda each: (each._part != start, -each.size)))

    @property
    def at_start(self) -> Workspace | None:
        """The part that the start is in; None where the start, with what is fixed, is not within reach."""
        first = self.components[0] if self.components else None
        return first if first is not None and first._part == self._start_part else None

    @property
    def _start_part(self) -> int:
        start = self._question.space.start[None]
        return int(self._parts.of(start)[0]) if self._question.measure(start)[0][0] >= 0.0 else -1

    def slice(self, fixed: Mapping[str, float], *, resolution: float | None = None) -> Workspace:
        """The workspace with further coordinates fixed, searched anew.

        Parameters
        ----------
        fixed : mapping of str to float
            Coordinates to fix, such as {"z": 200} [length or rad].
        resolution : float, optional
            As in `workspace`; default: this one's.
        """
        return Workspace(*sliced(self._question, fixed, self.resolution if resolution is None else resolution))

    def inscribed(
        self, kind: Kind, centre: ArrayLike | None = None, *, proportions: ArrayLike | None = None
    ) -> Inscribed:
        """The largest sphere (in a plane: circle), box or cylinder within reach.

        Parameters
        ----------
        kind : str
            "sphere", "box" or "cylinder".
        centre : array (d,), optional
            The centre; default: that of the largest shape that a search finds.
        proportions : array, optional
            Sides of the box, (d,), default all equal; diameter and height of the cylinder, which stands along the last
            coordinate, default equal.
        """
        return inscribed(self, kind, centre, proportions)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        shape: Inscribed | None = None,
        view: View | None = None,
        size: tuple[float, float] | None = None,
        theme: Theme = "light",
    ) -> Axes:
        """Draw the border, each face in the colour of the limit that forms it, and return the axes.

        A workspace in space stands in a box, with the machine where it starts: dotted in the solid and behind it.
        Beside it are slices through the start, and the solid from below where that shows more limits.

        Parameters
        ----------
        ax : Axes, optional
            Two-dimensional Matplotlib axes to draw on, without slices. Default: those of a new figure.
        shape : Inscribed, optional
            One that fits in, as of `inscribed`, whose edges are drawn too; then slices are through its centre.
        view : str or (float, float), optional
            Of a workspace in space: "top", "front", "side" or "iso", or elevation and azimuth [deg]. Default: where
            most limits are seen.
        size : (float, float), optional
            Width and height of a new figure [inches]; a small one has no slices.
        theme : {"light", "dark"}, optional
            Colours for a light or a dark ground.

        Raises
        ------
        InvalidArgument
            Three-dimensional axes, or no such view, size or theme.
        MissingLibrary
            Matplotlib is not installed.
        """
        axes: Axes = drawn(self, ax, shape, view, size, theme)
        return axes

    def save(self, path: str | PathLike[str]) -> None:
        """Write .npz (all arrays), .stl or .ply (the mesh; .ply with limits), or .csv (points of the border)."""
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
            "enclosure": None if self.enclosure is None else self.enclosure.to_dict(),
            "components": [{"size": each.size, "at_start": each is self.at_start} for each in self.components],
        }

    def table(self) -> ResultTable:
        """Size, ends, what forms the border, proved bounds and components; for notebooks its outline in a plane."""
        remarks = []
        if self.enclosure is not None:
            lower, upper = self.enclosure.lower, self.enclosure.upper
            remarks.append(f"proved: at least {lower:,.7g} and at most {upper:,.7g} {self.size_unit}")
        at_start = self.at_start
        if len(self.components) > 1:
            large = [each for each in self.components if each is at_start or each.size >= LEAST_SHARE * self.size]
            places = ["with" if each is at_start else "apart from" for each in large]
            parts = [f"{place} the start: {in_words(each)}" for place, each in zip(places, large, strict=True)]
            if small := len(self.components) - len(large):
                parts.append(f"and {counted(small, 'part')} of less than {LEAST_SHARE:.1%}")
            remarks.append("\n".join(parts))
        elif at_start is None:
            remarks.append("the start is not within it")
        return workspace_table(self, remarks)

    def __repr__(self) -> str:
        over = ", ".join(self.names)
        return f"<Workspace of '{self.mechanism.name}' over {over}: {in_words(self, degrees=False)}>"
