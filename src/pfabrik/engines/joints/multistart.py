"""Seeds of multistart searches: random starts, and feasible configurations computed once for each mechanism."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...common.rotations import from_quaternion, random_quaternions, rotvec_from_quaternion
from ...kernels.joints.joint_constants import RANDOM_STARTS, RANDOM_STEPS, SEED_DISTANCE, SEED_TURN, SEEDS, SPREAD
from ...kernels.joints.loops import BASE_AXES
from ...kernels.search_constants import MOST_STEPS
from ...machine.motion.displacements import columns
from ...machine.motion.loops import Closure
from ...machine.poses import pose
from ...tolerances import TOLERANCES
from .close import EVERYTHING_FREE, close
from .descend import nearest_configurations
from .effort import descents_within, starts_within
from .parasitic import differences, follows_task, has_parasitic_motion


def random_starts(closure: Closure, n: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Coordinates (n, columns) by `random_coordinates`, and poses (n, 4, 4) around home with any rotation."""
    mechanism = closure.mechanism
    poses = np.repeat(mechanism.home_pose[None], n, axis=0)
    poses[:, :3, :3] = from_quaternion(random_quaternions(n, rng))
    poses[:, :3, 3] += rng.normal(0.0, SPREAD * mechanism.characteristic_length, (n, 3))
    return random_coordinates(closure, n, rng), poses


def same_random_starts(closure: Closure, starts: int, n: int) -> Iterator[tuple[Floats, Floats]]:
    """Yield random starts, each repeated for n rows, and equal in every call: rows do not depend on each other."""
    rng = np.random.default_rng(0)
    for _ in range(starts):
        coordinates, poses = random_starts(closure, 1, rng)
        yield np.repeat(coordinates, n, axis=0), np.repeat(poses, n, axis=0)


def random_coordinates(closure: Closure, n: int, rng: np.random.Generator) -> Floats:
    """Coordinates (n, columns) with random angles; lengths, which follow the platform, and idle coordinates are 0."""
    coordinates = rng.uniform(-np.pi, np.pi, (n, len(closure.scale))) * closure.turning
    for name, span in columns(closure.mechanism).items():
        if closure.mechanism.joint(name).type == "spherical":
            coordinates[:, span] = rotvec_from_quaternion(random_quaternions(n, rng))
    coordinates[:, closure.idle] = 0.0
    return np.asarray(coordinates)


@derived
def seeds_of(closure: Closure) -> tuple[Floats, ...]:
    """Feasible configurations far from home and from each other, as joint coordinates (columns,).

    They are chosen from the configurations nearest to poses in four directions from home, and from random ones, which
    may lie in components of the workspace that are not connected with home.
    """
    mechanism = closure.mechanism
    directions = np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)]) / np.sqrt(3.0)
    offsets = SEED_DISTANCE * mechanism.characteristic_length * directions
    poses = [
        pose(mechanism.home_pose[:3, 3] + offset, rotvec=SEED_TURN * direction)
        for offset, direction in zip(offsets, directions, strict=True)
    ]
    turning = 0.0 if mechanism.end_effector_is_joint else 1.0
    home = np.zeros((len(directions), len(closure.scale)))
    _, steps = descents_within(closure, SEEDS, MOST_STEPS)
    platform = (1.0, 1.0, 1.0, turning, turning, turning)
    nearest = nearest_configurations(closure, home, np.array(poses), platform=platform, steps=max(steps, 1))
    coordinates, candidate_poses = random_feasible(closure)
    is_feasible = nearest.feasible
    coordinates = np.concatenate([home[:1], nearest.coordinates[is_feasible], coordinates])
    candidate_poses = np.concatenate([mechanism.home_pose[None], nearest.poses[is_feasible], candidate_poses])
    n, chosen = len(candidate_poses), [0]
    while len(chosen) <= min(SEEDS, n - 1):
        apart = [
            differences(closure, candidate_poses, np.repeat(candidate_poses[i : i + 1], n, axis=0)) for i in chosen
        ]
        chosen.append(int(np.min(apart, axis=0).argmax()))
    return tuple(coordinates[chosen[1:]])


@derived
def random_feasible(closure: Closure) -> tuple[Floats, Floats]:
    """Random feasible configurations: joint coordinates (k, columns), and poses (k, 4, 4).

    If what the task leaves out of a pose never changes, it is that of home.
    """
    mechanism, task = closure.mechanism, closure.task
    n = starts_within(closure, RANDOM_STARTS, RANDOM_STEPS)
    coordinates, poses = random_starts(closure, n, np.random.default_rng(0))
    left_out = task.left_out
    is_fixed = follows_task(closure) and not has_parasitic_motion(closure)
    if is_fixed:
        poses = task.completed(poses, np.repeat(mechanism.home_pose[None], n, axis=0))
    platform, frame = (left_out.held, left_out.frame) if is_fixed else (EVERYTHING_FREE, BASE_AXES)
    closing = close(
        closure,
        coordinates,
        poses,
        platform=platform,
        frame=frame,
        limits=True,
        margin=TOLERANCES.inside,
        max_iterations=100 if n == RANDOM_STARTS else RANDOM_STEPS,
    )
    feasible = closing.feasible
    return closing.coordinates[feasible], closing.poses[feasible]
