"""Redundant joints moved, as little as possible, so that legs reach their targets: by half-spaces, or by a search."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Records
from ..decomposition.leg_forms import RedundantJoint
from ..decomposition.leg_table import LegTable
from ..decomposition.plan import compile_trunks
from ..derived import derived
from ..kernels.legs import records as K
from ..kernels.platform.search_records import PoseSolutions, Starts
from ..kernels.reaching import plan as P
from ..kernels.threads import in_blocks
from ..model import Model
from ..tolerances import TOLERANCES
from .nearest import MOST_STEPS
from .nearest_pose import NearestPose, new_solution, no_starts, starts_at

PASSES_ALONG = 100
"""Most passes along a branch of three parts or more, as by default."""

ROWS_A_BLOCK = 256


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
    )
    trunks = []
    for from_platform in (False, True):
        compiled = compile_trunks(model.mechanism, frozenset(table.redundant_joints), from_platform)
        if compiled is not None:
            legs = np.array([places[name] for name in compiled.trunk_joints])
            is_slide = compiled.plan.trunk_joints["kind"] == P.SLIDE
            units = np.array([senses[leg] for leg in legs.tolist()]) * np.where(is_slide, model.length, 1.0)
            trunks.append(Trunks(compiled.plan, settings, legs, units, from_platform))
    return tuple(trunks)


def step_redundant_joints(
    model: Model,
    targets: Floats,
    start_poses: Floats,
    sides: Floats,
    places: NDArray[np.intp],
) -> tuple[NDArray[np.intp], Floats]:
    """Move redundant joints by the least steps that keep the limits of the legs on them; as `search_redundant_joints`.

    A step keeps limits to first order, and few suffice. Where they do not, or no trunk has these joints, limits stay
    exceeded: rows are solved only if legs say so.
    """
    all_trunks = _trunks(model)
    if not all_trunks:
        return places[:0], start_poses
    from ..kernels.reaching.move_trunks import move_trunks

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


def search_redundant_joints(
    model: Model,
    targets: Floats,
    start_poses: Floats,
    sides: Floats,
    places: NDArray[np.intp],
) -> tuple[NDArray[np.intp], Floats]:
    """Move the redundant joints of some rows, as little as possible, until legs reach their targets within all limits.

    Parameters
    ----------
    targets, start_poses : (n, 4, 4) and (n or 1, 4, 4) [length].
    sides : coordinates of the redundant joints, (n, legs), before and after.
    places : the rows to solve.

    Returns
    -------
    The rows solved, and the poses at which their searches ended, (rows, 4, 4) [length].
    """
    starts = starts_at(model, start_poses if len(start_poses) == 1 else start_poses[places], sides[places])
    solution = _nearest_redundant(model, targets[places], starts)
    is_solved = np.isfinite(solution.distances)
    sides[places[is_solved]] = solution.sides[is_solved]
    return places[is_solved], solution.poses[is_solved]


def _nearest_redundant(model: Model, targets: Floats, starts: Starts) -> PoseSolutions:
    """Feasible configurations at targets (n, 4, 4) [length] whose redundant joints are nearest to those of starts (n,).

    Searches start there alone; what they miss, projections from seeds find. A row without a solution for one set of
    redundant joints is not searched for the next.

    Parameters
    ----------
    starts : poses (n or 1, 4, 4), sides (n, legs), and no coordinates.
    """
    best = new_solution(len(targets), model.legs)
    best.distances[:], best.sides[:] = 0.0, starts.sides
    unsolved = np.arange(len(targets))
    for redundant, legs, nearest_pose in _redundant_searches(model):
        poses = starts.poses if len(starts.poses) == 1 else starts.poses[unsolved]
        block_starts = Starts(
            poses, np.ascontiguousarray(starts.q[:, legs]), np.ascontiguousarray(starts.sides[unsolved][:, legs])
        )
        values = np.ascontiguousarray(redundant["sense"] * block_starts.sides[:, redundant["leg"]])
        solution = nearest_pose.find(targets[unsolved], block_starts, values)
        best.distances[unsolved] = np.maximum(best.distances[unsolved], solution.distances)
        best.poses[unsolved], best.sides[unsolved, legs] = solution.poses, solution.sides
        unsolved = unsolved[np.isfinite(solution.distances)]
    return best


@derived
def _redundant_searches(model: Model) -> tuple[tuple[Records, slice, NearestPose], ...]:
    """A search for each independent set of redundant joints, at a held pose: their coordinates, and their legs."""
    held = model.task.held
    return tuple(
        (
            part_table.redundant,
            legs,
            NearestPose(model, part_table, held, {"steps": MOST_STEPS}, no_starts(part_table), part_table.redundant),
        )
        for part_table, legs in split_by_redundant(model.legs)
    )


@derived
def split_by_redundant(table: LegTable) -> tuple[tuple[LegTable, slice], ...]:
    """Tables of the legs on each independent set of redundant joints, with the slices of these legs.

    A pose separates the sets. Where the task leaves some of it open, or legs constrain it, all legs stay together.
    """
    if table.task["unset"][0] > 0 or table.task["rows"][0] > 0:
        return ((table, slice(None)),)
    legs, parts = table.legs, []
    starts = np.flatnonzero((legs["kind"] == K.REDUNDANT) & (legs["redundant"] < 0)).tolist()
    for k, next_start in zip(starts, [*starts[1:], len(legs)], strict=True):
        end = k + 1
        while end < next_start and legs[end]["redundant"] >= k:
            end += 1
        part_legs, n_before = legs[k:end].copy(), legs[k]["makes"] - 2
        part_legs["redundant"] -= np.where(part_legs["redundant"] >= 0, k, 0)
        part_legs["makes"] -= n_before
        part_legs["frame"] -= np.where(part_legs["frame"] >= 2, n_before, 0)
        records = {name: getattr(table, name) for name in ("limited", "cones", "known")}
        records = {name: array[(array["leg"] >= k) & (array["leg"] < end)] for name, array in records.items()}
        for array in records.values():
            array["leg"] -= k
        part = replace(table, forms=table.forms[k:end], legs=part_legs, recording=None, **records)
        parts.append((part, slice(k, end)))
    return tuple(parts)
