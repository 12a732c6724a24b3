"""Torques along a path, by how fast it is followed: what a timing keeps within limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..answers.solution import Solution
from ..arrays import Floats, Ints
from ..errors import InvalidArgument
from ..statics.loads import BodyLoads, checked_gravity, has_reason
from .drives import drives_of
from .inverse_dynamics import reasons_of
from .moving_rows import MovingRows, in_si
from .weights import weights_of


def torque_rows(solution: Solution, slopes: Floats, gravity: ArrayLike, loads: BodyLoads | None, steps: Ints) -> Floats:
    """What torques along a path are made of, at places s, side by side, (n, n_a (n_a + 2)), in SI units; no friction.

    With actuators q(s) these are M (q' s'' + q'' s'^2) + h s'^2 + rest: the mass matrix M, what the motion itself takes
    at a speed of 1, h, and the torques at rest; of redundant actuators, the least.

    Parameters
    ----------
    slopes : q', (n, n_a).
    steps : the step of the path that each place is at, or after, for errors, (n,).

    Raises
    ------
    InvalidArgument : places at which there are no torques, with the reason.
    """
    mechanism = solution.mechanism
    rows = MovingRows(
        *(solution, "actuators", slopes, np.zeros(slopes.shape)),
        weights=weights_of(mechanism, loads),
        gravity=checked_gravity(gravity),
    )
    found = rows.efforts(["resting", "matrices"])
    reasons = reasons_of(solution, found.marks)
    bad = np.flatnonzero(has_reason(reasons))
    if len(bad):
        places = np.unique(steps[bad])[:5].tolist()
        raise InvalidArgument("track", f"no torques: {reasons[bad[0]]}", "a path that its actuators hold", rows=places)
    moved = found.actuators - found.resting - drives_of(mechanism).rubbed(slopes)
    masses = in_si(mechanism, "actuators", found.matrices)
    return np.concatenate([masses.reshape(len(slopes), -1), moved, found.resting], axis=1)
