"""Legs in closed form: read from the graph, placed at a pose, and judged by what their joints make of it.

A leg is a driven crank or carriage with rods to the end effector, a strut, or a leg that guides the end effector and
drives nothing (U, S or U-P). Only the joints tell what a leg is: how `decompose` writes it does not matter. Its first
rod tells its branches; further rods (the other one of a parallelogram) are placed beside it and must close as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pfabrik import Joint, Mechanism
from pfabrik.decomposition.decompose import SubChain, decompose
from pfabrik.description.graph import cone_line, opposite
from pfabrik.description.joint_types import KINDS
from pfabrik.tolerances import TOLERANCES

from .rods import TIP, Passage, Rod, passage, place_rod, read_rod, require
from .turns import Array, Placed, angle_about, angle_of, at_home, either_angle, turns_about

Step = tuple[Joint, str, str]
GUIDES = (("universal",), ("spherical",), ("universal", "prismatic"))


@dataclass(frozen=True, eq=False)
class Leg:
    """One leg.

    Attributes
    ----------
    driver : the driven joint on the base; None where a strut is driven, or nothing.
    rods : those of the way from base (or driver) to end effector first; none of a leg that guides.
    guide : the joints of a leg that drives nothing, outward.
    """

    driver: Passage | None
    rods: tuple[Rod, ...]
    guide: tuple[Passage, ...]

    @property
    def passages(self) -> tuple[Passage, ...]:
        driver = () if self.driver is None else (self.driver,)
        return driver + self.guide + tuple(each for rod in self.rods for each in rod.passages)

    @property
    def actuated(self) -> Joint | None:
        return next((each.joint for each in self.passages if each.joint.actuated), None)

    @property
    def sides(self) -> tuple[float, ...]:
        """The branches of the leg."""
        return (1.0,) if self.driver is None else (1.0, -1.0)


# --- reading ---------------------------------------------------------------------------------------------------------


def read_legs(mechanism: Mechanism) -> tuple[Leg, ...]:
    """The legs of a mechanism, in the order of its sub-chains; `NoClosedForm` if one of them is none of these."""
    return tuple(_read_leg(mechanism, chain) for chain in decompose(mechanism))


def _read_leg(mechanism: Mechanism, chain: SubChain) -> Leg:
    steps = [_step(mechanism, mechanism.joint(name), chain) for name in dict.fromkeys(chain.joints)]
    end = TIP if mechanism.end_effector_is_joint else mechanism.end_effector
    main = _path(mechanism, steps, [mechanism.base], [end])
    driven = [joint.name for joint, *_ in steps if joint.actuated]
    require(len(driven) <= 1, f"{', '.join(driven)} drive one leg")
    if not driven:
        require(len(steps) == len(main) and tuple(each.joint.type for each in main) in GUIDES, f"{chain} is not driven")
        return Leg(None, (), tuple(main))
    driver = main[0] if main[0].joint.actuated and len(main) > 2 else None
    rods = [read_rod(mechanism, main if driver is None else main[1:]), *_further_rods(mechanism, steps, main)]
    require(driver is not None or len(rods[0].middle) > 0, f"{driven[0]} is neither on the base nor along a strut")
    return Leg(driver, tuple(rods), ())


def _step(mechanism: Mechanism, joint: Joint, chain: SubChain) -> Step:
    """A joint and the bodies it connects; of the joint that is the end effector, the tip instead of the other leg's."""
    first, second = joint.connects
    if mechanism.end_effector_is_joint and joint.name == mechanism.end_effector:
        own = {body for name in chain.joints if name != joint.name for body in mechanism.joint(name).connects}
        return (joint, TIP, second) if second in own else (joint, first, TIP)
    return joint, first, second


def _path(mechanism: Mechanism, steps: Sequence[Step], starts: Iterable[str], ends: Iterable[str]) -> list[Passage]:
    """The shortest path through some joints from any body of `starts` to one of `ends`, none if there is none."""
    ends, waiting = set(ends), [(start, list[Passage]()) for start in starts]
    passed = {start for start, _ in waiting}
    while waiting:
        body, path = waiting.pop(0)
        for joint, first, second in steps:
            if body not in (first, second) or any(each.joint is joint for each in path):
                continue
            beyond = second if body == first else first
            longer = [*path, passage(mechanism, joint, body, beyond, body == first)]
            if beyond in ends and (len(longer) > 1 or beyond not in passed):
                return longer
            if beyond not in passed:
                passed.add(beyond)
                waiting.append((beyond, longer))
    return []


