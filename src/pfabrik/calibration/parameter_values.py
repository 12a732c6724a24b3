"""What a calibration says of a parameter, and of a measurement; as text, as HTML and as plain numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from ..answers.aligned_text import aligned
from ..description.mechanism_html import card

HEADER = ("parameter", "described", "calibrated", "deviation", "unit", "")


class ParameterValue(NamedTuple):
    """A calibrated parameter.

    Attributes
    ----------
    value, described : calibrated, and of the machine as described, in `unit`.
    deviation : standard deviation; infinite where the data leave it open, NaN where nothing is left to estimate it by.
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


def as_text(parameters: Sequence[ParameterValue], facts: Sequence[str]) -> str:
    """A line for each parameter, then facts."""
    return "\n".join([aligned(HEADER, map(_cells, parameters)), "", *facts])


def as_html(name: str, parameters: Sequence[ParameterValue], facts: Sequence[str]) -> str:
    """A table of the parameters of a machine, for notebooks."""
    return card(name, list(facts), HEADER, [_cells(each) for each in parameters], "")


def as_numbers(parameters: Sequence[ParameterValue]) -> list[dict[str, Any]]:
    """Parameters as plain numbers, ready for JSON; None for what is not finite."""
    return [{name: plain(value) for name, value in each._asdict().items()} for each in parameters]


def plain(value: Any) -> Any:
    """A value, or None for a number that is not finite."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _cells(each: ParameterValue) -> tuple[str, ...]:
    degrees = each.unit == "rad"
    factor = math.degrees(1.0) if degrees else 1.0
    deviation = "open" if math.isinf(each.deviation) else "-" if math.isnan(each.deviation) else ""
    return (
        each.name,
        f"{each.described * factor:.9g}",
        f"{each.value * factor:.9g}",
        deviation or f"{each.deviation * factor:.2g}",
        "deg" if degrees else each.unit,
        "" if each.determined else "not determined",
    )
