"""Meshes as images of their faces, seen by an orthographic eye, and lines along the sides of pixels."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Floats, Ints, Mask
from .crossings import cross

TALLEST = 1.5
"""Most pixels from below to above, as a multiple of those across."""

FLAT = 1e-12
"""Area below which a face is seen on its edge [pixels²]."""

STEEPER = 4.0
"""Factor by which a jump in depth exceeds the steps beside it, at least: else it is a slope."""

SMOOTHINGS, SPECK = 30, 7
"""Times at least that corners of a line are moved towards their neighbours. Sides below which a line is a speck, if it
is a loop or ends in nothing."""

Node: TypeAlias = tuple[int, int]


class Raster(NamedTuple):
    """The nearest face in each pixel. Row 0 is the lowest.

    Attributes
    ----------
    face : (rows, columns); -1 where there is none.
    depth : towards the eye, (rows, columns); -inf where there is no face.
    weights : of the corners of the face, (rows, columns, 3).
    low : the centre of the first pixel, (2,).
    pixel : the distance of centres.
    """

    face: Ints
    depth: Floats
    weights: Floats
    low: Floats
    pixel: float

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, lower and upper edge."""
        low = self.low - 0.5 * self.pixel
        rows, columns = self.face.shape
        high = low + self.pixel * np.array([columns, rows])
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])

    def pixels(self, seen: Floats) -> tuple[tuple[Ints, Ints], Mask]:
        """Rows and columns of points (n, 2 or more), and the mask of those within the image; others are moved to it."""
        column, row = np.round((seen[:, :2] - self.low) / self.pixel).astype(np.int64).T
        rows, columns = self.face.shape
        within = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        return (np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)), within

    def mask_of(self, seen: Floats) -> Mask:
        """The mask of the pixels that points (n, 2 or more) are in; those that are NaN are in none."""
        mask = np.zeros(self.face.shape, bool)
        pixels, is_within = self.pixels(seen[np.isfinite(seen[:, 0])])
        mask[pixels[0][is_within], pixels[1][is_within]] = True
        return mask


def rasterised(seen: Floats, faces: Ints, width: int, margin: int = 2, *, both_sides: bool = False) -> Raster:
    """Draw triangles, as an eye sees them, into an image.

    Parameters
    ----------
    seen : vertices to the right, up, and towards the eye, (v, 3).
    faces : places of vertices, (f, 3), right-handed as seen from outside.
    width : pixels across.
    margin : free pixels around all faces.
    both_sides : True to draw faces that turn away from the eye too: those of a mesh that is not closed.
    """
    from PIL import Image, ImageDraw

    used = seen[np.unique(faces), :2]
    low, span = used.min(axis=0), np.ptp(used, axis=0)
    pixel = float(max(span[0], span[1] / TALLEST)) / max(width - 2 * margin - 1, 1)
    columns, rows = (np.ceil(span / pixel).astype(np.int64) + 2 * margin + 1).tolist()
    low = low - margin * pixel
    placed = np.concatenate([(seen[:, :2] - low) / pixel, seen[:, 2:]], axis=1)
    a, b, c = (placed[faces[:, k], :2] for k in range(3))
    area = cross(b - a, c - a)  # twice that on the screen; negative where a face turns away
    drawn = np.flatnonzero((np.abs(area) if both_sides else area) > FLAT)
    corners, area = placed[faces[drawn]], area[drawn]
    image = Image.new("I", (columns, rows), -1)
    polygon = ImageDraw.Draw(image).polygon
    order, nodes = corners[:, :, 2].sum(axis=1).argsort(), np.round(corners[:, :, :2]).reshape(-1, 6)
    for number, xy in zip(order.tolist(), nodes[order].tolist(), strict=True):  # far to near
        polygon(xy, fill=number)
    face = np.array(image, dtype=np.int64)
    depth, weights = np.full((rows, columns), -np.inf), np.zeros((rows, columns, 3))
    row, column = np.nonzero(face >= 0)
    shown = face[row, column]
    shares = np.clip(
        _weights(corners[shown], area[shown], np.stack([column, row], axis=1)), 0.0, 1.0
    )  # sides on pixels
    weights[row, column] = shares / shares.sum(axis=1, keepdims=True)
    depth[row, column] = (weights[row, column] * corners[shown, :, 2]).sum(axis=1)
    face[row, column] = drawn[shown]
    return Raster(face, depth, weights, low, pixel)


def _weights(corners: Floats, area: Floats, at: NDArray[Any]) -> Floats:
    """Barycentric coordinates (..., 3) of pixels (..., 2) in triangles (..., 3, 3) of an area (...)."""
    away = at - corners[..., 0, :2]
    second = cross(away, corners[..., 2, :2] - corners[..., 0, :2]) / area
    third = cross(corners[..., 1, :2] - corners[..., 0, :2], away) / area
    return np.stack([1.0 - second - third, second, third], axis=-1)


