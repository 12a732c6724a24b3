"""Legs in the pose of the platform and the coordinates of what carries their rods: equations, limits, derivatives.

Nothing is eliminated here, so that all of it is smooth where rods are stretched out over what carries them, and both
working modes are one set. Unknowns, n of them: the twist of the platform (velocity of its reference point, angular
velocity), then one for each crank and carriage, then one for each arm. Equations, besides those that `legs` leave on
the pose: each rod on a crank or carriage has its length.

Whatever is told of a rod follows from y = du - B x u, the rate at which its line u turns as seen by the body that an
end of it is on, with angular velocity B: hinges and cones at that end change by t . y, each with a vector t of its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._jit import allocator, routine
from ..legs.answer import deviation, end_of_rows
from ..legs.endings import turned
from ..legs.frames import NOWHERE, by_arm, coordinate_of, facing, new_frames, place_arm, put_pose_slope, set_frames
from ..legs.pivots import pivot_rows, pivot_slopes, place_pivot
from ..legs.records import (
    ARM,
    CARRIAGE,
    CARRIER,
    COSINE,
    CRANK,
    CROSS,
    FOOT,
    FOOT_LINE,
    HEAD,
    HINGE,
    N_VALUES,
    PIVOT,
    ROD,
    SHARED,
    SINE,
    SLIDE,
    TRIPLE,
    Floats,
    Record,
    Table,
)
from ..legs.rods import (
    carried,
    carried_foot,
    carrier_rate,
    carry,
    mark,
    read_rod,
    rod_rows,
    twist_rate,
)
from ..vectors import Vec, along, angle_between, cross, dot, move, norm, scale, sub, turn, vec, wrap

AT_FOOT, AT_HEAD = 0, 1
# Sine below which a line is straight along the axis of its cone: no direction leads in or out.
ALIGNED = 1e-12
# How far from a dead point, as `carry` says, a carrier must be to be put where its rod has its length.
SURELY = 1e-2


class Now(NamedTuple):
    """A configuration under work."""

    pose: Floats  # (4, 4) [L]
    q: Floats  # (legs,): of its carrier, or of an arm, deviation from home [L or rad]
    sides: Floats  # (legs,): which of its two solutions a pivot of three hinges takes


class View(NamedTuple):
    """What legs are like at a configuration."""

    frames: Floats  # (n, 7, 4): see `legs.frames`
    values: Floats  # (legs, N_VALUES)
    lines: Floats  # (legs, 3): of a rod, from foot to head
    rows: Floats  # (m,): the equations
    slopes: Floats  # (m, n): their derivatives
    slope: Floats  # (n,): that of a limit


@allocator
def new_now(legs: int) -> Now:
    """Memory for a configuration."""
    return Now(np.zeros((4, 4)), np.zeros(legs), np.zeros(legs))


@allocator
def new_view(table: Table) -> View:
    """Memory for what is told of it."""
    legs, n = table.legs.shape[0], count_unknowns(table)
    m = table.task[0]["rows"] + count_carried(table)
    values, lines = np.zeros((legs, N_VALUES)), np.zeros((legs, 3))
    return View(new_frames(table.legs), values, lines, np.zeros(m), np.zeros((m, n)), np.zeros(n))


@routine
def count_unknowns(table: Table) -> int:
    n = 6
    for k in range(table.columns.shape[0]):
        n = max(n, table.columns[k] + 1)
    return n


@routine
def count_carried(table: Table) -> int:
    """How many rods have a carrier of their own."""
    n = 0
    for k in range(table.legs.shape[0]):
        n += 1 if is_carried(table.legs[k]) else 0
    return n


@routine
def is_carried(leg: Record) -> bool:
    """Whether a leg is a rod with a carrier of its own."""
    return bool(leg["kind"] == ROD and (leg["carrier"] == CRANK or leg["carrier"] == CARRIAGE))


@routine
def place(table: Table, now: Now, view: View) -> float:
    """Read all legs at a configuration, and fill the equations; the largest of them, infinite if not a number."""
    legs, rows, main = table.legs, view.rows, 0
    set_frames(now.pose, table.task[0], view.frames)
    for k in range(legs.shape[0]):
        main = main if legs[k]["carrier"] == SHARED else k
        place_leg(table, k, main, now, view)
    worst = 0.0
    for i in range(rows.shape[0]):
        if not abs(rows[i]) <= worst:
            worst = abs(rows[i])
    return worst if worst == worst else math.inf


@routine
def place_leg(table: Table, k: int, main: int, now: Now, view: View) -> None:
    """Read one leg at a configuration whose `view.frames` are filled, and fill its equations.

    Parameters
    ----------
    main : the leg whose carrier it is on, read before; itself if it is on none but its own.
    """
    legs, values, lines, rows = table.legs, view.values, view.lines, view.rows
    leg, lead = legs[k], legs[main]
    frame = view.frames[leg["frame"]]
    if leg["kind"] == PIVOT:
        place_pivot(leg, frame, now.sides[k], values[k])
        pivot_rows(leg, frame, view.rows)
    elif leg["kind"] == ARM:
        place_arm(leg, coordinate_of(legs, k, now.q), view.frames, values[k])
    elif leg["kind"] == ROD:
        if is_carried(leg):
            values[k, CARRIER] = now.q[k]
            values[k, COSINE], values[k, SINE] = math.cos(now.q[k]), math.sin(now.q[k])
        read_rod(leg, lead, frame, values[main], values[k], lines[k])
        rod_rows(leg, lead, frame, values[main], values[k], lines[k], view.rows)
        if is_carried(leg):
            rows[own_row(table, k)] = values[k, SLIDE]


@routine
def close_rods(table: Table, now: Now, view: View) -> None:
    """Bring carriers to where their rods have their lengths, on the sides that they are on, but not near dead points:
    there a pose says little of them."""
    q, own = now.q, view.values
    set_frames(now.pose, table.task[0], view.frames)
    for k in range(q.shape[0]):
        leg = table.legs[k]
        if leg["by_plane"] == 1:
            frame, rod = view.frames[leg["frame"]], table.legs[k + 1]
            found, sure = facing(leg, rod, frame, side_of_arm(leg, rod, frame, q[k]))
            if sure > SURELY:
                q[k] = wrap(found, q[k]) if leg["carrier"] == CRANK else found
        if leg["kind"] == ARM:
            place_arm(leg, coordinate_of(table.legs, k, q), view.frames, own[k])
        if is_carried(leg):
            head = move(view.frames[leg["frame"]], vec(leg["head_point"]))
            if carry(leg, head, side_of(leg, head, q[k]), own[k]) > SURELY:
                q[k] = wrap(own[k, CARRIER], q[k]) if leg["carrier"] == CRANK else own[k, CARRIER]


@routine
def side_of(rod: Record, head: Vec, q: float) -> float:
    """The side of a carrier: of its dead point, where the rod comes nearest to the head."""
    if rod["carrier"] == CRANK:
        x = sub(head, vec(rod["carrier_point"]))
        return math.copysign(
            1.0, dot(vec(rod["spoke"]), x) * math.sin(q) - dot(vec(rod["spoke_across"]), x) * math.cos(q)
        )
    return math.copysign(1.0, q - dot(sub(head, vec(rod["foot_point"])), vec(rod["carrier_axis"])))


@routine
def side_of_arm(arm: Record, rod: Record, frame: Floats, q: float) -> float:
    """The same of an arm that `facing` places: by which way the plane turns away from the head."""
    axis, n = vec(arm["carrier_axis"]), vec(rod["foot_axes"][0])
    x = sub(move(frame, vec(rod["head_point"])), vec(arm["carrier_point"]))
    return math.copysign(1.0, dot(cross(turned(n, axis, math.cos(q), math.sin(q)), axis), x))


@routine
def own_row(table: Table, k: int) -> int:
    """The equation by which the rod of a carrier has its length."""
    return int(table.task[0]["rows"] - 6 + table.columns[k])


@routine
def put_slopes(table: Table, view: View) -> None:
    """Fill the derivatives of the equations."""
    legs, slopes, main = table.legs, view.slopes, 0
    for i in range(slopes.shape[0]):
        for j in range(6, slopes.shape[1]):
            slopes[i, j] = 0.0
    for k in range(legs.shape[0]):
        main = main if legs[k]["carrier"] == SHARED else k
        put_leg_slopes(table, k, main, view)


@routine
def put_leg_slopes(table: Table, k: int, main: int, view: View) -> None:
    """Fill the derivatives of one leg's equations, by the unknowns that they have."""
    leg, slopes = table.legs[k], view.slopes
    if leg["kind"] == PIVOT:
        pivot_slopes(leg, view.frames[leg["frame"]], view.slopes)
        for row in range(leg["first_row"], end_of_rows(table.legs, k, table.task[0]["rows"])):
            put_arm_slopes(table, k, view, slopes[row])
    elif leg["kind"] == ROD:
        if is_carried(leg):
            put_rate(table, k, k, direction(view.lines[k]), NOWHERE, NOWHERE, view, slopes[own_row(table, k)])
        put_rod_slopes(table, k, main, view)


