"""Poses answered by legs in closed form: completed where the task leaves something open, then every limit measured."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Ints, Record, Records
from .._jit import allocator, kernel, routine
from ..linear import solve_spd
from ..rotations import yaw_of
from ..rows import LIMIT_EXCESS, PENDING, REACHED, RESIDUAL
from ..vectors import copy_row, cross, dot, norm, put, scale, vec, wrap_into
from .endings import LEAST_MARGIN
from .frames import new_frames, orienting_coordinate, place_redundant, q_redundant_of, set_frames, slope_by_redundant
from .pivots import any_across, pivot_rows, pivot_slopes, place_pivot
from .poses import bring_yaw, load, turn_pose
from .records import N_VALUES, PIVOT, REDUNDANT, ROD, SHARED, Table
from .rods import place_rod, rod_rows, rod_slopes
from .table import open_table

# Largest constraint of a completed pose, and of one that the task sets whole [L or rad]: the promise is 1e-9, and the
# gap of a loop may be some times the constraint's.
CLOSED, CLOSE = 1e-13, 1e-10
# Newton steps that complete a pose: they take one to five; with arms that follow, more where these are nearly singular.
MOST_STEPS, MOST_STEPS_IMPLICIT = 8, 16
# What is added to the squares of unknowns, as a share of the largest: what constraints leave open stays where it is.
LOOSE = 1e-12
# Longest step [L or rad]: beyond, derivatives tell little.
LONGEST_STEP = 0.5
# Excess up to which a limit counts as kept [L or rad].
KEPT = 1e-9


class Completion(NamedTuple):
    """Scratch memory of one thread."""

    pose: Floats  # (4, 4) [L]
    sides: Floats  # (legs,): which of its two solutions each leg takes; of an arm that has none, its coordinate
    frames: Floats  # (n, 7, 4): see `frames`
    values: Floats  # (legs, N_VALUES)
    lines: Floats  # (legs, 3): of a rod, from foot to head
    proximal_slopes: Floats  # (legs, 6): derivatives of carriers' coordinates
    rows: Floats  # (m,): the constraints
    slopes: Floats  # (m, 6 + arms): their derivatives by the pose, then by arms
    motions: Floats  # (7, 6)
    normal: Floats  # (7 + arms, 8 + arms)


@allocator
def new_completion(table: Table) -> Completion:
    """Scratch memory of one thread."""
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
    singularity_margin, margin_of_rows, main = 1.0, 1.0, 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        frame, found = frames[leg["frame"]], 1.0
        main = main if leg["proximal"] == SHARED else k
        if leg["kind"] == PIVOT:
            found = place_pivot(leg, frame, sides[k], values[k])
        elif leg["kind"] == REDUNDANT:
            q = q_redundant_of(legs, k, sides)
            if leg["orients"] == 1:
                q, found = orienting_coordinate(leg, legs[k + 1], frame, q)
            place_redundant(leg, q, frames, values[k])
        else:
            found = place_rod(leg, legs[main], frame, sides[k], values[main], values[k], lines[k])
        singularity_margin = min(singularity_margin, found)
        margin_of_rows = min(margin_of_rows, found) if leg["has_rows"] == 1 else margin_of_rows
    return singularity_margin, margin_of_rows


@routine
def put_rows(legs: Records, frames: Floats, values: Floats, lines: Floats, rows: Floats) -> float:
    """Fill the constraints of all legs; the largest of them, infinite where one is not a number."""
    main = 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        main = main if leg["proximal"] == SHARED else k
        if leg["kind"] == PIVOT:
            pivot_rows(leg, frames[leg["frame"]], rows)
        elif leg["kind"] == ROD:
            rod_rows(leg, legs[main], frames[leg["frame"]], values[main], values[k], lines[k], rows)
    worst = 0.0
    for i in range(rows.shape[0]):
        worst = max(worst, abs(rows[i])) if abs(rows[i]) < math.inf else math.inf
    return worst


@routine
def put_slopes(
    legs: Records, frames: Floats, values: Floats, lines: Floats, proximal_slopes: Floats, slopes: Floats
) -> None:
    """Fill the derivatives of the constraints of all legs."""
    main = 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        main = main if leg["proximal"] == SHARED else k
        if leg["has_rows"] == 0:
            continue
        frame = frames[leg["frame"]]
        if leg["kind"] == PIVOT:
            pivot_slopes(leg, frame, slopes)
        elif leg["kind"] == ROD:
            rod_slopes(leg, legs[main], frame, values[main], values[k], lines[k], proximal_slopes[main], slopes)
        for row in range(leg["first_row"], end_of_rows(legs, k, slopes.shape[0])):
            put_redundant_slopes(legs, k, values, slopes[row])


@routine
def put_redundant_slopes(legs: Records, k: int, values: Floats, slope: Floats) -> None:
    """Derivatives by the arms that a leg is on, from those by the pose."""
    for j in range(6, slope.shape[0]):
        slope[j] = 0.0
    arm = legs[k]["redundant"]
    while arm >= 0:
        slope[6 + legs[arm]["column"]] += slope_by_redundant(slope, values[arm])
        arm = legs[arm]["redundant"]
    if legs[k]["inner"] == 1:
        for j in range(6):
            slope[j] = 0.0


@routine
def end_of_rows(legs: Records, k: int, rows: int) -> int:
    """The place after a leg's last constraint, of so many in all."""
    return int(legs[k + 1]["first_row"]) if k + 1 < legs.shape[0] else rows


