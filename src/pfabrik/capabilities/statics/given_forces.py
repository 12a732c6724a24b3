"""Forces of the actuators as arguments: the load that they hold, and cables among them that are slack."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import compress

import numpy as np
from numpy.typing import ArrayLike

from ...answers.differential import inverse_jacobian
from ...answers.solution import Solution
from ...common.arguments import as_floats
from ...common.arrays import Floats, shaped
from ...common.checks import require_known, require_names
from ...errors import InvalidArgument
from ...kinematics import actuator_units
from ...tolerances import TOLERANCES
from .forces import Forces, forces
from .joint_balance import pairs_of
from .loads import add_reason, in_shape, no_reasons

PUSHES = "cables alone do not hold the load like this: {} would push"
UNBALANCED = "no load on the end effector asks for these forces of the actuators alone"
EXPECTED = "what actuators exert, (..., n_a) or of `forces`, which says what cables are slack"


def exerted_of(solution: Solution, given: Forces | ArrayLike) -> Floats:
    """What the actuators exert, (n, n_a)."""
    values = given.actuators if isinstance(given, Forces) else as_floats("forces", given, EXPECTED)
    shape = (*solution.shape, len(solution.mechanism.actuator_names))
    if values.shape not in (shape, shape[-1:]):
        raise InvalidArgument("forces", f"shape {values.shape}", f"shape {shape}")
    if np.isinf(values).any():
        raise InvalidArgument("forces", "infinite ones", "numbers, or NaN where they are not known")
    return np.broadcast_to(values, shape).reshape(-1, shape[-1])


def slack_cables(solution: Solution, cables: Sequence[str], given: Forces | ArrayLike | None) -> Floats:
    """1 for actuators that are slack cables, 0 for all others, NaN where that is not known, (n, n_a)."""
    names = solution.mechanism.actuator_names
    slack = np.zeros((len(solution._rows.poses), len(names)))
    chosen = require_names("cables", cables)
    require_known("actuator", chosen, names)
    places = [names.index(cable) for cable in chosen]
    if places:
        if given is None:
            raise InvalidArgument("forces", "None", EXPECTED)
        pulls = exerted_of(solution, given)[:, places]
        slack[:, places] = np.where(np.isnan(pulls), np.nan, pulls >= 0.0)
    return slack


def loaded(solution: Solution, given: Forces | ArrayLike, slack: Floats) -> Forces:
    """The forces with the load that they hold, and a reason where they hold none.

    Of an array, in which slack cables exert nothing, it is a wrench on the end effector, -J't with the inverse
    Jacobian J.

    Raises
    ------
    InvalidArgument : forces of other configurations.
    """
    mechanism, exerted, is_slack = solution.mechanism, exerted_of(solution, given), slack == 1.0
    size = TOLERANCES.alignment * np.abs(exerted).max(axis=1, initial=0.0)
    if isinstance(given, Forces):
        if not given._is_at(solution):
            raise InvalidArgument("forces", "forces of other configurations", "those of this solution")
        found, wrong = given, is_slack & (exerted > size[:, None])
        words = [PUSHES.format(" and ".join(compress(mechanism.actuator_names, row))) for row in wrong]
    else:
        exerted = np.where(is_slack, 0.0, exerted)
        by_twist = inverse_jacobian(solution).reshape(*exerted.shape, -1)
        wrenches = np.nan_to_num(-np.einsum("nar,na->nr", by_twist, exerted))
        least = forces(solution, shaped(wrenches, solution.shape))
        found = replace(least, actuators=shaped(exerted, solution.shape))
        rates, units = pairs_of(mechanism, found._coordinates).rates, actuator_units(mechanism)
        undone = np.einsum("nad,na->nd", rates, (exerted - least.actuators.reshape(exerted.shape)) * units)
        wrong = np.abs(undone) > (size * units.max())[:, None]
        words = [UNBALANCED] * len(exerted)
    reasons = no_reasons(len(exerted))
    reasons[:] = np.ravel(np.asarray(found.reason, object))
    for row in np.flatnonzero(wrong.any(axis=1)):
        add_reason(reasons, [row], words[row])
    return replace(found, reason=in_shape(reasons, solution.shape))
