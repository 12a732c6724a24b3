"""Inverse kinematics leg by leg: every pose that completes a target, and at each every branch of every leg."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from checks import home_values
from pfabrik import Mechanism
from pfabrik.poses import as_poses
from pfabrik.tolerances import TOLERANCES

from .completions import Completion, completion_of
from .legs import Leg, judge, place_leg, read_legs
from .rods import require
from .turns import Array

CLOSED = TOLERANCES.position
"""Gap of a joint that counts as closed [L or rad]."""


class Plan(NamedTuple):
    """A mechanism as its legs.

    Attributes
    ----------
    columns : place of every leg's actuator among those of the mechanism; -1 of a leg that has none.
    home_sides : +1 or -1, the branch on which home has every leg.
    """

    mechanism: Mechanism
    legs: tuple[Leg, ...]
    completion: Completion
    columns: tuple[int, ...]
    home_sides: tuple[float, ...]


@lru_cache(maxsize=64)
def plan_of(mechanism: Mechanism) -> Plan:
    """The legs of a mechanism and how its targets are completed; `NoClosedForm` where either has none here."""
    legs = read_legs(mechanism)
    driven = [leg.actuated for leg in legs]
    columns = [-1 if joint is None else mechanism.actuator_names.index(joint.name) for joint in driven]
    require(set(range(len(mechanism.actuator_names))) <= set(columns), "an actuator is in no leg")
    home, sides = home_values(mechanism), []
    for leg, column in zip(legs, columns, strict=True):
        values = [_try_leg(mechanism, leg, mechanism.home_pose[None], side)[0][0] for side in leg.sides]
        apart = [_apart(mechanism, leg, value - home[column]) for value in values]
        sides.append(leg.sides[1] if len(leg.sides) == 2 and apart[1] < apart[0] - TOLERANCES.same_mode else 1.0)
    return Plan(mechanism, legs, completion_of(mechanism, legs), tuple(columns), tuple(sides))


def _try_leg(mechanism: Mechanism, leg: Leg, poses: Array, side: float) -> tuple[Array, Array, Array]:
    return judge(mechanism, leg, place_leg(mechanism, leg, poses, side))


def _apart(mechanism: Mechanism, leg: Leg, difference: float) -> float:
    """Difference of a leg's actuator [rad, whole turns aside, or L]."""
    if leg.actuated is not None and leg.actuated.type == "revolute":
        return abs(float(np.remainder(difference + np.pi, 2.0 * np.pi) - np.pi))
    return abs(difference) / mechanism.characteristic_length


def orthonormal(targets: Array) -> Array:
    """Targets (n, 4, 4) whose rotations are made orthonormal, their x axes first; the positions as they are."""
    poses = targets.copy()
    x = targets[:, :3, 0] / np.linalg.norm(targets[:, :3, 0], axis=1)[:, None]
    y = targets[:, :3, 1] - (x * targets[:, :3, 1]).sum(axis=1)[:, None] * x
    y /= np.linalg.norm(y, axis=1)[:, None]
    poses[:, :3, :3] = np.stack([x, y, np.cross(x, y)], axis=2)
    return poses


