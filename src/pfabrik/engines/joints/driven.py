"""A machine driven along a stream, tick by tick: what engines promise, and that by joint coordinates."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from ...common.arrays import Floats, Record, Records
from ...kernels.drives import DRIVE, TICK
from ...kernels.handle import Handle
from ...kernels.joints import live_joints as K
from ...kernels.joints.linearise_loops import new_descent_scratch
from ...kernels.joints.loops import Closed
from ...kernels.joints.path_kinematics import load_row, new_state, store_row
from ...kernels.legs.records import TASK
from ...machine.description.home_mobility import column_joints
from ...machine.model import Model
from ...machine.motion.singularities import are_opposite, assembly_signs, loop_blocks
from ...options import Options
from ...tolerances import TOLERANCES
from .configurations import Configurations
from .link_distances import pair_names
from .placed_links import links_on_paths
from .projection import modes_of


class Driven(ABC):
    """A machine that a stream of targets drives, where it is, and the limits that hold it.

    Attributes
    ----------
    target : array (4, 4), to be written before a tick [length].
    pose, actuators : arrays (4, 4) and (n_a,), where it is [length or rad].
    tick : the record `TICK` of the last tick.
    drives : the records `DRIVE` of its drives, in the order of `actuators`.
    """

    target: Floats
    pose: Floats
    actuators: Floats
    tick: Record
    drives: Records

    def __init__(self, model: Model, options: Options) -> None:
        self._model, self._mode = model, modes_of(model.closure, options)[-1]

    def distance(self, poses: Floats) -> float:
        """Distance of a pose (1, 4, 4) from the target, with the price of what is held [L]."""
        errors = self._model.task.errors(poses, self.target[None])
        return float(self._mode.distances(self._model.closure, *errors)[0])

    @abstractmethod
    def has_mode_of(self, configurations: Configurations) -> bool:
        """True if a configuration, one, is on the same sides of all dead points that are known."""

    @abstractmethod
    def go_on(self, dt: float) -> int:
        """One tick of dt seconds; its status."""

    @abstractmethod
    def walk_to(self, actuators: Floats | None) -> None:
        """Let ticks go to values of drives (n_a,), not to their targets; None to end that."""

    @abstractmethod
    def speeds(self) -> Floats:
        """How fast the drives went in the last tick (n_a,) [length or rad, per s]."""

    @abstractmethod
    def place(self, configurations: Configurations) -> None:
        """Let it rest where a configuration, one, has it; the rates of its drives are none."""

    @abstractmethod
    def coordinates(self) -> Floats:
        """All joint coordinates, deviations from home (1, columns) [length or rad]."""

    @abstractmethod
    def multipliers(self) -> dict[tuple[str, str], float]:
        """Multipliers of the limits in the last search of a tick, by joint and bound; `speed` of drives."""


class DrivenJoints(Driven):
    """As `Driven`, in joint coordinates."""

    def __init__(self, model: Model, options: Options, speeds: Floats, accelerations: Floats) -> None:
        super().__init__(model, options)
        closure, mechanism, length = model.closure, model.mechanism, model.length
        mode, n = self._mode, len(closure.actuated)
        loops = closure.loops._replace(lo=closure.loops.lo.copy(), hi=closure.loops.hi.copy())
        task, aim, drives = np.zeros(1, TASK), np.zeros(1, K.AIM), np.zeros(n, DRIVE)
        task["length"], task["axes"], task["rotations"] = length, model.task.axes, model.task.rotations
        task["reference"] = np.asarray(mechanism.reference_point) / length
        aim[0] = (
            model.task.frame,
            mode.hold,
            mode.price,
            mode.rounding,
            TOLERANCES.inside,
            TOLERANCES.active,
            TOLERANCES.position if options.tolerance is None else options.tolerance / length,
            options.rotation_tolerance,
        )
        units = 1.0 / closure.scale[closure.actuated]
        drives["lo"], drives["hi"] = loops.lo[closure.actuated], loops.hi[closure.actuated]
        drives["lo"] += TOLERANCES.inside
        drives["hi"] -= TOLERANCES.inside
        drives["speed"], drives["acceleration"] = speeds / units, accelerations / units
        drives_alone = np.zeros(len(closure.scale))
        drives_alone[closure.actuated] = 1.0
        self._model, self._live = (
            model,
            K.LiveJoints(
                loops,
                task,
                aim,
                np.array(mode.weights, dtype=float),
                np.zeros(6),
                drives,
                closure.actuated,
                units,
                closure.home,
                np.zeros(1, TICK),
                new_state(loops),
                np.zeros(len(closure.scale)),
                np.eye(4)[None].copy(),
                np.eye(4)[None].copy(),
                np.zeros(len(closure.scale)),
                drives_alone,
                np.zeros((1, len(closure.scale))),
                np.zeros(n),
                np.eye(4),
            ),
        )
        self._handle = Handle(self._live)
        self._scratch = Handle(new_descent_scratch(loops, *links_on_paths(mechanism)))
        self.target, self.pose, self.actuators = self._live.targets[0], self._live.pose, self._live.actuators
        self.tick, self.drives = self._live.tick[0], drives
        self._signs = np.zeros(0)
        self._has_signs = bool(loop_blocks(mechanism))

    def go_on(self, dt: float) -> int:
        """As of `Driven`; a tick that would pass a dead point of a loop is not taken."""
        if self._has_signs:
            return self._go_on_before_dead_points(dt)
        return K.tick_joints(self._handle.address, self._scratch.address, dt)

    def _go_on_before_dead_points(self, dt: float) -> int:
        live, mechanism = self._live, self._model.mechanism
        before = [array.copy() for array in (*live.state, live.drives)]
        speeds = live.drives["speed"].copy()
        for _ in range(4):
            status = K.tick_joints(self._handle.address, self._scratch.address, dt)
            if not are_opposite(assembly_signs(mechanism, self.coordinates()), self._signs).any():
                live.drives["speed"] = speeds
                return status
            for array, saved in zip((*live.state, live.drives), before, strict=True):
                array[:] = saved
            live.drives["speed"] *= 0.2
        live.drives["speed"] = 0.0
        status = K.tick_joints(self._handle.address, self._scratch.address, dt)
        live.drives["speed"] = speeds
        return status

    def walk_to(self, actuators: Floats | None) -> None:
        """As of `Driven`."""
        live = self._live
        self.tick["walks"] = 0 if actuators is None else 1
        if actuators is not None:
            live.anchors[0, live.columns] = (actuators - live.homes) / live.units

    def speeds(self) -> Floats:
        """As of `Driven`."""
        return np.asarray(self.drives["rate"] * self._live.units)

    def has_mode_of(self, configurations: Configurations) -> bool:
        """As of `Driven`."""
        signs = (
            assembly_signs(self._model.mechanism, configurations.coordinates) if self._has_signs else np.zeros((1, 0))
        )
        return not are_opposite(signs, self._signs).any()

    def place(self, configurations: Configurations) -> None:
        """As of `Driven`."""
        live, coordinates = self._live, configurations.coordinates * self._model.closure.scale
        load_row(live.loops, 0, self._closed(coordinates), live.state)
        K.place_joints(self._handle.address, self._scratch.address)
        if self._has_signs:
            self._signs = assembly_signs(self._model.mechanism, configurations.coordinates)[0]

    def coordinates(self) -> Floats:
        """As of `Driven`."""
        closed = self._closed(np.zeros((1, len(self._live.free))))
        store_row(self._live.loops, 0, self._live.state, closed)
        return closed.coordinates / self._model.closure.scale

    @staticmethod
    def _closed(coordinates: Floats) -> Closed:
        none = np.zeros((1, 0))
        return Closed(coordinates, np.eye(4)[None].copy(), none, none, none, np.zeros(1, np.int64))

    def multipliers(self) -> dict[tuple[str, str], float]:
        """As of `Driven`."""
        values, mechanism = self._scratch.record.hessian.multipliers, self._model.mechanism
        joints, n, found = column_joints(mechanism), len(self._live.free), dict[tuple[str, str], float]()
        is_drive = {column: drive for drive, column in enumerate(self._live.columns)}
        cones = [joint.name for joint in mechanism.joints if joint.cone is not None]
        pairs = pair_names(mechanism) if mechanism.clearance is not None else ()
        for number in np.flatnonzero(values > 0.0).tolist():
            if number < 2 * n:
                column, bound = number // 2, ("min", "max")[number % 2]
                if column in is_drive:
                    bound = held_by(self.drives[is_drive[column]], bound)
                name = mechanism.joints[joints[column]].name, bound
            elif number < 2 * n + len(cones):
                name = cones[number - 2 * n], "cone"
            else:
                name = pairs[number - 2 * n - len(cones)], "near"
            found[name] = float(values[number])
        return found


def held_by(drive: Record, bound: str) -> str:
    """The bound that holds a drive at an end of where it may go: of its range, or `speed`."""
    end, limit = ("least", "lo") if bound == "min" else ("most", "hi")
    return bound if abs(drive[end] - drive[limit]) <= TOLERANCES.active else "speed"
