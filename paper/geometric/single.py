"""Single calls as compiled code makes them: one target after another, without Python in between."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from pfabrik import Mechanism

from ..arrays import Floats
from .compiled import kernel
from .ik import Geometric
from .targets import Statuses
from .topologies import closed_form


def one_by_one(mechanism: Mechanism, targets: Floats, starts: Geometric | None = None) -> Callable[[], object]:
    """What answers targets (n, 4, 4), each by a whole call of the kernel from a start of its own; default: home."""
    form = closed_form(mechanism)
    loop = _loop(form.kernel)
    actuators, status = np.empty((len(targets), len(mechanism.actuator_names))), np.empty(len(targets), np.int8)
    seeds = np.asarray(form.home if starts is None else starts.actuators)
    return lambda: loop(form.plan, targets, seeds, starts is None, actuators, status)


@lru_cache(maxsize=8)
def _loop(closed_form: Any) -> Any:
    """The compiled loop over a kernel; returns how many targets are no poses."""

    @kernel
    def loop(plan: Any, targets: Floats, seeds: Floats, at_home: bool, actuators: Floats, status: Statuses) -> int:
        invalid = 0
        for i in range(targets.shape[0]):
            k = i if seeds.shape[0] > 1 else 0
            own, status_of_it = actuators[i : i + 1], status[i : i + 1]
            invalid += closed_form(plan, targets[i : i + 1], seeds[k : k + 1], at_home, own, status_of_it)
        return invalid

    return loop
