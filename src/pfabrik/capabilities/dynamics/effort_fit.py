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


FAR = 4.0
"""Noise of efforts, by that which they are taken to have, from which no machine explains them."""


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
    rms_before, rms, largest : residuals of each actuator, and its largest effort, (n_a,) [N, N m].
    residuals : (rows, n_a) [N, N m]; NaN for rows that were not used.
    """

    def __init__(
        self, unknowns: Unknowns, moved: EffortRows, measured: Floats, is_used: Mask, sigma: Floats | None
    ) -> None:
        self._columns, self._off = unknowns.columns(moved), measured - moved.described
        n_a = measured.shape[1]
        self._motions = moved.motions
        self._least = LEAST_NOISE * float(np.abs(measured).max(initial=0.0))
        if sigma is None:
            first = self._fitted(np.ones(n_a))
            left, spare = self._left(first.likeliest(self._least), np.ones(n_a)), first.spare
            if spare <= 0:
                found = f"{counted(len(measured), 'row')}, no more than are needed for {first.rank} parameters"
                raise InvalidArgument("efforts", found, "more rows, or sigma: nothing says how good they are")
            share = spare / len(first.off)
            sigma = np.maximum(np.sqrt(np.mean(left**2, axis=0) / share), self._least)
            self.fit, self.deviation = self._fitted(sigma), 1.0
        else:
            self.fit = self._fitted(sigma)
            left = self._left(self.fit.likeliest(1.0), sigma) / sigma
            spare = self.fit.spare
            self.deviation = max(1.0, float(np.sqrt((left**2).sum() / spare))) if spare > 0 else 1.0
        described = unknowns.to_scaled @ unknowns.described
        values, broken = self.fit.physical(described, len(unknowns.scales.bodies), self.deviation)
        self.found, self.is_broken = values - described, broken > IMPOSSIBLE
        left = self._left(self.found, sigma)
        self.missed = float(np.sqrt(np.mean((left / sigma) ** 2)))
        self.rms_before = np.sqrt(np.mean(self._left(np.zeros_like(values), sigma) ** 2, axis=0))
        self.rms, self.largest = np.sqrt(np.mean(left**2, axis=0)), np.abs(measured).max(axis=0)
        self.residuals = np.full((len(is_used), n_a), np.nan)
        self.residuals[is_used] = left

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
