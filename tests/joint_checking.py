"""Whether joint coordinates make a configuration of their mechanism, from the description alone: no solver's code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pfabrik import Joint, Mechanism, Solution

Array = NDArray[np.float64]


def deviations(mechanism: Mechanism, solution: Solution) -> dict[str, Array]:
    """Joint name -> its coordinates less home's, (n, freedoms)."""
    n = int(np.prod(solution.shape))
    return {
        name: np.reshape(value, (n, -1)) - np.ravel(mechanism.home_coordinate(name))
        for name, value in solution.joints.items()
    }


def motion(mechanism: Mechanism, joint: Joint, moved: Array) -> Array:
    """Motions (n, 4, 4) of a joint's second body relative to its first since home, in home coordinates."""
    T = np.tile(np.eye(4), (len(moved), 1, 1))
    if joint.type == "prismatic":
        T[:, :3, 3] = moved * np.array(mechanism.home_axis(joint.name))
    if joint.type in ("prismatic", "fixed"):
        return T
    if joint.type == "spherical":
        turn = Rotation.from_rotvec(moved)
    elif joint.type == "universal":
        first, second = np.array(joint.axes)
        turn = Rotation.from_rotvec(moved[:, :1] * first) * Rotation.from_rotvec(moved[:, 1:] * second)
    else:
        turn = Rotation.from_rotvec(moved[:, :1] * np.array(joint.axis))
    T[:, :3, :3] = turn.as_matrix()
    T[:, :3, 3] = np.array(joint.at) - T[:, :3, :3] @ np.array(joint.at)
    if joint.type == "cylindrical":
        T[:, :3, 3] += moved[:, 1:] * np.array(joint.axis)
    return T


def placed_bodies(mechanism: Mechanism, moved: dict[str, Array]) -> tuple[dict[str, Array], Array]:
    """Body -> displacements (n, 4, 4); the largest disagreement of any joint's two bodies, (n,), lengths in L."""
    n = len(next(iter(moved.values())))
    placed, open_by = {mechanism.base: np.tile(np.eye(4), (n, 1, 1))}, np.zeros(n)
    waiting = list(mechanism.joints)
    while waiting:
        joint = next(each for each in waiting if set(each.connects) & placed.keys())
        waiting.remove(joint)
        first, second = joint.connects
        T = motion(mechanism, joint, moved.get(joint.name, np.zeros((n, 0))))
        if first not in placed:
            placed[first] = placed[second] @ np.linalg.inv(T)
        elif second not in placed:
            placed[second] = placed[first] @ T
        else:
            put = placed[first] @ T
            at = np.append(mechanism.reference_point if joint.at is None else joint.at, 1.0)
            apart = np.linalg.norm((put - placed[second]) @ at, axis=1) / mechanism.characteristic_length
            turned = np.linalg.norm((put - placed[second])[:, :3, :3], axis=(1, 2)) / np.sqrt(2.0)
            open_by = np.maximum(open_by, np.maximum(apart, turned))
    return placed, open_by


def worst_opening(mechanism: Mechanism, solution: Solution) -> Array:
    """How far an answer's `joints` are from closed loops, its pose, and its actuators, (n,) [L or rad]."""
    moved = deviations(mechanism, solution)
    placed, worst = placed_bodies(mechanism, moved)
    length, pose = mechanism.characteristic_length, solution.pose.reshape(-1, 4, 4)
    if mechanism.end_effector_is_joint:
        body = placed[mechanism.joint(mechanism.end_effector).connects[0]]
    else:
        body = placed[mechanism.end_effector]
        worst = np.maximum(worst, np.linalg.norm((body - pose)[:, :3, :3], axis=(1, 2)) / np.sqrt(2.0))
    point = (body @ np.append(mechanism.reference_point, 1.0))[:, :3]
    worst = np.maximum(worst, np.linalg.norm(point - pose[:, :3, 3], axis=1) / length)
    values = solution.actuators.reshape(len(pose), -1)
    for column, name in enumerate(mechanism.actuator_names):
        unit = length if mechanism.joint(name).type == "prismatic" else 1.0
        worst = np.maximum(worst, np.abs(np.ravel(solution.joints[name]) - values[:, column]) / unit)
    return np.asarray(worst)


def worst_excess(mechanism: Mechanism, solution: Solution) -> Array:
    """Largest excess of an answer's `joints` over any range or cone, (n,) [L or rad]."""
    moved = deviations(mechanism, solution)
    placed, worst = placed_bodies(mechanism, moved)
    for joint in mechanism.joints:
        if joint.range is not None:
            values = moved[joint.name] + np.ravel(mechanism.home_coordinate(joint.name))
            low, high = np.reshape(joint.range, (-1, 2)).T
            slides = {"prismatic": [True], "cylindrical": [False, True]}.get(joint.type, [False] * len(low))
            unit = np.where(slides, mechanism.characteristic_length, 1.0)
            worst = np.maximum(worst, (np.maximum(low - values, values - high) / unit).max(axis=1))
        if joint.cone is not None:
            worst = np.maximum(worst, _cone_angle(mechanism, joint, placed) - joint.cone.half_angle)
    return np.asarray(worst)


def _cone_angle(mechanism: Mechanism, joint: Joint, placed: dict[str, Array]) -> Array:
    fixed = joint.cone.fixed_to
    body = joint.connects[0] if joint.connects[1] == fixed else joint.connects[1]
    came_by, end_body = joint, body
    while True:
        after = next(j for j in mechanism.joints if end_body in j.connects and j is not came_by)
        if after.at is not None and after.type not in ("prismatic", "fixed"):
            break
        came_by, end_body = after, after.connects[after.connects[0] == end_body]
    line = (placed[end_body] @ np.append(after.at, 1.0) - placed[body] @ np.append(joint.at, 1.0))[:, :3]
    axis = placed[fixed][:, :3, :3] @ np.array(joint.cone.axis)
    return np.arctan2(np.linalg.norm(np.cross(axis, line), axis=1), (axis * line).sum(axis=1))