def _further_rods(mechanism: Mechanism, steps: Sequence[Step], main: Sequence[Passage]) -> list[Rod]:
    """What is left of a leg beside its main path, as rods between bodies that are placed."""
    placed, rods = [main[0].inner, *(each.outer for each in main)], []
    left = [step for step in steps if all(step[0] is not each.joint for each in main)]
    while left:
        path = _path(mechanism, left, placed, placed)
        rods.append(read_rod(mechanism, path))
        placed += [each.outer for each in path[:-1]]
        left = [step for step in left if all(step[0] is not each.joint for each in path)]
    return rods


# --- placing ---------------------------------------------------------------------------------------------------------


def place_leg(mechanism: Mechanism, leg: Leg, poses: Array, side: Array | float) -> dict[str, Placed]:
    """Bodies of a leg on its branch `side`, its end effector at poses (n, 4, 4)."""
    placed = {mechanism.base: at_home(len(poses))}
    if mechanism.end_effector_is_joint:
        placed[TIP] = Placed(placed[mechanism.base].turn, poses[:, :3, 3] - mechanism.reference_point)
    else:
        turn = np.ascontiguousarray(poses[:, :3, :3])
        shift = poses[:, :3, 3] - turn @ np.array(mechanism.reference_point)
        placed[mechanism.end_effector] = Placed(turn, shift)
    end = placed[TIP if mechanism.end_effector_is_joint else mechanism.end_effector]
    if leg.driver is not None:
        solve = _solve_carriage if leg.driver.joint.type == "prismatic" else _solve_crank
        placed[leg.driver.outer] = solve(mechanism, leg, end.point(leg.rods[0].platform_end), side)
    for rod in leg.rods:
        place_rod(rod, placed)
    for each in leg.guide[:-1]:  # a slide does not turn
        centre = np.array(each.joint.at)
        placed[each.outer] = Placed(end.turn, centre - end.turn @ centre)
    return placed


def _solve_crank(mechanism: Mechanism, leg: Leg, platform_end: Array, side: Array | float) -> Placed:
    """The crank, turned so that its rod meets the platform end, (n, 3) [length].

    The circle of the rod's base end about the crank's axis meets the sphere about the platform end with the rod's
    length. Two solutions, to the left (`side` +1, seen against the axis) and to the right of the plane through axis and
    platform end. Degenerate: both are one where that plane holds crank and rod, and beyond this there is none: then the
    crank is turned as if there were; on the axis all angles are a solution, or none: home's is taken.
    Source: Merlet; Pierrot for the delta; Liu for plane legs.
    """
    driver, rod = leg.driver, leg.rods[0]
    axis, hub = driver.axes[0], np.array(driver.joint.at)
    centre = hub + axis * (axis @ (rod.base_end - hub))
    crank, length = float(np.linalg.norm(rod.base_end - centre)), float(np.linalg.norm(rod.line))
    require(
        crank > TOLERANCES.alignment * mechanism.characteristic_length, f"{driver.joint.name} does not move its rod"
    )
    x_axis = (rod.base_end - centre) / crank
    x, y, z = np.stack([x_axis, np.cross(axis, x_axis), axis]) @ (platform_end - centre).T
    out = np.hypot(x, y)
    near, far = np.hypot(out - crank, z), np.hypot(out + crank, z)
    part = crank * crank + out * out + z * z - length * length
    square = (far - length) * (far + length) * (length - near) * (length + near)
    turn = turns_about(axis, either_angle(x, y, part, square, side))
    return Placed(turn, hub - turn @ hub)


def _solve_carriage(mechanism: Mechanism, leg: Leg, platform_end: Array, side: Array | float) -> Placed:
    """The carriage, moved so that its rod meets the platform end, (n, 3) [length].

    The line of the rod's base end meets the sphere about the platform end with the rod's length. Two solutions, further
    along the rail than the platform end (`side` +1) and less far. Degenerate: both are one where the rod is square to
    the rail, and further away there is none: then the rod is square to the rail, and too short.
    Source: Merlet; Clavel for the linear delta; Orthoglide.
    """
    axis, rod = np.array(mechanism.home_axis(leg.driver.joint.name)), leg.rods[0]
    apart, length = platform_end - rod.base_end, float(np.linalg.norm(rod.line))
    level = apart @ axis
    across = np.linalg.norm(apart - level[:, None] * axis, axis=1)
    moved = level + side * np.sqrt(np.maximum((length - across) * (length + across), 0.0))
    return Placed(at_home(len(platform_end)).turn, moved[:, None] * axis)


# --- judging ---------------------------------------------------------------------------------------------------------


