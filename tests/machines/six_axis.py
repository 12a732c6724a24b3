"""An arm of six revolutes with a spherical wrist, whose inverse kinematics textbooks have in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import pfabrik as pf
from pfabrik import Joint, Mechanism

H, A1, A2, D4, D6 = 330.0, 75.0, 300.0, 320.0, 80.0


def six_axis_arm(**more: Any) -> Mechanism:
    """Upright at home, the forearm level; `more` is of every joint."""
    wrist = (A1 + D4, 0, H + A2)
    points = [(0, 0, 0), (A1, 0, H), (A1, 0, H + A2), wrist, wrist, wrist]
    bodies = ["base", *(f"link{k}" for k in range(1, 6)), "tool"]
    joints = [
        Joint(f"j{k + 1}", "revolute", (bodies[k], bodies[k + 1]), at=at, axis=np.eye(3)[axis], actuated=True, **more)
        for k, (at, axis) in enumerate(zip(points, (2, 1, 1, 0, 1, 0), strict=True))
    ]
    return Mechanism("6R arm with a wrist", joints, "tool", (wrist[0] + D6, 0, wrist[2]))


def turn(axis: int, angle: float) -> np.ndarray:
    """A rotation about x, y or z."""
    c, s, i, j = np.cos(angle), np.sin(angle), (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = c
    R[j, i], R[i, j] = s, -s
    return R


def tool_pose(q: Sequence[float]) -> np.ndarray:
    """Its tool: Rz(q1) Ry(q2) Ry(q3) Rx(q4) Ry(q5) Rx(q6)."""
    upper, fore = turn(1, q[1]), turn(1, q[1] + q[2])
    hand = turn(2, q[0]) @ fore @ turn(0, q[3]) @ turn(1, q[4]) @ turn(0, q[5])
    wrist = turn(2, q[0]) @ (np.array([A1, 0, H]) + upper @ [0, 0, A2] + fore @ [D4, 0, 0])
    return pf.pose(wrist + hand @ [D6, 0, 0], rotation=hand)


def joint_angles(target: np.ndarray) -> list[list[float]]:
    """The angles that have its tool on a target: shoulder before or behind, elbow up or down, wrist flipped or not."""
    R, solutions = target[:3, :3], []
    w = target[:3, 3] - R @ [D6, 0, 0]
    for q1 in (np.arctan2(w[1], w[0]), np.arctan2(-w[1], -w[0])):
        r, s = np.cos(q1) * w[0] + np.sin(q1) * w[1] - A1, w[2] - H
        sine = (A2**2 + D4**2 - r**2 - s**2) / (2 * A2 * D4)
        for q3 in (np.arcsin(sine), np.pi - np.arcsin(sine)) if abs(sine) < 1 else ():
            a, b = A2 - D4 * np.sin(q3), D4 * np.cos(q3)
            q2 = np.arctan2(a * r - b * s, a * s + b * r)
            M = (turn(2, q1) @ turn(1, q2 + q3)).T @ R
            for sign in (1, -1):
                q4 = np.arctan2(sign * M[1, 0], -sign * M[2, 0])
                q6 = np.arctan2(sign * M[0, 1], sign * M[0, 2])
                solutions.append([q1, q2, q3, q4, sign * np.arccos(M[0, 0]), q6])
    return solutions
