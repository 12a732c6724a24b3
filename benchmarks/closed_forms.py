"""Closed forms in plain NumPy, as one would write them for a known machine: what the benchmarks compare with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import pfabrik as pf
from pfabrik.machine.description.graph import Step

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


class Struts:
    """Struts from feet fixed in the base to points of the platform, each with a stroke and a cone at either end.

    One solution. All angles are compared by their cosines. Of a machine whose feet move, `lengths` gives the struts'
    lengths with the feet where they are at home.
    """

    def __init__(self, mechanism: pf.Mechanism) -> None:
        struts = [joint for joint in mechanism.joints if joint.along is not None]
        ends = [[mechanism.joint(name) for name in strut.along or ()] for strut in struts]
        ends = [sorted(pair, key=lambda joint: mechanism.end_effector in joint.connects) for pair in ends]
        feet, heads = zip(*ends, strict=True)
        self.feet = np.array([joint.at for joint in feet])
        self.tops = np.array([joint.at for joint in heads]) - mechanism.reference_point
        self.low, self.high = np.array([strut.range for strut in struts]).T
        self.foot_axes, self.foot_cosines = _cones(feet)
        self.head_axes, self.head_cosines = _cones(heads)

    def one(self, target: Array) -> tuple[Array, bool]:
        """Lengths (k,) at one pose (4, 4), and whether the strokes allow them."""
        lines = self.tops @ target[:3, :3].T + (target[:3, 3] - self.feet)
        lengths = np.sqrt((lines * lines).sum(axis=1))
        return lengths, bool(((self.low <= lengths) & (lengths <= self.high)).all())

    def lines(self, targets: Array) -> Array:
        """From foot to platform point, (n, 3, k)."""
        turned = targets[:, :3, :3] @ self.tops.T
        turned += targets[:, :3, 3:]
        turned -= self.feet.T
        return turned

    def lengths(self, targets: Array) -> Array:
        """Lengths (n, k) at poses (n, 4, 4)."""
        lines = self.lines(targets)
        return np.sqrt(np.einsum("nik,nik->nk", lines, lines))

    def solve(self, targets: Array) -> tuple[Array, Bools]:
        """Lengths (n, k), and whether every stroke and every cone is kept (n,)."""
        lines = self.lines(targets)
        lengths = np.sqrt(np.einsum("nik,nik->nk", lines, lines))
        kept = (self.low <= lengths) & (lengths <= self.high)
        kept &= np.einsum("nik,ki->nk", lines, self.foot_axes) >= self.foot_cosines * lengths
        head_axes = targets[:, :3, :3] @ self.head_axes.T
        kept &= np.einsum("nik,nik->nk", lines, head_axes) <= -self.head_cosines * lengths
        return lengths, kept.all(axis=1)


def _cones(joints: tuple[pf.Joint, ...]) -> tuple[Array, Array]:
    cones = [joint.cone for joint in joints if joint.cone is not None]
    return np.array([cone.axis for cone in cones]), np.cos([cone.half_angle for cone in cones])


@dataclass(frozen=True)
class _Crank:
    """A driven crank and a forearm, in the plane spanned by `plane` (2, 3)."""

    plane: Array
    shoulder: Array
    links: Array  # crank and forearm at home, (2, 2)
    homes: Array  # coordinates of shoulder and elbow at home
    senses: Array
    ranges: Array

    def solve(self, tips: Array) -> tuple[Array, Bools]:
        """Angle of the crank for both elbows (2, n), and whether that elbow exists and keeps both ranges."""
        line = tips - self.shoulder
        inner, outer = (self.links**2).sum(axis=1)
        square = (line * line).sum(axis=1)
        along = (square + inner - outer) / (2.0 * square)
        height = inner / square - along * along
        across = np.sqrt(np.maximum(height, 0.0))[:, None] * line[:, ::-1] * (-1.0, 1.0)
        middle = along[:, None] * line
        cranks = np.stack([middle + across, middle - across])
        shoulders = self._coordinate(0, _angle(self.links[0], cranks))
        bends = self._coordinate(1, _angle(cranks, line - cranks) - _angle(*self.links))
        kept = (height >= 0.0) & _within(shoulders, self.ranges[0]) & _within(bends, self.ranges[1])
        return shoulders, kept

    def _coordinate(self, joint: int, turn: Array) -> Array:
        middle = self.ranges[joint].mean()
        value = self.homes[joint] + self.senses[joint] * turn
        return (value - middle + np.pi) % (2.0 * np.pi) - np.pi + middle


def _angle(start: Array, end: Array) -> Array:
    x, y, u, v = start[..., 0], start[..., 1], end[..., 0], end[..., 1]
    return np.arctan2(x * v - y * u, x * u + y * v)


def _within(values: Array, bounds: Array) -> Bools:
    return (bounds[0] <= values) & (values <= bounds[1])


class FiveBar:
    """Two cranks and two forearms in a plane: two circles a leg, two elbows each, the first that keeps its ranges."""

    def __init__(self, mechanism: pf.Mechanism) -> None:
        self.cranks = [_crank(chain.branches[0]) for chain in pf.decompose(mechanism)]

    def solve(self, targets: Array) -> tuple[Array, Bools]:
        """Angles of the cranks (n, 2) [rad] at tips in the machine's plane, and whether all ranges are kept (n,)."""
        angles, reached = [], []
        for crank in self.cranks:
            values, kept = crank.solve(targets[:, :3, 3] @ crank.plane.T)
            angles.append(np.where(kept[0], values[0], values[1]))
            reached.append(kept[0] | kept[1])
        return np.stack(angles, axis=1), reached[0] & reached[1]


def _crank(steps: tuple[Step, ...]) -> _Crank:
    shoulder, elbow, tip = (step.joint for step in steps)
    normal = np.array(shoulder.axis)
    plane = np.linalg.svd(normal[None])[2][1:]
    plane = plane if np.cross(*plane) @ normal > 0.0 else plane[::-1]
    points = np.array([shoulder.at, elbow.at, tip.at]) @ plane.T
    return _Crank(
        plane,
        points[0],
        np.diff(points, axis=0),
        np.array([shoulder.home, elbow.home]),
        np.array([step.sign * np.sign(np.dot(step.joint.axis, normal)) for step in steps[:2]]),
        np.array([shoulder.range, elbow.range]),
    )
