"""Corners: feasible configurations far apart, which searches start from beside their own start."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..closure.close import in_lengths
from ..closure.configurations import new_rows
from ..closure.parasitic import is_flipped
from ..decomposition.leg_table import LegTable, leg_table
from ..description.mechanism import Mechanism
from ..kernels.closure.loops import BASE_AXES
from ..kernels.legs import records as K
from ..kernels.platform.records import Starts
from ..kernels.rows import REACHED
from ..rotations import from_rotvec
from ..tolerances import TOLERANCES
from .nearest_pose import NearestPose, home_start, no_starts, proximal_coordinates
from .rotation import constraints_at, keeps_rotation
from .table import machine

SEEDS, SEEDS_OF_MANY = 16, 32
"""How many configurations searches start from at most, and how many where arms are led, or pivots have two solutions:
there are many more configurations."""

BEYOND, BEYOND_OF_MANY = 8, 16
"""How many more start farther away, where rooms beyond the base may be."""

DRAWS, DRAWN_STEPS = 240, 30
"""How many random poses either are chosen from, and the steps that bring each to a feasible one."""

FAR, FARTHER, TURNED = 1.0, 2.5, 1.5
"""How far from home they are, and the other ones [L]: the mirror image of a room is twice as far away as the base. And
how far they are turned [rad]."""

TURNING = 0.2
"""What the square of a rotation counts beside that of a distance where corners are to be far apart [L^2]."""

OTHER_SIDE = 0.02
"""The same for the square of the sine of half the angle by which carriers differ."""

OF_A_MODE, SELDOM = 4, 0.2
"""How many corners of one working mode are enough, and by how much more those of a mode that has fewer count as apart
[L^2]: a mode may have a room of its own, small as it is."""


PLACES = 6
"""Decimals of the places of legs [L]: what is aligned differs by rounding."""


@lru_cache(maxsize=64)
def seeds_of(mechanism: Mechanism) -> Starts:
    """Feasible configurations far from home and from each other; every third may be in a room beyond the base."""
    table = leg_table(mechanism)
    assert isinstance(table, LegTable)
    rng = np.random.default_rng(0)
    is_many = table.has_implicit_joints or len(_sided_pivots(table)) > 0
    near, beyond = (SEEDS_OF_MANY, BEYOND_OF_MANY) if is_many else (SEEDS, BEYOND)
    seeds = _far_apart(home_start(mechanism, table), _drawn(mechanism, table, rng, DRAWS, FAR), near)
    others = _far_apart(seeds, _drawn(mechanism, table, rng, DRAWS, FARTHER), beyond)
    turns = np.concatenate([np.arange(len(seeds.poses)), 2.0 * np.arange(len(others.poses)) + 0.5])
    in_turn = np.argsort(turns)
    return Starts(*(np.concatenate(both)[in_turn] for both in zip(seeds, others, strict=True)))


@lru_cache(maxsize=64)
def seeds_of_other_assemblies(mechanism: Mechanism) -> Starts:
    """The corners whose poses are others where what the task leaves out of them, and arms, are completed from home."""
    from ..kernels.legs.answer import answer

    table, seeds = leg_table(mechanism), seeds_of(mechanism)
    assert isinstance(table, LegTable)
    poses, length = in_lengths(seeds.poses, mechanism.characteristic_length), mechanism.characteristic_length
    rows, sides, redundant = new_rows(mechanism, len(poses)), seeds.sides.copy(), table.implicit_joints["leg"]
    sides[:, redundant] = table.home_sides[:, redundant]
    answer(
        machine(table).address,
        poses,
        mechanism.home_pose[None].copy(),
        sides,
        rows.status,
        rows.poses,
        rows.actuators,
        rows.measures,
    )
    off = np.abs(in_lengths(rows.poses, 1.0 / length) - seeds.poses).max(axis=(1, 2))
    return seeds.at(np.flatnonzero((rows.status != REACHED) | (off > TOLERANCES.same_mode)))


def _drawn(mechanism: Mechanism, table: LegTable, rng: np.random.Generator, n: int, far: float) -> Starts:
    """Feasible configurations, the nearest to n random poses up to so far from home [L]."""
    home = home_start(mechanism, table)
    poses = np.repeat(home.poses, n, axis=0)
    twists = rng.uniform(-1.0, 1.0, (n, 6)) * np.repeat([far, TURNED], 3)
    for slopes in constraints_at(table, mechanism.home_pose[None])[1]:
        _, sizes, directions = np.linalg.svd(slopes)
        bound = directions[: (sizes > TOLERANCES.alignment).sum()]
        twists -= twists @ bound.T @ bound  # what the legs do not allow at home they hardly do elsewhere
    poses[:, :3, 3] += twists[:, :3]
    if not keeps_rotation(mechanism):
        poses[:, :3, :3] = from_rotvec(twists[:, 3:]) @ poses[:, :3, :3]
    q = np.zeros((n, len(table.legs)))
    q_proximal = np.concatenate([proximal_coordinates(table), table.redundant])
    for proximal in q_proximal[_by_place(table, q_proximal["leg"])]:
        way = _way(table, proximal["leg"])
        ends = way * proximal["sense"] * np.clip([proximal["lo"], proximal["hi"]], -np.pi, np.pi)
        q[:, proximal["leg"]] = way * rng.uniform(ends.min(), ends.max(), n)
    sides = np.repeat(home.sides, n, axis=0)
    pivots = _sided_pivots(table)
    sides[:, pivots] *= rng.choice([-1.0, 1.0], (n, len(pivots)))  # no search leads from one side to the other
    targets = in_lengths(poses, mechanism.characteristic_length)
    weights = (1.0, 1.0, 1.0, TURNING, TURNING, TURNING)
    nearest_pose = NearestPose(mechanism, table, weights, {"frame": BASE_AXES, "steps": DRAWN_STEPS}, no_starts(table))
    found = nearest_pose.find(targets, Starts(poses, q, sides))
    counts = np.isfinite(found.distances) & ~is_flipped(mechanism, found.poses)
    found.poses[:] = in_lengths(found.poses, 1.0 / mechanism.characteristic_length)
    return Starts(*found[1:4]).at(np.flatnonzero(counts))


def _far_apart(first: Starts, drawn: Starts, most: int) -> Starts:
    """Configurations drawn that are far from the first and from each other, chosen one by one."""
    every = Starts(*(np.concatenate(both) for both in zip(first, drawn, strict=True)))
    modes = np.unique(np.sign(every.sides), axis=0, return_inverse=True)[1].ravel()
    chosen: list[int] = []
    away = np.full(len(every.poses), np.inf)
    for k in range(len(first.poses)):
        away = np.minimum(away, _apart(every, k))
    while len(chosen) < min(most, len(drawn.poses)):
        rare = np.bincount(modes[chosen], minlength=modes.max() + 1)[modes] < OF_A_MODE
        chosen.append(int(np.where(rare & (away > 0.0), away + SELDOM, away).argmax()))
        away = np.minimum(away, _apart(every, chosen[-1]))
    return Starts._make(array[chosen] for array in every)


def _apart(starts: Starts, which: int) -> Floats:
    """How far starts are from one of them, (s,): squares of distances [L]."""
    squares = (starts.poses - starts.poses[which])[:, :3] ** 2 * (TURNING, TURNING, TURNING, 1.0)
    bends = np.sin(0.5 * (starts.q - starts.q[which])) ** 2
    return np.asarray(squares.sum(axis=(1, 2)) + OTHER_SIDE * bends.sum(axis=1))


def _sided_pivots(table: LegTable) -> NDArray[np.intp]:
    """The legs that are pivots of three hinges, which have two solutions."""
    pivots = np.flatnonzero((table.legs["kind"] == K.PIVOT) & (table.legs["side"] != 0.0))
    return pivots[_by_place(table, pivots)]


def _by_place(table: LegTable, legs: NDArray[np.intp]) -> NDArray[np.intp]:
    """Legs in an order that depends on where they are at home: what is drawn is theirs however they are described."""
    own = table.legs[legs]
    places = np.concatenate([own[end] for end in ("platform_end_point", "base_end_point", "proximal_point")], axis=1)
    return np.lexsort(np.round(places, PLACES).T[::-1])


def _way(table: LegTable, leg: int) -> float:
    """Which way the axis of what carries a leg points, 1 or -1, along the first axis of the base that is not across it:
    it may be described either way."""
    axis = np.round(table.legs[leg]["proximal_axis"], PLACES)
    return float(np.sign(axis[np.flatnonzero(axis)[0]]))
