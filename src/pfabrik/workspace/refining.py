"""From a coarse look at everything to small cells at the border: cells are divided where the border may be."""

from __future__ import annotations

from typing import NamedTuple, NoReturn

import numpy as np

from ..arrays import Floats, Ints, Mask
from ..errors import InvalidArgument
from .lattice import Lattice, codes, corners

GROWS = 0.5
"""By which share of its size a box grows to the side where something touches it."""

HORIZON = 24
"""How many times as far as the first look went one may go before a workspace counts as endless."""

MORE = 16
"""How many times as many points as the first look has another may have where the first found nothing."""

SPREAD = 0.5
"""Share of the difference of margins at a cell's corners below which the least says that the border may be within."""

THIN = 4
"""Steps of the smallest cells that are looked at for a border that shows at no corner."""


class Cells(NamedTuple):
    """Cells of one size: their lowest corners (n, d), how many steps they are wide, and the margins at all corners."""

    lows: Ints
    width: int
    margins: Floats

    @property
    def crossed(self) -> Mask:
        """Whether the border passes between the corners of each."""
        inside = self.margins >= 0.0
        return np.asarray(inside.any(axis=1) & ~inside.all(axis=1))

    def at(self, which: Mask) -> Cells:
        return Cells(self.lows[which], self.width, self.margins[which])


class Refined(NamedTuple):
    """Cells at the border, the smallest and those of twice their width, and cells all within, of any size."""

    border: Cells
    coarser: Cells
    within: tuple[Cells, ...]


def refined(lattice: Lattice, levels: int, reach: int) -> Refined:
    """Find the border.

    Parameters
    ----------
    levels : how often the first cells are halved.
    reach : how many of the first cells it is looked for to each side of the start, before anything is found.
    """
    cells = _first(lattice, levels, reach)
    within: list[Cells] = []
    coarser = cells
    while True:
        cells = _with_neighbours(lattice, cells)
        crossed, inside = cells.crossed, np.asarray((cells.margins >= 0.0).all(axis=1))
        if cells.width == 2:
            coarser = cells.at(crossed)
        if cells.width == 1:
            return Refined(cells.at(crossed), coarser, (*within, cells.at(inside)))
        divided = crossed | _thin(cells) if cells.width >= THIN else crossed
        within.append(cells.at(~divided & inside))
        lattice.measure.expect(int(crossed.sum()), cells.width, lattice.d)
        cells = _divided(lattice, cells.at(divided))


def _first(lattice: Lattice, levels: int, reach: int) -> Cells:
    """Cells over a box that nothing within reach touches; smaller ones where the first find nothing at all."""
    most = MORE * (2 * reach + 1) ** lattice.d
    while True:
        cells = _box(lattice, 1 << levels, reach)
        if not levels or (cells.margins >= 0.0).any() or len(cells.lows) * 2**lattice.d > most:
            return cells
        levels, reach = levels - 1, 2 * reach


def _box(lattice: Lattice, width: int, reach: int) -> Cells:
    d, question = lattice.d, lattice.measure.question
    first, last = ((end - lattice.origin) / (lattice.step * width) for end in (question.lowest, question.highest))
    low = np.maximum(np.floor(first) - 1, -reach).astype(np.int64)
    high = np.minimum(np.ceil(last) + 1, reach).astype(np.int64)
    while True:
        axes = [np.arange(a, b + 1) * width for a, b in zip(low, high, strict=True)]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        inside = lattice.margins(codes(places)) >= 0.0
        by = np.maximum(2, (GROWS * (high - low)).astype(np.int64))
        faces = [np.moveaxis(inside, axis, 0) for axis in range(d)]
        grow_low, grow_high = (np.array([face[end].any() for face in faces]) for end in (0, -1))
        if not (grow_low | grow_high).any():
            return _measured(lattice, places[(slice(None, -1),) * d].reshape(-1, d), width)
        low, high = low - by * grow_low, high + by * grow_high
        if (high - low).max() > HORIZON * reach:
            _refuse_endless(lattice, int((high - low).argmax()))


def _refuse_endless(lattice: Lattice, axis: int) -> NoReturn:
    name = lattice.measure.question.space.names[axis]
    expected = f"within={{'{name}': (least, greatest)}}: nothing ends the workspace, so that it must be cut off"
    raise InvalidArgument("within", f"no ends of '{name}'", expected)


def _measured(lattice: Lattice, lows: Ints, width: int) -> Cells:
    return Cells(lows, width, lattice.margins(codes(lows[:, None] + width * corners(lattice.d))))


def _thin(cells: Cells) -> Mask:
    """Whether the border may enter a cell and leave it between its corners: its margins fall towards it fast enough."""
    with np.errstate(invalid="ignore"):
        spread = cells.margins.max(axis=1) - cells.margins.min(axis=1)
        near = np.abs(cells.margins).min(axis=1) < SPREAD * spread
    return np.asarray(near & np.isfinite(spread))


def _divided(lattice: Lattice, cells: Cells) -> Cells:
    width = cells.width // 2
    lows = (cells.lows[:, None] + width * corners(lattice.d)).reshape(-1, lattice.d)
    return _measured(lattice, lows, width)


def _with_neighbours(lattice: Lattice, cells: Cells) -> Cells:
    """With all cells that the border goes on into: so it has no end but where it began."""
    d, every = lattice.d, corners(lattice.d)
    known, latest = np.sort(codes(cells.lows)), cells
    while True:
        beyond = []
        for axis in range(d):
            for side in (0, 1):
                face = latest.margins[:, every[:, axis] == side] >= 0.0
                open_ = face.any(axis=1) & ~face.all(axis=1)
                way = np.zeros(d, np.int64)
                way[axis] = cells.width * (2 * side - 1)
                beyond.append(latest.lows[open_] + way)
        lows = np.concatenate(beyond)
        code, first = np.unique(codes(lows), return_index=True)
        where = np.minimum(np.searchsorted(known, code), max(len(known) - 1, 0))
        new = known[where] != code
        if not new.any():
            return cells
        latest = _measured(lattice, lows[first[new]], cells.width)
        known = np.sort(np.concatenate([known, code[new]]))
        cells = cells._replace(
            lows=np.concatenate([cells.lows, latest.lows]), margins=np.concatenate([cells.margins, latest.margins])
        )
