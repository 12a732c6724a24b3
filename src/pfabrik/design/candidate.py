"""A machine at values of the dimensions that are sought: margins and rates of poses, whether or not it can be built."""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np

from ..answers.differential import singularity
from ..answers.solution import Solution
from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..errors import InvalidMechanism, UnsupportedMechanism
from ..ik import solve_ik
from ..kinematics import MachineAt, VariedMachine, generic_of, task_of

IMPOSSIBLE, REACHED = -1.0, 1.0
"""Margins where there is no machine, and of a leg that reaches by far."""

NARROW = 0.01
"""Half of a range below which margins are shares of this [L or rad]."""

ENDS = ("min", "max")


class Dimensions:
    """The dimensions that are sought, and what does not change with them.

    Attributes
    ----------
    mechanism : the machine as described.
    names, low, high : of the p dimensions, and their bounds, (p,).
    limits : pairs (joint, bound) of the r limits.
    axes : components of the twist that the task sets, velocity before angular velocity.
    is_direct : True where actuators follow these one by one, and nothing else moves with them.
    """

    def __init__(self, varied: VariedMachine, low: Floats, high: Floats) -> None:
        self.mechanism, self.names, self.limits = varied.mechanism, varied.names, varied.limits
        self.low, self.high, self._varied = low, high, varied
        mechanism = self.mechanism
        self.source = mechanism.__dict__["_source"]
        places = {drive.joint.name: place for place, drive in enumerate(mechanism.drives)}
        self.reaching = [
            (row, places.get(joint, -1)) for row, (joint, bound) in enumerate(self.limits) if bound == "reach"
        ]
        self.is_length = np.array([drive.kind == "length" for drive in mechanism.drives])
        self.ends_of = [
            [(row, bound == "min") for row, (joint, bound) in enumerate(self.limits) if joint == name and bound in ENDS]
            for name in mechanism.actuator_names
        ]
        task = task_of(mechanism)
        self.axes = np.flatnonzero([*task.axes, *(() if mechanism.end_effector_is_joint else task.turns)])
        freedoms = generic_of(mechanism).mobility.platform
        self.is_direct = len(mechanism.drives) == len(self.axes) == freedoms and task.rotations in (0, 3)

    def at(self, values: Floats, poses: Floats, *, from_home: bool) -> Candidate:
        """The machine at values (p,); of the poses (n, 4, 4), positions count from home's if `from_home`."""
        try:
            found: MachineAt | None = self._varied.at(values)
        except (InvalidMechanism, UnsupportedMechanism):
            found = None
        home = self.mechanism.home_pose if found is None else found.home_pose
        if from_home:
            poses = poses.copy()
            poses[:, :3, 3] += home[:3, 3]
        return Candidate(self, values, found, poses, home)

    def named(self, values: Floats) -> dict[str, float]:
        """Values by name."""
        return dict(zip(self.names, values.tolist(), strict=True))


