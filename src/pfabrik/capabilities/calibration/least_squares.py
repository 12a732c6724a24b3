"""Calibration: the parameters of a machine from measurements, by least squares."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Solution
from ...common.arguments import array, is_not_negative
from ...common.arrays import Floats
from ...common.checks import require_known, require_mapping, require_positive, require_type
from ...common.extras import require
from ...errors import InvalidArgument
from ...machine.description.mechanism import Mechanism, checked_mechanism
from .calibration import Calibration
from .linear_fit import LEAST_NOISE, RANK, LinearFit, decomposed
from .measured_residuals import Fit, Residuals, residuals, slopes_of, whitened
from .measurements import Measurements
from .parameters import Free, Parameters, parameters

TOLERANCE = 1e-8
"""Relative step at which least squares end: convergence is quadratic, and the next step is below what doubles show."""

Priors = Mapping[str, float | tuple[float, float]]
"""Parameter name -> standard deviation about its described value, or (value, standard deviation)."""


def calibrate(
    mechanism: Mechanism,
    measurements: Measurements,
    *,
    free: Free | Parameters = None,
    priors: Priors | None = None,
    weights: ArrayLike | None = None,
    ties: Literal["copies"] | None = None,
    start: Solution | None = None,
) -> Calibration:
    """Parameters of a machine that explain measurements best, by least squares.

    Measured values minus those of the machine with other parameters, over their standard deviations, are made small by
    SciPy's `least_squares` with exact derivatives. A parameter that they do not determine stays as described, and is
    reported: a small residual is no proof of it. Of parameters that only change together, those named last stay, and
    the others are what the measurements say beside them. A frame and a target of the instrument that may vary are
    aligned first, in closed form. A fit that misses by far warns: see `Calibration.doubt`.

    Parameters
    ----------
    mechanism : Mechanism
        The machine as described.
    measurements : Measurements
        What was measured of it.
    free : str or sequence of str or Parameters, optional
        What may vary, as in `parameters`; or parameters.
    priors : mapping of str to float, optional
        Parameter -> the standard deviation of its value as described, or a pair (value, standard deviation): what is
        known beforehand; asks for `sigma` of the measurements.
    weights : array (n,), optional
        Weights of the rows; 0 leaves a row out.
    ties : str, optional
        "copies" lets copies of a joint vary as one, as in `parameters`.
    start : Solution, optional
        Configurations of the machine as described at the readings, (n,) or one for all, that say which assembly mode it
        was in. Default: at measured poses, else home.

    Raises
    ------
    InvalidArgument or UnknownName
        What does not fit the machine.
    UnsupportedMechanism
        Parameters that open the loops of an overconstrained machine.
    MissingLibrary
        SciPy is not installed.
    """
    checked_mechanism(mechanism)
    require_type("measurements", measurements, Measurements, "Measurements")
    own = free if isinstance(free, Parameters) else parameters(mechanism, free, ties=ties)
    if own.mechanism != mechanism:
        raise InvalidArgument("free", "parameters of another machine", f"parameters of '{mechanism.name}'")
    return largest_determined(own, measurements, [own.names], priors=priors, weights=weights, start=start)


def largest_determined(
    own: Parameters,
    measurements: Measurements,
    sets: Sequence[Sequence[str]],
    *,
    priors: Priors | None = None,
    weights: ArrayLike | None = None,
    start: Solution | None = None,
) -> Calibration:
    """Calibration by the first of several sets of parameters that measurements determine.

    What the set leaves out stays as described; of the last set, also what is not determined.

    Parameters
    ----------
    sets : names of parameters, the largest set first.
    priors, weights, start : as of `calibrate`.
    """
    require("calibration", "scipy", "calibrate")
    _check_sigma(measurements)
    expected = _priors(own, priors, measurements)
    fit = Fit(own, measurements)
    row_weights = _weights(weights, measurements.rows)
    fit.begin(start)
    problem = _Problem(own, fit, expected, row_weights)
    for names in sets:
        problem.free = np.isin(own.names, names)
        found = problem.fitted()
        if found.kept[problem.free].all():
            break
    else:
        problem.free = found.kept
        found = problem.fitted(found)
    fit.require_assembled(found.values)
    if found.doubt:
        warnings.warn(f"'{own.mechanism.name}': {found.doubt}", stacklevel=3)
    return found


class _Problem:
    """The least-squares problem in scaled parameters: rows of the data, then those of the priors.

    Attributes
    ----------
    free : parameters that vary, (p,); the others are held.
    """

    def __init__(
        self, own: Parameters, fit: Fit, priors: dict[str, tuple[float, float]], weights: Floats | None
    ) -> None:
        self.own, self.fit, self.priors, self.weights = own, fit, priors, weights
        self.places = [own.names.index(name) for name in priors]
        self.prior_values = np.array([value for value, _ in priors.values()])
        self.prior_sigmas = np.array([sigma for _, sigma in priors.values()])
        self.free = np.ones(len(own), dtype=bool)
        self.base = fit.aligned_values()
        self.before = self._blocks(self.base)
        self.factors = whitened(self.before, fit.measurements.sigma, fit.length, weights)

    def fitted(self, whole: Calibration | None = None) -> Calibration:
        """The calibration by what is free; `whole` is the one that says what is determined."""
        return self._result(self._solved(), whole)

    def _solved(self) -> Floats:
        """The values that fit best, (p,); in directions that nothing determines, those as described."""
        from scipy.optimize import least_squares

        base, values, rank = self.base, self.base, 0
        for _ in range(MOST_RANKS):
            _, sizes, right = decomposed(self._jacobian(values))
            kept = right[: len(sizes)][sizes > RANK * sizes.max(initial=0.0)]
            if len(kept) == rank:
                break
            rank, basis = len(kept), self.own.scales[:, None] * kept.T * self.free[:, None]

            def residual(y: Floats, basis: Floats = basis) -> Floats:
                return self._residual(base + basis @ y)

            def derivative(y: Floats, basis: Floats = basis, kept: Floats = kept) -> Floats:
                slopes = self._jacobian(base + basis @ y)
                return np.asarray(np.einsum("mp,kp->mk", slopes, kept))  # not by threads of a BLAS

            begin = kept @ ((values - base) / self.own.scales)
            found = least_squares(
                residual,
                begin,
                derivative,
                method="lm",
                x_scale=FIRST_STEP,
                xtol=TOLERANCE,
                ftol=TOLERANCE,
                gtol=TOLERANCE,
                max_nfev=MOST_STEPS,
            )
            values = base + basis @ found.x
        return values

    def _result(self, values: Floats, whole: Calibration | None) -> Calibration:
        """The calibration at these values."""
        blocks = self._blocks(values, slopes=True)
        every = self.factors[:, None] * slopes_of(blocks) * self.own.scales
        groups = np.concatenate([block.groups for block in blocks])
        kinds = np.repeat(np.arange(len(blocks)), [len(block.groups) for block in blocks])
        has_sigma, least = self.fit.measurements.has_deviations, LEAST_NOISE * self.fit.length
        residual = self.factors * residuals(blocks)
        data = LinearFit(every * self.free, residual, groups, kinds, has_sigma, least)
        fitted = data
        if self.priors:
            every = np.concatenate([every, self._prior_slopes()])
            left = np.concatenate([residual, (values[self.places] - self.prior_values) / self.prior_sigmas])
            groups, kinds = (np.concatenate([each, np.full(len(self.places), -1)]) for each in (groups, kinds))
            fitted = LinearFit(every * self.free, left, groups, kinds, has_sigma, least)
        before = self.factors * residuals(self.before)
        by_quantity = {block.quantity: block.residual for block in blocks}
        given = self.own, self.fit.measurements, values, self.priors
        return Calibration(*given, data, fitted, every, before, by_quantity, whole)

    def _blocks(self, values: Floats, *, slopes: bool = False) -> list[Residuals]:
        return self.fit.blocks(values, slopes=slopes)

    def _residual(self, values: Floats) -> Floats:
        data = self.factors * residuals(self._blocks(values))
        return np.concatenate([data, (values[self.places] - self.prior_values) / self.prior_sigmas])

    def _jacobian(self, values: Floats) -> Floats:
        """Derivatives by scaled parameters."""
        slopes = slopes_of(self._blocks(values, slopes=True))
        every = np.concatenate([self.factors[:, None] * slopes * self.own.scales, self._prior_slopes()])
        return np.asarray(every * self.free)

    def _prior_slopes(self) -> Floats:
        rows = np.zeros((len(self.places), len(self.own)))
        rows[np.arange(len(self.places)), self.places] = self.own.scales[self.places] / self.prior_sigmas
        return rows


FIRST_STEP = 1e-2
"""A hundredth of the longest first step, in parameters' scales: farther, it is another machine, or none."""

