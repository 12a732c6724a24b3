"""Tasks that fit a mechanism: sets of pose coordinates that vary independently, and its axis of tilt if it has one."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Floats, Mask
from ...common.derived import derived
from ...common.rotations import shortest_turns
from ...errors import counted
from ...tolerances import TOLERANCES
from ..description.joints import TASK_TURNS
from ..description.mechanism import MOST_JOINTS_FOR_FREEDOM, Mechanism
from ..description.task import task_of
from .displacements import home_coordinates
from .loops import first_order, right_singular
from .mobility import around_home, generic_of


@derived
def tilt_axis(mechanism: Mechanism) -> Floats | None:
    """The axis of the end effector's only rotation, a unit vector (3,) whose largest component is positive.

    None if the task sets no tilt, if the end effector has other rotations too, or if this one leaves the tilt as it is.
    """
    if task_of(mechanism).rotations != 2 or len(mechanism.joints) > MOST_JOINTS_FOR_FREEDOM:
        return None
    turns = motions_at(mechanism, home_coordinates(mechanism)[None])[3:]
    if np.linalg.matrix_rank(turns, TOLERANCES.alignment) > 1:  # quickly seen, of most
        return None
    left, sizes, _ = np.linalg.svd(generic_of(mechanism).directions[3:], full_matrices=False)
    axis = left[:, 0] * np.sign(left[np.abs(left[:, 0]).argmax(), 0]) + 0.0
    is_only = np.count_nonzero(sizes > TOLERANCES.alignment) == 1
    across = np.linalg.norm(np.cross(axis, mechanism.home_pose[:3, 2]))
    return axis if is_only and across > TOLERANCES.independent else None


def along_tilt(mechanism: Mechanism, targets: Floats) -> Floats:
    """Targets (n, 4, 4) turned so that their z axis is one that the mechanism's only rotation leads to.

    With the axis n of this rotation it is the one whose part across n has the same direction: the angle about n is all
    that counts. Targets whose z axis is along n, and rows that are no poses, stay as they are.
    """
    axis = tilt_axis(mechanism)
    if axis is None:
        return targets
    home = mechanism.home_pose[:3, 2]
    along = (home @ axis) * axis
    with np.errstate(invalid="ignore", over="ignore"):
        across = targets[:, :3, 2] - (targets[:, :3, 2] @ axis)[:, None] * axis
        lengths = np.linalg.norm(across, axis=1)
        rows = np.flatnonzero((lengths > TOLERANCES.alignment) & (lengths < 2.0))
    wanted = along + np.linalg.norm(home - along) * across[rows] / lengths[rows, None]
    turned = targets.copy()
    turned[rows, :3, :3] = shortest_turns(targets[rows, :3, 2], wanted) @ targets[rows, :3, :3]
    return turned


AXES = ("x", "y", "z")
TURNS: dict[str, tuple[bool, bool, bool]] = {
    "tilt": (True, True, False),
    "yaw": (False, False, True),
    "rotation": (True, True, True),
}
"""Rotation words of a task, in the order of preference -> the rotations they set, about x, y and z."""

POSITION, ALIKE = 0.25, 0.9
"""Share of the best conditioning from which a task with the whole position is preferred, as users need it first; and
from which other tasks count as equally good."""


@dataclass(frozen=True)
class FittingTask:
    """A task, and the conditioning of its coordinates.

    Attributes
    ----------
    count : number of coordinates that vary.
    conditioning : smallest singular value of the end effector's motions, orthonormal twists, in these coordinates
        [L and rad], the median of configurations around home: 1 if they are all that it can vary, 0 if they depend on
        each other.
    n_constant : number of coordinates that never vary, such as the tilt out of a plane.
    """

    words: tuple[str, ...]
    count: int
    conditioning: float
    n_constant: int

    @property
    def kind(self) -> tuple[int, int]:
        """The key of tasks whose conditioning is compared."""
        return self.count, self.n_constant

    def __str__(self) -> str:
        return ",".join(self.words)


@derived
def fitting_tasks(mechanism: Mechanism) -> tuple[FittingTask, ...]:
    """Tasks with independent coordinates, the best first; empty if nothing moves.

    They are ordered by the number of freedoms that they set, the most first; then by the number of constant
    coordinates, the fewest first; then tasks with the whole position come before others, then the best conditioned. Of
    equally good ones, those with most of the position come first, and tilt before yaw.
    """
    bases, n_rows = _motions(mechanism)
    tasks = [_evaluate_task(words, bases, n_rows) for words in _candidates(mechanism)]
    independent = [task for task in tasks if task is not None and task.conditioning >= TOLERANCES.independent]
    best: dict[tuple[int, int], float] = {}
    for task in independent:
        best[task.kind] = max(task.conditioning, best.get(task.kind, 0.0))

    def rank(task: FittingTask) -> tuple[float, ...]:
        share = task.conditioning / best[task.kind]
        positions = sum(word in AXES for word in task.words)
        goodness = 0.0 if positions == 3 and share >= POSITION else 1.0 if share >= ALIKE else 2.0 - share
        order = [*AXES, *TURNS]
        return -task.count, task.n_constant, goodness, -positions, *(order.index(word) for word in task.words)

    return tuple(sorted(independent, key=rank))


def has_dependent_coordinates(mechanism: Mechanism) -> bool:
    """True if coordinates of the task depend on each other, so that hardly any target can be reached.

    Coordinates that never vary, such as a position out of the plane of a planar machine, do not count. False for
    machines with so many joints that counting freedoms takes long.
    """
    if len(mechanism.joints) > MOST_JOINTS_FOR_FREEDOM:
        return False
    generic = generic_of(mechanism)
    counts = _counted(mechanism.task)[: len(generic.directions)]
    n_varying = int(np.linalg.matrix_rank(generic.directions[counts], TOLERANCES.alignment))
    return int(counts.sum()) > generic.mobility.platform < n_varying


def has_weak_coordinates(mechanism: Mechanism) -> bool:
    """True if coordinates of the task vary independently by parasitic motions at most; they may be dependent too."""
    if len(mechanism.joints) > MOST_JOINTS_FOR_FREEDOM:
        return False
    task = _evaluate_task(mechanism.task, *_motions(mechanism))
    return has_dependent_coordinates(mechanism) or (task is not None and task.conditioning < TOLERANCES.independent)


def task_remark(mechanism: Mechanism) -> str:
    """A sentence that says why hardly any target of a task that asks too much is reachable, and which task fits."""
    tasks, freedoms = fitting_tasks(mechanism), generic_of(mechanism).mobility.platform
    fits = f"a task that fits is {' '.join(tasks[0].words)}" if tasks else "no task fits, for nothing moves"
    asked = counted(int(_counted(mechanism.task).sum()), "coordinate")
    varied = "which the mechanism hardly varies independently"
    if has_dependent_coordinates(mechanism):
        varied = f"of which the mechanism can vary {freedoms} independently"
    return f"the task {' '.join(mechanism.task)} asks for {asked}, {varied}: {fits}"


def task_hint(mechanism: Mechanism) -> str:
    """A sentence on a task that asks for more coordinates than the end effector has freedoms; empty if it does not."""
    if len(mechanism.joints) > MOST_JOINTS_FOR_FREEDOM or tilt_axis(mechanism) is not None:
        return ""
    tasks, freedoms = fitting_tasks(mechanism), generic_of(mechanism).mobility.platform
    asked = int(_counted(mechanism.task).sum())
    if asked <= freedoms or not tasks or set(tasks[0].words) == set(mechanism.task):
        return ""
    return (
        f"the task {' '.join(mechanism.task)} asks for {counted(asked, 'coordinate')}, and the end effector has "
        f"{counted(freedoms, 'freedom')}: a task that fits is {' '.join(tasks[0].words)}"
    )


def what_follows(mechanism: Mechanism) -> str:
    """What the task leaves out and the mechanism changes by itself: ``task z, tilt: x, y and yaw follow``; or empty."""
    words = mechanism.task
    if set(words) == set(mechanism.whole_task) or len(mechanism.joints) > MOST_JOINTS_FOR_FREEDOM:
        return ""
    moves = np.abs(generic_of(mechanism).directions).max(axis=1, initial=0.0) > TOLERANCES.alignment
    moves &= ~_counted(words)[: len(moves)]
    names = [axis for axis, varies in zip(AXES, moves[:3], strict=False) if varies]
    turns = moves[3:]
    if "tilt" in words:
        names += ["yaw"] * bool(turns.any())
    elif "yaw" in words:
        names += ["tilt"] * bool(turns.any())
    elif turns.any():
        names.append("the rotation")
    if not names:
        return ""
    listed = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
    return f"task {', '.join(words)}: {listed} follow{'s' * (len(names) == 1)}"


def leaves_a_choice(mechanism: Mechanism) -> bool:
    """True if a task leaves freedoms open that move several of the other coordinates together: answers are a choice.

    Freedoms that each move one coordinate alone are no choice: it stays as the target has it.
    """
    bases, n_rows = _motions(mechanism)
    counts = _counted(mechanism.task)[:n_rows]
    for basis in bases:
        values, right = right_singular(basis[counts][None])
        left = basis @ right[0, np.count_nonzero(values > TOLERANCES.nearly_implied) :].T
        if np.count_nonzero(np.abs(left).max(axis=1, initial=0.0) > TOLERANCES.nearly_implied) > left.shape[1] > 0:
            return True
    return False


def motions_at(mechanism: Mechanism, q: Floats) -> Floats:
    """Twists (r, k) of the end effector, one for each motion that the loops allow at coordinates q (1, c)."""
    closure, twist = first_order(mechanism, q)
    values, right = right_singular(closure)
    return np.asarray(twist[0] @ right[0, np.count_nonzero(values > TOLERANCES.alignment) :].T)


def _candidates(mechanism: Mechanism) -> list[tuple[str, ...]]:
    """All tasks that a mechanism may have."""
    positions = [axes for n in range(4) for axes in itertools.combinations(AXES, n)]
    turns: list[tuple[str, ...]] = [()] if mechanism.end_effector_is_joint else [(), *((name,) for name in TASK_TURNS)]
    return [(*axes, *turn) for axes in positions for turn in turns if axes or turn]


def _counted(words: tuple[str, ...]) -> Mask:
    """Mask of the rows of a twist [velocity; angular velocity] that a task sets, (6,)."""
    turns = next((TURNS[word] for word in words if word in TURNS), (False,) * 3)
    return np.array([axis in words for axis in AXES] + list(turns))


def _motions(mechanism: Mechanism) -> tuple[list[Floats], int]:
    """Orthonormal twists (r, freedoms) of the end effector at generic configurations around home, and their rows r.

    Motions with a tiny twist per joint rate are left out: they come from axes that intersect only to some digits.
    """
    closure, twist = first_order(mechanism, around_home(mechanism))
    values, right = right_singular(closure)
    ranks = np.count_nonzero(values > TOLERANCES.alignment, axis=-1)
    rank = int(ranks.max())
    spread = twist[ranks == rank] @ np.swapaxes(right[ranks == rank, rank:], -1, -2)
    left, sizes, _ = np.linalg.svd(spread, full_matrices=False)
    n_motions = np.count_nonzero(sizes > TOLERANCES.nearly_implied, axis=-1)
    freedoms = int(n_motions.max(initial=0))
    bases = [basis[:, :freedoms] for basis, n in zip(left, n_motions, strict=True) if n == freedoms]
    return bases, spread.shape[1]


def _evaluate_task(words: tuple[str, ...], bases: list[Floats], n_rows: int) -> FittingTask | None:
    """The conditioning of a task; None if some of its coordinates depend on the others."""
    counts = _counted(words)[:n_rows]
    rows = [basis[counts] for basis in bases]
    freedoms = bases[0].shape[1] if bases else 0
    varied = int(np.linalg.matrix_rank(np.hstack(rows), TOLERANCES.alignment)) if rows else 0
    n_constant = int(counts.sum()) - varied
    if not 0 < varied <= freedoms or (len(rows) < 2 and n_constant):  # one configuration does not tell what is constant
        return None
    sizes = np.array([np.linalg.svd(basis, compute_uv=False)[varied - 1] for basis in rows])
    return FittingTask(words, varied, float(np.median(sizes)), n_constant)
