"""Rotations of kernels: quaternions (w, x, y, z) for ball joints, rotation vectors for differences, yaw about z."""

from __future__ import annotations

import math

from ..common.arrays import Floats
from ._jit import inlined, routine

# Squares of a half angle [rad] and of its sine below which power series replace trigonometry: the first omitted terms
# are below 1e-17, and most steps of a search are as small.
SMALL_ANGLE, SMALL_SINE = 0.01, 0.0025


@inlined
def exponential(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Quaternion of a rotation vector [rad]."""
    square = 0.25 * (x * x + y * y + z * z)
    if square < SMALL_ANGLE:
        factor = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))
        cosine = 1.0 - square / 2.0 * (
            1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0 * (1.0 - square / 90.0)))
        )
    else:
        half = math.sqrt(square)
        factor, cosine = math.sin(half) / half, math.cos(half)
    return cosine, 0.5 * factor * x, 0.5 * factor * y, 0.5 * factor * z


@inlined
def logarithm(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Shortest rotation vector [rad] of a unit quaternion."""
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    square = x * x + y * y + z * z
    if square < SMALL_SINE:  # the series of the arc sine
        factor = 2.0 + square * (
            1.0 / 3.0 + square * (0.15 + square * (5.0 / 56.0 + square * (35.0 / 576.0 + square * 63.0 / 1408.0)))
        )
    else:
        sine = math.sqrt(square)
        factor = 2.0 * math.atan2(sine, w) / sine
    return factor * x, factor * y, factor * z


@routine
def turn_ball(ball: Floats, x: float, y: float, z: float) -> None:
    """ball = exp(rotation vector) ball, kept at unit length."""
    a, b, c, d = exponential(x, y, z)
    w, i, j, k = ball[0], ball[1], ball[2], ball[3]
    p = a * w - b * i - c * j - d * k
    q = a * i + b * w + c * k - d * j
    r = a * j - b * k + c * w + d * i
    s = a * k + b * j - c * i + d * w
    shorten = 1.5 - 0.5 * (p * p + q * q + r * r + s * s)  # one Newton step to 1 / length, which is 1 but for rounding
    ball[0], ball[1], ball[2], ball[3] = shorten * p, shorten * q, shorten * r, shorten * s


@routine
def rotate_by(R: Floats, w: float, x: float, y: float, z: float) -> None:
    """R = R times the rotation of a unit quaternion; the first three columns of `R`."""
    for i in range(3):
        a, b, c = R[i, 0], R[i, 1], R[i, 2]
        # row vector v times a rotation matrix is v rotated backwards: v - 2 w (u x v) + 2 u x (u x v), u = (x, y, z)
        p, q, r = y * c - z * b, z * a - x * c, x * b - y * a
        R[i, 0] = a + 2.0 * (-w * p + y * r - z * q)
        R[i, 1] = b + 2.0 * (-w * q + z * p - x * r)
        R[i, 2] = c + 2.0 * (-w * r + x * q - y * p)


@routine
def difference(R: Floats, S: Floats, out: Floats) -> None:
    """out = rotation vector of R S^T [rad], for any angle; the first three columns of both."""
    m00 = R[0, 0] * S[0, 0] + R[0, 1] * S[0, 1] + R[0, 2] * S[0, 2]
    m01 = R[0, 0] * S[1, 0] + R[0, 1] * S[1, 1] + R[0, 2] * S[1, 2]
    m02 = R[0, 0] * S[2, 0] + R[0, 1] * S[2, 1] + R[0, 2] * S[2, 2]
    m10 = R[1, 0] * S[0, 0] + R[1, 1] * S[0, 1] + R[1, 2] * S[0, 2]
    m11 = R[1, 0] * S[1, 0] + R[1, 1] * S[1, 1] + R[1, 2] * S[1, 2]
    m12 = R[1, 0] * S[2, 0] + R[1, 1] * S[2, 1] + R[1, 2] * S[2, 2]
    m20 = R[2, 0] * S[0, 0] + R[2, 1] * S[0, 1] + R[2, 2] * S[0, 2]
    m21 = R[2, 0] * S[1, 0] + R[2, 1] * S[1, 1] + R[2, 2] * S[1, 2]
    m22 = R[2, 0] * S[2, 0] + R[2, 1] * S[2, 1] + R[2, 2] * S[2, 2]
    # the quaternion from its largest component, so that nothing cancels
    if m00 + m11 + m22 > 0.0:
        w, x, y, z = 1.0 + m00 + m11 + m22, m21 - m12, m02 - m20, m10 - m01
    elif m00 >= m11 and m00 >= m22:
        w, x, y, z = m21 - m12, 1.0 + m00 - m11 - m22, m01 + m10, m02 + m20
    elif m11 >= m22:
        w, x, y, z = m02 - m20, m01 + m10, 1.0 - m00 + m11 - m22, m12 + m21
    else:
        w, x, y, z = m10 - m01, m02 + m20, m12 + m21, 1.0 - m00 - m11 + m22
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    out[0], out[1], out[2] = logarithm(w / norm, x / norm, y / norm, z / norm)


@inlined
def yaw_of(X: Floats) -> float:
    """The yaw of a rotation [rad], in (-pi, pi]: of R = S Rz(yaw), where S tilts z the shortest way.

    Reads the first three columns of X. Undefined if z is upside down; near that from entries that do not cancel.
    """
    if X[2, 2] >= 0.0:
        return math.atan2(X[1, 0] - X[0, 1], X[0, 0] + X[1, 1])
    if X[0, 0] >= X[1, 1]:
        z, w = X[2, 0] + X[0, 2], X[2, 1] - X[1, 2]
    else:
        z, w = X[2, 1] + X[1, 2], X[0, 2] - X[2, 0]
    return math.atan2(2.0 * z * w, w * w - z * z)


@inlined
def yaw_difference(X: Floats, Y: Floats) -> float:
    """The yaw of one rotation minus that of another [rad], within half a turn."""
    angle = yaw_of(X) - yaw_of(Y)
    return angle - 2.0 * math.pi * round(angle / (2.0 * math.pi))


@inlined
def turn_about_z(X: Floats, angle: float) -> None:
    """Turn a rotation about the base's z axis, in place: its yaw grows by the angle [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)
    for j in range(3):
        x, y = X[0, j], X[1, j]
        X[0, j], X[1, j] = cosine * x - sine * y, sine * x + cosine * y


UPSIDE_DOWN = 1e-12
"""Length of the sum of two z axes below which they count as opposite, and the yaw as undefined."""
