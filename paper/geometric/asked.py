"""Targets and starts as they are given, to arrays that the compiled code takes."""

from __future__ import annotations

from typing import Any

import numpy as np

from pfabrik.errors import InvalidArgument

from ..arrays import Floats
from ..tolerances import ROTATION_MATRIX

TARGETS = "poses of shape (..., 4, 4) or positions of shape (..., 3)"


def as_floats(name: str, value: Any, expected: str) -> Floats:
    """`value` as an array of float64 in rows; InvalidArgument for what is none."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InvalidArgument(name, "a ragged nest of sequences", expected) from error
    if array.dtype.kind not in "iuf":
        raise InvalidArgument(name, f"{type(value).__name__} of dtype {array.dtype}", expected)
    if array.dtype == np.float64 and array.flags.carray:
        return array
    return np.array(array, np.float64, order="C")  # the one memory layout that kernels are compiled for


def as_poses(target: Any) -> tuple[Floats, tuple[int, ...]]:
    """Poses (n, 4, 4), and the batch shape they came in; whether the numbers make poses is for the kernel to see.

    Positions (..., 3) are at home orientation; an object with ``as_matrix`` that gives poses is taken too.
    """
    array = as_floats("target", target.as_matrix() if hasattr(target, "as_matrix") else target, TARGETS)
    if array.shape[-2:] == (4, 4):
        return array.reshape(-1, 4, 4), array.shape[:-2]
    if array.ndim and array.shape[-1] == 3 and not hasattr(target, "as_matrix"):
        poses = np.tile(np.eye(4), (array.size // 3, 1, 1))
        poses[:, :3, 3] = array.reshape(-1, 3)
        return poses, array.shape[:-1]
    raise InvalidArgument("target", f"shape {array.shape}", TARGETS)


def what_is_wrong(target: Floats) -> str:
    """Why a (4, 4) array is not a pose, in words."""
    if not np.isfinite(target).all():
        return "a number that is not finite"
    if not np.allclose(target[3], (0, 0, 0, 1), atol=ROTATION_MATRIX, rtol=0):
        return f"a last row {target[3].tolist()}"
    return "a matrix that is not a rotation"


def as_starts(start: Any, shape: tuple[int, ...], n_actuators: int) -> Floats:
    """The actuators of a start, (1 or n, n_a); InvalidArgument where they do not fit, or are none."""
    expected = f"an answer with {n_actuators} actuators, single or of batch shape {shape}"
    if not hasattr(start, "actuators"):
        raise InvalidArgument("start", type(start).__name__, expected)
    values = as_floats("start", start.actuators, expected)
    if values.shape not in ((n_actuators,), (*shape, n_actuators)):
        raise InvalidArgument("start", f"actuators of shape {values.shape}", expected)
    values = values.reshape(-1, n_actuators)
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise InvalidArgument("start", "actuators that are not finite", "reached answers", rows=bad[:5].tolist())
    return values
