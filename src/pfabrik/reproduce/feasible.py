"""Whether an answer is feasible, from the description alone: closed-form loops and limits in plain NumPy.

Two kinds of machine are covered, told apart by their joints: struts (U-P-S) whose feet are on the base or on arms that
hinges and slides carry, and cranks with forearms that meet in one plane. No code of the solver is used.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..answers.solution import Solution
from ..description.mechanism import Cone, Joint, Mechanism
from ..errors import UnsupportedMechanism

Floats = NDArray[np.float64]


class Model(Protocol):
    """A machine at a fixed orientation of its platform, as functions of its free variables x (k,) [L or rad].

    The first variables are the position of the reference point, along `axes` (m, 3).
    """

    length: float
    axes: Floats
    bounds: Floats  # (k, 2)
    home: Floats  # (k,)

    def slacks(self, x: Floats, rotation: Floats) -> Floats:
        """How far every limit is away [L or rad]; negative where it is exceeded."""
        ...

    def gaps(self, x: Floats, rotation: Floats) -> Floats:
        """By how much every loop is open [L]; empty where the variables close all of them."""
        ...

    def variables(self, solution: Solution) -> Floats:
        """The variables of answers (n, k)."""
        ...


@lru_cache(maxsize=8)
def model_of(mechanism: Mechanism) -> Model:
    """The closed form of a machine."""
    return Cranks(mechanism) if mechanism.end_effector_is_joint else Struts(mechanism)


def worst_excess(solution: Solution) -> Floats:
    """Largest excess over any limit, or gap of any loop, of each answer (n,) [L or rad]; 0 if there is none."""
    model = model_of(solution.mechanism)
    poses = zip(model.variables(solution), solution.pose[:, :3, :3], strict=True)
    return np.array([max(0.0, -model.slacks(x, R).min(), np.abs(model.gaps(x, R)).max(initial=0.0)) for x, R in poses])


def _turned(axis: Floats, angle: float) -> Floats:
    """Rotation matrix about a unit axis."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def _unit(vector: object) -> Floats:
    array = np.array(vector, dtype=float)
    return np.asarray(array / np.linalg.norm(array))


def _at(joint: Joint) -> Floats:
    return np.array(joint.at, dtype=float)


def _range(joint: Joint) -> tuple[float, float]:
    low, high = joint.range or (-np.inf, np.inf)
    return float(low), float(high)  # type: ignore[arg-type]


def _beyond(joint: Joint, body: str) -> str:
    """The body on the other side of a joint."""
    first, second = joint.connects
    return first if second == body else second


def _toward_base(mechanism: Mechanism, body: str, but: tuple[Joint, ...] = ()) -> list[Joint]:
    """The R and P joints that carry a body, from the base outward; empty for the base itself."""
    carried: list[Joint] = []
    while body != mechanism.base:
        found = [j for j in mechanism.joints if body in j.connects and j.type in ("revolute", "prismatic")]
        joint = next((j for j in found if j not in (*carried, *but)), None)
        if joint is None:
            raise UnsupportedMechanism(mechanism.name, [f"body '{body}' is not carried by hinges and slides"])
        carried.insert(0, joint)
        body = _beyond(joint, body)
    return carried


@dataclass(frozen=True)
class _Carrier:
    """A body that moves with the joints between it and the base."""

    joints: tuple[Joint, ...]
    senses: tuple[float, ...]
    first: int  # of its variables

    def placed(self, x: Floats, length: float) -> tuple[Floats, Floats]:
        """Rotation and translation of the body from home."""
        rotation, shift = np.eye(3), np.zeros(3)
        for joint, sense, value in zip(self.joints, self.senses, x[self.first :], strict=False):
            if joint.type == "revolute":
                turn = _turned(_unit(joint.axis), sense * (value - joint.home))
                shift = shift + rotation @ (_at(joint) - turn @ _at(joint))
                rotation = rotation @ turn
            else:
                shift = shift + rotation @ _unit(joint.axis) * (sense * (value * length - joint.home))
        return rotation, shift


