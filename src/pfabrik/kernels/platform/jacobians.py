"""Jacobians of platforms on legs in closed form, from the slopes of the legs' own constraints and coordinates.

With C the derivative of the constraints that legs leave on the pose, and J that of the actuators, by the platform's
twist: the platform moves by B y, with B an orthonormal basis of the null space of C, and the actuators by J B y. So
the inverse Jacobian is J B B', and the forward one B (J B)+.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Mask
from .._jit import routine, search
from ..closure.first_order import size_of, triangularise
from ..legs.answer import place_legs, put_rows, put_slopes
from ..legs.frames import set_frames
from ..legs.poses import load_pose
from ..legs.records import Table
from ..legs.rods import put_proximal_slope
from ..legs.table import SAMPLE, open_table
from ..references import opener
from .equations import LegEvaluation, direction, has_proximal, new_leg_evaluation
from .limits import coordinate_slope

# Square of the sine of the angle from a dead point, or from aligned hinges, from which on slopes are exact to a
# thousand times rounding.
SURE = 1e-6
# Constraint up to which legs are closed, and slope up to which one follows from others [L or rad].
CLOSED = 1e-9
# Size of a slope below which it may be that of a singular configuration, the inverse of the largest [L or rad].
REGULAR = 1e-4
# Share of a row that has to be left of it beside others, for it to be orthogonal to them at once.
ENOUGH = 0.5


class JacobianTables(NamedTuple):
    """Scratch memory of one thread; r rows of a twist."""

    pose: Floats  # (4, 4) [L]
    leg_eval: LegEvaluation
    proximal_slopes: Floats  # (legs, 6): derivatives of carriers' coordinates
    slopes: Floats  # (rows, 6): those of constraints
    table: Floats  # (rows + r + n_a, r): constraints, the twist, and actuators, by the twist
    pairs: Floats  # (freedoms, r + n_a): twists and actuator rates that go together


def new_jacobian_tables(table: Table, rank: int, twists: int) -> JacobianTables:
    """Scratch memory of one thread, for constraints of some rank."""
    rows, legs, width = table.task[0]["rows"], len(table.legs), twists + len(table.driven)
    return JacobianTables(
        np.zeros((4, 4)),
        new_leg_evaluation(table),
        np.zeros((legs, 6)),
        np.zeros((rows, 6)),
        np.zeros((rows + width, twists)),
        np.zeros((twists - rank, width)),
    )


open_tables = opener(new_jacobian_tables(SAMPLE, 0, 6))


@search
def jacobians(
    machine: int,
    scratch_address: int,
    poses: Floats,
    sides: Floats,
    is_forward: int,
    found: Floats,
    is_told: Mask,
) -> int:
    """Fill Jacobians at poses (n, 4, 4) [length] whose constraints have their rank, away from all singularities.

    Parameters
    ----------
    machine, scratch : see `open_table` and `new_jacobian_tables`; the angles of all endings are asked for.
    sides : which of its two solutions each leg takes, (n or 1, legs).
    is_forward : 1 for twists by actuator rates, (n, r, n_a), 0 for actuator rates by twists, (n, n_a, r).
    found : filled with them [length, rad].
    is_told : filled with which rows these are, (n,).

    Returns
    -------
    How many rows are not told.
    """
    table, scratch = open_table(machine), open_tables(scratch_address)
    rows, twists = scratch.slopes.shape[0], scratch.table.shape[1]
    width, left = scratch.table.shape[0] - rows, 0
    for row in range(poses.shape[0]):
        load_pose(poses[row], table.task[0]["length"], scratch.pose)
        is_told[row] = (
            put_leg_slopes(table, sides[row if sides.shape[0] > 1 else 0], scratch)
            and put_pairs(rows, scratch.table, scratch.pairs)
            and (is_forward == 0 or orthogonalise(scratch.pairs, twists, width))
        )
        if not is_told[row]:
            left += 1
        elif is_forward == 1:
            put_product(scratch.pairs, 0, twists, width, found[row])
        else:
            put_product(scratch.pairs, twists, 0, twists, found[row])
        put_units(table, is_forward, found[row])
    return left


@routine
def put_leg_slopes(table: Table, sides: Floats, scratch: JacobianTables) -> bool:
    """Fill the table at a pose; False where legs are not closed, or next to a dead point."""
    legs, leg_eval, slopes, proximal_slopes = table.legs, scratch.leg_eval, scratch.slopes, scratch.proximal_slopes
    frames, values, lines = leg_eval.frames, leg_eval.values, leg_eval.lines
    rows, twists = slopes.shape[0], scratch.table.shape[1]
    set_frames(scratch.pose, table.task[0], frames)
    margin, _ = place_legs(legs, frames, sides, values, lines)
    if not margin > SURE or not put_rows(legs, frames, values, lines, leg_eval.rows) <= CLOSED:
        return False
    put_slopes(legs, frames, values, lines, proximal_slopes, slopes)
    for k in range(legs.shape[0]):
        if has_proximal(legs[k]) and legs[k]["has_rows"] == 0:
            put_proximal_slope(legs[k], frames[legs[k]["frame"]], values[k], direction(lines[k]), proximal_slopes[k])
    for j in range(twists):
        for i in range(rows):
            scratch.table[i, j] = slopes[i, j]
        for i in range(twists):
            scratch.table[rows + i, j] = 1.0 if i == j else 0.0
    for i in range(table.driven.shape[0]):
        driven, slope = table.driven[i], leg_eval.slope
        coordinate_slope(table, driven, leg_eval)
        for k in range(legs.shape[0]):
            column = table.columns[k]
            for j in range(twists if column >= 0 and slope[column] != 0.0 else 0):
                slope[j] += slope[column] * proximal_slopes[k, j]
        for j in range(twists):
            scratch.table[rows + twists + driven["column"], j] = slope[j]
    return True


@routine
def put_pairs(rows: int, table: Floats, pairs: Floats) -> bool:
    """Fill the twists that constraints allow, orthonormal, and actuator rates with them; False where the constraints
    have not the rank that leaves so many, or the rates are next to infinite."""
    n, width = pairs.shape
    rank, largest = table.shape[1] - n, 0.0
    if rank > 0:
        triangularise(table, rows, rank)
        if not abs(table[rank - 1, rank - 1]) > REGULAR:
            return False
    for k in range(n):
        for i in range(rank, rows):
            if not abs(table[i, rank + k]) <= CLOSED:
                return False
        for i in range(width):
            pairs[k, i] = table[rows + i, rank + k]
            largest = max(largest, abs(pairs[k, i]))
    return largest < 1.0 / REGULAR


@routine
def orthogonalise(pairs: Floats, first: int, last: int) -> bool:
    """Make the columns from `first` to `last` of all rows orthonormal, by Gram and Schmidt; the others go along.

    False where next to nothing is left of one.
    """
    n, width = pairs.shape
    for k in range(n):
        size = size_of(pairs, k, first, last)
        for _ in range(2):  # what is left of a row after much of it was taken is not orthogonal yet
            before = size
            for j in range(k):
                share = 0.0
                for i in range(first, last):
                    share += pairs[j, i] * pairs[k, i]
                for i in range(width):
                    pairs[k, i] -= share * pairs[j, i]
            size = size_of(pairs, k, first, last)
            if size > ENOUGH * before:
                break
        if not size > REGULAR:
            return False
        for i in range(width):
            pairs[k, i] /= size
    return True


@routine
def put_product(pairs: Floats, to: int, first: int, last: int, found: Floats) -> None:
    """The map from columns `first` to `last` of pairs, orthonormal there, to the others, which begin at `to`."""
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            total = 0.0
            for k in range(pairs.shape[0]):
                total += pairs[k, to + i] * pairs[k, first + j]
            found[i, j] = total


@routine
def put_units(table: Table, is_forward: int, found: Floats) -> None:
    """Give lengths and angles of a Jacobian their units."""
    length = table.task[0]["length"]
    for k in range(table.driven.shape[0]):
        driven = table.driven[k]
        unit, column = driven["unit"], driven["column"]
        for j in range(found.shape[1 - is_forward]):
            own = length if j < 3 else 1.0
            if is_forward == 1:
                found[j, column] *= own / unit
            else:
                found[column, j] *= unit / own
