"""A mechanism as a table: its actuators with their limits, and a drawing."""

from __future__ import annotations

import math

from ...common.printed import ResultTable
from .readouts import readouts
from .sketch import sketch
from .structure import Structure


def mechanism_table(mechanism: Structure, facts: str) -> ResultTable:
    """Name and facts, the actuators with their limits, and home as a drawing."""
    rows = [(each.name, *map(bound_text, each.limits), each.unit) for each in readouts(mechanism)]
    return ResultTable(mechanism.name, [facts], ("actuator", "min", "max", "unit"), rows, drawing=sketch(mechanism))


def bound_text(bound: float) -> str:
    """A limit in six digits; ``-`` where there is none."""
    return f"{bound:.6g}" if math.isfinite(bound) else "-"
