"""A search in the platform's pose to first order in its free motions, and the Hessian of its Lagrangian."""

from __future__ import annotations

import math

from ...common.arrays import Floats
from .._jit import routine
from ..clearance.link_limits import pair_excess
from ..free_motions import FreeMotions, add_limit, eliminate, project, project_gradient, put_multipliers
from ..joints.linearise_loops import price_curvature
from ..legs.answer import deviation
from ..legs.frames import set_frames
from ..legs.records import SHARED, Table
from ..search_constants import PROBE
from ..sqp import add_products, symmetrise
from ..vectors import dot, vec
from .equations import PlatformState, evaluate_leg, evaluate_legs, has_proximal, length_row, put_leg_slopes, put_slopes
from .limits import add_pair_slope, cone_slope, coordinate_slope, dead_point_slope, place_links
from .pose_constants import NEAR_LINKS
from .search import SearchScratch, copy_platform_state, move, put_objective
from .search_records import PlatformObjective


@routine
def put_limited_gradient(table: Table, search: SearchScratch, out: Floats) -> None:
    """Gradient of the objective plus the limits times their multipliers, at `search.leg_eval`."""
    gradient, multipliers, slope, kept_sides = (
        search.objective_gradient,
        search.hessian.multipliers,
        search.leg_eval.slope,
        search.kept_sides,
    )
    for j in range(out.shape[0]):
        out[j] = gradient[j]
    n_ranges = table.limited.shape[0]
    for i in range(n_ranges):
        multiplier = multipliers[2 * i + 1] - multipliers[2 * i]
        if multiplier != 0.0:
            coordinate_slope(table, table.limited[i], search.leg_eval)
            for j in range(out.shape[0]):
                out[j] += multiplier * slope[j]
    for i in range(table.cones.shape[0]):
        multiplier = multipliers[2 * n_ranges + i]
        if multiplier != 0.0:
            cone_slope(table, table.cones[i], search.leg_eval)
            for j in range(out.shape[0]):
                out[j] += multiplier * slope[j]
    offset = 2 * n_ranges + table.cones.shape[0]
    for k in range(kept_sides.shape[0]):
        multiplier = multipliers[offset + k] * kept_sides[k]
        if multiplier != 0.0:
            dead_point_slope(table, k, search.leg_eval)
            for j in range(out.shape[0]):
                out[j] += multiplier * slope[j]
    offset, links, is_placed = offset + kept_sides.shape[0], search.links, False
    for pair in range(links.kept[0]):
        multiplier = multipliers[offset + pair]
        if multiplier != 0.0:
            if not is_placed:
                place_links(table, search.links, search.leg_eval.frames, search.leg_eval.values)
            is_placed = True
            over = pair_excess(search.links, pair, math.inf)
            add_pair_slope(table, search.links, pair, over, multiplier, search.leg_eval, out)


@routine
def add_equation_gradient(held: int, search: SearchScratch, out: Floats) -> None:
    """Add the gradient of the equations times their multipliers."""
    equation_multipliers, slopes, holds = search.equation_multipliers, search.leg_eval.slopes, search.gradient.holds
    m = slopes.shape[0]
    for r in range(m):
        if equation_multipliers[r] != 0.0:
            for j in range(out.shape[0]):
                out[j] += equation_multipliers[r] * slopes[r, j]
    for k in range(held):
        for j in range(6):
            out[j] += equation_multipliers[m + k] * holds[k, j]


