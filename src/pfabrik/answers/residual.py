"""The independent check: whether an answer closes its mechanism's loops, worked out from its joint coordinates."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..description.task import Task
from ..motion.displacements import actuator_units, end_effector_pose, gaps
from .solution import Solution, checked_solution


def closure_residual(solution: Solution) -> float | Floats:
    """Largest gap of any loop of an answer, by the closure engine, (...,) [length].

    Bodies are posed from `solution.joints` alone, along one tree of joints. Compared are the two bodies of every other
    joint, the end effector with the pose of the answer, and the actuated joints with its actuator values; angles count
    times L. NaN for INVALID rows.

    Raises
    ------
    InvalidArgument : what is no Solution.
    """
    mechanism = checked_solution(solution).mechanism
    length, rows, q = mechanism.characteristic_length, solution._rows, solution._coordinates
    known = np.isfinite(q).all(axis=1)
    found = np.full(len(q), np.nan)
    compared = Task((True, True, True), 0 if mechanism.end_effector_is_joint else 3)
    position, rotation = compared.errors(end_effector_pose(mechanism, q[known]), rows.poses[known])
    found[known] = np.max([gaps(mechanism, q[known]), position, rotation * length], axis=0)
    for place, (drive, unit) in enumerate(zip(mechanism.drives, actuator_units(mechanism), strict=True)):
        value = q[known, drive.column] + drive.home
        found[known] = np.maximum(found[known], np.abs(value - rows.actuators[known, place]) * (length / unit))
    return float(found[0]) if solution.shape == () else found.reshape(solution.shape)
