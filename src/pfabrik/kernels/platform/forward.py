"""Forward kinematics of legs in closed form: the pose at which actuators have given values.

A driven carrier is put where its value says, and is no unknown: the length of its rod is then an equation, without a
branch or a dead point. Every other driven coordinate is an equation beside those of the legs, and what carries a rod
undriven is an unknown beside the pose. Newton's method solves them by least squares.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Ints, Record
from .._jit import kernel, routine
from ..legs.answer import KEPT, deviation, excess_of, largest_entry
from ..legs.poses import middle_of, orthonormalise
from ..legs.records import PIVOT, Q_PROXIMAL, Table
from ..legs.table import SAMPLE, open_table
from ..linear import solve_spd, solve_square
from ..references import opener
from ..rows import EXCEEDED, LIMIT_EXCESS, PENDING, REACHED, RESIDUAL
from ..sqp import longest
from ..vectors import add, copy_row, copy_table, cross, put, sub, vec, wrap
from .equations import (
    LegEvaluation,
    PlatformState,
    count_unknowns,
    new_leg_evaluation,
    new_platform_state,
    place,
    put_slopes,
)
from .limits import coordinate_slope, counts_turns
from .records import Starts
from .search import copy_platform_state, move
from .spheres import Spheres, new_spheres, put_spheres, set_spheres
from .starts import place_proximal, put_sides

ASSEMBLED, NEARLY_ASSEMBLED = 1e-13, 1e-11
"""Largest equation of an assembled configuration, and of one that no step makes more so [L or rad]: more actuators than
freedoms, or conditions that repeat each other, agree no better than the description is exact."""

STEPS, IMPLICIT_STEPS = 24, 8
"""Most steps of Newton's method, and those at each stride where actuators are led to their values."""

STRIDES = 8
"""In how many strides they are led where one does not assemble."""

SIGHT = 1e3
"""How far off values are looked for: no search could tell those that are farther from others there [L or rad]."""

FAR_STEP = 0.5
"""Longest step of Newton's method [L or rad]."""


class Newton(NamedTuple):
    """Scratch memory of one thread."""

    leg_eval: LegEvaluation
    free: Ints  # (m,): the unknowns that are free
    equations: Floats  # (e, m + 1): by these, right-hand side last
    normal: Floats  # (m, m + 1): normal equations
    step: Floats  # (n,)
    values: Floats  # (n_a,): deviations from home that the actuators are led to
    begin: Floats  # (n_a,)
    state: PlatformState
    first: PlatformState
    spheres: Spheres  # none where equations are others too


def new_newton(table: Table, turns: bool) -> Newton:
    """Scratch memory of one thread.

    Parameters
    ----------
    turns : whether the platform turns; a point that is an end effector does not.
    """
    n, legs, n_driven = count_unknowns(table), table.legs.shape[0], table.driven.shape[0]
    leg_eval, kept = new_leg_evaluation(table), np.zeros(n, np.int64)
    equations = leg_eval.rows.shape[0]
    for j in range(3, 6):
        kept[j] = 0 if turns else 1
    for i in range(n_driven):
        if drives_proximal(table, i):
            kept[table.columns[table.driven[i]["leg"]]] = 1
        else:
            equations += 1
    free = np.flatnonzero(kept == 0)
    m = free.shape[0]
    return Newton(
        leg_eval,
        free,
        np.zeros((equations, m + 1)),
        np.zeros((m, m + 1)),
        np.zeros(n),
        np.zeros(n_driven),
        np.zeros(n_driven),
        new_platform_state(legs),
        new_platform_state(legs),
        new_spheres(table),
    )


@routine
def drives_proximal(table: Table, i: int) -> bool:
    """Whether an actuator is what carries a rod."""
    driven = table.driven[i]
    return bool(driven["place"] == Q_PROXIMAL and table.legs[driven["leg"]]["kind"] != PIVOT)


@routine
def put_drivers(table: Table, scratch: Newton) -> None:
    """Put driven carriers where their values say."""
    q = scratch.state.q
    for i in range(table.driven.shape[0]):
        if drives_proximal(table, i):
            q[table.driven[i]["leg"]] = table.driven[i]["sense"] * scratch.values[table.driven[i]["column"]]


@routine
def put_slope(e: int, slope: Floats, scratch: Newton) -> None:
    free, own = scratch.free, scratch.equations[e]
    for a in range(free.shape[0]):
        own[a] = slope[free[a]]


@routine
def off_by(driven: Record, value: float, scratch: Newton) -> float:
    """By how much a coordinate that is no carrier's deviates from what it is to be."""
    off = value - scratch.values[driven["column"]]
    return wrap(off, 0.0) if counts_turns(driven) else off


@routine
def has_spheres(scratch: Newton) -> bool:
    return scratch.spheres.legs.shape[0] > 0


