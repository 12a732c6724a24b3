"""Distances of links over a cell of poses: four numbers a pair, all positive where the clearance is kept.

With any unit vector n, the distance of any two points x and y of two axes is at least n . (y - x), which is least at
ends: over a cell, the axes are nowhere nearer than the least of n . (b - a) over the four choices of an end a of the
first and an end b of the second. With n along the line between their nearest points, that is their distance at a
single pose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from .._jit import routine
from ..clearance.capsules import between_segments
from ..clearance.link_records import BASE, PLATFORM, LinkLimits
from ..clearance.solids import ROUND
from ..legs.records import Table
from ..vectors import Vec, along, dot, norm, scale, sub, vec
from .affine_forms import ABOVE, AWAY, BELOW, BOUNDS, CENTRE, ERROR, least, put_along, put_difference, put_fixed
from .leg_bounds import put_end, put_platform_point, put_proximal_point, put_rod
from .limit_rows import LimitRows, first_link_row
from .pose_cells import CURVATURE, ROUNDING, PoseCell

# Rows of a pair: one for each choice of an end of both axes.
ROWS_A_PAIR = 4
# Most turns of a direction over a cell, and the share of a turn below which it is the best one.
TURNS, LEAST_TURN = 12, 1e-3
# Share of the platform's motion that counts as one of links.
UNSEEN = 0.05


class CellLinks(NamedTuple):
    """Links that are to be kept apart, those of pairs all capsules or spheres."""

    limits: LinkLimits  # on BASE, PLATFORM, or the leg on whose crank or carriage an end is; others are in no pair
    ends: Floats  # (s, 2, 8, 3): the ends over a cell; scratch
    gaps: Floats  # (4, 8, 3): differences of the ends of two links; scratch


def new_cell_links(limits: LinkLimits) -> CellLinks:
    """Links with scratch memory of their own."""
    ends = np.zeros((len(limits.sizes), 2, BOUNDS + 1, 3))
    return CellLinks(limits, ends, np.zeros((ROWS_A_PAIR, BOUNDS + 1, 3)))


@routine
def put_link_ends(table: Table, sides: Floats, uncertain: float, n: int, rows: LimitRows, links: CellLinks) -> None:
    """Fill the ends of all links over the cell in `rows`."""
    reference = vec(table.task[0]["reference"])
    for i in range(links.limits.bodies.shape[0]):
        for e in range(2):
            at, body, end = vec(links.limits.home[i, e]), links.limits.bodies[i, e], links.ends[i, e]
            if body == PLATFORM:
                put_platform_point(sub(at, reference), reference, rows.cell, n, uncertain, end)
            elif body == BASE:
                put_fixed(at, uncertain, n, end)
            elif body < table.legs.shape[0]:
                put_end(table.legs[body], reference, rows.cell, n, 4.0 * uncertain, rows.bounds.end)
                put_rod(table.legs[body], sides[body], n, 2.0 * uncertain, rows.bounds)
                put_proximal_point(table.legs[body], at, n, 3.0 * uncertain, rows.bounds, end)


@routine
def put_pair(
    table: Table, pair: int, margin: float, uncertain: float, n: int, rows: LimitRows, links: CellLinks
) -> None:
    """Fill the rows of a pair of links, and how far each parameter moves one from the other; ends are filled.

    Where the first direction does not prove a margin, it is turned towards the nearest point of all differences b - a
    over the cell, in their linear parts: the direction whose bound is best (Gilbert's algorithm for the point of a
    convex set that is nearest to zero).
    """
    limits, i, j = links.limits, links.limits.pairs[pair, 0], links.limits.pairs[pair, 1]
    first, second = links.ends[i], links.ends[j]
    p, q, x, y = vec(first[0, CENTRE]), vec(first[1, CENTRE]), vec(second[0, CENTRE]), vec(second[1, CENTRE])
    s, t = between_segments(p, q, x, y)
    nearest = sub(along(x, t, sub(y, x)), along(p, s, sub(q, p)))
    apart = limits.sizes[i, ROUND] + limits.sizes[j, ROUND] + limits.least[0]
    for k in range(ROWS_A_PAIR):
        put_difference(second[k % 2], first[k // 2], n, links.gaps[k])
        if limits.bodies[i, k // 2] == PLATFORM and limits.bodies[j, k % 2] == PLATFORM:
            put_bounds_of_turned(rows.cell, uncertain, links.gaps[k])
    best, first_row = unit(nearest), first_link_row(table) + ROWS_A_PAIR * pair
    put_rows_along(links.gaps, best, apart, n, first_row, rows)
    lowest = least_row_of_pair(table, pair, n, rows)
    highest = least(rows.rows[lowest], n)
    for _ in range(TURNS):
        if highest >= margin:
            break
        step = sub(corner_of(links.gaps[lowest - first_row], rows.rows[lowest], n), nearest)
        square = dot(step, step)
        share = -dot(nearest, step) / square if square > 0.0 else 0.0
        if not share > LEAST_TURN:
            break
        nearest = along(nearest, min(share, 1.0), step)
        put_rows_along(links.gaps, unit(nearest), apart, n, first_row, rows)
        lowest = least_row_of_pair(table, pair, n, rows)
        if least(rows.rows[lowest], n) > highest:
            highest, best = least(rows.rows[lowest], n), unit(nearest)
    put_rows_along(links.gaps, best, apart, n, first_row, rows)
    worst = least_row_of_pair(table, pair, n, rows) - first_row
    put_spreads(links.gaps, worst, rows.cell, n, rows.spreads[table.legs.shape[0] + pair])


@routine
def put_spreads(gaps: Floats, worst: int, cell: PoseCell, n: int, spreads: Floats) -> None:
    """Fill how far each parameter moves two links from each other: their worst two ends, and all four on average.

    A share of the platform's motion counts too: beside a dead point it is not known how a crank moves.
    """
    for i in range(n):
        motion = cell.motions[i]
        spreads[i] = norm(vec(gaps[worst, i])) + UNSEEN * (norm(vec(motion)) + norm(vec(motion[3:])))
        for k in range(ROWS_A_PAIR):
            spreads[i] += norm(vec(gaps[k, i])) / ROWS_A_PAIR


@routine
def unit(v: Vec) -> Vec:
    """v / |v|; zero of zero."""
    length = norm(v)
    return scale(1.0 / length if length > 0.0 else 0.0, v)


@routine
def put_bounds_of_turned(cell: PoseCell, uncertain: float, gap: Floats) -> None:
    """Lower the error of a difference of two points of the platform, which only turns."""
    length, pose = norm(vec(gap[CENTRE])), cell.pose
    size = norm((pose[0, 3], pose[1, 3], pose[2, 3])) + length + gap[BOUNDS, AWAY] + uncertain
    error = cell.sizes[CURVATURE] * length + 2.0 * uncertain + 4.0 * ROUNDING * size
    gap[BOUNDS, ERROR] = min(gap[BOUNDS, ERROR], error)


@routine
def put_rows_along(gaps: Floats, direction: Vec, apart: float, n: int, first_row: int, rows: LimitRows) -> None:
    """direction . (b - a) less what two axes have to be apart, for each choice of ends."""
    for k in range(ROWS_A_PAIR):
        row = rows.rows[first_row + k]
        put_along(gaps[k], direction, n, row)
        row[CENTRE] -= apart
        row[BELOW] -= ROUNDING * apart
        row[ABOVE] += ROUNDING * apart


@routine
def corner_of(gap: Floats, row: Floats, n: int) -> Vec:
    """The difference b - a at the corner of the cell where its row is least, in its linear part."""
    z = vec(gap[CENTRE])
    for i in range(n):
        z = along(z, -1.0 if row[i] > 0.0 else 1.0, vec(gap[i]))
    return z


@routine
def least_row_of_pair(table: Table, pair: int, n: int, rows: LimitRows) -> int:
    """The row of a pair with the lowest bound."""
    first = first_link_row(table) + ROWS_A_PAIR * pair
    lowest = first
    for row in range(first + 1, first + ROWS_A_PAIR):
        if least(rows.rows[row], n) < least(rows.rows[lowest], n):
            lowest = row
    return lowest
