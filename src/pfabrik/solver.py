"""A machine prepared for control loops: the same answers as `solve_ik` and `solve_fk` give, in arrays that stay."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from .answers.differential import forward_jacobian
from .answers.solution import Solution
from .answers.starts import Start, start_of
from .answers.status import Status
from .arrays import Floats
from .closure.configurations import new_rows
from .description.mechanism import Mechanism, checked_mechanism
from .engine import inverse_engine_of
from .errors import InvalidArgument
from .fk import Actuators, solve_fk
from .ik import keeps_mode, solve_ik
from .options import Options, checked_options
from .platform.solve import LegsEngine
from .poses import DOUBLE
from .targets import Target
from .warm_up import warm_up


class Solver:
    """Asks one machine again and again, one question at a time.

    Everything is compiled, or loaded, when it is made, which is announced on standard error; questions compile nothing.
    Targets that legs in closed form reach are answered in arrays made once; others take what `solve_ik` takes.
    An instance is for one thread: make one for each.

    Attributes
    ----------
    status : a `Status`, of the last answer; INVALID before the first, and where a question was refused.
    pose : T_base_platform achieved, (4, 4) [length]; NaN where `status` is INVALID.
    actuators : in the order of `mechanism.actuator_names`, (n_a,) [length or rad]; likewise.

    `pose`, `actuators` and what `jacobian` returns are views, the same arrays each time: the next question overwrites
    them. Copy what is to stay, or take `solution`. They can be read only.
    """

    def __init__(self, mechanism: Mechanism, *, start: Start | None = None, options: Options | None = None) -> None:
        """Compile, or load, what questions need.

        Parameters
        ----------
        start : where every search starts, as of `solve_ik`: its working mode is kept, and its assembly mode. Default:
            home, and any working mode.
        options : of every question.

        Raises
        ------
        InvalidArgument : no Mechanism; a start that is no single configuration of it.
        """
        self.mechanism, self.options = checked_mechanism(mechanism), checked_options(options)
        self._start, begin = start, start_of(mechanism, start, ())
        warm_up(mechanism)
        self._engine = inverse_engine_of(mechanism, self.options)
        self._rows, self._target = new_rows(mechanism, 1), np.eye(4)[None]
        self._reach: Callable[[], int] | None = None
        self._assemble: Callable[[], int] | None = None
        if isinstance(self._engine, LegsEngine):
            keep_mode = keeps_mode(self.options, start)
            self._reach = self._engine.prepared(self._target, begin, self._rows, keep_mode=keep_mode)
            self._assemble, self._kept = self._engine.prepared_forward(begin, self._rows)
        self._forward = np.empty((3 if mechanism.end_effector_is_joint else 6, len(mechanism.actuator_names)))
        self.pose, self.actuators = _read_only(self._rows.poses[0]), _read_only(self._rows.actuators[0])
        self.status = Status.INVALID
        self._solution: Solution | None = None
        self._was_forward = False
        self._clear()

    def ik(self, target: Target) -> Status:
        """Answer a target as `solve_ik` does; its status.

        Parameters
        ----------
        target : one, as of `solve_ik`; a pose as an array (4, 4) of float64 is the quickest.

        Raises
        ------
        InvalidArgument : as of `solve_ik`; then `status` is INVALID.
        """
        if type(target) is np.ndarray and target.shape == (4, 4) and target.dtype is DOUBLE:
            self._target[0] = target
            if self._reach is not None and not self._reach():
                self._solution, self._was_forward, self.status = None, False, Status.REACHED
                return Status.REACHED
        asked = target.copy() if isinstance(target, np.ndarray) else target
        self._clear()
        return self._take(solve_ik(self.mechanism, asked, start=self._start, options=self.options), "target")

    def fk(self, actuators: Actuators) -> Status:
        """Answer actuator values (n_a,) [length or rad] as `solve_fk` does; the status.

        Raises
        ------
        InvalidArgument : as of `solve_fk`; then `status` is INVALID.
        """
        if type(actuators) is np.ndarray and actuators.shape == self.actuators.shape and actuators.dtype is DOUBLE:
            self._rows.actuators[0] = actuators
            if self._assemble is not None and not self._assemble():
                self._solution, self._was_forward, self.status = None, True, Status.REACHED
                return Status.REACHED
        asked = actuators.copy() if isinstance(actuators, np.ndarray) else actuators
        self._clear()
        found = solve_fk(self.mechanism, asked, start=self._start, options=self.options)
        return self._take(found, "actuators")

    def jacobian(self) -> Floats:
        """Twist of the end effector per actuator rate at the last answer, as of `forward_jacobian`, (6 or 3, n_a).

        Raises
        ------
        InvalidArgument : there is no answer.
        """
        self._forward[:] = forward_jacobian(self.solution)
        return _read_only(self._forward)

    @property
    def solution(self) -> Solution:
        """The last answer with all that is told of one, which later questions leave as it is.

        Raises
        ------
        InvalidArgument : there is none: nothing was asked, or the last question was refused.
        """
        if self._solution is None:
            if self.status is Status.INVALID:
                raise InvalidArgument("solution", "no answer", "a question before that is not refused")
            if self._was_forward:
                asked = self._rows.actuators[0]
                self._solution = solve_fk(self.mechanism, asked, start=self._start, options=self.options)
            else:
                self._solution = solve_ik(self.mechanism, self._target[0], start=self._start, options=self.options)
        return self._solution

    def __reduce__(self) -> tuple[Any, ...]:
        """For copies and other processes: prepared anew, and not asked yet. Addresses lead nowhere there."""
        return partial(type(self), start=self._start, options=self.options), (self.mechanism,)

    def __repr__(self) -> str:
        return f"<Solver of '{self.mechanism.name}': {self.status}>"

    def _take(self, found: Solution, name: str) -> Status:
        """Take over an answer given elsewhere."""
        if found.shape != ():
            raise InvalidArgument(name, f"batch shape {found.shape}", "one at a time")
        rows = found._rows
        self._rows.poses[:], self._rows.actuators[:] = rows.poses, rows.actuators
        self._solution, self.status = found, Status(int(rows.status[0]))
        return self.status

    def _clear(self) -> None:
        """Have no answer, until there is one."""
        self._solution, self.status = None, Status.INVALID
        self._rows.poses[:], self._rows.actuators[:] = np.nan, np.nan


def _read_only(array: Floats) -> Floats:
    """A view that follows what its owner writes."""
    view = array.view()
    view.setflags(write=False)
    return view
