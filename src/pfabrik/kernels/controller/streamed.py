"""A machine that a stream of targets drives, on a controller."""

from __future__ import annotations

import math
from typing import NamedTuple

from ...common.arrays import Floats
from .._jit import routine
from ..legs.complete_poses import is_pose, load_pose
from ..pose.live_pose import LivePose, LiveScratch, go_on, place
from ..rows import INVALID
from ..rows import REACHED as IS_REACHED
from ..vectors import copy_row, copy_table
from .reached import NO_ACTUATORS, NO_POSE, PROJECTED, Reaching, rest


class Streaming(NamedTuple):
    """A machine that is driven, and the memory of a tick."""

    live: LivePose
    scratch: LiveScratch


@routine
def begin_stream(own: Streaming, reaching: Reaching, pose: Floats, speeds: Floats, accelerations: Floats) -> int:
    """Let a machine rest at a feasible pose (4, 4) [length], with the most that its drives may; a code.

    Parameters
    ----------
    speeds, accelerations : (n_a,) [length or rad, per s and s^2]; an acceleration of 0 is no limit.
    """
    code = rest(reaching, pose)
    if code != 0:
        return code
    live, multipliers = own.live, own.scratch.search.hessian.multipliers
    for i in range(live.step.shape[0]):
        live.step[i] = 0.0
    for i in range(multipliers.shape[0]):
        multipliers[i] = 0.0
    for i in range(live.drives.shape[0]):
        driven, drive = live.search.driven[i], live.drives[i]
        speed, acceleration = (
            speeds[driven["column"]] / driven["unit"],
            accelerations[driven["column"]] / driven["unit"],
        )
        if not (speed > 0.0 and speed < math.inf and acceleration >= 0.0):
            return NO_ACTUATORS
        drive["aim"] = math.nan
        drive["speed"], drive["acceleration"] = speed, acceleration if acceleration > 0.0 else math.inf
    load_pose(pose, live.search.task[0]["length"], live.state.pose)
    copy_row(reaching.scratch.sides, live.state.sides)
    place(live, own.scratch)
    for i in range(live.drives.shape[0]):
        live.drives[i]["rate"] = 0.0
    return 0


@routine
def drive_to(own: Streaming, target: Floats, dt: float) -> int:
    """Go on towards a target (4, 4) [length] for dt seconds; a code. Pose and actuators are in `own.live`."""
    if not (dt > 0.0 and dt < math.inf):
        return NO_ACTUATORS
    copy_table(target, own.live.targets[0])
    is_target = is_pose(target)
    go_on(own.live, own.scratch, dt)
    status = own.live.tick[0]["status"]
    if status == INVALID or not is_target:
        return NO_POSE
    return 0 if status == IS_REACHED else PROJECTED
