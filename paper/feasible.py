"""Whether an answer is feasible, from the description alone: closed-form loops and limits in plain NumPy.

Two kinds of machine are covered, told apart by their joints: struts (U-P-S) whose feet are on the base or on arms that
hinges and slides carry, and cranks with forearms that meet in one plane. Nothing of the engines is used.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import cast

import numpy as np

from pfabrik import Cone, Joint, Mechanism, Solution, decompose

from .arrays import Floats
from .step import Step

ROOM = 4.0
"""How far from home positions are looked for, along each axis [L]."""


class Model(ABC):
    """A machine at a fixed orientation of its platform, as functions of its free variables x (k,) [L or rad].

    Attributes
    ----------
    axes : (m, 3); the first m variables are the position of the reference point along them.
    names : of the actuators that are the other variables.
    bounds : (k, 2).
    home : (k,).
    """

    def __init__(self, mechanism: Mechanism, axes: Floats, driven: Sequence[Joint]) -> None:
        self.mechanism = mechanism
        self.length = mechanism.characteristic_length
        self.axes = axes
        self.names = [joint.name for joint in driven]
        self.units = np.array([self.length if joint.type == "prismatic" else 1.0 for joint in driven])
        position = axes @ np.array(mechanism.reference_point) / self.length
        ranges = np.array([_range(joint) for joint in driven]).reshape(-1, 2) / self.units[:, None]
        self.bounds = np.concatenate([position[:, None] + [-ROOM, ROOM], ranges])
        homes = np.array([joint.home for joint in driven], dtype=float) / self.units
        self.home = np.concatenate([position, homes])

    def variables(self, solution: Solution) -> Floats:
        """The variables of answers (n, k)."""
        order = [self.mechanism.actuator_names.index(name) for name in self.names]
        positions = solution.pose[:, :3, 3] @ self.axes.T / self.length
        return np.concatenate([positions, solution.actuators[:, order] / self.units], axis=1)

    @abstractmethod
    def slacks(self, x: Floats, rotation: Floats) -> Floats:
        """How far every limit is away [L or rad]; negative where it is exceeded."""

    def gaps(self, x: Floats, rotation: Floats) -> Floats:
        """By how much every loop is open [L]; empty where the variables close all of them."""
        return np.zeros(0)


@lru_cache(maxsize=8)
def model_of(mechanism: Mechanism) -> Model:
    """The closed form of a machine."""
    return Cranks(mechanism) if mechanism.end_effector_is_joint else Struts(mechanism)


def worst_excess(solution: Solution) -> Floats:
    """Largest excess over any limit, or gap of any loop, of each answer (n,) [L or rad]; 0 if there is none."""
    model = model_of(solution.mechanism)
    poses = zip(model.variables(solution), solution.pose[:, :3, :3], strict=True)
    return np.array([max(0.0, -model.slacks(x, R).min(), np.abs(model.gaps(x, R)).max(initial=0.0)) for x, R in poses])


def _at(joint: Joint) -> Floats:
    return np.array(joint.at, dtype=float)


def _range(joint: Joint) -> tuple[float, float]:
    return cast(tuple[float, float], joint.range or (-np.inf, np.inf))


class Struts(Model):
    """Struts from feet, on the base or on arms, to a platform; x is the position, then the arms' joints."""

    def __init__(self, mechanism: Mechanism) -> None:
        chains = decompose(mechanism)
        self.arms = [chain.trunk for chain in chains]
        super().__init__(mechanism, np.eye(3), [step.joint for arm in self.arms for step in arm])
        struts = [branch for chain in chains for branch in chain.branches]
        self.carried_by = np.array([arm for arm, chain in enumerate(chains) for _ in chain.branches])
        self.low, self.high = np.array([_range(slide.joint) for _, slide, _ in struts]).T / self.length
        self.feet = np.array([_at(foot.joint) for foot, _, _ in struts])
        self.tops = np.array([_at(head.joint) - mechanism.reference_point for *_, head in struts])
        self.foot_axes, self.foot_angles = _cones([foot for foot, _, _ in struts])
        self.head_axes, self.head_angles = _cones([head.back for *_, head in struts])

    def slacks(self, x: Floats, rotation: Floats) -> Floats:
        own, placed = x[3:], []
        for arm in self.arms:
            placed.append(_placed(arm, own, self.length))
            own = own[len(arm) :]
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


