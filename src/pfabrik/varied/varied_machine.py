"""Machines at other values of their dimensions.

What a file's expressions, the reading of its legs and the legs' own routines compute is noted once, as expressions of
the dimensions and of a pose, and computed again, compiled, with other values: first what is the same at all poses, then
what is not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import array
from ..arrays import Floats
from ..checks import names_of
from ..closure.parasitic import has_parasitic_motion
from ..decomposition.leg_forms import NoLeg
from ..decomposition.leg_table import leg_table
from ..derived import derived
from ..description.geometry import AT_POINTS, described_numbers, limit_numbers
from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import UnknownName, UnsupportedMechanism
from ..kernels.enclosing import N_PLACES
from ..kernels.handle import Handle
from ..kernels.home import measure_home
from ..kernels.legs.feasibility import feasibility, read_targets
from ..kernels.search_constants import CLOSED, NEARLY_CLOSED
from ..model import model_of
from ..noted_numbers import Formulas, Trace, uniform_parts
from ..platform.table import kernel_table, table_handle
from ..platform.tip_engine import measured
from ..tolerances import TOLERANCES
from .placed_legs import PlacedLegs, replayed

STEP = 1e-6
"""Share of L in its central differences, by which only the margins of legs that do not close have slopes."""

MOST_NOTED = 8
"""How many expressions of one machine, for other outcomes of decisions, are kept."""

NOTHING = np.empty((1, 0))


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
    if model.why_poses_do_not_suffice:
        reason = f"no legs in closed form, {model.why_poses_do_not_suffice}"
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
    """

    def __init__(self, mechanism: Mechanism, names: tuple[str, ...]) -> None:
        self.mechanism, self.names = mechanism, names
        own = np.array([mechanism.dimensions[name] for name in names])
        self._noted = [NotedMachine(mechanism, names, own)]
        self.limits = self._noted[0].legs.limits

    def at(self, values: ArrayLike) -> MachineAt:
        """The machine at values (p,) of the dimensions, in the units of the file.

        Raises
        ------
        InvalidMechanism
            No machine has these dimensions, with every fault; limits that home exceeds are none.
        UnsupportedMechanism
            Its legs or limits are others than those of the machine as described.
        """
        given = array("values", values, f"{len(self.names)}", "finite values", f": {', '.join(self.names)}")
        for noted in self._noted:
            numbers = noted.at(given)
            if numbers is not None:
                return MachineAt(noted, given, numbers)
        noted = NotedMachine(self.mechanism, self.names, given)
        numbers = noted.at(given)
        if numbers is None or noted.legs.limits != self.limits:
            raise UnsupportedMechanism(self.mechanism.name, ["its legs are others with these dimensions"], "varied")
        self._noted = [noted, *self._noted[: MOST_NOTED - 1]]
        return MachineAt(noted, given, numbers)


