"""The feasible pose nearest to a target, by a general optimiser on closed-form loops and limits in plain NumPy.

Two kinds of machine are covered, both read from their description: platforms on struts and rods whose feet are on the
base or on bodies that hinges and slides carry (`Rods`), and two cranks whose forearms meet in a tip (`Cranks`). The
optimiser is SciPy's SLSQP from many starts, with derivatives by complex steps; no code of the solver is used.

Lengths are relative to L in here, angles in radians. Variables x are the reference point's position along `axes` (m),
the rotation vector from the target's orientation (3, or none), and the machine's own joints. A batch of x is (b, k).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from pfabrik import Cone, Joint, Mechanism, Solution

Array = NDArray[Any]

CLOSED = 1e-11
"""What an end of a search may exceed a limit or open a loop by [L or rad]: a hundredth of what an answer may, so that
it is no nearer by that than an answer's own slack."""

STEP = 1e-30
"""Imaginary step of a derivative: exact, since nothing is subtracted."""

LONGEST = 0.3
"""Unit of the variables [L or rad] of a search for a target that is farther away than that."""

REACH = 20.0
"""How far from its start a position is looked for [L]: bounds keep a search finite, and are not met."""

RESTARTS = 6
"""How often a search starts again where it ended, with a fresh estimate of curvature."""


class Found(NamedTuple):
    """The nearest feasible pose found: its variables, and by how much it is nearer than the answer judged [length]."""

    x: Array
    gain: float
    distance: float


# --- descriptions ----------------------------------------------------------------------------------------------------


def _unit(vector: object) -> Array:
    array = np.array(vector, dtype=float)
    return array / np.linalg.norm(array)


def _beyond(joint: Joint, body: str) -> str:
    return joint.connects[0] if joint.connects[1] == body else joint.connects[1]


def _others(mechanism: Mechanism, body: str, but: Joint) -> list[Joint]:
    return [joint for joint in mechanism.joints if body in joint.connects and joint is not but]


def _turned(axis: Array, angles: Array) -> Array:
    """Rotation matrices (b, 3, 3) about a unit axis, by real or complex angles (b,)."""
    return _exponential(angles[:, None] * axis)


def _exponential(w: Array) -> Array:
    """Rotation matrices of rotation vectors (b, 3), real or complex."""
    square = (w * w).sum(axis=1)
    small = np.abs(square) < 1e-8  # below, the next terms of the series are less than machine precision
    angle = np.sqrt(np.where(small, 1.0, square))
    first = np.where(small, 1.0 - square / 6.0, np.sin(angle) / angle)
    second = np.where(small, 0.5 - square / 24.0, (1.0 - np.cos(angle)) / np.where(small, 1.0, square))
    cross = np.zeros((len(w), 3, 3), w.dtype)
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -w[:, 2], w[:, 1], -w[:, 0]
    cross -= np.swapaxes(cross, 1, 2)
    return np.eye(3) + first[:, None, None] * cross + second[:, None, None] * (cross @ cross)


def _carriers(mechanism: Mechanism, body: str) -> list[tuple[Joint, float]]:
    """The hinges and slides that carry a body, from the base outward, and the sense in which each moves it."""
    chain: list[tuple[Joint, float]] = []
    while body != mechanism.base:
        carrying = [j for j in mechanism.joints if body in j.connects and j.type in ("revolute", "prismatic")]
        joint = next(j for j in carrying if all(j is not other for other, _ in chain))
        chain.insert(0, (joint, 1.0 if joint.connects[1] == body else -1.0))
        body = _beyond(joint, body)
    return chain


@dataclass(frozen=True)
class _Rod:
    """A strut, or a rod of one length, from a foot to a point of the platform."""

    foot: Joint
    head: Joint
    body: str
    length: tuple[float, float]


def _rods(mechanism: Mechanism) -> Iterator[_Rod]:
    for head in (joint for joint in mechanism.joints if mechanism.end_effector in joint.connects):
        rod = _beyond(head, mechanism.end_effector)
        (joint,) = _others(mechanism, rod, head)
        if joint.along is None:
            length = float(np.linalg.norm(np.subtract(head.at, joint.at)))
            yield _Rod(joint, head, _beyond(joint, rod), (length, length))
        else:
            (foot,) = _others(mechanism, _beyond(joint, rod), joint)
            yield _Rod(foot, head, _beyond(foot, _beyond(joint, rod)), joint.range or (0.0, np.inf))


