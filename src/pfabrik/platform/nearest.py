"""The nearest feasible poses, by searches in the pose of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Ints, Records
from ..closure.close import MARGIN
from ..closure.configurations import new_rows
from ..closure.projection import Way
from ..decomposition.leg_table import LegTable, leg_table
from ..description.home_mobility import column_joints
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.closure.loops import BASE_AXES, LOCKED, PoseObjective
from ..kernels.handle import Handle
from ..kernels.legs import records as K
from ..kernels.platform.records import Aim, Found, Starts
from ..kernels.rows import HOLD_NOTHING, LIMIT_EXCESS, REACHED
from ..kernels.threads import in_blocks
from ..rotations import from_rotvec
from ..tolerances import TOLERANCES
from .rotation import constraints_at, implied_rows, keeps_rotation, without_idle_legs
from .table import OF_AIMS, machine, machine_searched

MOST_STEPS = 200
"""Steps of a search, including those that are taken back; most need a dozen."""

CORNERS, HITS, HITS_OF_STRUTS, HITS_OF_VALUES = 16, 4, 3, 8
"""How many configurations searches start from at most, and how many of them must end at the nearest one, and one more
for each that ends elsewhere: fewer where struts leave the platform all its freedoms, and have no two ways to bend; more
where actuators have values, which a platform nearly has in many poses."""

CORNERS_OF_MANY, HITS_OF_MANY = 32, 8
"""Corners where arms are led, or pivots have two solutions; and hits there and where task and legs do not tell all of a
pose: there are many more configurations."""

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

ROWS_A_BLOCK = 16


class Projected(NamedTuple):
    """The nearest feasible configurations found, and what each holds of its target; distances are infinite where there
    is none."""

    found: Found
    holds: Ints


def project(
    mechanism: Mechanism,
    table: LegTable,
    targets: Floats,
    own: Starts,
    ways: Sequence[Way],
    *,
    corners: bool,
    stays: bool,
) -> Projected:
    """The nearest feasible configurations that searches from several starts find.

    Parameters
    ----------
    targets : (n, 4, 4) [length].
    own : the first start of each row, or one for all; poses [L].
    ways : what counts and what is held, tried in turn until one has an answer.
    corners : start from elsewhere too. Without, a search stays about where it starts.
    stays : in the working mode of the first start; through a dead point lies another.
    """
    first, *others = ways
    best = Projected(_search(mechanism, table, targets, own, first, corners, stays), np.full(len(targets), first.hold))
    for way in others:
        rows = np.flatnonzero(np.isinf(best.found.distances))
        if len(rows):
            start = own if len(own.poses) == 1 else own.at(rows)
            found = _search(mechanism, table, targets[rows], start, way, corners, stays)
            for array, tried in zip(best.found, found, strict=True):
                array[rows] = tried
            best.holds[rows] = way.hold
    return best


def _search(
    mechanism: Mechanism, table: LegTable, targets: Floats, own: Starts, way: Way, corners: bool, stays: bool
) -> Found:
    others = corners_of(mechanism) if corners else no_starts(table)
    return _approach(mechanism, table, _objective(mechanism, targets, way, MOST_STEPS), own, others, stays=stays)[0]


def _objective(mechanism: Mechanism, targets: Floats, way: Way, steps: int) -> PoseObjective:
    weights, frame = np.array(way.weights, dtype=float), task_of(mechanism).frame
    if mechanism.end_effector_is_joint or keeps_rotation(mechanism):
        weights[3:], frame = LOCKED, BASE_AXES
    return PoseObjective(targets, weights, frame, MARGIN, TOLERANCES.active, steps)


def weighed_limits(mechanism: Mechanism, table: LegTable, targets: Floats, present: Starts, way: Way) -> Floats:
    """How hard every limit holds configurations back from targets (n, 4, 4) [length]: multipliers, in the order of
    those that `closure.descend.weighed_limits` gives."""
    objective = _objective(mechanism, targets, way, 0)
    found = _approach(mechanism, table, objective, present, no_starts(table))[1]
    columns, ranges = len(column_joints(mechanism)), len(table.limited)
    coned = [joint.name for joint in mechanism.joints if joint.cone is not None]
    weights = np.zeros((len(targets), 2 * columns + len(coned)))
    for bound in (0, 1):
        weights[:, 2 * table.limited["column"] + bound] = found[:, bound : 2 * ranges : 2]
    cones = [2 * columns + coned.index(name) for name, bound in table.limits if bound == "cone"]
    weights[:, cones] = found[:, 2 * ranges : 2 * ranges + len(cones)]
    return weights


def nearest_actuators(mechanism: Mechanism, table: LegTable, values: Floats, own: Starts, *, corners: bool) -> Found:
    """Feasible configurations whose actuators are nearest to values (n, n_a), deviations from home [L or rad]."""
    poses = in_lengths(own.poses, mechanism.characteristic_length)
    poses = poses if len(poses) == len(values) else np.repeat(poses, len(values), axis=0)
    weights = np.zeros(6)
    if mechanism.end_effector_is_joint or keeps_rotation(mechanism):
        weights[3:] = LOCKED
    objective = PoseObjective(poses, weights, BASE_AXES, MARGIN, TOLERANCES.active, MOST_STEPS)
    others = corners_of(mechanism) if corners else no_starts(table)
    return _approach(mechanism, table, objective, own, others, values)[0]


def nearest_arms(mechanism: Mechanism, table: LegTable, targets: Floats, own: Starts) -> Found:
    """Feasible configurations at targets (n, 4, 4) [length] whose arms are near to where the starts (n,) have them.

    Searches start there alone: what they miss, projections from elsewhere find.
    """
    way, n = Way(task_of(mechanism).weights(LOCKED, LOCKED), HOLD_NOTHING), len(targets)
    objective, best = _objective(mechanism, targets, way, MOST_STEPS), _new_found(n, table)
    best.distances[:], best.sides[:] = 0.0, own.sides
    for part, legs in _apart_by_arms(table):
        begin, arms = Starts(own.poses, *(np.ascontiguousarray(array[:, legs]) for array in own[1:])), part.arms
        values = np.ascontiguousarray(arms["sense"] * begin.sides[:, arms["leg"]])
        found = _approach(mechanism, part, objective, begin, no_starts(part), values, arms)[0]
        np.maximum(best.distances, found.distances, out=best.distances)
        best.poses[:], best.sides[:, legs] = found.poses, found.sides
    return best


@lru_cache(maxsize=64)
def _apart_by_arms(table: LegTable) -> tuple[tuple[LegTable, slice], ...]:
    """Tables of the legs on each set of arms, and which legs these are: they have nothing to do with each other where
    the pose is given; else all in one."""
    if table.task["unset"][0] > 0 or table.task["rows"][0] > 0:
        return ((table, slice(None)),)
    legs, parts = table.legs, []
    starts = np.flatnonzero((legs["kind"] == K.ARM) & (legs["arm"] < 0)).tolist()
    for k, after in zip(starts, [*starts[1:], len(legs)], strict=True):
        end = k + 1
        while end < after and legs[end]["arm"] >= k:
            end += 1
        own_legs, before = legs[k:end].copy(), legs[k]["makes"] - 2
        own_legs["arm"] -= np.where(own_legs["arm"] >= 0, k, 0)
        own_legs["makes"] -= before
        own_legs["frame"] -= np.where(own_legs["frame"] >= 2, before, 0)
        own = {name: getattr(table, name) for name in ("limited", "cones", "known")}
        own = {name: array[(array["leg"] >= k) & (array["leg"] < end)] for name, array in own.items()}
        for array in own.values():
            array["leg"] -= k
        parts.append((replace(table, forms=table.forms[k:end], legs=own_legs, **own), slice(k, end)))
    return tuple(parts)


def _approach(
    mechanism: Mechanism,
    table: LegTable,
    objective: PoseObjective,
    own: Starts,
    others: Starts,
    values: Floats | None = None,
    driven: Records | None = None,
    *,
    stays: bool = False,
    minds_aims: bool = False,
) -> tuple[Found, Floats]:
    """The kernel over all rows, on all cores: what was found, or what holds them where they start.

    Parameters
    ----------
    values : what coordinates, those of actuators if no others are `driven`, are to be near to; see `Aim`.
    minds_aims : keep on the way, too, to where crossed hinges can point their rods. Rows that end where they cannot are
        searched for again like this: a way that is barred ends earlier.
    """
    from ..kernels.platform.nearest import approach

    at_home = table.task[0]["rotations"] == 0 and objective.platform[3] == LOCKED and objective.max_iterations > 0
    asked = without_idle_legs(table) if at_home and not len(table.arms) else machine_searched(table)
    asked = asked if driven is None else Handle(asked.record._replace(driven=driven))
    found, legs = _new_found(len(objective.targets), table), asked.record
    limits = 2 * len(legs.limited) + len(legs.cones) + len(legs.legs)
    minds_aims = minds_aims or objective.max_iterations == 0
    minded = len(legs.cones) if minds_aims else int((legs.cones["leader"] != OF_AIMS).sum())
    weights = np.zeros((len(objective.targets), limits))
    hits = _hits(table) if values is None else HITS_OF_VALUES
    implied = implied_rows(mechanism) if not len(table.arms) else 0
    near = np.zeros((0, len(legs.driven))) if values is None else values

    def run(block: slice) -> None:
        first = own if len(own.poses) == 1 else own.at(block)
        aim = Aim(objective._replace(targets=objective.targets[block]), near[block], implied)
        into = Found._make(array[block] for array in found)
        approach(asked.address, aim, first, others, hits, int(stays), minded, into, weights[block])

    in_blocks(run, len(found.distances), ROWS_A_BLOCK)
    astray = found.measures[:, LIMIT_EXCESS] > TOLERANCES.limit
    if minded < len(legs.cones) and astray.any():
        begin = own if len(own.poses) == 1 else own.at(np.flatnonzero(astray))
        again = objective._replace(targets=objective.targets[astray])
        asked_values = None if values is None else values[astray]
        pointed = _approach(mechanism, table, again, begin, others, asked_values, driven, stays=stays, minds_aims=True)[
            0
        ]
        for array, tried in zip(found, pointed, strict=True):
            array[astray] = tried
    return found, weights


@lru_cache(maxsize=64)
def _hits(table: LegTable) -> int:
    task = table.task[0]
    if table.leads_arms or task["unset"] + task["arms"] > task["rows"]:
        return HITS_OF_MANY
    return HITS if table.task[0]["rows"] > 0 or len(_carriers(table)) else HITS_OF_STRUTS


def _new_found(n: int, table: LegTable) -> Found:
    legs, actuators = len(table.legs), len(table.driven)
    return Found(
        np.full(n, np.inf),
        np.zeros((n, 4, 4)),
        np.zeros((n, legs)),
        np.zeros((n, legs)),
        np.zeros(n, np.int64),
        np.zeros((n, actuators)),
        np.zeros((n, 5)),
    )


def no_starts(table: LegTable) -> Starts:
    return Starts(np.zeros((0, 4, 4)), np.zeros((0, len(table.legs))), np.zeros((0, len(table.legs))))


def starts_at(mechanism: Mechanism, table: LegTable, poses: Floats, sides: Floats) -> Starts:
    """Poses (n, 4, 4) [length] with legs on given sides, (n, legs), as starts."""
    return Starts(in_lengths(poses, 1.0 / mechanism.characteristic_length), np.zeros((0, len(table.legs))), sides)


def _carriers(table: LegTable) -> Records:
    """The coordinates of carriers among those known."""
    on_rods = table.legs["kind"][table.known["leg"]] == K.ROD
    return np.asarray(table.known[on_rods & (table.known["place"] == K.CARRIER)])


def _sided_pivots(table: LegTable) -> NDArray[np.intp]:
    """The legs that are pivots of three hinges, which have two solutions."""
    return np.flatnonzero((table.legs["kind"] == K.PIVOT) & (table.legs["side"] != 0.0))


def home_start(mechanism: Mechanism, table: LegTable) -> Starts:
    """Home, as a start."""
    poses = in_lengths(mechanism.home_pose[None], 1.0 / mechanism.characteristic_length)
    return Starts(poses, np.zeros((1, len(table.legs))), table.home_sides)


@lru_cache(maxsize=64)
def corners_of(mechanism: Mechanism) -> Starts:
    """Feasible configurations far from home and from each other; every third may be in a room beyond the base."""
    table = leg_table(mechanism)
    assert isinstance(table, LegTable)
    rng = np.random.default_rng(0)
    is_many = table.leads_arms or len(_sided_pivots(table)) > 0
    near, beyond = (CORNERS_OF_MANY, BEYOND_OF_MANY) if is_many else (CORNERS, BEYOND)
    corners = _far_apart(home_start(mechanism, table), _drawn(mechanism, table, rng, DRAWS, FAR), near)
    others = _far_apart(corners, _drawn(mechanism, table, rng, DRAWS, FARTHER), beyond)
    turns = np.concatenate([np.arange(len(corners.poses)), 2.0 * np.arange(len(others.poses)) + 0.5])
    in_turn = np.argsort(turns)
    return Starts(*(np.concatenate(both)[in_turn] for both in zip(corners, others, strict=True)))


@lru_cache(maxsize=64)
def assembled_otherwise(mechanism: Mechanism) -> Starts:
    """The corners whose poses are others where what the task leaves out of them, and arms, are completed from home."""
    from ..kernels.legs.answer import answer

    table, corners = leg_table(mechanism), corners_of(mechanism)
    assert isinstance(table, LegTable)
    poses, length = in_lengths(corners.poses, mechanism.characteristic_length), mechanism.characteristic_length
    rows, sides, arms = new_rows(mechanism, len(poses)), corners.sides.copy(), table.led_arms["leg"]
    sides[:, arms] = table.home_sides[:, arms]
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
    off = np.abs(in_lengths(rows.poses, 1.0 / length) - corners.poses).max(axis=(1, 2))
    return corners.at(np.flatnonzero((rows.status != REACHED) | (off > TOLERANCES.same_mode)))


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
    weights = np.array([1.0, 1.0, 1.0, TURNING, TURNING, TURNING])
    if mechanism.end_effector_is_joint or keeps_rotation(mechanism):
        weights[3:] = LOCKED
    else:
        poses[:, :3, :3] = from_rotvec(twists[:, 3:]) @ poses[:, :3, :3]
    q = np.zeros((n, len(table.legs)))
    for carrier in (*_carriers(table), *table.arms):
        lo, hi = max(carrier["lo"], -np.pi), min(carrier["hi"], np.pi)
        q[:, carrier["leg"]] = carrier["sense"] * rng.uniform(lo, hi, n)
    sides = np.repeat(home.sides, n, axis=0)
    pivots = _sided_pivots(table)
    sides[:, pivots] *= rng.choice([-1.0, 1.0], (n, len(pivots)))  # no search leads from one side to the other
    targets = in_lengths(poses, mechanism.characteristic_length)
    objective = PoseObjective(targets, weights, BASE_AXES, MARGIN, TOLERANCES.active, DRAWN_STEPS)
    starts = Starts(poses, q, sides)
    found = _approach(mechanism, table, objective, starts, no_starts(table))[0]
    found.poses[:] = in_lengths(found.poses, 1.0 / mechanism.characteristic_length)
    return Starts(*found[1:4]).at(np.flatnonzero(np.isfinite(found.distances)))


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


def in_lengths(poses: Floats, scale: float) -> Floats:
    """Poses with their positions scaled, copied."""
    scaled = np.array(poses)
    scaled[:, :3, 3] *= scale
    return scaled
