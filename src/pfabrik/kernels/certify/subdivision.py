"""The cells of a region, and the memory that a kernel subdivides them in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Ints
from .._jit import opener
from ..clearance.link_records import NO_LINKS
from ..legs.open_table import SAMPLE
from ..legs.records import SHARED, Table
from .leg_bounds import new_bounds
from .limit_rows import LimitRows
from .link_rows import ROWS_A_PAIR, CellLinks, new_cell_links
from .pose_cells import N_PARAMETERS, CellParameters, new_cell

# Counters: cells on the stack, proved, left open, looked at; the limit that a pose breaks; cells to look at, at most.
N_STACK, N_PROVED, N_OPEN, N_CELLS, LIMIT, BUDGET, N_COUNTERS = 0, 1, 2, 3, 4, 5, 6
# Measures: a proved lower bound of the margin; the least margin of the poses measured; a cell is proved where its
# margin is at least that less this gap, or, if it is infinite, where the margin is positive.
PROVED_MARGIN, FOUND_MARGIN, GAP, N_MEASURES = 0, 1, 2, 3
# Columns of a cell: middle, half sizes, the set of legs, then pairs of links, that are proved on it, as bits.
HALF, PROVED_LEGS, N_COLUMNS = 6, 12, 13


class Subdivision(NamedTuple):
    """A region, its cells, and scratch memory."""

    parameters: CellParameters
    sides: Floats  # (legs,): the branch of each leg
    stack: Floats  # (n, N_COLUMNS): cells still to be looked at
    proved: Floats  # (n, N_COLUMNS): proved cells, as many as there is memory for
    left: Floats  # (n, N_COLUMNS): cells left open
    shares: Floats  # (n, 2): of each cell of the stack, what is within all limits at least and at most
    counters: Ints  # (N_COUNTERS,)
    measures: Floats  # (N_MEASURES,)
    pose: Floats  # (6,): parameters of the pose that breaks a limit
    cells: Floats  # (3, N_COLUMNS): scratch
    rows: LimitRows
    links: CellLinks


def new_rows(table: Table, n_pairs: int = 0) -> LimitRows:
    """Allocate the rows of a machine, with as many pairs of links."""
    n_legs = len(table.legs)
    leaders = np.arange(n_legs)
    for k in range(1, n_legs):
        leaders[k] = leaders[k - 1] if table.legs["proximal"][k] == SHARED else k
    owners = np.concatenate(
        [
            np.repeat(leaders[table.limited["leg"]], 2),
            leaders[table.cones["leg"]],
            np.repeat(leaders, 2),
            np.repeat(n_legs + np.arange(n_pairs), ROWS_A_PAIR),
        ]
    )
    rows, spreads = np.zeros((len(owners), 9)), np.zeros((n_legs + n_pairs, N_PARAMETERS))
    return LimitRows(rows, owners.astype(np.int64), spreads, new_cell(), new_bounds())


def new_subdivision(
    table: Table,
    parameters: CellParameters,
    sides: Floats,
    links: CellLinks,
    sizes: tuple[int, int, int],
    n_shares: int = 0,
) -> Subdivision:
    """Allocate a subdivision; `sizes` are the numbers of cells of the stack, proved and left open."""
    return Subdivision(
        parameters,
        sides,
        np.empty((sizes[0], N_COLUMNS)),
        np.empty((sizes[1], N_COLUMNS)),
        np.empty((sizes[2], N_COLUMNS)),
        np.empty((n_shares, 2)),
        np.zeros(N_COUNTERS, np.int64),
        np.full(N_MEASURES, np.inf),
        np.zeros(N_PARAMETERS),
        np.zeros((3, N_COLUMNS)),
        new_rows(table, len(links.limits.pairs)),
        links,
    )


def no_parameters() -> CellParameters:
    """Parameters of a region without poses."""
    return CellParameters(
        np.zeros(4, np.int64), np.zeros(6), np.zeros(6), np.zeros((1, 12)), np.zeros((1, 6)), np.zeros(1)
    )


open_subdivision = opener(new_subdivision(SAMPLE, no_parameters(), np.zeros(1), new_cell_links(NO_LINKS), (1, 1, 1), 1))
"""The subdivision at the address of a `Handle`."""
