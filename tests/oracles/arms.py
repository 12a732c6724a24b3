"""The best configuration of a redundant mechanism with crossbars (NRPM), limits and home from the description.

Given the platform, the arms are independent. The freedom of an arm is its angle phi and its extension d, and its margin
is the largest smallest slack over that box: a search in two dimensions, split into two one-dimensional ones so that its
accuracy can be argued. A slack is the distance from a limit, of a range in its width, of a cone in its half angle.

Along d, with phi fixed, a crossbar end moves on a line. The distance to its platform joint falls, then rises; so
between the (at most two) points closest to the platform joints every distance is monotone. The sets "length below
its bound" and "angle within a cone" (half angle below 90 degrees) are convex, so every slack is quasi-concave between
those points, and so is the smallest of them: golden-section search there finds the maximum, not just a local one.
Along phi the maximum over d is continuous; the highest local maxima of a grid are refined by golden section.

A search can only miss, so an error makes the margin too small. Brackets end 4e-9 of the width of two grid cells, or
of the range of d, wide, and a slack changes by little more than its share of a range: hence `ACCURACY`, about 1e-6 mm
of the boundary. The one assumption, that no two local maxima lie within two cells (3 degrees), is tested.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pfabrik import Cone, Joint, Mechanism

from .turns import Array, unit

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""Share of a bracket that one golden-section step keeps."""
ACCURACY = 1e-8
"""How exact a margin is."""


def _at(joint: Joint) -> Array:
    return np.array(joint.at, dtype=float)


def _range_slack(value: Array, limits: tuple[float, float] | None) -> Array:
    if limits is None:
        return np.full(np.shape(value), np.inf)
    low, high = limits
    return np.minimum(value - low, high - value) / (high - low)


def _cone_slack(cosine: Array, half_angle: float) -> Array:
    return 1.0 - np.arccos(np.clip(cosine, -1.0, 1.0)) / half_angle


def _fixed_axis(cone: Cone, body: str) -> Array:
    assert cone.fixed_to == body
    return unit(cone.axis)


@dataclass(frozen=True)
class _Strut:
    """A strut of variable length between two joints; `top` in platform coordinates, home's orientation."""

    slide: Joint
    foot: Joint
    head: Joint
    top: Array

    def tops(self, targets: Array) -> Array:
        """Positions of the platform joint, ``(n, 3)``."""
        return targets[:, :3, :3] @ self.top + targets[:, :3, 3]


def _struts(mechanism: Mechanism) -> list[_Strut]:
    found = []
    for slide in (joint for joint in mechanism.joints if joint.along is not None):
        ends = sorted(map(mechanism.joint, slide.along), key=lambda joint: mechanism.end_effector in joint.connects)
        found.append(_Strut(slide, *ends, _at(ends[1]) - mechanism.reference_point))
    return found


@dataclass(frozen=True)
class _Arm:
    """A swinging, extending arm with a crossbar and the struts on it."""

    hinge: Joint
    slide: Joint
    struts: tuple[_Strut, ...]
    senses: tuple[float, float]
    crossbar: str
    platform: str

    def lines(self, targets: Array, phi: Array) -> _Lines:
        """What the slacks need along d, for every pair of a target and an angle, both ``(n,)``."""
        n, k = len(phi), len(self.struts)
        pivot, axis = _at(self.hinge), unit(self.hinge.axis) * self.senses[0]
        swing = Rotation.from_rotvec((phi - self.hinge.home)[:, None] * axis).as_matrix()
        reach = swing @ (unit(self.slide.axis) * self.senses[1])
        table = np.full((n, k, 6), np.nan)
        for j, strut in enumerate(self.struts):
            start = _at(strut.foot) - pivot - self.slide.home * unit(self.slide.axis) * self.senses[1]
            gap = strut.tops(targets) - pivot - swing @ start
            table[:, j, 0] = (gap * reach).sum(axis=1)
            table[:, j, 1] = (gap**2).sum(axis=1) - table[:, j, 0] ** 2
            if strut.foot.cone is not None:
                foot = swing @ _fixed_axis(strut.foot.cone, self.crossbar)
                table[:, j, 2], table[:, j, 3] = (gap * foot).sum(axis=1), -(reach * foot).sum(axis=1)
            if strut.head.cone is not None:
                head = targets[:, :3, :3] @ _fixed_axis(strut.head.cone, self.platform)
                table[:, j, 4], table[:, j, 5] = -(gap * head).sum(axis=1), (reach * head).sum(axis=1)
        return _Lines(self, _range_slack(phi, self.hinge.range), table)


