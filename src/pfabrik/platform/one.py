"""One target at a time: what the kernel of the legs takes, prepared once for each machine."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..decomposition.leg_table import LegTable
from ..decomposition.resting import Resting
from ..description.mechanism import Mechanism
from ..kernels.handle import Handle, Scratch
from ..kernels.platform.records import Starts
from ..kernels.rows import N_COUNTERS, Rows
from .nearest_pose import home_start, no_starts
from .table import local_table, machine, resting_at_home, search_table

if TYPE_CHECKING:
    from ..kernels.platform.forward import NewtonScratch


class OneTarget:
    """A machine of legs, asked for one target after the other.

    What takes microseconds beside the legs' own is done once: a question is one call, and its answer a few arrays.
    """

    def __init__(self, mechanism: Mechanism, table: LegTable) -> None:
        self._n_actuators = len(mechanism.actuator_names)
        self._is_for_blocks, self._leads_arms = table.is_for_blocks, table.has_implicit_joints
        self._anywhere, self._nearby = machine(table), local_table(table)
        self.home, self.home_sides = mechanism.home_pose[None].copy(), table.home_sides
        self._resting = resting_at_home(table)
        self._at_rest = machine(table if self._resting is None else self._resting.table)

    @cached_property
    def _kernel(self) -> Callable[..., int]:
        if self._is_for_blocks:
            return self._blocks
        from ..kernels.legs.answer import answer

        return answer

    @cached_property
    def _blocks(self) -> Callable[..., int]:
        from ..kernels.legs.blocks import answer_blocks

        return answer_blocks

    def new_rows(self) -> Rows:
        """Room for one answer."""
        return Rows(
            np.empty(1, np.int64),
            np.zeros((1, N_COUNTERS), np.int64),
            np.empty((1, 4, 4)),
            np.empty((1, self._n_actuators)),
            np.zeros((1, 5)),
        )

    def reach(self, target: Floats, begin: Floats, sides: Floats, rows: Rows, *, nearby: bool) -> int:
        """Answer a target (1, 4, 4) if legs on these sides (1, legs) reach it at once; 0 where they do.

        Parameters
        ----------
        sides : where arms follow, they end here.
        begin : the pose from which it is completed, (1, 4, 4), `home` if from there; only `nearby`, if so asked.
        """
        if begin is self.home and self._resting is not None:
            return self._reach_at_rest(self._resting, target, rows)
        return self._kernel((self._nearby if nearby else self._anywhere).address, target, begin, sides, *_filled(rows))

    def prepared(self, target: Floats, begin: Floats, sides: Floats, rows: Rows, *, nearby: bool) -> Callable[[], int]:
        """`reach` with all that it takes, as long as this object is kept; arms begin anew each time."""
        if begin is self.home and self._resting is not None:
            return partial(self._reach_at_rest, self._resting, target, rows)
        asked, own = self._nearby if nearby else self._anywhere, sides.copy()
        call = partial(self._kernel, asked.address, target, begin, own, *_filled(rows))
        if not self._leads_arms:
            return call

        def call_anew() -> int:
            own[:] = sides
            return call()

        return call_anew

    def _reach_at_rest(self, resting: Resting, target: Floats, rows: Rows) -> int:
        """`reach` from home with arms that stay there."""
        rows.actuators[:] = resting.actuators
        return self._blocks(self._at_rest.address, target, self.home, resting.table.home_sides, *_filled(rows))


class Ends(NamedTuple):
    """Where carriers are and which solutions legs take, as of `Starts`, at actuators that are `wanted`."""

    wanted: Floats  # (n, n_a): deviations from home [L or rad]
    q: Floats  # (n, legs)
    sides: Floats  # (n, legs)


class OneAssembly:
    """Forward kinematics of a machine of legs, one row after the other, prepared likewise."""

    def __init__(self, mechanism: Mechanism, table: LegTable) -> None:
        self._n_actuators, self._n_legs = len(mechanism.actuator_names), len(table.legs)
        self.home, self._nowhere = Handle(home_start(mechanism, table)), Handle(no_starts(table))
        self._legs, self._scratched = search_table(table), (mechanism, table)

    @cached_property
    def _kernel(self) -> Callable[..., int]:
        from ..kernels.platform.forward import assemble

        return assemble

    @cached_property
    def _scratch(self) -> Scratch[NewtonScratch]:
        return scratch_of(*self._scratched)

    def new_ends(self) -> Ends:
        """Room for where carriers and legs of one row are in the end."""
        return Ends(np.empty((1, self._n_actuators)), np.empty((1, self._n_legs)), np.empty((1, self._n_legs)))

    def prepared(
        self, own: Handle[Starts], scratch: Handle[NewtonScratch] | Scratch[NewtonScratch], rows: Rows, ends: Ends
    ) -> Callable[[], int]:
        """A call that assembles what stands in `rows.actuators` from one start within all limits, as long as the start,
        the scratch memory and this object are kept; it returns 0 where it does."""
        asked = self._legs.address, scratch.address, rows.actuators, own.address, self._nowhere.address
        return partial(self._kernel, *asked, rows.status, ends.wanted, rows.poses, ends.q, ends.sides, rows.measures)

    def assemble(self, own: Handle[Starts], rows: Rows, ends: Ends) -> bool:
        """The same, at once; whether it does."""
        return self.prepared(own, self._scratch, rows, ends)() == 0


def new_scratch(mechanism: Mechanism, table: LegTable) -> NewtonScratch:
    """Scratch memory of assembly."""
    from ..kernels.platform.forward import new_newton_scratch

    return new_newton_scratch(search_table(table).record, not mechanism.end_effector_is_joint)


@lru_cache(maxsize=64)
def scratch_of(mechanism: Mechanism, table: LegTable) -> Scratch[NewtonScratch]:
    """The same for each thread."""
    return Scratch(new_scratch, mechanism, table)


def _filled(rows: Rows) -> tuple[NDArray[Any], ...]:
    """What the kernel fills of an answer."""
    return rows.status, rows.poses, rows.actuators, rows.measures
