"""A machine at values of the dimensions that are sought: margins and rates of poses, whether or not it can be built."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from ...answers.differential import singularity
from ...answers.solution import Solution
from ...common.arrays import Floats, Mask
from ...errors import InvalidArgument, InvalidMechanism, MobilityWarning, UnsupportedMechanism
from ...ik import solve_ik
from ...kinematics import MachineAt, VariedMachine, generic_of, task_of
from ...machine.decomposition.leg_table import DEAD_POINTS
from ...machine.description.joints import set_fields
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from ..statics.accuracy import largest

NOWHERE, IMPOSSIBLE, UNKNOWN, REACHED = -1e3, -1.0, -0.01, 1.0
"""Rows where there is no machine, where a margin is infinitely broken, where what is no margin has no value, as a leg
does not reach, and of a leg that reaches by far."""

HELD = 1e-9
"""Part of a unit of twist, or of a wrench, that actuators may leave loose by rounding [1 or L]."""

NARROW = 0.01
"""Half of a range below which margins are shares of this [L or rad]."""


class Dimensions:
    """The dimensions that are sought, and what does not change with them.

    Attributes
    ----------
    mechanism : the machine as described; own : its values, (p,); own_machine : the varied machine there.
    names, low, high : of the p dimensions, and their bounds, (p,).
    limits : pairs (joint, bound) of the r limits; reaching : pairs (row, actuator) of those that are reaches.
    ends : triples (row, actuator, is the lower) of those that are ends of an actuator.
    is_length : True for actuators that slide, (n_a,); sliding_names : of those between two ends.
    axes : components of the twist that the task sets, velocity before angular velocity.
    is_direct : True where actuators follow these one by one, and nothing else moves with them.
    """

    def __init__(self, varied: VariedMachine, low: Floats, high: Floats) -> None:
        self.mechanism, self.names, self.limits = varied.mechanism, varied.names, varied.limits
        self.low, self.high, self._varied = low, high, varied
        mechanism = self.mechanism
        self.source = mechanism.__dict__["_source"]
        self.own = np.array([mechanism.dimensions[name] for name in self.names])
        drive_of = {drive.joint.name: place for place, drive in enumerate(mechanism.drives)}
        limits = [(row, drive_of.get(joint), bound) for row, (joint, bound) in enumerate(self.limits)]
        of_drives = [(row, drive, bound) for row, drive, bound in limits if drive is not None]
        self.reaching = [(row, drive) for row, drive, _ in of_drives if row in varied.reach_rows]
        self.ends = [(row, drive, bound == "min") for row, drive, bound in of_drives if bound in ("min", "max")]
        self.is_length = np.array([drive.kind == "length" for drive in mechanism.drives])
        self.own_machine = varied.at(self.own)
        is_ended = np.isfinite(self.own_machine.ranges).all(axis=1)
        self.sliding = np.flatnonzero(self.is_length & is_ended)
        self.sliding_names = [mechanism.actuator_names[drive] for drive in self.sliding]
        task = task_of(mechanism)
        self.axes = np.flatnonzero([*task.axes, *(() if mechanism.end_effector_is_joint else task.turns)])
        freedoms = generic_of(mechanism).mobility.platform
        self.is_direct = len(mechanism.drives) == len(self.axes) == freedoms and task.rotations != 2

    def at(self, values: Floats) -> MachineAt | None:
        """The machine at values (p,); None where the file's expressions give none."""
        try:
            return self._varied.at(values)
        except (InvalidMechanism, UnsupportedMechanism):
            return None

    def named(self, values: Floats) -> dict[str, float]:
        """Values by name."""
        return dict(zip(self.names, values.tolist(), strict=True))


