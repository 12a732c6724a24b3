"""Inverse kinematics of one target: legs in closed form, in any mode if need be, then the nearest feasible pose."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record, Records
from .._jit import routine
from ..clearance.link_limits import links_excess
from ..legs.answer import Completion, answer_on_sides, place_legs
from ..legs.complete_poses import is_pose, read_target
from ..legs.frames import set_frames
from ..legs.records import Table
from ..projecting import COARSE, HELD, PRICED, UNBOUNDED, begin_effort, is_agreed, priced_distance, weighted_distance
from ..rows import (
    CERTAIN,
    HOLD,
    HOLD_NOTHING,
    HOLD_POSITION,
    INVALID,
    ITERATIONS,
    OPEN,
    PENDING,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    ROTATION_ERROR,
    TOO_NEAR,
    UNSURE,
)
from ..search_constants import BESIDE, SAME_DISTANCE, TURNED, WORTH
from ..vectors import copy_row, copy_table
from .any_mode import answer_in_any_mode, count_changes, note_choices, put_changed
from .limits import are_on_legs, place_links
from .nearest import NearestScratch, nearest_of_row, pose_objective, put_limit_multipliers, turned_by
from .pose_constants import MOST_CHANGED, MOST_CHOICES, NEARLY
from .redundant_sets import search_sets
from .search_records import PlatformObjective, PoseSolutions, RowSearch, Starts
from .starts import load_target
from .tables import (
    BY_LEGS,
    IN_OTHER_ASSEMBLIES,
    IN_OTHER_MODES,
    NEAREST,
    AnswerScratch,
    Start,
    Tables,
)

FARTHEST_TURN = 1e9
"""Largest angle that is counted in turns [rad]: the number of turns is then a number of 32 bits, too."""


@routine
def nearest_turn(driven: Record, value: float, near: float) -> tuple[float, bool]:
    """The value of an actuator moved by whole turns to where it is nearest to another; itself if out of its range."""
    turned = value
    if abs(near - value) < FARTHEST_TURN:
        turned = value + 2.0 * math.pi * round((near - value) / (2.0 * math.pi))
    is_inside = turned >= driven["home"] + driven["lo"] and turned <= driven["home"] + driven["hi"]
    return (turned, True) if is_inside and abs(near - turned) < FARTHEST_TURN else (value, False)


@routine
def turns_repeatedly(driven: Record) -> bool:
    """True if an actuator may turn more than once."""
    return bool(driven["turns"] == 1 and driven["hi"] - driven["lo"] > 2.0 * math.pi)


@routine
def count_turns(driven: Records, start_values: Floats, values: Floats) -> None:
    """Add whole turns to actuators that may turn more than once: nearest to the start's values (n_a,)."""
    for i in range(driven.shape[0]):
        column = driven[i]["column"]
        if turns_repeatedly(driven[i]):
            values[column], _ = nearest_turn(driven[i], values[column], start_values[column])


@routine
def put_start(start: Start, answer: PoseSolutions) -> None:
    """Fill an answer that is not solved yet with the sides of its start."""
    q, counters, measures = answer.q, answer.counters, answer.measures
    copy_row(start.sides[0], answer.sides[0])
    answer.distances[0] = math.inf
    for k in range(q.shape[1]):
        q[0, k] = math.nan
    for k in range(counters.shape[1]):
        counters[0, k] = 0
    for k in range(measures.shape[1]):
        measures[0, k] = 0.0


@routine
def stay_at_start(tables: Tables, scratch: AnswerScratch, start: Start, target: Floats, answer: PoseSolutions) -> int:
    """Fill an answer with its start; the status."""
    measures, setting = answer.measures, tables.plan.settings[0]
    put_start(start, answer)
    copy_table(start.poses[0], answer.poses[0])
    copy_row(start.actuators[0], answer.actuators[0])
    distance, angle = errors(tables.legs.task[0], target, start.poses[0], scratch.nearest.search.gradient.turn)
    measures[0, POSITION_ERROR], measures[0, ROTATION_ERROR] = distance * tables.legs.task[0]["length"], angle
    is_reached = measures[0, POSITION_ERROR] <= setting["position"] and angle <= setting["rotation"]
    return REACHED if is_reached else PROJECTED


