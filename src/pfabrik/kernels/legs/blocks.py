"""Inverse kinematics of rods in closed form, by blocks of poses: constraints, limits and actuators only."""

from __future__ import annotations

import math

import numpy as np

from ...common.arrays import Floats, Ints, Record
from .._jit import inlined, kernel, routine
from ..rows import LIMIT_EXCESS, OPEN, PENDING, REACHED, RESIDUAL
from ..search_constants import CLOSED, NEARLY_CLOSED
from ..vectors import ON_BOUND, Vec, add, along, copy_row, cross, dot, scale, sub, vec, wrap
from .columns import (
    AX,
    AY,
    AZ,
    BLOCK,
    BX,
    BY,
    BZ,
    COS,
    EXCESS,
    INVERSE,
    IS_REGULAR,
    LENGTH,
    MORE,
    OFF,
    PX,
    ROW,
    SIDE,
    SIN,
    VALUE,
    VALUES,
    XX,
    X,
    Y,
    Z,
    arctangent,
    fill_base_direction,
    fill_inverse,
    fill_platform_direction,
    fill_platform_point,
    fill_poses,
    project_on_base_direction,
    project_on_platform_direction,
)
from .leg_constants import KEPT, LEAST_MARGIN, ROUNDED
from .records import BASE_END, BASE_LINE, CARRIAGE, CRANK, HINGE, PLATFORM_END, Q_PROXIMAL, SHARED, SLIDE, open_table

TURN = 2.0 * math.pi


@routine
def fill_rod(rod: Record, proximal: Record, n: int, S: Floats) -> None:
    """Fill the line and the values of a rod, and add its constraints to ROW.

    Parameters
    ----------
    proximal : the rod whose proximal joint it is on, filled before; itself if it shares none.
    """
    platform_end, point = vec(rod["platform_end_point"]), vec(proximal["proximal_point"])
    if proximal["proximal"] == CRANK:
        axis, lever = vec(proximal["proximal_axis"]), sub(vec(rod["base_end_point"]), point)
        axial = scale(dot(axis, lever), axis)
        fill_platform_point(platform_end, add(point, axial), n, S)
        if rod["proximal"] == CRANK:
            fill_crank(rod, n, S)
        subtract_crank(sub(lever, axial), cross(axis, lever), n, S)
    else:
        fill_platform_point(platform_end, vec(rod["base_end_point"]), n, S)
        if rod["proximal"] == CARRIAGE:
            fill_carriage(rod, n, S)
        if proximal["proximal"] == CARRIAGE:
            subtract_carriage(vec(proximal["proximal_axis"]), n, S)
    fill_length(rod["length"], n, S)
    if rod["slides"] == 0 and rod["has_proximal"] == 0:
        track_constraint(VALUES + SLIDE, n, S)
    fill_hinges(rod, proximal, n, S)


@routine
def fill_crank(rod: Record, n: int, S: Floats) -> None:
    """Solve the crank angle at which the rod reaches its platform end, as `rods.solve_proximal` does."""
    crank, across = vec(rod["crank"]), vec(rod["crank_across"])
    constant = dot(crank, crank) - rod["length"] * rod["length"]
    for i in range(n):
        x, y, z = S[X, i], S[Y, i], S[Z, i]
        A = crank[0] * x + crank[1] * y + crank[2] * z
        B = across[0] * x + across[1] * y + across[2] * z
        C = 0.5 * (x * x + y * y + z * z + constant)
        square = A * A + B * B
        discriminant = square - C * C
        farthest = math.sqrt(square)
        C = farthest if farthest < C else (-farthest if -farthest > C else C)
        root, inverse = S[SIDE, i] * math.sqrt(discriminant if discriminant > 0.0 else 0.0), 1.0 / square
        cosine, sine = (A * C - B * root) * inverse, (B * C + A * root) * inverse
        S[IS_REGULAR, i] = S[IS_REGULAR, i] if discriminant > LEAST_MARGIN * LEAST_MARGIN * square else 0.0
        S[COS, i], S[SIN, i] = cosine, sine
        S[VALUES + Q_PROXIMAL, i] = arctangent(sine, cosine)


