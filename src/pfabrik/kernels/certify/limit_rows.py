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
from ..legs.pivots import any_across
from ..legs.records import (
    BASE_END,
    BASE_LINE,
    CARRIAGE,
    CRANK,
    CROSS,
    FROM_BASE,
    FROM_PLATFORM,
    HINGE,
    PIVOT,
    PLATFORM_END,
    Q_PROXIMAL,
    ROD,
    SHARED,
    SLIDE,
    TRIPLE,
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
from .leg_bounds import (
    LegBounds,
    put_base_line,
    put_direction,
    put_end,
    put_platform_line,
    put_reach_of_crank,
    put_rod,
    put_span,
)
from .pose_cells import N_PARAMETERS, ROUNDING, PoseCell

# Reach [L] by which a rod must be away from a dead point: beyond it, the closed form keeps its digits.
LEAST_REACH = 1e-9
# Half angle above which a cone limits nothing [rad].
OPEN_CONE = math.pi - 1e-9


class LimitRows(NamedTuple):
    """Scratch memory: the forms of all limits over a cell."""

    rows: Floats  # (limits, 9)
    owners: Ints  # (limits,): the leg of each row, or the one whose proximal joint it is on; of links, legs + pair
    spreads: Floats  # (legs + pairs + 1, 6): how far each parameter moves a leg, two links from each other, or the pose
    joints: Ints  # (ranges,): the parameter that a coordinate is, of JOINTS; else -1
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
            if leg["base_end"] == TRIPLE:
                axes = leg["base_end_axes"]
                put_direction(leg["frame"], vec(axes[2]), cell, n, bounds.v)
                put_unknown(bounds.length, 1.0, 1.0)
                put_pointing(vec(axes[0]), vec(axes[1]), vec(axes[2]), n, bounds, a)
        elif m > k:
            put_span(leg, legs[k], n, bounds)
            if is_pointed(table, m, BASE_END) or is_pointed(table, m, PLATFORM_END):
                put_unknown(a, -math.inf, math.inf)
        elif leg["kind"] == ROD and not put_rod(leg, sides[m], n, 2.0 * uncertain, bounds):
            put_unknown(bounds.b, 1.0, 1.0)
            if leg["proximal"] == CRANK:
                put_reach_of_crank(leg, n, uncertain, bounds)
            for i in range(9):
                a[i], b[i] = bounds.a[i], bounds.b[i]
            a[CENTRE], b[CENTRE] = a[CENTRE] - LEAST_REACH, b[CENTRE] - LEAST_REACH
            if is_pointed(table, m, BASE_END) or is_pointed(table, m, PLATFORM_END):
                worse = a if a[CENTRE] <= b[CENTRE] else b  # the one that may show that the rod does not reach
                worse[BELOW] = -math.inf
        elif leg["kind"] == ROD:
            if is_pointed(table, m, BASE_END):
                put_base_line(leg, legs[k], n, bounds)
                axes = leg["base_end_axes"]
                put_pointing(vec(axes[0]), vec(axes[1]), vec(leg["line"]), n, bounds, a)
            if is_pointed(table, m, PLATFORM_END):
                put_platform_line(leg, cell, n, bounds)
                axes = leg["platform_end_axes"]
                put_pointing(vec(axes[0]), vec(axes[1]), vec(leg["line"]), n, bounds, b)
        length = norm(vec(bounds.span[CENTRE]))
        for i in range(n):
            rows.spreads[m, i] = norm(vec(bounds.end[i])) + length * norm(vec(cell.motions[i, 3:]))
            if leg["kind"] == PIVOT:  # whose angles turn without moving its centre
                rows.spreads[m, i] += norm(vec(cell.motions[i, 3:]))
        put_ranges(table, m, k, n, uncertain, rows)
        put_cones(table, m, k, n, rows)


@routine
def is_pointed(table: Table, m: int, place: int) -> bool:
    """True if two crossed hinges at an end of rod `m` have to point it somewhere, and no limit shows that they can."""
    leg = table.legs[m]
    aimed = leg["base_end_aimed"] if place == BASE_END else leg["platform_end_aimed"]
    ending = leg["base_end"] if place == BASE_END else leg["platform_end"]
    if aimed == 0 or ending != CROSS:
        return False
    for i in range(table.limited.shape[0]):
        at = table.limited[i]["place"] - place
        if table.limited[i]["leg"] == m and at >= 0 and at < 3:
            return False
    return True


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
        value, joint = bounds.c, rows.joints[i]
        if joint >= 0:
            put_unknown(value, 0.0, 0.0)
            value[joint] = coordinate["sense"] * rows.cell.box[N_PARAMETERS + joint]
            value[CENTRE] = coordinate["sense"] * rows.cell.box[joint]
        else:
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
    elif leg["kind"] == PIVOT:
        put_pivot_angle(leg, place - BASE_END, cell, n, bounds, value)
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
            vec(leg["base_end_axes"][0]),
            vec(leg["base_end_axes"][1]),
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
            vec(leg["platform_end_axes"][0]),
            vec(leg["platform_end_axes"][1]),
            vec(leg["line"]),
            leg["platform_end_side"],
            leg["twists"],
            place - PLATFORM_END,
            n,
            bounds,
            value,
        )


