"""The result of a calibration: values with their deviations, what the data leave open, and what was off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats, Mask
from ...common.printed import Printed, ResultTable, error_text
from ...common.printed import plain as shown
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .linear_fit import LinearFit
from .measurements import INSTRUMENT, Measurements
from .parameters import Parameters
from .suggest import suggested

HEADER = ("parameter", "described", "calibrated", "deviation", "unit", "")


class ParameterValue(NamedTuple):
    """A calibrated parameter.

    Attributes
    ----------
    name : str
        Name of the parameter.
    value, described : float
        Calibrated, and of the machine as described, in `unit`.
    deviation : float
        Standard deviation; infinite where the data leave it open, or nothing is left to estimate it by.
    prior : tuple of float or None
        What it was expected to be, and the standard deviation of that.
    determined : bool
        True if the measurements determine it, beside what stays as described.
    unit : str
        Unit of the values.
    """

    name: str
    value: float
    described: float
    deviation: float
    prior: tuple[float, float] | None
    determined: bool
    unit: str


class Suspect(NamedTuple):
    """A measurement that fits worse than its deviation says.

    Attributes
    ----------
    row : int
        Its row; of a distance, its number.
    quantity : {"row", "distance"}
        Kind of the measurement.
    residual : float
        Difference of the row from what the others predict, in standard deviations (root mean square of its numbers).
    name : str
        What its file calls it.
    """

    row: int
    quantity: str
    residual: float
    name: str


def table_of(mechanism: Mechanism, parameters: Sequence[ParameterValue], facts: Sequence[str]) -> ResultTable:
    """A row for each parameter, then facts."""
    rows = [_cells(each, mechanism) for each in parameters]
    return ResultTable(mechanism.name, (), HEADER, rows, ["\n".join(facts)])


def as_numbers(parameters: Sequence[ParameterValue]) -> list[dict[str, Any]]:
    """Parameters as plain numbers, ready for JSON; None for infinite values and NaN."""
    return [{name: plain(value) for name, value in each._asdict().items()} for each in parameters]


def plain(value: Any) -> Any:
    """A value, or None for a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _cells(each: ParameterValue, mechanism: Mechanism) -> tuple[str, ...]:
    degrees = each.unit == "rad"
    factor = math.degrees(1.0) if degrees else 1.0
    size = factor if degrees else mechanism.characteristic_length
    deviation = "open" if math.isinf(each.deviation) else ""
    return (
        each.name,
        shown(each.described * factor, TOLERANCES.implied * size, ".9g"),
        shown(each.value * factor, TOLERANCES.implied * size, ".9g"),
        deviation or error_text(each.deviation * factor, ".2g", size),
        "deg" if degrees else each.unit,
        "" if each.determined else "not determined",
    )


OPEN = 1e-5
"""Part of a parameter in directions that the data leave open, up to which it counts as determined."""

WEAK = 3e-3
"""Deviation, in a parameter's scale, above which it counts as undetermined whatever the rank: 3 mm of a rod of 1 m."""

LIKELY = 0.75
"""Probability with which noise is no larger than it is taken to be, where few values are left over to tell it by."""

MOST_OUTLIERS = 3
"""Measurements that are named as not fitting, at most."""

TOO_FAR = 4.0
"""Root mean square, in standard deviations, from which values do not explain the measurements."""

AS_DESCRIBED = f"what is not determined stays as described; deviations of the others take it to be right to {WEAK:.1%}"
"""Treatments of parameters that are not determined."""

TOGETHER = 0.1
"""Part of an open direction from which a parameter is named as one of those that change together."""


