"""Torques along a path, by how fast it is followed: what a timing keeps within limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..answers.solution import Solution
from ..arrays import Floats, Ints
from ..errors import InvalidArgument
from ..files.units import metres_of
from ..statics.loads import BodyLoads, has_reason
from .drives import Drives
from .inverse_dynamics import inverse_dynamics
from .mass_matrix import mass_matrix


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

    def torques(rates: Floats | None) -> Floats:
        found = inverse_dynamics(solution, twists=rates, at="actuators", gravity=gravity, loads=loads)
        bad = np.flatnonzero(has_reason(np.ravel(found.reason)))
        if len(bad):
            words, rows = str(np.ravel(found.reason)[bad[0]]), np.unique(steps[bad])[:5].tolist()
            raise InvalidArgument("track", f"no torques: {words}", "a path that its actuators hold", rows=rows)
        return found.actuators

    drives = Drives(mechanism, metres_of(mechanism.length_unit))
    rest, masses = torques(None), mass_matrix(solution, "actuators", loads=loads)
    return np.concatenate([masses.reshape(len(rest), -1), torques(slopes) - rest - drives.rubbed(slopes), rest], axis=1)
