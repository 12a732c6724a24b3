"""Legs in the pose of the platform and the coordinates of what carries their rods: equations and their derivatives.

Nothing is eliminated here, so that all of it is smooth where rods are stretched out over what carries them, and both
working modes are one set. Unknowns, n of them: the twist of the platform (velocity of its reference point, angular
velocity), then one for each crank and carriage, then one for each arm. Equations, besides those that `legs` leave on
the pose: each rod on a crank or carriage has its length.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Record
from .._jit import routine
from ..legs.answer import end_of_rows
from ..legs.endings import turned
from ..legs.frames import (
    ZERO,
    new_frames,
    orienting_coordinate,
    place_redundant,
    put_pose_slope,
    q_redundant_of,
    redundant_slope,
    set_frames,
)
from ..legs.pivots import pivot_rows, pivot_slopes, place_pivot
from ..legs.records import (
    CARRIAGE,
    COSINE,
    CRANK,
    HINGE,
    N_VALUES,
    PIVOT,
    Q_PROXIMAL,
    REDUNDANT,
    ROD,
    SHARED,
    SINE,
    SLIDE,
    Table,
)
from ..legs.rods import (
    base_end_of,
    evaluate_rod,
    proximal_rate,
    rod_rows,
    solve_proximal,
    turned_by_proximal,
    twist_rate,
)
from ..vectors import Vec, along, cross, dot, move, norm, scale, sub, turn, vec, wrap

# How far from a dead point, as `solve_proximal` says, a carrier must be to be put where its rod has its length.
WELL_AWAY = 1e-2


class PlatformState(NamedTuple):
    """A configuration under work."""

    pose: Floats  # (4, 4) [L]
    q: Floats  # (legs,): of its carrier, or of an arm, deviation from home [L or rad]
    sides: Floats  # (legs,): which of its two solutions a pivot of three hinges takes


class LegEvaluation(NamedTuple):
    """What legs are like at a configuration."""

    frames: Floats  # (n, 7, 4): see `legs.frames`
    values: Floats  # (legs, N_VALUES)
    lines: Floats  # (legs, 3): of a rod, from foot to head
    rows: Floats  # (m,): the equations
    slopes: Floats  # (m, n): their derivatives
    slope: Floats  # (n,): that of a limit


def new_platform_state(legs: int) -> PlatformState:
    """Memory for a configuration."""
    return PlatformState(np.zeros((4, 4)), np.zeros(legs), np.zeros(legs))


def new_leg_evaluation(table: Table) -> LegEvaluation:
    """Memory for what is told of it."""
    legs, n = table.legs.shape[0], count_unknowns(table)
    m = table.task[0]["rows"] + count_proximal(table)
    values, lines = np.zeros((legs, N_VALUES)), np.zeros((legs, 3))
    return LegEvaluation(new_frames(table.legs), values, lines, np.zeros(m), np.zeros((m, n)), np.zeros(n))


@routine
def count_unknowns(table: Table) -> int:
    n = 6
    for k in range(table.columns.shape[0]):
        n = max(n, table.columns[k] + 1)
    return n


@routine
def count_proximal(table: Table) -> int:
    """How many rods have a carrier of their own."""
    n = 0
    for k in range(table.legs.shape[0]):
        n += 1 if has_proximal(table.legs[k]) else 0
    return n


@routine
def has_proximal(leg: Record) -> bool:
    """Whether a leg is a rod with a carrier of its own."""
    return bool(leg["kind"] == ROD and (leg["proximal"] == CRANK or leg["proximal"] == CARRIAGE))


@routine
def main_of(table: Table, k: int) -> int:
    """The leg whose carrier a leg is on; itself if it is on none but its own."""
    while table.legs[k]["proximal"] == SHARED:
        k -= 1
    return k


@routine
def place(table: Table, state: PlatformState, leg_eval: LegEvaluation) -> float:
    """Read all legs at a configuration, and fill the equations; the largest of them, infinite if not a number."""
    legs, rows, main = table.legs, leg_eval.rows, 0
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(legs.shape[0]):
        main = main if legs[k]["proximal"] == SHARED else k
        place_leg(table, k, main, state, leg_eval)
    worst = 0.0
    for i in range(rows.shape[0]):
        if not abs(rows[i]) <= worst:
            worst = abs(rows[i])
    return worst if worst == worst else math.inf


@routine
def place_leg(table: Table, k: int, main: int, state: PlatformState, leg_eval: LegEvaluation) -> None:
    """Read one leg at a configuration whose `leg_eval.frames` are filled, and fill its equations.

    Parameters
    ----------
    main : the leg whose carrier it is on, read before; itself if it is on none but its own.
    """
    legs, values, lines, rows = table.legs, leg_eval.values, leg_eval.lines, leg_eval.rows
    leg, lead = legs[k], legs[main]
    frame = leg_eval.frames[leg["frame"]]
    if leg["kind"] == PIVOT:
        place_pivot(leg, frame, state.sides[k], values[k])
        pivot_rows(leg, frame, leg_eval.rows)
    elif leg["kind"] == REDUNDANT:
        place_redundant(leg, q_redundant_of(legs, k, state.q), leg_eval.frames, values[k])
    elif leg["kind"] == ROD:
        if has_proximal(leg):
            values[k, Q_PROXIMAL] = state.q[k]
            values[k, COSINE], values[k, SINE] = math.cos(state.q[k]), math.sin(state.q[k])
        evaluate_rod(leg, lead, frame, values[main], values[k], lines[k])
        rod_rows(leg, lead, frame, values[main], values[k], lines[k], leg_eval.rows)
        if has_proximal(leg):
            rows[own_row(table, k)] = values[k, SLIDE]


@routine
def close_rods(table: Table, state: PlatformState, leg_eval: LegEvaluation) -> None:
    """Bring carriers to where their rods have their lengths, on the sides that they are on, but not near dead points:
    there a pose says little of them."""
    q, own = state.q, leg_eval.values
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(q.shape[0]):
        leg = table.legs[k]
        if leg["orients"] == 1:
            frame, rod = leg_eval.frames[leg["frame"]], table.legs[k + 1]
            found, singularity_margin = orienting_coordinate(
                leg, rod, frame, branch_of_redundant(leg, rod, frame, q[k])
            )
            if singularity_margin > WELL_AWAY:
                q[k] = wrap(found, q[k]) if leg["proximal"] == CRANK else found
        if leg["kind"] == REDUNDANT:
            place_redundant(leg, q_redundant_of(table.legs, k, q), leg_eval.frames, own[k])
        if has_proximal(leg):
            platform_end = move(leg_eval.frames[leg["frame"]], vec(leg["platform_end_point"]))
            if solve_proximal(leg, platform_end, side_of(leg, platform_end, q[k]), own[k]) > WELL_AWAY:
                q[k] = wrap(own[k, Q_PROXIMAL], q[k]) if leg["proximal"] == CRANK else own[k, Q_PROXIMAL]


@routine
def side_of(rod: Record, platform_end: Vec, q: float) -> float:
    """The side of a carrier: of its dead point, where the rod comes nearest to the head."""
    if rod["proximal"] == CRANK:
        x = sub(platform_end, vec(rod["proximal_point"]))
        return math.copysign(
            1.0, dot(vec(rod["crank"]), x) * math.sin(q) - dot(vec(rod["crank_across"]), x) * math.cos(q)
        )
    return math.copysign(1.0, q - dot(sub(platform_end, vec(rod["base_end_point"])), vec(rod["proximal_axis"])))


@routine
def branch_of_redundant(arm: Record, rod: Record, frame: Floats, q: float) -> float:
    """The same of an arm that `orienting_coordinate` places: by which way the plane turns away from the head."""
    axis, n = vec(arm["proximal_axis"]), vec(rod["base_end_axes"][0])
    x = sub(move(frame, vec(rod["platform_end_point"])), vec(arm["proximal_point"]))
    return math.copysign(1.0, dot(cross(turned(n, axis, math.cos(q), math.sin(q)), axis), x))


@routine
def own_row(table: Table, k: int) -> int:
    """The equation by which the rod of a carrier has its length."""
    return int(table.task[0]["rows"] - 6 + table.columns[k])


@routine
def put_slopes(table: Table, leg_eval: LegEvaluation) -> None:
    """Fill the derivatives of the equations."""
    legs, slopes, main = table.legs, leg_eval.slopes, 0
    for i in range(slopes.shape[0]):
        for j in range(6, slopes.shape[1]):
            slopes[i, j] = 0.0
    for k in range(legs.shape[0]):
        main = main if legs[k]["proximal"] == SHARED else k
        put_leg_slopes(table, k, main, leg_eval)


@routine
def put_leg_slopes(table: Table, k: int, main: int, leg_eval: LegEvaluation) -> None:
    """Fill the derivatives of one leg's equations, by the unknowns that they have."""
    leg, slopes = table.legs[k], leg_eval.slopes
    if leg["kind"] == PIVOT:
        pivot_slopes(leg, leg_eval.frames[leg["frame"]], leg_eval.slopes)
        for row in range(leg["first_row"], end_of_rows(table.legs, k, table.task[0]["rows"])):
            put_redundant_slopes(table, k, leg_eval, slopes[row])
    elif leg["kind"] == ROD:
        if has_proximal(leg):
            put_rate(table, k, k, direction(leg_eval.lines[k]), ZERO, ZERO, leg_eval, slopes[own_row(table, k)])
        put_rod_slopes(table, k, main, leg_eval)


