"""Targets in: poses, positions, and joint coordinates, as poses (n, 4, 4)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats, Ints
from .description.mechanism import Mechanism, checked_mechanism
from .description.task import task_of
from .errors import InvalidArgument
from .kernels.rows import INVALID
from .motion.displacements import columns, home_coordinates, joint_displacements
from .options import Options
from .poses import DOUBLE, SupportsMatrix, as_floats, as_poses, what_is_wrong

Target: TypeAlias = ArrayLike | SupportsMatrix | Mapping[str, ArrayLike]
"""Poses (..., 4, 4), positions (..., 3), a SciPy RigidTransform, or joint name -> coordinates."""


def as_targets(mechanism: Mechanism, target: Target) -> tuple[Floats, tuple[int, ...]]:
    """Targets as poses (n, 4, 4), C-contiguous, and the batch shape they came in.

    Raises
    ------
    InvalidArgument : a wrong shape; joint coordinates of another joint than the one between base and end effector.
    """
    checked_mechanism(mechanism)
    if type(target) is np.ndarray and target.shape == (4, 4) and target.dtype is DOUBLE and target.flags.carray:
        return target[None], ()
    if isinstance(target, Mapping):
        return _from_joint(mechanism, target)
    poses, shape = as_poses(target)
    if not any(task_of(mechanism).axes) and np.shape(cast(Any, target)) == (*shape, 3):
        raise InvalidArgument("target", "positions", f"poses: the task of '{mechanism.name}' has no position")
    return poses, shape


def carrying_joint(mechanism: Mechanism) -> str | None:
    """The one joint, fixed ones aside, that connects base and end effector; None where none or several do."""
    between = {mechanism.base, mechanism.end_effector}
    joints = [joint.name for joint in mechanism.joints if set(joint.connects) == between and joint.type != "fixed"]
    return joints[0] if len(joints) == 1 else None


def _from_joint(mechanism: Mechanism, target: Mapping[str, Any]) -> tuple[Floats, tuple[int, ...]]:
    """Poses that have given coordinates at the one joint that connects base and end effector."""
    name = carrying_joint(mechanism)
    given = ", ".join(map(str, target)) or "no joint"
    if name is None:
        expected = "a pose or position: no single joint connects base and end effector here"
        raise InvalidArgument("target", f"joint coordinates of {given}", expected)
    if list(target) != [name]:
        raise InvalidArgument("target", f"coordinates of {given}", f"those of '{name}'")
    span = columns(mechanism)[name]
    n = span.stop - span.start
    expected = f"finite coordinates of shape (..., {n})" if n > 1 else "finite coordinates of shape (...)"
    values = as_floats(f"target['{name}']", target[name], expected)
    values = values if n > 1 else values[..., None]
    if values.shape[-1:] != (n,):
        raise InvalidArgument(f"target['{name}']", f"shape {values.shape}", expected)
    deviations = values.reshape(-1, n) - home_coordinates(mechanism)[span]
    known = np.isfinite(deviations).all(axis=1)
    moved = joint_displacements(mechanism, name, deviations[known])
    if mechanism.joint(name).connects[0] != mechanism.base:
        moved = np.asarray(np.linalg.inv(moved), np.float64)
    poses = np.full((len(deviations), 4, 4), np.nan)
    poses[known] = moved @ mechanism.home_pose
    return poses, values.shape[:-1]


def refuse_invalid(targets: Floats, shape: tuple[int, ...], status: Ints, options: Options) -> None:
    """Raise for rows that are no poses, naming the first of a batch, unless they are to be marked."""
    if (len(targets) == 1 and status[0] != INVALID) or options.on_invalid == "mark":
        return
    bad = np.flatnonzero(status == INVALID)
    if len(bad):
        found, first = what_is_wrong(targets[bad[0]]), bad[:5].tolist() if shape else ()
        raise InvalidArgument("target", found, "finite poses whose rotation is one", rows=first)