def _placed(arm: Sequence[Step], values: Floats, length: float) -> tuple[Floats, Floats]:
    """Rotation and translation from home of the body on an arm; its joints have the first of some values [L or rad]."""
    rotation, shift = np.eye(3), np.zeros(3)
    for step, value in zip(arm, values, strict=False):
        joint, axis = step.joint, np.array(step.joint.axis)
        if joint.type == "revolute":
            turn = _turn_about(axis, step.sign * (value - joint.home))
            shift = shift + rotation @ (_at(joint) - turn @ _at(joint))
            rotation = rotation @ turn
        else:
            shift = shift + rotation @ axis * (step.sign * (value * length - joint.home))
    return rotation, shift


def _turn_about(axis: Floats, angle: float) -> Floats:
    """The rotation (3, 3) by an angle [rad] about a unit vector, by Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + 2.0 * np.sin(0.5 * angle) ** 2 * (K @ K))


def _angles(lines: Floats, axes: Floats) -> Floats:
    """Angles between unit vectors (k, 3), (k,), exact also where they are small."""
    across = np.linalg.norm(np.cross(lines, axes), axis=1)
    return np.asarray(np.arctan2(across, np.einsum("ki,ki->k", lines, axes)))


def _cones(steps: Sequence[Step]) -> tuple[Floats, Floats]:
    """Axes at home (k, 3) and half angles (k,) of the cones at some ends of struts; half a turn where there is none.

    Each must be fixed to the body that carries this end.
    """
    cones = []
    for step in steps:
        cone = step.joint.cone or Cone(axis=(0.0, 0.0, 1.0), half_angle=np.pi, fixed_to=step.inward)
        if cone.fixed_to != step.inward:
            raise ValueError(f"a cone is fixed to '{cone.fixed_to}'; the closed form expects it on '{step.inward}'")
        cones.append(cone)
    return np.array([cone.axis for cone in cones]), np.array([float(cone.half_angle) for cone in cones])


@dataclass(frozen=True)
class _Crank:
    """A driven crank and a forearm, both in the plane; vectors are (2,), at home."""

    shoulder: Floats
    crank: Floats
    forearm: Floats
    homes: Floats  # of shoulder and elbow, as all below
    senses: Floats
    ranges: Floats

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


class Cranks(Model):
    """Cranks and forearms that meet in a tip; x is the tip in the plane, then the angles of the cranks."""

    def __init__(self, mechanism: Mechanism) -> None:
        normal = np.array(mechanism.joint(mechanism.end_effector).axis)
        axes = np.linalg.svd(normal[None])[2][1:]  # square to it, and to each other
        axes = axes if np.cross(*axes) @ normal > 0.0 else axes[::-1]
        legs = [chain.branches[0] for chain in decompose(mechanism)]
        super().__init__(mechanism, axes, [shoulder.joint for shoulder, *_ in legs])
        self.cranks = [_crank(leg, axes, normal) for leg in legs]

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


def _crank(leg: Sequence[Step], axes: Floats, normal: Floats) -> _Crank:
    """One leg in the plane along `axes` (2, 3)."""
    turning = [step.joint for step in leg[:2]]
    points = np.array([_at(step.joint) for step in leg]) @ axes.T
    return _Crank(
        shoulder=points[0],
        crank=points[1] - points[0],
        forearm=points[2] - points[1],
        homes=np.array([joint.home for joint in turning], dtype=float),
        senses=np.array([step.sign * np.sign(np.array(step.joint.axis) @ normal) for step in leg[:2]]),
        ranges=np.array([_range(joint) for joint in turning]),
    )