def counted_around(mask: Mask, wide: int, tall: int | None = None) -> Ints:
    """The number of pixels of a mask within so many columns and rows of each."""
    total = mask.astype(np.int64)
    for axis, reach in ((0, wide if tall is None else tall), (1, wide)):
        padding = [(reach + 1, reach) if k == axis else (0, 0) for k in (0, 1)]
        total = np.cumsum(np.pad(total, padding), axis=axis)
        places, window = np.arange(mask.shape[axis]), 2 * reach + 1
        total = np.take(total, places + window, axis) - np.take(total, places, axis)
    return total


def most_around(labels: Ints, wide: int) -> Ints:
    """The label that most pixels around each have, of pixels that have one."""
    best, most = labels, np.zeros(labels.shape, np.int64)
    for label in np.unique(labels[labels >= 0]).tolist():
        count = counted_around(labels == label, wide)
        best, most = np.where(count > most, label, best), np.maximum(count, most)
    return np.where(labels >= 0, best, labels)


def lines_between(
    labels: Ints, raster: Raster, jump: float, smooth: float = 0.0, parted: Ints | None = None
) -> list[Floats]:
    """Smooth lines (n, 2) where labels differ, and where one part hides another that is farther away.

    Parameters
    ----------
    labels : (rows, columns); -1 where there is nothing.
    jump : least difference of depths where one part hides another.
    smooth : how far along lines they are smoothed [pixels].
    parted : other labels (rows, columns), between which no part hides another: their line is among those of the labels.
    """
    far = np.where(labels >= 0, raster.depth, 0.0)
    one = labels if parted is None else parted
    upright = (labels[:, 1:] != labels[:, :-1]) | (_is_jump(far, jump) & (one[:, 1:] == one[:, :-1]))
    level = (labels[1:] != labels[:-1]) | (_is_jump(far.T, jump).T & (one[1:] == one[:-1]))
    around: dict[Node, list[Node]] = {}
    for sides, down, right in ((upright, 1, 0), (level, 0, 1)):
        for row, column in (np.argwhere(sides) + [right, down]).tolist():
            first, second = (row, column), (row + down, column + right)
            around.setdefault(first, []).append(second)
            around.setdefault(second, []).append(first)
    rounds = max(SMOOTHINGS, int(smooth**2))
    lines = []
    for chain in _chains(around):
        is_closed, ends = chain[0] == chain[-1], [len(around[chain[place]]) for place in (0, -1)]
        if len(chain) >= SPECK or not (is_closed or 1 in ends):
            lines.append(_smoothed(chain, rounds, is_loop=is_closed and ends[0] == 2))
    return [raster.low + raster.pixel * (line[:, ::-1] - 0.5) for line in lines]


def _is_jump(depth: Floats, jump: float) -> Mask:
    """Mask (rows, columns - 1) of steps along rows that are no slopes: far greater than both steps beside them."""
    steps = np.abs(np.diff(depth, axis=1))
    beside = np.pad(steps, [(0, 0), (1, 1)])
    return np.asarray((steps > jump) & (steps > STEEPER * np.maximum(beside[:, :-2], beside[:, 2:])))


def _chains(around: dict[Node, list[Node]]) -> Iterator[list[Node]]:
    """The lines of a graph from junction to junction, then its loops."""
    used: set[frozenset[Node]] = set()
    junctions = [node for node, beside in around.items() if len(beside) != 2]
    for start in (*junctions, *around):
        for after in around[start]:
            if frozenset((start, after)) in used:
                continue
            chain = [start, after]
            used.add(frozenset(chain))
            while len(around[chain[-1]]) == 2 and chain[-1] != start:
                ahead = next(node for node in around[chain[-1]] if node != chain[-2])
                used.add(frozenset((chain[-1], ahead)))
                chain.append(ahead)
            yield chain


def _smoothed(chain: list[Node], rounds: int, *, is_loop: bool) -> Floats:
    """The corners (n, 2) of a line with each moved towards its neighbours, so often; its ends stay."""
    line = np.array(chain, float)
    for _ in range(rounds):
        if is_loop:
            line[:-1] = 0.25 * np.roll(line[:-1], 1, axis=0) + 0.5 * line[:-1] + 0.25 * np.roll(line[:-1], -1, axis=0)
            line[-1] = line[0]
        elif len(line) > 2:
            line[1:-1] = 0.25 * line[:-2] + 0.5 * line[1:-1] + 0.25 * line[2:]
    return line
