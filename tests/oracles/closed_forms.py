"""Closed-form inverse kinematics and reachability of three topologies, as a check on the library's own engines.

Covered are the planar 5-bar, the 6-UPS platform, and the redundant mechanism with crossbars (NRPM); dimensions, limits
and home come from the mechanism. Nothing here uses the library's kernels. Lengths are in the mechanism's unit,
angles in radians, targets are ``T_base_platform`` of shape ``(n, 4, 4)``.

Everything follows from `margin`: how far the best configuration at a target is from its tightest limit, as a share of
that limit's size. A range counts its width, a cone its half angle, the reach of a 5-bar leg the sum of its links.
Positive is inside, zero on the boundary, negative outside; the size of a negative value is only an indication. What
a configuration is free to choose (angle and extension of an NRPM's arm) is chosen within its range even outside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pfabrik.description.mechanism import Cone, Joint, Mechanism

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
"""Share of a bracket that one golden-section step keeps."""
PLANE_TOLERANCE = 1e-9
"""Offset from a planar mechanism's plane, relative to its reach, that still counts as in the plane."""
ACCURACY = 1e-8
"""How exact a margin is. For the redundant mechanism it is found by a search; the others are exact to rounding."""


def margin(mechanism: Mechanism, targets: Array) -> Array:
    """Signed normalised distance of each target from the nearest limit, in the best configuration; shape ``(n,)``."""
    topology = _topology(mechanism)
    if topology == "five_bar":
        return working_mode_margins(mechanism, targets).max(axis=1)
    if topology == "stewart":
        return _stewart_slacks(mechanism, targets).min(axis=1)
    return np.min([_best_arm(arm, targets)[0] for arm in arms(mechanism)], axis=0)


def reachable(mechanism: Mechanism, targets: Array) -> Bools:
    """Whether some configuration at each target keeps every limit; shape ``(n,)``."""
    return margin(mechanism, targets) >= 0.0


def actuators(mechanism: Mechanism, targets: Array) -> Array:
    """Actuated coordinates of the configuration with the largest margin; shape ``(n, n_a)``, NaN where none closes.

    The columns are in the order of ``mechanism.actuator_names``. Only the 6-UPS has no choice: a 5-bar answers in the
    working mode with the largest margin, the redundant mechanism in the middle of its freedom.
    """
    topology = _topology(mechanism)
    if topology == "five_bar":
        values = _five_bar_values(mechanism, targets)
    elif topology == "stewart":
        values = {strut.slide.name: strut.length(targets) for strut in _struts(mechanism)}
    else:
        values = _nrpm_values(mechanism, targets)
    return np.stack([values[name] for name in mechanism.actuator_names], axis=1)


def random_targets(mechanism: Mechanism, rng: np.random.Generator, n: int) -> Array:
    """Targets from well inside to far outside, ``(n, 4, 4)``; those of a 5-bar are level and in its plane.

    Positions are drawn from balls about the home position and tilts up to an angle: a quarter of the machine's size
    and 10 degrees (35 % of the targets), half and 45 degrees (40 %), all of it and 180 degrees (20 %), 20 times (5 %).
    """
    size = max(float(np.linalg.norm(np.subtract(j.at, _home(mechanism)))) for j in mechanism.joints if j.at is not None)
    kind = rng.choice(4, size=n, p=[0.35, 0.40, 0.20, 0.05])
    radius = np.array([0.25, 0.5, 1.0, 20.0])[kind] * size
    tilt = np.radians([10.0, 45.0, 180.0, 180.0])[kind]
    planar = _topology(mechanism) == "five_bar"
    normal = _unit(mechanism.joint(mechanism.end_effector).axis) if planar else np.zeros(3)
    steps = _directions(rng, n, normal) * (radius * rng.random(n) ** (1 / 3))[:, None]
    turns = _directions(rng, n) * (tilt * (not planar) * rng.random(n))[:, None]
    return poses(_home(mechanism) + steps, Rotation.from_rotvec(turns).as_matrix())


def inside_targets(mechanism: Mechanism, rng: np.random.Generator, n: int, least: float = 0.01) -> Array:
    """Random targets, ``(n, 4, 4)``, with a margin of at least `least`."""
    found = np.empty((0, 4, 4))
    while len(found) < n:
        drawn = random_targets(mechanism, rng, 4 * n)
        found = np.concatenate([found, drawn[margin(mechanism, drawn) >= least]])
    return found[:n]


