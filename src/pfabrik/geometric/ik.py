"""Inverse kinematics by closed form: coerce, call the kernel of the topology, wrap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Floats, Mask
from ..description.mechanism import Mechanism, checked_mechanism
from ..errors import InvalidArgument
from ..kernels.threads import in_blocks
from ..poses import as_floats, as_poses, what_is_wrong
from .targets import INVALID, REACHED
from .topologies import closed_form

ROWS_A_BLOCK = 4096
"""Rows that a core takes at once: enough to pay for the call, few enough to share a batch evenly."""


@dataclass(frozen=True, eq=False)
class Geometric:
    """What a closed form says of one target or, with leading batch axes on every field, of a batch.

    `bool(answer)` is whether the target, or every target of the batch, is reached.

    Attributes
    ----------
    reached : whether the geometry closes and every limit is kept, (...,); a plain bool for one target.
    actuators : actuated coordinates in the order of `mechanism.actuator_names`, (..., n_a) [length or rad]; NaN where
        not reached.
    """

    reached: bool | Mask
    actuators: Floats

    def __bool__(self) -> bool:
        return bool(np.all(self.reached))


def solve_ik(mechanism: Mechanism, target: Any, *, start: Any = None) -> Geometric:
    """Actuator values that put the end effector on a target, by the closed form of the mechanism's topology.

    One answer a target. A leg of crank and forearm is in home's branch, or in its other one where only that closes and
    keeps its limits; struts have one solution; the redundant coordinates of an arm stay next to the start's.

    Parameters
    ----------
    target : pose (..., 4, 4) of the end effector in the base frame [length], position (..., 3) at home orientation, or
        a SciPy RigidTransform; leading axes are a batch.
    start : an answer (anything with `actuators`), single or one for each target; only redundant arms read it. Default:
        home.

    Raises
    ------
    NoClosedForm : the mechanism's topology has none.
    InvalidArgument : a target or start of the wrong shape, or rows that are no poses.
    """
    checked_mechanism(mechanism)
    form = closed_form(mechanism)
    targets, shape = as_poses(target)
    n_actuators = len(mechanism.actuator_names)
    starts = form.home if start is None else _starts(start, shape, n_actuators)
    actuators, status = np.empty((len(targets), n_actuators)), np.empty(len(targets), np.int8)

    def run(block: slice) -> int:
        own = starts if len(starts) == 1 else starts[block]
        return form.kernel(form.plan, targets[block], own, start is None, actuators[block], status[block])

    in_blocks(run, len(targets), ROWS_A_BLOCK)
    bad = np.flatnonzero(status == INVALID)
    if len(bad):
        found = what_is_wrong(targets[bad[0]])
        raise InvalidArgument("target", found, "finite poses whose rotation is one", rows=bad[:5].tolist())
    reached = (status == REACHED).reshape(shape)
    return Geometric(reached if shape else bool(reached), actuators.reshape(*shape, n_actuators))


def _starts(start: Any, shape: tuple[int, ...], n_actuators: int) -> Floats:
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