@routine
def direction(line: Floats) -> Vec:
    return scale(1.0 / norm(vec(line)), vec(line))


@routine
def put_rate(table: Table, k: int, main: int, a: Vec, b: Vec, c: Vec, view: View, slope: Floats) -> None:
    """Derivative (n,) of a . (dH - dF) + b . W + c . w of a rod; only the entries of its unknowns are written.

    Parameters
    ----------
    main : the leg whose carrier it is on; itself if on none.
    """
    rod, carrier, column = table.legs[k], table.legs[main], table.columns[main]
    put_pose_slope(rod, view.frames[rod["frame"]], a, c, slope)
    if column >= 0:
        slope[column] = carrier_rate(carrier, carried_foot(rod, carrier, view.values[main]), a, b)
    put_arm_slopes(table, k, view, slope)


@routine
def put_arm_slopes(table: Table, k: int, view: View, slope: Floats) -> None:
    """Derivatives by the arms that a leg is on, from those by the pose."""
    arm = table.legs[k]["arm"]
    while arm >= 0:
        slope[table.columns[arm]] = 0.0
        arm = table.legs[arm]["arm"]
    arm = table.legs[k]["arm"]
    while arm >= 0:
        slope[table.columns[arm]] += by_arm(slope, view.values[arm])
        arm = table.legs[arm]["arm"]
    if table.legs[k]["inner"] == 1:
        for j in range(6):
            slope[j] = 0.0


