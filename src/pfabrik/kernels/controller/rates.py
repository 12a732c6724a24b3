"""Rates of actuators by the twist of the end effector, of the twists that legs allow."""

from __future__ import annotations

from typing import NamedTuple

from ...common.arrays import Floats, Ints
from .._jit import routine
from ..joints.first_order import subtract_projections
from ..legs.answer import put_slopes
from ..legs.frames import redundant_slope
from ..legs.leg_constants import LEAST_MARGIN
from ..legs.records import Table
from ..legs.rods import put_proximal_slope
from ..pose.equations import LegEvaluation, direction, has_proximal
from ..pose.limits import coordinate_slope
from ..vectors import copy_row
from .reached import LEG, Reaching, rest

RANK = 1e-9
"""Slope below which an equation does not determine a joint, or follows from others [L or rad]."""


class Rating(NamedTuple):
    """A machine whose actuator rates follow from twists, and the memory of a call."""

    table: Table
    leg_eval: LegEvaluation  # its frames, values and lines are those of the scratch memory of `Reaching`
    rows: Floats  # (rows, 6 + n_redundant): slopes of constraints
    used: Ints  # (rows,): 1 for those that determine a redundant joint
    drives: Floats  # (n_a, 6 + n_redundant): slopes of actuators
    basis: Floats  # (6, 6): orthonormal twists that legs bar


@routine
def put_rates(own: Rating, reaching: Reaching, pose: Floats, is_raw: int, turns: int) -> int:
    """Fill `drives` with the rates of actuators by the twist at a whole pose (4, 4) [length, rad]; a code.

    Parameters
    ----------
    is_raw : 1 for rates by any twist, 0 by the nearest that legs allow.
    turns : 0 if the end effector is a point, which does not turn.
    """
    code = rest(reaching, pose)
    if code < 0 or (code >= LEG and code < 2 * LEG):
        return code
    put_actuator_rates(own, reaching.scratch.proximal_slopes)
    count, length = 0, own.table.task[0]["length"]
    for i in range(3 if is_raw == 0 and turns == 0 else 0):
        for j in range(6):
            own.basis[count, j] = 1.0 if j == 3 + i else 0.0
        count += 1
    for i in range(own.rows.shape[0] if is_raw == 0 else 0):
        if own.used[i] == 0 and count < 6 and bars(own, count, own.rows[i]):
            count += 1
    for i in range(own.drives.shape[0]):
        for k in range(count):
            share = 0.0
            for j in range(6):
                share += own.basis[k, j] * own.drives[i, j]
            for j in range(6):
                own.drives[i, j] -= share * own.basis[k, j]
    for i in range(own.table.driven.shape[0]):
        driven = own.table.driven[i]
        for j in range(6):
            own.drives[driven["column"], j] *= driven["unit"] / (length if j < 3 else 1.0)
    return 0


@routine
def put_actuator_rates(own: Rating, proximal_slopes: Floats) -> None:
    """Fill `rows` and `drives` where legs are placed; redundant joints follow from the rows that determine them most.

    A proximal joint at its dead point has rate 0.
    """
    table, leg_eval, legs, width = own.table, own.leg_eval, own.table.legs, own.drives.shape[1]
    for k in range(legs.shape[0]):
        for j in range(6):
            proximal_slopes[k, j] = 0.0
    put_slopes(legs, leg_eval.frames, leg_eval.values, leg_eval.lines, proximal_slopes, own.rows)
    for k in range(legs.shape[0]):
        if has_proximal(legs[k]):
            u = direction(leg_eval.lines[k])
            put_proximal_slope(legs[k], leg_eval.frames[legs[k]["frame"]], leg_eval.values[k], u, proximal_slopes[k])
            for j in range(6):
                if not abs(proximal_slopes[k, j]) < 1.0 / (LEAST_MARGIN * LEAST_MARGIN):
                    proximal_slopes[k, j] = 0.0
    for i in range(table.driven.shape[0]):
        drive, slope = own.drives[table.driven[i]["column"]], leg_eval.slope
        coordinate_slope(table, table.driven[i], leg_eval)
        copy_row(slope[:6], drive[:6])
        for j in range(6, width):
            drive[j] = 0.0
        for k in range(legs.shape[0]):
            column = table.columns[k]
            if column < 0 or slope[column] == 0.0:
                continue
            if legs[k]["makes"] > 0:
                drive[6 + legs[k]["column"]] += slope[column] if legs[k]["mirror_of"] < 0 else 0.0
                continue
            for j in range(6):
                drive[j] += slope[column] * proximal_slopes[k, j]
            joint = legs[k]["redundant"]
            while joint >= 0:
                by_joint = redundant_slope(proximal_slopes[k], leg_eval.values[joint])
                drive[6 + legs[joint]["column"]] += slope[column] * by_joint
                joint = legs[joint]["redundant"]
    for i in range(own.rows.shape[0]):
        own.used[i] = 0
    for k in range(6, width):
        eliminate(own, k)


@routine
def eliminate(own: Rating, k: int) -> None:
    """Eliminate a column by the unused row that has most of it; if none has any, it stays."""
    best, most = -1, RANK
    for i in range(own.rows.shape[0]):
        if own.used[i] == 0 and abs(own.rows[i, k]) > most:
            best, most = i, abs(own.rows[i, k])
    if best < 0:
        return
    own.used[best] = 1
    pivot = own.rows[best]
    for i in range(own.rows.shape[0]):
        if i != best:
            take_off(own.rows[i], pivot, k)
    for i in range(own.drives.shape[0]):
        take_off(own.drives[i], pivot, k)


@routine
def take_off(row: Floats, pivot: Floats, k: int) -> None:
    """Subtract what makes entry k of a row zero."""
    share = row[k] / pivot[k]
    for j in range(row.shape[0] if share != 0.0 else 0):
        row[j] = row[j] - share * pivot[j] if j != k else 0.0


@routine
def bars(own: Rating, count: int, row: Floats) -> bool:
    """Add a row to an orthonormal basis of `count` rows; False where rounding is all that is left of it."""
    copy_row(row[:6], own.basis[count])
    size = subtract_projections(own.basis, count, 0, 6)
    for j in range(6 if size > RANK else 0):
        own.basis[count, j] /= size
    return size > RANK
