"""A rod between its base end, on a crank, a carriage or a fixed body, and its platform end, at a pose.

With F the base end, H the platform end, l = H - F, u = l / |l|, each rod adds some of these constraints on the pose:

- `length`, rigid rods without a proximal joint of their own: |l| - length;
- `base_end`, one hinge n at the base end: n . l;
- `platform_end`, one hinge m at the platform end: m . l;
- `twist`, both endings keep the rod from spinning: the angle about u between their twist marks, less that at home.

The derivative of each is a . (dH - dF) + b . W + c . w, with W and w the angular velocities of the bodies at the base
end and at the platform end.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine
from ..vectors import Vec, add, along, cross, dot, move, norm, put, scale, sub, turn, vec, where, wrap
from .endings import aimed_axis, angle_to, parts_about, solve_angle, turned, turned_back, universal_angles
from .frames import ZERO, put_pose_slope
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
def solve_proximal(rod: Record, platform_end: Vec, side: float, values: Floats) -> float:
    """Solve the crank or carriage coordinate at which the rod reaches its platform end; the singularity margin.

    With lever r and r' a quarter turn on, a crank: |o + r cos q + r' sin q - H| = length; a carriage:
    |F + q a - H| = length. Without a solution, the coordinate is the one that comes nearest.
    """
    if rod["proximal"] == CRANK:
        x, crank = sub(platform_end, vec(rod["proximal_point"])), vec(rod["crank"])
        C = 0.5 * (dot(x, x) + dot(crank, crank) - rod["length"] * rod["length"])
        cosine, sine, singularity_margin = solve_angle(dot(crank, x), dot(vec(rod["crank_across"]), x), C, side)
        values[COSINE], values[SINE] = cosine, sine
        values[Q_PROXIMAL] = math.atan2(sine, cosine)
        return singularity_margin
    x = sub(platform_end, vec(rod["base_end_point"]))
    middle = dot(x, vec(rod["proximal_axis"]))
    square = rod["length"] * rod["length"]
    discriminant = square - dot(x, x) + middle * middle
    values[Q_PROXIMAL] = middle + side * math.sqrt(max(discriminant, 0.0))
    return discriminant / square


@routine
def base_end_of(rod: Record, proximal: Record, values: Floats) -> Vec:
    """Position of the rod's base end, with its proximal joint, own or shared, as in `values`."""
    if proximal["proximal"] == NO_PROXIMAL:
        return vec(rod["base_end_point"])
    if proximal["proximal"] == CARRIAGE:
        return along(vec(rod["base_end_point"]), values[Q_PROXIMAL], vec(proximal["proximal_axis"]))
    if rod["proximal"] == SHARED:
        point = vec(proximal["proximal_point"])
        lever = turned(
            sub(vec(rod["base_end_point"]), point), vec(proximal["proximal_axis"]), values[COSINE], values[SINE]
        )
        return add(point, lever)
    lever = along(scale(values[COSINE], vec(rod["crank"])), values[SINE], vec(rod["crank_across"]))
    return add(vec(rod["proximal_point"]), lever)


@routine
def turned_by_proximal(proximal: Record, values: Floats, v: Vec, sense: float) -> Vec:
    """A direction turned with the crank, or back (sense -1); unchanged without a crank."""
    if proximal["proximal"] != CRANK:
        return v
    return turned(v, vec(proximal["proximal_axis"]), values[COSINE], sense * values[SINE])


@routine
def place_rod(
    rod: Record, proximal: Record, frame: Floats, proximal_values: Floats, values: Floats, line: Floats
) -> float:
    """Fill the values of a rod and its `line` from base end to platform end; the singularity margin.

    Its proximal joint is already placed: that of the rod `proximal`, which is itself if it shares none.
    Two crossed hinges point a rod in either of two ways, half a turn about it apart: home's side is used, unless the
    twist then differs from home's by more than a quarter turn.
    """
    span = sub(move(frame, vec(rod["platform_end_point"])), base_end_of(rod, proximal, proximal_values))
    length, singularity_margin = norm(span), 1.0
    u, home = scale(1.0 / length, span), vec(rod["line"])
    base_line, platform_line = turned_by_proximal(proximal, proximal_values, u, -1.0), turned_back(frame, u)
    put(line, span)
    put(values[BASE_LINE:PLATFORM_LINE], base_line)
    put(values[PLATFORM_LINE:COSINE], platform_line)
    values[SLIDE] = length - rod["length"]
    base_side, platform_side = rod["base_end_side"], rod["platform_end_side"]
    if rod["twists"] == 1 and (rod["base_end"] == CROSS or rod["platform_end"] == CROSS):
        flip = twist_side(rod, proximal, frame, proximal_values, base_line, platform_line, u)
        if rod["platform_end"] == CROSS:
            platform_side *= flip
        else:
            base_side *= flip
    if rod["base_end_aimed"] == 1:
        margin = ending_angles(
            rod["base_end"], rod["base_end_axes"], home, base_line, base_side, values[BASE_END:SLIDE]
        )
        singularity_margin = min(singularity_margin, margin)
    if rod["platform_end_aimed"] == 1:
        margin = ending_angles(
            rod["platform_end"],
            rod["platform_end_axes"],
            home,
            platform_line,
            platform_side,
            values[PLATFORM_END:BASE_LINE],
        )
        singularity_margin = min(singularity_margin, margin)
    return singularity_margin


