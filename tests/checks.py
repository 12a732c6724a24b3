"""Whether an answer is a configuration of its mechanism, from the description alone: no code of the solver is used."""

from __future__ import annotations

import dataclasses
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import pfabrik as pf
from pfabrik import Joint, Mechanism, Solution, Status
from pfabrik.kernels._shipped import IS_INTERPRETED
from pfabrik.machine.description.home_mobility import universal_axes

Array = NDArray[np.float64]
INTERPRETED = IS_INTERPRETED
"""Kernels run as plain Python, a hundred times slower."""


def home_values(mechanism: Mechanism) -> Array:
    """Actuator values at home, (n_a,)."""
    return np.array([drive.home for drive in mechanism.drives])


def actuator_units(mechanism: Mechanism) -> Array:
    """L of every actuator that is a length, 1 of an angle, (n_a,)."""
    return np.array([1.0 if drive.kind == "angle" else mechanism.characteristic_length for drive in mechanism.drives])


def pose_errors(mechanism: Mechanism, poses: Array, targets: Array) -> Array:
    """How far poses are from targets, (n,) [L or rad]; of a joint end effector only the position counts."""
    apart = np.linalg.norm((poses - targets)[..., :3, 3], axis=-1) / mechanism.characteristic_length
    turned = np.linalg.norm((poses - targets)[..., :3, :3], axis=(-2, -1)) / np.sqrt(2.0)
    return np.maximum(apart, 0.0 if mechanism.end_effector_is_joint else turned)


def assert_feasible(mechanism: Mechanism, answer: Solution) -> None:
    """What REACHED and PROJECTED promise, measured without the library: finite, assembled, within all limits."""
    for name in ("pose", "actuators", "position_error", "rotation_error", "actuator_error", "residual", "limit_excess"):
        assert np.isfinite(getattr(answer, name)).all(), name
    assert np.max(answer.status) <= Status.PROJECTED
    assert np.max(answer.residual) <= 1e-9 * mechanism.characteristic_length
    assert np.max(pf.closure_residual(answer)) <= 1e-9 * mechanism.characteristic_length
    assert np.max(answer.limit_excess) <= 1e-9
    assert np.max(gap_of_joints(mechanism, answer)) <= 2e-9
    assert np.max(excess_of_joints(mechanism, answer) - turned_by_rounding(mechanism, answer)) <= 1.0001e-9


def turned_by_rounding(mechanism: Mechanism, solution: Solution) -> Array:
    """By how much rounding of its ends turns a strut that is drawn in to almost nothing, (n,) [rad]."""
    shortest = np.full(int(np.prod(solution.shape)), np.inf)
    for slide in (joint for joint in mechanism.joints if joint.type == "prismatic"):
        one, other = ([j for j in mechanism.joints if body in j.connects and j is not slide] for body in slide.connects)
        for start, end in product(one, other):
            if {start.name, end.name} <= solution.points.keys() and start.at != end.at:
                line = np.reshape(solution.points[end.name] - solution.points[start.name], (-1, 3))
                shortest = np.minimum(shortest, np.linalg.norm(line, axis=1))
    return np.asarray(np.finfo(float).eps * mechanism.characteristic_length / np.maximum(shortest, 1e-300))


def task_offsets(mechanism: Mechanism, poses: Array, targets: Array) -> tuple[Array, Array]:
    """Offsets [L] and turns [rad] of poses (n, 4, 4) from targets in what the task sets, (n, k) each."""
    axes = ["xyz".index(name) for name in mechanism.task if name in "xyz"]
    offset, turn = (poses - targets)[:, :3, 3][:, axes] / mechanism.characteristic_length, np.zeros((len(poses), 1))
    here, there = poses[:, :3, :3], np.broadcast_to(targets, poses.shape)[:, :3, :3]
    if "rotation" in mechanism.task and not mechanism.end_effector_is_joint:
        turn = Rotation.from_matrix(here @ np.swapaxes(there, 1, 2)).as_rotvec()
    elif "tilt" in mechanism.task:
        across = np.cross(here[:, :, 2], there[:, :, 2])
        sine, cosine = np.linalg.norm(across, axis=1), (here[:, :, 2] * there[:, :, 2]).sum(axis=1)
        turn = across * (np.arctan2(sine, cosine) / np.maximum(sine, 1e-300))[:, None]
    elif "yaw" in mechanism.task:  # the twist about z that is left when the z axis is turned back the shortest way
        quaternions = (Rotation.from_matrix(each).as_quat() for each in (here, there))
        yaw, other = (2.0 * np.arctan2(each[:, 2], each[:, 3]) for each in quaternions)
        turn = np.remainder(yaw - other + np.pi, 2.0 * np.pi)[:, None] - np.pi
    return offset, turn


def task_errors(mechanism: Mechanism, poses: Array, targets: Array) -> Array:
    """How far poses are from targets in what the task sets, (n,) [L and rad]."""
    offset, turn = task_offsets(mechanism, poses, targets)
    return np.hypot(np.hypot.reduce(offset, axis=1), np.linalg.norm(turn, axis=1))


