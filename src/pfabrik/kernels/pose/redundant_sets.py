"""Free redundant joints moved, as little as possible, so that legs reach, by searches."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Record
from .._jit import routine
from ..legs.records import Table
from ..vectors import copy_table
from .nearest import NearestScratch, nearest_of_row, new_nearest_scratch
from .search_records import MultistartPlan, PoseSolutions, RowSearch, Starts, new_solutions


class RedundantSet(NamedTuple):
    """Legs on one independent set of free redundant joints, and the search for their coordinates at a held pose."""

    legs: Table  # driven are the redundant joints; no legs if there is no such set
    plan: MultistartPlan
    first: Ints  # (1,): place of the first of these legs among all


class RedundantSets(NamedTuple):
    """The free redundant joints of a machine."""

    one: RedundantSet
    two: RedundantSet
    three: RedundantSet
    four: RedundantSet
    five: RedundantSet
    six: RedundantSet


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

    one: SetScratch
    two: SetScratch
    three: SetScratch
    four: SetScratch
    five: SetScratch
    six: SetScratch


def new_sets_scratch(sets: RedundantSets) -> SetsScratch:
    """Allocate the scratch memory of one thread; none for sets that there are not."""
    return SetsScratch._make(map(_new_set_scratch, sets))


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
        RowSearch(0, 0, 0, question["steps"], 0),
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
