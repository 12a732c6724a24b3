"""Inverse kinematics by closed form: coerce, call the kernel of the topology, wrap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pfabrik import Mechanism
from pfabrik.errors import InvalidArgument

from ..arrays import Floats, Mask
from .asked import as_poses, as_starts, what_is_wrong
from .targets import INVALID, REACHED
from .threads import in_blocks
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
    if not isinstance(mechanism, Mechanism):
        raise InvalidArgument("mechanism", type(mechanism).__name__, "a Mechanism")
    form = closed_form(mechanism)
    targets, shape = as_poses(target)
    n_actuators = len(mechanism.actuator_names)
    starts = form.home if start is None else as_starts(start, shape, n_actuators)
    actuators, status = np.empty((len(targets), n_actuators)), np.empty(len(targets), np.int64)

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
