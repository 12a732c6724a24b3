"""Refines a coarse grid towards the border: cells are divided where the border may be."""

from __future__ import annotations

from typing import NamedTuple, NoReturn

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from ...errors import InvalidArgument
from .lattice_points import MIDDLE, Lattice, Numbering, codes, corners, offsets, places_of

GROWS = 0.5
"""Share of its size by which a box grows to a side that the workspace touches."""

HORIZON = 24
"""Factor by which the grid may exceed its first extent before a workspace counts as unbounded."""

MORE = 16
"""Factor by which a finer grid may have more points than the first, if that found nothing within reach."""

SPREAD = 0.5
"""Share of the spread of margins at a cell's corners below which the smallest suggests a border within the cell."""

THIN = 4
"""Width in steps of the smallest cells that are searched for a border that shows at no corner."""


GUESSED = 0.7
"""Radius of a workspace that is taken for progress until its first cells are known [L or rad]."""


class Cells(NamedTuple):
    """Cells of one size.

    Attributes
    ----------
    codes : of their lowest corners, (n,).
    width : in steps of the lattice.
    corners : numbers of the lattice points at all corners, (n, 2^d).
    margins : the margins there, (n, 2^d).
    """

    codes: Ints
    width: int
    corners: Ints
    margins: Floats

    @property
    def touched(self) -> Mask:
        """Mask of the cells with some corner within reach."""
        return np.asarray((self.margins >= 0.0).any(axis=1))

    @property
    def inside(self) -> Mask:
        """Mask of the cells with all corners within reach."""
        return np.asarray((self.margins >= 0.0).all(axis=1))

    @property
    def thin(self) -> Mask:
        """Mask of the cells that the border may enter and leave between corners: margins fall fast enough."""
        if self.width < THIN:
            return np.zeros(len(self.codes), bool)
        with np.errstate(invalid="ignore"):
            spread = self.margins.max(axis=1) - self.margins.min(axis=1)
            near = np.abs(self.margins).min(axis=1) < SPREAD * spread
        return np.asarray(near & np.isfinite(spread))

    def at(self, which: Mask) -> Cells:
        return Cells(self.codes[which], self.width, self.corners[which], self.margins[which])


class Refined(NamedTuple):
    """Cells at the border, the smallest, and cells all within, of any size."""

    border: Cells
    within: tuple[Cells, ...]


def refined(lattice: Lattice, levels: int, reach: int) -> Refined:
    """Find the border.

    Parameters
    ----------
    levels : how often the first cells are halved.
    reach : number of the first cells to each side of the start in the first grid.
    """
    progress = lattice.measure.progress
    progress.begin((2 * reach + 1) ** lattice.d, _guessed_cells(lattice, levels), levels)
    cells = _first(lattice, levels, reach)
    within: list[Cells] = []
    while True:
        cells = _with_neighbours(lattice, cells.at(cells.touched | cells.thin))
        inside = cells.inside
        crossed = cells.touched & ~inside
        divided = ~inside
        divided[inside] = cells.at(inside).thin
        _report(lattice, cells, int(crossed.sum()), int(divided.sum()))
        if cells.width == 1:
            return Refined(cells.at(crossed), (*within, cells.at(inside)))
        within.append(cells.at(~divided))
        cells = _divided(lattice, cells.at(divided))


def _guessed_cells(lattice: Lattice, levels: int) -> float:
    """The number of the first cells at the border of a workspace that is a ball of `GUESSED` size."""
    radius = GUESSED / float((2**levels * lattice.step / lattice.measure.question.lengths).max())
    return 2.0 * np.pi * radius if lattice.d == 2 else 4.0 * np.pi * radius**2


def _report(lattice: Lattice, cells: Cells, crossed: int, divided: int) -> None:
    """Report how many cells are at the border, and are to be halved at this level and those ahead."""
    halved, growth, width = [float(divided)], 1 << (lattice.d - 1), cells.width
    while width > 2:
        width //= 2
        halved.append(halved[-1] * growth if width >= THIN else crossed * growth ** len(halved))
    halvings = 0
    if crossed and lattice.measure.fewest:
        halvings = lattice.measure.halvings(np.maximum(np.ptp(places_of(cells.codes, lattice.d), axis=0), 1.0))
    lattice.measure.progress.expect(crossed, halved if cells.width > 1 else [], halvings)


def _first(lattice: Lattice, levels: int, reach: int) -> Cells:
    """Cells over a box whose faces are out of reach; smaller cells if the first have no corner within reach."""
    most = MORE * (2 * reach + 1) ** lattice.d
    while True:
        cells = _box(lattice, 1 << levels, reach)
        if not levels or (cells.margins >= 0.0).any() or cells.corners.size > most:
            return cells
        levels, reach = levels - 1, 2 * reach


