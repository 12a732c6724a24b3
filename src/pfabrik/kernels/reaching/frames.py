"""What moves together: carriers (the bodies branches hang on), the platform's points, and small rotations."""

from __future__ import annotations

import math

from .._jit import routine
from ..vectors import Vec, add, along, cross, dot, move, norm, put, rotate, scale, sub, turn, vec
from .plan import TURN, Configuration, Floats, Plan

# Above this sine of its angle a rotation shows its axis to twelve digits; below it, the limits at 0 and pi serve.
SURE_SINE = 1e-4


@routine
def identity_pose(T: Floats) -> None:
    for i in range(T.shape[0]):
        for j in range(4):
            T[i, j] = 1.0 if i == j else 0.0


@routine
def move_carriers(plan: Plan, now: Configuration) -> None:
    """Pose every carrier from its trunk's joint values; leave each trunk joint's present point and axis in `screws`."""
    carriers, screws, trunk_values = now.carriers, now.screws, now.trunks
    identity_pose(carriers[0])
    for k in range(plan.trunks.shape[0]):
        T = carriers[k + 1]
        identity_pose(T)
        for j in range(plan.trunks[k]["first"], plan.trunks[k]["last"]):
            axis = turn(T, vec(plan.trunk_joints[j]["axis"]))
            point = add(turn(T, vec(plan.trunk_joints[j]["point"])), (T[0, 3], T[1, 3], T[2, 3]))
            put(screws[j, 0], point)
            put(screws[j, 1], axis)
            if plan.trunk_joints[j]["kind"] == TURN:
                turn_pose(T, axis, trunk_values[j])
                moved = rotate(sub((T[0, 3], T[1, 3], T[2, 3]), point), axis, trunk_values[j])
                set_position(T, add(point, moved))
            else:
                set_position(T, along((T[0, 3], T[1, 3], T[2, 3]), trunk_values[j], axis))


@routine
def set_position(T: Floats, p: Vec) -> None:
    T[0, 3] = p[0]
    T[1, 3] = p[1]
    T[2, 3] = p[2]


@routine
def turn_pose(T: Floats, axis: Vec, angle: float) -> None:
    """Turn the rotation of the pose `T` about `axis` (base coordinates); its position stays."""
    for j in range(3):
        column = rotate((T[0, j], T[1, j], T[2, j]), axis, angle)
        T[0, j] = column[0]
        T[1, j] = column[1]
        T[2, j] = column[2]


@routine
def turn_pose_by_vector(T: Floats, w: Vec) -> None:
    """Turn the rotation of `T` by the rotation vector `w` and make it orthonormal again to machine precision."""
    angle = norm(w)
    if angle > 0.0:
        turn_pose(T, scale(1.0 / angle, w), angle)
        orthonormalise(T)


@routine
def orthonormalise(T: Floats) -> None:
    x = (T[0, 0], T[1, 0], T[2, 0])
    y = (T[0, 1], T[1, 1], T[2, 1])
    x = scale(1.0 / norm(x), x)
    y = along(y, -dot(x, y), x)
    y = scale(1.0 / norm(y), y)
    z = cross(x, y)
    for i in range(3):
        T[i, 0] = x[i]
        T[i, 1] = y[i]
        T[i, 2] = z[i]


@routine
def rotation_between(A: Floats, B: Floats) -> Vec:
    """Rotation vector w with exp(w) A = B, |w| in [0, pi]; base coordinates."""
    # M = B A^T, entry by entry
    xx = B[0, 0] * A[0, 0] + B[0, 1] * A[0, 1] + B[0, 2] * A[0, 2]
    xy = B[0, 0] * A[1, 0] + B[0, 1] * A[1, 1] + B[0, 2] * A[1, 2]
    xz = B[0, 0] * A[2, 0] + B[0, 1] * A[2, 1] + B[0, 2] * A[2, 2]
    yx = B[1, 0] * A[0, 0] + B[1, 1] * A[0, 1] + B[1, 2] * A[0, 2]
    yy = B[1, 0] * A[1, 0] + B[1, 1] * A[1, 1] + B[1, 2] * A[1, 2]
    yz = B[1, 0] * A[2, 0] + B[1, 1] * A[2, 1] + B[1, 2] * A[2, 2]
    zx = B[2, 0] * A[0, 0] + B[2, 1] * A[0, 1] + B[2, 2] * A[0, 2]
    zy = B[2, 0] * A[1, 0] + B[2, 1] * A[1, 1] + B[2, 2] * A[1, 2]
    zz = B[2, 0] * A[2, 0] + B[2, 1] * A[2, 1] + B[2, 2] * A[2, 2]
    twice_sine = (zy - yz, xz - zx, yx - xy)
    sine = 0.5 * norm(twice_sine)
    cosine = 0.5 * (xx + yy + zz - 1.0)
    angle = math.atan2(sine, cosine)
    if sine > SURE_SINE:
        return scale(0.5 * angle / sine, twice_sine)
    if cosine > 0.0:  # a small rotation: angle / sine is 1 to machine precision
        return scale(0.5, twice_sine)
    # near half a turn the axis is the largest column of the symmetric part, M + M^T = 2 cos I + 2 (1 - cos) a a^T
    xy, xz, yz = 0.5 * (xy + yx), 0.5 * (xz + zx), 0.5 * (yz + zy)
    axis = (xx - cosine, xy, xz)
    if yy > xx and yy >= zz:
        axis = (xy, yy - cosine, yz)
    elif zz > xx and zz > yy:
        axis = (xz, yz, zz - cosine)
    if dot(axis, twice_sine) < 0.0:
        axis = scale(-1.0, axis)
    return scale(angle / norm(axis), axis)


@routine
def place_ends(plan: Plan, c: int, now: Configuration) -> None:
    """Put the first and last nodes of a chain where carrier and platform have them."""
    for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
        branch = plan.branches[b]
        first, last = branch["first"], branch["last"]
        if branch["rail"] == 0:
            put(now.nodes[first], move(now.carriers[branch["carrier"]], vec(plan.nodes[first]["home"])))
        put(now.nodes[last], move(now.pose, vec(branch["end"])))
