"""Rows of targets answered by the nearest feasible configurations that descents from several starts find."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Ints, Record, Records
from .._jit import routine, search
from ..closure.loops import BASE_AXES, LOCKED, PoseObjective
from ..closure.pose_objective import pose_gradient, turn_of_tilt
from ..holding import balance
from ..legs.answer import deviation, excess_of
from ..legs.poses import orthonormalise
from ..legs.records import REDUNDANT, Table
from ..legs.table import SAMPLE, open_table
from ..qp import QP, new_qp
from ..references import opener
from ..rotations import difference, yaw_difference
from ..rows import (
    CERTAIN,
    HOLD,
    HOLD_NOTHING,
    ITERATIONS,
    LIMIT_EXCESS,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    RESIDUAL,
    ROTATION_ERROR,
)
from ..sqp import scale_objective
from ..vectors import copy_row, copy_table, norm, vec
from .certificate import is_global
from .descend import descend
from .equations import PlatformState, has_proximal, new_platform_state, place
from .linearise import linearise
from .records import SETTINGS, Found, Plan, PlatformObjective, Starts
from .search import Search, copy_platform_state, fix, new_search
from .starts import begin, load_target, nearest_start, put_held, put_sides

LARGEST_NUMBER = 1.7976931348623157e308
"""Distances are finite, however far a target is."""

HOLDABLE = 1e-3
"""How near a search for what is held must come for its end to be tried with it held [L or rad]."""

SAME = 1e-7
"""Share by which a later start must come nearer to be preferred to an earlier one."""

TALLY = np.dtype(
    [
        ("least", "f8"),  # distance met [L]
        ("agreements", "f8"),  # how often it was; infinite where none is nearer
        ("disagreements", "f8"),  # how often a search ended farther away
        ("is_unbroken", "i8"),  # 1 where a search was not lost on its way
    ]
)
"""Where searches for a row have ended."""


class NearestScratch(NamedTuple):
    """Scratch memory of one thread."""

    search: Search
    best: PlatformState
    best_tally: Records  # (1,): TALLY
    phase1_tally: Records  # (1,): TALLY of searches that did not come to what is held
    distances_to_held: (
        Floats  # (1 + starts,): how far the first start, and each other, is from that; infinite where one is not lost
    )
    held: Floats  # (6,): what is held, alone, as the weights of an objective
    p: QP  # to weigh limits
    pulls: Floats  # (limits, n)


def new_nearest_scratch(table: Table, plan: Plan) -> NearestScratch:
    """Scratch memory of one thread."""
    setting, starts = plan.settings[0], plan.poses.shape[0]
    search, best = new_search(table, setting["cones"]), new_platform_state(table.legs.shape[0])
    k, n = search.first.linear.G.shape
    k, n = (k, n) if setting["steps"] == 0 else (0, 0)
    tallies = np.zeros(1, TALLY), np.zeros(1, TALLY)
    return NearestScratch(
        search, best, *tallies, np.zeros(1 + starts), np.zeros(6), new_qp(max(k, n), k), np.zeros((k, n))
    )


_PLAN = Plan(np.zeros(6), np.zeros(1, SETTINGS), np.zeros((0, 4, 4)), np.zeros((0, 0)), np.zeros((0, 0)))
open_plan, open_scratch = opener(_PLAN), opener(new_nearest_scratch(SAMPLE, _PLAN))
"""What `nearest_pose` is asked, and its scratch memory: it is given the addresses of their handles."""


@routine
def write(table: Table, row: int, objective: PoseObjective, search: Search, best: PlatformState, found: Found) -> None:
    """Write a configuration, and what is measured of it."""
    leg_eval, task, own = search.leg_eval, table.task[0], objective.targets[row]
    pose, measures, length = found.poses[row], found.measures[row], task["length"]
    orthonormalise(best.pose)
    measures[RESIDUAL] = place(table, best, leg_eval) * length
    measures[LIMIT_EXCESS] = max(excess_of(table.limited, table.cones, leg_eval.values), 0.0)
    copy_row(best.q, found.q[row])
    copy_row(best.sides, found.sides[row])
    for i in range(table.driven.shape[0]):
        driven = table.driven[i]
        found.actuators[row, driven["column"]] = driven["home"] + deviation(driven, leg_eval.values) * driven["unit"]
    copy_table(best.pose, pose)
    phase1_tally = 0.0
    for i in range(3):
        pose[i, 3] *= length
        pose[3, i] = 0.0
        phase1_tally = math.hypot(phase1_tally, pose[i, 3] - own[i, 3] if task["axes"][i] == 1 else 0.0)
    pose[3, 3] = 1.0
    measures[POSITION_ERROR] = min(phase1_tally, LARGEST_NUMBER)
    measures[ROTATION_ERROR] = turned_by(task["rotations"], best.pose, search)


@routine
def turned_by(rotations: int, pose: Floats, search: Search) -> float:
    """The angle by which a pose is turned from the target, in what counts."""
    if rotations == 3:
        difference(pose, search.target, search.gradient.turn)
        return norm(vec(search.gradient.turn))
    if rotations == 2:
        _, angle = turn_of_tilt(search.target, pose)
        return angle
    return abs(yaw_difference(pose, search.target)) if rotations == 1 else 0.0


@routine
def holds_all(objective: PoseObjective) -> bool:
    """Whether the whole pose is held."""
    free = 0
    for i in range(6):
        free += 0 if objective.platform[i] == LOCKED else 1
    return objective.frame == BASE_AXES and free == 0


@routine
def is_other_mode(legs: Records, first: Floats, sides: Floats) -> bool:
    """Whether some leg takes its other solution."""
    for k in range(sides.shape[0]):
        if (legs[k]["kind"] != REDUNDANT or legs[k]["orients"] == 1) and first[k] * sides[k] < 0.0:
            return True
    return False


@routine
def holds_some(table: Table, objective: PlatformObjective, weights: Floats) -> bool:
    """Whether some of what a target sets is to be held; what is held, alone, as the weights (6,) of an objective."""
    held, turns = 0, table.task[0]["rotations"] > 0
    for i in range(6):
        is_held = objective.pose.platform[i] == LOCKED and (i < 3 or turns)
        weights[i] = 1.0 if is_held else 0.0
        held += 1 if is_held else 0
    return held > 0 and objective.values.shape[0] == 0


@routine
def clear(tally: Record) -> None:
    """Begin a tally."""
    tally["least"], tally["agreements"], tally["disagreements"], tally["is_unbroken"] = math.inf, 0.0, 0.0, 0


@routine
def count_ending(distance: float, tally: Record, search: Search, best: PlatformState) -> None:
    """Take over where a search has ended if it is nearer, and count it."""
    least = tally["least"]
    if distance < (1.0 - SAME) * least:
        tally["disagreements"] += tally["agreements"]
        tally["least"], tally["agreements"] = distance, 1.0
        copy_platform_state(search.best, best)
        for k in range(search.holding.shape[0]):
            search.holding[k] = search.pulled[k]
    elif distance <= (1.0 + SAME) * least and least < math.inf:
        tally["agreements"] += 1.0
    else:
        tally["disagreements"] += 1.0


@routine
def is_enough(tally: Record, agreements: int) -> bool:
    """Whether searches agree often enough: as often as asked for, and once more for each that ended elsewhere."""
    return bool(tally["agreements"] >= agreements + tally["disagreements"])


@routine
def search_from(
    table: Table,
    row: int,
    objective: PlatformObjective,
    sides: Floats,
    stays: int,
    search: Search,
    best: PlatformState,
    best_tally: Record,
) -> bool:
    """Search from where `search.best` is, and take it over if it is nearer; whether it is lost.

    Parameters
    ----------
    sides : of the working mode that is to be kept, if one is.
    """
    distance = descend(table, row, objective, best_tally["least"], best, search)
    is_infeasible = distance == math.inf and (best_tally["least"] == math.inf or search.control[0]["steps"] == 0)
    if distance < math.inf:
        put_sides(table, search.best, search.leg_eval)
        if stays == 0 or not is_other_mode(table.legs, sides, search.best.sides):
            count_ending(distance, best_tally, search, best)
            best_tally["is_unbroken"] = max(best_tally["is_unbroken"], 1 - search.control[0]["is_restoring"])
            if (
                best_tally["agreements"] == 1.0
                and distance == best_tally["least"]
                and (distance == 0.0 or is_global(table, row, objective, search))
            ):
                best_tally["agreements"] = math.inf
    return is_infeasible


@routine
def search_row(
    table: Table,
    row: int,
    objective: PlatformObjective,
    phase1_objective: PlatformObjective,
    own: Starts,
    others: Starts,
    agreements: int,
    stays: int,
    scratch: NearestScratch,
) -> float:
    """The nearest configuration of a row, into `scratch.best`, and how far it is [L]; see `nearest_pose`.

    What is held is put in its place at once where searches may start anywhere, and no arms would be left behind, or
    nothing else has a place; and else brought there step by step. The other way too, where that finds nothing, or only
    after it was lost on the way. Where too few agree, searches from starts that were lost go for what is held alone,
    and then on with it held: from a feasible configuration there are more ways to it than the shortest.
    """
    search, best, best_tally, phase1_tally, distances_to_held = (
        scratch.search,
        scratch.best,
        scratch.best_tally[0],
        scratch.phase1_tally[0],
        scratch.distances_to_held,
    )
    target, n = search.target, others.poses.shape[0]
    near = -1
    first, kept = row if own.poses.shape[0] > 1 else 0, search.kept
    sides = own.sides[first]
    for k in range(kept.shape[0]):
        kept[k] = sides[k] if stays == 1 and has_proximal(table.legs[k]) else 0.0
    at_once = holds_all(objective.pose) or (n > 0 and table.task[0]["implicit"] == 0)
    clear(best_tally)
    clear(phase1_tally)
    for i in range(n + 1):
        distances_to_held[i] = math.inf
    for start in range(n + 2):
        if is_enough(best_tally, agreements) or (start == n + 1 and best_tally["is_unbroken"] == 1):
            break
        near = nearest_start(objective.pose, target, others, search.gradient) if start == 1 else near
        place = -1 if start == 0 or start == n + 1 else near if start == 1 else start - 2 + int(start - 2 >= near)
        begin(table, own if place < 0 else others, first if place < 0 else place, search)
        if stays == 1 and is_other_mode(table.legs, sides, search.best.sides):
            continue
        in_place = (start <= n) == at_once
        fix(objective.pose, in_place, search)
        if in_place:
            put_held(table, objective.pose, target, search.leg_eval, search.best)
        if (
            search_from(table, row, objective, sides, stays, search, best, best_tally)
            and phase1_objective.pose.max_iterations > 0
        ):
            search.gradient.unit[0] = 1.0
            begun = own.poses[first] if place < 0 else others.poses[place]
            distances_to_held[place + 1], _ = pose_gradient(phase1_objective.pose, target, begun, search.gradient, True)
    fix(phase1_objective.pose, False, search)
    while (
        phase1_objective.pose.max_iterations > 0
        and not is_enough(best_tally, agreements)
        and (best_tally["least"] < math.inf or not is_enough(phase1_tally, agreements))
    ):
        place = -1
        for i in range(n):
            place = i if distances_to_held[i + 1] < distances_to_held[place + 1] else place
        if distances_to_held[place + 1] == math.inf:
            break
        distances_to_held[place + 1] = math.inf
        begin(table, own if place < 0 else others, first if place < 0 else place, search)
        distance = descend(
            table,
            row,
            phase1_objective,
            phase1_tally["least"] if best_tally["least"] == math.inf else math.inf,
            best,
            search,
        )
        if distance <= HOLDABLE:
            search_from(table, row, objective, sides, stays, search, best, best_tally)
        elif best_tally["least"] == math.inf and search.control[0]["steps"] > 1:
            count_ending(distance, phase1_tally, search, best)
    least: float = best_tally["least"]
    return least


@routine
def judge(own: Record, row: int, found: Found) -> None:
    """Tell whether what counts is REACHED, and what of the target an answer has of what it was to hold, by how far it
    is: targets out of sight were not sought."""
    position, rotation = found.measures[row, POSITION_ERROR], found.measures[row, ROTATION_ERROR]
    is_there = position <= own["position"] and rotation <= own["rotation"]
    is_held = position <= own["held_position"] and rotation <= own["held_rotation"]
    found.status[row] = REACHED if is_there else PROJECTED
    found.counters[row, HOLD] = own["hold"] if is_held else HOLD_NOTHING


@routine
def weigh(
    table: Table, row: int, objective: PlatformObjective, own: Starts, scratch: NearestScratch, weights: Floats
) -> None:
    """Fill how hard every limit holds a row back where it starts, see `nearest_pose`."""
    search, linear = scratch.search, scratch.search.first.linear
    begin(table, own, row, search)
    fix(objective.pose, True, search)
    search.gradient.unit[0] = 1.0
    linearise(table, row, objective, search.best, search, search.first)
    scale_objective(linear)
    for c in range(balance(linear, objective.pose.near, scratch.p, scratch.pulls)):
        weights[linear.which[c]] = scratch.p.x[c]


@search
def nearest_pose(
    machine: int,
    plan: int,
    scratch_address: int,
    targets: Floats,
    values: Floats,
    begins: Floats,
    q: Floats,
    sides: Floats,
    distances: Floats,
    ends: Floats,
    ends_q: Floats,
    ends_sides: Floats,
    counters: Ints,
    actuators: Floats,
    measures: Floats,
    status: Ints,
    weights: Floats,
) -> int:
    """Fill the nearest feasible configuration of every row.

    With no steps to take, fill `weights` instead, (n, 2 ranges + cones + legs): how hard every limit holds each row
    back where it starts, as of `closure.descend.nearest_pose`.

    Parameters
    ----------
    machine : see `open_table`.
    plan : the address of a `Plan`.
    scratch : that of `NearestScratch`, made for both.
    targets, values : see `PlatformObjective`.
    begins, q, sides : the first start of each row, or one for all, as of `Starts`; the others follow until the nearest
        configuration has been met often enough: `is_enough`.
    distances, ends, ends_q, ends_sides, counters, actuators, measures, status : `Found`.

    Returns
    -------
    How many rows have no answer.
    """
    table, asked = open_table(machine), open_plan(plan)
    setting, own, left = asked.settings[0], Starts(begins, q, sides), 0
    others, found = (
        Starts(asked.poses, asked.q, asked.sides),
        Found(distances, ends, ends_q, ends_sides, counters, actuators, measures, status),
    )
    scratch = open_scratch(scratch_address)
    search, best, held = scratch.search, scratch.best, scratch.held
    frame, margin, near, weighs = setting["frame"], setting["margin"], setting["near"], setting["steps"] == 0
    pose = PoseObjective(targets, asked.weights, frame, margin, near, setting["steps"])
    objective = PlatformObjective(pose, values, setting["implied"])
    steps = setting["steps"] if holds_some(table, objective, held) else 0
    phase1_objective = PlatformObjective(
        PoseObjective(targets, held, frame, margin, near, steps), values, setting["implied"]
    )
    for row in range(distances.shape[0]):
        distances[row] = math.inf
        if not load_target(table, pose, row, search):
            left += 1
            continue
        if weighs:
            weigh(table, row, objective, own, scratch, weights[row])
            continue
        least = search_row(
            table, row, objective, phase1_objective, own, others, setting["agreements"], setting["stays"], scratch
        )
        distances[row] = least
        if least < math.inf:
            counters[row, ITERATIONS] = search.control[0]["steps"]
            write(table, row, pose, search, best, found)
            judge(setting, row, found)
            counters[row, HOLD] += CERTAIN if scratch.best_tally[0]["agreements"] == math.inf else 0
        else:
            left += 1
    return left
