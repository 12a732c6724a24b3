"""Poses answered by legs in closed form: completed where the task leaves something open, then every limit measured."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._jit import allocator, kernel, routine
from ..linear import solve_spd
from ..vectors import Vec, cross, dot, norm, scale, vec, wrap_into
from .endings import SURE, turned
from .pivots import pivot_rows, pivot_slopes, place_pivot
from .records import ARM, N_VALUES, PIVOT, ROD, SHARED, Floats, Record, Records, Table
from .rods import place_arm, place_rod, rod_rows, rod_slopes
from .table import open_table

# Status of a row; REACHED is the public one's number.
REACHED, PENDING = 0, 9
# Largest constraint of a completed pose, and of one that the task sets whole [L or rad]: the promise is 1e-9, and the
# gap of a loop may be some times the constraint's.
CLOSED, CLOSE = 1e-13, 1e-10
# Newton steps that complete a pose: they take one to five.
MOST_STEPS = 8
# Longest step [L or rad]: beyond, derivatives tell little.
LONGEST_STEP = 0.5
# Deviation from an orthonormal matrix up to which a target is a pose, and from which on it is not made one.
NOT_A_ROTATION, ROUNDED = 1e-6, 1e-14
# Excess up to which a limit counts as kept [L or rad].
KEPT = 1e-9


class Completion(NamedTuple):
    """Scratch memory of one thread."""

    pose: Floats  # (4, 4) [L]
    frames: Floats  # (2, 4, 4): see `set_frames`
    values: Floats  # (legs, N_VALUES)
    lines: Floats  # (legs, 3): of a rod, from foot to head
    follow: Floats  # (legs, 6): derivatives of carriers' coordinates
    rows: Floats  # (m,): the constraints
    slopes: Floats  # (m, 6): their derivatives
    motions: Floats  # (7, 6)
    normal: Floats  # (7, 8)


@allocator
def new_completion(table: Table) -> Completion:
    """Scratch memory of one thread."""
    legs, m = table.legs.shape[0], table.task[0]["rows"]
    return Completion(
        np.zeros((4, 4)),
        np.zeros((2, 4, 4)),
        np.zeros((legs, N_VALUES)),
        np.zeros((legs, 3)),
        np.zeros((legs, 6)),
        np.zeros(m),
        np.zeros((m, 6)),
        np.zeros((7, 6)),
        np.zeros((7, 8)),
    )


@routine
def set_frames(pose: Floats, task: Record, frames: Floats) -> None:
    """The platform's displacement as seen from the base, and the base's as seen from the platform.

    Rows 0 to 2 of each map head points; row 3 is the point about which the platform turns.
    """
    p, reference = (pose[0, 3], pose[1, 3], pose[2, 3]), vec(task["reference"])
    for i in range(3):
        for j in range(3):
            frames[0, i, j] = pose[i, j]
            frames[1, i, j] = pose[j, i]
        frames[0, i, 3] = frames[0, 3, i] = p[i]
        frames[1, i, 3] = reference[i] - (pose[0, i] * p[0] + pose[1, i] * p[1] + pose[2, i] * p[2])
        frames[1, 3, i] = reference[i]


@routine
def place_legs(legs: Records, frames: Floats, sides: Floats, values: Floats, lines: Floats) -> tuple[float, float]:
    """Fill the values of all legs at a pose; how sure the least sure of all are, see `SURE`, and of those that bear."""
    sure, bearing, main = 1.0, 1.0, 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        frame, found = frames[leg["reversed"]], 1.0
        main = main if leg["carrier"] == SHARED else k
        if leg["kind"] == PIVOT:
            found = place_pivot(leg, frame, sides[k], values[k])
        elif leg["kind"] == ARM:
            place_arm(leg, sides[k], values[k - leg["on_arm"]], values[k])
        else:
            found = place_rod(leg, legs[main], frame, sides[k], values[main], values[k], lines[k])
        sure = min(sure, found)
        bearing = min(bearing, found) if leg["bears"] == 1 else bearing
    return sure, bearing


@routine
def put_rows(legs: Records, frames: Floats, values: Floats, lines: Floats, rows: Floats) -> float:
    """Fill the constraints of all legs; the largest of them, infinite where one is not a number."""
    main = 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        main = main if leg["carrier"] == SHARED else k
        if leg["kind"] == PIVOT:
            pivot_rows(leg, frames[leg["reversed"]], rows)
        elif leg["kind"] == ROD:
            rod_rows(leg, legs[main], frames[leg["reversed"]], values[main], values[k], lines[k], rows)
    worst = 0.0
    for i in range(rows.shape[0]):
        worst = max(worst, abs(rows[i])) if abs(rows[i]) < math.inf else math.inf
    return worst


@routine
def put_slopes(legs: Records, frames: Floats, values: Floats, lines: Floats, follow: Floats, slopes: Floats) -> None:
    """Fill the derivatives of the constraints of all legs."""
    main = 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        main = main if leg["carrier"] == SHARED else k
        if leg["bears"] == 0:
            continue
        frame = frames[leg["reversed"]]
        if leg["kind"] == PIVOT:
            pivot_slopes(leg, frame, slopes)
        elif leg["kind"] == ROD:
            rod_slopes(leg, legs[main], frame, values[main], values[k], lines[k], follow[main], slopes)


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


@routine
def newton_step(task: Record, pose: Floats, rows: Floats, slopes: Floats, motions: Floats, normal: Floats) -> float:
    """Move what is not set so that the constraints vanish, by least squares; how far, infinite where it cannot be."""
    n = task["unset"]
    put_motions(task, pose, motions)
    for i in range(n):
        for j in range(n + 1):
            normal[i, j] = 0.0
    for k in range(rows.shape[0]):
        for i in range(n):
            slope = 0.0
            for c in range(6):
                slope += slopes[k, c] * motions[i, c]
            normal[n, i] = slope
            for j in range(i + 1):
                normal[i, j] += slope * normal[n, j]
            normal[i, n] -= slope * rows[k]
    if not solve_spd(normal, n, 0.0):
        return math.inf
    twist = motions[6]
    for c in range(6):
        twist[c] = 0.0
        for i in range(n):
            twist[c] += normal[i, n] * motions[i, c]
    step = max(norm(vec(twist[:3])), norm(vec(twist[3:])))
    share = min(1.0, LONGEST_STEP / step)
    for i in range(3):
        pose[i, 3] += share * twist[i]
    turn_pose(pose, scale(share, vec(twist[3:])))
    return share * step


@routine
def turn_pose(pose: Floats, spin: Vec) -> None:
    """Turn the rotation of a pose by a rotation vector, in base coordinates."""
    angle = norm(spin)
    if angle == 0.0:
        return
    axis = scale(1.0 / angle, spin)
    for j in range(3):
        column = turned((pose[0, j], pose[1, j], pose[2, j]), axis, math.cos(angle), math.sin(angle))
        for i in range(3):
            pose[i, j] = column[i]


@routine
def load(target: Floats, begin: Floats, task: Record, pose: Floats) -> bool:
    """A target [length] as a pose [L], what it does not set as in another; False where it is no pose, or turned over.

    Of the rotation the nearest is taken: two steps of R <- R (3 - R^T R) / 2. Where the direction of the z axis is
    all that is set of it, it is brought there by the shortest turn.
    """
    if not is_pose(target):
        return False
    for i in range(3):
        pose[i, 3] = (target[i, 3] if task["axes"][i] == 1 else begin[i, 3]) / task["length"]
        for j in range(3):
            pose[i, j] = target[i, j] if task["rotations"] == 3 else begin[i, j]
    if task["rotations"] == 3:
        make_exact(pose)
    elif task["rotations"] == 2:
        return lean_to(target, 1.0, pose)
    return True


@routine
def lean_to(target: Floats, share: float, pose: Floats) -> bool:
    """Bring the z axis of a pose to a target's by the shortest turn, or a share of the way; False where turned over."""
    now, wanted = (pose[0, 2], pose[1, 2], pose[2, 2]), (target[0, 2], target[1, 2], target[2, 2])
    wanted = scale(1.0 / norm(wanted), wanted)
    across = cross(now, wanted)
    sine, cosine = norm(across), dot(now, wanted)
    if sine > 0.0:
        turn_pose(pose, scale(share * math.atan2(sine, cosine) / sine, across))
    return cosine > SURE - 1.0