@routine
def copy_solution(source: PoseSolutions, to: PoseSolutions) -> None:
    """Copy an answer."""
    counters = to.counters
    to.distances[0], to.status[0] = source.distances[0], source.status[0]
    copy_table(source.poses[0], to.poses[0])
    copy_row(source.q[0], to.q[0])
    copy_row(source.sides[0], to.sides[0])
    copy_row(source.actuators[0], to.actuators[0])
    copy_row(source.measures[0], to.measures[0])
    for k in range(counters.shape[1]):
        counters[0, k] = source.counters[0, k]


@routine
def load_own(pose: Floats, length: float, to: Floats) -> None:
    """Fill a pose (4, 4) [L] with one in [length]."""
    scale = 1.0 / length
    copy_table(pose, to)
    for i in range(3):
        to[i, 3] *= scale


@routine
def errors(task: Record, target: Floats, pose: Floats, turn: Floats) -> tuple[float, float]:
    """Distance [L] and angle [rad] of a pose from a target, both in [length], in what the task sets."""
    distance = 0.0
    for i in range(3):
        distance = math.hypot(distance, pose[i, 3] - target[i, 3] if task["axes"][i] == 1 else 0.0)
    return distance / task["length"], turned_by(task["rotations"], pose, target, turn)


@routine
def is_on_target(tables: Tables, target: Floats, pose: Floats, turn: Floats) -> bool:
    """True if a start is on its target already."""
    task, machine, farthest = tables.legs.task[0], tables.machine[0], 0.0
    for i in range(3):
        farthest = max(farthest, abs(target[i, 3] - pose[i, 3]) if task["axes"][i] == 1 else 0.0)
    if not farthest <= machine["position"] * task["length"]:
        return False
    return bool(turned_by(task["rotations"], pose, target, turn) <= machine["rotation"])


@routine
def reach_from(
    table: Table, target: Floats, begin: Floats, sides: Floats, scratch: Completion, answer: PoseSolutions
) -> int:
    """Solve a target by legs on given sides, completed from a pose [length]; the status, and outputs if REACHED."""
    return answer_on_sides(
        table, target, begin, sides, scratch, answer.poses[0], answer.actuators[0], answer.measures[0]
    )


@routine
def are_apart(tables: Tables, scratch: AnswerScratch, pose: Floats, sides: Floats) -> bool:
    """True if no links are nearer than the clearance, with legs on given sides (legs,) at a pose [length]."""
    table, links, own = tables.legs, scratch.nearest.search.links, scratch.completion
    if links.pairs.shape[0] == 0:
        return True
    load_own(pose, table.task[0]["length"], own.pose)
    set_frames(own.pose, table.task[0], own.frames)
    if are_on_legs(links):
        place_legs(table.legs, own.frames, sides, own.values, own.lines)
    place_links(table, scratch.nearest.search.links, own.frames, own.values)
    return bool(links_excess(links) <= tables.plan.settings[0]["limit"])


@routine
def reach_at_start(
    tables: Tables, scratch: AnswerScratch, start: Start, target: Floats, question: Record, answer: PoseSolutions
) -> int:
    """Solve a target by legs on the sides of the start; from home with free redundant joints at rest."""
    if question["has_start"] == 0 and tables.machine[0]["rests"] == 1:
        copy_row(tables.resting.actuators[0], answer.actuators[0])
        return reach_from(tables.resting.legs, target, start.poses[0], tables.resting.sides[0], scratch.resting, answer)
    table = tables.near if question["keeps_mode"] == 1 else tables.legs
    return reach_from(table, target, start.poses[0], answer.sides[0], scratch.completion, answer)


