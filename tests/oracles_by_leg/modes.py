"""Any mechanism of known legs: its poses for a target, and of every leg the branches at a pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pfabrik.description.mechanism import Mechanism
from pfabrik.tolerances import TOLERANCES

from .drives import Drive, drive_of
from .facts import HORIZON, Array, home_values, require
from .kept import Mask, judge
from .legs import Leg, read_legs
from .platforms import Completion, completion_of
from .rods import TIP, place_rod
from .turns import Placed, at_home

Ints = NDArray[np.intp]
SIDES = (1.0, -1.0)
"""The two branches of a leg that has two."""


@dataclass(frozen=True, eq=False)
class Legs:
    """A mechanism as its legs.

    Attributes
    ----------
    columns : place of every leg's actuator among those of the mechanism; -1 of a leg that has none.
    home_sides : +1 or -1, the branch on which home has every leg.
    bodies : those that stand for base and end effector.
    """

    mechanism: Mechanism
    legs: tuple[Leg, ...]
    drives: tuple[Drive, ...]
    completion: Completion
    columns: tuple[int, ...]
    bodies: tuple[str, str]
    home_sides: Array

    def scale(self, index: int) -> float:
        """What differences of a leg's actuator are counted in: 1 of an angle, L of a length; 1 without one."""
        joint = self.legs[index].actuated
        return self.mechanism.characteristic_length if joint is not None and joint.type == "prismatic" else 1.0


@lru_cache(maxsize=64)
def legs_of(mechanism: Mechanism) -> Legs:
    """The legs of a mechanism and how its targets are completed; `Unsuitable` where either has no closed form here."""
    legs = read_legs(mechanism)
    _require_free_tip(mechanism, legs)
    known = {each.joint.name for leg in legs for each in leg.passages}
    for name in mechanism.actuator_names:
        require(name in known, f"actuated joint {name} is in no sub-chain")
    drives = tuple(drive_of(mechanism, leg) for leg in legs)
    driven = [leg.actuated for leg in legs]
    columns = tuple(-1 if joint is None else mechanism.actuator_names.index(joint.name) for joint in driven)
    first = legs[0].passages[0].inner
    end = TIP if mechanism.end_effector_is_joint else _end(legs[0])
    plan = Legs(mechanism, legs, drives, completion_of(mechanism, legs), columns, (first, end), np.ones(len(legs)))
    sides = nearest_sides(plan, mechanism.home_pose[None], home_values(mechanism))
    return replace(plan, home_sides=sides[0])


def _end(leg: Leg) -> str:
    return (leg.guide or leg.rods[0].passages)[-1].outer


def _require_free_tip(mechanism: Mechanism, legs: Sequence[Leg]) -> None:
    """A tip between legs must leave each of them free: a ball joint, or a hinge of legs that are all in its plane."""
    if not mechanism.end_effector_is_joint:
        return
    tip = mechanism.joint(mechanism.end_effector)
    require(tip.range is None and tip.cone is None, f"the range of {tip.name} ties its legs together")
    require(tip.type in ("revolute", "spherical"), f"{tip.name} ties its legs together")
    if tip.type == "revolute":
        axes = [axis for leg in legs for each in leg.passages for axis in each.axes]
        plane = [np.linalg.norm(np.cross(axis, np.array(tip.axis))) <= TOLERANCES.alignment for axis in axes]
        require(all(plane), "its axes are not all parallel")


def try_leg(plan: Legs, index: int, poses: Array, side: Array | float) -> tuple[Array, Mask, Mask]:
    """One leg at poses (n, 4, 4), on its branch `side`: its actuator (n,), whether it closes, and keeps its limits."""
    leg, drive = plan.legs[index], plan.drives[index]
    placed = {plan.bodies[0]: at_home(len(poses)), plan.bodies[1]: _end_effector(plan.mechanism, poses)}
    if leg.driver is not None and drive.solve is not None:
        head = placed[plan.bodies[1]].point(leg.rods[0].head)
        placed[leg.driver.outer] = drive.solve(plan.mechanism, leg, head, side)
    for rod in leg.rods:
        place_rod(rod, placed)
    for each in leg.guide[:-1]:  # a slide does not turn
        turn = placed[plan.bodies[1]].turn
        centre = np.array(each.joint.at)
        placed[each.outer] = Placed(turn, centre - turn @ centre)
    values = np.full(len(poses), np.nan)
    closes, keeps = judge(plan.mechanism, leg, placed, values)
    return values, closes, keeps


def _end_effector(mechanism: Mechanism, poses: Array) -> Placed:
    """The end effector at poses (n, 4, 4); of a tip, which has no orientation, its place."""
    if mechanism.end_effector_is_joint:
        return Placed(at_home(len(poses)).turn, poses[:, :3, 3] - mechanism.reference_point)
    turn = np.ascontiguousarray(poses[:, :3, :3])
    return Placed(turn, poses[:, :3, 3] - turn @ np.array(mechanism.reference_point))


