"""Results of a calibration for a parameter and for a measurement: as text, as HTML and as plain numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from ..description.mechanism import Mechanism
from ..printed import ResultTable, error_text
from ..printed import plain as shown
from ..tolerances import TOLERANCES

HEADER = ("parameter", "described", "calibrated", "deviation", "unit", "")


class ParameterValue(NamedTuple):
    """A calibrated parameter.

    Attributes
    ----------
    value, described : calibrated, and of the machine as described, in `unit`.
    deviation : standard deviation; infinite where the data leave it open, or nothing is left to estimate it by.
    prior : what it was expected to be, or None.
    determined : True if the measurements alone determine it.
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
    row : its row; of a distance, its number.
    quantity : "row" or "distance".
    residual : largest difference of the row, in standard deviations, from what the others predict.
    """

    row: int
    quantity: str
    residual: float


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
