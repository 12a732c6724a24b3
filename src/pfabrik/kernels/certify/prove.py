"""Subdivision of a region of poses until every limit is proved to be kept, or a pose is found that breaks one.

A cell on which a limit is not proved is halved along the parameter that moves its leg, or its links, most; what is
proved on a cell holds on its halves. Where a limit's linear part says that a corner breaks it, the pose there is
measured, and the search descends from there to where the limit is broken most.
"""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine, search
from ..legs.open_table import open_table
from ..legs.records import Table
from ..vectors import copy_row
from .affine_forms import CENTRE
from .cell_verdicts import centre_less_slopes, enclose_cell, put_row, unproved_row
from .limit_rows import first_link_row, margin_of
from .pose_cells import (
    N_PARAMETERS,
    STEPS,
    fit_into,
    is_beside,
)
from .subdivision import (
    BUDGET,
    FOUND_MARGIN,
    GAP,
    HALF,
    LIMIT,
    N_CELLS,
    N_OPEN,
    N_PROVED,
    N_STACK,
    PROVED_LEGS,
    Subdivision,
    open_subdivision,
)

# Questions, in kinds[3]: prove the region, or enclose the part of each cell that is within all limits.
PROVE, ENCLOSE = 0, 1
# Results of `prove`: every limit is proved; a pose breaks one; the budget is spent; some cells became too small.
DONE, BROKEN, SPENT, TOO_SMALL = 0, 1, 2, 3
# Excess [L, rad or cosine] from which a measured pose counts as breaking a limit: answers may exceed limits by 1e-9.
BREAKS = 2e-9
# Half size [L or rad] below which cells are not halved.
SMALLEST = 1e-7
# Steps of a descent, and the share of a cell's size below which it ends.
DESCENT_STEPS, LEAST_STEP = 40, 1e-3
# The first cells from which the distance of links is searched for its least.
SEARCHED = 16


@search
def prove(machine: int, subdivision: int) -> int:
    """Work on the stack of cells until it is empty, a pose breaks a limit, or the budget is spent.

    Parameters
    ----------
    machine, subdivision : addresses of the kernel table and of a `Subdivision`.
    """
    table, work = open_table(machine), open_subdivision(subdivision)
    counters, stack = work.counters, work.stack
    if work.parameters.kinds[3] == ENCLOSE:
        for i in range(counters[N_STACK]):
            enclose_cell(table, work, stack[i], work.shares[i])
        return DONE
    while counters[N_STACK] > 0:
        if counters[N_CELLS] >= counters[BUDGET]:
            return SPENT
        counters[N_STACK] -= 1
        cell, corner = work.cells[0], work.cells[1]
        copy_row(stack[counters[N_STACK]], cell)
        if is_beside(work.parameters, cell[:HALF], cell[HALF:PROVED_LEGS]):
            continue
        counters[N_CELLS] += 1
        row = unproved_row(table, work, cell)
        if row < 0:
            if counters[N_PROVED] < work.proved.shape[0]:
                copy_row(cell, work.proved[counters[N_PROVED]])
            counters[N_PROVED] += 1
            continue
        put_corner(work, cell, row, corner)
        is_broken = False
        for i in range(N_PARAMETERS):
            work.cells[2, i] = work.rows.spreads[work.rows.owners[row], i]
        if work.measures[GAP] < math.inf or centre_less_slopes(work.rows.rows[row], work.parameters.kinds[2]) < 0.0:
            is_broken = breaks_limit(table, work, row, cell, corner)
        if is_small(cell) or counters[N_STACK] + 2 > stack.shape[0]:
            copy_row(cell, work.left[counters[N_OPEN]])
            counters[N_OPEN] += 1
            if counters[N_OPEN] >= work.left.shape[0]:
                return TOO_SMALL
        else:
            push_halves(work, cell, corner)
        if is_broken:
            return BROKEN
    return DONE if counters[N_OPEN] == 0 else TOO_SMALL