@dataclass(frozen=True)
class _Lines:
    """Slack along d for many arm angles: per strut closest d, squared distance there, and the cones' cosines.

    A cosine is ``(c0 + c1 d) / length`` with its two coefficients in columns 2 and 3 (crossbar), 4 and 5 (platform).
    """

    arm: _Arm
    hinge_slack: Array
    table: Array

    def take(self, rows: NDArray[np.intp]) -> _Lines:
        return _Lines(self.arm, self.hinge_slack[rows], self.table[rows])

    def slack(self, d: Array) -> Array:
        """The smallest slack of all limits of the arm, ``(n,)``, at extensions d ``(n,)``."""
        worst = np.minimum(self.hinge_slack, _range_slack(d, self.arm.slide.range))
        for j, strut in enumerate(self.arm.struts):
            closest, squared, *cosines = self.table[:, j].T
            length = np.sqrt(np.maximum(squared, 0.0) + (closest - d) ** 2)
            worst = np.minimum(worst, _range_slack(length, strut.slide.range))
            for cone, c0, c1 in ((strut.foot.cone, *cosines[:2]), (strut.head.cone, *cosines[2:])):
                if cone is not None:
                    worst = np.minimum(worst, _cone_slack((c0 + c1 * d) / length, cone.half_angle))
        return worst

    def best(self, steps: int) -> tuple[Array, Array]:
        """The largest slack over d and where it is, both ``(n,)``."""
        low, high = self.arm.slide.range
        n = len(self.table)
        breaks = np.sort(np.clip(self.table[:, :, 0], low, high), axis=1)
        edges = np.hstack([np.full((n, 1), low), breaks, np.full((n, 1), high)])
        row, piece = np.nonzero(edges[:, 1:] > edges[:, :-1])
        value, d = _golden_section(self.take(row).slack, edges[row, piece], edges[row, piece + 1], steps)
        table = np.full((2, n, edges.shape[1] - 1), -np.inf)
        table[0, row, piece], table[1, row, piece] = value, d
        winner = table[0].argmax(axis=1)
        return table[0, np.arange(n), winner], table[1, np.arange(n), winner]


def _golden_section(slack: Callable[[Array], Array], low: Array, high: Array, steps: int) -> tuple[Array, Array]:
    """Largest value and place of quasi-concave functions of one variable, one per row, in brackets of their own."""
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = slack(left), slack(right)
    for _ in range(steps):
        up = at_left < at_right
        low, high = np.where(up, left, low), np.where(up, high, right)
        probe = np.where(up, low + GOLDEN * (high - low), high - GOLDEN * (high - low))
        value = slack(probe)
        left, right = np.where(up, right, probe), np.where(up, probe, left)
        at_left, at_right = np.where(up, at_right, value), np.where(up, value, at_left)
    return np.maximum(at_left, at_right), np.where(at_left > at_right, left, right)


def _best_arm(
    arm: _Arm, targets: Array, cells: int = 60, peaks: int = 3, steps: int = 40
) -> tuple[Array, Array, Array]:
    """Margin, angle and extension of an arm at its best configuration for each target, each ``(n,)``.

    Parameters
    ----------
    cells : number of cells the range of the angle is divided into before refining; two peaks within a cell are one.
    peaks : number of local maxima of that grid that are refined, the highest first.
    steps : golden-section steps of the refinement; 40 narrow a bracket to 4e-9 of its width.
    """
    n, grid = len(targets), np.linspace(*arm.hinge.range, cells + 1)
    row = np.repeat(np.arange(n), cells + 1)
    coarse = arm.lines(targets[row], np.tile(grid, n)).best(steps // 2)[0].reshape(n, cells + 1)
    padded = np.pad(coarse, ((0, 0), (1, 1)), constant_values=-np.inf)
    peaked = np.where((coarse >= padded[:, :-2]) & (coarse >= padded[:, 2:]), coarse, -np.inf)
    order = np.argsort(-peaked, axis=1)[:, :peaks]
    row, rank = np.nonzero(np.isfinite(np.take_along_axis(peaked, order, axis=1)))
    cell, goals = order[row, rank], targets[row]

    def over_d(phi: Array) -> Array:
        return arm.lines(goals, phi).best(steps)[0]

    low, high = grid[np.maximum(cell - 1, 0)], grid[np.minimum(cell + 1, cells)]
    _, phi = _golden_section(over_d, low, high, steps)
    value, d = arm.lines(goals, phi).best(steps)
    table = np.full((3, n, peaks), -np.inf)
    table[:, row, rank] = value, phi, d
    winner = table[0].argmax(axis=1)
    return tuple(table[:, np.arange(n), winner])


def arms(mechanism: Mechanism) -> list[_Arm]:
    """The arms of a redundant mechanism."""
    found = []
    for hinge in (joint for joint in mechanism.joints if joint.type == "revolute"):
        body = _across(hinge, mechanism.base)
        (slide,) = (joint for joint in mechanism.joints if body in joint.connects and joint is not hinge)
        crossbar = _across(slide, body)
        struts = tuple(strut for strut in _struts(mechanism) if crossbar in strut.foot.connects)
        senses = (1.0 if hinge.connects[1] == body else -1.0, 1.0 if slide.connects[1] == crossbar else -1.0)
        found.append(_Arm(hinge, slide, struts, senses, crossbar, mechanism.end_effector))
    return found


def _across(joint: Joint, body: str) -> str:
    """The body on the other side of a joint."""
    return joint.connects[0] if joint.connects[1] == body else joint.connects[1]


def redundant_margin(mechanism: Mechanism, targets: Array, **finer: int) -> Array:
    """Smallest slack of all limits in the best configuration at targets (n, 4, 4), (n,)."""
    return np.min([_best_arm(arm, targets, **finer)[0] for arm in arms(mechanism)], axis=0)


def redundant_actuators(mechanism: Mechanism, targets: Array) -> Array:
    """Actuated coordinates (n, n_a) in the best configuration, in the middle of its freedom."""
    values = {}
    for arm in arms(mechanism):
        _, phi, d = _best_arm(arm, targets)
        values[arm.hinge.name], values[arm.slide.name] = phi, d
        table = arm.lines(targets, phi).table
        lengths = np.sqrt(table[:, :, 1] + (table[:, :, 0] - d[:, None]) ** 2)
        values.update({strut.slide.name: lengths[:, j] for j, strut in enumerate(arm.struts)})
    return np.stack([values[name] for name in mechanism.actuator_names], axis=1)
