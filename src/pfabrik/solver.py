"""A solver prepared for control loops: answers of `solve_ik` and `solve_fk`, and forces, in arrays allocated once."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .answers.differential import forward_jacobian, singularity
from .answers.solution import Solution
from .answers.start_configuration import Start, start_of
from .answers.status import Status
from .capabilities.dynamics.prepared_effort import PreparedEffort, twist_of
from .capabilities.dynamics.weights import lacking_masses
from .capabilities.statics.forces import GRAVITY
from .capabilities.statics.loads import BodyLoads
from .common.arguments import DOUBLE
from .common.arrays import Floats, read_only
from .engines.engine import engine_of
from .engines.joints.configurations import new_rows
from .engines.targets import Target
from .errors import InvalidArgument
from .fk import Actuators, solve_fk
from .ik import keeps_mode, solve_ik
from .machine.description.mechanism import Mechanism, checked_mechanism
from .machine.model import model_of
from .machine.motion.fitting_task import along_tilt, tilt_axis
from .machine.poses import pose
from .options import Options, checked_options
from .track import track

FAR = 3.0
"""How far away from home a target is out of reach of any machine [L or rad]."""


class Solver:
    """Solves single targets of one mechanism repeatedly.

    The constructor compiles or loads all kernels, and says so on standard error; later calls compile nothing. Targets
    that are reached in closed form allocate no arrays; others take as long as `solve_ik`.
    An instance is for one thread: make one for each.

    `pose`, `actuators` and the results of `jacobian` and `effort` are read-only views of the same arrays each time: the
    next call overwrites them. Copy them to keep them, or use `solution`.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    start : Solution or array (nq,), optional
        The start of every search, as in `solve_ik`; its working mode and its assembly mode are kept. Default: home, and
        any working mode.
    options : Options, optional
        Options of every call.
    most_steps : int, optional
        In place of that of `Options`.

    Attributes
    ----------
    status : Status
        Status of the last answer; INVALID before the first one, and after a call that raised.
    pose : array (4, 4)
        T_base_platform achieved [length]; NaN if `status` is INVALID.
    actuators : array (n_a,)
        Actuated coordinates in the order of `mechanism.actuator_names` [length or rad]; NaN if `status` is INVALID.

    Raises
    ------
    InvalidArgument
        No Mechanism; a start that is no single configuration of it.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        *,
        start: Start | None = None,
        options: Options | None = None,
        most_steps: int | None = None,
    ) -> None:
        """Prepare what answers need, which takes tenths of a second."""
        self.mechanism, self.options = checked_mechanism(mechanism), checked_options(options)
        if most_steps is not None:
            self.options = replace(self.options, most_steps=most_steps)
        self._start, begin = start, start_of(mechanism, start, ())
        prepare(mechanism)
        engine, keep_mode = engine_of(mechanism), keeps_mode(self.options, start)
        self._rows, self._target = new_rows(model_of(mechanism), 1), np.eye(4)[None]
        is_bounded = self.options.most_steps is not None and not engine.is_fast
        self._prepared = None
        if not is_bounded:
            self._prepared = engine.prepared(self._target, begin, self._rows, keep_mode=keep_mode)
        self._prepared_forward = engine.prepared_forward(begin, self._rows)
        self._reach, self._assemble = (call and call[0] for call in (self._prepared, self._prepared_forward))
        self._forward = np.empty((3 if mechanism.end_effector_is_joint else 6, len(mechanism.actuator_names)))
        self.pose, self.actuators = read_only(self._rows.poses[0]), read_only(self._rows.actuators[0])
        self.status = Status.INVALID
        self._solution: Solution | None = None
        self._was_forward = False
        self._has_tilt_axis = tilt_axis(mechanism) is not None
        self._efforts = PreparedEffort(mechanism, start)
        self._efforts_seen = read_only(self._efforts.actuators)
        if not lacking_masses(mechanism):
            self._efforts.carry(None, GRAVITY)
        self._clear()

    def ik(self, target: Target) -> Status:
        """Solve for a target as `solve_ik` does; the status.

        Parameters
        ----------
        target : array or RigidTransform or mapping
            A single target, as in `solve_ik`; an array (4, 4) of float64 is the fastest.

        Raises
        ------
        InvalidArgument
            As in `solve_ik`; then `status` is INVALID.
        """
        if type(target) is np.ndarray and target.shape == (4, 4) and target.dtype is DOUBLE:
            self._target[0] = along_tilt(self.mechanism, target[None])[0] if self._has_tilt_axis else target
            if self._reach is not None and not self._reach():
                self._solution, self._was_forward, self.status = None, False, Status.REACHED
                return Status.REACHED
        copied = target.copy() if isinstance(target, np.ndarray) else target
        self._clear()
        return self._store(solve_ik(self.mechanism, copied, start=self._start, options=self.options), "target")

    def fk(self, actuators: Actuators) -> Status:
        """Solve for actuator values (n_a,) [length or rad] as `solve_fk` does; the status.

        Raises
        ------
        InvalidArgument
            As in `solve_fk`; then `status` is INVALID.
        """
        if type(actuators) is np.ndarray and actuators.shape == self.actuators.shape and actuators.dtype is DOUBLE:
            self._rows.actuators[0] = actuators
            if self._assemble is not None and not self._assemble():
                self._solution, self._was_forward, self.status = None, True, Status.REACHED
                return Status.REACHED
        copied = actuators.copy() if isinstance(actuators, np.ndarray) else actuators
        self._clear()
        return self._store(solve_fk(self.mechanism, copied, start=self._start, options=self.options), "actuators")

    def effort(
        self,
        pose: Target,
        twist: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        *,
        loads: BodyLoads | None = None,
        gravity: ArrayLike = GRAVITY,
    ) -> Floats:
        """Forces of the actuators at a pose that moves, (n_a,) [N m, of slides N], as `inverse_dynamics` has them.

        Those at the pose that `ik` answers, whose status is `status`; NaN where `inverse_dynamics` has a reason.

        Parameters
        ----------
        pose : array or RigidTransform or mapping
            As the target of `ik`.
        twist, acceleration : array (6,) or (3,), optional
            Velocity and acceleration of the reference point, then angular ones, in the base frame [length/s, rad/s; per
            s]; at rest by default. Arrays (6,) of float64 are the fastest.
        loads : mapping of str to tuple, optional
            What bodies carry, as in `inverse_dynamics`; what changes from call to call is prepared anew, in about a
            millisecond.
        gravity : array (3,), optional
            Gravity [m/s²], likewise.

        Raises
        ------
        InvalidArgument or UnknownName
            As in `ik` and `inverse_dynamics`.
        """
        moves = twist_of("twist", twist), twist_of("acceleration", acceleration)
        efforts = self._efforts
        efforts.carry(loads, gravity)
        self.ik(pose)
        is_in_place = self._solution is None and self.status is Status.REACHED
        if not (is_in_place and efforts.at_pose(self._rows.poses[0], *moves)):
            efforts.at(self.solution, *moves, loads, gravity)
        return self._efforts_seen

    def jacobian(self) -> Floats:
        """The forward Jacobian at the last answer, (6 or 3, n_a): twist per actuator rate; see `forward_jacobian`.

        Raises
        ------
        InvalidArgument
            There is no answer.
        """
        self._forward[:] = forward_jacobian(self.solution)
        return read_only(self._forward)

    @property
    def solution(self) -> Solution:
        """The last answer as a `Solution`, which later calls do not change.

        Raises
        ------
        InvalidArgument
            There is none: nothing was solved yet, or the last call raised.
        """
        if self._solution is None:
            if self.status is Status.INVALID:
                raise InvalidArgument("solution", "no answer", "a question before that is not refused")
            if self._was_forward:
                values = self._rows.actuators[0]
                self._solution = solve_fk(self.mechanism, values, start=self._start, options=self.options)
            else:
                self._solution = solve_ik(self.mechanism, self._target[0], start=self._start, options=self.options)
        return self._solution

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle as a new solver without an answer: memory addresses hold in one process only."""
        return partial(type(self), start=self._start, options=self.options), (self.mechanism,)

    def __repr__(self) -> str:
        return f"<Solver of '{self.mechanism.name}': {self.status}>"

    def _store(self, solution: Solution, name: str) -> Status:
        """Store a solution of `solve_ik` or `solve_fk` as the last answer."""
        if solution.shape != ():
            raise InvalidArgument(name, f"batch shape {solution.shape}", "one at a time")
        rows = solution._rows
        self._rows.poses[:], self._rows.actuators[:] = rows.poses, rows.actuators
        self._solution, self.status = solution, Status(int(rows.status[0]))
        return self.status

    def _clear(self) -> None:
        """Forget the last answer."""
        self._solution, self.status = None, Status.INVALID
        self._rows.poses[:], self._rows.actuators[:] = np.nan, np.nan


def prepare(mechanism: Mechanism) -> None:
    """Let first answers, within reach and out of it, prepare what later ones use: 0.1 s, once a machine."""
    home, shift = mechanism.home_pose, FAR * mechanism.characteristic_length
    far = pose(home[:3, 3] + shift, rotvec=(FAR, 0.0, 0.0))
    at_home = solve_ik(mechanism, home)
    solve_ik(mechanism, far)
    assert len(track(mechanism, np.stack([home, far])).q) == 2
    for change in (0.0, shift):
        solve_fk(mechanism, at_home.actuators + change)
    forward_jacobian(at_home)
    singularity(at_home)