class Calibration(Printed):
    """Parameters of a machine fitted to measurements; made by `calibrate`.

    Attributes
    ----------
    values : array (p,)
        Calibrated values, in the order of `names`; as described where the measurements do not determine them.
    deviations : array (p,)
        Standard deviations, with what stays as described taken to be right to 3 in 1000; of that itself, as far as the
        measurements tell: infinite where they leave it open, or nothing is left to say how good they are. Residuals
        larger than `sigma` make them larger.
    determined : array of bool (p,)
        True for the parameters that the measurements determine, beside what stays as described.
    rank : int
        Number of directions of parameters that they determine.
    rms_before, rms : float
        Root mean square of the residuals with the machine as described, and calibrated: in standard deviations if
        `sigma` was given, else as lengths, angles times L.
    rms_left_out : float
        Root mean square of the residuals of every row as predicted from the others.
    residuals : dict of str to array
        Quantity -> predicted less measured, measurement by measurement [length or rad].
    """

    def __init__(
        self,
        parameters: Parameters,
        measurements: Measurements,
        values: Floats,
        priors: dict[str, tuple[float, float]],
        data: LinearFit,
        fitted: LinearFit,
        slopes: Floats,
        before: Floats,
        residuals: dict[str, Floats],
        whole: Calibration | None = None,
    ) -> None:
        self._parameters, self.measurements, self.values, self._priors = parameters, measurements, values, priors
        self._data, self._fitted, self._slopes, self._before, self.residuals = data, fitted, slopes, before, residuals
        self._whole = whole or self  # with all parameters free
        self.names, self.rank = parameters.names, self._whole._data.rank

    @cached_property
    def mechanism(self) -> Mechanism:
        """The machine with the calibrated values."""
        return self._parameters.apply(self.values)

    @cached_property
    def rms_before(self) -> float:
        return float(np.sqrt(np.mean(self._before**2)))

    @cached_property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self._data.residual**2)))

    @cached_property
    def rms_left_out(self) -> float:
        raw = self._data.left_out().raw
        return float(np.sqrt(np.nanmean(raw**2))) if np.isfinite(raw).any() else float("nan")

    @cached_property
    def deviations(self) -> Floats:
        own = np.sqrt(np.diag(self.covariance))
        own[_parts(self._fitted.open_directions) > OPEN] = np.inf
        return np.asarray(own if self._whole is self else np.where(self._whole.kept, own, self._whole.deviations))

    @cached_property
    def covariance(self) -> Floats:
        """Covariance (p, p) of the values that are determined."""
        fit, scales = self._fitted, self._parameters.scales
        scaled = fit.covariance
        if np.isfinite(fit.variance) and fit.variance > 0.0:
            scaled = scaled + fit.by_held(self._slopes, WEAK)
        return np.asarray(scaled * scales[:, None] * scales)

    @cached_property
    def determined(self) -> Mask:
        if self._whole is not self and not self._priors:
            return self._whole.kept
        closed = _parts(self._data.open_directions) <= OPEN
        spread = np.sqrt(np.diag(self._data.cofactors) * self._cautious_variance)
        return np.asarray(closed & (spread <= WEAK) & (not self._is_exhausted))

    @cached_property
    def kept(self) -> Mask:
        """Parameters (p,) that measurements and priors determine if the others stay as described.

        Those that are determined anyway come first, then the instrument's, then the others as they are named.
        """
        expected = np.isin(self.names, [*self._priors])
        kept = self.determined | expected
        if kept.all() or self._is_exhausted:
            return np.asarray(kept)
        is_instrument = np.asarray(self._parameters.moves.any(axis=(1, 2)))
        most = np.where(expected | is_instrument, np.inf, WEAK / np.sqrt(self._cautious_variance))
        for p in (*np.flatnonzero(is_instrument & ~kept), *np.flatnonzero(~is_instrument & ~kept)):
            kept[p] = True
            spreads = self._fitted.spreads(kept)
            kept[p] = np.isfinite(spreads).all() and bool((spreads <= most[kept]).all())
        return np.asarray(kept)

    @property
    def _is_exhausted(self) -> bool:
        """True if nothing says how good the measurements are: no deviations, and no more values than parameters."""
        return not self._data.spare and not self.measurements.has_deviations

    @property
    def doubt(self) -> str:
        """Why these values may be wrong as a whole, in a sentence: the fit explains little; "" if nothing says so."""
        if self._whole is not self:
            return self._whole.doubt
        known, length = self.measurements.has_deviations, self._parameters.mechanism.characteristic_length
        if not self.rms > (TOO_FAR if known else np.inf if self.measurements.sigma else WEAK * length):
            return ""
        off = f"{self.rms:.3g} {'standard deviations' if known else self._parameters.mechanism.length_unit}".strip()
        held = [
            name
            for name, moves in zip(INSTRUMENT, np.asarray(self._parameters.moves.any(axis=(0, 2))), strict=True)
            if not moves
        ]
        also = f": free {' or '.join(map(repr, held))} too?" if held else ""
        return f"no values were found that explain these measurements, which they miss by {off} rms{also}"

    @cached_property
    def _cautious_variance(self) -> float:
        """Variance of a residual, to say what is determined: of few that are left over, the most that may be."""
        from scipy.special import chdtri

        if self.measurements.has_deviations:
            return self._data.variance
        spare = self._data.spare
        most = float(self._data.variance * spare / chdtri(spare, LIKELY)) if spare else 0.0
        return most if self.measurements.sigma else max(most, self._data.least_noise**2)

    @property
    def parameters(self) -> tuple[ParameterValue, ...]:
        """All parameters with their deviations."""
        own = self._parameters
        rows = zip(own.names, self.values.tolist(), own.values.tolist(), self.deviations.tolist(), strict=True)
        return tuple(
            ParameterValue(name, value, drawn, deviation, self._priors.get(name), bool(is_determined), unit)
            for (name, value, drawn, deviation), is_determined, unit in zip(
                rows, self.determined, own.units, strict=True
            )
        )

    @property
    def undetermined(self) -> tuple[str, ...]:
        """What the measurements leave open, in words: one sentence for parameters that change together."""
        if self._whole is not self:
            return self._whole.undetermined
        directions = self._open_directions()
        if not self._is_exhausted:
            return tuple(_sentences(self.names, directions, self.determined))
        sentence = "no more values are measured than are free: without sigma nothing says how good they are"
        return (*_sentences(self.names, directions, _parts(directions) <= OPEN), sentence)

    def _open_directions(self) -> Floats:
        """Directions that are open, and those in which a parameter's deviation is too large."""
        _, values, right = self._data._decomposed
        spread = np.sqrt(self._cautious_variance) / values[: self._data.rank]
        weak = np.flatnonzero(spread > WEAK)
        return np.concatenate([right[: self._data.rank][weak], self._data.open_directions])

    @cached_property
    def outliers(self) -> tuple[Suspect, ...]:
        """Measurements that do not fit the others, three at most: noise alone names some in one of a hundred fits."""
        return tuple(self._suspect(number, residual) for number, residual in self._data.outliers(MOST_OUTLIERS))

    def _suspect(self, number: int, residual: float) -> Suspect:
        name, rows = self.measurements.names[number], self.measurements.rows
        is_row = number < rows
        return Suspect(number if is_row else number - rows, "row" if is_row else "distance", residual, name)

    @property
    def sizes(self) -> tuple[Floats, Floats]:
        """Root mean square of the residuals of every measurement, before and after."""
        numbers = np.unique(self._data.groups)

        def of_each(residual: Floats) -> Floats:
            return np.array([np.sqrt(np.mean(residual[self._data.groups == number] ** 2)) for number in numbers])

        return of_each(self._before), of_each(self._data.residual)

    def suggest(self, n: int, criterion: str = "deviation", *, seed: int = 0) -> Floats:
        """Actuator values (n, n_a) of the next configurations that would determine the parameters best.

        Parameters
        ----------
        n : int
            Number of configurations.
        criterion : str, optional
            "deviation" makes the worst deviation small, "determinant" the volume of the uncertainty.
        seed : int, optional
            Seed of the feasible configurations that are chosen from.
        """
        return suggested(
            self.mechanism, self._parameters, self.values, self.measurements, self._whole._data, n, criterion, seed
        )

    def __repr__(self) -> str:
        open_ = len(self.names) - int(self.determined.sum())
        left = f", {open_} undetermined" if open_ else ""
        counts = f"{len(self.names)} parameters{left}, rms {self._size(self.rms)}"
        return f"<Calibration of '{self._parameters.mechanism.name}': {counts}>"

    def table(self) -> ResultTable:
        """The parameters, a line each; then what is left, what is open, and what does not fit."""
        return table_of(self._parameters.mechanism, self.parameters, self._facts)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain numbers, lists and dicts, ready for JSON."""
        return {
            "parameters": as_numbers(self.parameters),
            "rms_before": plain(self.rms_before),
            "rms": plain(self.rms),
            "rms_left_out": plain(self.rms_left_out),
            "rank": self.rank,
            "doubt": self.doubt,
            "undetermined": list(self.undetermined),
            "outliers": [each._asdict() for each in self.outliers],
        }

    def _size(self, rms: float) -> str:
        """A root mean square in words."""
        least, length = min(self.measurements.sigma.values(), default=1.0), self.mechanism.characteristic_length
        return error_text(rms, ".3g", max(length, 1.0) / least if self.measurements.sigma else length)

    @property
    def residual_unit(self) -> str:
        """Unit of root mean squares."""
        if self.measurements.sigma:
            return "standard deviations" if self.measurements.has_deviations else "weighted"
        return self._parameters.mechanism.length_unit

    @property
    def _facts(self) -> list[str]:
        """What is left, what is open, and what does not fit, a sentence each."""
        left_out = f", {self._size(self.rms_left_out)} where the others predict" if self.rms_left_out > 0.0 else ""
        return [
            f"rms {self._size(self.rms_before)} before, {self._size(self.rms)} after{left_out} [{self.residual_unit}]",
            *([self.doubt] if self.doubt else []),
            *self.undetermined,
            *([] if self.determined.all() else [AS_DESCRIBED]),
            *(f"{each.name} does not fit: off by {each.residual:.1f} standard deviations" for each in self.outliers),
        ]


def _parts(directions: Floats) -> Floats:
    """Part of every parameter in directions (k, p), (p,)."""
    return np.asarray(np.sqrt((directions**2).sum(axis=0)))


def _sentences(names: Sequence[str], directions: Floats, determined: Mask) -> list[str]:
    if not len(directions):
        return []
    shared = directions.T @ directions
    sizes = np.sqrt(np.diag(shared))
    remaining = [p for p in range(len(names)) if sizes[p] > TOGETHER or not determined[p]]
    sentences = []
    while remaining:
        group, waiting = [], [remaining.pop(0)]
        while waiting:
            p = waiting.pop()
            group.append(p)
            near = [k for k in remaining if abs(shared[p, k]) > TOGETHER * max(sizes[p] * sizes[k], 1e-300)]
            waiting += near
            remaining = [k for k in remaining if k not in near]
        if determined[group].all():
            continue
        group.sort()
        own = ", ".join(names[p] for p in group[:-1])
        if len(group) > 1:
            sentences.append(f"{own} and {names[group[-1]]} change together")
        else:
            sentences.append(f"{names[group[0]]} is not determined by these measurements")
    return sentences
