"""A followed path as a smooth curve: its steps, and the motion of actuators and platform along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..answers.tracked import Track
from ..arrays import Floats
from ..kernels.timing import second_derivatives
from ..kinematics import actuator_units
from ..poses import between

FINEST, FEWEST = 20_000, 2
"""Grid points that a path is given at least, and each of its steps: that speeds are kept between them too costs less
than 1e-3 of the time."""

STANDS = 1e-9
"""Motion [L or rad] below which two steps are the same place."""


@dataclass(frozen=True)
class Curve:
    """Cubic splines through the steps of a path, straight at its ends, along the length s of its steps.

    Attributes
    ----------
    steps : rows of the track that it goes through, (k,): those at which it stands still are left out.
    s : where they are, (k,).
    values, curves : actuators and reference point there, (k, n_a + 3), and their second derivatives.
    poses : (k, 4, 4).
    n_actuators : how many of the columns are actuators.
    """

    steps: np.ndarray
    s: Floats
    values: Floats
    curves: Floats
    poses: Floats
    n_actuators: int

    def grid(self) -> Floats:
        """Points along s, the steps among them."""
        parts = max(-(-FINEST // (len(self.s) - 1)), FEWEST)
        shares = np.arange(parts) / parts
        inner = (self.s[:-1, None] + np.diff(self.s)[:, None] * shares).ravel()
        return np.append(inner, self.s[-1])

    def at(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Values, first and second derivatives at s (n,), (n, n_a + 3) each."""
        place, step = self._places(s)
        after = ((s - self.s[place]) / step)[:, None]
        before, step = 1.0 - after, step[:, None]
        low, high = self.values[place], self.values[place + 1]
        bend, bend_after = self.curves[place], self.curves[place + 1]
        values = before * low + after * high
        values += step**2 / 6.0 * ((before**3 - before) * bend + (after**3 - after) * bend_after)
        slopes = (high - low) / step
        slopes += step / 6.0 * ((1.0 - 3.0 * before**2) * bend + (3.0 * after**2 - 1.0) * bend_after)
        return values, slopes, before * bend + after * bend_after

    def poses_at(self, s: Floats) -> Floats:
        """Poses at s (n,): positions on the spline, rotations by the shortest turn from step to step."""
        place, step = self._places(s)
        shares = ((s - self.s[place]) / step)[:, None, None]
        poses = between(self.poses[place], self.poses[place + 1], shares)
        poses[:, :3, 3] = self.at(s)[0][:, self.n_actuators :]
        return poses

    def step_of(self, s: Floats) -> np.ndarray:
        """The row of the track at, or before, s (n,)."""
        return np.asarray(self.steps[np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 1)])

    def _places(self, s: Floats) -> tuple[np.ndarray, Floats]:
        place = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2)
        return place, np.diff(self.s)[place]


def largest_between(begin: Floats, end: Floats, rise: Floats) -> Floats:
    """The largest magnitudes of parabolas from begin to end, of which `rise` is the slope at the begin, by the share
    of the way."""
    bend = end - begin - rise
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = -0.5 * rise / bend
        inner = np.where((turn > 0.0) & (turn < 1.0), begin + 0.5 * rise * turn, 0.0)
    return np.asarray(np.maximum(np.maximum(np.abs(begin), np.abs(end)), np.abs(inner)))


def curve_of(track: Track) -> Curve:
    """The curve through a path."""
    mechanism = track.mechanism
    moves = np.linalg.norm(np.diff(track.actuators, axis=0) / actuator_units(mechanism), axis=1)
    steps = np.concatenate([[0], 1 + np.flatnonzero(moves > STANDS)])
    s = np.concatenate([[0.0], np.cumsum(moves[steps[1:] - 1])])
    poses = np.ascontiguousarray(track.pose[steps])
    values = np.ascontiguousarray(np.concatenate([track.actuators[steps], poses[:, :3, 3]], axis=1))
    curves = np.empty_like(values)
    if len(steps) > 1:
        second_derivatives(s, values, curves)
    return Curve(steps, s, values, curves, poses, track.actuators.shape[1])
