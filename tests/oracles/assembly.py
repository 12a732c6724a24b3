"""Forward kinematics in closed form or by brute force, as a check on the library's own; no code is shared with it.

Each function answers for one set of actuator values and returns *every* real solution it finds, limits aside. Where
that is a multi-start search, the count is what the starts have seen: it can only be too small. Lengths are in the
machine's unit, angles in radians.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pfabrik.description.mechanism import Mechanism

Array = NDArray[np.float64]

SAME = 1e-6
"""Largest difference of any entry of two poses, lengths relative to the machine's size, that still counts as one."""


# --- planar 3-RPR: Sauer, Numerical Analysis, Reality Check 1 --------------------------------------------------------


class Planar3RPR:
    """A triangle on three struts in the plane, in Sauer's terms.

    The struts start at (0, 0), (x1, 0) and (x2, y2) and end at the corners of the triangle: (x, y), the corner at
    distance L3 in direction theta, and the corner at distance L2 in direction theta + gamma. L1, the side between the
    last two, follows and is not used.

    With theta given, the differences of the three circles' equations are linear in (x, y); what is left of the first
    circle is f(theta) = N1^2 + N2^2 - p1^2 D^2, whose roots are the solutions: a trigonometric polynomial of degree
    three, so there are at most six.
    """

    def __init__(self, L2: float, L3: float, gamma: float, x1: float, x2: float, y2: float, L1: float = 0.0) -> None:
        self.L2, self.L3, self.gamma = L2, L3, gamma
        self.x1, self.x2, self.y2 = x1, x2, y2

    @property
    def anchors(self) -> Array:
        """Feet of the struts, (3, 2)."""
        return np.array([[0.0, 0.0], [self.x1, 0.0], [self.x2, self.y2]])

    def corners(self, theta: float, x: float, y: float) -> Array:
        """Heads of the struts, (3, 2)."""
        turned = theta + self.gamma
        offsets = [
            (0.0, 0.0),
            (self.L3 * np.cos(theta), self.L3 * np.sin(theta)),
            (self.L2 * np.cos(turned), self.L2 * np.sin(turned)),
        ]
        return np.array([x, y]) + np.array(offsets)

    def lengths(self, theta: float, x: float, y: float) -> Array:
        """Lengths of the struts, (3,): the inverse kinematics."""
        return np.linalg.norm(self.corners(theta, x, y) - self.anchors, axis=1)

    def _terms(self, theta: Array, p: Sequence[float]) -> tuple[Array, ...]:
        """Rows (A2, B2), (A3, B3) and right-hand sides of the two linear equations in (x, y)."""
        A2, B2 = self.L3 * np.cos(theta) - self.x1, self.L3 * np.sin(theta)
        A3 = self.L2 * np.cos(theta + self.gamma) - self.x2
        B3 = self.L2 * np.sin(theta + self.gamma) - self.y2
        r2 = (p[1] ** 2 - p[0] ** 2 - A2**2 - B2**2) / 2
        r3 = (p[2] ** 2 - p[0] ** 2 - A3**2 - B3**2) / 2
        return A2, B2, A3, B3, r2, r3

    def f(self, theta: Array, p: Sequence[float]) -> Array:
        """N1^2 + N2^2 - p1^2 D^2 (all over 4)."""
        A2, B2, A3, B3, r2, r3 = self._terms(np.asarray(theta, dtype=float), p)
        return (B3 * r2 - B2 * r3) ** 2 + (A2 * r3 - A3 * r2) ** 2 - (p[0] * (A2 * B3 - B2 * A3)) ** 2

    def roots(self, p: Sequence[float], samples: int = 20_000) -> list[float]:
        """Roots of f on a turn: sign changes bisected; smallest values of |f| between samples, where f touches zero.

        Touching means below 1e-12 of the largest |f|: two roots closer than about 1e-6 rad are one.
        """
        grid = -np.pi + 2 * np.pi * (np.arange(samples + 1) + 0.5) / samples
        values = self.f(grid, p)
        scale = np.abs(values).max()
        found = [self._bisected(grid[k], grid[k + 1], p) for k in np.flatnonzero(values[:-1] * values[1:] < 0)]
        size = np.abs(values)
        dips = 1 + np.flatnonzero((size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:]) & (size[1:-1] < 1e-5 * scale))
        for k in dips:
            if values[k - 1] * values[k] > 0 and values[k] * values[k + 1] > 0:
                found += self._touching(grid[k - 1], grid[k + 1], p, scale)
        return sorted((theta + np.pi) % (2 * np.pi) - np.pi for theta in found)

    def _bisected(self, low: float, high: float, p: Sequence[float]) -> float:
        rising = self.f(high, p) > 0
        for _ in range(80):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if (self.f(middle, p) > 0) == rising else (middle, high)
        return 0.5 * (low + high)

    def _touching(self, low: float, high: float, p: Sequence[float], scale: float) -> list[float]:
        """The double root, or the two roots that a sample missed, or nothing, in a bracket of a smallest |f|."""
        sign = np.sign(self.f(low, p))
        start, end = low, high
        for _ in range(80):
            left, right = start + (end - start) / 3, end - (end - start) / 3
            start, end = (start, right) if sign * self.f(left, p) < sign * self.f(right, p) else (left, end)
        bottom = 0.5 * (start + end)
        if abs(self.f(bottom, p)) < 1e-12 * scale:
            return [bottom]
        if sign * self.f(bottom, p) < 0:
            return [self._bisected(low, bottom, p), self._bisected(bottom, high, p)]
        return []

    def solutions(self, p: Sequence[float]) -> list[tuple[float, float, float]]:
        """All (theta, x, y) with strut lengths p; a double root counts once."""
        found: list[tuple[float, float, float]] = []
        for theta in self.roots(p):
            found += [(theta, x, y) for x, y in self._positions(theta, p)]
        return found

    def _positions(self, theta: float, p: Sequence[float]) -> list[tuple[float, float]]:
        """The positions at a root: one, or where the two lines coincide (D = 0) up to two points of one circle."""
        A2, B2, A3, B3, r2, r3 = self._terms(np.float64(theta), p)
        D, sizes = A2 * B3 - B2 * A3, np.hypot([A2, A3], [B2, B3])
        if abs(D) > 1e-7 * sizes[0] * sizes[1]:
            return [((B3 * r2 - B2 * r3) / D, (A2 * r3 - A3 * r2) / D)]
        a, b, r = (A2, B2, r2) if sizes[0] >= sizes[1] else (A3, B3, r3)
        norm = np.hypot(a, b)
        offset, half = r / norm, np.sqrt(max(p[0] ** 2 - (r / norm) ** 2, 0.0))
        sides = (-1, 1) if half > 0 else (0,)
        points = [((offset * a - s * half * b) / norm, (offset * b + s * half * a) / norm) for s in sides]
        return [xy for xy in points if np.allclose(self.lengths(theta, *xy), p, rtol=1e-6)]


