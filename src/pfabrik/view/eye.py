"""The direction that pictures are seen from: orthographic, given by name or angles, or chosen by a machine's shape."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Real

import numpy as np

from ..common.arrays import Floats
from ..common.drawing import View
from ..errors import InvalidArgument

"""A direction by name, or as elevation above the level and azimuth about the upright axis [deg]."""

VIEWS: dict[str, tuple[float, float]] = {
    "top": (90.0, -90.0),
    "front": (0.0, -90.0),
    "side": (0.0, 0.0),
    "iso": (float(np.degrees(np.arcsin(1.0 / np.sqrt(3.0)))), -45.0),
}
"""Elevation and azimuth of each name [deg]: x to the right from above and in front, y to the right from the side."""

USUAL = (22.0, -58.0)
"""Elevation and azimuth where no other shows more [deg]."""

ELEVATIONS = (12.0, 18.0, 24.0, 30.0)
"""Elevations tried for a machine [deg]: from higher up it looks flat."""

TURN, OFF_AXES = 10.0, 12.0
"""Step of the azimuths that are tried, and their least distance from an axis [deg]: along it another one is a point."""

APART, LONG = 0.08, 0.6
"""Distance of two joints on the screen from which on they are apart, as a share of the machine's extent; share of its
length that a link is long enough with."""

WEIGHTS = {"apart": 2.0, "long": 0.7, "area": 0.8, "crossings": -0.35, "turn": -0.35}
"""Of the mean share of `APART` between joints, of the share of `LONG` of the shortest link, of the root of the share of
a square that is covered, of crossings per link, and of the angle from the usual direction [1/rad]."""

SAME = 1e-6
"""Distance up to which two joints are at one place, as a share of the extent."""

MOST = 64
"""Joints, and links, that are compared; of more, every second, third ... is."""


@dataclass(frozen=True)
class Eye:
    """An orthographic eye.

    Attributes
    ----------
    elevation : above the level [deg].
    azimuth : about the upright axis [deg]; 0 looks from the first axis, 90 from the second.
    order : the coordinates that the first, second and upright axis stand for: an even permutation.
    """

    elevation: float
    azimuth: float
    order: tuple[int, int, int] = (0, 1, 2)

    @cached_property
    def axes(self) -> Floats:
        """The directions to the right, up, and towards the eye, unit vectors (3, 3)."""
        up, turn = np.radians([self.elevation, self.azimuth])
        towards = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
        right = np.array([-np.sin(turn), np.cos(turn), 0.0])
        axes = np.empty((3, 3))
        axes[:, list(self.order)] = np.array([right, np.cross(towards, right), towards])
        return axes

    def seen(self, points: Floats) -> Floats:
        """Points (..., 3) as they are seen: to the right, up, and towards the eye, (..., 3)."""
        return np.asarray(points @ self.axes.T)


def upright(names: Sequence[str]) -> tuple[int, int, int]:
    """The order of three coordinates in which z stands upright, if it is one of them."""
    last = list(names).index("z") if "z" in names else 2
    return (last + 1) % 3, (last + 2) % 3, last


def eye_of(view: View, order: tuple[int, int, int] = (0, 1, 2)) -> Eye:
    """The eye of a direction that was asked for.

    Raises
    ------
    InvalidArgument : no such name, and no elevation and azimuth.
    """
    if isinstance(view, str) and view in VIEWS:
        return Eye(*VIEWS[view], order)
    if not isinstance(view, str) and isinstance(view, Sequence) and len(view) == 2 and all(map(_is_angle, view)):
        elevation, azimuth = map(float, view)
        if abs(elevation) <= 90.0:
            return Eye(elevation, azimuth, order)
    names = ", ".join(f"'{name}'" for name in VIEWS)
    raise InvalidArgument("view", repr(view), f"{names}, or (elevation from -90 to 90, azimuth) in degrees")


def eye_on(plane: Floats) -> Eye:
    """The eye that looks straight at a plane, of directions to the right and up (2, 3) as `plane_of` returns."""
    x, y, z = np.cross(*plane).tolist()
    level = float(np.hypot(x, y))
    azimuth = float(np.degrees(np.arctan2(y, x))) if level > SAME else VIEWS["top"][1]
    return Eye(float(np.degrees(np.arctan2(z, level))), azimuth)


def _is_angle(value: object) -> bool:
    return not isinstance(value, bool) and isinstance(value, Real) and bool(np.isfinite(float(value)))


def eye_for(points: Floats, links: Floats) -> Eye:
    """The eye that shows a machine best: joints apart, links long, few crossings, not far from the usual direction.

    Parameters
    ----------
    points, links : joints (n, 3), and both ends of straight links (k, 2, 3) [length].
    """
    extent = float(np.ptp(points, axis=0).max())
    if not extent > 0.0:
        return Eye(*USUAL)
    points, links = (each[:: -(-len(each) // MOST) or 1] / extent for each in (points, links))
    points = np.unique((points / SAME).round(), axis=0) * SAME
    links = links[np.linalg.norm(links[:, 1] - links[:, 0], axis=1) > SAME]
    return best_of(ELEVATIONS, -175.0, lambda eye: _score(eye, points, links))


def best_of(
    elevations: Sequence[float], first: float, score: Callable[[Eye], float], order: tuple[int, int, int] = (0, 1, 2)
) -> Eye:
    """The eye with the highest score, at some elevations and at azimuths all round from a first one [deg]."""
    azimuths = [turn for turn in np.arange(first, 185.0, TURN) if abs((turn + 45.0) % 90.0 - 45.0) >= OFF_AXES]
    eyes = [Eye(up, float(turn), order) for up in elevations for turn in azimuths]
    return max(eyes, key=lambda eye: round(score(eye), 9))


def _score(eye: Eye, points: Floats, links: Floats) -> float:
    flat, ends = eye.seen(points)[:, :2], eye.seen(links)[..., :2]
    gaps = np.linalg.norm(flat[:, None] - flat, axis=2)
    np.fill_diagonal(gaps, APART)
    shown = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / np.linalg.norm(links[:, 1] - links[:, 0], axis=1)
    usual = Eye(*USUAL).axes[2]
    parts = {
        "apart": float(np.minimum(gaps.min(axis=1), APART).mean()) / APART,
        "long": min(float(shown.min(initial=LONG)), LONG) / LONG,
        "area": float(np.sqrt(np.prod(np.ptp(flat, axis=0)))),
        "crossings": np.count_nonzero(np.triu(crosses(ends))) / max(len(ends), 1),
        "turn": float(np.arccos(np.clip(eye.axes[2] @ usual, -1.0, 1.0))),
    }
    return sum(WEIGHTS[name] * value for name, value in parts.items())


def crosses(ends: Floats) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """Mask (k, k) of the pairs of straight lines in a plane, (k, 2, 2), that cross between their ends."""
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    to = ends[None] - start[:, None, None]  # from the start of one to both ends of another
    sides = along[:, None, None, 0] * to[..., 1] - along[:, None, None, 1] * to[..., 0]
    parted = (sides[..., 0] * sides[..., 1]) < -(SAME**2)
    return np.asarray(parted & parted.T)
