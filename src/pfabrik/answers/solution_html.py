"""An answer as HTML for notebooks: its status, errors, actuators and a drawing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..description.mechanism_html import bound_text, card
from ..description.readouts import readouts
from ..description.sketch import sketch
from .aligned_text import error_text, plain
from .words import as_sentence, loop_gap

if TYPE_CHECKING:
    from .answer_fields import Answer


def answer_html(answer: Answer, counts: dict[str, int]) -> str:
    """One answer with its actuators and a drawing; of a batch, the number of rows with each status."""
    if answer.shape != ():
        rows = [(name, str(count)) for name, count in counts.items()]
        return card(answer.mechanism.name, [f"batch of shape {answer.shape}"], ("status", "rows"), rows, "")
    is_valid = bool(np.isfinite(answer.pose).all())
    drawing = sketch(answer.mechanism, answer.points, answer.pose[:3, 3]) if is_valid else ""
    return card(answer.mechanism.name, _facts(answer, is_valid), _HEADER, _actuators(answer), drawing)


_HEADER = ("actuator", "value", "min", "max", "unit")


def _facts(answer: Answer, is_valid: bool) -> list[str]:
    """Status, errors and residual, a line each; of an INVALID answer the status only."""
    if not is_valid:
        return [str(answer.status).lower()]
    unit, length = answer.mechanism.length_unit, answer.mechanism.characteristic_length
    position = error_text(float(answer.position_error), ".3g", length)
    rotation = error_text(float(np.degrees(answer.rotation_error)), ".3g", np.degrees(1.0))
    errors = f"position error {position} {unit}, rotation error {rotation} deg"
    return [as_sentence(answer), errors, f"residual {loop_gap(answer)}"]


def _actuators(answer: Answer) -> list[tuple[str, ...]]:
    """Name, value, bounds and unit of each actuator."""
    return [
        (readout.name, plain(float(readout.display(value)), 1e-9), *map(bound_text, readout.limits), readout.unit)
        for readout, value in zip(readouts(answer.mechanism), answer.actuators, strict=True)
    ]
