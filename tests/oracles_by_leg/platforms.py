"""The end effector's pose, where a target sets a part of it: the rest follows from the legs, in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pfabrik.description.graph import tree_of
from pfabrik.description.home_mobility import (
    body_twist,
    column_joints,
    joint_screws,
    loop_conditions,
    orthonormal_rates,
)
from pfabrik.description.mechanism import Mechanism, Vector
from pfabrik.tolerances import TOLERANCES

from .facts import Array, Unsuitable, is_parallel, require
from .legs import Leg
from .turns import aimed, either_angle, shortest_turn

AXES = ("x", "y", "z")
Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Completion:
    """How a target is made a pose.

    Attributes
    ----------
    solutions : how many poses a target has; the first is the one that home is on.
    pose : the poses (n, 4, 4) of one solution, from targets (n, 4, 4) whose rotations are orthonormal.
    """

    solutions: int
    pose: Callable[[Array, int], Array]


def completion_of(mechanism: Mechanism, legs: Sequence[Leg]) -> Completion:
    """How targets of a mechanism's task are completed; `Unsuitable` where no closed form for it is known.

    A task that sets everything leaves nothing to complete. Of three translations the rotation is home's, if at home the
    end effector cannot turn; of three rotations the position follows, if at home one of its points cannot move. What
    else is known is told by `_hinged`, `_mirrored` and `_guided`.
    """
    task = set(mechanism.task)
    if mechanism.end_effector_is_joint:
        require(task == set(AXES), "its task leaves out a part of where its tip is")
        return Completion(1, lambda targets, _: _posed(np.eye(3), targets[:, :3, 3]))
    if task == {*AXES, "rotation"}:
        return Completion(1, lambda targets, _: targets)
    if task == set(AXES):
        if not np.abs(_home_motions(mechanism)[:3]).max(initial=0.0) > TOLERANCES.alignment:
            return Completion(1, lambda targets, _: _posed(np.eye(3), targets[:, :3, 3]))
        return _guided(mechanism, legs, slides=True)
    if task == {"rotation"}:
        pivot = _still_point(mechanism)
        arm = mechanism.reference_point - pivot
        return Completion(1, lambda targets, _: _posed(targets[:, :3, :3], pivot + targets[:, :3, :3] @ arm))
    if task == {"tilt"}:
        return _guided(mechanism, legs, slides=False)
    if "tilt" in task and len(task) == 2:
        given = AXES.index((task - {"tilt"}).pop())
        mirror = _mirror(mechanism, legs)
        return _hinged(mechanism, legs, given) if mirror is None else _mirrored(mechanism, mirror, given)
    raise Unsuitable(f"what follows from {', '.join(mechanism.task)} has no closed form here")


def _posed(turns: Array, points: Array) -> Array:
    poses = np.zeros((len(points), 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = turns, points, 1.0
    return poses


def _home_motions(mechanism: Mechanism) -> Array:
    """The twists that the end effector has at home, one a column, (6, k): angular, then of the origin [L]."""
    screws = np.vstack([joint_screws(mechanism, joint) for joint in mechanism.joints])
    screws, owners = orthonormal_rates(mechanism) @ screws, column_joints(mechanism)
    tree = tree_of(mechanism)
    _, values, rows = np.linalg.svd(loop_conditions(tree.loops[:, owners], screws))
    free = rows[np.count_nonzero(values > TOLERANCES.alignment) :].T
    return np.asarray(body_twist(tree.paths[mechanism.end_effector_body][owners], screws) @ free)


def _still_point(mechanism: Mechanism) -> Array:
    """The point of the end effector that, at home, no motion of it moves, (3,) [length]."""
    twists = _home_motions(mechanism).T
    skew = np.concatenate([np.cross(np.eye(3), twist[:3]) for twist in twists]).reshape(-1, 3)
    velocity = twists[:, 3:].ravel()
    point = np.linalg.lstsq(skew.reshape(-1, 3), velocity, rcond=None)[0]
    moved = np.abs(skew @ point - velocity).max(initial=0.0)
    require(moved <= TOLERANCES.alignment, "no point of its end effector rests")
    return np.asarray(point * mechanism.characteristic_length)


def _guided(mechanism: Mechanism, legs: Sequence[Leg], slides: bool) -> Completion:
    """The end effector on a leg that guides it: on a universal joint, with a slide between the two or without one.

    Without, the task is the tilt, with one the position, on the line of the slide. The universal joint points z, or
    that line, as asked: two solutions (half a turn about either of its axes apart), home's first. Degenerate: pointed
    along its first axis, about which any angle is a solution; home's is taken. Source: Merlet.
    """
    guides = [leg.guide for leg in legs if leg.guide and leg.guide[0].joint.type == "universal"]
    guides = [guide for guide in guides if (len(guide) == 2) == slides]
    require(bool(guides), f"what follows from {', '.join(mechanism.task)} has no closed form here")
    joint = guides[0][0]
    centre = np.array(joint.joint.at)
    arm = mechanism.reference_point - centre
    line = Z
    if slides:
        axis = np.array(mechanism.home_axis(guides[0][1].joint.name))
        size = float(np.linalg.norm(arm))
        require(
            size > 0.0 and is_parallel(axis, arm / size, TOLERANCES.rotation),
            "its reference point is not on the line of its guide",
        )
        line = arm

    def pose(targets: Array, solution: int) -> Array:
        wanted = targets[:, :3, 3] - centre if slides else targets[:, :3, 2]
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
    found = [each for each in (_plane(mechanism, leg) for leg in legs) if each is not None]
    require(len(found) >= 3, "fewer than three of its legs stay in a plane")
    normals, heads = (np.array(each) for each in zip(*found[:3], strict=True))
    levels = (normals * heads).sum(axis=1)
    points = heads - mechanism.reference_point
    free = [place for place in range(3) if place != given]
    sum_up = np.cross(normals[:, free[0]], normals[:, free[1]])  # the combination without the coordinates
    require(float(np.linalg.norm(sum_up)) > TOLERANCES.alignment, "the planes of its legs leave it a translation")
    solve_free = np.linalg.pinv(normals[:, free])

    def pose(targets: Array, solution: int) -> Array:
        tilts = shortest_turn(Z, targets[:, :3, 2])
        turned = np.einsum("kj,nji->nki", normals, tilts)  # the normals as the tilted platform sees them
        cosines = (turned[..., :2] * points[:, :2]).sum(axis=-1)
        sines = turned[..., 1] * points[:, 0] - turned[..., 0] * points[:, 1]
        rest = levels - np.outer(targets[:, given, 3], normals[:, given]) - turned[..., 2] * points[:, 2]
        x, y, part = cosines @ sum_up, sines @ sum_up, rest @ sum_up
        torsion = either_angle(x, y, part, (np.hypot(x, y) - part) * (np.hypot(x, y) + part), side(solution))
        cosine, sine = np.cos(torsion), np.sin(torsion)
        position = targets[:, :3, 3].copy()
        position[:, free] = (rest - cosines * cosine[:, None] - sines * sine[:, None]) @ solve_free.T
        spin = np.zeros((len(targets), 3, 3))
        spin[:, 0, 0] = spin[:, 1, 1] = cosine
        spin[:, 0, 1], spin[:, 1, 0], spin[:, 2, 2] = -sine, sine, 1.0
        return _posed(tilts @ spin, position)

    at_home = (normals[:, 1] * points[:, 0] - normals[:, 0] * points[:, 1]) @ sum_up

    def side(solution: int) -> float:
        return float(np.copysign(1.0, at_home if solution else -at_home))

    return Completion(2, pose)


def _mirrored(mechanism: Mechanism, mirror: tuple[Array, float], given: int) -> Completion:
    """The end effector as the image of the base in a plane: one coordinate and the tilt are given.

    Cranks on the base and equal ones on the end effector meet in balls on that plane, at home and everywhere. The
    tilt gives the plane's normal, the coordinate its distance: one solution. Degenerate: where the plane is along the
    given coordinate no distance gives that, and the legs do not close; a tilt at which every plane through some line
    would do is answered by one of them. Source: Canfield.
    """
    normal, level = mirror
    image = _reflected(mechanism.reference_point, normal, level)
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
    found = [(leg.driver, leg.rods[0]) for leg in legs if leg.driver is not None and len(leg.rods) == 1]
    kinds = [(driver.joint.type, *(each.joint.type for each in rod.passages)) for driver, rod in found]
    if len(kinds) < 3 or len(kinds) < len(legs) or set(kinds) != {("revolute", "spherical", "revolute")}:
        return None
    balls = np.array([rod.foot for _, rod in found])
    normal = np.cross(balls[1] - balls[0], balls[2] - balls[0])
    if not np.linalg.norm(normal) > TOLERANCES.alignment * mechanism.characteristic_length**2:
        return None
    normal = normal / np.linalg.norm(normal)
    level, near = float(normal @ balls[0]), TOLERANCES.position * mechanism.characteristic_length
    for driver, rod in found:
        (axis,), (other,) = driver.axes, rod.outer[0].axes
        apart = _reflected(np.array(driver.joint.at), normal, level) - rod.head
        aligned = is_parallel(_reflected(axis, normal, 0.0), other, TOLERANCES.rotation)
        if not aligned or np.linalg.norm(np.cross(apart, other)) > near or abs(normal @ rod.foot - level) > near:
            return None
    return normal, level


def _reflected(point: Array | Vector, normal: Array, level: float) -> Array:
    return np.asarray(point - 2.0 * (np.dot(normal, point) - level) * normal)


def _plane(mechanism: Mechanism, leg: Leg) -> tuple[Array, Array] | None:
    """Normal of the plane in which a leg's hinge keeps the ball joint on the end effector, and that joint, at home."""
    if not leg.rods or len(leg.rods[0].inner) != 1 or not leg.rods[0].inner[0].is_hinge:
        return None
    rod, normal, driver = leg.rods[0], leg.rods[0].inner[0].axes[0], leg.driver
    if rod.outer[-1].joint.type != "spherical":
        return None
    square = TOLERANCES.position * float(np.linalg.norm(rod.line))
    if driver is None and abs(normal @ rod.line) > square:
        return None
    if driver is not None and driver.is_hinge and not is_parallel(driver.axes[0], normal, TOLERANCES.rotation):
        return None
    if driver is not None and not driver.is_hinge:
        axis = np.array(mechanism.home_axis(driver.joint.name))
        if abs(axis @ normal) > TOLERANCES.rotation:
            return None
    return normal, rod.head
