"""The nearest feasible pose of each target, by a multistart of descents."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Record, Records
from .._jit import opener, routine, search
from ..clearance.link_limits import links_excess
from ..clearance.link_records import NO_LINKS
from ..holding import limit_multipliers
from ..joints.linearise_loops import turn_of_tilt
from ..joints.loops import BASE_AXES, LOCKED, PoseObjective
from ..legs.answer import deviation, excess_of
from ..legs.complete_poses import orthonormalise
from ..legs.records import SAMPLE, Table, open_table
from ..projecting import (
    TALLY,
    UNBOUNDED,
    clear_tally,
    count_effort,
    count_ending,
    is_agreed,
    is_over,
    is_spent,
    seed_of,
)
from ..qp import QP, new_qp
from ..quaternions import difference, yaw_difference
from ..rows import (
    CERTAIN,
    HOLD,
    HOLD_NOTHING,
    ITERATIONS,
    LARGEST_NUMBER,
    LIMIT_EXCESS,
    PENDING,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    RESIDUAL,
    ROTATION_ERROR,
)
from ..search_constants import CLOSED
from ..sqp import scale_objective
from ..vectors import copy_row, copy_table, norm, vec
from .certificate import cost_of_hold, is_global, may_be_global, put_forces
from .descend_pose import descend
from .equations import PlatformState, evaluate_legs, has_proximal, new_platform_state
from .limits import place_links
from .linearise import linearise
from .search import SearchScratch, copy_platform_state, fix_held, new_search_scratch
from .search_records import SETTINGS, Along, MultistartPlan, PlatformObjective, PoseSolutions, RowSearch, Starts
from .starts import load_start, load_target, nearest_start, place_held, put_sides, take_along, way_along


class NearestScratch(NamedTuple):
    """Scratch memory of one thread."""

    search: SearchScratch
    best: PlatformState
    best_tally: Records  # (1,): TALLY
    p: QP  # for the multipliers of limits
    natural_gradients: Floats  # (limits, n): inverse metric times the gradients of active limits


def new_nearest_scratch(table: Table, plan: MultistartPlan, weighs_limits: bool) -> NearestScratch:
    """Allocate the scratch memory of one thread, for the multipliers of limits too where these are asked for."""
    search, best = new_search_scratch(table, plan.links), new_platform_state(table.legs.shape[0])
    k, n = search.first.linear.G.shape if weighs_limits else (0, 0)
    return NearestScratch(search, best, np.zeros(1, TALLY), new_qp(max(k, n), k), np.zeros((k, n)))


NO_STARTS = Starts(np.zeros((0, 4, 4)), np.zeros((0, 0)), np.zeros((0, 0)))
PLAN = MultistartPlan(
    np.zeros((1, 6)),
    np.zeros(1, SETTINGS),
    NO_STARTS,
    Along(np.zeros((3, 3)), np.zeros((0, 3)), np.zeros((0, 2))),
    NO_LINKS,
)
open_plan, open_scratch = opener(PLAN), opener(new_nearest_scratch(SAMPLE, PLAN, False))
"""The plan and scratch memory of `nearest_pose` at the addresses of their handles."""


@routine
def write_solution(
    table: Table,
    row: int,
    objective: PoseObjective,
    search: SearchScratch,
    best: PlatformState,
    solutions: PoseSolutions,
) -> None:
    """Write a configuration and its measures."""
    leg_eval, task, target = search.leg_eval, table.task[0], objective.targets[row]
    pose, measures, length = solutions.poses[row], solutions.measures[row], task["length"]
    orthonormalise(best.pose)
    measures[RESIDUAL] = evaluate_legs(table, best, leg_eval) * length
    measures[LIMIT_EXCESS] = max(excess_of(table.limited, table.cones, leg_eval.values), 0.0)
    copy_row(best.q, solutions.q[row])
    copy_row(best.sides, solutions.sides[row])
    for i in range(table.driven.shape[0]):
        driven = table.driven[i]
        solutions.actuators[row, driven["column"]] = (
            driven["home"] + deviation(driven, leg_eval.values) * driven["unit"]
        )
    copy_table(best.pose, pose)
    distance = 0.0
    for i in range(3):
        pose[i, 3] *= length
        pose[3, i] = 0.0
        distance = math.hypot(distance, pose[i, 3] - target[i, 3] if task["axes"][i] == 1 else 0.0)
    pose[3, 3] = 1.0
    measures[POSITION_ERROR] = min(distance, LARGEST_NUMBER)
    measures[ROTATION_ERROR] = turned_by(task["rotations"], best.pose, search.target, search.gradient.turn)


@routine
def turned_by(rotations: int, pose: Floats, target: Floats, turn: Floats) -> float:
    """Angle of a pose from a target, in the rotations that the task sets [rad]; `turn` is scratch memory."""
    if rotations == 3:
        difference(pose, target, turn)
        return norm(vec(turn))
    if rotations == 2:
        _, angle = turn_of_tilt(target, pose)
        return angle
    return abs(yaw_difference(pose, target)) if rotations == 1 else 0.0


@routine
def holds_all(objective: PoseObjective) -> bool:
    """True if the whole pose is held."""
    n_free = 0
    for i in range(6):
        n_free += 0 if objective.platform[i] == LOCKED else 1
    return objective.frame == BASE_AXES and n_free == 0


@routine
def has_rotation(objective: PoseObjective, search: SearchScratch) -> bool:
    """True if the rotation is all that is held, and `search.best` has it: as of a platform that does not turn."""
    pose, target = search.best.pose, search.target
    if objective.frame != BASE_AXES or objective.platform[3] != LOCKED:
        return False
    for i in range(3):
        if objective.platform[i] == LOCKED:
            return False
        for j in range(3):
            if abs(pose[i, j] - target[i, j]) > CLOSED:
                return False
    return True


@routine
def is_other_mode(legs: Records, own_sides: Floats, sides: Floats) -> bool:
    """True if some leg takes its other side."""
    for k in range(sides.shape[0]):
        if legs[k]["implicit"] == 0 and own_sides[k] * sides[k] < 0.0:
            return True
    return False


@routine
def keep_ending(distance: float, tally: Record, search: SearchScratch, best: PlatformState) -> None:
    """Count the end of a search in a tally, and keep its configuration in `best` if it is nearer."""
    if count_ending(distance, tally):
        copy_platform_state(search.best, best)
        for k in range(search.blocking.shape[0]):
            search.blocking[k] = search.involved[k]


@routine
def search_from(
    table: Table,
    row: int,
    objective: PlatformObjective,
    sides: Floats,
    stays: int,
    scratch: NearestScratch,
) -> None:
    """Descend from `search.best` and count the end by `keep_ending`.

    Parameters
    ----------
    sides : of the working mode to be kept, if `stays` is 1.
    """
    search, best, best_tally = scratch.search, scratch.best, scratch.best_tally[0]
    distance = descend(table, row, objective, best_tally["least"], best, search)
    count_effort(search.control[0]["steps"], search.effort[0])
    if distance == math.inf:
        return
    put_sides(table, search.best, search.leg_eval)
    if stays == 1 and is_other_mode(table.legs, sides, search.best.sides):
        return
    keep_ending(distance, best_tally, search, best)
    best_tally["is_unbroken"] = max(best_tally["is_unbroken"], 1 - search.control[0]["is_restoring"])
    if not (best_tally["agreements"] == 1.0 and distance == best_tally["least"]):
        return
    is_bounded, pose = may_be_global(objective, search), objective.pose
    is_held = pose.hold != HOLD_NOTHING and pose.price == 0.0
    best_tally["cost"] = 0.0 if distance == 0.0 else math.inf
    if distance > 0.0 and (is_bounded or is_held):
        is_known = put_forces(table, row, objective, search)
        is_bounded = is_bounded and is_known
        if is_held and is_known:
            best_tally["cost"] = cost_of_hold(pose, distance, search)
    if distance == 0.0 or (is_bounded and is_global(table, search)):
        best_tally["agreements"] = math.inf


@routine
def search_row(
    table: Table,
    row: int,
    objective: PlatformObjective,
    starts: Starts,
    plan: MultistartPlan,
    n_seeds: int,
    agreements: int,
    stays: int,
    scratch: NearestScratch,
) -> float:
    """The nearest configuration of a row, into `scratch.best`, and its distance [L].

    Searches begin at its own start, then at so many seeds, the nearest to the target first.

    A part that is held at any price, or where there are seeds, is put in place at once, but with implicit joints;
    otherwise descents bring it there. The other of the two ways is tried last, if the first finds nothing or needed
    restoration.
    """
    search, best_tally, effort = scratch.search, scratch.best_tally[0], scratch.search.effort[0]
    seeds, along = plan.seeds, plan.along
    nearest_seed, by = -1, way_along(table, objective.pose, search.target, along)
    own_start, kept_sides = row if starts.poses.shape[0] > 1 else 0, search.kept_sides
    sides = starts.sides[own_start]
    for k in range(kept_sides.shape[0]):
        kept_sides[k] = sides[k] if stays == 1 and has_proximal(table.legs[k]) else 0.0
    is_held = objective.pose.hold != HOLD_NOTHING and objective.pose.price == 0.0
    is_placed_first = holds_all(objective.pose) or ((n_seeds > 0 or is_held) and table.task[0]["implicit"] == 0)
    clear_tally(best_tally)
    for start in range(n_seeds + 2):
        if is_agreed(best_tally, agreements) or (start == n_seeds + 1 and best_tally["is_unbroken"] == 1):
            break
        if is_spent(effort) or is_over(effort):
            break
        if start == 1 and n_seeds > 0:
            nearest_seed = nearest_start(objective.pose, by, seeds, search)
        seed = seed_of(start, n_seeds, nearest_seed)
        load_start(table, starts if seed < 0 else seeds, own_start if seed < 0 else seed, search)
        if seed >= 0:
            take_along(by, along, search.best)
        if stays == 1 and is_other_mode(table.legs, sides, search.best.sides):
            continue
        is_in_place = (start <= n_seeds) == is_placed_first
        fix_held(objective.pose, is_in_place or has_rotation(objective.pose, search), search)
        if is_in_place:
            place_held(table, objective.pose, search.target, search.leg_eval, search.best)
        search_from(table, row, objective, sides, stays, scratch)
        if start == 0 and best_tally["least"] < math.inf:
            best_tally["from_start"] = 1
    least: float = best_tally["least"]
    return least


@routine
def set_status(setting: Record, row: int, solutions: PoseSolutions) -> None:
    """Set the status of a row; record whether the held part is met within tolerance.

    Both go by the measured errors, for targets beyond sight are brought nearer before the search.
    """
    position, rotation = solutions.measures[row, POSITION_ERROR], solutions.measures[row, ROTATION_ERROR]
    is_reached = position <= setting["position"] and rotation <= setting["rotation"]
    is_held = position <= setting["held_position"] and rotation <= setting["held_rotation"]
    solutions.status[row] = REACHED if is_reached else PROJECTED
    solutions.counters[row, HOLD] = setting["hold"] if is_held else HOLD_NOTHING


@routine
def pose_objective(plan: MultistartPlan, aim: int, targets: Floats, steps: int) -> PoseObjective:
    """One of the plan's objectives, of targets, in so many steps."""
    setting = plan.settings[aim]
    return PoseObjective(
        targets,
        plan.weights[aim],
        setting["frame"],
        setting["hold"],
        setting["price"],
        setting["rounding"],
        setting["margin"],
        setting["near"],
        steps,
    )


