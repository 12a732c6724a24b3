"""Joint coordinates, constraints, slopes and Jacobians of legs in closed form, at poses of the platform.

Let C be the derivative of the legs' constraints on the pose, and J that of the actuators, by the platform's twist. With
B an orthonormal basis of the null space of C, the platform moves by B y and the actuators by J B y. So the inverse
Jacobian is J B B', and the forward Jacobian B (J B)+.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from .._jit import opener, routine, search
from ..joints.first_order import REGULAR, orthonormalise_rows, triangularise
from ..legs.answer import deviation, place_legs, put_rows, put_slopes
from ..legs.complete_poses import load_pose
from ..legs.frames import set_frames
from ..legs.leg_constants import LEAST_MARGIN
from ..legs.records import SAMPLE, Table, open_table
from ..legs.rods import put_proximal_slope
from ..vectors import copy_row
from .equations import (
    LegEvaluation,
    PlatformState,
    direction,
    evaluate_legs,
    has_proximal,
    new_leg_evaluation,
    new_platform_state,
)
from .limits import coordinate_slope

# Singularity margin (squared sine of the angle from a dead point, or from aligned hinges) below which actuators have no
# slopes: these go with the inverse of the sine, which poses of 16 digits give to 12 there.
LEAST_SLOPE_MARGIN = 1e-4
# Constraint up to which legs are closed [L or rad].
CLOSED = 1e-9


class EvaluationScratch(NamedTuple):
    """Scratch memory of one thread."""

    state: PlatformState
    leg_eval: LegEvaluation
    proximal_slopes: Floats  # (legs, 6): derivatives of proximal coordinates by the pose


def new_evaluation_scratch(table: Table) -> EvaluationScratch:
    """Allocate the scratch memory of one thread."""
    return EvaluationScratch(
        new_platform_state(len(table.legs)), new_leg_evaluation(table), np.zeros((len(table.legs), 6))
    )


open_evaluation_scratch = opener(new_evaluation_scratch(SAMPLE))


@search
def evaluate_poses(
    machine: int,
    scratch_address: int,
    poses: Floats,
    sides: Floats,
    q_proximal: Floats,
    coordinates: Floats,
    rows: Floats,
    slopes: Floats,
) -> None:
    """Evaluate legs at poses (n, 4, 4) [length]: coordinates, constraints and derivatives, whichever have rows.

    Parameters
    ----------
    machine, scratch_address : addresses of the kernel table and of `EvaluationScratch`.
    sides : side of each leg, (n or 1, legs).
    q_proximal : coordinates of proximal joints, (n or 0, legs) [L or rad]; NaN to solve them in closed form.
    coordinates : filled with the joint coordinates of legs, deviations from home, (n or 0, columns) [length or rad].
    rows, slopes : filled with the constraints of all legs, (n or 0, rows), and their derivatives by the pose and by
        redundant joints, (n or 0, rows, 6 + n_redundant) [L, rad]: NaN if a leg with rows is at or beyond a dead point.
        If slopes have room for those of actuators behind them, of machines without redundant joints,
        (n, rows + n_a, 6), they are NaN near dead points of any leg, and if legs are not closed.
    """
    table, scratch = open_table(machine), open_evaluation_scratch(scratch_address)
    state, leg_eval, legs, known = scratch.state, scratch.leg_eval, table.legs, table.known
    for row in range(poses.shape[0]):
        load_pose(poses[row], table.task[0]["length"], state.pose)
        copy_row(sides[row if sides.shape[0] > 1 else 0], state.sides)
        total = math.nan
        if q_proximal.shape[0] > 0:
            total = 0.0
            copy_row(q_proximal[row], state.q)
            for k in range(state.q.shape[0]):
                total += state.q[k]
        margin, margin_of_rows, gap = 1.0, 1.0, 0.0
        if rows.shape[0] > 0 or not abs(total) < math.inf:
            set_frames(state.pose, table.task[0], leg_eval.frames)
            margin, margin_of_rows = place_legs(legs, leg_eval.frames, state.sides, leg_eval.values, leg_eval.lines)
        if abs(total) < math.inf:
            gap = evaluate_legs(table, state, leg_eval)
        for i in range(known.shape[0] if coordinates.shape[0] > 0 else 0):
            coordinates[row, known[i]["column"]] = deviation(known[i], leg_eval.values) * known[i]["unit"]
        if rows.shape[0] > 0:
            m, own = rows.shape[1], slopes[row]
            gap = max(gap, put_rows(legs, leg_eval.frames, leg_eval.values, leg_eval.lines, rows[row]))
            put_slopes(legs, leg_eval.frames, leg_eval.values, leg_eval.lines, scratch.proximal_slopes, own[:m])
            is_regular = margin_of_rows > LEAST_MARGIN * LEAST_MARGIN
            if own.shape[0] > m:
                is_regular = margin > LEAST_SLOPE_MARGIN and gap <= CLOSED
                put_actuator_slopes(table, leg_eval, scratch.proximal_slopes, own[m:])
            for i in range(own.shape[0] if not is_regular else 0):
                for j in range(own.shape[1]):
                    own[i, j] = math.nan


@routine
def put_actuator_slopes(table: Table, leg_eval: LegEvaluation, proximal_slopes: Floats, slopes: Floats) -> None:
    """Fill the derivatives of actuators by the pose, (n_a, 6); proximal joints move so that rods keep their lengths."""
    legs, slope = table.legs, leg_eval.slope
    for k in range(legs.shape[0]):
        if has_proximal(legs[k]) and legs[k]["has_rows"] == 0:
            frame, u = leg_eval.frames[legs[k]["frame"]], direction(leg_eval.lines[k])
            put_proximal_slope(legs[k], frame, leg_eval.values[k], u, proximal_slopes[k])
    for i in range(table.driven.shape[0]):
        coordinate_slope(table, table.driven[i], leg_eval)
        own = slopes[table.driven[i]["column"]]
        copy_row(slope[:6], own)
        for k in range(legs.shape[0]):
            column = table.columns[k]
            for j in range(6 if column >= 0 and slope[column] != 0.0 else 0):
                own[j] += slope[column] * proximal_slopes[k, j]


# Largest slope of a constraint that follows from others [L or rad].
IMPLIED = 1e-9


class JacobianTables(NamedTuple):
    """Scratch memory of one thread; r rows of a twist."""

    table: Floats  # (rows + r + n_a, r): constraints, the twist, and actuators, by the twist
    pairs: Floats  # (freedoms, r + n_a): twists with their actuator rates


def new_jacobian_tables(rows: int, rank: int, twists: int, actuators: int) -> JacobianTables:
    """Scratch memory of one thread for a number of constraints and their rank."""
    width = twists + actuators
    return JacobianTables(np.zeros((rows + width, twists)), np.zeros((twists - rank, width)))


open_tables = opener(new_jacobian_tables(0, 0, 6, 6))


@search
def jacobians(scratch_address: int, slopes: Floats, is_forward: int, maps: Floats) -> int:
    """Fill Jacobians of rows whose constraints have their generic rank, away from all singularities.

    Parameters
    ----------
    scratch : see `new_jacobian_tables`.
    slopes : of constraints, then of actuators, by the twist of the platform, (n, rows + n_a, 6) [L, rad].
    is_forward : 1 for twists by actuator rates, (n, r, n_a), 0 for actuator rates by twists, (n, n_a, r).
    maps : Jacobians to fill [L, rad]; the first entry of an unsolved row is NaN.

    Returns
    -------
    The number of unsolved rows.
    """
    scratch = open_tables(scratch_address)
    table, pairs = scratch.table, scratch.pairs
    width, twists, n_unsolved = pairs.shape[1], table.shape[1], 0
    rows = table.shape[0] - width
    for row in range(slopes.shape[0]):
        total = 0.0
        for j in range(twists):
            for i in range(rows):
                table[i, j] = slopes[row, i, j]
                total += table[i, j]
            for i in range(twists):
                table[rows + i, j] = 1.0 if i == j else 0.0
            for i in range(rows, slopes.shape[1]):
                table[twists + i, j] = slopes[row, i, j]
        to, first = (0, twists) if is_forward == 1 else (twists, 0)
        is_solved = abs(total) < math.inf and fill_pairs(rows, table, pairs)
        if not is_solved or (is_forward == 1 and not orthonormalise_rows(pairs, first, width)):
            maps[row, 0, 0] = math.nan
            n_unsolved += 1
            continue
        for i in range(maps.shape[1]):
            for j in range(maps.shape[2]):
                maps[row, i, j] = 0.0
                for k in range(pairs.shape[0]):
                    maps[row, i, j] += pairs[k, to + i] * pairs[k, first + j]
    return n_unsolved


@routine
def fill_pairs(rows: int, table: Floats, pairs: Floats) -> bool:
    """Fill an orthonormal basis of the twists that constraints allow, with their actuator rates.

    False if the rank of the constraints is not the generic one, or if rates are nearly infinite or NaN.
    """
    n, width = pairs.shape
    rank = table.shape[1] - n
    if rank > 0:
        triangularise(table, rows, rank)
        if not abs(table[rank - 1, rank - 1]) > REGULAR:
            return False
    for k in range(n):
        for i in range(rank, rows):
            if not abs(table[i, rank + k]) <= IMPLIED:
                return False
        for i in range(width):
            pairs[k, i] = table[rows + i, rank + k]
            if not abs(pairs[k, i]) < 1.0 / REGULAR:
                return False
    return True
