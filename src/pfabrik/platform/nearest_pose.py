"""Searches in the pose of the platform: where they start, and the kernel asked of rows on all cores."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats, Records
from ..closure.close import in_lengths
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.closure.loops import BASE_AXES, LOCKED
from ..kernels.handle import Handle, Scratch
from ..kernels.legs import records as K
from ..kernels.platform.records import SETTINGS, Plan, PoseSolutions, Starts
from ..kernels.rows import LIMIT_EXCESS, N_COUNTERS, PENDING
from ..kernels.threads import in_blocks
from ..tolerances import TOLERANCES
from .along import carriages_along, proximal_coordinates, stays_there
from .rotation import implied_rows, keeps_rotation, without_idle_legs
from .table import OF_AIMS, search_table

if TYPE_CHECKING:
    from ..kernels.platform.nearest import NearestScratch

AGREEMENTS, AGREEMENTS_OF_STRUTS, AGREEMENTS_OF_VALUES = 4, 3, 8
"""How many searches must end at the nearest configuration, and one more for each that ends elsewhere: fewer where
struts leave the platform all its freedoms, and have no two ways to bend; more where actuators have values, which a
platform nearly has in many poses."""

HITS_OF_RAILS = 6
"""The same where rods on carriages leave the platform all its freedoms: each may go on to the other side of its
carriage, and ends there at the limit of another leg. With 4, of 1,200 targets 14 have a nearer pose, with 6 three."""

AGREEMENTS_OF_MANY = 8
"""The same where arms are led, or task and legs do not tell all of a pose: there are many more configurations."""

ROWS_A_BLOCK = 16

_NO_WEIGHTS = np.zeros((0, 0))


class NearestPose:
    """Searches of a machine for what is nearest in one way, prepared: what is left to do for a row is little.

    Parameters
    ----------
    weights : what counts of the pose, (6,), as of `PoseObjective`; what does not turn is held as it is.
    settings : of `SETTINGS`, by name, those that do not follow from the machine and its task.
    others : starts that follow each row's own.
    driven : the coordinates that are to be near to values; None where only poses count.
    minds_aims : keep on the way, too, to where crossed hinges can point their rods. Rows that end where they cannot are
        searched for again like this: a way that is barred ends earlier.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        table: LegTable,
        weights: Sequence[float],
        settings: Mapping[str, float],
        others: Starts,
        driven: Records | None = None,
        *,
        minds_aims: bool = False,
    ) -> None:
        self._table, searches = table, settings["steps"] > 0
        counted, rests = np.array(weights, dtype=float), keeps_rotation(mechanism)
        counted[3:] = LOCKED if rests else counted[3:]
        at_home = table.task[0]["rotations"] == 0 and counted[3] == LOCKED and searches
        legs = without_idle_legs(table) if at_home and not len(table.redundant) else search_table(table)
        self._legs = legs if driven is None else Handle(legs.record._replace(driven=driven))
        cones = self._legs.record.cones
        minded = len(cones) if minds_aims or not searches else int((cones["leader"] != OF_AIMS).sum())
        own = np.zeros(1, SETTINGS)
        own["margin"], own["near"], own["cones"] = TOLERANCES.inside, TOLERANCES.active, minded
        own["implied"] = 0 if len(table.redundant) else implied_rows(mechanism)
        own["agreements"] = _agreements(table) if driven is None else AGREEMENTS_OF_VALUES
        for name, value in {"frame": task_of(mechanism).frame, **settings}.items():
            own[name] = value
        own["frame"] = BASE_AXES if rests else own["frame"]
        along = stays_there(table) if driven is not None else carriages_along(table)
        self._plan = Handle(Plan(counted, own, *others, along))
        self._no_values = np.zeros((0, len(self._legs.record.driven)))
        self._minding: NearestPose | None = None
        if minded < len(cones):
            self._minding = NearestPose(mechanism, table, weights, settings, others, driven, minds_aims=True)

    @cached_property
    def _kernel(self) -> Callable[..., int]:
        from ..kernels.platform.nearest import nearest_pose

        return nearest_pose

    @cached_property
    def _scratch(self) -> Scratch[NearestScratch]:
        from ..kernels.platform.nearest import new_nearest_scratch

        return Scratch(new_nearest_scratch, self._legs.record, self._plan.record)

    def find(self, targets: Floats, own: Starts, values: Floats | None = None) -> PoseSolutions:
        """Where searches for targets (n, 4, 4) [length] end; see `fill`."""
        found = new_found(len(targets), self._table)
        self.fill(targets, own, found, values)
        return found

    def fill(self, targets: Floats, own: Starts, found: PoseSolutions, values: Floats | None = None) -> int:
        """Search for targets (n, 4, 4) [length], on all cores; how many rows have no answer.

        Parameters
        ----------
        own : the first start of each row, or one for all.
        values : what driven coordinates are to be near to, (n, driven) [L or rad].
        """
        left = self._run(targets, own, found, self._no_values if values is None else values, _NO_WEIGHTS)
        if self._minding is not None:
            astray = (found.measures[:, LIMIT_EXCESS] > TOLERANCES.limit) & (found.distances < np.inf)
            if np.count_nonzero(astray):
                found.status[astray] = PENDING
                near, some = None if values is None else values[astray], found.at(astray)
                left += self._minding.fill(targets[astray], own.of(astray), some, near)
                found.put(astray, some)
        return left

    def weigh(self, targets: Floats, present: Starts) -> Floats:
        """How hard every limit, and then every leg, holds configurations back from targets (n, 4, 4) [length], where
        these approaches have no steps to take: see the kernel."""
        legs = self._legs.record
        weights = np.zeros((len(targets), 2 * len(legs.limited) + len(legs.cones) + len(legs.legs)))
        self._run(targets, present, new_found(len(targets), self._table), self._no_values, weights)
        return weights

    def _run(self, targets: Floats, own: Starts, found: PoseSolutions, values: Floats, weights: Floats) -> int:
        kernel, machine, plan, scratch = self._kernel, self._legs.address, self._plan.address, self._scratch
        if len(targets) <= ROWS_A_BLOCK:
            return kernel(machine, plan, scratch.address, targets, values, *own, *found, weights)

        def run(block: slice) -> int:
            near = values[block] if len(values) else values
            told = *own.of(block), *found.at(block), weights[block]
            return kernel(machine, plan, scratch.address, targets[block], near, *told)

        return sum(in_blocks(run, len(targets), ROWS_A_BLOCK))


