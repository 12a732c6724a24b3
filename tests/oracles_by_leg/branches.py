"""All working modes for one target: every pose that completes it, and at each every branch of every leg."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pfabrik.decomposition.decompose import decompose
from pfabrik.description.mechanism import Mechanism
from pfabrik.poses import as_poses
from pfabrik.tolerances import TOLERANCES

from .facts import Array
from .modes import Legs, are_near, legs_of, orthonormal, try_leg


@dataclass(frozen=True, eq=False)
class WorkingModes:
    """Every configuration of the legs for one target; home's working mode first, then those with fewer legs astray.

    Attributes
    ----------
    actuators : actuated coordinates, (k, n_a) [length or rad], in the order of `mechanism.actuator_names`.
    poses : poses of the end effector, T_base_platform, (k, 4, 4) [length]: of a target that sets but a part, completed.
    keeps_limits : whether every range and every cone is kept, (k,).
    legs : what the columns of `branches` stand for: the sub-chains, as `decompose` prints them.
    branches : on which branch every leg is, (k, legs): 0 on home's, 1 on the other.
    completions : which of the poses that complete the target it is, (k,): 0 the one that home is on.
    """

    actuators: Array
    poses: Array
    keeps_limits: NDArray[np.bool_]
    legs: tuple[str, ...]
    branches: NDArray[np.intp]
    completions: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.actuators)


@dataclass(frozen=True)
class _Branch:
    """One leg on one branch: 0 home's, 1 the other."""

    number: int
    value: float
    keeps_limits: bool


def working_modes(mechanism: Mechanism, target: Any) -> WorkingModes:
    """All working modes in which a mechanism reaches one target: its inverse kinematics, limits told but not asked for.

    A leg with a crank or a carriage has two branches, a strut one, and every combination is a mode; where both branches
    of a leg are one, it counts once. A target that sets but a part of a pose may have two poses, each with its modes. A
    joint that would reach further modes with the same actuators (a universal joint half a turn about both axes on) is
    on home's side. No mode at all: the target is out of reach of a leg.

    Parameters
    ----------
    target : pose (4, 4) of the end effector in the base frame [length], position (3,) at home orientation, or a SciPy
        RigidTransform; what the mechanism's task sets of it counts.
    """
    plan = legs_of(mechanism)
    targets, _ = as_poses(target)
    modes = list(_modes(plan, orthonormal(targets))) if are_near(plan, targets).all() else []
    return _wrapped(mechanism, modes)


def _modes(plan: Legs, target: Array) -> Iterator[tuple[int, Array, tuple[_Branch, ...]]]:
    """Completions, their poses (4, 4), and branches one a leg."""
    before: list[Array] = []
    for completion in range(plan.completion.solutions):
        pose = plan.completion.pose(target, completion)
        if any(np.abs(pose - other)[0, :3, :3].max() <= TOLERANCES.same_mode for other in before):
            continue
        before.append(pose)
        for branches in product(*(list(_branches(plan, index, pose)) for index in range(len(plan.legs)))):
            yield completion, pose[0], branches


def _branches(plan: Legs, index: int, pose: Array) -> Iterator[_Branch]:
    """The branches on which one leg closes."""
    home = plan.home_sides[index]
    found: list[float] = []
    for number, side in enumerate((home, -home)[: plan.drives[index].branches]):
        value, closes, keeps = try_leg(plan, index, pose, side)
        scale = plan.scale(index)
        if closes[0] and not any(abs(value[0] - other) <= TOLERANCES.same_mode * scale for other in found):
            found.append(float(value[0]))
            yield _Branch(number, float(value[0]), bool(keeps[0]))


def _wrapped(mechanism: Mechanism, modes: list[tuple[int, Array, tuple[_Branch, ...]]]) -> WorkingModes:
    plan = legs_of(mechanism)
    modes.sort(key=lambda mode: (mode[0], sum(branch.number for branch in mode[2])))
    actuators = np.full((len(modes), len(mechanism.actuator_names)), np.nan)
    for row, (_, _, branches) in enumerate(modes):
        for column, branch in zip(plan.columns, branches, strict=True):
            if column >= 0:
                actuators[row, column] = branch.value
    return WorkingModes(
        actuators=actuators,
        poses=np.array([pose for _, pose, _ in modes]).reshape(-1, 4, 4),
        keeps_limits=np.array([all(each.keeps_limits for each in branches) for *_, branches in modes], dtype=bool),
        legs=tuple(str(chain) for chain in decompose(mechanism)),
        branches=np.array([[each.number for each in branches] for *_, branches in modes], dtype=np.intp).reshape(
            -1, len(plan.legs)
        ),
        completions=np.array([completion for completion, *_ in modes], dtype=np.intp),
    )
