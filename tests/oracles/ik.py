"""Inverse kinematics leg by leg in closed form: cranks and carriages with rods, and struts, on all their branches.

Hinges at the ends of rods are read where all of them stand square to one plane; universal and ball joints elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pfabrik import Joint, Mechanism
from pfabrik.machine.poses import as_poses
from pfabrik.tolerances import TOLERANCES

from .turns import Array, angle_about, angle_of, either_angle, turns_about, unit


class NoClosedForm(Exception):
    """A mechanism with legs or a task that are not covered here; the text says why."""


def require(fact: bool, otherwise: str) -> None:
    if not fact:
        raise NoClosedForm(otherwise)


class Rod(NamedTuple):
    """A rod, or a strut with a slide, between two joints; `bodies` are those of the rod itself."""

    foot: Joint
    head: Joint
    slide: Joint | None
    bodies: tuple[str, ...]


class Leg(NamedTuple):
    """A driven crank or carriage on the base with its rods; or a strut, which has no driver."""

    driver: Joint | None
    carrier: str
    rods: tuple[Rod, ...]

    @property
    def actuated(self) -> Joint:
        return self.driver or self.rods[0].slide

    @property
    def sides(self) -> tuple[float, ...]:
        return (1.0,) if self.driver is None else (1.0, -1.0)


class Plan(NamedTuple):
    """A mechanism as its legs; `normal` is that of the plane in which hinges keep rods, zero without."""

    mechanism: Mechanism
    legs: tuple[Leg, ...]
    normal: Array
    home_sides: tuple[float, ...]


# --- reading ---------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=64)
def plan_of(mechanism: Mechanism) -> Plan:
    """The legs of a mechanism; `NoClosedForm` where it has others."""
    whole = {"x", "y", "z", "rotation"}
    require(mechanism.end_effector_is_joint or set(mechanism.task) in (whole, whole - {"rotation"}), "a partial task")
    end = mechanism.end_effector
    if mechanism.end_effector_is_joint:
        tip = mechanism.joint(end)
        require(tip.range is None, "a range of the tip")
        heads = [(tip, body) for body in tip.connects]
    else:
        heads = [(joint, _beyond(joint, end)) for joint in mechanism.joints if end in joint.connects]
    rods: dict[str, list[Rod]] = {}
    drivers: dict[str, tuple[Joint | None, str]] = {}
    for head, body in heads:
        rod, driver, carrier = _read_rod(mechanism, head, body)
        key = (driver or rod.slide).name
        drivers[key] = driver, carrier
        rods.setdefault(key, []).append(rod)
    legs = tuple(Leg(*drivers[key], tuple(rods[key])) for key in rods)
    read = {joint.name for leg in legs for joint in (leg.actuated, *(j for r in leg.rods for j in (r.foot, r.head)))}
    require(read == {joint.name for joint in mechanism.joints}, "joints in no leg")
    plan = Plan(mechanism, legs, _normal(mechanism, legs), ())
    sides = []
    for leg in legs:
        values = [evaluate(plan, leg, mechanism.home_pose[None], side)[0][0] for side in leg.sides]
        off = [abs(_turned_back(leg, value - float(leg.actuated.home))) for value in values]
        sides.append(leg.sides[int(np.argmin(off))] if leg.driver else 1.0)
    return plan._replace(home_sides=tuple(sides))


def _read_rod(mechanism: Mechanism, head: Joint, body: str) -> tuple[Rod, Joint | None, str]:
    """The rod behind a joint of the end effector, what drives it on the base, and the body on which it stands."""
    foot, bodies, slide = _only(mechanism, body, head), (body,), None
    if foot.along is not None:
        slide, body = foot, _beyond(foot, body)
        foot, bodies = _only(mechanism, body, slide), (*bodies, body)
    carrier = _beyond(foot, body)
    for joint in (foot, head):
        require(joint.type in ("revolute", "universal", "spherical"), f"{joint.name} does not end a rod")
        require(joint.type == "revolute" or joint.range is None, f"a range of {joint.name}")
        fixed_to = carrier if joint is foot else mechanism.end_effector
        require(joint.cone is None or joint.cone.fixed_to == fixed_to, f"a cone of {joint.name} on the rod")
    require((foot.type, head.type) != ("universal", "universal"), "a rod that does not spin")
    rod = Rod(foot, head, slide, bodies)
    if carrier == mechanism.base:
        require(slide is not None and slide.actuated, "a strut that is not driven")
        return rod, None, carrier
    drivers = [joint for joint in mechanism.joints if set(joint.connects) == {mechanism.base, carrier}]
    require(len(drivers) == 1 and drivers[0].actuated and slide is None, f"{carrier} is not driven on the base")
    require(drivers[0].type in ("revolute", "prismatic"), "a driver that is no crank and no carriage")
    return rod, drivers[0], carrier


def _beyond(joint: Joint, body: str) -> str:
    return joint.connects[0] if joint.connects[1] == body else joint.connects[1]


def _only(mechanism: Mechanism, body: str, but: Joint) -> Joint:
    others = [joint for joint in mechanism.joints if body in joint.connects and joint is not but]
    require(len(others) == 1, f"{body} has branches")
    return others[0]


def _normal(mechanism: Mechanism, legs: tuple[Leg, ...]) -> Array:
    ends = [joint for leg in legs for rod in leg.rods for joint in (rod.foot, rod.head)]
    if all(joint.type != "revolute" for joint in ends):
        return np.zeros(3)
    require(all(joint.type == "revolute" for joint in mechanism.joints if joint.type != "prismatic"), "mixed hinges")
    axes = np.array([unit(joint.axis) for joint in mechanism.joints if joint.type == "revolute"])
    require(bool(np.abs(np.abs(axes @ axes[0]) - 1.0).max() < 1e-12), "hinges that are not parallel")
    return np.asarray(axes[0])


# --- solving and judging ---------------------------------------------------------------------------------------------


def evaluate(plan: Plan, leg: Leg, poses: Array, side: float) -> tuple[Array, Array, Array]:
    """Actuators (n,), gaps (n,) [L or rad] and margins (n,) of a leg on one branch, its end effector at poses.

    A margin is the distance from the tightest limit, of a range in its width, of a cone in its half angle: positive
    within what counts as kept, infinite without limits.
    """
    mechanism, n, normal = plan.mechanism, len(poses), plan.normal
    turns = np.tile(np.eye(3), (n, 1, 1)) if mechanism.end_effector_is_joint else poses[:, :3, :3]
    heads = [turns @ np.subtract(rod.head.at, mechanism.reference_point) + poses[:, :3, 3] for rod in leg.rods]
    values, carried, moved = _drive(leg, heads[0], side)
    gap, margin, length = np.zeros(n), np.full(n, np.inf), mechanism.characteristic_length
    for rod, head in zip(leg.rods, heads, strict=True):
        line, home_line = head - moved(np.array(rod.foot.at)), np.subtract(rod.head.at, rod.foot.at)
        size = np.linalg.norm(line, axis=1)
        if rod.slide is not None:
            values, margin = size, np.minimum(margin, _range_margin(mechanism, rod.slide, size))
        else:
            gap = np.maximum(gap, np.abs(size - np.linalg.norm(home_line)) / length)
        for joint, frame, way in ((rod.foot, carried, line), (rod.head, turns, -line)):
            if joint.cone is not None:
                axis = frame @ np.array(joint.cone.axis)
                angle = np.arctan2(np.linalg.norm(np.cross(axis, way), axis=1), (axis * way).sum(axis=1))
                margin = np.minimum(margin, 1.0 + (TOLERANCES.limit - angle) / joint.cone.half_angle)
        if normal.any():
            gap = np.maximum(gap, np.abs((head - rod.head.at) @ normal) / length)
            gap = np.maximum(gap, np.linalg.norm(turns @ normal - normal, axis=1))
            about = dict.fromkeys(rod.bodies, angle_about(normal, home_line, line))
            about |= {leg.carrier: angle_of(carried, normal), mechanism.end_effector: angle_of(turns, normal)}
            for joint in {rod.foot, rod.head} - {mechanism.joint(name) for name in _tip(mechanism)}:
                first, second = joint.connects
                bend = np.sign(np.dot(joint.axis, normal)) * (about[second] - about[first])
                margin = np.minimum(margin, _range_margin(mechanism, joint, _counted(joint, bend + joint.home)))
    if leg.driver is not None:
        values = _counted(leg.driver, values)
        margin = np.minimum(margin, _range_margin(mechanism, leg.driver, values))
    return values, gap, margin


def _tip(mechanism: Mechanism) -> tuple[str, ...]:
    return (mechanism.end_effector,) if mechanism.end_effector_is_joint else ()


def _drive(leg: Leg, head: Array, side: float) -> tuple[Array, Array, Any]:
    """The driver's values with its first rod at heads (n, 3), its rotations, and how it moves points.

    A crank's circle, or a carriage's line, meets the sphere about the head with the rod's length: two solutions, which
    are one where the rod is in a plane with the crank and its axis, or square to the rail. Beyond, there is none: the
    nearest is taken, and the rod does not fit. Sources: Merlet; Pierrot for the delta; Clavel for the linear one.
    """
    level = np.tile(np.eye(3), (len(head), 1, 1))
    if leg.driver is None:
        return np.zeros(len(head)), level, lambda point: point
    driver, rod = leg.driver, leg.rods[0]
    axis, foot = unit(driver.axis), np.array(rod.foot.at)
    size = float(np.linalg.norm(np.subtract(rod.head.at, foot)))
    sense = 1.0 if driver.connects[1] == leg.carrier else -1.0
    if driver.type == "prismatic":
        along = (head - foot) @ axis
        across = np.linalg.norm(head - foot - along[:, None] * axis, axis=1)
        moved = along + side * np.sqrt(np.maximum((size - across) * (size + across), 0.0))
        return driver.home + sense * moved, level, lambda point: point + moved[:, None] * axis
    hub = np.array(driver.at)
    centre = hub + axis * (axis @ (foot - hub))
    crank = float(np.linalg.norm(foot - centre))
    require(crank > 0.0, f"{driver.name} does not move its rod")
    x_axis = (foot - centre) / crank
    x, y, z = np.stack([x_axis, np.cross(axis, x_axis), axis]) @ (head - centre).T
    out = np.hypot(x, y)
    near, far = np.hypot(out - crank, z), np.hypot(out + crank, z)
    part = crank * crank + out * out + z * z - size * size
    square = (far - size) * (far + size) * (size - near) * (size + near)
    angle = either_angle(x, y, part, square, side)
    turn = turns_about(axis, angle)
    return driver.home + sense * angle, turn, lambda point: hub + turn @ (point - hub)


def _counted(joint: Joint, values: Array) -> Array:
    """Angles as their hinge counts them: by whole turns into its range where that is possible."""
    if joint.type != "revolute" or joint.range is None:
        return values
    low, high = np.array(joint.range) + (-TOLERANCES.limit, TOLERANCES.limit)
    least = values + 2.0 * np.pi * np.ceil((low - values) / (2.0 * np.pi))
    return np.where(((values < low) | (values > high)) & (least <= high), least, values)


def _range_margin(mechanism: Mechanism, joint: Joint, values: Array) -> Array:
    if joint.range is None:
        return np.full(len(values), np.inf)
    low, high = joint.range
    slack = TOLERANCES.limit * (mechanism.characteristic_length if joint.type == "prismatic" else 1.0)
    return np.asarray((np.minimum(values - low, high - values) + slack) / (high - low if high > low else 1.0))


def _turned_back(leg: Leg, difference: float) -> float:
    """Difference of a leg's actuator, whole turns aside."""
    if leg.actuated.type != "revolute":
        return difference
    return float(np.remainder(difference + np.pi, 2.0 * np.pi) - np.pi)


