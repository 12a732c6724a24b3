"""Slices: where a plane cuts a mesh, and the shapes that fit in, drawn on axes of the other two coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..capabilities.workspace.workspace_table import for_people, labels
from ..common.arrays import Floats, Ints
from ..common.drawing import SMALL
from .frame import round_ticks
from .looks import Look, dress

if TYPE_CHECKING:
    from ..capabilities.workspace.inscribed import Inscribed
    from ..capabilities.workspace.region import Region

BORDER, ROUND = 1.8, 96
"""Width of a border [points], and straight pieces of a circle."""

ACROSS, UP = 23.0, 15.0
"""Room that each number needs on a level and on an upright axis [points]."""

AROUND = 6
"""Segments before and after each of a border that decide on its group."""

DASHED: dict[str, Any] = {"linewidth": 0.9, "linestyle": (0, (4.0, 2.0)), "zorder": 4}
"""Looks of a shape that fits in."""


class Cut(NamedTuple):
    """Where a plane across one coordinate cuts a mesh.

    Attributes
    ----------
    points : (p, 2), the other two coordinates.
    segments : places of both ends, (k, 2), with the inside on the left of those of a closed mesh.
    faces : the face that each is in, (k,).
    """

    points: Floats
    segments: Ints
    faces: Ints


class Plane(NamedTuple):
    """A plane across one coordinate of space: its level [length or rad], and the other two, to the right and up."""

    axis: int
    level: float
    across: list[int]


def plane_across(axis: int, level: float, order: tuple[int, int, int]) -> Plane:
    """A plane in which the upright coordinate, the last of an order, is upright."""
    return Plane(axis, level, [k for k in order if k != axis])


def cut_mesh(vertices: Floats, faces: Ints, plane: Plane) -> Cut:
    """Cut a mesh of triangles in space by a plane."""
    above = vertices[:, plane.axis] > plane.level
    places = np.flatnonzero((above[faces] != above[faces[:, :1]]).any(axis=1))
    corners = faces[places]
    is_up = above[corners].sum(axis=1) == 1
    alone = np.where(is_up, above[corners].argmax(axis=1), above[corners].argmin(axis=1))
    rows = np.arange(len(places))
    apex, after, before = (corners[rows, (alone + turn) % 3] for turn in range(3))
    is_right_handed = plane.across[0] == (plane.axis + 1) % 3
    is_first = is_up != is_right_handed
    sides = [np.stack([apex, np.where(is_first, *pair)], axis=1) for pair in ((before, after), (after, before))]
    edges, ends = np.unique(np.sort(np.concatenate(sides), axis=1), axis=0, return_inverse=True)
    low, high = vertices[edges[:, 0]], vertices[edges[:, 1]]
    share = (plane.level - low[:, plane.axis]) / (high[:, plane.axis] - low[:, plane.axis])
    points = low + share[:, None] * (high - low)
    return Cut(points[:, plane.across], ends.reshape(2, -1).T, places)


def loops_of(segments: Ints) -> list[list[int]]:
    """Closed loops of segments (f, 2), each as the places that it passes."""
    following: dict[int, list[int]] = {}
    for start, end in segments.tolist():
        following.setdefault(start, []).append(end)
    loops = []
    while following:
        start = next(iter(following))
        loop, here = [], start
        while here in following:
            loop.append(here)
            after = following[here].pop()
            if not following[here]:
                del following[here]
            here = after
        loops.append(loop)
    return loops


def stretches_of(loop: list[int], group_of: dict[tuple[int, ...], int]) -> Iterator[tuple[int, list[int]]]:
    """The stretches of a loop that are of one group, each with the places that it passes, its end included."""
    ends = [*loop[1:], loop[0]]
    groups = [group_of[pair] for pair in zip(loop, ends, strict=True)]
    first = next((k for k in range(len(loop)) if groups[k] != groups[k - 1]), 0)
    order = [(first + k) % len(loop) for k in range(len(loop))]
    for group, members in groupby(order, key=groups.__getitem__):
        places = list(members)
        yield group, [*(loop[place] for place in places), ends[places[-1]]]


def area_of(loops: list[Floats]) -> Any:
    """The area within loops (n, 2) each, as a path of matplotlib's; None if there are none."""
    from matplotlib.path import Path

    if not loops:
        return None
    ends = [np.vstack([loop, loop[:1]]) for loop in loops]
    codes = [[Path.MOVETO, *[Path.LINETO] * (len(end) - 2), Path.CLOSEPOLY] for end in ends]
    return Path(np.concatenate(ends), np.concatenate(codes))