@routine
def put_residuals(table: Table, scratch: Newton) -> float:
    """Read the legs at the present configuration, and fill the right-hand sides; the largest residual.

    Spheres are all that there is to read, and fill the left-hand sides too.
    """
    if has_spheres(scratch):
        return put_spheres(scratch.state.pose, scratch.spheres, scratch.equations)
    worst, rows, equations = place(table, scratch.state, scratch.leg_eval), scratch.leg_eval.rows, scratch.equations
    m, e = scratch.free.shape[0], rows.shape[0]
    for r in range(e):
        equations[r, m] = -rows[r]
    for i in range(table.driven.shape[0]):
        if not drives_proximal(table, i):
            driven = table.driven[i]
            off = off_by(driven, deviation(driven, scratch.leg_eval.values), scratch)
            worst, equations[e, m] = max(worst, abs(off)), -off
            e += 1
    return worst


@routine
def put_equations(table: Table, scratch: Newton) -> None:
    """Fill the left-hand sides where the legs have been read."""
    slopes, leg_eval = scratch.leg_eval.slopes, scratch.leg_eval
    put_slopes(table, leg_eval)
    e = slopes.shape[0]
    for r in range(e):
        put_slope(r, slopes[r], scratch)
    for i in range(table.driven.shape[0]):
        if not drives_proximal(table, i):
            coordinate_slope(table, table.driven[i], leg_eval)
            put_slope(e, leg_eval.slope, scratch)
            e += 1


@routine
def solve(scratch: Newton) -> bool:
    """Solve the equations, by least squares if they are not as many as the unknowns, into the last column of `normal`;
    whether they have a solution."""
    equations, normal = scratch.equations, scratch.normal
    m = normal.shape[0]
    if equations.shape[0] == m:
        copy_table(equations, normal)
        return solve_square(normal, m)
    for a in range(m):
        for b in range(m + 1):
            normal[a, b] = 0.0
            for e in range(equations.shape[0]):
                normal[a, b] += equations[e, a] * equations[e, b]
    return solve_spd(normal, m, 0.0)


@routine
def newton(table: Table, steps: int, scratch: Newton) -> float:
    """Solve for the actuators' values from the present configuration; the largest residual left."""
    free, normal, step = scratch.free, scratch.normal, scratch.step
    m, before = free.shape[0], math.inf
    put_drivers(table, scratch)
    if has_spheres(scratch):
        set_spheres(table, scratch.values, scratch.state, scratch.leg_eval, scratch.spheres)
    for taken in range(steps):
        worst = put_residuals(table, scratch)
        if not worst < math.inf or worst <= ASSEMBLED or (worst <= NEARLY_ASSEMBLED and worst > 0.5 * before):
            return worst
        is_near = taken > 0 and worst * worst <= ASSEMBLED * before  # the same slopes, once more, leave less
        if not is_near and not has_spheres(scratch):
            put_equations(table, scratch)
        if not solve(scratch):
            return math.inf
        before = worst
        for a in range(m):
            step[free[a]] = normal[a, m]
        take_step(table, scratch)
    return put_residuals(table, scratch)


@routine
def take_step(table: Table, scratch: Newton) -> None:
    """Take a step, no longer than it tells anything: of how the platform's middle moves, and how it turns about that.

    The reference point may be far away.
    """
    pose, step, middle = scratch.state.pose, scratch.step, middle_of(scratch.state.pose, table.task[0])
    put(step, add(vec(step), cross(vec(step[3:]), middle)))
    move(table, step, min(1.0, FAR_STEP / max(longest(step, step.shape[0]), FAR_STEP)), scratch.state)
    off = sub(middle, middle_of(pose, table.task[0]))
    for i in range(3):
        pose[i, 3] += off[i]


@routine
def lead(table: Table, values: Floats, scratch: Newton) -> float:
    """The same, with the actuators led to their values from those of the present configuration."""
    begin, state = scratch.begin, scratch.values
    place(table, scratch.state, scratch.leg_eval)
    for i in range(table.driven.shape[0]):
        column = table.driven[i]["column"]
        begin[column] = deviation(table.driven[i], scratch.leg_eval.values)
        if table.driven[i]["turns"] == 1:
            begin[column] = wrap(begin[column], values[column])
    worst = math.inf
    for stride in range(1, STRIDES + 1):
        for column in range(state.shape[0]):
            state[column] = begin[column] + (values[column] - begin[column]) * stride / STRIDES
        worst = newton(table, STEPS if stride == STRIDES else IMPLICIT_STEPS, scratch)
    return worst


@routine
def is_feasible(table: Table, values: Floats, scratch: Newton) -> bool:
    """Whether the present configuration, assembled, keeps all limits, and its actuators those of theirs."""
    if has_spheres(scratch):
        place(table, scratch.state, scratch.leg_eval)
    for i in range(table.driven.shape[0]):
        value = values[table.driven[i]["column"]]
        if not max(table.driven[i]["lo"] - value, value - table.driven[i]["hi"]) <= KEPT:
            return False
    return bool(excess_of(table.limited, table.cones, scratch.leg_eval.values) <= KEPT)


