"""Joints in series as coordinates of an exported file: they must fit the actuators."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..answers.differential import inverse_jacobian
from ..checks import require_names
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..ik import solve_ik
from ..motion.joint_path import JointPath, joint_path
from ..tolerances import TOLERANCES
from .machine_data import Machine
from .self_test import KEEP

N_TRIED = 30
NEAR = 0.05
"""Configurations around home by which joints are judged: how many, and how far off [L or rad]."""


def fitting_path(mechanism: Mechanism, machine: Machine, joints: str | Sequence[str]) -> JointPath:
    """The path of named joints, which move freely, and determine the actuators as these determine them.

    Raises
    ------
    UnsupportedMechanism : they do not.
    UnknownName, InvalidArgument : no such joints, or not in series.
    """
    path = joint_path(mechanism, require_names("joints", [joints] if isinstance(joints, str) else joints))
    if reason := _unfit(mechanism, machine, path):
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    return path


def _unfit(mechanism: Mechanism, machine: Machine, path: JointPath) -> str:
    """Why joints cannot be the coordinates; empty if they can."""
    names, length = ", ".join(path.names), mechanism.characteristic_length
    if any(motion.kind == "ball" for motion in path.motions):
        return f"joints {names}: a ball has no coordinates here, name hinges"
    units = np.array([1.0 if each.kind == "angle" else length for each in path.coordinates])
    q = path.home + NEAR * units * np.random.default_rng(0).uniform(-1.0, 1.0, (N_TRIED, len(units)))
    poses, twists = path.poses_and_twists(q)
    solution = solve_ik(mechanism.without_limits(), poses, options=KEEP)
    off = np.abs(solution.pose - poses).max(axis=(1, 2)) / max(length, 1.0)
    if not ((off <= 10.0 * TOLERANCES.position) & (solution.status == 0)).all():
        return f"joints {names} are not independent: its legs let them move only together"
    jacobian = inverse_jacobian(solution) @ twists
    jacobian = jacobian * units / np.where([driven.is_length for driven in machine.driven], length, 1.0)[:, None]
    smallest = np.linalg.svd(jacobian, compute_uv=False)[:, len(units) - 1 :]
    if not smallest.size or np.median(smallest) <= TOLERANCES.rank:
        return f"its actuators do not determine joints {names}"
    return ""