# --- models ----------------------------------------------------------------------------------------------------------


class Rods:
    """A platform on struts and rods; its own variables are the hinges and slides that carry their feet."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.length = length = mechanism.characteristic_length
        self.axes = np.eye(3)
        self.turns = True
        rods = list(_rods(mechanism))
        self.feet = np.array([rod.foot.at for rod in rods]) / length
        self.tops = (np.array([rod.head.at for rod in rods]) - mechanism.reference_point) / length
        self.low, self.high = np.array([rod.length for rod in rods]).T / length
        self.rigid = self.low == self.high
        self.bodies = list(dict.fromkeys(rod.body for rod in rods))
        self.stands_on = np.array([self.bodies.index(rod.body) for rod in rods])
        self.foot_axes, self.foot_cosines = _cones([rod.foot for rod in rods], [rod.body for rod in rods])
        self.head_axes, self.head_cosines = _cones([rod.head for rod in rods], [mechanism.end_effector] * len(rods))
        self.chains = [_carriers(mechanism, body) for body in self.bodies]
        self.joints = [joint for chain in self.chains for joint, _ in chain]
        self.units = np.array([length if joint.type == "prismatic" else 1.0 for joint in self.joints])
        self.home = np.array([joint.home for joint in self.joints], dtype=float) / self.units
        ranges = [joint.range or (-np.inf, np.inf) for joint in self.joints]
        self.ranges = np.array(ranges, dtype=float).reshape(-1, 2) / self.units[:, None]

    def measures(self, p: Array, R: Array, z: Array) -> tuple[Array, Array]:
        """Gaps of the rods, to be zero, and slacks of the limits that are no plain bounds, to be positive; (b, ...)."""
        turns, shifts = self._carried(z)
        feet = (turns @ self.feet[:, :, None])[..., 0] + shifts
        lines = p[:, None] + (R[:, None] @ self.tops[:, :, None])[..., 0] - feet
        lengths = np.sqrt((lines * lines).sum(axis=2))
        lines = lines / lengths[..., None]
        at_feet = (lines * (turns @ self.foot_axes[:, :, None])[..., 0]).sum(axis=2) - self.foot_cosines
        at_heads = -(lines * (R[:, None] @ self.head_axes[:, :, None])[..., 0]).sum(axis=2) - self.head_cosines
        struts = ~self.rigid
        slacks = [lengths[:, struts] - self.low[struts], self.high[struts] - lengths[:, struts]]
        slacks += [at_feet[:, self.foot_cosines > -1.0], at_heads[:, self.head_cosines > -1.0]]
        return lengths[:, self.rigid] - self.low[self.rigid], np.concatenate(slacks, axis=1)

    def _carried(self, z: Array) -> tuple[Array, Array]:
        """Rotations (b, rods, 3, 3) and shifts (b, rods, 3) from home of the bodies on which the rods stand."""
        turns, shifts, column = [], [], 0
        for chain in self.chains:
            turn, shift = np.tile(np.eye(3).astype(z.dtype), (len(z), 1, 1)), np.zeros((len(z), 3), z.dtype)
            for joint, sense in chain:
                moved = sense * (z[:, column] - joint.home / self.units[column])
                if joint.type == "revolute":
                    own, centre = _turned(_unit(joint.axis), moved), np.array(joint.at) / self.length
                    shift = shift + (turn @ (centre - own @ centre)[..., None])[..., 0]
                    turn = turn @ own
                else:
                    shift = shift + moved[:, None] * (turn @ _unit(joint.axis))
                column += 1
            turns.append(turn)
            shifts.append(shift)
        return np.stack(turns, axis=1)[:, self.stands_on], np.stack(shifts, axis=1)[:, self.stands_on]


def _cones(joints: list[Joint], bodies: list[str]) -> tuple[Array, Array]:
    """Axes at home (k, 3) and cosines of the half angles (k,); without a cone, -1."""
    cones = [joint.cone or Cone((0, 0, 1), np.pi, body) for joint, body in zip(joints, bodies, strict=True)]
    for cone, body in zip(cones, bodies, strict=True):
        if cone.fixed_to != body:
            raise NotImplementedError(f"a cone is fixed to '{cone.fixed_to}'; expected is '{body}'")
    return np.array([_unit(cone.axis) for cone in cones]), np.cos([cone.half_angle for cone in cones])


class Cranks:
    """Two cranks and two forearms in a plane that meet in a tip; its own variables are shoulders and elbows."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.length = length = mechanism.characteristic_length
        tip = mechanism.joint(mechanism.end_effector)
        self.turns = False
        self.normal = _unit(tip.axis)
        axes = np.linalg.svd(self.normal[None])[2][1:]
        self.axes = axes if np.cross(*axes) @ self.normal > 0.0 else axes[::-1]
        self.joints = []
        for forearm in tip.connects:
            (elbow,) = _others(mechanism, forearm, tip)
            (shoulder,) = _others(mechanism, _beyond(elbow, forearm), elbow)
            self.joints += [shoulder, elbow]
        outer = [*(_beyond(j, mechanism.base) for j in self.joints[::2]), *tip.connects]
        outward = [outer[0], outer[2], outer[1], outer[3]]
        self.senses = [
            float(np.sign(_unit(joint.axis) @ self.normal)) * (1.0 if joint.connects[1] == body else -1.0)
            for joint, body in zip(self.joints, outward, strict=True)
        ]
        self.points = np.array([[*self.joints[i].at] for i in range(4)] + [[*tip.at]]) @ self.axes.T / length
        self.units = np.ones(4)
        self.home = np.array([joint.home for joint in self.joints], dtype=float)
        self.ranges = np.array([joint.range or (-np.inf, np.inf) for joint in self.joints], dtype=float)

    def measures(self, p: Array, R: Array, z: Array) -> tuple[Array, Array]:
        turned = [sense * (z[:, i] - self.home[i]) for i, sense in enumerate(self.senses)]
        tips, gaps = p @ self.axes.T, []
        for leg in (0, 2):
            shoulder, elbow, tip = self.points[leg], self.points[leg + 1], self.points[4]
            crank = _in_plane(turned[leg]) @ (elbow - shoulder)
            forearm = _in_plane(turned[leg] + turned[leg + 1]) @ (tip - elbow)
            gaps.append(shoulder + crank + forearm - tips)
        return np.concatenate(gaps, axis=1), np.zeros((len(p), 0), p.dtype)


