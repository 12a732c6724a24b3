"""Limits over a cell of poses: numbers that are positive where a limit is kept, one row each.

Rows are in the order of `legs.margin_rows`: two for each range, one for each cone (its cosine less that of the half
angle), then two for the reach of each leg with a proximal joint. Behind them are four for each pair of links
(`link_rows`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ...common.arrays import Floats, Ints, Record
from .._jit import routine
from ..legs.records import (
    BASE_END,
    BASE_LINE,
    CARRIAGE,
    CRANK,
    CROSS,
    HINGE,
    PIVOT,
    PLATFORM_END,
    Q_PROXIMAL,
    ROD,
    SHARED,
    SLIDE,
    Table,
)
from ..vectors import Vec, cross, dot, norm, scale, sub, vec, wrap_into
from .affine_forms import (
    ABOVE,
    BELOW,
    CENTRE,
    combine,
    least,
    most,
    put_along,
    put_arc_cosine,
    put_cosine,
    put_heading,
    put_moved,
    put_turned,
    put_unknown,
)
from .leg_bounds import LegBounds, put_base_line, put_end, put_platform_line, put_reach_of_crank, put_rod, put_span
from .pose_cells import ROUNDING, PoseCell

# Reach [L] by which a rod must be away from a dead point: beyond it, the closed form keeps its digits.
LEAST_REACH = 1e-9
# Half angle above which a cone limits nothing [rad].
OPEN_CONE = math.pi - 1e-9


class LimitRows(NamedTuple):
    """Scratch memory: the forms of all limits over a cell."""

    rows: Floats  # (limits, 9)
    owners: Ints  # (limits,): the leg of each row, or the one whose proximal joint it is on; of links, legs + pair
    spreads: Floats  # (legs + pairs, 6): how far each parameter moves a leg, or two links from each other
    cell: PoseCell
    bounds: LegBounds


@routine
def put_limits(table: Table, sides: Floats, uncertain: float, k: int, n: int, rows: LimitRows) -> None:
    """Fill the rows of leg `k`, and of the rods on its proximal joint, over the cell in `rows`."""
    legs, bounds, cell, first_reach = table.legs, rows.bounds, rows.cell, first_reach_row(table)
    reference = vec(table.task[0]["reference"])
    has_joint = legs[k]["proximal"] == CRANK or legs[k]["proximal"] == CARRIAGE
    for m in range(k, legs.shape[0]):
        leg = legs[m]
        if m > k and leg["proximal"] != SHARED:
            break
        put_end(leg, reference, cell, n, (4.0 if has_joint else 2.0) * uncertain, bounds.end)
        a, b = rows.rows[first_reach + 2 * m], rows.rows[first_reach + 2 * m + 1]
        put_unknown(a, 1.0, 1.0)
        put_unknown(b, 1.0, 1.0)
        if leg["kind"] == PIVOT:
            put_moved(bounds.end, vec(leg["base_end_point"]), n, bounds.span)
        elif m > k:
            put_span(leg, legs[k], n, bounds)
        elif leg["kind"] == ROD and not put_rod(leg, sides[m], n, 2.0 * uncertain, bounds):
            put_unknown(bounds.b, 1.0, 1.0)
            if leg["proximal"] == CRANK:
                put_reach_of_crank(leg, n, uncertain, bounds)
            for i in range(9):
                a[i], b[i] = bounds.a[i], bounds.b[i]
            a[CENTRE], b[CENTRE] = a[CENTRE] - LEAST_REACH, b[CENTRE] - LEAST_REACH
        length = norm(vec(bounds.span[CENTRE]))
        for i in range(n):
            rows.spreads[m, i] = norm(vec(bounds.end[i])) + length * norm(vec(cell.motions[i, 3:]))
        put_ranges(table, m, k, n, uncertain, rows)
        put_cones(table, m, k, n, rows)


@routine
def first_reach_row(table: Table) -> int:
    """Index of the first row on the reach of legs."""
    return 2 * table.limited.shape[0] + table.cones.shape[0]


@routine
def first_link_row(table: Table) -> int:
    """Index of the first row on the distance of links."""
    return first_reach_row(table) + 2 * table.legs.shape[0]


@routine
def put_ranges(table: Table, m: int, k: int, n: int, uncertain: float, rows: LimitRows) -> None:
    """Fill the rows of all ranges of leg `m`, on the proximal joint of leg `k`."""
    bounds = rows.bounds
    for i in range(table.limited.shape[0]):
        coordinate = table.limited[i]
        if coordinate["leg"] != m:
            continue
        value = bounds.c
        put_coordinate(table.legs[m], table.legs[k], coordinate["place"], rows.cell, n, bounds, value)
        middle = coordinate["sense"] * value[CENTRE]
        if coordinate["turns"] == 1:
            middle = wrap_into(middle, coordinate["lo"], coordinate["hi"])
        rounded = ROUNDING * (1.0 + abs(middle))
        low, high = rows.rows[2 * i], rows.rows[2 * i + 1]
        for j in range(n):
            low[j] = coordinate["sense"] * value[j]
            high[j] = -low[j]
        if coordinate["place"] == SLIDE:  # from a length at home that depends on the same points
            rounded += 2.0 * uncertain
        below, above = value[BELOW] - rounded, value[ABOVE] + rounded
        if coordinate["sense"] < 0.0:
            below, above = -above, -below
        low[CENTRE], low[BELOW], low[ABOVE] = middle - coordinate["lo"], below, above
        high[CENTRE], high[BELOW], high[ABOVE] = coordinate["hi"] - middle, -above, -below


@routine
def put_coordinate(
    leg: Record, owner: Record, place: int, cell: PoseCell, n: int, bounds: LegBounds, value: Floats
) -> None:
    """A coordinate of a leg over a cell; unknown where its place has no bounds yet."""
    if leg["kind"] == PIVOT and place >= PLATFORM_END:
        put_along(bounds.span, vec(leg["slide_rows"][place - PLATFORM_END]), n, value)
    elif leg["kind"] != ROD:
        put_unknown(value, -math.inf, math.inf)
    elif place == Q_PROXIMAL:
        for i in range(9):
            value[i] = bounds.q[i]
    elif place == SLIDE:
        for i in range(9):
            value[i] = bounds.length[i]
        value[CENTRE] -= leg["length"]
    elif place < SLIDE:
        put_base_line(leg, owner, n, bounds)
        put_ending_angle(
            leg["base_end"],
            leg["base_end_axes"],
            vec(leg["line"]),
            leg["base_end_side"],
            leg["twists"],
            place - BASE_END,
            n,
            bounds,
            value,
        )
    else:
        put_platform_line(leg, cell, n, bounds)
        put_ending_angle(
            leg["platform_end"],
            leg["platform_end_axes"],
            vec(leg["line"]),
            leg["platform_end_side"],
            leg["twists"],
            place - PLATFORM_END,
            n,
            bounds,
            value,
        )


@routine
def put_ending_angle(
    ending: int, axes: Floats, home: Vec, side: float, twists: int, which: int, n: int, bounds: LegBounds, value: Floats
) -> None:
    """Angle of a hinge at an end of a rod: of a single one, or of two that cross, from the form of the rod's line.

    Of two hinges a, b: a . Rot(b, q1) u = a . w gives q1 = q0 + side acos(C / h), as `solve_angle` does; then a turns
    Rot(b, q1) u into w.
    """
    line = bounds.v
    if ending == HINGE:
        put_heading(line, vec(axes[0]), home, n, value)
        return
    put_unknown(value, -math.inf, math.inf)
    if ending != CROSS or twists == 1:
        return
    a, b = vec(axes[0]), vec(axes[1])
    along_b = dot(b, home)
    flat = sub(home, scale(along_b, b))
    A, B = dot(a, flat), dot(a, cross(b, home))
    h = math.hypot(A, B)
    length = norm(vec(line[CENTRE]))
    if not h > 0.0 or not length > 0.0:
        return
    cosine, angle, centre = bounds.a, bounds.b, dot(a, vec(line[CENTRE])) / length
    put_cosine(line, a, centre, least(bounds.length, n), most(bounds.length, n), n, cosine)
    cosine[CENTRE] += centre - dot(a, b) * along_b
    for i in range(9):
        cosine[i] /= h
    if not put_arc_cosine(cosine, n, angle):
        return
    if side < 0.0:
        for i in range(n):
            angle[i] = -angle[i]
        below, above = -angle[ABOVE], -angle[BELOW]
        angle[CENTRE], angle[BELOW], angle[ABOVE] = -angle[CENTRE], below, above
    angle[CENTRE] += math.atan2(B, A)
    if which == 1:
        for i in range(9):
            value[i] = angle[i]
        return
    put_heading(line, a, home, n, value)
    q = angle[CENTRE]
    put_turned(home, b, math.cos(q), math.sin(q), q, angle, n, line)
    put_heading(line, a, home, n, cosine)
    combine(value, -1.0, cosine, n, value)


@routine
def put_cones(table: Table, m: int, k: int, n: int, rows: LimitRows) -> None:
    """Fill the rows of all cones of leg `m`, on the proximal joint of leg `k`."""
    first, bounds = 2 * table.limited.shape[0], rows.bounds
    for c in range(table.cones.shape[0]):
        cone = table.cones[c]
        if cone["leg"] != m:
            continue
        row = rows.rows[first + c]
        if cone["half_angle"] >= OPEN_CONE:
            put_unknown(row, 1.0, 1.0)
            continue
        cosine = math.cos(cone["half_angle"])
        if cone["place"] == BASE_LINE:
            put_base_line(table.legs[m], table.legs[k], n, bounds)
        else:
            put_platform_line(table.legs[m], rows.cell, n, bounds)
        put_cosine(bounds.v, vec(cone["axis"]), cosine, least(bounds.length, n), most(bounds.length, n), n, row)


@routine
def margin_of(table: Table, row: int, value: float) -> float:
    """The relative margin of a limit, as of `feasibility`, from the value of its row; infinite where a rod reaches."""
    if row >= first_link_row(table):
        return value
    n_ranges = 2 * table.limited.shape[0]
    if row < n_ranges:
        coordinate = table.limited[row // 2]
        return value / (0.5 * (coordinate["hi"] - coordinate["lo"]))
    if row < n_ranges + table.cones.shape[0]:
        half_angle = table.cones[row - n_ranges]["half_angle"]
        if half_angle >= OPEN_CONE:
            return 1.0
        return (half_angle - math.acos(min(max(value + math.cos(half_angle), -1.0), 1.0))) / half_angle
    return math.inf if value > 0.0 else min(value, -LEAST_REACH)
