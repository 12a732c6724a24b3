"""Rate of the Jacobian of a map: exact, from the second order of the loops' conditions.

Actuators x(q) accelerate by x'' = J q'' + J' q'. With q'' = 0 that is a quadratic form h(q') of the rates: the second
derivatives H of x, by which J' = H q'. So a column of J' follows from two motions,

    J'(q') e = (h(q' + e) - h(q' - e)) / 4.

Lengths are in L.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats
from ...common.rotations import CROSSED, turning
from ...errors import UnsupportedMechanism
from ...kinematics import JointPath, generic_of
from ...tolerances import TOLERANCES
from ..dynamics.moving_rows import MovingRows, in_lengths
from .task_path import Coordinates, TaskPath

ROWS_A_BLOCK = 512
"""Rows whose matrices are in memory at once."""

PURPOSE = "differentiated twice"
NEAR_NONE = 0.1
"""Angle [rad] below which digits cancel, and series are used: what they leave out is below 1e-15."""


def jacobian_rates(coordinates: Coordinates, solution: Solution, rates: Floats) -> Floats:
    """dJ/dt (n, n_a, k) at configurations (n,) whose coordinates have rates (n, k), in the machine's units.

    Raises
    ------
    UnsupportedMechanism : coordinates that are no turns or slides, of a ball; the yaw of a platform that tilts too.
    """
    mechanism, length = coordinates.mechanism, coordinates.mechanism.characteristic_length
    _refuse(coordinates)
    units = np.where(coordinates.is_angle, 1.0, length)
    found = np.full((len(rates), len(mechanism.actuator_names), len(units)), np.nan)
    at = "task" if isinstance(coordinates, TaskPath) else coordinates.names
    known = np.flatnonzero(~np.isnan(solution._coordinates).any(axis=1))
    for start in range(0, len(known), ROWS_A_BLOCK):
        rows = known[start : start + ROWS_A_BLOCK]
        of = _second_order(coordinates, MovingRows(solution[rows], at))
        own = rates[rows] / units
        size = np.abs(own).max(axis=1, initial=0.0)[:, None]
        size[size == 0.0] = 1.0
        for place, one in enumerate(np.eye(len(units))):
            found[rows, :, place] = (of(own + size * one) - of(own - size * one)) / (4.0 * size * units[place])
    return found


def _refuse(coordinates: Coordinates) -> None:
    """Refuse coordinates whose rates are not those of the joints or the platform."""
    mechanism = coordinates.mechanism
    if isinstance(coordinates, JointPath):
        balls = [coordinates.names[each.place] for each in coordinates.motions if each.kind == "ball"]
        if balls:
            reason = f"{balls[0]} is a coordinate of a ball, whose rates are no angular velocities"
            raise UnsupportedMechanism(mechanism.name, [reason], PURPOSE)
    elif "yaw" in coordinates.names:
        tilts = np.abs(generic_of(mechanism).directions[:, 3:5]).max(initial=0.0)
        if tilts > TOLERANCES.alignment:
            raise UnsupportedMechanism(mechanism.name, ["its platform tilts as it yaws"], PURPOSE)


def _second_order(coordinates: Coordinates, rows: MovingRows) -> Callable[[Floats], Floats]:
    """Accelerations of the actuators (n, n_a) by rates (n, k) of coordinates that do not accelerate."""
    units, poses = in_lengths(coordinates.mechanism, rows.at), rows.solution._rows.poses

    def accelerations(rates: Floats) -> Floats:
        if not isinstance(coordinates, TaskPath):
            return replace(rows, rates=rates * units).efforts().gains
        twist, change = (each[:, : len(units)] * units for each in _turned(coordinates, poses, rates))
        moving = replace(rows, rates=twist)
        if len(units) > 3:
            spin, z = moving.efforts(["twists"]).twists[:, 3:], poses[:, :3, 2]
            about = spin - twist[:, 3:]
            change[:, 3:] += (about * z).sum(axis=1)[:, None] * np.cross(spin, z)  # it turns about its own axis too
        return replace(moving, gains=change).efforts().gains

    return accelerations


def _turned(coordinates: TaskPath, poses: Floats, rates: Floats) -> tuple[Floats, Floats]:
    """Twist of a platform by rates (n, k) of a task, and its change as these stay, (n, 6) each."""
    vectors, speeds, twist = coordinates.vectors_at(poses), *coordinates.spread(rates)
    change = np.zeros((len(rates), 6))
    matrices, faster = turning(vectors), _turning_rate(vectors, speeds)
    twist[:, 3:] = (matrices @ speeds[..., None])[..., 0]
    change[:, 3:] = (faster @ speeds[..., None])[..., 0]
    return twist, change


def _turning_rate(vectors: Floats, speeds: Floats) -> Floats:
    """Rate of `turning` as rotation vectors v (n, 3) move: b' V + b W + c' V^2 + c (V W + W V), with W of dv/dt."""
    a = np.linalg.norm(vectors, axis=1)[:, None, None]
    V, W = ((each @ CROSSED).reshape(-1, 3, 3) for each in (vectors, speeds))
    s = np.maximum(a, NEAR_NONE)
    cos, sin, near = 1.0 - np.cos(s), s - np.sin(s), a <= NEAR_NONE
    b = 0.5 * np.sinc(a / (2.0 * np.pi)) ** 2
    c = np.where(near, 1 / 6 - a**2 / 120 + a**4 / 5040 - a**6 / 362880, sin / s**3)
    of_b = np.where(near, -1 / 12 + a**2 / 180 - a**4 / 6720 + a**6 / 453600, (s * np.sin(s) - 2 * cos) / s**4)
    of_c = np.where(near, -1 / 60 + a**2 / 1260 - a**4 / 60480 + a**6 / 4989600, (s * cos - 3 * sin) / s**5)
    along = np.einsum("ni,ni->n", vectors, speeds)[:, None, None]
    return np.asarray(along * (of_b * V + of_c * (V @ V)) + b * W + c * (V @ W + W @ V))
