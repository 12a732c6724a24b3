"""Inverse kinematics by legs in closed form: poses completed by Newton's method, then all limits checked."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Record, Records
from .._jit import allocator, flattened, routine
from ..linear import solve_spd
from ..quaternions import yaw_of
from ..rows import LIMIT_EXCESS, PENDING, REACHED, RESIDUAL
from ..search_constants import CLOSED, NEARLY_CLOSED, NEWTON_STEP
from ..vectors import copy_row, cross, dot, move, norm, put, scale, vec, where, wrap_into
from .complete_poses import read_target, set_yaw, turn_pose
from .frames import new_frames, orienting_coordinate, q_redundant_of, redundant_slope, set_frames
from .kinds import leg_rows, leg_slopes, place_leg
from .leg_constants import DAMPING, KEPT, LEAST_MARGIN, MOST_STEPS, MOST_STEPS_IMPLICIT
from .pivots import any_across
from .records import N_VALUES, SHARED, Table, open_table
from .rods import solve_proximal


class Completion(NamedTuple):
    """Scratch memory of one thread."""

    pose: Floats  # (4, 4) [L]
    sides: Floats  # (legs,): side of each leg; the coordinate of a redundant joint without sides
    frames: Floats  # (n, 7, 4), as in `frames`
    values: Floats  # (legs, N_VALUES)
    lines: Floats  # (legs, 3): of a rod, from base end to platform end
    proximal_slopes: Floats  # (legs, 6): derivatives of proximal coordinates by the pose
    rows: Floats  # (m,): the constraints
    slopes: Floats  # (m, 6 + n_redundant): their derivatives by the pose, then by redundant joints
    motions: Floats  # (7, 6): twists of the unset coordinates; the last row is the step
    normal: Floats  # (7 + n_redundant, 8 + n_redundant): the normal equations


@allocator
def new_completion(table: Table) -> Completion:
    """Allocate the scratch memory of one thread."""
    legs, m, redundant = table.legs.shape[0], table.task[0]["rows"], table.task[0]["redundant"]
    return Completion(
        np.zeros((4, 4)),
        np.zeros(legs),
        new_frames(table.legs),
        np.zeros((legs, N_VALUES)),
        np.zeros((legs, 3)),
        np.zeros((legs, 6)),
        np.zeros(m),
        np.zeros((m, 6 + redundant)),
        np.zeros((7, 6)),
        np.zeros((7 + redundant, 8 + redundant)),
    )


@routine
def place_legs(legs: Records, frames: Floats, sides: Floats, values: Floats, lines: Floats) -> tuple[float, float]:
    """Fill the values of all legs at a pose; the least singularity margin of all legs, and of those with rows."""
    singularity_margin, margin_of_rows, owner = 1.0, 1.0, 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        frame, q, margin = frames[leg["frame"]], q_redundant_of(legs, k, sides), 1.0
        owner = owner if leg["proximal"] == SHARED else k
        if leg["has_proximal"] == 1:
            margin = solve_proximal(leg, move(frame, vec(leg["platform_end_point"])), sides[k], values[k])
        if leg["orients"] == 1:
            q, margin = orienting_coordinate(leg, legs[k + 1], frame, q)
        margin = min(margin, place_leg(legs, k, owner, q, sides[k], frames, values, lines))
        margin = where(margin > -math.inf, margin, -math.inf)  # no number, where squares overflow, is singular
        singularity_margin = min(singularity_margin, margin)
        margin_of_rows = min(margin_of_rows, margin) if leg["has_rows"] == 1 else margin_of_rows
    return singularity_margin, margin_of_rows


@routine
def put_rows(legs: Records, frames: Floats, values: Floats, lines: Floats, rows: Floats) -> float:
    """Fill the constraints of all legs; the largest of them, infinite if one is not a number."""
    put_leg_rows(legs, frames, values, lines, rows)
    worst = 0.0
    for i in range(rows.shape[0]):
        worst = max(worst, abs(rows[i])) if abs(rows[i]) < math.inf else math.inf
    return worst


@routine
def put_leg_rows(legs: Records, frames: Floats, values: Floats, lines: Floats, rows: Floats) -> None:
    """Fill the constraints of all legs."""
    owner = 0
    for k in range(legs.shape[0]):
        owner = owner if legs[k]["proximal"] == SHARED else k
        leg_rows(legs, k, owner, frames, values, lines, rows)


@routine
def put_slopes(
    legs: Records, frames: Floats, values: Floats, lines: Floats, proximal_slopes: Floats, slopes: Floats
) -> None:
    """Fill the derivatives of the constraints of all legs."""
    owner = 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        owner = owner if leg["proximal"] == SHARED else k
        if leg["has_rows"] == 0:
            continue
        leg_slopes(legs, k, owner, frames, values, lines, proximal_slopes, slopes)
        for row in range(leg["first_row"], leg["first_row"] + leg["n_rows"]):
            put_redundant_slopes(legs, k, values, slopes[row])


@routine
def put_redundant_slopes(legs: Records, k: int, values: Floats, slope: Floats) -> None:
    """Fill the derivatives by the redundant joints that a leg is on, from those by the pose."""
    for j in range(6, slope.shape[0]):
        slope[j] = 0.0
    joint = legs[k]["redundant"]
    while joint >= 0:
        slope[6 + legs[joint]["column"]] += redundant_slope(slope, values[joint])
        joint = legs[joint]["redundant"]
    if legs[k]["inner"] == 1:
        for j in range(6):
            slope[j] = 0.0


@routine
def put_motions(task: Record, pose: Floats, motions: Floats) -> None:
    """Fill the twists (velocity, angular velocity) of the pose coordinates that the task does not set."""
    for i in range(task["unset"]):
        for j in range(6):
            motions[i, j] = 0.0
    n = 0
    for i in range(3):
        if task["axes"][i] == 0:
            motions[n, i] = 1.0
            n += 1
    for i in range(3):
        if task["rotations"] == 0:
            motions[n + i, 3 + i] = 1.0
        elif task["rotations"] == 2:
            motions[n, 3 + i] = pose[i, 2]
    if task["rotations"] == 1:  # turns about axes normal to the mean of both z axes keep the yaw
        axis = (pose[0, 2], pose[1, 2], pose[2, 2] + 1.0)
        across = any_across(scale(1.0 / norm(axis), axis))
        put(motions[n, 3:], across)
        put(motions[n + 1, 3:], cross(axis, across))


@routine
def newton_step(table: Table, scratch: Completion) -> float:
    """Take one least-squares Newton step of the unset coordinates and redundant joints; its length.

    Infinite if the normal equations have no solution.
    """
    task, pose, rows, slopes = table.task[0], scratch.pose, scratch.rows, scratch.slopes
    motions, normal, unset = scratch.motions, scratch.normal, task["unset"]
    n = unset + task["redundant"]
    put_motions(task, pose, motions)
    for i in range(n):
        for j in range(n + 1):
            normal[i, j] = 0.0
    for k in range(rows.shape[0]):
        for i in range(unset):
            slope = 0.0
            for c in range(6):
                slope += slopes[k, c] * motions[i, c]
            normal[n, i] = slope
        for i in range(unset, n):
            normal[n, i] = slopes[k, 6 + i - unset]
        for i in range(n):
            for j in range(i + 1):
                normal[i, j] += normal[n, i] * normal[n, j]
            normal[i, n] -= normal[n, i] * rows[k]
    for i in range(unset, n):
        normal[i, i] = normal[i, i] if normal[i, i] > 0.0 else 1.0  # a redundant joint without constraints stays
    if not solve_spd(normal, n, DAMPING):
        return math.inf
    twist = motions[6]
    for c in range(6):
        twist[c] = 0.0
        for i in range(unset):
            twist[c] += normal[i, n] * motions[i, c]
    step = max(norm(vec(twist[:3])), norm(vec(twist[3:])))
    for i in range(unset, n):
        step = max(step, abs(normal[i, n]))
    share = min(1.0, NEWTON_STEP / step)
    for i in range(3):
        pose[i, 3] += share * twist[i]
    yaw = yaw_of(pose) if task["rotations"] == 1 else 0.0
    turn_pose(pose, scale(share, vec(twist[3:])))
    if task["rotations"] == 1:
        set_yaw(pose, yaw)
    for k in range(table.legs.shape[0] if task["implicit"] == 1 else 0):
        leg = table.legs[k]
        if leg["implicit"] == 1 and leg["mirror_of"] < 0:
            scratch.sides[k] += share * normal[unset + leg["column"], n]
    return share * step


@routine
def deviation(coordinate: Record, values: Floats) -> float:
    """Deviation of a coordinate from home [L or rad], angles taken modulo whole turns into their range."""
    value: float = coordinate["sense"] * values[coordinate["leg"], coordinate["place"]]
    return wrap_into(value, coordinate["lo"], coordinate["hi"]) if coordinate["turns"] == 1 else value


@routine
def excess_of(limited: Records, cones: Records, values: Floats) -> float:
    """Largest excess over any limit [L or rad], at most 0 if all are kept; an exceeded cone counts 2 `KEPT`."""
    worst = -math.inf
    for i in range(limited.shape[0]):
        value = deviation(limited[i], values)
        worst = max(worst, max(limited[i]["lo"] - value, value - limited[i]["hi"]))
    for i in range(cones.shape[0]):
        cosine = cone_cosine(cones[i], values)
        if not cosine >= cones[i]["least_cosine"]:
            worst = max(worst, 2.0 * KEPT)
    return worst


@routine
def cone_cosine(cone: Record, values: Floats) -> float:
    """Cosine of the angle between a line and the axis of its cone."""
    leg_values, place = values[cone["leg"]], cone["place"]
    return dot(vec(cone["axis"]), (leg_values[place], leg_values[place + 1], leg_values[place + 2]))


@flattened
def answer(
    machine: int,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    status: Ints,
    poses: Floats,
    actuators: Floats,
    measures: Floats,
) -> int:
    """Solve targets (n, 4, 4) [length] by legs on given sides, within all limits; the others are PENDING.

    Parameters
    ----------
    machine : address of the kernel table.
    begins : poses that targets are completed from, (n or 1, 4, 4) [length].
    sides : side of each leg, (n or 1, legs); the coordinate of a redundant joint without sides [L or rad]. With
        implicit joints there is a row for each target, and solved rows receive the solution's.

    Returns
    -------
    The number of PENDING rows.
    """
    table, total = open_table(machine), 0
    scratch = new_completion(table)
    for row in range(targets.shape[0]):
        begin = begins[row if begins.shape[0] > 1 else 0]
        side = sides[row if sides.shape[0] > 1 else 0]
        status[row] = answer_on_sides(
            table, targets[row], begin, side, scratch, poses[row], actuators[row], measures[row]
        )
        total += status[row]
    return total // PENDING


@routine
def answer_on_sides(
    table: Table,
    target: Floats,
    begin: Floats,
    sides: Floats,
    scratch: Completion,
    pose: Floats,
    actuators: Floats,
    measures: Floats,
) -> int:
    """Solve a target as `answer` does; its status, and outputs where it is REACHED."""
    if not (read_target(target, begin, table.task[0], scratch.pose) and complete_pose(table, sides, scratch)):
        return PENDING
    status = write_answer(table, scratch, pose, actuators, measures)
    if table.task[0]["implicit"] == 1 and status == REACHED:
        copy_row(scratch.sides, sides)
    return status


@routine
def write_answer(table: Table, scratch: Completion, pose: Floats, actuators: Floats, measures: Floats) -> int:
    """Write a completed pose and its measures if all limits are kept; its status."""
    excess, task = excess_of(table.limited, table.cones, scratch.values), table.task[0]
    if not excess <= KEPT:
        return PENDING
    for i in range(3):
        pose[i, 3] = scratch.pose[i, 3] * task["length"]
        pose[3, i] = 0.0
        for j in range(3):
            pose[i, j] = scratch.pose[i, j]
    pose[3, 3] = 1.0
    for i in range(table.driven.shape[0]):
        driven = table.driven[i]
        actuators[driven["column"]] = driven["home"] + deviation(driven, scratch.values) * driven["unit"]
    measures[RESIDUAL] = largest_entry(scratch.rows) * task["length"]
    measures[LIMIT_EXCESS] = max(excess, 0.0)
    return REACHED


@routine
def largest_entry(rows: Floats) -> float:
    """The largest absolute value of the rows."""
    worst = 0.0
    for i in range(rows.shape[0]):
        worst = max(worst, abs(rows[i]))
    return worst


@routine
def complete_pose(table: Table, sides: Floats, scratch: Completion) -> bool:
    """Move the unset coordinates of a pose until all legs close; True if they do, none of them near a dead point.

    During the iteration, legs without constraint rows may be beyond a dead point.
    """
    legs, task, frames, values, lines = table.legs, table.task[0], scratch.frames, scratch.values, scratch.lines
    travelled, previous, is_set = 0.0, math.inf, task["unset"] == 0
    copy_row(sides, scratch.sides)
    for _ in range(MOST_STEPS_IMPLICIT if task["implicit"] == 1 else MOST_STEPS):
        set_frames(scratch.pose, task, frames)
        singularity_margin, margin_of_rows = place_legs(legs, frames, scratch.sides, values, lines)
        if not margin_of_rows > LEAST_MARGIN * LEAST_MARGIN:
            return False
        residual = put_rows(legs, frames, values, lines, scratch.rows)
        if residual <= CLOSED or (
            is_set and residual <= NEARLY_CLOSED and (task["implicit"] == 0 or residual > 0.5 * previous)
        ):
            return singularity_margin > LEAST_MARGIN * LEAST_MARGIN
        if is_set and task["implicit"] == 0:
            return False
        put_slopes(legs, frames, values, lines, scratch.proximal_slopes, scratch.slopes)
        travelled += newton_step(table, scratch)
        if not travelled <= task["farthest"]:
            return False
        previous = residual
    return False
