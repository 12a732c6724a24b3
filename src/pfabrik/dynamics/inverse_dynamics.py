"""`inverse_dynamics`: what the actuators of a machine exert to move as it is asked to."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from ..answers.solution import Solution, checked_solution
from ..answers.tracked import Track
from ..arguments import array
from ..arrays import Floats, Mask, shaped
from ..checks import require_choice
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..files.units import metres_of
from ..kinematics import BodyInertia, actuator_units, generic_of, inertias_of, tree_of
from ..statics.forces import GRAVITY
from ..statics.joint_balance import Balance, about_centres, balance_at, open_components
from ..statics.loads import (
    BodyLoads,
    add_reason,
    carried_of,
    checked_gravity,
    checked_loads,
    has_reason,
    in_shape,
    no_reasons,
)
from ..statics.sharing import within_limits
from ..statics.transmission import GAINS_MOTION, NO_CONFIGURATION, gives_way_in_words, is_redundantly_actuated
from .asked_motion import in_lengths, is_missed, motion_of, shown_of, task_axes
from .drives import Drives
from .efforts import Efforts
from .moving_machine import MovingMachine, Weights, weights_of

ROWS_A_BLOCK = 256
"""Rows whose matrices are in memory at once."""

FREE_PART = "the loads move a part without inertia that neither the end effector nor an actuator holds"
NOT_MADE = "the machine cannot move so here: its task leaves that motion out, or it is at a serial singularity"


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
    the least rates there are, and move on as the forces on them will.

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
    asked = _asked(motion, twists, accelerations, at)
    mechanism, solution = asked.solution.mechanism, asked.solution
    metres, pull = metres_of(mechanism.length_unit), checked_gravity(gravity)
    weights, others = loads_of(mechanism, metres, checked_loads(mechanism, loads))
    drives, n = Drives(mechanism, metres), len(asked.rates)
    reasons, n_a = no_reasons(n), len(mechanism.actuator_names)
    add_reason(reasons, np.isnan(solution._coordinates).any(axis=1), NO_CONFIGURATION)
    exerted, rates, gains = (np.full((n, n_a), np.nan) for _ in range(3))
    reactions = np.full((n, len(mechanism.joints), 6), np.nan)
    is_open = np.zeros(reactions.shape, bool)
    known = np.flatnonzero(~has_reason(reasons))
    for start in range(0, len(known), ROWS_A_BLOCK):
        rows = known[start : start + ROWS_A_BLOCK]
        block = _Block(asked, rows, weights, others, pull / metres, metres)
        found = block.balanced(drives)
        add_reason(reasons, rows[found.is_singular], GAINS_MOTION)
        add_reason(reasons, rows[block.is_missed], NOT_MADE)
        add_reason(reasons, rows[found.is_idle[:, 0]], FREE_PART)
        add_reason(reasons, rows[~found.is_held[:, 0]], gives_way_in_words(mechanism))
        exerted[rows], rates[rows], gains[rows] = found.actuators[..., 0] / drives.units, *block.of_actuators()
        reactions[rows], is_open[rows] = block.reactions(found)
    unknown = has_reason(reasons)
    exerted[unknown], rates[unknown], gains[unknown] = np.nan, np.nan, np.nan
    reactions[is_open | unknown[:, None, None]] = np.nan
    reactions *= np.repeat([1.0, metres], 3)
    shape = solution.shape
    return Efforts(
        shaped(exerted, shape),
        shaped(rates, shape),
        shaped(gains, shape),
        asked.times,
        is_redundantly_actuated(mechanism),
        in_shape(reasons, shape),
        mechanism,
        drives,
        reactions.reshape(*shape, -1, 6),
        is_open,
    )


def _asked(motion: Any, twists: ArrayLike | None, accelerations: ArrayLike | None, at: str) -> AskedMotion:
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


def masses_of(mechanism: Mechanism, metres: float) -> dict[str, BodyInertia]:
    """What the bodies that move weigh.

    Raises
    ------
    InvalidArgument : some bodies have no mass.
    """
    lacking = lacking_masses(mechanism, metres)
    if lacking:
        expected = "a mass of each body that moves: `with_masses`, or in its file, and 0 where it weighs nothing"
        raise InvalidArgument("mechanism", f"no mass of {', '.join(lacking)}", expected)
    resting = _resting(mechanism)
    return {body: each for body, each in inertias_of(mechanism, metres).items() if body not in resting}


def lacking_masses(mechanism: Mechanism, metres: float) -> list[str]:
    """The bodies that move and have no mass."""
    found, resting = inertias_of(mechanism, metres), _resting(mechanism)
    return [body for body in mechanism.bodies if body not in found and body not in resting]


def _resting(mechanism: Mechanism) -> set[str]:
    """The base, and the bodies that are held on it."""
    resting = {mechanism.base}
    for index, forward in tree_of(mechanism).steps:
        joint = mechanism.joints[index]
        if joint.is_rigid and joint.connects[0 if forward else 1] in resting:
            resting.add(joint.connects[1 if forward else 0])
    return resting


def loads_of(mechanism: Mechanism, metres: float, loads: BodyLoads) -> tuple[Weights, BodyLoads]:
    """All masses, those that bodies carry among them, and the other loads, moments in N times the machine's length."""
    parts, others = list(masses_of(mechanism, metres).items()), {}
    for body, (load, point) in loads.items():
        value = array(f"loads['{body}']", load, "() | 3 | 6", note=", a mass [kg], force [N] or wrench [N, N m]")
        if value.shape == () and value >= 0.0:
            centre = array(f"loads['{body}'][1]", point, "3", note=", its centre")
            parts.append((body, BodyInertia(float(value), centre, np.zeros((3, 3)))))
        else:
            others[body] = (value / np.array([1.0] * 3 + [metres] * 3) if value.shape == (6,) else load, point)
    return weights_of(parts), others


