"""Cells of poses: boxes of up to six parameters, each with the pose at its centre and what the pose does around it.

With s the parameters of a cell, each in [-1, 1], a point b of the platform moves from p + R b to

    p + R b + sum s_i (u_i + w_i x R b) + e,    |e| <= curvature |b|,

and the platform turns by at most `angle`. Parameters of a box are the position and a rotation vector r, R = exp(r):
with J the left Jacobian of exp, w_i = h_i J e_i. Along a straight line of rotation vectors, of speed |s|, the angular
velocity is at most |s| and changes by at most |r| |s|^2 / 6, so that curvature = (1 + |r| / 6) angle^2 / 2 (decision
38). A tilt is R = exp(x, y, 0) Rz(yaw). Between two poses of a track the position is linear and the rotation a
geodesic. Coordinates of joints in series from the base to the platform turn and slide it one after the other.

Coordinates that follow from the legs make a cell oblique (`put_oblique`): they are linear in the others, but for an
error, which is one more parameter of the cell.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from .._jit import routine
from ..legs.endings import turned
from ..vectors import Vec, add, along, cross, dot, move, norm, put, scale, sub, turn, vec

# Parametrisations of poses; tilts are in a cone, or in a box.
ROTATION_VECTOR, TILT, STEPS, JOINTS, TILT_BOX = 0, 1, 2, 3, 4
# Shapes of positions: a box, a cylinder along z, a ball.
BOX, CYLINDER, BALL = 0, 1, 2
# LimitRows of a `PoseCell.motions`: velocities and angular velocities by each parameter.
N_PARAMETERS = 6
# Sizes of a cell: largest shift, largest chord of a unit vector, curvature, largest angle, and how far the reference
# point is from where its velocities lead, at most.
SHIFT, CHORD, CURVATURE, ANGLE, BEND = 0, 1, 2, 3, 4
# Columns of a joint in series: 1 if it slides, its axis and a point of it at home. The last row's point is the
# reference point; that of a slide is the next one's.
SLIDES, AXIS, POINT, N_JOINT_COLUMNS = 0, 1, 4, 7
# Share of a number's magnitude, in terms of a length 1, that the roundings of a form stay below: some 60 operations.
ROUNDING = 2.0**-44


class CellParameters(NamedTuple):
    """The parameters of a region: what `shape_cell` reads."""

    kinds: Ints  # (5,): parametrisation, shape of positions, number of parameters, question, 1: without singularities
    middle: Floats  # (6,)
    half: Floats  # (6,)
    steps: Floats  # (n, 12): of a track: position, row-wise rotation [12 numbers] at the beginning of each step
    moves: Floats  # (n, 6): of a track: displacement and rotation vector of each step
    uncertain: Floats  # (1,): radius of the ball that each joint's point may be in [L]
    joints: Floats  # (k + 1, 7): joints in series, of JOINTS
    ranges: Ints  # (ranges,): which of these joints a limited coordinate is, or -1; empty without any
    implicit: Ints  # (6,): 1 of coordinates that follow from the legs
    signs: Floats  # (2,): of the determinants of the constraints, and of the whole machine, at home; 0: not asked for


class PoseCell(NamedTuple):
    """A cell of poses."""

    pose: Floats  # (4, 4)
    motions: Floats  # (6, 6)
    sizes: Floats  # (5,)
    box: Floats  # (12,): middle and half sizes of the parameters that it was made of


def new_cell() -> PoseCell:
    """Allocate a cell."""
    return PoseCell(np.zeros((4, 4)), np.zeros((N_PARAMETERS, 6)), np.zeros(5), np.zeros(2 * N_PARAMETERS))


@routine
def put_exponential(r: Vec, R: Floats) -> None:
    """R = exp(r), by Rodrigues' formula with factors that are exact near zero."""
    square = dot(r, r)
    angle = math.sqrt(square)
    half = 0.5 * angle
    a = math.sin(angle) / angle if angle > 1e-8 else 1.0
    b = math.sin(half) / half if half > 1e-8 else 1.0
    b = 0.5 * b * b
    x, y, z = r
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y
    R[1, 0], R[1, 1], R[1, 2] = b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x
    R[2, 0], R[2, 1], R[2, 2] = b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)


