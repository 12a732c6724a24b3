"""The direction that a machine in space is viewed from, chosen by its shape."""

from __future__ import annotations

import numpy as np

from .arrays import Floats

ELEVATION, AZIMUTH = 22.0, -58.0
"""Direction that is taken where no other shows more [deg]."""

ELEVATIONS = (12.0, 22.0, 32.0, 42.0, 52.0)
AZIMUTHS = tuple(range(-175, 185, 13))
"""Directions that are tried [deg]; none along an axis of the base, where another axis would be a point."""

CLOSE = 0.08
"""Distance on the screen from which on two joints are apart, as a share of the machine's largest extent."""

AREA, TURN = 0.8, 0.28
"""Weights of the share of a square that the machine covers, and of the angle from the usual direction [1/rad],
against the mean share of `CLOSE` that joints are apart."""

SAME = 1e-6
"""Distance up to which two joints are at one place, as a share of the largest extent."""

MOST_POINTS = 64
"""Points that are compared; of more, every second, third ... is."""


def viewpoint(points: Floats) -> tuple[float, float]:
    """Elevation and azimuth [deg] from which points (n, 3) are apart from each other and cover most of the picture.

    So a flat machine is looked at along the direction in which it is thin, and a machine of equal sides from the usual
    direction.
    """
    points = points[:: -(-len(points) // MOST_POINTS)]
    extent = float(np.ptp(points, axis=0).max())
    if not extent > 0.0:
        return ELEVATION, AZIMUTH
    places = np.unique((points / extent / SAME).round().astype(np.int64), axis=0)
    shares = np.asarray(places * SAME, np.float64)
    usual = _towards(ELEVATION, AZIMUTH)
    views = [(ELEVATION, AZIMUTH), *((up, float(round_)) for up in ELEVATIONS for round_ in AZIMUTHS)]
    return max(views, key=lambda view: round(_score(shares, view, usual), 9))


def directions(elevation: float, azimuth: float) -> Floats:
    """The directions to the right and up on the screen, unit vectors (2, 3)."""
    right = np.array([-np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth)), 0.0])
    return np.array([right, np.cross(_towards(elevation, azimuth), right)])


def _towards(elevation: float, azimuth: float) -> Floats:
    """The unit vector from the machine to the eye."""
    up, turn = np.radians(elevation), np.radians(azimuth)
    return np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])


def _score(points: Floats, view: tuple[float, float], usual: Floats) -> float:
    flat = points @ directions(*view).T
    apart = np.linalg.norm(flat[:, None] - flat, axis=2)
    np.fill_diagonal(apart, np.inf)
    nearest = np.minimum(apart.min(axis=1), CLOSE) / CLOSE
    area = float(np.prod(np.ptp(flat, axis=0)))
    turn = float(np.arccos(np.clip(_towards(*view) @ usual, -1.0, 1.0)))
    return float(nearest.mean()) + AREA * area - TURN * turn
