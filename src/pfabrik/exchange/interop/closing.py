"""The closed home of an open machine: its joints moved until all loops meet, within their ranges.

The solver of `closure` begins with loops that are closed at home. So between the two sides of a loop that is open, a
slide and a hinge of no other use bridge the gap; locked where this is gone, they leave the loop to the joints.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from ...common.arrays import Floats, Mask
from ...common.rotations import shortest_turns, to_rotvec
from ...kinematics import column_joints, columns, displacements, home_coordinates, tree_of
from ...machine.description.joints import Joint, JointType
from ...machine.description.mechanism import Mechanism
from ...machine.description.structure import Structure
from ...machine.motion.displacements import screws
from ...machine.motion.loops import Closure, closure_of
from ...tolerances import TOLERANCES
from .opened import Loop, OpenMechanism

CLOSED = 1e-13
"""Gap that counts as none [L and rad]: rounding."""

BRIDGE = "bridge of loop"
"""What bodies and joints in the gap of a loop are called."""


class Linear(NamedTuple):
    """Values (m,) and their slopes (m, c)."""

    values: Floats
    slopes: Floats


class OpenLoops:
    """The loops of an open machine, and how far they are open at given coordinates.

    Attributes
    ----------
    tree : the joints alone.
    low, high : bounds of the tree's coordinates as deviations from home, (c,) [rad or length]; infinite without any.
    length : the radius around all joints and loops [length], the L of gaps here.
    """

    def __init__(self, opened: OpenMechanism) -> None:
        self.loops = opened.loops
        self.tree: Structure = opened.tree()
        limits = np.reshape([each.limits for each in self.tree.coordinates], (-1, 2)).T
        self.low, self.high = limits - home_coordinates(self.tree)
        points = [joint.at for joint in opened.joints if joint.at is not None]
        self.length = radius_around([*points, *(point for loop in opened.loops for point in loop.at)])

    @cached_property
    def middles(self) -> Mapping[str, Floats]:
        """Body -> the middle of its joints and loops, (3,) [length]; bodies between slides have none."""
        points: dict[str, list[Floats]] = defaultdict(list)
        for joint in self.tree.joints:
            for body in joint.connects if joint.at is not None else ():
                points[body].append(np.array(joint.at))
        for loop in self.loops:
            for body, point in zip(loop.connects, loop.at, strict=True):
                points[body].append(point)
        points.pop(self.tree.base, None)
        return {body: np.mean(own, axis=0) for body, own in points.items()}

    def distances(self, q: Floats) -> Floats:
        """How far the bodies are from where they are drawn, at coordinates (n, c): (n,) [L].

        sqrt(mean over bodies of (shift / L)^2 + (2 sin(turn / 2))^2), with the shift of the middle of a body's joints.
        """
        moved, squares = displacements(self.tree, q), np.zeros(len(q))
        for body, middle in self.middles.items():
            turn = moved[body][:, :3, :3]
            shifts = turn @ middle + moved[body][:, :3, 3] - middle
            squares += (shifts**2).sum(axis=1) / self.length**2 + 3.0 - np.trace(turn, axis1=1, axis2=2)
        return np.asarray(np.sqrt(np.maximum(squares, 0.0) / max(len(self.middles), 1)))

    def linearised(self, q: Floats) -> tuple[Linear, Linear]:
        """The loops' errors, and the bodies' shifts and turns that `distances` sums up, near coordinates (c,).

        Slopes are by the rates of `screws`; those of errors hold where these are small.
        """
        present, moved, unit = screws(self.tree, q[None])[0], displacements(self.tree, q[None]), self.length
        scale = self.tree.characteristic_length / unit
        signs = {body: path[column_joints(self.tree)] for body, path in tree_of(self.tree).paths.items()}

        def rates(body: str, point: Floats) -> tuple[Floats, Floats]:
            """Angular velocities and velocities of a point (3,) on a body, (3, c) each."""
            own = (present * signs[body][:, None]).T
            return own[:3], scale * own[3:] + _crossing(point / unit) @ own[:3]

        errors: list[Floats] = []
        gaps: list[Floats] = []
        for loop in self.loops:
            points, frames = _sides(loop, moved)
            turns, shifts = zip(*(rates(*each) for each in zip(loop.connects, points, strict=True)), strict=True)
            across = {"spherical": np.zeros((0, 3)), "revolute": frames[0][:, :2].T}.get(loop.type, np.eye(3))
            errors += [shifts[0] - shifts[1], across @ (turns[0] - turns[1])]
            gaps += [(points[0] - points[1]) / unit, across @ _turn(loop, frames)]
        values, slopes = [], []
        for body, middle in self.middles.items():
            turn = moved[body][0, :3, :3]
            point = turn @ middle + moved[body][0, :3, 3]
            omegas, velocities = rates(body, point)
            values += [(point - middle) / unit, (turn - np.eye(3)).ravel() * np.sqrt(0.5)]
            turning = np.stack([_crossing(axis) @ omegas for axis in turn.T], axis=1)
            slopes += [velocities, turning.reshape(9, -1) * np.sqrt(0.5)]
        linear = Linear(np.concatenate(values), np.concatenate(slopes))
        return Linear(np.concatenate(gaps), np.concatenate(errors)), linear

    @cached_property
    def columns_of_loops(self) -> Mask:
        """Coordinates (n, c) that mirror images turn about: all, and those around each loop, or around no other."""
        paths = tree_of(self.tree).paths
        around = [np.not_equal(*(paths[body] for body in loop.connects)) for loop in self.loops]
        alone = [each & (np.sum(around, axis=0) == 1) for each in around]
        columns = np.array([np.ones(len(self.tree.joints), bool), *around, *alone])[:, column_joints(self.tree)]
        return np.unique(columns, axis=0)

    @cached_property
    def bridged(self) -> tuple[Closure, dict[int, float]]:
        """The machine with bridges in its open loops, compiled, and column -> the coordinate that closes each."""
        joints, values = list(self.tree.joints), {}
        openings = self.openings(np.zeros_like(self.low))
        for number, (loop, (gap, turn)) in enumerate(zip(self.loops, openings, strict=True)):
            first, second = loop.connects
            at = loop.at[1]
            for kind, vector in (("prismatic", gap * self.length), ("revolute", turn)):
                size = float(np.linalg.norm(vector))
                if size > 0.0:
                    name = f"{BRIDGE} {number} {kind}"
                    point = None if kind == "prismatic" else at
                    joints.append(Joint(name, cast(JointType, kind), (first, name), point, vector / size))
                    values[name], first = size, name
            axis = loop.turned[1][:, 2] if loop.type == "revolute" else None
            joints.append(Joint(f"{BRIDGE} {number}", loop.type, (first, second), at, axis))
        body = next(body for body in self.loops[0].connects if body != self.tree.base)
        bridged = replace(self.tree, joints=tuple(joints), end_effector=body)
        closure = closure_of(cast(Mechanism, bridged), whole=True)
        return closure, {columns(bridged)[name].start: value for name, value in values.items()}

    def openings(self, q: Floats) -> list[tuple[Floats, Floats]]:
        """For every loop, at coordinates (c,): distance (3,) [L], and angle (3,) [rad] between its two sides."""
        bodies = displacements(self.tree, q[None])
        sides = [(loop, *_sides(loop, bodies)) for loop in self.loops]
        return [((points[0] - points[1]) / self.length, _turn(loop, frames)) for loop, points, frames in sides]

    def gap(self, q: Floats) -> float:
        """The largest distance [L] or angle [rad]."""
        sizes = [np.linalg.norm(part) for opening in self.openings(q) for part in opening]
        return float(max(sizes, default=0.0))

    def meetings(self, q: Floats) -> list[tuple[Floats, Floats]]:
        """For every loop, at coordinates (c,): the point (3,) [length] midway between its sides, a frame (3, 3)."""
        bodies = displacements(self.tree, q[None])
        return [(point.mean(axis=0), frames[0]) for point, frames in (_sides(loop, bodies) for loop in self.loops)]

    def is_along_pin(self, loop: Loop, q: Floats, gap: Floats) -> bool:
        """True if the hinges around a loop are all parallel, nothing else moves it, and its gap (3,) is along them."""
        one, other = (tree_of(self.tree).paths[body][column_joints(self.tree)] for body in loop.connects)
        turns = screws(self.tree, q[None])[0][one != other][:, :3]
        off = np.linalg.norm(np.cross(turns, gap), axis=1) > TOLERANCES.file_angle * np.linalg.norm(gap)
        return bool(len(turns) and not off.any() and turns.any(axis=1).all())


def _crossing(point: Floats) -> Floats:
    """The matrix (3, 3) that takes an angular velocity to its cross product with a vector (3,)."""
    x, y, z = point
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


def radius_around(points: Sequence[ArrayLike]) -> float:
    """The radius around the mean of points (3,) [length]; 1 where they have no extent."""
    every = np.array(points, float).reshape(-1, 3)
    return float(np.linalg.norm(every - every.mean(axis=0), axis=1).max()) or 1.0 if len(every) else 1.0


def _sides(loop: Loop, bodies: dict[str, Floats]) -> tuple[Floats, Floats]:
    """A loop's points (2, 3) [length] and frames (2, 3, 3) where its bodies are."""
    moved = [bodies[body][0] for body in loop.connects]
    points = [motion[:3, :3] @ point + motion[:3, 3] for motion, point in zip(moved, loop.at, strict=True)]
    frames = [motion[:3, :3] @ frame for motion, frame in zip(moved, loop.turned, strict=True)]
    return np.array(points), np.array(frames)


def _turn(loop: Loop, frames: Floats) -> Floats:
    """The rotation vector (3,) [rad] from the second frame to the first; of a hinge, that between the axes."""
    if loop.type == "spherical":
        return np.zeros(3)
    if loop.type == "revolute":
        one, other = frames[:, :, 2]  # of a hinge, either way along its line
        return to_rotvec(shortest_turns(np.copysign(1.0, one @ other) * other[None], one[None])[0])
    return to_rotvec(frames[0] @ frames[1].T)