@routine
def reach_by_redundant(
    tables: Tables,
    scratch: AnswerScratch,
    table: Table,
    targets: Floats,
    begin: Floats,
    question: Record,
    answer: PoseSolutions,
) -> int:
    """Solve a target by legs whose free redundant joints move from where the sides of the answer have them.

    Parameters
    ----------
    begin : the pose where a search starts, (4, 4) [length].
    """
    sets, spare, moved, own, pose = tables.sets, scratch.sets, scratch.moved[0], scratch.own, scratch.home[0]
    status = PENDING
    copy_row(answer.sides[0], moved)
    load_own(begin, table.task[0]["length"], own[0])
    if search_sets(sets, spare, targets, own, question, moved, pose):
        status = reach_from(table, targets[0], pose, moved, scratch.completion, answer)
    if status == REACHED:
        copy_row(moved, answer.sides[0])
    return status


@routine
def reach_moved(
    tables: Tables, scratch: AnswerScratch, start: Start, targets: Floats, question: Record, answer: PoseSolutions
) -> int:
    """Solve a target with free redundant joints moved: from the start; then from home, where limits bar that way."""
    table, legs, sides = tables.near if question["keeps_mode"] == 1 else tables.legs, tables.legs.legs, answer.sides
    status = reach_by_redundant(tables, scratch, table, targets, start.poses[0], question, answer)
    if status == REACHED or question["has_start"] == 0 or question["keeps_mode"] == 1:
        return status
    for k in range(legs.shape[0]):
        if legs[k]["implicit"] == 1:
            sides[0, k] = tables.home.sides[0, k]
    status = reach_by_redundant(tables, scratch, table, targets, tables.home.poses[0], question, answer)
    if status != REACHED:
        copy_row(start.sides[0], sides[0])
    return status


@routine
def reach_in_other_mode(
    tables: Tables, scratch: AnswerScratch, start: Start, target: Floats, answer: PoseSolutions
) -> int:
    """Solve a target by legs on other sides than those of the start; as `answer_in_any_mode`."""
    sides = scratch.other.sides[0]
    copy_row(start.sides[0], sides)
    status = answer_in_any_mode(
        tables.legs,
        target,
        start.poses[0],
        sides,
        scratch.misfits,
        scratch.choices,
        scratch.completion,
        answer,
    )
    if status == REACHED:
        copy_row(sides, answer.sides[0])
        return REACHED if are_apart(tables, scratch, answer.poses[0], sides) else TOO_NEAR
    return status


@routine
def reach_apart(tables: Tables, scratch: AnswerScratch, start: Start, target: Floats, answer: PoseSolutions) -> int:
    """Solve a target by legs on other sides than those of the start, so that links are apart: few changes first."""
    sides, choices, n_tried = scratch.other.sides[0], scratch.choices, 0
    n = min(note_choices(tables.legs, start.sides[0], choices), MOST_CHOICES)
    for n_changed in range(1, n + 1):
        for choice in range(2**n - 1, 0, -1):
            if n_tried == MOST_CHANGED or count_changes(choice) != n_changed:
                continue
            n_tried += 1
            put_changed(start.sides[0], choices, n, choice, sides)
            status = reach_from(tables.legs, target, start.poses[0], sides, scratch.completion, answer)
            if status == REACHED and are_apart(tables, scratch, answer.poses[0], sides):
                copy_row(sides, answer.sides[0])
                return REACHED
    copy_row(start.sides[0], answer.sides[0])
    return PENDING


@routine
def squared_distance(target: Floats, length: float, pose: Floats) -> float:
    """Sum of the squared differences of the entries of a target [length] and a pose [L], in the largest entry."""
    square, scale = 0.0, 1.0
    for i in range(3):
        scale = max(scale, abs(target[i, 3] / length))
    for i in range(3):
        for j in range(4):
            entry = target[i, j] / length if j == 3 else target[i, j]
            square += ((pose[i, j] - entry) / scale) ** 2
    return square