@routine
def subtract_crank(radial: Vec, across: Vec, n: int, S: Floats) -> None:
    """Subtract the turned lever of a crank from the line."""
    for i in range(n):
        cosine, sine = S[COS, i], S[SIN, i]
        S[X, i] -= cosine * radial[0] + sine * across[0]
        S[Y, i] -= cosine * radial[1] + sine * across[1]
        S[Z, i] -= cosine * radial[2] + sine * across[2]


@routine
def fill_carriage(rod: Record, n: int, S: Floats) -> None:
    """Solve the carriage position at which the rod reaches its platform end, as `rods.solve_proximal` does."""
    axis, square = vec(rod["proximal_axis"]), rod["length"] * rod["length"]
    for i in range(n):
        x, y, z = S[X, i], S[Y, i], S[Z, i]
        middle = x * axis[0] + y * axis[1] + z * axis[2]
        discriminant = square - (x * x + y * y + z * z) + middle * middle
        S[IS_REGULAR, i] = S[IS_REGULAR, i] if discriminant > LEAST_MARGIN * LEAST_MARGIN * square else 0.0
        S[VALUES + Q_PROXIMAL, i] = middle + S[SIDE, i] * math.sqrt(discriminant if discriminant > 0.0 else 0.0)


@routine
def subtract_carriage(axis: Vec, n: int, S: Floats) -> None:
    """Subtract the travel of a carriage from the line."""
    for i in range(n):
        travel = S[VALUES + Q_PROXIMAL, i]
        S[X, i] -= travel * axis[0]
        S[Y, i] -= travel * axis[1]
        S[Z, i] -= travel * axis[2]


@routine
def fill_length(length: float, n: int, S: Floats) -> None:
    """Fill the length of the line, and the slide: that minus the rod's length at home."""
    for i in range(n):
        present = math.sqrt(S[X, i] * S[X, i] + S[Y, i] * S[Y, i] + S[Z, i] * S[Z, i])
        S[LENGTH, i], S[VALUES + SLIDE, i] = present, present - length


@routine
def fill_hinges(rod: Record, proximal: Record, n: int, S: Floats) -> None:
    """Fill the constraints and angles of single hinges at the ends of a rod, and its twist constraint."""
    base_end, platform_end, home = vec(rod["base_end_axes"][0]), vec(rod["platform_end_axes"][0]), vec(rod["line"])
    if rod["base_end"] == HINGE:
        project_on_base_direction(base_end, proximal, VALUE, n, S)
        track_constraint(VALUE, n, S)
    if rod["platform_end"] == HINGE:
        project_on_platform_direction(platform_end, VALUE, n, S)
        track_constraint(VALUE, n, S)
    if rod["twists"] == 1:
        fill_base_direction(base_end, proximal, n, S)
        fill_platform_direction(platform_end, n, S)
        fill_inverse(n, S)
        fill_twist(rod["twist"], n, S)
        track_constraint(VALUE, n, S)
    if rod["base_end_aimed"] == 1:
        project_on_base_direction(cross(base_end, home), proximal, AY, n, S)
        project_on_base_direction(along(home, -dot(base_end, home), base_end), proximal, AX, n, S)
        fill_angle(VALUES + BASE_END, n, S)
    if rod["platform_end_aimed"] == 1:
        project_on_platform_direction(cross(platform_end, home), AY, n, S)
        project_on_platform_direction(along(home, -dot(platform_end, home), platform_end), AX, n, S)
        fill_angle(VALUES + PLATFORM_END, n, S)


@routine
def fill_angle(to: int, n: int, S: Floats) -> None:
    """Fill an angle with cosine proportional to AX and sine proportional to AY."""
    for i in range(n):
        S[to, i] = arctangent(S[AY, i], S[AX, i])