@routine
def put_limit_multipliers(
    table: Table, row: int, objective: PlatformObjective, starts: Starts, scratch: NearestScratch, weights: Floats
) -> None:
    """Fill the multipliers of all limits where a row starts; see `nearest_pose`."""
    search, linear = scratch.search, scratch.search.first.linear
    load_start(table, starts, row, search)
    fix_held(objective.pose, True, search)
    search.gradient.unit[0] = 1.0
    linearise(table, row, objective, search.best, search, search.first)
    scale_objective(linear)
    for c in range(limit_multipliers(linear, objective.pose.near, scratch.p, scratch.natural_gradients)):
        weights[linear.which[c]] = scratch.p.x[c]


@routine
def nearest_of_row(
    table: Table,
    plan: MultistartPlan,
    asked: RowSearch,
    targets: Floats,
    values: Floats,
    starts: Starts,
    solutions: PoseSolutions,
    scratch: NearestScratch,
    weights: Floats,
) -> float:
    """Fill the nearest feasible configuration of a row by one of the plan's objectives; its distance [L].

    Where it ends beyond a cone that was not constrained, it is searched for again with all cones: constraining those
    that limit where crossed hinges can point their rods may stop a search early. So it is with links that are too near:
    of what keeps the limits, the nearest that keeps links apart unasked is the nearest of all that keep them apart.
    """
    setting, search, links, row = plan.settings[asked.aim], scratch.search, scratch.search.links, asked.row
    pose = pose_objective(plan, asked.aim, targets, min(setting["steps"], asked.most_steps))
    objective = PlatformObjective(pose, values, setting["implied"])
    solutions.distances[row] = math.inf
    if not load_target(table, pose, row, search):
        return math.inf
    n_seeds, least = min(plan.seeds.poses.shape[0], asked.most_seeds), math.inf
    n_cones, n_pairs = setting["cones"], links.kept[0]
    search.n_cones[0] = n_cones
    if setting["steps"] == 0:
        links.kept[0] = links.pairs.shape[0]
        put_limit_multipliers(table, row, objective, starts, scratch, weights[row])
        return math.inf
    for _attempt in range(4):
        least = search_row(
            table,
            row,
            objective,
            starts,
            plan,
            n_seeds,
            setting["agreements"],
            asked.stays,
            scratch,
        )
        solutions.distances[row] = least
        if least == math.inf:
            solutions.status[row] = PENDING
            break
        solutions.counters[row, ITERATIONS] = search.control[0]["steps"]
        write_solution(table, row, pose, search, scratch.best, solutions)
        set_status(setting, row, solutions)
        solutions.counters[row, HOLD] += CERTAIN if scratch.best_tally[0]["agreements"] == math.inf else 0
        place_links(table, search.links, search.leg_eval.frames, search.leg_eval.values)
        excess, over = solutions.measures[row, LIMIT_EXCESS], links_excess(search.links)
        solutions.measures[row, LIMIT_EXCESS] = max(excess, over)
        is_beyond = n_cones < table.cones.shape[0] and excess > setting["limit"]
        is_near = links.kept[0] < links.pairs.shape[0] and over > setting["limit"]
        if not (is_beyond or is_near):
            break
        n_cones = table.cones.shape[0] if is_beyond else setting["cones"]
        search.n_cones[0] = n_cones
        links.kept[0] = links.kept[0] if is_beyond else links.pairs.shape[0]
    links.kept[0] = n_pairs
    return least


