"""A rod between its foot, which a hinge or a slide may carry, and its head, at a pose.

With F the foot, H the head, l = H - F, u = l / |l|, each rod leaves some of these constraints on the pose:

- `length`, rigid rods that no carrier is turned for: |l| - length;
- `base_end`, a foot on one hinge n: n . l;
- `platform_end`, a head on one hinge m: m . l;
- `twist`, both ends keep the rod from spinning: the angle about u between marks that go with its ends, less home's.

The derivative of each is a . (dH - dF) + b . W + c . w, with W and w the angular velocities of the bodies of foot and
head.
"""

from __future__ import annotations

import math

from ...arrays import Floats, Record
from .._jit import routine
from ..vectors import Vec, add, along, cross, dot, move, norm, put, scale, sub, turn, vec, wrap
from .endings import aim, angle_to, either_angle, turned, turned_back
from .frames import NOWHERE, put_pose_slope
from .records import (
    BASE_END,
    BASE_LINE,
    CARRIAGE,
    COSINE,
    CRANK,
    CROSS,
    HINGE,
    NO_PROXIMAL,
    PLATFORM_END,
    PLATFORM_LINE,
    Q_PROXIMAL,
    SHARED,
    SINE,
    SLIDE,
)


@routine
def solve_proximal(rod: Record, platform_end: Vec, side: float, own: Floats) -> float:
    """Turn the crank, or move the carriage, until the rod reaches its platform end; the singularity margin.

    A crank: |o + spoke cos q + across sin q - H| = length; a carriage: |F + q a - H| = length. Where none reaches, it
    stays where it comes nearest.
    """
    if rod["proximal"] == CRANK:
        x, crank = sub(platform_end, vec(rod["proximal_point"])), vec(rod["crank"])
        C = 0.5 * (dot(x, x) + dot(crank, crank) - rod["length"] * rod["length"])
        cosine, sine, singularity_margin = either_angle(dot(crank, x), dot(vec(rod["crank_across"]), x), C, side)
        own[COSINE], own[SINE] = cosine, sine
        own[Q_PROXIMAL] = math.atan2(sine, cosine)
        return singularity_margin
    x = sub(platform_end, vec(rod["base_end_point"]))
    middle = dot(x, vec(rod["proximal_axis"]))
    square = rod["length"] * rod["length"]
    rest = square - dot(x, x) + middle * middle
    own[Q_PROXIMAL] = middle + side * math.sqrt(max(rest, 0.0))
    return rest / square


@routine
def base_end_of(rod: Record, proximal: Record, own: Floats) -> Vec:
    """Where the foot is, with the carrier (the rod's, or the one it shares) as `own` says."""
    if proximal["proximal"] == NO_PROXIMAL:
        return vec(rod["base_end_point"])
    if proximal["proximal"] == CARRIAGE:
        return along(vec(rod["base_end_point"]), own[Q_PROXIMAL], vec(proximal["proximal_axis"]))
    if rod["proximal"] == SHARED:
        point = vec(proximal["proximal_point"])
        arm = turned(sub(vec(rod["base_end_point"]), point), vec(proximal["proximal_axis"]), own[COSINE], own[SINE])
        return add(point, arm)
    arm = along(scale(own[COSINE], vec(rod["crank"])), own[SINE], vec(rod["crank_across"]))
    return add(vec(rod["proximal_point"]), arm)


@routine
def turned_by_proximal(proximal: Record, own: Floats, v: Vec, sense: float) -> Vec:
    """A direction turned with the crank, or back (sense -1)."""
    if proximal["proximal"] != CRANK:
        return v
    return turned(v, vec(proximal["proximal_axis"]), own[COSINE], sense * own[SINE])


@routine
def place_rod(
    rod: Record, proximal: Record, frame: Floats, side: float, lead: Floats, own: Floats, line: Floats
) -> float:
    """Fill a rod's values, and the present `line` from foot to head; how sure they are, see `LEAST_MARGIN`.

    Parameters
    ----------
    carrier, lead : the rod whose carrier it is on and that rod's values; its own if it shares none.
    """
    singularity_margin = 1.0
    if rod["proximal"] == CRANK or rod["proximal"] == CARRIAGE:
        singularity_margin = solve_proximal(rod, move(frame, vec(rod["platform_end_point"])), side, own)
    return min(singularity_margin, read_rod(rod, proximal, frame, lead, own, line))


