"""Searches for the nearest pose of the platform: their settings and starts, and the kernel run on all cores."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ...common.arrays import Floats, Records
from ...common.batch import take, take_each
from ...common.derived import derived
from ...kernels.handle import Handle, Scratch
from ...kernels.joints.loops import BASE_AXES, LOCKED
from ...kernels.legs import records as K
from ...kernels.pose.pose_constants import (
    AGREEMENTS,
    AGREEMENTS_OF_MANY,
    AGREEMENTS_OF_RAILS,
    AGREEMENTS_OF_STRUTS,
    AGREEMENTS_OF_VALUES,
)
from ...kernels.pose.search_records import SETTINGS, MultistartPlan, PoseSolutions, Starts, new_solutions
from ...kernels.threads import in_blocks
from ...machine.decomposition.leg_table import LegTable
from ...machine.model import Model
from ...tolerances import TOLERANCES
from ..joints.close import in_lengths
from .carriages import carriages_along, proximal_coordinates, stays_there
from .links_of_legs import links_of_legs
from .rotation import keeps_rotation, n_implied_rows, without_idle_legs
from .table import OF_POINTING, search_table

if TYPE_CHECKING:
    from ...kernels.pose.nearest import NearestScratch

ROWS_A_BLOCK = 16

Objective: TypeAlias = tuple[Sequence[float], Mapping[str, float]]
"""Weights (6,) of the pose, as of `PoseObjective`, and fields of `SETTINGS` that machine and task do not give."""

_NO_WEIGHTS = np.zeros((0, 0))


class NearestPose:
    """Searches for the nearest feasible configurations of a machine, by one objective, prepared once for all rows.

    Parameters
    ----------
    weights, settings : as of `Objective`.
    seeds : starts tried after each row's own.
    driven : the coordinates that have target values; None where only poses count.
    """

    def __init__(
        self,
        model: Model,
        table: LegTable,
        weights: Sequence[float],
        settings: Mapping[str, float],
        seeds: Starts,
        driven: Records | None = None,
    ) -> None:
        self._table = table
        legs, plan = search_plan(model, table, [(weights, settings)], seeds, driven)
        self._legs, self._plan = Handle(legs), Handle(plan)
        self._no_values = np.zeros((0, len(legs.driven)))

    @cached_property
    def _kernel(self) -> Callable[..., int]:
        from ...kernels.pose.nearest import nearest_pose

        return nearest_pose

    @cached_property
    def _scratch(self) -> Scratch[NearestScratch]:
        from ...kernels.pose.nearest import new_nearest_scratch

        plan = self._plan.record
        return Scratch(new_nearest_scratch, self._legs.record, plan, plan.settings[0]["steps"] == 0)

    def find(self, targets: Floats, starts: Starts, values: Floats | None = None) -> PoseSolutions:
        """The nearest configurations to targets (n, 4, 4) [length]; parameters as of `fill`."""
        solution = new_solution(len(targets), self._table)
        self.fill(targets, starts, solution, values)
        return solution

    def fill(self, targets: Floats, starts: Starts, solution: PoseSolutions, values: Floats | None = None) -> int:
        """Fill the nearest configurations to targets (n, 4, 4) [length], on all cores; return the number unsolved.

        Parameters
        ----------
        starts : the first start of each row, or one for all.
        values : target values of the driven coordinates, (n, driven) [L or rad].
        """
        return self._run(targets, starts, solution, self._no_values if values is None else values, _NO_WEIGHTS)

    def weigh(self, targets: Floats, configurations: Starts) -> Floats:
        """The multipliers of all limits, of legs and pairs of links, at configurations, for targets (n, 4, 4) [length].

        For instances whose setting `steps` is 0: nothing is searched for.
        """
        legs, pairs = self._legs.record, self._plan.record.links.pairs
        weights = np.zeros((len(targets), 2 * len(legs.limited) + len(legs.cones) + len(legs.legs) + len(pairs)))
        self._run(targets, configurations, new_solution(len(targets), self._table), self._no_values, weights)
        return weights

    def _run(self, targets: Floats, starts: Starts, solution: PoseSolutions, values: Floats, weights: Floats) -> int:
        kernel, legs, plan, scratch = self._kernel, self._legs.address, self._plan.address, self._scratch
        if len(targets) <= ROWS_A_BLOCK:
            return kernel(legs, plan, scratch.address, targets, values, starts, solution, weights)

        def run(block: slice) -> int:
            block_values = values[block] if len(values) else values
            outputs = take_each(starts, block), take(solution, block), weights[block]
            return kernel(legs, plan, scratch.address, targets[block], block_values, *outputs)

        return sum(in_blocks(run, len(targets), ROWS_A_BLOCK))


def search_plan(
    model: Model,
    table: LegTable,
    objectives: Sequence[Objective],
    seeds: Starts,
    driven: Records | None = None,
) -> tuple[K.Table, MultistartPlan]:
    """The kernel table and the plan of searches by some objectives; the rotation of what cannot turn is locked."""
    is_fixed = keeps_rotation(model)
    weights, settings = np.array([each for each, _ in objectives]), np.zeros(len(objectives), SETTINGS)
    weights[:, 3:] = LOCKED if is_fixed else weights[:, 3:]
    is_at_home = table.task[0]["rotations"] == 0 and weights[0, 3] == LOCKED and objectives[0][1]["steps"] > 0
    has_idle_legs = is_at_home and not len(table.redundant) and model.mechanism.clearance is None
    legs = (without_idle_legs(table) if has_idle_legs else search_table(table)).record
    settings["margin"], settings["near"], settings["limit"] = TOLERANCES.inside, TOLERANCES.active, TOLERANCES.limit
    settings["implied"] = 0 if len(table.redundant) else n_implied_rows(model)
    settings["agreements"] = _agreements(table) if driven is None else AGREEMENTS_OF_VALUES
    for setting, (_, named) in zip(settings, objectives, strict=True):
        for name, value in {"frame": model.task.frame, **named}.items():
            setting[name] = value
        setting["frame"] = BASE_AXES if is_fixed else setting["frame"]
        setting["price"] = 0.0 if is_fixed else setting["price"]
        setting["cones"] = (legs.cones["leader"] != OF_POINTING).sum() if setting["steps"] else len(legs.cones)
    along = stays_there(table) if driven is not None else carriages_along(table)
    plan = MultistartPlan(weights, settings, seeds, along, links_of_legs(model))
    return (legs if driven is None else legs._replace(driven=driven)), plan


@derived
def _agreements(table: LegTable) -> int:
    task = table.task[0]
    if table.leaves_open:
        return AGREEMENTS_OF_MANY
    if task["rows"] > 0 or len(table.redundant):
        return AGREEMENTS
    proximal_kinds = table.legs["proximal"][proximal_coordinates(table)["leg"]]
    return (
        AGREEMENTS_OF_STRUTS
        if not len(proximal_kinds)
        else AGREEMENTS_OF_RAILS
        if (proximal_kinds == K.CARRIAGE).any()
        else AGREEMENTS
    )


def new_solution(n: int, table: LegTable) -> PoseSolutions:
    """Allocate n solutions, all PENDING."""
    return new_solutions(n, len(table.legs), len(table.driven))


def no_starts(table: LegTable) -> Starts:
    """No starts, in the shape that a machine's have."""
    return Starts(np.zeros((0, 4, 4)), np.zeros((0, len(table.legs))), np.zeros((0, len(table.legs))))


def starts_at(model: Model, poses: Floats, sides: Floats) -> Starts:
    """Starts at poses (n, 4, 4) [length] with legs on given sides, (n, legs)."""
    return Starts(in_lengths(poses, 1.0 / model.length), np.zeros((0, len(model.legs.legs))), sides)


def home_start(model: Model) -> Starts:
    """A single start: home."""
    return starts_at(model, model.mechanism.home_pose[None], model.legs.home_sides)._replace(
        q=np.zeros((1, len(model.legs.legs)))
    )