@routine
def left_jacobian(r: Vec, v: Vec) -> Vec:
    """J(r) v: the angular velocity of exp(r) when r moves with velocity v."""
    square = dot(r, r)
    angle = math.sqrt(square)
    if angle < 1e-3:  # the next terms are below 1e-15
        b, c = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        half = math.sin(0.5 * angle)
        b, c = 2.0 * half * half / square, (angle - math.sin(angle)) / (square * angle)
    across = cross(r, v)
    return along(along(v, b, across), c, cross(r, across))


@routine
def put_cell(region: CellParameters, box: Floats, cell: PoseCell) -> None:
    """Fill a cell from a box: the middle and the half sizes of its parameters.

    Of a track, box[1] is the number of the step and box[0] the share of the way along it.
    """
    middle, half = box[:N_PARAMETERS], box[N_PARAMETERS:]
    pose, motions, sizes, kind = cell.pose, cell.motions, cell.sizes, region.kinds[0]
    sizes[BEND] = 0.0
    for i in range(2 * N_PARAMETERS):
        cell.box[i] = box[i]
    if kind == STEPS:
        put_step(region, middle, half, cell)
        return
    if kind == JOINTS:
        put_joints(region.joints, cell)
        return
    for i in range(3):
        pose[i, 3] = middle[i]
        for j in range(6):
            motions[i, j] = 0.0
        motions[i, i] = half[i]
        put(motions[3 + i, :3], (0.0, 0.0, 0.0))
    r, spread = vec(middle[3:]), vec(half[3:])
    angle = norm(spread)
    if kind in (TILT, TILT_BOX):
        yaw, r = r[2], (r[0], r[1], 0.0)
        put_exponential(r, pose)
        put(motions[5, 3:], scale(spread[2], (pose[0, 2], pose[1, 2], pose[2, 2])))
        cosine, sine = math.cos(yaw), math.sin(yaw)
        for i in range(3):
            a, b = pose[i, 0], pose[i, 1]
            pose[i, 0], pose[i, 1] = a * cosine + b * sine, b * cosine - a * sine
        angle = math.hypot(spread[0], spread[1]) + spread[2]
    else:
        put_exponential(r, pose)
        put(motions[5, 3:], scale(spread[2], left_jacobian(r, (0.0, 0.0, 1.0))))
    put(motions[3, 3:], scale(spread[0], left_jacobian(r, (1.0, 0.0, 0.0))))
    put(motions[4, 3:], scale(spread[1], left_jacobian(r, (0.0, 1.0, 0.0))))
    sizes[SHIFT] = norm(vec(half))
    put_angle(angle, 1.0 + (norm(r) + angle) / 6.0, cell)


@routine
def put_step(region: CellParameters, middle: Floats, half: Floats, cell: PoseCell) -> None:
    """Fill a cell of a track: a part of one step."""
    step = int(middle[1])
    begin, move = region.steps[step], region.moves[step]
    turned = scale(middle[0], vec(move[3:]))
    put_exponential(turned, cell.motions)  # scratch: its rows are filled below
    R = cell.motions
    for i in range(3):
        cell.pose[i, 3] = begin[i] + middle[0] * move[i]
        for j in range(3):
            cell.pose[i, j] = R[i, 0] * begin[3 + j] + R[i, 1] * begin[6 + j] + R[i, 2] * begin[9 + j]
    for i in range(6):
        cell.motions[0, i] = half[0] * move[i]
    cell.sizes[SHIFT] = half[0] * norm(vec(move))
    put_angle(half[0] * norm(vec(move[3:])), 1.0, cell)


