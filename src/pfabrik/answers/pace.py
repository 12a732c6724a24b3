"""The times of a path and the speed limits of its actuators."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..common.arguments import array, is_not_infinite
from ..common.arrays import Floats
from ..common.checks import put_limits, require_positive
from ..errors import InvalidArgument
from ..machine.description.mechanism import Mechanism

EVEN = 1e-6
"""Relative difference up to which time steps count as equal: times in files have so many digits."""


class Pace(NamedTuple):
    """Times of the targets, and speed limits of the actuators.

    Attributes
    ----------
    times : (n,) [s]; NaN where unknown.
    sample_time : from each target to the next [s]; None if it varies.
    speed_limits : (n_a,) [length/s or rad/s].
    """

    times: Floats
    sample_time: float | None
    speed_limits: Floats


def pace_of(
    mechanism: Mechanism,
    count: int,
    sample_time: float | None,
    times: ArrayLike | None,
    speed_limits: float | Mapping[str, float] | None,
) -> Pace | None:
    """The checked times and speed limits of a path of `count` targets; None without times."""
    names = mechanism.actuator_names
    if sample_time is None and times is None:
        if speed_limits is not None:
            expected = "the time between two targets [s], or times"
            raise InvalidArgument("sample_time", "None beside speed limits", expected)
        return None
    if sample_time is not None:
        sample_time = require_positive("sample_time", sample_time)
        if times is not None:
            raise InvalidArgument("times", "times beside a sample time", "one of them")
        checked = sample_time * np.arange(count, dtype=np.float64)
    else:
        checked = _checked_times(times, count)
        sample_time = _even_step(checked)
    limits = np.full(len(names), np.inf)
    put_limits(limits, "speed_limits", speed_limits, names)
    return Pace(checked, sample_time, limits)


def _checked_times(times: ArrayLike | None, count: int) -> Floats:
    note = ", when each target is to be there [s], NaN where not known"
    checked = array("times", times, f"{count}", "times", note, is_not_infinite).copy()
    if (np.diff(checked[~np.isnan(checked)]) < 0.0).any():
        raise InvalidArgument("times", "times that go back", "times of which none is before one before it")
    return checked


def _even_step(times: Floats) -> float | None:
    """The step of times that are equally far apart; None for others."""
    steps = np.diff(times)
    if not len(steps) or not steps.min() > 0.0 or np.ptp(steps) > EVEN * steps[0]:
        return None
    return float(steps.mean())
