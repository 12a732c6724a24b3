"""Answers against MuJoCo's own kinematics and constraint rows, on the model that we export."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...common.arrays import Floats
from ...common.rotations import angles_between
from ...fk import solve_fk
from ...ik import solve_ik
from ...kinematics import generic_of
from ...machine.description.home_mobility import end_effector_freedom
from ...machine.description.mechanism import Mechanism
from ...machine.poses import pose
from .cuts import cut_tree
from .mjcf_bodies import names_of
from .mjcf_qpos import qpos_of
from .mjcf_writing import to_mjcf
from .robot_in_mujoco import RobotInMujoco

SPREAD = (0.2, 0.35)
"""Largest distance of random targets from home, in each coordinate [L, rad]."""

MOST_DRAWS = 8
"""Most draws of random targets, then of actuator values: each of as many as are wanted, until enough are reached."""


class Travelled(NamedTuple):
    """The distances of configurations from home.

    Attributes
    ----------
    drives : dict of str to float
        Actuator -> the span of its values [rad or length].
    shares : dict of str to float
        Actuator -> the span as a share of its range, or of what was tried where that is less; 1 at most.
    position, rotation : float
        The farthest that the end effector was from home [length], [rad].
    """

    drives: dict[str, float]
    shares: dict[str, float]
    position: float
    rotation: float


def reached_at_random(mechanism: Mechanism, count: int, rng: np.random.Generator) -> list[Solution]:
    """Reached configurations around home, at most `count`.

    Answers to random targets, nearer to home while most are out of reach; where targets are hardly ever reached, as
    where they set more than the end effector can do, answers to random actuator values.
    """
    solutions: list[Solution] = []
    for solve, draw in ((solve_ik, _targets), (solve_fk, _actuators)):
        near = 1.0
        for _ in range(MOST_DRAWS):
            if len(solutions) == count:
                return solutions
            block = solve(mechanism, draw(mechanism, count, near, rng))
            reached = np.flatnonzero(np.asarray(block.status) == Status.REACHED)
            solutions += [block[int(row)] for row in reached[: count - len(solutions)]]
            near *= 0.6 if 2 * len(reached) < count else 1.0
    return solutions


def travelled(mechanism: Mechanism, solutions: Sequence[Solution]) -> Travelled:
    """The distances of some configurations, at least one, from home."""
    values = np.array([solution.actuators for solution in solutions])
    spans = np.ptp(np.concatenate([[[drive.home for drive in mechanism.drives]], values]), axis=0)
    poses = np.array([solution.pose for solution in solutions])
    shifts = np.linalg.norm(poses[:, :3, 3] - mechanism.home_pose[:3, 3], axis=1)
    turns = angles_between(poses[:, :3, :3], mechanism.home_pose[:3, :3])
    names = mechanism.actuator_names
    shares = {}
    for drive, span, most in zip(mechanism.drives, spans, _most(mechanism), strict=True):
        shares[drive.name] = min(1.0, float(span / min(drive.limits[1] - drive.limits[0], 2.0 * most)))
    return Travelled(dict(zip(names, spans.tolist(), strict=True)), shares, float(shifts.max()), float(turns.max()))


def _most(mechanism: Mechanism) -> Floats:
    """Largest distance of actuators from home, (n_a,) [rad or length]."""
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


APART = 1e-3
"""How far passive joints are moved off before MuJoCo's rows close the loops by themselves [rad or L]."""

EXACT = 1e-9
"""Singular value, relative to the largest, below which a row of the loops follows from others: the model is exact."""


def on_export(mechanism: Mechanism, solutions: Iterable[Solution], rng: np.random.Generator) -> Floats:
    """Loop gap at answers [m], and how far they are from the poses that MuJoCo closes to [m], [rad]; the largest."""
    robot = RobotInMujoco(mechanism, to_mjcf(mechanism), "qpos0", EXACT)
    site = robot.data.site(names_of(mechanism, cut_tree(mechanism)).reference)
    is_determined = end_effector_freedom(mechanism, frozenset(drive.column for drive in mechanism.drives)) == 0
    slides = robot.is_slide[robot.model.dof_jntid]
    units = np.where(slides, robot.metres * mechanism.characteristic_length, 1.0) * robot.passive
    largest = np.zeros(3)
    for solution in solutions:
        robot.take(qpos_of(mechanism, solution.q))
        gap, _ = robot.gap()
        if is_determined:
            robot.move(rng.uniform(-APART, APART, robot.model.nv) * units)
        robot.close()
        apart = distances(solution, site.xpos, site.xmat.reshape(3, 3), robot.metres)
        largest = np.maximum(largest, [gap, *apart])
    return largest


def distances(solution: Solution, position: Floats, turn: Floats, metres: float) -> tuple[float, float]:
    """Distances of an answer's pose from a position (3,) [m] and an orientation (3, 3), [m] and [rad]."""
    apart = float(np.linalg.norm(position - solution.pose[:3, 3] * metres))
    is_point = solution.mechanism.end_effector_is_joint
    return apart, 0.0 if is_point else float(angles_between(turn, solution.pose[:3, :3]))
