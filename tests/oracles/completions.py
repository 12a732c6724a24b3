"""The end effector's pose, where a target sets a part of it: the rest follows from the legs, in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pfabrik import Mechanism
from pfabrik.tolerances import TOLERANCES

from .legs import Leg
from .rods import NoClosedForm, require
from .turns import Array, aimed, either_angle, is_parallel, shortest_turn

AXES = ("x", "y", "z")
Z = np.array([0.0, 0.0, 1.0])


class Completion(NamedTuple):
    """How a target is made a pose.

    Attributes
    ----------
    solutions : how many poses a target has; the first is the one that home is on.
    pose : the poses (n, 4, 4) of one solution, from targets (n, 4, 4).
    """

    solutions: int
    pose: Callable[[Array, int], Array]


def completion_of(mechanism: Mechanism, legs: Sequence[Leg]) -> Completion:
    """How targets of a mechanism's task are completed; `NoClosedForm` where none is known.

    A task that sets everything leaves nothing to complete. Of three translations the rotation is home's, unless a leg
    guides it; of three rotations the position follows, if all hinges meet in a point.
    """
    task = set(mechanism.task)
    if mechanism.end_effector_is_joint:
        return Completion(1, lambda targets, _: _posed(np.eye(3), targets[:, :3, 3]))
    if task == {*AXES, "rotation"}:
        return Completion(1, lambda targets, _: targets)
    if task == {*AXES}:
        guided = _guided(mechanism, legs, slides=True)
        return guided or Completion(1, lambda targets, _: _posed(np.eye(3), targets[:, :3, 3]))
    if task == {"rotation"}:
        pivot = _meeting_point(mechanism)
        arm = mechanism.reference_point - pivot
        return Completion(1, lambda targets, _: _posed(targets[:, :3, :3], pivot + targets[:, :3, :3] @ arm))
    if task == {"tilt"}:
        guided = _guided(mechanism, legs, slides=False)
        if guided is not None:
            return guided
    if "tilt" in task and len(task) == 2:
        given = AXES.index((task - {"tilt"}).pop())
        return _mirrored(mechanism, legs, given) or _hinged(mechanism, legs, given)
    raise NoClosedForm(f"what follows from {', '.join(mechanism.task)} has no closed form here")


def _posed(turns: Array, points: Array) -> Array:
    poses = np.zeros((len(points), 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = turns, points, 1.0
    return poses


def _meeting_point(mechanism: Mechanism) -> Array:
    """Where the axes of all hinges meet, (3,) [length]."""
    across = [np.eye(3) - np.outer(joint.axis, joint.axis) for joint in mechanism.joints]
    offsets = np.concatenate([P @ joint.at for P, joint in zip(across, mechanism.joints, strict=True)])
    point = np.linalg.lstsq(np.concatenate(across), offsets, rcond=None)[0]
    off = np.abs(np.concatenate(across) @ point - offsets).max()
    require(off <= TOLERANCES.position * mechanism.characteristic_length, "its hinges do not meet")
    return np.asarray(point)


def _guided(mechanism: Mechanism, legs: Sequence[Leg], slides: bool) -> Completion | None:
    """The end effector on a leg that guides it: on a universal joint, with a slide between the two or without one.

    Without, the task is the tilt, with one the position, on the line of the slide. The universal joint points z, or
    that line, as asked: two solutions (half a turn about either of its axes apart), home's first. Degenerate: pointed
    along its first axis, about which any angle is a solution; home's is taken. Source: Merlet.
    """
    guides = [leg.guide for leg in legs if leg.guide and leg.guide[0].joint.type == "universal"]
    guides = [guide for guide in guides if (len(guide) == 2) == slides]
    if not guides:
        return None
    joint, centre = guides[0][0], np.array(guides[0][0].joint.at)
    arm = mechanism.reference_point - centre

    def pose(targets: Array, solution: int) -> Array:
        line, wanted = (arm, targets[:, :3, 3] - centre) if slides else (Z, targets[:, :3, 2])
        base = np.tile(np.eye(3), (len(targets), 1, 1))
        turns = aimed(joint.axes, base, line, wanted, other=bool(solution))[-1]
        return _posed(turns, targets[:, :3, 3] if slides else centre + turns @ arm)

    return Completion(2, pose)


def _hinged(mechanism: Mechanism, legs: Sequence[Leg], given: int) -> Completion:
    """The end effector on three legs that hinges keep in a plane each: one coordinate and the tilt are given.

    Its three joints stay in these planes, which is three equations that are linear in the two coordinates and in sine
    and cosine of the torsion about the platform's own z axis. Without the coordinates one is left, which has two
    solutions, home's first; where it has none the nearest torsion is taken, and the legs do not close. Degenerate: all
    torsions are solutions; home's is taken. Source: Lee-Shah for the 3-RPS, Carretero for the 3-PRS.
    """
    hinges = [leg.rods[0].inner[0] for leg in legs if leg.rods and leg.rods[0].inner[0].is_hinge]
    require(len(hinges) == len(legs) == 3, "its legs do not stay in planes")
    normals, heads = np.array([hinge.axes[0] for hinge in hinges]), np.array([leg.rods[0].platform_end for leg in legs])
    levels, points = (normals * heads).sum(axis=1), heads - mechanism.reference_point
    free = [place for place in range(3) if place != given]
    sum_up = np.cross(normals[:, free[0]], normals[:, free[1]])  # the combination without the coordinates
    solve_free = np.linalg.pinv(normals[:, free])
    at_home = (normals[:, 1] * points[:, 0] - normals[:, 0] * points[:, 1]) @ sum_up

    def pose(targets: Array, solution: int) -> Array:
        tilts = shortest_turn(Z, targets[:, :3, 2])
        turned = np.einsum("kj,nji->nki", normals, tilts)  # the normals as the tilted platform sees them
        cosines = (turned[..., :2] * points[:, :2]).sum(axis=-1)
        sines = turned[..., 1] * points[:, 0] - turned[..., 0] * points[:, 1]
        rest = levels - np.outer(targets[:, given, 3], normals[:, given]) - turned[..., 2] * points[:, 2]
        x, y, part = cosines @ sum_up, sines @ sum_up, rest @ sum_up
        side = np.copysign(1.0, at_home if solution else -at_home)
        torsion = either_angle(x, y, part, (np.hypot(x, y) - part) * (np.hypot(x, y) + part), side)
        cosine, sine = np.cos(torsion), np.sin(torsion)
        position = targets[:, :3, 3].copy()
        position[:, free] = (rest - cosines * cosine[:, None] - sines * sine[:, None]) @ solve_free.T
        spin = np.zeros((len(targets), 3, 3))
        spin[:, 0, 0] = spin[:, 1, 1] = cosine
        spin[:, 0, 1], spin[:, 1, 0], spin[:, 2, 2] = -sine, sine, 1.0
        return _posed(tilts @ spin, position)

    return Completion(2, pose)


def _mirrored(mechanism: Mechanism, legs: Sequence[Leg], given: int) -> Completion | None:
    """The end effector as the image of the base in a plane: one coordinate and the tilt are given.

    Cranks on the base and equal ones on the end effector meet in balls on that plane, at home and everywhere. The
    tilt gives the plane's normal, the coordinate its distance: one solution. Degenerate: where the plane is along the
    given coordinate no distance gives that, and the legs do not close; a tilt at which every plane through some line
    would do is answered by one of them. Source: Canfield.
    """
    mirror = _mirror(mechanism, legs)
    if mirror is None:
        return None
    normal, level = mirror
    image = _reflected(np.array(mechanism.reference_point), normal, level)
    turned = np.eye(3) - 2.0 * np.outer(normal, normal)
    up = turned @ Z
    across = np.cross(up, np.eye(3)[np.abs(up).argmin()])

    def pose(targets: Array, _: int) -> Array:
        lines = up - targets[:, :3, 2]
        lines = np.where(np.linalg.norm(lines, axis=1)[:, None] > TOLERANCES.rank, lines, across)
        lines /= np.linalg.norm(lines, axis=1)[:, None]
        share = np.copysign(np.maximum(np.abs(lines[:, given]), TOLERANCES.rank), lines[:, given])
        step = (targets[:, given, 3] - image[given]) / share
        turns = (np.eye(3) - 2.0 * lines[:, :, None] * lines[:, None, :]) @ turned
        return _posed(turns, image + step[:, None] * lines)

    return Completion(1, pose)


def _mirror(mechanism: Mechanism, legs: Sequence[Leg]) -> tuple[Array, float] | None:
    """The plane, at home, in which legs R*-S-R are mirrored: its unit normal, and its distance from the origin."""
    kinds = [tuple(each.joint.type for each in leg.passages) for leg in legs]
    if len(legs) < 3 or set(kinds) != {("revolute", "spherical", "revolute")}:
        return None
    balls = np.array([leg.rods[0].base_end for leg in legs])
    normal = np.cross(balls[1] - balls[0], balls[2] - balls[0])
    normal = normal / np.linalg.norm(normal)
    level, near = float(normal @ balls[0]), TOLERANCES.position * mechanism.characteristic_length
    for leg in legs:
        (axis,), (other,) = leg.driver.axes, leg.rods[0].outer[0].axes
        apart = _reflected(np.array(leg.driver.joint.at), normal, level) - leg.rods[0].platform_end
        aligned = is_parallel(_reflected(axis, normal, 0.0), other, TOLERANCES.rotation)
        if not aligned or np.linalg.norm(np.cross(apart, other)) > near:
            return None
    return normal, level


def _reflected(point: Array, normal: Array, level: float) -> Array:
    return np.asarray(point - 2.0 * (normal @ point - level) * normal)