@routine
def is_flipped(tables: Tables, pose: Floats, completed: Floats) -> bool:
    """True if the platform has turned over on legs that keep it upright about home.

    Parameters
    ----------
    completed : filled with the pose [length] as what the task sets of it is completed from home [L].
    """
    task, machine, largest = tables.legs.task[0], tables.machine[0], 0.0
    if machine["flips"] == 0:
        return False
    if not read_target(pose, tables.home.poses[0], task, completed):
        return True
    for i in range(3):
        largest = max(largest, abs(pose[i, 3] / task["length"] - completed[i, 3]))
        for j in range(3):
            largest = max(largest, abs(pose[i, j] - completed[i, j]))
    return bool(largest > machine["same_mode"])


@routine
def reach_in_other_assembly(tables: Tables, scratch: AnswerScratch, target: Floats, answer: PoseSolutions) -> int:
    """Solve a target in another assembly, completed from the nearest seed that leads to one."""
    seeds, other, begin, length = tables.others, scratch.other, scratch.begin[0], tables.legs.task[0]["length"]
    status, nearest = PENDING, math.inf
    for seed in range(seeds.poses.shape[0]):
        distance = squared_distance(target, length, seeds.poses[seed])
        if not distance < nearest:
            continue
        copy_table(seeds.poses[seed], begin)
        for i in range(3):
            begin[i, 3] *= length
        copy_row(seeds.sides[seed], other.sides[0])
        is_reached = reach_from(tables.legs, target, begin, other.sides[0], scratch.completion, other) == REACHED
        if is_reached and not is_flipped(tables, other.poses[0], scratch.completion.pose):
            status, nearest = REACHED, distance
            copy_row(other.sides[0], answer.sides[0])
            copy_table(other.poses[0], answer.poses[0])
            copy_row(other.actuators[0], answer.actuators[0])
            copy_row(other.measures[0], answer.measures[0])
    return status


@routine
def search_for(
    tables: Tables,
    scratch: AnswerScratch,
    pose: Floats,
    sides: Floats,
    question: Record,
    aim: int,
    seeds: int,
    targets: Floats,
    answer: PoseSolutions,
) -> float:
    """Fill the nearest feasible pose by one objective, from a pose [length] and so many seeds; its distance [L].

    See `nearest_of_row`.
    """
    begin = scratch.begin
    load_own(pose, tables.legs.task[0]["length"], begin[0])
    return nearest_of_row(
        tables.search,
        tables.plan,
        RowSearch(0, aim, seeds, question["steps"], question["keeps_mode"]),
        targets,
        scratch.no_values,
        Starts(begin, scratch.no_q, sides),
        answer,
        scratch.nearest,
        scratch.no_weights,
    )


@routine
def price_of(tables: Tables, answer: PoseSolutions) -> tuple[float, float]:
    """The distance of an answer from its target with the price of what is held [L], and the error of that."""
    setting, measures = tables.plan.settings[PRICED], answer.measures
    position, rotation = measures[0, POSITION_ERROR] / tables.legs.task[0]["length"], measures[0, ROTATION_ERROR]
    hold, weights = setting["hold"], tables.plan.weights[PRICED]
    off = position if hold == HOLD_POSITION else rotation
    return priced_distance(weights, hold, setting["price"], position, rotation), off


@routine
def hold_exactly(
    tables: Tables, scratch: AnswerScratch, targets: Floats, question: Record, answer: PoseSolutions
) -> float:
    """Hold what an answer misses by rounding alone exactly, where that costs no more; the distance, with the price."""
    setting, other = tables.plan.settings[PRICED], scratch.other
    priced, off = price_of(tables, answer)
    if setting["price"] > 0.0 and off <= TURNED * setting["rounding"] * priced:
        held = search_for(tables, scratch, answer.poses[0], answer.sides, question, HELD, 0, targets, other)
        if held < math.inf and held <= (1.0 + SAME_DISTANCE) * priced:
            copy_solution(other, answer)
            return held
    answer.distances[0] = priced
    return priced


@routine
def project_from(
    tables: Tables,
    scratch: AnswerScratch,
    pose: Floats,
    sides: Floats,
    targets: Floats,
    question: Record,
    answer: PoseSolutions,
) -> float:
    """Fill the feasible pose that one descent from a pose [length] leads to; its distance, with the price [L]."""
    aim = PRICED if tables.machine[0]["projections"] > 1 else 0
    distance = search_for(tables, scratch, pose, sides, question, aim, 0, targets, answer)
    if aim == PRICED and distance < math.inf:
        return hold_exactly(tables, scratch, targets, question, answer)
    return distance


