"""The torques of a path as splines along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from ...errors import InvalidArgument
from ...kinematics import actuator_units
from ...machine.description.mechanism import Mechanism
from ..dynamics.drives import drives_of
from ..dynamics.inverse_dynamics import reasons_of
from ..dynamics.moving_rows import MovingRows, in_si
from ..statics.loads import has_reason
from ..statics.shared_limits import along, facets_of, minors_of
from ..statics.transmission import is_redundantly_actuated
from .curve import Spline


class TorqueParts(NamedTuple):
    """Torques t = by_push s'' + by_speed s'^2 + viscous s' + rest at places s of a path, (n, m) each [N m, N].

    Attributes
    ----------
    rest : of weight and loads, and of dry friction on the way.
    most : their limits.
    """

    by_push: Floats
    by_speed: Floats
    viscous: Floats
    rest: Floats
    most: Floats

    def torques(self, speeds: Floats, pushes: Floats) -> Floats:
        """The torques at s' and s'', (n,) each."""
        speeds, pushes = speeds[:, None], pushes[:, None]
        return self.by_push * pushes + (self.by_speed * speeds + self.viscous) * speeds + self.rest


class TorqueSamples(NamedTuple):
    """What torques are made of, at n places of a path.

    Attributes
    ----------
    columns : the mass matrix, what the motion takes at a speed of 1, and the torques at rest, (n, n_a (n_a + 2)).
    minors : of redundant actuators, as `minors_of` has them; else (n, 0).
    motions : how many these share; 0 if they are not redundant.
    """

    columns: Floats
    minors: Floats
    motions: int


@dataclass(frozen=True)
class TorqueSource:
    """A path on which there are torques.

    Attributes
    ----------
    rows_at : from places to configurations there, whose actuators have the rates q'.
    step_of : from places to the steps of the path that they are at, or after.
    """

    mechanism: Mechanism
    rows_at: Callable[[Floats], MovingRows]
    step_of: Callable[[Floats], Ints]

    def at(self, s: Floats) -> TorqueSamples:
        """The torques at places (n,); InvalidArgument where there are none, with the reason."""
        mechanism, rows = self.mechanism, self.rows_at(s)
        assert rows.rates is not None
        drives, found = drives_of(mechanism), rows.efforts(["resting", "matrices"])
        reasons = reasons_of(rows.solution, found.marks)
        bad = np.flatnonzero(has_reason(reasons))
        if len(bad):
            what, places = f"no torques: {reasons[bad[0]]}", np.unique(self.step_of(s[bad]))[:5].tolist()
            raise InvalidArgument("track", what, "a path that its actuators hold", rows=places)
        moved = found.actuators - found.resting - drives.rubbed(rows.rates, found.signs)
        masses = (in_si(mechanism, "actuators", found.matrices) * drives.si).reshape(len(s), -1)
        columns = np.hstack([masses, moved, found.resting])
        if not is_redundantly_actuated(mechanism):
            return TorqueSamples(columns, np.zeros((len(s), 0)), 0)
        return TorqueSamples(columns, *minors_of(rows.solution, "timed by torque"))


