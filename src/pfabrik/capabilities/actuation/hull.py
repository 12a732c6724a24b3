"""The feasible part of a box of joint coordinates, as half-spaces within it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats, Mask
from ...errors import InvalidArgument
from ...tolerances import TOLERANCES
from .drive_limits import clipped, distinct
from .named_values import box_of
from .placed import Placer

POINTS = 20_000
"""Points of a box at which feasibility is asked: shares of it are known to half a per cent."""

MOST_CUTS = 200
"""Most half-spaces: a hull that needs more has a border that no few planes follow."""

ROUNDS, SHARES = 5, 33
"""Divisions of a line to the border, and points of each: to 3e-8 of the line."""

BEYOND = 1e-4
"""Step beyond the border to a point at which its limit is asked, as a share of the way."""

INSIDE = 1e-6
"""Distance of half-spaces from the border, inward, as a share of half the box."""


class Hull(NamedTuple):
    """Half-spaces normal q <= offset whose points are feasible, as far as was asked.

    Attributes
    ----------
    normals : array (m, k)
        Unit vectors; the first 2 k are the box.
    offsets : array (m,)
        Largest values along the normals.
    interior : array (k,)
        The point in it from which it was cut: home, or the point with the largest margin.
    share_lost : float
        Share of the box that is not feasible.
    share_cut : float
        Share of the box that is outside the half-spaces: more, where what is feasible is not convex.
    limits : tuple of tuple of str
        Pairs (joint, bound) that the border of each half-space lies on, m of them; "" for the box where it is a range.
    """

    normals: Floats
    offsets: Floats
    interior: Floats
    share_lost: float
    share_cut: float
    limits: tuple[tuple[str, str], ...]

    def contains(self, q: Floats) -> np.bool_ | Mask:
        """True where coordinates q (..., k) are in it."""
        return np.asarray((np.asarray(q) @ self.normals.T <= self.offsets).all(axis=-1))[()]

    def polygon(self) -> Floats:
        """Its corners (m, 2), counterclockwise; of two coordinates.

        Raises
        ------
        InvalidArgument
            There are not two coordinates.
        """
        if self.normals.shape[1] != 2:
            raise InvalidArgument("hull", f"{self.normals.shape[1]} coordinates", "two")
        (x1, x0), (y1, y0) = self.offsets[:2] * [1.0, -1.0], self.offsets[2:4] * [1.0, -1.0]
        corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        for normal, offset in zip(self.normals[4:], self.offsets[4:], strict=True):
            corners = clipped(corners, normal, float(offset))
        return distinct(corners)


def feasible_hull(placer: Placer, box: Any, seed: int) -> Hull:
    """Half-spaces within the feasible part of a box, by cutting planes.

    While a point of the box that is not feasible is within the half-spaces, the nearest one to the interior is cut off:
    by the plane on which the margin vanishes on the way to it, or, if that is not between the two, by one across it.

    Raises
    ------
    InvalidArgument : a box without feasible points, or one without an extent.
    """
    low, high = box_of(placer.coordinates, box)
    if (high <= low).any():
        raise InvalidArgument("box", "a coordinate without an extent", "lowest coordinates below the highest")
    k, half, middle = len(low), 0.5 * (high - low), 0.5 * (high + low)

    def margin(u: Floats) -> Floats:
        return placer.feasible_margins(middle + u * half) + TOLERANCES.limit

    points = _lattice(k, np.random.default_rng(seed))
    values = margin(points)
    home = (placer.coordinates.home - middle) / half
    interior = home if np.abs(home).max() <= 1.0 and margin(home[None])[0] > 0.0 else points[values.argmax()]
    if not margin(interior[None])[0] > 0.0:
        raise InvalidArgument("box", "no feasible point", "a box of which a part is reachable")
    normals = np.stack([sign * axis for axis in np.eye(k) for sign in (1.0, -1.0)])
    offsets, limits = np.ones(2 * k), [("", "")] * (2 * k)
    infeasible = points[values < 0.0]
    is_inside = np.ones(len(infeasible), bool)
    while is_inside.any() and len(offsets) < MOST_CUTS:
        near = infeasible[is_inside]
        point = near[np.linalg.norm(near - interior, axis=1).argmin()]
        border = _border(margin, interior, point)
        normal = _outward(margin, interior, border, point)
        ((joint, bound),) = placer.margins((middle + half * (border + BEYOND * (point - border)))[None])[1]
        offset = min(float(normal @ border), float(normal @ point)) - INSIDE
        normals, offsets = np.vstack([normals, normal]), np.append(offsets, offset)
        limits.append((str(joint), str(bound)))
        is_inside &= infeasible @ normal <= offset
    needed = _needed(infeasible @ normals.T > offsets, 2 * k)
    normals, offsets, limits = normals[needed], offsets[needed], [limits[place] for place in needed]
    even = _even(k)
    kept = (even @ normals.T <= offsets).all(axis=1)
    outward = normals / half
    sizes = np.linalg.norm(outward, axis=1)
    return Hull(
        outward / sizes[:, None],
        (offsets + outward @ middle) / sizes,
        middle + half * interior,
        float((margin(even) < 0.0).mean()),
        float(1.0 - kept.mean()),
        tuple(limits),
    )


def _lattice(k: int, random: np.random.Generator) -> Floats:
    """Points of the box [-1, 1]^k, its border included: a lattice of up to three axes, else random ones."""
    if k > 3:
        return random.uniform(-1.0, 1.0, (POINTS, k))
    axis = np.linspace(-1.0, 1.0, round(POINTS ** (1.0 / k)))
    return np.stack(np.meshgrid(*[axis] * k, indexing="ij"), axis=-1).reshape(-1, k)


def _even(k: int) -> Floats:
    """Points that fill the box [-1, 1]^k evenly, across any direction: multiples of a generalised golden ratio."""
    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (k + 1))
    steps = ratio ** -np.arange(1.0, k + 1.0)
    return np.asarray(2.0 * ((0.5 + np.arange(POINTS)[:, None] * steps) % 1.0) - 1.0)


def _needed(cut: Mask, n_box: int) -> list[int]:
    """Places of half-spaces without which a point would not be cut off, of (points, m), and of those of the box."""
    counts, needed = cut.sum(axis=1), list(range(n_box))
    for place in range(n_box, cut.shape[1]):
        if (counts[cut[:, place]] > 1).all():
            counts -= cut[:, place]
        else:
            needed.append(place)
    return needed


def _border(margin: Any, inside: Floats, outside: Floats) -> Floats:
    """A point on the way from a feasible point to one that is not at which the margin first changes its sign."""
    near, far = 0.0, 1.0
    for _ in range(ROUNDS):
        shares = np.linspace(near, far, SHARES)
        is_feasible = margin(inside + shares[:, None] * (outside - inside)) >= 0.0
        is_feasible[0], is_feasible[-1] = True, False
        first = int(is_feasible.argmin())
        near, far = shares[first - 1], shares[first]
    return np.asarray(inside + near * (outside - inside))


def _outward(margin: Any, interior: Floats, border: Floats, point: Floats) -> Floats:
    """The unit normal of the border, by border points around; the way to the point where this does not part the two.

    The margin's slope is no measure of it: within the border another limit may be the nearest.
    """
    way = (point - interior) / np.linalg.norm(point - interior)
    across = np.linalg.svd(way[None])[2][1:]
    reach = np.linalg.norm(border - interior)
    tangents = [
        _border(margin, interior, interior + FARTHER * (border + reach * side - interior))
        - _border(margin, interior, interior + FARTHER * (border - reach * side - interior))
        for side in AROUND * across
    ]
    normal = np.linalg.svd(np.reshape(tangents, (-1, len(way))))[2][-1]
    normal = normal * np.sign(normal @ way)
    return np.asarray(normal if normal @ way > STEEP else way)


AROUND = 1e-2
"""Distance of border points by which its direction is told, as a share of that from the interior."""

FARTHER = 1.5
"""Length of lines beside a border point on which the border is searched for, in distances from the interior."""

STEEP = 0.1
"""Cosine between the way out and the border's normal below which the latter is not used: the border has a kink."""
