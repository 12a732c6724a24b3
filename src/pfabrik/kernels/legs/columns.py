"""A block of poses side by side, a column of a table for each: every line of arithmetic serves them all."""

from __future__ import annotations

import math

from ...arrays import Floats, Record
from .._jit import routine
from ..vectors import Vec, cross, dot, scale, sub, vec
from .poses import NOT_A_ROTATION, ROUNDED, make_exact
from .records import CRANK

# Few enough for the nearest cache, many enough to pay for what is read once a block.
BLOCK = 64

# Rows of the table: rotation and position of the platform [L]; how far the rotation was from orthonormal, whether the
# row is a pose and all solutions are sure, its largest constraint, its largest excess; sides that rods take.
XX, XY, XZ, YX, YY, YZ, ZX, ZY, ZZ, PX, PY, PZ = range(12)
OFF, MARGIN, ROW, EXCESS, SIDE = range(12, 17)
# Of one rod: from foot to head, its length and the inverse of that, the carrier's angle, two directions, a number.
X, Y, Z, LENGTH, INVERSE, COS, SIN = range(17, 24)
AX, AY, AZ, BX, BY, BZ, VALUE = range(24, 31)
# Then its values in the places that `records` gives them, as far as HEAD; then as many more as the caller needs.
VALUES, MORE = 31, 37

# Coefficients of atan t = t (1 + z P(z)), z = t^2, for |t| <= tan(pi / 8): Chebyshev's, off by 6e-18 at most.
ATAN = (
    -0.01917688711906225899,
    0.0392316582955871913,
    -0.05085449737940259861,
    0.05858148912802209882,
    -0.06664511447381948,
    0.07692183190826086564,
    -0.0909090457812390189,
    0.1111111101525636173,
    -0.1428571428466654292,
    0.1999999999999552068,
    -0.3333333333333333016,
)
TAN_EIGHTH = 0.41421356237309503


@routine
def arctangent(y: float, x: float) -> float:
    """atan2, without branches: loops that call it vectorise."""
    a, b = abs(x), abs(y)
    larger, smaller = (a, b) if a > b else (b, a)
    is_steep = smaller > TAN_EIGHTH * larger
    over = smaller - larger if is_steep else smaller
    under = smaller + larger if is_steep else larger
    t = over / (under if under != 0.0 else 1.0)
    z = t * t
    p = (((ATAN[0] * z + ATAN[1]) * z + ATAN[2]) * z + ATAN[3]) * z + ATAN[4]
    p = (((p * z + ATAN[5]) * z + ATAN[6]) * z + ATAN[7]) * z + ATAN[8]
    p = (p * z + ATAN[9]) * z + ATAN[10]
    angle = t + t * (z * p)
    angle = angle + 0.25 * math.pi if is_steep else angle
    angle = 0.5 * math.pi - angle if b > a else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@routine