@routine
def put_motions(task: Record, pose: Floats, motions: Floats) -> None:
    """Fill the twists (velocity, angular velocity) of the coordinates of the pose that the task does not set."""
    for i in range(task["unset"]):
        for j in range(6):
            motions[i, j] = 0.0
    place = 0
    for i in range(3):
        if task["axes"][i] == 0:
            motions[place, i] = 1.0
            place += 1
    for i in range(3):
        if task["rotations"] == 0:
            motions[place + i, 3 + i] = 1.0
        elif task["rotations"] == 2:
            motions[place, 3 + i] = pose[i, 2]
    if task["rotations"] == 1:  # about axes across the mean of both z axes the platform turns without yaw
        axis = (pose[0, 2], pose[1, 2], pose[2, 2] + 1.0)
        first = any_across(scale(1.0 / norm(axis), axis))
        put(motions[place, 3:], first)
        put(motions[place + 1, 3:], cross(axis, first))


@routine
def newton_step(table: Table, scratch: Completion) -> float:
    """Move what is not set, and arms that bear, so that the constraints vanish, by least squares; how far, infinite
    where it cannot be."""
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
        normal[i, i] = normal[i, i] if normal[i, i] > 0.0 else 1.0  # an arm without constraints stays
    if not solve_spd(normal, n, LOOSE):
        return math.inf
    twist = motions[6]
    for c in range(6):
        twist[c] = 0.0
        for i in range(unset):
            twist[c] += normal[i, n] * motions[i, c]
    step = max(norm(vec(twist[:3])), norm(vec(twist[3:])))
    for i in range(unset, n):
        step = max(step, abs(normal[i, n]))
    share = min(1.0, LONGEST_STEP / step)
    for i in range(3):
        pose[i, 3] += share * twist[i]
    yaw = yaw_of(pose) if task["rotations"] == 1 else 0.0
    turn_pose(pose, scale(share, vec(twist[3:])))
    if task["rotations"] == 1:
        bring_yaw(pose, yaw)
    for k in range(table.legs.shape[0] if task["implicit"] == 1 else 0):
        leg = table.legs[k]
        if leg["kind"] == REDUNDANT and leg["orients"] == 0 and leg["mirror_of"] < 0:
            scratch.sides[k] += share * normal[unset + leg["column"], n]
    return share * step


@routine
def deviation(coordinate: Record, values: Floats) -> float:
    """A coordinate's deviation from home [L or rad], angles counted into their range."""
    value: float = coordinate["sense"] * values[coordinate["leg"], coordinate["place"]]
    return wrap_into(value, coordinate["lo"], coordinate["hi"]) if coordinate["turns"] == 1 else value


@routine
def excess_of(limited: Records, cones: Records, values: Floats) -> float:
    """Largest excess over any limit [L or rad], negative or zero where all are kept, and at least some above `KEPT`."""
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
    own, place = values[cone["leg"]], cone["place"]
    return dot(vec(cone["axis"]), (own[place], own[place + 1], own[place + 2]))


@kernel
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
    """Answer targets (n, 4, 4) [length] that legs reach on given sides within all limits; the others are PENDING.

    Parameters
    ----------
    machine : see `open_table`.
    begins : poses that targets are completed from, (n or 1, 4, 4) [length].
    sides : which of its two solutions each leg takes, (n or 1, legs); of an arm that takes none, its coordinate [L or
        rad]. Where arms are led there is a row for each target, and where they end is written into those reached.

    Returns
    -------
    How many are PENDING.
    """
    table, left = open_table(machine), 0
    scratch = new_completion(table)
    for row in range(targets.shape[0]):
        status[row] = PENDING
        begin = begins[row if begins.shape[0] > 1 else 0]
        side = sides[row if sides.shape[0] > 1 else 0]
        if load(targets[row], begin, table.task[0], scratch.pose) and complete(table, side, scratch):
            status[row] = write_answer(table, scratch, poses[row], actuators[row], measures[row])
            if table.task[0]["implicit"] == 1 and status[row] == REACHED:
                copy_row(scratch.sides, side)
        left += status[row]
    return left // PENDING


@routine
def write_answer(table: Table, scratch: Completion, pose: Floats, actuators: Floats, measures: Floats) -> int:
    """Write a completed pose and what is measured of it, if all limits are kept; its status."""
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
    measures[RESIDUAL] = worst_of(scratch.rows) * task["length"]
    measures[LIMIT_EXCESS] = max(excess, 0.0)
    return REACHED


@routine
def worst_of(rows: Floats) -> float:
    worst = 0.0
    for i in range(rows.shape[0]):
        worst = max(worst, abs(rows[i]))
    return worst


@routine
def complete(table: Table, sides: Floats, scratch: Completion) -> bool:
    """Move what is not set of a pose until all legs close; whether they do, none of them near a dead point.

    On the way legs that bear no constraint may be beyond one.
    """
    legs, task, frames, values, lines = table.legs, table.task[0], scratch.frames, scratch.values, scratch.lines
    gone, before, is_set = 0.0, math.inf, task["unset"] == 0
    copy_row(sides, scratch.sides)
    for _ in range(MOST_STEPS_IMPLICIT if task["implicit"] == 1 else MOST_STEPS):
        set_frames(scratch.pose, task, frames)
        singularity_margin, margin_of_rows = place_legs(legs, frames, scratch.sides, values, lines)
        if not margin_of_rows > LEAST_MARGIN * LEAST_MARGIN:
            return False
        worst = put_rows(legs, frames, values, lines, scratch.rows)
        if worst <= CLOSED or (is_set and worst <= CLOSE and (task["implicit"] == 0 or worst > 0.5 * before)):
            return singularity_margin > LEAST_MARGIN * LEAST_MARGIN
        if is_set and task["implicit"] == 0:
            return False
        put_slopes(legs, frames, values, lines, scratch.proximal_slopes, scratch.slopes)
        gone += newton_step(table, scratch)
        if not gone <= task["farthest"]:
            return False
        before = worst
    return False
