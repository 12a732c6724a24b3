"""What was asked of a machine last, and its answer: the viewer without anything to look at."""

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
from ...motion.displacements import home_coordinates
from ...poses import pose
from ...rotations import to_rpy

DIGITS = 9
"""Digits after the point of what is shown: below is rounding, and no -0.0."""


class Session:
    """One machine, what it is asked for, and what it answers.

    Every answer starts from the one before, and stays in its working mode, as far as that was feasible.

    Attributes
    ----------
    target : the pose asked for, (4, 4); where something else was asked for, the pose that came of it.
    actuators : the actuator values asked for, or those that came of what was, (n_a,) [length or rad].
    solution : the answer.
    start : the last feasible answer, which the next one starts from.
    asked : what was asked for last: a "pose", "actuators", or a "configuration" that was given.
    """

    def __init__(self, mechanism: Mechanism, solution: Solution | None = None) -> None:
        self.mechanism = mechanism
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
    def sentence(self) -> str:
        """What became of what was asked for."""
        return as_sentence(self.solution, self.actuators if self.asked == "actuators" else None)

    @property
    def pose_as_python(self) -> str:
        """The target as what is typed in Python."""
        place = ", ".join(f"{value:.6g}" for value in self.target[:3, 3].round(DIGITS) + 0.0)
        turned = np.degrees(to_rpy(self.target[:3, :3])).round(DIGITS) + 0.0
        angles = ", ".join(f"{value:.6g}" for value in turned)
        return f"pf.pose([{place}], rpy=[{angles}], degrees=True)"


def moved(target: Floats, name: str, value: float) -> Floats:
    """A pose with one of its coordinates changed: "x", "y", "z" [length], "roll", "pitch", "yaw" [deg]."""
    place, angles = np.array(target[:3, 3]), np.degrees(to_rpy(target[:3, :3]))
    if name in "xyz":
        place["xyz".index(name)] = value
    else:
        angles[("roll", "pitch", "yaw").index(name)] = value
    return pose(place, rpy=angles, degrees=True)