@routine
def is_pose(target: Floats) -> bool:
    worst, finite = abs(target[3, 3] - 1.0), 0.0
    for i in range(3):
        worst += abs(target[3, i])
        finite += target[i, 3]
        for j in range(i, 3):
            worst += abs(gram(target, i, j))
    x, y, z = column(target, 0), column(target, 1), column(target, 2)
    return worst <= NOT_A_ROTATION and dot(cross(x, y), z) > 0.0 and abs(finite) < math.inf


@routine
def column(T: Floats, i: int) -> Vec:
    return T[0, i], T[1, i], T[2, i]


@routine
def gram(T: Floats, i: int, j: int) -> float:
    """An entry of R^T R - 1."""
    return T[0, i] * T[0, j] + T[1, i] * T[1, j] + T[2, i] * T[2, j] - (1.0 if i == j else 0.0)


@routine
def make_exact(pose: Floats) -> None:
    """Make the rotation of a pose the nearest that is orthonormal."""
    for _ in range(2):
        xx, yy, zz = gram(pose, 0, 0), gram(pose, 1, 1), gram(pose, 2, 2)
        xy, yz, zx = gram(pose, 0, 1), gram(pose, 1, 2), gram(pose, 2, 0)
        if abs(xx) + abs(yy) + abs(zz) + abs(xy) + abs(yz) + abs(zx) <= ROUNDED:
            return
        for i in range(3):
            row = vec(pose[i])
            pose[i, 0] -= 0.5 * dot(row, (xx, xy, zx))
            pose[i, 1] -= 0.5 * dot(row, (xy, yy, yz))
            pose[i, 2] -= 0.5 * dot(row, (zx, yz, zz))


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
    status: NDArray[np.int64],
    poses: Floats,
    actuators: Floats,
    measures: Floats,
) -> int:
    """Answer targets (n, 4, 4) [length] that legs reach on given sides within all limits; the others are PENDING.

    Parameters
    ----------
    machine : see `open_table`.
    begins : poses that targets are completed from, (n or 1, 4, 4) [length].
    sides : which of its two solutions each leg takes, (n or 1, legs); of an arm, its coordinate [L or rad].

    Returns
    -------
    How many are PENDING.
    """
    table, left = open_table(machine), 0
    work = new_completion(table)
    for row in range(targets.shape[0]):
        status[row] = PENDING
        begin = begins[row if begins.shape[0] > 1 else 0]
        side = sides[row if sides.shape[0] > 1 else 0]
        if load(targets[row], begin, table.task[0], work.pose) and complete(table, side, work):
            status[row] = write_answer(table, work, poses[row], actuators[row], measures[row])
        left += status[row]
    return left // PENDING