def nearest_sides(plan: Legs, poses: Array, actuators: Array) -> Array:
    """On which branch every leg is, (n, legs) of +1 and -1, at poses (n, 4, 4) with actuators (n, n_a).

    Where the two branches are one it is +1.
    """
    sides = np.ones((len(poses), len(plan.legs)))
    for index, (drive, column) in enumerate(zip(plan.drives, plan.columns, strict=True)):
        if drive.branches == 2:
            apart = [try_leg(plan, index, poses, side)[0] - actuators[:, column] for side in SIDES]
            if plan.legs[index].turns:  # of angles whole turns do not count
                apart = [np.remainder(each + np.pi, 2.0 * np.pi) - np.pi for each in apart]
            left, right = (np.abs(each) / plan.scale(index) for each in apart)
            sides[:, index] = np.where(right < left - TOLERANCES.same_mode, -1.0, 1.0)
    return sides


def solve_legs(plan: Legs, targets: Array, sides: Array, first: Ints) -> tuple[Mask, Array, Array]:
    """Answers to targets (n, 4, 4) by legs.

    Of every pose that completes a target every leg has its branches; limits of a leg are its own, so that each leg
    takes the branch it is on where that keeps them, else its other one, and the first pose at which all legs find one
    is the answer.

    Parameters
    ----------
    sides : on which branch every leg is, (1 or n, legs).
    first : which completion comes first, (1 or n,).

    Returns
    -------
    Whether each target is reached, (n,), actuators (n, n_a) and poses (n, 4, 4), NaN where not.
    """
    n = len(targets)
    reached, actuators = np.zeros(n, bool), np.full((n, len(plan.mechanism.actuator_names)), np.nan)
    poses = np.full((n, 4, 4), np.nan)
    near = are_near(plan, targets)
    turned = orthonormal(targets)
    sides, first = np.broadcast_to(sides, (n, len(plan.legs))), np.broadcast_to(first, n)
    for solution in range(plan.completion.solutions):
        for own in range(plan.completion.solutions):
            rows = np.flatnonzero(near & ~reached & (first == own))
            completed = plan.completion.pose(turned[rows], (own + solution) % plan.completion.solutions)
            found, values = _at_poses(plan, completed, sides[rows])
            reached[rows[found]] = True
            actuators[rows[found]], poses[rows[found]] = values[found], completed[found]
    return reached, actuators, poses


def _at_poses(plan: Legs, poses: Array, sides: Array) -> tuple[Mask, Array]:
    """Whether all legs reach poses (n, 4, 4), (n,), and the actuators (n, n_a)."""
    values = np.full((len(poses), len(plan.mechanism.actuator_names)), np.nan)
    left = np.arange(len(poses))
    for index, (drive, column) in enumerate(zip(plan.drives, plan.columns, strict=True)):
        own, _, kept = try_leg(plan, index, poses[left], sides[left, index])
        other = np.flatnonzero(~kept) if drive.branches == 2 else left[:0]
        if len(other):
            again, _, kept[other] = try_leg(plan, index, poses[left[other]], -sides[left[other], index])
            own[other] = again
        if column >= 0:
            values[left, column] = own
        left = left[kept]
    found = np.zeros(len(poses), bool)
    found[left] = True
    return found, values


def are_near(plan: Legs, targets: Array) -> Mask:
    """Which targets (n, 4, 4) are near enough to count, (n,): beyond, rounding alone exceeds the tolerance."""
    away = np.abs(targets[:, :3, 3]).max(axis=1, initial=0.0)
    return np.asarray(away <= HORIZON * plan.mechanism.characteristic_length)


def orthonormal(targets: Array) -> Array:
    """Targets (n, 4, 4) whose rotations are made orthonormal, their x axes first; the positions as they are."""
    poses = targets.copy()
    x = targets[:, :3, 0] / np.linalg.norm(targets[:, :3, 0], axis=1)[:, None]
    y = targets[:, :3, 1] - (x * targets[:, :3, 1]).sum(axis=1)[:, None] * x
    y /= np.linalg.norm(y, axis=1)[:, None]
    poses[:, :3, :3] = np.stack([x, y, np.cross(x, y)], axis=2)
    return poses


def start_of(plan: Legs, actuators: Array, poses: Array | None) -> tuple[Array, Ints]:
    """On which branch every leg is at a start (at home, without poses), (1 or n, legs), and on which completion."""
    if poses is None:
        return plan.home_sides[None], np.zeros(1, dtype=np.intp)
    n = max(len(poses), len(actuators))
    poses, actuators = (np.broadcast_to(array, (n, *array.shape[1:])) for array in (poses, actuators))
    completed = [plan.completion.pose(poses, solution) for solution in range(plan.completion.solutions)]
    apart = [np.abs(each - poses)[:, :3, :3].max(axis=(1, 2), initial=0.0) for each in completed]
    return nearest_sides(plan, orthonormal(poses), actuators), np.argmin(apart, axis=0)
