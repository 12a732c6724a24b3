"""Working modes: every configuration in which a mechanism has its end effector on a target."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod

import numpy as np

from ...answers.solution import Solution
from ...answers.status import Status
from ...answers.words import actuator_columns, in_units, pose_cells, pose_columns
from ...common.arrays import Floats
from ...common.checks import require_count
from ...engines.joints.close import CLOSED, close
from ...errors import InvalidArgument
from ...kernels.rows import POSITION_ERROR, ROTATION_ERROR
from ...kinematics import Target, as_targets, engine_of, model_of, readouts
from ...machine.description.mechanism import Mechanism
from ...machine.poses import are_poses, made_exact, what_is_wrong
from .branches import BranchSearch, Listed
from .lists import BATCH, Modes


@dataclass(frozen=True)
class WorkingModes(Modes):
    """Working modes found by a search, nearest to home first.

    Attributes
    ----------
    modes : tuple of Solution
        A Solution per mode: REACHED within all limits; EXCEEDED beyond those in `active_limits`.
    hits : tuple of int
        Number of starts that found the rarest leg branch of each mode.
    starts : int
        Number of starts.
    branches : tuple of tuple of tuple of int
        For every platform pose and every leg, the number of starts that found each branch of the leg. Modes are the
        combinations of one branch per leg; there may be more than are listed.
    """

    kind = "working"

    branches: tuple[tuple[tuple[int, ...], ...], ...]

    @property
    def total(self) -> int:
        return sum(prod(map(len, legs)) for legs in self.branches)

    @staticmethod
    def _columns(mechanism: Mechanism) -> list[str]:
        is_open = mechanism.task != mechanism.whole_task
        return actuator_columns(mechanism) + (pose_columns(mechanism) if is_open else [])

    @staticmethod
    def _cells(mode: Solution) -> list[str]:
        is_open = mode.mechanism.task != mode.mechanism.whole_task
        return in_units(readouts(mode.mechanism), mode.actuators) + (pose_cells(mode) if is_open else [])

    @property
    def _found_once(self) -> int:
        return sum(hits == 1 for legs in self.branches for leg in legs for hits in leg)


def working_modes(mechanism: Mechanism, target: Target, *, most_starts: int = 40_000, most: int = 4096) -> WorkingModes:
    """All configurations with the end effector on a target in the components of the task, regardless of limits.

    Newton's method, undamped, starts from random configurations of all joints until every branch of every leg has been
    found ten times and at least 1024 starts have been made, or `most_starts`. With the platform fixed, legs are
    independent, so modes are all combinations of their branches; if the task leaves part of the pose open, at every
    pose found. This is a search, not a proof: each mode listed exists, its loops are closed to machine
    precision, and it is listed once. `unseen` of the result estimates the probability that another start finds a new
    branch. The same call gives the same answer.

    Modes differ in actuator values or joint centres. The spin of a rod, or half a turn of a strut about itself by the
    universal joint at its end, makes no new mode: the configuration nearest to home within limits is listed.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    target : array or RigidTransform or mapping
        One pose (4, 4) of the end effector in the base frame [length], or position (3,) at home orientation.
    most_starts : int, optional
        Most starts.
    most : int, optional
        Most modes to list, the nearest to home; `total` of the result counts all.

    Returns
    -------
    WorkingModes
        Empty if no configuration has the end effector on the target.

    Raises
    ------
    ContinuumOfSolutions
        Actuators still move with the end effector on the target: a redundant machine, a task that asks for less than
        the actuators do, or a serial singularity (a stretched wrist). The message names them.
    InvalidArgument
        A batch of targets, or a target that is not a pose.
    """
    pose = _as_pose(mechanism, target)
    most_starts, most = require_count("most_starts", most_starts), require_count("most", most, 0)
    search = BranchSearch(model_of(mechanism).closure, pose)
    while search.starts < most_starts and not search.is_done:
        search.add_starts(BATCH)
    listed = search.listed(most)
    branches = tuple(tuple(tuple(leg.hits) for leg in legs) for legs in search.legs)
    return WorkingModes(tuple(_as_solution(mechanism, pose, listed)), listed.hits, search.starts, branches)


def _as_pose(mechanism: Mechanism, target: Target) -> Floats:
    """The single target as an exact pose (4, 4)."""
    targets, shape = as_targets(mechanism, target)
    if shape != ():
        raise InvalidArgument("target", f"batch shape {shape}", "one target: a pose (4, 4) or a position (3,)")
    if not are_poses(targets)[0]:
        raise InvalidArgument("target", what_is_wrong(targets[0]), "a finite pose whose rotation is one")
    exact: Floats = made_exact(targets)[0]
    return exact


def _as_solution(mechanism: Mechanism, target: Floats, listed: Listed) -> Solution:
    """Make a Solution of listed configurations for one target: measure them, without changes."""
    closing = close(model_of(mechanism).closure, listed.coordinates, listed.poses, max_iterations=0)
    configurations = engine_of(mechanism).as_configurations(closing)
    rows, n = configurations.rows, len(configurations)
    if mechanism.end_effector_is_joint:
        rows.poses[:, :3, :3] = target[:3, :3]
    is_feasible = (closing.gap <= CLOSED) & configurations.is_within_limits
    rows.status[:] = np.where(is_feasible, Status.REACHED, Status.EXCEEDED)
    position, rotation = model_of(mechanism).task.errors(rows.poses, np.repeat(target[None], n, axis=0))
    rows.measures[:, POSITION_ERROR], rows.measures[:, ROTATION_ERROR] = position, rotation
    return Solution(mechanism, configurations, (n,))