# --- answers ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Answer:
    """Answers of the closed form, with the batch axes of the targets.

    Attributes
    ----------
    margin : see `evaluate`, (...,); where a leg does not close, its gap, negative [L or rad].
    actuators : (..., n_a) [length or rad]: each leg's in home's branch where that keeps its limits, else in the better
        one, whether or not that does; NaN where a leg does not close.
    pose : T_base_platform (..., 4, 4) [length].
    """

    margin: Array
    actuators: Array
    pose: Array

    @property
    def reached(self) -> NDArray[np.bool_]:
        return np.asarray(self.margin >= 0.0)


def solve_ik(mechanism: Mechanism, target: Any) -> Answer:
    """Actuators that put the end effector on targets (..., 4, 4) or (..., 3), leg by leg."""
    plan, (targets, shape) = plan_of(mechanism), as_poses(target)
    poses, n = _posed(mechanism, targets), len(targets)
    margin, actuators = np.full(n, np.inf), np.full((n, len(mechanism.actuator_names)), np.nan)
    for leg, home in zip(plan.legs, plan.home_sides, strict=True):
        own, values = np.full(n, -np.inf), np.full(n, np.nan)
        for side in (home, -home)[: len(leg.sides)]:
            tried, gap, room = evaluate(plan, leg, poses, side)
            is_closed = gap <= TOLERANCES.position
            room = np.where(is_closed, room, -gap)
            better = (own < 0.0) & (room > own)
            own, values = np.where(better, room, own), np.where(better, np.where(is_closed, tried, np.nan), values)
        margin = np.minimum(margin, own)
        actuators[:, mechanism.actuator_names.index(leg.actuated.name)] = values
    return Answer(margin.reshape(shape), actuators.reshape(*shape, -1), poses.reshape(*shape, 4, 4))


