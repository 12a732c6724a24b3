"""A block of poses, one per column of a table: loops over columns vectorise."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import inlined, routine
from ..vectors import Vec, cross, dot, scale, sub, vec
from .complete_poses import orthonormalise
from .leg_constants import NOT_A_ROTATION, ROUNDED
from .records import CRANK

# Few enough for the first-level cache, many enough to amortise what is read once a block.
BLOCK = 64

# Rows of the table: rotation and position of the platform [L]; deviation of the rotation from orthonormal; 1 if it is a
# pose and all solutions are regular; largest constraint; largest excess; side of the rod.
XX, XY, XZ, YX, YY, YZ, ZX, ZY, ZZ, PX, PY, PZ = range(12)
OFF, IS_REGULAR, ROW, EXCESS, SIDE = range(12, 17)
# Of one rod: its line from base end to platform end, length, inverse length, crank angle; two directions; a number.
X, Y, Z, LENGTH, INVERSE, COS, SIN = range(17, 24)
AX, AY, AZ, BX, BY, BZ, VALUE = range(24, 31)
# Then the values of the rod, in the order of `records`, up to PLATFORM_END; then rows for the caller.
VALUES, MORE = 31, 37

# Coefficients of atan t = t (1 + z P(z)), z = t^2, for |t| <= tan(pi / 8): Chebyshev's, error at most 6e-18.
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


@inlined
def arctangent(y: float, x: float) -> float:
    """atan2 without branches, so that loops over it vectorise."""
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
def fill_poses(targets: Floats, begins: Floats, task: Record, first: int, n: int, pose: Floats, S: Floats) -> None:
    """Fill the poses of n targets (4, 4) [length] from index `first` on; unset coordinates are taken from `begins`.

    `pose` is scratch memory for one pose.
    """
    scale_factor, block = 1.0 / task["length"], targets[first : first + n]
    for i in range(n):
        target = block[i]
        S[XX, i], S[XY, i], S[XZ, i] = target[0, 0], target[0, 1], target[0, 2]
        S[YX, i], S[YY, i], S[YZ, i] = target[1, 0], target[1, 1], target[1, 2]
        S[ZX, i], S[ZY, i], S[ZZ, i] = target[2, 0], target[2, 1], target[2, 2]
        S[PX, i], S[PY, i], S[PZ, i] = (
            scale_factor * target[0, 3],
            scale_factor * target[1, 3],
            scale_factor * target[2, 3],
        )
        S[OFF, i] = abs(target[3, 0]) + abs(target[3, 1]) + abs(target[3, 2]) + abs(target[3, 3] - 1.0)
    check_poses(n, S)
    if task["rotations"] == 3:
        for i in range(n):
            if S[OFF, i] > ROUNDED and S[IS_REGULAR, i] == 1.0:
                orthonormalise_column(i, pose, S)
    else:
        for j in range(9):
            fill_starts(begins[:, j // 3, j % 3], 1.0, first, n, XX + j, S)
    for j in range(3):
        if task["axes"][j] == 0:
            fill_starts(begins[:, j, 3], scale_factor, first, n, PX + j, S)


@routine
def fill_starts(begins: Floats, factor: float, first: int, n: int, to: int, S: Floats) -> None:
    """Fill a row with a factor times the start values: one value for all columns, or one for each."""
    if begins.shape[0] == 1:
        value = factor * begins[0]
        for i in range(n):
            S[to, i] = value
    else:
        for i in range(n):
            S[to, i] = factor * begins[first + i]


@routine
def check_poses(n: int, S: Floats) -> None:
    """Set IS_REGULAR where a column is a pose, given OFF of its last row; then OFF of its rotation."""
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
        S[IS_REGULAR, i], S[ROW, i], S[EXCESS, i] = (1.0 if is_pose else 0.0), 0.0, -math.inf
        S[OFF, i] = off


@routine
def orthonormalise_column(i: int, pose: Floats, S: Floats) -> None:
    """Make the rotation of column `i` orthonormal."""
    for j in range(9):
        pose[j // 3, j % 3] = S[XX + j, i]
    orthonormalise(pose)
    for j in range(9):
        S[XX + j, i] = pose[j // 3, j % 3]


@routine
def fill_platform_point(point: Vec, origin: Vec, n: int, S: Floats) -> None:
    """Fill X, Y, Z with a point of the platform minus a point of the base."""
    for i in range(n):
        S[X, i] = S[XX, i] * point[0] + S[XY, i] * point[1] + S[XZ, i] * point[2] + (S[PX, i] - origin[0])
        S[Y, i] = S[YX, i] * point[0] + S[YY, i] * point[1] + S[YZ, i] * point[2] + (S[PY, i] - origin[1])
        S[Z, i] = S[ZX, i] * point[0] + S[ZY, i] * point[1] + S[ZZ, i] * point[2] + (S[PZ, i] - origin[2])


@routine
def fill_inverse(n: int, S: Floats) -> None:
    """Fill INVERSE with one over the rod's length."""
    for i in range(n):
        S[INVERSE, i] = 1.0 / S[LENGTH, i]


