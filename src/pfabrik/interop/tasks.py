"""What targets of a robot set, where its file does not say."""

from __future__ import annotations

from ..description.mechanism import Mechanism
from ..motion.fitting_task import AXES, FittingTask, fitting_tasks, has_dependent_coordinates, task_remark
from ..motion.mobility import generic_of
from .opened import Note

MOST_TASKS, WELL_CONDITIONED = 4, 0.1
"""Most other tasks that are told of, and the least conditioning of such ones [L and rad]."""


def with_task(mechanism: Mechanism, is_asked_for: bool, told: list[Note]) -> Mechanism:
    """With a task that the end effector can do, where nobody has asked for one and it cannot set all of a pose."""
    if is_asked_for:
        if has_dependent_coordinates(mechanism):
            told.append(Note(task_remark(mechanism)))
        return mechanism
    freedoms = generic_of(mechanism).mobility.platform
    whole = 3 if mechanism.end_effector_is_joint else 6
    if mechanism.task != mechanism.whole_task or freedoms >= whole:
        return mechanism
    tasks = fitting_tasks(mechanism)
    if not tasks:
        told.append(Note(f"the end effector has no freedoms of {whole}: hardly any target can be reached"))
        return mechanism
    fits, *others = tasks
    has = f"the end effector has {freedoms} freedom{'s' * (freedoms != 1)} of {whole}"
    told.append(Note(f"{has}: targets set {' '.join(fits.words)}, as with `--task {fits}`"))
    able = [task for task in others if _is_choice(task, fits)]
    if able:
        told.append(Note("other tasks that it can do", tuple(f"--task {task}" for task in able[:MOST_TASKS])))
    return mechanism._with(task=fits.words)


def _is_choice(task: FittingTask, fits: FittingTask) -> bool:
    """Whether another task sets as much as the one that fits, or all of the position alone."""
    position = task.words == AXES and set(AXES) < set(fits.words)
    return not task.n_constant and task.conditioning >= WELL_CONDITIONED and (task.count == fits.count or position)
