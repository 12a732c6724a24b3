"""How far drives go in a tick: no faster than they may, no sooner than they can, never where they could not stop."""

from __future__ import annotations

import math

import numpy as np

from ..common.arrays import Record, Records
from ._jit import routine
from .search_constants import NEARLY_CLOSED

DRIVE = np.dtype(
    [
        ("lo", "f8"),  # range, as of all values deviations from home [L or rad]
        ("hi", "f8"),
        ("speed", "f8"),  # most per second
        ("acceleration", "f8"),  # most per second squared; infinite without one
        ("value", "f8"),  # where it is
        ("rate", "f8"),  # how fast it went there, per second
        ("least", "f8"),  # where it may go next
        ("most", "f8"),
        ("wished", "f8"),  # where it would be on the target before; no number where legs do not reach that
        ("aim", "f8"),  # where it is on the target
    ]
)
"""A drive that follows a stream."""

TICK = np.dtype(
    [
        ("status", "i8"),  # of the last tick: REACHED, PROJECTED, or INVALID where the target is no pose
        ("attempt", "i8"),  # that found something; STILL if none did
        ("looks", "i8"),  # 1: it aimed at where drives may rest, not at the target itself
        ("searched", "i8"),  # 1: limits have multipliers
        ("ticks", "f8"),  # as of `ticks_to_rest`, at its begin
        ("to_target", "f8"),  # the same, beside a target that moves as in the tick before
        ("lag", "f8"),  # distance from the target, with the price of what is held [L]
        ("exceeded", "f8"),  # by what share some drive's acceleration was exceeded
    ]
)
"""What a tick came to."""

ATTEMPTS = 9
"""Ranges of drives that a tick is searched in, one after the other until something is found: see `attempt_of`."""

STILL = ATTEMPTS
"""Nothing was found: nothing moves."""


@routine
def attempt_of(attempt: int) -> tuple[float, float]:
    """By what factor an attempt exceeds accelerations, and the share of the ranges that it has.

    What limits leave may bend more than accelerations allow: the least that does is taken.
    """
    if attempt < 4:
        return (1.0, 1.0) if attempt == 0 else (1.0 + 0.25 * (2.0 ** (attempt - 1)), 1.0)
    return (4.0, 1.0) if attempt == 4 else (math.inf, 0.5 ** (2.0 * (attempt - 5)))


@routine
def ticks_to_rest(drives: Records, factor: float, dt: float) -> float:
    """How many ticks all drives take, slowing down together, until they rest; 0 if nothing limits how hard they do.

    Parameters
    ----------
    factor : of their accelerations.
    """
    ticks = 0.0
    for i in range(drives.shape[0]):
        most = factor * drives[i]["acceleration"] * dt
        ticks = max(ticks, 1.0 + abs(drives[i]["rate"]) / most if most < math.inf else 0.0)
    return ticks


@routine
def ticks_to_target(drives: Records, dt: float) -> float:
    """As `ticks_to_rest`, until they move as their target did in the last tick; rest, where that is not known."""
    ticks = 0.0
    for i in range(drives.shape[0]):
        drive, rate = drives[i], drives[i]["rate"]
        if drive["acceleration"] < math.inf:
            target_rate = (drive["aim"] - drive["wished"]) / dt
            rate -= target_rate if abs(target_rate) < math.inf else 0.0
            ticks = max(ticks, 1.0 + abs(rate) / (drive["acceleration"] * dt))
    return ticks


@routine
def keeps_up(drive: Record, dt: float) -> bool:
    """True if a drive that is on its target at the end of a tick can go on as that did in the tick."""
    if not drive["acceleration"] < math.inf:
        return True
    target_rate = (drive["aim"] - drive["wished"]) / dt
    rate = (drive["aim"] - drive["value"]) / dt - (target_rate if abs(target_rate) < math.inf else 0.0)
    return bool(abs(rate) <= drive["acceleration"] * dt)


