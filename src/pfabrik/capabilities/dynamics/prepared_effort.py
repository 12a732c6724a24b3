"""Forces of one state after another, prepared: of machines whose legs tell where all bodies are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Solution
from ...answers.start_configuration import Start, start_of
from ...common.arguments import DOUBLE, array
from ...common.arrays import Floats
from ...kernels.dynamics.effort_at_pose import MovingState, effort_at_pose, new_moving_state
from ...kernels.dynamics.moving import MovingMachine, MovingScratch, new_moving_scratch
from ...kernels.handle import Handle
from ...kernels.joints.loops import BALL
from ...kinematics import LegsRead, engine_of, task_of
from ...machine.description.mechanism import Mechanism
from ..statics.forces import GRAVITY
from ..statics.loads import BodyLoads, checked_gravity
from ..statics.transmission import is_redundantly_actuated
from .drives import drives_of
from .inverse_dynamics import inverse_dynamics
from .moving_rows import Probes, moving_of
from .weights import weights_of

AT_REST = np.zeros(6)


class _Kernel(NamedTuple):
    """A call of the kernel, and what it reads and writes."""

    legs: LegsRead
    machine: Handle[MovingMachine]
    scratch: Handle[MovingScratch]
    state: Handle[MovingState]

    def run(self) -> int:
        """The marks of the state."""
        legs = self.legs
        addresses = self.machine.address, self.scratch.address, self.state.address
        return effort_at_pose(legs.table.address, legs.scratch.address, *addresses)


class PreparedEffort:
    """What the actuators of a machine exert in one state, as `inverse_dynamics` has it.

    Attributes
    ----------
    actuators : of the last state, (n_a,) [N, N m].
    """

    def __init__(self, mechanism: Mechanism, start: Start | None) -> None:
        self._mechanism = mechanism
        self._legs = engine_of(mechanism).read_legs(start_of(mechanism, start, ()))
        self._asked: Any = ()
        self._kernel: _Kernel | None = None
        self.actuators = np.full(len(mechanism.actuator_names), np.nan)

    def carry(self, loads: BodyLoads | None, gravity: ArrayLike) -> None:
        """Prepare for what bodies carry, and a gravity, unless that is done; InvalidArgument as `inverse_dynamics`."""
        if loads is None and gravity is GRAVITY and self._asked == (None, None):
            return
        asked = None if loads is None else _key(loads), None if gravity is GRAVITY else _key(gravity)
        if asked != self._asked:
            weights, pull = weights_of(self._mechanism, loads), checked_gravity(gravity)
            moving = moving_of(self._mechanism, "task", weights, pull, Probes())
            self._kernel = _kernel(self._mechanism, self._legs, moving)
            self._asked = asked

    def at_pose(self, pose: Floats, twist: Floats, acceleration: Floats) -> bool:
        """Fill the efforts at a pose (4, 4) that legs reach, with twists (6,); False where that is for `at`."""
        if self._kernel is None:
            return False
        state = self._kernel.state.record
        state.pose[:], state.twist[:], state.gain[:] = pose, twist, acceleration
        if self._kernel.run():
            return False
        self.actuators[:] = state.results.actuators[0]
        return True

    def at(
        self, solution: Solution, twist: Floats, acceleration: Floats, loads: BodyLoads | None, gravity: ArrayLike
    ) -> None:
        """Fill the efforts in a configuration; NaN where there are none."""
        twist, acceleration = array("twist", twist, "6"), array("acceleration", acceleration, "6")
        moved = inverse_dynamics(solution, twists=twist, accelerations=acceleration, loads=loads, gravity=gravity)
        self.actuators[:] = moved.actuators


def twist_of(name: str, given: ArrayLike | None) -> Floats:
    """A twist (6,), of six numbers, of the three of a point, or of none."""
    if type(given) is np.ndarray and given.shape == (6,) and given.dtype is DOUBLE:
        return given
    if given is None:
        return AT_REST
    value = array(name, given, "6 | 3")
    return value if len(value) == 6 else np.concatenate([value, np.zeros(3)])


def _key(value: Any) -> Any:
    """What an argument says, to compare it with another's: numbers, and tuples of these; NaN where it is wrong."""
    try:
        if isinstance(value, Mapping):
            return tuple((body, *map(_key, pair)) for body, pair in value.items())
        return tuple(np.ravel(np.asarray(value, float)).tolist())
    except (TypeError, ValueError):
        return float("nan")


def _kernel(mechanism: Mechanism, legs: LegsRead | None, moving: MovingMachine) -> _Kernel | None:
    """The kernel for a machine; None where legs do not give all coordinates, or limits share what actuators exert."""
    if legs is None or mechanism.end_effector_is_joint:
        return None
    coordinates = {int(unit[2]) + place for unit in moving.units for place in range(3 if unit[0] == BALL else 1)}
    is_shared = is_redundantly_actuated(mechanism) and bool(np.isfinite(drives_of(mechanism).limits).any())
    if is_shared or not coordinates <= legs.columns:
        return None
    task, length, columns = task_of(mechanism), mechanism.characteristic_length, len(mechanism.coordinates)
    axes = task.twists(mechanism.home_pose)
    state = new_moving_state(moving, legs.sides, axes, task.rotations == 2, columns, length)
    scratch = new_moving_scratch(moving, len(axes))
    return _Kernel(legs, Handle(moving), Handle(scratch), Handle(state))
