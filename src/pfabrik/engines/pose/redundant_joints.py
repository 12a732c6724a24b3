"""Redundant joints moved, as little as possible, so that legs reach their targets, by a search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...common.derived import derived
from ...kernels.clearance.link_records import NO_LINKS
from ...kernels.pose import redundant_sets as R
from ...kernels.pose.nearest import NO_STARTS
from ...kernels.pose.search_records import SETTINGS, Along, MultistartPlan
from ...kernels.search_constants import MOST_STEPS
from ...machine.decomposition.leg_table import LegTable
from ...machine.model import Model
from .nearest_pose import no_starts, search_plan
from .table import without_legs

MOST_SETS = len(R.RedundantSets._fields)


@derived
def redundant_sets(model: Model) -> R.RedundantSets:
    """The free redundant joints of a machine as kernels take them; nothing if there are none.

    More sets than kernels have places for are one: searches for these are longer.
    """
    table, none = model.legs, _no_set(model.legs)
    parts = split_by_redundant(table) if table.has_free_redundant else ()
    parts = ((table, slice(None)),) if len(parts) > MOST_SETS else parts
    sets = [none] * MOST_SETS
    for place, (part, legs) in enumerate(parts):
        objective = model.task.held, {"steps": MOST_STEPS}
        searched = search_plan(model, part, [objective], no_starts(part), part.redundant)
        sets[place] = R.RedundantSet(*searched, np.array([legs.start or 0]))
    return R.RedundantSets._make(sets)


def _no_set(table: LegTable) -> R.RedundantSet:
    """No redundant joints."""
    legs, along = without_legs(table), Along(np.zeros((3, 3)), np.zeros((0, 3)), np.zeros((0, 2)))
    plan = MultistartPlan(np.zeros((0, 6)), np.zeros(0, SETTINGS), NO_STARTS, along, NO_LINKS)
    return R.RedundantSet(legs, plan, np.zeros(1, np.int64))


@derived
def split_by_redundant(table: LegTable) -> tuple[tuple[LegTable, slice], ...]:
    """Tables of the legs on each independent set of redundant joints, with the slices of these legs.

    A pose separates the sets. Where the task leaves some of it open, or legs constrain it, all legs stay together.
    """
    if table.task["unset"][0] > 0 or table.task["rows"][0] > 0:
        return ((table, slice(None)),)
    legs, parts = table.legs, []
    starts = np.flatnonzero(table.is_redundant & (legs["redundant"] < 0)).tolist()
    for k, next_start in zip(starts, [*starts[1:], len(legs)], strict=True):
        end = k + 1
        while end < next_start and legs[end]["redundant"] >= k:
            end += 1
        part_legs, n_before = legs[k:end].copy(), legs[k]["makes"] - 2
        part_legs["redundant"] -= np.where(part_legs["redundant"] >= 0, k, 0)
        part_legs["makes"] -= n_before * (part_legs["makes"] > 0)
        part_legs["frame"] -= np.where(part_legs["frame"] >= 2, n_before, 0)
        records = {name: getattr(table, name) for name in ("limited", "cones", "known")}
        records = {name: array[(array["leg"] >= k) & (array["leg"] < end)] for name, array in records.items()}
        for array in records.values():
            array["leg"] -= k
        part = replace(table, forms=table.forms[k:end], legs=part_legs, fields={}, **records)
        parts.append((part, slice(k, end)))
    return tuple(parts)
