"""What an answer is: a status, a configuration that is feasible, and what was measured of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from types import MappingProxyType
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from .flatten import Flat, flatten
from .kernels import plan as P
from .mechanism import Mechanism
from .tolerances import TOLERANCES

Floats = NDArray[np.float64]


class Status(IntEnum):
    """What became of a target; the worst of a batch is the largest."""

    REACHED = P.REACHED
    PROJECTED = P.PROJECTED
    FAILED = P.FAILED
    INVALID = P.INVALID


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that holds a projected pose back.

    Attributes
    ----------
    joint, bound : which limit of which joint.
    value, limit : the coordinate (or the angle at the cone) and its bound [length or rad].
    """

    joint: str
    bound: Literal["min", "max", "cone"]
    value: float
    limit: float


class Solution:
    """The answer to one target or, with leading batch axes on every field, to a batch.

    What a status promises is measured on the configuration, not assumed: `residual` and `limit_excess` are there to
    be read. Where the status is INVALID (a row that was no pose, marked), numbers are NaN.

    Attributes
    ----------
    status : a `Status`; for a batch an integer array of them, (...,).
    pose : T_base_platform achieved, (..., 4, 4) [length].
    actuators : actuated coordinates in the order of `mechanism.actuators`, (..., n_a) [length or rad].
    points : joint name -> position of its centre in the base frame, (..., 3) [length]; joints that act as one are at
        their common centre.
    position_error, rotation_error : distance of the pose from the target, (...,) [length], [rad].
    residual : largest gap of any loop: open ends, stretched rigid links, links out of their plane, (...,) [length].
    limit_excess : largest excess over any limit, (...,); lengths relative to L, angles in rad; 0 if all are kept.
    iterations, rounds : passes over the chains, and revisions of the target, (...,).
    active_limits : limits that hold a projected pose back; for a batch, one tuple a row, in row order.
    """

    def __init__(self, mechanism: Mechanism, flat: Flat, rows: P.Rows, shape: tuple[int, ...]) -> None:
        self.mechanism = mechanism
        self.shape = shape
        self._flat = flat
        self._rows = rows

    def __getstate__(self) -> tuple[Mechanism, P.Rows, tuple[int, ...]]:
        """What an answer is made of; all else follows again where it is unpickled."""
        return self.mechanism, self._rows, self.shape

    def __setstate__(self, state: tuple[Mechanism, P.Rows, tuple[int, ...]]) -> None:
        mechanism, rows, shape = state
        self.__init__(mechanism, flatten(mechanism), rows, shape)  # type: ignore[misc]

    def _shaped(self, array: NDArray[Any]) -> Any:
        shaped = array.reshape(self.shape + array.shape[1:])
        return shaped if shaped.ndim else shaped.item()

    @property
    def status(self) -> Any:
        return Status(int(self._rows.status[0])) if self.shape == () else self._shaped(self._rows.status)

    @property
    def pose(self) -> Floats:
        return cast(Floats, self._shaped(self._rows.poses))

    @property
    def actuators(self) -> Floats:
        return cast(Floats, self._shaped(self._rows.actuators))

    @property
    def position_error(self) -> Any:
        return self._shaped(self._rows.measures[:, 0])

    @property
    def rotation_error(self) -> Any:
        return self._shaped(self._rows.measures[:, 1])

    @property
    def residual(self) -> Any:
        return self._shaped(self._rows.measures[:, 2])

    @property
    def limit_excess(self) -> Any:
        return self._shaped(self._rows.measures[:, 3])

    @property
    def iterations(self) -> Any:
        return self._shaped(self._rows.counters[:, 0])

    @property
    def rounds(self) -> Any:
        return self._shaped(self._rows.counters[:, 1])

    @cached_property
    def points(self) -> Mapping[str, Floats]:
        rows, plan = self._rows, self._flat.plan
        carriers, screw_points = _carriers(plan, rows.trunks)
        found: dict[str, Floats] = {}
        for name, joint in self._flat.trunk_points:
            found[name] = screw_points[joint]
        for point in self._flat.points:
            turning = rows.poses[:, :3, :3] if point.carrier < 0 else carriers[point.carrier][:, :3, :3]
            found[point.joint] = self._node(point.node, carriers) + turning @ (point.shift * point.axis)
        order = [joint.name for joint in self.mechanism.joints if joint.name in found]
        unknown = (rows.status == Status.INVALID)[:, None]
        return MappingProxyType({name: self._shaped(np.where(unknown, np.nan, found[name])) for name in order})

    def _node(self, k: int, carriers: list[Floats]) -> Floats:
        """Positions (n, 3) of node k: stored, on the platform, or on its carrier."""
        rows, plan = self._rows, self._flat.plan
        node = plan.nodes[k]
        if node["stored"] >= 0:
            return rows.nodes[:, node["stored"]]
        branch = plan.branches[np.searchsorted(plan.branches["last"], k)]
        if k == branch["last"]:
            T, point = rows.poses, branch["end"]
        else:
            T, point = carriers[branch["carrier"]], node["home"]
        return cast(Floats, T[:, :3, :3] @ point + T[:, :3, 3])

    @cached_property
    def active_limits(self) -> Any:
        rows = self._rows
        held: list[tuple[ActiveLimit, ...]] = [()] * len(rows.status)
        projected = np.flatnonzero(rows.status == Status.PROJECTED)
        if len(projected):
            from .kernels.limits import read_limited

            plan = self._flat.plan
            chosen = P.Rows._make(np.ascontiguousarray(array[projected]) for array in rows)
            values = np.empty((len(projected), len(plan.coordinates) + len(plan.cones)))
            read_limited(plan, chosen, values)
            for row, found in zip(projected, self._active(values), strict=True):
                held[row] = found
        return held[0] if self.shape == () else held

    def _active(self, values: Floats) -> list[tuple[ActiveLimit, ...]]:
        """The limits each row of `values` lies on."""
        coordinates, cones = self._flat.plan.coordinates, self._flat.plan.cones
        n = len(coordinates)
        near = TOLERANCES.active / coordinates["scale"]
        low = values[:, :n] - coordinates["lo"] <= near
        high = coordinates["hi"] - values[:, :n] <= near
        wide = cones["half_angle"] - values[:, n:] <= TOLERANCES.active
        found: list[list[ActiveLimit]] = [[] for _ in values]
        for row, j in zip(*np.nonzero(low | high), strict=True):
            bound: Literal["min", "max"] = "min" if low[row, j] else "max"
            limit = float(coordinates["lo" if bound == "min" else "hi"][j])
            found[row].append(ActiveLimit(self._flat.coordinates[j], bound, float(values[row, j]), limit))
        for row, j in zip(*np.nonzero(wide), strict=True):
            half_angle = float(cones["half_angle"][j])
            found[row].append(ActiveLimit(self._flat.cones[j], "cone", float(values[row, n + j]), half_angle))
        return [tuple(each) for each in found]

    def __bool__(self) -> bool:
        """Whether the target, or every target of the batch, is REACHED."""
        return bool((self._rows.status == Status.REACHED).all())

    def __len__(self) -> int:
        if self.shape == ():
            raise TypeError("the answer to one target has no length")
        return self.shape[0]

    def __getitem__(self, index: Any) -> Solution:
        """The answer at `index` of the batch axes; NumPy's rules for integers, slices and arrays."""
        if self.shape == ():
            raise TypeError("the answer to one target cannot be indexed")
        chosen = np.arange(len(self._rows.status)).reshape(self.shape)[index]
        rows = P.Rows._make(np.ascontiguousarray(array[np.ravel(chosen)]) for array in self._rows)
        return Solution(self.mechanism, self._flat, rows, np.shape(chosen))

    def __iter__(self) -> Iterator[Solution]:
        return (self[i] for i in range(len(self)))

    def to_dict(self) -> dict[str, Any]:
        """The fields as plain numbers, lists and dicts, ready for JSON; NaN (an INVALID row) becomes None."""
        names = (
            "pose",
            "actuators",
            "position_error",
            "rotation_error",
            "residual",
            "limit_excess",
            "iterations",
            "rounds",
        )
        plain: dict[str, Any] = {"status": _plain_status(self.status)}
        plain |= {name: _plain(getattr(self, name)) for name in names}
        plain["points"] = {name: _plain(point) for name, point in self.points.items()}
        limits = [self.active_limits] if self.shape == () else self.active_limits
        listed = [[vars(limit) for limit in row] for row in limits]
        plain["active_limits"] = listed[0] if self.shape == () else listed
        return plain

    def __repr__(self) -> str:
        counts = {status.name: int((self._rows.status == status).sum()) for status in Status}
        found = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
        return f"<Solution of '{self.mechanism.name}': {found or 'empty'}>"


