"""The closure residual of an answer, computed independently from its joint coordinates."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..description.task import Task
from ..motion.displacements import actuator_units, end_effector_pose, gaps
from .solution import Solution, checked_solution


def closure_residual(solution: Solution) -> float | Floats:
    """Largest gap of any loop of an answer, (...,) [length].

    Bodies are posed from `solution.joints` alone, along a spanning tree of joints. The residual is the largest gap
    between the two bodies of every other joint, between the end effector and the pose of the answer, and between the
    actuated joints and its actuator values; angles are multiplied by L. NaN for INVALID rows.

    Raises
    ------
    InvalidArgument : the argument is no Solution.
    """
    mechanism = checked_solution(solution).mechanism
    length, rows, q = mechanism.characteristic_length, solution._rows, solution._coordinates
    valid = np.isfinite(q).all(axis=1)
    residuals = np.full(len(q), np.nan)
    whole_pose = Task((True, True, True), 0 if mechanism.end_effector_is_joint else 3)
    position, rotation = whole_pose.errors(end_effector_pose(mechanism, q[valid]), rows.poses[valid])
    residuals[valid] = np.max([gaps(mechanism, q[valid]), position, rotation * length], axis=0)
    for place, (drive, unit) in enumerate(zip(mechanism.drives, actuator_units(mechanism), strict=True)):
        value = q[valid, drive.column] + drive.home
        residuals[valid] = np.maximum(residuals[valid], np.abs(value - rows.actuators[valid, place]) * (length / unit))
    return float(residuals[0]) if solution.shape == () else residuals.reshape(solution.shape)