@routine
def put_joints(joints: Floats, cell: PoseCell) -> None:
    """Fill a cell of the coordinates of joints in series: of turns by q_i about w_i through c_i, and slides along w_i.

    A point x of the platform has dx/dq_i = w_i x (x - c_i), and d2x/dq_i dq_j = w_i x (dx/dq_j) for i <= j; both are
    zero for i a slide, but for dx/dq_i = w_i. So its remainder is at most half the sum of h_i h_j |x - c_j|, j the
    outer one, where |x - c_j| is at most the way to x along the points of the joints. About a single point two turns
    bend it less: by w' and w x w, with |w'| = h_1 h_2 |w_1 x w_2| and |w|^2 = |h_1 w_1 + h_2 w_2|^2.
    """
    pose, motions, sizes, middle, half = (
        cell.pose,
        cell.motions,
        cell.sizes,
        cell.box[:N_PARAMETERS],
        cell.box[N_PARAMETERS:],
    )
    n = joints.shape[0] - 1
    for i in range(3):
        for j in range(4):
            pose[i, j] = 1.0 if i == j else 0.0
    angle, square, n_turns, first = 0.0, 0.0, 0, 0
    for i in range(n):
        axis, point = vec(joints[i, AXIS:POINT]), vec(joints[i, POINT:])
        w, c = turn(pose, axis), move(pose, point)
        put(motions[i], c)
        put(motions[i, 3:], w)
        if joints[i, SLIDES] > 0.0:
            move_to(pose, along((pose[0, 3], pose[1, 3], pose[2, 3]), middle[i], w))
            continue
        turn_about(pose, w, middle[i])
        move_to(pose, sub(c, turn(pose, point)))
        cosine = dot(w, vec(motions[first, 3:])) if n_turns == 1 else 0.0
        sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
        square += half[i] * half[i] + (2.0 * abs(cosine) + sine) * half[i] * angle
        angle, n_turns, first = angle + half[i], n_turns + 1, i
    move_to(pose, move(pose, vec(joints[n, POINT:])))
    p = (pose[0, 3], pose[1, 3], pose[2, 3])
    way, sizes[SHIFT] = 0.0, 0.0
    for i in range(n - 1, -1, -1):
        w, c = vec(motions[i, 3:]), vec(motions[i])
        way += norm(sub(vec(joints[i + 1, POINT:]), vec(joints[i, POINT:])))
        is_slide = joints[i, SLIDES] > 0.0
        if is_slide:
            way += abs(middle[i]) + half[i]
        before = 0.0
        for j in range(i):
            before += half[j] if joints[j, SLIDES] == 0.0 else 0.0
        speed = 1.0 if is_slide else way
        sizes[SHIFT] += half[i] * speed
        sizes[BEND] += half[i] * speed * (before + (0.0 if is_slide else 0.5 * half[i]))
        put(motions[i], scale(half[i], w if is_slide else cross(w, sub(p, c))))
        put(motions[i, 3:], scale(0.0 if is_slide else half[i], w))
    put_angle(angle, 1.0, cell)
    if n_turns == 2:
        sizes[CURVATURE] = min(sizes[CURVATURE], 0.5 * square * (1.0 + ROUNDING))


@routine
def turn_about(pose: Floats, axis: Vec, angle: float) -> None:
    """Turn the rotation of a pose about a unit vector."""
    cosine, sine = math.cos(angle), math.sin(angle)
    for j in range(3):
        column = turned((pose[0, j], pose[1, j], pose[2, j]), axis, cosine, sine)
        for i in range(3):
            pose[i, j] = column[i]


@routine
def move_to(pose: Floats, p: Vec) -> None:
    """Put a pose at a position."""
    for i in range(3):
        pose[i, 3] = p[i]