def lay_out(targets: Floats, begins: Floats, task: Record, first: int, n: int, pose: Floats, S: Floats) -> None:
    """Columns of the poses of n targets (4, 4) [length] from the `first` on; what they do not set is as in `begins`.

    `pose` is room for one.
    """
    shrink, own = 1.0 / task["length"], targets[first : first + n]
    for i in range(n):
        target = own[i]
        S[XX, i], S[XY, i], S[XZ, i] = target[0, 0], target[0, 1], target[0, 2]
        S[YX, i], S[YY, i], S[YZ, i] = target[1, 0], target[1, 1], target[1, 2]
        S[ZX, i], S[ZY, i], S[ZZ, i] = target[2, 0], target[2, 1], target[2, 2]
        S[PX, i], S[PY, i], S[PZ, i] = shrink * target[0, 3], shrink * target[1, 3], shrink * target[2, 3]
        S[OFF, i] = abs(target[3, 0]) + abs(target[3, 1]) + abs(target[3, 2]) + abs(target[3, 3] - 1.0)
    check_poses(n, S)
    if task["rotations"] == 3:
        for i in range(n):
            if S[OFF, i] > ROUNDED and S[MARGIN, i] == 1.0:
                straighten(i, pose, S)
    else:
        for j in range(9):
            lay_begins(begins[:, j // 3, j % 3], 1.0, first, n, XX + j, S)
    for j in range(3):
        if task["axes"][j] == 0:
            lay_begins(begins[:, j, 3], shrink, first, n, PX + j, S)


@routine
def lay_begins(begins: Floats, factor: float, first: int, n: int, to: int, S: Floats) -> None:
    """Fill a column with what one for each row, or one for all, begins with, times a factor."""
    if begins.shape[0] == 1:
        value = factor * begins[0]
        for i in range(n):
            S[to, i] = value
    else:
        for i in range(n):
            S[to, i] = factor * begins[first + i]


@routine
def check_poses(n: int, S: Floats) -> None:
    """Start IS_SURE with whether a column is a pose, whose last row is off by OFF; then that is for the rotation."""
    for i in range(n):
        xx, xy, xz = S[XX, i], S[XY, i], S[XZ, i]
        yx, yy, yz = S[YX, i], S[YY, i], S[YZ, i]
        zx, zy, zz = S[ZX, i], S[ZY, i], S[ZZ, i]
        off = abs(xx * xx + yx * yx + zx * zx - 1.0) + abs(xy * xy + yy * yy + zy * zy - 1.0)
        off += abs(xz * xz + yz * yz + zz * zz - 1.0) + abs(xx * xy + yx * yy + zx * zy)
        off += abs(xy * xz + yy * yz + zy * zz) + abs(xz * xx + yz * yx + zz * zx)
        volume = xx * (yy * zz - yz * zy) - xy * (yx * zz - yz * zx) + xz * (yx * zy - yy * zx)
        farthest = abs(S[PX, i]) + abs(S[PY, i]) + abs(S[PZ, i])
        is_pose = (off + S[OFF, i] <= NOT_A_ROTATION) & (volume > 0.0) & (farthest < math.inf)
        S[MARGIN, i], S[ROW, i], S[EXCESS, i] = (1.0 if is_pose else 0.0), 0.0, -math.inf
        S[OFF, i] = off


@routine
def straighten(i: int, pose: Floats, S: Floats) -> None:
    """Make the rotation of column `i` orthonormal."""
    for j in range(9):
        pose[j // 3, j % 3] = S[XX + j, i]
    make_exact(pose)
    for j in range(9):
        S[XX + j, i] = pose[j // 3, j % 3]


@routine
def lay_moved(point: Vec, origin: Vec, n: int, S: Floats) -> None:
    """Fill X, Y, Z with a point of the platform, less a point of the base."""
    for i in range(n):
        S[X, i] = S[XX, i] * point[0] + S[XY, i] * point[1] + S[XZ, i] * point[2] + (S[PX, i] - origin[0])
        S[Y, i] = S[YX, i] * point[0] + S[YY, i] * point[1] + S[YZ, i] * point[2] + (S[PY, i] - origin[1])
        S[Z, i] = S[ZX, i] * point[0] + S[ZY, i] * point[1] + S[ZZ, i] * point[2] + (S[PZ, i] - origin[2])


@routine
def lay_inverse(n: int, S: Floats) -> None:
    """Fill INVERSE with that of the rod's length."""
    for i in range(n):
        S[INVERSE, i] = 1.0 / S[LENGTH, i]


@routine
def lay_turned(direction: Vec, n: int, S: Floats) -> None:
    """Fill AX, AY, AZ with a direction of the platform."""
    for i in range(n):
        S[AX, i] = S[XX, i] * direction[0] + S[XY, i] * direction[1] + S[XZ, i] * direction[2]
        S[AY, i] = S[YX, i] * direction[0] + S[YY, i] * direction[1] + S[YZ, i] * direction[2]
        S[AZ, i] = S[ZX, i] * direction[0] + S[ZY, i] * direction[1] + S[ZZ, i] * direction[2]


@routine
def lay_along_turned(direction: Vec, to: int, n: int, S: Floats) -> None:
    """Fill a column with the share of the rod's line along a direction of the platform."""
    for i in range(n):
        x = S[XX, i] * direction[0] + S[XY, i] * direction[1] + S[XZ, i] * direction[2]
        y = S[YX, i] * direction[0] + S[YY, i] * direction[1] + S[YZ, i] * direction[2]
        z = S[ZX, i] * direction[0] + S[ZY, i] * direction[1] + S[ZZ, i] * direction[2]
        S[to, i] = x * S[X, i] + y * S[Y, i] + z * S[Z, i]


@routine
def lay_carried(direction: Vec, proximal: Record, n: int, S: Floats) -> None:
    """Fill BX, BY, BZ with a direction of the body that the foot is on."""
    if proximal["proximal"] != CRANK:
        for i in range(n):
            S[BX, i], S[BY, i], S[BZ, i] = direction[0], direction[1], direction[2]
        return
    rest, plain, across = split(direction, vec(proximal["proximal_axis"]))
    for i in range(n):
        cosine, sine = S[COS, i], S[SIN, i]
        S[BX, i] = rest[0] + cosine * plain[0] + sine * across[0]
        S[BY, i] = rest[1] + cosine * plain[1] + sine * across[1]
        S[BZ, i] = rest[2] + cosine * plain[2] + sine * across[2]


@routine
def lay_along_carried(direction: Vec, proximal: Record, to: int, n: int, S: Floats) -> None:
    """Fill a column with the share of the rod's line along a direction of the body that the foot is on."""
    if proximal["proximal"] != CRANK:
        for i in range(n):
            S[to, i] = direction[0] * S[X, i] + direction[1] * S[Y, i] + direction[2] * S[Z, i]
        return
    rest, plain, across = split(direction, vec(proximal["proximal_axis"]))
    for i in range(n):
        cosine, sine = S[COS, i], S[SIN, i]
        x = rest[0] + cosine * plain[0] + sine * across[0]
        y = rest[1] + cosine * plain[1] + sine * across[1]
        z = rest[2] + cosine * plain[2] + sine * across[2]
        S[to, i] = x * S[X, i] + y * S[Y, i] + z * S[Z, i]


@routine
def split(direction: Vec, axis: Vec) -> tuple[Vec, Vec, Vec]:
    """What of a direction an axis keeps that it turns about, what it turns, and that a quarter turn on."""
    rest = scale(dot(axis, direction), axis)
    return rest, sub(direction, rest), cross(axis, direction)