@routine
def project_anew(
    tables: Tables,
    scratch: AnswerScratch,
    start: Start,
    targets: Floats,
    question: Record,
    seeds: int,
    answer: PoseSolutions,
) -> float:
    """Fill the nearest feasible pose of all that searches from the start and from seeds find; its distance [L].

    What is held is held at first; where that costs more than its price, it gives way, from there and from the start.
    Where nothing has it, or searches do not agree on where, others follow for which the price counts from the outset.
    """
    if tables.machine[0]["projections"] == 1:
        return search_for(tables, scratch, start.poses[0], start.sides, question, 0, seeds, targets, answer)
    trial, most, effort = scratch.priced, question["most_steps"], scratch.nearest.search.effort[0]
    if most > 0:
        effort["bound"] = most // 2
    best = search_for(tables, scratch, start.poses[0], start.sides, question, HELD, seeds, targets, answer)
    if most > 0:
        effort["bound"] = most
    tally, plan, n_places = scratch.nearest.best_tally[0], tables.plan, 2
    is_sure = is_agreed(tally, plan.settings[HELD]["agreements"])
    is_from_start = tally["from_start"] == 1 or tally["agreements"] == math.inf
    if is_sure and is_from_start and tally["cost"] <= plan.settings[PRICED]["price"]:
        return best
    if not is_sure:
        found = search_for(tables, scratch, start.poses[0], start.sides, question, COARSE, seeds, targets, trial)
        priced, _ = price_of(tables, trial)
        if found < math.inf and (1.0 + BESIDE) * priced < best:
            copy_solution(trial, answer)
            answer.distances[0], best, n_places = priced, (1.0 + BESIDE) * priced, 1
    if best == math.inf:
        return math.inf
    for place in range(n_places):
        pose, sides = (answer.poses[0], answer.sides) if place == 0 else (start.poses[0], start.sides)
        distance = project_from(tables, scratch, pose, sides, targets, question, trial)
        if distance < (1.0 - SAME_DISTANCE) * best:
            best = distance
            copy_solution(trial, answer)
    return best


@routine
def distance_of(tables: Tables, scratch: AnswerScratch, target: Floats, pose: Floats) -> float:
    """Distance of a pose from a target [L], without any price."""
    position, rotation = errors(tables.legs.task[0], target, pose, scratch.nearest.search.gradient.turn)
    aim = PRICED if tables.machine[0]["projections"] > 1 else 0
    return weighted_distance(tables.plan.weights[aim], position, rotation)


@routine
def project(
    tables: Tables, scratch: AnswerScratch, start: Start, targets: Floats, question: Record, answer: PoseSolutions
) -> float:
    """Fill the nearest feasible pose; its distance, with the price of what is held [L].

    From a start one descent leads to it. Others are searched for only where it leads nowhere; in any mode also where it
    leads so far that the start is no answer to a target before this one.
    """
    machine, other, target, distance = tables.machine[0], scratch.other, targets[0], math.inf
    seeds, nearest = 0 if question["is_nearby"] == 1 else question["seeds"], scratch.anew
    if question["has_start"] == 1 or question["is_nearby"] == 1:
        distance = project_from(tables, scratch, start.poses[0], start.sides, targets, question, answer)
    if distance < math.inf:
        before = distance_of(tables, scratch, target, start.poses[0])
        is_settled = question["keeps_mode"] == 1 or answer.status[0] == REACHED or answer.counters[0, HOLD] >= CERTAIN
        if is_settled or before - distance_of(tables, scratch, target, answer.poses[0]) <= WORTH:
            seeds = 0
    if seeds > 0 or distance == math.inf:
        found = project_anew(tables, scratch, start, targets, question, seeds, nearest)
        if found < (1.0 - SAME_DISTANCE) * distance:
            distance = found
            copy_solution(nearest, answer)
    is_doubtful = answer.status[0] == PROJECTED and answer.counters[0, HOLD] < CERTAIN and distance < math.inf
    if machine["fallback"] >= 0 and is_doubtful:
        aim = machine["fallback"]
        found = search_for(tables, scratch, start.poses[0], start.sides, question, aim, seeds, targets, other)
        if found < math.inf and other.status[0] == REACHED:
            distance = found
            copy_solution(other, answer)
            answer.counters[0, HOLD] = HOLD_NOTHING
    return distance


