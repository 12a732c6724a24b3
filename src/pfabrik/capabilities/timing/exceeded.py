"""The limits of a timing, and how much of them it takes: at its samples, and between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from .curve import Curve
from .platform_path import PlatformPath
from .timed import EXCEEDED, Exceeded, What
from .torque_path import TorquePath

LOOKS, CLOSER_LOOKS = np.array([0.06, 0.25, 0.5, 0.75, 0.94]), np.linspace(0.0, 1.0, 17)
"""When limits are looked at within a cell of the grid, at whose ends they are kept, by its duration; and within one in
which a limit is exceeded, or an actuator turns back: there dry friction leaps."""

ZOOMS = 3
"""How often the looks around the worst one are repeated between its neighbours."""

CELLS_A_BLOCK = 2000

SAME = 1e-5
"""Difference of squared speeds, and of s'', by the largest, up to which two timings are the same in a cell: torques
change by about as much of their limits, a hundredth of what is told."""

SPLINED, DOUBLINGS = 1e-4, 10
"""Share of a limit of torque up to which splines are exact: a tenth of what is told; and how often their places are
doubled for that."""


class Limits(NamedTuple):
    """What a timing keeps.

    Attributes
    ----------
    speeds, accelerations, torques : of the actuators, (n_a,); platform : the highest speed of the reference point.
    path : the torques along the path.
    twists : the accelerations of the platform along the path, with their limits.
    """

    speeds: Floats
    accelerations: Floats
    platform: float
    torques: Floats
    path: TorquePath | None
    twists: PlatformPath | None

    def named(self, actuators: tuple[str, ...]) -> tuple[tuple[str, What], ...]:
        """All limits, in the order of `CurveMotion.used`."""
        kinds: list[tuple[str, What]] = [*((name, "speed") for name in actuators)]
        kinds += [(name, "acceleration") for name in actuators]
        kinds += [(name, "torque") for name in (() if self.path is None else self.path.names)]
        kinds.append(("platform", "speed"))
        if self.twists is not None:
            kinds += [("platform", "acceleration"), ("platform", "angular acceleration")]
        return tuple(kinds)


@dataclass(frozen=True)
class Timing:
    """How fast a curve is passed: between the points s (k,) of a grid, at which s' squared is x (k,), s'' is even."""

    s: Floats
    x: Floats

    @cached_property
    def speeds(self) -> Floats:
        """s' at the points, (k,)."""
        return np.sqrt(self.x)

    @cached_property
    def durations(self) -> Floats:
        """Of the cells between the points, (k - 1,)."""
        return np.asarray(2.0 * np.diff(self.s) / (self.speeds[1:] + self.speeds[:-1]))

    @cached_property
    def reached(self) -> Floats:
        """When the points are reached, (k,)."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    @cached_property
    def pushes(self) -> Floats:
        """s'' of the cells, (k - 1,)."""
        return np.asarray(np.diff(self.x) / (2.0 * np.diff(self.s)))

    def at(self, cells: Ints, late: Floats) -> tuple[Floats, Floats, Floats]:
        """The places s, s' and s'' in cells, so much later than these begin, in the shape of `late`."""
        speeds, pushes = self.speeds[cells], self.pushes[cells]
        places = np.clip(self.s[cells] + (speeds + 0.5 * pushes * late) * late, self.s[0], self.s[-1])
        return places, np.maximum(speeds + pushes * late, 0.0), pushes

    def through(self, places: Floats) -> tuple[Floats, Floats]:
        """s' and s'' at places s (n,)."""
        cells = np.clip(np.searchsorted(self.s, places, side="right") - 1, 0, len(self.s) - 2)
        pushes = self.pushes[cells]
        return np.sqrt(np.maximum(self.x[cells] + 2.0 * pushes * (places - self.s[cells]), 0.0)), pushes


class CurveMotion(NamedTuple):
    """A curve at n places, as it is passed.

    Attributes
    ----------
    rates, accelerations : of the actuators, (n, n_a); platform_speeds : of the reference point, (n,).
    used : the share of every limit, (n, limits).
    """

    rates: Floats
    accelerations: Floats
    platform_speeds: Floats
    used: Floats


def motion_at(curve: Curve, limits: Limits, places: Floats, speeds: Floats, pushes: Floats) -> CurveMotion:
    """The motion at places s (n,) that are passed at s' and s''."""
    n, slopes, bends = curve.n_actuators, curve.at(places, 1), curve.at(places, 2)[:, : curve.n_actuators]
    rates, gains = slopes * speeds[:, None], slopes[:, :n] * pushes[:, None] + bends * speeds[:, None] ** 2
    platform = np.linalg.norm(rates[:, n:], axis=1)
    shares = [np.abs(rates[:, :n]) / limits.speeds, np.abs(gains) / limits.accelerations]
    if limits.path is not None:
        parts = limits.path.at(places, slopes[:, :n], bends)
        shares.append(np.abs(parts.torques(speeds, pushes)) / parts.most)
    shares.append(platform[:, None] / limits.platform)
    if limits.twists is not None:
        shares.append(limits.twists.at(places, slopes[:, :n], bends).sizes(speeds, pushes) / limits.twists.limits)
    used = np.concatenate(shares, axis=1)
    return CurveMotion(rates[:, :n], gains, platform, used)


P = TypeVar("P", TorquePath, PlatformPath)


