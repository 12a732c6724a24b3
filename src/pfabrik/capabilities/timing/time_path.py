"""`time_path`: the fastest timing of a path."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Solution
from ...answers.tracked import Track, refuse_leaps
from ...common.arguments import array, is_not_negative
from ...common.arrays import Floats, Mask
from ...common.checks import require_positive, require_type
from ...errors import InvalidArgument
from ...fk import solve_fk
from ...kernels.timing import acceleration_shares, fastest, speed_shares
from ...kinematics import actuator_units, drive_limits, readouts
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from ..dynamics.moving_rows import MovingRows
from ..dynamics.weights import lacking_masses, weights_of
from ..statics.forces import GRAVITY
from ..statics.loads import BodyLoads, checked_gravity
from .curve import Curve, curve_of, refuse_crossings
from .dwells import pieces_of, with_pauses
from .exceeded import Limits, Timing, cells_over, exceeded, motion_at, with_exact_splines
from .platform_path import PlatformPath, PlatformRows, beside
from .timed import Timed
from .torque_path import TorqueParts, TorquePath, TorqueSource

MOST_SAMPLES = 10_000_000

TORQUE_PLACES = 400
"""Places of a path, at least, between which torques are a spline."""

REFINEMENTS = 12
"""Largest number of times that the grid is refined where torques exceed their limits between its points; usually six
suffice for a path of minutes."""

ROUND = 1e-4
"""Share of a platform's acceleration up to which directions in which it is limited are as good as all."""

ROUNDS = 8
"""Largest number of passes that slow down cells of the grid in which an acceleration exceeds its limit; usually three
suffice."""


