"""Regions of poses: shapes of positions, with boxes of rotation vectors or cones of tilts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import array
from ..arrays import Floats, Mask
from ..checks import require_angle, require_positive
from ..errors import InvalidArgument
from ..rotations import from_rotvec

Shape = Literal["box", "cylinder", "ball"]
Turning = Literal["rotation vector", "tilt"]

MOST_TURN = math.pi
"""Largest component of a rotation vector [rad]: beyond half a turn two vectors give one rotation."""


@dataclass(frozen=True, eq=False)
class PoseRegion:
    """All poses with a position in a shape and an orientation in a range.

    Attributes
    ----------
    low, high : the ends of the six parameters, (6,) each: the position x, y, z of the reference point [length], then
        the orientation [rad].
    shape : of positions: "box"; "cylinder" along z, or "ball", which touch the ends.
    turning : "rotation vector": R = from_rotvec(r), with r between the ends. "tilt":
        R = from_rotvec([tilt_x, tilt_y, 0]) Rz(yaw), as of `workspace`, where the tilt is at most the largest
        `tilt_x`, in any direction. Orientations are relative to that of home.
    """

    low: Floats
    high: Floats
    shape: Shape = "box"
    turning: Turning = "rotation vector"

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
        low, high : (3,) [length]; where both are equal the coordinate is fixed.
        rotation : half sizes of a box of rotation vectors about zero, a number or (3,), or its ends, (2, 3) [rad].
        tilt : largest angle of the platform's z axis with that of home, in any direction [rad].
        yaw : turn about z before the tilt: an angle, or its two ends [rad].
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
        """The poses (..., 4, 4) of parameters (..., 6) [length, rad]."""
        given = array("parameters", parameters, "... 6")
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
    for end in (low, high):
        end.setflags(write=False)
    return PoseRegion(low, high, shape, turning)  # type: ignore[arg-type]


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
