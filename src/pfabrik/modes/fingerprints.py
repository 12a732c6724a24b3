"""What working modes are told apart by, and what moves although the end effector rests on its target."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Floats, Mask
from ..closure.close import Closing, Closure, close
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..motion.displacements import centres, columns
from ..motion.limits import within_turns
from ..tolerances import TOLERANCES
from .lists import ALONG

Read = Callable[[Closing], Floats]

SHAKES = 16
"""Random directions in which a configuration is moved to see what of it does not stay; more than motions are free."""

SHIFT = 1e-3
"""How far what does not stay moves at least, relative to how far it was moved: the errors of a double root are less."""

STRAIGHT = 0.2
"""How far a move may be from twice the move of half the size, relative to it. Where it ended at another solution, or at
the same as the half, it is off by all of it."""


class Fingerprints:
    """What working modes are told apart by: where the platform is, and for each leg actuators and joint centres.

    What moves while actuators and end effector rest, as the elbow of a rod that spins, tells nothing. If that is the
    platform itself (a rod that ends in the point asked for), legs are not independent below it, and count as one.

    Attributes
    ----------
    pose_rests : whether the platform is where it is because of actuators and end effector.
    leg_of_group, leg_of_column, leg_of_mark : which leg owns what.
    """

    def __init__(self, closure: Closure, coordinates: Floats, pose: Floats) -> None:
        """See what rests at a closed configuration, (columns,) and (4, 4)."""
        mechanism = self.mechanism = closure.mechanism
        self._closure = closure
        locked = closure.driven

        def rests(read: Read) -> Mask:
            return np.asarray((shifts(closure, coordinates, pose, read, locked) == 0.0).all(axis=(0, 2)))

        groups = np.arange(len(closure.loops.groups) - 1)
        self.pose_rests = bool(rests(lambda closing: pose_marks(mechanism, closing.poses)[:, None]).all())
        self.leg_of_group = groups if self.pose_rests else 0 * groups
        self.leg_of_column = self.leg_of_group[closure.loops.group_of]
        self._joints = [joint.name for joint in mechanism.joints if joint.at is not None and joint.type != "fixed"]
        kept = rests(lambda closing: self._centres(closing.coordinates))
        self._joints = [name for name, rest in zip(self._joints, kept, strict=True) if rest]
        self._actuated = closure.actuated
        self._turning = closure.turning[closure.actuated] > 0.0
        self._scale = closure.scale[closure.actuated]
        own = self.leg_of_column[self._actuated]
        last = [self.leg_of_column[columns(mechanism)[name].start] for name in self._joints]
        self.leg_of_mark = np.concatenate([own, own, np.repeat(last, 3)]).astype(np.intp)
        self._home = self.of_legs(np.zeros((1, len(closure.scale))))[0]

    @property
    def n_legs(self) -> int:
        return int(self.leg_of_group.max()) + 1

    def of_poses(self, poses: Floats) -> Floats:
        """Fingerprints of platforms (n, 4, 4): positions [L], rotation matrices; (n, 0) if platforms tell nothing."""
        return pose_marks(self.mechanism, poses) if self.pose_rests else np.zeros((len(poses), 0))

    def of_legs(self, coordinates: Floats) -> Floats:
        """Fingerprints of legs of closed configurations (n, columns): actuators [L, or cosine, sine], centres [L]."""
        values = self._closure.actuators(coordinates)
        first = np.where(self._turning, np.cos(values), values * self._scale)
        second = np.where(self._turning, np.sin(values), 0.0)
        points = self._centres(coordinates)
        return np.concatenate([first, second, points.reshape(len(points), -1)], axis=1)

    def pose_from_home(self, marks: Floats) -> float:
        """Square of the distance of a platform from home's, from its marks."""
        return float(((marks - self.of_poses(self.mechanism.home_pose[None])[0]) ** 2).sum())

    def legs_from_home(self, leg: int, marks: Floats) -> Floats:
        """Squares of the distances of a leg's branches from home's, (n,), from their marks (n, own)."""
        return np.asarray(((marks - self._home[self.leg_of_mark == leg]) ** 2).sum(axis=1))

    def wished_centres(self, coordinates: Floats) -> Floats:
        """Joint centres as the closure kernel wishes for them, (n, joints, 3) [length]; NaN if they tell nothing."""
        wished = np.full((len(coordinates), len(self.mechanism.joints), 3), np.nan)
        points = self._centres(coordinates) * self.mechanism.characteristic_length
        for place, joint in enumerate(self.mechanism.joints):
            if joint.name in self._joints:
                wished[:, place] = points[:, self._joints.index(joint.name)]
        return wished

    def _centres(self, coordinates: Floats) -> Floats:
        """Centres of the joints that are looked at, (n, looked at, 3) [L]."""
        points = centres(self.mechanism, coordinates)
        own = [points[name] for name in self._joints]
        return np.reshape(own, (-1, len(coordinates), 3)).swapaxes(0, 1) / self.mechanism.characteristic_length


