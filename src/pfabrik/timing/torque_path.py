"""The torques of a path as splines along it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Ints
from ..dynamics.drives import drives_of
from ..dynamics.inverse_dynamics import reasons_of
from ..dynamics.moving_rows import MovingRows, in_si
from ..errors import InvalidArgument
from ..kinematics import actuator_units
from ..statics.loads import has_reason
from ..statics.shared_limits import facets_of, minors_along
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


class TorquePath:
    """The torques of a path, by what they are at places s (n,), and their limits (n_a,).

    With actuators q(s) they are M (q' s'' + q'' s'^2) + h s'^2 + rest: the mass matrix M, what the motion itself takes
    at a speed of 1, h, and the torques at rest; of redundant actuators, the least.

    Attributes
    ----------
    names : of the actuators; where they are redundant, of those that are at their limits together.
    limits : of the first of these [N m, N].
    """

    def __init__(self, rows: MovingRows, s: Floats, steps: Ints, limits: Floats) -> None:
        """Take configurations at these places whose actuators have the rates q'.

        Parameters
        ----------
        steps : the step of the path that each place is at, or after, for errors, (n,).

        Raises
        ------
        InvalidArgument : places at which there are no torques, with the reason.
        """
        solution, mechanism = rows.solution, rows.solution.mechanism
        assert rows.rates is not None
        self._drives, found = drives_of(mechanism), rows.efforts(["resting", "matrices"])
        reasons = reasons_of(solution, found.marks)
        bad = np.flatnonzero(has_reason(reasons))
        if len(bad):
            what, places = f"no torques: {reasons[bad[0]]}", np.unique(steps[bad])[:5].tolist()
            raise InvalidArgument("track", what, "a path that its actuators hold", rows=places)
        moved = found.actuators - found.resting - self._drives.rubbed(rows.rates, found.signs)
        masses = (in_si(mechanism, "actuators", found.matrices) * self._drives.si).reshape(len(s), -1)
        columns = np.hstack([masses, moved, found.resting])
        self.names, self.limits, self._limits, self._motions = mechanism.actuator_names, limits, limits, 0
        if is_redundantly_actuated(mechanism):
            minors, self._motions = minors_along(solution, "timed by torque")
            columns = np.hstack([columns, minors])
            meeting = [others for others, _ in facets_of(minors[:1], len(limits), self._motions)]
            self.names = tuple(" and ".join(mechanism.actuator_names[i] for i in others) for others in meeting)
            self.limits = limits[[others[0] for others in meeting]]
        self._spline = Spline.through(s, columns)
        self._work = self._drives.si * actuator_units(mechanism)  # of a unit of force, by what the minors are in

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

    def _together(self, own: TorqueParts, minors: Floats) -> TorqueParts:
        """What redundant actuators do together, and the most of it."""
        shares = [share * self._work for _, share in facets_of(minors, len(self._limits), self._motions)]
        with np.errstate(invalid="ignore"):
            most = [np.where(share == 0.0, 0.0, np.abs(share) * self._limits).sum(axis=1) for share in shares]
        push, speed, viscous, rest = (
            np.stack([(share * part).sum(axis=1) for share in shares], axis=1) for part in own[:4]
        )
        return TorqueParts(push, speed, viscous, rest, np.stack(most, axis=1))
