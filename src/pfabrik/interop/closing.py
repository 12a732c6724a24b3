"""Closing an open machine: its joints moved as little as need be until all loops meet, within their ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats, Mask
from ..description.graph import tree_of
from ..description.home_mobility import body_twist, column_joints
from ..description.structure import Structure
from ..motion.displacements import displacements, home_coordinates, rate_units, screws, stepped
from ..rotations import angles_and_sines, square_to
from ..tolerances import TOLERANCES
from .opened import Loop, OpenMechanism

STEPS = 200
"""Most steps of one attempt; a dozen are usual."""

CLOSED = 1e-13
"""Gap that counts as none [L and rad]: rounding."""

STALLED = 1.0 - 1e-9
"""Share of the sum of squares that a step leaves where there is nothing left to gain."""

STARTS, STRAY = 6, 0.3
"""Attempts from elsewhere, where the first ends open, and how far off they start [rad or L]: legs that are stretched
out, or lie on one another, have no direction to begin with."""


@dataclass(frozen=True)
class Placed:
    """Where the joints have been moved to.

    Attributes
    ----------
    q : coordinates of the tree's joints, deviations from home, (c,) [rad or length].
    gap : of all loops, the largest distance [L] or angle [rad].
    """

    q: Floats
    gap: float


class Closer:
    """An open machine, and how far its loops are open at given coordinates."""

    def __init__(self, opened: OpenMechanism) -> None:
        self.loops = opened.loops
        self.tree: Structure = opened.tree()
        self.length = _size(opened)
        self._paths = {body: path[column_joints(self.tree)] for body, path in tree_of(self.tree).paths.items()}
        self._own = self.length / self.tree.characteristic_length

    @property
    def count(self) -> int:
        """How many coordinates the tree's joints have."""
        return len(column_joints(self.tree))

    def openings(self, q: Floats) -> list[tuple[Floats, Floats]]:
        """For every loop, at coordinates (c,): distance (3,) [L], and angle (3,) [rad] between its two sides."""
        bodies = displacements(self.tree, q[None])
        return [self._opening(loop, bodies) for loop in self.loops]

    def gap(self, q: Floats) -> float:
        """The largest distance [L] or angle [rad]."""
        found = [np.linalg.norm(part) for opening in self.openings(q) for part in opening]
        return float(max(found, default=0.0))

    def meeting(self, q: Floats) -> list[tuple[Floats, Floats]]:
        """For every loop, at coordinates (c,): its point (3,) [length] and frame (3, 3), amid those of its sides."""
        bodies = displacements(self.tree, q[None])
        return [(point.mean(axis=0), frames[0]) for point, frames in (_sides(loop, bodies) for loop in self.loops)]

    def linearised(self, q: Floats) -> tuple[Floats, Floats]:
        """What is open (rows,), and how it changes with the rates of `screws` (rows, c)."""
        bodies, each = displacements(self.tree, q[None]), screws(self.tree, q[None])[0]
        each = np.concatenate([each[:, :3], each[:, 3:] / self._own], axis=1)
        rows, slopes = [np.zeros(0)], [np.zeros((0, self.count))]
        for loop in self.loops:
            points, frames = _sides(loop, bodies)
            twists = [body_twist(self._paths[body], each) for body in loop.connects]
            moved = [
                twist[3:] + np.cross(twist[:3], point / self.length, axis=0)
                for twist, point in zip(twists, points, strict=True)
            ]
            rows.append((points[0] - points[1]) / self.length)
            slopes.append(moved[0] - moved[1])
            if loop.type != "spherical":
                turned = twists[0][:3] - twists[1][:3]
                across = np.eye(3) if loop.type == "fixed" else square_to(frames[0][:, 2])
                rows.append(across @ _turn(loop, frames))
                slopes.append(across @ turned)
        return np.concatenate(rows), np.concatenate(slopes)

    def _opening(self, loop: Loop, bodies: dict[str, Floats]) -> tuple[Floats, Floats]:
        points, frames = _sides(loop, bodies)
        return (points[0] - points[1]) / self.length, _turn(loop, frames)


def _size(opened: OpenMechanism) -> float:
    """The radius around all joints and loops [length]."""
    points = [joint.at for joint in opened.joints if joint.at is not None]
    every = np.concatenate([np.reshape(points, (-1, 3)), *(loop.at for loop in opened.loops)])
    spread = np.linalg.norm(every - every.mean(axis=0), axis=1).max(initial=0.0) if len(every) else 0.0
    return float(spread) or 1.0


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
        axes = frames[:, :, 2]
        sine = np.cross(axes[1], axes[0])
        size = float(np.linalg.norm(sine))
        return np.asarray(sine * (np.arctan2(size, axes[0] @ axes[1]) / size if size else 1.0))
    angle, sines = angles_and_sines(frames[0] @ frames[1].T)
    return np.asarray(sines / np.sinc(angle / np.pi))


def closed(closer: Closer, free: Mask, low: Floats, high: Floats) -> Placed:
    """The coordinates nearest to home, of those found, in which the loops meet; or are least open.

    Parameters
    ----------
    free : which coordinates may move, (c,); the others stay at home.
    low, high : bounds of the coordinates as deviations from home, (c,) [rad or length].
    """
    units = rate_units(closer.tree)
    rng = np.random.default_rng(0)
    home = np.where(free, np.clip(0.0, low, high), 0.0)
    best = _descended(closer, home, free, low, high)
    for _ in range(STARTS):
        if best.gap <= TOLERANCES.file_gap:
            break
        astray = np.where(free, np.clip(home + rng.uniform(-STRAY, STRAY, len(home)) * units, low, high), home)
        tried = _descended(closer, astray, free, low, high)
        best = tried if tried.gap < 0.5 * best.gap else best
    return best


def _descended(closer: Closer, q: Floats, free: Mask, low: Floats, high: Floats) -> Placed:
    """Levenberg and Marquardt's method, its steps cut at the bounds."""
    damping = 1e-3
    rows, slopes = closer.linearised(q)
    for _ in range(STEPS):
        if np.abs(rows).max(initial=0.0) <= CLOSED or damping > 1e12:
            break
        gradient = slopes.T @ rows
        stuck = ((q <= low) & (gradient > 0.0)) | ((q >= high) & (gradient < 0.0))
        moving = np.flatnonzero(free & ~stuck)
        part = slopes[:, moving]
        step = np.zeros(len(q))
        damped = np.sqrt(damping * (rows @ rows)) * np.eye(len(moving))
        asked = np.concatenate([rows, np.zeros(len(moving))])
        step[moving] = -np.linalg.lstsq(np.concatenate([part, damped]), asked, rcond=None)[0]
        tried = np.clip(stepped(closer.tree, q[None], step[None])[0], low, high)
        new_rows, new_slopes = closer.linearised(tried)
        left = (new_rows @ new_rows) / (rows @ rows)
        if left < 1.0:
            q, rows, slopes, damping = tried, new_rows, new_slopes, max(0.1 * damping, 1e-9)
        else:
            damping *= 10.0
        if STALLED < left < 1.0:
            break
    return Placed(q, closer.gap(q))


def bounds(opened: OpenMechanism) -> tuple[Floats, Floats]:
    """Bounds of all coordinates as deviations from home, (c,) each; infinite where there are none."""
    tree = opened.tree()
    low, high = np.reshape([each.limits for each in tree.coordinates], (-1, 2)).T - home_coordinates(tree)
    return low, high
