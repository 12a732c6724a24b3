"""Equations of legs, and their derivatives, in the platform's pose and the proximal and redundant coordinates.

Nothing is eliminated here: the equations are smooth through dead points, and both working modes belong to one set.
Unknowns, n of them: the twist of the platform (velocity of its reference point, angular velocity), then one for each
crank and carriage, then one for each redundant joint. Equations: the constraints of the legs on the pose, then the
length of each rod on its own crank or carriage.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Record
from .._jit import routine
from ..legs.endings import turned
from ..legs.frames import (
    ZERO,
    new_frames,
    orienting_coordinate,
    put_pose_slope,
    q_redundant_of,
    redundant_slope,
    set_frames,
)
from ..legs.kinds import leg_rows, place_frame, place_leg
from ..legs.pivots import pivot_slopes
from ..legs.records import (
    COSINE,
    CRANK,
    HINGE,
    N_VALUES,
    PIVOT,
    Q_PROXIMAL,
    ROD,
    SHARED,
    SINE,
    SLIDE,
    Table,
)
from ..legs.rods import (
    base_end_of,
    proximal_rate,
    solve_proximal,
    turned_by_proximal,
    twist_rate,
)
from ..vectors import Vec, along, cross, dot, move, norm, scale, sub, turn, vec, wrap
from .pose_constants import FAR_FROM_DEAD_POINT


class PlatformState(NamedTuple):
    """A configuration: the platform's pose, and the coordinates and sides of legs."""

    pose: Floats  # (4, 4) [L]
    q: Floats  # (legs,): of the proximal or redundant joint, deviation from home [L or rad]
    sides: Floats  # (legs,): side of each leg; a pivot of three hinges is placed by it


class LegEvaluation(NamedTuple):
    """Legs evaluated at a configuration."""

    frames: Floats  # (n, 7, 4), as in `legs.frames`
    values: Floats  # (legs, N_VALUES)
    lines: Floats  # (legs, 3): of a rod, from base end to platform end
    rows: Floats  # (m,): the equations
    slopes: Floats  # (m, n): their derivatives
    slope: Floats  # (n,): derivative of one limit or coordinate


def new_platform_state(legs: int) -> PlatformState:
    """Allocate a configuration."""
    return PlatformState(np.zeros((4, 4)), np.zeros(legs), np.zeros(legs))


def new_leg_evaluation(table: Table) -> LegEvaluation:
    """Allocate a leg evaluation."""
    legs, n = table.legs.shape[0], count_unknowns(table)
    m = table.task[0]["rows"] + count_proximal(table)
    values, lines = np.zeros((legs, N_VALUES)), np.zeros((legs, 3))
    return LegEvaluation(new_frames(table.legs), values, lines, np.zeros(m), np.zeros((m, n)), np.zeros(n))


@routine
def count_unknowns(table: Table) -> int:
    """Number of unknowns."""
    n = 6
    for k in range(table.columns.shape[0]):
        n = max(n, table.columns[k] + 1)
    return n


@routine
def count_proximal(table: Table) -> int:
    """Number of rods with a proximal joint of their own."""
    n = 0
    for k in range(table.legs.shape[0]):
        n += 1 if has_proximal(table.legs[k]) else 0
    return n


@routine
def has_proximal(leg: Record) -> bool:
    """True if a leg is a rod with a proximal joint of its own."""
    return bool(leg["has_proximal"] == 1)


@routine
def owner_of(table: Table, k: int) -> int:
    """Index of the leg that owns the proximal joint of a leg; the leg itself if it shares none."""
    while table.legs[k]["proximal"] == SHARED:
        k -= 1
    return k


@routine
def evaluate_legs(table: Table, state: PlatformState, leg_eval: LegEvaluation) -> float:
    """Evaluate all legs at a configuration and fill the equations; the largest of them, infinite if not a number."""
    legs, rows, owner = table.legs, leg_eval.rows, 0
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(legs.shape[0]):
        owner = owner if legs[k]["proximal"] == SHARED else k
        evaluate_leg(table, k, owner, state, leg_eval)
    worst = 0.0
    for i in range(rows.shape[0]):
        if not abs(rows[i]) <= worst:
            worst = abs(rows[i])
    return worst if worst == worst else math.inf