@routine
def put_oblique(
    region: CellParameters, box: Floats, slopes: Floats, errors: Floats, whole: Floats, cell: PoseCell
) -> None:
    """Fill a cell on which implicit coordinates are y + sum s_i slopes_i + t error, |t| <= 1: each t is a parameter.

    Lines in its parameters are lines in coordinates, and its sizes are those of the box around it (`whole`).

    Parameters
    ----------
    box : middle, and half sizes of the other coordinates.
    slopes : (6, 6): of each implicit coordinate, in a row, by the others.
    errors : (6,): positive.
    """
    for j in range(N_PARAMETERS):
        whole[j], whole[N_PARAMETERS + j] = box[j], box[N_PARAMETERS + j]
        if region.implicit[j] == 1:
            whole[N_PARAMETERS + j] = errors[j]
            for i in range(N_PARAMETERS):
                whole[N_PARAMETERS + j] += abs(slopes[j, i]) * (
                    box[N_PARAMETERS + i] if region.implicit[i] == 0 else 0.0
                )
    put_cell(region, whole, cell)
    motions = cell.motions
    for j in range(N_PARAMETERS):
        if region.implicit[j] == 0:
            continue
        for k in range(6):
            unit = motions[j, k] / whole[N_PARAMETERS + j]
            for i in range(N_PARAMETERS):
                if region.implicit[i] == 0:
                    motions[i, k] += slopes[j, i] * box[N_PARAMETERS + i] * unit
            motions[j, k] = errors[j] * unit


@routine
def put_angle(angle: float, bend: float, cell: PoseCell) -> None:
    """Fill what depends on the largest angle by which a cell turns."""
    cell.sizes[ANGLE] = angle
    cell.sizes[CHORD] = 2.0 * math.sin(0.5 * angle) if angle < math.pi else 2.0
    cell.sizes[CURVATURE] = 0.5 * bend * angle * angle


@routine
def fit_into(region: CellParameters, point: Floats) -> None:
    """Move the parameters of a pose into the region: first into its box, then into its shape and its cone."""
    for i in range(N_PARAMETERS):
        if region.implicit[i] == 1:
            continue
        point[i] = min(max(point[i], region.middle[i] - region.half[i]), region.middle[i] + region.half[i])
    if region.kinds[1] != BOX:
        z = 0.0 if region.kinds[1] == CYLINDER else point[2] - region.middle[2]
        x, y = point[0] - region.middle[0], point[1] - region.middle[1]
        away = math.sqrt(x * x + y * y + z * z)
        if away > region.half[0]:
            share = region.half[0] / away
            point[0], point[1] = region.middle[0] + share * x, region.middle[1] + share * y
            if region.kinds[1] == BALL:
                point[2] = region.middle[2] + share * z
    if region.kinds[0] == TILT:
        away = math.hypot(point[3], point[4])
        if away > region.half[3]:
            point[3], point[4] = point[3] * region.half[3] / away, point[4] * region.half[3] / away


@routine
def is_beside(region: CellParameters, middle: Floats, half: Floats) -> bool:
    """True if no pose of a cell is in the region: outside its shape of positions, or its cone of tilts."""
    if region.kinds[0] == TILT and is_beyond(middle[3], middle[4], 0.0, vec(half[3:]), region.half[3]):
        return True
    if region.kinds[1] == BOX:
        return False
    z = 0.0 if region.kinds[1] == CYLINDER else middle[2] - region.middle[2]
    return is_beyond(middle[0] - region.middle[0], middle[1] - region.middle[1], z, vec(half), region.half[0])


@routine
def is_beyond(x: float, y: float, z: float, half: Vec, radius: float) -> bool:
    """True if a box about a point is wholly farther than a radius from zero, with room for rounding."""
    x, y, z = max(abs(x) - half[0], 0.0), max(abs(y) - half[1], 0.0), max(abs(z) - half[2], 0.0)
    return x * x + y * y + z * z > radius * radius * (1.0 + 1e-12)


@routine
def moved_by(motion: Floats, lever: Vec) -> Vec:
    """Velocity of a point at a lever from the reference point, by one row of motions."""
    return add(vec(motion), cross(vec(motion[3:]), lever))