@lru_cache(maxsize=64)
def _agreements(table: LegTable) -> int:
    task = table.task[0]
    if table.leaves_open:
        return AGREEMENTS_OF_MANY
    if task["rows"] > 0 or len(table.redundant):
        return AGREEMENTS
    q_proximal = table.legs["proximal"][proximal_coordinates(table)["leg"]]
    return (
        AGREEMENTS_OF_STRUTS
        if not len(q_proximal)
        else HITS_OF_RAILS
        if (q_proximal == K.CARRIAGE).any()
        else AGREEMENTS
    )


def new_found(n: int, table: LegTable) -> PoseSolutions:
    legs, actuators = len(table.legs), len(table.driven)
    return PoseSolutions(
        np.full(n, np.inf),
        np.zeros((n, 4, 4)),
        np.zeros((n, legs)),
        np.zeros((n, legs)),
        np.zeros((n, N_COUNTERS), np.int64),
        np.zeros((n, actuators)),
        np.zeros((n, 5)),
        np.full(n, PENDING),
    )


def no_starts(table: LegTable) -> Starts:
    return Starts(np.zeros((0, 4, 4)), np.zeros((0, len(table.legs))), np.zeros((0, len(table.legs))))


def starts_at(mechanism: Mechanism, table: LegTable, poses: Floats, sides: Floats) -> Starts:
    """Poses (n, 4, 4) [length] with legs on given sides, (n, legs), as starts."""
    return Starts(in_lengths(poses, 1.0 / mechanism.characteristic_length), np.zeros((0, len(table.legs))), sides)


def home_start(mechanism: Mechanism, table: LegTable) -> Starts:
    """Home, as a start."""
    poses = in_lengths(mechanism.home_pose[None], 1.0 / mechanism.characteristic_length)
    return Starts(poses, np.zeros((1, len(table.legs))), table.home_sides)
