"""Poses answered in blocks by rods in closed form: what their limits, drivers and constraints need, and no more."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Floats, Ints, Record
from .._jit import inlined, kernel, routine
from ..rows import LIMIT_EXCESS, OPEN, PENDING, REACHED, RESIDUAL
from ..vectors import ON_BOUND, Vec, add, along, copy_row, cross, dot, scale, sub, vec, wrap
from .answer import CLOSE, CLOSED, KEPT
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
    LENGTH,
    MARGIN,
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
    lay_along_carried,
    lay_along_turned,
    lay_carried,
    lay_inverse,
    lay_moved,
    lay_out,
    lay_turned,
)
from .endings import LEAST_MARGIN
from .poses import ROUNDED
from .records import BASE_END, BASE_LINE, CARRIAGE, CRANK, HINGE, NO_PROXIMAL, PLATFORM_END, Q_PROXIMAL, SHARED, SLIDE
from .table import open_table

TURN = 2.0 * math.pi


@routine
def lay_rod(rod: Record, proximal: Record, n: int, S: Floats) -> None:
    """Columns of a rod: its line, its values, and what its constraints add to ROW.

    Parameters
    ----------
    carrier : the rod whose carrier it is on, laid before; itself if it shares none.
    """
    platform_end, point = vec(rod["platform_end_point"]), vec(proximal["proximal_point"])
    if proximal["proximal"] == CRANK:
        axis, arm = vec(proximal["proximal_axis"]), sub(vec(rod["base_end_point"]), point)
        rest = scale(dot(axis, arm), axis)
        lay_moved(platform_end, add(point, rest), n, S)
        if rod["proximal"] == CRANK:
            lay_crank(rod, n, S)
        leave_arm(sub(arm, rest), cross(axis, arm), n, S)
    else:
        lay_moved(platform_end, vec(rod["base_end_point"]), n, S)
        if rod["proximal"] == CARRIAGE:
            lay_carriage(rod, n, S)
        if proximal["proximal"] == CARRIAGE:
            leave_slide(vec(proximal["proximal_axis"]), n, S)
    lay_length(rod["length"], n, S)
    if rod["slides"] == 0 and (rod["proximal"] == NO_PROXIMAL or rod["proximal"] == SHARED):
        note_row(VALUES + SLIDE, n, S)
    lay_hinges(rod, proximal, n, S)


@routine
def lay_crank(rod: Record, n: int, S: Floats) -> None:
    """Turn a crank until its rod reaches the head; see `rods.solve_proximal`."""
    crank, across = vec(rod["crank"]), vec(rod["crank_across"])
    more = dot(crank, crank) - rod["length"] * rod["length"]
    for i in range(n):
        x, y, z = S[X, i], S[Y, i], S[Z, i]
        A = crank[0] * x + crank[1] * y + crank[2] * z
        B = across[0] * x + across[1] * y + across[2] * z
        C = 0.5 * (x * x + y * y + z * z + more)
        square = A * A + B * B
        rest = square - C * C
        farthest = math.sqrt(square)
        C = farthest if farthest < C else (-farthest if -farthest > C else C)
        root, inverse = S[SIDE, i] * math.sqrt(rest if rest > 0.0 else 0.0), 1.0 / square
        cosine, sine = (A * C - B * root) * inverse, (B * C + A * root) * inverse
        S[MARGIN, i] = S[MARGIN, i] if rest > LEAST_MARGIN * LEAST_MARGIN * square else 0.0
        S[COS, i], S[SIN, i] = cosine, sine
        S[VALUES + Q_PROXIMAL, i] = arctangent(sine, cosine)


@routine
def leave_arm(plain: Vec, across: Vec, n: int, S: Floats) -> None:
    """Take the arm of a crank, as it has turned, from the line."""
    for i in range(n):
        cosine, sine = S[COS, i], S[SIN, i]
        S[X, i] -= cosine * plain[0] + sine * across[0]
        S[Y, i] -= cosine * plain[1] + sine * across[1]
        S[Z, i] -= cosine * plain[2] + sine * across[2]


@routine
def lay_carriage(rod: Record, n: int, S: Floats) -> None:
    """Move a carriage until its rod reaches the head; see `rods.solve_proximal`."""
    axis, square = vec(rod["proximal_axis"]), rod["length"] * rod["length"]
    for i in range(n):
        x, y, z = S[X, i], S[Y, i], S[Z, i]
        middle = x * axis[0] + y * axis[1] + z * axis[2]
        rest = square - (x * x + y * y + z * z) + middle * middle
        S[MARGIN, i] = S[MARGIN, i] if rest > LEAST_MARGIN * LEAST_MARGIN * square else 0.0
        S[VALUES + Q_PROXIMAL, i] = middle + S[SIDE, i] * math.sqrt(rest if rest > 0.0 else 0.0)


@routine
def leave_slide(axis: Vec, n: int, S: Floats) -> None:
    """Take the way of a carriage from the line."""
    for i in range(n):
        way = S[VALUES + Q_PROXIMAL, i]
        S[X, i] -= way * axis[0]
        S[Y, i] -= way * axis[1]
        S[Z, i] -= way * axis[2]


@routine
def lay_length(length: float, n: int, S: Floats) -> None:
    for i in range(n):
        present = math.sqrt(S[X, i] * S[X, i] + S[Y, i] * S[Y, i] + S[Z, i] * S[Z, i])
        S[LENGTH, i], S[VALUES + SLIDE, i] = present, present - length


@routine
def lay_hinges(rod: Record, proximal: Record, n: int, S: Floats) -> None:
    """Constraints and angles of single hinges at the ends of a rod, and that they do not twist."""
    base_end, platform_end, home = vec(rod["base_end_axes"][0]), vec(rod["platform_end_axes"][0]), vec(rod["line"])
    if rod["base_end"] == HINGE:
        lay_along_carried(base_end, proximal, VALUE, n, S)
        note_row(VALUE, n, S)
    if rod["platform_end"] == HINGE:
        lay_along_turned(platform_end, VALUE, n, S)
        note_row(VALUE, n, S)
    if rod["twists"] == 1:
        lay_carried(base_end, proximal, n, S)
        lay_turned(platform_end, n, S)
        lay_inverse(n, S)
        lay_twist(rod["twist"], n, S)
        note_row(VALUE, n, S)
    if rod["base_end_aimed"] == 1:
        lay_along_carried(cross(base_end, home), proximal, AY, n, S)
        lay_along_carried(along(home, -dot(base_end, home), base_end), proximal, AX, n, S)
        lay_angle(VALUES + BASE_END, n, S)
    if rod["platform_end_aimed"] == 1:
        lay_along_turned(cross(platform_end, home), AY, n, S)
        lay_along_turned(along(home, -dot(platform_end, home), platform_end), AX, n, S)
        lay_angle(VALUES + PLATFORM_END, n, S)


@routine
def lay_angle(to: int, n: int, S: Floats) -> None:
    """An angle whose cosine goes as AX, and its sine as AY."""
    for i in range(n):
        S[to, i] = arctangent(S[AY, i], S[AX, i])


@routine
def lay_twist(home: float, n: int, S: Floats) -> None:
    """Fill VALUE with the angle about the line from BX, BY, BZ to AX, AY, AZ, less home's."""
    for i in range(n):
        scaled = S[INVERSE, i]
        u, v, w = scaled * S[X, i], scaled * S[Y, i], scaled * S[Z, i]
        a, b, c = S[AX, i], S[AY, i], S[AZ, i]
        d, e, f = S[BX, i], S[BY, i], S[BZ, i]
        sine = u * (e * c - f * b) + v * (f * a - d * c) + w * (d * b - e * a)
        cosine = d * a + e * b + f * c - (u * d + v * e + w * f) * (u * a + v * b + w * c)
        S[VALUE, i] = turned_into(arctangent(sine, cosine) - home, -0.5 * TURN, 0.5 * TURN)