def draw_slice(
    panel: Any, region: Region, plane: Plane, look: Look, place: Ints | None = None, colours: Any = ()
) -> Any:
    """Draw where a plane cuts the border, filled within; returns the area within, a path, or None.

    Parameters
    ----------
    place, colours : the group of each limit, and the colour of each group; default: one thin line in soft colour.
    """
    from matplotlib.patches import PathPatch

    cut = cut_mesh(region.vertices, region.faces, plane)
    points = cut.points * np.array(for_people(region.units)[0])[plane.across]
    loops = loops_of(cut.segments)
    area = area_of([points[loop] for loop in loops])
    groups = np.zeros(len(cut.faces), np.int64) if place is None else place[region.face_limit[cut.faces]]
    group_of = dict(zip(map(tuple, cut.segments.tolist()), groups.tolist(), strict=True))
    for loop in loops:
        for group, corners in stretches_of(loop, group_of | _steadied(loop, group_of, points)):
            style = {"color": look.soft, "linewidth": 0.8} if place is None else {"color": colours[group]}
            panel.plot(*points[corners].T, **({"linewidth": BORDER, "solid_capstyle": "round", "zorder": 3} | style))
    if area is not None:
        panel.add_patch(PathPatch(area, facecolor=look.within, edgecolor="none", zorder=0))
    _dress_panel(panel, region, plane, look)
    return area


def _steadied(loop: list[int], group_of: dict[tuple[int, ...], int], points: Floats) -> dict[tuple[int, ...], int]:
    """The groups of the segments of a loop, each that of most of those around it: along a seam, faces alternate."""
    pairs = list(zip(loop, [*loop[1:], loop[0]], strict=True))
    groups = np.array([group_of[pair] for pair in pairs])
    lengths = np.linalg.norm(points[[end for _, end in pairs]] - points[loop], axis=1)
    best, most = groups, np.zeros(len(loop))
    for group in np.unique(groups).tolist():
        of_group = lengths * (groups == group)
        around = np.sum([np.roll(of_group, shift) for shift in range(-AROUND, AROUND + 1)], axis=0)
        best, most = np.where(around > most, group, best), np.maximum(around, most)
    return dict(zip(pairs, best.tolist(), strict=True))


def _dress_panel(panel: Any, region: Region, plane: Plane, look: Look) -> None:
    """Name the axes of a slice, and its level above it."""
    names, factor = labels(region), for_people(region.units)[0][plane.axis]
    first, second = plane.across
    dress(panel, look)
    ends = region.bounds[:, plane.across] * np.array(for_people(region.units)[0])[plane.across]
    room = 0.06 * np.ptp(ends, axis=0)
    panel.set(xlim=(ends[0, 0] - room[0], ends[1, 0] + room[0]), ylim=(ends[0, 1] - room[1], ends[1, 1] + room[1]))
    if region.units[first] == region.units[second]:
        panel.set_aspect("equal")
    name, _, unit = names[plane.axis].rpartition(" ")
    number = f"{plane.level * factor + 0.0:.3g}".replace("-", "\N{MINUS SIGN}")
    panel.set_title(f"{name} = {number} {unit.strip('[]')}", fontsize=SMALL, pad=2.0)
    panel.set_xlabel(names[first], fontsize=SMALL, labelpad=1.0)
    panel.set_ylabel(names[second], fontsize=SMALL, labelpad=1.0)
    panel.tick_params(labelsize=SMALL - 1.0, length=2.0)
    panel.apply_aspect()
    box, dpi = panel.get_window_extent(), panel.get_figure(root=True).dpi
    panel.set_xticks(round_ticks(panel.get_xlim(), box.width * 72.0 / dpi, ACROSS))
    panel.set_yticks(round_ticks(panel.get_ylim(), box.height * 72.0 / dpi, UP))
    panel.spines[["top", "right"]].set_visible(False)


def edges_of(shape: Inscribed) -> list[Floats]:
    """The edges of a shape in space: lines (n, 3) each; of a sphere, three great circles."""
    turn = np.linspace(0.0, 2.0 * np.pi, ROUND + 1)
    circle = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    if shape.kind == "box":
        corners = 2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1.0
        lines = [np.stack([corner, corner * (1.0 - 2.0 * along)]) for corner in corners for along in np.eye(3)]
        lines = [line for line in lines if line[0].sum() < line[1].sum()]
    elif shape.kind == "cylinder":
        lines = [circle + [0.0, 0.0, end] for end in (-1.0, 1.0)]
    else:
        lines = [np.roll(circle, k, axis=1) for k in range(3)]
    return [shape.centre + 0.5 * shape.extents * line for line in lines]


def outline_of(shape: Inscribed, plane: Plane | None = None) -> Floats:
    """The outline of a shape in a plane, or where a plane cuts one in space: points (n, 2); none where it does not."""
    half, turn = 0.5 * shape.extents, np.linspace(0.0, 2.0 * np.pi, ROUND + 1)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    if plane is None:
        return np.asarray(shape.centre + half * (square if shape.kind == "box" else circle))
    height = abs(plane.level - shape.centre[plane.axis]) / half[plane.axis]
    if height >= 1.0:
        return np.zeros((0, 2))
    chord = np.sqrt(1.0 - height**2)
    if shape.kind == "box":
        line = square
    elif shape.kind == "cylinder":
        line = circle if plane.axis == 2 else square * np.where(np.array(plane.across) == 2, 1.0, chord)
    else:
        line = circle * chord
    return np.asarray(shape.centre[plane.across] + half[plane.across] * line)
