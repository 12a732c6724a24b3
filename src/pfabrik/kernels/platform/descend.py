"""The nearest feasible configuration of legs in closed form: a descent on the platform's pose and its rods' carriers.

As on joint coordinates (`closure.descend`), in a quarter of the unknowns: its motions are those that the legs'
equations leave free, found anew at each configuration, and each step is brought back onto them before it is judged.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._jit import allocator, routine
from ..closure.loops import BASE_AXES, LOCKED, Ints, PoseObjective
from ..closure.pose_objective import PoseGradient, pose_gradient
from ..free_motions import (
    Elimination,
    FreeMotions,
    add_limit,
    eliminate,
    new_elimination,
    new_free_motions,
    project_gradient,
    put_multipliers,
)
from ..legs.answer import deviation, set_frames, turn_pose
from ..legs.records import SHARED, Floats
from ..qp import QP, new_qp
from ..sqp import (
    CLOSED,
    DONE,
    EXCESS,
    GAP,
    HOLDING,
    LARGEST,
    LIMITS,
    LONGEST_STEP,
    MOTIONS,
    NEARLY_CLOSED,
    PROBE,
    PROMISE,
    RESTORING,
    ROWS,
    VALUE,
    Hessian,
    StepControl,
    begin_descent,
    go_on,
    is_closed,
    judge_step,
    longest,
    new_hessian,
    new_step_control,
    on_the_way,
    plan_step,
    restoring_step,
    rests_open,
    scale_objective,
)
from ..vectors import copy_row, copy_table, dot, vec, wrap
from .equations import (
    Now,
    View,
    cone_slope,
    coordinate_slope,
    count_unknowns,
    counts_turns,
    dead_point_slope,
    is_carried,
    new_now,
    new_view,
    own_row,
    place,
    place_leg,
    put_leg_slopes,
    put_slopes,
)
from .records import Aim, Table

HOPELESS = 20.0
"""A search that is farther than the nearest yet by so many times what its last step promised is given up."""

BY = 0.03
"""A search that comes so near to the nearest configuration met yet [rad or L] would end there."""

NEAR = 0.3
"""Limits farther away than this are left out of a programme [rad or L]: no step comes near them."""


class Search(NamedTuple):
    """Scratch memory of one thread."""

    look: View
    gradient: PoseGradient
    hessian: Hessian
    control: StepControl
    p: QP
    elimination: Elimination
    first: FreeMotions
    second: FreeMotions
    force: Floats  # (n,): gradient of the objective
    here: Floats  # (n,)
    there: Floats  # (n,)
    step: Floats  # (n,)
    balance: Floats  # (rows,): multipliers of the equations and of what is held
    best: Now
    trial: Now
    target: Floats  # (4, 4): of the row [L]
    kept: Floats  # (legs,): the sides that carriers are to stay on; 0 for either
    pulled: Ints  # (legs,): 1 for those that the Lagrangian asks for
    near_cosines: Floats  # (cones,): of angles from their axes at which cones are near


@allocator
def new_search(table: Table) -> Search:
    """Scratch memory of one thread."""
    n, legs = count_unknowns(table), table.legs.shape[0]
    rows, limits = table.task[0]["rows"] + n, 2 * table.limited.shape[0] + table.cones.shape[0] + legs
    elimination = new_elimination(n, rows)
    for j in range(n):
        elimination.used[j] = 2 if j < 6 else 1
    near_cosines = np.zeros(table.cones.shape[0])
    for i in range(near_cosines.shape[0]):
        near_cosines[i] = math.cos(max(table.cones[i]["half_angle"] - NEAR, 0.0))
    return Search(
        new_view(table),
        PoseGradient(np.zeros(6), np.zeros((6, 6)), np.zeros(6), np.ones(1), np.zeros(6)),
        new_hessian(n, limits),
        new_step_control(),
        new_qp(n, limits),
        elimination,
        new_free_motions(n, rows, limits),
        new_free_motions(n, rows, limits),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(rows),
        new_now(legs),
        new_now(legs),
        np.zeros((4, 4)),
        np.zeros(legs),
        np.zeros(legs, np.int64),
        near_cosines,
    )


@routine
def copy_now(source: Now, to: Now) -> None:
    copy_table(source.pose, to.pose)
    copy_row(source.q, to.q)
    copy_row(source.sides, to.sides)


@routine
def put_objective(table: Table, row: int, aim: Aim, now: Now, search: Search) -> tuple[float, int]:
    """The objective, its gradient into `search.force`; how many components of the twist are held by equations.

    None are where what is held is in its place and does not move: see `fix`.
    """
    force, slope = search.force, search.look.slope
    for j in range(6, force.shape[0]):
        force[j] = 0.0
    used = search.elimination.used
    turns = used[3] + used[4] + used[5] > 0
    value, held = pose_gradient(aim.pose, search.target, now.pose, search.gradient, turns)
    held = held if used[3] > 0 and used[0] > 0 else 0
    for j in range(6):
        force[j] = search.gradient.force[j]
    for i in range(table.driven.shape[0] if aim.values.shape[0] > 0 else 0):
        driven = table.driven[i]
        off = coordinate_slope(table, driven, search.look) - aim.values[row, driven["column"]]
        off = wrap(off, 0.0) if counts_turns(driven) else off
        value += 0.5 * search.gradient.unit[0] * off * off
        for j in range(force.shape[0]):
            force[j] += search.gradient.unit[0] * off * slope[j]
    return value, held


@routine
def fix(aim: PoseObjective, in_place: bool, search: Search) -> None:
    """Leave out the components of the twist that are held, if the platform is in place and they are its velocities."""
    used = search.elimination.used
    for j in range(6):
        used[j] = 0 if in_place and aim.frame == BASE_AXES and aim.platform[j] == LOCKED else 2


@routine
def linearise(table: Table, row: int, aim: Aim, now: Now, search: Search, view: FreeMotions) -> None:
    """Look at a configuration."""
    scalars, errors = view.linear.scalars, search.gradient.errors
    gap = place(table, now, search.look)
    put_slopes(table, search.look)
    scalars[VALUE], held = put_objective(table, row, aim, now, search)
    for k in range(held):
        gap = max(gap, abs(errors[k]))
    scalars[GAP] = gap
    eliminate(lay_out(held, search), search.elimination, view)
    project_gradient(search.force, view)
    linearise_limits(table, aim.pose.margin, search, view)


@routine
def lay_out(held: int, search: Search) -> int:
    """The equations of the legs and of what is held, with an identity beside them; how many."""
    A, rows, slopes = search.elimination.A, search.look.rows, search.look.slopes
    errors, holds = search.gradient.errors, search.gradient.holds
    m, n = slopes.shape
    for r in range(m + held):
        for j in range(A.shape[1]):
            A[r, j] = 0.0
        A[r, n + 1 + r] = 1.0
    for r in range(m):
        A[r, n] = -rows[r]
        for j in range(n):
            A[r, j] = slopes[r, j]
    for k in range(held):
        A[m + k, n] = -errors[k]
        for j in range(6):
            A[m + k, j] = holds[k, j]
    return int(m + held)


@routine
def linearise_limits(table: Table, margin: float, search: Search, view: FreeMotions) -> None:
    """Excess and gradient of every limit within reach, and of dead points that are not to be passed."""
    slope, values, kept, k, excess = search.look.slope, search.look.values, search.kept, 0, -math.inf
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        value = deviation(limited, values)
        below, above = limited["lo"] + margin - value, value - limited["hi"] + margin
        if max(below, above) <= -NEAR:
            continue
        excess = max(excess, max(below, above))
        coordinate_slope(table, limited, search.look)
        if above > -NEAR:
            k = add_limit(k, above, 2 * i + 1, search.look.slope, view)
        if below > -NEAR:
            for j in range(slope.shape[0]):
                slope[j] = -slope[j]
            k = add_limit(k, below, 2 * i, search.look.slope, view)
    for i in range(table.cones.shape[0]):
        cone = table.cones[i]
        line = vec(values[cone["leg"], cone["place"] :])
        if dot(vec(cone["axis"]), line) <= search.near_cosines[i]:
            over = cone_slope(table, cone, search.look) - cone["half_angle"] + margin
            excess = max(excess, over)
            k = add_limit(k, over, 2 * table.limited.shape[0] + i, search.look.slope, view)
    first = 2 * table.limited.shape[0] + table.cones.shape[0]
    for leg in range(kept.shape[0]):
        if kept[leg] != 0.0:
            over = kept[leg] * dead_point_slope(table, leg, search.look)
            if over > -NEAR:
                excess = max(excess, over)
                for j in range(slope.shape[0]):
                    slope[j] *= kept[leg]
                k = add_limit(k, over, first + leg, search.look.slope, view)
    view.linear.counts[LIMITS] = k
    view.linear.scalars[EXCESS] = excess


@routine
def put_force(table: Table, search: Search, out: Floats) -> None:
    """Gradient of the objective and of the limits, by their multipliers, where `search.look` is."""
    force, multipliers, slope, kept = search.force, search.hessian.multipliers, search.look.slope, search.kept
    for j in range(out.shape[0]):
        out[j] = force[j]
    ranges = table.limited.shape[0]
    for i in range(ranges):
        pull = multipliers[2 * i + 1] - multipliers[2 * i]
        if pull != 0.0:
            coordinate_slope(table, table.limited[i], search.look)
            for j in range(out.shape[0]):
                out[j] += pull * slope[j]
    for i in range(table.cones.shape[0]):
        pull = multipliers[2 * ranges + i]
        if pull != 0.0:
            cone_slope(table, table.cones[i], search.look)
            for j in range(out.shape[0]):
                out[j] += pull * slope[j]
    first = 2 * ranges + table.cones.shape[0]
    for k in range(kept.shape[0]):
        pull = multipliers[first + k] * kept[k]
        if pull != 0.0:
            dead_point_slope(table, k, search.look)
            for j in range(out.shape[0]):
                out[j] += pull * slope[j]


@routine
def add_balance(held: int, search: Search, out: Floats) -> None:
    """Add the gradient of the equations, by their multipliers."""
    balance, slopes, holds = search.balance, search.look.slopes, search.gradient.holds
    m = slopes.shape[0]
    for r in range(m):
        if balance[r] != 0.0:
            for j in range(out.shape[0]):
                out[j] += balance[r] * slopes[r, j]
    for k in range(held):
        for j in range(6):
            out[j] += balance[m + k] * holds[k, j]


@routine
def note_pulled(table: Table, aim: Aim, search: Search) -> None:
    """Note the legs that the Lagrangian asks for: those of limits and equations with multipliers, and what carries
    them."""
    legs, multipliers, balance, pulled = table.legs, search.hessian.multipliers, search.balance, search.pulled
    ranges, n = table.limited.shape[0], legs.shape[0]
    first = 2 * ranges + table.cones.shape[0]
    for k in range(n):
        end = legs[k + 1]["first_row"] if k + 1 < n else table.task[0]["rows"]
        most = multipliers[first + k]
        for r in range(legs[k]["first_row"], end):
            most = max(most, abs(balance[r]))
        if is_carried(legs[k]):
            most = max(most, abs(balance[own_row(table, k)]))
        pulled[k] = 1 if most > 0.0 else 0
    for i in range(ranges):
        if multipliers[2 * i] != multipliers[2 * i + 1]:
            pulled[table.limited[i]["leg"]] = 1
    for i in range(table.cones.shape[0]):
        if multipliers[2 * ranges + i] > 0.0:
            pulled[table.cones[i]["leg"]] = 1
    for i in range(table.driven.shape[0] if aim.values.shape[0] > 0 else 0):
        pulled[table.driven[i]["leg"]] = 1
    for k in range(n - 1, 0, -1):
        if pulled[k] == 1 and (legs[k]["carrier"] == SHARED or legs[k]["on_arm"] == 1):
            pulled[k - 1] = 1


@routine
def lagrangian_gradient(table: Table, row: int, aim: Aim, now: Now, search: Search, out: Floats) -> None:
    """Gradient of the Lagrangian at a configuration, from the legs that are `pulled`."""
    pulled, main = search.pulled, 0
    set_frames(now.pose, table.task[0], search.look.frames)
    for k in range(pulled.shape[0]):
        main = main if table.legs[k]["carrier"] == SHARED else k
        if pulled[k] == 1:
            place_leg(table, k, main, now, search.look)
            put_leg_slopes(table, k, main, search.look)
    _, held = put_objective(table, row, aim, now, search)
    put_force(table, search, out)
    add_balance(held, search, out)


@routine
def lagrangian_hessian(table: Table, row: int, aim: Aim, search: Search, view: FreeMotions) -> float:
    """Curvature of the objective and of the active limits along free motions, into `hessian`; the largest on its
    diagonal.

    By differences of the gradient of the Lagrangian, whose multipliers of the equations balance it at pivot unknowns,
    from `best`, where `search.look` still is.
    """
    linear, H, basis, step = view.linear, search.hessian.H, view.basis, search.step
    motions, here, there = linear.counts[MOTIONS], search.here, search.there
    put_force(table, search, search.here)
    search.control.scalars[HOLDING] = put_multipliers(search.here, view, search.balance)
    add_balance(linear.counts[ROWS] - search.look.slopes.shape[0], search, search.here)
    note_pulled(table, aim, search)
    largest = 0.0
    for a in range(motions):
        probe = PROBE / math.sqrt(linear.metric[a, a])
        for j in range(step.shape[0]):
            step[j] = basis[j, a]
        copy_now(search.best, search.trial)
        move(table, search.step, probe, search.trial)
        lagrangian_gradient(table, row, aim, search.trial, search, search.there)
        for b in range(motions):
            H[b, a] = 0.0
            for j in range(step.shape[0]):
                H[b, a] += basis[j, b] * (there[j] - here[j]) / probe
    for a in range(motions):
        largest = max(largest, abs(H[a, a]))
        for b in range(a):
            H[a, b] = H[b, a] = 0.5 * (H[a, b] + H[b, a])
    return largest


@routine
def move(table: Table, step: Floats, share: float, now: Now) -> None:
    """Take a share of a step."""
    pose, q, columns = now.pose, now.q, table.columns
    for i in range(3):
        pose[i, 3] += share * step[i]
    turn_pose(now.pose, (share * step[3], share * step[4], share * step[5]))
    for k in range(q.shape[0]):
        if columns[k] >= 0:
            q[k] += share * step[columns[k]]


@routine
def take(table: Table, view: FreeMotions, x: Floats, now: Now, search: Search, closing: bool) -> float:
    """Take a step of the free motions, and with it one that meets the equations; the share of it not too long."""
    basis, shift, step = view.basis, view.shift, search.step
    n = step.shape[0]
    for j in range(n):
        step[j] = shift[j] if closing else 0.0
        for a in range(view.linear.counts[MOTIONS]):
            step[j] += basis[j, a] * x[a]
    share = LONGEST_STEP / max(longest(search.step, n), LONGEST_STEP)
    move(table, search.step, share, now)
    return share


@routine
def restore_feasibility(
    table: Table, row: int, aim: Aim, now: Now, tolerance: float, search: Search, view: FreeMotions
) -> bool:
    """Bring a configuration onto its equations and within its limits, by the shortest way; `view` is where it ends.

    Both to a tolerance; where rounding keeps it from that, to what counts as closed.
    """
    for _step in range(RESTORING):
        linearise(table, row, aim, now, search, view)
        if is_closed(view.linear, tolerance):
            return True
        if not restoring_step(view.linear, search.p):
            return False
        take(table, view, search.p.x, now, search, True)
    linearise(table, row, aim, now, search, view)
    return is_closed(view.linear, max(tolerance, NEARLY_CLOSED))


@routine
def is_by(now: Now, met: Now) -> bool:
    """Whether a configuration is so near to another that a descent would end there."""
    pose, other, q = now.pose, met.pose, now.q
    for i in range(3):
        for j in range(4):
            if abs(pose[i, j] - other[i, j]) > BY:
                return False
    for k in range(q.shape[0]):
        if abs(wrap(q[k] - met.q[k], 0.0)) > BY:
            return False
    return True


@routine
def descend(table: Table, row: int, aim: Aim, least: float, met: Now, search: Search) -> float:
    """From `best`, brought onto its equations, down to the nearest; the distance there, infinite if not feasible.

    And infinite where what steps promise says that it will not come as near as `least`; where it comes by the
    configuration that is so near, that is where it ends.
    """
    view, other, hessian, control = search.first, search.second, search.hessian, search.control
    unit = search.gradient.unit
    unit[0] = 1.0
    if not restore_feasibility(table, row, aim, search.best, CLOSED, search, view):
        return math.inf
    unit[0] = scale_objective(view.linear)
    for j in range(search.force.shape[0]):
        search.force[j] *= unit[0]
    begin_descent(view.linear, hessian, control)
    while control.counts[DONE] == 0:
        control.scalars[LARGEST] = lagrangian_hessian(table, row, aim, search, view)
        led_down = False
        while not led_down and control.counts[DONE] == 0:
            if plan_step(view.linear, hessian, control, aim.pose.max_iterations, search.p):
                copy_now(search.best, search.trial)
                share = take(table, view, search.p.x, search.trial, search, False)
                tolerance = on_the_way(control, share)
                feasible = restore_feasibility(table, row, aim, search.trial, tolerance, search, other)
                led_down = judge_step(view.linear, other.linear, feasible, share, hessian, control)
                if led_down:
                    copy_now(search.trial, search.best)
                    view, other = other, view
                    if least < math.inf and is_by(search.best, met):
                        return least
                    if HOPELESS * control.scalars[PROMISE] < view.linear.scalars[VALUE] - 0.5 * unit[0] * least * least:
                        return math.inf
            if rests_open(view.linear, led_down, control):
                if not restore_feasibility(table, row, aim, search.best, CLOSED, search, view):
                    return math.inf
                go_on(view.linear, control)
                led_down = True
    return math.sqrt(2.0 * view.linear.scalars[VALUE] / unit[0])
