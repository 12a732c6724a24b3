"""Objective, equations and limits of legs to first order, in the motions that their equations leave free."""

from __future__ import annotations

import math

from .._jit import routine
from ..clearance.link_limits import pair_excess
from ..free_motions import FreeMotions, add_limit, eliminate, project_gradient
from ..legs.answer import deviation
from ..legs.records import Table
from ..vectors import dot, vec
from .equations import PlatformState, evaluate_legs, put_slopes
from .leg_links import add_pair_slope, place_links
from .limits import cone_slope, coordinate_slope, dead_point_slope
from .pose_constants import NEAR_LINKS
from .search import SearchScratch, put_objective
from .search_records import PlatformObjective


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
    near, half_angles = search.near[0], search.half_angles
    cosine, sine = math.cos(near), math.sin(near)
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        value = deviation(limited, values)
        below, above = limited["lo"] + margin - value, value - limited["hi"] + margin
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
        cone = table.cones[i]
        line = vec(values[cone["leg"], cone["place"] :])
        if (
            half_angles[i, 0] <= near
            or dot(vec(cone["axis"]), line) <= half_angles[i, 1] * cosine + half_angles[i, 2] * sine
        ):
            over = cone_slope(table, cone, search.leg_eval) - cone["half_angle"] + margin
            excess = max(excess, over)
            k = add_limit(k, over, 2 * table.limited.shape[0] + i, search.leg_eval.slope, reduced)
    offset = 2 * table.limited.shape[0] + table.cones.shape[0]
    for leg in range(kept_sides.shape[0]):
        if kept_sides[leg] != 0.0:
            over = kept_sides[leg] * dead_point_slope(table, leg, search.leg_eval)
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
        over = pair_excess(search.links, pair, near) + margin
        if over > -near:
            excess = max(excess, over)
            for j in range(slope.shape[0]):
                slope[j] = 0.0
            add_pair_slope(table, search.links, pair, over - margin, 1.0, search.leg_eval, search.leg_eval.slope)
            k = add_limit(k, over, offset + pair, search.leg_eval.slope, reduced)
    reduced.linear.totals[0]["limits"] = k
    reduced.linear.totals[0]["excess"] = excess
