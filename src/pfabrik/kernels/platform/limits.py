"""Limits of legs at a configuration, each with its derivative by the unknowns that `equations` names.

Whatever is told of a rod follows from y = du - B x u, the rate at which its line u turns as seen by the body that an
end of it is on, with angular velocity B: hinges and cones at that end change by t . y, each with a vector t of its own.
"""

from __future__ import annotations

import math

from ...arrays import Floats, Record
from .._jit import routine
from ..legs.answer import deviation
from ..legs.frames import ZERO, put_pose_slope
from ..legs.records import (
    BASE_END,
    BASE_LINE,
    CRANK,
    CROSS,
    HINGE,
    PIVOT,
    PLATFORM_END,
    Q_PROXIMAL,
    SLIDE,
    TRIPLE,
    Table,
)
from ..legs.rods import base_end_of, turned_by_proximal, twist_mark
from ..vectors import Vec, along, angle_between, cross, dot, norm, scale, sub, turn, vec
from .equations import LegEvaluation, direction, main_of, put_rate, put_redundant_slopes

AT_BASE_END, AT_PLATFORM_END = 0, 1
# Sine below which a line is straight along the axis of its cone: no direction leads in or out.
ALIGNED = 1e-12


@routine
def put_turning(table: Table, k: int, main: int, end: int, t: Vec, leg_eval: LegEvaluation) -> None:
    """Derivative, into `leg_eval.slope`, of what changes by t . y at an end of a rod."""
    u = direction(leg_eval.lines[k])
    flat = along(t, -dot(t, u), u)
    a, spin = scale(1.0 / norm(vec(leg_eval.lines[k])), flat), scale(-1.0, cross(u, t))
    b, c = (spin, ZERO) if end == AT_BASE_END else (ZERO, spin)
    put_rate(table, k, main, a, b, c, leg_eval, leg_eval.slope)


@routine
def seen(table: Table, k: int, main: int, end: int, v: Vec, leg_eval: LegEvaluation) -> Vec:
    """A direction that goes with the body which an end of a rod is on, as it is now."""
    if end == AT_BASE_END:
        return turned_by_proximal(table.legs[main], leg_eval.values[main], v, 1.0)
    return turn(leg_eval.frames[table.legs[k]["frame"]], v)


@routine
def counts_turns(coordinate: Record) -> bool:
    """Whether an angle may be a full turn from where it is."""
    return bool(coordinate["turns"] == 1 and coordinate["hi"] - coordinate["lo"] > 2.0 * math.pi)


@routine
def coordinate_slope(table: Table, coordinate: Record, leg_eval: LegEvaluation) -> float:
    """A coordinate's deviation from home, its derivative into `leg_eval.slope`."""
    slope, k, spot = leg_eval.slope, coordinate["leg"], coordinate["place"]
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    leg = table.legs[k]
    if leg["kind"] == PIVOT:
        put_pivot_slope(leg, leg_eval.frames[leg["frame"]], leg_eval.values[k], spot, leg_eval.slope)
        put_redundant_slopes(table, k, leg_eval, leg_eval.slope)
    elif spot == Q_PROXIMAL:
        slope[table.columns[k]] = 1.0
    elif spot == SLIDE:
        put_rate(table, k, main_of(table, k), direction(leg_eval.lines[k]), ZERO, ZERO, leg_eval, leg_eval.slope)
    else:
        put_hinge_slope(table, k, spot, leg_eval)
    for j in range(slope.shape[0]):
        slope[j] *= coordinate["sense"]
    return deviation(coordinate, leg_eval.values)


@routine
def put_hinge_slope(table: Table, k: int, spot: int, leg_eval: LegEvaluation) -> None:
    """Derivative of the angle of a hinge at an end of a rod.

    One hinge n: (n x u) . y / |n x u|^2. Two, a on the body and b on the rod: q1' = b . y / D, q2' = - a . y / D,
    D = (a x u) . b.
    """
    leg, main, u = table.legs[k], main_of(table, k), direction(leg_eval.lines[k])
    end = AT_BASE_END if spot < PLATFORM_END else AT_PLATFORM_END
    ending, axes = (
        (leg["base_end"], leg["base_end_axes"])
        if end == AT_BASE_END
        else (leg["platform_end"], leg["platform_end_axes"])
    )
    first = seen(table, k, main, end, vec(axes[0]), leg_eval)
    if ending == HINGE:
        across = cross(first, u)
        t = scale(1.0 / dot(across, across), across)
    else:
        place = BASE_END if end == AT_BASE_END else PLATFORM_END
        last = seen(table, k, main, end, twist_mark(ending, axes, leg_eval.values[k, place:]), leg_eval)
        D = dot(cross(first, u), last)
        t = scale(1.0 / D, last) if spot == place else scale(-1.0 / D, first)
    put_turning(table, k, main, end, t, leg_eval)


