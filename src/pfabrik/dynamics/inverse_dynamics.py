"""`inverse_dynamics`: what the actuators of a machine exert to move as it is asked to."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ..answers.solution import Solution, checked_solution
from ..answers.tracked import Track
from ..arguments import array
from ..arrays import Floats, Ints, shaped
from ..checks import require_choice
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..files.units import metres_of
from ..kernels.dynamics.moving import FREE_PART, NOT_HELD, NOT_MADE, SINGULAR
from ..statics.forces import GRAVITY
from ..statics.loads import (
    BodyLoads,
    Reasons,
    add_reason,
    checked_gravity,
    checked_loads,
    has_reason,
    in_shape,
    no_reasons,
)
from ..statics.sharing import within_limits
from ..statics.transmission import GAINS_MOTION, NO_CONFIGURATION, gives_way_in_words, is_redundantly_actuated
from .asked_motion import motion_of
from .drives import drives_of
from .efforts import Efforts
from .moving_rows import MovingRows
from .transmitted import TransmittedForces
from .weights import Weights, loads_of

LEFT_FREE = "the loads move a part without inertia that neither the end effector nor an actuator holds"
NEVER_MADE = "the machine cannot move so here: its task leaves that motion out, or it is at a serial singularity"


@runtime_checkable
class TimedMotion(Protocol):
    """Configurations at times, and how the actuators move, as `Timed` has them."""

    @property
    def solution(self) -> Solution: ...

    @property
    def times(self) -> Floats: ...

    @property
    def rates(self) -> Floats: ...

    @property
    def accelerations(self) -> Floats: ...


class AskedMotion(NamedTuple):
    """Configurations and how they move, in n rows.

    Attributes
    ----------
    solution : the configurations.
    times : (n,) [s]; None without.
    at : of what the numbers are: "task", "actuators", or "path" for both.
    rates, accelerations : (n, k), in the machine's units.
    """

    solution: Solution
    times: Floats | None
    at: str
    rates: Floats
    accelerations: Floats


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

    Parameters
    ----------
    motion : Solution or Track or Timed
        Configurations, at rest unless `twists` or `accelerations` are given. A path with times moves as these say: the
        polynomial through each step and its four neighbours gives its rates and accelerations. A path of `time_path`
        moves as that has it.
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
    asked = asked_motion(motion, twists, accelerations, at)
    mechanism, solution = asked.solution.mechanism, asked.solution
    metres, pull = metres_of(mechanism.length_unit), checked_gravity(gravity)
    weights = loads_of(mechanism, metres, checked_loads(mechanism, loads))
    drives, n = drives_of(mechanism), len(asked.rates)
    reasons, n_a = no_reasons(n), len(mechanism.actuator_names)
    add_reason(reasons, np.isnan(solution._coordinates).any(axis=1), NO_CONFIGURATION)
    known = np.flatnonzero(~has_reason(reasons))
    rows = rows_of(asked, known, weights, pull)
    is_redundant = is_redundantly_actuated(mechanism) and bool(np.isfinite(drives.limits).any())
    found = rows.efforts(["motions"] if is_redundant else [])
    reasons[known] = reasons_of(mechanism, found.marks)
    values = np.full((3, n, n_a), np.nan)
    values[:, known] = found.actuators, found.rates, found.gains
    if is_redundant:
        places = np.flatnonzero((np.abs(found.actuators) > drives.limits).any(axis=1))
        least, limits = found.actuators[places] * drives.units, drives.limits * drives.units
        shared = within_limits(least, found.motions[places], np.stack([-limits, limits], axis=1))[0]
        values[0, known[places]] = shared / drives.units
    values[:, has_reason(reasons)] = np.nan
    shape = solution.shape
    exerted, rates, gains = (shaped(each, shape) for each in values)
    reasons_here = in_shape(reasons, shape)
    reactions = TransmittedForces(rows, known, values[0], shape)
    return Efforts(
        exerted,
        rates,
        gains,
        asked.times,
        is_redundantly_actuated(mechanism),
        reasons_here,
        mechanism,
        drives,
        reactions,
    )


def reasons_of(mechanism: Mechanism, marks: Ints) -> Reasons:
    """Why rows with marks have no forces; empty where they have."""
    reasons, gives_way = no_reasons(len(marks)), gives_way_in_words(mechanism)
    of_marks = {SINGULAR: GAINS_MOTION, NOT_MADE: NEVER_MADE, FREE_PART: LEFT_FREE, NOT_HELD: gives_way}
    for mark, reason in of_marks.items():
        add_reason(reasons, (marks & mark) > 0, reason)
    return reasons


def asked_motion(motion: Any, twists: ArrayLike | None, accelerations: ArrayLike | None, at: str) -> AskedMotion:
    """The configurations, and how they move."""
    require_choice("at", at, ("task", "actuators"))
    is_given = twists is not None or accelerations is not None
    if isinstance(motion, TimedMotion):
        if is_given:
            raise InvalidArgument("twists", "twists beside a path with times", "none: the path says how it moves")
        return AskedMotion(motion.solution, motion.times, "actuators", motion.rates, motion.accelerations)
    solution = checked_solution(motion)
    if isinstance(motion, Track) and not is_given:
        return AskedMotion(motion, motion.times, "path", *motion_of(motion))
    mechanism, n = solution.mechanism, len(solution._rows.status)
    width = len(mechanism.actuator_names) if at == "actuators" else 6
    values = []
    for name, given in (("twists", twists), ("accelerations", accelerations)):
        forms = f"... {width}" if at == "actuators" else "... 6 | ... 3"
        value = np.zeros(width) if given is None else array(name, given, forms)
        if value.shape[-1] < width:
            value = np.concatenate([value, np.zeros(value.shape)], axis=-1)
        try:
            values.append(np.broadcast_to(value, (*solution.shape, width)).reshape(n, width))
        except ValueError:
            expected = f"one for all, or one for each of batch shape {solution.shape}"
            raise InvalidArgument(name, f"a batch of {value.shape[:-1]}", expected) from None
    times = motion.times if isinstance(motion, Track) else None
    return AskedMotion(solution, times, at, *values)


def rows_of(asked: AskedMotion, rows: Any, weights: Weights, gravity: Floats) -> MovingRows:
    """Some rows of a question."""
    solution = asked.solution
    return MovingRows(
        solution.mechanism,
        weights,
        gravity,
        asked.at,
        solution._configurations.coordinates_at(rows),
        solution._rows.poses[rows],
        asked.rates[rows],
        asked.accelerations[rows],
    )