MOST_RANKS, MOST_STEPS = 3, 60
"""How often directions are chosen, and the most steps for each choice: a drawing needs one and five."""


def _check_sigma(measurements: Measurements) -> None:
    given = measurements.sigma
    missing = [name for name in measurements.quantities if name not in given]
    if given and missing:
        raise InvalidArgument("sigma", f"none for {', '.join(missing)}", "one for every quantity that is measured")


def _priors(own: Parameters, priors: Any, measurements: Measurements) -> dict[str, tuple[float, float]]:
    priors = require_mapping("priors", priors, "name -> standard deviation, or (value, deviation)")
    if priors and not measurements.has_deviations:
        raise InvalidArgument("priors", "priors beside measurements without sigma", "sigma: how good each is")
    expected: dict[str, tuple[float, float]] = {}
    require_known("parameter", priors, own.names)
    for name, given in priors.items():
        pair = np.atleast_1d(array(f"priors['{name}']", given, "() | 2", note=": a deviation, or (value, deviation)"))
        value = pair[0] if len(pair) == 2 else own.values[own.names.index(name)]
        sigma = require_positive(f"deviation of priors['{name}']", float(pair[-1]))
        expected[name] = float(value), float(sigma)
    return expected


def _weights(weights: ArrayLike | None, rows: int) -> Floats | None:
    if weights is None:
        return None
    return array("weights", weights, f"{rows}", "numbers from 0", holds=is_not_negative)