@routine
def write_answer(table: Table, work: Completion, pose: Floats, actuators: Floats, measures: Floats) -> int:
    """Write a completed pose and what is measured of it, if all limits are kept; its status."""
    excess, task = excess_of(table.limited, table.cones, work.values), table.task[0]
    if not excess <= KEPT:
        return PENDING
    for i in range(3):
        pose[i, 3] = work.pose[i, 3] * task["length"]
        pose[3, i] = 0.0
        for j in range(3):
            pose[i, j] = work.pose[i, j]
    pose[3, 3] = 1.0
    for i in range(table.driven.shape[0]):
        driven = table.driven[i]
        actuators[driven["column"]] = driven["home"] + deviation(driven, work.values) * driven["unit"]
    measures[2] = worst_of(work.rows) * task["length"]
    measures[3] = max(excess, 0.0)
    return REACHED


@routine
def worst_of(rows: Floats) -> float:
    worst = 0.0
    for i in range(rows.shape[0]):
        worst = max(worst, abs(rows[i]))
    return worst


@routine
def complete(table: Table, sides: Floats, work: Completion) -> bool:
    """Move what is not set of a pose until all legs close; whether they do, none of them near a dead point.

    On the way legs that bear no constraint may be beyond one.
    """
    legs, task, frames, values, lines = table.legs, table.task[0], work.frames, work.values, work.lines
    gone, enough = 0.0, CLOSED if task["unset"] > 0 else CLOSE
    for _ in range(MOST_STEPS):
        set_frames(work.pose, task, frames)
        sure, bearing = place_legs(legs, frames, sides, values, lines)
        if not bearing > SURE * SURE:
            return False
        if put_rows(legs, frames, values, lines, work.rows) <= enough:
            return sure > SURE * SURE
        if task["unset"] == 0:
            return False
        put_slopes(legs, frames, values, lines, work.follow, work.slopes)
        gone += newton_step(task, work.pose, work.rows, work.slopes, work.motions, work.normal)
        if not gone <= task["farthest"]:
            return False
    return False


@routine
def load_pose(pose: Floats, length: float, to: Floats) -> None:
    """A pose [length], as one [L]."""
    for i in range(3):
        to[i, 3] = pose[i, 3] / length
        for j in range(3):
            to[i, j] = pose[i, j]


@kernel
def read_coordinates(machine: int, poses: Floats, sides: Floats, found: Floats) -> None:
    """Fill deviations from home [length or rad], `found` (n, columns), of the coordinates that legs tell at poses."""
    table = open_table(machine)
    work, known = new_completion(table), table.known
    for row in range(poses.shape[0]):
        load_pose(poses[row], table.task[0]["length"], work.pose)
        set_frames(work.pose, table.task[0], work.frames)
        place_legs(table.legs, work.frames, sides[row if sides.shape[0] > 1 else 0], work.values, work.lines)
        for i in range(known.shape[0]):
            found[row, known[i]["column"]] = deviation(known[i], work.values) * known[i]["unit"]


@kernel
def measure_rows(machine: int, poses: Floats, sides: Floats, rows: Floats, slopes: Floats) -> None:
    """Fill the constraints (n, rows) of all legs at poses [length], and their derivatives (n, rows, 6) [L, rad]."""
    table = open_table(machine)
    work, legs = new_completion(table), table.legs
    for row in range(poses.shape[0]):
        load_pose(poses[row], table.task[0]["length"], work.pose)
        set_frames(work.pose, table.task[0], work.frames)
        place_legs(legs, work.frames, sides[row if sides.shape[0] > 1 else 0], work.values, work.lines)
        put_rows(legs, work.frames, work.values, work.lines, rows[row])
        put_slopes(legs, work.frames, work.values, work.lines, work.follow, slopes[row])