@routine
def direction(line: Floats) -> Vec:
    return scale(1.0 / norm(vec(line)), vec(line))


@routine
def put_rate(table: Table, k: int, main: int, a: Vec, b: Vec, c: Vec, leg_eval: LegEvaluation, slope: Floats) -> None:
    """Derivative (n,) of a . (dH - dF) + b . W + c . w of a rod; only the entries of its unknowns are written.

    Parameters
    ----------
    main : the leg whose carrier it is on; itself if on none.
    """
    rod, proximal, column = table.legs[k], table.legs[main], table.columns[main]
    put_pose_slope(rod, leg_eval.frames[rod["frame"]], a, c, slope)
    if column >= 0:
        slope[column] = proximal_rate(proximal, base_end_of(rod, proximal, leg_eval.values[main]), a, b)
    put_redundant_slopes(table, k, leg_eval, slope)


@routine
def put_redundant_slopes(table: Table, k: int, leg_eval: LegEvaluation, slope: Floats) -> None:
    """Derivatives by the arms that a leg is on, from those by the pose."""
    arm = table.legs[k]["redundant"]
    while arm >= 0:
        slope[table.columns[arm]] = 0.0
        arm = table.legs[arm]["redundant"]
    arm = table.legs[k]["redundant"]
    while arm >= 0:
        slope[table.columns[arm]] += redundant_slope(slope, leg_eval.values[arm])
        arm = table.legs[arm]["redundant"]
    if table.legs[k]["inner"] == 1:
        for j in range(6):
            slope[j] = 0.0