class TorquePath:
    """The torques of a path, by what they are at places s (n,), and their limits (n_a,).

    With actuators q(s) they are M (q' s'' + q'' s'^2) + h s'^2 + rest: the mass matrix M, what the motion itself takes
    at a speed of 1, h, and the torques at rest; of redundant actuators, the least.

    Attributes
    ----------
    s : the places.
    names : of the actuators; where they are redundant, of those that are at their limits together.
    limits : of the first of these [N m, N].
    rubs : True for actuators with dry friction, (n_a,).
    """

    def __init__(self, limits: Floats, source: TorqueSource, s: Floats, samples: TorqueSamples | None = None) -> None:
        """Take the torques at places s (n,), in their order, or `samples` that are known.

        Raises
        ------
        InvalidArgument : places at which there are no torques, with the reason.
        """
        mechanism = source.mechanism
        self._source, self._samples = source, samples or source.at(s)
        self.s, self._limits, self._drives, self._motions = s, limits, drives_of(mechanism), self._samples.motions
        self.names, self.limits, columns, minors = mechanism.actuator_names, limits, *self._samples[:2]
        self.rubs = self._drives.friction[:, 0] > 0.0
        if self._motions:
            minors = along(minors)
            columns = np.hstack([columns, minors])
            meeting = [others for others, _ in facets_of(minors[:1], len(limits), self._motions)]
            self.names = tuple(" and ".join(mechanism.actuator_names[i] for i in others) for others in meeting)
            self.limits = limits[[others[0] for others in meeting]]
        self._spline = Spline.through(s, columns)
        self._work = self._drives.si * actuator_units(mechanism)  # of a unit of force, by what the minors are in

    def with_places(self, more: Floats) -> TorquePath:
        """The torques with those at more places."""
        s, known, added = np.append(self.s, more), self._samples, self._source.at(more)
        order = np.argsort(s, kind="stable")
        columns, minors = (np.concatenate(pair)[order] for pair in zip(known[:2], added[:2], strict=True))
        return TorquePath(self._limits, self._source, s[order], TorqueSamples(columns, minors, known.motions))

    def at(self, s: Floats, slopes: Floats, bends: Floats) -> TorqueParts:
        """The torques at s (n,), where the actuators have these first and second derivatives, (n, n_a)."""
        n_a, drives = slopes.shape[1], self._drives
        ends = np.cumsum([n_a**2, n_a, n_a])
        masses, by_speed, rest, minors = np.split(self._spline.at(s), ends, axis=1)
        masses = masses.reshape(-1, n_a, n_a)
        by_push, more = (np.einsum("nab,nb->na", masses, x) for x in (slopes, bends))
        dry, viscous = drives.friction.T
        most = np.broadcast_to(self._limits, slopes.shape)
        rest += dry * drives.signs(slopes)
        own = TorqueParts(by_push, by_speed + more, slopes * (viscous * drives.si), rest, most)
        return self._together(own, minors) if self._motions else own

    def at_either_sign(self, s: Floats, slopes: Floats, bends: Floats) -> TorqueParts:
        """As `at`, on a grid s; in a cell in which an actuator turns back, friction has either sign at both ends.

        With |t + r| <= m for two values r of what friction adds, |t + (r + r') / 2| <= m - |r - r'| / 2.
        """
        parts, signs = self.at(s, slopes, bends), self._drives.signs(slopes)
        turns = (signs[1:] != signs[:-1]) & self.rubs
        either = np.zeros(signs.shape, bool)
        either[1:], either[:-1] = turns, either[:-1] | turns
        at = np.flatnonzero(either.any(axis=1))
        if not len(at):
            return parts
        rest, most = parts.rest.copy(), np.array(parts.most)
        ends = [self.at(s[at], np.where(either[at], sign * 1.0, slopes[at]), bends[at]).rest for sign in (1.0, -1.0)]
        rest[at], most[at] = 0.5 * (ends[0] + ends[1]), most[at] - 0.5 * np.abs(ends[0] - ends[1])
        return parts._replace(rest=rest, most=most)

    def _together(self, own: TorqueParts, minors: Floats) -> TorqueParts:
        """What redundant actuators do together, and the most of it."""
        shares = [share * self._work for _, share in facets_of(minors, len(self._limits), self._motions)]
        with np.errstate(invalid="ignore"):
            most = [np.where(share == 0.0, 0.0, np.abs(share) * self._limits).sum(axis=1) for share in shares]
        push, speed, viscous, rest = (
            np.stack([(share * part).sum(axis=1) for share in shares], axis=1) for part in own[:4]
        )
        return TorqueParts(push, speed, viscous, rest, np.stack(most, axis=1))
