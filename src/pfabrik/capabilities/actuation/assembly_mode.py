"""The joint coordinates that a machine has in home's assembly mode: they end at parallel singularities."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from ...kinematics import actuator_units
from .task_path import Coordinates

ON_THE_WAY = 16
"""Points on a way from home, up to half a turn of it, at which it is asked if a singularity was passed."""

TRIED = 512
"""Coordinates within the ranges by which it is told if there is a singularity at all."""

TURN = 2.0 * np.pi

HALVINGS = 40
"""Halvings of a way to its last point before a singularity: to rounding."""


class AssemblyMode:
    """The coordinates q that a motion from home leads to without passing a parallel singularity: straight, or by axes.

    There actuators lose their hold: det dx/dq is 0, and has the other sign beyond. What is behind it is another
    assembly for the same actuators. Of redundant actuators a single determinant does not tell, and nothing is beyond.

    Parameters
    ----------
    slopes : of coordinates (n, k), dx/dq (n, n_a, k) in home's working mode; NaN where loops do not close.
    """

    def __init__(self, coordinates: Coordinates, slopes: Callable[[Floats], Floats]) -> None:
        self._coordinates = coordinates
        self._units = np.where(coordinates.is_angle, 1.0, coordinates.mechanism.characteristic_length)
        self._actuator_units, self._slopes = actuator_units(coordinates.mechanism), slopes
        self._is_square = len(coordinates.mechanism.actuator_names) == len(coordinates.names)

    def margins(self, q: Floats, least: float) -> Floats:
        """The least gain dx/dq of rows (n, k), (n,) [L, rad]; negative beyond; inf if above `least` or loops are open.

        It is no less than the determinant over the other gains, none of which is above the norm.
        """
        margins = np.full(len(q), np.inf)
        if not self._is_square:
            return margins
        scaled, beyond = self._scaled(q), self.are_beyond(q)
        with np.errstate(invalid="ignore"):
            others = np.linalg.norm(scaled, axis=(1, 2)) ** (scaled.shape[2] - 1)
            small = np.abs(np.linalg.det(scaled)) <= least * others
        rows = np.flatnonzero(small | (beyond & np.isfinite(scaled[:, 0, 0])))
        margins[rows] = np.linalg.svd(scaled[rows], compute_uv=False)[:, -1]
        return np.where(beyond, -np.where(np.isfinite(margins), margins, 0.0), margins)

    def are_beyond(self, q: Floats, *, close: bool = False) -> Mask:
        """True for rows (n, k) at which loops close, but to which no such motion leads, (n,).

        Parameters
        ----------
        close : loops close at all rows, also where slopes do not tell, next to dead points.
        """
        beyond = np.zeros(len(q), bool)
        if not self._is_square or not self._are_any:
            return beyond
        signs = self._signs(q)
        pending = np.flatnonzero((signs > 0.0) | (close & np.isnan(signs)))
        for order in (None, np.arange(q.shape[1]), np.arange(q.shape[1])[::-1]):
            pending = pending[~self._is_clear(q[pending], order)]
        beyond[pending] = True
        return np.asarray(beyond | (signs < 0.0))

    def _is_clear(self, q: Floats, order: Ints | None) -> Mask:
        """True for rows (n, k) to which all coordinates at once, or one by one in an order, can be moved from home."""
        way, clear = q - self._coordinates.home, np.ones(len(q), bool)
        halves = np.abs(way[:, list(self._coordinates.is_angle)]).max(initial=np.pi) / np.pi
        n = ON_THE_WAY * int(np.ceil(halves)) * (1 if order is None else len(order))
        for share in np.arange(1, n) / n:
            parts = share if order is None else np.clip(len(order) * share - order, 0.0, 1.0)
            rows = np.flatnonzero(clear)
            if not len(rows):
                break
            clear[rows] = self._signs(self._coordinates.home + parts * way[rows]) > 0.0
        return clear

    def ends(self, q: Floats) -> Floats:
        """The last points (n, k) of straight motions from home to rows that are beyond."""
        home, near, far = self._coordinates.home, np.zeros((len(q), 1)), np.ones((len(q), 1))
        for _ in range(HALVINGS if len(q) else 0):
            middle = 0.5 * (near + far)
            beyond = self.are_beyond(home + middle * (q - home))[:, None]
            near, far = np.where(beyond, near, middle), np.where(beyond, middle, far)
        return np.asarray(home + near * (q - home))

    @cached_property
    def _are_any(self) -> bool:
        """True if a singularity is within the ranges, as far as was tried, or these have several turns."""
        own = self._coordinates
        low = np.where(np.isfinite(own.low), own.low, own.home - self._units)
        high = np.where(np.isfinite(own.high), own.high, own.home + self._units)
        if (np.where(own.is_angle, high - low, 0.0) > TURN).any():
            return True
        return bool((self._signs(np.random.default_rng(0).uniform(low, high, (TRIED, len(low)))) < 0.0).any())

    @cached_property
    def _home_sign(self) -> float:
        return float(np.sign(np.linalg.det(self._scaled(self._coordinates.home[None])))[0])

    def _signs(self, q: Floats) -> Floats:
        """1 on home's side of parallel singularities, -1 on the other, NaN where loops do not close, (n,)."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sign(np.linalg.det(self._scaled(q))) * self._home_sign)

    def _scaled(self, q: Floats) -> Floats:
        return self._slopes(q) * (self._units / self._actuator_units[:, None])
