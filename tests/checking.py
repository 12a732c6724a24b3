"""Whether an answer is a configuration of its mechanism, from the description alone: no code of the solver is used."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from pfabrik import Joint, Mechanism, Solution


def worst_gap(mechanism: Mechanism, solution: Solution) -> np.ndarray:
    """Largest change of any distance that a rigid body fixes, (n,), over the characteristic length.

    Joint centres of one body keep their distances; centres on the base stay, those on the end effector move with it;
    a link hinged to the base keeps its offset along the hinge's axis.
    """
    points = {name: np.reshape(point, (-1, 3)) for name, point in solution.points.items()}
    pose = solution.pose.reshape(-1, 4, 4)
    gaps = [np.zeros(len(pose))]
    for body in mechanism.bodies:
        centred = [j for j in mechanism.joints if body in j.connects and j.name in points]
        for a, b in combinations(centred, 2):
            length = np.linalg.norm(np.subtract(a.at, b.at))
            gaps.append(np.abs(np.linalg.norm(points[a.name] - points[b.name], axis=1) - length))
        for joint in centred:
            if body == mechanism.base:
                gaps.append(np.linalg.norm(points[joint.name] - joint.at, axis=1))
            if body == mechanism.end_effector:
                offset = np.subtract(joint.at, mechanism.reference_point)
                gaps.append(np.linalg.norm(points[joint.name] - (pose[:, :3, :3] @ offset + pose[:, :3, 3]), axis=1))
    gaps += [_hinge_gap(mechanism, joint, points) for joint in mechanism.joints if joint.type == "revolute"]
    if mechanism.end_effector_is_joint:
        gaps.append(np.linalg.norm(points[mechanism.end_effector] - pose[:, :3, 3], axis=1))
    return np.max(gaps, axis=0) / mechanism.characteristic_length


def _hinge_gap(mechanism: Mechanism, hinge: Joint, points: dict[str, np.ndarray]) -> np.ndarray:
    n = len(next(iter(points.values())))
    if mechanism.base not in hinge.connects or hinge.name not in points:
        return np.zeros(n)
    link = hinge.connects[0] if hinge.connects[1] == mechanism.base else hinge.connects[1]
    gap = np.zeros(n)
    for other in mechanism.joints:
        if link in other.connects and other.name in points and other is not hinge:
            along = (points[other.name] - hinge.at) @ np.array(hinge.axis)
            gap = np.maximum(gap, np.abs(along - np.subtract(other.at, hinge.at) @ np.array(hinge.axis)))
    return gap


def worst_excess(mechanism: Mechanism, solution: Solution) -> np.ndarray:
    """Largest excess over a range of an actuator or a cone fixed to base or platform, (n,) [L or rad]."""
    points = {name: np.reshape(point, (-1, 3)) for name, point in solution.points.items()}
    pose = solution.pose.reshape(-1, 4, 4)
    excess = [np.zeros(len(pose))]
    values = solution.actuators.reshape(len(pose), -1)
    for column, name in enumerate(mechanism.actuator_names):
        joint = mechanism.joint(name)
        if joint.range is not None:
            scale = mechanism.characteristic_length if joint.type == "prismatic" else 1.0
            over = np.maximum(joint.range[0] - values[:, column], values[:, column] - joint.range[1])
            excess.append(over / scale)
        if joint.along is not None:
            length = np.linalg.norm(points[joint.along[0]] - points[joint.along[1]], axis=1)
            excess.append(np.abs(length - values[:, column]) / mechanism.characteristic_length)
    for joint in mechanism.joints:
        if joint.cone is not None and joint.cone.fixed_to in (mechanism.base, mechanism.end_effector):
            axis = np.broadcast_to(np.array(joint.cone.axis), (len(pose), 3))
            if joint.cone.fixed_to == mechanism.end_effector:
                axis = pose[:, :3, :3] @ np.array(joint.cone.axis)
            line = _next_centre(mechanism, joint, points) - points[joint.name]
            cosine = np.einsum("ij,ij->i", axis, line) / np.linalg.norm(line, axis=1)
            excess.append(np.arccos(np.clip(cosine, -1, 1)) - joint.cone.half_angle)
    return np.max(excess, axis=0)


def _next_centre(mechanism: Mechanism, joint: Joint, points: dict[str, np.ndarray]) -> np.ndarray:
    """The next joint centre on the body opposite to the cone's, through prismatic joints."""
    body = joint.connects[0] if joint.connects[1] == joint.cone.fixed_to else joint.connects[1]
    came_by = joint
    while True:
        after = next(j for j in mechanism.joints if body in j.connects and j is not came_by)
        if after.name in points:
            return points[after.name]
        body = after.connects[0] if after.connects[1] == body else after.connects[1]
        came_by = after