class NotedMachine:
    """The expressions of a varied machine; they hold as long as decisions come out as when they were noted."""

    def __init__(self, mechanism: Mechanism, names: Sequence[str], values: Floats) -> None:
        source, own = mechanism.__dict__["_source"], dict(zip(names, values.tolist(), strict=True))
        sketch, trace, p = source.sketch_with(own), Trace(), len(names)
        try:
            self.table = leg_table(sketch)
        except NoLeg as reason:
            raise UnsupportedMechanism(mechanism.name, [str(reason)], "varied") from None
        given = [trace.input(value) for value in own.values()]
        numbered = source.sketch_with(dict(zip(names, given, strict=True)))
        numbers = described_numbers(numbered)
        centres = [x for x in numbers[AT_POINTS - 1 :][: 3 * len(sketch.joints)] if not math.isnan(float(x))]
        if not _radius(np.array(centres, float)):
            centres += numbers[:3]
        self._size = 0.0 if _radius(np.array(centres, float)) else sketch.characteristic_length
        length = trace.input(sketch.characteristic_length)
        words = replayed(self.table, [length, *numbers, *limit_numbers(numbered)])
        self.legs = legs = PlacedLegs(trace, self.table, words, length)
        model = model_of(mechanism)
        self.is_coupled = self.table.is_completed and not (
            self.table.is_for_blocks and not has_parasitic_motion(model.path_closure)
        )
        self._programs: dict[tuple[str, int, bool], Formulas] = {}
        self.uniform = uniform_parts([*legs.margins, *legs.rows, *legs.actuators])
        self._centres = Formulas(centres, given, p, np.ones((p, p), bool))
        self._decided = np.array([answer for _, answer in trace.decisions.values()], bool)
        parts: list[list[Any]] = [[number for number, _ in trace.decisions.values()], numbers[:3], self.uniform]
        recording: Any = self.table.recording
        self.written = [word + k for word, _, size in recording.writes.tolist() for k in range(size)]
        parts += [[words[word] for word in self.written]] if self.table.is_completed else []
        self._spans = list(pairwise(np.cumsum([0, *map(len, parts)]).tolist()))
        outputs = [number for part in parts for number in part]
        self._uniform = Formulas(outputs, [*given, length], p + 1, np.ones((p + 1, p), bool))

    def at(self, values: Floats) -> list[Floats] | None:
        """L, the reference point, what is the same at all poses, and words; None if a decision comes out otherwise."""
        length = self._size
        if not length:
            centres, _ = self._centres(values, NOTHING, np.empty((len(values), 0)))
            length = _radius(centres[0])
        found, _ = self._uniform(np.append(values, length), NOTHING, np.empty((len(values) + 1, 0)))
        decided, reference, uniform, *words = (found[0, a:b] for a, b in self._spans)
        if not np.array_equal(decided != 0.0, self._decided) or not np.isfinite(reference).all():
            return None
        return [np.array([length]), reference, uniform, *words]

    def slopes_at(self, values: Floats, length: float) -> tuple[Floats, Floats]:
        """Slopes of the reference point, and of what is the same at all poses, by the dimensions: (3, p), (m, p)."""
        p = len(values)
        tangents = np.eye(p + 1, p)
        if not self._size:
            centres, moved = self._centres(values, NOTHING, np.eye(p))
            for k, direction in enumerate(moved[0].T):
                step = STEP * length / (np.abs(direction).max() or 1.0)
                more, less = (_radius(centres[0] + sense * step * direction) for sense in (1.0, -1.0))
                tangents[p, k] = (more - less) / (2.0 * step)
        _, slopes = self._uniform(np.append(values, length), NOTHING, tangents)
        (_, _), (a, b), (c, d), *_ = self._spans
        return slopes[0, a:b], slopes[0, c:d]

    def program(self, name: str, by_dimensions: int, by_pose: bool) -> Formulas:
        """Formulas of the legs at poses, with slopes by dimensions, and then by twists and implicit joints."""
        key = name, by_dimensions, by_pose
        if key not in self._programs:
            legs, m = self.legs, len(self.uniform)
            n_pose = 6 + len(legs.q) if by_pose else 0
            depends = np.zeros((m + 18 + len(legs.q), by_dimensions + n_pose), bool)
            depends[:m, :by_dimensions] = True
            if by_pose:
                depends[m : m + 6, by_dimensions : by_dimensions + 6] = np.eye(6)
                depends[m + 18 :, by_dimensions + 6 :] = np.eye(len(legs.q))
            outputs = [*(legs.margins if name == "margins" else legs.actuators), *legs.rows, *legs.reach]
            inputs = [*self.uniform, *legs.twist, *legs.pose, *legs.q]
            self._programs[key] = Formulas(outputs, inputs, m + 6, depends)
        return self._programs[key]


def _radius(centres: Floats) -> float:
    """The radius of the smallest sphere around points in a row, (3 n,)."""
    n = len(centres) // 3
    numbers = np.zeros(4 + 9 * n)
    numbers[4 : 4 + 3 * n] = centres
    measure_home(numbers, n, np.empty(6 * n + 8), np.empty(N_PLACES, int))
    return float(numbers[0])