@routine
def fill_twist(home: float, n: int, S: Floats) -> None:
    """Fill VALUE with the angle about the line from BX, BY, BZ to AX, AY, AZ, minus that at home."""
    for i in range(n):
        scaled = S[INVERSE, i]
        u, v, w = scaled * S[X, i], scaled * S[Y, i], scaled * S[Z, i]
        a, b, c = S[AX, i], S[AY, i], S[AZ, i]
        d, e, f = S[BX, i], S[BY, i], S[BZ, i]
        sine = u * (e * c - f * b) + v * (f * a - d * c) + w * (d * b - e * a)
        cosine = d * a + e * b + f * c - (u * d + v * e + w * f) * (u * a + v * b + w * c)
        S[VALUE, i] = wrap_between(arctangent(sine, cosine) - home, -0.5 * TURN, 0.5 * TURN)


@routine
def track_constraint(column: int, n: int, S: Floats) -> None:
    """Raise ROW to the absolute value of a constraint; to infinity if it is not a number."""
    for i in range(n):
        size = abs(S[column, i])
        size = size if size < math.inf else math.inf
        S[ROW, i] = size if size > S[ROW, i] else S[ROW, i]


@routine
def counting_range(coordinate: Record) -> Vec:
    """A shift to add to a coordinate and the bounds that it is then wrapped between, as in `answer.deviation`."""
    if coordinate["turns"] == 0:
        return 0.0, -math.inf, math.inf
    lo, hi = coordinate["lo"], coordinate["hi"]
    if hi - lo > TURN:
        return 0.0, lo - ON_BOUND, hi + ON_BOUND
    middle = 0.5 * (lo + hi)
    return middle - wrap(middle, 0.0), middle - 0.5 * TURN, middle + 0.5 * TURN


@inlined
def wrap_between(angle: float, below: float, above: float) -> float:
    """An angle less than a turn beyond either of two bounds, moved between them by a whole turn."""
    return angle - TURN if angle > above else (angle + TURN if angle < below else angle)


@routine
def track_range(coordinate: Record, n: int, S: Floats) -> None:
    """Raise EXCESS to the excess of a coordinate over its range."""
    lo, hi, sense, place = coordinate["lo"], coordinate["hi"], coordinate["sense"], VALUES + coordinate["place"]
    shift, lowest, highest = counting_range(coordinate)
    for i in range(n):
        value = wrap_between(sense * S[place, i] + shift, lowest, highest)
        below, above = lo - value, value - hi
        excess = below if below > above else above
        excess = excess if excess < math.inf else math.inf
        S[EXCESS, i] = excess if excess > S[EXCESS, i] else S[EXCESS, i]


@routine
def project_on_cone_axis(cone: Record, proximal: Record, n: int, S: Floats) -> None:
    """Fill VALUE with the component of the rod's line along the axis of a cone."""
    if cone["place"] == BASE_LINE:
        project_on_base_direction(vec(cone["axis"]), proximal, VALUE, n, S)
    else:
        project_on_platform_direction(vec(cone["axis"]), VALUE, n, S)


@routine
def track_cone(cone: Record, proximal: Record, n: int, S: Floats) -> None:
    """Raise EXCESS to 2 `KEPT` where a rod is outside the cone at one of its ends."""
    least = cone["least_cosine"]
    project_on_cone_axis(cone, proximal, n, S)
    for i in range(n):
        length, before = S[LENGTH, i], S[EXCESS, i]
        is_kept = (S[VALUE, i] >= least * length) & (length > 0.0)
        excess = -math.inf if is_kept else 2.0 * KEPT
        S[EXCESS, i] = excess if excess > before else before


