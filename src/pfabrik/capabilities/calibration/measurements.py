"""Measurements of a real machine: actuators as they read, and what an instrument measured of its end effector."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import any_values, array, is_not_infinite
from ...common.arrays import Floats, Ints, Mask
from ...common.checks import require_known
from ...common.rotations import from_rotvec, to_rotvec, turning
from ...errors import InvalidArgument
from ...machine.poses import is_rotation

INSTRUMENT = ("frame", "tool")
"""The frame and target of an instrument, which sees T_instrument_base T_base_platform T_platform_target."""

ROUNDS = 20
"""Rounds in which frame and target are aligned to each other."""

UNTURNED = 1e-9
"""Part of no turn in what decides one, so that it also decides about an axis about which nothing tells."""


def seen(poses: Floats, twists: Floats | None, places: Floats, moves: Floats) -> tuple[Floats, Floats | None]:
    """Poses (n, 4, 4), and twists (n, 6, p) of them by parameters, as an instrument sees them.

    Parameters
    ----------
    places : a rotation vector and a place of the frame and of the target, (2, 6) [rad, length].
    moves : their derivatives by the parameters, (p, 2, 6).
    """
    frame, target = _matrices(places)
    here = frame @ poses @ target
    if twists is None:
        return here, None
    turn, turned = frame[:3, :3], frame[:3, :3] @ poses[:, :3, :3]
    of_frame, of_target = (turning(places[k : k + 1, :3])[0] @ moves[:, k, :3].T for k in (0, 1))
    arms, levers = poses[:, :3, :3] @ target[:3, 3], here[:, :3, 3] - frame[:3, 3]
    angular = turn @ twists[:, 3:] + of_frame + turned @ of_target
    velocity = turn @ (twists[:, :3] + np.cross(twists[:, 3:], arms[:, :, None], axis=1)) + moves[:, 0, 3:].T
    velocity = velocity + np.cross(of_frame[None], levers[:, :, None], axis=1) + turned @ moves[:, 1, 3:].T
    return here, np.concatenate([velocity, angular], axis=1)


def aligned(poses: Floats, given: Measurements, is_free: Mask, length: float) -> Floats:
    """The frame and the target, (2, 6), that take poses (n, 4, 4) nearest to measured ones, in closed form.

    Turns follow from covariances (Arun; of positions, and of orientations), then both places from linear equations;
    round by round where frame and target are open.

    Parameters
    ----------
    is_free : which numbers may be other than 0, (2, 6); turns only if all three may.
    """
    places = np.zeros((2, 6))
    position, orientation = (np.full(shape, np.nan) if a is None else a for a, shape in _fields(given))
    at, turned = np.isfinite(position).all(axis=1), np.isfinite(orientation).all(axis=(1, 2))
    for number in range(ROUNDS if is_free.any(axis=1).all() else 1):
        frame, target = _matrices(places)
        if is_free[0, :3].all():
            shown = poses @ target
            covariance = _spread(position[at]).T @ _spread(shown[at, :3, 3]) / length**2
            if number > 0 or not is_free[1, :3].all() or not at.any():
                covariance += np.einsum("nij,nkj->ik", orientation[turned], shown[turned, :3, :3])
            places[0, :3] = to_rotvec(_nearest_turn(covariance))
            frame = _matrices(places)[0]
        turns = frame[:3, :3] @ poses[:, :3, :3]
        if is_free[1, :3].all():
            places[1, :3] = to_rotvec(_nearest_turn(np.einsum("nji,njk->ik", turns[turned], orientation[turned])))
        columns = np.concatenate([np.broadcast_to(np.eye(3), turns.shape), turns], axis=2)[at][
            :, :, is_free[:, 3:].ravel()
        ]
        wanted = (position - poses[:, :3, 3] @ frame[:3, :3].T)[at]
        found = np.linalg.lstsq(columns.reshape(-1, columns.shape[2]), wanted.ravel())[0]
        places[:, 3:][is_free[:, 3:]] = found
    return places


def _fields(given: Measurements) -> tuple[tuple[Floats | None, tuple[int, ...]], ...]:
    return (given.position, (given.rows, 3)), (given.orientation, (given.rows, 3, 3))


def _matrices(places: Floats) -> Floats:
    """Poses (2, 4, 4) of rotation vectors and places, (2, 6)."""
    made = np.tile(np.eye(4), (2, 1, 1))
    made[:, :3, :3], made[:, :3, 3] = from_rotvec(places[:, :3]), places[:, 3:]
    return made


def _spread(points: Floats) -> Floats:
    return points - points.mean(axis=0) if len(points) else points


def _nearest_turn(covariance: Floats) -> Floats:
    """The rotation with the largest trace of its transpose times a matrix (3, 3)."""
    left, _, right = np.linalg.svd(covariance + UNTURNED * np.eye(3))
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)


Sigma: TypeAlias = float | Mapping[str, float] | None

QUANTITIES = ("position", "orientation", "height", "distances", "joints")
"""What is measured, and what `sigma` is of; a pose is a position and an orientation."""


class Measurements:
    """Readings of a machine's actuators in some configurations, and the quantities measured there.

    Parameters
    ----------
    actuators : array (n, n_a)
        Readings, in the order of `mechanism.actuator_names` [length or rad].
    pose : array (n, 4, 4), optional
        Measured T_base_platform [length]; NaN where there is none.
    position : array (n, 3), optional
        Position of the reference point in the base frame [length]; NaN for components that are not measured.
    orientation : array (n, 3, 3), optional
        R_base_platform; NaN where there is none.
    height : array (n,), optional
        z of the reference point [length], as a probe finds it.
    distances : array (d, 3), optional
        Rows (i, j, distance): between the reference points of rows i and j [length], as on a printed part.
    joints : mapping of str to array (n,), optional
        Coordinate name -> what its sensor reads [length or rad].
    sigma : float or mapping of str to float, optional
        Standard deviation of a measurement [length or rad]: one number for all, or one for each of "position",
        "orientation", "height", "distances", "joints". By default all are equally good, an angle times L as a length,
        and how good is estimated from what is left.
    absolute_sigma : bool, optional
        False if `sigma` only says how good quantities are relative to each other, and how good they all are is
        estimated from what is left.
    names : sequence of str, optional
        What a file calls the rows, n, and the distances, d, as in "row 3 does not fit". Default: their numbers from 1.

    Attributes
    ----------
    rows : int
        Number of configurations.
    quantities : tuple of str
        What was measured, of those that `sigma` may be of.
    has_deviations : bool
        True if it is known how good the measurements are.
    """

    def __init__(
        self,
        actuators: ArrayLike,
        *,
        pose: ArrayLike | None = None,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        height: ArrayLike | None = None,
        distances: ArrayLike | None = None,
        joints: Mapping[str, ArrayLike] | None = None,
        sigma: Sigma = None,
        absolute_sigma: bool = True,
        names: Sequence[str] | None = None,
    ) -> None:
        self.actuators = array(
            "actuators", actuators, "n n_a", "finite readings", ", a row for each configuration"
        ).copy()
        n = self.rows = len(self.actuators)
        if not n:
            raise InvalidArgument("actuators", f"shape {self.actuators.shape}", "a row for each configuration")
        if pose is not None and (position is not None or orientation is not None):
            raise InvalidArgument("pose", "a pose beside a position or an orientation", "either")
        if pose is not None:
            poses = array("pose", pose, f"{n} 4 4", "poses, a row for each configuration,", holds=any_values)
            position, orientation = poses[:, :3, 3], poses[:, :3, :3]
        self.position = None if position is None else _measured("position", position, f"{n} 3")
        self.orientation = None if orientation is None else _measured("orientation", orientation, f"{n} 3 3")
        if self.orientation is not None:
            _check_rotations(self.orientation)
        self.height = None if height is None else _measured("height", height, f"{n}")
        self.distances = _pairs(distances, self.actuators)
        self.joints = {name: _measured(f"joints['{name}']", v, f"{n}") for name, v in (joints or {}).items()}
        self.sigma = _sigmas(sigma)
        self.has_deviations = bool(self.sigma) and absolute_sigma
        self._names = _checked_names(names, n + len(self.distances))
        if self.count == 0:
            raise InvalidArgument("measurements", "none", "a pose, position, orientation, height, distance or joint")

    @property
    def pairs(self) -> Ints:
        """The rows (d, 2) that distances are between."""
        return np.asarray(self.distances[:, :2].astype(np.int64))

    @property
    def count(self) -> int:
        """Number of measured values; an orientation counts three."""
        fields = [self.position, self.height, *self.joints.values()]
        counts = sum(int(np.isfinite(field).sum()) for field in fields if field is not None) + len(self.distances)
        if self.orientation is not None:
            counts += 3 * int(np.isfinite(self.orientation).all(axis=(1, 2)).sum())
        return counts

    @property
    def quantities(self) -> tuple[str, ...]:
        return tuple(name for name in QUANTITIES if self._fields[name] is not None)

    @property
    def _fields(self) -> dict[str, Any]:
        """What was measured by the names of `__init__`; None, or nothing, for what was not."""
        return {name: getattr(self, name) for name in QUANTITIES[:3]} | {
            "distances": self.distances if len(self.distances) else None,
            "joints": self.joints or None,
        }

    @property
    def names(self) -> tuple[str, ...]:
        """What the rows, then the distances are called."""
        return self._names or self._numbered(0)

    def _numbered(self, before: int) -> tuple[str, ...]:
        """Names of rows and distances by their numbers, behind so many other rows."""
        rows = [f"row {row}" for row in range(before + 1, before + self.rows + 1)]
        pairs = (before + 1 + self.pairs).tolist()
        return (*rows, *(f"the distance of rows {first} and {second}" for first, second in pairs))

    def __len__(self) -> int:
        return self.rows

    def __add__(self, other: Measurements) -> Measurements:
        """Measurements of the same machine, the rows of the other behind these.

        Raises
        ------
        InvalidArgument
            Other actuators, or deviations of a quantity that differ.
        """
        if not isinstance(other, Measurements):
            return NotImplemented
        both = (self, other)
        widths = [each.actuators.shape[1] for each in both]
        if widths[0] != widths[1]:
            raise InvalidArgument("measurements", f"{widths[1]} actuators a row", f"{widths[0]}, as of the others")
        pairs = other.distances + [self.rows, self.rows, 0.0]
        names = None
        if self._names or other._names:
            own, others = self.names, other._names or other._numbered(self.rows)
            names = [*own[: self.rows], *others[: other.rows], *own[self.rows :], *others[other.rows :]]
        sensors: dict[str, Any] = dict.fromkeys([*self.joints, *other.joints])
        sensors = {name: _stacked([each.joints.get(name) for each in both], both) for name in sensors}
        return Measurements(
            np.concatenate([each.actuators for each in both]),
            **{name: _stacked([getattr(each, name) for each in both], both) for name in QUANTITIES[:3]},
            distances=np.concatenate([self.distances, pairs]) if len(self.distances) + len(pairs) else None,
            joints=sensors,
            sigma=_common_sigma(self, other),
            absolute_sigma=self.has_deviations,
            names=names,
        )

    def __repr__(self) -> str:
        given = [name for name in self.quantities if name in QUANTITIES[:3]]
        given += [f"{len(self.distances)} distances"] if len(self.distances) else []
        given += [f"joints {', '.join(self.joints)}"] if self.joints else []
        return f"<Measurements: {self.rows} rows, {self.count} values: {', '.join(given)}>"

    def without(self, rows: Sequence[int]) -> Measurements:
        """Measurements without those of some rows and the distances to them."""
        kept = np.setdiff1d(np.arange(self.rows), rows)
        place = np.full(self.rows, -1)
        place[kept] = np.arange(len(kept))
        pairs = place[self.pairs]
        spans = np.flatnonzero((pairs >= 0).all(axis=1))
        distances = np.column_stack([pairs, self.distances[:, 2]])[spans]
        fields = {name: getattr(self, name) for name in QUANTITIES[:3]}
        return Measurements(
            self.actuators[kept],
            **{name: None if value is None else value[kept] for name, value in fields.items()},
            distances=distances if len(distances) else None,
            joints={name: value[kept] for name, value in self.joints.items()},
            sigma=self.sigma or None,
            absolute_sigma=self.has_deviations,
            names=[self.names[k] for k in (*kept, *(self.rows + spans))],
        )

    def check_for(self, actuators: Sequence[str], coordinates: Sequence[str]) -> None:
        """Refuse measurements of another machine."""
        if self.actuators.shape[1] != len(actuators):
            expected = f"{len(actuators)} a row: {', '.join(actuators)}"
            raise InvalidArgument("measurements", f"{self.actuators.shape[1]} actuators a row", expected)
        require_known("coordinate", self.joints, coordinates)


def _checked_names(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    """Names of rows and distances; none where they are only numbered."""
    if names is None:
        return ()
    if len(names) != count:
        raise InvalidArgument("names", f"{len(names)}", f"{count}: of every row and every distance")
    return tuple(map(str, names))


def _stacked(values: Sequence[Floats | None], both: Sequence[Measurements]) -> Floats | None:
    """Values of two sets of rows as one; NaN for those that were not measured."""
    shape = next((value.shape[1:] for value in values if value is not None), None)
    if shape is None:
        return None
    parts = zip(values, both, strict=True)
    return np.concatenate([np.full((each.rows, *shape), np.nan) if v is None else v for v, each in parts])


def _common_sigma(first: Measurements, second: Measurements) -> dict[str, float] | None:
    """Deviations of what was measured in either set."""
    if bool(first.sigma) != bool(second.sigma) or first.has_deviations != second.has_deviations:
        raise InvalidArgument("sigma", "deviations of some measurements beside none", "those of all, or none")
    own = [{name: each.sigma[name] for name in each.quantities if name in each.sigma} for each in (first, second)]
    for name in own[0].keys() & own[1].keys():
        if own[0][name] != own[1][name]:
            found = f"{own[0][name]:g} and {own[1][name]:g} of {name}"
            raise InvalidArgument("sigma", found, "one deviation of a quantity, and `weights` of the rows")
    return {**own[0], **own[1]} or None


def _measured(name: str, values: ArrayLike, shape: str) -> Floats:
    return array(name, values, shape, "finite values", ", or NaN for what was not measured", is_not_infinite).copy()


def _check_rotations(orientations: Floats) -> None:
    given = np.flatnonzero(np.isfinite(orientations).all(axis=(1, 2)))
    bad = [int(row) for row in given if not is_rotation(orientations[row])]
    if bad:
        raise InvalidArgument("orientation", "a matrix that is not a rotation", "R^T R = I and det R = 1", rows=bad[:5])


def _pairs(distances: ArrayLike | None, actuators: Floats) -> Floats:
    if distances is None:
        return np.zeros((0, 3))
    given = array("distances", distances, "n 3", note=", (row, row, distance)").copy()
    rows, n = given[:, :2], len(actuators)
    if (rows != rows.astype(int)).any() or (rows < 0).any() or (rows >= n).any() or (given[:, 2] <= 0.0).any():
        raise InvalidArgument("distances", "a row that does not exist, or no distance", f"rows 0 to {n - 1}, above 0")
    first, second = rows.astype(int).T
    same = np.flatnonzero((actuators[first] == actuators[second]).all(axis=1))
    if len(same):
        found = f"a distance between rows {first[same[0]]} and {second[same[0]]}, a row or its readings twice"
        raise InvalidArgument("distances", found, "rows with different readings, which are apart")
    return given


def _sigmas(sigma: Any) -> dict[str, float]:
    """Standard deviation of each quantity; empty if none is given."""
    if sigma is None:
        return {}
    given = dict(sigma) if isinstance(sigma, Mapping) else dict.fromkeys(QUANTITIES, sigma)
    require_known("quantity", given, QUANTITIES)
    for name, value in given.items():
        if not isinstance(value, int | float | np.floating) or not 0.0 < value < np.inf:
            if not isinstance(sigma, Mapping):
                raise InvalidArgument("sigma", repr(value), "a positive number, or one by quantity")
            raise InvalidArgument(f"sigma['{name}']", repr(value), "a positive number")
    return {name: float(value) for name, value in given.items()}