@routine
def share_to_rest(ticks: float) -> float:
    """The share of what is left to a limit, or to a target, that a tick may go so that the drives then can rest there.

    Drives that slow down together by the same part each tick go half as far again, in `ticks` of them, as they would
    at this tick's rate: (1 + ticks / 2) times its step in all.
    """
    return 1.0 / (1.0 + 0.5 * ticks)


@routine
def kept_of_rate(ticks: float) -> float:
    """The share of its rate that a drive keeps in a tick in which all slow down together: see `ticks_to_rest`."""
    return 1.0 - 1.0 / max(ticks - 1.0, 1.0)


@routine
def left_of_limit(h: float, bend: float, rate: float, ticks: float) -> float:
    """How far inside a limit a tick stays, so that drives can rest before it [L or rad].

    A tick goes a share of what is left, or as far as it goes slowing down, which is safe if the ticks before were.

    Parameters
    ----------
    h, bend : its excess, and by how much more the way to rest comes to than its slope says.
    rate : its change by the last step.
    """
    goes = max(share_to_rest(ticks) * (-h - max(bend, 0.0)), rate * kept_of_rate(ticks))
    return max(-h - goes, 0.0)


@routine
def put_bounds(drive: Record, attempt: int, ticks: float, dt: float) -> None:
    """Fill where a drive may go in an attempt at a tick of dt seconds; what it cannot keep, its range comes first.

    Parameters
    ----------
    ticks : as of `ticks_to_rest`.
    """
    factor, share = attempt_of(attempt)
    value, speed, room = drive["value"], drive["speed"], share_to_rest(ticks)
    change = factor * drive["acceleration"] * dt
    slowest, fastest = max(-speed, drive["rate"] - change), min(speed, drive["rate"] + change)
    if slowest > fastest:  # faster than it may: as slow as it can be
        slowest = fastest = drive["rate"] - math.copysign(change, drive["rate"])
    spare = min(2.0 * NEARLY_CLOSED, 0.5 * (fastest - slowest) * dt)
    least, most = share * (slowest * dt + spare), share * (fastest * dt - spare)
    slowed_down = drive["rate"] * dt * kept_of_rate(ticks)
    lo, hi = min(room * (drive["lo"] - value), slowed_down), max(room * (drive["hi"] - value), slowed_down)
    drive["least"] = max(min(max(least, lo), most), drive["lo"] - value) + value
    drive["most"] = min(max(min(most, hi), least), drive["hi"] - value) + value


@routine
def is_in_time(drive: Record, value: float) -> bool:
    """True if a drive gets to a value in the tick."""
    return bool(drive["least"] <= value <= drive["most"])


@routine
def slowed(drive: Record, ticks: float, dt: float) -> float:
    """Where a drive is after a tick in which all slow down together, as hard as they may: see `ticks_to_rest`."""
    return float(drive["value"] + drive["rate"] * dt * kept_of_rate(ticks))


@routine
def go_to(drive: Record, value: float, dt: float) -> float:
    """Note where a drive has gone in a tick; by what share that exceeds its acceleration, 0 if it is kept.

    Where it goes no farther than loops may be open in so short a tick, it is as fast as before.
    """
    rate, exceeded = (value - drive["value"]) / dt, 0.0
    if drive["speed"] * dt <= NEARLY_CLOSED:
        rate = drive["rate"]
    if drive["acceleration"] < math.inf:
        exceeded = max(abs(rate - drive["rate"]) / (drive["acceleration"] * dt) - 1.0, 0.0)
    drive["rate"], drive["value"] = rate, value
    return exceeded


@routine
def ticks_left(drives: Records, dt: float) -> float:
    """How many ticks the drives take at full speed to where they are on the target."""
    ticks = 0.0
    for i in range(drives.shape[0]):
        ticks = max(ticks, abs(drives[i]["aim"] - drives[i]["value"]) / (drives[i]["speed"] * dt))
    return ticks