def _plain_status(status: Any) -> Any:
    return (
        status.name
        if isinstance(status, Status)
        else np.vectorize(lambda s: Status(s).name, otypes=[object])(status).tolist()
    )


def _plain(value: Any) -> Any:
    array = np.asarray(value)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        return np.where(np.isfinite(array), array.astype(object), np.array(None)).tolist()
    return array.tolist()


def _carriers(plan: P.Plan, trunk_values: Floats) -> tuple[list[Floats], list[Floats]]:
    """Poses (n, 4, 4) of the base and of every trunk's body, and the present centres (n, 3) of the trunk joints."""
    n = len(trunk_values)
    carriers = [np.broadcast_to(np.eye(4), (n, 4, 4))]
    centres: list[Floats] = []
    for trunk in plan.trunks:
        T = carriers[0]
        for j in range(trunk["first"], trunk["last"]):
            joint = plan.trunk_joints[j]
            centres.append(T[:, :3, :3] @ joint["point"] + T[:, :3, 3])
            T = T @ _motion(joint, trunk_values[:, j])
        carriers.append(T)
    return carriers, centres


def _motion(joint: Any, values: Floats) -> Floats:
    """The motions (n, 4, 4) of one trunk joint at its home place."""
    axis, point = joint["axis"], joint["point"]
    moved = np.zeros((len(values), 4, 4))
    moved[:] = np.eye(4)
    if joint["kind"] == P.SLIDE:
        moved[:, :3, 3] = values[:, None] * axis
        return moved
    K = np.cross(np.eye(3), axis).T * -1.0
    sine, versine = np.sin(values)[:, None, None], (1.0 - np.cos(values))[:, None, None]
    moved[:, :3, :3] = np.eye(3) + sine * K + versine * (K @ K)
    moved[:, :3, 3] = point - moved[:, :3, :3] @ point
    return moved
