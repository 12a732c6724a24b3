"""Workspaces in space as an eye sees them: the limit, depth and slope of each pixel, in the light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..capabilities.workspace.surface import face_normals
from ..common.arrays import Floats, Ints, Mask
from .eye import USUAL, Eye, best_of
from .raster import (
    Raster,
    counted_around,
    greatest_around,
    lines_between,
    most_around,
    near_changes,
    rasterised,
    spread,
)

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

NEAR = 1.5
"""Distance from a line within which pixels ask for their limit: marching cubes cuts edges by up to a cell [cells]."""

REACH, POINTS, HALVINGS = 1.6, 7, 4
"""Of the ray of a pixel: how far before and behind the mesh points are asked [cells], how many, and how often the step
that the border is in is halved."""

GRAZES, GOLDEN = 4, 0.618
"""How often a ray that meets nothing is asked in between, where the margin is greatest: it may graze an edge; and where
in the stretch that is left, as a share of it."""

SLOPE = 0.1
"""Step in which slopes are measured [cells]."""

STRIDES = 2
"""Pixels that are asked first, to the width in which any are: those between four of one limit are filled."""

FEW, VOTES, ROUNDS = 2, 3, 8
"""Without margins: pixels around each, at least, that its limit is the most frequent of; how often, and how often
normals are averaged, for the mesh is rough there."""

STEEPEST = 4.0
"""Slope towards the eye beyond which a pixel is behind those around it."""

JUMP, JUMP_PIXELS = 3.0, 8.0
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
        labels = self.limit if is_told_apart(self.region) else np.minimum(self.limit, 0)
        return lines_between(labels, self.raster, max(JUMP * self.step, JUMP_PIXELS * self.raster.pixel), self.depth)

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
    seen = eye.seen(points)
    span = float(np.ptp(seen[:, 0]))
    margin = int(np.ceil(NEAR * step / max(span, step) * across)) + 3
    raster = rasterised(seen, region.faces, across + 2 * margin, margin)
    limit = np.where(raster.face >= 0, region.face_limit[raster.face], -1)
    if region._question.has_margins:
        normals = corner_normals(points, region.faces, region.face_limit)
    else:
        normals = corner_normals(points, region.faces, rounds=ROUNDS)
    normal = (raster.weights[..., None] * normals[raster.face]).sum(axis=2)
    solid = SeenSolid(region, eye, raster, scale, step, limit, raster.depth.copy(), _units(normal))
    if region._question.has_margins:
        _sharpen(solid)
    else:
        for _ in range(VOTES):
            limit[:] = most_around(limit, max(FEW, int(step / raster.pixel)))
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


def _sharpen(solid: SeenSolid) -> None:
    """Ask the pixels near lines where their rays meet the border: first a few, then those between that differ."""
    limit, wide = solid.limit, int(np.ceil(NEAR * solid.step / solid.raster.pixel)) + 1
    stride = 1 << int(np.log2(max(wide // STRIDES, 1)))
    guess = spread(solid.raster.depth, wide + stride, stride)
    is_far = greatest_around(guess, wide) > guess + STEEPEST * wide * solid.raster.pixel
    nearest = spread(np.where(is_far, -np.inf, guess), wide, stride)
    is_open, is_asked = near_changes(limit, wide) & np.isfinite(guess), np.zeros(limit.shape, bool)
    while is_open.any():
        nodes = np.zeros(limit.shape, bool)
        nodes[::stride, ::stride] = True
        nodes &= (counted_around(is_open, stride) > 0) & np.isfinite(guess) & ~is_asked
        _ask(solid, np.flatnonzero(nodes), guess, nearest)
        is_asked |= nodes
        is_open &= ~is_asked
        if stride > 1:
            is_open &= ~_fill_between(solid, is_open, stride)
        stride //= 2


def _fill_between(solid: SeenSolid, asked: Mask, stride: int) -> Mask:
    """Fill pixels between four nodes, so many pixels apart, of one limit; the mask of the pixels that were."""
    rows, columns = np.nonzero(asked)
    (row, down), (column, right) = np.divmod(rows, stride), np.divmod(columns, stride)
    n_rows, n_columns = solid.limit[::stride, ::stride].shape
    inner = (row + 1 < n_rows) & (column + 1 < n_columns)
    rows, columns, row, column, down, right = (each[inner] for each in (rows, columns, row, column, down, right))
    nodes = [(row + a, column + b) for a in (0, 1) for b in (0, 1)]
    labels, depths, normals = (
        np.stack([image[::stride, ::stride][node] for node in nodes])
        for image in (solid.limit, solid.depth, solid.normal)
    )
    alike = (labels == labels[0]).all(axis=0)
    filled = np.zeros(asked.shape, bool)
    beside = alike & (labels[0] < 0) & (solid.limit[rows, columns] < 0)  # nothing is there
    filled[rows[beside], columns[beside]] = True
    alike &= labels[0] >= 0
    alike &= np.ptp(np.where(alike, depths, 0.0), axis=0) < max(JUMP * solid.step, JUMP_PIXELS * solid.raster.pixel)
    down, right = down[alike] / stride, right[alike] / stride
    shares = np.stack([(1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right])
    at = rows[alike], columns[alike]
    solid.limit[at] = labels[0, alike]
    solid.depth[at] = (shares * depths[:, alike]).sum(axis=0)
    solid.normal[at] = _units((shares[..., None] * normals[:, alike]).sum(axis=0))
    filled[at] = True
    return filled


def _ask(solid: SeenSolid, pixels: Ints, guess: Floats, nearest: Floats) -> None:
    """Ask the rays of pixels, (n,), where the nearest part around them is; where they meet nothing there, behind it."""
    covered = pixels[(nearest > guess).reshape(-1)[pixels]]
    rest = np.ones(solid.limit.size, bool)
    rest[_find(solid, covered, nearest)] = False
    _find(solid, pixels[rest[pixels]], guess)


def _find(solid: SeenSolid, pixels: Ints, guess: Floats) -> Ints:
    """Find where rays enter the border near a guess of the depth, and what limit is outside; the pixels where it is."""
    axes, reach = solid.eye.axes, REACH * solid.step
    base = solid.raster.centres(pixels) @ axes[:2] + guess.reshape(-1, 1)[pixels] * axes[2]
    shares = np.linspace(reach, -reach, POINTS)
    margins, bindings = _measured(solid, base[:, None] + shares[:, None] * axes[2])
    inside = margins >= 0.0
    first = inside.argmax(axis=1)
    low, high = shares[first], shares[np.maximum(first - 1, 0)]
    limit = bindings[np.arange(len(first)), np.maximum(first - 1, 0)]
    is_hit = inside.any(axis=1) & ~inside[:, 0]
    missed = np.flatnonzero(~inside.any(axis=1))
    low[missed], high[missed], limit[missed], is_hit[missed] = _grazed(solid, base[missed], margins[missed], shares)
    hit = np.flatnonzero(is_hit)
    low, high, limit, base = low[hit], high[hit], limit[hit], base[hit]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        margin, binding = _measured(solid, base + middle[:, None] * axes[2])
        is_within = margin >= 0.0
        limit = np.where(is_within, limit, binding)
        low, high = np.where(is_within, middle, low), np.where(is_within, high, middle)
    at = base + low[:, None] * axes[2]
    beside = at[:, None] + SLOPE * solid.step * np.concatenate([np.zeros((1, 3)), np.eye(3)])
    margins, _ = _measured(solid, beside)
    with np.errstate(invalid="ignore"):  # infinite where a leg does not reach
        slope = margins[:, :1] - margins[:, 1:]
    is_named, is_steep = limit >= 0, np.isfinite(slope).all(axis=1) & (slope != 0.0).any(axis=1)
    solid.limit.reshape(-1)[pixels[hit[is_named]]] = limit[is_named]
    solid.depth.reshape(-1)[pixels[hit]] = guess.reshape(-1)[pixels[hit]] + low
    solid.normal.reshape(-1, 3)[pixels[hit[is_steep]]] = _units(slope[is_steep])
    return pixels[hit]


def _grazed(solid: SeenSolid, base: Floats, margins: Floats, shares: Floats) -> tuple[Floats, Floats, Ints, Mask]:
    """Look on rays without a point within for one between the points: inside, before it, the limit there, the mask."""
    best = margins.argmax(axis=1)
    rows = np.flatnonzero((best > 0) & (best < POINTS - 1))  # else the ray is still on its way
    best = np.clip(best, 1, POINTS - 2)
    near, far = shares[best - 1], shares[best + 1]
    before, limit = near.copy(), np.full(len(base), -1)
    inside, is_hit = np.full(len(base), np.nan), np.zeros(len(base), bool)
    for _ in range(GRAZES):
        if not len(rows):
            break
        tried = near[rows, None] + np.array([1.0 - GOLDEN, GOLDEN]) * (far - near)[rows, None]
        margin, binding = _measured(solid, base[rows, None] + tried[..., None] * solid.eye.axes[2])
        is_within = margin >= 0.0
        hit, first = is_within.any(axis=1), is_within.argmax(axis=1)
        at = np.flatnonzero(hit)
        inside[rows[at]], is_hit[rows[at]] = tried[at, first[at]], True
        before[rows[at]] = np.where(first[at] == 1, tried[at, 0], near[rows[at]])
        is_nearer = margin[:, 0] >= margin[:, 1]
        far[rows] = np.where(is_nearer, tried[:, 1], far[rows])
        near[rows] = np.where(is_nearer, near[rows], tried[:, 0])
        limit[rows] = binding[:, 0]
        rows = rows[~hit]
    return inside, before, limit, is_hit


def _measured(solid: SeenSolid, points: Floats) -> tuple[Floats, Ints]:
    """Margins and limits (...) of points of space (..., 3)."""
    margins, bindings = solid.region._question.measure(points.reshape(-1, 3) / solid.scale)
    return margins.reshape(points.shape[:-1]), bindings.reshape(points.shape[:-1])


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
