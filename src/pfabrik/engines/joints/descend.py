"""The nearest feasible configuration by a local search on joint coordinates, and the multipliers of its limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ...common.arrays import Floats
from ...common.batch import take
from ...common.derived import derived
from ...kernels.handle import Scratch
from ...kernels.joints.loops import BASE_AXES, Closed, Objective, PoseObjective
from ...kernels.rows import HOLD_NOTHING
from ...kernels.search_constants import MOST_STEPS, SIGHT
from ...kernels.threads import in_blocks
from ...machine.motion.loops import Closure
from ...tolerances import TOLERANCES
from .close import EVERYTHING_FREE, Closing, close, closing_of, new_closed
from .effort import steps_within
from .placed_links import links_on_paths

Priced: TypeAlias = tuple[int, float, float]
"""What is held up to a price, the price and the share of the distance that it is rounded off by."""

UNPRICED: Priced = HOLD_NOTHING, 0.0, 0.0

if TYPE_CHECKING:
    from ...kernels.joints.linearise_loops import DescentScratch
    from ...machine.description.mechanism import Mechanism


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
    coordinates : of the start, (n, columns): closed within all limits, or nearly so.
    platform : weights (6,) of the squares of position [L] and rotation [rad] in the objective; LOCKED for components
        that are held at the target's.
    frame : part of the rotation that counts: all with BASE_AXES, the tilt with TARGET_AXES, the yaw with HALF_WAY.
    steps : most steps of each search.

    Returns
    -------
    Closing : valid where `feasible`. Gaps and excesses are those of the whole mechanism, repeated for every group.
    """
    return _minimise(closure, coordinates, _objective(closure, targets, platform, frame, steps))


def nearest_actuators(
    closure: Closure, coordinates: Floats, poses: Floats, values: Floats, steps: int = MOST_STEPS
) -> Closing:
    """Feasible configurations whose actuators differ least from the values (n, n_a), by least squares: local minima.

    Parameters
    ----------
    coordinates, poses : of the start, (n, columns) and (n, 4, 4); need not be closed, nor within limits.
    steps : most steps of each search; with 0, loops are closed within limits from values clipped to their ranges.
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
    return _minimise(closure, begin.coordinates, free._replace(weights=weights, anchors=anchors * closure.scale))


def _minimise(closure: Closure, coordinates: Floats, objective: Objective) -> Closing:
    """Minimise an objective by local searches from coordinates (n, columns)."""
    return closing_of(closure, _run(closure, coordinates, objective)[0])


def limit_multipliers(
    closure: Closure,
    coordinates: Floats,
    targets: Floats,
    *,
    platform: Sequence[float],
    frame: int = BASE_AXES,
    priced: Priced = UNPRICED,
) -> Floats:
    """Multipliers of all limits at configurations nearest to targets, (n, 2 columns + cones + pairs of links).

    The order is low and high bound of each coordinate, then the cones, then the pairs. A multiplier is the decrease of
    the distance, with its price, [L] per unit [L or rad] by which the limit is relaxed; 0 for limits that are not
    active.
    """
    clipped = clip_targets(closure.mechanism, targets)
    return _run(closure, coordinates, _objective(closure, clipped, platform, frame, 0, priced))[1]


def clip_targets(mechanism: Mechanism, targets: Floats) -> Floats:
    """Targets (n, 4, 4), with positions farther than `SIGHT` from home moved towards home to that distance."""
    home, far = mechanism.home_pose[:3, 3], SIGHT * mechanism.characteristic_length
    clipped, offset = targets.copy(), targets[:, :3, 3] - home
    clipped[:, :3, 3] = home + offset * np.minimum(1.0, far / np.maximum(np.abs(offset).max(axis=1), far))[:, None]
    return clipped


def _run(closure: Closure, coordinates: Floats, objective: Objective) -> tuple[Closed, Floats]:
    """Run the kernel on all rows, on all cores: the local minima, or with 0 steps the multipliers of the limits."""
    from ...kernels.joints.descend import nearest_configuration

    closed = new_closed(closure, coordinates, np.tile(np.eye(4), (len(coordinates), 1, 1)), 0.0)
    scratch = _scratch(closure)
    n_limits = 2 * len(closure.scale) + len(closure.loops.cone_angles) + len(links_on_paths(closure.mechanism)[0].pairs)
    multipliers = np.zeros((len(coordinates), n_limits))

    def run(block: slice) -> None:
        results = take(closed, block)
        pose = objective.pose._replace(targets=objective.pose.targets[block])
        part = objective._replace(pose=pose, anchors=objective.anchors[block])
        nearest_configuration(closure.machine.address, scratch.address, part, results, multipliers[block])

    in_blocks(run, len(coordinates), rows_a_block=16)
    return closed, multipliers


@derived
def _scratch(closure: Closure) -> Scratch[DescentScratch]:
    from ...kernels.joints.linearise_loops import new_descent_scratch

    return Scratch(new_descent_scratch, closure.loops, *links_on_paths(closure.mechanism))


def _objective(
    closure: Closure, targets: Floats, platform: Sequence[float], frame: int, steps: int, priced: Priced = UNPRICED
) -> Objective:
    """The objective of the distance from targets (n, 4, 4), with no weight on joint coordinates."""
    scaled = targets.copy()
    scaled[:, :3, 3] /= closure.mechanism.characteristic_length
    near = TOLERANCES.inside, TOLERANCES.active
    pose = PoseObjective(scaled, np.array(platform, dtype=float), frame, *priced, *near, steps)
    return Objective(pose, np.zeros(len(closure.scale)), np.zeros((len(targets), 0)))