def time_path(
    track: Track,
    *,
    speed: float | Mapping[str, float] | None = None,
    acceleration: float | Mapping[str, float] | None = None,
    platform_speed: float | None = None,
    platform_acceleration: float | None = None,
    platform_angular_acceleration: float | None = None,
    torque: float | Mapping[str, float] | None = None,
    loads: BodyLoads | None = None,
    gravity: ArrayLike = GRAVITY,
    rate: float = 1000.0,
    dwells: ArrayLike | None = None,
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
    platform_acceleration, platform_angular_acceleration : float, optional
        Highest acceleration of the reference point [length/s^2], and highest angular acceleration of the platform
        [rad/s^2], in any direction; by the twists of the actuators' motion.
    torque : float or mapping of str to float, optional
        The most that actuators exert, by name or the same for all [N m, of slides N]; those not named have the
        `max_torque` of their joints, which counts where the machine has the masses of all bodies. Rotors and friction
        are included, as in `inverse_dynamics`. Redundant
        actuators share what they do in any way that keeps their limits: at these are several at once. What the timing
        exceeds is in `exceeded`.
    loads : mapping of str to tuple, optional
        For torques, as in `inverse_dynamics`.
    gravity : array (3,), optional
        For torques, likewise [m/s²].
    rate : float, optional
        Rate of the samples that are returned [1/s].
    dwells : array (n,), optional
        Time at rest before each step [s], as a `Path` has it: the path stops at the step before (or at the first), and
        its parts are timed one by one.

    Raises
    ------
    InvalidArgument
        A track with steps that were not reached, leap, cross a parallel singularity, or between which the spline leaves
        a range, by the number of the step; one that does not move; no limit at all; more than ten million samples. With
        limits of torque, bodies without a mass, and limits that are exceeded at rest.
    UnsupportedMechanism
        Limits of torque of a machine with so many redundant actuators that what they do together has over 500 limits.
    """
    require_type("track", track, Track, "a Track, as `track` returns")
    mechanism = track.mechanism
    speeds = drive_limits(mechanism, "speed", speed)
    accelerations = drive_limits(mechanism, "acceleration", acceleration)
    torques = drive_limits(mechanism, "torque", torque)
    if torque is None and lacking_masses(mechanism):
        torques[:] = np.inf
    most_platform = np.inf if platform_speed is None else require_positive("platform_speed", platform_speed)
    most_twist = _twist_limits(mechanism, platform_acceleration, platform_angular_acceleration)
    every = 1.0 / require_positive("rate", rate)
    if not np.isfinite([*speeds, *accelerations, *torques, most_platform, *most_twist]).any():
        found = f"'{mechanism.name}' without max_speed and max_acceleration"
        raise InvalidArgument(
            "speed", found, "a limit of speed, acceleration, torque or the platform, given or in the mechanism"
        )
    if not len(track):
        raise InvalidArgument("track", "an empty path", "two steps or more that differ")
    refuse_leaps(track)
    pauses = np.zeros(len(track)) if dwells is None else array("dwells", dwells, f"{len(track)}", holds=is_not_negative)
    if pauses.sum() / every > MOST_SAMPLES:
        raise InvalidArgument("dwells", f"{pauses.sum():.4g} s at rest", f"at most {MOST_SAMPLES} samples")
    pause, parts = 0.0, []
    refuse_crossings(track)
    for dwell, rows in pieces_of(pauses):
        pause, curve = pause + dwell, curve_of(track, rows)
        if len(curve.s) < 2:
            continue
        refuse_swings(track, curve)
        by_torque = _torques(track, curve, torques, loads, gravity)
        limits = Limits(speeds, accelerations, most_platform, torques, by_torque, _twists(track, curve, most_twist))
        parts.append((pause, _sampled(track, curve, *_fastest(curve, limits), every)))
        pause = 0.0
    if not parts:
        raise InvalidArgument("track", "a path that does not move", "two steps or more that differ")
    return with_pauses(parts, pause, every)


def _torques(
    track: Track, curve: Curve, limits: Floats, loads: BodyLoads | None, gravity: ArrayLike
) -> TorquePath | None:
    """The torques along a path; None where none is limited."""
    if not np.isfinite(limits).any():
        return None
    mechanism, n = track.mechanism, curve.n_actuators
    weights, pull = weights_of(mechanism, loads), checked_gravity(gravity)

    def rows_at(s: Floats) -> MovingRows:
        slopes = curve.at(s, 1)[:, :n]
        return MovingRows(_solution_at(track, curve, s), "actuators", slopes, weights=weights, gravity=pull)

    source = TorqueSource(mechanism, rows_at, curve.step_of)
    return TorquePath(limits, source, curve.grid(TORQUE_PLACES, 1))


def _solution_at(track: Track, curve: Curve, s: Floats) -> Solution:
    """The configurations at places s (n,) of a path."""
    if np.array_equal(s, curve.s):
        return track[curve.steps]
    return solve_fk(track.mechanism, curve.at(s)[:, : curve.n_actuators], start=track[curve.step_of(s)])


def _twist_limits(mechanism: Mechanism, acceleration: float | None, angular: float | None) -> Floats:
    """Limits of a platform's accelerations, (2,); infinite where there is none."""
    if angular is not None and mechanism.end_effector_is_joint:
        found = f"a limit for '{mechanism.end_effector}', a joint"
        raise InvalidArgument(
            "platform_angular_acceleration", found, "a body as end effector: a joint's centre turns not"
        )
    named = {"platform_acceleration": acceleration, "platform_angular_acceleration": angular}
    return np.array([np.inf if value is None else require_positive(name, value) for name, value in named.items()])


def _twists(track: Track, curve: Curve, limits: Floats) -> PlatformPath | None:
    """The accelerations of the platform along a path; None where none is limited."""
    if not np.isfinite(limits).any():
        return None
    return PlatformPath(limits, partial(_solution_at, track, curve), curve.grid(TORQUE_PLACES, 1))


def refuse_swings(track: Track, curve: Curve) -> None:
    """Refuse a track whose spline, which swings out where steps bend, leaves the range of an actuator between steps."""
    s, mechanism = curve.grid(), track.mechanism
    low, high = np.array([drive.limits for drive in mechanism.drives]).T
    values = curve.at(s)[:, : curve.n_actuators]
    beyond, units = np.maximum(low - values, values - high), actuator_units(mechanism)
    over = beyond > TOLERANCES.active * units
    if over.any():
        place = int(np.argmax((beyond / units).max(axis=0)))
        shown = readouts(mechanism)[place]
        far = float(shown.display(beyond[:, place].max(keepdims=True))[0])
        found = f"a path that swings {far:.3g} {shown.unit} beyond the range of '{shown.name}' between its steps"
        steps = np.unique(curve.step_of(s[over[:, place]]))[:5].tolist()
        raise InvalidArgument("track", found, "shorter steps, or some room before that limit", rows=steps)


def _fastest(curve: Curve, limits: Limits) -> tuple[Timing, Limits, Mask]:
    """The fastest timing on a grid as fine as its limits need it; these, exact where it is, and `cells_over`."""
    s = curve.grid()
    timing = _fastest_on(s, curve, limits)
    if limits.path is None and limits.twists is None:
        return timing, limits, cells_over(curve, timing, limits)
    limits = with_exact_splines(curve, timing, limits)
    over = cells_over(curve, timing, limits)
    for _ in range(REFINEMENTS):
        if not over.any():
            break
        over[1:-1] |= over[2:] | over[:-2]
        s, before = np.sort(np.append(s, 0.5 * (s[1:] + s[:-1])[over])), timing
        timing = _fastest_on(s, curve, limits)
        over = cells_over(curve, timing, limits, before)
    return timing, limits, over


def _fastest_on(s: Floats, curve: Curve, limits: Limits) -> Timing:
    """The largest squared speeds on a grid s."""
    slopes, bends = curve.at(s, 1), curve.at(s, 2)
    n, shares = curve.n_actuators, np.empty(len(s) - 1)
    speed_shares(s, slopes, bends, limits.speeds, limits.platform, shares)
    with np.errstate(divide="ignore"):
        caps = 1.0 / shares**2
    caps = np.minimum(np.append(caps, caps[-1:]), np.append(caps[:1], caps))
    caps[~np.isfinite(caps)] = np.finfo(float).max ** 0.5
    by_push, by_speed = (np.ascontiguousarray(each[:, :n]) for each in (slopes, bends))
    most = np.tile(limits.accelerations, (len(s), 1))
    rest = viscous = np.zeros(most.shape)
    if limits.path is not None:
        parts = limits.path.at_either_sign(s, slopes[:, :n], bends[:, :n])
        limited = np.isfinite(limits.accelerations).nonzero()[0]
        by_push, by_speed = beside(slopes[:, limited], parts.by_push), beside(bends[:, limited], parts.by_speed)
        rest, viscous = beside(rest[:, limited], parts.rest), beside(viscous[:, limited], parts.viscous)
        most = beside(most[:, limited], parts.most)
        _refuse_heavy(curve, s, parts, limits.path)
    platform = None
    if limits.twists is not None:
        platform = PlatformRows(limits.twists.at(s, slopes[:, :n], bends[:, :n]), limits.twists.limits)
    x, at_rest, held = np.empty(len(s)), bool(np.isfinite(most).any()) or platform is not None, rest
    off = np.zeros(1)
    for _ in range(ROUNDS):
        rows = by_push, by_speed, most, held
        fastest(s, *(rows if platform is None else platform.beside(*rows)), caps, at_rest, x)
        acceleration_shares(s, x, slopes, bends, limits.accelerations, shares)
        before, held = held, rest + viscous * np.sqrt(x)[:, None]
        drag = np.abs(held - before) > TOLERANCES.speed * most
        off = off if platform is None else platform.shares(s, x)
        if shares.max() <= 1.0 + TOLERANCES.speed and not drag.any() and off.max() <= 1.0 + ROUND:
            break
        if platform is not None:
            platform.add_directions(s, x)
        slower = np.where(shares > 1.0, shares, 0.0) ** 2
        slower = np.maximum(np.append(slower, 0.0), np.append(0.0, slower))
        caps = np.where(slower > 0.0, np.minimum(caps, x / np.maximum(slower, 1.0)), caps)
    timing = Timing(s, x / max(1.0, shares.max(), off.max()))
    stuck = timing.speeds[1:] + timing.speeds[:-1] <= 0.0
    if stuck.any():
        steps = curve.step_of(s[:-1][stuck])[:5].tolist()
        raise InvalidArgument("track", "steps that no limit lets it pass", "a smoother path", rows=steps)
    return timing


def _refuse_heavy(curve: Curve, s: Floats, parts: TorqueParts, path: TorquePath) -> None:
    """Refuse limits of torque that a machine exceeds while it rests on the path, or begins to move."""
    over = np.abs(parts.rest) >= parts.most
    if over.any():
        share = np.abs(parts.rest) / parts.most
        place = int(np.argmax(share.max(axis=0)))
        limit = path.limits[place]
        most = limit * share[:, place].max()
        found = f"{limit:.6g}, where '{path.names[place]}' must exert up to {most:.6g} at rest"
        steps = np.unique(curve.step_of(s[over[:, place]]))[:5].tolist()
        raise InvalidArgument("torque", found, "limits that hold the machine, dry friction included", rows=steps)


def _sampled(track: Track, curve: Curve, timing: Timing, limits: Limits, over: Mask, every: float) -> Timed:
    """Samples at a rate, and at the very end."""
    reached, names = timing.reached, track.mechanism.actuator_names
    if reached[-1] / every > MOST_SAMPLES:
        found = f"{1.0 / every:g} samples per second for {reached[-1]:g} s"
        raise InvalidArgument("rate", found, f"at most {MOST_SAMPLES} samples")
    times = np.arange(0.0, reached[-1], every)
    times = np.append(times[times < reached[-1] - 1e-9 * every], reached[-1])
    cells = np.clip(np.searchsorted(reached, times, side="right") - 1, 0, len(reached) - 2)
    places, *motion = timing.at(cells, times - reached[cells])
    motion[0][-1] = timing.speeds[-1]  # not rounding, of which friction would have a sign
    sampled = motion_at(curve, limits, places, *motion)
    return Timed(
        mechanism=track.mechanism,
        times=times,
        steps=curve.step_of(places),
        poses=curve.poses_at(places),
        actuators=curve.at(places)[:, : curve.n_actuators],
        rates=sampled.rates,
        accelerations=sampled.accelerations,
        platform_speeds=sampled.platform_speeds,
        used=sampled.used.max(axis=1),
        binding=sampled.used.argmax(axis=1),
        limits=limits.named(names),
        exceeded=exceeded(curve, timing, limits, names, over),
        _track=track,
    )
