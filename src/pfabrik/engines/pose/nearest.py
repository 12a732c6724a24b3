"""The objectives of searches for the nearest feasible configurations, of poses and of actuators."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...kernels.joints.loops import BASE_AXES
from ...kernels.pose.pose_constants import AGREEMENTS_OF_VALUES
from ...kernels.pose.search_records import PoseSolutions, Starts
from ...kernels.projecting import UNBOUNDED
from ...kernels.rows import HOLD_ORIENTATION, HOLD_POSITION
from ...kernels.search_constants import MOST_STEPS
from ...machine.description.home_mobility import column_joints
from ...machine.model import Model
from ...options import Options
from ...tolerances import TOLERANCES
from ..joints.projection import ProjectionMode, modes_of, projection_modes, with_coarse
from .links_of_legs import links_of_legs
from .nearest_pose import NearestPose, Objective, no_starts
from .seeds import seeds_of

OF_VALUES: Objective = (0.0,) * 6, {"frame": BASE_AXES, "steps": MOST_STEPS, "agreements": AGREEMENTS_OF_VALUES}
"""The objective of actuators nearest to values; the pose does not count."""


ALL_SEEDS = UNBOUNDED
"""More agreements than there are searches: they end only where the target is reached."""


def objectives_of(
    model: Model,
    hold: str | None,
    rotation_length: float | None,
    hold_price: float,
    tolerance: float | None,
    rotation_tolerance: float,
) -> tuple[list[Objective], int, int]:
    """The objectives of searches, how many of the first are for poses, and the one tried where these leave doubts.

    A single one with nothing held; or one in which a part is held, one in which it is held up to its price, and that
    one rounded off farther. Where redundant joints follow step by step, each of two projections misses some targets
    near singularities. -1 if no other one is tried.
    """
    settings = {"steps": MOST_STEPS, "rotation": rotation_tolerance}
    settings["position"] = tolerance or TOLERANCES.position * model.length
    projections = with_coarse(projection_modes(model.path_closure, hold, rotation_length, hold_price))
    other = "orientation" if len(projections) == 1 else None
    others = projection_modes(model.path_closure, other, rotation_length, hold_price)[:1]
    objectives = [objective_of(model, projection, settings) for projection in projections]
    objectives += [objective_of(model, projection, {**settings, "agreements": ALL_SEEDS}) for projection in others]
    has_others = model.legs.has_implicit_joints and others[0] != projections[0]
    return objectives, len(projections), len(projections) if has_others else -1


def endings(
    model: Model, options: Options, target: Floats, starts: Starts, *, keep_mode: bool
) -> list[tuple[ProjectionMode, PoseSolutions]]:
    """Where the search of each projection ends from each start alone, for one target (1, 4, 4) [length]."""
    settings = {"steps": MOST_STEPS, "stays": int(keep_mode), "rotation": options.rotation_tolerance}
    settings["position"] = options.tolerance or TOLERANCES.position * model.length
    targets = np.repeat(target, len(starts.poses), axis=0)
    projections = modes_of(model.path_closure, options)
    objectives = [objective_of(model, projection, settings) for projection in projections]
    searches = [NearestPose(model, model.legs, *objective, no_starts(model.legs)) for objective in objectives]
    return [
        (projection, search.find(targets, starts)) for projection, search in zip(projections, searches, strict=True)
    ]


def objective_of(model: Model, projection: ProjectionMode, settings: Mapping[str, float]) -> Objective:
    """The objective of one projection."""
    held = {
        "hold": projection.hold,
        "price": projection.price,
        "rounding": projection.rounding,
        "held_position": TOLERANCES.held * model.length if projection.hold == HOLD_POSITION else np.inf,
        "held_rotation": TOLERANCES.held if projection.hold == HOLD_ORIENTATION else np.inf,
    }
    return projection.weights, {**settings, **held}


def limit_multipliers(model: Model, targets: Floats, configurations: Starts, projection: ProjectionMode) -> Floats:
    """The multipliers of all limits at configurations, for targets (n, 4, 4) [length].

    In the order of `joints.descend.limit_multipliers`.
    """
    table, mechanism = model.legs, model.mechanism
    multipliers = _multipliers(model, projection).weigh(targets, configurations)
    columns, ranges = len(column_joints(mechanism)), len(table.limited)
    cone_joints = [joint.name for joint in mechanism.joints if joint.cone is not None]
    n_pairs = len(links_of_legs(model).pairs)
    weights = np.zeros((len(targets), 2 * columns + len(cone_joints) + n_pairs))
    weights[:, weights.shape[1] - n_pairs :] = multipliers[:, multipliers.shape[1] - n_pairs :]
    for bound in (0, 1):
        weights[:, 2 * table.limited["column"] + bound] = multipliers[:, bound : 2 * ranges : 2]
    cones = [2 * columns + cone_joints.index(name) for name, bound in table.limits if bound == "cone"]
    weights[:, cones] = multipliers[:, 2 * ranges : 2 * ranges + len(cones)]
    return weights


@derived
def _multipliers(model: Model, projection: ProjectionMode) -> NearestPose:
    """The kernel call that takes no steps and gives the multipliers of limits."""
    settings = {"steps": 0, "hold": projection.hold, "price": projection.price, "rounding": projection.rounding}
    return NearestPose(model, model.legs, projection.weights, settings, no_starts(model.legs))


def nearest_positions(model: Model, targets: Floats, starts: Starts, *, seeds: bool, keep_mode: bool) -> PoseSolutions:
    """Feasible configurations whose positions are nearest to those of targets (n, 4, 4) [length], in any orientation.

    Distances are those of positions alone; rows whose position is reached have the status REACHED.

    Parameters
    ----------
    starts : the first start of each row, or one for all.
    seeds : search from the machine's seeds too.
    keep_mode : stay in the working mode of the first start.
    """
    search = _position_search(model, seeds, keep_mode)
    return search.find(np.require(targets, requirements=["C", "W"]), starts)


@derived
def _position_search(model: Model, seeds: bool, keep_mode: bool) -> NearestPose:
    """The search for nearest positions; the orientation does not count."""
    settings = {
        "steps": MOST_STEPS,
        "stays": int(keep_mode),
        "position": TOLERANCES.position * model.length,
        "rotation": np.inf,
        "held_position": np.inf,
        "held_rotation": np.inf,
    }
    seed_starts = seeds_of(model) if seeds else no_starts(model.legs)
    return NearestPose(model, model.legs, model.task.weights(1.0, 0.0), settings, seed_starts)