@routine
def put_rod_slopes(table: Table, k: int, main: int, view: View) -> None:
    """Fill the derivatives of the equations that `rod_rows` fills."""
    rod, carrier, lead, slopes = table.legs[k], table.legs[main], view.values[main], view.slopes
    frame, n, span, u = view.frames[rod["frame"]], rod["first_row"], vec(view.lines[k]), direction(view.lines[k])
    if rod["slides"] == 0 and not is_carried(rod):
        put_rate(table, k, main, u, NOWHERE, NOWHERE, view, slopes[n])
        n += 1
    if rod["foot"] == HINGE:
        axis = carried(carrier, lead, vec(rod["foot_axes"][0]), 1.0)
        put_rate(table, k, main, axis, cross(axis, span), NOWHERE, view, slopes[n])
        n += 1
    if rod["head"] == HINGE:
        axis = turn(frame, vec(rod["head_axes"][0]))
        put_rate(table, k, main, axis, NOWHERE, cross(axis, span), view, slopes[n])
        n += 1
    if rod["twists"] == 1:
        by_line, b, c = twist_rate(rod, carrier, frame, lead, view.values[k], u)
        by_line = scale(1.0 / norm(span), along(by_line, -dot(by_line, u), u))
        put_rate(table, k, main, by_line, b, c, view, slopes[n])


@routine
def put_turning(table: Table, k: int, main: int, end: int, t: Vec, view: View) -> None:
    """Derivative, into `view.slope`, of what changes by t . y at an end of a rod."""
    u = direction(view.lines[k])
    flat = along(t, -dot(t, u), u)
    a, spin = scale(1.0 / norm(vec(view.lines[k])), flat), scale(-1.0, cross(u, t))
    b, c = (spin, NOWHERE) if end == AT_FOOT else (NOWHERE, spin)
    put_rate(table, k, main, a, b, c, view, view.slope)


@routine
def seen(table: Table, k: int, main: int, end: int, v: Vec, view: View) -> Vec:
    """A direction that goes with the body which an end of a rod is on, as it is now."""
    if end == AT_FOOT:
        return carried(table.legs[main], view.values[main], v, 1.0)
    return turn(view.frames[table.legs[k]["frame"]], v)


@routine
def counts_turns(coordinate: Record) -> bool:
    """Whether an angle may be a full turn from where it is."""
    return bool(coordinate["turns"] == 1 and coordinate["hi"] - coordinate["lo"] > 2.0 * math.pi)


@routine
def main_of(table: Table, k: int) -> int:
    """The leg whose carrier a leg is on; itself if it is on none but its own."""
    while table.legs[k]["carrier"] == SHARED:
        k -= 1
    return k