def _box(lattice: Lattice, width: int, reach: int) -> Cells:
    d, question = lattice.d, lattice.measure.question
    first, last = ((end - lattice.origin) / (lattice.step * width) for end in (question.lowest, question.highest))
    farthest = min(HORIZON * reach, MIDDLE // width - 2 * reach)
    middle = np.clip(np.round(np.clip(0.0, first, last)), -farthest, farthest)  # the start, or what is nearest to it
    low = np.clip(np.floor(first) - 1, middle - reach, middle).astype(np.int64)
    high = np.clip(np.ceil(last) + 1, middle, middle + reach).astype(np.int64)
    _refuse_rays(lattice, middle, width, int(farthest), reach)
    while True:
        axes = [np.arange(a, b + 1) * width for a, b in zip(low, high, strict=True)]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        code = codes(places)
        numbers = lattice.number(code, width)
        inside = lattice.margins[numbers] >= 0.0
        by = np.maximum(2, (GROWS * (high - low)).astype(np.int64))
        faces = [np.moveaxis(inside, axis, 0) for axis in range(d)]
        grow_low, grow_high = (np.array([face[end].any() for face in faces]) for end in (0, -1))
        if not (grow_low | grow_high).any():
            return _cells(lattice, code, numbers, width)
        low, high = low - by * grow_low, high + by * grow_high
        if (high - low).max() > HORIZON * reach:
            _refuse_endless(lattice, int((high - low).argmax()))


def _refuse_rays(lattice: Lattice, middle: Ints, width: int, farthest: int, reach: int) -> None:
    """Refuse a workspace without an end along an axis: its box, which is looked at next, has many more points."""
    for axis, along in enumerate(np.eye(lattice.d, dtype=np.int64)):
        for sign in (-1, 1):
            done = 0
            while done < farthest:
                ahead = np.arange(done + 1, min(max(2 * done, reach), farthest) + 1)
                places = (middle.astype(np.int64) + sign * ahead[:, None] * along) * width
                numbers = lattice.number(codes(places), width)
                if not (lattice.margins[numbers] >= 0.0).all():
                    break
                done = int(ahead[-1])
            else:
                _refuse_endless(lattice, axis)


def _refuse_endless(lattice: Lattice, axis: int) -> NoReturn:
    name = lattice.measure.question.space.names[axis]
    expected = f"within={{'{name}': (least, greatest)}}: nothing ends the workspace, so that it must be cut off"
    raise InvalidArgument("within", f"no ends of '{name}'", expected)


def _cells(lattice: Lattice, code: Ints, numbers: Ints, width: int) -> Cells:
    """All cells of a box, from the codes and numbers of its points, (n, ...) each."""
    sides = (slice(None, -1), slice(1, None))
    numbers_of_corners = [
        numbers[tuple(sides[side] for side in corner)].ravel() for corner in corners(lattice.d).tolist()
    ]
    at_corners = np.stack(numbers_of_corners, axis=1)
    return Cells(code[(sides[0],) * lattice.d].ravel(), width, at_corners, lattice.margins[at_corners])


def _divided(lattice: Lattice, cells: Cells) -> Cells:
    """The halves of cells, along each coordinate."""
    d, width = lattice.d, cells.width // 2
    numbers = lattice.number(cells.codes[:, None] + offsets(width * np.indices((3,) * d).reshape(d, -1).T), width)
    places = (corners(d)[:, None] + corners(d)) @ 3 ** np.arange(d)[::-1]
    at_corners = numbers[:, places].reshape(-1, 2**d)
    code = (cells.codes[:, None] + offsets(width * corners(d))).ravel()
    return Cells(code, width, at_corners, lattice.margins[at_corners])


def _with_neighbours(lattice: Lattice, cells: Cells) -> Cells:
    """Cells with all cells that the border continues into, so that it is closed."""
    d, cell_corners, width = lattice.d, corners(lattice.d), cells.width
    known, latest, numbers_found = Numbering(), cells, [cells.corners]
    known.number(cells.codes)
    while len(latest.codes):
        inside, before = latest.margins >= 0.0, len(known)
        for axis, offset in enumerate(width * offsets(np.eye(d, dtype=np.int64))):
            for side in (0, 1):
                face = inside[:, cell_corners[:, axis] == side]
                known.number(latest.codes[face.any(axis=1) & ~face.all(axis=1)] + offset * (2 * side - 1))
        new = known.codes[before:]
        numbers = lattice.number(new[:, None] + offsets(width * cell_corners), width)
        latest = Cells(new, width, numbers, lattice.margins[numbers])
        numbers_found.append(numbers)
    at_corners = np.concatenate(numbers_found)
    return Cells(known.codes, width, at_corners, lattice.margins[at_corners])