@routine
def ending_angles(ending: int, axes: Floats, home: Vec, line: Vec, side: float, angles: Floats) -> float:
    """Fill the angles of the hinges at an end of a rod, from the body that they are on; the singularity margin."""
    if ending == HINGE:
        angles[0] = angle_to((axes[0, 0], axes[0, 1], axes[0, 2]), home, line)
        return 1.0
    return universal_angles(axes, home, line, side, angles)


@routine
def twist_side(
    rod: Record, proximal: Record, frame: Floats, proximal_values: Floats, base_line: Vec, platform_line: Vec, u: Vec
) -> float:
    """1 if the twist of a rod with its hinges on home's sides is within a quarter turn of home's, else -1."""
    home, base_axes, platform_axes = vec(rod["line"]), rod["base_end_axes"], rod["platform_end_axes"]
    base_mark, platform_mark = (
        vec(base_axes[0 if rod["base_end"] == HINGE else 1]),
        vec(platform_axes[0 if rod["platform_end"] == HINGE else 1]),
    )
    home_sine, home_cosine = parts_about(home, base_mark, platform_mark)
    if rod["base_end"] == CROSS:
        base_mark = aimed_axis(base_axes, home, base_line, rod["base_end_side"])
    if rod["platform_end"] == CROSS:
        platform_mark = aimed_axis(platform_axes, home, platform_line, rod["platform_end_side"])
    base_mark = turned_by_proximal(proximal, proximal_values, base_mark, 1.0)
    sine, cosine = parts_about(u, base_mark, turn(frame, platform_mark))
    return where(cosine * home_cosine + sine * home_sine < 0.0, -1.0, 1.0)


@routine
def twist_mark(ending: int, axes: Floats, angles: Floats) -> Vec:
    """The last hinge of an ending, which moves with the rod, in the body that the ending is on."""
    first = (axes[0, 0], axes[0, 1], axes[0, 2])
    if ending == HINGE:
        return first
    return turned((axes[1, 0], axes[1, 1], axes[1, 2]), first, math.cos(angles[0]), math.sin(angles[0]))


@routine
def twist_of(rod: Record, proximal: Record, frame: Floats, proximal_values: Floats, values: Floats, u: Vec) -> float:
    """Angle about a rod's line between the twist marks of its two endings, less that at home."""
    base_end = turned_by_proximal(
        proximal, proximal_values, twist_mark(rod["base_end"], rod["base_end_axes"], values[BASE_END:SLIDE]), 1.0
    )
    platform_end = turn(
        frame, twist_mark(rod["platform_end"], rod["platform_end_axes"], values[PLATFORM_END:BASE_LINE])
    )
    return wrap(angle_to(u, base_end, platform_end) - rod["twist"], 0.0)


