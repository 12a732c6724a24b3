"""Machines at other values of their dimensions.

What a file's expressions, the reading of its legs and the legs' own routines compute is noted once, as expressions of
the dimensions and of a pose, and computed again, compiled, with other values: first what is the same at all poses, then
what is not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats
from ...common.checks import names_of
from ...common.derived import derived
from ...errors import UnknownName, UnsupportedMechanism
from ...kernels.enclosing import N_PLACES
from ...kernels.handle import Handle
from ...kernels.home import measure_home
from ...kernels.legs.margin_rows import feasibility, read_targets
from ...kernels.search_constants import CLOSED, NEARLY_CLOSED
from ...machine.decomposition.leg_forms import NoLeg
from ...machine.decomposition.leg_table import LegTable, leg_table
from ...machine.description.geometry import AT_POINTS
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.model import model_of
from ...machine.motion.mobility import generic_of
from ...machine.noted_numbers import NOTHING, Formulas, Number
from ...tolerances import TOLERANCES
from ..joints.parasitic import has_parasitic_motion
from ..pose.table import kernel_table, table_handle
from ..pose.tip_engine import measured
from .noted_reading import NotedReading
from .placed_legs import PlacedLegs, open_motions

STEP = 1e-6
"""Share of L in its central differences, by which only the margins of legs that do not close have slopes."""

MOST_NOTED = 8
"""How many expressions of one machine, for other outcomes of decisions, are kept."""


def varied(mechanism: Mechanism, names: str | Sequence[str] | None = None) -> VariedMachine:
    """The machine with some of its dimensions open.

    Parameters
    ----------
    mechanism : Mechanism
        A machine from a file with dimensions, whose chains are all legs in closed form.
    names : str or sequence of str, optional
        Names of the p dimensions that vary; the others stay. By default all that are numbers in the file.

    Raises
    ------
    UnknownName
        It has no dimension of that name.
    UnsupportedMechanism
        Formulas of its legs do not give all margins; with the reason.
    """
    source = checked_mechanism(mechanism).__dict__.get("_source")
    if names is None:
        names = () if source is None else source.independent
    return _varied(mechanism, names_of("names", names))


@derived
def _varied(mechanism: Mechanism, names: tuple[str, ...]) -> VariedMachine:
    for name in names:
        if name not in mechanism.dimensions:
            raise UnknownName("dimension", name, mechanism.dimensions)
    model, reason = model_of(mechanism), ""
    if "_source" not in mechanism.__dict__:
        reason = "it was not read from a file with dimensions"
    elif model.why_poses_do_not_suffice:
        reason = model.why_poses_do_not_suffice
    elif measured(model) is not model:
        reason = "one leg places its end effector as a point"
    elif mechanism.clearance is not None:
        reason = "its links keep a clearance"
    if reason:
        raise UnsupportedMechanism(mechanism.name, [reason], "varied")
    return VariedMachine(mechanism, names)


class VariedMachine:
    """A machine whose dimensions vary; its limits are rows of numbers, never faults.

    Attributes
    ----------
    mechanism : Mechanism
        The machine as described.
    names : tuple of str
        Names of the p dimensions that vary.
    limits : tuple of tuple of str
        Pairs (joint, bound) of the r limits: those of `Feasibility.limits` that can bind.
    reach_rows : tuple of int
        Which of them are dead points of legs.
    """

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]) -> None:
        self.mechanism, self.names = mechanism, names
        own = np.array([mechanism.dimensions[name] for name in names])
        self._noted = [NotedMachine(mechanism, names, own)]
        self.limits, self.reach_rows = self._noted[0].legs.limits, self._noted[0].legs.reach_rows

    def at(self, values: ArrayLike) -> MachineAt:
        """The machine at values (p,) of the dimensions, in the units of the file.

        Raises
        ------
        InvalidMechanism
            The file's expressions have no values there; limits that home exceeds are no fault.
        UnsupportedMechanism
            Its legs or limits are others than those of the machine as described.
        """
        given = np.asarray(values, float)
        for noted in self._noted if given.shape == (len(self.names),) else []:
            found = noted.at(given)
            if found is not None:
                return found
        given = array("values", values, f"{len(self.names)}", "finite values", f": {', '.join(self.names)}")
        noted = NotedMachine(self.mechanism, self.names, given)
        found = noted.at(given)
        if found is None or noted.legs.limits != self.limits:
            raise UnsupportedMechanism(self.mechanism.name, ["its legs are others with these dimensions"], "varied")
        self._noted = [noted, *self._noted[: MOST_NOTED - 1]]
        return found


class NotedMachine:
    """The expressions of a varied machine; they hold as long as decisions come out as when they were noted."""

    def __init__(self, mechanism: Mechanism, names: Sequence[str], values: Floats) -> None:
        self.mechanism = mechanism
        reading, p = NotedReading(mechanism, names, values), len(names)
        sketch, trace, given, numbers = reading.sketch, reading.trace, reading.given, reading.numbers
        centres = [x for x in numbers[AT_POINTS - 1 :][: 3 * len(sketch.joints)] if not math.isnan(float(x))]
        if not _radii(np.array([centres], float))[0]:
            centres += numbers[:3]
        self._size = 0.0 if _radii(np.array([centres], float))[0] else sketch.characteristic_length
        length = trace.input(sketch.characteristic_length)
        try:
            self.table = leg_table(sketch, [length, *numbers, *reading.limits])
        except NoLeg as reason:
            raise UnsupportedMechanism(mechanism.name, [str(reason)], "varied") from None
        self.legs = legs = PlacedLegs(trace, self.table, length)
        self.is_coupled = self.table.is_completed and (
            not self.table.is_for_blocks or has_parasitic_motion(model_of(mechanism).path_closure)
        )
        self._centres = Formulas(centres, given, p)
        self._decided = np.array(list(trace.decisions.values()), float).tobytes()
        parts: list[list[Any]] = [list(trace.decisions.values()), [length], numbers[:3], legs.uniform]
        self.written = _written(self.table) if self.table.is_completed else []
        parts.append([number for *_, number in self.written])
        parts.append([reading.limits[2 * drive.column + end] for drive in mechanism.drives for end in (0, 1)])
        self._spans = list(pairwise(np.cumsum([0, *map(len, parts)]).tolist()))
        outputs = [number for part in parts for number in part]
        self._uniform = Formulas(outputs, [*given, length], p + 1)

    def at(self, values: Floats) -> MachineAt | None:
        """The machine at values of the dimensions; None if a decision comes out otherwise there."""
        length = self._size or _radii(self._centres(values)[0])[0]
        given = np.empty(len(values) + 1)
        given[:-1], given[-1] = values, length
        found = self._uniform(given)[0][0]
        decided, *parts = [found[a:b] for a, b in self._spans]
        if decided.tobytes() != self._decided or not math.isfinite(np.add.reduce(found[: self._spans[3][1]])):
            return None
        return MachineAt(self, values, parts)

    def slopes_at(self, values: Floats, length: float) -> tuple[Floats, Floats]:
        """Slopes of the reference point, and of what is the same at all poses, by the dimensions: (3, p), (m, p)."""
        p = len(values)
        tangents = np.eye(p + 1, p)
        if not self._size:
            centres, moved = self._centres(values, NOTHING, np.eye(p))
            steps = STEP * length / np.maximum(np.abs(moved[0]).max(axis=0), STEP)
            ends = _radii(np.concatenate([centres + (moved[0] * step).T for step in (steps, -steps)]))
            tangents[p] = (ends[:p] - ends[p:]) / (2.0 * steps)
        _, slopes = self._uniform(np.append(values, length), NOTHING, tangents)
        _, _, (a, b), (c, d), *_ = self._spans
        return slopes[0, a:b], slopes[0, c:d]

    @derived
    def program(self, name: str) -> Formulas:
        """Formulas of the legs at poses: margins or actuators, constraints, and margins of the reach of legs."""
        legs = self.legs
        asked = legs.margins if name == "margins" else legs.actuators
        return legs.formulas([*asked, *legs.rows, *legs.reach])

    def tangents(self, moved: Floats, by_pose: bool) -> Floats:
        """Slopes of all inputs: of what is the same at all poses by p dimensions, (m, p), then by twists and q."""
        (m, p), n_q = moved.shape, len(self.legs.q)
        tangents = np.zeros((m + 18 + n_q, p + (6 + n_q if by_pose else 0)))
        tangents[:m, :p] = moved
        if by_pose:
            tangents[m : m + 6, p : p + 6], tangents[m + 18 :, p + 6 :] = np.eye(6), np.eye(n_q)
        return tangents


def _written(table: LegTable) -> list[tuple[str, int, str, int, Number]]:
    """The numbers of a table that note their steps: array, row, field and place in this of each."""
    return [
        (name, row, field, place, number)
        for name, rows in table.fields.items()
        for row, fields in enumerate(rows)
        for field, given in fields.items()
        for place, number in enumerate(np.ravel(np.array(given, object)).tolist())
        if isinstance(number, Number)
    ]


def _radii(centres: Floats) -> Floats:
    """Radii of the smallest spheres around points, of which each row (3 n,) has all."""
    n = centres.shape[1] // 3
    numbers, scratch, places, radii = np.zeros(4 + 9 * n), np.empty(6 * n + 8), np.empty(N_PLACES, int), []
    for row in centres:
        numbers[4 : 4 + 3 * n] = row
        measure_home(numbers, n, scratch, places)
        radii.append(numbers[0])
    return np.array(radii)


AT_REST = np.zeros(6)
"""The twist that numbers of a pose have slopes by."""


class PlacedValues(NamedTuple):
    """Values of expressions at n poses, views of one array.

    Attributes
    ----------
    values, rows, reach : the values asked for, the constraints, and the margins of the reach of legs.
    slopes, row_slopes : of the first two.
    completed : the poses.
    """

    values: Floats
    rows: Floats
    reach: Floats
    slopes: Floats
    row_slopes: Floats
    completed: Floats


class MachineAt:
    """A varied machine at values of its dimensions; poses are targets (n, 4, 4) [length], reached in home's mode."""

    def __init__(self, noted: NotedMachine, values: Floats, parts: Sequence[Floats]) -> None:
        self._noted, self._values = noted, values
        (length,), self._reference, self._uniform, self._written, self._ends = parts
        self._length = float(length)

    @property
    def characteristic_length(self) -> float:
        """L: the radius of the smallest sphere about the centres of all joints at home [length]."""
        return self._length

    @property
    def ranges(self) -> Floats:
        """Lowest and highest values of the actuators, (n_a, 2) [length or rad]; infinite where they have no end."""
        return self._ends.reshape(-1, 2)

    @cached_property
    def home_pose(self) -> Floats:
        """The pose of the end effector at home, (4, 4) [length]."""
        pose = np.eye(4)
        pose[:3, 3] = self._reference
        return pose

    def margins(self, poses: Floats) -> Floats:
        """Signed margins (n, r), as of `feasibility`, whose margin is the least of a row.

        Finite where legs do not reach, infinite for the reach and the closure of legs that do; NaN of what is no pose.
        """
        return self._evaluated("margins", poses).values

    def actuators(self, poses: Floats) -> Floats:
        """Values of the actuators (n, n_a) [length or rad]; where a leg does not reach, those that come nearest."""
        return self._evaluated("actuators", poses).values

    def inverse_jacobians(self, poses: Floats) -> Floats:
        """Derivatives (n, n_a, 6) of the actuators by velocity [length] and angular velocity of the end effector."""
        placed = self._evaluated("actuators", poses, by_pose=True)
        by_pose, by_q, rows = placed.slopes[:, :, :6], placed.slopes[:, :, 6:], placed.row_slopes
        if by_q.shape[2]:
            by_pose = by_pose - by_q @ np.linalg.pinv(rows[:, :, 6:], TOLERANCES.rank) @ rows[:, :, :6]
        return by_pose

    def motions(self, poses: Floats) -> tuple[Floats, Floats]:
        """Motions of the end effector that the constraints leave: their actuator rates (n, n_a, f), and their twists
        (n, 6, f), of which velocities are in L; NaN where the constraints' slopes have no values."""
        placed, mechanism = self._evaluated("actuators", poses, by_pose=True), self._noted.mechanism
        n, freedoms = placed.slopes.shape[2], generic_of(mechanism).mobility.platform
        units = np.append(np.full(3, self._length), np.ones(n - 3))
        held = np.zeros((len(placed.rows), n, n))
        held[:, [3, 4, 5], [3, 4, 5]] = mechanism.end_effector_is_joint
        rows = np.concatenate([placed.row_slopes, held], axis=1)
        moves = np.full((len(rows), n, freedoms), np.nan)
        known = np.isfinite(rows).all(axis=(1, 2))
        moves[known] = np.swapaxes(np.linalg.svd(rows[known] * units)[2][:, n - freedoms :], 1, 2)
        return placed.slopes * units @ moves, moves[:, :6]

    def slopes(self, poses: Floats) -> Floats:
        """Derivatives (n, r, p) of the margins by the dimensions; what a task leaves open moves so that legs close.

        With H the slopes of the constraints by what is open, x, and g those by the dimensions, H dx + g = 0. The pose
        is held where legs do not close; where they leave x open, it moves as little as it can, to first order.
        """
        noted, p = self._noted, len(self._values)
        reference, moved = noted.slopes_at(self._values, self._length)
        placed = self._evaluated("margins", poses, moved=moved)
        if not noted.table.is_completed:
            return placed.slopes
        is_closed = (np.abs(placed.rows) <= NEARLY_CLOSED).all(axis=1)
        unset = reference[(noted.table.task["axes"][0] == 0) & (noted.table.task["unset"] > 0)]
        if not unset.any() and (np.abs(placed.row_slopes[is_closed]) * np.abs(self._values) <= NEARLY_CLOSED).all():
            return placed.slopes
        placed = self._evaluated("margins", poses, by_pose=True, moved=moved)
        slopes, row_slopes = placed.slopes, placed.row_slopes
        rotations, n_q = placed.completed[:, :12].reshape(-1, 3, 4)[:, :, :3], len(noted.legs.implicit)
        motions = open_motions(noted.table, rotations, n_q)
        begun = np.zeros((motions.shape[2], p))
        begun[: len(unset)] = unset
        by_open = row_slopes[:, :, p:] @ motions
        left = row_slopes[is_closed, :, :p] + by_open[is_closed] @ begun
        dx = np.zeros((len(slopes), *begun.shape))
        dx[is_closed] = begun - np.linalg.pinv(by_open[is_closed], TOLERANCES.rank) @ left
        return np.asarray(slopes[:, :, :p] + slopes[:, :, p:] @ motions @ dx)

    def _evaluated(self, name: str, poses: Floats, by_pose: bool = False, moved: Floats | None = None) -> PlacedValues:
        """Expressions of the legs at targets, with slopes: by dimensions, where these move what is the same at all
        poses, then by the pose."""
        noted, legs = self._noted, self._noted.legs
        program, tangents = noted.program(name), None
        if moved is not None or by_pose:
            tangents = noted.tangents(np.empty((len(self._uniform), 0)) if moved is None else moved, by_pose)
        uniform = np.concatenate([self._uniform, AT_REST])
        targets, begin = np.ascontiguousarray(poses, float), self.home_pose[None]
        if noted.is_coupled:
            completed = self._completed(targets, begin)
        else:
            completed = np.empty((len(targets), 12))
            read_targets(table_handle(noted.table).address, targets, begin, completed)
        values, slopes = program(uniform, completed, tangents)
        end = values.shape[1] - len(legs.reach)
        n = end - len(legs.rows)
        placed = PlacedValues(
            values[:, :n], values[:, n:end], values[:, end:], slopes[:, :n], slopes[:, n:end], completed
        )
        if noted.table.is_completed and not noted.is_coupled and not np.abs(placed.rows).max(initial=0.0) <= CLOSED:
            is_open = (np.abs(placed.rows) > CLOSED).any(axis=1) & (placed.reach == math.inf).all(axis=1)
            if is_open.any():
                completed[is_open] = self._completed(targets[is_open], begin)
                values[is_open], slopes[is_open] = program(uniform, completed[is_open], tangents)
        return placed

    def _completed(self, targets: Floats, begin: Floats) -> Floats:
        """Poses and coordinates of implicit joints that targets are completed to, in rows (n, 12 + implicit)."""
        noted, table = self._noted, self._noted.table
        arrays = {name: getattr(table, name).copy() for name in table.fields}
        for (name, row, field, place, _), number in zip(noted.written, self._written, strict=True):
            arrays[name][field][row : row + 1].reshape(1, -1)[0, place] = number
        handle = Handle(kernel_table(table)._replace(**{name: arrays[name] for name in arrays if name != "aimed"}))
        completed, margins = np.full((len(targets), 12 + len(table.legs)), math.nan), np.empty(len(targets))
        sides = np.array(arrays["legs"]["side"], float)[None]
        feasibility(handle.address, targets, begin, sides, margins, np.empty(len(targets), np.int64), completed)
        return np.ascontiguousarray(completed[:, [*range(12), *(12 + k for k in noted.legs.implicit)]])