@routine
def breaks_limit(table: Table, work: Subdivision, row: int, cell: Floats, corner: Floats) -> bool:
    """True if the pose at a corner breaks the limit of a row; then the pose where it is broken most is noted.

    Rows of links are below their distance away from the middle: there the search also descends from corners that keep
    the limit, of the first cells and of some later ones.
    """
    value = value_at(table, work, row, corner)
    if not value < -BREAKS and (row < first_link_row(table) or not is_searched(work.counters[N_CELLS])):
        work.measures[FOUND_MARGIN] = min(work.measures[FOUND_MARGIN], margin_of(table, row, value))
        return False
    for i in range(N_PARAMETERS):
        work.pose[i] = corner[i]
    lowest = descend(table, work, row, cell, value)
    work.measures[FOUND_MARGIN] = min(work.measures[FOUND_MARGIN], margin_of(table, row, lowest))
    work.counters[LIMIT] = row
    return lowest < -BREAKS


@routine
def is_searched(n_cells: int) -> bool:
    """True for the first cells, then for so few that descents take less time than bounds."""
    return n_cells <= SEARCHED or n_cells % (16 * SEARCHED) == 0


@routine
def is_small(cell: Floats) -> bool:
    """True if a cell is too small to be halved."""
    largest = 0.0
    for i in range(N_PARAMETERS):
        largest = max(largest, cell[HALF + i])
    return largest < SMALLEST


@routine
def put_corner(work: Subdivision, cell: Floats, row: int, corner: Floats) -> None:
    """Fill the pose of a cell, and of the region, where the linear part of a row is least."""
    slopes = work.rows.rows[row]
    for i in range(N_PARAMETERS):
        corner[i] = cell[i]
    for i in range(work.parameters.kinds[2]):
        corner[i] += -cell[HALF + i] if slopes[i] > 0.0 else (cell[HALF + i] if slopes[i] < 0.0 else 0.0)
    if work.parameters.kinds[0] != STEPS:
        fit_into(work.parameters, corner)
    corner[0] = min(max(corner[0], 0.0), 1.0) if work.parameters.kinds[0] == STEPS else corner[0]


@routine
def value_at(table: Table, work: Subdivision, row: int, point: Floats) -> float:
    """The value of a row at one pose, of a pair of links that of their distance; the point's half sizes become zero."""
    for i in range(N_PARAMETERS):
        point[HALF + i] = 0.0
    value: float = work.rows.rows[put_row(table, work, point, row), CENTRE]
    return value


@routine
def descend(table: Table, work: Subdivision, row: int, cell: Floats, value: float) -> float:
    """Move the noted pose to where a row is least, by corners of cells that shrink where none is lower; the value."""
    size, point = 1.0, work.cells[1]
    for _ in range(DESCENT_STEPS):
        for i in range(N_PARAMETERS):
            point[i], point[HALF + i] = work.pose[i], size * cell[HALF + i]
        put_corner(work, point, put_row(table, work, point, row), point)
        tried = value_at(table, work, row, point)
        if tried < value:
            for i in range(N_PARAMETERS):
                work.pose[i] = point[i]
            value, size = tried, 2.0 * size
        else:
            size *= 0.5
        if size < LEAST_STEP:
            break
    return value


@routine
def push_halves(work: Subdivision, cell: Floats, corner: Floats) -> None:
    """Push both halves of a cell along the parameter with the largest spread; that of the corner is first."""
    axis, widest, spreads = 0, -1.0, work.cells[2]
    for i in range(work.parameters.kinds[2]):
        if spreads[i] > widest and cell[HALF + i] > 0.0:
            axis, widest = i, spreads[i]
    half = 0.5 * cell[HALF + axis]
    away = -half if corner[axis] > cell[axis] else half
    for shift in (away, -away):
        top = work.stack[work.counters[N_STACK]]
        copy_row(cell, top)
        top[axis] += shift
        top[HALF + axis] = half
        work.counters[N_STACK] += 1
