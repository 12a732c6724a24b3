"""What actuators exert, and joints transmit, in motion."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, TextIO, cast

import numpy as np

from ...answers.status import Status
from ...answers.tracked import MOST_NAMED
from ...common.arrays import Floats, Mask, as_plain, shaped
from ...common.cells import CsvWriter
from ...common.drawing import Size, Theme, drawn
from ...common.frozen import FrozenMapping
from ...common.printed import Printed, ResultTable, plain
from ...common.whole_files import whole_path
from ...errors import InvalidArgument, counted
from ...kinematics import readouts
from ...machine.description.mechanism import Mechanism
from ..statics.joint_balance import open_in_words
from ..statics.loads import Reasons, reasons_in_words
from .drives import Drives, drives_of
from .moving_rows import MovingRows
from .path_notes import path_notes
from .sizing import Sizing, seconds_of, sizing_of
from .transmitted import transmitted

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Efforts(Printed):
    """What actuators exert in motion, as `inverse_dynamics` returns it.

    Attributes
    ----------
    actuators : array (..., n_a)
        Force or torque that each actuator exerts on its coordinate, rotor and friction included [N, N m]: positive
        drives it up. NaN where `reason` says why.
    rates, accelerations : array (..., n_a)
        Those of the actuators [length or rad, per s and per s²].
    at_rest : array of bool (..., n_a)
        True for actuators that stand still, to rounding: dry friction counts as 0 there, and may be anything up to its
        size.
    power : array (..., n_a)
        What each actuator gives to the machine, negative where it brakes [W].
    projected : array of bool (...)
        True where the target is out of reach: forces are those of the nearest feasible poses, which the machine takes.
    times : array (n,) or None
        Times of the rows of a path [s]; None for others.
    energy : array (n,) or None
        What all actuators have given since the first row [J]; None without times.
    is_least_norm : bool
        True if there are more actuators than motions that they control: of all forces that make the motion, those with
        the least sum of squares are given, torques compared with forces times L: within `max_torque` where any are.
    reason : str or array of str (...)
        Why there are no such forces; empty where there are. A text for a single answer.
    """

    actuators: Floats
    rates: Floats
    accelerations: Floats
    at_rest: Mask
    times: Floats | None
    is_least_norm: bool
    reason: str | Reasons
    _rows: MovingRows = field(repr=False)

    @property
    def _mechanism(self) -> Mechanism:
        return self._rows.solution.mechanism

    @property
    def _drives(self) -> Drives:
        return drives_of(self._mechanism)

    @property
    def projected(self) -> Mask:
        """See the attributes."""
        return np.asarray(np.asarray(self._rows.solution.status) == Status.PROJECTED)

    @cached_property
    def _transmitted(self) -> tuple[Floats, Mask]:
        return transmitted(self._rows, np.reshape(self.actuators, (-1, len(self._mechanism.actuator_names))))

    @cached_property
    def power(self) -> Floats:
        """See the attributes."""
        return np.asarray(self.actuators * self.rates * self._drives.si)

    @cached_property
    def energy(self) -> Floats | None:
        """See the attributes."""
        if self.times is None:
            return None
        power = self.power.sum(axis=-1)
        return np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(self.times))])

    @cached_property
    def reactions(self) -> FrozenMapping[str, Floats]:
        """Joint -> force and moment that its first body exerts on its second, (..., 6) [N, N m], in the base frame.

        Moments are about the points that `Forces.reactions` has. NaN where `reason` says why, and where `undetermined`
        does.
        """
        joints, shape = enumerate(self._mechanism.joints), self._rows.solution.shape
        return FrozenMapping({joint.name: shaped(self._transmitted[0][:, place], shape) for place, joint in joints})

    @property
    def undetermined(self) -> str:
        """Which of the reactions the motion does not determine, in words; empty if it determines all."""
        return open_in_words(self._mechanism, self._transmitted[1])

    @cached_property
    def sizing(self) -> Sizing:
        """What each actuator must do over all rows: rms and peak, rates, power, and what that leaves of its limits."""
        flat = (np.reshape(x, (-1, len(self._drives.forces))) for x in (self.actuators, self.rates, self.power))
        exerted, rates, power = flat
        weights = np.ones(len(exerted)) if self.times is None else seconds_of(self.times)
        return sizing_of(self._mechanism, exerted, rates, power, weights)

    def table(self) -> ResultTable:
        """What each actuator exerts, its power and rate; of a batch, its sizing."""
        lines, limits = reasons_in_words(self.reason, "no forces"), self._drives.limits
        if np.isnan(self.sizing.rms).any():
            return ResultTable(self._mechanism.name, lines or ["no row"])
        exerted = np.reshape(self.actuators, (-1, len(self._drives.forces)))
        remarks = [*self._out_of_reach, *self._resting, *path_notes(self._rows, exerted)]
        if self.energy is not None and self.times is not None and np.isfinite(self.energy[-1]):
            given = plain(float(self.energy[-1]), 1e-6 * float(np.nanmax(np.abs(self.energy))))
            remarks.append(f"given in all: {given} J in {np.ptp(self.times):.6g} s")
        if np.ndim(self.actuators) > 1:
            return replace(self.sizing.table(), lines=lines, remarks=remarks)
        header = ["actuator", "exerts", "unit", "power [W]", "rate"] + ["of its limit"] * bool(
            np.isfinite(limits).any()
        )
        rows, least = [], 1e-9 * np.abs(self.actuators).max()
        for place, each in enumerate(readouts(self._mechanism)):
            force, rate = self.actuators[place], float(each.display(self.rates[place])) + 0.0
            cells = [each.name, plain(force, least), self._drives.forces[place]]
            cells += [f"{self.power[place] + 0.0:.6g}", f"{rate:.6g} {each.unit}/s"]
            cells += [plain(abs(force) / limits[place] if np.isfinite(limits[place]) else np.nan, -1.0, ".0%")]
            rows.append(cells[: len(header)])
        return ResultTable(self._mechanism.name, lines, header, rows, remarks)

    @property
    def _out_of_reach(self) -> list[str]:
        """The targets whose nearest poses are taken, a sentence if there are any."""
        rows = np.flatnonzero(self.projected) + 1
        if not len(rows):
            return []
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        named = [f"{run[0]}" if len(run) == 1 else f"{run[0]} to {run[-1]}" for run in runs[:MOST_NAMED]]
        more = f" and {counted(len(runs) - MOST_NAMED, 'more run')}" if len(runs) > MOST_NAMED else ""
        which = f": {', '.join(named)}{more}" if np.ndim(self.reason) else ""
        return [f"out of reach, so forces are those of the nearest poses: {counted(len(rows), 'target')}{which}"]

    @property
    def _resting(self) -> list[str]:
        """What dry friction at rest may be, a sentence if there is any."""
        names, units, dry = self._mechanism.actuator_names, self._drives.forces, self._drives.friction[:, 0]
        counts = np.reshape(self.at_rest, (-1, len(names))).sum(axis=0)
        where: dict[str, list[str]] = {}
        for place in np.flatnonzero((counts > 0) & (dry > 0.0)):
            rows = "" if np.ndim(self.actuators) == 1 else f", in {counted(int(counts[place]), 'row')}"
            where.setdefault(f"{dry[place]:.6g} {units[place]}{rows}", []).append(names[place])
        most = "; ".join(f"{', '.join(actuators)} ({size})" for size, actuators in where.items())
        return [f"at rest dry friction counts as 0, and may be up to its size either way: {most}"] * bool(where)

    def to_dict(self) -> dict[str, Any]:
        """Its fields, with `projected`, power, energy and sizing, as plain numbers, lists and texts, ready for JSON."""
        more = {
            "projected": self.projected.tolist(),
            "power": as_plain(self.power),
            "energy": as_plain(self.energy),
            "sizing": self.sizing.to_dict(),
        }
        return {**super().to_dict(), **more}

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write a row for each time: what actuators exert [N m, N], their rates [deg/s, length/s] and power [W], the
        energy given so far [J], 1 where the target is out of reach, and why there are no forces, where there are none.

        The file appears whole or not at all.

        Raises
        ------
        InvalidArgument
            Configurations that are no path with times.
        """
        self._require_times()
        with whole_path(path) as part, part.open("w", newline="", encoding="utf-8") as handle:
            self.write(handle)

    def write(self, handle: TextIO) -> None:
        """Write the columns of `to_csv` to an open file."""
        times, shown = self._require_times(), readouts(self._mechanism)
        rates = [each.display(column) for each, column in zip(shown, self.rates.T, strict=True)]
        numbers = np.column_stack([times, self.actuators, *rates, self.power, np.asarray(self.energy)])
        writer = CsvWriter(handle)
        header = [f"effort_{each.name}" for each in shown]
        header += [f"rate_{each.name}{'_deg' if each.is_angle else ''}" for each in shown]
        writer.writerow(["t", *header, *(f"power_{each.name}" for each in shown), "energy", "projected", "reason"])
        for row, is_off, reason in zip((numbers + 0.0).tolist(), self.projected.tolist(), self.reason, strict=True):
            writer.writerow([*row, int(is_off), reason])

    def _require_times(self) -> Floats:
        if self.times is None:
            raise InvalidArgument("efforts", "no path with times", "those of a `track` with times, or of `time_path`")
        return self.times

    def plot(self, *, size: Size | None = None, theme: Theme = "light") -> Figure:
        """Forces of every actuator over time and over its rate, between its limits, and the power of all.

        Rms and peak are drawn and named; what is at a limit is orange, and times with targets out of reach are grey.

        Parameters
        ----------
        size : (float, float), optional
            Width and height of the figure [inches].
        theme : {"light", "dark"}, optional
            As in `plot`.

        Raises
        ------
        InvalidArgument
            Configurations that are no path with times; no such size or theme.
        """
        self._require_times()
        return cast("Figure", drawn(self, size, theme))