def _in_plane(angles: Array) -> Array:
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)


Model = Rods | Cranks


@lru_cache(maxsize=64)
def model_of(mechanism: Mechanism) -> Model:
    return Cranks(mechanism) if mechanism.end_effector_is_joint else Rods(mechanism)


# --- the search ------------------------------------------------------------------------------------------------------


class Problem:
    """A target, what is held of it, and an answer to be judged; distances count as `Options` says.

    Parameters
    ----------
    target : (4, 4) [length].
    hold : "orientation", "position" or None.
    answer : of one target; where the scale of the search is taken from, and one of its starts.
    rotation_length : as of `Options` [length].
    """

    def __init__(
        self,
        mechanism: Mechanism,
        target: Array,
        hold: str | None,
        answer: Solution,
        rotation_length: float | None = None,
    ) -> None:
        self.model = model = model_of(mechanism)
        rotates = "rotation" in mechanism.task
        self.m, self.w = len(model.axes), 3 * model.turns
        self.rotation = target[:3, :3] if rotates else np.eye(3)
        self.lever = (rotation_length or mechanism.rotation_length) / model.length if rotates else 0.0
        self.wanted = np.array(target[:3, 3], dtype=float) / model.length
        self.centre = np.array(mechanism.reference_point) / model.length
        values = [float(answer.joints[joint.name]) for joint in model.joints]
        turned = Rotation.from_matrix(answer.pose[:3, :3] @ self.rotation.T).as_rotvec()[: self.w]
        at = model.axes @ (answer.pose[:3, 3] / model.length - self.centre)
        self.answer = np.concatenate([at, turned, values / model.units])
        self.held = np.zeros(len(self.answer), bool)
        if hold == "orientation" and rotates:
            self.held[self.m : self.m + self.w] = True
        if hold == "position":
            self.held[: self.m] = True
        self.begin = self._held_as_wanted(self.answer)
        self.distance = self.distance_of(self.answer)
        self.scale = min(max(self.distance, 1e-6), LONGEST)

    def _held_as_wanted(self, x: Array) -> Array:
        wished = np.zeros(len(x))
        wished[: self.m] = self.model.axes @ (self.wanted - self.centre)
        return np.where(self.held, wished, x)

    def distance_of(self, x: Array) -> float:
        offset = self.centre + x[: self.m] @ self.model.axes - self.wanted
        return float(np.hypot(np.linalg.norm(offset), self.lever * np.linalg.norm(x[self.m : self.m + self.w])))

    def gain(self, x: Array) -> float:
        """By how much variables are nearer than the answer [L]; exact also where both are far away."""
        move, rest = (x - self.answer)[: self.m], self._rest(self.answer)
        p, a = x[self.m : self.m + self.w], self.answer[self.m : self.m + self.w]
        less = -(move @ move) + 2.0 * move @ rest - self.lever**2 * (p - a) @ (p + a)
        return float(less) / (self.distance + self.distance_of(x))

    def _rest(self, x: Array) -> Array:
        """From variables to the target, along the axes."""
        return self.model.axes @ (self.wanted - self.centre) - x[: self.m]

    def measures(self, x: Array) -> tuple[Array, Array]:
        """Gaps and slacks of variables (b, k), real or complex."""
        p = self.centre + x[:, : self.m] @ self.model.axes
        turns = _exponential(x[:, self.m : self.m + self.w]) if self.w else np.tile(np.eye(3), (len(x), 1, 1))
        return self.model.measures(p, turns @ self.rotation, x[:, self.m + self.w :])

    def excess(self, x: Array) -> float:
        """Largest gap, or excess over a limit [L or rad]."""
        gaps, slacks = self.measures(x[None])
        own, (low, high) = x[self.m + self.w :], self.model.ranges.T
        beyond = [np.abs(gaps[0]), -slacks[0], low - own, own - high]
        return max(float(each.max(initial=0.0)) for each in beyond)

    def starts(self, count: int) -> Iterator[Array]:
        """The answer, home, and random variables: half of them about the answer, half about home."""
        rng = np.random.default_rng(1)
        home = np.concatenate([np.zeros(self.m + self.w), self.model.home])
        yield self.begin
        yield self._held_as_wanted(home)
        low, high = np.clip(self.model.ranges.T, -np.pi, np.pi)
        for i in range(count):
            about = (self.answer, home)[i % 2].copy()
            about[: self.m] += rng.uniform(-0.4, 0.4, self.m)
            about[self.m : self.m + self.w] += rng.uniform(-0.4, 0.4, self.w) * (self.lever > 0.0)
            about[self.m + self.w :] = rng.uniform(low, high)
            yield self._held_as_wanted(about)

    def descend(self, begin: Array) -> Array | None:
        """Where a search from a start ends, if that is feasible."""
        x, nearer, beyond = begin, -np.inf, np.inf
        for _ in range(RESTARTS):
            x = _Descent(self, x).end()
            excess = self.excess(x)
            if not excess <= max(CLOSED, 0.5 * beyond):
                return None  # stuck where no step brings the loops together
            gain, beyond = self.gain(x), excess
            if excess <= CLOSED and abs(gain - nearer) <= 1e-10 * self.distance_of(x):
                return x
            nearer = gain
        return x if beyond <= CLOSED else None


