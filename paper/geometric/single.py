"""Single calls as compiled code makes them: one target after another, without Python in between."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from types import FunctionType
from typing import Any

import numpy as np

from pfabrik import Mechanism

from ..arrays import Floats
from .compiled import for_each
from .ik import Geometric
from .targets import Statuses
from .topologies import Kernel, closed_form


def one_by_one(mechanism: Mechanism, targets: Floats, starts: Geometric | None = None) -> Callable[[], object]:
    """What answers targets (n, 4, 4), each by a whole call of the kernel from a start of its own; default: home."""
    form = closed_form(mechanism)
    call = _call(form.kernel)
    actuators, status = np.empty((len(targets), len(mechanism.actuator_names))), np.empty(len(targets), np.int64)
    seeds = np.asarray(form.home if starts is None else starts.actuators)
    return lambda: call(form.plan, targets, seeds, starts is None, actuators, status, len(targets))


@lru_cache(maxsize=8)
def _call(solve: Any) -> Any:
    """What calls a closed form for one of its targets."""
    return for_each(FunctionType(call_for_one.__code__, globals() | {"solve": solve}, call_for_one.__name__))


solve: Kernel
"""Bound where `call_for_one` is compiled for a closed form."""


def call_for_one(
    plan: Any, targets: Floats, seeds: Floats, at_home: bool, actuators: Floats, status: Statuses, i: int
) -> int:
    """A call of `solve`, a global of the function that is compiled, for target `i`; 1 if that is no pose."""
    k = i if seeds.shape[0] > 1 else 0
    own, status_of_it = actuators[i : i + 1], status[i : i + 1]
    return solve(plan, targets[i : i + 1], seeds[k : k + 1], at_home, own, status_of_it)  # noqa: F821
