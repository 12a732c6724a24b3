"""A machine as its file of tensors knows it: coordinates, groups of legs, what is solved for."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism, counted
from .machine_data import Machine
from .named_joints import fitting_path
from .self_test import targets_around_home
from .tensor_tables import LegGroup, Place, arms_of, groups_of, place_of


class TensorMachine:
    """A machine whose legs the routines of tensors know, and the coordinates that its file takes.

    Attributes
    ----------
    path : the named joints; None where poses of the platform are the coordinates.
    """

    def __init__(self, mechanism: Mechanism, joints: Sequence[str] | None) -> None:
        self.mechanism, self.machine = mechanism, Machine(mechanism)
        self.path = None if joints is None else fitting_path(mechanism, joints)
        if reason := self._refused():
            raise UnsupportedMechanism(mechanism.name, [reason], "exported")

    def _refused(self) -> str:
        machine = self.machine
        if arms := arms_of(machine):
            return f"legs on joints {', '.join(arms)}, which poses do not set in one step"
        if self.path is None and machine.uncontrolled:
            return f"its actuators leave the end effector {counted(machine.uncontrolled, 'freedom')}"
        if self.path is None and machine.rotations == 1:
            return "its task sets a yaw alone: name joints in series instead"
        return ""

    @cached_property
    def groups(self) -> list[LegGroup]:
        """The legs by their kind."""
        return groups_of(self.machine)

    @cached_property
    def driven(self) -> list[Place]:
        """Where the routines find the actuators."""
        return [place_of(driven, self.machine, self.groups) for driven in self.machine.driven]

    @cached_property
    def proximal(self) -> list[tuple[str, int, float]]:
        """All proximal joints: group, leg, and the unit of their coordinate [L or rad]."""
        size = self.mechanism.characteristic_length
        return [
            (group.name, leg, size if group.kind["proximal"] == "carriage" else 1.0)
            for group in self.groups
            if group.kind["proximal"]
            for leg in range(group.kind["n"])
        ]

    @cached_property
    def open(self) -> list[tuple[str, int, float]]:
        """Proximal joints without a motor: forward kinematics solve for them too."""
        driven = {place[:2] for place in self.driven if place[2] == "proximal"}
        return [each for each in self.proximal if each[:2] not in driven]

    @property
    def completes(self) -> bool:
        """True if the task leaves some of a pose open."""
        return self.path is None and self.machine.unset > 0

    @property
    def is_point(self) -> bool:
        return self.mechanism.end_effector_is_joint

    def samples(self, n: int) -> Floats:
        """Coordinates of joints (n, k) all over their ranges, around home where they have none; or poses (n, 4, 4)."""
        random = np.random.default_rng(0)
        if self.path is None:
            return targets_around_home(self.mechanism, n, random)
        reach = np.array(
            [0.5 if c.kind == "angle" else 0.3 * self.mechanism.characteristic_length for c in self.path.coordinates]
        )
        low = np.where(np.isfinite(self.path.low), self.path.low, self.path.home - reach)
        high = np.where(np.isfinite(self.path.high), self.path.high, self.path.home + reach)
        return np.asarray(random.uniform(low, high, (n, len(reach))))
