"""Reached configurations of a mechanism for a referee to look at, and how far from home they go."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..answers.solution import Solution
from ..answers.status import Status
from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..fk import solve_fk
from ..ik import solve_ik
from ..motion.mobility import generic_of
from ..poses import pose
from ..rotations import angles_between

SPREAD = (0.2, 0.35)
"""How far from home random targets are at most, in each coordinate [L, rad]."""

MOST_DRAWS = 8
"""How often random targets, then actuator values, are drawn: each time as many as are asked for, until enough are
reached."""


class Travelled(NamedTuple):
    """How far configurations went.

    Attributes
    ----------
    drives : actuator -> the span of its values [rad or length].
    shares : actuator -> the span as a share of its range, or of what was tried where that is less; 1 at most.
    position, rotation : the farthest that the end effector was from home [length], [rad].
    """

    drives: dict[str, float]
    shares: dict[str, float]
    position: float
    rotation: float


def reached_at_random(mechanism: Mechanism, count: int, rng: np.random.Generator) -> list[Solution]:
    """Reached configurations around home, as many as are asked for if so many are found.

    Answers to random targets, nearer to home while most are out of reach; where targets are hardly ever reached, as
    where they set more than the end effector can do, answers to random actuator values.
    """
    found: list[Solution] = []
    for ask, drawn in ((solve_ik, _targets), (solve_fk, _actuators)):
        near = 1.0
        for _ in range(MOST_DRAWS):
            if len(found) == count:
                return found
            answers = ask(mechanism, drawn(mechanism, count, near, rng))
            reached = np.flatnonzero(np.asarray(answers.status) == Status.REACHED)
            found += [answers[int(row)] for row in reached[: count - len(found)]]
            near *= 0.6 if 2 * len(reached) < count else 1.0
    return found


def travelled(mechanism: Mechanism, found: Sequence[Solution]) -> Travelled:
    """How far some configurations went, at least one."""
    values = np.array([solution.actuators for solution in found])
    spans = np.ptp(np.concatenate([[[drive.home for drive in mechanism.drives]], values]), axis=0)
    poses = np.array([solution.pose for solution in found])
    shifts = np.linalg.norm(poses[:, :3, 3] - mechanism.home_pose[:3, 3], axis=1)
    turns = angles_between(poses[:, :3, :3], mechanism.home_pose[:3, :3])
    names = mechanism.actuator_names
    shares = {}
    for drive, span, most in zip(mechanism.drives, spans, _most(mechanism), strict=True):
        shares[drive.name] = min(1.0, float(span / min(drive.limits[1] - drive.limits[0], 2.0 * most)))
    return Travelled(dict(zip(names, spans.tolist(), strict=True)), shares, float(shifts.max()), float(turns.max()))


def _most(mechanism: Mechanism) -> Floats:
    """How far actuators are taken from home at most, (n_a,) [rad or length]."""
    shift, turn = SPREAD
    turns = np.array([drive.kind == "angle" for drive in mechanism.drives])
    return np.where(turns, turn, shift * mechanism.characteristic_length)


def _actuators(mechanism: Mechanism, count: int, near: float, rng: np.random.Generator) -> Floats:
    """Actuated values (n, n_a) off home, within their ranges; `near` scales how far."""
    most = near * _most(mechanism)
    home = [drive.home for drive in mechanism.drives]
    low, high = np.transpose([drive.limits for drive in mechanism.drives])
    return np.clip(home + rng.uniform(-most, most, (count, len(most))), low, high)


def _targets(mechanism: Mechanism, count: int, near: float, rng: np.random.Generator) -> Floats:
    """Poses (n, 4, 4) off home in those directions that the end effector has at all; `near` scales how far."""
    directions = generic_of(mechanism).directions
    most = near * np.repeat(SPREAD, 3)[: len(directions)]
    twists = rng.uniform(-most, most, (count, len(directions))) @ directions @ directions.T
    turns = twists[:, 3:] if twists.shape[1] > 3 else np.zeros((count, 3))
    return pose(mechanism.reference_point + mechanism.characteristic_length * twists[:, :3], rotvec=turns)