@routine
def note_row(column: int, n: int, S: Floats) -> None:
    """A constraint: ROW is the largest, infinite where one is not a number."""
    for i in range(n):
        size = abs(S[column, i])
        size = size if size < math.inf else math.inf
        S[ROW, i] = size if size > S[ROW, i] else S[ROW, i]


@routine
def turns_of(coordinate: Record) -> Vec:
    """What is added to a coordinate, and the bounds that it is counted into then; see `answer.deviation`."""
    if coordinate["turns"] == 0:
        return 0.0, -math.inf, math.inf
    lo, hi = coordinate["lo"], coordinate["hi"]
    if hi - lo > TURN:
        return 0.0, lo - ON_BOUND, hi + ON_BOUND
    middle = 0.5 * (lo + hi)
    return middle - wrap(middle, 0.0), middle - 0.5 * TURN, middle + 0.5 * TURN


@inlined
def turned_into(angle: float, below: float, above: float) -> float:
    """An angle less than a turn beyond either of two bounds, counted into them."""
    return angle - TURN if angle > above else (angle + TURN if angle < below else angle)


@routine
def note_range(coordinate: Record, n: int, S: Floats) -> None:
    """The excess of a coordinate over its range."""
    lo, hi, sense, place = coordinate["lo"], coordinate["hi"], coordinate["sense"], VALUES + coordinate["place"]
    more, least, most = turns_of(coordinate)
    for i in range(n):
        value = turned_into(sense * S[place, i] + more, least, most)
        below, above = lo - value, value - hi
        excess = below if below > above else above
        excess = excess if excess < math.inf else math.inf
        S[EXCESS, i] = excess if excess > S[EXCESS, i] else S[EXCESS, i]


