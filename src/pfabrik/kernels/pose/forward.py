"""Forward kinematics of legs in closed form: the pose at which actuators have given values.

An actuated proximal joint is put at its value and is no unknown: the length of its rod is then an equation, without
branches or dead points. Every other actuated coordinate adds an equation to those of the legs, and every passive
proximal joint an unknown to the pose. Newton's method solves them by least squares.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Record
from .._jit import kernel, opener, routine
from ..legs.answer import deviation, excess_of, largest_entry
from ..legs.complete_poses import middle_of, orthonormalise, turn_pose
from ..legs.endings import turned
from ..legs.leg_constants import KEPT
from ..legs.records import CRANK, FROM_BASE, Q_PROXIMAL, SAMPLE, Table, open_table
from ..linear import least_pivot, sign_of_square, solve_spd, solve_square
from ..rows import EXCEEDED, LIMIT_EXCESS, PENDING, REACHED, RESIDUAL
from ..search_constants import BELIEVED, CONTRACTION, FARTHEST_TURN, NEWTON_STEP, SHORTEST_SHARE, SINGULAR
from ..sqp import longest
from ..vectors import add, copy_row, copy_table, cross, put, scale, sub, turn, vec, wrap
from ..vectors import move as moved
from .equations import (
    LegEvaluation,
    PlatformState,
    count_unknowns,
    evaluate_legs,
    new_leg_evaluation,
    new_platform_state,
    put_slopes,
)
from .limits import coordinate_slope, is_multiturn
from .pose_constants import ASSEMBLED, BENT, FARTHEST_VALUE, FORWARD_STEPS, NEARLY_ASSEMBLED, ON_THE_WAY
from .search import copy_platform_state, move
from .search_records import Starts
from .spheres import Spheres, new_spheres, put_sphere_errors, put_spheres, set_spheres
from .starts import place_proximal, put_sides


class NewtonScratch(NamedTuple):
    """Scratch memory of one thread."""

    leg_eval: LegEvaluation
    free: Ints  # (m,): indices of the unknowns
    equations: Floats  # (e, m + 1): equations in these, right-hand side last
    normal: Floats  # (m, m + 1): normal equations
    first: Floats  # (e, m + 1): the equations where Newton's method began, the actuators as they were there
    step: Floats  # (n,)
    values: Floats  # (n_a,): deviations from home that the actuators are to have
    start_values: Floats  # (n_a,): deviations from home where a continuation starts
    state: PlatformState
    best: PlatformState
    behind: PlatformState  # the last configuration of a continuation
    spheres: Spheres  # none if there are other equations
    steps: Ints  # (2,): Newton steps taken, and the most to take; 0 if there is no bound


def new_newton_scratch(table: Table, turns: bool) -> NewtonScratch:
    """Allocate the scratch memory of one thread.

    Parameters
    ----------
    turns : True if the platform turns; False if the end effector is a point.
    """
    n, n_legs, n_driven = count_unknowns(table), table.legs.shape[0], table.driven.shape[0]
    leg_eval, is_fixed = new_leg_evaluation(table), np.zeros(n, np.int64)
    n_equations = leg_eval.rows.shape[0]
    for j in range(3, 6):
        is_fixed[j] = 0 if turns else 1
    for i in range(n_driven):
        if drives_proximal(table, i):
            is_fixed[table.columns[table.driven[i]["leg"]]] = 1
        else:
            n_equations += 1
    free = np.flatnonzero(is_fixed == 0)
    m = free.shape[0]
    return NewtonScratch(
        leg_eval,
        free,
        np.zeros((n_equations, m + 1)),
        np.zeros((m, m + 1)),
        np.zeros((n_equations, m + 1)),
        np.zeros(n),
        np.zeros(n_driven),
        np.zeros(n_driven),
        new_platform_state(n_legs),
        new_platform_state(n_legs),
        new_platform_state(n_legs),
        new_spheres(table),
        np.zeros(2, np.int64),
    )


@routine
def drives_proximal(table: Table, i: int) -> bool:
    """True if an actuator drives a proximal or redundant joint."""
    return bool(table.driven[i]["place"] == Q_PROXIMAL)


@routine
def opens_loops(table: Table, i: int) -> bool:
    """True if an actuator drives a proximal or redundant joint that does not carry all legs."""
    return drives_proximal(table, i) and not carries_all(table, table.driven[i]["leg"])


@routine
def place_carriers(table: Table, scratch: NewtonScratch) -> bool:
    """Put actuated joints that carry all legs at their values; True if other proximal joints are actuated.

    These take the platform along, or turn it on its carrier: the loops stay as they are.
    """
    q, has_others = scratch.state.q, False
    for i in range(table.driven.shape[0]):
        if opens_loops(table, i):
            has_others = True
        elif drives_proximal(table, i):
            k = table.driven[i]["leg"]
            value = table.driven[i]["sense"] * scratch.values[table.driven[i]["column"]]
            take_platform_along(table, k, value - q[k], scratch.state)
            q[k] = value
    return has_others


@routine
def place_drivers(table: Table, scratch: NewtonScratch) -> float:
    """Put the other actuated proximal and redundant joints at their values; the largest change [L or rad]."""
    q, largest = scratch.state.q, 0.0
    for i in range(table.driven.shape[0]):
        if opens_loops(table, i):
            k = table.driven[i]["leg"]
            value = table.driven[i]["sense"] * scratch.values[table.driven[i]["column"]]
            change = wrap(value - q[k], 0.0) if table.driven[i]["turns"] == 1 else value - q[k]
            largest = max(largest, abs(change))
            q[k] = value
    return largest


@routine
def put_first_equations(table: Table, scratch: NewtonScratch) -> bool:
    """Fill the left-hand sides at the current configuration, whose actuators are not yet at their values.

    False at a parallel singularity, where the actuators lead nowhere in particular.
    """
    if has_spheres(scratch):
        set_spheres(table, scratch.values, scratch.state, scratch.leg_eval, scratch.spheres)
        put_spheres(scratch.state.pose, scratch.spheres, scratch.equations)
    else:
        evaluate_legs(table, scratch.state, scratch.leg_eval)
        put_equations(table, scratch)
    copy_table(scratch.equations, scratch.first)
    put_products(scratch)
    return least_pivot(scratch.normal, scratch.normal.shape[0]) > SINGULAR


@routine
def put_products(scratch: NewtonScratch) -> None:
    """Fill `normal` with J0'J1, of the slopes where Newton's method began and now."""
    first, equations, normal = scratch.first, scratch.equations, scratch.normal
    m = normal.shape[0]
    for a in range(m):
        for b in range(m):
            normal[a, b] = 0.0
            for e in range(equations.shape[0]):
                normal[a, b] += first[e, a] * equations[e, b]


@routine
def has_crossed(scratch: NewtonScratch) -> bool:
    """True if det J0'J1 is not positive, with the slopes J0 at the start and J1 now: a singularity is between them."""
    put_products(scratch)
    return sign_of_square(scratch.normal, scratch.normal.shape[0]) <= 0