def assert_honest(mechanism: Mechanism, targets: np.ndarray, answer: Solution) -> None:
    """Feasible, and REACHED where and only where the pose is the target in what the task sets."""
    assert_feasible(mechanism, answer)
    reached, error = answer.status == Status.REACHED, task_errors(mechanism, answer.pose, targets)
    assert np.all(error[reached] <= 1.5e-9)
    assert np.all(error[~reached] > 1e-10)


@lru_cache(maxsize=64)
def with_axes(mechanism: Mechanism) -> Mechanism:
    """The same machine, with the axes of its universal joints written out where the library chooses them."""
    if all(joint.axes is not None for joint in mechanism.joints if joint.type == "universal"):
        return mechanism
    joints = [
        dataclasses.replace(joint, axes=universal_axes(mechanism, joint)) if joint.type == "universal" else joint
        for joint in mechanism.joints
    ]
    return dataclasses.replace(mechanism, joints=tuple(joints))


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


def placed_bodies(mechanism: Mechanism, moved: dict[str, Array]) -> tuple[dict[str, Array], list[Array]]:
    """Body -> displacements (n, 4, 4); and by how much every loop is open, (n, 12) [L, entries of matrices].

    Bodies are placed one after the other through joints, from the base; the joints left over must agree.
    """
    n = len(next(iter(moved.values())))
    placed, open_by, waiting = {mechanism.base: np.tile(np.eye(4), (n, 1, 1))}, [], list(mechanism.joints)
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
            at = np.append(mechanism.reference_point if joint.at is None else joint.at, 1.0)
            apart = placed[first] @ T - placed[second]
            shifts = (apart @ at)[:, :3] / mechanism.characteristic_length
            open_by.append(np.concatenate([shifts, apart[:, :3, :3].reshape(n, 9)], axis=1))
    return placed, open_by


@lru_cache(maxsize=1)  # a gap and an excess are measured one after the other
def placed_by(mechanism: Mechanism, solution: Solution) -> tuple[dict[str, Array], list[Array]]:
    """The bodies as an answer's `joints` place them, and by how much every loop is open."""
    return placed_bodies(mechanism, deviations(mechanism, solution))


def gap_of_joints(mechanism: Mechanism, solution: Solution) -> Array:
    """How far an answer's `joints` are from closed loops, its pose, points and actuators, (n,) [L or rad]."""
    mechanism = with_axes(mechanism)
    placed, open_by = placed_by(mechanism, solution)
    length, pose = mechanism.characteristic_length, solution.pose.reshape(-1, 4, 4)
    worst = np.zeros(len(pose))
    for each in open_by:
        turned = np.linalg.norm(each[:, 3:], axis=1) / np.sqrt(2.0)
        worst = np.max([worst, np.linalg.norm(each[:, :3], axis=1), turned], axis=0)
    if mechanism.end_effector_is_joint:
        body = placed[mechanism.joint(mechanism.end_effector).connects[0]]
    else:
        body = placed[mechanism.end_effector]
        worst = np.maximum(worst, np.linalg.norm((body - pose)[:, :3, :3], axis=(1, 2)) / np.sqrt(2.0))
    point = (body @ np.append(mechanism.reference_point, 1.0))[:, :3]
    worst = np.maximum(worst, np.linalg.norm(point - pose[:, :3, 3], axis=1) / length)
    for name, centre in solution.points.items():
        joint = mechanism.joint(name)
        apart = [(placed[body] @ np.append(joint.at, 1.0))[:, :3] - centre.reshape(-1, 3) for body in joint.connects]
        worst = np.maximum(worst, np.linalg.norm(apart, axis=2).min(axis=0) / length)
    values = solution.actuators.reshape(len(pose), -1)
    for column, name in enumerate(mechanism.actuator_names):
        unit = length if mechanism.joint(name).type == "prismatic" else 1.0
        worst = np.maximum(worst, np.abs(np.ravel(solution.joints[name]) - values[:, column]) / unit)
    return np.asarray(worst)


def excess_of_joints(mechanism: Mechanism, solution: Solution) -> Array:
    """Largest excess of an answer's `joints` over any range or cone, (n,) [L or rad]."""
    mechanism = with_axes(mechanism)
    moved, (placed, _) = deviations(mechanism, solution), placed_by(mechanism, solution)
    worst = np.zeros(len(placed[mechanism.base]))
    for joint in mechanism.joints:
        if joint.range is not None:
            values = moved[joint.name] + np.ravel(mechanism.home_coordinate(joint.name))
            low, high = np.reshape(joint.range, (-1, 2)).T
            slides = {"prismatic": [True], "cylindrical": [False, True]}.get(joint.type, [False] * len(low))
            unit = np.where(slides, mechanism.characteristic_length, 1.0)
            worst = np.maximum(worst, (np.maximum(low - values, values - high) / unit).max(axis=1))
        if joint.cone is not None:
            worst = np.maximum(worst, cone_angle(mechanism, joint, placed) - joint.cone.half_angle)
    return np.asarray(worst)


def cone_angle(mechanism: Mechanism, joint: Joint, placed: dict[str, Array]) -> Array:
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
