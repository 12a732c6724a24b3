"""One target at a time: what the kernel of the legs takes, prepared once for each machine."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..kernels.handle import Handle
from ..kernels.reaching import plan as P
from .nearest import home_start, no_starts
from .table import machine, machine_nearby


class OneTarget:
    """A machine of legs, asked for one target after the other.

    What takes microseconds beside the legs' own is done once: a question is one call, and its answer a few arrays.
    """

    def __init__(self, mechanism: Mechanism, table: LegTable) -> None:
        self._n_actuators = len(mechanism.actuator_names)
        self._is_for_blocks, self._leads_arms = table.is_for_blocks, table.leads_arms
        self._anywhere, self._nearby = machine(table), machine_nearby(table)
        self.home, self.home_sides = mechanism.home_pose[None].copy(), table.home_sides

    @cached_property
    def _kernel(self) -> Callable[..., int]:
        if self._is_for_blocks:
            from ..kernels.legs.blocks import answer_blocks

            return answer_blocks
        from ..kernels.legs.answer import answer

        return answer

    def new_rows(self) -> P.Rows:
        """Room for one answer."""
        return P.Rows(
            np.empty(1, np.int64),
            np.zeros((1, 3), np.int64),
            np.empty((1, 4, 4)),
            np.empty((1, 0, 3)),
            np.empty((1, 0)),
            np.empty((1, self._n_actuators)),
            np.zeros((1, 5)),
        )

    def reach(self, target: Floats, begin: Floats, sides: Floats, rows: P.Rows, *, nearby: bool) -> int:
        """Answer a target (1, 4, 4) if legs on these sides (1, legs) reach it at once; 0 where they do.

        Parameters
        ----------
        sides : where arms follow, they end here.
        begin : the pose from which it is completed, (1, 4, 4); only `nearby`, if so asked.
        """
        return self._kernel((self._nearby if nearby else self._anywhere).address, target, begin, sides, *_filled(rows))

    def prepared(
        self, target: Floats, begin: Floats, sides: Floats, rows: P.Rows, *, nearby: bool
    ) -> Callable[[], int]:
        """`reach` with all that it takes, as long as this object is kept; arms begin anew each time."""
        asked, own = self._nearby if nearby else self._anywhere, sides.copy()
        call = partial(self._kernel, asked.address, target, begin, own, *_filled(rows))
        if not self._leads_arms:
            return call

        def call_anew() -> int:
            own[:] = sides
            return call()

        return call_anew


class Ends(NamedTuple):
    """Where one row's carriers are, and which solutions its legs take, as of `Starts`."""

    q: Floats  # (1, legs)
    sides: Floats  # (1, legs)


class OneAssembly:
    """Forward kinematics of a machine of legs from home, one row after the other, prepared likewise."""

    def __init__(self, mechanism: Mechanism, table: LegTable) -> None:
        n_actuators, self._n_legs = len(mechanism.actuator_names), len(table.legs)
        turns = not mechanism.end_effector_is_joint
        self._home, self._units = np.zeros(n_actuators), np.ones(n_actuators)
        self._home[table.driven["column"]], self._units[table.driven["column"]] = (
            table.driven["home"],
            table.driven["unit"],
        )
        self._starts = Handle(home_start(mechanism, table)), Handle(no_starts(table))
        self._asked = turns, *(starts.address for starts in self._starts)
        self._legs, self._arms = machine(table), table.led_arms["leg"]

    @cached_property
    def _kernel(self) -> Callable[..., None]:
        from ..kernels.platform.forward import assemble

        return assemble

    def new_ends(self) -> Ends:
        """Room for where carriers and legs are in the end."""
        return Ends(np.empty((1, self._n_legs)), np.empty((1, self._n_legs)))

    def assemble(self, values: Floats, rows: P.Rows, ends: Ends) -> bool:
        """Answer actuated values (1, n_a) if they assemble from home within all limits; whether they do."""
        wanted = (values - self._home) / self._units
        self._kernel(self._legs.address, wanted, *self._asked, rows.status, rows.poses, *ends, rows.measures)
        if rows.status[0] != P.REACHED:
            return False
        if len(self._arms):
            ends.sides[:, self._arms] = ends.q[:, self._arms]
        rows.actuators[:] = values
        return True


def _filled(rows: P.Rows) -> tuple[NDArray[Any], ...]:
    """What the kernel fills of an answer."""
    return rows.status, rows.poses, rows.actuators, rows.measures
