"""The closed home of an open machine: its joints moved until all loops meet, within their ranges.

The solver of `closure` begins with loops that are closed at home. So between the two sides of a loop that is open, a
slide and a hinge of no other use bridge the gap; locked where this is gone, they leave the loop to the joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats, Mask
from ..closure.close import close, platform_poses
from ..description.joints import Joint, JointType
from ..description.mechanism import Mechanism
from ..description.structure import Structure
from ..kinematics import column_joints, columns, displacements, home_coordinates, rate_units, tree_of
from ..motion.displacements import screws
from ..motion.loops import Closure, closure_of
from ..rotations import shortest_turns, to_rotvec
from ..tolerances import TOLERANCES
from .opened import Loop, OpenMechanism

CLOSED = 1e-13
"""Gap that counts as none [L and rad]: rounding."""

POLISH = 10
"""Newton's steps at the end, where least squares stall: those of a closed loop end at rounding."""

BRIDGE = "bridge of loop"
"""What bodies and joints in the gap of a loop are called."""

STARTS, STRAY = 6, 0.3
"""Attempts from elsewhere, where the first ends open, and how far off they start [rad or L]: legs that are stretched
out, or lie on one another, have no direction to begin with."""


@dataclass(frozen=True)
class ClosedHome:
    """Coordinates at which the loops meet, or are least open.

    Attributes
    ----------
    q : coordinates of the tree's joints, deviations from home, (c,) [rad or length].
    gap : of all loops, the largest distance [L] or angle [rad].
    """

    q: Floats
    gap: float


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


def close_home(loops: OpenLoops, free: Mask, low: Floats, high: Floats) -> ClosedHome:
    """The coordinates nearest to home, of those found, in which the loops meet; or are least open.

    Parameters
    ----------
    free : the coordinates that may move, (c,); the others stay at home.
    low, high : bounds of the coordinates as deviations from home, (c,) [rad or length]; equal ones hold a coordinate.
    """
    home = np.where(free, np.clip(0.0, low, high), 0.0)
    if not loops.loops:
        return ClosedHome(home, 0.0)
    closure, bridges = loops.bridged
    rng, units = np.random.default_rng(0), rate_units(loops.tree)
    strays = rng.uniform(-STRAY, STRAY, (STARTS, len(home))) * units
    has_limits = bool(np.isfinite([low, high]).any())
    locked = frozenset([*np.flatnonzero(~free | (low == high)).tolist(), *bridges])
    best = ClosedHome(home, np.inf)
    for starts in (home[None], np.where(free, np.clip(home + strays, low, high), home)):
        coordinates = np.zeros((len(starts), len(closure.scale)))
        coordinates[:, : len(home)], coordinates[:, list(bridges)] = starts, list(bridges.values())
        poses = platform_poses(closure.mechanism, coordinates)
        for limits in (False, True)[: 1 + has_limits]:
            ends = close(closure, coordinates, poses, locked=locked, limits=limits, closeness=0.1 * CLOSED)
            exact = close(closure, ends.coordinates, ends.poses, locked=locked, undamped=True, max_iterations=POLISH)
            for q in np.clip(np.concatenate([exact.coordinates, ends.coordinates])[:, : len(home)], low, high):
                trial = ClosedHome(q, loops.gap(q))
                best = trial if trial.gap < 0.5 * best.gap else best
            if best.gap <= TOLERANCES.file_gap:
                return best
    return best
