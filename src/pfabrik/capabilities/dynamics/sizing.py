"""What each actuator must do along a motion: the numbers that a motor and its gear are chosen by."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...common.arrays import Floats
from ...common.printed import Printed, ResultTable, plain
from ...kinematics import drive_limits, readouts
from ...machine.description.mechanism import Mechanism
from .drives import drives_of

PER_MINUTE = 30.0 / np.pi
"""Turns per minute of a radian per second."""


STANDS, ALIKE = 1e-5, 1e-3
"""Share of the highest rate or power up to which one is printed as 0, for differences of places leave as much; and
share by which forces, or rates, differ that count as one: a motor at its limit is there for a while."""


@dataclass(frozen=True, eq=False)
class Sizing(Printed):
    """What each actuator must do along a motion, (n_a,) each, as `Efforts.sizing` has it.

    On the actuator's coordinate, rotor and friction included; means are over time, or over rows without times. NaN
    where no row has forces.

    Attributes
    ----------
    rms : array (n_a,)
        Root mean square of the force or torque, which warms a motor [N, N m].
    peak, rate_at_peak : array (n_a,)
        The force or torque of the largest magnitude [N, N m], and the rate there [length or rad per s]: where the force
        is that, to a thousandth, the highest rate, and the sign that goes with it.
    peak_rate : array (n_a,)
        The highest rate, of either sign [length or rad per s].
    peak_power, braking, mean_power : array (n_a,)
        The most power that the actuator gives, the most that it takes, and the mean of what it gives [W].
    torque_margin, speed_margin : array (n_a,)
        What is left of `max_torque` and `max_speed`: 1 of an idle motor, 0 at the limit, negative beyond; NaN where the
        machine has none.
    motor_rms, motor_peak, motor_speed : array (n_a,)
        Torques [N m] and highest speed [rad/s] of the motor before a `gear` without losses; NaN where the machine has
        none.
    """

    rms: Floats
    peak: Floats
    rate_at_peak: Floats
    peak_rate: Floats
    peak_power: Floats
    braking: Floats
    mean_power: Floats
    torque_margin: Floats
    speed_margin: Floats
    motor_rms: Floats
    motor_peak: Floats
    motor_speed: Floats
    _mechanism: Mechanism = field(repr=False)

    def table(self) -> ResultTable:
        """A row for each actuator; margins where there are limits, and a table of the motors before their gears."""
        units, shown = drives_of(self._mechanism).forces, readouts(self._mechanism)
        margins = {"of torque": self.torque_margin, "of speed": self.speed_margin}
        margins = {name: left for name, left in margins.items() if np.isfinite(left).any()}
        least, rows, motors = 1e-9 * np.abs(self.peak).max(initial=0.0), [], []
        for place, each in enumerate(shown):
            there, fastest = (float(each.display(x[place])) for x in (self.rate_at_peak, self.peak_rate))
            rates = (plain(x, STANDS * fastest, ".5g") for x in (there, fastest))
            power = max(self.peak_power[place], self.braking[place])
            powers = (self.peak_power, self.braking, self.mean_power)
            watts = (plain(float(x[place]), STANDS * power, ".5g") for x in powers)
            forces = (plain(float(x[place]), least, ".5g") for x in (self.rms, self.peak))
            left = (plain(float(x[place]), 0.0, ".0%") for x in margins.values())
            rows.append([each.name, *forces, units[place], *rates, f"{each.unit}/s", *watts, *left])
            if np.isfinite(self.motor_rms[place]):
                speed = PER_MINUTE * self.motor_speed[place]
                numbers = (self.motor_rms[place], self.motor_peak[place], speed)
                motors.append([each.name, *(plain(float(x), 0.0, ".5g") for x in numbers)])
        header = ["actuator", "rms", "peak", "unit", "at rate", "peak rate", "unit"]
        header += ["gives [W]", "brakes [W]", "mean [W]"]
        header += [f"left {name}" for name in margins]
        before = ResultTable("Motors", (), ("motor", "rms [N m]", "peak [N m]", "peak rate [rpm]"), motors)
        return ResultTable(self._mechanism.name, (), header, rows, more=[before] if motors else [])


def sizing_of(mechanism: Mechanism, exerted: Floats, rates: Floats, power: Floats, weights: Floats) -> Sizing:
    """The sizing of forces, rates and power, (n, n_a), of rows that count as their weights, (n,)."""
    known = ~np.isnan(exerted).any(axis=1)
    if not known.any():
        exerted = rates = power = np.full((1, exerted.shape[1]), np.nan)
        known, weights = np.ones(1, bool), np.ones(1)
    exerted, rates, power, shares = exerted[known], rates[known], power[known], weights[known] / weights[known].sum()
    drives, size, speed = drives_of(mechanism), np.abs(exerted), np.abs(rates)
    rms, most, fastest = np.sqrt(shares @ exerted**2), size.max(axis=0), speed.max(axis=0)
    near = np.where(size >= (1.0 - ALIKE) * most, speed, -np.inf)
    row = np.argmax(near >= (1.0 - ALIKE) * near.max(axis=0) - STANDS * fastest, axis=0)  # the first of those alike
    there = row, np.arange(len(row))
    peak = np.copysign(most, exerted[there])
    gears = np.array([drive.said("gear") or np.nan for drive in mechanism.drives])
    return Sizing(
        rms,
        peak,
        rates[there],
        fastest,
        np.maximum(power.max(axis=0), 0.0),
        np.maximum(-power.min(axis=0), 0.0),
        shares @ power,
        _left(peak, drives.limits),
        _left(fastest, drive_limits(mechanism, "speed", None)),
        rms / np.abs(gears),
        peak / gears,
        fastest * drives.si * np.abs(gears),
        mechanism,
    )


def _left(values: Floats, limits: Floats) -> Floats:
    """What values leave of limits, as a share; NaN of those that are infinite."""
    return np.where(np.isfinite(limits), 1.0 - np.abs(values) / limits, np.nan)


def seconds_of(times: Floats) -> Floats:
    """The time that each of rows at times (n,) stands for, by the trapezoidal rule [s]; 1 of a single row."""
    if len(times) < 2:
        return np.ones(len(times))
    halves = 0.5 * np.diff(times)
    return np.asarray(np.append(halves, 0.0) + np.append(0.0, halves))