def edge(margin: Callable[[Array], Array], farthest: Array, width: float) -> Array:
    """Where margins that are positive at 0 and negative at `farthest` change sign, ``(n,)``, to within `width`.

    Brackets are halved ten times, then narrowed by false positions, aimed beside the root so that both ends close in;
    every third step halves again, for margins that leap.
    """
    low, high = np.zeros_like(farthest), farthest
    at_low, at_high = margin(low), margin(high)
    step = 0
    while (high - low).max() > width:
        share = 0.5 if step < 10 or step % 3 == 0 else at_low / (at_low - at_high)
        middle = low + share * (high - low)
        aside = np.minimum(0.4 * width, 0.5 * (high - low))
        middle = np.clip(middle + np.where(share < 0.5, aside, -aside), low + 0.5 * aside, high - 0.5 * aside)
        value = margin(middle)
        inside = value >= 0.0
        low, at_low = np.where(inside, middle, low), np.where(inside, value, at_low)
        high, at_high = np.where(inside, high, middle), np.where(inside, at_high, value)
        step += 1
    return 0.5 * (low + high)


def poses(positions: Array, rotations: Array | None = None) -> Array:
    """``T_base_platform`` of positions ``(n, 3)`` and rotations ``(n, 3, 3)``, level when left out."""
    result = np.tile(np.eye(4), (len(positions), 1, 1))
    result[:, :3, 3] = positions
    if rotations is not None:
        result[:, :3, :3] = rotations
    return result


def leg_lengths(base: Array, platform: Array, targets: Array) -> Array:
    """Distances ``(n, k)`` from base points ``(k, 3)`` to platform points ``(k, 3)`` given in platform coordinates."""
    moved = np.einsum("nij,kj->nki", targets[:, :3, :3], platform) + targets[:, None, :3, 3]
    return np.linalg.norm(moved - base, axis=2)


# --- reading a mechanism ---------------------------------------------------------------------------------------------


def _topology(mechanism: Mechanism) -> str:
    """Which of the three topologies this is, told from the kinds of joints alone."""
    if any(joint.name == mechanism.end_effector for joint in mechanism.joints):
        return "five_bar"
    return "nrpm" if any(joint.type == "revolute" for joint in mechanism.joints) else "stewart"


def _home(mechanism: Mechanism) -> Array:
    return np.array(mechanism.reference_point, dtype=float)


def _at(joint: Joint) -> Array:
    return np.array(joint.at, dtype=float)


def _unit(vector: object) -> Array:
    result = np.array(vector, dtype=float)
    return result / np.linalg.norm(result)


def _directions(rng: np.random.Generator, n: int, normal: Array | None = None) -> Array:
    """Random unit vectors ``(n, 3)``, normal to `normal` unless it is zero."""
    drawn = rng.normal(size=(n, 3))
    if normal is not None:
        drawn -= (drawn @ normal)[:, None] * normal
    return drawn / np.linalg.norm(drawn, axis=1, keepdims=True)


def _across(joint: Joint, body: str) -> str:
    """The body on the other side of a joint."""
    return joint.connects[0] if joint.connects[1] == body else joint.connects[1]


def _next_joint(mechanism: Mechanism, body: str, but: Joint) -> Joint:
    """The one other joint of a body with two joints."""
    (joint,) = (j for j in mechanism.joints if body in j.connects and j.name != but.name)
    return joint


def _range_slack(value: Array, limits: tuple[float, float] | None) -> Array:
    if limits is None:
        return np.full(np.shape(value), np.inf)
    low, high = limits
    return np.minimum(value - low, high - value) / (high - low)


def _unwrapped(angle: Array, limits: tuple[float, float] | None) -> Array:
    """The angle, shifted by whole turns to where it is closest to the middle of its range."""
    middle = 0.0 if limits is None else sum(limits) / 2
    return middle + (angle - middle + np.pi) % (2 * np.pi) - np.pi


def _cone_slack(cosine: Array, half_angle: float) -> Array:
    return 1.0 - np.arccos(np.clip(cosine, -1.0, 1.0)) / half_angle


# --- planar 5-bar ----------------------------------------------------------------------------------------------------


def working_mode_margins(mechanism: Mechanism, targets: Array) -> Array:
    """Margin of a 5-bar in each working mode, ``(n, 4)``: home's, first elbow flipped, second flipped, both flipped."""
    first, second = (leg.margins(targets[:, :3, 3]) for leg in _cranks(mechanism))
    return np.stack([np.minimum(first[:, i], second[:, j]) for i, j in ((0, 0), (1, 0), (0, 1), (1, 1))], axis=1)


