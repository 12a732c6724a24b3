"""Platforms that their legs keep from turning, and the legs that say nothing while one does not turn."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Mask
from ..closure.close import platform_poses
from ..decomposition.leg_table import LegTable, leg_table
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.handle import Handle
from ..kernels.legs import records as K
from ..motion.walks import around_home
from ..tolerances import TOLERANCES
from .table import Machine, kernel_table, machine, reading_of, search_table, with_aims

SAMPLES, NEARBY = 8, 0.05
"""How many poses about home are looked at, and how far off they are [L]."""


@lru_cache(maxsize=64)
def keeps_rotation(mechanism: Mechanism) -> bool:
    """Whether the platform does not turn: a joint has no orientation; and legs such as parallelograms keep it from
    that, though its task leaves the rotation open.

    A platform that has turned over on its rods is of no use, though its loops close, and no answer.
    """
    if mechanism.end_effector_is_joint:
        return True
    table = leg_table(mechanism)
    if not isinstance(table, LegTable) or task_of(mechanism).rotations > 0:
        return False
    if table.task[0]["rows"] < 3:
        return False
    rows, slopes = constraints_at(table, _shifted_about_home(table))
    if not len(rows):
        return False
    stays = np.abs(rows).max(initial=0.0) <= TOLERANCES.position
    return bool(stays and (np.linalg.svd(slopes[:, :, 3:])[1][:, -1] > TOLERANCES.nearly_implied).all())


@lru_cache(maxsize=64)
def implied_rows(mechanism: Mechanism) -> int:
    """How many constraints of legs without arms follow from the others in general, as of planes that are the same.

    None of legs that are at dead points, where these cannot be told.
    """
    table = leg_table(mechanism)
    assert isinstance(table, LegTable)
    at_home = _implied_at(table, mechanism.home_pose[None])
    if 0 in at_home:  # where walks about home, which take long, would tell nothing else
        return 0
    return min(at_home + _implied_at(table, platform_poses(mechanism, around_home(mechanism))), default=0)


def _implied_at(table: LegTable, poses: Floats) -> list[int]:
    """The same of each of some poses (n, 4, 4) [length] that no dead point is at."""
    sizes = np.linalg.svd(constraints_at(table, poses)[1], compute_uv=False)
    implied: list[int] = (table.task["rows"][0] - (sizes > TOLERANCES.alignment).sum(axis=1)).tolist()
    return implied


@lru_cache(maxsize=64)
def without_idle_legs(table: LegTable) -> Machine:
    """What kernels are given to search where the platform does not turn from home.

    There a second forearm of a parallelogram goes along with the first, and three slides and a hinge say nothing: such
    legs are idle. A cone of such a forearm is one of the first one, whose line is the same.
    """
    legs, rows = table.legs.copy(), table.task[0]["rows"]
    values, slopes = constraints_at(table, _shifted_about_home(table))
    if not len(values):
        return search_table(table)
    quiet = np.maximum(np.abs(values), np.abs(slopes[:, :, :3]).max(axis=2)).max(axis=0) <= TOLERANCES.implied
    ends = np.append(legs["first_row"][1:], rows)
    limited = np.concatenate([table.limited["leg"], table.driven["leg"]])
    cones, main = table.cones.copy(), 0
    for k in range(len(legs)):
        is_second = legs["proximal"][k] == K.SHARED
        main = main if is_second else k
        has_first = is_second and legs["kind"][main] == K.ROD
        own = quiet[legs["first_row"][k] : ends[k]]
        if len(own) and own.all() and k not in limited and (has_first or k not in cones["leg"]):
            legs["kind"][k] = K.IDLE
            cones["leg"][cones["leg"] == k] = main
    return Handle(kernel_table(table)._replace(legs=legs, cones=with_aims(legs, cones[_of_their_own(cones)])))


def _of_their_own(cones: NDArray[np.void]) -> Mask:
    """Which cones limit what none before limits as much."""
    own = np.ones(len(cones), dtype=bool)
    for i, cone in enumerate(cones):
        before = cones[:i][own[:i]]
        same = (before["leg"] == cone["leg"]) & (before["place"] == cone["place"])
        same &= (np.abs(before["axis"] - cone["axis"]) <= TOLERANCES.implied).all(axis=1)
        own[i] = not (same & (before["half_angle"] <= cone["half_angle"])).any()
    return own


def _shifted_about_home(table: LegTable) -> Floats:
    """Poses (n, 4, 4) [length] about home, not turned."""
    task, poses = table.task[0], np.repeat(np.eye(4)[None], SAMPLES, axis=0)
    shifts = np.random.default_rng(0).uniform(-NEARBY, NEARBY, (SAMPLES, 3))
    poses[:, :3, 3] = task["length"] * (task["reference"] + shifts)
    return poses


def constraints_at(table: LegTable, poses: Floats) -> tuple[Floats, Floats]:
    """The constraints of home's legs on poses (n, 4, 4) [length], (n, rows), and their derivatives, (n, rows, 6).

    Where arms follow, without what these give way to. Of the poses, those that legs reach short of dead points.
    """
    from ..kernels.platform.evaluate import evaluate_poses

    n_rows = table.task[0]["rows"]
    rows, slopes = np.zeros((len(poses), n_rows)), np.zeros((len(poses), n_rows, 6 + len(table.redundant)))
    legs = machine(table)
    own, nothing = np.require(poses, requirements=["C", "W"]), np.zeros((0, 0))
    evaluate_poses(legs.address, reading_of(table).address, own, table.home_sides, nothing, nothing, rows, slopes)
    known = np.isfinite(slopes).all(axis=(1, 2))
    rows, by_pose, by_arms = rows[known], slopes[known, :, :6], slopes[known, :, 6:]
    return rows, by_pose - by_arms @ (np.linalg.pinv(by_arms) @ by_pose) if table.task["redundant"][0] else by_pose