@routine
def carries_all(table: Table, k: int) -> bool:
    """True if a leg is a redundant joint between base and platform that all legs are on but those that it is on."""
    legs, root, n_carriers = table.legs, k, 0
    while legs[root]["redundant"] >= 0:
        root = legs[root]["redundant"]
        n_carriers += 1
    if legs[k]["makes"] == 0 or legs[root]["frame"] != FROM_BASE or n_carriers != k:
        return False
    for j in range(k, legs.shape[0]):  # joints come before the legs that are on them
        joint = j
        while joint > k:
            joint = legs[joint]["redundant"]
        if joint != k:
            return False
    return True


@routine
def take_platform_along(table: Table, k: int, change: float, state: PlatformState) -> None:
    """Move the platform as a joint that carries all legs moves it when its coordinate changes."""
    pose, joint = state.pose, table.legs[k]
    axis, point, other = vec(joint["proximal_axis"]), vec(joint["proximal_point"]), joint["redundant"]
    while other >= 0:  # it is where the joints between it and the base, or the platform, have it
        leg, q = table.legs[other], state.q[other]
        if leg["at_platform_end"] == joint["at_platform_end"]:
            if leg["proximal"] == CRANK:
                centre, cosine, sine = vec(leg["proximal_point"]), math.cos(q), math.sin(q)
                axis = turned(axis, vec(leg["proximal_axis"]), cosine, sine)
                point = add(centre, turned(sub(point, centre), vec(leg["proximal_axis"]), cosine, sine))
            else:
                point = add(point, scale(q, vec(leg["proximal_axis"])))
        other = leg["redundant"]
    if joint["at_platform_end"] == 1:
        axis, point, change = turn(pose, axis), moved(pose, point), -change
    if joint["proximal"] == CRANK:
        arm = sub((pose[0, 3], pose[1, 3], pose[2, 3]), point)
        shift = sub(turned(arm, axis, math.cos(change), math.sin(change)), arm)
        turn_pose(pose, scale(change, axis))
    else:
        shift = scale(change, axis)
    for i in range(3):
        pose[i, 3] += shift[i]