@routine
def evaluate_leg(table: Table, k: int, owner: int, state: PlatformState, leg_eval: LegEvaluation) -> None:
    """Evaluate one leg at a configuration with filled `leg_eval.frames`, and fill its equations.

    Parameters
    ----------
    owner : the leg that owns its proximal joint, evaluated before; itself if it shares none.
    """
    legs, frames, values, lines, rows = table.legs, leg_eval.frames, leg_eval.values, leg_eval.lines, leg_eval.rows
    if has_proximal(legs[k]):
        values[k, Q_PROXIMAL] = state.q[k]
        values[k, COSINE], values[k, SINE] = math.cos(state.q[k]), math.sin(state.q[k])
    place_leg(legs, k, owner, q_redundant_of(legs, k, state.q), state.sides[k], frames, values, lines)
    leg_rows(legs, k, owner, frames, values, lines, rows)
    if has_proximal(legs[k]):
        rows[length_row(table, k)] = values[k, SLIDE]


@routine
def close_rods(table: Table, state: PlatformState, leg_eval: LegEvaluation) -> None:
    """Move proximal and orienting joints to their closed-form solutions, on the sides that they are on.

    Joints near dead points stay: there the pose hardly determines them.
    """
    q, values = state.q, leg_eval.values
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(q.shape[0]):
        leg = table.legs[k]
        if leg["orients"] == 1:
            frame, rod = leg_eval.frames[leg["frame"]], table.legs[k + 1]
            coordinate, singularity_margin = orienting_coordinate(
                leg, rod, frame, redundant_side(leg, rod, frame, q[k])
            )
            if singularity_margin > FAR_FROM_DEAD_POINT:
                q[k] = wrap(coordinate, q[k]) if leg["proximal"] == CRANK else coordinate
        place_frame(table.legs, k, q, leg_eval.frames, values)
        if has_proximal(leg):
            platform_end = move(leg_eval.frames[leg["frame"]], vec(leg["platform_end_point"]))
            if (
                solve_proximal(leg, platform_end, proximal_side(leg, platform_end, q[k]), values[k])
                > FAR_FROM_DEAD_POINT
            ):
                q[k] = wrap(values[k, Q_PROXIMAL], q[k]) if leg["proximal"] == CRANK else values[k, Q_PROXIMAL]


@routine
def proximal_side(rod: Record, platform_end: Vec, q: float) -> float:
    """Side of a proximal joint: the sign of its displacement from the dead point."""
    if rod["proximal"] == CRANK:
        x = sub(platform_end, vec(rod["proximal_point"]))
        return math.copysign(
            1.0, dot(vec(rod["crank"]), x) * math.sin(q) - dot(vec(rod["crank_across"]), x) * math.cos(q)
        )
    return math.copysign(1.0, q - dot(sub(platform_end, vec(rod["base_end_point"])), vec(rod["proximal_axis"])))


@routine
def redundant_side(joint: Record, rod: Record, frame: Floats, q: float) -> float:
    """Side of an orienting joint: the sign of its displacement from the dead point."""
    axis, n = vec(joint["proximal_axis"]), vec(rod["base_end_axes"][0])
    x = sub(move(frame, vec(rod["platform_end_point"])), vec(joint["proximal_point"]))
    return math.copysign(1.0, dot(cross(turned(n, axis, math.cos(q), math.sin(q)), axis), x))


@routine
def length_row(table: Table, k: int) -> int:
    """Index of the equation for the length of a rod on its own proximal joint."""
    return int(table.task[0]["rows"] - 6 + table.columns[k])


@routine
def put_slopes(table: Table, leg_eval: LegEvaluation) -> None:
    """Fill the derivatives of the equations."""
    legs, slopes, owner = table.legs, leg_eval.slopes, 0
    for i in range(slopes.shape[0]):
        for j in range(6, slopes.shape[1]):
            slopes[i, j] = 0.0
    for k in range(legs.shape[0]):
        owner = owner if legs[k]["proximal"] == SHARED else k
        put_leg_slopes(table, k, owner, leg_eval)


