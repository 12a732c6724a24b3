"""The last request to a machine and its answer: the state of the viewer, without a page."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...answers.words import as_sentence
from ...arrays import Floats
from ...configuration import configuration
from ...description.mechanism import Mechanism
from ...fk import solve_fk
from ...ik import solve_ik
from ...kinematics import JointPath, home_coordinates, joint_path, passive_series
from ...poses import pose
from ...rotations import to_rpy

DIGITS = 9
"""Digits after the point that are shown: further ones are rounding; no -0.0 is shown."""


COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


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
    """

    def __init__(self, mechanism: Mechanism, solution: Solution | None = None) -> None:
        self.mechanism, series = mechanism, passive_series(mechanism)
        self.path: JointPath | None = joint_path(mechanism, series) if series else None
        home = configuration(mechanism, home_coordinates(mechanism))
        self.solution = home
        self.start = home
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
        self._answer(solution, "configuration")

    def _answer(self, solution: Solution, asked: Literal["pose", "actuators", "configuration"]) -> None:
        self.solution, self.asked = solution, asked
        self.target, self.actuators = np.array(solution.pose), np.array(solution.actuators)
        if solution.status <= Status.PROJECTED:
            self.start = solution

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