@routine
def put_free_slope(e: int, slope: Floats, scratch: NewtonScratch) -> None:
    """Fill the left-hand side of an equation with the derivatives by the free unknowns."""
    free, equation = scratch.free, scratch.equations[e]
    for a in range(free.shape[0]):
        equation[a] = slope[free[a]]


@routine
def driver_error(driven: Record, value: float, scratch: NewtonScratch) -> float:
    """Deviation of an actuated coordinate, other than a proximal one, from its wished value."""
    error = value - scratch.values[driven["column"]]
    return wrap(error, 0.0) if is_multiturn(driven) else error


@routine
def has_spheres(scratch: NewtonScratch) -> bool:
    """True if all equations are spheres."""
    return scratch.spheres.legs.shape[0] > 0


@routine
def put_residuals(table: Table, scratch: NewtonScratch) -> float:
    """Evaluate the legs at the current configuration and fill the right-hand sides; the largest residual.

    If all equations are spheres, only these are evaluated, and the left-hand sides are filled too.
    """
    if has_spheres(scratch):
        return put_spheres(scratch.state.pose, scratch.spheres, scratch.equations)
    worst, rows, equations = (
        evaluate_legs(table, scratch.state, scratch.leg_eval),
        scratch.leg_eval.rows,
        scratch.equations,
    )
    m, e = scratch.free.shape[0], rows.shape[0]
    for r in range(e):
        equations[r, m] = -rows[r]
    for i in range(table.driven.shape[0]):
        if not drives_proximal(table, i):
            driven = table.driven[i]
            error = driver_error(driven, deviation(driven, scratch.leg_eval.values), scratch)
            worst, equations[e, m] = max(worst, abs(error)), -error
            e += 1
    return worst


@routine
def put_equations(table: Table, scratch: NewtonScratch) -> None:
    """Fill the left-hand sides, the legs being evaluated."""
    slopes, leg_eval = scratch.leg_eval.slopes, scratch.leg_eval
    put_slopes(table, leg_eval)
    e = slopes.shape[0]
    for r in range(e):
        put_free_slope(r, slopes[r], scratch)
    for i in range(table.driven.shape[0]):
        if not drives_proximal(table, i):
            coordinate_slope(table, table.driven[i], leg_eval)
            put_free_slope(e, leg_eval.slope, scratch)
            e += 1


@routine
def solve_linear(scratch: NewtonScratch) -> bool:
    """Solve the linear equations into the last column of `normal`; False if they have no solution.

    By least squares unless there are as many equations as unknowns.
    """
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
def newton(table: Table, assembled: float, stays: bool, scratch: NewtonScratch) -> float:
    """Solve for the actuators' values from the current configuration; the largest residual left.

    Parameters
    ----------
    assembled : residual that ends the iteration [L or rad].
    stays : end with an infinite residual if the platform does not follow the actuators: where they place rods, if one
        goes farther than `FARTHEST_TURN`, if the first step, by the slopes at the start, leaves more than `BELIEVED`
        says, or if a singularity is between start and end; elsewhere if steps do not contract, as of `CONTRACTION`.
    """
    free, normal, step = scratch.free, scratch.normal, scratch.step
    m, previous, longest_step = free.shape[0], math.inf, math.inf
    follows = place_carriers(table, scratch) and stays
    if follows:
        follows = put_first_equations(table, scratch)
    if place_drivers(table, scratch) > FARTHEST_TURN and follows:
        return math.inf
    if has_spheres(scratch):
        set_spheres(table, scratch.values, scratch.state, scratch.leg_eval, scratch.spheres)
    for iteration in range(FORWARD_STEPS):
        if scratch.steps[1] > 0 and scratch.steps[0] >= scratch.steps[1]:
            return math.inf
        by_first = follows and iteration == 0
        if by_first and has_spheres(scratch):
            worst = put_sphere_errors(scratch.state.pose, scratch.spheres, scratch.equations)
        else:
            worst = put_residuals(table, scratch)
        if not worst < math.inf or worst <= assembled or (worst <= NEARLY_ASSEMBLED and worst > 0.5 * previous):
            return math.inf if follows and iteration > 0 and has_crossed(scratch) else worst
        is_near = iteration > 0 and worst * worst <= ASSEMBLED * previous  # another step with the same slopes suffices
        if not is_near and not has_spheres(scratch) and not by_first:
            put_equations(table, scratch)
        if not solve_linear(scratch):
            return math.inf
        previous, size = worst, 0.0
        for a in range(m):
            step[free[a]] = normal[a, m]
            size += normal[a, m] * normal[a, m]
        scratch.steps[0] += 1
        if not take_step(table, scratch) and stays:
            return math.inf
        if stays and worst > NEARLY_ASSEMBLED and not math.sqrt(size) <= longest_step:
            return math.inf
        longest_step = (BELIEVED if by_first else CONTRACTION) * math.sqrt(size)
    return put_residuals(table, scratch)


