"""Vectors of a home configuration: floats, those among them that note how they were computed (`noted_numbers`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..kernels.vectors import cross as crossed
from .noted_numbers import atan2, copysign, largest, smallest, sqrt

SMALL, LARGE = 1e-100, 1e100
"""Numbers between which squares, and sums of them, neither over- nor underflow."""


class Vector(tuple[float, ...]):
    """Three numbers."""

    __slots__ = ()

    def __add__(self, other: Any) -> Vector:
        return Vector((self[0] + other[0], self[1] + other[1], self[2] + other[2]))

    def __sub__(self, other: Any) -> Vector:
        return Vector((self[0] - other[0], self[1] - other[1], self[2] - other[2]))

    def __mul__(self, k: float) -> Vector:  # type: ignore[override]
        return Vector((k * self[0], k * self[1], k * self[2]))

    def __truediv__(self, k: float) -> Vector:
        return Vector((self[0] / k, self[1] / k, self[2] / k) if k != 0.0 else (0.0, 0.0, 0.0))

    def __neg__(self) -> Vector:
        return self * -1.0

    def __matmul__(self, other: Vector) -> float:
        return self[0] * other[0] + self[1] * other[1] + self[2] * other[2]

    def is_same(self, other: Vector) -> bool:
        """True if both have the same components."""
        return all(a == b for a, b in zip(self, other, strict=True))


def cross(a: Vector, b: Vector) -> Vector:
    return Vector(crossed(a, b))  # type: ignore[arg-type]


def norm(a: Vector) -> float:
    size: float = sqrt(a @ a)
    return size


def length(a: Vector) -> float:
    """The norm of a vector however long or short it is, as of one in a mechanism's own unit."""
    size: float = largest(map(abs, a))
    unit = 1.0 if SMALL < size < LARGE or size == 0.0 else size
    return unit * norm(Vector(x / unit for x in a))


def area(a: Vector, b: Vector) -> float:
    """Area between two vectors; of unit vectors, the sine of the angle between them."""
    return norm(cross(a, b))


def square_to(a: Vector) -> tuple[Vector, Vector]:
    """Two unit vectors square to a vector, and to each other.

    The last two rows of I - t w w^T, the reflection that turns v into the x axis: with s = -sign(v_x) |v|,
    w = (1, v_y / (v_x - s), v_z / (v_x - s)) and t = (s - v_x) / s. Of no length, v is that axis.
    """
    x, s = a[0], -copysign(length(a), a[0])
    u, w, t = (a[1] / (x - s), a[2] / (x - s), (s - x) / s) if s != 0.0 else (0.0, 0.0, 0.0)
    return Vector((-t * u, 1.0 - t * u * u, -t * u * w)), Vector((-t * w, -t * u * w, 1.0 - t * w * w))


def sign(a: float) -> float:
    """+1 or -1; of a zero, the sign that it has."""
    one: float = copysign(1.0, a)
    return one


def angle_of(sine: float, cosine: float) -> float:
    """The angle of a vector with these components, in (-pi, pi]."""
    angle: float = atan2(sine, cosine)
    return angle


def spread(vectors: Sequence[Vector]) -> float:
    """The most by which one component differs among vectors."""
    most: float = largest(largest(each) - smallest(each) for each in zip(*vectors, strict=True))
    return most
