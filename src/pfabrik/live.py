"""A machine driven from any stream of targets: never beyond a limit, never faster than it may, never a leap."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np

from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .answers.status import Status
from .common.arguments import DOUBLE
from .common.arrays import Floats, read_only
from .common.checks import require_count, require_positive
from .configuration import configuration
from .engines.engine import Driven, driven_by, engine_of
from .engines.kept_assembly import start_or_home
from .engines.targets import Target, as_targets
from .errors import InvalidArgument
from .fk import Actuators, solve_fk
from .ik import solve_ik
from .machine.description.drive_limits import drive_limits
from .machine.description.mechanism import Mechanism, checked_mechanism
from .machine.motion.displacements import home_coordinates
from .machine.motion.fitting_task import tilt_axis
from .options import Options


class Live:
    """Drives a mechanism along a stream of targets, tick by tick.

    Each tick goes to the nearest pose that the drives get to in time: with all loops closed and every limit kept, no
    drive faster than it may, links apart, on the same side of every dead point. So nothing leaps, out of reach or where
    an answer lies in another part of the workspace, and what does not move says what holds it.

    `pose`, `actuators` and `speeds` are read-only views of the same arrays each time. A tick allocates no arrays. An
    instance is for one thread: make one for each machine.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    speed, acceleration : float or mapping of str to float, optional
        Highest values of the drives, by name or the same for all [length or rad, per s and per s²]; those not named
        have the `max_speed` and `max_acceleration` of their joints. Every drive needs a speed. With an acceleration it
        also brakes in time for its range.
    hold, hold_price
        As in `Options`.
    guide : bool or int
        Whether ticks also look for a nearer pose than the one that they come to by themselves, elsewhere in the
        workspace or with an arm folded otherwise, and walk there where it is nearer by a tenth: True asks on another
        thread, a number within the tick, every so many ticks. False for hard real time: nothing is asked.
    start : Solution or array (nq,), optional
        Where the machine is. Default: home.

    Attributes
    ----------
    status : Status
        Of the last tick: REACHED; PROJECTED, on the way or as near as it gets; INVALID where the target was no pose, on
        which the machine comes to rest.
    pose : array (4, 4)
        T_base_platform [length].
    actuators, speeds : array (n_a,)
        Where the drives are, and how fast they went there [length or rad, per s].

    Raises
    ------
    InvalidArgument
        No speed, given or in the file; a start that is not feasible.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        *,
        speed: float | Mapping[str, float] | None = None,
        acceleration: float | Mapping[str, float] | None = None,
        hold: Literal["orientation", "position"] | None = "orientation",
        hold_price: float = 10.0,
        guide: bool | int = True,
        start: Start | None = None,
    ) -> None:
        self.mechanism = checked_mechanism(mechanism)
        self.options = Options(hold=hold, hold_price=hold_price)
        speeds = drive_limits(mechanism, "speed", speed)
        self._limits = speeds, drive_limits(mechanism, "acceleration", acceleration)
        free = [name for name, most in zip(mechanism.actuator_names, speeds, strict=True) if most == math.inf]
        if free:
            raise InvalidArgument("speed", f"{free[0]} without one", "a most speed of each drive, given or `max_speed`")
        self._driven = driven_by(mechanism, self.options, *self._limits)
        self.pose, self.actuators = read_only(self._driven.pose), read_only(self._driven.actuators)
        self._guide = Guide(mechanism, self.options, speeds, guide) if guide else None
        self._has_tilt_axis = tilt_axis(mechanism) is not None
        self.status = Status.INVALID
        self.reset(start)

    def tick(self, target: Target, dt: float) -> Status:
        """Go on towards a target for dt seconds; the status.

        Parameters
        ----------
        target : array or RigidTransform or mapping
            As in `solve_ik`, a single one; an array (4, 4) of float64 is the fastest, and is never refused: where it is
            no pose, NaN for instance, the drives slow down.
        dt : float
            Time since the last tick [s].

        Raises
        ------
        InvalidArgument
            A target of another shape; a time that is not positive.
        """
        if not 0.0 < dt < math.inf:
            require_positive("dt", dt)
        if type(target) is np.ndarray and target.shape == (4, 4) and target.dtype is DOUBLE and not self._has_tilt_axis:
            self._driven.target[:] = target
        else:
            self._driven.target[:] = _single(self.mechanism, target)
        self.status = _STATUSES[self._driven.go_on(dt)]
        if self._guide is not None:
            self._guide.look(self._driven)
        return self.status

    def to(self, actuators: Actuators) -> Status:
        """Go where drives were measured to be (n_a,) [length or rad], in the same assembly; the status of `solve_fk`.

        Nothing changes where that is not REACHED. Speeds stay those of the last tick.
        """
        solution = solve_fk(self.mechanism, actuators, start=self.q)
        if solution.shape != ():
            raise InvalidArgument("actuators", f"batch shape {solution.shape}", "one at a time")
        status = Status(int(solution._rows.status[0]))
        if status is Status.REACHED:
            rates = self._driven.drives["rate"].copy()
            self._driven.place(solution._configurations)
            self._driven.drives["rate"] = rates
        return status

    def reset(self, start: Start | None = None) -> None:
        """Let the machine rest at a start, or at home.

        Raises
        ------
        InvalidArgument
            The start is not feasible.
        """
        mechanism = self.mechanism
        begin = start_or_home(engine_of(mechanism), mechanism, start_of(mechanism, start, ()))
        found = configuration(mechanism, (begin.coordinates + home_coordinates(mechanism))[0])
        if found.status is not Status.REACHED:
            raise InvalidArgument("start", str(found), "a configuration within all limits")
        self._driven.place(begin)
        self.status = Status.REACHED

    @property
    def q(self) -> Floats:
        """All joint coordinates (nq,), in the order of `mechanism.coordinate_names` [length or rad]."""
        return np.asarray((self._driven.coordinates() + home_coordinates(self.mechanism))[0])

    @property
    def solution(self) -> Solution:
        """Where the machine is, as of `configuration`: with its limits, margins and joints."""
        return configuration(self.mechanism, self.q)

    @property
    def lag(self) -> float:
        """Distance from the last target, rotations and the price of what is held included [length]."""
        return float(self._driven.tick["lag"] * self.mechanism.characteristic_length)

    @property
    def speeds(self) -> Floats:
        """How fast the drives went in the last tick (n_a,) [length or rad, per s]."""
        return self._driven.speeds()

    @property
    def exceeded(self) -> float:
        """By what share some drive's acceleration was exceeded in the last tick: 0.1 is a tenth too much.

        Limits come first, then speeds: only where a passive joint's limit comes up between two ticks.
        """
        return float(self._driven.tick["exceeded"])

    @property
    def holding(self) -> tuple[str, ...]:
        """What kept the last tick from its target, the most first: limits by their joints, and drives' speeds."""
        if not self._driven.tick["searched"]:
            return ()
        found = self._driven.multipliers()
        most = max(found.values(), default=0.0)
        return tuple(
            " ".join(limit) for limit, value in sorted(found.items(), key=lambda each: -each[1]) if value > 1e-6 * most
        )

    def __repr__(self) -> str:
        return f"<Live of '{self.mechanism.name}': {self.status}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle as another that rests in the same place."""
        names = self.mechanism.actuator_names
        speed, acceleration = (dict(zip(names, most.tolist(), strict=True)) for most in self._limits)
        acceleration = {name: most for name, most in acceleration.items() if most < math.inf}
        made = partial(
            type(self),
            speed=speed,
            acceleration=acceleration,
            hold=self.options.hold,
            hold_price=self.options.hold_price,
            start=self.q,
        )
        return made, (self.mechanism,)


