"""The Lagrangian of a search in the pose of the platform: its gradient, and its Hessian by differences."""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine
from ..clearance.link_limits import pair_excess
from ..free_motions import FreeMotions, project, put_multipliers
from ..legs.frames import set_frames
from ..legs.records import SHARED, Table
from ..search_constants import PROBE
from ..sqp import symmetrise
from .equations import PlatformState, evaluate_leg, has_proximal, length_row, put_leg_slopes
from .leg_links import add_pair_slope, place_links
from .limits import cone_slope, coordinate_slope, dead_point_slope
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
    the equations balance the gradient at pivot unknowns.
    """
    linear, H, basis, step = reduced.linear, search.hessian.H, reduced.basis, search.step
    motions, here, there = linear.totals[0]["motions"], search.here, search.there
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
    return symmetrise(H, motions)
