"""An answer as a table: its status, pose, loops and actuators, with a drawing for notebooks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats
from ..description.mechanism_table import bound_text
from ..description.readouts import Readout, readouts
from ..description.sketch import sketch
from ..printed import ResultTable, plain
from ..rotations import to_rpy
from ..tolerances import TOLERANCES
from .words import as_sentence, loop_gap

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism
    from .answer_fields import Answer


def answer_table(answer: Answer, counts: dict[str, int]) -> ResultTable:
    """One answer; of a batch, the number of rows with each status."""
    name = answer.mechanism.name
    if answer.shape != ():
        rows = [(status, str(count)) for status, count in counts.items()]
        return ResultTable(name, [f"batch of shape {answer.shape}"], ("status", "rows"), rows)
    if not np.isfinite(answer.pose).all():
        return ResultTable(name, [str(answer.status).lower()])
    header, *rows = zip(*_actuators(answer), strict=True)
    drawing = sketch(answer.mechanism, answer.points, answer.pose[:3, 3])
    return ResultTable(name, [as_sentence(answer), "", *_pose(answer)], header, rows, drawing=drawing)


def _pose(answer: Answer) -> list[str]:
    """Position and angles, aligned, and how far loops are open."""
    position, angles = pose_texts(answer)
    rows = [
        ("x y z", "   ".join(position), answer.mechanism.length_unit),
        ("roll pitch yaw", "   ".join(angles), "deg"),
    ]
    width = max(len(text) for _, text, _ in rows)
    lines = [f"{name:<16}{text:<{width}}   [{unit}]" for name, text, unit in rows]
    return [*lines, f"{'loops closed to':<16}{loop_gap(answer)}"]


def pose_texts(answer: Answer) -> tuple[list[str], list[str]]:
    """Position [length], and roll, pitch, yaw [deg]."""
    smallest = TOLERANCES.position * answer.mechanism.characteristic_length
    position = [plain(value, smallest) for value in answer.pose[:3, 3]]
    return position, [plain(math.degrees(angle), 1e-7) for angle in to_rpy(answer.pose[:3, :3])]


def pose_cells(answer: Answer) -> list[str]:
    """Position and angles of a pose in one row."""
    position, angles = pose_texts(answer)
    return position + angles


def pose_columns(mechanism: Mechanism) -> list[str]:
    """The columns of `pose_cells`."""
    return [*(f"{name} [{mechanism.length_unit}]" for name in "xyz"), "roll [deg]", "pitch [deg]", "yaw [deg]"]


def actuator_columns(mechanism: Mechanism) -> list[str]:
    """The names of the actuators with their units for people."""
    return [f"{readout.name} [{readout.unit}]" for readout in readouts(mechanism)]


def _actuators(answer: Answer) -> list[Sequence[str]]:
    """Columns: the actuator values, the values asked for if they are not reached, and the limits."""
    shown, asked = readouts(answer.mechanism), answer._values
    columns = [["actuator", *(readout.name for readout in shown)], ["value", *in_units(shown, answer.actuators)]]
    if asked is not None and not answer:
        columns.append(["asked", *in_units(shown, asked[0])])
    for side, bound in enumerate(("min", "max")):
        columns.append([bound, *(bound_text(readout.limits[side]) for readout in shown)])
    return [*columns, ["unit", *(readout.unit for readout in shown)]]


def in_units(shown: Sequence[Readout], values: Floats) -> list[str]:
    """Actuator coordinates (n_a,) [length or rad] in the units for people."""
    return [plain(float(readout.display(value)), 1e-9) for readout, value in zip(shown, values, strict=True)]
