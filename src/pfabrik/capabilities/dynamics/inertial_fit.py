"""Least squares of parameters that a physical body must have, and what the data determine of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Mask

RANK = 1e-8
"""Singular value, as a share of the largest, up to which efforts do not depend on a direction of parameters."""

WEAK = 0.1
"""Deviation above which a direction counts as undetermined, as a share of what parameters are expected to be off by."""

OPEN = 1e-5
"""Part of a parameter in directions that are not determined, up to which it counts as determined."""

FIRST = 1e3
"""How much a parameter that is determined alone is preferred to lead a combination."""

SLIGHT = 0.1
"""Share of a combination's deviation up to which a parameter that it depends on is left out, off by all it may be."""

IMPOSSIBLE = 1e-9
"""How negative a mass or a second moment may be by rounding, as a share of the body's."""

STEPS, CLOSE = 10_000, 0.03
"""Steps towards the best physical values at most, and how near they end: of efforts, in standard deviations of all."""

RELAXED = 1.7
"""How much farther than found a step goes: those to bodies at the edge of what is possible are many."""


_R = np.sqrt(0.5)
_SECOND = np.array([[-0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [0.5, 0.5, -0.5]])
TO_DENSITY = np.zeros((10, 10))
"""From the parameters of a body, in its mass and size, to its density matrix in an orthonormal basis."""
TO_DENSITY[0, 0] = 1.0
TO_DENSITY[1:4, 1:4] = np.eye(3) / _R
TO_DENSITY[4:7, 4:7] = _SECOND
TO_DENSITY[7:, 7:] = -np.eye(3) / _R
FROM_DENSITY = np.linalg.inv(TO_DENSITY)

_ROW, _COLUMN = np.array([3, 0, 1, 2, 0, 1, 2, 0, 0, 1]), np.array([3, 3, 3, 3, 0, 1, 2, 1, 2, 2])
_HALF = np.where(_ROW == _COLUMN, 1.0, _R)


def nearest_possible(values: Floats, n_bodies: int) -> tuple[Floats, Floats]:
    """The nearest parameters (p,) that bodies and actuators can have, and how far these are off, (b + drives,).

    A body is physical where its density matrix, the integral of [r; 1] [r; 1]' over its mass, is not negative: where
    its mass and moments of inertia are positive, and none of these is more than the other two together. Parameters of
    actuators are not negative.
    """
    vectors, drives = values[: 10 * n_bodies].reshape(-1, 10), values[10 * n_bodies :]
    matrices = np.zeros((n_bodies, 4, 4))
    matrices[:, _ROW, _COLUMN] = matrices[:, _COLUMN, _ROW] = vectors * _HALF
    sizes, axes = np.linalg.eigh(matrices)
    kept = ((axes * np.maximum(sizes, 0.0)[:, None]) @ np.swapaxes(axes, 1, 2))[:, _ROW, _COLUMN] / _HALF
    return np.append(kept, np.maximum(drives, 0.0)), np.maximum(-np.append(sizes[:, 0], drives), 0.0)


class InertialFit(NamedTuple):
    """Deviations of scaled parameters from those described, as efforts and what is expected have them.

    The scaled parameters are density matrices of bodies, then those of actuators; each is expected to be as described,
    with a deviation of 1.

    Attributes
    ----------
    left, values, right : of the efforts in standard deviations by scaled parameters, their singular values
        (m, k), (k,), (k, p).
    off : what efforts are more than those of the machine as described, in standard deviations, (m,).
    """

    left: Floats
    values: Floats
    right: Floats
    off: Floats

    @property
    def rank(self) -> int:
        """Number of directions that the efforts depend on."""
        return int((self.values > RANK * self.values.max(initial=0.0)).sum())

    @property
    def spare(self) -> int:
        """Number of efforts beyond what determines these."""
        return len(self.off) - self.rank

    def directions(self, deviation: float) -> tuple[Floats, Floats]:
        """Orthonormal directions that the data determine, (r, p), and their deviations, (r,).

        Parameters
        ----------
        deviation : of efforts, in that of `off`.
        """
        rank = self.rank
        spread = deviation / self.values[:rank]
        return self.right[:rank][spread <= WEAK], spread[spread <= WEAK]

    def deviations(self, by_scaled: Floats, deviation: float) -> Floats:
        """Standard deviations of parameters by scaled ones, (p, p): infinite where the data do not determine one."""
        rank, sizes = self.rank, np.linalg.norm(by_scaled, axis=1)
        along = by_scaled @ self.right[:rank].T
        spread = np.linalg.norm(along * (deviation / self.values[:rank]), axis=1)
        outside = np.linalg.norm(by_scaled - along @ self.right[:rank], axis=1)
        return np.where((outside <= OPEN * sizes) & (spread <= WEAK * sizes), spread, np.inf)

    def likeliest(self, deviation: float) -> Floats:
        """What parameters are more than described, (p,), whether or not a body can have them."""
        shares = self.values / (self.values**2 + deviation**2)
        return np.asarray((self.left.T @ self.off * shares) @ self.right)

    def physical(self, described: Floats, n_bodies: int, deviation: float) -> tuple[Floats, Floats]:
        """The likeliest parameters that bodies can have, (p,), and by how much the likeliest of all break that.

        By alternating directions: steps to the likeliest near the point before, then to the nearest physical one.

        Returns
        -------
        values, broken : (p,), (b + drives,).
        """
        found = described + self.likeliest(deviation)
        kept, broken = nearest_possible(found, n_bodies)
        if broken.max(initial=0.0) <= IMPOSSIBLE:
            return found, broken
        weights, pulled = (self.values / deviation) ** 2, (self.left.T @ self.off) * self.values / deviation**2
        stiff = float(np.sqrt(weights.max() + 1.0))  # the pull to the point before: between the stiffest and the rest
        apart = np.zeros(len(found))
        for _ in range(STEPS):
            wanted = stiff * (kept - apart - described)
            along = self.right @ wanted
            inside = (pulled + along) / (weights + 1.0 + stiff)
            found = described + self.right.T @ (inside - along / (1.0 + stiff)) + wanted / (1.0 + stiff)
            farther = RELAXED * found + (1.0 - RELAXED) * kept
            before, kept = kept, nearest_possible(farther + apart, n_bodies)[0]
            apart = apart + farther - kept
            missed = np.linalg.norm(self.right @ (kept - found) * self.values / deviation)
            if missed <= CLOSE and stiff * np.abs(kept - before).max() <= CLOSE:
                break
        return kept, broken


def combined(
    directions: Floats, spread: Floats, to_scaled: Floats, sizes: Floats, alone: Mask
) -> tuple[Ints, Floats, Floats]:
    """The combinations that determined directions (r, p) of scaled parameters, with deviations (r,), stand for.

    Parameters
    ----------
    alone : True for parameters that lead first, as they are determined without others, (p,).
    to_scaled : scaled parameters by parameters, (p, p).
    sizes : of the parameters, to compare them by, (p,).

    Returns
    -------
    The parameter that leads each, by its index, (r,); factors by which parameters count, (r, p), 1 of the leading one
    and 0 of all other leading ones; standard deviations, (r,).
    """
    from scipy.linalg import qr

    shown = (directions @ to_scaled) * sizes
    if not len(shown):
        return np.zeros(0, int), shown, np.zeros(0)
    first = np.where(alone, FIRST, 1.0)
    leading = np.sort(qr(shown * first, mode="r", pivoting=True)[1][: len(shown)])
    back = np.linalg.inv(shown[:, leading])
    factors, deviations = back @ shown, np.linalg.norm(back * spread, axis=1)
    factors[np.abs(factors) <= np.maximum(SLIGHT * deviations[:, None], OPEN)] = 0.0
    own, by = sizes[leading], np.where(sizes > 0.0, sizes, 1.0)  # of a size of 0 there is nothing to compare
    return leading, factors * (own[:, None] / by), own * deviations
