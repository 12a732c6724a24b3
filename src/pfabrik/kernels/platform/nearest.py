"""Rows of targets answered by the nearest feasible configurations that descents from several starts find."""

from __future__ import annotations

import math

import numpy as np

from .._jit import kernel, routine, search
from ..closure.loops import BASE_AXES, LOCKED, PoseObjective
from ..closure.pose_objective import turn_of_tilt
from ..holding import balance
from ..legs.answer import deviation, excess_of
from ..legs.poses import make_exact
from ..legs.records import ARM, PIVOT, SLIDE, Floats, Records, Table
from ..legs.table import open_table
from ..qp import new_qp
from ..rotations import difference, yaw_difference
from ..rows import LIMIT_EXCESS, POSITION_ERROR, RESIDUAL, ROTATION_ERROR
from ..sqp import STEPS, scale_objective
from ..vectors import copy_row, copy_table, norm, vec
from .descend import descend
from .equations import Now, is_carried, new_now, new_view, place
from .linearise import linearise
from .records import Aim, Found, Starts
from .search import Search, copy_now, fix, new_search
from .starts import begin, load_target, nearest_start, put_held, put_sides

LARGEST_NUMBER = 1.7976931348623157e308
"""Distances are finite, however far a target is."""

SAME = 1e-7
"""Share by which a later start must come nearer to be preferred to an earlier one."""


@kernel
def read_configurations(machine: int, poses: Floats, q: Floats, sides: Floats, found: Floats) -> None:
    """Fill deviations from home [length or rad], `found` (n, columns), of the coordinates that legs tell.

    Parameters
    ----------
    machine : see `open_table`.
    poses, q, sides : as of `Found`.
    """
    table = open_table(machine)
    now, look, known = new_now(table.legs.shape[0]), new_view(table), table.known
    for row in range(poses.shape[0]):
        copy_table(poses[row], now.pose)
        copy_row(q[row], now.q)
        copy_row(sides[row], now.sides)
        place(table, now, look)
        for i in range(known.shape[0]):
            found[row, known[i]["column"]] = deviation(known[i], look.values) * known[i]["unit"]


@routine
def write(table: Table, row: int, aim: PoseObjective, search: Search, best: Now, found: Found) -> None:
    """Write a configuration, and what is measured of it."""
    look, task, own = search.look, table.task[0], aim.targets[row]
    pose, measures, length = found.poses[row], found.measures[row], task["length"]
    make_exact(best.pose)
    measures[RESIDUAL] = place(table, best, look) * length
    measures[LIMIT_EXCESS] = max(excess_of(table.limited, table.cones, look.values), 0.0)
    copy_row(best.q, found.q[row])
    copy_row(best.sides, found.sides[row])
    for i in range(table.driven.shape[0]):
        driven = table.driven[i]
        found.actuators[row, driven["column"]] = driven["home"] + deviation(driven, look.values) * driven["unit"]
    copy_table(best.pose, pose)
    away = 0.0
    for i in range(3):
        pose[i, 3] *= length
        pose[3, i] = 0.0
        away = math.hypot(away, pose[i, 3] - own[i, 3] if task["axes"][i] == 1 else 0.0)
    pose[3, 3] = 1.0
    measures[POSITION_ERROR] = min(away, LARGEST_NUMBER)
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
def is_global(table: Table, aim: PoseObjective, search: Search) -> bool:
    """Whether no feasible configuration is nearer than where a descent has ended.

    So if the Lagrangian of what holds it there is convex: with the orientation held and all legs struts, the bounds of
    a strut s = |o| are (s^2 - hi^2) / 2 hi and (lo^2 - s^2) / 2 lo, with the gradients of s - hi and lo - s; a cone of
    at most a right angle is convex; and the distance outweighs the least lengths if the sum of their multipliers, each
    over its length, is below 1.
    """
    if (
        aim.frame != BASE_AXES
        or aim.platform[3] != LOCKED
        or search.force.shape[0] > 6
        or search.look.rows.shape[0] > 0
    ):
        return False
    for i in range(3):
        if aim.platform[i] != 1.0:
            return False
    multipliers, pull, ranges = search.hessian.multipliers, 0.0, table.limited.shape[0]
    for i in range(ranges):
        limited = table.limited[i]
        leg = table.legs[limited["leg"]]
        if leg["kind"] != PIVOT and limited["place"] == SLIDE:
            pull += multipliers[2 * i] / (leg["length"] + limited["lo"])
        elif multipliers[2 * i] + multipliers[2 * i + 1] > 0.0:
            return False
    for i in range(table.cones.shape[0]):
        if multipliers[2 * ranges + i] > 0.0 and table.cones[i]["half_angle"] > 0.5 * math.pi:
            return False
    return bool(pull < search.gradient.unit[0])


