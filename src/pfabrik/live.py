"""A machine driven from any stream of targets: never beyond a limit, never faster than it may, never a leap."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .answers.active_limits import stretched_joint
from .answers.answer_fields import PoseRequest
from .answers.pace import pace_of
from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .answers.status import Status
from .answers.tracked import Track
from .common.arguments import DOUBLE
from .common.arrays import Floats, read_only
from .common.checks import require_positive
from .configuration import configuration
from .engines.engine import POSITION_ERROR, Configurations, driven_by, engine_of
from .engines.joints.configurations import new_rows
from .engines.kept_assembly import start_or_home
from .engines.targets import Target, as_targets
from .errors import InvalidArgument
from .fk import Actuators, solve_fk
from .kernels.rows import ROTATION_ERROR
from .machine.description.drive_bounds import drive_limits
from .machine.description.mechanism import Mechanism, checked_mechanism
from .machine.description.task import task_of
from .machine.model import model_of
from .machine.motion.displacements import home_coordinates
from .machine.motion.fitting_task import tilt_axis
from .options import Options
from .track import as_path


class Live:
    """Drives a mechanism along a stream of targets, tick by tick.

    Each tick goes to the nearest pose that the drives get to in time: with all loops closed and every limit kept, no
    drive faster than it may, links apart, on the same side of every dead point. So no drive leaps, out of reach or
    where an answer lies in another part of the workspace, and what does not move says what holds it. Parallel
    singularities are passed as the target leads, although drives do not hold the platform there: `singularity` tells.

    `pose` and `actuators` are read-only views of the same arrays each time. A tick allocates no arrays, but where a
    linkage has one drive alone. An instance is for one thread: make one for each machine.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    speed, acceleration : float or mapping of str to float, optional
        Highest values of the drives, by name or the same for all [length or rad, per s and per s²]; those not named
        have the `max_speed` and `max_acceleration` of their joints. Every drive needs a speed. With an acceleration it
        also brakes in time for its range.
    hold : {"orientation", "position"} or None
        What is held out of reach, as in `Options`.
    hold_price : float
        Up to which, as in `Options`.
    rotation_length : float, optional
        Which distance a rotation counts as, per radian, as in `Options` [length].
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
        rotation_length: float | None = None,
        start: Start | None = None,
    ) -> None:
        self.mechanism = checked_mechanism(mechanism)
        self.options = Options(hold=hold, hold_price=hold_price, rotation_length=rotation_length)
        speeds = drive_limits(mechanism, "speed", speed)
        self._limits = speeds, drive_limits(mechanism, "acceleration", acceleration)
        free = [name for name, most in zip(mechanism.actuator_names, speeds, strict=True) if most == math.inf]
        if free:
            raise InvalidArgument("speed", f"{free[0]} without one", "a most speed of each drive, given or `max_speed`")
        self._driven = driven_by(mechanism, self.options, *self._limits)
        self.pose, self.actuators = read_only(self._driven.pose), read_only(self._driven.actuators)
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
        if type(dt) is not float or not 0.0 < dt < math.inf:
            dt = require_positive("dt", dt)
        if type(target) is np.ndarray and target.shape == (4, 4) and target.dtype is DOUBLE and not self._has_tilt_axis:
            self._driven.target[:] = target
        else:
            self._driven.target[:] = _single(self.mechanism, target)
        self.status = _STATUSES[self._driven.go_on(dt)]
        return self.status

    def follow(self, targets: Target, *, times: ArrayLike | None = None, sample_time: float | None = None) -> Track:
        """Go on along a recorded stream, a tick a target, the first a tick after now; the answers of the ticks.

        Parameters
        ----------
        targets : array or RigidTransform or mapping
            A path of targets, as in `track`.
        times : array (n,), optional
            The time of each target [s]; the first tick takes as long as the second.
        sample_time : float, optional
            In place of `times`, the time from one target to the next [s].

        Raises
        ------
        InvalidArgument
            As in `track`; also where the time between two targets is not positive, or not known.
        """
        mechanism = self.mechanism
        poses, engine = as_path(mechanism, targets, self.options), engine_of(mechanism)
        limits = dict(zip(mechanism.actuator_names, self._limits[0].tolist(), strict=True))
        pace = pace_of(mechanism, len(poses), sample_time, times, limits)
        if pace is None:
            raise InvalidArgument("sample_time", "None", "the time between two targets [s], or times")
        steps = np.diff(pace.times) if len(poses) > 1 else np.ones(len(poses))
        if not (steps > 0.0).all():
            raise InvalidArgument("times", "targets at one time, or at none that is known", "times that grow")
        rows, ticks = new_rows(model_of(mechanism), len(poses)), np.append(steps[:1], steps)[: len(poses)]
        coordinates = np.zeros((len(poses), len(mechanism.coordinates)))
        for k, (pose, dt) in enumerate(zip(poses, ticks.tolist(), strict=True)):
            rows.status[k] = self.tick(pose, dt)
            rows.poses[k], rows.actuators[k], coordinates[k] = self.pose, self.actuators, self._driven.coordinates()[0]
        errors = task_of(mechanism).errors(rows.poses, poses)
        rows.measures[:, POSITION_ERROR], rows.measures[:, ROTATION_ERROR] = errors
        track = Track(
            mechanism, Configurations(rows, coordinates), PoseRequest(poses.copy(), self.options), pace, engine
        )
        track.jumps = np.zeros(len(poses), bool)  # drives go from each tick to the next
        return track

    def to(self, actuators: Actuators) -> Status:
        """Go where drives were measured to be (n_a,) [length or rad], in the same assembly; the status of `solve_fk`.

        Nothing changes where that is not REACHED. Speeds stay those of the last tick.
        """
        solution = solve_fk(self.mechanism, actuators, start=self.q)
        if solution.shape != ():
            raise InvalidArgument("actuators", f"batch shape {solution.shape}", "one at a time")
        status = Status(int(solution._rows.status[0]))
        if status is Status.REACHED:
            self._driven.place(solution._configurations)
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
        self._driven.rest()
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
        if not most > 0.0:  # where all links of a leg are in one line, its reach has no slope
            stretched = stretched_joint(model_of(self.mechanism), self._driven.coordinates())
            return tuple(f"{each.joint} {each.bound}" for each in stretched)
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
            rotation_length=self.options.rotation_length,
            start=self.q,
        )
        return made, (self.mechanism,)


_STATUSES = {int(status): status for status in Status}


def _single(mechanism: Mechanism, target: Target) -> Floats:
    """A single target as a pose (4, 4); one that is no pose as it is."""
    poses, shape = as_targets(mechanism, target)
    if shape != ():
        raise InvalidArgument("target", f"batch shape {shape}", "one at a time")
    pose: Floats = poses[0]
    return pose