class Guide:
    """Looks for poses nearer to a target than the one that ticks come to, and lets them walk there.

    Where the way is barred, or the walk does not come nearer in the end, ticks aim at their targets again.
    """

    def __init__(self, mechanism: Mechanism, options: Options, speeds: Floats, every: bool | int) -> None:
        self.mechanism, self.options, self.speeds = mechanism, replace(options, working_mode="keep"), speeds
        self.every = EVERY if every is True else require_count("guide", every)
        self._pool = ThreadPoolExecutor(1, "pfabrik-guide") if every is True else None
        self._asked: Future[Solution] | None = None
        self._ticks, self._goal, self._distance, self._given_up = 0, np.zeros(0), math.inf, math.inf

    def look(self, driven: Driven) -> None:
        """After a tick: begin a walk to what is nearer, or end one."""
        self._ticks += 1
        if driven.tick["status"] == Status.REACHED:
            self._given_up, self._ticks = math.inf, 0
            driven.walk_to(None)
        if driven.tick["walks"]:
            self._walk(driven)
        elif self._asked is not None and self._asked.done():
            self._judge(driven, self._asked.result())
            self._asked = None
        if self._asked is None and self._ticks >= self.every and driven.tick["status"] != Status.INVALID:
            self._ticks, target = 0, driven.target.copy()
            if self._pool is None:
                self._judge(driven, self._ask(target))
            else:
                self._asked = self._pool.submit(self._ask, target)

    def _ask(self, target: Floats) -> Solution:
        return solve_ik(self.mechanism, target, options=self.options)

    def _judge(self, driven: Driven, found: Solution) -> None:
        """Begin a walk to what was found, if that is nearer by a share."""
        if driven.tick["walks"] or found.status > Status.PROJECTED or not driven.has_mode_of(found._configurations):
            return
        distance, lag = driven.distance(found._rows.poses), float(driven.tick["lag"])
        if distance <= (1.0 - NEARER) * lag - NEARER**3 and distance < self._given_up:
            self._goal, self._distance = np.array(found.actuators), distance
            driven.walk_to(self._goal)

    def _walk(self, driven: Driven) -> None:
        """End a walk that is done, or that goes on no more: then only what is nearer still is walked to."""
        rates = np.abs(driven.speeds()) / self.speeds
        if rates.max() < AT_REST:
            self._given_up = (1.0 - NEARER) * self._distance
            driven.walk_to(None)
        elif driven.tick["lag"] <= self._distance:
            driven.walk_to(None)


AT_REST = 1e-3
"""Share of the most speed below which a walk goes on no more."""

EVERY = 50
"""Ticks between two questions for a nearer pose."""

NEARER = 0.1
"""Share of the distance by which a pose is to be nearer, to be walked to."""

_STATUSES = {int(status): status for status in Status}


def _single(mechanism: Mechanism, target: Target) -> Floats:
    """A single target as a pose (4, 4); one that is no pose as it is."""
    poses, shape = as_targets(mechanism, target)
    if shape != ():
        raise InvalidArgument("target", f"batch shape {shape}", "one at a time")
    pose: Floats = poses[0]
    return pose
