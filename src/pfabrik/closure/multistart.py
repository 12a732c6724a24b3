"""Feasible configurations of a mechanism that searches can start from, found once."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.closure.loops import BASE_AXES
from ..poses import pose
from ..tolerances import TOLERANCES
from .close import EVERYTHING_FREE, close, closure_of
from .descend import MOST_STEPS, nearest_configurations
from .effort import descents_within, starts_within
from .parasitic import differences, follows_task, has_parasitic_motion
from .starts import random_starts

FAR_CORNER, TURNED_CORNER = 0.5, 0.5
"""Where corners are looked for: so far from home [L], and turned so far [rad]."""


SEEDS, CHANCES, A_CHANCE = 8, 128, 20
"""How many corners searches start from, and how many random configurations are closed to find some, in about how many
steps each."""


@lru_cache(maxsize=64)
def seeds_of(mechanism: Mechanism) -> tuple[Floats, ...]:
    """Feasible configurations far from home and from each other, as joint coordinates (columns,).

    Some are as far as the workspace goes from home in four directions; some are chanced upon, in parts of it to which
    no way may lead from home.
    """
    closure = closure_of(mechanism, whole=False)
    directions = np.array([(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)]) / np.sqrt(3.0)
    offsets = FAR_CORNER * mechanism.characteristic_length * directions
    poses = [
        pose(mechanism.home_pose[:3, 3] + offset, rotvec=TURNED_CORNER * direction)
        for offset, direction in zip(offsets, directions, strict=True)
    ]
    turning = 0.0 if mechanism.end_effector_is_joint else 1.0
    home = np.zeros((len(directions), len(closure.scale)))
    _, steps = descents_within(closure, SEEDS, MOST_STEPS)
    platform = (1.0, 1.0, 1.0, turning, turning, turning)
    ends = nearest_configurations(closure, home, np.array(poses), platform=platform, steps=max(steps, 1))
    coordinates, places = random_feasible(mechanism)
    kept = ends.feasible
    coordinates = np.concatenate([home[:1], ends.coordinates[kept], coordinates])
    places = np.concatenate([mechanism.home_pose[None], ends.poses[kept], places])
    chosen = [0]
    while len(chosen) <= min(SEEDS, len(places) - 1):
        apart = [differences(closure, places, np.repeat(places[i : i + 1], len(places), axis=0)) for i in chosen]
        chosen.append(int(np.min(apart, axis=0).argmax()))
    return tuple(coordinates[chosen[1:]])


@lru_cache(maxsize=64)
def random_feasible(mechanism: Mechanism) -> tuple[Floats, Floats]:
    """Feasible configurations closed from random ones: joint coordinates (k, columns), and poses (k, 4, 4).

    They are in the assembly of home as far as a task tells it.
    """
    closure, task = closure_of(mechanism, whole=False), task_of(mechanism)
    chances = starts_within(closure, CHANCES, A_CHANCE)
    coordinates, poses = random_starts(closure, chances, np.random.default_rng(0))
    rest = task.left_out
    keeps_rest = follows_task(mechanism) and not has_parasitic_motion(mechanism)
    if keeps_rest:
        poses = task.completed(poses, np.repeat(mechanism.home_pose[None], chances, axis=0))
    platform, frame = (rest.held, rest.frame) if keeps_rest else (EVERYTHING_FREE, BASE_AXES)
    found = close(
        closure,
        coordinates,
        poses,
        platform=platform,
        frame=frame,
        limits=True,
        margin=TOLERANCES.inside,
        max_iterations=100 if chances == CHANCES else A_CHANCE,
    )
    feasible = found.feasible
    return found.coordinates[feasible], found.poses[feasible]
