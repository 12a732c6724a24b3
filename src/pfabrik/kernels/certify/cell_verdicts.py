"""Verdicts on single cells: the limit that is not proved on it, or the parts of it that are within all limits."""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine
from ..legs.records import SHARED, Table
from .affine_forms import ABOVE, BELOW, CENTRE, least, most
from .half_spaces_of_cells import share_above
from .limit_rows import first_link_row, margin_of, put_limits
from .link_rows import ROWS_A_PAIR, least_row_of_pair, put_link_ends, put_pair
from .pose_cells import BALL, BOX, ROUNDING, TILT, CellParameters, put_cell
from .subdivision import FOUND_MARGIN, GAP, HALF, PROVED_LEGS, PROVED_MARGIN, Subdivision

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
    """The row with the least margin of those that are not proved on a cell; -1 if all are, and noted in the cell."""
    rows, measures, n = work.rows, work.measures, work.parameters.kinds[2]
    margin = max(measures[FOUND_MARGIN] - measures[GAP], 0.0) if measures[GAP] < math.inf else 0.0
    put_cell(work.parameters, cell, rows.cell)
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
    return worst


@routine
def put_row(table: Table, work: Subdivision, box: Floats, row: int) -> int:
    """Fill the rows of the leg, or the pair of links, of a row over a box; the row, of a pair the lowest one."""
    rows, n, owner, n_legs = work.rows, work.parameters.kinds[2], work.rows.owners[row], table.legs.shape[0]
    put_cell(work.parameters, box, rows.cell)
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
