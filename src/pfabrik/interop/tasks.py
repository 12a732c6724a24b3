"""The task of a robot whose file does not say what targets set."""

from __future__ import annotations

from ..description.mechanism import Mechanism
from ..kinematics import generic_of
from ..motion.fitting_task import AXES, FittingTask, fitting_tasks, has_dependent_coordinates, task_remark
from .notes import Note, note_names

MOST_TASKS, WELL_CONDITIONED = 4, 0.1
"""Most other tasks in the note, and the least conditioning of those [L and rad]."""


def with_task(mechanism: Mechanism, is_asked_for: bool, notes: list[Note]) -> Mechanism:
    """With a task that the end effector can do, where nobody has asked for one and it cannot set all of a pose."""
    if is_asked_for:
        if has_dependent_coordinates(mechanism):
            notes.append(Note(task_remark(mechanism)))
        return mechanism
    freedoms = generic_of(mechanism).mobility.platform
    whole = 3 if mechanism.end_effector_is_joint else 6
    if mechanism.task != mechanism.whole_task or freedoms >= whole:
        return mechanism
    tasks = fitting_tasks(mechanism)
    if not tasks:
        notes.append(Note(f"the end effector has no freedoms of {whole}: hardly any target can be reached"))
        return mechanism
    fits, *alternatives = tasks
    has = f"the end effector has {freedoms} freedom{'s' * (freedoms != 1)} of {whole}"
    notes.append(Note(f"{has}: targets set {' '.join(fits.words)}, as with `--task {fits}`"))
    choices = [f"--task {task}" for task in alternatives if _is_choice(task, fits)]
    note_names(notes, "other tasks that it can do", choices[:MOST_TASKS])
    return mechanism._with(task=fits.words)


def _is_choice(task: FittingTask, fits: FittingTask) -> bool:
    """True if another task sets as much as the one that fits, or all of the position alone."""
    position = task.words == AXES and set(AXES) < set(fits.words)
    return not task.n_constant and task.conditioning >= WELL_CONDITIONED and (task.count == fits.count or position)