class Candidate:
    """A machine at values of its dimensions, and poses that it is to reach, (n, 4, 4) [length].

    Attributes
    ----------
    is_machine : False where the file's expressions give no machine: all but `value_of` is of the machine as described.
    """

    def __init__(self, dimensions: Dimensions, values: Floats, poses: Floats, moves: Floats) -> None:
        """Positions of the poses count from home's along axes where `moves` (3,) is 1."""
        found = dimensions.at(values)
        self.dimensions, self.values, self.is_machine = dimensions, values, found is not None
        self._found = dimensions.own_machine if found is None else found
        home = self._found.home_pose
        self._all = np.concatenate([poses, home[None]])
        self._all[:-1, :3, 3] += moves * home[:3, 3]
        self.poses, self._n_drives = self._all[:-1], len(dimensions.is_length)

    def value_of(self, expression: str) -> float:
        """The value of an expression of dimensions; NaN where it has none."""
        try:
            return float(self.dimensions.source.value_of(expression, self.dimensions.named(self.values)))
        except InvalidArgument:
            return math.nan

    @property
    def length(self) -> float:
        """L: the radius of the smallest sphere about the centres of all joints at home [length]."""
        return self._found.characteristic_length

    @property
    def units(self) -> Floats:
        """L for actuators that slide, 1 for others, (n_a,)."""
        return np.where(self.dimensions.is_length, self.length, 1.0)

    @property
    def sliding_ranges(self) -> Floats:
        """Ends of the actuators that slide between two, (n, 2) [length]."""
        return self._found.ranges[self.dimensions.sliding]

    @property
    def margins(self) -> Floats:
        """Margins of all limits at all poses, (n, r): finite, and continuous where a leg just reaches.

        A leg that reaches has, in place of no margin at all, 1 / (J u)^2 of its actuator's rate J by the twist: like
        the gap beyond, it goes to 0 with the distance from the dead point.
        """
        return self._margins[:-1]

    @property
    def home_margins(self) -> Floats:
        """Margins at home, where a machine that is built is first, (r,)."""
        return np.asarray(self._margins[-1])

    @cached_property
    def _margins(self) -> Floats:
        dimensions, found = self.dimensions, self._found
        margins, ranges = found.margins(self._all), found.ranges
        if dimensions.reaching:
            rows, drives = np.array(dimensions.reaching).T
            rates = self._rates[:, drives][:, :, dimensions.axes[dimensions.axes < 3]]
            units = (self.length / self.units)[drives]
            with np.errstate(all="ignore"):
                near = np.fmin(1.0 / (np.square(rates).sum(axis=2) * units**2), REACHED)
            margins[:, rows] = np.where(np.isposinf(margins[:, rows]), np.nan_to_num(near), margins[:, rows])
        units = self.units * NARROW
        narrow = ranges[:, 1] - ranges[:, 0] < 2.0 * units
        if narrow.any():  # so the margin of a range that ends before it begins falls with its ends
            values = found.actuators(self._all)
            for row, drive, is_low in dimensions.ends:
                if narrow[drive]:
                    low, high = ranges[drive]
                    gap = values[:, drive] - low if is_low else high - values[:, drive]
                    margins[:, row] = gap / units[drive]
        margins[np.isposinf(margins)] = REACHED
        margins[~np.isfinite(margins)] = IMPOSSIBLE
        return margins

    @cached_property
    def actuators(self) -> Floats:
        """Values of the actuators at all poses, (n, n_a) [length or rad]."""
        return self._found.actuators(self.poses)

    @property
    def rates(self) -> Floats:
        """Rates of the actuators by the end effector's twist, (n, n_a, 6) [length, rad]; NaN where there are none."""
        return self._rates[:-1]

    @cached_property
    def _rates(self) -> Floats:
        return self._found.inverse_jacobians(self._all)

    @cached_property
    def motions(self) -> tuple[Mask, Floats, Floats]:
        """Where motions are known, (n,), and there actuator rates (k, n_a, f) and twists (k, 6, f); lengths in L."""
        rates, twists = self._found.motions(self.poses)
        known = np.asarray(np.isfinite(rates).all(axis=(1, 2)) & np.isfinite(twists).all(axis=(1, 2)))
        return known, rates[known] / self.units[:, None], twists[known]

    @cached_property
    def forward(self) -> tuple[Floats, Floats]:
        """Forward Jacobians F = T A^+ (n, 6, n_a), from motions' twists T and actuator rates A, and what actuators do
        not hold, T - F A (n, 6, f); lengths in L, NaN where motions are unknown."""
        known, rates, twists = self.motions
        maps = twists @ np.linalg.pinv(rates, TOLERANCES.rank)
        forward, loose = (np.full((len(known), *part.shape[1:]), np.nan) for part in (maps, twists))
        forward[known], loose[known] = maps, twists - maps @ rates
        return forward, loose

    def forces(self, wrenches: Floats) -> Floats:
        """Actuator forces -F' w (n, w, n_a) that hold wrenches (w, 6) or (w, 3); of redundant actuators, the least."""
        (forward, loose), r = self.forward, wrenches.shape[1]
        scaled = wrenches / np.repeat([1.0, self.length], 3)[:r]
        gives_way = np.abs(scaled @ loose[:, :r]).max(axis=2) > HELD * np.abs(scaled).max()
        held = -scaled @ forward[:, :r] * (self.length / self.units)
        return np.where(gives_way[:, :, None], np.nan, held)

    def position_errors(self, errors: Floats) -> Floats:
        """Largest errors of the position, (n,) [length], by errors of actuators, (n_a,) [length or rad]."""
        forward, loose = self.forward
        by_actuator = self.length * forward[:, :3] * (errors / self.units)
        known = np.asarray((np.abs(loose[:, :3]) <= HELD).all(axis=(1, 2)))
        found = np.full(len(known), np.nan)
        found[known] = largest(by_actuator[known], np.zeros((np.count_nonzero(known), 0, 3, 3)))[0]
        return found

    def compliance(self, stiffness: Floats) -> Floats:
        """Compliance T (A' k A)^-1 T' of positions, (n, 3, 3), by actuators of stiffness k, (n_a,)."""
        (known, rates, twists), found = self.motions, np.full((len(self.poses), 3, 3), np.nan)
        rates = rates * self.units[:, None]
        gives, directions = np.linalg.eigh(np.swapaxes(rates, 1, 2) * stiffness @ rates)
        moved = self.length * twists[:, :3] @ directions
        with np.errstate(all="ignore"):
            found[known] = moved / gives[:, None] @ np.swapaxes(moved, 1, 2)
        return found

    @cached_property
    def factors(self) -> Floats:
        """Actuator speeds per speed along what the task sets, (n, k): singular values, L the unit of mixed lengths."""
        axes = self.dimensions.axes
        with np.errstate(all="ignore"):
            units = np.where(axes < 3, self.length, 1.0) / self.units[:, None]
            found = self.rates[:, :, axes] * units
        is_known = np.isfinite(found).all(axis=(1, 2))
        values = np.full((len(found), min(found.shape[1:])), np.nan)
        values[is_known] = np.linalg.svd(found[is_known], compute_uv=False)
        return values

    @cached_property
    def distances(self) -> Floats:
        """Measures of the nearest serial and parallel singularity, (n, 2), as of `pf.singularity`."""
        if not self.dimensions.is_direct:
            return self.measured(_singularities, 2)
        with np.errstate(divide="ignore"):
            return np.stack([1.0 / self.factors[:, 0], self.factors[:, -1]], axis=1)

    @cached_property
    def unlimited(self) -> Mechanism:
        """The machine without limits, which can be built where its limits exclude home; or InvalidMechanism."""
        own, source = self.dimensions.mechanism, self.dimensions.source
        sketch = source.sketch_with(self.dimensions.named(self.values))
        joints = [dataclasses.replace(joint, range=None, cone=None) for joint in sketch.joints]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MobilityWarning)  # of machines that are only tried
            found = dataclasses.replace(own, joints=tuple(joints), reference_point=sketch.reference_point)
        values = {name: self.value_of(name) for name in own.dimensions}
        set_fields(found, _source=dataclasses.replace(source, dimensions=values))
        return found

    def measured(self, function: Callable[[Solution], Any], width: int = 1) -> Floats:
        """Values (n, width) of a function of the machine's configurations; NaN at poses where legs do not close."""
        (closed, solution), found = self._closed, np.full((len(self.poses), width), np.nan)
        if solution is not None:
            found[closed] = np.reshape(function(solution), (-1, width))
        return found

    @cached_property
    def _closed(self) -> tuple[Mask, Solution | None]:
        """Where legs close, (n,), and the configurations there, without limits; none of what cannot be built."""
        closing = [
            row for row, (_, bound) in enumerate(self.dimensions.limits) if bound in (*DEAD_POINTS, "not closed")
        ]
        closed = np.asarray(np.isposinf(self._found.margins(self.poses)[:, closing]).all(axis=1))
        try:
            return closed, solve_ik(self.unlimited, self.poses[closed]) if closed.any() else None
        except InvalidMechanism:
            return closed, None


def _singularities(solution: Solution) -> Floats:
    found = singularity(solution)
    return np.stack([found.serial, np.minimum(found.parallel, found.constraint)], axis=1)
