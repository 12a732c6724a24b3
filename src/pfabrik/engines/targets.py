"""Targets in: poses, positions, and joint coordinates, as poses (n, 4, 4)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from ..common.arguments import DOUBLE, any_values, array
from ..common.arrays import Floats, Ints
from ..errors import InvalidArgument
from ..kernels.rows import INVALID
from ..machine.description.mechanism import Mechanism, checked_mechanism
from ..machine.description.task import task_of
from ..machine.motion.displacements import columns
from ..machine.motion.fitting_task import along_tilt
from ..machine.motion.joint_path import path_of
from ..machine.poses import SupportsMatrix, as_poses, what_is_wrong
from ..options import Options

Target: TypeAlias = ArrayLike | SupportsMatrix | Mapping[str, ArrayLike]
"""Poses (..., 4, 4), positions (..., 3), a SciPy RigidTransform, or joint name -> coordinates."""


def as_targets(mechanism: Mechanism, target: Target) -> tuple[Floats, tuple[int, ...]]:
    """Targets as poses (n, 4, 4), C-contiguous, and the batch shape they came in; tilts as of `along_tilt`.

    Raises
    ------
    InvalidArgument : a wrong shape; joints that do not lead in series from the base to the end effector.
    UnknownName : no joint of that name.
    """
    checked_mechanism(mechanism)
    if type(target) is np.ndarray and target.shape == (4, 4) and target.dtype is DOUBLE and target.flags.carray:
        return along_tilt(mechanism, target[None]), ()
    if isinstance(target, Mapping):
        return _from_joints(mechanism, target)
    poses, shape = as_poses(target)
    if not any(task_of(mechanism).axes) and np.shape(cast(Any, target)) == (*shape, 3):
        raise InvalidArgument("target", "positions", f"poses: the task of '{mechanism.name}' has no position")
    return along_tilt(mechanism, poses), shape


def carrying_joint(mechanism: Mechanism) -> str | None:
    """The one joint, fixed ones aside, that connects base and end effector; None where none or several do."""
    between = {mechanism.base, mechanism.end_effector}
    joints = [joint.name for joint in mechanism.joints if set(joint.connects) == between and joint.type != "fixed"]
    return joints[0] if len(joints) == 1 else None


def _from_joints(mechanism: Mechanism, target: Mapping[str, Any]) -> tuple[Floats, tuple[int, ...]]:
    """Poses at given coordinates of joints that stand in series between base and end effector."""
    try:
        path = path_of(mechanism, tuple(target))
    except InvalidArgument as error:
        raise InvalidArgument(
            "target", f"coordinates of {error.found}", f"a pose, or those of {error.expected}"
        ) from None
    names = tuple(target)
    values = [_joint_values(mechanism, name, target[name]) for name in names]
    try:
        shape = np.broadcast_shapes(*(array.shape[:-1] for array in values))
    except ValueError:
        shapes = ", ".join(str(array.shape[:-1]) for array in values)
        raise InvalidArgument("target", f"coordinates of batch shapes {shapes}", "shapes that agree") from None
    q = np.concatenate([np.broadcast_to(array, (*shape, array.shape[-1])) for array in values], axis=-1)
    return path.poses(q.reshape(-1, q.shape[-1])), shape


def _joint_values(mechanism: Mechanism, name: str, given: Any) -> Floats:
    """The coordinates (..., n) of a joint, or one of them (..., 1)."""
    joints = {joint.name for joint in mechanism.joints}
    span = columns(mechanism)[name] if name in joints else slice(0, 1)
    n = span.stop - span.start
    shape, what = f"... {n}" if n > 1 else "...", "finite coordinates"
    values = array(f"target['{name}']", given, shape, what, holds=any_values)  # rows may be marked
    return values if n > 1 else values[..., None]


def refuse_invalid(targets: Floats, shape: tuple[int, ...], status: Ints, options: Options) -> None:
    """Raise for rows that are no poses, naming the first of a batch, unless they are to be marked."""
    if (len(targets) == 1 and status[0] != INVALID) or options.on_invalid == "mark":
        return
    bad = np.flatnonzero(status == INVALID)
    if len(bad):
        found, first = what_is_wrong(targets[bad[0]]), bad[:5].tolist() if shape else ()
        raise InvalidArgument("target", found, "finite poses whose rotation is one", rows=first)