@routine
def coordinate_slope(table: Table, coordinate: Record, view: View) -> float:
    """A coordinate's deviation from home, its derivative into `view.slope`."""
    slope, k, spot = view.slope, coordinate["leg"], coordinate["place"]
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    leg = table.legs[k]
    if leg["kind"] == PIVOT:
        put_pivot_slope(leg, view.frames[leg["frame"]], view.values[k], spot, view.slope)
        put_arm_slopes(table, k, view, view.slope)
    elif spot == CARRIER:
        slope[table.columns[k]] = 1.0
    elif spot == SLIDE:
        put_rate(table, k, main_of(table, k), direction(view.lines[k]), NOWHERE, NOWHERE, view, view.slope)
    else:
        put_hinge_slope(table, k, spot, view)
    for j in range(slope.shape[0]):
        slope[j] *= coordinate["sense"]
    return deviation(coordinate, view.values)


@routine
def put_hinge_slope(table: Table, k: int, spot: int, view: View) -> None:
    """Derivative of the angle of a hinge at an end of a rod.

    One hinge n: (n x u) . y / |n x u|^2. Two, a on the body and b on the rod: q1' = b . y / D, q2' = - a . y / D,
    D = (a x u) . b.
    """
    leg, main, u = table.legs[k], main_of(table, k), direction(view.lines[k])
    end = AT_FOOT if spot < HEAD else AT_HEAD
    ending, axes = (leg["foot"], leg["foot_axes"]) if end == AT_FOOT else (leg["head"], leg["head_axes"])
    first = seen(table, k, main, end, vec(axes[0]), view)
    if ending == HINGE:
        across = cross(first, u)
        t = scale(1.0 / dot(across, across), across)
    else:
        place = FOOT if end == AT_FOOT else HEAD
        last = seen(table, k, main, end, mark(ending, axes, view.values[k, place:]), view)
        D = dot(cross(first, u), last)
        t = scale(1.0 / D, last) if spot == place else scale(-1.0 / D, first)
    put_turning(table, k, main, end, t, view)


@routine
def put_pivot_slope(pivot: Record, frame: Floats, own: Floats, spot: int, slope: Floats) -> None:
    """Derivative of a coordinate of a pivot: a slide, or one of up to three hinges that add up to its turn w."""
    if spot >= HEAD:
        put_pose_slope(pivot, frame, vec(pivot["slide_rows"][spot - HEAD]), NOWHERE, slope)
        return
    axes, which = pivot["foot_axes"], spot - FOOT
    first = vec(axes[0])
    if pivot["foot"] == HINGE:
        put_pose_slope(pivot, frame, NOWHERE, first, slope)
        return
    second = mark(CROSS, axes, own[FOOT:])
    if pivot["foot"] == TRIPLE:
        third = turn(frame, vec(axes[2]))
        others = cross(second, third) if which == 0 else (cross(third, first) if which == 1 else cross(first, second))
        D = dot(first, cross(second, third))
        put_pose_slope(pivot, frame, NOWHERE, scale(1.0 / D, others), slope)
        return
    lean = dot(first, second)
    own_axis, other = (first, second) if which == 0 else (second, first)
    rate = scale(1.0 / (1.0 - lean * lean), along(own_axis, -lean, other))
    put_pose_slope(pivot, frame, NOWHERE, rate, slope)


@routine
def cone_slope(table: Table, cone: Record, view: View) -> float:
    """The angle of a rod's line from the axis of its cone, its derivative into `view.slope`."""
    slope, k = view.slope, cone["leg"]
    end = AT_FOOT if cone["place"] == FOOT_LINE else AT_HEAD
    main = main_of(table, k)
    axis, u = seen(table, k, main, end, vec(cone["axis"]), view), direction(view.lines[k])
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    sine = norm(cross(axis, u))
    if sine > ALIGNED:
        put_turning(table, k, main, end, scale(-1.0 / sine, axis), view)
    return angle_between(axis, u)


@routine
def dead_point_slope(table: Table, k: int, view: View) -> float:
    """The rate at which a carrier shortens its rod, zero where the rod is stretched out over it; its derivative into
    `view.slope`.

    With the foot's rate f by the carrier, which goes with the carrier, and the rod's line u: f . u. Its sign tells the
    two solutions of the leg apart.
    """
    slope, leg, own = view.slope, table.legs[k], view.values[k]
    for j in range(slope.shape[0]):
        slope[j] = 0.0
    axis = vec(leg["carrier_axis"])
    if leg["carrier"] == CRANK:
        axis = cross(axis, sub(carried_foot(leg, leg, own), vec(leg["carrier_point"])))
    put_turning(table, k, k, AT_FOOT, axis, view)
    return dot(axis, direction(view.lines[k]))
