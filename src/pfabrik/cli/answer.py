"""One answer for people: what became of it, the pose, the actuators; angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..report import Floats, as_sentence, loop_gap, readouts, rpy_angles
from .table import aligned

if TYPE_CHECKING:
    from ..report import Readout
    from ..solution import Solution


def describe(solution: Solution, asked: Floats | None = None) -> str:
    """The answer to a target or, with `asked` (n_a,) [length or rad], to actuator values."""
    position, angles = pose_texts(solution)
    rows = [
        ("x y z", "   ".join(position), solution.mechanism.length_unit),
        ("roll pitch yaw", "   ".join(angles), "deg"),
    ]
    width = max(len(value) for _, value, _ in rows)
    lines = [f"{name:<16}{value:<{width}}   [{label}]" for name, value, label in rows]
    gap = f"{'loops closed to':<16}{loop_gap(solution)}"
    return "\n".join([as_sentence(solution, asked), "", *lines, gap, "", actuator_table(solution, asked)])


def pose_texts(solution: Solution) -> tuple[list[str], list[str]]:
    """Position [length], and roll, pitch, yaw [deg]."""
    smallest = 1e-9 * solution.mechanism.characteristic_length
    position = [plain(value, smallest) for value in solution.pose[:3, 3]]
    return position, [plain(math.degrees(angle), 1e-7) for angle in rpy_angles(solution.pose)]


def actuator_table(solution: Solution, asked: Floats | None) -> str:
    """The actuator values, those asked for where they were not reached, and the limits."""
    shown = readouts(solution.mechanism)
    low, high = ([bound_text(readout.limits[side]) for readout in shown] for side in (0, 1))
    columns = {"actuator": [readout.name for readout in shown], "value": in_units(shown, solution.actuators)}
    if asked is not None and not solution:
        columns["asked"] = in_units(shown, asked)
    columns |= {"min": low, "max": high, "unit": [readout.unit for readout in shown]}
    return aligned(list(columns), zip(*columns.values(), strict=True))


def in_units(shown: Sequence[Readout], values: Floats) -> list[str]:
    """Actuator coordinates (n_a,) [length or rad] in the units for people."""
    return [plain(float(readout.display(value)), 1e-9) for readout, value in zip(shown, values, strict=True)]


def bound_text(bound: float) -> str:
    """A limit; ``-`` where there is none."""
    return f"{bound:.6g}" if math.isfinite(bound) else "-"


def plain(value: float, smallest: float) -> str:
    """Six digits; what is smaller than `smallest` is noise and reads 0."""
    return f"{value:.6g}" if abs(value) > smallest else "0"
