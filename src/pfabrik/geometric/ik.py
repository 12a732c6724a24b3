"""Inverse kinematics by closed form: coerce, call the kernel of the topology, wrap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidArgument
from ..mechanism import Mechanism
from ..parallel import in_blocks
from ..poses import as_floats, as_targets, what_is_wrong
from .targets import INVALID, REACHED
from .topologies import closed_form

Floats = NDArray[np.float64]
ROWS_A_BLOCK = 4096
"""Rows that a core takes at once: enough to pay for the call, few enough to share a batch evenly."""


@dataclass(frozen=True, eq=False)
class Geometric:
    """What a closed form says of one target or, with leading batch axes on every field, of a batch.

    `bool(answer)` is whether the target, or every target of the batch, is reached.

    Attributes
    ----------
    reached : whether the geometry closes and every limit is kept, (...,); a plain bool for one target.
    actuators : actuated coordinates in the order of `mechanism.actuators`, (..., n_a) [length or rad]; NaN where not.
    shape : the batch axes, () for one target.
    """

    reached: Any
    actuators: Floats
    shape: tuple[int, ...]

    def __bool__(self) -> bool:
        return bool(np.all(self.reached))


def solve_ik(mechanism: Mechanism, target: Any, *, seed: Any = None) -> Geometric:
    """Actuator values that put the end effector on a target, by the closed form of the mechanism's topology.

    One answer a target: home's working mode, and of a redundant arm the coordinates nearest to the seed's.

    Parameters
    ----------
    target : pose (..., 4, 4) of the end effector in the base frame [length], position (..., 3) at home orientation, or
        a SciPy RigidTransform; leading axes are a batch.
    seed : an answer (anything with `actuators`), single or one for each target, next to whose redundant coordinates
        the answer is to be; without redundancy it changes nothing. Default: home.

    Raises
    ------
    NoClosedForm : the mechanism's topology has none here.
    InvalidArgument : a target or seed of the wrong shape, or rows that are no poses.
    """
    if not isinstance(mechanism, Mechanism):
        raise InvalidArgument("mechanism", type(mechanism).__name__, "a Mechanism, as `load` returns")
    form = closed_form(mechanism)
    targets, shape = as_targets(target)
    seeds = form.home if seed is None else _seeds(seed, shape, len(mechanism.actuators))
    actuators = np.empty((len(targets), len(mechanism.actuators)))
    status = np.empty(len(targets), np.int8)

    def run(rows: slice) -> int:
        own = seeds if len(seeds) == 1 else seeds[rows]
        return form.kernel(form.plan, targets[rows], own, seed is None, actuators[rows], status[rows])

    if sum(in_blocks(run, len(targets), ROWS_A_BLOCK)):
        bad = np.flatnonzero(status == INVALID)
        found = what_is_wrong(targets[bad[0]])
        raise InvalidArgument("target", found, "finite poses whose rotation is one", rows=[int(i) for i in bad[:5]])
    reached = (status == REACHED).reshape(shape)
    return Geometric(reached if shape else bool(reached), actuators.reshape(*shape, len(mechanism.actuators)), shape)


def _seeds(seed: Any, shape: tuple[int, ...], n_actuators: int) -> Floats:
    """The actuators of a seed, (1 or n, n_a); InvalidArgument where they do not fit, or are none."""
    expected = f"an answer with {n_actuators} actuators, single or of batch shape {shape}"
    if not hasattr(seed, "actuators"):
        raise InvalidArgument("seed", type(seed).__name__, expected)
    values = as_floats("seed", seed.actuators, expected)
    if values.shape not in ((n_actuators,), (*shape, n_actuators)):
        raise InvalidArgument("seed", f"actuators of shape {values.shape}", expected)
    values = values.reshape(-1, n_actuators)
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise InvalidArgument(
            "seed", "actuators that are not finite", "reached answers", rows=[int(i) for i in bad[:5]]
        )
    return values