class MachineAt:
    """A varied machine at values of its dimensions; poses are targets (n, 4, 4) [length], reached in home's mode."""

    def __init__(self, noted: NotedMachine, values: Floats, numbers: list[Floats]) -> None:
        self._noted, self._values = noted, values
        (self._length,), self._reference, self._uniform, *self._words = numbers

    @property
    def home_pose(self) -> Floats:
        """The pose of the end effector at home, (4, 4) [length]."""
        pose = np.eye(4)
        pose[:3, 3] = self._reference
        return pose

    def margins(self, poses: Floats) -> Floats:
        """Signed margins (n, r), as of `feasibility`, whose margin is the least of a row.

        Finite where legs do not reach, infinite for the reach and the closure of legs that do; NaN of what is no pose.
        """
        return self._evaluated("margins", poses)[0]

    def actuators(self, poses: Floats) -> Floats:
        """Values of the actuators (n, n_a) [length or rad]; where a leg does not reach, those that come nearest."""
        return self._evaluated("actuators", poses)[0]

    def inverse_jacobians(self, poses: Floats) -> Floats:
        """Derivatives (n, n_a, 6) of the actuators by velocity [length] and angular velocity of the end effector."""
        return self._evaluated("actuators", poses, by_pose=True)[1]

    def slopes(self, poses: Floats) -> Floats:
        """Derivatives (n, r, p) of the margins by the dimensions; what a task leaves open moves so that legs close.

        With H the slopes of the constraints by what is open, x, and g those by the dimensions, H dx + g = 0.
        """
        noted, p = self._noted, len(self._values)
        reference, moved = noted.slopes_at(self._values, self._length)
        if not noted.table.is_completed:
            return self._evaluated("margins", poses, moved=moved)[1]
        _, slopes, rows, row_slopes, completed = self._evaluated("margins", poses, by_pose=True, moved=moved)
        open_motions, begun = self._open_motions(completed, reference)
        by_open = row_slopes[:, :, p:] @ open_motions
        is_closed = np.abs(rows).max(axis=1, initial=0.0) <= NEARLY_CLOSED
        left = row_slopes[is_closed, :, :p] + by_open[is_closed] @ begun
        dx = np.zeros((len(rows), *begun.shape))
        dx[is_closed] = begun - np.linalg.pinv(by_open[is_closed], TOLERANCES.rank) @ left
        return np.asarray(slopes[:, :, :p] + slopes[:, :, p:] @ open_motions @ dx)

    def _open_motions(self, completed: Floats, reference: Floats) -> tuple[Floats, Floats]:
        """Twists and rates (n, 6 + implicit, u) of what a task leaves open; how it begins by the dimensions (u, p).

        Which coordinates are open is as of `kernels.legs.answer.put_motions`.
        """
        task, n_q = self._noted.table.task[0], completed.shape[1] - 12
        axes, rotations = task["axes"].tolist(), int(task["rotations"])
        rotation = completed[:, :12].reshape(-1, 3, 4)[:, :, :3]
        fixed = np.eye(6 + n_q)
        placed = [axis for axis in range(3) if not axes[axis] and task["unset"]]
        columns = [np.broadcast_to(fixed[:, axis], (len(completed), 6 + n_q)) for axis in placed]
        turns: list[Any] = []
        if task["unset"] and rotations == 0:
            turns = [np.broadcast_to(axis, (len(completed), 3)) for axis in np.eye(3)]
        elif task["unset"] and rotations == 2:
            turns = [rotation[:, :, 2]]
        elif task["unset"] and rotations == 1:
            axis = rotation[:, :, 2] + (0.0, 0.0, 1.0)
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            across = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
            turns = [across, np.cross(axis, across)]
        columns += [np.pad(turn, ((0, 0), (3, n_q))) for turn in turns]
        columns += [np.broadcast_to(fixed[:, 6 + k], (len(completed), 6 + n_q)) for k in range(n_q)]
        begun = np.zeros((len(columns), len(self._values)))
        begun[: len(placed)] = reference[placed]
        return np.stack(columns, axis=2) if columns else np.zeros((len(completed), 6 + n_q, 0)), begun

    def _evaluated(
        self, name: str, poses: Floats, by_pose: bool = False, moved: Floats | None = None
    ) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Formulas of the legs at targets, and their slopes; the constraints, and theirs; what was completed.

        Slopes are by dimensions, where these move what is the same at all poses, and by the pose.
        """
        noted = self._noted
        p, n_q = 0 if moved is None else moved.shape[1], len(noted.legs.implicit)
        program, m = noted.program(name, p, by_pose), len(self._uniform)
        tangents = np.zeros((m + 18 + n_q, p + (6 + n_q if by_pose else 0)))
        if moved is not None:
            tangents[:m, :p] = moved
        if by_pose:
            tangents[m : m + 6, p : p + 6], tangents[m + 18 :, p + 6 :] = np.eye(6), np.eye(n_q)
        uniform, legs = np.append(self._uniform, np.zeros(6)), noted.legs
        targets, begin = np.require(poses, float, ["C", "W"]), self.home_pose[None]
        if noted.is_coupled:
            completed = self._completed(targets, begin)
        else:
            completed = np.empty((len(targets), 12))
            read_targets(table_handle(noted.table).address, targets, begin, completed)
        values, slopes = program(uniform, completed, tangents)
        n = values.shape[1] - len(legs.rows) - len(legs.reach)
        end = n + len(legs.rows)
        if noted.table.is_completed and not noted.is_coupled:
            is_open = (np.abs(values[:, n:end]) > CLOSED).any(axis=1) & (values[:, end:] == math.inf).all(axis=1)
            if is_open.any():
                completed[is_open] = self._completed(targets[is_open], begin)
                values[is_open], slopes[is_open] = program(uniform, completed[is_open], tangents)
        return values[:, :n], slopes[:, :n], values[:, n:end], slopes[:, n:end], completed

    def _completed(self, targets: Floats, begin: Floats) -> Floats:
        """Poses and coordinates of implicit joints that targets are completed to, in rows (n, 12 + implicit)."""
        noted, table = self._noted, self._noted.table
        recording: Any = table.recording
        words = recording.words.copy()
        words[noted.written] = self._words[0]
        arrays = recording.arrays(words)
        handle = Handle(kernel_table(table)._replace(**{name: arrays[name] for name in arrays if name != "aimed"}))
        completed, margins = np.full((len(targets), 12 + len(table.legs)), math.nan), np.empty(len(targets))
        sides = np.array(arrays["legs"]["side"], float)[None]
        feasibility(handle.address, targets, begin, sides, margins, np.empty(len(targets), np.int64), completed)
        return np.ascontiguousarray(completed[:, [*range(12), *(12 + k for k in noted.legs.implicit)]])
