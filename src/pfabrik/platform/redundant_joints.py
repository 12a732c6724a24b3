"""Redundant joints moved, as little as possible, so that legs reach their targets: by half-spaces, or by a search."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..decomposition.leg_forms import RedundantJoint
from ..decomposition.leg_table import LegTable
from ..decomposition.plan import compile_trunks
from ..derived import derived
from ..kernels.clearance.link_records import NO_LINKS
from ..kernels.passes import plan as P
from ..kernels.platform import redundant_sets as R
from ..kernels.platform.nearest import NO_STARTS
from ..kernels.platform.search_records import SETTINGS, Along, MultistartPlan
from ..kernels.threads import in_blocks
from ..model import Model
from ..tolerances import TOLERANCES
from .nearest import MOST_STEPS
from .nearest_pose import no_starts, search_plan
from .table import without_legs

PASSES_ALONG = 100
"""Most passes along a branch of three parts or more, as by default."""

ROWS_A_BLOCK = 256


MOST_SETS = len(R.RedundantSets._fields) - 2

_RECORDS = (P.NODE, P.BRANCH, P.CHAIN, P.CONE, P.TRUNK_SPAN, P.TRUNK_JOINT)
NO_TRUNKS = R.MovedTrunks._make(
    (*(np.zeros(0, each) for each in _RECORDS), np.zeros(1, R.MOVING), np.zeros(0, int), np.zeros(0))
)


class Trunks(NamedTuple):
    """Redundant joints as the trunks of chains in joint positions."""

    plan: P.Plan
    settings: P.Settings
    legs: NDArray[np.intp]  # (n_trunk_joints,): their places among the legs
    units: Floats  # (n_trunk_joints,): of their coordinates there, in the coordinates of trunks [length or rad]
    are_on_platform: bool


@derived
def _trunks(model: Model) -> tuple[Trunks, ...]:
    """The redundant joints that begin chains which positions express, from the base or from the platform.

    None where the task does not set the whole pose, for branches are told where to reach.
    """
    table = model.legs
    if table.is_partial or table.has_implicit_joints or table.task["rotations"][0] != 3:
        return ()
    places = {form.element.joint.name: k for k, form in enumerate(table.forms) if isinstance(form, RedundantJoint)}
    senses = dict(zip(table.redundant["leg"].tolist(), table.redundant["sense"].tolist(), strict=True))
    settings = P.Settings(
        enough=TOLERANCES.inside * model.length,
        max_iterations=PASSES_ALONG,
        max_rounds=0,
        free=0,
        keep_sides=0,
        lever=model.length,
        is_accelerated=1,
    )
    trunks = []
    for from_platform in (False, True):
        compiled = compile_trunks(model.mechanism, frozenset(table.redundant_joints), from_platform)
        if compiled is not None:
            legs = np.array([places[name] for name in compiled.trunk_joints])
            units = np.array([senses[leg] for leg in legs.tolist()]) * compiled.plan.trunk_joints["unit"]
            trunks.append(Trunks(compiled.plan, settings, legs, units, from_platform))
    return tuple(trunks)


def step_redundant_joints(
    model: Model,
    targets: Floats,
    start_poses: Floats,
    sides: Floats,
    places: NDArray[np.intp],
) -> tuple[NDArray[np.intp], Floats]:
    """Move redundant joints by the least steps that keep the limits of the legs on them; `places` are the rows.

    A step keeps limits to first order, and few suffice. Where they do not, or no trunk has these joints, limits stay
    exceeded: rows are solved only if legs say so.
    """
    all_trunks = _trunks(model)
    if not all_trunks:
        return places[:0], start_poses
    from ..kernels.passes.move_trunks import move_trunks

    targets, margin = np.ascontiguousarray(targets[places]), TOLERANCES.inside * model.length
    for trunks in all_trunks:
        poses = _of_base(model, targets) if trunks.are_on_platform else targets
        values = np.ascontiguousarray(sides[places[:, None], trunks.legs] * trunks.units)

        def run(block: slice, trunks: Trunks = trunks, poses: Floats = poses, values: Floats = values) -> None:
            move_trunks(trunks.plan, poses[block], values[block], trunks.settings, margin)

        in_blocks(run, len(places), ROWS_A_BLOCK)
        sides[places[:, None], trunks.legs] = values / trunks.units
    return places, start_poses if len(start_poses) == 1 else start_poses[places]


def _of_base(model: Model, targets: Floats) -> Floats:
    """Poses (n, 4, 4) of the base as the platform sees it: with r the reference point of home, R^T (r - p) + r.

    For the platform takes a point q of home to R (q - r) + p.
    """
    poses, home = np.empty_like(targets), model.mechanism.home_pose[:3, 3]
    poses[:], poses[:, :3, :3] = np.eye(4), targets[:, :3, :3].transpose(0, 2, 1)
    poses[:, :3, 3] = home + np.einsum("nij,nj->ni", poses[:, :3, :3], home - targets[:, :3, 3])
    return poses


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
    trunks = {each.are_on_platform: _moving(model, each) for each in (_trunks(model) if len(parts) else ())}
    return R.RedundantSets._make((trunks.get(False, NO_TRUNKS), trunks.get(True, NO_TRUNKS), *sets))


def _moving(model: Model, trunks: Trunks) -> R.MovedTrunks:
    """Trunks as kernels take them."""
    moving = np.zeros(1, R.MOVING)
    moving[0] = trunks.are_on_platform, PASSES_ALONG, TOLERANCES.inside * model.length, model.length
    records = (np.require(record, requirements=["C", "W"]) for record in trunks.plan[:6])
    return R.MovedTrunks._make((*records, moving, trunks.legs, trunks.units))


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
        part = replace(table, forms=table.forms[k:end], legs=part_legs, recording=None, **records)
        parts.append((part, slice(k, end)))
    return tuple(parts)
