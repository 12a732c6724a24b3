"""The closed home of an open machine: its joints moved until all loops meet, within their ranges.

Here the bodies that close a loop may be far apart, and joints on either side may be anywhere within their ranges; the
solver of `closure` begins with a `Mechanism`, whose loops are closed at home.
"""

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
        self.length = _radius(opened)
        self._paths = {body: path[column_joints(self.tree)] for body, path in tree_of(self.tree).paths.items()}
        self._relative_length = self.length / self.tree.characteristic_length

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
        one, other = (self._paths[body] for body in loop.connects)
        turns = screws(self.tree, q[None])[0][one != other][:, :3]
        off = np.linalg.norm(np.cross(turns, gap), axis=1) > TOLERANCES.file_angle * np.linalg.norm(gap)
        return bool(len(turns) and not off.any() and turns.any(axis=1).all())

    def linearised(self, q: Floats) -> tuple[Floats, Floats]:
        """Loop errors (rows,) [L and rad], and their slopes by the rates of `screws` (rows, c)."""
        bodies, twists = displacements(self.tree, q[None]), screws(self.tree, q[None])[0]
        twists = np.concatenate([twists[:, :3], twists[:, 3:] / self._relative_length], axis=1)
        errors, slopes = [np.zeros(0)], [np.zeros((0, len(self.low)))]
        for loop in self.loops:
            points, frames = _sides(loop, bodies)
            turning, moving = [], []
            for body, point in zip(loop.connects, points, strict=True):
                twist = body_twist(self._paths[body], twists)
                turning.append(twist[:3])
                moving.append(twist[3:] + np.cross(twist[:3], point / self.length, axis=0))
            errors.append((points[0] - points[1]) / self.length)
            slopes.append(moving[0] - moving[1])
            if loop.type != "spherical":
                across = np.eye(3) if loop.type == "fixed" else square_to(frames[0][:, 2])
                errors.append(across @ _turn(loop, frames))
                slopes.append(across @ (turning[0] - turning[1]))
        return np.concatenate(errors), np.concatenate(slopes)


def _radius(opened: OpenMechanism) -> float:
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


def close_home(loops: OpenLoops, free: Mask, low: Floats, high: Floats) -> ClosedHome:
    """The coordinates nearest to home, of those found, in which the loops meet; or are least open.

    Parameters
    ----------
    free : the coordinates that may move, (c,); the others stay at home.
    low, high : bounds of the coordinates as deviations from home, (c,) [rad or length].
    """
    units = rate_units(loops.tree)
    rng = np.random.default_rng(0)
    home = np.where(free, np.clip(0.0, low, high), 0.0)
    best = _descend(loops, home, free, low, high)
    for _ in range(STARTS):
        if best.gap <= TOLERANCES.file_gap:
            break
        start = np.where(free, np.clip(home + rng.uniform(-STRAY, STRAY, len(home)) * units, low, high), home)
        trial = _descend(loops, start, free, low, high)
        best = trial if trial.gap < 0.5 * best.gap else best
    return best


def _descend(loops: OpenLoops, q: Floats, free: Mask, low: Floats, high: Floats) -> ClosedHome:
    """Levenberg and Marquardt's method, its steps cut at the bounds."""
    damping = 1e-3
    errors, slopes = loops.linearised(q)
    for _ in range(STEPS):
        if np.abs(errors).max(initial=0.0) <= CLOSED or damping > 1e12:
            break
        gradient = slopes.T @ errors
        is_stuck = ((q <= low) & (gradient > 0.0)) | ((q >= high) & (gradient < 0.0))
        moving = np.flatnonzero(free & ~is_stuck)
        damped = np.sqrt(damping * (errors @ errors)) * np.eye(len(moving))
        matrix = np.concatenate([slopes[:, moving], damped])
        step = np.zeros(len(q))
        step[moving] = -np.linalg.lstsq(matrix, np.concatenate([errors, np.zeros(len(moving))]), rcond=None)[0]
        trial = np.clip(stepped(loops.tree, q[None], step[None])[0], low, high)
        trial_errors, trial_slopes = loops.linearised(trial)
        remaining = (trial_errors @ trial_errors) / (errors @ errors)
        if remaining < 1.0:
            q, errors, slopes, damping = trial, trial_errors, trial_slopes, max(0.1 * damping, 1e-9)
        else:
            damping *= 10.0
        if STALLED < remaining < 1.0:
            break
    return ClosedHome(q, loops.gap(q))
