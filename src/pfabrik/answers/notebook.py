"""What a notebook shows of an answer: its status, how far it is, its actuators and a drawing, as HTML."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..description.notebook import bound_text, card
from ..description.readouts import readouts
from ..description.sketch import sketch
from .words import as_sentence

if TYPE_CHECKING:
    from .solution import Solution


def solution_html(solution: Solution, counts: dict[str, int]) -> str:
    """One answer with its actuators and a drawing; of a batch, how many rows have each status."""
    if solution.shape != ():
        rows = [(name, str(count)) for name, count in counts.items()]
        return card(solution.mechanism.name, [f"batch of shape {solution.shape}"], ("status", "rows"), rows, "")
    known = bool(np.isfinite(solution.pose).all())
    drawing = sketch(solution.mechanism, solution.points, solution.pose[:3, 3]) if known else ""
    return card(solution.mechanism.name, _facts(solution, known), _HEADER, _actuators(solution), drawing)


_HEADER = ("actuator", "value", "min", "max", "unit")


def _facts(solution: Solution, known: bool) -> list[str]:
    if not known:
        return [str(solution.status).lower()]
    unit, turned = solution.mechanism.length_unit, np.degrees(solution.rotation_error)
    errors = f"position error {solution.position_error:.3g} {unit}, rotation error {turned:.3g} deg"
    return [as_sentence(solution), errors, f"residual {solution.residual:.2g} {unit}"]


def _actuators(solution: Solution) -> list[tuple[str, ...]]:
    shown = zip(readouts(solution.mechanism), solution.actuators, strict=True)
    return [
        (each.name, f"{float(each.display(value)):.6g}", *map(bound_text, each.limits), each.unit)
        for each, value in shown
    ]