@routine
def project_or_reach(
    tables: Tables,
    scratch: AnswerScratch,
    start: Start,
    targets: Floats,
    question: Record,
    is_near: bool,
    answer: PoseSolutions,
) -> int:
    """Answer a target by the nearest feasible pose; the status.

    From a pose within `NEARLY` of its target, and from every pose where the task leaves some of it open, legs then try
    to reach the target exactly. What is within `NEARLY`, stays unreached and has no certificate is UNSURE.

    Parameters
    ----------
    is_near : legs reach the target, but with links that are too near.
    """
    links, other = scratch.nearest.search.links, scratch.other
    links.kept[0] = links.pairs.shape[0] if is_near else 0
    distance = project(tables, scratch, start, targets, question, answer)
    if distance == math.inf:
        put_start(start, answer)
        return PENDING
    status, q, measures = answer.status[0], answer.q, answer.measures
    if question["last"] == NEAREST or is_near:
        return int(status)
    if distance <= NEARLY and not (status == PROJECTED and answer.counters[0, HOLD] >= CERTAIN):
        status = UNSURE
    if status == UNSURE or tables.machine[0]["is_partial"] == 1:
        table, begin = tables.near if question["is_nearby"] == 1 else tables.legs, scratch.begin[0]
        copy_table(answer.poses[0], begin)
        copy_solution(answer, other)
        is_reached = reach_from(table, targets[0], begin, other.sides[0], scratch.completion, other) == REACHED
        if is_reached and are_apart(tables, scratch, other.poses[0], other.sides[0]):
            copy_solution(other, answer)
            for k in range(q.shape[1]):
                q[0, k] = math.nan
            measures[0, POSITION_ERROR], measures[0, ROTATION_ERROR] = 0.0, 0.0
            return REACHED
    return int(status)


@routine
def answer_by_phases(
    tables: Tables, scratch: AnswerScratch, start: Start, targets: Floats, question: Record, answer: PoseSolutions
) -> int:
    """Answer a target by the phases that are asked for; the status, as of `answer_row`."""
    machine, first, last, target = tables.machine[0], question["first"], question["last"], targets[0]
    keeps_mode, is_near = question["keeps_mode"] == 1, first > BY_LEGS and answer.status[0] == TOO_NEAR
    if first == BY_LEGS and reach_at_start(tables, scratch, start, target, question, answer) == REACHED:
        is_near = not are_apart(tables, scratch, answer.poses[0], answer.sides[0])
        if not is_near:
            return REACHED
    is_moved = first == BY_LEGS and machine["is_free"] == 1 and not is_near
    if is_moved and reach_moved(tables, scratch, start, targets, question, answer) == REACHED:
        return REACHED
    if last == BY_LEGS:
        return TOO_NEAR if is_near else OPEN
    if machine["searches"] == 0:
        return PENDING
    if first <= IN_OTHER_MODES and machine["has_sides"] == 1:
        turn = scratch.nearest.search.gradient.turn
        if not is_near and question["has_start"] == 1 and is_on_target(tables, target, start.poses[0], turn):
            return PENDING
        if not (keeps_mode or is_near):
            status = reach_in_other_mode(tables, scratch, start, target, answer)
            is_near = status == TOO_NEAR
            if status != PENDING and not is_near:
                return REACHED if status == REACHED else PENDING
        if is_near and not keeps_mode and reach_apart(tables, scratch, start, target, answer) == REACHED:
            return REACHED
    if last == IN_OTHER_MODES:
        return TOO_NEAR if is_near else OPEN
    is_elsewhere = first <= IN_OTHER_ASSEMBLIES and machine["is_completed"] == 1 and not (keeps_mode or is_near)
    if is_elsewhere and reach_in_other_assembly(tables, scratch, target, answer) == REACHED:
        is_near = not are_apart(tables, scratch, answer.poses[0], answer.sides[0])
        if not is_near or reach_apart(tables, scratch, start, target, answer) == REACHED:
            return REACHED
    if last == IN_OTHER_ASSEMBLIES:
        return TOO_NEAR if is_near else OPEN
    return project_or_reach(tables, scratch, start, targets, question, is_near, answer)