@routine
def put_pivot_slope(pivot: Record, frame: Floats, own: Floats, spot: int, slope: Floats) -> None:
    """Derivative of a coordinate of a pivot: a slide, or one of up to three hinges that add up to its turn w."""
    if spot >= PLATFORM_END:
        put_pose_slope(pivot, frame, vec(pivot["slide_rows"][spot - PLATFORM_END]), ZERO, slope)
        return
    axes, which = pivot["base_end_axes"], spot - BASE_END
    first = vec(axes[0])
    if pivot["base_end"] == HINGE:
        put_pose_slope(pivot, frame, ZERO, first, slope)
        return
    second = twist_mark(CROSS, axes, own[BASE_END:])
    if pivot["base_end"] == TRIPLE:
        third = turn(frame, vec(axes[2]))
        others = cross(second, third) if which == 0 else (cross(third, first) if which == 1 else cross(first, second))
        D = dot(first, cross(second, third))
        put_pose_slope(pivot, frame, ZERO, scale(1.0 / math.copysign(max(abs(D), ALIGNED), D), others), slope)
        return
    lean = dot(first, second)
    own_axis, other = (first, second) if which == 0 else (second, first)
    rate = scale(1.0 / (1.0 - lean * lean), along(own_axis, -lean, other))
    put_pose_slope(pivot, frame, ZERO, rate, slope)


@routine
def cone_slope(table: Table, cone: Record, leg_eval: LegEvaluation) -> float:
    """The angle of a rod's line from the axis of its cone, its derivative into `leg_eval.slope`.

    Or that of a pivot's third hinge, which goes with the platform, from an axis that does not.
    """
    slope, k = leg_eval.slope, cone["leg"]
    if table.legs[k]["kind"] == PIVOT:
        return pivot_cone_slope(table, cone, leg_eval)
    end = AT_BASE_END if cone["place"] == BASE_LINE else AT_PLATFORM_END
    main = main_of(table, k)
    axis, u = seen(table, k, main, end, vec(cone["axis"]), leg_eval), direction(leg_eval.lines[k])
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    sine = norm(cross(axis, u))
    if sine > ALIGNED:
        put_turning(table, k, main, end, scale(-1.0 / sine, axis), leg_eval)
    return angle_between(axis, u)


@routine
def pivot_cone_slope(table: Table, cone: Record, leg_eval: LegEvaluation) -> float:
    """`cone_slope` of a pivot."""
    slope, k = leg_eval.slope, cone["leg"]
    leg, axis, line = table.legs[k], vec(cone["axis"]), vec(leg_eval.values[k, BASE_LINE:])
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    across = cross(axis, line)
    if norm(across) > ALIGNED:
        put_pose_slope(leg, leg_eval.frames[leg["frame"]], ZERO, scale(1.0 / norm(across), across), slope)
        put_redundant_slopes(table, k, leg_eval, slope)
    return angle_between(axis, line)


@routine
def dead_point_slope(table: Table, k: int, leg_eval: LegEvaluation) -> float:
    """The rate at which a carrier shortens its rod, zero where the rod is stretched out over it; its derivative into
    `leg_eval.slope`.

    With the foot's rate f by the carrier, which goes with the carrier, and the rod's line u: f . u. Its sign tells the
    two solutions of the leg apart.
    """
    slope, leg, own = leg_eval.slope, table.legs[k], leg_eval.values[k]
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    axis = vec(leg["proximal_axis"])
    if leg["proximal"] == CRANK:
        axis = cross(axis, sub(base_end_of(leg, leg, own), vec(leg["proximal_point"])))
    put_turning(table, k, k, AT_BASE_END, axis, leg_eval)
    return dot(axis, direction(leg_eval.lines[k]))