@dataclass(frozen=True)
class _Crank:
    """A leg of a 5-bar: a crank on the base and a forearm to the tip, both in the plane normal to `normal`."""

    shoulder: Joint
    elbow: Joint
    tip: Array
    normal: Array
    senses: tuple[float, float]

    def solve(self, tips: Array) -> tuple[Array, Array]:
        """Coordinates of shoulder and elbow ``(n, 2 modes, 2)``, and the slack of reach ``(n,)``.

        Two circles about the shoulder and the tip meet in two elbow positions: mode 0 is on home's side of the line
        from shoulder to tip. Where the circles do not meet, the coordinates are those of the nearest stretched or
        folded leg and the slack is negative.
        """
        crank, forearm = _at(self.elbow) - _at(self.shoulder), self.tip - _at(self.elbow)
        r1, r2 = np.linalg.norm(crank), np.linalg.norm(forearm)
        line = tips - _at(self.shoulder)
        offset = line @ self.normal
        line = line - offset[:, None] * self.normal
        distance = np.linalg.norm(line, axis=1)
        cosine = (r1**2 + distance**2 - r2**2) / np.maximum(2 * r1 * distance, np.finfo(float).tiny)
        opening = np.arccos(np.clip(cosine, -1.0, 1.0))
        side = np.sign(self._turn(self.tip - _at(self.shoulder), crank))
        heading = self._turn(crank, line)[:, None] + opening[:, None] * side * np.array([1.0, -1.0])
        elbows = np.cos(heading)[..., None] * crank + np.sin(heading)[..., None] * np.cross(self.normal, crank)
        bend = self._turn(elbows, line[:, None] - elbows) - self._turn(crank, forearm)
        slack = np.minimum(r1 + r2 - distance, distance - abs(r1 - r2)) / (r1 + r2)
        off_plane = np.abs(offset) / (r1 + r2)
        slack = np.where(off_plane > PLANE_TOLERANCE, np.minimum(slack, -off_plane), slack)
        turns = (heading, bend)
        joints = (self.shoulder, self.elbow)
        values = [
            _unwrapped(joint.home + sense * turn, joint.range)
            for joint, sense, turn in zip(joints, self.senses, turns, strict=True)
        ]
        return np.stack(values, axis=2), slack

    def margins(self, tips: Array) -> Array:
        """Margin of either mode, ``(n, 2)``."""
        values, slack = self.solve(tips)
        ranges = (self.shoulder.range, self.elbow.range)
        slacks = [_range_slack(values[:, :, k], limits) for k, limits in enumerate(ranges)]
        return np.minimum(np.minimum(*slacks), slack[:, None])

    def _turn(self, start: Array, end: Array) -> Array:
        """Right-handed angle about the normal from one vector to another."""
        return np.arctan2(np.cross(start, end) @ self.normal, (np.asarray(start) * end).sum(axis=-1))


def _cranks(mechanism: Mechanism) -> list[_Crank]:
    tip = mechanism.joint(mechanism.end_effector)
    return [_crank(mechanism, tip, forearm) for forearm in tip.connects]


def _crank(mechanism: Mechanism, tip: Joint, forearm: str) -> _Crank:
    elbow = _next_joint(mechanism, forearm, tip)
    link = _across(elbow, forearm)
    shoulder = _next_joint(mechanism, link, elbow)
    normal = _unit(shoulder.axis)
    senses = tuple(
        float(np.sign(np.dot(joint.axis, normal))) * (1.0 if joint.connects[1] == outer else -1.0)
        for joint, outer in ((shoulder, link), (elbow, forearm))
    )
    return _Crank(shoulder, elbow, _at(tip), normal, senses)


def _five_bar_values(mechanism: Mechanism, targets: Array) -> dict[str, Array]:
    values: dict[str, Array] = {}
    for leg in _cranks(mechanism):
        solved, slack = leg.solve(targets[:, :3, 3])
        best = leg.margins(targets[:, :3, 3]).argmax(axis=1)
        chosen = np.where(slack[:, None] < 0, np.nan, solved[np.arange(len(best)), best])
        values[leg.shoulder.name], values[leg.elbow.name] = chosen.T
    return values


# --- 6-UPS -----------------------------------------------------------------------------------------------------------


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

    def length(self, targets: Array) -> Array:
        return np.linalg.norm(self.tops(targets) - _at(self.foot), axis=1)


