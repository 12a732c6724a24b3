"""Configurations at named coordinates: which are reached, and how actuators move there."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...answers.differential import forward_jacobian, inverse_jacobian, singularity
from ...answers.margins import margins
from ...answers.solution import Solution
from ...answers.status import Status
from ...common.arrays import Floats, Ints, Mask
from ...common.rotations import nearest_turn
from ...engines.pose.coordinates import read_coordinates
from ...engines.pose.jacobians import actuator_slopes
from ...feasibility import feasibility
from ...ik import solve_ik
from ...kinematics import JointPath, model_of
from ...machine.description.mechanism import Mechanism
from ...options import Options
from ...tolerances import TOLERANCES
from .assembly_mode import AssemblyMode
from .task_path import Coordinates, TaskPath

IN_MODE = Options(working_mode="keep")
"""A robot keeps its working mode: that of home."""

Limits: TypeAlias = NDArray[np.str_]
"""Joint and bound of a limit for every row, (n, 2)."""

NEAR_DEAD_POINT = 1e-2
"""Measure of a serial singularity [L and rad] below which it is named as what limits: actuators are a hundred times as
fast there as the platform. Farther off it is no limit, and no share of a range to be compared with."""

NO_LIMIT, SINGULARITY = ("", ""), ("", "singularity")
WORD = "U128"
"""Type of names: room for those of any joint."""


class Placed(NamedTuple):
    """Configurations at named coordinates, or as near as they can be."""

    actuators: Floats  # (n, n_a)
    status: Ints  # (n,)
    coordinates: Floats  # (n, k): those that the configurations have
    asked: Floats  # (n, k): those asked for, or where a motion towards them ends at a parallel singularity


class Placer:
    """Finds configurations at named coordinates q (n, k), in the working mode of home.

    Named joints set more of a pose than a task may. Where legs have closed forms, they are placed by the whole pose;
    what that does not reach is answered for the machine with its own task.
    """

    def __init__(self, coordinates: Coordinates) -> None:
        self.coordinates, self.mechanism = coordinates, coordinates.mechanism

    def place(self, q: Floats) -> Placed:
        """Configurations at coordinates q (n, k), or as near as `solve_ik` finds them in home's assembly mode."""
        n, beyond = len(q), self.assembly.are_beyond(q)
        placed = Placed(np.empty((n, len(self.mechanism.actuator_names))), np.empty(n, np.int64), q.copy(), q.copy())
        is_found = np.zeros(n, bool)
        if self._by_legs is not None:
            rows = np.flatnonzero((self._margins(q)[0] >= -TOLERANCES.limit) & ~beyond)
            solution = solve_ik(self._by_legs, self.coordinates.poses(q[rows]), options=IN_MODE)
            placed.actuators[rows], placed.status[rows] = solution.actuators, solution.status
            is_found[rows] = placed.status[rows] == Status.REACHED
        placed.asked[beyond] = self.assembly.ends(q[beyond])
        rows = np.flatnonzero(~is_found)
        self._put(placed, rows)
        placed.status[beyond] = Status.PROJECTED
        again = rows[self.assembly.are_beyond(placed.coordinates[rows])]  # what is nearest may be
        placed.asked[again] = self.assembly.ends(placed.coordinates[again])
        self._put(placed, again)
        placed.status[again] = Status.PROJECTED
        return placed

    def _put(self, placed: Placed, rows: Ints) -> None:
        """Write the answers of the machine to some rows."""
        if len(rows):
            asked = placed.asked[rows]
            solution = self.solution(asked)
            status = np.array(solution.status)
            status[(status == Status.REACHED) & ~self._has(solution, asked)] = Status.PROJECTED
            placed.actuators[rows], placed.status[rows] = solution.actuators, status
            placed.coordinates[rows] = self.values(solution)

    def solution(self, q: Floats) -> Solution:
        """The answers of the machine to the poses at coordinates q (n, k)."""
        return self.solution_of(q, (len(q),))

    def solution_of(self, q: Floats, shape: tuple[int, ...]) -> Solution:
        """The answers of the machine to the poses at coordinates q (n, k), as a batch of a given shape."""
        return solve_ik(self.mechanism, self.coordinates.poses(q).reshape(*shape, 4, 4), options=IN_MODE)

    def values(self, solution: Solution) -> Floats:
        """The named coordinates (n, k) of a solution's configurations."""
        if isinstance(self.coordinates, TaskPath):
            return self.coordinates.of(solution)
        by_legs = self._values_by_legs(solution.pose.reshape(-1, 4, 4))
        if by_legs is not None:
            return by_legs
        return solution.q.reshape(-1, len(self.mechanism.coordinate_names))[:, self.coordinates.columns]

    def _values_by_legs(self, poses: Floats) -> Floats | None:
        """The named coordinates (n, k) at poses (n, 4, 4), if a leg of home's mode has them: no loop has to be closed.

        None if no leg has them, or they do not give one of the poses, or are out of their ranges there; or if they may
        make whole turns, which follow from the start.
        """
        model = model_of(self.mechanism)
        assert isinstance(self.coordinates, JointPath)
        columns = self.coordinates.columns
        turns = np.array(self.coordinates.is_angle) & (self.coordinates.high - self.coordinates.low >= 2.0 * np.pi)
        if model.why_poses_do_not_suffice or turns.any() or not np.isin(columns, model.legs.known["column"]).all():
            return None
        deviations = np.zeros((len(poses), len(self.mechanism.coordinate_names)))
        read_coordinates(model.legs, poses, model.legs.home_sides, deviations)
        q = deviations[:, columns] + self.coordinates.home
        gaps = np.abs(self.coordinates.poses(q) - poses)
        gaps[:, :3, 3] /= self.mechanism.characteristic_length
        outside = np.maximum(self.coordinates.low - q, q - self.coordinates.high)
        is_exact = gaps.max(initial=0.0) <= TOLERANCES.position and outside.max(initial=0.0) <= TOLERANCES.active
        return q if is_exact else None

    def jacobian(self, q: Floats) -> Floats:
        """Actuator rates by the rates of the named coordinates at q (n, k), (n, n_a, k).

        With the legs' slopes dx/dT by the twist T of the platform, and the path's T = S dq/dt: dx/dq = dx/dT S. It does
        not ask for limits. Where loops do not close at q, and near dead points, it is that of `solution`.
        """
        maps = self._slopes_by_legs(q)
        if maps is None:
            return self.jacobian_of(self.solution(q))
        rows = np.flatnonzero(np.isnan(maps[:, 0, 0]))
        if len(rows):
            maps[rows] = self.jacobian_of(self.solution(q[rows]))
        return maps

    def jacobian_of(self, solution: Solution) -> Floats:
        """Actuator rates by the rates of the named coordinates at a solution, (n, n_a, k).

        Of a task with rates r = R T: dr/dx = R dT/dx, whose Moore-Penrose inverse is dx/dr.
        """
        if isinstance(self.coordinates, JointPath):
            inverse = inverse_jacobian(solution).reshape(-1, *self._shape)
            return np.asarray(inverse @ self.coordinates.poses_and_twists(self.values(solution))[1])
        forward = forward_jacobian(solution).reshape(-1, *self._shape[::-1])
        rates = self.coordinates.rates(solution.pose.reshape(-1, 4, 4)) @ forward
        return np.asarray(np.linalg.pinv(rates, rcond=TOLERANCES.rank), float)

    def margins(self, q: Floats) -> tuple[Floats, Limits]:
        """The least margin of every row of q (n, k), (n,), and its limit (n, 2); negative beyond reach."""
        margin, limits = self._margins(q)
        near = np.flatnonzero((margin > 0.0) & self._may_be_dead_point(q))
        if len(near):
            solution = self.solution(q[near])
            distances = np.ravel(singularity(solution).serial)
            fastest = np.abs(self.jacobian_of(solution)).max(axis=2).argmax(axis=1)
            for row, distance, place in zip(near, distances, fastest, strict=True):
                if distance < min(margin[row], NEAR_DEAD_POINT):
                    margin[row], limits[row] = distance, (self.mechanism.actuator_names[place], "dead point")
        hold = self.assembly.margins(q, NEAR_DEAD_POINT)
        nearer = np.flatnonzero(hold < np.minimum(margin, NEAR_DEAD_POINT))
        margin[nearer], limits[nearer] = hold[nearer], SINGULARITY
        return margin, limits

    def feasible_margins(self, q: Floats) -> Floats:
        """The least margin of every row of q (n, k), (n,), dead points aside: its sign says whether q is feasible."""
        margin = self._margins(q)[0]
        inside = np.flatnonzero(margin >= 0.0)
        beyond = inside[self.assembly.are_beyond(q[inside], close=True)]
        margin[beyond] = np.minimum(self.assembly.margins(q[beyond], NEAR_DEAD_POINT), -TOLERANCES.active)
        return margin

    def _margins(self, q: Floats) -> tuple[Floats, Limits]:
        return self._margins_by_legs(q) if self._by_legs is not None else self._margins_by_solution(q)

    @cached_property
    def assembly(self) -> AssemblyMode:
        """The coordinates that home's assembly mode has."""
        return AssemblyMode(self.coordinates, self._slopes)

    def _slopes(self, q: Floats) -> Floats:
        """Actuator rates (n, n_a, k) at q (n, k), NaN where loops do not close."""
        maps = self._slopes_by_legs(q)
        if maps is None:
            solution = self.solution(q)
            maps = self.jacobian_of(solution)
            maps[~self._has(solution, q)] = np.nan
        return maps

    def _slopes_by_legs(self, q: Floats) -> Floats | None:
        """Actuator rates (n, n_a, k) at q (n, k), NaN near dead points or where legs are open; None without legs."""
        if self._by_legs is None or not isinstance(self.coordinates, JointPath):
            return None
        poses, twists = self.coordinates.poses_and_twists(q)
        slopes = actuator_slopes(model_of(self._by_legs), poses)
        return None if slopes is None else slopes @ twists

    @cached_property
    def _by_legs(self) -> Mechanism | None:
        """The machine that legs answer for, of named joints with the whole pose as its task; None if they do not."""
        if model_of(self.mechanism).why_poses_do_not_suffice:
            return None
        if isinstance(self.coordinates, TaskPath):
            return self.mechanism
        return self.mechanism._with(task=self.mechanism.whole_task)

    @property
    def _shape(self) -> tuple[int, int]:
        return len(self.mechanism.actuator_names), 3 if self.mechanism.end_effector_is_joint else 6

    def _margins_by_legs(self, q: Floats) -> tuple[Floats, Limits]:
        assert self._by_legs is not None
        found = feasibility(self._by_legs, self.coordinates.poses(q))
        limits = np.array([*found.limits, NO_LIMIT], WORD)[found.binding]
        margin, places = self._range_margins(q)
        of_range = np.array([(name, bound) for name in self.coordinates.names for bound in ("min", "max")], WORD)
        return np.minimum(found.margin, margin), np.where((margin < found.margin)[:, None], of_range[places], limits)

    def _range_margins(self, q: Floats) -> tuple[Floats, Ints]:
        """The least margin of the named coordinates' own ranges, (n,), and its place among pairs of min and max.

        A pose does not say how many turns a joint has made: its range does.
        """
        low, high = self.coordinates.low, self.coordinates.high
        half = np.maximum(0.5 * (high - low), TOLERANCES.limit)
        with np.errstate(invalid="ignore"):
            shares = np.stack([(q - low) / half, (high - q) / half], axis=2).reshape(len(q), -1)
        shares[np.isnan(shares)] = np.inf
        places = shares.argmin(axis=1)
        return shares[np.arange(len(q)), places], places

    def _margins_by_solution(self, q: Floats) -> tuple[Floats, Limits]:
        """Margins of limits where reached; else minus the distance from what was asked [L or rad]."""
        solution = self.solution(q)
        missed = np.flatnonzero((np.array(solution.status) != Status.REACHED) | ~self._has(solution, q))
        table = margins(solution)
        values = np.stack([*(np.broadcast_to(each, len(q)) for each in table.values()), np.full(len(q), np.inf)])
        places = values.argmin(axis=0)
        margin, limits = values[places, np.arange(len(q))], np.array([*table, NO_LIMIT], WORD)[places]
        units = np.where(self.coordinates.is_angle, 1.0, self.mechanism.characteristic_length)
        margin[missed] = -np.linalg.norm((self.values(solution) - q)[missed] / units, axis=1)
        if len(missed):
            binding = solution[missed].binding
            limits[missed] = np.where(binding["joint"][:, None] == "", [("", "not closed")], _columns(binding))
        return margin, limits

    def _may_be_dead_point(self, q: Floats) -> Mask:
        """True where legs close at coordinates q (n, k), but have no slopes; wherever legs do not tell."""
        slopes = self._slopes_by_legs(q)
        return np.ones(len(q), bool) if slopes is None else np.isnan(slopes[:, 0, 0])

    def _has(self, solution: Solution, q: Floats) -> Mask:
        """True where a solution has coordinates q (n, k); turns without a range may differ by whole turns."""
        gaps = self.values(solution) - q
        turns = np.array(self.coordinates.is_angle) & ~np.isfinite(self.coordinates.high - self.coordinates.low)
        gaps[:, turns] = nearest_turn(gaps[:, turns])
        gaps[:, ~np.array(self.coordinates.is_angle)] /= self.mechanism.characteristic_length
        return np.asarray(np.abs(gaps).max(axis=1) <= TOLERANCES.same_mode)


def _columns(binding: NDArray[np.void]) -> Limits:
    return np.stack([binding["joint"], binding["bound"]], axis=1)
