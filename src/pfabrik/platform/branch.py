"""The branch of an answer: which of its solutions each leg takes, and each pose that a task leaves open."""

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
    """Signs (n, legs + 1) of configurations at poses (n, 4, 4) [length] on sides (n or 1, legs).

    First the sides of the legs, 0 of a leg with one solution; last the sign of det C, where C are the derivatives of
    the constraints by what the task leaves open, pose coordinates and implicit joints. It changes where two solutions
    of these meet, and is 0 there, where nothing is left open, and where a leg is at a dead point.
    """
    has_sides = np.broadcast_to(model.legs.home_sides != 0.0, (len(poses), sides.shape[1]))
    return np.hstack([np.where(has_sides, np.sign(sides), 0.0), _completions(model, poses, sides)])


def same_branch(signs: Floats, other_signs: Floats) -> Mask:
    """True where signs (n, k) nowhere contradict others, (n,): a configuration on a fold is of both branches."""
    return np.asarray((signs * other_signs >= 0.0).all(axis=1))


def _completions(model: Model, poses: Floats, sides: Floats) -> Floats:
    """The sign of det C at each pose, (n, 1)."""
    chosen = _counting_rows(model)
    if not len(chosen):
        return np.zeros((len(poses), 1))
    C = _open_slopes(model, poses, sides)[:, chosen]
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN at dead points
        determinants = np.linalg.det(C / np.linalg.norm(C, axis=2, keepdims=True))
    return np.where(np.abs(determinants) > TOLERANCES.singular, np.sign(determinants), 0.0)[:, None]


@derived
def _counting_rows(model: Model) -> list[int]:
    """As many constraints as the task leaves unknowns open, independent near home; none if there are not so many.

    The rest follow from these in every configuration, as of several legs that all keep a platform in one plane.
    """
    closing = measure_configurations(model, around_home(model.mechanism))
    near = Configurations(new_rows(model, len(closing.poses)), closing.coordinates)
    write_closing(model.path_closure, closing, near.rows)
    slopes = _open_slopes(model, closing.poses, sides_at(model, near))
    for C in slopes[np.isfinite(slopes).all(axis=(1, 2))]:
        chosen: list[int] = []
        for row in range(len(C)):
            if np.linalg.matrix_rank(C[[*chosen, row]], tol=TOLERANCES.independent**2) > len(chosen):
                chosen.append(row)
        if len(chosen) == C.shape[1]:
            return chosen
    return []


def _open_slopes(model: Model, poses: Floats, sides: Floats) -> Floats:
    """Derivatives C of all constraints by what the task leaves open, (n, rows, k) [L, rad]; NaN at dead points."""
    from ..kernels.platform.evaluate import evaluate_poses

    table, n = model.legs, len(poses)
    rows = np.empty((n, int(table.task["rows"][0])))
    slopes = np.empty((*rows.shape, 6 + int(table.task["redundant"][0])))
    handle, scratch = reading_table(table), reading_scratch(table)
    poses, sides = (np.require(each, requirements=["C", "W"]) for each in (poses, sides))
    with np.errstate(divide="ignore", invalid="ignore"):  # at dead points, if interpreted
        evaluate_poses(handle.address, scratch.address, poses, sides, NO_ROWS, NO_ROWS, rows, slopes)
        return np.concatenate([slopes[:, :, :6] @ _open_motions(model.task, poses), slopes[:, :, 6:]], axis=2)


def _open_motions(task: Task, poses: Floats) -> Floats:
    """Twists (n, 6, k) of the pose coordinates that the task does not set; of a yaw, about axes square to its own."""
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
