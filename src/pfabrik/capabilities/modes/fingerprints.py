"""Fingerprints that distinguish working modes, and a test for motions with the end effector on its target."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...common.arrays import Floats, Mask
from ...common.rotations import nearest_turn
from ...engines.joints.close import Closing, close
from ...kinematics import columns
from ...machine.description.mechanism import Mechanism
from ...machine.motion.displacements import centres
from ...machine.motion.limited_coordinates import within_turns
from ...machine.motion.loops import Closure
from ...tolerances import TOLERANCES
from .lists import ALONG

Read = Callable[[Closing], Floats]

SHAKES = 16
"""Random moves of a configuration in the test for free motions; more than there are free motions."""

SHIFT = 1e-3
"""Least move of a free quantity relative to that of the configuration: errors at a double root are smaller."""

STRAIGHT = 0.2
"""Largest relative difference between a move and twice the move of half the size; 1 if one of them ends at another
solution, or both at the same."""


class Fingerprints:
    """Fingerprints of working modes: the platform's pose, and the actuator values and joint centres of each leg.

    Centres that move while actuators and end effector rest, such as the elbow of a spinning rod, are left out. If the
    platform itself moves then (a rod that ends in the target point), legs depend on each other and count as one leg.

    Attributes
    ----------
    pose_rests : True if actuators and end effector determine the platform's pose.
    leg_of_group, leg_of_column, leg_of_mark : the leg to which each group, column and mark belongs.
    """

    def __init__(self, closure: Closure, coordinates: Floats, pose: Floats) -> None:
        """Choose the quantities that are determined at a closed configuration (columns,) with pose (4, 4)."""
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
        centres_rest = rests(lambda closing: self._centres(closing.coordinates))
        self._joints = [name for name, centre_rests in zip(self._joints, centres_rest, strict=True) if centre_rests]
        self._actuated = closure.actuated
        self._turning = closure.turning[closure.actuated] > 0.0
        self._scale = closure.scale[closure.actuated]
        leg_of_actuator = self.leg_of_column[self._actuated]
        leg_of_joint = [self.leg_of_column[columns(mechanism)[name].start] for name in self._joints]
        self.leg_of_mark = np.concatenate([leg_of_actuator, leg_of_actuator, np.repeat(leg_of_joint, 3)]).astype(
            np.intp
        )
        self._home = self.of_legs(np.zeros((1, len(closure.scale))))[0]

    @property
    def n_legs(self) -> int:
        return int(self.leg_of_group.max()) + 1

    def of_poses(self, poses: Floats) -> Floats:
        """Fingerprints of platforms (n, 4, 4): positions [L], rotation matrices; (n, 0) if the pose does not rest."""
        return pose_marks(self.mechanism, poses) if self.pose_rests else np.zeros((len(poses), 0))

    def of_legs(self, coordinates: Floats) -> Floats:
        """Fingerprints of legs of closed configurations (n, columns): actuators [L, or cosine, sine], centres [L]."""
        values = self._closure.actuators(coordinates)
        first = np.where(self._turning, np.cos(values), values * self._scale)
        second = np.where(self._turning, np.sin(values), 0.0)
        points = self._centres(coordinates)
        return np.concatenate([first, second, points.reshape(len(points), -1)], axis=1)

    def pose_from_home(self, marks: Floats) -> float:
        """Squared distance of the marks of a platform from those of home."""
        return float(((marks - self.of_poses(self.mechanism.home_pose[None])[0]) ** 2).sum())

    def legs_from_home(self, leg: int, marks: Floats) -> Floats:
        """Squared distances of the marks (n, k) of a leg's branches from those of home, (n,)."""
        return np.asarray(((marks - self._home[self.leg_of_mark == leg]) ** 2).sum(axis=1))

    def target_centres(self, coordinates: Floats) -> Floats:
        """Target positions of joint centres for the closure kernel, (n, joints, 3) [length]; NaN for those left out."""
        targets = np.full((len(coordinates), len(self.mechanism.joints), 3), np.nan)
        points = self._centres(coordinates) * self.mechanism.characteristic_length
        for place, joint in enumerate(self.mechanism.joints):
            if joint.name in self._joints:
                targets[:, place] = points[:, self._joints.index(joint.name)]
        return targets

    def _centres(self, coordinates: Floats) -> Floats:
        """Centres of the joints of the fingerprint, (n, k, 3) [L]."""
        points = centres(self.mechanism, coordinates)
        chosen = [points[name] for name in self._joints]
        return np.reshape(chosen, (-1, len(coordinates), 3)).swapaxes(0, 1) / self.mechanism.characteristic_length


def pose_marks(mechanism: Mechanism, poses: Floats) -> Floats:
    """Marks of platforms (n, 4, 4): positions [L] and rotation matrices, (n, 12)."""
    positions = poses[:, :3, 3] / mechanism.characteristic_length
    return np.concatenate([positions, poses[:, :3, :3].reshape(-1, 9)], axis=1)


def shifts(
    closure: Closure, coordinates: Floats, pose: Floats, read: Read, locked: frozenset[int] = frozenset()
) -> Floats:
    """Moves of the free quantities of a configuration (columns,) with the end effector on its target.

    The configuration is moved by `ALONG` and by half of it, and closed again after both moves. A free quantity stays
    moved, by half after half the move; a determined one returns, or ends at another solution.

    Parameters
    ----------
    read : reads the quantities, (n, quantities, numbers) [L or rad], off a closing.

    Returns
    -------
    (SHAKES, quantities, numbers), relative to the move of the configuration; zero for quantities that are determined.
    """
    rng = np.random.default_rng(0)
    shakes, twists = rng.normal(size=(SHAKES, len(coordinates))), rng.normal(size=(SHAKES, 6))
    shakes[:, closure.idle] = 0.0
    shakes[:, list(locked)] = 0.0
    lengths = ALONG / np.sqrt((shakes**2).sum(axis=1, keepdims=True) + (twists**2).sum(axis=1, keepdims=True))
    moves = []
    for size in (0.0, 0.5 * lengths, lengths):
        moved = _moved(pose, size * twists, closure.mechanism.characteristic_length)
        completed = closure.task.completed(np.repeat(pose[None], SHAKES, axis=0), moved)
        closed = close_on_target(closure, coordinates + size * shakes / closure.scale, completed, locked=locked)
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
    """Close legs with platforms (n, 4, 4) held in the components of the task; options are those of `close`."""
    task = closure.task
    return close(closure, coordinates, poses, platform=task.held, frame=task.frame, **options)


def count_from_home(closure: Closure, coordinates: Floats) -> None:
    """Shift angles in place by full turns: nearest to home, or into their ranges."""
    turns = closure.turning > 0.0
    for name, span in columns(closure.mechanism).items():
        if closure.mechanism.joint(name).type == "spherical":
            turns[span] = False
    coordinates[:, turns] = nearest_turn(coordinates[:, turns])
    within_turns(closure.mechanism, coordinates)