@routine
def read_rod(rod: Record, proximal: Record, frame: Floats, lead: Floats, own: Floats, line: Floats) -> float:
    """The same, with the carrier where its values say.

    Two crossed hinges aim a rod in either of two ways, half a turn about it apart: those of home, unless the two ends
    then hold the rod the other way around.
    """
    span = sub(move(frame, vec(rod["platform_end_point"])), base_end_of(rod, proximal, lead))
    length, singularity_margin = norm(span), 1.0
    u, home = scale(1.0 / length, span), vec(rod["line"])
    base_line, platform_line = turned_by_proximal(proximal, lead, u, -1.0), turned_back(frame, u)
    put(line, span)
    put(own[BASE_LINE:PLATFORM_LINE], base_line)
    put(own[PLATFORM_LINE:COSINE], platform_line)
    own[SLIDE] = length - rod["length"]
    if rod["base_end_aimed"] == 1:
        singularity_margin = min(
            singularity_margin,
            aim_end(rod["base_end"], rod["base_end_axes"], home, base_line, rod["base_end_side"], own[BASE_END:SLIDE]),
        )
    if rod["platform_end_aimed"] == 1:
        singularity_margin = min(
            singularity_margin,
            aim_end(
                rod["platform_end"],
                rod["platform_end_axes"],
                home,
                platform_line,
                rod["platform_end_side"],
                own[PLATFORM_END:BASE_LINE],
            ),
        )
    is_crossed = rod["base_end"] == CROSS or rod["platform_end"] == CROSS
    if rod["twists"] == 1 and is_crossed and abs(twist_of(rod, proximal, frame, lead, own, u)) > 0.5 * math.pi:
        if rod["platform_end"] == CROSS:
            aim_end(
                CROSS,
                rod["platform_end_axes"],
                home,
                platform_line,
                -rod["platform_end_side"],
                own[PLATFORM_END:BASE_LINE],
            )
        else:
            aim_end(CROSS, rod["base_end_axes"], home, base_line, -rod["base_end_side"], own[BASE_END:SLIDE])
    return singularity_margin


@routine
def aim_end(ending: int, axes: Floats, home: Vec, line: Vec, side: float, angles: Floats) -> float:
    """Angles of the hinges at an end of a rod, from the body they are on; how sure they are."""
    if ending == HINGE:
        angles[0] = angle_to((axes[0, 0], axes[0, 1], axes[0, 2]), home, line)
        return 1.0
    return aim(axes, home, line, side, angles)


@routine
def mark(ending: int, axes: Floats, angles: Floats) -> Vec:
    """A direction that goes with an end of a rod, as seen by the body it is on: the last hinge."""
    first = (axes[0, 0], axes[0, 1], axes[0, 2])
    if ending == HINGE:
        return first
    return turned((axes[1, 0], axes[1, 1], axes[1, 2]), first, math.cos(angles[0]), math.sin(angles[0]))


@routine
def twist_of(rod: Record, proximal: Record, frame: Floats, lead: Floats, own: Floats, u: Vec) -> float:
    """The angle about a rod's line between marks that go with its ends, less home's."""
    base_end = turned_by_proximal(proximal, lead, mark(rod["base_end"], rod["base_end_axes"], own[BASE_END:SLIDE]), 1.0)
    platform_end = turn(frame, mark(rod["platform_end"], rod["platform_end_axes"], own[PLATFORM_END:BASE_LINE]))
    return wrap(angle_to(u, base_end, platform_end) - rod["twist"], 0.0)


@routine
def spin_rate(ending: int, first: Vec, last: Vec, u: Vec) -> tuple[Vec, Vec]:
    """Rate at which an end of a rod spins about u, by du and by the angular velocity of its body.

    A hinge n: of the part of n across u. Two hinges: of the rod itself, with q1' = b . y / D, q2' = -a . y / D,
    y = du - W x u, D = (a x u) . b.
    """
    if ending == HINGE:
        lengthwise = dot(first, u)
        flat = along(first, -lengthwise, u)
        across = scale(1.0 / dot(flat, flat), cross(u, flat))
        return scale(-lengthwise, across), cross(first, across)
    D = dot(cross(first, u), last)
    by_line = scale(1.0 / D, along(scale(dot(first, u), last), -dot(last, u), first))
    return by_line, sub(u, cross(u, by_line))


@routine
def twist_rate(rod: Record, proximal: Record, frame: Floats, lead: Floats, own: Floats, u: Vec) -> tuple[Vec, Vec, Vec]:
    """Derivative of the twist of a rod by du, W and w."""
    base_end = turned_by_proximal(proximal, lead, mark(rod["base_end"], rod["base_end_axes"], own[BASE_END:SLIDE]), 1.0)
    platform_end = turn(frame, mark(rod["platform_end"], rod["platform_end_axes"], own[PLATFORM_END:BASE_LINE]))
    first_foot = turned_by_proximal(proximal, lead, vec(rod["base_end_axes"][0]), 1.0)
    first_head = turn(frame, vec(rod["platform_end_axes"][0]))
    base_line, foot_body = spin_rate(rod["base_end"], first_foot, base_end, u)
    platform_line, head_body = spin_rate(rod["platform_end"], first_head, platform_end, u)
    return sub(platform_line, base_line), scale(-1.0, foot_body), head_body