@routine
def note_involved(table: Table, objective: PlatformObjective, search: SearchScratch) -> None:
    """Mark the legs that the Lagrangian depends on.

    These are the legs of actuators in the objective, and of limits and equations with multipliers, with the joints that
    carry them.
    """
    legs, multipliers, equation_multipliers, involved = (
        table.legs,
        search.hessian.multipliers,
        search.equation_multipliers,
        search.involved,
    )
    n_ranges, n = table.limited.shape[0], legs.shape[0]
    offset = 2 * n_ranges + table.cones.shape[0]
    for k in range(n):
        largest = multipliers[offset + k]
        for r in range(legs[k]["first_row"], legs[k]["first_row"] + legs[k]["n_rows"]):
            largest = max(largest, abs(equation_multipliers[r]))
        if has_proximal(legs[k]):
            largest = max(largest, abs(equation_multipliers[length_row(table, k)]))
        involved[k] = 1 if largest > 0.0 else 0
    for i in range(n_ranges):
        if multipliers[2 * i] != multipliers[2 * i + 1]:
            involved[table.limited[i]["leg"]] = 1
    for i in range(table.cones.shape[0]):
        if multipliers[2 * n_ranges + i] > 0.0:
            involved[table.cones[i]["leg"]] = 1
    links = search.links
    for pair in range(links.kept[0]):
        for end in range(4 if multipliers[offset + n + pair] > 0.0 else 0):
            body = links.bodies[links.pairs[pair, end // 2], end % 2]
            if body >= 0:
                involved[body] = 1
    for i in range(table.driven.shape[0] if objective.values.shape[0] > 0 else 0):
        involved[table.driven[i]["leg"]] = 1
    for k in range(n - 1, 0, -1):
        if involved[k] == 1:
            if legs[k]["proximal"] == SHARED:
                involved[k - 1] = 1
            if legs[k]["redundant"] >= 0:
                involved[legs[k]["redundant"]] = 1


@routine
def lagrangian_gradient(
    table: Table, row: int, objective: PlatformObjective, state: PlatformState, search: SearchScratch, out: Floats
) -> None:
    """Gradient of the Lagrangian at a configuration, from the legs that are `involved`."""
    involved, owner = search.involved, 0
    set_frames(state.pose, table.task[0], search.leg_eval.frames)
    for k in range(involved.shape[0]):
        owner = owner if table.legs[k]["proximal"] == SHARED else k
        if involved[k] == 1:
            evaluate_leg(table, k, owner, state, search.leg_eval)
            put_leg_slopes(table, k, owner, search.leg_eval)
    _, held = put_objective(table, row, objective, state, search)
    put_limited_gradient(table, search, out)
    add_equation_gradient(held, search, out)


@routine
def lagrangian_hessian(
    table: Table, row: int, objective: PlatformObjective, search: SearchScratch, reduced: FreeMotions
) -> float:
    """Hessian of the Lagrangian in the free motions, into `hessian`; the largest entry on its diagonal.

    By differences of the gradient of the Lagrangian from `best`, where `search.leg_eval` still is; the multipliers of
    the equations balance the gradient at pivot unknowns. What a price bends is added: its edge may be sharper than the
    differences are wide.
    """
    linear, H, basis, step = reduced.linear, search.hessian.H, reduced.basis, search.step
    motions, here, there = linear.totals[0]["motions"], search.here, search.there
    is_priced = objective.pose.price > 0.0
    if is_priced:
        search.gradient.pricing[0]["is_fixed"] = 1
        for part in range(2):
            for j in range(step.shape[0]):
                there[j] = search.objective_gradient[j] if 3 * part <= j < 3 * part + 3 else 0.0
            project(there, reduced, search.hessian.forces[part])
    put_limited_gradient(table, search, search.here)
    search.control[0]["equation_multipliers"] = put_multipliers(search.here, reduced, search.equation_multipliers)
    add_equation_gradient(linear.totals[0]["rows"] - search.leg_eval.slopes.shape[0], search, search.here)
    note_involved(table, objective, search)
    for a in range(motions):
        step_length = PROBE / math.sqrt(linear.metric[a, a])
        for j in range(step.shape[0]):
            step[j] = basis[j, a]
        copy_platform_state(search.best, search.trial)
        move(table, search.step, step_length, search.trial)
        lagrangian_gradient(table, row, objective, search.trial, search, search.there)
        for j in range(step.shape[0]):
            there[j] = (there[j] - here[j]) / step_length
        project(there, reduced, H[a])
    if is_priced:
        search.gradient.pricing[0]["is_fixed"] = 0
        place, both, turn = price_curvature(objective.pose, False, search.gradient)
        add_products(place, both, turn, search.hessian, motions)
    return symmetrise(H, motions)


@routine
def linearise(
    table: Table,
    row: int,
    objective: PlatformObjective,
    state: PlatformState,
    search: SearchScratch,
    reduced: FreeMotions,
) -> None:
    """Fill the reduced linearisation at a configuration."""
    totals, errors = reduced.linear.totals[0], search.gradient.errors
    search.effort[0]["linearised"] += 1
    gap = evaluate_legs(table, state, search.leg_eval)
    put_slopes(table, search.leg_eval)
    totals["value"], held = put_objective(table, row, objective, state, search)
    for k in range(held):
        gap = max(gap, abs(errors[k]))
    totals["gap"] = gap
    eliminate(
        put_equations(held, search), search.elimination, reduced, search.leg_eval.rows.shape[0], objective.implied
    )
    project_gradient(search.objective_gradient, reduced)
    linearise_limits(table, objective.pose.margin, search, reduced)


@routine
def put_equations(held: int, search: SearchScratch) -> int:
    """Fill the equations of the legs and of the held part, with an identity beside them; their number."""
    A, rows, slopes = search.elimination.A, search.leg_eval.rows, search.leg_eval.slopes
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
def linearise_limits(table: Table, margin: float, search: SearchScratch, reduced: FreeMotions) -> None:
    """Fill excess and gradient of every limit within reach, and of dead points that are not to be passed."""
    slope, values, kept_sides, k, excess = (
        search.leg_eval.slope,
        search.leg_eval.values,
        search.kept_sides,
        0,
        -math.inf,
    )
    near, half_angles, margins = search.near[0], search.half_angles, search.margins
    cosine, sine = math.cos(near), math.sin(near)
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        value = deviation(limited, values)
        below, above = limited["lo"] + margin - value, value - limited["hi"] + margin
        below, above = below + margins[2 * i], above + margins[2 * i + 1]
        if max(below, above) <= -near:
            continue
        excess = max(excess, max(below, above))
        coordinate_slope(table, limited, search.leg_eval)
        if above > -near:
            k = add_limit(k, above, 2 * i + 1, search.leg_eval.slope, reduced)
        if below > -near:
            for j in range(slope.shape[0]):
                slope[j] = -slope[j]
            k = add_limit(k, below, 2 * i, search.leg_eval.slope, reduced)
    for i in range(search.n_cones[0]):
        cone, number = table.cones[i], 2 * table.limited.shape[0] + i
        line = vec(values[cone["leg"], cone["place"] :])
        if (
            half_angles[i, 0] <= near
            or margins[number] > 0.0
            or dot(vec(cone["axis"]), line) <= half_angles[i, 1] * cosine + half_angles[i, 2] * sine
        ):
            over = cone_slope(table, cone, search.leg_eval) - cone["half_angle"] + margin + margins[number]
            excess = max(excess, over)
            k = add_limit(k, over, number, search.leg_eval.slope, reduced)
    offset = 2 * table.limited.shape[0] + table.cones.shape[0]
    for leg in range(kept_sides.shape[0]):
        if kept_sides[leg] != 0.0:
            over = kept_sides[leg] * dead_point_slope(table, leg, search.leg_eval) + margins[offset + leg]
            if over > -near:
                excess = max(excess, over)
                for j in range(slope.shape[0]):
                    slope[j] *= kept_sides[leg]
                k = add_limit(k, over, offset + leg, search.leg_eval.slope, reduced)
    offset, links = offset + kept_sides.shape[0], search.links
    if links.kept[0] > 0:
        place_links(table, search.links, search.leg_eval.frames, search.leg_eval.values)
    near = min(near, NEAR_LINKS)
    for pair in range(links.kept[0]):
        excess_of_pair = pair_excess(search.links, pair, near + margins[offset + pair])
        over = excess_of_pair + margin + margins[offset + pair]
        if over > -near:
            excess = max(excess, over)
            for j in range(slope.shape[0]):
                slope[j] = 0.0
            add_pair_slope(table, search.links, pair, excess_of_pair, 1.0, search.leg_eval, search.leg_eval.slope)
            k = add_limit(k, over, offset + pair, search.leg_eval.slope, reduced)
    reduced.linear.totals[0]["limits"] = k
    reduced.linear.totals[0]["excess"] = excess