class Candidate:
    """A machine at values of its dimensions, and poses that it is to reach, (n, 4, 4) [length]."""

    def __init__(
        self, dimensions: Dimensions, values: Floats, found: MachineAt | None, poses: Floats, home: Floats
    ) -> None:
        self.dimensions, self.values, self._found, self.poses, self.home = dimensions, values, found, poses, home

    @property
    def is_machine(self) -> bool:
        """False where the file's expressions give no machine."""
        return self._found is not None

    @property
    def length(self) -> float:
        """L: the radius of the smallest sphere about the centres of all joints at home [length]."""
        return np.inf if self._found is None else self._found.characteristic_length

    @property
    def ranges(self) -> Floats:
        """Lowest and highest values of the actuators, (n_a, 2) [length or rad]."""
        n = len(self.dimensions.mechanism.drives)
        return np.full((n, 2), np.nan) if self._found is None else self._found.ranges

    @cached_property
    def margins(self) -> Floats:
        """Margins of all limits at all poses, (n, r): finite, and continuous where a leg just reaches.

        A leg that reaches has, in place of no margin at all, 1 / (J u)^2 of its actuator's rate J by the twist: like
        the gap beyond, it goes to 0 with the distance from the dead point.
        """
        return self._margins_at(self.poses)

    @cached_property
    def home_margins(self) -> Floats:
        """Margins at home, where a machine that is built is first, (1, r)."""
        return self._margins_at(self.home[None])

    def _margins_at(self, poses: Floats) -> Floats:
        dimensions = self.dimensions
        if self._found is None:
            return np.full((len(poses), len(dimensions.limits)), IMPOSSIBLE)
        margins = self._found.margins(poses)
        margins = np.where(np.isposinf(margins), REACHED, margins)
        if dimensions.reaching:
            with np.errstate(all="ignore"):
                rates = self._found.inverse_jacobians(poses)[:, :, dimensions.axes[dimensions.axes < 3]]
                near = 1.0 / (np.square(rates).sum(axis=2) * self._unit**2)
            near = np.clip(np.nan_to_num(near, nan=0.0, posinf=REACHED), 0.0, REACHED)
            for row, drive in dimensions.reaching:
                if drive >= 0:
                    margins[:, row] = np.where(margins[:, row] == REACHED, near[:, drive], margins[:, row])
        self._put_narrow(margins, poses)
        return np.nan_to_num(margins, nan=IMPOSSIBLE, neginf=IMPOSSIBLE)

    def _put_narrow(self, margins: Floats, poses: Floats) -> None:
        """Margins of actuators whose range is narrow, or ends before it begins, as shares of `NARROW`: so they fall
        with its ends."""
        assert self._found is not None
        units = np.where(self.dimensions.is_length, self.length, 1.0) * NARROW
        narrow = np.flatnonzero(np.ptp(self.ranges, axis=1) * np.sign(np.diff(self.ranges, axis=1)[:, 0]) < 2.0 * units)
        values = self._found.actuators(poses) if len(narrow) else np.zeros((0, 0))
        for drive in narrow.tolist():
            low, high = self.ranges[drive]
            for row, is_low in self.dimensions.ends_of[drive]:
                margins[:, row] = (values[:, drive] - low if is_low else high - values[:, drive]) / units[drive]

    @property
    def _unit(self) -> Floats:
        """What a translation by a unit of length is of an actuator that turns, (n_a,): L."""
        return np.where(self.dimensions.is_length, 1.0, self.length)

    @cached_property
    def actuators(self) -> Floats:
        """Values of the actuators at all poses, (n, n_a) [length or rad]."""
        if self._found is None:
            return np.full((len(self.poses), len(self.dimensions.mechanism.drives)), np.nan)
        return self._found.actuators(self.poses)

    @cached_property
    def rates(self) -> Floats:
        """Rates of the actuators by the end effector's twist, (n, n_a, 6) [length, rad]; NaN where there are none."""
        if self._found is None:
            return np.full((len(self.poses), len(self.dimensions.mechanism.drives), 6), np.nan)
        return self._found.inverse_jacobians(self.poses)

    @cached_property
    def factors(self) -> Floats:
        """Actuator speeds per speed along what the task sets, (n, k): singular values, L the unit of mixed lengths."""
        axes, is_length = self.dimensions.axes, self.dimensions.is_length
        units = np.where(axes < 3, self.length, 1.0) / np.where(is_length, self.length, 1.0)[:, None]
        found = self.rates[:, :, axes] * units
        is_known = np.isfinite(found).all(axis=(1, 2))
        values = np.full((len(found), min(found.shape[1:])), np.nan)
        values[is_known] = np.linalg.svd(found[is_known], compute_uv=False)
        return values

    @cached_property
    def distances(self) -> Floats:
        """Measures of the nearest serial and parallel singularity, (n, 2), as of `pf.singularity`."""
        if not self.dimensions.is_direct:
            found = singularity(self.solution)
            return np.stack([found.serial, np.minimum(found.parallel, found.constraint)], axis=1)
        with np.errstate(divide="ignore"):
            return np.stack([1.0 / self.factors[:, 0], self.factors[:, -1]], axis=1)

    @cached_property
    def unlimited(self) -> Mechanism:
        """The machine without limits, which can be built where its limits exclude home."""
        sketch = self.dimensions.source.sketch_with(self.dimensions.named(self.values))
        own = self.dimensions.mechanism
        joints = [dataclasses.replace(joint, range=None, cone=None) for joint in sketch.joints]
        return dataclasses.replace(own, joints=tuple(joints), reference_point=sketch.reference_point)

    @cached_property
    def solution(self) -> Solution:
        """The configurations of the machine without limits at all poses."""
        return solve_ik(self.unlimited, self.poses)
