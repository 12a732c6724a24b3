"""`inverse_dynamics`: what the actuators of a machine exert to move as it is asked to."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Solution
from ...answers.tracked import Track
from ...common.arrays import Ints, shaped
from ...kernels.dynamics.moving import FREE_PART, NOT_HELD, NOT_MADE, SINGULAR
from ..statics.forces import GRAVITY
from ..statics.loads import BodyLoads, Reasons, add_reason, checked_gravity, has_reason, in_shape, no_reasons
from ..statics.sharing import within_limits
from ..statics.transmission import GAINS_MOTION, NO_CONFIGURATION, gives_way_in_words, is_redundantly_actuated
from .asked_motion import TimedMotion, asked_motion
from .drives import drives_of
from .efforts import Efforts
from .weights import weights_of

LEFT_FREE = "the loads move a part without inertia that neither the end effector nor an actuator holds"
NEVER_MADE = "the machine cannot move so here: its task leaves that motion out, or it is at a serial singularity"
LEAPS = "the velocity leaps here: the nearest pose comes to a limit or leaves it, which no finite forces make it do"
TOO_LARGE = "its numbers are too large: forces overflow"


def inverse_dynamics(
    motion: Solution | Track | TimedMotion,
    *,
    twists: ArrayLike | None = None,
    accelerations: ArrayLike | None = None,
    at: Literal["task", "actuators"] = "task",
    gravity: ArrayLike = GRAVITY,
    loads: BodyLoads | None = None,
) -> Efforts:
    """Forces that the actuators exert to move the masses of a machine, and what the joints transmit.

    By virtual power, for all motions that the loops allow: t . dq + sum w_b . V_b = 0, with the wrenches w_b of weight,
    inertia and loads on every body, and of rotors and friction on the actuators. All forces are in N, all moments and
    torques in N m, whatever the machine's unit of length; gravity is in m/s². Positions, twists and accelerations are
    in the machine's unit, as everywhere.

    Parts that neither the end effector nor an actuator holds, such as a rod that spins between two ball joints, have
    no momentum along the motions that are left to them, and move on as the forces on them will.

    Dry friction acts against the rate of its actuator. At rest it counts as 0, and may be anything up to its size:
    `at_rest` says where. At rest is what rounding makes of it: rates up to 1e-8 L/s or rad/s, or 1e-8 of the fastest
    actuator's; on a path with times also those that places exact to 1e-9 L or rad do not tell from 0, and all steps of
    an actuator that stays within that for three on end.

    Parameters
    ----------
    motion : Solution or Track or Timed
        Configurations, at rest unless `twists` or `accelerations` are given. A path with times moves as these say: the
        polynomial through each step and its four neighbours gives its rates and accelerations. Where targets are out of
        reach, it is the nearest poses that move: `projected` says where. A path of `time_path` moves as that has it.
    twists, accelerations : array (..., 6) or (..., 3), optional
        Velocity and acceleration of the reference point, then angular ones, in the base frame [length/s, rad/s; per s];
        three numbers are those of a point. Of these counts what the task sets; the rest follows. With `at` "actuators",
        rates and accelerations of the actuators, (..., n_a). One for all rows, or one for each. What a pose leaves
        open, as the arms of a redundant machine, moves as little as it may, or as its actuators are told.
    at : {"task", "actuators"}, optional
        What `twists` and `accelerations` are of.
    gravity : array (3,), optional
        Gravity [m/s²].
    loads : mapping of str to tuple, optional
        Body -> (mass, centre), for what it carries, which moves with it; (force, point) or (wrench, point) for what
        else acts on it from outside, in the base frame [N, N m]. Points are those of the body at home, in base
        coordinates [length].

    Returns
    -------
    Efforts
        The actuators' forces, rates and power, and the joints' reactions. NaN where its `reason` says why.

    Raises
    ------
    InvalidArgument or UnknownName
        Bodies without a mass; a path without times; a wrong shape, numbers that are not finite, no such body.
    """
    rows = asked_motion(motion, twists, accelerations, at)
    mechanism, shape = rows.solution.mechanism, rows.solution.shape
    rows = replace(rows, weights=weights_of(mechanism, loads), gravity=checked_gravity(gravity))
    drives, is_redundant = drives_of(mechanism), is_redundantly_actuated(mechanism)
    shares = is_redundant and bool(np.isfinite(drives.limits).any())
    found = rows.efforts(["motions"] if shares else [])
    reasons, exerted = reasons_of(rows.solution, found.marks), found.actuators
    if shares:
        over = np.flatnonzero((np.abs(exerted) > drives.limits).any(axis=1))
        limits = drives.limits * drives.units
        least, both = exerted[over] * drives.units, np.stack([-limits, limits], axis=1)
        exerted[over] = within_limits(least, found.motions[over], both)[0] / drives.units
    add_reason(reasons, [] if rows.kinks is None else rows.kinks, LEAPS)
    add_reason(reasons, ~np.isfinite(exerted).all(axis=1), TOO_LARGE)
    lacking = has_reason(reasons)
    if lacking.any():
        for each in (exerted, found.rates, found.gains, found.signs):
            each[lacking] = np.nan
    exerted, rates, gains = (shaped(each, shape) for each in (exerted, found.rates, found.gains))
    at_rest, reason = shaped(found.signs == 0.0, shape), in_shape(reasons, shape)
    return Efforts(exerted, rates, gains, at_rest, rows.times, is_redundant, reason, rows)


def reasons_of(solution: Solution, marks: Ints) -> Reasons:
    """Why rows with marks have no forces; empty where they have."""
    reasons = no_reasons(len(marks))
    add_reason(reasons, np.isnan(solution._coordinates).any(axis=1), NO_CONFIGURATION)
    if not marks.any():
        return reasons
    gives_way = gives_way_in_words(solution.mechanism)
    of_marks = {SINGULAR: GAINS_MOTION, NOT_MADE: NEVER_MADE, FREE_PART: LEFT_FREE, NOT_HELD: gives_way}
    for mark, reason in of_marks.items():
        add_reason(reasons, (marks & mark) > 0, reason)
    return reasons
