"""Inverse kinematics leg by leg."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pfabrik.description.mechanism import Mechanism
from pfabrik.poses import as_poses

from .facts import Array, home_values
from .kept import Mask
from .modes import legs_of, solve_legs, start_of


@dataclass(frozen=True, eq=False)
class Answer:
    """What the closed form says, with the batch axes of the targets.

    Attributes
    ----------
    reached : whether some choice of branches closes and keeps every limit, (...,).
    actuators : (..., n_a) [length or rad], in the order of `mechanism.actuator_names`; NaN where not reached.
    pose : T_base_platform (..., 4, 4) [length], what the task leaves out included; NaN where not reached.
    """

    reached: Mask
    actuators: Array
    pose: Array

    def __bool__(self) -> bool:
        return bool(self.reached.all())


def solve_ik(mechanism: Mechanism, target: Any, *, start: Any = None) -> Answer:
    """Actuators that put the end effector on targets (..., 4, 4) or (..., 3), one answer a target.

    In home's working mode, or the start's (anything with `actuators` and `pose`, single or one a target), where that
    closes and keeps every limit; else each leg that does not takes its other branch, and where this does not help
    either, the target's other completion counts. `Unsuitable` where a leg or the task has no closed form here.
    """
    plan = legs_of(mechanism)
    targets, shape = as_poses(target)
    n_actuators = len(mechanism.actuator_names)
    if start is None:
        sides, first = start_of(plan, home_values(mechanism), None)
    else:
        values, poses = np.reshape(start.actuators, (-1, n_actuators)), np.reshape(start.pose, (-1, 4, 4))
        sides, first = start_of(plan, values, poses)
    reached, actuators, poses = solve_legs(plan, targets, sides, first)
    return Answer(reached.reshape(shape), actuators.reshape(*shape, n_actuators), poses.reshape(*shape, 4, 4))