@routine
def holds_all(aim: PoseObjective) -> bool:
    """Whether the whole pose is held."""
    free = 0
    for i in range(6):
        free += 0 if aim.platform[i] == LOCKED else 1
    return aim.frame == BASE_AXES and free == 0


@routine
def is_other_mode(legs: Records, first: Floats, sides: Floats) -> bool:
    """Whether some leg takes its other solution."""
    for k in range(sides.shape[0]):
        if (legs[k]["kind"] != ARM or legs[k]["by_plane"] == 1) and first[k] * sides[k] < 0.0:
            return True
    return False


@routine
def search_row(
    table: Table, row: int, aim: Aim, own: Starts, others: Starts, hits: int, stays: int, search: Search, best: Now
) -> float:
    """The nearest configuration of a row, into `best`, and how far it is [L]; see `approach`.

    What is held is put in its place at once where searches may start anywhere, and no arms would be left behind, or
    nothing else has a place; and else brought there step by step. The other way too, where that finds nothing.
    """
    least, met, target, n = math.inf, 0, search.target, others.poses.shape[0]
    near = nearest_start(aim.pose, target, others, search.gradient)
    first, kept = row if own.poses.shape[0] > 1 else 0, search.kept
    for k in range(kept.shape[0]):
        kept[k] = own.sides[first, k] if stays == 1 and is_carried(table.legs[k]) else 0.0
    at_once = holds_all(aim.pose) or (n > 0 and table.task[0]["led"] == 0)
    for start in range(n + 2):
        if start == 0 or start == n + 1:
            begin(table, own, first, search)
        else:
            begin(table, others, near if start == 1 else (start - 2 if start - 2 < near else start - 1), search)
        if start == n + 1 and least < math.inf:
            break
        if stays == 1 and is_other_mode(table.legs, own.sides[first], search.best.sides):
            continue
        in_place = (start <= n) == at_once
        fix(aim.pose, in_place, search)
        if in_place:
            put_held(table, aim.pose, target, search.look, search.best)
        distance = descend(table, row, aim, least, best, search)
        if distance < math.inf:
            put_sides(table, search.best, search.look)
            if stays == 1 and is_other_mode(table.legs, own.sides[first], search.best.sides):
                distance = math.inf
        if distance < (1.0 - SAME) * least:
            least, met = distance, 1
            copy_now(search.best, best)
        elif distance <= (1.0 + SAME) * least and least < math.inf:
            met += 1
        if met >= hits or (met == 1 and distance == least and is_global(table, aim.pose, search)):
            break
    return least


@search
def approach(
    machine: int,
    aim: Aim,
    own: Starts,
    others: Starts,
    hits: int,
    stays: int,
    cones: int,
    found: Found,
    weights: Floats,
) -> None:
    """Fill the nearest feasible configuration of every row.

    With no steps to take, fill `weights` instead, (n, 2 ranges + cones + legs): how hard every limit holds each row
    back where it starts, as of `closure.descend.approach`.

    Parameters
    ----------
    machine : see `open_table`.
    own : the first start of each row, or one for all.
    others : starts that follow, for any row, until the nearest configuration has been met as often as `hits` says.
    stays : 1 for configurations in the working mode of a row's first start alone.
    cones : how many of the cones searches mind, the first ones; excesses over all of them are told.
    """
    table = open_table(machine)
    search, best = new_search(table, cones), new_now(table.legs.shape[0])
    k, n = search.first.linear.G.shape
    p, pulls = new_qp(k, k), np.zeros((k, n))
    for row in range(found.distances.shape[0]):
        found.distances[row] = math.inf
        if not load_target(table, aim.pose, row, search):
            continue
        if aim.pose.max_iterations == 0:
            begin(table, own, row, search)
            fix(aim.pose, True, search)
            search.gradient.unit[0] = 1.0
            linearise(table, row, aim, search.best, search, search.first)
            scale_objective(search.first.linear)
            for c in range(balance(search.first.linear, aim.pose.near, p, pulls)):
                weights[row, search.first.linear.which[c]] = p.x[c]
            continue
        least = search_row(table, row, aim, own, others, hits, stays, search, best)
        found.distances[row] = least
        found.steps[row] = search.control.counts[STEPS]
        if least < math.inf:
            write(table, row, aim.pose, search, best, found)
