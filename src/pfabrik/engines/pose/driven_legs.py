"""A machine of legs driven along a stream, tick by tick."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats
from ...kernels.handle import Handle
from ...kernels.pose import live_pose as K
from ...kernels.pose.equations import count_unknowns, new_platform_state
from ...kernels.pose.search_records import Starts, new_solutions
from ...kernels.rows import PROJECTED
from ...kernels.search_constants import MOST_STEPS
from ...kernels.ticks import DRIVE, TICK
from ...machine.model import Model
from ...options import Options
from ...tolerances import TOLERANCES
from ..joints.configurations import Configurations, new_rows
from ..joints.driven_joints import held_by
from ..joints.engine_contract import Driven
from ..joints.link_distances import pair_names
from ..joints.projection import modes_of
from .answers import leg_answers, sides_at
from .nearest import OF_VALUES, objective_of
from .nearest_pose import no_starts, search_plan
from .table import local_table


class DrivenLegs(Driven):
    """As `Driven`, in the platform's pose."""

    def __init__(self, model: Model, options: Options, speeds: Floats, accelerations: Floats) -> None:
        super().__init__(model)
        self._live = live_tables(model, options, speeds, accelerations)
        self._told: Floats | None = None  # coordinates that were asked for last: whole turns are counted from there
        self._handle, self._scratch = Handle(self._live), Handle(K.new_live_scratch(self._live))
        self._address = self._handle.address, self._scratch.address
        self.target, self.pose, self.actuators = self._live.targets[0], self._live.pose, self._live.actuators
        self.tick, self.drives = self._live.tick[0], self._live.drives
        self._state = *self._live.state, self._live.begin, self._live.targets
        self._memory = self._live.tick, self._live.step, self._scratch.record.search.hessian.multipliers

    def _tick(self, dt: float) -> int:
        return K.tick_pose(*self._address, dt)

    def speeds(self) -> Floats:
        """As of `Driven`."""
        driven, speeds = self._live.search.driven, np.zeros(len(self.drives))
        speeds[driven["column"]] = self.drives["rate"] * driven["unit"]
        return speeds

    def _put(self, configurations: Configurations) -> None:
        live = self._live
        live.state.pose[:] = configurations.rows.poses[0]
        live.state.pose[:3, 3] /= self._model.length
        live.state.sides[:] = sides_at(self._model, configurations)[0]
        live.state.q[:], self._told = 0.0, configurations.coordinates.copy()
        K.place_pose(*self._address)

    def coordinates(self) -> Floats:
        """As of `Driven`."""
        rows, live = new_rows(self._model, 1), self._live
        rows.status[:], rows.poses[0], rows.actuators[0] = PROJECTED, live.pose, live.actuators
        sides, q = live.state.sides[None].copy(), live.state.q[None].copy()
        before = None if self._told is None else Configurations(rows, self._told)
        self._told = leg_answers(self._model, rows, sides, q, before, sides).coordinates
        return self._told.copy()

    def multipliers(self) -> dict[tuple[str, str], float]:
        """As of `Driven`."""
        values, own, drives = self._weighed(), self._live.search, self.drives
        names, dead_points = self._model.legs.limits, self._model.legs.dead_points
        ranges, cones, found = len(own.limited) - len(drives), len(own.cones), dict[tuple[str, str], float]()
        ends = 2 * len(own.limited), 2 * len(own.limited) + cones, 2 * len(own.limited) + cones + len(own.legs)
        for number in np.flatnonzero(values > 0.0).tolist():
            if number < 2 * ranges:
                name = names[number]
            elif number < ends[0]:
                drive = number // 2 - ranges
                place = int(own.driven["column"][drive])
                bound = held_by(drives[drive], ("min", "max")[number % 2])
                name = self._model.mechanism.actuator_names[place], bound
            elif number < ends[1]:
                cone = 2 * ranges + number - ends[0]
                name = names[cone] if cone < len(names) else dead_points[int(own.cones["leg"][number - ends[0]])]
            elif number < ends[2]:
                name = dead_points[number - ends[1]]
            else:
                name = pair_names(self._model.mechanism)[number - ends[2]], "near"
            found[name] = max(found.get(name, 0.0), float(values[number]))
        return found

    def _weighed(self) -> Floats:
        """The multipliers of all limits where the machine is, with the ranges of the last tick."""
        from ...kernels.pose.nearest import nearest_pose, new_nearest_scratch

        live, none = self._live, np.zeros((0, len(self.drives)))
        settings = live.plan.settings.copy()
        settings["steps"] = 0
        legs, plan = Handle(live.search), Handle(live.plan._replace(settings=settings))
        scratch, n = Handle(new_nearest_scratch(live.search, plan.record, True)), len(live.search.legs)
        start = Starts(live.state.pose[None].copy(), live.state.q[None].copy(), live.state.sides[None].copy())
        weights = np.zeros((1, len(scratch.record.search.hessian.multipliers)))
        found = new_solutions(1, n, len(self.drives))
        nearest_pose(legs.address, plan.address, scratch.address, live.targets, none, start, found, weights)
        return np.asarray(weights[0])


def live_tables(model: Model, options: Options, speeds: Floats, accelerations: Floats) -> K.LivePose:
    """A machine of legs as kernels drive it, with the most speed and acceleration of each drive [per s and s^2]."""
    table = model.legs
    settings = {"steps": MOST_STEPS, "rotation": options.rotation_tolerance}
    settings["position"] = options.tolerance or TOLERANCES.position * model.length
    aim = objective_of(model, modes_of(model.path_closure, options)[-1], settings)
    legs, plan = search_plan(model, table, [aim, OF_VALUES], no_starts(table))
    own, n = legs._replace(limited=np.concatenate([legs.limited, legs.driven])), len(legs.driven)
    columns, units, drives = own.driven["column"], own.driven["unit"], np.zeros(n, DRIVE)
    drives["lo"], drives["hi"] = own.driven["lo"] + TOLERANCES.inside, own.driven["hi"] - TOLERANCES.inside
    drives["speed"], drives["acceleration"] = speeds[columns] / units, accelerations[columns] / units
    return K.LivePose(
        local_table(table).record,
        own,
        plan,
        drives,
        np.zeros(1, TICK),
        new_platform_state(len(table.legs)),
        np.zeros(count_unknowns(own)),
        np.eye(4),
        np.zeros((1, n)),
        np.eye(4)[None].copy(),
        np.zeros(n),
        np.eye(4),
    )
