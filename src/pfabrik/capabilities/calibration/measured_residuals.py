"""Residuals of a calibration, predicted less measured values, and their derivatives by the parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...answers.start_configuration import start_of
from ...answers.status import Status
from ...common.arrays import Floats, Ints, Mask
from ...common.rotations import to_rotvec
from ...errors import InvalidArgument, InvalidMechanism
from ...ik import solve_ik
from ...kinematics import Configurations, engine_of, home_coordinates, model_of
from ...machine.description.mechanism import Mechanism
from ...options import Options
from .measurements import Measurements, aligned, seen
from .parameters import Parameters
from .sensitivity import GeometrySlopes, legs_that_stay, require_closed


class Residuals(NamedTuple):
    """Residuals of one quantity.

    Attributes
    ----------
    quantity : of `measurements.QUANTITIES`.
    residual : predicted less measured, (k,) [length or rad].
    slopes : derivatives by the parameters, (k, p); None if they were not asked for.
    groups : which measurement each belongs to, (k,): a row, or behind all rows a distance.
    """

    quantity: str
    residual: Floats
    slopes: Floats | None
    groups: Ints


HAIR = 1e-6
"""How far actuators may be from their readings [L or rad]: a tenth of what instruments show at best."""


class Fit:
    """Measurements beside what a machine would give by the values of its parameters.

    The machine is without limits: readings are what they are. Configurations are continued from one evaluation to the
    next, so that they stay in the assembly mode that they began in.
    """

    def __init__(self, parameters: Parameters, measurements: Measurements) -> None:
        self.parameters, self.measurements = parameters, measurements
        self.machine = parameters.unlimited
        self.length = self.machine.characteristic_length
        self._columns = _sensor_columns(self.machine, measurements)
        self._stretched: Mask = np.zeros(measurements.rows, dtype=bool)
        """Rows that the machine as described reaches as nearly as it can, (n,): they may be so until the fit ends."""
        self._start: Configurations | None = None
        self._last_slopes: tuple[bytes, list[Residuals]] | None = None
        self._last: tuple[bytes, Mechanism, Solution] | None = None

    def begin(self, start: Solution | None) -> None:
        """Assemble the machine as it is described at all readings; at some of them, as nearly as it can be.

        Raises
        ------
        InvalidArgument : it cannot be assembled at any.
        """
        if start is None and self.parameters.moves.any():
            self._start = None  # measured poses are those of another frame
        elif start is None:
            self._start = self._near_measured_poses()
        else:
            deviations = np.reshape(start.q, (-1, start.q.shape[-1])) - home_coordinates(start.mechanism)
            self._start = start_of(self.machine, deviations + home_coordinates(self.machine), start.shape)
        solution = self._assembled(self.parameters.values)[1]
        if not solution and start is None and self._start is not None:  # measured in another frame, or too far off
            self._start = self._last = None
            solution = self._assembled(self.parameters.values)[1]
        is_apart = _is_apart(solution)
        if not is_apart.any():
            self._start = copy(solution._configurations)
        self._stretched = np.ravel(solution.status) == Status.PROJECTED
        if is_apart.all() or (is_apart & ~self._stretched).any():
            raise self._not_assembled(is_apart, "described")

    def require_assembled(self, values: Floats) -> None:
        """InvalidArgument for readings at which the machine with these values cannot be assembled."""
        is_apart = _is_apart(self._assembled(values)[1])
        if is_apart.any():
            raise self._not_assembled(is_apart, "calibrated")

    def _not_assembled(self, is_apart: Mask, how: str) -> InvalidArgument:
        found = f"rows that '{self.machine.name}' as {how} cannot be assembled at"
        rows = np.flatnonzero(is_apart)[:5].tolist()
        return InvalidArgument("actuators", found, "readings of this machine, in its units", rows=rows)

    def begin_at(self, values: Floats, solution: Solution) -> None:
        """Begin in configurations of the machine with other values of its parameters."""
        deviations = np.reshape(solution.q, (len(solution), -1)) - home_coordinates(solution.mechanism)
        self._start = start_of(self.machine, deviations + home_coordinates(self.machine), solution.shape)
        self._assembled(values)

    def _places(self, values: Floats) -> Floats:
        """The frame and the target of the instrument at values (p,), (2, 6)."""
        return np.asarray(np.einsum("p,pkx->kx", values, self.parameters.moves))

    def aligned_values(self) -> Floats:
        """The values of the machine as described, (p,), with the frame and the target that fit it best."""
        own, moves = self.parameters, self.parameters.moves
        if not moves.any():
            return own.values
        poses = np.asarray(self._assembled(own.values)[1].pose)
        places = aligned(poses, self.measurements, np.asarray(moves.any(axis=0)), self.length)
        return np.asarray(own.values + np.einsum("kx,pkx->p", places, moves))

    def _near_measured_poses(self) -> Configurations | None:
        """Configurations at the measured poses, where these are whole."""
        given = self.measurements
        if given.position is None or given.orientation is None:
            return None
        poses = np.tile(np.eye(4), (given.rows, 1, 1))
        poses[:, :3, :3], poses[:, :3, 3] = given.orientation, given.position
        if not np.isfinite(poses).all():
            return None
        return solve_ik(self.machine, poses)._configurations

    def _assembled(self, values: Floats) -> tuple[Mechanism, Solution]:
        """The machine with these values, at all readings."""
        key = values.tobytes()
        if self._last is None or self._last[0] != key:
            model = model_of(self.machine).with_geometry(*self.parameters.geometry(values))
            mechanism, readings = model.mechanism, self.measurements.actuators * self.parameters.factors_at(values)
            found = engine_of(mechanism).forward(readings, self._start, Options().actuator_tolerance)
            solution = Solution(mechanism, found, (len(readings),))
            self._last = key, mechanism, solution
        return self._last[1:]

    def blocks(self, values: Floats, *, slopes: bool = False) -> list[Residuals]:
        """Residuals at values (p,), quantity by quantity; NaN where no machine has them, or it cannot be assembled."""
        if slopes and self._last_slopes is not None and self._last_slopes[0] == values.tobytes():
            return self._last_slopes[1]
        try:
            mechanism, solution = self._assembled(values)
        except InvalidMechanism:
            if values.tobytes() == self.parameters.values.tobytes():
                raise
            described = self.blocks(self.parameters.values)
            return [block._replace(residual=np.full_like(block.residual, np.nan)) for block in described]
        status = np.ravel(solution.status)
        is_apart = _is_apart(solution)
        poses = np.array(solution.pose)
        poses[is_apart & ~(self._stretched & (status == Status.PROJECTED))] = np.nan
        q = np.array(solution.q) if slopes or self._columns else np.zeros((len(poses), 0))
        twists = rates = None
        if slopes:
            if not is_apart.any():
                self._start = copy(solution._configurations)  # a copy has its coordinates, which are of this geometry
            twists, rates = self._rates(values, mechanism, solution, q, np.flatnonzero(~is_apart))
        if self.parameters.moves.any():
            poses, twists = seen(poses, twists, self._places(values), self.parameters.moves)
        blocks = list(self._blocks(poses, q, twists, rates))
        if slopes:
            self._last_slopes = values.tobytes(), blocks
        return blocks

    def _rates(
        self, values: Floats, mechanism: Mechanism, solution: Solution, q: Floats, rows: Ints
    ) -> tuple[Floats, Floats | None]:
        """Twists (n, 6, p) and, for sensors, rates of all coordinates (n, c, p) by the parameters.

        Parameters
        ----------
        rows : where the machine is assembled; elsewhere it is at a dead point, and they are 0.
        """
        p, is_whole = len(self.parameters), len(rows) == len(q)
        twists, rates = np.zeros((len(q), 6, p)), np.zeros((len(q), q.shape[1], p)) if self._columns else None
        if not len(rows):
            return twists, rates
        changes = self.parameters.slopes(values)
        moved = self.measurements.actuators[rows][:, :, None] * self.parameters.factors.T
        legs = None if self._columns else legs_that_stay(self.parameters)
        here = (solution if is_whole else solution[rows])._configurations
        by_legs = None if legs is None else legs.at(mechanism, here, changes, moved)
        if by_legs is not None:
            twists[rows], opened = by_legs.twists, by_legs.opened
        else:
            first = GeometrySlopes(mechanism, q[rows] - home_coordinates(mechanism), changes, self.parameters.like)
            twists[rows], own = first.at_held_actuators(moved)
            opened = first.opened
            if rates is not None:
                rates[rows] = own + changes.home.T
        require_closed(opened, self.parameters)
        return twists, rates

    def _blocks(self, poses: Floats, q: Floats, twists: Floats | None, rates: Floats | None) -> Iterator[Residuals]:
        given, rows = self.measurements, np.arange(self.measurements.rows)
        here = poses[:, :3, 3]
        if given.position is not None:
            kept = np.isfinite(given.position)
            yield Residuals(
                "position",
                (here - given.position)[kept],
                None if twists is None else twists[:, :3][kept],
                np.broadcast_to(rows[:, None], kept.shape)[kept],
            )
        if given.orientation is not None:
            turned = np.isfinite(given.orientation).all(axis=(1, 2))
            turns = poses[turned, :3, :3] @ np.swapaxes(given.orientation[turned], 1, 2)
            residual = to_rotvec(turns) if np.isfinite(turns).all() else np.full((len(turns), 3), np.nan)
            yield Residuals(
                "orientation",
                residual.ravel(),
                None if twists is None else twists[turned, 3:].reshape(-1, twists.shape[2]),
                np.repeat(rows[turned], 3),
            )
        if given.height is not None:
            kept = np.isfinite(given.height)
            slopes = None if twists is None else twists[kept, 2]
            yield Residuals("height", here[kept, 2] - given.height[kept], slopes, rows[kept])
        if len(given.distances):
            first, second = given.pairs.T
            spans = here[second] - here[first]
            lengths = np.linalg.norm(spans, axis=1)
            slopes = None
            if twists is not None:
                slopes = np.einsum("di,dip->dp", spans / lengths[:, None], (twists[second] - twists[first])[:, :3])
            yield Residuals("distances", lengths - given.distances[:, 2], slopes, given.rows + np.arange(len(lengths)))
        for name, column in self._columns.items():
            kept = np.isfinite(given.joints[name])
            slopes = None if rates is None else rates[kept, column]
            yield Residuals("joints", q[kept, column] - given.joints[name][kept], slopes, rows[kept])


def _is_apart(solution: Solution) -> Mask:
    """Rows (n,) at which the machine is not assembled: a search may end a hair from readings that it can have."""
    status, off = np.ravel(solution.status), np.ravel(solution.actuator_error)
    return np.asarray((status > Status.PROJECTED) | ((status == Status.PROJECTED) & (off > HAIR)))


def _sensor_columns(machine: Mechanism, measurements: Measurements) -> Mapping[str, int]:
    """The column of every coordinate that a sensor reads."""
    coordinates = machine.coordinates_by_name
    measurements.check_for(machine.actuator_names, [*coordinates])
    for name in measurements.joints:
        if coordinates[name].joint.type == "spherical":
            raise InvalidArgument("joints", f"'{name}', of a spherical joint", "coordinates that a sensor reads")
    return {name: coordinates[name].column for name in measurements.joints}


def whitened(blocks: Sequence[Residuals], sigma: Mapping[str, float], length: float, weights: Floats | None) -> Floats:
    """Factors of all residuals, (m,): one over their standard deviation, or to make lengths of angles."""
    factors: list[Floats] = []
    for block in blocks:
        is_angle = block.quantity == "orientation"
        factor = 1.0 / sigma[block.quantity] if sigma else (length if is_angle else 1.0)
        own = np.full(len(block.residual), factor)
        if weights is not None:
            inside = block.groups < len(weights)
            own[inside] *= weights[block.groups[inside]]
        factors.append(own)
    return np.concatenate(factors)


def residuals(blocks: Sequence[Residuals]) -> Floats:
    """All residuals, (m,)."""
    return np.concatenate([block.residual for block in blocks])


def slopes_of(blocks: Sequence[Residuals]) -> Floats:
    """All derivatives, (m, p)."""
    return np.concatenate([block.slopes for block in blocks if block.slopes is not None])
