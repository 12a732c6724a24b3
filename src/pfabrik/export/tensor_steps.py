"""How many Newton steps a file of tensors needs."""

from __future__ import annotations

from typing import Any

import numpy as np

from .tensor_machine import TensorMachine
from .tensor_text import tensor_text

N_TRIED = 100
"""Configurations by which steps are counted."""

MOST_STEPS = 16
ENOUGH = 0.95
"""Share of them that must have come as far as rounding lets them."""


def steps_of(machine: TensorMachine) -> int:
    """The number of Newton steps after which forward kinematics from home are done, one more for good measure."""
    room: dict[str, Any] = {}
    exec(compile(tensor_text(machine, "numpy", MOST_STEPS), "tensors", "exec"), room)
    forward = room["to_pose" if machine.path is None else "to_joints"]
    samples = machine.samples(N_TRIED)
    inside = samples[room["margin"](samples)[0] > 0.0]
    values = room["to_actuators"](inside if len(inside) else samples[:1])
    last = forward(values, steps=MOST_STEPS)
    size = machine.mechanism.characteristic_length
    for steps in range(2, MOST_STEPS):
        off = np.abs(forward(values, steps=steps) - last).reshape(len(values), -1).max(axis=1)
        if np.mean(off <= 1e-13 * max(size, 1.0)) > ENOUGH:
            return steps + 1
    return MOST_STEPS