@routine
def put_leg_slopes(table: Table, k: int, owner: int, leg_eval: LegEvaluation) -> None:
    """Fill the derivatives of one leg's equations, by the unknowns that enter them."""
    leg, slopes = table.legs[k], leg_eval.slopes
    if leg["kind"] == PIVOT:
        pivot_slopes(leg, leg_eval.frames[leg["frame"]], leg_eval.slopes)
        for row in range(leg["first_row"], leg["first_row"] + leg["n_rows"]):
            put_redundant_slopes(table, k, leg_eval, slopes[row])
    elif leg["kind"] == ROD:
        if has_proximal(leg):
            put_rate(table, k, k, direction(leg_eval.lines[k]), ZERO, ZERO, leg_eval, slopes[length_row(table, k)])
        put_rod_slopes(table, k, owner, leg_eval)


@routine
def direction(line: Floats) -> Vec:
    """Unit vector along a line."""
    return scale(1.0 / norm(vec(line)), vec(line))


@routine
def put_rate(table: Table, k: int, owner: int, a: Vec, b: Vec, c: Vec, leg_eval: LegEvaluation, slope: Floats) -> None:
    """Derivative (n,) of a . (dH - dF) + b . W + c . w of a rod; only the entries of its unknowns are written.

    Parameters
    ----------
    owner : the leg that owns its proximal joint; itself if it shares none.
    """
    rod, proximal, column = table.legs[k], table.legs[owner], table.columns[owner]
    put_pose_slope(rod, leg_eval.frames[rod["frame"]], a, c, slope)
    if column >= 0:
        slope[column] = proximal_rate(proximal, base_end_of(rod, proximal, leg_eval.values[owner]), a, b)
    put_redundant_slopes(table, k, leg_eval, slope)


@routine
def put_redundant_slopes(table: Table, k: int, leg_eval: LegEvaluation, slope: Floats) -> None:
    """Fill the derivatives by the redundant joints that a leg is on, from those by the pose."""
    joint = table.legs[k]["redundant"]
    while joint >= 0:
        slope[table.columns[joint]] = 0.0
        joint = table.legs[joint]["redundant"]
    joint = table.legs[k]["redundant"]
    while joint >= 0:
        slope[table.columns[joint]] += redundant_slope(slope, leg_eval.values[joint])
        joint = table.legs[joint]["redundant"]
    if table.legs[k]["inner"] == 1:
        for j in range(6):
            slope[j] = 0.0


@routine
def put_rod_slopes(table: Table, k: int, owner: int, leg_eval: LegEvaluation) -> None:
    """Fill the derivatives of the equations that `rod_rows` fills."""
    rod, proximal, proximal_values, slopes = table.legs[k], table.legs[owner], leg_eval.values[owner], leg_eval.slopes
    frame, n, span, u = (
        leg_eval.frames[rod["frame"]],
        rod["first_row"],
        vec(leg_eval.lines[k]),
        direction(leg_eval.lines[k]),
    )
    if rod["slides"] == 0 and not has_proximal(rod):
        put_rate(table, k, owner, u, ZERO, ZERO, leg_eval, slopes[n])
        n += 1
    if rod["base_end"] == HINGE:
        axis = turned_by_proximal(proximal, proximal_values, vec(rod["base_end_axes"][0]), 1.0)
        put_rate(table, k, owner, axis, cross(axis, span), ZERO, leg_eval, slopes[n])
        n += 1
    if rod["platform_end"] == HINGE:
        axis = turn(frame, vec(rod["platform_end_axes"][0]))
        put_rate(table, k, owner, axis, ZERO, cross(axis, span), leg_eval, slopes[n])
        n += 1
    if rod["twists"] == 1:
        by_line, b, c = twist_rate(rod, proximal, frame, proximal_values, leg_eval.values[k], u)
        by_line = scale(1.0 / norm(span), along(by_line, -dot(by_line, u), u))
        put_rate(table, k, owner, by_line, b, c, leg_eval, slopes[n])