class _Block:
    """Some rows of a question, and their motion.

    Attributes
    ----------
    rates, gains : of joints, as of `MovingMachine`, (n, c).
    is_missed : True where the machine does not move as it is asked to, (n,).
    """

    def __init__(
        self, asked: AskedMotion, rows: Any, weights: Weights, others: BodyLoads, gravity: Floats, metres: float
    ) -> None:
        solution, self.others, self.gravity = asked.solution, others, gravity
        self.mechanism = mechanism = solution.mechanism
        self.q = solution._configurations.coordinates_at(rows)
        self.moving = moving = MovingMachine(mechanism, weights, self.q)
        self.pull, self.scale = gravity / mechanism.characteristic_length, mechanism.characteristic_length**2 * metres
        poses = solution._rows.poses[rows]
        shown, units = shown_of(moving, asked.at, poses), in_lengths(mechanism, asked.at)
        rates, gains = (x[rows][:, : len(units)] / units for x in (asked.rates, asked.accelerations))
        if asked.at == "task":
            axes = task_axes(mechanism, poses)
            rates, gains = (np.einsum("nki,ni->nk", axes[..., : len(units)], x) for x in (rates, gains))
        following = shown.following(moving)
        self.rates = (following @ rates[..., None])[..., 0]
        self.drift = moving.drift(self.rates)
        least = moving.least_accelerations(self.drift)
        still = np.einsum("nki,ni->nk", shown.by_twist, moving.end_drift(self.rates, self.drift))
        more = gains - still - (shown.by_rates @ least[..., None])[..., 0]
        self.gains = least + (following @ more[..., None])[..., 0]
        self.is_missed = np.zeros(len(rows), bool)
        if asked.at == "task":
            self.is_missed = is_missed(shown, self.rates, rates) | is_missed(shown, self.gains, gains - still)
        self._let_go()

    def _carried(self) -> Floats:
        """What joints carry of the masses, as a `Balance` has it, (n, joints, 6)."""
        resisted = self.moving.resistance(self.rates, self.gains, self.drift, self.pull)
        return self.moving.carried(resisted) * self.scale

    def _let_go(self) -> None:
        """Let the parts that nothing holds move as the forces on them will."""
        self.carried = self._carried()
        if self.others:
            none = np.zeros((len(self.q), 6))
            self._more = carried_of(self.mechanism, self.q, none, self.others, self.gravity)
            self.carried += self._more
        if generic_of(self.mechanism).mobility.idle and self.moving.weights.bodies:
            motions, mobility = self.moving.free_responses(self.moving.first.unseen)
            pushed = np.einsum("nck,nc->nk", motions, self.moving.work(self.carried)) / self.scale
            self.gains = self.gains + np.einsum("nck,nkm,nm->nc", motions, mobility, pushed)
            self.carried = self._carried() + (self._more if self.others else 0.0)

    def of_actuators(self) -> tuple[Floats, Floats]:
        """Rates and accelerations of the actuators, (n, n_a) each, in the machine's units."""
        units = actuator_units(self.mechanism)
        return self.rates[:, self.moving.first.actuated] * units, self.gains[:, self.moving.first.actuated] * units

    def balanced(self, drives: Drives) -> Balance:
        """The forces that make the motion."""
        on_drives = drives.loads(*self.of_actuators()) * drives.units
        found = balance_at(self.mechanism, self.moving.first, self.carried[..., None], on_drives[..., None])
        limits = drives.limits * drives.units
        rows = np.flatnonzero((np.abs(found.actuators[..., 0]) > limits).any(axis=1))
        if not len(rows) or not is_redundantly_actuated(self.mechanism):
            return found
        more = np.zeros(on_drives.shape)
        rates = self.moving.first.pairs[rows][:, self.moving.first.actuated]
        least = found.actuators[rows, :, 0]
        more[rows] = within_limits(least, rates, np.stack([-limits, limits], axis=1))[0] - least
        against = balance_at(self.mechanism, self.moving.first, self.carried[..., None], (on_drives + more)[..., None])
        return against._replace(actuators=against.actuators + more[..., None])

    def reactions(self, found: Balance) -> tuple[Floats, Mask]:
        """What joints transmit, force [N] and moment about their centres [N length], (n, joints, 6), and where that is
        not determined."""
        length = self.mechanism.characteristic_length
        places = self.moving.centres, self.moving.reference * length
        is_open = open_components(self.mechanism, found.open, *places)
        return about_centres(self.mechanism, found.wrenches, *places)[..., 0], is_open