@search
def nearest_pose(
    machine: int,
    plan_address: int,
    scratch_address: int,
    targets: Floats,
    values: Floats,
    starts: Starts,
    solutions: PoseSolutions,
    weights: Floats,
) -> int:
    """Fill the nearest feasible configuration of every row, by the first objective of the plan, with links kept apart.

    With no steps to take, fill `weights` instead, (n, 2 ranges + cones + legs + pairs of links): the
    multipliers of the limits where each row starts, as in `joints.descend.nearest_configuration`.

    Parameters
    ----------
    machine, plan_address : addresses of the kernel table and of `MultistartPlan`.
    scratch_address : that of `NearestScratch`, allocated for both.
    targets, values : as in `PlatformObjective`.
    starts : the own start of each row, or one for all; the seeds of the plan follow until enough searches agree, as in
        `is_agreed`.

    Returns
    -------
    The number of rows without a solution.
    """
    table, plan, scratch, n_unsolved = open_table(machine), open_plan(plan_address), open_scratch(scratch_address), 0
    stays = plan.settings[0]["stays"]
    scratch.search.links.kept[0] = scratch.search.links.pairs.shape[0]
    for row in range(solutions.distances.shape[0]):
        asked = RowSearch(row, 0, UNBOUNDED, UNBOUNDED, stays)
        least = nearest_of_row(table, plan, asked, targets, values, starts, solutions, scratch, weights)
        n_unsolved += 1 if least == math.inf else 0
    return n_unsolved
