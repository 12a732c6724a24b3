"""The joint coordinates that a machine has in home's assembly mode: they end at parallel singularities."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from ..arrays import Floats, Mask
from ..motion.displacements import actuator_units
from .task_path import Coordinates

ON_THE_WAY = 16
"""Points on the way from home, up to half a turn of it, at which it is asked if a singularity was passed."""

TRIED = 512
"""Coordinates within the ranges by which it is told if there is a singularity at all."""

TURN = 2.0 * np.pi

HALVINGS = 40
"""Halvings of a way to its last point before a singularity: to rounding."""


class AssemblyMode:
    """The coordinates q that a motion straight from home leads to without passing a parallel singularity.

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

    def margins(self, q: Floats) -> Floats:
        """The least gain dx/dq of rows (n, k), (n,) [L, rad]; negative beyond, inf where loops do not close."""
        if not self._is_square:
            return np.full(len(q), np.inf)
        scaled = self._scaled(q)
        closes = np.isfinite(scaled[:, 0, 0])
        margins = np.full(len(q), np.inf)
        margins[closes] = np.linalg.svd(scaled[closes], compute_uv=False)[:, -1]
        return np.where(self.are_beyond(q), -np.where(closes, margins, 0.0), margins)

    def are_beyond(self, q: Floats) -> Mask:
        """True for rows (n, k) that no straight motion from home leads to, by singularities or turns, (n,)."""
        if not self._is_square or not self._are_any:
            return np.zeros(len(q), bool)
        way = q - self._coordinates.home
        halves = np.maximum(1.0, np.abs(way[:, list(self._coordinates.is_angle)]).max(axis=1, initial=0.0) / np.pi)
        beyond = self._signs(q) < 0.0
        n = ON_THE_WAY * int(np.ceil(halves.max(initial=1.0)))
        for share in np.arange(1, n) / n:
            rows = np.flatnonzero(~beyond)
            signs = self._signs(self._coordinates.home + share * way[rows])
            beyond[rows] = (signs < 0.0) | (np.isnan(signs) & (halves[rows] > 1.0))  # a turn has to close all the way
        return beyond

    def ends(self, q: Floats) -> Floats:
        """The last points (n, k) of straight motions from home to rows that are beyond."""
        home, near, far = self._coordinates.home, np.zeros((len(q), 1)), np.ones((len(q), 1))
        for _ in range(HALVINGS):
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
