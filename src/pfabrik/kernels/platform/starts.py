"""Where searches in the pose of the platform begin: targets read, platforms and carriers put in their places."""

from __future__ import annotations

import math

from ...arrays import Floats, Record
from .._jit import routine
from ..closure.loops import BASE_AXES, HALF_WAY, LOCKED, SIGHT, TARGET_AXES, PoseObjective
from ..closure.pose_objective import PoseGradient, pose_gradient
from ..legs.frames import ZERO, orienting_coordinate, place_redundant, q_redundant_of, set_frames
from ..legs.poses import column, is_pose, middle_of, orthonormalise, set_yaw, turn_pose
from ..legs.records import CRANK, Q_PROXIMAL, REDUNDANT, Table
from ..legs.rods import solve_proximal
from ..rotations import yaw_of
from ..vectors import copy_row, copy_table, cross, dot, move, norm, scale, sub, vec, wrap
from .equations import LegEvaluation, PlatformState, branch_of_redundant, has_proximal
from .records import STRETCHED, Starts
from .search import Search

BENT = 1e-2
"""How far rods that are stretched out are bent where a search starts [L or rad]."""


@routine
def load_target(table: Table, objective: PoseObjective, row: int, search: Search) -> bool:
    """Put the target of a row into `search.target`, near enough to be told from others there; False if it is no pose.

    Of a platform that cannot turn, and is not asked to, the rotation is home's.
    """
    own, target, task = objective.targets[row], search.target, table.task[0]
    if not is_pose(own):
        return False
    most = 0.0
    for i in range(3):
        most = max(most, abs(own[i, 3] / task["length"] - task["reference"][i]))
        for j in range(3):
            target[i, j] = own[i, j]
    if task["rotations"] == 0 and objective.platform[3] == LOCKED:
        for i in range(9):
            target[i // 3, i % 3] = 1.0 if i % 4 == 0 else 0.0
    for i in range(3):
        home = task["reference"][i]
        target[i, 3] = home + (own[i, 3] / task["length"] - home) * min(1.0, SIGHT / max(most, SIGHT))
    orthonormalise(target)
    return True


@routine
def begin(table: Table, starts: Starts, start: int, search: Search) -> None:
    """Put a start into `search.best`."""
    copy_table(starts.poses[start], search.best.pose)
    copy_row(starts.sides[start], search.best.sides)
    if starts.q.shape[0] > 0:
        copy_row(starts.q[start], search.best.q)
    else:
        place_proximal(table, search.best, search.leg_eval)


@routine
def place_proximal(table: Table, state: PlatformState, leg_eval: LegEvaluation) -> None:
    """Put carriers and arms where the pose and the sides have them.

    Rods that are stretched out over what carries them are bent a little to their sides: stretched out, nothing says to
    first order that they could bend, and a search would stay there.
    """
    q, sides = state.q, state.sides
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(q.shape[0]):
        leg, own = table.legs[k], leg_eval.values[k]
        q[k] = q_redundant_of(table.legs, k, sides) if leg["kind"] == REDUNDANT else 0.0
        if leg["orients"] == 1:
            q[k], _ = orienting_coordinate(leg, table.legs[k + 1], leg_eval.frames[leg["frame"]], sides[k])
        if leg["kind"] == REDUNDANT:
            place_redundant(leg, q[k], leg_eval.frames, own)
        if has_proximal(leg):
            platform_end = move(leg_eval.frames[leg["frame"]], vec(leg["platform_end_point"]))
            solve_proximal(leg, platform_end, -sides[k], own)
            other = own[Q_PROXIMAL]
            solve_proximal(leg, platform_end, sides[k], own)
            q[k] = own[Q_PROXIMAL] if abs(own[Q_PROXIMAL] - other) >= STRETCHED else own[Q_PROXIMAL] + BENT * sides[k]


@routine
def put_held(
    table: Table, objective: PoseObjective, target: Floats, leg_eval: LegEvaluation, state: PlatformState
) -> None:
    """Place the platform as it is to be held, and carriers where rods then put them.

    It turns about its middle, but where legs complete the position: they do so from where it was.
    """
    pose, q, middle = state.pose, state.q, middle_of(state.pose, table.task[0])
    for i in range(3):
        for j in range(3):
            if objective.frame == BASE_AXES and objective.platform[3] == LOCKED:
                pose[i, j] = target[i, j]
    if objective.frame == TARGET_AXES and objective.platform[3] == LOCKED:
        axis = cross(column(state.pose, 2), column(target, 2))
        sine = norm(axis)
        if sine > 0.0:
            turn_pose(state.pose, scale(math.atan2(sine, dot(column(state.pose, 2), column(target, 2))) / sine, axis))
    if objective.frame == HALF_WAY and objective.platform[5] == LOCKED:
        set_yaw(state.pose, yaw_of(target))
    off = sub(middle, middle_of(pose, table.task[0])) if table.task[0]["unset"] == 0 else ZERO
    for i in range(3):
        pose[i, 3] = target[i, 3] if objective.platform[i] == LOCKED else pose[i, 3] + off[i]
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(q.shape[0]):
        leg = table.legs[k]
        if leg["orients"] == 1:
            q[k] = nearest_orienting(leg, table.legs[k + 1], leg_eval.frames[leg["frame"]], q[k])
        if leg["kind"] == REDUNDANT:
            place_redundant(leg, q_redundant_of(table.legs, k, q), leg_eval.frames, leg_eval.values[k])
        if has_proximal(leg):
            q[k] = nearest_q_proximal(leg, leg_eval.frames[leg["frame"]], q[k], leg_eval.values[k])


@routine
def nearest_q_proximal(leg: Record, frame: Floats, present: float, own: Floats) -> float:
    """Of the two coordinates at which a carrier's rod reaches its head, or comes nearest, the one nearer to this."""
    platform_end, best = move(frame, vec(leg["platform_end_point"])), math.inf
    for i in range(2):
        solve_proximal(leg, platform_end, 2.0 * i - 1.0, own)
        found: float = own[Q_PROXIMAL]
        if leg["proximal"] == CRANK:
            found = wrap(found, present)
        if abs(found - present) < abs(best - present):
            best = found
    return best


@routine
def nearest_orienting(arm: Record, rod: Record, frame: Floats, present: float) -> float:
    """Of the coordinates at which an arm has its rod's plane hold the head, the one nearer to this."""
    found, _ = orienting_coordinate(arm, rod, frame, 1.0)
    if arm["proximal"] != CRANK:
        return found
    other, _ = orienting_coordinate(arm, rod, frame, -1.0)
    found, other = wrap(found, present), wrap(other, present)
    return found if abs(found - present) <= abs(other - present) else other


@routine
def put_sides(table: Table, state: PlatformState, leg_eval: LegEvaluation) -> None:
    """Tell which of their two solutions legs take, and where arms are."""
    set_frames(state.pose, table.task[0], leg_eval.frames)
    sides, q = state.sides, state.q
    for k in range(q.shape[0]):
        leg = table.legs[k]
        if leg["kind"] == REDUNDANT:
            if leg["orients"] == 0:
                sides[k] = q[k]
            elif sides[k] != 0.0:
                sides[k] = branch_of_redundant(leg, table.legs[k + 1], leg_eval.frames[leg["frame"]], q[k])
            place_redundant(leg, q[k], leg_eval.frames, leg_eval.values[k])
        if has_proximal(leg):
            frame = leg_eval.frames[leg["frame"]]
            platform_end = move(frame, vec(leg["platform_end_point"]))
            off = (0.0, 0.0)
            for side in (-1.0, 1.0):
                solve_proximal(leg, platform_end, side, leg_eval.values[k])
                away = leg_eval.values[k, Q_PROXIMAL] - q[k]
                off = (off[1], abs(wrap(away, 0.0) if leg["proximal"] == CRANK else away))
            if abs(off[1] - off[0]) > STRETCHED:
                sides[k] = 1.0 if off[1] < off[0] else -1.0


@routine
def nearest_start(objective: PoseObjective, target: Floats, starts: Starts, gradient: PoseGradient) -> int:
    """The start whose pose is nearest to a target; -1 where there is none."""
    nearest, least = -1, math.inf
    gradient.unit[0] = 1.0
    for start in range(starts.poses.shape[0]):
        value, _ = pose_gradient(objective, target, starts.poses[start], gradient, True)
        if value < least:
            nearest, least = start, value
    return nearest