def _posed(mechanism: Mechanism, targets: Array) -> Array:
    """Targets with the rotation that is home's where the task sets none; made orthonormal, their x axes first."""
    poses = targets.copy()
    if "rotation" not in mechanism.task:
        poses[:, :3, :3] = np.eye(3)
        return poses
    x = targets[:, :3, 0] / np.linalg.norm(targets[:, :3, 0], axis=1)[:, None]
    y = targets[:, :3, 1] - (x * targets[:, :3, 1]).sum(axis=1)[:, None] * x
    y /= np.linalg.norm(y, axis=1)[:, None]
    poses[:, :3, :3] = np.stack([x, y, np.cross(x, y)], axis=2)
    return poses


class WorkingModes(NamedTuple):
    """Every choice of branches for one target, whether or not limits are kept; home's first.

    Attributes
    ----------
    actuators : (k, n_a) [length or rad], in the order of `mechanism.actuator_names`.
    margins : see `evaluate`, (k,).
    """

    actuators: Array
    margins: Array


def working_modes(mechanism: Mechanism, target: Any) -> WorkingModes:
    """All working modes in which a mechanism reaches one target; branches that coincide count once."""
    plan = plan_of(mechanism)
    pose = _posed(mechanism, as_poses(target)[0])
    branches = [list(_branches(plan, index, pose)) for index in range(len(plan.legs))]
    modes = sorted(product(*branches), key=lambda mode: sum(branch[0] for branch in mode))
    order = [mechanism.actuator_names.index(leg.actuated.name) for leg in plan.legs]
    actuators = np.zeros((len(modes), len(order)))
    actuators[:, order] = np.array([[value for _, value, _ in mode] for mode in modes]).reshape(len(modes), len(order))
    return WorkingModes(actuators, np.array([min(margin for *_, margin in mode) for mode in modes]))


def _branches(plan: Plan, index: int, pose: Array) -> Iterator[tuple[int, float, float]]:
    """Number, actuator and margin of the branches on which one leg closes."""
    leg, home, found = plan.legs[index], plan.home_sides[index], list[float]()
    unit_of = 1.0 if leg.actuated.type == "revolute" else plan.mechanism.characteristic_length
    for number, side in enumerate((home, -home)[: len(leg.sides)]):
        (value,), (gap,), (margin,) = evaluate(plan, leg, pose, side)
        is_new = all(abs(_turned_back(leg, value - each)) / unit_of > TOLERANCES.same_mode for each in found)
        if gap <= TOLERANCES.position and is_new:
            found.append(value)
            yield number, value, margin
