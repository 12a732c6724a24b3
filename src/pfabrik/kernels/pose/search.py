"""Scratch memory of a search in the pose of the platform, its objective and its steps."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Records
from .._jit import routine
from ..clearance.link_limits import new_link_limits
from ..clearance.link_records import LinkLimits
from ..free_motions import Elimination, FreeMotions, new_elimination, new_free_motions
from ..joints.linearise_loops import PRICING, PoseGradient, pose_gradient
from ..joints.loops import BASE_AXES, LOCKED, PoseObjective
from ..legs.complete_poses import turn_pose
from ..legs.records import Table
from ..projecting import EFFORT, UNBOUNDED
from ..qp import QP, new_qp
from ..sqp import CONTROL, Hessian, new_hessian
from ..vectors import copy_row, copy_table, wrap
from .equations import LegEvaluation, PlatformState, count_unknowns, new_leg_evaluation, new_platform_state
from .limits import coordinate_slope, is_multiturn
from .pose_constants import NEAR
from .search_records import PlatformObjective


class SearchScratch(NamedTuple):
    """Scratch memory of one thread."""

    leg_eval: LegEvaluation
    gradient: PoseGradient
    hessian: Hessian
    control: Records  # (1,): CONTROL
    p: QP
    elimination: Elimination
    first: FreeMotions  # reduced linearisations at `best` and `trial`, swapped when a step is accepted
    second: FreeMotions
    objective_gradient: Floats  # (n,): gradient of the objective
    here: Floats  # (n,): gradient of the Lagrangian at `best`
    there: Floats  # (n,): gradient of the Lagrangian beside it
    step: Floats  # (n,)
    equation_multipliers: Floats  # (rows,): multipliers of the equations and of the held part
    best: PlatformState
    trial: PlatformState
    closed: PlatformState  # the last feasible configuration of the descent
    target: Floats  # (4, 4): of the row [L]
    kept_sides: Floats  # (legs,): sides that proximal joints must keep; 0 for either
    involved: Ints  # (legs,): 1 for legs that the Lagrangian depends on
    blocking: Ints  # (legs,): 1 for legs that block the incumbent
    near: Floats  # (1,): limits farther away are left out [rad or L]
    margins: Floats  # (limits,): how far inside each limit a search stays, beyond the margin of all [rad or L]
    half_angles: Floats  # (cones, 3): half angles of all cones, their cosines and sines
    n_cones: Ints  # (1,): how many of these are constrained, the first ones
    links: LinkLimits
    effort: Records  # (1,): EFFORT


def new_search_scratch(table: Table, links: LinkLimits) -> SearchScratch:
    """Allocate the scratch memory of one thread."""
    n, n_legs = count_unknowns(table), table.legs.shape[0]
    rows, limits = table.task[0]["rows"] + n, 2 * table.limited.shape[0] + table.cones.shape[0] + n_legs
    limits += links.pairs.shape[0]
    elimination = new_elimination(n, rows)
    for j in range(n):
        elimination.used[j] = 2 if j < 6 else 1
    half_angles, effort = np.zeros((table.cones.shape[0], 3)), np.zeros(1, EFFORT)
    effort["most"], effort["bound"] = UNBOUNDED, UNBOUNDED
    for i in range(half_angles.shape[0]):
        angle = table.cones[i]["half_angle"]
        half_angles[i, 0], half_angles[i, 1], half_angles[i, 2] = angle, math.cos(angle), math.sin(angle)
    return SearchScratch(
        new_leg_evaluation(table),
        PoseGradient(np.zeros(6), np.zeros((6, 6)), np.zeros(6), np.ones(1), np.zeros(6), np.zeros(1, PRICING)),
        new_hessian(n, limits),
        np.zeros(1, CONTROL),
        new_qp(n, limits),
        elimination,
        new_free_motions(n, rows, limits),
        new_free_motions(n, rows, limits),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(rows),
        new_platform_state(n_legs),
        new_platform_state(n_legs),
        new_platform_state(n_legs),
        np.zeros((4, 4)),
        np.zeros(n_legs),
        np.zeros(n_legs, np.int64),
        np.zeros(n_legs, np.int64),
        np.full(1, NEAR),
        np.zeros(limits),
        half_angles,
        np.full(1, half_angles.shape[0]),
        new_link_limits(links),
        effort,
    )


@routine
def copy_platform_state(source: PlatformState, to: PlatformState) -> None:
    """Copy a configuration."""
    copy_table(source.pose, to.pose)
    copy_row(source.q, to.q)
    copy_row(source.sides, to.sides)


@routine
def fix_held(objective: PoseObjective, in_place: bool, search: SearchScratch) -> None:
    """Exclude the held components of the twist from the unknowns, if in place and along base axes."""
    used = search.elimination.used
    for j in range(6):
        used[j] = 0 if in_place and objective.frame == BASE_AXES and objective.platform[j] == LOCKED else 2


@routine
def set_platform_users(n_users: int, search: SearchScratch) -> None:
    """Set how often the platform's unknowns count as used by legs: 1 or 2.

    With 2, equations are solved for the platform only where proximal joints have small coefficients; with 1, for both
    alike.
    """
    used = search.elimination.used
    for j in range(6):
        used[j] = n_users if used[j] > 0 else 0


@routine
def move(table: Table, step: Floats, share: float, state: PlatformState) -> None:
    """Move a configuration by a share of a step of the unknowns."""
    pose, q, columns = state.pose, state.q, table.columns
    for i in range(3):
        pose[i, 3] += share * step[i]
    turn_pose(state.pose, (share * step[3], share * step[4], share * step[5]))
    for k in range(q.shape[0]):
        if columns[k] >= 0:
            q[k] += share * step[columns[k]]


@routine
def put_objective(
    table: Table, row: int, objective: PlatformObjective, state: PlatformState, search: SearchScratch
) -> tuple[float, int]:
    """The objective, its gradient into `search.objective_gradient`; the number of twist components held by equations.

    There are none if the held part is in place and excluded by `fix_held`.
    """
    gradient, slope = search.objective_gradient, search.leg_eval.slope
    for j in range(6, gradient.shape[0]):
        gradient[j] = 0.0
    used = search.elimination.used
    turns = used[3] + used[4] + used[5] > 0
    value, held = pose_gradient(objective.pose, search.target, state.pose, search.gradient, turns)
    held = held if used[3] > 0 and used[0] > 0 else 0
    for j in range(6):
        gradient[j] = search.gradient.force[j]
    for i in range(table.driven.shape[0] if objective.values.shape[0] > 0 else 0):
        driven = table.driven[i]
        error = coordinate_slope(table, driven, search.leg_eval) - objective.values[row, driven["column"]]
        error = wrap(error, 0.0) if is_multiturn(driven) else error
        value += 0.5 * search.gradient.unit[0] * error * error
        for j in range(gradient.shape[0]):
            gradient[j] += search.gradient.unit[0] * error * slope[j]
    return value, held
