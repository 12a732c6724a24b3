"""Number of Newton steps that a file of tensors needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Floats
from .tensor_machine import TensorMachine
from .tensor_text import Steps, tensor_text

N_TRIED = 400
"""Configurations by which steps are counted."""

MOST_STEPS = 12
SAME = 1e-6
"""Difference of coordinates up to which forward kinematics came back to them [rad or length]."""

ENOUGH = 0.995
"""Share of them that must have come as far as rounding lets them, by forward kinematics."""

CLOSING = ("dead point", "legs do not close")
"""What names of limits begin with that no range is."""

FEWEST_COMPLETING = 2
"""Steps by which a pose is completed at other dimensions too, where legs do not close at once as they do at home's."""


def steps_of(machine: TensorMachine) -> Steps:
    """The Newton steps after which forward kinematics from home, and completed poses, are done.

    One more follows in the file, which carries the derivatives. Poses are completed beyond ranges too, with one to
    spare.
    """
    room: dict[str, Any] = {}
    exec(compile(tensor_text(machine, "numpy", Steps(MOST_STEPS, MOST_STEPS)), "tensors", "exec"), room)
    samples = machine.samples(N_TRIED)
    margins = room["margins"](samples)
    inside = samples[(margins > 0.0).all(axis=1)]
    inside = inside if len(inside) else samples[:1]
    closes = samples[(margins[:, [name.startswith(CLOSING) for name in room["LIMITS"]]] > 0.0).all(axis=1)]
    closes = closes if len(closes) else samples[:1]
    forward = room["to_pose" if machine.path is None else "to_joints"]
    if machine.path is not None:  # others are another assembly for their actuators
        own = np.abs(forward(room["to_actuators"](inside), steps=MOST_STEPS) - inside).max(axis=1) <= SAME
        inside = inside[own] if own.any() else inside[:1]
    values = room["to_actuators"](inside)

    def complete(steps: int) -> Floats:
        room["COMPLETING_STEPS"] = steps
        return np.asarray(room["pose"](closes))

    size = max(machine.mechanism.characteristic_length, 1.0)
    completing = max(FEWEST_COMPLETING, _fewest(complete, size, 1.0) + 1) if machine.completes else 0
    return Steps(_fewest(lambda steps: forward(values, steps=steps), size, ENOUGH), completing)


def _fewest(answer: Callable[[int], Floats], size: float, enough: float) -> int:
    """The fewest steps after which a share of the answers (n, ...) are those after many [L or rad]."""
    last = answer(MOST_STEPS)
    for steps in range(MOST_STEPS):
        off = np.abs(answer(steps) - last).reshape(len(last), -1).max(axis=1)
        if np.mean(off <= 1e-13 * size) >= enough:
            return steps
    return MOST_STEPS
