"""The Lagrangian of a search in the pose of the platform: its gradient, and its curvature by differences of that."""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine
from ..free_motions import FreeMotions, project, put_multipliers
from ..legs.answer import end_of_rows
from ..legs.frames import set_frames
from ..legs.records import SHARED, Table
from ..sqp import PROBE, symmetrise
from .equations import PlatformState, has_proximal, own_row, place_leg, put_leg_slopes
from .limits import cone_slope, coordinate_slope, dead_point_slope
from .records import PlatformObjective
from .search import Search, copy_platform_state, move, put_objective


@routine
def put_force(table: Table, search: Search, out: Floats) -> None:
    """Gradient of the objective and of the limits, by their multipliers, where `search.leg_eval` is."""
    force, multipliers, slope, kept = search.force, search.hessian.multipliers, search.leg_eval.slope, search.kept
    for j in range(out.shape[0]):
        out[j] = force[j]
    ranges = table.limited.shape[0]
    for i in range(ranges):
        pull = multipliers[2 * i + 1] - multipliers[2 * i]
        if pull != 0.0:
            coordinate_slope(table, table.limited[i], search.leg_eval)
            for j in range(out.shape[0]):
                out[j] += pull * slope[j]
    for i in range(table.cones.shape[0]):
        pull = multipliers[2 * ranges + i]
        if pull != 0.0:
            cone_slope(table, table.cones[i], search.leg_eval)
            for j in range(out.shape[0]):
                out[j] += pull * slope[j]
    first = 2 * ranges + table.cones.shape[0]
    for k in range(kept.shape[0]):
        pull = multipliers[first + k] * kept[k]
        if pull != 0.0:
            dead_point_slope(table, k, search.leg_eval)
            for j in range(out.shape[0]):
                out[j] += pull * slope[j]


@routine
def add_balance(held: int, search: Search, out: Floats) -> None:
    """Add the gradient of the equations, by their multipliers."""
    balance, slopes, holds = search.balance, search.leg_eval.slopes, search.gradient.holds
    m = slopes.shape[0]
    for r in range(m):
        if balance[r] != 0.0:
            for j in range(out.shape[0]):
                out[j] += balance[r] * slopes[r, j]
    for k in range(held):
        for j in range(6):
            out[j] += balance[m + k] * holds[k, j]


@routine
def note_pulled(table: Table, objective: PlatformObjective, search: Search) -> None:
    """Note the legs that the Lagrangian asks for: those of limits and equations with multipliers, and what carries
    them."""
    legs, multipliers, balance, pulled = table.legs, search.hessian.multipliers, search.balance, search.pulled
    ranges, n = table.limited.shape[0], legs.shape[0]
    first = 2 * ranges + table.cones.shape[0]
    for k in range(n):
        most = multipliers[first + k]
        for r in range(legs[k]["first_row"], end_of_rows(legs, k, table.task[0]["rows"])):
            most = max(most, abs(balance[r]))
        if has_proximal(legs[k]):
            most = max(most, abs(balance[own_row(table, k)]))
        pulled[k] = 1 if most > 0.0 else 0
    for i in range(ranges):
        if multipliers[2 * i] != multipliers[2 * i + 1]:
            pulled[table.limited[i]["leg"]] = 1
    for i in range(table.cones.shape[0]):
        if multipliers[2 * ranges + i] > 0.0:
            pulled[table.cones[i]["leg"]] = 1
    for i in range(table.driven.shape[0] if objective.values.shape[0] > 0 else 0):
        pulled[table.driven[i]["leg"]] = 1
    for k in range(n - 1, 0, -1):
        if pulled[k] == 1:
            if legs[k]["proximal"] == SHARED:
                pulled[k - 1] = 1
            if legs[k]["redundant"] >= 0:
                pulled[legs[k]["redundant"]] = 1


@routine
def lagrangian_gradient(
    table: Table, row: int, objective: PlatformObjective, state: PlatformState, search: Search, out: Floats
) -> None:
    """Gradient of the Lagrangian at a configuration, from the legs that are `pulled`."""
    pulled, main = search.pulled, 0
    set_frames(state.pose, table.task[0], search.leg_eval.frames)
    for k in range(pulled.shape[0]):
        main = main if table.legs[k]["proximal"] == SHARED else k
        if pulled[k] == 1:
            place_leg(table, k, main, state, search.leg_eval)
            put_leg_slopes(table, k, main, search.leg_eval)
    _, held = put_objective(table, row, objective, state, search)
    put_force(table, search, out)
    add_balance(held, search, out)


@routine
def lagrangian_hessian(
    table: Table, row: int, objective: PlatformObjective, search: Search, reduced: FreeMotions
) -> float:
    """Curvature of the objective and of the active limits along free motions, into `hessian`; the largest on its
    diagonal.

    By differences of the gradient of the Lagrangian, whose multipliers of the equations balance it at pivot unknowns,
    from `best`, where `search.leg_eval` still is.
    """
    linear, H, basis, step = reduced.linear, search.hessian.H, reduced.basis, search.step
    motions, here, there = linear.totals[0]["motions"], search.here, search.there
    put_force(table, search, search.here)
    search.control[0]["equation_multipliers"] = put_multipliers(search.here, reduced, search.balance)
    add_balance(linear.totals[0]["rows"] - search.leg_eval.slopes.shape[0], search, search.here)
    note_pulled(table, objective, search)
    for a in range(motions):
        probe = PROBE / math.sqrt(linear.metric[a, a])
        for j in range(step.shape[0]):
            step[j] = basis[j, a]
        copy_platform_state(search.best, search.trial)
        move(table, search.step, probe, search.trial)
        lagrangian_gradient(table, row, objective, search.trial, search, search.there)
        for j in range(step.shape[0]):
            there[j] = (there[j] - here[j]) / probe
        project(there, reduced, H[a])
    return symmetrise(H, motions)