def _struts(mechanism: Mechanism) -> list[_Strut]:
    return [_strut(mechanism, joint) for joint in mechanism.joints if joint.along is not None]


def _strut(mechanism: Mechanism, slide: Joint) -> _Strut:
    ends = [mechanism.joint(name) for name in slide.along]
    (head,) = (joint for joint in ends if mechanism.end_effector in joint.connects)
    (foot,) = (joint for joint in ends if joint is not head)
    return _Strut(slide, foot, head, _at(head) - _home(mechanism))


def _stewart_slacks(mechanism: Mechanism, targets: Array) -> Array:
    """Slack of every strut and every cone, ``(n, 18)``."""
    slacks = []
    for strut in _struts(mechanism):
        lines = strut.tops(targets) - _at(strut.foot)
        length = np.linalg.norm(lines, axis=1)
        slacks.append(_range_slack(length, strut.slide.range))
        if strut.foot.cone is not None:
            axis = _fixed_axis(strut.foot.cone, mechanism.base)
            slacks.append(_cone_slack(lines @ axis / length, strut.foot.cone.half_angle))
        if strut.head.cone is not None:
            axes = targets[:, :3, :3] @ _fixed_axis(strut.head.cone, mechanism.end_effector)
            slacks.append(_cone_slack(-(lines * axes).sum(axis=1) / length, strut.head.cone.half_angle))
    return np.stack(slacks, axis=1)


def _fixed_axis(cone: Cone, body: str) -> Array:
    if cone.fixed_to != body:
        raise NotImplementedError(f"the closed form expects this cone on '{body}', not on '{cone.fixed_to}'")
    return _unit(cone.axis)


# --- redundant mechanism with crossbars ------------------------------------------------------------------------------
#
# Given the platform, the three arms are independent. The freedom of an arm is its angle phi and its extension d, and
# its margin is the largest smallest slack over that box: a search in two dimensions, split into two one-dimensional
# ones so that its accuracy can be argued.
#
# Along d, with phi fixed, a crossbar end moves on a line. The distance to its platform joint falls, then rises; so
# between the (at most two) points closest to the platform joints every distance is monotone. The sets "length below
# its bound" and "angle within a cone" (half angle below 90 degrees) are convex, so every slack is quasi-concave between
# those points, and so is the smallest of them: golden-section search there finds the maximum, not just a local one.
# Along phi the maximum over d is continuous; the highest local maxima of a grid are refined by golden section.
#
# A search can only miss, so an error makes the margin too small. Brackets end 4e-9 of the width of two grid cells, or
# of the range of d, wide, and a slack changes by little more than its share of a range: hence `ACCURACY`, about 1e-6 mm
# of the boundary. The one assumption, that no two local maxima lie within two cells (3 degrees), is tested.


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
        pivot, axis = _at(self.hinge), _unit(self.hinge.axis) * self.senses[0]
        swing = Rotation.from_rotvec((phi - self.hinge.home)[:, None] * axis).as_matrix()
        reach = swing @ (_unit(self.slide.axis) * self.senses[1])
        table = np.full((n, k, 6), np.nan)
        for j, strut in enumerate(self.struts):
            start = _at(strut.foot) - pivot - self.slide.home * _unit(self.slide.axis) * self.senses[1]
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
    return [_arm(mechanism, joint) for joint in mechanism.joints if joint.type == "revolute"]


def _arm(mechanism: Mechanism, hinge: Joint) -> _Arm:
    body = _across(hinge, mechanism.base)
    slide = _next_joint(mechanism, body, hinge)
    crossbar = _across(slide, body)
    struts = tuple(strut for strut in _struts(mechanism) if crossbar in strut.foot.connects)
    senses = (1.0 if hinge.connects[1] == body else -1.0, 1.0 if slide.connects[1] == crossbar else -1.0)
    return _Arm(hinge, slide, struts, senses, crossbar, mechanism.end_effector)


def _nrpm_values(mechanism: Mechanism, targets: Array) -> dict[str, Array]:
    values = {}
    for arm in arms(mechanism):
        _, phi, d = _best_arm(arm, targets)
        values[arm.hinge.name], values[arm.slide.name] = phi, d
        table = arm.lines(targets, phi).table
        lengths = np.sqrt(table[:, :, 1] + (table[:, :, 0] - d[:, None]) ** 2)
        values.update({strut.slide.name: lengths[:, j] for j, strut in enumerate(arm.struts)})
    return values
