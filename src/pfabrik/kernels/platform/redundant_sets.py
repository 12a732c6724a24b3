"""Free redundant joints moved, as little as possible, so that legs reach: by half-spaces, or by searches."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Floats, Ints, Record, Records
from .._jit import routine
from ..legs.records import Table
from ..passes.half_spaces import LeastStep, new_half_spaces
from ..passes.move_trunks import move_trunk
from ..passes.plan import Configuration, Plan, Settings, new_configuration
from ..vectors import copy_table, sub, turn
from .nearest import NearestScratch, nearest_of_row, new_nearest_scratch
from .search_records import MultistartPlan, PoseSolutions, Starts, new_solutions

MOVING = np.dtype(
    [
        ("are_on_platform", "i8"),  # 1: trunks are next to the platform
        ("iterations", "i8"),  # most passes along a branch
        ("enough", "f8"),  # how far inside limits steps aim, and how near branches come [length]
        ("length", "f8"),  # L
    ]
)
"""How trunks are moved."""


class MovedTrunks(NamedTuple):
    """Free redundant joints as the trunks of chains in joint positions, as of `passes.plan`."""

    nodes: Records
    branches: Records
    chains: Records
    cones: Records
    trunks: Records
    trunk_joints: Records
    moving: Records  # (1,): MOVING
    legs: Ints  # (n_trunk_joints,): their places among the legs; none if there are no trunks
    units: Floats  # (n_trunk_joints,): of their coordinates there, in the coordinates of trunks [length or rad]


class RedundantSet(NamedTuple):
    """Legs on one independent set of free redundant joints, and the search for their coordinates at a held pose."""

    legs: Table  # driven are the redundant joints; no legs if there is no such set
    plan: MultistartPlan
    first: Ints  # (1,): place of the first of these legs among all


class RedundantSets(NamedTuple):
    """The free redundant joints of a machine."""

    from_base: MovedTrunks
    from_platform: MovedTrunks
    one: RedundantSet
    two: RedundantSet
    three: RedundantSet
    four: RedundantSet
    five: RedundantSet
    six: RedundantSet


class TrunkScratch(NamedTuple):
    """Scratch memory of one thread, for trunks."""

    config: Configuration
    half_spaces: LeastStep
    pose: Floats  # (4, 4) [length]
    values: Floats  # (n_trunk_joints,)


class SetScratch(NamedTuple):
    """Scratch memory of one thread, for one set."""

    nearest: NearestScratch
    solution: PoseSolutions  # one row
    sides: Floats  # (1, legs): where the search starts
    values: Floats  # (1, redundant joints): coordinates that are to be near
    no_q: Floats  # (0, legs)
    no_weights: Floats  # (0, 0)


class SetsScratch(NamedTuple):
    """Scratch memory of one thread, for all of `RedundantSets`."""

    from_base: TrunkScratch
    from_platform: TrunkScratch
    one: SetScratch
    two: SetScratch
    three: SetScratch
    four: SetScratch
    five: SetScratch
    six: SetScratch


def new_sets_scratch(sets: RedundantSets) -> SetsScratch:
    """Allocate the scratch memory of one thread; none for sets that there are not."""
    return SetsScratch._make([*map(_new_trunk_scratch, sets[:2]), *map(_new_set_scratch, sets[2:])])


def _new_trunk_scratch(trunks: MovedTrunks) -> TrunkScratch:
    plan = Plan(*trunks[:6], 1.0)
    return TrunkScratch(new_configuration(plan), new_half_spaces(plan), np.zeros((4, 4)), np.zeros(len(trunks.legs)))


def _new_set_scratch(part: RedundantSet) -> SetScratch:
    legs, redundant = len(part.legs.legs), len(part.legs.driven)
    made = SetScratch(
        new_nearest_scratch(part.legs, part.plan, False),
        new_solutions(1, legs, redundant),
        np.zeros((1, legs)),
        np.zeros((1, redundant)),
        np.zeros((0, legs)),
        np.zeros((0, 0)),
    )
    return made if legs else _emptied(made)


def _emptied(scratch: Any) -> Any:
    """Scratch memory of no size."""
    return scratch._make(_emptied(item) if isinstance(item, tuple) else item[:0] for item in scratch)


@routine
def step_trunks(sets: RedundantSets, scratch: SetsScratch, home: Floats, target: Floats, sides: Floats) -> None:
    """Move trunks by the least steps that keep the limits of the legs on them, to first order.

    Parameters
    ----------
    home, target : poses of home and of the target, (4, 4) [length].
    sides : coordinates of redundant joints, (legs,), before and after.
    """
    _step_some(sets.from_base, scratch.from_base, home, target, sides)
    _step_some(sets.from_platform, scratch.from_platform, home, target, sides)


@routine
def _step_some(trunks: MovedTrunks, scratch: TrunkScratch, home: Floats, target: Floats, sides: Floats) -> None:
    """Step the trunks next to the base, or those next to the platform."""
    moving, values, pose = trunks.moving[0], scratch.values, scratch.pose
    length, enough = moving["length"], moving["enough"]
    if values.shape[0] == 0:
        return
    copy_table(target, pose)
    if moving["are_on_platform"] == 1:  # the pose of the base as the platform sees it
        centre = (home[0, 3], home[1, 3], home[2, 3])
        for i in range(3):
            for j in range(3):
                pose[i, j] = target[j, i]
        back = turn(pose, sub(centre, (target[0, 3], target[1, 3], target[2, 3])))
        for i in range(3):
            pose[i, 3] = centre[i] + back[i]
    for i in range(values.shape[0]):
        values[i] = sides[trunks.legs[i]] * trunks.units[i]
    plan = Plan(trunks.nodes, trunks.branches, trunks.chains, trunks.cones, trunks.trunks, trunks.trunk_joints, length)
    settings = Settings(enough, moving["iterations"], 0, 0, 0, length, 1)
    move_trunk(plan, pose, values, settings, enough, scratch.config, scratch.half_spaces)
    for i in range(values.shape[0]):
        sides[trunks.legs[i]] = values[i] / trunks.units[i]


@routine
def search_set(
    part: RedundantSet,
    scratch: SetScratch,
    targets: Floats,
    begin: Floats,
    question: Record,
    sides: Floats,
    pose: Floats,
) -> bool:
    """Move the joints of one set, as little as possible, until legs reach a target; False if no search finds how.

    Parameters
    ----------
    begin : the pose where the search starts, (1, 4, 4) [L].
    sides : coordinates of redundant joints, (legs,), before and after.
    pose : filled with that where the search ends, (4, 4) [length].
    """
    legs, own, values, first = part.legs, scratch.sides, scratch.values, part.first[0]
    if legs.legs.shape[0] == 0:
        return True
    for k in range(own.shape[1]):
        own[0, k] = sides[first + k]
    for i in range(legs.driven.shape[0]):
        values[0, legs.driven[i]["column"]] = legs.driven[i]["sense"] * own[0, legs.driven[i]["leg"]]
    effort = scratch.nearest.search.effort[0]
    effort["steps"], effort["most"] = 0, question["effort"]
    starts = Starts(begin, scratch.no_q, own)
    distance = nearest_of_row(
        legs,
        part.plan,
        0,
        0,
        question["steps"],
        0,
        0,
        targets,
        values,
        starts,
        scratch.solution,
        scratch.nearest,
        scratch.no_weights,
    )
    if distance == math.inf:
        return False
    for k in range(own.shape[1]):
        sides[first + k] = scratch.solution.sides[0, k]
    copy_table(scratch.solution.poses[0], pose)
    return True


@routine
def search_sets(
    sets: RedundantSets,
    scratch: SetsScratch,
    targets: Floats,
    begin: Floats,
    question: Record,
    sides: Floats,
    pose: Floats,
) -> bool:
    """Move the joints of all sets as `search_set` does; False once one is not found, or if steps are bounded."""
    return (
        question["most_steps"] == 0
        and search_set(sets.one, scratch.one, targets, begin, question, sides, pose)
        and search_set(sets.two, scratch.two, targets, begin, question, sides, pose)
        and search_set(sets.three, scratch.three, targets, begin, question, sides, pose)
        and search_set(sets.four, scratch.four, targets, begin, question, sides, pose)
        and search_set(sets.five, scratch.five, targets, begin, question, sides, pose)
        and search_set(sets.six, scratch.six, targets, begin, question, sides, pose)
    )