@kernel
def answer_blocks(
    machine: int,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    status: Ints,
    poses: Floats,
    actuators: Floats,
    measures: Floats,
) -> int:
    """Solve targets as `answer.answer` does, for legs that are all rods in block form; the number not reached.

    Rows that may close once their unset coordinates are completed are OPEN, the others PENDING.
    """
    table = open_table(machine)
    legs, limited, cones, driven, task = table.legs, table.limited, table.cones, table.driven, table.task
    S, pose, n_unreached = np.empty((MORE, BLOCK)), np.zeros((4, 4)), 0
    copy_row(targets.reshape(-1), poses.reshape(-1))  # in one pass, which also brings targets into the cache
    for first in range(0, targets.shape[0], BLOCK):
        n = min(BLOCK, targets.shape[0] - first)
        fill_poses(targets, begins, task[0], first, n, pose, S)
        owner, a, b, c = 0, 0, 0, 0
        for k in range(legs.shape[0]):
            if legs[k]["proximal"] != SHARED:
                owner = k
            if legs[k]["has_proximal"] == 1:
                fill_sides(sides, k, first, n, S)
            fill_rod(legs[k], legs[owner], n, S)
            while a < limited.shape[0] and limited[a]["leg"] == k:
                track_range(limited[a], n, S)
                a += 1
            while b < cones.shape[0] and cones[b]["leg"] == k:
                track_cone(cones[b], legs[owner], n, S)
                b += 1
            while c < driven.shape[0] and driven[c]["leg"] == k:
                write_actuator(driven[c], first, n, S, actuators)
                c += 1
        n_unreached += write_status(task[0], first, n, S, status, measures)
        write_poses(task[0], first, n, S, poses)
    return n_unreached


@routine
def fill_sides(sides: Floats, k: int, first: int, n: int, S: Floats) -> None:
    """Fill SIDE with the sides of leg `k`."""
    for i in range(n):
        S[SIDE, i] = sides[first + i if sides.shape[0] > 1 else 0, k]


@routine
def write_status(task: Record, first: int, n: int, S: Floats, status: Ints, measures: Floats) -> int:
    """Write status and measures of a block; the number of rows not reached."""
    length, tolerance, n_unreached = task["length"], CLOSED if task["unset"] > 0 else NEARLY_CLOSED, 0
    status, measures = status[first : first + n], measures[first : first + n]
    for i in range(n):
        is_closed = S[ROW, i] <= tolerance
        is_reached = (S[IS_REGULAR, i] == 1.0) & is_closed & (S[EXCESS, i] <= KEPT)
        is_open = (S[IS_REGULAR, i] == 1.0) & (not is_closed) & (task["unset"] > 0)
        status[i] = REACHED if is_reached else (OPEN if is_open else PENDING)
        n_unreached += 0 if is_reached else 1
        measures[i, RESIDUAL] = S[ROW, i] * length
        measures[i, LIMIT_EXCESS] = max(S[EXCESS, i], 0.0)
    return n_unreached


@routine
def write_poses(task: Record, first: int, n: int, S: Floats, poses: Floats) -> None:
    """Write the pose coordinates that targets do not set, and rotations that were made orthonormal."""
    length, is_set, block = task["length"], task["rotations"] == 3, poses[first : first + n]
    for i in range(n):
        if not is_set or S[OFF, i] > ROUNDED:
            for j in range(9):
                block[i, j // 3, j % 3] = S[XX + j, i]
    for j in range(3):
        if task["axes"][j] == 0:
            for i in range(n):
                block[i, j, 3] = S[PX + j, i] * length


@routine
def write_actuator(driven: Record, first: int, n: int, S: Floats, actuators: Floats) -> None:
    """Write the values of an actuator [length or rad]."""
    home, unit, sense, place = driven["home"], driven["unit"], driven["sense"], VALUES + driven["place"]
    (shift, lowest, highest), column = counting_range(driven), actuators[first : first + n, driven["column"]]
    for i in range(n):
        S[VALUE, i] = home + wrap_between(sense * S[place, i] + shift, lowest, highest) * unit
    for i in range(n):
        column[i] = S[VALUE, i]
