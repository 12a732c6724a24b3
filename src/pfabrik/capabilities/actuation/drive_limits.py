"""Torques and speeds of joints that limited actuators allow: half-spaces, and the box inscribed in them."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from ...errors import InvalidArgument


class HalfSpaces(NamedTuple):
    """The set of vectors v (k,) with normal v <= offset for every normal; it is symmetric about zero.

    Attributes
    ----------
    normals : array (..., m, k)
        Unit vectors, the second half the opposites of the first; zero where they say nothing.
    offsets : array (..., m)
        Largest values along the normals.
    box : array (..., k)
        Half the sides of the inscribed box: every v with |v| <= box is in the set. Each side has the same share of what
        its coordinate has alone.
    alone : array (..., k)
        The largest value of each coordinate while the others are zero; inf where nothing limits it.
    """

    normals: Floats
    offsets: Floats
    box: Floats
    alone: Floats

    def contains(self, v: Floats) -> np.bool_ | Floats:
        """True where vectors v (..., k) are in the set."""
        sizes = np.einsum("...mk,...k->...m", self.normals, v)
        return np.asarray((sizes <= self.offsets).all(axis=-1))[()]

    def polygon(self) -> Floats:
        """The corners (m, 2) of a single set of two coordinates, counterclockwise.

        Raises
        ------
        InvalidArgument
            A batch, other than two coordinates, or a set without bounds.
        """
        if self.normals.ndim != 2 or self.normals.shape[1] != 2 or not np.isfinite(self.alone).all():
            found = f"half-spaces of shape {self.normals.shape}"
            raise InvalidArgument("polygon", found, "a single bounded set of two coordinates: (m, 2)")
        low, high = -self.alone.max() * ROOM, self.alone.max() * ROOM
        corners = np.array([[low, low], [high, low], [high, high], [low, high]])
        for normal, offset in zip(self.normals, self.offsets, strict=True):
            corners = clipped(corners, normal, float(offset))
        return distinct(corners)


def image_of_box(generators: Floats, limits: Floats) -> HalfSpaces:
    """The set of all sums of generators g_i (..., n, k), each times a number within +-limit_i, (..., n): a zonotope.

    Its facets are spanned by k - 1 of the generators: with n their normal, |n v| <= sum |n g_i| limit_i.
    """
    n, k = generators.shape[-2:]
    chosen = list(combinations(range(n), k - 1))
    normals = np.stack([_normal(generators[..., list(rows), :]) for rows in chosen], axis=-2)
    axes = np.broadcast_to(np.eye(k), (*normals.shape[:-2], k, k))  # where all generators are in a plane, its ends
    normals = np.concatenate([_unit(normals), axes], axis=-2)
    reaches = np.abs(normals @ np.swapaxes(generators, -1, -2)) * limits[..., None, :]
    return _with_box(normals, reaches.sum(axis=-1))


def preimage_of_box(rows: Floats, limits: Floats) -> HalfSpaces:
    """The set of all v with |row_i v| <= limit_i, of rows (..., n, k) and limits (..., n)."""
    sizes = np.linalg.norm(rows, axis=-1)
    safe = np.where(sizes > 0.0, sizes, 1.0)
    return _with_box(rows / safe[..., None], np.where(sizes > 0.0, limits / safe, np.inf))


def _with_box(normals: Floats, offsets: Floats) -> HalfSpaces:
    """Half-spaces |normal v| <= offset with the box whose sides are in proportion to what each coordinate has alone."""
    sizes = np.abs(normals)
    alone = _least(offsets[..., None], sizes)
    finite = np.where(np.isfinite(alone), alone, 0.0)
    share = _least(offsets, np.einsum("...mk,...k->...m", sizes, finite), axis=-1)
    share = np.where(np.isfinite(share), share, 0.0)
    both, limits = np.concatenate([normals, -normals], axis=-2), np.concatenate([offsets, offsets], axis=-1)
    return HalfSpaces(both, limits, np.where(np.isfinite(alone), share[..., None] * finite, np.inf), alone)


def _least(offsets: Floats, sizes: Floats, axis: int = -2) -> Floats:
    """The least of offsets / sizes, where sizes are not zero."""
    ratios = np.full(sizes.shape, np.inf)
    np.divide(offsets, sizes, out=ratios, where=sizes > TINY)
    return np.asarray(ratios.min(axis=axis))


ROOM = 1e3
"""Size of a polygon to be clipped, in what coordinates have alone: a thin set askew may be that much longer."""

TINY = 1e-14
"""Part of a unit normal below which it does not limit a coordinate: rounding."""


def _normal(rows: Floats) -> Floats:
    """A vector square to rows (..., k - 1, k), by cofactors: zero where they depend on each other."""
    k = rows.shape[-1]
    minors = [np.linalg.det(np.delete(rows, column, axis=-1)) * (-1.0) ** column for column in range(k)]
    return np.stack(minors, axis=-1)


def _unit(vectors: Floats) -> Floats:
    sizes = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(sizes > 0.0, sizes, 1.0))


def clipped(corners: Floats, normal: Floats, offset: float) -> Floats:
    """The part with normal v <= offset of a convex polygon (m, 2), in the same order (Sutherland and Hodgman)."""
    beyond = corners @ normal - offset
    kept: list[Floats] = []
    for place in range(len(corners)):
        a, b = beyond[place - 1], beyond[place]
        if (a > 0.0) != (b > 0.0):
            kept.append(corners[place - 1] + a / (a - b) * (corners[place] - corners[place - 1]))
        if b <= 0.0:
            kept.append(corners[place])
    return np.reshape(kept, (-1, 2))


def distinct(corners: Floats) -> Floats:
    """Corners (m, 2) of a polygon without those that coincide with the one before."""
    gaps = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    return corners[gaps > SAME * np.abs(corners).max(initial=0.0)] if len(corners) > 1 else corners


SAME = 1e-9
"""Distance of corners that coincide, as a share of a polygon's size: more than the rounding of cuts."""