@routine
def load_start(table: Table, starts: Starts, start: int, scratch: Newton) -> None:
    state = scratch.state
    copy_table(starts.poses[start], state.pose)
    copy_row(starts.sides[start], state.sides)
    if starts.q.shape[0] > 0:
        copy_row(starts.q[start], state.q)
    else:
        place_proximal(table, scratch.state, scratch.leg_eval)


@routine
def apart(one: Floats, other: Floats) -> float:
    """Square of how far two poses are apart."""
    square = 0.0
    for i in range(3):
        for j in range(4):
            square += (one[i, j] - other[i, j]) ** 2
    return square


@routine
def put_deviations(table: Table, values: Floats, wanted: Floats) -> None:
    """Fill the deviations from home [L or rad] that actuators have at given values (n_a,) [length or rad].

    Those of angles without bounds within a turn, and no farther off than anything is looked for.
    """
    for i in range(table.driven.shape[0]):
        driven = table.driven[i]
        off = (values[driven["column"]] - driven["home"]) / driven["unit"]
        if driven["turns"] == 1 and driven["hi"] - driven["lo"] == math.inf:
            off -= 2.0 * math.pi * math.floor(off / (2.0 * math.pi))
        wanted[driven["column"]] = min(max(off, -SIGHT), SIGHT)


@routine
def assemble_row(
    table: Table, given: Floats, own: Starts, row: int, others: Starts, wanted: Floats, scratch: Newton
) -> int:
    """Assemble one row within all limits, into `scratch.state`, with the legs evaluated there; its status."""
    first, values, status = row if own.poses.shape[0] > 1 else 0, wanted[row], PENDING
    put_deviations(table, given[row], values)
    for attempt in range(2):
        load_start(table, own, first, scratch)
        copy_row(values, scratch.values)
        worst = newton(table, STEPS, scratch) if attempt == 0 else lead(table, values, scratch)
        if worst <= NEARLY_ASSEMBLED:
            if is_feasible(table, values, scratch):
                return REACHED
            status = EXCEEDED
            break
    nearest = math.inf
    for start in range(others.poses.shape[0]):
        load_start(table, others, start, scratch)
        copy_row(values, scratch.values)
        if newton(table, STEPS, scratch) <= NEARLY_ASSEMBLED and is_feasible(table, values, scratch):
            distance = apart(scratch.state.pose, own.poses[first])
            if distance < nearest:
                nearest = distance
                copy_platform_state(scratch.state, scratch.first)
    if nearest < math.inf:
        copy_platform_state(scratch.first, scratch.state)
        place(table, scratch.state, scratch.leg_eval)
        return REACHED
    return status


@routine
def write_assembled(table: Table, row: int, scratch: Newton, ends: Starts, measures: Floats) -> None:
    """Write a configuration that is assembled, its pose in [length], and what is measured of it."""
    length, pose = table.task[0]["length"], ends.poses[row]
    orthonormalise(scratch.state.pose)
    measures[row, RESIDUAL] = largest_entry(scratch.leg_eval.rows) * length
    measures[row, LIMIT_EXCESS] = max(excess_of(table.limited, table.cones, scratch.leg_eval.values), 0.0)
    copy_table(scratch.state.pose, pose)
    for i in range(3):
        pose[i, 3] *= length
    put_sides(table, scratch.state, scratch.leg_eval)
    copy_row(scratch.state.q, ends.q[row])
    copy_row(scratch.state.sides, ends.sides[row])


open_starts = opener(Starts(np.zeros((0, 4, 4)), np.zeros((0, 0)), np.zeros((0, 0))))
open_newton = opener(new_newton(SAMPLE, True))
"""Starts and scratch memory, of which a kernel is given the addresses of handles."""


@kernel
def assemble(
    machine: int,
    scratch_address: int,
    values: Floats,
    own: int,
    others: int,
    status: Ints,
    wanted: Floats,
    poses: Floats,
    q: Floats,
    sides: Floats,
    measures: Floats,
) -> int:
    """Assemble legs at given actuators, within all limits; rows for which none is found are PENDING.

    Or EXCEEDED, where they assemble from the row's start, beyond a limit.

    Newton's method from each row's start; where it strays, the actuators are led to their values in strides.

    Parameters
    ----------
    machine : see `open_table`.
    scratch : the address of `Newton`.
    values : (n, n_a) [length or rad].
    own : where each row starts, or all of them; as `others` the address of `Starts`.
    others : starts that follow; of the configurations that they find, the one nearest to the row's start is taken.
    wanted : of the values, see `put_deviations`.
    poses : of the configurations, (n, 4, 4) [length].
    q, sides : as of `Starts`.

    Returns
    -------
    How many are not REACHED.
    """
    table, first, rest, left = open_table(machine), open_starts(own), open_starts(others), 0
    scratch = open_newton(scratch_address)
    for row in range(values.shape[0]):
        status[row] = assemble_row(table, values, first, row, rest, wanted, scratch)
        if status[row] == REACHED:
            write_assembled(table, row, scratch, Starts(poses, q, sides), measures)
        else:
            left += 1
    return left
