"""Memory of a search in the pose of the platform, and what is asked of it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Ints, Records
from .._jit import routine
from ..closure.loops import BASE_AXES, LOCKED, PoseObjective
from ..closure.pose_objective import PoseGradient, pose_gradient
from ..free_motions import Elimination, FreeMotions, new_elimination, new_free_motions
from ..legs.poses import turn_pose
from ..legs.records import Table
from ..qp import QP, new_qp
from ..sqp import CONTROL, Hessian, new_hessian
from ..vectors import copy_row, copy_table, wrap
from .equations import LegEvaluation, PlatformState, count_unknowns, new_leg_evaluation, new_platform_state
from .limits import coordinate_slope, counts_turns
from .records import PlatformObjective

NEAR, NEARBY, STEPS_AWAY = 0.3, 0.02, 3.0
"""Limits farther away than the first are left out of a programme [rad or L]: no step comes near them. As steps get
shorter, so are those farther away than so many of them, but for what is within the second."""


class Search(NamedTuple):
    """Scratch memory of one thread."""

    leg_eval: LegEvaluation
    gradient: PoseGradient
    hessian: Hessian
    control: Records  # (1,): CONTROL
    p: QP
    elimination: Elimination
    first: FreeMotions
    second: FreeMotions
    force: Floats  # (n,): gradient of the objective
    here: Floats  # (n,)
    there: Floats  # (n,)
    step: Floats  # (n,)
    balance: Floats  # (rows,): multipliers of the equations and of what is held
    best: PlatformState
    trial: PlatformState
    closed: PlatformState  # the last that was closed entirely on the way
    target: Floats  # (4, 4): of the row [L]
    kept: Floats  # (legs,): the sides that carriers are to stay on; 0 for either
    pulled: Ints  # (legs,): 1 for those that the Lagrangian asks for
    holding: Ints  # (legs,): 1 for those that hold the nearest configuration yet where it is
    near: Floats  # (1,): limits farther away are left out
    half_angles: Floats  # (cones, 3): of the cones that are minded, their cosines and sines


def new_search(table: Table, cones: int) -> Search:
    """Scratch memory of one thread, for searches that mind so many cones, the first ones."""
    n, legs = count_unknowns(table), table.legs.shape[0]
    rows, limits = table.task[0]["rows"] + n, 2 * table.limited.shape[0] + table.cones.shape[0] + legs
    elimination = new_elimination(n, rows)
    for j in range(n):
        elimination.used[j] = 2 if j < 6 else 1
    half_angles = np.zeros((cones, 3))
    for i in range(half_angles.shape[0]):
        angle = table.cones[i]["half_angle"]
        half_angles[i, 0], half_angles[i, 1], half_angles[i, 2] = angle, math.cos(angle), math.sin(angle)
    return Search(
        new_leg_evaluation(table),
        PoseGradient(np.zeros(6), np.zeros((6, 6)), np.zeros(6), np.ones(1), np.zeros(6)),
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
        new_platform_state(legs),
        new_platform_state(legs),
        new_platform_state(legs),
        np.zeros((4, 4)),
        np.zeros(legs),
        np.zeros(legs, np.int64),
        np.zeros(legs, np.int64),
        np.full(1, NEAR),
        half_angles,
    )


@routine
def copy_platform_state(source: PlatformState, to: PlatformState) -> None:
    copy_table(source.pose, to.pose)
    copy_row(source.q, to.q)
    copy_row(source.sides, to.sides)


@routine
def fix(objective: PoseObjective, in_place: bool, search: Search) -> None:
    """Leave out the components of the twist that are held, if the platform is in place and they are its velocities."""
    used = search.elimination.used
    for j in range(6):
        used[j] = 0 if in_place and objective.frame == BASE_AXES and objective.platform[j] == LOCKED else 2


@routine
def count_platform(users: int, search: Search) -> None:
    """Have equations solved for the platform as readily as for what carries their rods (1), or where those do not tell
    (2): what moves of it then counts as what legs have in common."""
    used = search.elimination.used
    for j in range(6):
        used[j] = users if used[j] > 0 else 0


@routine
def move(table: Table, step: Floats, share: float, state: PlatformState) -> None:
    """Take a share of a step."""
    pose, q, columns = state.pose, state.q, table.columns
    for i in range(3):
        pose[i, 3] += share * step[i]
    turn_pose(state.pose, (share * step[3], share * step[4], share * step[5]))
    for k in range(q.shape[0]):
        if columns[k] >= 0:
            q[k] += share * step[columns[k]]


@routine
def put_objective(
    table: Table, row: int, objective: PlatformObjective, state: PlatformState, search: Search
) -> tuple[float, int]:
    """The objective, its gradient into `search.force`; how many components of the twist are held by equations.

    None are where what is held is in its place and does not move: see `fix`.
    """
    force, slope = search.force, search.leg_eval.slope
    for j in range(6, force.shape[0]):
        force[j] = 0.0
    used = search.elimination.used
    turns = used[3] + used[4] + used[5] > 0
    value, held = pose_gradient(objective.pose, search.target, state.pose, search.gradient, turns)
    held = held if used[3] > 0 and used[0] > 0 else 0
    for j in range(6):
        force[j] = search.gradient.force[j]
    for i in range(table.driven.shape[0] if objective.values.shape[0] > 0 else 0):
        driven = table.driven[i]
        off = coordinate_slope(table, driven, search.leg_eval) - objective.values[row, driven["column"]]
        off = wrap(off, 0.0) if counts_turns(driven) else off
        value += 0.5 * search.gradient.unit[0] * off * off
        for j in range(force.shape[0]):
            force[j] += search.gradient.unit[0] * off * slope[j]
    return value, held