class Struts:
    """Struts from feet, on the base or on arms, to a platform; x is the position, then the arms' joints."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.length = mechanism.characteristic_length
        self.axes = np.eye(3)
        struts = [joint for joint in mechanism.joints if joint.along is not None]
        ends = [sorted(map(mechanism.joint, s.along or ()), key=self._is_head) for s in struts]
        self.low, self.high = np.array([_range(strut) for strut in struts]).T / self.length
        self.feet = np.array([_at(foot) for foot, _ in ends])
        self.tops = np.array([_at(head) - mechanism.reference_point for _, head in ends])
        bodies = [_foot_body(foot, strut, mechanism) for (foot, _), strut in zip(ends, struts, strict=True)]
        self.carriers, self.carried_by = self._carriers(bodies)
        self.foot_axes, self.foot_angles = _cones([foot for foot, _ in ends], bodies)
        self.head_axes, self.head_angles = _cones([head for _, head in ends], [mechanism.end_effector] * len(ends))
        joints = [joint for carrier in self.carriers for joint in carrier.joints]
        self.names = [joint.name for joint in joints]
        self.units = np.array([self.length if joint.type == "prismatic" else 1.0 for joint in joints])
        ranges = np.array([_range(joint) for joint in joints]).reshape(-1, 2) / self.units[:, None]
        reach = np.array([[-4.0, 4.0]] * 3) + np.array(mechanism.reference_point)[:, None] / self.length
        self.bounds = np.concatenate([reach, ranges])
        homes = np.array([joint.home for joint in joints], dtype=float) / self.units
        self.home = np.concatenate([np.array(mechanism.reference_point) / self.length, homes])

    def _is_head(self, joint: Joint) -> bool:
        return self.mechanism.end_effector in joint.connects

    def _carriers(self, bodies: list[str]) -> tuple[list[_Carrier], NDArray[np.intp]]:
        names, first, carriers = list(dict.fromkeys(bodies)), 3, []
        for name in names:
            joints = _toward_base(self.mechanism, name)
            inner, senses = self.mechanism.base, []
            for joint in joints:
                senses.append(1.0 if joint.connects[0] == inner else -1.0)
                inner = _beyond(joint, inner)
            carriers.append(_Carrier(tuple(joints), tuple(senses), first))
            first += len(joints)
        return carriers, np.array([names.index(body) for body in bodies])

    def slacks(self, x: Floats, rotation: Floats) -> Floats:
        placed = [carrier.placed(x, self.length) for carrier in self.carriers]
        turns = np.stack([turn for turn, _ in placed])[self.carried_by]
        shifts = np.stack([shift for _, shift in placed])[self.carried_by]
        feet = (turns @ self.feet[:, :, None])[:, :, 0] + shifts
        lines = self.tops @ rotation.T + x[:3] * self.length - feet
        lengths = np.linalg.norm(lines, axis=1)
        lines = lines / lengths[:, None]
        foot_axes = (turns @ self.foot_axes[:, :, None])[:, :, 0]
        at_foot = self.foot_angles - _angles(lines, foot_axes)
        at_head = self.head_angles - _angles(-lines, self.head_axes @ rotation.T)
        own, scaled = x[3:], lengths / self.length
        low, high = self.bounds[3:].T
        return np.concatenate([scaled - self.low, self.high - scaled, at_foot, at_head, own - low, high - own])

    def gaps(self, x: Floats, rotation: Floats) -> Floats:
        return np.zeros(0)

    def variables(self, solution: Solution) -> Floats:
        order = [self.mechanism.actuator_names.index(name) for name in self.names]
        return np.concatenate(
            [solution.pose[:, :3, 3] / self.length, solution.actuators[:, order] / self.units], axis=1
        )


def _foot_body(foot: Joint, strut: Joint, mechanism: Mechanism) -> str:
    """The body on which a strut stands."""
    return foot.connects[0] if foot.connects[1] in strut.connects else foot.connects[1]


def _angles(lines: Floats, axes: Floats) -> Floats:
    """Angles between unit vectors (k, 3), (k,), exact also where they are small."""
    across = np.linalg.norm(np.cross(lines, axes), axis=1)
    return np.asarray(np.arctan2(across, np.einsum("ki,ki->k", lines, axes)))


def _cones(joints: list[Joint], bodies: list[str]) -> tuple[Floats, Floats]:
    """Axes at home (k, 3) and half angles (k,); without a cone, any direction is allowed."""
    any_line = Cone(axis=(0.0, 0.0, 1.0), half_angle=np.pi, fixed_to="")
    cones = [joint.cone or replace(any_line, fixed_to=body) for joint, body in zip(joints, bodies, strict=True)]
    for cone, body in zip(cones, bodies, strict=True):
        if cone.fixed_to != body:
            raise ValueError(f"a cone is fixed to '{cone.fixed_to}'; the closed form expects it on '{body}'")
    return np.array([_unit(cone.axis) for cone in cones]), np.array([float(cone.half_angle) for cone in cones])


@dataclass(frozen=True)
class _Crank:
    """A driven crank and a forearm, both in the plane; vectors are (2,), at home."""

    shoulder: Floats
    crank: Floats
    forearm: Floats
    homes: tuple[float, float]
    senses: tuple[float, float]
    ranges: Floats  # of shoulder and elbow

    def elbow(self, angle: float) -> Floats:
        turn = self.senses[0] * (angle - self.homes[0])
        c, s = np.cos(turn), np.sin(turn)
        return np.asarray(self.shoulder + np.array([[c, -s], [s, c]]) @ self.crank)

    def bend(self, elbow: Floats, tip: Floats) -> float:
        """Coordinate of the elbow, on the turn nearest to the middle of its range."""
        turn = _turn(elbow - self.shoulder, tip - elbow) - _turn(self.crank, self.forearm)
        middle = float(self.ranges[1].mean())
        value = self.homes[1] + self.senses[1] * turn
        return float((value - middle + np.pi) % (2.0 * np.pi) - np.pi + middle)


def _turn(start: Floats, end: Floats) -> float:
    return float(np.arctan2(start[0] * end[1] - start[1] * end[0], start @ end))


class Cranks:
    """Cranks and forearms that meet in a tip; x is the tip in the plane, then the angles of the cranks."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.length = mechanism.characteristic_length
        tip = mechanism.joint(mechanism.end_effector)
        normal = _unit(tip.axis)
        axes = np.linalg.svd(normal[None])[2][1:]
        self.axes = axes if np.cross(*axes) @ normal > 0.0 else axes[::-1]
        self.chains = [_toward_base(mechanism, forearm, but=(tip,)) for forearm in tip.connects]
        self.cranks = [self._crank(shoulder, elbow, tip, normal) for shoulder, elbow in self.chains]
        self.names = [shoulder.name for shoulder, _ in self.chains]
        reach = (self.axes @ np.array(mechanism.reference_point))[:, None] / self.length + np.array([[-4.0, 4.0]] * 2)
        self.bounds = np.concatenate([reach, [crank.ranges[0] for crank in self.cranks]])
        tip_home = self.axes @ _at(tip) / self.length
        self.home = np.concatenate([tip_home, [crank.homes[0] for crank in self.cranks]])

    def _crank(self, shoulder: Joint, elbow: Joint, tip: Joint, normal: Floats) -> _Crank:
        link = _beyond(shoulder, self.mechanism.base)
        senses = (
            float(np.sign(_unit(shoulder.axis) @ normal)) * (1.0 if shoulder.connects[1] == link else -1.0),
            float(np.sign(_unit(elbow.axis) @ normal)) * (1.0 if elbow.connects[0] == link else -1.0),
        )
        points = np.array([_at(joint) for joint in (shoulder, elbow, tip)]) @ self.axes.T
        ranges = np.array([_range(shoulder), _range(elbow)])
        homes = (float(shoulder.home), float(elbow.home))  # type: ignore[arg-type]
        return _Crank(points[0], points[1] - points[0], points[2] - points[1], homes, senses, ranges)

    def slacks(self, x: Floats, rotation: Floats) -> Floats:
        values = []
        for crank, angle in zip(self.cranks, x[2:], strict=True):
            bend = crank.bend(crank.elbow(angle), x[:2] * self.length)
            (low, high), (bend_low, bend_high) = crank.ranges
            values += [angle - low, high - angle, bend - bend_low, bend_high - bend]
        return np.array(values)

    def gaps(self, x: Floats, rotation: Floats) -> Floats:
        tip = x[:2] * self.length
        pairs = zip(self.cranks, x[2:], strict=True)
        reach = [np.linalg.norm(tip - crank.elbow(angle)) - np.linalg.norm(crank.forearm) for crank, angle in pairs]
        return np.array(reach) / self.length

    def variables(self, solution: Solution) -> Floats:
        order = [self.mechanism.actuator_names.index(name) for name in self.names]
        tips = solution.pose[:, :3, 3] @ self.axes.T / self.length
        return np.concatenate([tips, solution.actuators[:, order]], axis=1)