@dataclass(frozen=True, eq=False)
class Answer:
    """Answers of the closed form, with the batch axes of the targets.

    Attributes
    ----------
    margin : distance from the tightest limit in this configuration, (...,): see `judge`. Where a leg does not close,
        its gap, negative [L or rad].
    actuators : (..., n_a) [length or rad]: each leg's in home's branch where that keeps its limits, else in the better
        one, whether or not that does; NaN where a leg does not close.
    pose : T_base_platform (..., 4, 4) [length], what the task leaves out included.
    """

    margin: Array
    actuators: Array
    pose: Array

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Whether some choice of branches closes and keeps every limit."""
        return np.asarray(self.margin >= 0.0)


def solve_ik(mechanism: Mechanism, target: Any) -> Answer:
    """Actuators that put the end effector on targets (..., 4, 4) or (..., 3).

    In home's working mode where that closes and keeps every limit; else each leg that does not takes its other branch,
    and where this does not help either, the target's other completion counts.
    """
    plan = plan_of(mechanism)
    targets, shape = as_poses(target)
    targets, n = orthonormal(targets), len(targets)
    margin, values, poses = np.full(n, -np.inf), np.full((n, len(mechanism.actuator_names)), np.nan), targets.copy()
    for solution in range(plan.completion.solutions):
        rows = np.flatnonzero(margin < 0.0)
        completed = plan.completion.pose(targets[rows], solution)
        margins, actuators = _at_poses(plan, completed)
        better = margins > margin[rows]
        margin[rows[better]], values[rows[better]] = margins[better], actuators[better]
        poses[rows[better]] = completed[better]
    return Answer(margin.reshape(shape), values.reshape(*shape, -1), poses.reshape(*shape, 4, 4))


def _at_poses(plan: Plan, poses: Array) -> tuple[Array, Array]:
    """Margins (n,) and actuators (n, n_a) at poses (n, 4, 4)."""
    margin, actuators = np.full(len(poses), np.inf), np.zeros((len(poses), len(plan.mechanism.actuator_names)))
    for leg, column, home in zip(plan.legs, plan.columns, plan.home_sides, strict=True):
        own, values = np.full(len(poses), -np.inf), np.full(len(poses), np.nan)
        for side in (home, -home)[: len(leg.sides)]:
            rows = np.flatnonzero(own < 0.0)
            tried, gap, room = _try_leg(plan.mechanism, leg, poses[rows], side)
            room = np.where(gap <= CLOSED, room, -gap)
            better = room > own[rows]
            own[rows[better]], values[rows[better]] = room[better], np.where(gap <= CLOSED, tried, np.nan)[better]
        margin = np.minimum(margin, own)
        if column >= 0:
            actuators[:, column] = values
    return margin, actuators


class WorkingModes(NamedTuple):
    """Every configuration of the legs for one target; home's working mode first, then those with fewer legs on others.

    Attributes
    ----------
    actuators : actuated coordinates, (k, n_a) [length or rad], in the order of `mechanism.actuator_names`.
    poses : T_base_platform, (k, 4, 4) [length]: of a target that sets but a part, completed.
    margins : see `judge`, (k,).
    branches : on which branch every leg is, (k, legs): 0 on home's, 1 on the other.
    completions : which of the poses that complete the target it is, (k,): 0 the one that home is on.
    """

    actuators: Array
    poses: Array
    margins: Array
    branches: NDArray[np.intp]
    completions: NDArray[np.intp]


def working_modes(mechanism: Mechanism, target: Any) -> WorkingModes:
    """All working modes in which a mechanism reaches one target, limits told but not asked for.

    A leg with a crank or a carriage has two branches, a strut one, and every combination is a mode; where both branches
    of a leg are one, it counts once. A joint that would reach further modes with the same actuators (a universal joint
    half a turn about both axes on) is on home's side.
    """
    plan = plan_of(mechanism)
    target = orthonormal(as_poses(target)[0])
    modes, before = [], list[Array]()
    for completion in range(plan.completion.solutions):
        pose = plan.completion.pose(target, completion)
        if any(np.abs(pose - other)[0, :3, :3].max() <= TOLERANCES.same_mode for other in before):
            continue
        before.append(pose)
        for branches in product(*(list(_branches(plan, index, pose)) for index in range(len(plan.legs)))):
            modes.append((completion, pose[0], *zip(*branches, strict=True)))
    modes.sort(key=lambda mode: (mode[0], sum(mode[2])))
    n, driven = len(mechanism.actuator_names), np.array(plan.columns) >= 0
    actuators, order = np.zeros((len(modes), n)), np.array(plan.columns)[driven]
    if modes:
        actuators[:, order] = np.array([mode[3] for mode in modes])[:, driven]
    return WorkingModes(
        actuators,
        np.array([mode[1] for mode in modes]).reshape(-1, 4, 4),
        np.array([min(mode[4]) for mode in modes]),
        np.array([mode[2] for mode in modes], dtype=np.intp).reshape(-1, len(plan.legs)),
        np.array([mode[0] for mode in modes], dtype=np.intp),
    )


def _branches(plan: Plan, index: int, pose: Array) -> Iterator[tuple[int, float, float]]:
    """Number, actuator and margin of the branches on which one leg closes."""
    leg, home, found = plan.legs[index], plan.home_sides[index], list[float]()
    for number, side in enumerate((home, -home)[: len(leg.sides)]):
        (value,), (gap,), (margin,) = _try_leg(plan.mechanism, leg, pose, side)
        if gap <= CLOSED and all(_apart(plan.mechanism, leg, value - other) > TOLERANCES.same_mode for other in found):
            found.append(value)
            yield number, value, margin