def pose_marks(mechanism: Mechanism, poses: Floats) -> Floats:
    """What platforms (n, 4, 4) are told apart by: positions [L], and rotation matrices, (n, 12)."""
    positions = poses[:, :3, 3] / mechanism.characteristic_length
    return np.concatenate([positions, poses[:, :3, :3].reshape(-1, 9)], axis=1)


def shifts(
    closure: Closure, coordinates: Floats, pose: Floats, read: Read, locked: frozenset[int] = frozenset()
) -> Floats:
    """How far what is read of a configuration (columns,) moves with the end effector on its target.

    The configuration is shaken by `ALONG` and by half of it, and closed again each time: what is one of a continuum
    ends as far off as it was moved, and half as far; what stands alone comes back, or goes to another solution.

    Parameters
    ----------
    read : what is looked at, (n, things, numbers) [L or rad].

    Returns
    -------
    (SHAKES, things, numbers), relative to how far the configuration was moved; zero for what comes back.
    """
    rng = np.random.default_rng(0)
    shakes, twists = rng.normal(size=(SHAKES, len(coordinates))), rng.normal(size=(SHAKES, 6))
    shakes[:, closure.idle] = 0.0
    shakes[:, list(locked)] = 0.0
    lengths = ALONG / np.sqrt((shakes**2).sum(axis=1, keepdims=True) + (twists**2).sum(axis=1, keepdims=True))
    moves = []
    for size in (0.0, 0.5 * lengths, lengths):
        begin = _moved(pose, size * twists, closure.mechanism.characteristic_length)
        wanted = task_of(closure.mechanism).completed(np.repeat(pose[None], SHAKES, axis=0), begin)
        closed = close_on_target(closure, coordinates + size * shakes / closure.scale, wanted, locked=locked)
        moves.append(np.where((closed.gap <= TOLERANCES.position)[:, None, None], read(closed), np.nan))
    half, whole = moves[1] - moves[0], moves[2] - moves[0]
    size = np.linalg.norm(whole, axis=2, keepdims=True)
    bend = np.linalg.norm(whole - 2.0 * half, axis=2, keepdims=True)
    return np.where((size > SHIFT * ALONG) & (bend <= STRAIGHT * size), whole, 0.0) / ALONG


def _moved(pose: Floats, twists: Floats, length: float) -> Floats:
    """A pose (4, 4) moved by small twists, velocity [L] and angular velocity [rad], (n, 6): (n, 4, 4)."""
    half = 0.5 * np.cross(np.eye(3), twists[:, None, 3:])
    moved = np.repeat(pose[None], len(twists), axis=0)
    moved[:, :3, :3] = np.linalg.solve(np.eye(3) - half, np.eye(3) + half) @ pose[:3, :3]  # a rotation: Cayley
    moved[:, :3, 3] += length * twists[:, :3]
    return moved


def close_on_target(closure: Closure, coordinates: Floats, poses: Floats, **options: Any) -> Closing:
    """Close legs below platforms (n, 4, 4) that are held in all that the task asks for; options as of `close`."""
    task = task_of(closure.mechanism)
    return close(closure, coordinates, poses, platform=task.held, frame=task.frame, **options)


def count_from_home(closure: Closure, coordinates: Floats) -> None:
    """Count angles by whole turns, in place: nearest to home, or into their ranges."""
    turns = closure.turning > 0.0
    for name, span in columns(closure.mechanism).items():
        if closure.mechanism.joint(name).type == "spherical":
            turns[span] = False
    angles = coordinates[:, turns]
    coordinates[:, turns] = angles - 2.0 * np.pi * np.round(angles / (2.0 * np.pi))
    within_turns(closure.mechanism, coordinates)
