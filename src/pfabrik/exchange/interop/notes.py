"""Notes of an import (what it left out, changed or found), and the task where a file says none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from ...errors import PfabrikError
from ...kinematics import generic_of
from ...machine.description.mechanism import Mechanism
from ...machine.motion.fitting_task import AXES, FittingTask, fitting_tasks, has_dependent_coordinates, task_remark


@dataclass(frozen=True)
class Note:
    """Something that an import left out, changed, or found, with the names of what it is about.

    Attributes
    ----------
    what : str
        What was left out, changed, or found.
    names : tuple of str
        Names of what it is about.
    """

    what: str
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.what}: {', '.join(self.names)}" if self.names else self.what


def note_names(notes: list[Note], what: str, names: Iterable[object]) -> None:
    """Add a note of some names, unless there are none."""
    if texts := tuple(map(str, names)):
        notes.append(Note(what, texts))


def counted_names(counts: Counter[str]) -> list[str]:
    """Things that have no names, or too many: ``geom (30)``."""
    return [f"{name} ({count})" for name, count in sorted(counts.items())]


@contextmanager
def noting(notes: Sequence[Note]) -> Iterator[None]:
    """Have an error carry the notes made before it, as `__notes__`."""
    try:
        yield
    except PfabrikError as error:
        carried = getattr(error, "__notes__", [])
        for note in notes:
            if f"note: {note}" not in carried:
                error.add_note(f"note: {note}")
        raise


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