class _Descent:
    """One run of SLSQP on the free variables, in units of the problem's scale from where it begins."""

    def __init__(self, problem: Problem, begin: Array) -> None:
        self.problem, self.begin, self.free = problem, begin, np.flatnonzero(~problem.held)
        self.size = problem.scale * max(problem.distance_of(problem.answer), problem.scale)
        weights = np.zeros(len(begin))
        weights[: problem.m] = 1.0
        weights[problem.m : problem.m + problem.w] = problem.lever**2
        pull = weights * begin
        pull[: problem.m] = -problem._rest(begin)
        self.weights, self.pull = weights[self.free], pull[self.free]
        self.known: tuple[Array, Any] = (np.full(len(self.free), np.nan), None)
        self.sloped = self.known

    def at(self, y: Array) -> Array:
        x = self.begin.copy()
        x[self.free] += self.problem.scale * y
        return x

    def objective(self, y: Array) -> tuple[float, Array]:
        moved, scale = self.problem.scale * y, self.problem.scale / self.size
        gradient = self.pull + self.weights * moved
        return float(moved @ (self.pull + gradient)) / (2.0 * self.size), scale * gradient

    def values(self, y: Array) -> tuple[Array, Array]:
        if not np.array_equal(y, self.known[0]):
            gaps, slacks = self.problem.measures(self.at(y)[None])
            self.known = y.copy(), (gaps[0] / self.problem.scale, slacks[0] / self.problem.scale)
        return self.known[1]

    def slopes(self, y: Array) -> tuple[Array, Array]:
        if not np.array_equal(y, self.sloped[0]):
            x = np.tile(self.at(y).astype(complex), (len(self.free), 1))
            x[np.arange(len(self.free)), self.free] += STEP * 1j
            gaps, slacks = self.problem.measures(x)
            self.sloped = y.copy(), (gaps.imag.T / STEP, slacks.imag.T / STEP)
        return self.sloped[1]

    def end(self) -> Array:
        problem = self.problem
        bounds = np.tile([-REACH, REACH], (len(self.begin), 1))
        bounds[problem.m + problem.w :] = problem.model.ranges - self.begin[problem.m + problem.w :, None]
        kinds = [("eq", 0)] * bool(len(self.values(np.zeros(len(self.free)))[0])) + [("ineq", 1)]
        constraints = [
            {"type": kind, "fun": lambda y, i=i: self.values(y)[i], "jac": lambda y, i=i: self.slopes(y)[i]}
            for kind, i in kinds
            if len(self.values(np.zeros(len(self.free)))[i])
        ]
        found = minimize(
            self.objective,
            np.zeros(len(self.free)),
            jac=True,
            bounds=bounds[self.free] / problem.scale,
            constraints=constraints,
            method="SLSQP",
            options={"maxiter": 200, "ftol": 1e-13},
        )
        return self.at(found.x)


