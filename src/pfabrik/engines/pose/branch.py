"""The branches of an answer's legs: folds that belong to two, answers that keep their start's, and other modes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain, combinations, islice

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...common.derived import derived
from ...common.rotations import nearest_turn
from ...kernels.pose.pose_constants import MOST_CHANGED
from ...kernels.pose.tables import EXACTLY, IN_OTHER_ASSEMBLIES, IN_OTHER_MODES
from ...kernels.rows import HOLD, HOLD_NOTHING, OPEN, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR, TOO_NEAR
from ...machine.description.task import Task
from ...machine.model import Model
from ...machine.motion.mobility import around_home
from ...machine.poses import between
from ...tolerances import TOLERANCES
from ..joints.close import measure_configurations
from ..joints.configurations import Configurations, new_rows, write_closing
from ..joints.effort import continued
from .answers import LegAnswers, columns_of_sides, sides_at
from .coordinates import NO_ROWS, read_coordinates
from .single import Answers, Request, answer_phases
from .table import reading_scratch, reading_table
from .tables import has_seeds


def subsets(legs: list[int]) -> Iterator[list[int]]:
    """Iterate over the non-empty subsets of some legs, the smallest first, at most `MOST_CHANGED`."""
    all_subsets = chain.from_iterable(combinations(legs, n) for n in range(1, len(legs) + 1))
    return (list(subset) for subset in islice(all_subsets, MOST_CHANGED))


def starts_beside(model: Model, start: Configurations | None) -> list[tuple[Mask, LegAnswers]]:
    """The start, or home, in the other working modes that meet there, each with a mask of the rows on that fold."""
    return _beside(home_answer(model) if start is None else start, model)


@derived
def _beside(start: Configurations, model: Model) -> list[tuple[Mask, LegAnswers]]:
    """Compute `starts_beside`; cached with the start, which may serve many targets."""
    branch, starts = sides_at(model, start), []
    folded = _folded(model, start.rows.poses, branch)
    for changed in subsets(np.flatnonzero(folded.any(axis=0)).tolist()):
        other_branch = branch.copy()
        other_branch[:, changed] *= -1.0
        is_folded = np.asarray(folded[:, changed].all(axis=1))
        starts.append((is_folded, LegAnswers(start.rows, start.coordinates, other_branch)))
    return starts


@derived
def home_answer(model: Model) -> LegAnswers:
    """Home as an answer."""
    rows, coordinates = new_rows(model, 1), np.zeros((1, len(model.mechanism.coordinates)))
    rows.poses[:], rows.actuators[:] = model.mechanism.home_pose, model.path_closure.actuators(coordinates)
    return LegAnswers(rows, coordinates, model.legs.home_sides)


def _folded(model: Model, poses: Floats, branch: Floats) -> Mask:
    """True for legs whose two solutions coincide at poses (n, 4, 4) [length], (n, legs)."""
    table, folded = model.legs, np.zeros(branch.shape, bool)
    two_sided, columns, groups = columns_of_sides(model)
    for group in groups:
        q = np.zeros((2, len(branch), len(model.path_closure.scale)))
        for factor, values in zip((1.0, -1.0), q, strict=True):
            candidate = branch.copy()
            candidate[:, two_sided[group]] *= factor
            read_coordinates(table, poses, candidate, values)
        apart = np.subtract(*q)[:, columns]
        apart = np.where(model.path_closure.turning[columns] > 0.0, nearest_turn(apart), apart)
        folded[:, two_sided[group]] = (np.abs(apart) <= TOLERANCES.same_mode)[:, group]
    return folded


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


def poses_decide(model: Model) -> bool:
    """True if what the task leaves open of a pose follows from the legs, which have no implicit joints besides.

    Then a target and the sides of the legs are one configuration: there is nothing to search for.
    """
    table = model.legs
    return not table.has_implicit_joints and (not table.is_partial or len(_independent_rows(model)) > 0)


def _slopes_of_open(model: Model, poses: Floats, sides: Floats) -> Floats:
    """Derivatives C of all constraints by the open unknowns, (n, rows, k) [L, rad]; NaN at dead points."""
    from ...kernels.pose.evaluate import evaluate_poses

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


Answer = Callable[[Floats, Configurations], Configurations]
"""Solver for one target (1, 4, 4) around a start, in its working mode."""


def kept(
    model: Model, answers: Configurations, targets: Floats, start: Configurations, answer: Answer
) -> Configurations:
    """Replace answers in another working mode than their start by the result of continuation from the start."""
    branch = sides_at(model, start)
    has_left = (answers.rows.status <= PROJECTED) & ~_is_in_mode(model, answers, branch)
    for row in np.flatnonzero(has_left):
        place = np.array([row])
        row_start, row_branch = (start, branch) if len(start) == 1 else (start.at(place), branch[place])
        answers = answers.with_rows(place, _continue_to(model, targets[place], row_start, row_branch, answer))
    return answers


def _is_in_mode(model: Model, answers: Configurations, branch: Floats) -> Mask:
    """True where no leg with two solutions is on another branch than in `branch`, (n,)."""
    return same_branch(sides_at(model, answers), branch * (model.legs.home_sides != 0.0))


def _continue_to(model: Model, target: Floats, start: Configurations, branch: Floats, answer: Answer) -> Configurations:
    """Answer one target by continuation from the start; PROJECTED if the last feasible step ends before it."""
    start_pose, last = start.rows.poses, answer(start.rows.poses, start)

    def advance(_rows: NDArray[np.intp], shares: Floats) -> Mask:
        nonlocal last
        trial = answer(between(start_pose, target, shares), last)
        is_kept = (trial.rows.status == REACHED) & _is_in_mode(model, trial, branch)
        last = trial if is_kept[0] else last
        return np.asarray(is_kept)

    if last.rows.status[0] <= PROJECTED and continued(1, advance)[0] < 1.0:
        measures = last.rows.measures
        measures[:, POSITION_ERROR], measures[:, ROTATION_ERROR] = model.task.errors(last.rows.poses, target)
        last.rows.status[:], last.rows.counters[:, HOLD] = PROJECTED, HOLD_NOTHING
    return last


def answer_unreached(request: Request, targets: Floats, answers: Answers, places: NDArray[np.intp]) -> None:
    """Answer targets (n, 4, 4) at some places in other working modes, or by the nearest feasible poses.

    Rows may stay PENDING or UNSURE. Seeds are not computed if other modes answer all rows.
    """
    first, model = IN_OTHER_MODES, request.model
    if not (request.keep_mode or has_seeds(model)) and model.legs.has_sides:
        answer_phases(request, targets, answers, places, first, first)
        first, places = IN_OTHER_ASSEMBLIES, places[np.isin(answers.rows.status[places], (OPEN, TOO_NEAR))]
    if len(places):
        answer_phases(request, targets, answers, places, first, EXACTLY)
