"""The fit of scaled parameters to efforts, weighed by the noise of each actuator."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Mask
from ...errors import InvalidArgument, counted
from .inertial_fit import IMPOSSIBLE, InertialFit
from .regressor import EffortRows
from .unknowns import Unknowns

LEAST_NOISE = 1e-4
"""Error that efforts of unknown quality are taken to have at least, as a share of the largest: simulated ones have
none, and would seem to determine what no instrument shows."""


MOST_ALIKE = 0.999
"""Autocorrelation of residuals at most, by which rows are counted: of drift alone none would count."""


class EffortFit:
    """Parameters that explain efforts, weighed by deviations that are given, or that each actuator's residuals show.

    Of more actuators than motions only what moves the machine counts, W' (t - t_described) with the motions W: how
    actuators share a load does not follow from its masses.

    Attributes
    ----------
    fit : in standard deviations; deviation : of these, more than 1 where residuals are larger than `sigma` says.
    found : what scaled parameters are more than described, (p,).
    is_broken : True for bodies and actuators' parameters that had to be held physical.
    missed : root mean square of the residuals, in deviations.
    alike : autocorrelation of the residuals of each actuator, from a row to the next, (n_a,); n_pairs : of such rows.
    explained : share of the squares of efforts that the identified machine explains.
    rms_before, rms, largest : residuals of each actuator, and its largest effort, (n_a,) [N, N m].
    residuals : (rows, n_a) [N, N m]; NaN for rows that were not used.
    """

    def __init__(
        self, unknowns: Unknowns, moved: EffortRows, measured: Floats, is_used: Mask, sigma: Floats | None
    ) -> None:
        self._columns, self._off = unknowns.columns(moved), measured - moved.described
        n_a, next_is_used = measured.shape[1], np.diff(np.flatnonzero(is_used)) == 1
        self._motions = moved.motions
        self._least = LEAST_NOISE * float(np.abs(measured).max(initial=0.0))
        if sigma is None:
            first = self._fitted(np.ones(n_a))
            left, spare = self._left(first.likeliest(self._least), np.ones(n_a)), first.spare
            if spare <= 0:
                found = f"{counted(len(measured), 'row')}, no more than are needed for {first.rank} parameters"
                raise InvalidArgument("efforts", found, "more rows, or sigma: nothing says how good they are")
            share = spare / len(first.off)
            sigma, self.deviation = np.maximum(np.sqrt(np.mean(left**2, axis=0) / share), self._least), 1.0
        else:
            first = self._fitted(sigma)
            left, spare = self._left(first.likeliest(1.0), sigma), first.spare
            self.deviation = max(1.0, float(np.sqrt(((left / sigma) ** 2).sum() / spare))) if spare > 0 else 1.0
        alike = np.clip(self._autocorrelation(left, next_is_used), 0.0, MOST_ALIKE)
        weights = sigma * np.sqrt((1.0 + alike) / (1.0 - alike))  # by the effective number of rows
        self.fit = self._fitted(weights)
        described = unknowns.to_scaled @ unknowns.described
        values, broken = self.fit.physical(described, len(unknowns.scales.bodies), self.deviation)
        self.found, self.is_broken = values - described, broken > IMPOSSIBLE
        left = self._left(self.found, weights)
        self.alike, self.n_pairs = self._autocorrelation(left, next_is_used), int(next_is_used.sum())
        whole = ((measured * unknowns.drives.units) ** 2).sum()
        self.explained = 1.0 - float(((left * unknowns.drives.units) ** 2).sum() / whole) if whole else 1.0
        self.missed = float(np.sqrt(np.mean((left / sigma) ** 2)))
        self.rms_before = np.sqrt(np.mean(self._left(np.zeros_like(values), weights) ** 2, axis=0))
        self.rms, self.largest = np.sqrt(np.mean(left**2, axis=0)), np.abs(measured).max(axis=0)
        self.residuals = np.full((len(is_used), n_a), np.nan)
        self.residuals[is_used] = left

    def of_bodies(self, values: Floats, n_bodies: int) -> Floats:
        """Efforts of the bodies with scaled parameters, (n, n_a)."""
        return np.asarray(self._columns[..., : 10 * n_bodies] @ values[: 10 * n_bodies])

    def _autocorrelation(self, left: Floats, next_is_used: Mask) -> Floats:
        """Of residuals (n, n_a) from a row to the next, (n_a,): those below the least noise count as white."""
        products = (left[1:] * left[:-1])[next_is_used].sum(axis=0)
        squares = (left[1:] ** 2 + left[:-1] ** 2)[next_is_used].sum(axis=0) / 2.0
        least = next_is_used.sum() * self._least**2
        return np.asarray(products / np.maximum(squares + least, np.finfo(float).tiny))

    def sensitivity(self, to_scaled: Floats) -> Floats:
        """How much efforts depend on each parameter, (p,): root mean square by scaled ones (p, p)."""
        return np.asarray(np.sqrt(np.mean((self._columns @ to_scaled) ** 2, axis=(0, 1))))

    def _bases(self, sigma: Floats) -> Floats:
        """Orthonormal motions of the actuators, (n, n_a, d), in deviations."""
        return np.linalg.qr(self._motions * sigma[:, None])[0]

    def _fitted(self, sigma: Floats) -> InertialFit:
        turned = np.swapaxes(self._bases(sigma), 1, 2)
        columns, off = turned @ (self._columns / sigma[:, None]), turned @ (self._off / sigma)[..., None]
        return InertialFit(*np.linalg.svd(columns.reshape(-1, columns.shape[2]), full_matrices=False), off.ravel())

    def _left(self, found: Floats, sigma: Floats) -> Floats:
        """Residuals with scaled parameters, (n, n_a)."""
        bases, left = self._bases(sigma), (self._off - self._columns @ found) / sigma
        return np.asarray((bases @ (np.swapaxes(bases, 1, 2) @ left[..., None]))[..., 0] * sigma)
