"""A path with its times."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TextIO, TypeAlias

import numpy as np

from ...answers.solution import Solution
from ...answers.tracked import Track
from ...common.arrays import Floats, Ints
from ...common.cells import CsvWriter
from ...common.drawing import curves_over_time
from ...common.printed import Printed, ResultTable
from ...common.rotations import to_rpy
from ...common.whole_files import whole_path
from ...errors import counted
from ...fk import solve_fk
from ...kinematics import readouts
from ...machine.description.mechanism import Mechanism

if TYPE_CHECKING:
    from matplotlib.figure import Figure

What: TypeAlias = Literal["speed", "acceleration", "torque", "angular acceleration"]

EXCEEDED = 1e-3
"""Share of a limit by which it is exceeded: what a grid between whose points speeds are kept costs of the time."""

REACHED = 0.99
"""Share of a limit from which on a sample counts as held back by it; some limits bind only at the next grid point."""


class Exceeded(NamedTuple):
    """A limit that a timing exceeds, where it does most.

    Attributes
    ----------
    actuator : str
        The actuator, several of redundant ones, or "platform".
    what : {"speed", "acceleration", "torque", "angular acceleration"}
        What is limited.
    share : float
        The largest share of the limit.
    time : float
        When that is [s].
    step : int
        The step of the track that it is at, or after.
    duration : float
        For how long the limit is exceeded in all, to a few steps of the grid [s].
    """

    actuator: str
    what: What
    share: float
    time: float
    step: int
    duration: float


@dataclass(frozen=True, eq=False, repr=False)
class Timed(Printed):
    """A path as fast as it may be followed, in n samples.

    Attributes
    ----------
    mechanism : Mechanism
        The machine.
    times : array (n,)
        Times of the samples [s].
    steps : array of int (n,)
        The step of the track that each sample is at, or after.
    poses : array (n, 4, 4)
        Poses of the end effector [length].
    actuators, rates, accelerations : array (n, n_a)
        Coordinates of the actuators, their rates and accelerations [length or rad, per s, per s^2].
    platform_speeds : array (n,)
        Speeds of the reference point [length/s].
    used : array (n,)
        The largest share of any limit.
    binding : array of int (n,)
        Index of that limit in `limits`.
    limits : tuple of tuple of str
        Pairs (actuator, "speed", "acceleration" or "torque") of all actuators, and ("platform", "speed"); where the
        platform's are limited, also with "acceleration" and "angular acceleration". Redundant actuators are at their
        limits of torque several at once: "A1 and A3".
    exceeded : tuple of Exceeded
        Those that are exceeded by more than a thousandth, by how much, when and where, the most first; empty where all
        are kept. It is looked for between the samples too.
    """

    mechanism: Mechanism
    times: Floats
    steps: Ints
    poses: Floats
    actuators: Floats
    rates: Floats
    accelerations: Floats
    platform_speeds: Floats
    used: Floats
    binding: Ints
    limits: tuple[tuple[str, What], ...]
    exceeded: tuple[Exceeded, ...]
    _track: Track = field(repr=False)

    @cached_property
    def solution(self) -> Solution:
        """The configurations of the samples, (n,), by their actuators."""
        return solve_fk(self.mechanism, self.actuators, start=self._track[self.steps])

    @property
    def duration(self) -> float:
        """Duration of the whole path [s]."""
        return float(self.times[-1])

    @property
    def held_back(self) -> dict[tuple[str, What], float]:
        """(actuator, what) -> share of the time in which this limit holds the path back, the longest first."""
        weights = np.gradient(self.times) if len(self.times) > 1 else np.ones(1)
        shares = {
            limit: float(weights[(self.binding == place) & (self.used >= REACHED)].sum() / weights.sum())
            for place, limit in enumerate(self.limits)
        }
        return {limit: share for limit, share in sorted(shares.items(), key=lambda each: -each[1]) if share > 0.0}

    def __repr__(self) -> str:
        name = self.mechanism.name
        return f"<Timed path of '{name}': {self.duration:.6g} s, {counted(len(self.times), 'sample')}>"

    def table(self) -> ResultTable:
        """Duration, the limits that hold the path back, and those that it exceeds."""
        lines = [f"{self.duration:.6g} s, {counted(len(self.times), 'sample')}"]
        rows = [(name, what, f"{share:.1%}") for (name, what), share in self.held_back.items()]
        beyond = [
            f"{each.actuator} exceeds its limit of {each.what} by {each.share - 1.0:.2%}, at {each.time:.6g} s, step "
            f"{each.step}; by more than {EXCEEDED:.1%} for {each.duration:.2g} s in all"
            for each in self.exceeded
        ]
        header = ("held back by", "limit", "share of the time")
        return ResultTable(self.mechanism.name, lines, header, rows, ["\n".join(beyond)] * bool(beyond))

    def to_dict(self) -> dict[str, Any]:
        """Duration, number of samples, the limits that hold the path back and those exceeded, ready for JSON."""
        held = [{"actuator": name, "what": what, "share": share} for (name, what), share in self.held_back.items()]
        exceeded = [each._asdict() for each in self.exceeded]
        return {"duration": self.duration, "samples": len(self.times), "held_back": held, "exceeded": exceeded}

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write times, poses, actuators, their rates and accelerations; angles in degrees.

        The file appears whole or not at all.
        """
        with whole_path(path) as part, part.open("w", newline="", encoding="utf-8") as handle:
            self.write(handle)

    def write(self, handle: TextIO) -> None:
        """Write the columns of `to_csv` to an open file."""
        shown = readouts(self.mechanism)
        units = np.array([float(each.display(np.ones(1))[0]) for each in shown])
        names = [f"{each.name}{'_deg' if each.is_angle else ''}" for each in shown]
        writer = CsvWriter(handle)
        header = ["t", "step", "x", "y", "z", "roll_deg", "pitch_deg", "yaw_deg"]
        header += [f"{kind}_{name}" for kind in ("actuator", "rate", "acceleration") for name in names]
        writer.writerow([*header, "platform_speed", "held_back_by"])
        numbers = np.concatenate(
            [
                self.poses[:, :3, 3],
                np.degrees(to_rpy(self.poses[:, :3, :3])),
                self.actuators * units,
                self.rates * units,
                self.accelerations * units,
                self.platform_speeds[:, None],
            ],
            axis=1,
        )
        words = [" ".join(limit) for limit in self.limits]
        for time, step, row, used, place in zip(
            self.times.tolist(),
            self.steps.tolist(),
            (numbers + 0.0).tolist(),
            self.used.tolist(),
            self.binding.tolist(),
            strict=True,
        ):
            writer.writerow([time, step, *row, words[place] if used >= REACHED else ""])

    def plot(self) -> Figure:
        """Actuators, their rates and accelerations over time, one curve each; a Matplotlib figure."""
        shown = readouts(self.mechanism)
        units = np.array([float(each.display(np.ones(1))[0]) for each in shown])
        panels = {"actuators": self.actuators, "rates [/s]": self.rates, "accelerations [/s²]": self.accelerations}
        names = [f"{each.name} [{each.unit}]" for each in shown]
        return curves_over_time(self.times, names, {label: values * units for label, values in panels.items()})
