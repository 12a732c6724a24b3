"""Newton's method on strut lengths in plain NumPy, as one would write it for a known hexapod: no joints, no limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class StrutNewton:
    """Poses of a platform on six struts whose lengths are known, many at once, by Newton steps on the pose.

    Parameters
    ----------
    feet : in the base frame, (6, 3).
    tops : in the platform's own frame, (6, 3).
    """

    def __init__(self, feet: Array, tops: Array) -> None:
        self.feet, self.tops = feet, tops
        self.size = float(np.abs(feet).max())

    def solve(self, lengths: Array, start: Array, steps: int = 20) -> tuple[Array, Array]:
        """Poses (n, 4, 4) with strut lengths (n, 6), from poses `start` (n, 4, 4) or (4, 4); the largest error of each.

        A row rests once it is within 1e-12 of the machine's size; `steps` at most, none longer than half that size or
        half a radian.
        """
        poses = np.array(np.broadcast_to(start, (len(lengths), 4, 4)))
        errors, rows = np.full(len(lengths), np.inf), np.arange(len(lengths))
        for _ in range(steps):
            T = poses[rows]
            arms = self.tops @ np.swapaxes(T[:, :3, :3], 1, 2)
            lines = arms + T[:, None, :3, 3] - self.feet
            present = np.linalg.norm(lines, axis=2)
            errors[rows] = np.abs(present - lengths[rows]).max(axis=1)
            going = errors[rows] > 1e-12 * self.size
            rows, T, arms, lines, present = (each[going] for each in (rows, T, arms, lines, present))
            if not len(rows):
                break
            lines /= present[:, :, None]
            matrices = np.concatenate([lines, np.cross(arms, lines) / self.size], axis=2)
            twists = np.linalg.solve(matrices, (lengths[rows] - present)[:, :, None])[..., 0] / self.size
            twists *= np.minimum(1.0, 0.5 / np.maximum(np.abs(twists).max(axis=1), 1e-300))[:, None]
            poses[rows, :3, 3] += self.size * twists[:, :3]
            poses[rows, :3, :3] = _rotations(twists[:, 3:]) @ T[:, :3, :3]
        return poses, errors

    def modes(self, lengths: Array, starts: int, rng: np.random.Generator) -> Array:
        """All poses (k, 4, 4) that random starts lead to, each once, for one set of lengths (6,)."""
        start = np.tile(np.eye(4), (starts, 1, 1))
        start[:, :3, 3] = rng.normal(0.0, self.size, (starts, 3))
        start[:, :3, :3] = np.linalg.qr(rng.normal(size=(starts, 3, 3)))[0]
        start[:, :3, 0] *= np.linalg.det(start[:, :3, :3])[:, None]
        poses, error = self.solve(np.tile(lengths, (starts, 1)), start, steps=60)
        found: list[Array] = []
        for pose in poses[error <= 1e-9 * self.size]:
            if not found or np.abs(np.array(found) - pose).max(axis=(1, 2)).min() > 1e-5:
                found.append(pose)
        return np.array(found).reshape(-1, 4, 4)


def _rotations(vectors: Array) -> Array:
    """Rotation matrices (n, 3, 3) of rotation vectors (n, 3) [rad]."""
    angles = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    K = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    sine, versine = np.sinc(angles / np.pi), 0.5 * np.sinc(angles / (2.0 * np.pi)) ** 2
    turned: Array = np.eye(3) + sine * K + versine * (K @ K)
    return turned