@routine
def put_rod_slopes(table: Table, k: int, main: int, leg_eval: LegEvaluation) -> None:
    """Fill the derivatives of the equations that `rod_rows` fills."""
    rod, proximal, lead, slopes = table.legs[k], table.legs[main], leg_eval.values[main], leg_eval.slopes
    frame, n, span, u = (
        leg_eval.frames[rod["frame"]],
        rod["first_row"],
        vec(leg_eval.lines[k]),
        direction(leg_eval.lines[k]),
    )
    if rod["slides"] == 0 and not has_proximal(rod):
        put_rate(table, k, main, u, ZERO, ZERO, leg_eval, slopes[n])
        n += 1
    if rod["base_end"] == HINGE:
        axis = turned_by_proximal(proximal, lead, vec(rod["base_end_axes"][0]), 1.0)
        put_rate(table, k, main, axis, cross(axis, span), ZERO, leg_eval, slopes[n])
        n += 1
    if rod["platform_end"] == HINGE:
        axis = turn(frame, vec(rod["platform_end_axes"][0]))
        put_rate(table, k, main, axis, ZERO, cross(axis, span), leg_eval, slopes[n])
        n += 1
    if rod["twists"] == 1:
        by_line, b, c = twist_rate(rod, proximal, frame, lead, leg_eval.values[k], u)
        by_line = scale(1.0 / norm(span), along(by_line, -dot(by_line, u), u))
        put_rate(table, k, main, by_line, b, c, leg_eval, slopes[n])
