"""The start of a search: an answer, or joint coordinates."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..common.arguments import array
from ..common.arrays import Floats
from ..engines.engine import engine_of
from ..engines.joints.close import measure_configurations
from ..engines.joints.configurations import Configurations
from ..errors import InvalidArgument
from ..kernels.rows import FAILED
from ..machine.description.mechanism import Mechanism, checked_mechanism, moves_alike, told_apart
from ..machine.model import model_of
from ..machine.motion.displacements import home_coordinates
from .solution import Solution

Start: TypeAlias = Solution | ArrayLike
"""A Solution, or joint coordinates q (..., nq) in the order of `mechanism.coordinate_names` [rad or length]."""


def start_of(mechanism: Mechanism, start: Start | None, shape: tuple[int, ...]) -> Configurations | None:
    """The configurations from which a batch of this shape starts: one for all rows or one for each; None for home.

    Raises
    ------
    InvalidArgument : the start is neither an answer of this mechanism nor joint coordinates of it, is not feasible, or
        has another batch shape.
    """
    if start is None:
        return None
    if not isinstance(start, Solution):
        deviations, start_shape = joint_vectors(mechanism, start, "start")
        _require_shape(start_shape, shape)
        return engine_of(mechanism).as_configurations(measure_configurations(model_of(mechanism), deviations))
    if start.mechanism != mechanism and not moves_alike(start.mechanism, mechanism):
        found = f"an answer of {told_apart(start.mechanism, mechanism)}"
        raise InvalidArgument("start", found, f"one of '{mechanism.name}' itself, or joint coordinates")
    if np.count_nonzero(start._rows.status >= FAILED):
        raise InvalidArgument("start", "an answer that is FAILED or INVALID", "a feasible configuration")
    _require_shape(start.shape, shape)
    return start._configurations


def joint_vectors(mechanism: Mechanism, q: ArrayLike, name: str) -> tuple[Floats, tuple[int, ...]]:
    """Joint vectors as deviations from home, (n, nq), and the batch shape they came in."""
    home = home_coordinates(checked_mechanism(mechanism))
    given = array(name, q, f"... {len(home)}", "finite numbers", ": all joint coordinates, or a Solution")
    return given.reshape(-1, len(home)) - home, given.shape[:-1]


def _require_shape(start_shape: tuple[int, ...], shape: tuple[int, ...]) -> None:
    if start_shape not in ((), shape):
        raise InvalidArgument("start", f"batch shape {start_shape}", f"a single configuration or batch shape {shape}")
