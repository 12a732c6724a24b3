"""Forward kinematics in closed form, as a check on the library's own; no code is shared with it.

Each function returns *every* real solution for one set of actuator values, limits aside. Lengths are in the machine's
unit, angles in radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pfabrik.machine.description.mechanism import Mechanism

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Planar3RPR:
    """A triangle on three struts in the plane, in the terms of Sauer, Numerical Analysis, Reality Check 1.

    The struts start at (0, 0), (x1, 0) and (x2, y2) and end at the corners of the triangle: (x, y), the corner at
    distance L3 in direction theta, and the corner at distance L2 in direction theta + gamma. L1, the side between the
    last two, follows and is not used.
    """

    L2: float
    L3: float
    gamma: float
    x1: float
    x2: float
    y2: float
    L1: float = 0.0

    @property
    def anchors(self) -> Array:
        """Feet of the struts, (3, 2)."""
        return np.array([[0.0, 0.0], [self.x1, 0.0], [self.x2, self.y2]])

    def corners(self, theta: float, x: float, y: float) -> Array:
        """Heads of the struts, (3, 2)."""
        arms = [(0.0, 0.0), (self.L3, theta), (self.L2, theta + self.gamma)]
        return np.array([(x + length * np.cos(angle), y + length * np.sin(angle)) for length, angle in arms])

    def lengths(self, theta: float, x: float, y: float) -> Array:
        """Lengths of the struts, (3,): the inverse kinematics."""
        return np.linalg.norm(self.corners(theta, x, y) - self.anchors, axis=1)

    def _numerators(self, theta: Array | float, p: Sequence[float]) -> tuple[Array, Array, Array]:
        """N1, N2 and D of x = N1 / D and y = N2 / D, which follow from theta by differences of the circles."""
        a, b = self.L3 * np.cos(theta) - self.x1, self.L3 * np.sin(theta)
        c = self.L2 * np.cos(theta + self.gamma) - self.x2
        d = self.L2 * np.sin(theta + self.gamma) - self.y2
        r, s = (p[1] ** 2 - p[0] ** 2 - a**2 - b**2) / 2, (p[2] ** 2 - p[0] ** 2 - c**2 - d**2) / 2
        return d * r - b * s, a * s - c * r, a * d - b * c

    def solutions(self, p: Sequence[float]) -> list[tuple[float, float, float]]:
        """All (theta, x, y) with strut lengths p.

        What is left of the first circle, N1^2 + N2^2 - p1^2 D^2, is a trigonometric polynomial of degree three in
        theta: its roots are those of a sextic on the unit circle.
        """
        N1, N2, D = self._numerators(2.0 * np.pi * np.arange(8) / 8.0, p)
        harmonics = np.fft.fft(N1**2 + N2**2 - (p[0] * D) ** 2)
        roots = np.roots(harmonics[[3, 2, 1, 0, -1, -2, -3]])
        angles = np.sort(np.angle(roots[np.abs(np.abs(roots) - 1.0) < 1e-7]))
        N1, N2, D = self._numerators(angles, p)
        return list(zip(angles.tolist(), (N1 / D).tolist(), (N2 / D).tolist(), strict=True))


def five_bar_tips(mechanism: Mechanism, actuators: Sequence[float]) -> list[Array]:
    """The tip's positions (0, 1 or 2 of them) of a 5-bar with its two driven joints on the base: two circles."""
    tip = mechanism.joint(mechanism.end_effector)
    elbows, radii = [], []
    for name, value in zip(mechanism.actuator_names, actuators, strict=True):
        crank = mechanism.joint(name)
        (elbow,) = (each for each in mechanism.joints if crank.connects[1] in each.connects and each.name != name)
        turn = Rotation.from_rotvec((value - crank.home) * np.array(crank.axis))
        elbows.append(np.array(crank.at) + turn.apply(np.subtract(elbow.at, crank.at)))
        radii.append(float(np.linalg.norm(np.subtract(tip.at, elbow.at))))
    return circles_meet(elbows[0], radii[0], elbows[1], radii[1], np.array(tip.axis))


def circles_meet(first: Array, r1: float, second: Array, r2: float, normal: Array) -> list[Array]:
    """Points common to two circles of one plane: none, one where they touch, or two."""
    line = second - first
    distance = np.linalg.norm(line)
    along = (distance**2 + r1**2 - r2**2) / (2 * distance)
    square = r1**2 - along**2
    if square < 0:
        return []
    ahead = line / distance
    aside, middle = np.cross(normal, ahead) * np.sqrt(square), first + along * ahead
    return [middle + aside, middle - aside] if square > 0 else [middle]
