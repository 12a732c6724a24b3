"""The legs of a table at a pose, as expressions: routines of `kernels.legs`, run on numbers that note their steps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...kernels import vectors
from ...kernels.legs import answer, frames, margin_rows
from ...kernels.legs import records as K
from ...kernels.search_constants import NEARLY_CLOSED
from ...machine.decomposition.home_numbers import Fields
from ...machine.decomposition.leg_table import LegTable
from ...machine.noted_numbers import Formulas, Number, Trace, of_numbers, uniform_parts, where


class PlacedLegs:
    """The legs of a table at a pose, as expressions.

    Attributes
    ----------
    pose, q : numbers that are given: the rows of the pose [length]; the coordinates of implicit joints [L or rad],
        or `has_sides`, the sides of all legs, which these are among.
    implicit : the legs of these.
    twist : numbers that are zero, by which expressions have slopes by the pose: velocity [length], angular velocity.
    margins, limits : the margins that can bind, and their limits.
    reach_rows, reach : the places of the dead points of legs among them, and their margins.
    actuators : values of the actuators [length or rad].
    rows : the constraints [L or rad].
    uniform : the numbers, the same at all poses, that all these are computed from.
    """

    def __init__(self, trace: Trace, table: LegTable, length: Number, *, has_sides: bool = False) -> None:
        """The legs of a table of numbers that note their steps, L among them."""
        records = {name: noted_records(getattr(table, name), fields) for name, fields in table.fields.items()}
        legs, task = records["legs"], records["task"][0]
        n = len(legs)
        home = [[float(i == j) for j in range(3)] + [float(task["reference"][i]) * float(length)] for i in range(3)]
        self.pose = [trace.input(x, is_open=True) for row in home for x in row]
        self.twist = [trace.input(0.0, is_open=True) for _ in range(6)]
        self.implicit = [k for k in range(n) if legs[k]["implicit"] == 1 and legs[k]["mirror_of"] < 0]
        given = range(n) if has_sides else self.implicit
        self.q = [trace.input(float(legs[k]["side"]), is_open=True) for k in given]
        sides = [leg["side"] for leg in legs]
        for k, q in zip(given, self.q, strict=True):
            sides[k] = q
        placed = frames.new_frames(table.legs).astype(object)
        values, lines, rows = (np.zeros(shape).astype(object) for shape in ((n, K.N_VALUES), (n, 3), task["rows"]))
        of_numbers(frames.set_frames)(self._moved(length), task, placed)
        of_numbers(answer.place_legs)(legs, placed, sides, values, lines)
        of_numbers(answer.put_leg_rows)(legs, placed, values, lines, rows)
        measured = zip(table.measured_limits, _margins(records, values, rows), strict=True)
        binding = [
            (place, limit, margin)
            for place, (limit, margin) in enumerate(measured)
            if isinstance(margin, Number) or margin < math.inf
        ]
        self.limits, self.margins = tuple(limit for _, limit, _ in binding), [margin for _, _, margin in binding]
        dead_points = range(len(table.limits), len(table.limits) + n)
        self.reach_rows = tuple(row for row, (place, _, _) in enumerate(binding) if place in dead_points)
        self.reach = [self.margins[row] for row in self.reach_rows]
        self.rows = rows.tolist()
        deviation = of_numbers(answer.deviation)
        driven = sorted(records["driven"], key=lambda each: each["column"])
        self.actuators = [each["home"] + deviation(each, values) * each["unit"] for each in driven]
        self.uniform = uniform_parts([*self.margins, *self.rows, *self.actuators])

    def formulas(self, outputs: Sequence[Any]) -> Formulas:
        """Formulas by the inputs `uniform` and `twist`, the same at all poses, then `pose` and `q`."""
        return Formulas(outputs, [*self.uniform, *self.twist, *self.pose, *self.q], len(self.uniform) + 6)

    def _moved(self, length: Number) -> Any:
        """The pose [L], moved by the twist."""
        pose, cross = np.array(self.pose, object).reshape(3, 4), of_numbers(vectors.cross)
        moved = np.zeros((4, 4)).astype(object)
        for j in range(3):
            across = cross(tuple(self.twist[3:]), tuple(pose[:, j]))
            moved[:3, j] = [x + dx for x, dx in zip(pose[:, j], across, strict=True)]
        moved[:3, 3] = [(x + dx) / length for x, dx in zip(pose[:, 3], self.twist[:3], strict=True)]
        return moved


def _margins(records: dict[str, Any], values: Any, rows: Any) -> Iterator[Any]:
    """Margins in the order of `LegTable.measured_limits`; infinite where a leg reaches, and where it closes."""
    legs = records["legs"]
    for coordinate in records["limited"]:
        yield from of_numbers(margin_rows.range_margins)(coordinate, values)
    for cone in records["cones"]:
        yield of_numbers(margin_rows.cone_margin)(cone, values)
    reach = [of_numbers(margin_rows.reach_margin)(leg, own) for leg, own in zip(legs, values, strict=True)]
    closed = [of_numbers(margin_rows.closing_margin)(legs, k, rows, values) for k in range(len(legs))]
    for margin in (*reach, *closed):
        yield where(margin < -NEARLY_CLOSED, margin, math.inf)


def open_motions(table: LegTable, rotations: Floats, n_implicit: int) -> Floats:
    """Twists and rates of what a task leaves open at rotations (n, 3, 3), as of `kernels.legs.answer.put_motions`.

    Returns
    -------
    Columns (n, 6 + implicit, u): positions, turns, implicit joints.
    """
    task, n = table.task[0], len(rotations)
    fixed = np.eye(6 + n_implicit)
    columns = [fixed[:, axis] for axis in range(3) if task["unset"] and not task["axes"][axis]]
    if task["unset"] and task["rotations"] == 0:
        columns += [*fixed[:, 3:6].T]
    elif task["unset"] and task["rotations"] < 3:
        axis = rotations[:, :, 2]
        turns = [axis]
        if task["rotations"] == 1:
            axis = axis + (0.0, 0.0, 1.0)
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            across = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
            turns = [across, np.cross(axis, across)]
        columns += [np.pad(turn, ((0, 0), (3, n_implicit))) for turn in turns]
    columns += [*fixed[:, 6:].T]
    motions = np.zeros((n, 6 + n_implicit, len(columns)))
    for k, column in enumerate(columns):
        motions[:, :, k] = column
    return motions


def noted_records(array: Any, fields: Sequence[Fields]) -> Any:
    """An array of records as mappings, with what they were filled from where that notes its steps."""
    made = np.empty(len(array), object)
    for row, (record, given) in enumerate(zip(array, fields, strict=True)):
        made[row] = {name: _noted(record[name], given.get(name), array.dtype[name]) for name in array.dtype.names}
    return made


def _noted(value: Any, given: Any, kind: Any) -> Any:
    """A field of a record, of numbers that note their steps."""
    if not kind.shape:
        return given if isinstance(given, Number) else value.item()
    noted = np.array(value, object)
    if given is not None and kind.base.kind == "f":
        for place, number in enumerate(given):
            noted[place] = number
    return noted