# --- planar 5-bar ----------------------------------------------------------------------------------------------------


def five_bar_tips(mechanism: Mechanism, actuators: Sequence[float]) -> list[Array]:
    """The tip's positions (0, 1 or 2 of them) of a 5-bar with its two driven joints on the base: two circles."""
    tip = mechanism.joint(mechanism.end_effector)
    normal = np.array(tip.axis)
    elbows, radii = [], []
    for name, value in zip(mechanism.actuator_names, actuators, strict=True):
        crank = mechanism.joint(name)
        link = crank.connects[1]
        (elbow,) = (j for j in mechanism.joints if link in j.connects and j.name != name)
        turn = Rotation.from_rotvec((value - crank.home) * np.array(crank.axis))
        elbows.append(np.array(crank.at) + turn.apply(np.subtract(elbow.at, crank.at)))
        radii.append(float(np.linalg.norm(np.subtract(tip.at, elbow.at))))
    return circles_meet(elbows[0], radii[0], elbows[1], radii[1], normal)


def circles_meet(first: Array, r1: float, second: Array, r2: float, normal: Array) -> list[Array]:
    """Points common to two circles of one plane: none, one where they touch, or two."""
    line = second - first
    distance = np.linalg.norm(line)
    along = (distance**2 + r1**2 - r2**2) / (2 * distance)
    square = r1**2 - along**2
    if square < 0:
        return []
    ahead = line / distance
    aside = np.cross(normal, ahead) * np.sqrt(square)
    middle = first + along * ahead
    return [middle + aside, middle - aside] if square > 0 else [middle]


def spheres_meet(centres: Array, radii: Sequence[float]) -> list[Array]:
    """Points common to three spheres: none, one or two, mirrored at the plane of the centres; centres ``(3, 3)``."""
    ex = centres[1] - centres[0]
    d = np.linalg.norm(ex)
    ex = ex / d
    across = centres[2] - centres[0]
    i = across @ ex
    j = np.linalg.norm(across - i * ex)
    ey = (across - i * ex) / j
    x = (radii[0] ** 2 - radii[1] ** 2 + d**2) / (2 * d)
    y = (radii[0] ** 2 - radii[2] ** 2 + i**2 + j**2) / (2 * j) - i / j * x
    square = radii[0] ** 2 - x**2 - y**2
    if square < 0:
        return []
    foot, height = centres[0] + x * ex + y * ey, np.sqrt(square) * np.cross(ex, ey)
    return [foot + height, foot - height] if square > 0 else [foot]


# --- serial planar arm -----------------------------------------------------------------------------------------------


def planar_arm(links: Sequence[float], angles: Sequence[float]) -> tuple[Array, float]:
    """Tip ``(2,)`` and heading of an arm in the plane; each angle counts from the link before, the first from x."""
    headings = np.cumsum(angles)
    return np.array([links @ np.cos(headings), links @ np.sin(headings)]), float(headings[-1])


# --- six struts between two bodies -----------------------------------------------------------------------------------


