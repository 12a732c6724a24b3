"""The nearest feasible configuration, exactly: a local search on joint coordinates, and what holds it back."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats
from ..kernels.closure.loops import BASE_AXES, SIGHT, Closed, Objective, PoseObjective
from ..kernels.handle import Scratch
from ..kernels.threads import in_blocks
from ..tolerances import TOLERANCES
from .close import EVERYTHING_FREE, Closing, Closure, close, closing_of, closure_of, new_closed
from .effort import steps_within

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism
    from ..kernels.closure.linearise import DescentScratch


MOST_STEPS = 200
"""Steps of a search, including those that are taken back; most need a dozen."""


def nearest_configurations(
    closure: Closure,
    coordinates: Floats,
    targets: Floats,
    *,
    platform: Sequence[float],
    frame: int = BASE_AXES,
    steps: int = MOST_STEPS,
) -> Closing:
    """Feasible configurations nearest to targets, (n, 4, 4): local minima of the distance, from given coordinates.

    Parameters
    ----------
    coordinates : where to start, (n, columns): closed within all limits, or not far from it.
    platform : what counts of the distance from the targets: weights of the squares of position [L] and rotation [rad];
        LOCKED for what is to be as the target has it.
    frame : of the rotation counts all with BASE_AXES, the tilt with TARGET_AXES, the yaw with HALF_WAY.
    steps : each search may take.

    Returns
    -------
    Closing : judge by `feasible`. Gaps and excesses are those of the whole, the same for every group.
    """
    return _ended(closure, coordinates, _objective(closure, targets, platform, frame, steps))


def nearest_actuators(
    closure: Closure, coordinates: Floats, poses: Floats, values: Floats, steps: int = MOST_STEPS
) -> Closing:
    """Feasible configurations whose actuators differ least from the values (n, n_a), by least squares; a local search.

    Parameters
    ----------
    coordinates, poses : where to start, (n, columns) and (n, 4, 4); need not be closed, nor within limits.
    steps : each search may take; with none it ends where loops close within limits, from values put within ranges.
    """
    anchors, weights = coordinates.copy(), np.zeros(len(closure.scale))
    closure.put_actuators(anchors, values)
    weights[closure.actuated] = 1.0
    if steps == 0:
        lo, hi = closure.loops.lo + TOLERANCES.inside, closure.loops.hi - TOLERANCES.inside
        anchors = np.where(lo <= hi, np.clip(anchors * closure.scale, lo, hi) / closure.scale, anchors)
    most = steps_within(closure, 100)
    begin = close(closure, anchors, poses, limits=True, margin=TOLERANCES.inside, max_iterations=most)
    if steps == 0:
        return begin
    free = _objective(closure, begin.poses, EVERYTHING_FREE, BASE_AXES, steps)
    return _ended(closure, begin.coordinates, free._replace(weights=weights, anchors=anchors * closure.scale))


def _ended(closure: Closure, coordinates: Floats, objective: Objective) -> Closing:
    """Where searches from coordinates (n, columns) end."""
    return closing_of(closure, _run(closure, coordinates, objective)[0])


def limit_multipliers(
    closure: Closure, coordinates: Floats, targets: Floats, *, platform: Sequence[float], frame: int = BASE_AXES
) -> Floats:
    """How hard every limit holds configurations back from their targets: multipliers, (n, 2 columns + cones).

    First the low and high bounds of the coordinates in turn, then the cones: by how much of L the target comes nearer,
    per unit [L or rad] by which a limit gives way; 0 for limits that do not matter.
    """
    return _run(
        closure, coordinates, _objective(closure, clip_targets(closure.mechanism, targets), platform, frame, 0)
    )[1]


def clip_targets(mechanism: Mechanism, targets: Floats) -> Floats:
    """Targets (n, 4, 4), those so far from home that no search could tell them from others there brought nearer."""
    home, far = mechanism.home_pose[:3, 3], SIGHT * mechanism.characteristic_length
    near, offset = targets.copy(), targets[:, :3, 3] - home
    near[:, :3, 3] = home + offset * np.minimum(1.0, far / np.maximum(np.abs(offset).max(axis=1), far))[:, None]
    return near


def _run(closure: Closure, coordinates: Floats, objective: Objective) -> tuple[Closed, Floats]:
    """The kernel over all rows, on all cores: where they ended, or what holds them where they are."""
    from ..kernels.closure.descend import nearest_configuration

    closed = new_closed(closure, coordinates, np.tile(np.eye(4), (len(coordinates), 1, 1)), 0.0)
    scratch = _scratch(closure.mechanism, closure.whole)
    weights = np.zeros((len(coordinates), 2 * len(closure.scale) + len(closure.loops.cone_angles)))

    def run(block: slice) -> None:
        own = Closed._make(array[block] for array in closed)
        pose = objective.pose._replace(targets=objective.pose.targets[block])
        asked = objective._replace(pose=pose, anchors=objective.anchors[block])
        nearest_configuration(closure.machine.address, scratch.address, asked, own, weights[block])

    in_blocks(run, len(coordinates), rows_a_block=16)
    return closed, weights


@lru_cache(maxsize=64)
def _scratch(mechanism: Mechanism, whole: bool) -> Scratch[DescentScratch]:
    from ..kernels.closure.linearise import new_descent_scratch

    return Scratch(new_descent_scratch, closure_of(mechanism, whole).loops)


def _objective(closure: Closure, targets: Floats, platform: Sequence[float], frame: int, steps: int) -> Objective:
    """What is to come near where no coordinate counts."""
    wanted = targets.copy()
    wanted[:, :3, 3] /= closure.mechanism.characteristic_length
    pose = PoseObjective(wanted, np.array(platform, dtype=float), frame, TOLERANCES.inside, TOLERANCES.active, steps)
    return Objective(pose, np.zeros(len(closure.scale)), np.zeros((len(targets), 0)))
