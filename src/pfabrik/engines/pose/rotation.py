"""Platforms that cannot turn, idle legs, and constraints that follow from others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats, Mask
from ...common.derived import derived
from ...kernels.handle import Handle
from ...kernels.legs import records as K
from ...machine.decomposition.leg_table import LegTable
from ...machine.model import Model
from ...machine.motion.mobility import around_home
from ...tolerances import TOLERANCES
from ..joints.close import platform_poses
from .table import TableHandle, kernel_table, reading_scratch, search_table, table_handle, with_pointing_cones

N_SAMPLES, RADIUS = 8, 0.05
"""Poses sampled around home, and how far off they are [L]."""


@derived
def keeps_rotation(model: Model) -> bool:
    """True if the platform cannot turn: a joint end effector has no orientation; or legs such as parallelograms fix it.

    Only of tasks that leave the whole rotation open. A platform that has turned over on its rods closes its loops, but
    is useless, and no answer.
    """
    if model.mechanism.end_effector_is_joint:
        return True
    if model.task.rotations > 0 or model.legs.task[0]["rows"] < 3:
        return False
    rows, slopes = constraints_at(model.legs, _shifted_about_home(model.legs))
    if not len(rows):
        return False
    is_kept = _holds_in_shifts(rows, slopes).all()
    return bool(is_kept and (np.linalg.svd(slopes[:, :, 3:])[1][:, -1] > TOLERANCES.nearly_implied).all())


@derived
def n_implied_rows(model: Model) -> int:
    """The number of leg constraints that follow from the others in general, such as planes that coincide.

    For machines without redundant joints. 0 at dead points, where it cannot be determined.
    """
    mechanism, table = model.mechanism, model.legs
    at_home = _n_implied(table, mechanism.home_pose[None])
    if 0 in at_home:  # walks around home take long, and would give 0 too
        return 0
    return min(at_home + _n_implied(table, platform_poses(mechanism, around_home(mechanism))), default=0)


def _n_implied(table: LegTable, poses: Floats) -> list[int]:
    """The number of implied constraints at each of the poses (n, 4, 4) [length] that are not at dead points."""
    sizes = np.linalg.svd(constraints_at(table, poses)[1], compute_uv=False)
    implied: list[int] = (table.task["rows"][0] - (sizes > TOLERANCES.alignment).sum(axis=1)).tolist()
    return implied


@derived
def without_idle_legs(table: LegTable) -> TableHandle:
    """Kernel table for searches in which the platform keeps its orientation at home.

    Without rotation the second forearm of a parallelogram moves like the first, and three slides and a hinge constrain
    nothing: such legs are idle. The cone of such a forearm becomes one of the first, whose direction is the same.
    """
    legs, rows = table.legs.copy(), table.task[0]["rows"]
    values, slopes = constraints_at(table, _shifted_about_home(table))
    if not len(values):
        return search_table(table)
    is_idle = _holds_in_shifts(values, slopes)
    row_ends = np.append(legs["first_row"][1:], rows)
    limited = np.concatenate([table.limited["leg"], table.driven["leg"]])
    cones, first_leg = table.cones.copy(), 0
    for k in range(len(legs)):
        is_second = legs["proximal"][k] == K.SHARED
        first_leg = first_leg if is_second else k
        has_first = is_second and legs["kind"][first_leg] != K.IDLE
        leg_idle = is_idle[legs["first_row"][k] : row_ends[k]]
        if len(leg_idle) and leg_idle.all() and k not in limited and (has_first or k not in cones["leg"]):
            legs["kind"][k], legs["has_proximal"][k] = K.IDLE, 0
            cones["leg"][cones["leg"] == k] = first_leg
    return Handle(kernel_table(table)._replace(legs=legs, cones=with_pointing_cones(legs, cones[_is_tightest(cones)])))


def _holds_in_shifts(values: Floats, slopes: Floats) -> Mask:
    """Mask of the constraints (rows,) that hold wherever a platform that does not turn is, by samples around home.

    By their slopes, too: of what they leave open far away these tell more than values near home.
    """
    left_open = np.maximum(np.abs(values), np.abs(slopes[:, :, :3]).max(axis=2)).max(axis=0)
    return np.asarray(left_open <= TOLERANCES.implied)


def _is_tightest(cones: NDArray[np.void]) -> Mask:
    """Mask of the cones that no earlier one makes superfluous: of the same leg, end and axis, and as narrow."""
    is_kept = np.ones(len(cones), dtype=bool)
    for i, cone in enumerate(cones):
        kept = cones[:i][is_kept[:i]]
        is_same = (kept["leg"] == cone["leg"]) & (kept["place"] == cone["place"])
        is_same &= (np.abs(kept["axis"] - cone["axis"]) <= TOLERANCES.implied).all(axis=1)
        is_kept[i] = not (is_same & (kept["half_angle"] <= cone["half_angle"])).any()
    return is_kept


def _shifted_about_home(table: LegTable) -> Floats:
    """Poses (n, 4, 4) [length] around home, not turned."""
    task, poses = table.task[0], np.repeat(np.eye(4)[None], N_SAMPLES, axis=0)
    shifts = np.random.default_rng(0).uniform(-RADIUS, RADIUS, (N_SAMPLES, 3))
    poses[:, :3, 3] = task["length"] * (task["reference"] + shifts)
    return poses


def constraints_at(table: LegTable, poses: Floats) -> tuple[Floats, Floats]:
    """Constraints of the legs, on home's sides, at poses (n, 4, 4) [length]: (m, rows), and derivatives, (m, rows, 6).

    Of the n poses, the m that legs reach short of dead points. Where redundant joints follow from the pose, their
    derivatives J_q are projected out: J - J_q pinv(J_q) J.
    """
    from ...kernels.pose.evaluate import evaluate_poses

    n_rows = table.task[0]["rows"]
    rows, slopes = np.zeros((len(poses), n_rows)), np.zeros((len(poses), n_rows, 6 + len(table.redundant)))
    legs = table_handle(table)
    kernel_poses, no_rows = np.require(poses, requirements=["C", "W"]), np.zeros((0, 0))
    evaluate_poses(
        legs.address, reading_scratch(table).address, kernel_poses, table.home_sides, no_rows, no_rows, rows, slopes
    )
    is_regular = np.isfinite(slopes).all(axis=(1, 2))
    rows, by_pose, by_redundant = rows[is_regular], slopes[is_regular, :, :6], slopes[is_regular, :, 6:]
    return rows, by_pose - by_redundant @ (np.linalg.pinv(by_redundant) @ by_pose) if table.task["redundant"][
        0
    ] else by_pose
