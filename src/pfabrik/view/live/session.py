"""The last request to a machine and its answer: the state of the viewer, without a page."""

from __future__ import annotations

from collections import deque
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...answers.words import as_sentence
from ...common.arrays import Floats
from ...common.rotations import to_rpy
from ...configuration import configuration
from ...fk import solve_fk
from ...ik import solve_ik
from ...kinematics import JointPath, home_coordinates, joint_path, passive_series
from ...machine.description.mechanism import Mechanism
from ...machine.poses import pose
from .distances import Nearness, nearness, side_of

DIGITS = 9
"""Digits after the point that are shown: further ones are rounding; no -0.0 is shown."""


COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


MOST_STEPS = 200
"""Steps that can be undone."""

SINGULAR = 1e-3
"""Measure below which an answer is too near to a singularity for the sides of parallel ones to have a sign."""

SAME = 1e-12
"""Share of a value, and of the characteristic length, by which rounding alone changes a target that is given again."""

Asked: TypeAlias = Literal["pose", "actuators", "configuration"]


class _Step(NamedTuple):
    """A state of a session, to go back to."""

    solution: Solution
    start: Solution
    asked: Asked
    target: Floats
    actuators: Floats
    side: float


class Session:
    """One machine, its target or actuator values, and its answer.

    Every answer starts from the one before, and stays in its working mode, as far as that was feasible.

    Attributes
    ----------
    target : the target pose, (4, 4); the answer's pose if actuator values or a configuration were given.
    actuators : the given actuator values, else those of the answer, (n_a,) [length or rad].
    solution : the answer.
    start : the last feasible answer, which the next one starts from.
    asked : what was given last: a "pose", "actuators", or a "configuration".
    path : the passive joints in series that carry the end effector, whose coordinates can be given too; None without.
    home : the configuration at home.
    """

    def __init__(self, mechanism: Mechanism, solution: Solution | None = None) -> None:
        self.mechanism, series = mechanism, passive_series(mechanism)
        self.path: JointPath | None = joint_path(mechanism, series) if series else None
        home = configuration(mechanism, home_coordinates(mechanism))
        self.solution = self.start = self.home = home
        self._past: deque[_Step] = deque(maxlen=MOST_STEPS)
        self._gesture: object = None
        self.show(home if solution is None else solution)

    def go_to(self, target: Floats) -> None:
        """Ask for a pose (4, 4)."""
        self._answer(solve_ik(self.mechanism, target, start=self.start), "pose")
        self.target = np.array(target)

    def drive(self, actuators: Floats) -> None:
        """Ask for actuator values (n_a,)."""
        self._answer(solve_fk(self.mechanism, actuators, start=self.start), "actuators")
        self.actuators = np.array(actuators, float)

    def show(self, solution: Solution) -> None:
        """Take a configuration as it is: a working mode, a step of a track."""
        self._side = np.nan
        self._answer(solution, "configuration")

    def remember(self, gesture: object) -> None:
        """Keep the present state as a step that can be undone, unless it is in the midst of the same gesture."""
        if gesture != self._gesture:
            self._gesture = gesture
            self._past.append(_Step(self.solution, self.start, self.asked, self.target, self.actuators, self._side))

    def forget_nothing_new(self) -> None:
        """Drop the step that was kept last where the present state is the one that it would go back to."""
        if self._past and self._past[-1].asked == self.asked:
            before, small = self._past[-1], SAME * max(1.0, self.mechanism.characteristic_length)
            pairs = {
                "pose": (before.target, self.target),
                "actuators": (before.actuators, self.actuators),
                "configuration": (before.solution.q, self.solution.q),
            }
            is_same = np.allclose(*pairs[self.asked], rtol=SAME, atol=small, equal_nan=True)
            if is_same and before.solution.status == self.solution.status:
                self._past.pop()
                self._gesture = None

    def undo(self) -> None:
        """Go back to before the last gesture, if there was one."""
        if self._past:
            self.solution, self.start, self.asked, self.target, self.actuators, self._side = self._past.pop()
            self._gesture = None

    def _answer(self, solution: Solution, asked: Asked) -> None:
        self.solution, self.asked = solution, asked
        self.target, self.actuators = np.array(solution.pose), np.array(solution.actuators)
        if solution.status <= Status.PROJECTED:
            self.start = solution
        serial, _ = self.nearness
        if serial.measure < SINGULAR:
            self._side = np.nan
        elif np.isnan(self._side):
            self._side = side_of(solution)

    @property
    def nearness(self) -> tuple[Nearness, Nearness]:
        """Distances of the answer from serial and from parallel singularities."""
        return nearness(self.solution, self.home)

    @property
    def is_across(self) -> bool:
        """True if a parallel singularity was passed since a configuration was shown, or a leg was at a dead point."""
        _, parallel = self.nearness
        return bool(parallel.measure >= SINGULAR and side_of(self.solution) * self._side < 0.0)

    @property
    def joints(self) -> Floats:
        """Coordinates of `path` at the target, (k,) [rad or length]; of the answer, where the target is not on it."""
        if self.path is None:
            return np.empty(0)
        of_answer = self.solution.q[self.path.columns]
        of_target = self.path.coordinates_at(self.target[None], of_answer)[0]
        return np.asarray(of_answer if np.isnan(of_target).any() else of_target)

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        return as_sentence(self.solution)

    @property
    def pose_as_python(self) -> str:
        """The target as a Python expression."""
        words = [f"{np.round(value, DIGITS) + 0.0:.6g}" for value in coordinates(self.target).values()]
        return f"pf.pose([{', '.join(words[:3])}], rpy=[{', '.join(words[3:])}], degrees=True)"


def coordinates(target: Floats) -> dict[str, float]:
    """A pose (4, 4) as "x", "y", "z" [length], and "roll", "pitch", "yaw" [deg]."""
    values = np.concatenate([target[:3, 3], np.degrees(to_rpy(target[:3, :3]))])
    return dict(zip(COORDINATES, values.tolist(), strict=True))


def moved(target: Floats, name: str, value: float) -> Floats:
    """A pose with one of its `coordinates` changed."""
    values = list((coordinates(target) | {name: value}).values())
    return pose(values[:3], rpy=values[3:], degrees=True)