def with_exact_splines(curve: Curve, timing: Timing, limits: Limits) -> Limits:
    """The limits with torques and twists at as many places as splines between them need, to be exact in this motion."""

    def torques_off(one: TorquePath, other: TorquePath, places: Floats, *asked: Floats) -> Floats:
        motion, parts = asked[2:], other.at(places, *asked[:2])
        return np.abs(parts.torques(*motion) - one.at(places, *asked[:2]).torques(*motion)) / parts.most

    def twists_off(one: PlatformPath, other: PlatformPath, places: Floats, *asked: Floats) -> Floats:
        sizes = (each.at(places, *asked[:2]).sizes(*asked[2:]) for each in (one, other))
        return np.abs(next(sizes) - next(sizes)) / other.limits

    def exact(path: P, off: Callable[..., Floats]) -> P:
        places = 0.5 * (path.s[1:] + path.s[:-1])
        for _ in range(DOUBLINGS):
            slopes, bends = (curve.at(places, order)[:, : curve.n_actuators] for order in (1, 2))
            finer = path.with_places(places)
            far = off(path, finer, places, slopes, bends, *timing.through(places)).max(axis=1) > SPLINED
            path, at = finer, np.searchsorted(finer.s, places[far])
            if not len(at):
                break
            places = 0.5 * np.concatenate([path.s[at] + path.s[at - 1], path.s[at + 1] + path.s[at]])
            places.sort()
        return path

    path, twists = limits.path, limits.twists
    return limits._replace(
        path=None if path is None else exact(path, torques_off),
        twists=None if twists is None else exact(twists, twists_off),
    )


def cells_over(curve: Curve, timing: Timing, limits: Limits, before: Timing | None = None) -> Mask:
    """True for the cells of the grid between whose ends a limit is exceeded by more than half of what is told.

    Parameters
    ----------
    before : a timing whose cells are known not to be over where this one is the same, but for those that are parted.
    """
    over = np.zeros(len(timing.durations), bool)
    looked_at = np.ones(len(over), bool)
    if before is not None:  # x is straight between points
        differs = np.abs(np.interp(timing.s, before.s, before.x) - timing.x) > SAME * timing.x.max()
        differs |= ~np.isin(timing.s, before.s)
        pushes = before.through(0.5 * (timing.s[1:] + timing.s[:-1]))[1]
        looked_at = np.abs(pushes - timing.pushes) > SAME * np.abs(timing.pushes).max()
        looked_at |= differs[1:] | differs[:-1]
    for cells in _blocks(np.flatnonzero(looked_at)):
        over[cells] = (_used(curve, timing, limits, cells, LOOKS) > 1.0 + 0.5 * EXCEEDED).any(axis=(1, 2))
    return over


def _blocks(cells: Ints) -> list[Ints]:
    return np.split(cells, range(CELLS_A_BLOCK, len(cells), CELLS_A_BLOCK)) if len(cells) else []


def exceeded(
    curve: Curve, timing: Timing, limits: Limits, actuators: tuple[str, ...], over: Mask
) -> tuple[Exceeded, ...]:
    """The limits that a motion exceeds, anywhere, the most first; `over` is of `cells_over`."""
    named = limits.named(actuators)
    found: dict[int, Exceeded] = {}
    durations = np.zeros(len(named))
    signs = np.sign(curve.at(timing.s, 1)[:, : curve.n_actuators])
    rubs = False if limits.path is None else limits.path.rubs
    turns_back = ((signs[1:] != signs[:-1]) & rubs).any(axis=1)
    for cells in _blocks(np.flatnonzero(over | turns_back)):
        used = _used(curve, timing, limits, cells, CLOSER_LOOKS)
        durations += (used > 1.0 + EXCEEDED).mean(axis=1).T @ timing.durations[cells]
        for place in np.flatnonzero(used.max(axis=(0, 1)) > 1.0 + 0.5 * EXCEEDED).tolist():
            worst, look = np.unravel_index(used[..., place].argmax(), used.shape[:2])
            cell = cells[worst]
            share, at = _peak(curve, timing, limits, cell, place, CLOSER_LOOKS[look])
            if share > max(1.0 + EXCEEDED, found[place].share if place in found else 0.0):
                late = at * timing.durations[cell]
                step = int(curve.step_of(timing.at(cell, late)[0]))
                found[place] = Exceeded(*named[place], share, float(timing.reached[cell] + late), step, 0.0)
    told = (each._replace(duration=float(durations[place])) for place, each in found.items())
    return tuple(sorted(told, key=lambda each: -each.share))


def _peak(curve: Curve, timing: Timing, limits: Limits, cell: int, place: int, look: float) -> tuple[float, float]:
    """The largest share of a limit in a cell, and when that is, by its duration, near a look."""
    share, apart = 0.0, float(CLOSER_LOOKS[1])
    for _ in range(ZOOMS):
        looks = np.clip(look + apart * (2.0 * CLOSER_LOOKS - 1.0), 0.0, 1.0)
        used = _used(curve, timing, limits, np.array([cell]), looks)[0, :, place]
        share, look, apart = float(used.max()), float(looks[used.argmax()]), 2.0 * apart * float(CLOSER_LOOKS[1])
    return share, look


def _used(curve: Curve, timing: Timing, limits: Limits, cells: Ints, looks: Floats) -> Floats:
    """The share of each limit at some times in cells of the grid, (cells, looks, limits)."""
    late = np.multiply.outer(timing.durations[cells], looks)
    motion = (np.broadcast_to(each, late.shape).ravel() for each in timing.at(cells[:, None], late))
    return motion_at(curve, limits, *motion).used.reshape(*late.shape, -1)