@routine
def take_step(table: Table, scratch: NewtonScratch) -> bool:
    """Take a step; False if it was shortened, as the platform's joints move or turn too far for the linearisation.

    The reference point may be far away, so the platform turns about the centre of its joints.
    """
    pose, step, middle = scratch.state.pose, scratch.step, middle_of(scratch.state.pose, table.task[0])
    put(step, add(vec(step), cross(vec(step[3:]), middle)))
    share = min(1.0, NEWTON_STEP / max(longest(step, step.shape[0]), NEWTON_STEP))
    move(table, step, share, scratch.state)
    shift = sub(middle, middle_of(pose, table.task[0]))
    for i in range(3):
        pose[i, 3] += shift[i]
    return share == 1.0


@routine
def continue_to(table: Table, values: Floats, scratch: NewtonScratch) -> float:
    """Solve for the actuators' values in the assembly mode of the current configuration; the largest residual.

    The actuators go to their values in steps from each of which Newton's method contracts; they halve where it does
    not. Infinite where a singularity ends the mode.
    """
    start_values, current_values = scratch.start_values, scratch.values
    evaluate_legs(table, scratch.state, scratch.leg_eval)
    for i in range(table.driven.shape[0]):
        column = table.driven[i]["column"]
        start_values[column] = deviation(table.driven[i], scratch.leg_eval.values)
        if table.driven[i]["turns"] == 1:
            start_values[column] = wrap(start_values[column], values[column])
    way, share, worst = 0.0, 0.5, math.inf
    copy_platform_state(scratch.state, scratch.behind)
    while way < 1.0 and share >= SHORTEST_SHARE:
        for column in range(current_values.shape[0]):
            current_values[column] = start_values[column] + (values[column] - start_values[column]) * (way + share)
        assembled = ASSEMBLED if way + share == 1.0 else ON_THE_WAY
        worst = newton(table, assembled, True, scratch)
        if worst <= max(assembled, NEARLY_ASSEMBLED):
            copy_platform_state(scratch.state, scratch.behind)
            way += share
            share = min(2.0 * share, 1.0 - way)
        else:
            copy_platform_state(scratch.behind, scratch.state)
            share, worst = 0.5 * share, math.inf
    return worst


@routine
def is_feasible(table: Table, values: Floats, scratch: NewtonScratch) -> bool:
    """True if the current configuration, assembled, keeps all limits, those of the actuators included."""
    if has_spheres(scratch):
        evaluate_legs(table, scratch.state, scratch.leg_eval)
    for i in range(table.driven.shape[0]):
        value = values[table.driven[i]["column"]]
        if not max(table.driven[i]["lo"] - value, value - table.driven[i]["hi"]) <= KEPT:
            return False
    return bool(excess_of(table.limited, table.cones, scratch.leg_eval.values) <= KEPT)


@routine
def load_start(table: Table, starts: Starts, start: int, scratch: NewtonScratch) -> None:
    """Fill the current configuration with a start."""
    state = scratch.state
    copy_table(starts.poses[start], state.pose)
    copy_row(starts.sides[start], state.sides)
    if starts.q.shape[0] > 0:
        copy_row(starts.q[start], state.q)
    else:
        place_proximal(table, scratch.state, BENT, scratch.leg_eval)


@routine
def squared_distance(one: Floats, other: Floats) -> float:
    """Sum of the squared differences of two poses' entries."""
    square = 0.0
    for i in range(3):
        for j in range(4):
            square += (one[i, j] - other[i, j]) ** 2
    return square


