"""Torques along a path, by how fast it is followed: what a timing keeps within limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..answers.solution import Solution
from ..arrays import Floats, Ints
from ..errors import InvalidArgument
from ..files.units import metres_of
from ..statics.loads import BodyLoads, add_reason, checked_gravity, checked_loads, has_reason
from ..statics.transmission import NO_CONFIGURATION
from .drives import drives_of
from .inverse_dynamics import AskedMotion, reasons_of, rows_of
from .weights import loads_of


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
    metres, n = metres_of(mechanism.length_unit), len(slopes)
    weights, drives = loads_of(mechanism, metres, checked_loads(mechanism, loads)), drives_of(mechanism)
    asked = AskedMotion(solution, None, "actuators", slopes, np.zeros(slopes.shape))
    moving = rows_of(asked, np.arange(n), weights, checked_gravity(gravity))
    found = moving.efforts(["resting", "matrices"])
    reasons = reasons_of(mechanism, found.marks)
    add_reason(reasons, np.isnan(moving.q).any(axis=1), NO_CONFIGURATION)
    bad = np.flatnonzero(has_reason(reasons))
    if len(bad):
        rows = np.unique(steps[bad])[:5].tolist()
        raise InvalidArgument("track", f"no torques: {reasons[bad[0]]}", "a path that its actuators hold", rows=rows)
    moved = found.actuators - found.resting - drives.rubbed(slopes)
    return np.concatenate([moving.in_si(found.matrices).reshape(n, -1), moved, found.resting], axis=1)
