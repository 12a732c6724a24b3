"""The paths of the demo: data, keyed by catalogue file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Circle:
    """A circle in the y-z plane through its centre, traced once from its lowest point.

    Attributes
    ----------
    center : (x, y, z) [length unit of the mechanism].
    radius : in the same unit.
    """

    center: tuple[float, float, float]
    radius: float

    def points(self, count: int) -> NDArray[np.float64]:
        """`count` points (count, 3), evenly spaced; the last one is the first one again."""
        turn = np.linspace(0, 2 * np.pi, count)
        around = np.stack([np.zeros(count), np.sin(turn), -np.cos(turn)], axis=-1)
        return np.asarray(self.center) + self.radius * around


# The circles of the P-FABRIK paper's third experiment [mm]; the upper arc of each is out of reach.
CIRCLES = {
    "five_bar": Circle((0, 0, 200), 60),
    "stewart": Circle((0, 0, 220), 60),
    "nrpm": Circle((0, 0, 200), 100),
}