@routine
def put_deviations(table: Table, values: Floats, deviations: Floats) -> None:
    """Fill the deviations from home [L or rad] of actuators at given values (n_a,) [length or rad].

    Angles without bounds are reduced to one turn, and deviations are limited to SIGHT.
    """
    for i in range(table.driven.shape[0]):
        driven = table.driven[i]
        deviation = (values[driven["column"]] - driven["home"]) / driven["unit"]
        if driven["turns"] == 1 and driven["hi"] - driven["lo"] == math.inf:
            deviation -= 2.0 * math.pi * math.floor(deviation / (2.0 * math.pi))
        deviations[driven["column"]] = min(max(deviation, -FARTHEST_VALUE), FARTHEST_VALUE)


@routine
def assemble_from_own(table: Table, wished: Floats, starts: Starts, start: int, scratch: NewtonScratch) -> int:
    """Assemble one row within all limits, into `scratch.state`, with the legs evaluated there; its status.

    From a start in its assembly mode, at once or by continuation: PENDING if that fails, EXCEEDED if it leads beyond a
    limit.

    Parameters
    ----------
    wished : deviations of the actuators from home, (n_a,) [L or rad].
    """
    for attempt in range(2):
        load_start(table, starts, start, scratch)
        copy_row(wished, scratch.values)
        worst = newton(table, ASSEMBLED, True, scratch) if attempt == 0 else continue_to(table, wished, scratch)
        if worst <= NEARLY_ASSEMBLED:
            return REACHED if is_feasible(table, wished, scratch) else EXCEEDED
    return PENDING


@routine
def assemble_from_others(
    table: Table, wished: Floats, starts: Starts, pose: Floats, nearest: float, scratch: NewtonScratch
) -> float:
    """Assemble one row as `assemble_from_own` does, from other starts in any mode; the squared distance from a pose.

    Of the solutions, that nearest to the pose (4, 4) [L] is taken if it is nearer than `nearest`.
    """
    for start in range(starts.poses.shape[0]):
        load_start(table, starts, start, scratch)
        copy_row(wished, scratch.values)
        if newton(table, ASSEMBLED, False, scratch) <= NEARLY_ASSEMBLED and is_feasible(table, wished, scratch):
            distance = squared_distance(scratch.state.pose, pose)
            if distance < nearest:
                nearest = distance
                copy_platform_state(scratch.state, scratch.best)
    if nearest < math.inf:
        copy_platform_state(scratch.best, scratch.state)
        evaluate_legs(table, scratch.state, scratch.leg_eval)
    return nearest


@routine
def write_assembled(table: Table, row: int, scratch: NewtonScratch, ends: Starts, measures: Floats) -> None:
    """Write an assembled configuration, its pose in [length], and its measures."""
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
open_newton = opener(new_newton_scratch(SAMPLE, True))
"""Starts and scratch memory at the addresses of handles."""


@kernel
def assemble(
    machine: int,
    scratch_address: int,
    values: Floats,
    starts_address: int,
    is_begun: bool,
    status: Ints,
    deviations: Floats,
    ends: Starts,
    measures: Floats,
) -> int:
    """Assemble legs at given actuators, within all limits; the other rows are PENDING.

    Or EXCEEDED, if they assemble in the mode of the row's start but beyond a limit. Newton's method runs from each
    row's start; if it does not contract, a continuation leads the actuators to their values.

    Parameters
    ----------
    machine, scratch_address : addresses of the kernel table and of `NewtonScratch`.
    values : (n, n_a) [length or rad].
    starts_address : address of `Starts`: one for each row or one for all.
    is_begun : True if rows that are REACHED have their configurations, from `assemble_in_blocks`.
    deviations : filled by `put_deviations`, (n, n_a).
    ends : filled with the configurations, their poses in [length].

    Returns
    -------
    The number of rows that are not REACHED.
    """
    table, starts, scratch, n_unassembled = (
        open_table(machine),
        open_starts(starts_address),
        open_newton(scratch_address),
        0,
    )
    for row in range(values.shape[0]):
        if is_begun and status[row] == REACHED:
            continue
        put_deviations(table, values[row], deviations[row])
        own = row if starts.poses.shape[0] > 1 else 0
        status[row] = assemble_from_own(table, deviations[row], starts, own, scratch)
        if status[row] == REACHED:
            write_assembled(table, row, scratch, ends, measures)
        else:
            n_unassembled += 1
    return n_unassembled
