"""Subdivision of a region of poses until every limit is proved to be kept, or a pose is found that breaks one.

A cell on which a limit is not proved is halved along the parameter that moves its leg, or its links, most; what is
proved on a cell holds on its halves. Where a limit's linear part says that a corner breaks it, the pose there is
measured, and the search descends from there to where the limit is broken most.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from .._jit import opener, routine, search
from ..clearance.link_records import NO_LINKS
from ..legs.records import SAMPLE, SHARED, Table, open_table
from ..vectors import copy_row, norm, vec
from .affine_forms import ABOVE, BELOW, CENTRE, least, most, put_unknown
from .implicit_pose import ImplicitPose, has_implicit, new_implicit, put_pose
from .leg_bounds import new_bounds
from .limit_rows import LimitRows, first_link_row, margin_of, put_limits
from .link_rows import ROWS_A_PAIR, CellLinks, least_row_of_pair, new_cell_links, put_link_ends, put_pair
from .parallel_rows import ParallelRows, is_regular, new_parallel, put_parallel
from .pose_cells import (
    BALL,
    BOX,
    N_JOINT_COLUMNS,
    N_PARAMETERS,
    ROUNDING,
    STEPS,
    TILT,
    CellParameters,
    fit_into,
    is_beside,
    new_cell,
    put_cell,
)

# Slope, as a share of the largest, below which one counts as part of the remainder: the volume divides by all of them.
FLAT = 1e-4
# Error of a volume by rounding, as a share of its cell's.
ROUNDED = 1e-9


@routine
def share_above(row: Floats, n: int, bound: int) -> float:
    """Share of a cell where the linear part of a row, plus one of its bounds, is positive; rounded to that side.

    Of the unit cube, {sum w_i u_i <= t} has the volume sum (-1)^|S| max(t - w(S), 0)^m / (m! prod w), over all sets S
    of axes.
    """
    side = -1.0 if bound == BELOW else 1.0
    total, largest = row[CENTRE] + row[bound], 0.0
    if not abs(total) < math.inf:
        return 1.0 if total > 0.0 else 0.0
    for i in range(n):
        largest = max(largest, abs(row[i]))
    first, second, third = 0.0, 0.0, 0.0  # the widths of up to three slopes; 0 if there are fewer
    for i in range(n):
        width = abs(row[i])
        if width <= FLAT * largest or third > 0.0:
            total += side * width
        elif first == 0.0:
            first = width
        elif second == 0.0:
            second = width
        else:
            third = width
    span = first + second + third
    if total >= span:
        return 1.0
    if total <= -span:
        return 0.0
    t = 0.5 * (total + span)
    if second == 0.0:
        volume = t / first
    elif third == 0.0:
        volume = (square(t) - square(t - first) - square(t - second) + square(t - span)) / (2.0 * first * second)
    else:
        volume = cube(t) - cube(t - first) - cube(t - second) - cube(t - third) - cube(t - span)
        volume += cube(t - first - second) + cube(t - first - third) + cube(t - second - third)
        volume /= 6.0 * first * second * third
    return min(max(volume + side * ROUNDED, 0.0), 1.0)


@routine
def square(t: float) -> float:
    """t^2 if t is positive, else 0."""
    return t * t if t > 0.0 else 0.0


@routine
def cube(t: float) -> float:
    """t^3 if t is positive, else 0."""
    return t * t * t if t > 0.0 else 0.0


# Counters: cells on the stack, proved, left open, looked at; the limit that a pose breaks; cells to look at, at most;
# the row that was not proved on the last cell that was not.
N_STACK, N_PROVED, N_OPEN, N_CELLS, LIMIT, BUDGET, LAST_ROW, N_COUNTERS = 0, 1, 2, 3, 4, 5, 6, 7
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
    implicit: ImplicitPose
    parallel: ParallelRows


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
            [n_legs + n_pairs],
        ]
    )
    rows, spreads = np.zeros((len(owners), 9)), np.zeros((n_legs + n_pairs + 1, N_PARAMETERS))
    joints = np.full(len(table.limited), -1)
    return LimitRows(rows, owners.astype(np.int64), spreads, joints, new_cell(), new_bounds())


def new_subdivision(
    table: Table,
    parameters: CellParameters,
    sides: Floats,
    links: CellLinks,
    sizes: tuple[int, int, int],
    n_shares: int = 0,
) -> Subdivision:
    """Allocate a subdivision; `sizes` are the numbers of cells of the stack, proved and left open."""
    rows = new_rows(table, len(links.limits.pairs))
    if len(parameters.ranges):
        rows.joints[:] = parameters.ranges
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
        rows,
        links,
        new_implicit(int(table.task["rows"][0])),
        new_parallel(),
    )


def no_parameters() -> CellParameters:
    """Parameters of a region without poses."""
    return CellParameters(
        np.zeros(5, np.int64),
        np.zeros(6),
        np.zeros(6),
        np.zeros((1, 12)),
        np.zeros((1, 6)),
        np.zeros(1),
        np.zeros((1, N_JOINT_COLUMNS)),
        np.zeros(0, np.int64),
        np.zeros(6, np.int64),
        np.zeros(2),
    )


open_subdivision = opener(new_subdivision(SAMPLE, no_parameters(), np.zeros(1), new_cell_links(NO_LINKS), (1, 1, 1), 1))
"""The subdivision at the address of a `Handle`."""


# Legs and pairs of links of which a cell remembers that they are proved.
MOST_BITS = 50


@routine
def enclose_cell(table: Table, work: Subdivision, cell: Floats, shares: Floats) -> None:
    """Fill the shares of a cell that are within all limits at least and at most.

    Over a cell each limit is between two affine functions. What limits cut off is at most the sum of what each cuts
    off, and at least the most that one does.
    """
    rows, n, proved, inner, outer = work.rows, work.parameters.kinds[2], int(cell[PROVED_LEGS]), 1.0, 1.0
    put_cell(work.parameters, cell, rows.cell)
    for k in range(table.legs.shape[0]):
        bit = 1 << min(k, MOST_BITS)
        if table.legs[k]["proximal"] == SHARED or (k < MOST_BITS and proved & bit != 0) or outer <= 0.0:
            continue
        put_limits(table, work.sides, work.parameters.uncertain[0], k, n, rows)
        is_proved = True
        for row in range(rows.rows.shape[0]):
            if rows.owners[row] != k or least(rows.rows[row], n) >= 0.0:
                continue
            is_proved = False
            if most(rows.rows[row], n) < 0.0:
                outer = 0.0
            inner -= 1.0 - share_above(rows.rows[row], n, BELOW)
            outer = min(outer, share_above(rows.rows[row], n, ABOVE))
        if is_proved and k < MOST_BITS:
            proved |= bit
    cell[PROVED_LEGS] = float(proved)
    shares[0], shares[1] = min(max(inner, 0.0), outer), outer


@routine
def unproved_row(table: Table, work: Subdivision, cell: Floats) -> int:
    """The row with the least margin of those that are not proved on a cell; -1 if all are, and noted in the cell.

    Without bounds of implicit coordinates it is the last one, on the whole machine. What is proved on a cell with such
    coordinates is not taken over by its halves: they may enclose others.
    """
    rows, measures, n = work.rows, work.measures, work.parameters.kinds[2]
    margin = max(measures[FOUND_MARGIN] - measures[GAP], 0.0) if measures[GAP] < math.inf else 0.0
    if not put_pose(table, work.sides, work.parameters, cell, rows, work.implicit):
        cell[PROVED_LEGS] = 0.0
        put_unknown_machine(work, cell)
        return rows.rows.shape[0] - 1
    if has_implicit(work.parameters):
        cell[PROVED_LEGS] = 0.0
    proved, worst, least_margin, proved_margin = int(cell[PROVED_LEGS]), -1, math.inf, measures[PROVED_MARGIN]
    is_round = work.parameters.kinds[0] == TILT or work.parameters.kinds[1] != BOX
    n_legs, n_leg_rows, has_ends = table.legs.shape[0], first_link_row(table), False
    for k in range(n_legs + work.links.limits.pairs.shape[0]):
        bit = 1 << min(k, MOST_BITS)
        if (k < n_legs and table.legs[k]["proximal"] == SHARED) or (k < MOST_BITS and proved & bit != 0):
            continue
        first, end = 0, n_leg_rows
        if k < n_legs:
            put_limits(table, work.sides, work.parameters.uncertain[0], k, n, rows)
        else:
            if not has_ends:
                put_link_ends(table, work.sides, work.parameters.uncertain[0], n, rows, work.links)
                has_ends = True
            put_pair(table, k - n_legs, margin, work.parameters.uncertain[0], n, rows, work.links)
            first = n_leg_rows + ROWS_A_PAIR * (k - n_legs)
            end = first + ROWS_A_PAIR
        is_proved, leg_margin = True, math.inf
        for row in range(first, end):
            if rows.owners[row] != k:
                continue
            value = least(rows.rows[row], n)
            at_least = margin_of(table, row, value)
            if is_round and not at_least >= margin:
                at_least = margin_of(table, row, value + gain_of_shape(work.parameters, cell, rows.rows[row]))
            leg_margin = min(leg_margin, at_least)
            if not at_least >= margin:
                is_proved = False
                if worst < 0 or at_least < least_margin:
                    worst, least_margin = row, at_least
        if is_proved:
            proved_margin = min(proved_margin, leg_margin)
            if k < MOST_BITS:
                proved |= bit
    cell[PROVED_LEGS] = float(proved)
    measures[PROVED_MARGIN] = proved_margin
    if worst < 0 and work.parameters.kinds[4] == 1:
        work.parallel.side[0] = 0.0
        is_filled = put_parallel(table, work.sides, n, rows, work.parallel)
        if not is_filled or not is_regular(work.parameters, n, work.parallel):
            put_unknown_machine(work, cell)
            return rows.rows.shape[0] - 1
    return worst


@routine
def put_unknown_machine(work: Subdivision, cell: Floats) -> None:
    """The last row, which is not known, and how far each parameter moves the platform."""
    rows = work.rows
    last = rows.rows.shape[0] - 1
    put_unknown(rows.rows[last], -math.inf, math.inf)
    put_cell(work.parameters, cell, rows.cell)
    for i in range(N_PARAMETERS):
        motion = rows.cell.motions[i]
        rows.spreads[rows.owners[last], i] = norm(vec(motion)) + norm(vec(motion[3:]))


@routine
def put_row(table: Table, work: Subdivision, box: Floats, row: int) -> int:
    """Fill the rows of the leg, or the pair of links, of a row over a box; the row, of a pair the lowest one.

    It is -1 where implicit coordinates are not known.
    """
    rows, n, owner, n_legs = work.rows, work.parameters.kinds[2], work.rows.owners[row], table.legs.shape[0]
    if not put_pose(table, work.sides, work.parameters, box, rows, work.implicit):
        return -1
    if owner < n_legs:
        put_limits(table, work.sides, work.parameters.uncertain[0], owner, n, rows)
        return row
    put_link_ends(table, work.sides, work.parameters.uncertain[0], n, rows, work.links)
    put_pair(table, owner - n_legs, 0.0, work.parameters.uncertain[0], n, rows, work.links)
    return least_row_of_pair(table, owner - n_legs, n, rows)


@routine
def gain_of_shape(region: CellParameters, cell: Floats, row: Floats) -> float:
    """By how much the least value of a row in the region's shape is above that in the cell, at least.

    Of the slopes g by the parameters of a ball about b of radius r, the least is g . (b - middle) - |g| r.
    """
    gain = 0.0
    if region.kinds[1] != BOX:
        gain += gain_in_ball(cell, row, region.middle, 0, 3 if region.kinds[1] == BALL else 2, region.half[0])
    if region.kinds[0] == TILT:
        gain += gain_in_ball(cell, row, region.middle, 3, 5, region.half[3])
    return gain * (1.0 - ROUNDING) - ROUNDING


@routine
def gain_in_ball(cell: Floats, row: Floats, centre: Floats, first: int, end: int, radius: float) -> float:
    """What the ball of some parameters, rather than their box, adds to the least value of a row."""
    in_box, in_ball, square = 0.0, 0.0, 0.0
    for i in range(first, end):
        if not cell[HALF + i] > 0.0:
            return 0.0
        slope = row[i] / cell[HALF + i]
        in_box -= abs(row[i])
        in_ball += slope * (centre[i] - cell[i])
        square += slope * slope
    return max(in_ball - radius * math.sqrt(square) - in_box, 0.0)


@routine
def centre_less_slopes(row: Floats, n: int) -> float:
    """The least value of the linear part of a row."""
    total: float = row[CENTRE]
    for i in range(n):
        total -= abs(row[i])
    return total


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
            keep_proved(work, cell)
            continue
        counters[LAST_ROW] = row
        put_corner(work, cell, row, corner)
        is_broken = False
        for i in range(N_PARAMETERS):
            work.cells[2, i] = work.rows.spreads[work.rows.owners[row], i]
        is_limit = row + 1 < work.rows.rows.shape[0]
        if is_limit and (
            work.measures[GAP] < math.inf or centre_less_slopes(work.rows.rows[row], work.parameters.kinds[2]) < 0.0
        ):
            is_broken = breaks_limit(table, work, row, cell, corner)
        elif not is_limit and work.parallel.side[0] < 0.0:
            for i in range(N_PARAMETERS):
                work.pose[i] = cell[i]
            work.counters[LIMIT], work.parallel.side[0], is_broken = row, 0.0, True
        if is_small(cell) and not is_broken and unproved_row(table, work, cell) < 0:  # by the margin found in it
            keep_proved(work, cell)
        elif is_small(cell) or counters[N_STACK] + 2 > stack.shape[0]:
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
def keep_proved(work: Subdivision, cell: Floats) -> None:
    """Count a cell as proved, and keep it where there is room."""
    if work.counters[N_PROVED] < work.proved.shape[0]:
        copy_row(cell, work.proved[work.counters[N_PROVED]])
    work.counters[N_PROVED] += 1


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
    filled = put_row(table, work, point, row)
    return work.rows.rows[filled, CENTRE] if filled >= 0 else math.inf


@routine
def descend(table: Table, work: Subdivision, row: int, cell: Floats, value: float) -> float:
    """Move the noted pose to where a row is least, by corners of cells that shrink where none is lower; the value."""
    size, point = 1.0, work.cells[1]
    for _ in range(DESCENT_STEPS):
        for i in range(N_PARAMETERS):
            point[i], point[HALF + i] = work.pose[i], size * cell[HALF + i]
        filled = put_row(table, work, point, row)
        if filled < 0:
            size *= 0.5
            continue
        put_corner(work, point, filled, point)
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
