"""What a notebook shows of an answer: its status, how far it is, its actuators and a drawing, as HTML."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..description.mechanism_html import bound_text, card
from ..description.readouts import readouts
from ..description.sketch import sketch
from .words import as_sentence

if TYPE_CHECKING:
    from .answer import Answer


def answer_html(answer: Answer, counts: dict[str, int]) -> str:
    """One answer with its actuators and a drawing; of a batch, how many rows have each status."""
    if answer.shape != ():
        rows = [(name, str(count)) for name, count in counts.items()]
        return card(answer.mechanism.name, [f"batch of shape {answer.shape}"], ("status", "rows"), rows, "")
    known = bool(np.isfinite(answer.pose).all())
    drawing = sketch(answer.mechanism, answer.points, answer.pose[:3, 3]) if known else ""
    return card(answer.mechanism.name, _facts(answer, known), _HEADER, _actuators(answer), drawing)


_HEADER = ("actuator", "value", "min", "max", "unit")


def _facts(answer: Answer, known: bool) -> list[str]:
    if not known:
        return [str(answer.status).lower()]
    unit, turned = answer.mechanism.length_unit, np.degrees(answer.rotation_error)
    errors = f"position error {answer.position_error:.3g} {unit}, rotation error {turned:.3g} deg"
    return [as_sentence(answer), errors, f"residual {answer.residual:.2g} {unit}"]


def _actuators(answer: Answer) -> list[tuple[str, ...]]:
    shown = zip(readouts(answer.mechanism), answer.actuators, strict=True)
    return [
        (each.name, f"{float(each.display(value)):.6g}", *map(bound_text, each.limits), each.unit)
        for each, value in shown
    ]
