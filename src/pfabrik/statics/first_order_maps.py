"""Forward Jacobians of the rows of a solution, and at which of them they say all: away from singularities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..answers.differential import forward_jacobian, singularity
from ..answers.solution import Solution
from ..answers.status import Status
from ..arrays import Floats, Mask
from ..description.mechanism import Mechanism
from ..errors import counted
from ..kinematics import generic_of, model_of
from ..platform.jacobians import regular_forward_map
from ..tolerances import TOLERANCES
from .reasons import Reasons, add_reason, no_reasons

NO_CONFIGURATION = "the row is INVALID: it has no configuration"
GIVES_WAY = "a parallel singularity: the end effector moves with all actuators locked"
GAINS_MOTION = "a constraint singularity: the loops let the machine move in more ways than elsewhere"
LEFT_OPEN = "the end effector keeps {} with all actuators locked, in every pose"


class Maps(NamedTuple):
    """Forward Jacobians of n rows, in the machine's units.

    Attributes
    ----------
    forward : twists per actuator rate, (n, 6, n_a), or (n, 3, n_a) for a joint end effector.
    is_valid : False for INVALID rows, (n,).
    is_regular : True where the machine has the motions that it has in general, controlled by its actuators, (n,).
    reasons : why the Jacobian does not tell how the end effector moves; empty where it does, (n,).
    """

    forward: Floats
    is_valid: Mask
    is_regular: Mask
    reasons: Reasons


def maps_of(solution: Solution) -> Maps:
    """The forward Jacobians of a solution's rows.

    By the legs' slopes, which are enough away from singularities, else by all joints, which are slower but tell these.
    """
    mechanism, is_valid = solution.mechanism, np.asarray(solution._rows.status != Status.INVALID)
    rows = Solution(mechanism, solution._configurations, is_valid.shape)
    forward = regular_forward_map(model_of(mechanism), rows._configurations)
    if forward is None:
        is_asked, forward = is_valid, np.array(forward_jacobian(rows))
    else:
        is_asked = is_valid & np.isnan(forward[:, 0, 0])
    asked = np.flatnonzero(is_asked)
    is_regular, reasons = is_valid & ~is_asked, no_reasons(len(is_valid))
    add_reason(reasons, ~is_valid, NO_CONFIGURATION)
    if len(asked):
        found = singularity(rows[asked])
        forward[asked] = forward_jacobian(rows[asked])
        least = np.stack([found.constraint, found.parallel, found.serial, found.passive]) < TOLERANCES.singular
        add_reason(reasons, asked[least[0]], GAINS_MOTION)
        add_reason(reasons, asked[least[1]], gives_way_in_words(mechanism))
        is_regular[asked] = ~least.any(axis=0)
    return Maps(forward, is_valid, is_regular, reasons)


def twist_units(mechanism: Mechanism) -> Floats:
    """The units of a twist [velocity of the reference point; angular velocity]: L and 1, (6,) or (3,)."""
    length = mechanism.characteristic_length
    return np.array([length] * 3 if mechanism.end_effector_is_joint else [length] * 3 + [1.0] * 3)


def gives_way_in_words(mechanism: Mechanism) -> str:
    """Why actuators do not hold the end effector, in general or at a configuration."""
    uncontrolled = generic_of(mechanism).mobility.uncontrolled
    return LEFT_OPEN.format(counted(uncontrolled, "freedom")) if uncontrolled else GIVES_WAY


def is_redundantly_actuated(mechanism: Mechanism) -> bool:
    """True if actuators can work against each other: there are more than motions that they control."""
    counts = generic_of(mechanism).mobility
    return counts.actuators > counts.platform + counts.internal - counts.uncontrolled
