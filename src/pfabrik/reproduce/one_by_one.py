"""Single calls as compiled code makes them: a kernel called for one target after another, without Python in between.

Every call is a whole one: it makes its own scratch memory, and takes one target, one seed and room for one answer.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..kernels._jit import kernel
from ..kernels.legs.answer import answer
from ..kernels.reaching.plan import Plan, Reached, Seeds, Settings
from ..kernels.reaching.solve import solve_by_passes
from ..kernels.rows import Rows

_njit: Any = numba.njit(nogil=True, error_model="numpy")


@kernel
def p_fabrik_one_by_one(plan: Plan, targets: Floats, seeds: Seeds, settings: Settings, reached: Reached) -> None:
    """Let chains reach for every target by a call of its own."""
    for i in range(targets.shape[0]):
        k = i if seeds.poses.shape[0] > 1 else 0
        own = Reached(
            reached.poses[i : i + 1],
            reached.nodes[i : i + 1],
            reached.trunks[i : i + 1],
            reached.gaps[i : i + 1],
            reached.iterations[i : i + 1],
            reached.rounds[i : i + 1],
        )
        own_seeds = Seeds(seeds.poses[k : k + 1], seeds.nodes[k : k + 1], seeds.trunks[k : k + 1])
        solve_by_passes(plan, targets[i : i + 1], own_seeds, settings, own)


@kernel
def legs_one_by_one(machine: int, targets: Floats, begins: Floats, sides: Floats, rows: Rows) -> int:
    """The same by legs in closed form, all on the sides they take at home; returns how many these did not reach."""
    left = 0
    for i in range(targets.shape[0]):
        k = i if begins.shape[0] > 1 else 0
        left += answer(
            machine,
            targets[i : i + 1],
            begins[k : k + 1],
            sides,
            rows.status[i : i + 1],
            rows.poses[i : i + 1],
            rows.actuators[i : i + 1],
            rows.measures[i : i + 1],
        )
    return left


@lru_cache(maxsize=8)
def closed_form_one_by_one(closed_form: Any) -> Any:
    """The compiled loop over the kernel of a closed form; returns how many targets are no poses."""

    def loop(
        plan: Any, targets: Floats, seeds: Floats, at_home: bool, actuators: Floats, status: NDArray[np.int8]
    ) -> int:
        invalid = 0
        for i in range(targets.shape[0]):
            k = i if seeds.shape[0] > 1 else 0
            own, status_of_it = actuators[i : i + 1], status[i : i + 1]
            invalid += closed_form(plan, targets[i : i + 1], seeds[k : k + 1], at_home, own, status_of_it)
        return invalid

    return _njit(loop)