@routine
def fill_platform_direction(direction: Vec, n: int, S: Floats) -> None:
    """Fill AX, AY, AZ with a direction fixed in the platform."""
    for i in range(n):
        S[AX, i] = S[XX, i] * direction[0] + S[XY, i] * direction[1] + S[XZ, i] * direction[2]
        S[AY, i] = S[YX, i] * direction[0] + S[YY, i] * direction[1] + S[YZ, i] * direction[2]
        S[AZ, i] = S[ZX, i] * direction[0] + S[ZY, i] * direction[1] + S[ZZ, i] * direction[2]


@routine
def project_on_platform_direction(direction: Vec, to: int, n: int, S: Floats) -> None:
    """Fill a row with the component of the rod's line along a direction fixed in the platform."""
    for i in range(n):
        x = S[XX, i] * direction[0] + S[XY, i] * direction[1] + S[XZ, i] * direction[2]
        y = S[YX, i] * direction[0] + S[YY, i] * direction[1] + S[YZ, i] * direction[2]
        z = S[ZX, i] * direction[0] + S[ZY, i] * direction[1] + S[ZZ, i] * direction[2]
        S[to, i] = x * S[X, i] + y * S[Y, i] + z * S[Z, i]


@routine
def fill_base_direction(direction: Vec, proximal: Record, n: int, S: Floats) -> None:
    """Fill BX, BY, BZ with a direction fixed in the body of the base end."""
    if proximal["proximal"] != CRANK:
        for i in range(n):
            S[BX, i], S[BY, i], S[BZ, i] = direction[0], direction[1], direction[2]
        return
    axial, radial, across = split(direction, vec(proximal["proximal_axis"]))
    for i in range(n):
        cosine, sine = S[COS, i], S[SIN, i]
        S[BX, i] = axial[0] + cosine * radial[0] + sine * across[0]
        S[BY, i] = axial[1] + cosine * radial[1] + sine * across[1]
        S[BZ, i] = axial[2] + cosine * radial[2] + sine * across[2]


@routine
def project_on_base_direction(direction: Vec, proximal: Record, to: int, n: int, S: Floats) -> None:
    """Fill a row with the component of the rod's line along a direction fixed in the body of the base end."""
    if proximal["proximal"] != CRANK:
        for i in range(n):
            S[to, i] = direction[0] * S[X, i] + direction[1] * S[Y, i] + direction[2] * S[Z, i]
        return
    axial, radial, across = split(direction, vec(proximal["proximal_axis"]))
    for i in range(n):
        cosine, sine = S[COS, i], S[SIN, i]
        x = axial[0] + cosine * radial[0] + sine * across[0]
        y = axial[1] + cosine * radial[1] + sine * across[1]
        z = axial[2] + cosine * radial[2] + sine * across[2]
        S[to, i] = x * S[X, i] + y * S[Y, i] + z * S[Z, i]


@routine
def split(direction: Vec, axis: Vec) -> tuple[Vec, Vec, Vec]:
    """A direction's parts along and normal to an axis, and the normal part turned by a quarter turn."""
    axial = scale(dot(axis, direction), axis)
    return axial, sub(direction, axial), cross(axis, direction)
