"""Regions of poses: shapes of positions, with boxes of rotation vectors or cones of tilts; boxes of joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ...common.arguments import array
from ...common.arrays import Floats, Mask, Record
from ...common.checks import require_angle, require_positive
from ...common.rotations import from_rotvec
from ...errors import InvalidArgument
from ...kernels.legs import records as K
from ...kinematics import JointPath, Model, joint_path, passive_series
from ...machine.decomposition.leg_table import LegTable
from ...machine.description.mechanism import Mechanism

Shape = Literal["box", "cylinder", "ball"]
Turning = Literal["rotation vector", "tilt", "joints"]

MOST_JOINTS = 6
"""Most coordinates of joints in series: a pose has no more."""

MOST_TURN = math.pi
"""Largest component of a rotation vector [rad]: beyond half a turn two vectors give one rotation."""


@dataclass(frozen=True, eq=False)
class PoseRegion:
    """All poses with a position in a shape and an orientation in a range; or those at coordinates of some joints.

    Attributes
    ----------
    low, high : array (6,)
        The ends of the six parameters: the position x, y, z of the reference point [length], then the orientation
        [rad]. Of joints, the ends of their coordinates [length, rad], and then zeros.
    shape : {"box", "cylinder", "ball"}
        Shape of the positions; a cylinder stands along z, it and a ball touch the ends.
    turning : {"rotation vector", "tilt", "joints"}
        "rotation vector": R = from_rotvec(r), with r between the ends. "tilt": R = from_rotvec([tilt_x, tilt_y, 0])
        Rz(yaw), as in `workspace`, where the tilt is at most the largest `tilt_x`, in any direction. Orientations are
        relative to that of home. "joints": the pose is where joints in series lead.
    names : tuple of str
        Names of the joints' coordinates; none of other regions.
    path : JointPath or None
        The joints of the machine that it was asked of; None of other regions, and before.
    """

    low: Floats
    high: Floats
    shape: Shape = "box"
    turning: Turning = "rotation vector"
    names: tuple[str, ...] = ()
    path: JointPath | None = None

    @staticmethod
    def joints(ranges: Mapping[str, ArrayLike]) -> PoseRegion:
        """The poses at coordinates of joints in series from the base to the end effector.

        Parameters
        ----------
        ranges : mapping of str to array (2,)
            The two ends of coordinates [length, rad], by their names: "pivot[0]", "pivot[1]" of a universal joint,
            the joint's own of others. Coordinates that are left out stay as at home.
        """
        if not ranges or len(ranges) > MOST_JOINTS:
            raise InvalidArgument("ranges", f"{len(ranges)} coordinates", f"one to {MOST_JOINTS} coordinates")
        ends = np.zeros((2, 6))
        for i, (name, given) in enumerate(ranges.items()):
            ends[:, i] = array(f"ranges['{name}']", given, "2", "two ends")
            if ends[0, i] > ends[1, i]:
                raise InvalidArgument(f"ranges['{name}']", f"{ends[:, i].tolist()}", "ends, the smaller one first")
        return _frozen(ends[0], ends[1], "box", "joints", tuple(ranges))

    def of(self, mechanism: Mechanism) -> PoseRegion:
        """The region of a machine: of joints, with all coordinates from the base to the end effector in order.

        Raises
        ------
        InvalidArgument
            Joints that are not in series from base to end effector, more than six coordinates, or balls.
        """
        if self.turning != "joints":
            return self
        by_name, series = mechanism.coordinates_by_name, passive_series(mechanism)
        joints = dict.fromkeys(by_name[name].joint.name if name in by_name else name for name in self.names)
        path = joint_path(mechanism, series if joints.keys() <= set(series) else tuple(joints))
        if len(path.motions) > MOST_JOINTS or any(motion.kind == "ball" for motion in path.motions):
            raise InvalidArgument("ranges", ", ".join(path.names), f"at most {MOST_JOINTS} hinges and slides in series")
        path = joint_path(mechanism, tuple(path.names[motion.place] for motion in path.motions))
        ends = np.zeros((2, 6))
        ends[:, : len(path.names)] = path.home
        for i, name in enumerate(self.names):
            if name not in path.names:
                raise InvalidArgument("ranges", f"'{name}'", f"coordinates of these: {', '.join(path.names)}")
            ends[:, path.names.index(name)] = self.low[i], self.high[i]
        return _frozen(ends[0], ends[1], "box", "joints", path.names, path)

    @staticmethod
    def box(
        low: ArrayLike,
        high: ArrayLike,
        *,
        rotation: ArrayLike | None = None,
        tilt: float | None = None,
        yaw: ArrayLike = 0.0,
    ) -> PoseRegion:
        """Positions between two corners.

        Parameters
        ----------
        low, high : array (3,)
            The corners [length]; where both are equal the coordinate is fixed.
        rotation : float or array (3,) or (2, 3), optional
            Half sizes of a box of rotation vectors about zero, or its ends [rad].
        tilt : float, optional
            Largest angle of the platform's z axis with that of home, in any direction [rad].
        yaw : float or array (2,), optional
            Turn about z before the tilt: an angle, or its two ends [rad].
        """
        ends = np.stack([array("low", low, "3"), array("high", high, "3")])
        if (ends[0] > ends[1]).any():
            raise InvalidArgument(
                "high", f"{ends[1].tolist()}", f"no coordinate below those of low, {ends[0].tolist()}"
            )
        return _region(ends, "box", rotation, tilt, yaw)

    @staticmethod
    def cylinder(
        centre: ArrayLike,
        radius: float,
        height: float,
        *,
        rotation: ArrayLike | None = None,
        tilt: float | None = None,
        yaw: ArrayLike = 0.0,
    ) -> PoseRegion:
        """Positions in a cylinder along z, about its centre (3,) [length]; orientations as in `box`."""
        radius, height = require_positive("radius", radius), require_positive("height", height)
        half = np.array([radius, radius, 0.5 * height])
        middle = array("centre", centre, "3")
        return _region(np.stack([middle - half, middle + half]), "cylinder", rotation, tilt, yaw)

    @staticmethod
    def ball(
        centre: ArrayLike,
        radius: float,
        *,
        rotation: ArrayLike | None = None,
        tilt: float | None = None,
        yaw: ArrayLike = 0.0,
    ) -> PoseRegion:
        """Positions in a ball about its centre (3,) [length]; orientations as in `box`."""
        middle, half = array("centre", centre, "3"), np.full(3, require_positive("radius", radius))
        return _region(np.stack([middle - half, middle + half]), "ball", rotation, tilt, yaw)

    @property
    def middle(self) -> Floats:
        """The parameters in its middle, (6,)."""
        return np.asarray(0.5 * (self.low + self.high))

    @property
    def half(self) -> Floats:
        """Half its size along each parameter, (6,)."""
        return np.asarray(0.5 * (self.high - self.low))

    def pose(self, parameters: ArrayLike) -> Floats:
        """The poses (..., 4, 4) of parameters (..., 6) [length, rad]; of joints, those `of` a machine."""
        given = array("parameters", parameters, "... 6")
        if self.turning == "joints":
            if self.path is None:
                raise InvalidArgument("region", "a region of joints", "that of a machine: `region.of(mechanism)`")
            found = self.path.poses(given[..., : len(self.names)].reshape(-1, len(self.names)))
            return found.reshape(*given.shape[:-1], 4, 4)
        poses = np.zeros((*given.shape[:-1], 4, 4))
        poses[..., :3, 3], poses[..., 3, 3] = given[..., :3], 1.0
        turn = given[..., 3:].copy()
        if self.turning == "tilt":
            yaw = turn * (0.0, 0.0, 1.0)
            turn[..., 2] = 0.0
            poses[..., :3, :3] = from_rotvec(turn) @ from_rotvec(yaw)
        else:
            poses[..., :3, :3] = from_rotvec(turn)
        return poses

    def contains(self, parameters: ArrayLike) -> bool | Mask:
        """True where parameters (..., 6) are in the region; bools (...)."""
        given = array("parameters", parameters, "... 6")
        inside = np.asarray(((given >= self.low) & (given <= self.high)).all(axis=-1))
        away = given[..., :3] - self.middle[:3]
        if self.shape != "box":
            away = away[..., :2] if self.shape == "cylinder" else away
            inside &= np.linalg.norm(away, axis=-1) <= self.half[0]
        if self.turning == "tilt":
            inside &= np.hypot(given[..., 3], given[..., 4]) <= self.high[3]
        return inside if inside.ndim else bool(inside)

    def __repr__(self) -> str:
        if self.turning == "joints":
            ranges = zip(self.names, self.low.tolist(), self.high.tolist(), strict=False)
            return f"<PoseRegion {', '.join(f'{name} [{a:g}, {b:g}]' for name, a, b in ranges)}>"
        position = " x ".join(f"[{a:g}, {b:g}]" for a, b in zip(self.low[:3], self.high[:3], strict=True))
        ends = np.degrees(np.stack([self.low[3:], self.high[3:]])).T.tolist()
        turns = " x ".join(f"[{a:g}, {b:g}]" for a, b in ends)
        if self.turning == "tilt":
            turns = f"tilt <= {ends[0][1]:g}, yaw [{ends[2][0]:g}, {ends[2][1]:g}]"
        return f"<PoseRegion {self.shape} {position}, {self.turning} {turns} deg>"


def _region(ends: Floats, shape: Shape, rotation: Any, tilt: Any, yaw: Any) -> PoseRegion:
    """A region from the ends of its positions (2, 3) and the description of its orientations."""
    if tilt is not None and rotation is not None:
        raise InvalidArgument("tilt", f"{tilt!r}", "None with a rotation: orientations are either a box or a cone")
    turns, turning = np.zeros((2, 3)), "rotation vector"
    if tilt is not None or np.any(yaw):
        turning, size = "tilt", 0.0 if tilt is None else require_angle("tilt", tilt)
        turns[:, :2] = [[-size, -size], [size, size]]
        turns[:, 2] = _ends("yaw", yaw, ())
    elif rotation is not None:
        turns = _ends("rotation", rotation, (3,))
    low, high = np.concatenate([ends, turns], axis=1)
    return _frozen(low, high, shape, turning)  # type: ignore[arg-type]


def _frozen(
    low: Floats,
    high: Floats,
    shape: Shape,
    turning: Turning,
    names: tuple[str, ...] = (),
    path: JointPath | None = None,
) -> PoseRegion:
    for end in (low, high):
        end.setflags(write=False)
    return PoseRegion(low, high, shape, turning, names, path)


def _ends(name: str, value: Any, shape: tuple[int, ...]) -> Floats:
    """Ends (2, *shape) of angles; of a rotation, half sizes about zero are accepted too."""
    note = ": half sizes or ends [rad]" if shape else ": an angle or its two ends [rad]"
    given = array(name, value, "() | 3 | 2 3" if shape else "() | 2", "angles up to pi", note, _is_turn)
    if given.shape != (2, *shape):
        given = np.broadcast_to(given, shape)
        given = np.stack([-given if shape else given, given])
    if (given[0] > given[1]).any():
        raise InvalidArgument(name, f"{given.tolist()}", "ends, the smaller one first [rad]")
    return given


def _is_turn(angles: Floats) -> Mask:
    return np.asarray(np.abs(angles) <= MOST_TURN)


def drawn(region: PoseRegion, count: int, rng: np.random.Generator) -> Floats:
    """Random parameters in a region, (count, 6), half of them on its border."""
    found = rng.uniform(region.low, region.high, (count, 6))
    ends = np.where(rng.random((count, 6)) < 0.5, region.low, region.high)
    at_end = rng.random((count, 6)) < np.where(np.arange(count) % 2, 0.7, 0.0)[:, None]
    return rounded(region, np.where(at_end, ends, found))


def rounded(region: PoseRegion, parameters: Floats) -> Floats:
    """Parameters moved into the round parts of a region."""
    found = parameters.copy()
    axes = {"box": [], "cylinder": [0, 1], "ball": [0, 1, 2]}[region.shape]
    round_parts = [(axes, region.middle[axes], region.half[0])] if axes else []
    if region.turning == "tilt":
        round_parts.append(([3, 4], np.zeros(2), region.high[3]))
    for places, middle, radius in round_parts:
        off = found[..., places] - middle
        sizes = np.maximum(np.linalg.norm(off, axis=-1, keepdims=True), np.finfo(float).tiny)
        found[..., places] = middle + off * np.minimum(1.0, radius / sizes)
    return found


PAD = 1e-9
"""Share by which a box is larger than computed, for rounding."""


def reach_box(model: Model, middle: Floats, axes: list[int]) -> tuple[Floats, Floats]:
    """Ends (d,) of a box over some coordinates that holds all that is within reach [length or rad].

    A leg keeps |M (p - c)| <= r: M = I for struts and cranks, across the rail for carriages without ends. The sum of
    all squares is at most the sum of all r^2: an ellipsoid, and each leg with M = I a ball of its own.

    Parameters
    ----------
    middle : the six coordinates, of which those of `axes` vary [length, rad].
    """
    places = [axis for axis in axes if axis < 3]
    low, high = np.full(len(axes), -math.pi), np.full(len(axes), math.pi)
    if not places:
        return low, high
    rotation = from_rotvec(middle[3:][None])[0] if max(axes) < 3 else None
    columns, fixed = np.eye(3)[:, places], middle[:3] / model.length
    fixed[places] = 0.0
    normal, right, total = np.zeros((len(places), len(places))), np.zeros(len(places)), 0.0
    lowest, highest = np.full(len(places), -np.inf), np.full(len(places), np.inf)
    for M, centre, radius in _reaches(model.legs, rotation):
        part, offset = M @ columns, M @ (centre - fixed)
        normal += part.T @ part
        right += part.T @ offset
        total += radius * radius - float(offset @ offset)
        if M.shape == (3, 3) and (np.eye(3) == M).all():
            lowest = np.maximum(lowest, centre[places] - radius)
            highest = np.minimum(highest, centre[places] + radius)
    if np.linalg.cond(normal) < 1e12:
        best = np.linalg.solve(normal, right)
        half = np.sqrt(max(total + float(right @ best), 0.0) * np.diag(np.linalg.inv(normal)))
        lowest, highest = np.maximum(lowest, best - half), np.minimum(highest, best + half)
    pad = PAD * (1.0 + np.abs(lowest) + np.abs(highest))
    is_place = np.array(axes) < 3
    low[is_place], high[is_place] = (lowest - pad) * model.length, (highest + pad) * model.length
    return low, high


def _reaches(table: LegTable, rotation: Floats | None) -> list[tuple[Floats, Floats, float]]:
    """M (k, 3), centre [L] and radius [L] of legs read from the base; without a rotation for any orientation."""
    reaches = []
    for k, leg in enumerate(table.legs):
        if leg["frame"] != 0:
            continue
        ranges = {
            int(each["place"]): max(abs(each["lo"]), abs(each["hi"])) for each in table.limited if each["leg"] == k
        }
        point, slack = leg["platform_end_point"], 0.0
        if rotation is None:
            point, slack = np.zeros(3), float(np.linalg.norm(point))
        else:
            point = rotation @ point
        if leg["kind"] == K.PIVOT:
            for i in range(leg["slides"]):
                row = leg["slide_rows"][i]
                if math.isfinite(bound := ranges.get(K.PLATFORM_END + i, math.inf)):
                    radius = bound + slack * float(np.linalg.norm(row))
                    reaches.append((row[None], leg["base_end_point"] - point, radius))
        elif leg["kind"] == K.ROD and (reach := _reach_of(leg, ranges)) is not None:
            M, centre, radius = reach
            reaches.append((M, centre - point, radius + slack))
    return reaches


def _reach_of(leg: Record, ranges: dict[int, float]) -> tuple[Floats, Floats, float] | None:
    """M, centre and radius of a rod, by its platform end; None if it has no end."""
    length, proximal = float(leg["length"]), leg["proximal"]
    if proximal == K.CRANK:
        return np.eye(3), leg["proximal_point"], length + float(np.linalg.norm(leg["crank"]))
    if proximal == K.CARRIAGE:
        axis, travel = leg["proximal_axis"], ranges.get(K.Q_PROXIMAL, math.inf)
        if math.isfinite(travel):
            return np.eye(3), leg["base_end_point"], length + travel
        return np.eye(3) - np.outer(axis, axis), leg["base_end_point"], length
    if proximal == K.NO_PROXIMAL and math.isfinite(bound := ranges.get(K.SLIDE, math.inf if leg["slides"] else 0.0)):
        return np.eye(3), leg["base_end_point"], length + bound
    return None
