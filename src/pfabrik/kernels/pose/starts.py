"""Starts of searches in the pose of the platform: targets, platforms and proximal joints put in place."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine
from ..joints.linearise_loops import pose_gradient
from ..joints.loops import BASE_AXES, HALF_WAY, LOCKED, TARGET_AXES, PoseObjective
from ..legs.complete_poses import column, is_pose, middle_of, orthonormalise, set_yaw, turn_pose
from ..legs.frames import ZERO, orienting_coordinate, q_redundant_of, set_frames
from ..legs.kinds import place_frame
from ..legs.records import CRANK, Q_PROXIMAL, Table
from ..legs.rods import solve_proximal
from ..quaternions import yaw_of
from ..search_constants import SIGHT
from ..vectors import Vec, copy_row, copy_table, cross, dot, move, norm, scale, sub, turn, vec, wrap
from .equations import LegEvaluation, PlatformState, has_proximal, redundant_side
from .pose_constants import AROUND, BENT, STRETCHED
from .search import SearchScratch
from .search_records import Along, Starts


@routine
def load_target(table: Table, objective: PoseObjective, row: int, search: SearchScratch) -> bool:
    """Fill `search.target` with the target of a row, brought within range of sight; False if it is no pose.

    For a platform that cannot turn and whose rotation is held, the rotation of the target is home's.
    """
    given, target, task = objective.targets[row], search.target, table.task[0]
    if not is_pose(given):
        return False
    farthest = 0.0
    for i in range(3):
        farthest = max(farthest, abs(given[i, 3] / task["length"] - task["reference"][i]))
        for j in range(3):
            target[i, j] = given[i, j]
    if task["rotations"] == 0 and objective.platform[3] == LOCKED:
        for i in range(9):
            target[i // 3, i % 3] = 1.0 if i % 4 == 0 else 0.0
    for i in range(3):
        home = task["reference"][i]
        target[i, 3] = home + (given[i, 3] / task["length"] - home) * min(1.0, SIGHT / max(farthest, SIGHT))
    orthonormalise(target)
    return True


@routine
def load_start(table: Table, starts: Starts, start: int, search: SearchScratch) -> None:
    """Fill `search.best` with a start."""
    copy_table(starts.poses[start], search.best.pose)
    copy_row(starts.sides[start], search.best.sides)
    if starts.q.shape[0] > 0:
        copy_row(starts.q[start], search.best.q)
    else:
        place_proximal(table, search.best, BENT, search.leg_eval)


@routine
def way_along(table: Table, objective: PoseObjective, target: Floats, along: Along) -> Vec:
    """The displacement by which seeds are taken along for a target [L]."""
    home = table.task[0]["reference"]
    off = (
        target[0, 3] - home[0] if objective.platform[0] != 0.0 else 0.0,
        target[1, 3] - home[1] if objective.platform[1] != 0.0 else 0.0,
        target[2, 3] - home[2] if objective.platform[2] != 0.0 else 0.0,
    )
    by = turn(along.part, off)
    return scale(1.0 - AROUND / max(norm(by), AROUND), by)


@routine
def take_along(by: Vec, along: Along, state: PlatformState) -> None:
    """Displace a configuration and its carriages, as far as the ranges of these allow."""
    pose, q, share = state.pose, state.q, 1.0
    for k in range(q.shape[0]):
        step = dot(vec(along.rates[k]), by)
        if step != 0.0:
            end = along.room[k, 1] if step > 0.0 else along.room[k, 0]
            share = min(share, max((end - q[k]) / step, 0.0))
    for k in range(q.shape[0]):
        q[k] += share * dot(vec(along.rates[k]), by)
    for i in range(3):
        pose[i, 3] += share * by[i]


@routine
def place_proximal(table: Table, state: PlatformState, bent: float, leg_eval: LegEvaluation) -> None:
    """Put proximal and redundant joints where the pose and the sides have them.

    Joints at dead points are displaced a little, by `bent`, to their sides: at a dead point the gradient does not show
    that they can move, and a search would stay there.
    """
    q, sides = state.q, state.sides
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(q.shape[0]):
        leg, values = table.legs[k], leg_eval.values[k]
        q[k] = q_redundant_of(table.legs, k, sides) if leg["makes"] > 0 else 0.0
        if leg["orients"] == 1:
            q[k], _ = orienting_coordinate(leg, table.legs[k + 1], leg_eval.frames[leg["frame"]], sides[k])
        place_frame(table.legs, k, q, leg_eval.frames, leg_eval.values)
        if has_proximal(leg):
            platform_end = move(leg_eval.frames[leg["frame"]], vec(leg["platform_end_point"]))
            solve_proximal(leg, platform_end, -sides[k], values)
            other_solution = values[Q_PROXIMAL]
            solve_proximal(leg, platform_end, sides[k], values)
            q[k] = (
                values[Q_PROXIMAL]
                if abs(values[Q_PROXIMAL] - other_solution) >= STRETCHED
                else values[Q_PROXIMAL] + bent * sides[k]
            )


@routine
def place_held(
    table: Table, objective: PoseObjective, target: Floats, leg_eval: LegEvaluation, state: PlatformState
) -> None:
    """Move the platform to the held part of the target, and proximal joints to the nearest solutions there.

    The platform turns about the centre of its joints; if legs complete the position, about its reference point.
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
    shift = sub(middle, middle_of(pose, table.task[0])) if table.task[0]["unset"] == 0 else ZERO
    for i in range(3):
        pose[i, 3] = target[i, 3] if objective.platform[i] == LOCKED else pose[i, 3] + shift[i]
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(q.shape[0]):
        leg = table.legs[k]
        if leg["orients"] == 1:
            q[k] = nearest_orienting(leg, table.legs[k + 1], leg_eval.frames[leg["frame"]], q[k])
        place_frame(table.legs, k, q, leg_eval.frames, leg_eval.values)
        if has_proximal(leg):
            q[k] = nearest_q_proximal(leg, leg_eval.frames[leg["frame"]], q[k], leg_eval.values[k])