def gough_modes(
    base: Array, platform: Array, lengths: Sequence[float], starts: int = 1000, seed: int = 0, steps: int = 150
) -> tuple[Array, NDArray[np.int_]]:
    """All poses found of a platform on six struts, ``(k, 4, 4)``, and how many starts ended in each, ``(k,)``.

    Newton from random poses, all starts at once: six equations |t + R b - a|^2 = l^2, unknown t and R, with steps of at
    most half the machine's size or half a radian. Steps that undamped go astray, which is what brings the starts to
    solutions with small basins; a method that descends reaches those a hundred times less often.
    """
    base, platform, lengths = np.array(base, float), np.array(platform, float), np.array(lengths, float)
    rng = np.random.default_rng(seed)
    size = max(np.abs(base - base.mean(0)).max(), np.abs(platform - platform.mean(0)).max(), lengths.max())
    R = Rotation.random(starts, rng).as_matrix()
    t = base.mean(0) + rng.uniform(-1, 1, (starts, 3)) * size - R @ platform.mean(0)
    scale = np.repeat([size, 1.0], 3)
    for _ in range(steps):
        gaps, J = _strut_gaps(base, platform, lengths, t, R)
        J = J * scale / size**2 + 1e-15 * np.eye(6)  # no matrix exactly singular; roots stay where they are
        step = -np.linalg.solve(J, (gaps / size**2)[..., None])[..., 0]
        step *= np.minimum(1.0, 0.5 / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
        step *= scale
        t, R = t + step[:, :3], Rotation.from_rotvec(step[:, 3:]).as_matrix() @ R
    U, _, V = np.linalg.svd(R)
    R = U @ V
    gaps, _ = _strut_gaps(base, platform, lengths, t, R)
    ended = np.abs(gaps).max(axis=1) < 1e-11 * size**2
    return _distinct(t[ended], R[ended], size)


def _strut_gaps(base: Array, platform: Array, lengths: Array, t: Array, R: Array) -> tuple[Array, Array]:
    """Half the excess of the squared lengths ``(n, 6)``, and its derivative by t and a turn, ``(n, 6, 6)``."""
    arms = np.einsum("nij,kj->nki", R, platform)
    struts = t[:, None] + arms - base
    return 0.5 * ((struts**2).sum(axis=2) - lengths**2), np.concatenate([struts, np.cross(arms, struts)], axis=2)


def _distinct(t: Array, R: Array, size: float) -> tuple[Array, NDArray[np.int_]]:
    entries = np.concatenate([t / size, R.reshape(-1, 9)], axis=1)
    kept: list[int] = []
    hits: list[int] = []
    while len(kept) < len(entries):
        seen = np.zeros(len(entries), bool)
        for k in kept:
            seen |= np.abs(entries - entries[k]).max(axis=1) < SAME
        if seen.all():
            break
        kept.append(int(np.flatnonzero(~seen)[0]))
        hits.append(int((np.abs(entries - entries[kept[-1]]).max(axis=1) < SAME).sum()))
    poses = np.tile(np.eye(4), (len(kept), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = R[kept], t[kept]
    return poses, np.array(hits, int)


# --- 3-RPS -----------------------------------------------------------------------------------------------------------


def rps_tops(
    base_radius: float, side: float, lengths: Sequence[float], starts: int = 400, seed: int = 0
) -> list[Array]:
    """Ball joints ``(3, 3)`` of a 3-RPS with feet 120 degrees apart, hinges tangential; every solution found.

    Each strut swings in the upright plane through the axis by an angle, so the unknowns are three angles and the
    equations the three sides of the platform's triangle, all of length `side`.
    """
    azimuth = np.radians([0.0, 120.0, 240.0])
    out = np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=1)
    lengths = np.array(lengths, float)
    rng = np.random.default_rng(seed)
    swing = rng.uniform(-np.pi, np.pi, (starts, 3))
    for _ in range(100):
        tops = _swung(base_radius, out, lengths, swing)
        rates = lengths[:, None] * (-np.sin(swing)[..., None] * out + np.cos(swing)[..., None] * [0, 0, 1.0])
        gaps, J = np.empty((starts, 3)), np.zeros((starts, 3, 3))
        for row, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
            between = tops[:, i] - tops[:, j]
            gaps[:, row] = 0.5 * ((between**2).sum(1) - side**2) / side**2
            J[:, row, i] = (between * rates[:, i]).sum(1) / side**2
            J[:, row, j] = -(between * rates[:, j]).sum(1) / side**2
        step = -np.linalg.solve(J + 1e-15 * np.eye(3), gaps[..., None])[..., 0]
        swing = swing + step * np.minimum(1.0, 0.5 / np.maximum(np.abs(step).max(1), 1e-300))[:, None]
    found: list[Array] = []
    for top in _swung(base_radius, out, lengths, swing[np.abs(gaps).max(axis=1) < 1e-12]):
        if all(np.abs(top - other).max() > SAME * side for other in found):
            found.append(top)
    return found


def _swung(base_radius: float, out: Array, lengths: Array, swing: Array) -> Array:
    reach = np.cos(swing)[..., None] * out + np.sin(swing)[..., None] * [0, 0, 1.0]
    return base_radius * out + lengths[:, None] * reach
