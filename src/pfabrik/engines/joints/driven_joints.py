"""A machine driven along a stream, tick by tick, in joint coordinates."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Record
from ...kernels.handle import Handle
from ...kernels.joints import live_joints as K
from ...kernels.joints.linearise_loops import new_descent_scratch
from ...kernels.joints.loops import Closed, Objective, PoseObjective
from ...kernels.joints.path_kinematics import load_row, new_state, store_row
from ...kernels.legs.records import TASK
from ...kernels.ticks import DRIVE, TICK
from ...machine.description.home_mobility import column_joints
from ...machine.model import Model
from ...options import Options
from ...tolerances import TOLERANCES
from .configurations import Configurations
from .engine_contract import Driven
from .link_distances import pair_names
from .placed_links import links_on_paths
from .projection import modes_of


class DrivenJoints(Driven):
    """As `Driven`, in joint coordinates."""

    def __init__(self, model: Model, options: Options, speeds: Floats, accelerations: Floats) -> None:
        super().__init__(model)
        closure, mechanism, length = model.closure, model.mechanism, model.length
        mode, n = modes_of(closure, options)[-1], len(closure.actuated)
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
        self._memory = self._live.tick, self._live.step, self._scratch.record.hessian.multipliers
        self._state = *self._live.state, self._live.targets

    def _tick(self, dt: float) -> int:
        return K.tick_joints(self._handle.address, self._scratch.address, dt)

    def speeds(self) -> Floats:
        """As of `Driven`."""
        return np.asarray(self.drives["rate"] * self._live.units)

    def _put(self, configurations: Configurations) -> None:
        live, coordinates = self._live, configurations.coordinates * self._model.closure.scale
        load_row(live.loops, 0, self._closed(coordinates), live.state)
        K.place_joints(self._handle.address, self._scratch.address)

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
        values, mechanism = self._weighed(), self._model.mechanism
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

    def _weighed(self) -> Floats:
        """The multipliers of all limits where the machine is, with the ranges of the last tick."""
        from ...kernels.joints.descend import nearest_configuration

        live, aim = self._live, self._live.aim[0]
        targets, loops = live.targets.copy(), Handle(live.loops)
        targets[:, :3, 3] /= self._model.length
        priced, near = (aim["hold"], aim["price"], aim["rounding"]), (aim["margin"], aim["near"])
        pose = PoseObjective(targets, live.weights, int(aim["frame"]), *priced, *near, 0)
        closed = self._closed(self.coordinates() * self._model.closure.scale)
        groups = len(live.loops.groups) - 1
        closed = closed._replace(
            gaps=np.zeros((1, groups)), excesses=np.zeros((1, groups)), misses=np.zeros((1, groups))
        )
        weights = np.zeros((1, len(self._scratch.record.hessian.multipliers)))
        self._scratch.record.margins[:] = 0.0
        objective = Objective(pose, live.free, np.zeros((1, 0)))
        nearest_configuration(loops.address, self._scratch.address, objective, closed, weights)
        return np.asarray(weights[0])


def held_by(drive: Record, bound: str) -> str:
    """The bound that holds a drive at an end of where it may go: of its range, or `speed`."""
    end, limit = ("least", "lo") if bound == "min" else ("most", "hi")
    return bound if abs(drive[end] - drive[limit]) <= TOLERANCES.active else "speed"
