"""Seeds: feasible configurations far apart that searches start from, besides the start given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats
from ...common.batch import take
from ...common.derived import derived
from ...common.rotations import from_rotvec
from ...kernels.joints.loops import BASE_AXES
from ...kernels.legs import records as K
from ...kernels.pose.pose_constants import (
    BEYOND,
    DRAW_STEPS,
    DRAWS,
    FARTHEST_ROTATION,
    JOINT_PLACES,
    MANY_BEYOND,
    MANY_SEEDS,
    Q_WEIGHT,
    RADIUS,
    RADIUS_BEYOND,
    RARE_BONUS,
    ROTATION_WEIGHT,
    SEEDS,
    SEEDS_PER_MODE,
)
from ...kernels.pose.search_records import Starts
from ...kernels.rows import REACHED
from ...machine.decomposition.leg_table import LegTable
from ...machine.model import Model
from ...tolerances import TOLERANCES
from ..joints.close import in_lengths
from ..joints.configurations import new_rows
from ..joints.parasitic import is_flipped
from .carriages import proximal_coordinates
from .nearest_pose import NearestPose, home_start, no_starts
from .rotation import constraints_at, keeps_rotation
from .table import table_handle

DECIMALS = 6
"""Decimals of the places of legs [L]: aligned ones differ by rounding."""


@derived
def seeds_of(model: Model) -> Starts:
    """Feasible configurations far from home and from each other; every third may be in a component beyond the base."""
    table = model.legs
    rng = np.random.default_rng(0)
    is_many = table.has_implicit_joints or len(_sided_pivots(table)) > 0
    n_near, n_beyond = (MANY_SEEDS, MANY_BEYOND) if is_many else (SEEDS, BEYOND)
    near_seeds = _far_apart(home_start(model), _random_feasible(model, rng, DRAWS, RADIUS), n_near)
    far_seeds = _far_apart(near_seeds, _random_feasible(model, rng, DRAWS, RADIUS_BEYOND), n_beyond)
    ranks = np.concatenate([np.arange(len(near_seeds.poses)), 2.0 * np.arange(len(far_seeds.poses)) + 0.5])
    order = np.argsort(ranks)
    return Starts(*(np.concatenate(both)[order] for both in zip(near_seeds, far_seeds, strict=True)))


@derived
def seeds_of_other_assemblies(model: Model) -> Starts:
    """The seeds in other assemblies than home's: completing from home what the task sets gives another pose."""
    from ...kernels.legs.answer import answer

    table, seeds, length = model.legs, seeds_of(model), model.length
    if keeps_rotation(model) and all(model.task.axes) and not table.has_implicit_joints:
        return no_starts(table)  # a position that is set is the pose
    poses = in_lengths(seeds.poses, length)
    rows, sides, redundant = new_rows(model, len(poses)), seeds.sides.copy(), table.implicit_joints["leg"]
    sides[:, redundant] = table.home_sides[:, redundant]
    answer(
        table_handle(table).address,
        poses,
        model.mechanism.home_pose[None].copy(),
        sides,
        rows.status,
        rows.poses,
        rows.actuators,
        rows.measures,
    )
    error = np.abs(in_lengths(rows.poses, 1.0 / length) - seeds.poses).max(axis=(1, 2))
    others = take(seeds, np.flatnonzero((rows.status != REACHED) | (error > TOLERANCES.same_mode)))
    return Starts(*(np.concatenate(both) for both in zip(others, _spread_joints(model), strict=True)))


def _spread_joints(model: Model) -> Starts:
    """Home with one implicit joint after the other all over its range, where the task sets the whole pose.

    Such a joint has few solutions, to which seeds near home may all be on one side.
    """
    table, home = model.legs, home_start(model)
    if table.is_partial:
        return no_starts(table)
    joints = table.implicit_joints
    legs = np.repeat(joints["leg"], JOINT_PLACES)
    lo, hi = (np.clip(joints[end], -np.pi, np.pi) for end in ("lo", "hi"))
    values = (joints["sense"] * np.linspace(lo, hi, JOINT_PLACES, endpoint=False)).T.ravel()
    poses, q, sides = (
        np.repeat(array, len(legs), axis=0) for array in (home.poses, np.zeros_like(home.sides), home.sides)
    )
    sides[np.arange(len(legs)), legs] = values
    return Starts(poses, q, sides)