@routine
def put_pivot_angle(pivot: Record, which: int, cell: PoseCell, n: int, bounds: LegBounds, value: Floats) -> None:
    """Angle of a pivot's hinge, R = exp(a q1) exp(b q2) exp(c q3), from the directions that it turns.

    One hinge turns all across it. Two: R b = exp(a q1) b and R^T a = exp(-b q2) a. Three: a and b point c to R c, as
    crossed hinges do a rod; and so do c and b, by -q3 and -q2, a to R^T a, on the other side.
    """
    axes, line, frame = pivot["base_end_axes"], bounds.v, pivot["frame"]
    back = FROM_PLATFORM if frame == FROM_BASE else FROM_BASE
    a, b, c = vec(axes[0]), vec(axes[1]), vec(axes[2])
    put_unknown(value, -math.inf, math.inf)
    if pivot["base_end"] == HINGE:
        put_direction(frame, any_across(a), cell, n, line)
        put_heading(line, a, any_across(a), n, value)
    elif pivot["base_end"] == CROSS and which == 0:
        put_direction(frame, b, cell, n, line)
        put_heading(line, a, b, n, value)
    elif pivot["base_end"] == CROSS:
        put_direction(back, a, cell, n, line)
        put_heading(line, b, a, n, value)
        put_negative(value, n)
    elif pivot["base_end"] == TRIPLE:
        put_unknown(bounds.length, 1.0, 1.0)
        if which < 2:
            put_direction(frame, c, cell, n, line)
            put_ending_angle(CROSS, a, b, c, pivot["side"], 0, which, n, bounds, value)
        else:
            put_direction(back, a, cell, n, line)
            put_ending_angle(CROSS, c, b, a, -pivot["side"], 0, 0, n, bounds, value)
            put_negative(value, n)


@routine
def put_negative(a: Floats, n: int) -> None:
    """a = -a."""
    for i in range(n):
        a[i] = -a[i]
    below, above = -a[ABOVE], -a[BELOW]
    a[CENTRE], a[BELOW], a[ABOVE] = -a[CENTRE], below, above


@routine
def put_pointing_cosine(a: Vec, b: Vec, home: Vec, n: int, bounds: LegBounds, cosine: Floats) -> float:
    """C / h of hinges a, b that turn `home` into a line: A cos q + B sin q = C, h = hypot(A, B); the angle of (A, B).

    Infinite, and nothing filled, where no angle is determined.
    """
    along_b = dot(b, home)
    flat = sub(home, scale(along_b, b))
    A, B = dot(a, flat), dot(a, cross(b, home))
    h = math.hypot(A, B)
    length = norm(vec(bounds.v[CENTRE]))
    if not h > 0.0 or not length > 0.0:
        return math.inf
    centre = dot(a, vec(bounds.v[CENTRE])) / length
    put_cosine(bounds.v, a, centre, least(bounds.length, n), most(bounds.length, n), n, cosine)
    cosine[CENTRE] += centre - dot(a, b) * along_b
    for i in range(9):
        cosine[i] /= h
    return math.atan2(B, A)


@routine
def put_pointing(a: Vec, b: Vec, home: Vec, n: int, bounds: LegBounds, row: Floats) -> None:
    """1 - |C / h|, which is positive where two hinges point `home` along the line in `v`."""
    put_unknown(row, -math.inf, math.inf)
    cosine = bounds.a
    if not put_pointing_cosine(a, b, home, n, bounds, cosine) < math.inf:
        return
    if cosine[CENTRE] < 0.0:
        put_negative(cosine, n)
    other = 1.0 + least(cosine, n)
    for i in range(9):
        row[i] = cosine[i]
    put_negative(row, n)
    row[CENTRE] += 1.0 - LEAST_REACH
    row[BELOW] -= ROUNDING
    if not other >= least(row, n):
        put_unknown(row, other, most(row, n))


@routine
def put_ending_angle(
    ending: int,
    a: Vec,
    b: Vec,
    home: Vec,
    side: float,
    twists: int,
    which: int,
    n: int,
    bounds: LegBounds,
    value: Floats,
) -> None:
    """Angle of a hinge at an end of a rod: of a single one, or of two that cross, from the form of the rod's line.

    Of two hinges a, b: a . Rot(b, q1) u = a . w gives q1 = q0 + side acos(C / h), as `solve_angle` does; then a turns
    Rot(b, q1) u into w.
    """
    line = bounds.v
    if ending == HINGE:
        put_heading(line, a, home, n, value)
        return
    put_unknown(value, -math.inf, math.inf)
    if ending != CROSS or twists == 1:
        return
    cosine, angle = bounds.a, bounds.b
    start = put_pointing_cosine(a, b, home, n, bounds, cosine)
    if not start < math.inf or not put_arc_cosine(cosine, n, angle):
        return
    if side < 0.0:
        put_negative(angle, n)
    angle[CENTRE] += start
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
