"""`time_path`: the fastest timing of a path."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..answers.status import Status
from ..answers.tracked import Track
from ..arrays import Floats
from ..checks import put_limits, require_positive, require_type
from ..description.mechanism import Mechanism
from ..errors import InvalidArgument
from ..kernels.timing import fastest
from ..kinematics import actuator_units, readouts
from ..tolerances import TOLERANCES
from .curve import Curve, curve_of, largest_between, refuse_crossings
from .timed import Timed, What

MOST_SAMPLES = 10_000_000

ROUNDS = 8
"""Largest number of passes that slow down cells of the grid in which an acceleration exceeds its limit; usually three
suffice."""


def time_path(
    track: Track,
    *,
    speed: float | Mapping[str, float] | None = None,
    acceleration: float | Mapping[str, float] | None = None,
    platform_speed: float | None = None,
    rate: float = 1000.0,
) -> Timed:
    """The fastest timing of a path that was followed, from rest to rest, within the limits of every actuator.

    Between its steps the path is the cubic spline of the actuators through them, so that corners of a path are rounded
    off within a step: follow it in steps as short as it is to be exact. On that path no other timing is faster, but for
    the grid it is computed on. Where no acceleration is limited, it starts and ends at full speed.

    Parameters
    ----------
    track : Track
        A path, all of its steps reached, without jumps.
    speed, acceleration : float or mapping of str to float, optional
        Highest values of the actuators, by name or the same for all [length or rad, per s and per s^2]; those not named
        have the limits of their joints, `max_speed` and `max_acceleration`.
    platform_speed : float, optional
        Highest speed of the reference point [length/s].
    rate : float, optional
        Rate of the samples that are returned [1/s].

    Raises
    ------
    InvalidArgument
        A track with steps that were not reached, leap, cross a parallel singularity, or between which the spline leaves
        a range, by the number of the step; one that does not move; no limit at all; more than ten million samples.
    """
    require_type("track", track, Track, "a Track, as `track` returns")
    mechanism = track.mechanism
    speeds = limits_of(mechanism, "speed", speed)
    accelerations = limits_of(mechanism, "acceleration", acceleration)
    most_platform = np.inf if platform_speed is None else require_positive("platform_speed", platform_speed)
    every = 1.0 / require_positive("rate", rate)
    if not np.isfinite([*speeds, *accelerations, most_platform]).any():
        found = f"'{mechanism.name}' without max_speed and max_acceleration"
        raise InvalidArgument(
            "speed", found, "a limit of speed, acceleration or platform speed, given or in the mechanism"
        )
    if not len(track):
        raise InvalidArgument("track", "an empty path", "two steps or more that differ")
    refuse_leaps(track)
    curve = curve_of(track)
    if len(curve.s) < 2:
        raise InvalidArgument("track", "a path that does not move", "two steps or more that differ")
    refuse_crossings(track)
    refuse_swings(track, curve)
    s, x = _fastest(curve, speeds, accelerations, most_platform)
    return _sampled(track, curve, s, x, (speeds, accelerations, most_platform), every)


def limits_of(mechanism: Mechanism, what: str, given: float | Mapping[str, float] | None) -> Floats:
    """The highest speed or acceleration of every actuator, (n_a,); infinite where there is none."""
    limits = np.full(len(mechanism.drives), np.inf)
    for place, drive in enumerate(mechanism.drives):
        limit = getattr(drive.joint, f"max_{what}")
        value = limit[drive.place] if isinstance(limit, tuple) else limit
        if value is not None:
            limits[place] = value
    put_limits(limits, what, given, mechanism.actuator_names)
    return limits


def refuse_leaps(track: Track) -> None:
    """Refuse a track with steps that are not reached, or that jump."""
    for bad, what in ((track.status != Status.REACHED, "not reached"), (track.jumps, "leaping from the one before")):
        steps = np.flatnonzero(bad)
        if len(steps):
            found = f"{len(steps)} step{'s' * (len(steps) > 1)} {what}"
            raise InvalidArgument("track", found, "a path that is reached throughout", rows=steps[:5].tolist())


def refuse_swings(track: Track, curve: Curve) -> None:
    """Refuse a track whose spline, which swings out where steps bend, leaves the range of an actuator between steps."""
    s, mechanism = curve.grid(), track.mechanism
    low, high = np.array([drive.limits for drive in mechanism.drives]).T
    values = curve.at(s)[0][:, : curve.n_actuators]
    beyond, units = np.maximum(low - values, values - high), actuator_units(mechanism)
    over = beyond > TOLERANCES.active * units
    if over.any():
        place = int(np.argmax((beyond / units).max(axis=0)))
        shown = readouts(mechanism)[place]
        far = float(shown.display(beyond[:, place].max(keepdims=True))[0])
        found = f"a path that swings {far:.3g} {shown.unit} beyond the range of '{shown.name}' between its steps"
        steps = np.unique(curve.step_of(s[over[:, place]]))[:5].tolist()
        raise InvalidArgument("track", found, "shorter steps, or some room before that limit", rows=steps)


def _fastest(curve: Curve, speeds: Floats, accelerations: Floats, most_platform: float) -> tuple[Floats, Floats]:
    """A grid along s and the largest squared speeds there."""
    s = curve.grid()
    _, slopes, bends = curve.at(s)
    n = curve.n_actuators
    slopes_of, bends_of = np.ascontiguousarray(slopes[:, :n]), np.ascontiguousarray(bends[:, :n])
    steepest = largest_between(slopes[:-1], slopes[1:], bends[:-1] * np.diff(s)[:, None])
    with np.errstate(divide="ignore"):
        caps = np.min(speeds / steepest[:, :n], axis=1)
        caps = np.minimum(caps, most_platform / np.linalg.norm(steepest[:, n:], axis=1)) ** 2
    caps = np.minimum(np.append(caps, caps[-1:]), np.append(caps[:1], caps))
    caps[~np.isfinite(caps)] = np.finfo(float).max ** 0.5
    x, at_rest = np.empty(len(s)), bool(np.isfinite(accelerations).any())
    for _ in range(ROUNDS):
        fastest(s, slopes_of, bends_of, accelerations, caps, at_rest, x)
        excess = _excess(s, x, slopes_of, bends_of, accelerations)
        if excess.max() <= 1.0 + TOLERANCES.speed:
            break
        slower = np.where(excess > 1.0, excess, 0.0) ** 2
        slower = np.maximum(np.append(slower, 0.0), np.append(0.0, slower))
        caps = np.where(slower > 0.0, np.minimum(caps, x / np.maximum(slower, 1.0)), caps)
    return s, x / max(1.0, excess.max())


def _excess(s: Floats, x: Floats, slopes: Floats, bends: Floats, most: Floats) -> Floats:
    """The largest share of any acceleration's limit between each two of n points of the grid, (n - 1,).

    There s'' is even and the actuators' third derivatives are, so that accelerations are parabolas in s.
    """
    step = np.diff(s)[:, None]
    push = np.diff(x)[:, None] / (2.0 * step)
    begin, end = (slopes[part] * push + bends[part] * x[part, None] for part in (slice(-1), slice(1, None)))
    rise = np.diff(bends, axis=0) * x[:-1, None] + 3.0 * step * bends[:-1] * push
    return np.asarray((largest_between(begin, end, rise) / most).max(axis=1))


def _sampled(
    track: Track, curve: Curve, s: Floats, x: Floats, limits: tuple[Floats, Floats, float], every: float
) -> Timed:
    """Samples at a rate, and at the very end."""
    steps, mean = np.diff(s), 0.5 * (np.sqrt(x[1:]) + np.sqrt(x[:-1]))
    if not (mean > 0.0).all():
        stuck = curve.step_of(s[:-1][mean <= 0.0])
        raise InvalidArgument("track", "steps that no limit lets it pass", "a smoother path", rows=stuck[:5].tolist())
    reached = np.concatenate([[0.0], np.cumsum(steps / mean)])
    if reached[-1] / every > MOST_SAMPLES:
        found = f"{1.0 / every:g} samples per second for {reached[-1]:g} s"
        raise InvalidArgument("rate", found, f"at most {MOST_SAMPLES} samples")
    times = np.arange(0.0, reached[-1], every)
    times = np.append(times[times < reached[-1] - 1e-9 * every], reached[-1])
    cell = np.clip(np.searchsorted(reached, times, side="right") - 1, 0, len(steps) - 1)
    pushes = np.diff(x) / (2.0 * steps)
    late = times - reached[cell]
    pace = np.maximum(np.sqrt(x[cell]) + pushes[cell] * late, 0.0)
    where = np.clip(s[cell] + (np.sqrt(x[cell]) + 0.5 * pushes[cell] * late) * late, s[0], s[-1])
    values, slopes, bends = curve.at(where)
    n = curve.n_actuators
    rates = slopes * pace[:, None]
    gains = slopes[:, :n] * pushes[cell][:, None] + bends[:, :n] * pace[:, None] ** 2
    speeds, accelerations, most_platform = limits
    platform = np.linalg.norm(rates[:, n:], axis=1)
    used = np.concatenate(
        [np.abs(rates[:, :n]) / speeds, np.abs(gains) / accelerations, platform[:, None] / most_platform], axis=1
    )
    names = track.mechanism.actuator_names
    kinds: list[tuple[str, What]] = [*((name, "speed") for name in names), *((name, "acceleration") for name in names)]
    return Timed(
        mechanism=track.mechanism,
        times=times,
        steps=curve.step_of(where),
        poses=curve.poses_at(where),
        actuators=values[:, :n],
        rates=rates[:, :n],
        accelerations=gains,
        platform_speeds=platform,
        used=used.max(axis=1),
        binding=used.argmax(axis=1),
        limits=(*kinds, ("platform", "speed")),
        _track=track,
    )
