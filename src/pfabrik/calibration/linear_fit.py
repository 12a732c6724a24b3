"""A least-squares problem at its solution: what it determines, how well, and which measurement does not fit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Floats, Ints

RANK = 1e-8
"""Singular value, as a share of the largest, up to which a direction of parameters leaves measurements unchanged:
derivatives are exact to 1e-10, and what decides, at 1e-5 and above, is far from it."""


@dataclass(frozen=True)
class LinearFit:
    """A least-squares problem at its solution.

    Attributes
    ----------
    jacobian : of the residuals in standard deviations by parameters in their scales, (m, p).
    residual : (m,), in standard deviations, or as lengths where none are given.
    groups : the measurement of every residual, (m,).
    has_sigma : True if standard deviations are given.
    """

    jacobian: Floats
    residual: Floats
    groups: Ints
    has_sigma: bool

    @cached_property
    def _decomposed(self) -> tuple[Floats, Floats, Floats]:
        left, values, right = np.linalg.svd(self.jacobian, full_matrices=True)
        return left, values, right

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
        """Variance of a residual: 1 if deviations are given, else what is left over; NaN if nothing is."""
        if self.has_sigma:
            return 1.0
        spare = len(self.residual) - self.rank
        return float(self.residual @ self.residual) / spare if spare > 0 else float("nan")

    @cached_property
    def covariance(self) -> Floats:
        """Of the scaled parameters, (p, p), within the directions that are determined."""
        _, values, right = self._decomposed
        kept = right[: self.rank] / values[: self.rank, None]
        return np.asarray(kept.T @ kept * self.variance)

    @cached_property
    def leverages(self) -> Floats:
        """Diagonal of the projection on predictions, (m,)."""
        left = self._decomposed[0][:, : self.rank]
        return np.asarray(np.einsum("mk,mk->m", left, left))

    def left_out(self) -> tuple[Ints, Floats, Floats]:
        """Measurements, and the root mean square residual of each from what the others predict, also studentised."""
        left = self._decomposed[0][:, : self.rank]
        numbers = np.unique(self.groups)
        raw, student = np.full(len(numbers), np.nan), np.full(len(numbers), np.nan)
        total, spare = float(self.residual @ self.residual), len(self.residual) - self.rank
        for k, number in enumerate(numbers):
            rows = np.flatnonzero(self.groups == number)
            room = np.eye(len(rows)) - left[rows] @ left[rows].T
            values, vectors = np.linalg.eigh(room)
            seen = values > 1e-9
            if not seen.any():
                continue
            parts = vectors[:, seen].T @ self.residual[rows]
            predicted = vectors[:, seen] @ (parts / values[seen])
            raw[k] = float(np.sqrt(np.mean(predicted**2)))
            explained = float(parts @ (parts / values[seen]))
            others = spare - int(seen.sum())
            scale = 1.0 if self.has_sigma else (total - explained) / others if others > 0 else float("nan")
            if scale > 0.0:
                student[k] = float(np.sqrt(explained / seen.sum() / scale))
        return numbers, raw, student
