"""The acceleration of a platform along a path: of its reference point, and angular."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from ...answers.differential import forward_jacobian
from ...answers.solution import Solution
from ...common.arrays import Floats
from ...errors import InvalidArgument
from .curve import Spline

Rows: TypeAlias = tuple[Floats, Floats, Floats, Floats]
"""Limits by s'' and by s'^2, the most, and what is held at rest, (n, m) each."""

DIRECTIONS = 8
"""Directions, over half a turn, in which an acceleration is limited at first."""

UPRIGHT = 1e-6
"""Cosine of the angle to the path below which a direction is square to it: what s'' adds there is rounding."""


def beside(one: Floats, other: Floats) -> Floats:
    """Columns of two arrays, (n, m) and (n, k), as kernels take them."""
    return np.ascontiguousarray(np.hstack([one, other]))


class TwistParts(NamedTuple):
    """Accelerations a = along s'' + across s'^2 of a platform at n places, (n, 2, 3): of its reference point, angular.

    What of them is limited, an ellipse in (s'', s'^2), lies in the plane of the two vectors.
    """

    along: Floats
    across: Floats

    def sizes(self, speeds: Floats, pushes: Floats) -> Floats:
        """Sizes of both accelerations at s' and s'', (n,) each, (n, 2)."""
        speeds, pushes = speeds[:, None, None], pushes[:, None, None]
        return np.asarray(np.linalg.norm(self.along * pushes + self.across * speeds**2, axis=2))

    def in_plane(self) -> tuple[Floats, Floats, Floats]:
        """The size of `along`, and what `across` is along it and square to it, (n, 2) each."""
        sizes = np.linalg.norm(self.along, axis=2)
        unit = np.divide(self.along, sizes[..., None], out=np.zeros_like(self.along), where=sizes[..., None] > 0.0)
        level = (unit * self.across).sum(axis=2)
        return sizes, level, np.linalg.norm(self.across - level[..., None] * unit, axis=2)


class PlatformPath:
    """The twists J q' of a platform at s' = 1, and their change J q'' + J' q', with J a spline along the path.

    Attributes
    ----------
    s : the places between which it is a spline, (k,).
    limits : of the acceleration of the reference point, and of the angular one, (2,).
    """

    def __init__(
        self, limits: Floats, solution_at: Callable[[Floats], Solution], s: Floats, known: Floats | None = None
    ) -> None:
        """Take the Jacobians at places s (k,), in their order, or those that are known, (k, 6 n_a)."""
        self.s, self.limits, self._solution_at = s, limits, solution_at
        self._jacobians = self._at(s) if known is None else known
        self._spline = Spline.through(s, self._jacobians)

    def _at(self, s: Floats) -> Floats:
        solution = self._solution_at(s)
        found = np.zeros((len(s), 6, len(solution.mechanism.actuator_names)))
        found[:, : 3 if solution.mechanism.end_effector_is_joint else 6] = forward_jacobian(solution)
        if not np.isfinite(found).all():
            raise InvalidArgument("track", "a path on which the platform's speed is unknown", "one that drives hold")
        return found.reshape(len(s), -1)

    def with_places(self, more: Floats) -> PlatformPath:
        """The path with Jacobians at more places."""
        s = np.append(self.s, more)
        order = np.argsort(s, kind="stable")
        known = np.concatenate([self._jacobians, self._at(more)])[order]
        return PlatformPath(self.limits, self._solution_at, s[order], known)

    def at(self, s: Floats, slopes: Floats, bends: Floats) -> TwistParts:
        """The parts at s (n,), where the actuators have these first and second derivatives, (n, n_a)."""
        J, change = (self._spline.at(s, order).reshape(len(s), 2, 3, -1) for order in (0, 1))
        along, across = (np.einsum("nkia,na->nki", J, x) for x in (slopes, bends))
        return TwistParts(along, across + np.einsum("nkia,na->nki", change, slopes))


class PlatformRows:
    """The acceleration of a platform at the points of a grid, as limits in directions of which there may be more.

    Attributes
    ----------
    by_push, by_speed, most : of the limits, (n, m), as kernels take them.
    """

    def __init__(self, parts: TwistParts, limits: Floats) -> None:
        self._parts, self._limited = parts, np.flatnonzero(np.isfinite(limits))
        self._limits, self._plane = limits[self._limited], [each[:, self._limited] for each in parts.in_plane()]
        n, angles = len(parts.along), np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        self.by_push = self.by_speed = self.most = np.zeros((n, 0))
        for angle in angles:
            self._add(np.full((n, len(self._limited)), angle))

    def _add(self, angles: Floats) -> None:
        sizes, level, square = self._plane
        cosine = np.cos(angles)
        cosine[np.abs(cosine) < UPRIGHT] = 0.0
        self.by_push = np.hstack([self.by_push, cosine * sizes])
        self.by_speed = np.hstack([self.by_speed, cosine * level + np.sin(angles) * square])
        self.most = np.hstack([self.most, np.broadcast_to(self._limits, angles.shape)])

    def beside(self, by_push: Floats, by_speed: Floats, most: Floats, held: Floats) -> Rows:
        """Other limits and these, as kernels take them."""
        none = np.zeros(self.most.shape)
        return (
            beside(by_push, self.by_push), beside(by_speed, self.by_speed), beside(most, self.most), beside(held, none)
        )  # fmt: skip

    def shares(self, s: Floats, x: Floats) -> Floats:
        """The largest share of a limit at the ends of each cell of the grid, (n - 1,)."""
        pushes, found = np.diff(x) / (2.0 * np.diff(s)), np.zeros(len(s) - 1)
        for ends in (slice(None, -1), slice(1, None)):
            parts = TwistParts(self._parts.along[ends], self._parts.across[ends])
            sizes = parts.sizes(np.sqrt(x[ends]), pushes)[:, self._limited]
            found = np.maximum(found, (sizes / self._limits).max(axis=1))
        return found

    def add_directions(self, s: Floats, x: Floats) -> None:
        """Limit the accelerations in the directions that they have at each point before it, and behind it."""
        sizes, level, square = self._plane
        pushes = np.diff(x) / (2.0 * np.diff(s))
        for push in (np.append(pushes, pushes[-1:]), np.append(pushes[:1], pushes)):
            self._add(np.arctan2(square * x[:, None], sizes * push[:, None] + level * x[:, None]))
