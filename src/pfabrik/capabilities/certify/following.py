"""Coordinates of the pose that follow from the legs in a region, and why some have no bounds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from ...common.rotations import to_rotvec
from ...kinematics import JointPath, Model, task_of
from .constraint_legs import leg_of_joints, leg_that_restricts, leg_without_bounds, names_of_leg
from .pose_region import PoseRegion


class Following(NamedTuple):
    """What follows from the legs.

    Attributes
    ----------
    implicit : array (6,)
        1 of coordinates of the pose that follow from the legs over the region.
    reason : str
        Why nothing can be proved of the region: a leg leaves a constraint on its poses; empty if none does.
    """

    implicit: Ints
    reason: str


def what_follows(model: Model, region: PoseRegion, uncertain: float) -> Following:
    """Which coordinates follow from the legs over a region: those that its task leaves open, if legs restrict it there,
    and leave as many constraints as they are."""
    reason = _of_uncertain(model, uncertain)
    if region.path is not None:
        return Following(np.zeros(6, np.int64), reason or _of_joints(model, region.path))
    task, table = task_of(model.mechanism), model.legs
    far = np.abs(np.stack([region.low, region.high])[:, 3:]).max(axis=0)
    middle = region.middle[:3] - model.mechanism.home_pose[:3, 3]
    shifts, turns = np.concatenate([np.diag(region.half[:3]), middle[None]]) / model.length, np.diag(far)
    leg = leg_that_restricts(table, shifts, turns)
    is_open = task.rotations == 2 and bool(far.any())
    if leg < 0 and not is_open:
        return Following(np.zeros(6, np.int64), reason)
    implicit, n_constraints = np.logical_not((*task.axes, *task.turns)), int(table.task["rows"][0])
    unknown = leg_without_bounds(table)
    if unknown >= 0:
        reason = reason or f"the constraints of the leg with {names_of_leg(table, unknown)} have no bounds over regions"
    elif int(implicit.sum()) != n_constraints or not n_constraints:
        reason = reason or (
            f"the leg with {names_of_leg(table, leg)} restricts the platform in this region, or carries others"
            if leg >= 0 and not implicit.any()
            else f"legs have {n_constraints} constraints on {implicit.sum()} coordinates that the task leaves open"
        )
    if reason:
        return Following(np.zeros(6, np.int64), reason)
    return Following(implicit.astype(np.int64), "")


def of_track(model: Model, poses: Floats, uncertain: float) -> Following:
    """As `what_follows`, between the steps of a track: nothing does, or legs restrict it."""
    rotations = poses[:, :3, :3]
    shifts = (poses[:, :3, 3] - model.mechanism.home_pose[:3, 3]) / model.length
    moves = to_rotvec(rotations[1:] @ np.swapaxes(rotations[:-1], 1, 2))
    turns, reason = np.concatenate([to_rotvec(rotations), moves]), ""
    leg = leg_that_restricts(model.legs, shifts, turns)
    if task_of(model.mechanism).rotations == 2 and np.any(turns):
        reason = "the yaw of the platform follows from its legs, without bounds over tracks yet"
    elif leg >= 0:
        names = names_of_leg(model.legs, leg)
        reason = f"the leg with {names} restricts the platform in this region, or carries others"
    return Following(np.zeros(6, np.int64), reason or _of_uncertain(model, uncertain))


def _of_uncertain(model: Model, uncertain: float) -> str:
    legs = model.legs.legs
    return (
        "with uncertain points, legs restrict the platform"
        if uncertain and len(legs) and legs["has_rows"].any()
        else ""
    )


def _of_joints(model: Model, path: JointPath) -> str:
    """Why poses at coordinates of joints may break constraints of legs; empty if none can."""
    table = model.legs
    leg = leg_of_joints(table, {each.joint.name for each in path.coordinates})
    if leg < 0:
        return f"the joints {', '.join(path.names)} are no leg of their own"
    axes = np.array([motion.axis for motion in path.motions if motion.kind == "turn"]).reshape(-1, 3)
    other = leg_that_restricts(table, np.eye(3), axes, leg)
    return f"the leg with {names_of_leg(table, other)} restricts the platform in this region" if other >= 0 else ""
