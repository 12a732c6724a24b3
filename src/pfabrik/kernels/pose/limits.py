"""Limits of legs and distances of their links, with their derivatives by the unknowns of `equations`.

The derivatives of a rod's coordinates follow from y = du - B x u, the rate of its direction u in the body at one of its
ends, which has angular velocity B: hinges and cones at that end change by t . y, each with its own vector t.

Their bodies are numbered: the base, the platform, or the leg on whose crank or carriage they are.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine
from ..clearance.link_limits import put_pulls
from ..clearance.link_records import BASE, PLATFORM, LinkLimits
from ..clearance.solids import CAPSULE, KIND
from ..legs.answer import deviation
from ..legs.endings import turned
from ..legs.frames import CENTRE, ZERO, put_pose_slope
from ..legs.records import (
    BASE_END,
    BASE_LINE,
    COSINE,
    CRANK,
    CROSS,
    FROM_BASE,
    HINGE,
    PIVOT,
    PLATFORM_END,
    Q_PROXIMAL,
    SINE,
    SLIDE,
    TRIPLE,
    Table,
)
from ..legs.rods import base_end_of, turned_by_proximal, twist_mark
from ..vectors import Vec, add, along, angle_between, cross, dot, move, norm, put, scale, sub, turn, vec
from .equations import LegEvaluation, direction, owner_of, put_rate, put_redundant_slopes

AT_BASE_END, AT_PLATFORM_END = 0, 1
# Sine below which a line is along the axis of its cone, and the gradient of the angle undefined.
ALIGNED = 1e-12


@routine
def put_turning(table: Table, k: int, owner: int, end: int, t: Vec, leg_eval: LegEvaluation) -> None:
    """Fill `leg_eval.slope` with the derivative of a quantity that changes by t . y at an end of a rod."""
    u = direction(leg_eval.lines[k])
    normal_part = along(t, -dot(t, u), u)
    a, spin = scale(1.0 / norm(vec(leg_eval.lines[k])), normal_part), scale(-1.0, cross(u, t))
    b, c = (spin, ZERO) if end == AT_BASE_END else (ZERO, spin)
    put_rate(table, k, owner, a, b, c, leg_eval, leg_eval.slope)


@routine
def current_direction(table: Table, k: int, owner: int, end: int, v: Vec, leg_eval: LegEvaluation) -> Vec:
    """Current direction of a vector fixed in the body at an end of a rod, given at home."""
    if end == AT_BASE_END:
        return turned_by_proximal(table.legs[owner], leg_eval.values[owner], v, 1.0)
    return turn(leg_eval.frames[table.legs[k]["frame"]], v)


@routine
def is_multiturn(coordinate: Record) -> bool:
    """True if an angle has a range of more than one turn."""
    return bool(coordinate["turns"] == 1 and coordinate["hi"] - coordinate["lo"] > 2.0 * math.pi)


@routine
def coordinate_slope(table: Table, coordinate: Record, leg_eval: LegEvaluation) -> float:
    """Deviation of a coordinate from home; its derivative goes into `leg_eval.slope`."""
    slope, k, entry = leg_eval.slope, coordinate["leg"], coordinate["place"]
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    leg = table.legs[k]
    if leg["kind"] == PIVOT:
        put_pivot_slope(leg, leg_eval.frames[leg["frame"]], leg_eval.values[k], entry, leg_eval.slope)
        put_redundant_slopes(table, k, leg_eval, leg_eval.slope)
    elif entry == Q_PROXIMAL:
        slope[table.columns[k]] = 1.0
    elif entry == SLIDE:
        put_rate(table, k, owner_of(table, k), direction(leg_eval.lines[k]), ZERO, ZERO, leg_eval, leg_eval.slope)
    else:
        put_hinge_slope(table, k, entry, leg_eval)
    for j in range(slope.shape[0]):
        slope[j] *= coordinate["sense"]
    return deviation(coordinate, leg_eval.values)


@routine
def put_hinge_slope(table: Table, k: int, entry: int, leg_eval: LegEvaluation) -> None:
    """Derivative of the angle of a hinge at an end of a rod.

    One hinge n: (n x u) . y / |n x u|^2. Two hinges, a on the body and b on the rod, with D = (a x u) . b:
    q1' = b . y / D, q2' = - a . y / D.
    """
    leg, owner, u = table.legs[k], owner_of(table, k), direction(leg_eval.lines[k])
    end = AT_BASE_END if entry < PLATFORM_END else AT_PLATFORM_END
    ending, axes = (
        (leg["base_end"], leg["base_end_axes"])
        if end == AT_BASE_END
        else (leg["platform_end"], leg["platform_end_axes"])
    )
    first = current_direction(table, k, owner, end, vec(axes[0]), leg_eval)
    if ending == HINGE:
        across = cross(first, u)
        t = scale(1.0 / dot(across, across), across)
    else:
        place = BASE_END if end == AT_BASE_END else PLATFORM_END
        last = current_direction(table, k, owner, end, twist_mark(ending, axes, leg_eval.values[k, place:]), leg_eval)
        D = dot(cross(first, u), last)
        t = scale(1.0 / D, last) if entry == place else scale(-1.0 / D, first)
    put_turning(table, k, owner, end, t, leg_eval)


@routine
def put_pivot_slope(pivot: Record, frame: Floats, values: Floats, entry: int, slope: Floats) -> None:
    """Derivative of a coordinate of a pivot: a slide, or one of up to three hinges whose rates sum to w."""
    if entry >= PLATFORM_END:
        put_pose_slope(pivot, frame, vec(pivot["slide_rows"][entry - PLATFORM_END]), ZERO, slope)
        return
    axes, index = pivot["base_end_axes"], entry - BASE_END
    first = vec(axes[0])
    if pivot["base_end"] == HINGE:
        put_pose_slope(pivot, frame, ZERO, first, slope)
        return
    second = twist_mark(CROSS, axes, values[BASE_END:])
    if pivot["base_end"] == TRIPLE:
        third = turn(frame, vec(axes[2]))
        normal = cross(second, third) if index == 0 else (cross(third, first) if index == 1 else cross(first, second))
        D = dot(first, cross(second, third))
        put_pose_slope(pivot, frame, ZERO, scale(1.0 / math.copysign(max(abs(D), ALIGNED), D), normal), slope)
        return
    cosine = dot(first, second)
    axis, other = (first, second) if index == 0 else (second, first)
    rate = scale(1.0 / (1.0 - cosine * cosine), along(axis, -cosine, other))
    put_pose_slope(pivot, frame, ZERO, rate, slope)


@routine
def cone_slope(table: Table, cone: Record, leg_eval: LegEvaluation) -> float:
    """Angle of a rod's line from the axis of its cone; its derivative goes into `leg_eval.slope`.

    For a pivot: the angle of its third hinge, fixed in the platform, from an axis fixed in the base.
    """
    slope, k = leg_eval.slope, cone["leg"]
    if table.legs[k]["kind"] == PIVOT:
        return pivot_cone_slope(table, cone, leg_eval)
    end = AT_BASE_END if cone["place"] == BASE_LINE else AT_PLATFORM_END
    owner = owner_of(table, k)
    axis, u = current_direction(table, k, owner, end, vec(cone["axis"]), leg_eval), direction(leg_eval.lines[k])
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    sine = norm(cross(axis, u))
    if sine > ALIGNED:
        put_turning(table, k, owner, end, scale(-1.0 / sine, axis), leg_eval)
    return angle_between(axis, u)


@routine
def pivot_cone_slope(table: Table, cone: Record, leg_eval: LegEvaluation) -> float:
    """The angle of `cone_slope` for a pivot."""
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
    """Rate f . u at which a proximal joint shortens its rod, zero at a dead point.

    f is the rate of the base end by the proximal coordinate, which moves with the joint, and u the rod's direction. The
    sign is opposite to the leg's side. The derivative goes into `leg_eval.slope`.
    """
    slope, leg, values = leg_eval.slope, table.legs[k], leg_eval.values[k]
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    axis = vec(leg["proximal_axis"])
    if leg["proximal"] == CRANK:
        axis = cross(axis, sub(base_end_of(leg, leg, values), vec(leg["proximal_point"])))
    put_turning(table, k, k, AT_BASE_END, axis, leg_eval)
    return dot(axis, direction(leg_eval.lines[k]))


@routine
def place_links(table: Table, links: LinkLimits, frames: Floats, values: Floats) -> None:
    """Fill the places of all links, with legs evaluated."""
    for i in range(links.home.shape[0]):
        is_capsule = links.sizes[i, KIND] == CAPSULE
        for k in range(4):
            at, body = vec(links.home[i, k]), links.bodies[i, 1 if is_capsule and k == 1 else 0]
            put(links.places[i, k], place_in(table, body, at, is_capsule or k == 0, frames, values))


@routine
def are_on_legs(links: LinkLimits) -> bool:
    """True if some links move with proximal joints."""
    for i in range(links.bodies.shape[0]):
        if max(links.bodies[i, 0], links.bodies[i, 1]) >= 0:
            return True
    return False


@routine
def place_in(table: Table, body: int, at: Vec, is_point: bool, frames: Floats, values: Floats) -> Vec:
    """A point of a body, or a direction in it, given at home, where it is now."""
    if body == BASE:
        return at
    if body == PLATFORM:
        frame = frames[FROM_BASE]
        return move(frame, sub(at, vec(table.task[0]["reference"]))) if is_point else turn(frame, at)
    leg = table.legs[body]
    axis, point = vec(leg["proximal_axis"]), vec(leg["proximal_point"])
    if leg["proximal"] == CRANK:
        lever = turned(sub(at, point) if is_point else at, axis, values[body, COSINE], values[body, SINE])
        return add(point, lever) if is_point else lever
    return along(at, values[body, Q_PROXIMAL], axis) if is_point else at


@routine
def add_pair_slope(
    table: Table, links: LinkLimits, pair: int, excess: float, factor: float, leg_eval: LegEvaluation, out: Floats
) -> None:
    """Add a factor times the derivative of the excess of the pair that was measured last."""
    put_pulls(links, pair, excess, factor)
    for end in range(4):
        body = links.bodies[links.pairs[pair, end // 2], end % 2]
        add_force(table, body, vec(links.pulls[end]), vec(links.pulls[end, 3:]), leg_eval, out)


@routine
def add_force(table: Table, body: int, x: Vec, force: Vec, leg_eval: LegEvaluation, out: Floats) -> None:
    """Add the generalised force of a force at a point of a body."""
    if body == PLATFORM:
        moment = cross(sub(x, vec(leg_eval.frames[FROM_BASE, CENTRE])), force)
        for i in range(3):
            out[i] += force[i]
            out[3 + i] += moment[i]
    elif body >= 0:
        leg = table.legs[body]
        rate = vec(leg["proximal_axis"])
        if leg["proximal"] == CRANK:
            rate = cross(rate, sub(x, vec(leg["proximal_point"])))
        out[table.columns[body]] += dot(force, rate)