@routine
def nearest_q_proximal(leg: Record, frame: Floats, current: float, values: Floats) -> float:
    """Of the coordinates at which a rod reaches its platform end, or comes nearest, the nearest to `current`."""
    platform_end, best = move(frame, vec(leg["platform_end_point"])), math.inf
    for i in range(2):
        solve_proximal(leg, platform_end, 2.0 * i - 1.0, values)
        candidate: float = values[Q_PROXIMAL]
        if leg["proximal"] == CRANK:
            candidate = wrap(candidate, current)
        if abs(candidate - current) < abs(best - current):
            best = candidate
    return best


@routine
def nearest_orienting(joint: Record, rod: Record, frame: Floats, current: float) -> float:
    """Of the coordinates of an orienting joint that face its rod to the platform end, the nearest to `current`."""
    candidate, _ = orienting_coordinate(joint, rod, frame, 1.0)
    if joint["proximal"] != CRANK:
        return candidate
    other, _ = orienting_coordinate(joint, rod, frame, -1.0)
    candidate, other = wrap(candidate, current), wrap(other, current)
    return candidate if abs(candidate - current) <= abs(other - current) else other


@routine
def put_sides(table: Table, state: PlatformState, leg_eval: LegEvaluation) -> None:
    """Fill the sides of legs, and the coordinates of redundant joints without sides, from a configuration."""
    set_frames(state.pose, table.task[0], leg_eval.frames)
    sides, q = state.sides, state.q
    for k in range(q.shape[0]):
        leg = table.legs[k]
        if leg["implicit"] == 1:
            sides[k] = q[k]
        elif leg["orients"] == 1 and sides[k] != 0.0:
            sides[k] = redundant_side(leg, table.legs[k + 1], leg_eval.frames[leg["frame"]], q[k])
        place_frame(table.legs, k, q, leg_eval.frames, leg_eval.values)
        if has_proximal(leg):
            frame = leg_eval.frames[leg["frame"]]
            platform_end = move(frame, vec(leg["platform_end_point"]))
            distances = (0.0, 0.0)
            for side in (-1.0, 1.0):
                solve_proximal(leg, platform_end, side, leg_eval.values[k])
                difference = leg_eval.values[k, Q_PROXIMAL] - q[k]
                distances = (distances[1], abs(wrap(difference, 0.0) if leg["proximal"] == CRANK else difference))
            if abs(distances[1] - distances[0]) > STRETCHED:
                sides[k] = 1.0 if distances[1] < distances[0] else -1.0


@routine
def nearest_start(objective: PoseObjective, by: Vec, starts: Starts, search: SearchScratch) -> int:
    """Index of the start whose pose, taken along by `by`, is nearest to the target; -1 if there are none."""
    nearest, least, target, gradient = -1, math.inf, search.trial.pose, search.gradient
    copy_table(search.target, target)
    for i in range(3):
        target[i, 3] -= by[i]
    gradient.unit[0] = 1.0
    for start in range(starts.poses.shape[0]):
        value, _ = pose_gradient(objective, target, starts.poses[start], gradient, True)
        if value < least:
            nearest, least = start, value
    return nearest