@routine
def lay_along_cone(cone: Record, proximal: Record, n: int, S: Floats) -> None:
    """Fill VALUE with the share of the rod's line along the axis of a cone."""
    if cone["place"] == BASE_LINE:
        lay_along_carried(vec(cone["axis"]), proximal, VALUE, n, S)
    else:
        lay_along_turned(vec(cone["axis"]), VALUE, n, S)


@routine
def note_cone(cone: Record, proximal: Record, n: int, S: Floats) -> None:
    """The excess of a rod over a cone at one of its ends: only that it is more than is kept."""
    least = cone["least_cosine"]
    lay_along_cone(cone, proximal, n, S)
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
    """Answer as `answer.answer` does where all legs are rods that blocks serve; how many targets are not reached.

    Those that close once what they leave open is completed may be reached too: they are OPEN, the others PENDING.
    """
    table = open_table(machine)
    legs, limited, cones, driven, task = table.legs, table.limited, table.cones, table.driven, table.task
    S, pose, left = np.empty((MORE, BLOCK)), np.zeros((4, 4)), 0
    copy_row(targets.reshape(-1), poses.reshape(-1))  # at once: that also fetches targets faster than reading blocks
    for first in range(0, targets.shape[0], BLOCK):
        n = min(BLOCK, targets.shape[0] - first)
        lay_out(targets, begins, task[0], first, n, pose, S)
        main, a, b, c = 0, 0, 0, 0
        for k in range(legs.shape[0]):
            if legs[k]["proximal"] != SHARED:
                main = k
            if legs[k]["proximal"] == CRANK or legs[k]["proximal"] == CARRIAGE:
                lay_sides(sides, k, first, n, S)
            lay_rod(legs[k], legs[main], n, S)
            while a < limited.shape[0] and limited[a]["leg"] == k:
                note_range(limited[a], n, S)
                a += 1
            while b < cones.shape[0] and cones[b]["leg"] == k:
                note_cone(cones[b], legs[main], n, S)
                b += 1
            while c < driven.shape[0] and driven[c]["leg"] == k:
                write_actuator(driven[c], first, n, S, actuators)
                c += 1
        left += write_status(task[0], first, n, S, status, measures)
        write_poses(task[0], first, n, S, poses)
    return left


@routine
def lay_sides(sides: Floats, k: int, first: int, n: int, S: Floats) -> None:
    for i in range(n):
        S[SIDE, i] = sides[first + i if sides.shape[0] > 1 else 0, k]


@routine
def write_status(task: Record, first: int, n: int, S: Floats, status: Ints, measures: Floats) -> int:
    """Write which rows are reached, and what is measured of them; how many are not."""
    length, enough, left = task["length"], CLOSED if task["unset"] > 0 else CLOSE, 0
    status, measures = status[first : first + n], measures[first : first + n]
    for i in range(n):
        is_closed = S[ROW, i] <= enough
        is_reached = (S[MARGIN, i] == 1.0) & is_closed & (S[EXCESS, i] <= KEPT)
        is_open = (S[MARGIN, i] == 1.0) & (not is_closed) & (task["unset"] > 0)
        status[i] = REACHED if is_reached else (OPEN if is_open else PENDING)
        left += 0 if is_reached else 1
        measures[i, RESIDUAL] = S[ROW, i] * length
        measures[i, LIMIT_EXCESS] = max(S[EXCESS, i], 0.0)
    return left


@routine
def write_poses(task: Record, first: int, n: int, S: Floats, poses: Floats) -> None:
    """Write what targets do not set of poses, and rotations that had to be made orthonormal."""
    length, is_set, own = task["length"], task["rotations"] == 3, poses[first : first + n]
    for i in range(n):
        if not is_set or S[OFF, i] > ROUNDED:
            for j in range(9):
                own[i, j // 3, j % 3] = S[XX + j, i]
    for j in range(3):
        if task["axes"][j] == 0:
            for i in range(n):
                own[i, j, 3] = S[PX + j, i] * length


@routine
def write_actuator(driven: Record, first: int, n: int, S: Floats, actuators: Floats) -> None:
    """Write the values of an actuator."""
    home, unit, sense, place = driven["home"], driven["unit"], driven["sense"], VALUES + driven["place"]
    (more, least, most), own = turns_of(driven), actuators[first : first + n, driven["column"]]
    for i in range(n):
        S[VALUE, i] = home + turned_into(sense * S[place, i] + more, least, most) * unit
    for i in range(n):
        own[i] = S[VALUE, i]