@routine
def answer_row(
    tables: Tables, scratch: AnswerScratch, start: Start, target: Floats, question: Record, answer: PoseSolutions
) -> int:
    """Answer one target (1, 4, 4) [length] from a start, `tables.home` if none is given; the status.

    REACHED by legs in closed form: on the sides of the start, free redundant joints being moved if need be; if the mode
    need not be kept, on others and in other assemblies. Else PROJECTED to the nearest feasible pose found, or REACHED
    from there. PENDING where no feasible pose was found, or only joint coordinates are exact enough: at a dead point,
    or on a target that the start is on already. UNSURE where these may come nearer than a projection that nearly
    reaches. OPEN if the phases asked for do not answer it, TOO_NEAR if they reach it, but with links that are too near.
    Later phases are to be told so by the status of the answer. INVALID if the target is no pose.

    Parameters
    ----------
    scratch : as of `new_answer_scratch`; `scratch.nearest.search.effort` tells the steps and the searches that it took.
    answer : filled with one row: the distance [L] of a projection, the pose [length], sides, actuators, measures, and
        in `counters` the steps of its search and what is held; q is NaN where closed forms answer.
    """
    effort, most = scratch.nearest.search.effort[0], question["most_steps"]
    begin_effort(question["effort"], most if most > 0 else UNBOUNDED, effort)
    put_start(start, answer)
    if not is_pose(target[0]):
        answer.status[0] = INVALID
        return INVALID
    put_start(start, scratch.other)
    status = answer_by_phases(tables, scratch, start, target, question, answer)
    if most > 0 and status == PENDING:
        status, effort["is_cut"] = stay_at_start(tables, scratch, start, target[0], answer), 1
    status = PROJECTED if most > 0 and status == UNSURE else status
    if most > 0 and status == PROJECTED:
        answer.counters[0, ITERATIONS] = most if effort["is_cut"] == 1 else effort["linearised"]
    answer.status[0] = status
    if question["has_start"] == 1 and status != PENDING and status != OPEN and status != TOO_NEAR:
        count_turns(tables.legs.driven, start.actuators[0], answer.actuators[0])
    return status


@routine
def weigh_limits(
    tables: Tables,
    scratch: AnswerScratch,
    weighing: NearestScratch,
    targets: Floats,
    answer: PoseSolutions,
    weights: Floats,
) -> None:
    """Fill the multipliers of all limits (n,), numbered as in `Tables`, at a projection that a search found.

    By how much of the distance [L] the answer would come nearer, per unit [L or rad] by which the limit gives way.

    Parameters
    ----------
    weighing : as of `new_weighing_scratch`.
    targets : that of the answer, (1, 4, 4) [length].
    """
    table, plan, begin, aim = tables.assembly, tables.plan, scratch.begin, 0
    search = weighing.search
    if tables.machine[0]["projections"] > 1 and answer.counters[0, HOLD] % CERTAIN == HOLD_NOTHING:
        aim = PRICED
    pose = pose_objective(plan, aim, targets, 0)
    objective = PlatformObjective(pose, scratch.no_values, plan.settings[aim]["implied"])
    load_own(answer.poses[0], table.task[0]["length"], begin[0])
    for k in range(weights.shape[0]):
        weights[k] = 0.0
    search.n_cones[0] = table.cones.shape[0]
    if load_target(table, pose, 0, search):
        put_limit_multipliers(table, 0, objective, Starts(begin, answer.q, answer.sides), weighing, weights)