def _random_feasible(model: Model, rng: np.random.Generator, n: int, radius: float) -> Starts:
    """Random feasible configurations: the nearest to n random poses within a radius of home [L]."""
    table, home = model.legs, home_start(model)
    poses = np.repeat(home.poses, n, axis=0)
    twists = rng.uniform(-1.0, 1.0, (n, 6)) * np.repeat([radius, FARTHEST_ROTATION], 3)
    for slopes in constraints_at(table, model.mechanism.home_pose[None])[1]:
        _, sizes, directions = np.linalg.svd(slopes)
        bound = directions[: (sizes > TOLERANCES.alignment).sum()]
        twists -= twists @ bound.T @ bound  # motions that the legs bar at home they mostly bar elsewhere
    poses[:, :3, 3] += twists[:, :3]
    if not keeps_rotation(model):
        poses[:, :3, :3] = from_rotvec(twists[:, 3:]) @ poses[:, :3, :3]
    q = np.zeros((n, len(table.legs)))
    coordinates = np.concatenate([proximal_coordinates(table), table.redundant])
    for coordinate in coordinates[_by_place(table, coordinates["leg"])]:
        sign = _axis_sign(table, coordinate["leg"])
        ends = sign * coordinate["sense"] * np.clip([coordinate["lo"], coordinate["hi"]], -np.pi, np.pi)
        q[:, coordinate["leg"]] = sign * rng.uniform(ends.min(), ends.max(), n)
    sides = np.repeat(home.sides, n, axis=0)
    pivots = _sided_pivots(table)
    sides[:, pivots] *= rng.choice([-1.0, 1.0], (n, len(pivots)))  # no search leads from one side to the other
    targets = in_lengths(poses, model.length)
    weights = (1.0, 1.0, 1.0, ROTATION_WEIGHT, ROTATION_WEIGHT, ROTATION_WEIGHT)
    nearest_pose = NearestPose(model, table, weights, {"frame": BASE_AXES, "steps": DRAW_STEPS}, no_starts(table))
    solution = nearest_pose.find(targets, Starts(poses, q, sides))
    is_usable = np.isfinite(solution.distances) & ~is_flipped(model.path_closure, solution.poses)
    solution.poses[:] = in_lengths(solution.poses, 1.0 / model.length)
    return take(Starts(*solution[1:4]), np.flatnonzero(is_usable))


def _far_apart(given: Starts, drawn: Starts, most: int) -> Starts:
    """Up to `most` of the configurations drawn, chosen one by one to be far from those given and from each other."""
    candidates = Starts(*(np.concatenate(both) for both in zip(given, drawn, strict=True)))
    modes = np.unique(np.sign(candidates.sides), axis=0, return_inverse=True)[1].ravel()
    chosen: list[int] = []
    distances = np.full(len(candidates.poses), np.inf)
    for k in range(len(given.poses)):
        distances = np.minimum(distances, _distances_from(candidates, k))
    while len(chosen) < min(most, len(drawn.poses)):
        is_rare = np.bincount(modes[chosen], minlength=modes.max() + 1)[modes] < SEEDS_PER_MODE
        chosen.append(int(np.where(is_rare & (distances > 0.0), distances + RARE_BONUS, distances).argmax()))
        distances = np.minimum(distances, _distances_from(candidates, chosen[-1]))
    return take(candidates, chosen)


def _distances_from(starts: Starts, k: int) -> Floats:
    """Squared distances of all starts from start k, (s,) [L^2]."""
    squares = (starts.poses - starts.poses[k])[:, :3] ** 2 * (ROTATION_WEIGHT, ROTATION_WEIGHT, ROTATION_WEIGHT, 1.0)
    bends = np.sin(0.5 * (starts.q - starts.q[k])) ** 2
    return np.asarray(squares.sum(axis=(1, 2)) + Q_WEIGHT * bends.sum(axis=1))


def _sided_pivots(table: LegTable) -> NDArray[np.intp]:
    """The legs that are pivots of three hinges, which have two solutions."""
    pivots = np.flatnonzero((table.legs["proximal"] == K.NO_PROXIMAL) & (table.legs["side"] != 0.0))
    return pivots[_by_place(table, pivots)]


def _by_place(table: LegTable, legs: NDArray[np.intp]) -> NDArray[np.intp]:
    """Legs ordered by where they are at home: random draws do not depend on the order of the description."""
    records = table.legs[legs]
    places = np.concatenate(
        [records[end] for end in ("platform_end_point", "base_end_point", "proximal_point")], axis=1
    )
    return np.lexsort(np.round(places, DECIMALS).T[::-1])


def _axis_sign(table: LegTable, leg: int) -> float:
    """The sign of the first component of a leg's proximal axis that is not zero: it may be described either way."""
    axis = np.round(table.legs[leg]["proximal_axis"], DECIMALS)
    return float(np.sign(axis[np.flatnonzero(axis)[0]]))
