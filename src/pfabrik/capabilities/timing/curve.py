"""A followed path as a smooth curve of actuators and platform, and where it meets parallel singularities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...answers.differential import inverse_jacobian
from ...answers.tracked import Track
from ...common.arrays import Floats, Ints, Mask
from ...errors import InvalidArgument
from ...kernels.timing import second_derivatives, spline_at
from ...kinematics import actuator_units
from ...machine.poses import between
from ...tolerances import TOLERANCES

FINEST, FEWEST = 20_000, 2
"""Grid points that a path is given at least, and each of its steps: that speeds are kept between them too costs less
than 1e-3 of the time."""


@dataclass(frozen=True)
class Spline:
    """Natural cubic splines along s.

    Attributes
    ----------
    s : where its values are, (k,).
    values, curves : (k, m), and their second derivatives.
    """

    s: Floats
    values: Floats
    curves: Floats

    @classmethod
    def through(cls, s: Floats, values: Floats) -> Spline:
        """Splines through values (k, m)."""
        return cls(s, values, _curves(s, values))

    def at(self, s: Floats, order: int = 0) -> Floats:
        """Derivatives of an order at s (n,), (n, m): values (0), slopes (1) or second derivatives (2)."""
        derivatives = np.empty((len(s), self.values.shape[1]))
        spline_at(self.s, self.values, self.curves, s, order, derivatives)
        return derivatives

    def _places(self, s: Floats) -> Ints:
        """The step that each s is in, (n,)."""
        return np.asarray(np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2))


@dataclass(frozen=True)
class Curve(Spline):
    """Splines through the steps of a path, straight at its ends, along the length s of its steps.

    Attributes
    ----------
    values : actuators and reference point at the steps, (k, n_a + 3).
    steps : rows of the track that it goes through, (k,): those at which it stands still are left out.
    poses : (k, 4, 4).
    n_actuators : how many of the columns are actuators.
    """

    steps: np.ndarray
    poses: Floats
    n_actuators: int

    def grid(self, least: int = FINEST, fewest: int = FEWEST) -> Floats:
        """Points along s, at least so many, and so many for each step, the steps among them."""
        parts = max(-((1 - least) // (len(self.s) - 1)), fewest)
        shares = np.arange(parts) / parts
        inner = (self.s[:-1, None] + np.diff(self.s)[:, None] * shares).ravel()
        return np.append(inner, self.s[-1])

    def poses_at(self, s: Floats) -> Floats:
        """Poses at s (n,): positions on the spline, rotations by the shortest turn from step to step."""
        place = self._places(s)
        shares = (s - self.s[place]) / np.diff(self.s)[place]
        poses = between(self.poses[place], self.poses[place + 1], shares[:, None, None])
        poses[:, :3, 3] = self.at(s)[:, self.n_actuators :]
        return poses

    def step_of(self, s: Floats) -> np.ndarray:
        """The row of the track at, or before, s (n,)."""
        return np.asarray(self.steps[np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 1)])


def _curves(s: Floats, values: Floats) -> Floats:
    """Second derivatives of splines; of a single value, nothing."""
    curves = np.empty_like(values)
    if len(s) > 1:
        second_derivatives(s, values, curves)
    return curves


def curve_of(track: Track, rows: slice = slice(None)) -> Curve:
    """The curve through a path, or through some of its rows."""
    mechanism, first = track.mechanism, rows.start or 0
    moves = np.linalg.norm(np.diff(track.actuators[rows], axis=0) / actuator_units(mechanism), axis=1)
    steps = np.concatenate([[0], 1 + np.flatnonzero(moves > TOLERANCES.position)])
    s = np.concatenate([[0.0], np.cumsum(moves[steps[1:] - 1])])
    steps = steps + first
    poses = np.ascontiguousarray(track.pose[steps])
    values = np.ascontiguousarray(np.concatenate([track.actuators[steps], poses[:, :3, 3]], axis=1))
    return Curve(s, values, _curves(s, values), steps, poses, track.actuators.shape[1])


LOOKS = 80
"""Steps of a path that are sampled at first; more are added where a singularity could be between two of them."""


def refuse_crossings(track: Track) -> None:
    """Refuse paths that meet or cross a parallel singularity, with the steps.

    Raises
    ------
    InvalidArgument
    """
    sampled = np.unique(np.linspace(0, len(track) - 1, LOOKS).astype(int))
    while True:
        holds, basis, orientation = _measured(track, sampled)
        turned = _turned_over(basis, orientation)
        change = np.abs(np.diff(holds))
        change = np.maximum(change, np.maximum(np.append(change[1:], 0.0), np.insert(change[:-1], 0, 0.0)))
        near = turned | (np.minimum(holds[1:], holds[:-1]) < change)
        between = near & (np.diff(sampled) > 1)
        if not between.any():
            break
        sampled = np.sort(np.append(sampled, (sampled[:-1] + sampled[1:])[between] // 2))
    is_singular = holds < TOLERANCES.singular
    is_singular[1:] |= turned
    if is_singular.any():
        count = int(is_singular.sum())
        found = f"a path through {count} parallel singularit{'ies' if count > 1 else 'y'}"
        steps = sampled[is_singular][:5].tolist()
        raise InvalidArgument("track", found, "a path that its actuators hold throughout", rows=steps)


def _measured(track: Track, rows: Ints) -> tuple[Floats, Floats, Floats]:
    """The smallest singular value of the inverse Jacobian at steps, (k,), lengths relative to L: the least actuator
    rate of any unit motion of the platform.

    Also an orthonormal basis of its motions, (k, freedoms, r), and the orientation of the rates in it, (k,); 0 where
    actuators and freedoms differ in number.
    """
    mechanism = track.mechanism
    jacobians = inverse_jacobian(track[rows]) / actuator_units(mechanism)[:, None]
    jacobians[..., :3] *= mechanism.characteristic_length
    left, sizes, right = np.linalg.svd(jacobians, full_matrices=False)
    freedoms = int((sizes > TOLERANCES.rank * sizes[:, :1]).sum(axis=1).max(initial=0))
    square = freedoms == jacobians.shape[1]
    orientation = np.sign(np.linalg.det(left)) if square else np.zeros(len(rows))
    return sizes[:, freedoms - 1], right[:, :freedoms], orientation


def _turned_over(basis: Floats, orientation: Floats) -> Mask:
    """Mask (k - 1,) of neighbours between which the orientation changes, with each basis carried to the next."""
    carried = np.sign(np.linalg.det(basis[1:] @ np.swapaxes(basis[:-1], 1, 2)))
    return np.asarray(orientation[1:] * orientation[:-1] * carried < 0.0)
