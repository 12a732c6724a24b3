"""Branches of answers: the inverse-kinematics branch of each leg, and the branch of a completed pose."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Mask
from ..closure.close import measure_configurations
from ..closure.configurations import Configurations, new_rows, write_closing
from ..derived import derived
from ..description.task import Task
from ..model import Model
from ..motion.walks import around_home
from ..tolerances import TOLERANCES
from .answers import sides_at
from .coordinates import NO_ROWS
from .table import reading_scratch, reading_table


def branch_of(model: Model, poses: Floats, sides: Floats) -> Floats:
    """Branch signs (n, legs + 1) of configurations at poses (n, 4, 4) [length].

    First come the legs' branches, 0 for legs with one solution. The last is the sign of det C. C holds the derivatives
    of the constraints by the unknowns that the task leaves open: pose coordinates and implicit joints. The sign changes
    where two solutions for these coincide. It is 0 there, at dead points of legs, and if the task leaves nothing open.

    Parameters
    ----------
    sides : branches of legs and coordinates of redundant joints, (n or 1, legs); see `LegAnswers`.
    """
    has_sides = np.broadcast_to(model.legs.home_sides != 0.0, (len(poses), sides.shape[1]))
    return np.hstack([np.where(has_sides, np.sign(sides), 0.0), _completion_signs(model, poses, sides)])


def same_branch(signs: Floats, other_signs: Floats) -> Mask:
    """True where branch signs (n, k) do not contradict others, (n,): a configuration on a fold is on both branches."""
    return np.asarray((signs * other_signs >= 0.0).all(axis=1))


def _completion_signs(model: Model, poses: Floats, sides: Floats) -> Floats:
    """Sign of det C at poses, (n, 1); see `branch_of`."""
    independent = _independent_rows(model)
    if not len(independent):
        return np.zeros((len(poses), 1))
    C = _slopes_of_open(model, poses, sides)[:, independent]
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN at dead points
        determinants = np.linalg.det(C / np.linalg.norm(C, axis=2, keepdims=True))
    return np.where(np.abs(determinants) > TOLERANCES.singular, np.sign(determinants), 0.0)[:, None]


@derived
def _independent_rows(model: Model) -> list[int]:
    """Rows of C, independent near home, as many as there are open unknowns; empty if there are fewer.

    The other rows depend on these in every configuration, for instance if several legs keep a platform in one plane.
    """
    closing = measure_configurations(model, around_home(model.mechanism))
    near = Configurations(new_rows(model, len(closing.poses)), closing.coordinates)
    write_closing(model.path_closure, closing, near.rows)
    slopes = _slopes_of_open(model, closing.poses, sides_at(model, near))
    for C in slopes[np.isfinite(slopes).all(axis=(1, 2))]:
        independent: list[int] = []
        for row in range(len(C)):
            if np.linalg.matrix_rank(C[[*independent, row]], tol=TOLERANCES.independent**2) > len(independent):
                independent.append(row)
        if len(independent) == C.shape[1]:
            return independent
    return []


def _slopes_of_open(model: Model, poses: Floats, sides: Floats) -> Floats:
    """Derivatives C of all constraints by the open unknowns, (n, rows, k) [L, rad]; NaN at dead points."""
    from ..kernels.platform.evaluate import evaluate_poses

    table, n = model.legs, len(poses)
    rows = np.empty((n, int(table.task["rows"][0])))
    slopes = np.empty((*rows.shape, 6 + int(table.task["redundant"][0])))
    handle, scratch = reading_table(table), reading_scratch(table)
    poses, sides = (np.require(array, requirements=["C", "W"]) for array in (poses, sides))
    with np.errstate(divide="ignore", invalid="ignore"):  # at dead points, if interpreted
        evaluate_poses(handle.address, scratch.address, poses, sides, NO_ROWS, NO_ROWS, rows, slopes)
        return np.concatenate([slopes[:, :, :6] @ _open_twists(model.task, poses), slopes[:, :, 6:]], axis=2)


def _open_twists(task: Task, poses: Floats) -> Floats:
    """Twists (n, 6, k) of the pose coordinates that the task leaves open; if it sets a yaw, about axes normal to it."""
    shifts = np.eye(6)[:, :3][:, ~np.array(task.axes)] + np.zeros((len(poses), 1, 1))
    turns = np.zeros((len(poses), 6, 3 - task.rotations))
    if task.rotations == 0:
        turns[:, 3:] = np.eye(3)
    elif task.rotations == 2:
        turns[:, 3:, 0] = poses[:, :3, 2]
    elif task.rotations == 1:
        axes = poses[:, :3, 2] + [0.0, 0.0, 1.0]
        turns[:, 3:, 0] = np.cross(axes, [1.0, 0.0, 0.0])
        turns[:, 3:, 1] = np.cross(axes, turns[:, 3:, 0])
    return np.concatenate([shifts, turns], axis=2)