def nearest(problem: Problem, count: int = 6) -> Found | None:
    """The nearest feasible pose that searches from several starts find; None if none ends at a feasible one."""
    ends = [end for end in map(problem.descend, problem.starts(count)) if end is not None]
    if not ends:
        return None
    x = max(ends, key=problem.gain)
    length = problem.model.length
    return Found(x, problem.gain(x) * length, problem.distance_of(x) * length)


def drawn_targets(mechanism: Mechanism, rng: np.random.Generator, n: int) -> Array:
    """Targets (n, 4, 4) from 0.05 L to 5 L from home, near ones as often as far ones, and turned by 0.3 rad or so.

    Half of them are turned less, by a tenth of that, so that feasible poses with their orientation are common; of a
    mechanism whose end effector stays in a plane, as many are in that plane.
    """
    targets = np.tile(mechanism.home_pose, (n, 1, 1))
    directions = rng.normal(size=(n, 3))
    if mechanism.end_effector_is_joint:
        normal = _unit(mechanism.joint(mechanism.end_effector).axis)
        directions -= (rng.choice([0.0, 1.0], size=n) * (directions @ normal))[:, None] * normal
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    away = mechanism.characteristic_length * np.exp(rng.uniform(np.log(0.05), np.log(5.0), n))
    targets[:, :3, 3] += away[:, None] * directions
    if "rotation" in mechanism.task:
        turns = 0.3 * rng.normal(size=(n, 3)) * rng.choice([0.1, 1.0], size=(n, 1))
        targets[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return targets