@routine
def spin_rate(ending: int, first: Vec, last: Vec, u: Vec) -> tuple[Vec, Vec]:
    """Rate at which an end of a rod spins about u, as coefficients of du and of the angular velocity W of its body.

    One hinge n: the rate of the part of n normal to u. Two hinges: the rate of the rod itself, with q1' = b . y / D,
    q2' = -a . y / D, y = du - W x u, D = (a x u) . b.
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
def twist_rate(
    rod: Record, proximal: Record, frame: Floats, proximal_values: Floats, values: Floats, u: Vec
) -> tuple[Vec, Vec, Vec]:
    """Derivative of the twist of a rod, as coefficients of du, W and w."""
    base_end = turned_by_proximal(
        proximal, proximal_values, twist_mark(rod["base_end"], rod["base_end_axes"], values[BASE_END:SLIDE]), 1.0
    )
    platform_end = turn(
        frame, twist_mark(rod["platform_end"], rod["platform_end_axes"], values[PLATFORM_END:BASE_LINE])
    )
    first_base = turned_by_proximal(proximal, proximal_values, vec(rod["base_end_axes"][0]), 1.0)
    first_platform = turn(frame, vec(rod["platform_end_axes"][0]))
    base_line, base_body = spin_rate(rod["base_end"], first_base, base_end, u)
    platform_line, platform_body = spin_rate(rod["platform_end"], first_platform, platform_end, u)
    return sub(platform_line, base_line), scale(-1.0, base_body), platform_body


@routine
def put_slope(
    rod: Record,
    proximal: Record,
    frame: Floats,
    proximal_values: Floats,
    proximal_slopes: Floats,
    a: Vec,
    b: Vec,
    c: Vec,
    slope: Floats,
) -> None:
    """Derivative (6,) of a . (dH - dF) + b . W + c . w by the platform's velocity and angular velocity.

    Parameters
    ----------
    proximal_slopes : derivative of the proximal coordinate (6,).
    """
    put_pose_slope(rod, frame, a, c, slope)
    if proximal["proximal"] != NO_PROXIMAL:
        by_proximal = proximal_rate(proximal, base_end_of(rod, proximal, proximal_values), a, b)
        for i in range(6):
            slope[i] += by_proximal * proximal_slopes[i]


@routine
def proximal_rate(proximal: Record, base_end: Vec, a: Vec, b: Vec) -> float:
    """Derivative of -a . F + b . W by the proximal coordinate, with F the base end."""
    axis = vec(proximal["proximal_axis"])
    if proximal["proximal"] == CARRIAGE:
        return -dot(a, axis)
    return dot(b, axis) - dot(a, cross(axis, sub(base_end, vec(proximal["proximal_point"]))))


@routine
def clamped_rate(rod: Record, platform_end: Vec, values: Floats) -> Vec:
    """Derivative by the platform end of a proximal coordinate that does not reach it, but comes nearest."""
    axis = vec(rod["proximal_axis"])
    if rod["proximal"] == CARRIAGE:
        return axis
    point = vec(rod["proximal_point"])
    lever = sub(base_end_of(rod, rod, values), point)
    return scale(1.0 / dot(lever, sub(platform_end, point)), cross(axis, lever))


@routine
def put_proximal_slope(rod: Record, frame: Floats, values: Floats, u: Vec, proximal_slopes: Floats) -> None:
    """Derivative (6,) of the proximal coordinate that keeps the rod's length."""
    put_pose_slope(rod, frame, u, ZERO, proximal_slopes)
    rate = proximal_rate(rod, base_end_of(rod, rod, values), u, ZERO)
    for i in range(6):
        proximal_slopes[i] /= -rate


@routine
def rod_rows(
    rod: Record, proximal: Record, frame: Floats, proximal_values: Floats, values: Floats, line: Floats, rows: Floats
) -> None:
    """Fill the constraints of a rod."""
    n, span = rod["first_row"], vec(line)
    if rod["slides"] == 0 and rod["has_proximal"] == 0:
        rows[n] = values[SLIDE]
        n += 1
    if rod["base_end"] == HINGE:
        rows[n] = norm(span) * dot(vec(rod["base_end_axes"][0]), vec(values[BASE_LINE:PLATFORM_LINE]))
        n += 1
    if rod["platform_end"] == HINGE:
        rows[n] = norm(span) * dot(vec(rod["platform_end_axes"][0]), vec(values[PLATFORM_LINE:COSINE]))
        n += 1
    if rod["twists"] == 1:
        rows[n] = twist_of(rod, proximal, frame, proximal_values, values, scale(1.0 / norm(span), span))


@routine
def rod_slopes(
    rod: Record,
    proximal: Record,
    frame: Floats,
    proximal_values: Floats,
    values: Floats,
    line: Floats,
    proximal_slopes: Floats,
    slopes: Floats,
) -> None:
    """Fill the derivatives of a rod's constraints, and of its proximal coordinate (`proximal_slopes`)."""
    n, span = rod["first_row"], vec(line)
    u = scale(1.0 / norm(span), span)
    if rod["has_proximal"] == 1:
        put_proximal_slope(rod, frame, values, u, proximal_slopes)
    elif rod["slides"] == 0:
        put_slope(rod, proximal, frame, proximal_values, proximal_slopes, u, ZERO, ZERO, slopes[n])
        n += 1
    if rod["base_end"] == HINGE:
        axis = turned_by_proximal(proximal, proximal_values, vec(rod["base_end_axes"][0]), 1.0)
        put_slope(rod, proximal, frame, proximal_values, proximal_slopes, axis, cross(axis, span), ZERO, slopes[n])
        n += 1
    if rod["platform_end"] == HINGE:
        axis = turn(frame, vec(rod["platform_end_axes"][0]))
        put_slope(rod, proximal, frame, proximal_values, proximal_slopes, axis, ZERO, cross(axis, span), slopes[n])
        n += 1
    if rod["twists"] == 1:
        by_line, b, c = twist_rate(rod, proximal, frame, proximal_values, values, u)
        by_line = scale(1.0 / norm(span), along(by_line, -dot(by_line, u), u))
        put_slope(rod, proximal, frame, proximal_values, proximal_slopes, by_line, b, c, slopes[n])
