"""Workspaces in space as an eye sees them: the limit, depth and slope of each pixel, in the light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..capabilities.workspace.surface import face_normals
from ..common.arrays import Floats, Ints, Mask
from .eye import USUAL, Eye, best_of
from .raster import Raster, counted_around, lines_between, most_around, rasterised

if TYPE_CHECKING:
    from ..capabilities.workspace.region import Region

ELEVATIONS = (20.0, 30.0, 40.0)
"""Elevations that are tried for a solid [deg]."""

SPREAD, TURN = 1.0, 0.1
"""Weights of how much the slopes seen differ, and of the turn from the usual azimuth [1/rad], against the sum of the
roots of the share of the picture that each limit has."""

JUDGED, CELLS = 6000, 40
"""Faces that directions are judged by, and cells across the picture that hide each other."""

SPAN = 100.0
"""Size of the box of a workspace whose coordinates have different units: then each has this span."""

VOTES, ROUNDS = 3, 8
"""Without margins, where the mesh is rough: how often each pixel takes the limit that is the most frequent of a cell
around it, and how often normals are averaged. With margins once does."""

TOOTH, SMOOTH = 0.5, 2.0
"""Cells around a pixel most of which are covered, or it is none of the solid's: marching cubes leave teeth on edges.
Cells that lines are smoothed along."""

COARSE = 10.0
"""Size of a cell from which on its edges are seen as they are [pixels]."""

JUMP, JUMP_PIXELS = 3.0, 24.0
"""Least difference in depth of a line where a solid hides itself [cells, pixels]."""

LIGHT = (-0.42, 0.50, 0.80)
"""Where the light is, to the right, up and towards the eye."""


@dataclass(frozen=True, eq=False)
class SeenSolid:
    """A solid in space as an eye sees it.

    Attributes
    ----------
    scale : from coordinates [length or rad] to those of space, (3,): 1 where all have one unit.
    step : size of its cells, in space.
    limit : which of the region's limits each pixel shows, (rows, columns); -1 where it shows none.
    depth : towards the eye, (rows, columns).
    normal : outward, (rows, columns, 3).
    """

    region: Region
    eye: Eye
    raster: Raster
    scale: Floats
    step: float
    limit: Ints
    depth: Floats
    normal: Floats

    @property
    def lines(self) -> list[Floats]:
        """Lines between limits, and around what hides what is behind it, (n, 2) each."""
        labels, parted = self.limit, self.region.face_limit[self.raster.face]
        if not is_told_apart(self.region):
            labels, parted = np.minimum(labels, 0), np.minimum(parted, 0)
        jump = max(JUMP * self.step, JUMP_PIXELS * self.raster.pixel)
        return lines_between(labels, self.raster, jump, SMOOTH * self.cell, parted)

    @property
    def cell(self) -> float:
        """Size of a cell as far as it is smoothed away [pixels]."""
        return min(self.step / self.raster.pixel, COARSE)

    def hides(self, points: Floats) -> Mask:
        """Mask (n,) of points in space (n, 3) that are within the solid, or behind it."""
        seen = self.eye.seen(points)
        pixels, is_within = self.raster.pixels(seen)
        return np.asarray(is_within & (self.limit[pixels] >= 0) & (self.depth[pixels] > seen[:, 2] + 0.3 * self.step))


def is_told_apart(region: Region) -> bool:
    """False if several limits bind at once on the border, of which one is named: with any orientation, or several."""
    return region._question.hold == "orientation" and len(region._question.turns) == 1


def scale_of(region: Region) -> Floats:
    """Factors (3,) from coordinates to a space in which a solid is drawn."""
    spans = np.ptp(region.bounds, axis=0)
    return np.ones(3) if len(set(region.units)) == 1 else SPAN / np.where(spans > 0.0, spans, 1.0)


def seen_solid(region: Region, eye: Eye, across: int) -> SeenSolid:
    """A workspace as an eye sees it.

    Parameters
    ----------
    across : pixels from its left to its right end.
    """
    scale = scale_of(region)
    points, step = region.vertices * scale, float((region.resolution * scale).max())
    raster = rasterised(eye.seen(points), region.faces, across)
    limit = np.where(raster.face >= 0, region.face_limit[raster.face], -1)
    has_margins = region._question.has_margins
    labels, rounds, votes = (region.face_limit, 1, 1) if has_margins else (None, ROUNDS, VOTES)
    normals = corner_normals(points, region.faces, labels, rounds)
    normal = _units((raster.weights[..., None] * normals[raster.face]).sum(axis=2))
    solid = SeenSolid(region, eye, raster, scale, step, limit, raster.depth, normal)
    wide = int(TOOTH * solid.cell)
    limit[2 * counted_around(limit >= 0, wide) < (2 * wide + 1) ** 2] = -1
    for _ in range(votes):
        limit[:] = most_around(limit, max(1, int(solid.cell)))
    return solid


def _units(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def corner_normals(points: Floats, faces: Ints, labels: Ints | None = None, rounds: int = 1) -> Floats:
    """Normals at the corners of faces (f, 3, 3), each the mean of those of one label around it, so many times."""
    flat = face_normals(points[faces])
    keys = faces if labels is None else faces * (int(labels.max()) + 1) + labels[:, None]
    place = np.unique(keys, return_inverse=True)[1].reshape(faces.shape)
    for _ in range(rounds):
        sums = [np.bincount(place.ravel(), np.repeat(column, 3)).astype(np.float64) for column in flat.T]
        normals = _units(np.stack(sums, axis=1))
        flat = np.asarray(normals[place].mean(axis=1))
    return np.asarray(normals[place])


def in_the_light(normal: Floats, eye: Eye, colours: Floats) -> Floats:
    """Colours (..., 3) of surfaces with outward normals (..., 3), with light from the upper left of the eye."""
    right, up, towards = eye.axes
    light = np.array(LIGHT) @ [right, up, towards]
    bright = np.clip(normal @ (light / np.linalg.norm(light)), 0.0, 1.0)[..., None]
    facing = np.clip(normal @ towards, 0.0, 1.0)[..., None]
    shaded = (0.88 * colours + 0.12) * (0.58 + 0.34 * bright + 0.08 * facing)
    return np.asarray(np.clip(shaded + (1.0 - shaded) * 0.22 * bright**2, 0.0, 1.0))


class PickedFaces(NamedTuple):
    """Some faces of a solid: their middles (n, 3), normals (n, 3), and labels (n,)."""

    middles: Floats
    normals: Floats
    labels: Ints

    def seen(self, eye: Eye) -> Ints:
        """The places of the faces that an eye sees."""
        flat = eye.seen(self.middles)
        cell = np.floor((flat[:, :2] - flat[:, :2].min(axis=0)) / (np.ptp(flat[:, :2]) / CELLS + 1e-300)).astype(int)
        key = cell @ [2 * CELLS, 1]
        order = np.lexsort((flat[:, 2], key))
        nearest = order[np.append(key[order][1:] != key[order][:-1], True)]
        return np.asarray(nearest[self.normals[nearest] @ eye.axes[2] > 0.0])

    def shares(self, eye: Eye, place: Ints) -> Floats:
        """The share of what is seen that each group has, by the place of each label's group."""
        groups = place[self.labels[self.seen(eye)]]
        return np.bincount(groups, minlength=place.max() + 1) / max(len(groups), 1)


def picked_faces(points: Floats, faces: Ints, labels: Ints) -> PickedFaces:
    """Faces picked at random, that directions are judged by."""
    chosen = np.random.default_rng(0).permutation(len(faces))[:JUDGED]
    corners = points[faces[chosen]]
    return PickedFaces(corners.mean(axis=1), _units(face_normals(corners)), labels[chosen])


def best_eye(sample: PickedFaces, order: tuple[int, int, int]) -> Eye:
    """The eye that shows most of a solid: of each label, and of different slopes, not far from the usual direction."""
    return best_of(ELEVATIONS, -170.0, lambda eye: _score(eye, sample), order)


def _score(eye: Eye, sample: PickedFaces) -> float:
    seen = sample.seen(eye)
    if not len(seen):
        return -np.inf
    shares = np.bincount(sample.labels[seen]) / len(seen)
    slopes = 1.0 - float(np.linalg.norm(sample.normals[seen].mean(axis=0)))
    turn = abs(np.radians((eye.azimuth - USUAL[1] + 180.0) % 360.0 - 180.0))
    return float(np.sqrt(shares).sum()) + SPREAD * slopes - TURN * float(turn)
