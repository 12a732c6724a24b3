"""Answers against MuJoCo's own kinematics and constraint rows, on the model that we export."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats
from ..description.home_mobility import end_effector_freedom
from ..description.mechanism import Mechanism
from ..rotations import angles_between
from .cuts import cut_tree
from .mjcf_bodies import names_of
from .mjcf_qpos import qpos_of
from .mjcf_writing import to_mjcf
from .robot_in_mujoco import RobotInMujoco

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