@routine
def put_slope(
    rod: Record,
    proximal: Record,
    frame: Floats,
    lead: Floats,
    proximal_slopes: Floats,
    a: Vec,
    b: Vec,
    c: Vec,
    slope: Floats,
) -> None:
    """Derivative (6,) of a . (dH - dF) + b . W + c . w by the platform's velocity and angular velocity.

    Parameters
    ----------
    follow : derivative of the carrier's coordinate (6,).
    """
    put_pose_slope(rod, frame, a, c, slope)
    if proximal["proximal"] != NO_PROXIMAL:
        by_carrier = proximal_rate(proximal, base_end_of(rod, proximal, lead), a, b)
        for i in range(6):
            slope[i] += by_carrier * proximal_slopes[i]


@routine
def proximal_rate(proximal: Record, base_end: Vec, a: Vec, b: Vec) -> float:
    """Derivative of - a . F + b . W by the coordinate of a carrier, with the foot F on it."""
    axis = vec(proximal["proximal_axis"])
    if proximal["proximal"] == CARRIAGE:
        return -dot(a, axis)
    return dot(b, axis) - dot(a, cross(axis, sub(base_end, vec(proximal["proximal_point"]))))


@routine
def put_proximal_slope(rod: Record, frame: Floats, own: Floats, u: Vec, proximal_slopes: Floats) -> None:
    """Derivative (6,) of the coordinate of a carrier that keeps the rod's length."""
    put_pose_slope(rod, frame, u, NOWHERE, proximal_slopes)
    rate = proximal_rate(rod, base_end_of(rod, rod, own), u, NOWHERE)
    for i in range(6):
        proximal_slopes[i] /= -rate


@routine
def rod_rows(
    rod: Record, proximal: Record, frame: Floats, lead: Floats, own: Floats, line: Floats, rows: Floats
) -> None:
    """Fill a rod's constraints."""
    n, span = rod["first_row"], vec(line)
    if rod["slides"] == 0 and (rod["proximal"] == NO_PROXIMAL or rod["proximal"] == SHARED):
        rows[n] = own[SLIDE]
        n += 1
    if rod["base_end"] == HINGE:
        rows[n] = norm(span) * dot(vec(rod["base_end_axes"][0]), vec(own[BASE_LINE:PLATFORM_LINE]))
        n += 1
    if rod["platform_end"] == HINGE:
        rows[n] = norm(span) * dot(vec(rod["platform_end_axes"][0]), vec(own[PLATFORM_LINE:COSINE]))
        n += 1
    if rod["twists"] == 1:
        rows[n] = twist_of(rod, proximal, frame, lead, own, scale(1.0 / norm(span), span))


@routine
def rod_slopes(
    rod: Record,
    proximal: Record,
    frame: Floats,
    lead: Floats,
    own: Floats,
    line: Floats,
    proximal_slopes: Floats,
    slopes: Floats,
) -> None:
    """Fill the derivatives of a rod's constraints, and of its carrier's coordinate (`proximal_slopes`)."""
    n, span = rod["first_row"], vec(line)
    u = scale(1.0 / norm(span), span)
    if rod["proximal"] == CRANK or rod["proximal"] == CARRIAGE:
        put_proximal_slope(rod, frame, own, u, proximal_slopes)
    elif rod["slides"] == 0:
        put_slope(rod, proximal, frame, lead, proximal_slopes, u, NOWHERE, NOWHERE, slopes[n])
        n += 1
    if rod["base_end"] == HINGE:
        axis = turned_by_proximal(proximal, lead, vec(rod["base_end_axes"][0]), 1.0)
        put_slope(rod, proximal, frame, lead, proximal_slopes, axis, cross(axis, span), NOWHERE, slopes[n])
        n += 1
    if rod["platform_end"] == HINGE:
        axis = turn(frame, vec(rod["platform_end_axes"][0]))
        put_slope(rod, proximal, frame, lead, proximal_slopes, axis, NOWHERE, cross(axis, span), slopes[n])
        n += 1
    if rod["twists"] == 1:
        by_line, b, c = twist_rate(rod, proximal, frame, lead, own, u)
        by_line = scale(1.0 / norm(span), along(by_line, -dot(by_line, u), u))
        put_slope(rod, proximal, frame, lead, proximal_slopes, by_line, b, c, slopes[n])
