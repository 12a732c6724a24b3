"""Redundant joints moved, as little as possible, so that legs reach their targets: by half-spaces, or by a search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..decomposition.leg_forms import RedundantJoint
from ..decomposition.leg_table import LegTable
from ..decomposition.plan import compile_trunks
from ..derived import derived
from ..kernels.clearance.link_records import NO_LINKS
from ..kernels.passes import plan as P
from ..kernels.platform import redundant_sets as R
from ..kernels.platform.nearest import NO_STARTS
from ..kernels.platform.search_records import SETTINGS, Along, MultistartPlan
from ..kernels.search_constants import MOST_STEPS
from ..model import Model
from ..tolerances import TOLERANCES
from .nearest_pose import no_starts, search_plan
from .table import without_legs

PASSES_ALONG = 100
"""Most passes along a branch of three parts or more, as by default."""

MOST_SETS = len(R.RedundantSets._fields) - 2

_RECORDS = (P.NODE, P.BRANCH, P.CHAIN, P.CONE, P.TRUNK_SPAN, P.TRUNK_JOINT)
NO_TRUNKS = R.MovedTrunks._make(
    (*(np.zeros(0, each) for each in _RECORDS), np.zeros(1, R.MOVING), np.zeros(0, int), np.zeros(0))
)


def _trunks(model: Model) -> dict[bool, R.MovedTrunks]:
    """The redundant joints that begin chains which positions express, from the base (False) or from the platform.

    None where the task does not set the whole pose, for branches are told where to reach.
    """
    table, trunks = model.legs, dict[bool, R.MovedTrunks]()
    if table.is_partial or table.has_implicit_joints or table.task["rotations"][0] != 3:
        return trunks
    places = {form.element.joint.name: k for k, form in enumerate(table.forms) if isinstance(form, RedundantJoint)}
    senses = dict(zip(table.redundant["leg"].tolist(), table.redundant["sense"].tolist(), strict=True))
    for from_platform in (False, True):
        compiled = compile_trunks(model.mechanism, frozenset(table.redundant_joints), from_platform)
        if compiled is not None:
            legs = np.array([places[name] for name in compiled.trunk_joints])
            units = np.array([senses[leg] for leg in legs.tolist()]) * compiled.plan.trunk_joints["unit"]
            moving = np.zeros(1, R.MOVING)
            moving[0] = from_platform, PASSES_ALONG, TOLERANCES.inside * model.length, model.length
            records = (np.require(record, requirements=["C", "W"]) for record in compiled.plan[:6])
            trunks[from_platform] = R.MovedTrunks._make((*records, moving, legs, units))
    return trunks


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
    trunks = _trunks(model) if len(parts) else {}
    return R.RedundantSets._make((trunks.get(False, NO_TRUNKS), trunks.get(True, NO_TRUNKS), *sets))


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