def judge(mechanism: Mechanism, leg: Leg, placed: dict[str, Placed]) -> tuple[Array, Array, Array]:
    """The actuator of a placed leg (n,), the gap of its joints (n,) [L or rad], and its margin (n,).

    The margin is the distance from the tightest limit: of a range in its width, of a cone in its half angle; positive
    within what counts as kept, infinite without limits.
    """
    n = len(placed[mechanism.base].shift)
    values, gap, margin = np.full(n, np.nan), np.zeros(n), np.full(n, np.inf)
    for each in leg.passages:
        moved, off = _measure(mechanism, each, placed)
        coordinates = _counted(mechanism, each.joint, moved)
        gap = np.maximum(gap, off)
        margin = np.minimum(margin, _range_margin(mechanism, each.joint, coordinates))
        if each.joint.cone is not None:
            margin = np.minimum(margin, _cone_margin(mechanism, leg, each.joint, placed))
        if each.joint.actuated:
            values = coordinates[:, 0]
    return values, gap, margin


def _measure(mechanism: Mechanism, each: Passage, placed: dict[str, Placed]) -> tuple[Array, Array]:
    """Coordinates less home's of a joint between placed bodies, (n, freedoms), and how far they miss it [L or rad].

    A ball joint has no coordinates here, and a joint that is the tip none either.
    """
    joint, inner, outer = each.joint, placed[each.inner], placed[each.outer]
    if joint.at is not None:
        point = np.array(joint.at)
    else:  # of a slide any would do
        point = np.array(mechanism.reference_point if joint.along is None else mechanism.joint(joint.along[0]).at)
    length = mechanism.characteristic_length
    if TIP in (each.inner, each.outer) or joint.type == "spherical":
        off = np.linalg.norm(outer.point(point) - inner.point(point), axis=1)
        return np.empty((len(off), 0)), off / length
    first, second = (inner, outer) if each.forward else (outer, inner)
    turn = np.swapaxes(first.turn, 1, 2) @ second.turn
    apart = np.einsum("nji,nj->ni", first.turn, second.point(point) - first.point(point))
    if joint.type == "prismatic":
        axis = np.array(mechanism.home_axis(joint.name))
        along = apart @ axis
        off = np.linalg.norm(apart - along[:, None] * axis, axis=1) / length
        return along[:, None], np.maximum(off, np.linalg.norm(turn - np.eye(3), axis=(1, 2)) / np.sqrt(2.0))
    gap = np.linalg.norm(apart, axis=1) / length
    if joint.type == "revolute":
        axis = np.array(joint.axis)
        return angle_of(turn, axis)[:, None], np.maximum(gap, np.linalg.norm(turn @ axis - axis, axis=1))
    axes = each.axes if each.forward else each.axes[::-1]
    angle = angle_about(axes[0], axes[1], turn @ axes[1])
    rest = np.swapaxes(turns_about(axes[0], angle), 1, 2) @ turn
    twist = np.linalg.norm(rest @ axes[1] - axes[1], axis=1)
    return np.stack([angle, angle_of(rest, axes[1])], axis=1), np.maximum(gap, twist)


def _counted(mechanism: Mechanism, joint: Joint, moved: Array) -> Array:
    """Coordinates as the joint counts them, angles of hinges by whole turns into their range where that is possible."""
    if not moved.shape[1]:
        return moved
    values = moved + np.ravel(mechanism.home_coordinate(joint.name))
    if joint.type != "revolute" or joint.range is None:
        return values
    low, high = np.ravel(joint.range) + (-TOLERANCES.limit, TOLERANCES.limit)
    least = values + 2.0 * np.pi * np.ceil((low - values) / (2.0 * np.pi))
    outside = (values < low) | (values > high)
    return np.where(outside & (least <= high), least, values)


def _range_margin(mechanism: Mechanism, joint: Joint, coordinates: Array) -> Array:
    if joint.range is None or not coordinates.shape[1]:
        return np.full(len(coordinates), np.inf)
    low, high = np.reshape(joint.range, (-1, 2)).T
    is_length = np.array([kind == "length" for kind in KINDS[joint.type].coordinates])
    slack = TOLERANCES.limit * np.where(is_length, mechanism.characteristic_length, 1.0)
    inside = np.minimum(coordinates - low, high - coordinates) + slack
    return np.asarray((inside / np.where(high > low, high - low, 1.0)).min(axis=1))


def _cone_margin(mechanism: Mechanism, leg: Leg, joint: Joint, placed: dict[str, Placed]) -> Array:
    """Of a cone whose line ends within its leg, on the base or on the end effector."""
    start, end = cone_line(mechanism, joint)
    ends_on = next((body for body in end.connects if body in placed), TIP)
    line = placed[ends_on].point(np.array(end.at)) - placed[opposite(joint)].point(np.array(start.at))
    axis = placed[joint.cone.fixed_to].turn @ np.array(joint.cone.axis)
    angle = np.arctan2(np.linalg.norm(np.cross(axis, line), axis=1), (axis * line).sum(axis=1))
    return np.asarray(1.0 + (TOLERANCES.limit - angle) / joint.cone.half_angle)
