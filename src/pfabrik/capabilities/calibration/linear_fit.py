"""A least-squares problem at its solution: determined directions, deviations, and measurements that do not fit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Mask

RANK = 1e-8
"""Singular value, as a share of the largest, up to which a direction of parameters leaves measurements unchanged:
derivatives are exact to 1e-10, and what decides, at 1e-5 and above, is far from it."""


FALSE, LEAST_OTHERS = 0.01, 2
"""How often noise alone may name a measurement that does not fit; and how many numbers are to be left over without it:
of one, all measurements are as far off as each other."""


class LeftOut(NamedTuple):
    """Measurements beside what the others predict of them.

    Attributes
    ----------
    numbers : of the measurements, (k,).
    raw : root mean square residual of each, (k,).
    student : the same in standard deviations, (k,); as the others show them where none are given.
    chances : how often noise would put this one so far off, (k,); NaN where too little is left over to tell.
    """

    numbers: Ints
    raw: Floats
    student: Floats
    chances: Floats


@dataclass(frozen=True)
class LinearFit:
    """A least-squares problem at its solution.

    Attributes
    ----------
    jacobian : of the residuals in standard deviations by parameters in their scales, (m, p).
    residual : (m,), in standard deviations, or as lengths where none are given.
    groups, kinds : the measurement of every residual, and what kind of quantity it is of, (m,).
    has_sigma : True if standard deviations are given.
    least_noise : deviation of a residual at least, where none are given: simulated ones are off by rounding.
    """

    jacobian: Floats
    residual: Floats
    groups: Ints
    kinds: Ints
    has_sigma: bool
    least_noise: float

    @cached_property
    def _decomposed(self) -> tuple[Floats, Floats, Floats]:
        return decomposed(self.jacobian)

    @cached_property
    def rank(self) -> int:
        _, values, _ = self._decomposed
        return int((values > RANK * values.max(initial=0.0)).sum())

    @cached_property
    def open_directions(self) -> Floats:
        """Orthonormal directions (k, p) of scaled parameters that change no measurement."""
        return self._decomposed[2][self.rank :]

    @cached_property
    def variance(self) -> float:
        """Variance of a residual: what is left over, and no less than 1 if deviations are given.

        Where nothing is left over it is not known: infinite, but for deviations that are given.
        """
        left_over = float(self.residual @ self.residual) / self.spare if self.spare else np.inf
        if self.has_sigma:
            return max(1.0, left_over) if self.spare else 1.0
        return left_over

    @cached_property
    def spare(self) -> int:
        """Number of residuals beyond what is determined by them; what has no weight does not count."""
        return int(self._counted.sum()) - self.rank

    @cached_property
    def _counted(self) -> Mask:
        """Residuals that have a weight, (m,)."""
        return np.asarray(self.jacobian.any(axis=1) | (self.residual != 0.0))

    @cached_property
    def cofactors(self) -> Floats:
        """Covariance of the scaled parameters, (p, p), within the directions that are determined, by the variance."""
        _, values, right = self._decomposed
        kept = right[: self.rank] / values[: self.rank, None]
        return np.asarray(kept.T @ kept)

    def spreads(self, kept: Mask) -> Floats:
        """Deviations (k,) of some of the scaled parameters beside which the others are held, by the variance.

        Infinite where some direction of them changes no measurement.
        """
        _, values, right = self._decomposed
        _, sizes, turned = decomposed((values[:, None] * right[: len(values)])[:, kept])
        if len(sizes) < kept.sum() or sizes.min(initial=np.inf) <= RANK * values.max(initial=0.0):
            return np.full(int(kept.sum()), np.inf)
        return np.asarray(np.sqrt(((turned / sizes[:, None]) ** 2).sum(axis=0)))

    @cached_property
    def covariance(self) -> Floats:
        """Of the scaled parameters, (p, p), within the directions that are determined."""
        if np.isinf(self.variance):
            return np.where(self.cofactors == 0.0, 0.0, np.copysign(np.inf, self.cofactors))
        return np.asarray(self.cofactors * self.variance)

    def by_held(self, jacobian: Floats, expected: float) -> Floats:
        """Covariance (p, p) of scaled parameters by what those that are held may be off.

        If they are off by h, the others are off by S h, with S = -J⁺ J_h. Of h two things are known: it is about 0,
        within e, and what it leaves of the residual r, of variance v. So the mean of h h^T is V + d d^T, with
        R = J_h + J S, V = (R^T R / v + 1 / e²)^-1 and d = -V R^T r / v.

        Parameters
        ----------
        jacobian : (m, p), with the parameters that are held, whose columns are 0 in that of this fit.
        expected : e, deviation of scaled parameters that are held from what they are held at.
        """
        held = jacobian.any(axis=0) & ~self.jacobian.any(axis=0)
        left, values, right = self._decomposed
        across = left[:, : self.rank].T @ jacobian[:, held]
        moved = -(right[: self.rank] / values[: self.rank, None]).T @ across
        rest = jacobian[:, held] - left[:, : self.rank] @ across
        information = rest.T @ rest / self.variance + np.eye(int(held.sum())) / expected**2
        spread = np.linalg.inv(information)
        shift = spread @ (rest.T @ self.residual) / self.variance
        return np.asarray(moved @ (spread + np.outer(shift, shift)) @ moved.T)

    def left_out(self) -> LeftOut:
        """How far every measurement is from what the others predict.

        Without those of measurement k, residuals e are r + H_k e_k, with e_k = (I - H_kk)^-1 r_k and H = J J⁺.
        """
        from scipy.special import chdtrc, fdtrc

        left = self._decomposed[0][:, : self.rank]
        leverages = np.einsum("mr,mr->m", left, left)
        numbers = np.unique(self.groups)
        raw, student, chances = (np.full(len(numbers), np.nan) for _ in range(3))
        total = float(self.residual @ self.residual)
        for k, number in enumerate(numbers):
            rows = np.flatnonzero(self.groups == number)
            values, vectors = np.linalg.eigh(np.eye(len(rows)) - left[rows] @ left[rows].T)
            seen = values > 1e-9
            if not seen.any():
                continue
            parts = vectors[:, seen].T @ self.residual[rows]
            predicted = vectors[:, seen] @ (parts / values[seen])
            raw[k] = float(np.sqrt(np.mean(predicted**2)))
            explained, count = float(parts @ (parts / values[seen])), int(seen.sum())
            others = self.spare - count
            scale = 1.0 if self.has_sigma else (total - explained) / others if others > 0 else np.nan
            if scale > 0.0:
                student[k] = float(np.sqrt(explained / count / scale))
            across = left @ (left[rows].T @ vectors[:, seen])
            alike = np.isin(self.kinds, self.kinds[rows]) & (self.groups != number) & self._counted
            spare = float((1.0 - leverages - (across**2 / values[seen]).sum(axis=1))[alike].sum())
            if min(others, spare) < LEAST_OTHERS - 1e-6:
                continue
            rest = (self.residual + across @ (parts / values[seen]))[alike]
            noise = max(float(rest @ rest) / spare, 1.0 if self.has_sigma else self.least_noise**2)
            chances[k] = fdtrc(count, spare, explained / count / noise)
            if self.has_sigma:
                chances[k] = max(chances[k], chdtrc(count, explained))
        return LeftOut(numbers, raw, student, chances)

    def outliers(self, most: int) -> list[tuple[int, float]]:
        """Numbers of the measurements that do not fit, and their studentised residuals, the worst first.

        The worst is taken out, and the worst of the others, as often as may be: so none hides behind another. Those up
        to the last that noise would hardly give do not fit: by the F distribution beside the others of its kind
        (Student's t, of one number), of as many as there are, or as there are choices of those that hid it. Noise alone
        names any in about one of a hundred fits.
        """
        worst: list[tuple[int, float]] = []
        n_named, fit = 0, self
        while len(worst) < most:
            each = fit.left_out()
            told = np.flatnonzero(np.isfinite(each.chances))
            if not len(told):
                break
            k = told[np.lexsort((-each.student[told], each.chances[told]))[0]]
            choices = math.comb(len(told) + len(worst) - n_named, len(worst) - n_named + 1)
            worst.append((int(each.numbers[k]), float(each.student[k])))
            if each.chances[k] * choices <= FALSE:
                n_named = len(worst)
            fit = fit._without(int(each.numbers[k]))
        return worst[:n_named]

    def _without(self, number: int) -> LinearFit:
        """The fit of the other measurements, to first order."""
        kept = self.groups != number
        rows = (self.jacobian[kept], self.residual[kept], self.groups[kept], self.kinds[kept])
        rest = LinearFit(*rows, self.has_sigma, self.least_noise)
        across = rest._decomposed[0][:, : rest.rank]
        return replace(rest, residual=rest.residual - across @ (across.T @ rest.residual))


LEAST_NOISE = 1e-5
"""Error that measurements of unknown quality are taken to have at least [L]: 10 um of 1 m. Simulated ones have none,
and would seem to determine what no instrument shows."""


def decomposed(matrix: Floats) -> tuple[Floats, Floats, Floats]:
    """The singular value decomposition of a matrix (m, p): (m, k), (k,), and all (p, p) on the right.

    By routines that leave matrices of this size to one thread: those of a BLAS wait for each other longer than they
    compute.
    """
    from scipy.linalg import svd

    turned, triangle = _by_triangles(matrix)
    left, values, right = svd(triangle, lapack_driver="gesvd")
    return np.einsum("mk,kr->mr", turned, left), values, right


def _by_triangles(matrix: Floats) -> tuple[Floats, Floats]:
    """Q (m, k) and R (k, p) of a matrix (m, p), by pieces twice as high as wide."""
    m, p = matrix.shape
    if m <= 2 * p:
        turned, triangle = np.linalg.qr(matrix)
        return turned, triangle
    pieces = np.zeros((-(-m // (2 * p)), 2 * p, p))
    pieces.reshape(-1, p)[:m] = matrix
    turned, triangles = np.linalg.qr(pieces)
    before, triangle = _by_triangles(triangles.reshape(-1, p))
    return (turned @ before.reshape(-1, p, before.shape[1])).reshape(-1, before.shape[1])[:m], triangle
