"""Reaching a target in joint coordinates: the legs closed below a platform that is held there."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine
from ..legs.complete_poses import tilt_to, turn_pose
from ..quaternions import difference, turn_about_z, yaw_difference
from ..search_constants import CLOSED, CONTINUATION_STEPS, LONGEST_IN_MODE
from ..vectors import copy_row, copy_table, norm, scale, vec
from .close import close_row
from .joint_constants import BRANCH_AGREEMENTS, MOST_CLOSING, SAME_GAP, STEPS, STRANGE
from .joint_tables import EXPECTED, PROMPT, REACH, STEP, JointScratch, JointTables
from .linearise_loops import steps_left, turn_of_tilt
from .loops import BASE_AXES, Closed, ClosureProblem
from .path_kinematics import end_path, load_row, store_row, walk_path


@routine
def copy_closed(source: Closed, to: Closed) -> None:
    """Copy a configuration."""
    copy_row(source.coordinates[0], to.coordinates[0])
    copy_table(source.poses[0], to.poses[0])
    copy_row(source.gaps[0], to.gaps[0])
    copy_row(source.excesses[0], to.excesses[0])
    copy_row(source.misses[0], to.misses[0])
    to.iterations[0] = source.iterations[0]


@routine
def largest_of(measures: Floats) -> float:
    """Largest of the measures (1, groups) of a configuration, at least 0; infinite if one is not a number."""
    largest = 0.0
    for group in range(measures.shape[1]):
        largest = max(largest, measures[0, group]) if measures[0, group] < math.inf else math.inf
    return largest


@routine
def gap_of(closed: Closed) -> float:
    """Largest gap of a configuration [L or rad]."""
    return largest_of(closed.gaps)


@routine
def excess_of(closed: Closed) -> float:
    """Largest excess of a configuration over a limit [L or rad]."""
    return largest_of(closed.excesses)


@routine
def is_feasible(tables: JointTables, closed: Closed) -> bool:
    """True if a configuration is closed within every limit."""
    machine = tables.machine[0]
    return bool(gap_of(closed) <= machine["closed"] and excess_of(closed) <= machine["limit"])


@routine
def put_better(tables: JointTables, trial: Closed, best: Closed) -> None:
    """Copy a trial that is feasible, or less infeasible, to the best."""
    is_less = max(gap_of(trial), excess_of(trial)) < max(gap_of(best), excess_of(best))
    if is_less or is_feasible(tables, trial):
        copy_closed(trial, best)


@routine
def close_legs(
    tables: JointTables,
    scratch: JointScratch,
    start: Closed,
    pose: Floats,
    held: Floats,
    frame: int,
    most: int,
    limits: int,
    patience: int,
    to: Closed,
) -> None:
    """Close the legs of a start, within limits or without, below a platform held at a pose; or measure them."""
    closing, machine, control = scratch.closing, tables.machine[0], scratch.descent.control[0]
    most = min(most, steps_left(control))
    inside, centres, follow = machine["inside"], scratch.no_centres, 1 - limits
    problem = ClosureProblem(held, frame, centres, limits, inside, follow, 0, 0, patience, CLOSED, most)
    for j in range(tables.moves.shape[0]):
        to.coordinates[0, j] = start.coordinates[0, j] * (tables.moves[j] if most > 0 else 1.0)
    copy_table(pose, to.poses[0])
    load_row(tables.loops, 0, to, closing.trial)
    layout = tables.layout if limits == 1 else tables.following
    to.iterations[0] = close_row(tables.loops, layout, problem, 0, closing, to)
    store_row(tables.loops, 0, closing.best, to)
    control["linearised"] += to.iterations[0]


@routine
def close_below(
    tables: JointTables,
    scratch: JointScratch,
    start: Closed,
    pose: Floats,
    is_whole: bool,
    most: int,
    patience: int,
    to: Closed,
) -> None:
    """Close the legs within limits below a platform of which all is held, or what the task sets."""
    held = tables.whole if is_whole else tables.held
    frame = BASE_AXES if is_whole else int(tables.machine[0]["frame"])
    close_legs(tables, scratch, start, pose, held, frame, most, 1, patience, to)


@routine
def pose_platform(tables: JointTables, scratch: JointScratch, closed: Closed) -> None:
    """Fill the platform's pose from the coordinates."""
    loops, eq, state, pose = tables.loops, scratch.closing.eq, scratch.closing.trial, closed.poses[0]
    load_row(loops, 0, closed, state)
    walk_path(loops, 0, loops.paths[1], state, eq)
    end_path(loops, 0, loops.paths[1], loops.end, eq)
    for i in range(4):
        for j in range(4):
            pose[i, j] = eq.T[min(i, 2), j] if i < 3 else (1.0 if j == 3 else 0.0)


@routine
def measure(tables: JointTables, scratch: JointScratch, closed: Closed) -> None:
    """Fill the measures of a configuration, whose platform is posed."""
    close_legs(tables, scratch, closed, closed.poses[0], tables.whole, BASE_AXES, 0, 1, -1, closed)


@routine
def errors(task: Record, pose: Floats, target: Floats, turn: Floats) -> tuple[float, float]:
    """Distance [L] and angle [rad] of a pose from a target in what the task sets."""
    position, rotations = 0.0, task["rotations"]
    for i in range(3):
        position = math.hypot(position, pose[i, 3] - target[i, 3] if task["axes"][i] == 1 else 0.0)
    if rotations == 3:
        difference(pose, target, turn)
        return position, norm(vec(turn))
    if rotations == 2:
        _, angle = turn_of_tilt(target, pose)
        return position, angle
    return position, abs(yaw_difference(pose, target)) if rotations == 1 else 0.0


@routine
def differences(pose: Floats, other: Floats) -> float:
    """Largest difference of positions [L] and of entries of rotation matrices."""
    most = 0.0
    for i in range(3):
        for j in range(4):
            most = max(most, abs(pose[i, j] - other[i, j]))
    return most


@routine
def complete(task: Record, target: Floats, begin: Floats, pose: Floats) -> None:
    """Fill a pose with what a target sets, and the rest as it is at the beginning."""
    rotations = task["rotations"]
    for i in range(4):
        for j in range(3):
            pose[i, j] = target[i, j] if rotations == 3 else begin[i, j]
        pose[i, 3] = begin[i, 3] if i < 3 and task["axes"][min(i, 2)] == 0 else target[i, 3]
    if rotations == 1:
        turn_about_z(pose, yaw_difference(target, begin))
    elif rotations == 2:
        tilt_to(target, 1.0, pose)


@routine
def put_between(begin: Floats, end: Floats, share: float, turn: Floats, pose: Floats) -> None:
    """Fill a pose a share of the way from one to another: straight positions, the shortest turn."""
    copy_table(begin, pose)
    difference(end, begin, turn)
    angle = norm(vec(turn))
    if angle > 0.0:
        part = math.atan2(share * math.sin(angle), 1.0 - share + share * math.cos(angle))
        turn_pose(pose, scale(part / angle, vec(turn)))
    for i in range(3):
        pose[i, 3] += share * (end[i, 3] - begin[i, 3])


@routine
def continue_to(
    tables: JointTables, scratch: JointScratch, target: Floats, is_whole: bool, limits: int, patience: int, to: Closed
) -> None:
    """Lead the platform from its pose at the start to a target, in steps; with patience no farther than they close.

    Where what is not held jumps on the way, the result is marked as open.
    """
    machine, begin, present, wished = tables.machine[0], scratch.begin, scratch.present, scratch.wished
    held = tables.whole if is_whole else tables.held
    frame = BASE_AXES if is_whole else int(machine["frame"])
    most, n, has_jumped = machine["continuation_steps"], CONTINUATION_STEPS, False
    if most == 0:
        close_legs(tables, scratch, begin, target, held, frame, MOST_CLOSING * (1 - limits), limits, patience, to)
        return
    copy_closed(begin, to)
    copy_table(begin.poses[0], present)
    for step in range(1, n + 1):
        if step < n:
            put_between(begin.poses[0], target, step / n, scratch.turn, wished)
        else:
            copy_table(target, wished)
        if not is_whole:
            copy_table(wished, scratch.start.poses[0])
            complete(tables.task[0], scratch.start.poses[0], present, wished)
        close_legs(tables, scratch, to, wished, held, frame, most, limits, patience, to)
        if patience > 0 and not is_feasible(tables, to):
            break
        has_jumped = has_jumped or differences(to.poses[0], wished) > STRANGE + differences(wished, present)
        copy_table(to.poses[0], present)
    if has_jumped:
        to.gaps[0, 0] = math.inf


@routine
def complete_by_loops(tables: JointTables, scratch: JointScratch, is_step: bool) -> bool:
    """Complete `scratch.pose` by closing the loops, without limits, on what the task sets; True if they close.

    In the assembly mode of the start.
    """
    machine, pose, trial = tables.machine[0], scratch.pose, scratch.trial
    held, frame = (tables.held, int(machine["frame"])) if machine["varies"] == 1 else (tables.whole, BASE_AXES)
    most = STEPS if is_step else MOST_CLOSING
    close_legs(tables, scratch, scratch.begin, pose, held, frame, most, 0, -1, trial)
    has_jumped = differences(trial.poses[0], pose) > STRANGE
    if machine["varies"] == 1 and not is_step and (has_jumped or gap_of(trial) > machine["near"]):
        continue_to(tables, scratch, pose, False, 0, -1, trial)
        has_jumped = False
    copy_table(trial.poses[0], pose)
    return not (is_step and has_jumped) and (is_step or gap_of(trial) <= machine["near"])


@routine
def is_flipped(tables: JointTables, scratch: JointScratch, pose: Floats) -> bool:
    """True if a platform has flipped over on legs that keep its orientation about home."""
    machine, home = tables.machine[0], scratch.wished
    if machine["follows"] == 0 or machine["varies"] == 1:
        return False
    for i in range(4):
        for j in range(4):
            scratch.present[i, j] = 1.0 if i == j else (tables.loops.end[i] if i < 3 and j == 3 else 0.0)
    complete(tables.task[0], pose, scratch.present, home)
    return bool(differences(pose, home) > machine["same_mode"])


@routine
def start_at(tables: JointTables, coordinates: Floats, rest: Closed, start: Closed) -> None:
    """Fill the coordinates of a start with given ones (columns,), but idle coordinates with those of another."""
    for j in range(tables.idle.shape[0]):
        start.coordinates[0, j] = rest.coordinates[0, j] if tables.idle[j] == 1 else coordinates[j]


@routine
def measure_nearby(tables: JointTables, scratch: JointScratch) -> None:
    """Fill the distances of the random feasible configurations from the target."""
    for i in range(scratch.distances.shape[0]):
        position, rotation = errors(tables.task[0], tables.nearby_poses[i], scratch.target[0], scratch.turn)
        scratch.distances[i] = math.hypot(position, rotation)


@routine
def take_nearby(scratch: JointScratch) -> int:
    """The nearest of the random feasible configurations that is not taken yet."""
    distances, place = scratch.distances, 0
    for i in range(distances.shape[0]):
        place = i if distances[i] < distances[place] else place
    distances[place] = math.inf
    return place


@routine
def search_from_nearby(tables: JointTables, scratch: JointScratch, is_whole: bool) -> None:
    """Reach the target from the random feasible configurations whose end effectors are nearest to it."""
    machine, best, start, trial = tables.machine[0], scratch.reached, scratch.start, scratch.trial
    measure_nearby(tables, scratch)
    for _ in range(min(machine["nearby"], scratch.distances.shape[0])):
        if is_feasible(tables, best) or steps_left(scratch.descent.control[0]) == 0:
            break
        place = take_nearby(scratch)
        start_at(tables, tables.nearby[place], best, start)
        complete(tables.task[0], scratch.target[0], tables.nearby_poses[place], scratch.wished)
        close_below(tables, scratch, start, scratch.wished, is_whole, int(machine["search_steps"]), -1, trial)
        put_better(tables, trial, best)


@routine
def put_better_legs(tables: JointTables, scratch: JointScratch, trial: Closed, best: Closed) -> None:
    """Copy the legs of a trial that are less infeasible than those of the best, and count where legs agree."""
    loops, agreements, limit = tables.loops, scratch.agreements, tables.machine[0]["limit"]
    for group in range(agreements.shape[0]):
        off = max(trial.gaps[0, group], trial.excesses[0, group])
        least = max(best.gaps[0, group], best.excesses[0, group])
        if off < (1.0 - SAME_GAP) * least:
            agreements[group] = 1.0
        elif off <= (1.0 + SAME_GAP) * least and off < math.inf:
            agreements[group] += 1.0
        if min(off, least) <= limit:
            agreements[group] = 0.0
        if off < least:
            best.gaps[0, group], best.excesses[0, group] = trial.gaps[0, group], trial.excesses[0, group]
            for j in range(loops.group_of.shape[0]):
                if loops.group_of[j] == group:
                    best.coordinates[0, j] = trial.coordinates[0, j]


@routine
def search_from_random(
    tables: JointTables,
    scratch: JointScratch,
    pose: Floats,
    is_whole: bool,
    is_pose_fixed: bool,
    best: Closed,
) -> None:
    """Reach a pose from random starts; if all of it is given, leg by leg.

    Then the search is given up once enough starts of one of its legs agree on the least gap or excess.
    """
    machine, start, trial, group_of = tables.machine[0], scratch.start, scratch.trial, tables.loops.group_of
    for group in range(scratch.agreements.shape[0]):
        scratch.agreements[group] = 0.0
    for k in range(machine["random"]):
        agreed = 0.0
        for group in range(scratch.agreements.shape[0]):
            agreed = max(agreed, scratch.agreements[group])
        is_spent = steps_left(scratch.descent.control[0]) == 0
        if is_feasible(tables, best) or agreed >= BRANCH_AGREEMENTS or is_spent:
            break
        start_at(tables, tables.random[k], best, start)
        for j in range(group_of.shape[0]):
            group = group_of[j]
            if is_pose_fixed and max(best.gaps[0, group], best.excesses[0, group]) <= machine["limit"]:
                start.coordinates[0, j] = best.coordinates[0, j]
        close_below(tables, scratch, start, pose, is_whole, int(machine["search_steps"]), -1, trial)
        if is_pose_fixed:
            put_better_legs(tables, scratch, trial, best)
        else:
            put_better(tables, trial, best)


@routine
def is_beyond_reach(tables: JointTables, pose: Floats) -> bool:
    """True if some path is too short for a pose, at any configuration."""
    reaches = tables.reaches
    for path in range(reaches.shape[0]):
        square = 0.0
        for i in range(3):
            off = pose[i, 3] - reaches[path, i]
            for j in range(3):
                off -= pose[i, j] * reaches[path, 3 + j]
            square += off * off
        if math.sqrt(square) > reaches[path, 6]:
            return True
    return False


@routine
def reach(tables: JointTables, scratch: JointScratch, question: Record, patience: int) -> bool:
    """Bring the platform to the target, within limits, into `scratch.reached`; True if it got there.

    In one step and by continuation; if the mode need not be kept, from other configurations and leg by leg. With
    patience, not farther than steps make progress.
    """
    machine, task, pose, begin, best = tables.machine[0], tables.task[0], scratch.pose, scratch.begin, scratch.reached
    verb, follows = question["verb"], machine["follows"] == 1
    is_fixed, is_step, is_completed = follows or machine["is_whole"] == 1, verb in (STEP, PROMPT), True
    complete(task, scratch.target[0], begin.poses[0], pose)
    is_beyond = machine["is_whole"] == 1 and is_beyond_reach(tables, pose)
    if verb == EXPECTED and not is_beyond:
        return reach_as_expected(tables, scratch, question["leg_by_leg"] == 1)
    if follows:
        is_completed = complete_by_loops(tables, scratch, is_step)
    position, rotation = errors(task, begin.poses[0], pose, scratch.turn)
    is_long = question["keeps_mode"] == 1 and math.hypot(position, rotation) > LONGEST_IN_MODE
    if patience > 0 and (is_beyond or (is_long and verb == PROMPT)):
        copy_closed(begin, best)
        return False
    most = STEPS if is_step else int(machine["closing_steps"])
    close_below(tables, scratch, begin, pose, is_fixed, most, patience, best)
    if is_step or is_beyond:
        return is_completed and is_feasible(tables, best)
    if is_long or not is_feasible(tables, best):
        continue_to(tables, scratch, pose, is_fixed, 1, patience, scratch.trial)
        put_better(tables, scratch.trial, best)
    if question["keeps_mode"] == 1 or verb == REACH or machine["has_seeds"] == 0:
        return is_feasible(tables, best)
    if not is_fixed:
        search_from_nearby(tables, scratch, False)
    if is_completed:
        search_from_random(tables, scratch, pose, is_fixed, is_fixed, best)
    if follows and machine["has_others"] == 1:
        is_whole = machine["varies"] == 0
        search_from_nearby(tables, scratch, is_whole)
        if machine["asks_all"] == 1:
            complete(task, scratch.target[0], begin.poses[0], pose)
            search_from_random(tables, scratch, pose, is_whole, False, best)
    return is_feasible(tables, best)


@routine
def walk(tables: JointTables, scratch: JointScratch, patience: int) -> None:
    """Lead the platform from its pose at the start to the target, in the working mode, into `scratch.reached`."""
    machine, pose = tables.machine[0], scratch.pose
    follows = machine["follows"] == 1
    complete(tables.task[0], scratch.target[0], scratch.begin.poses[0], pose)
    if follows:
        complete_by_loops(tables, scratch, False)
    continue_to(tables, scratch, pose, follows or machine["is_whole"] == 1, 1, patience, scratch.reached)


@routine
def reach_as_expected(tables: JointTables, scratch: JointScratch, leg_by_leg: bool) -> bool:
    """Close all loops on the target, what the task leaves open of a pose being expected as it is at the start.

    With `leg_by_leg`, where that fails, each leg is searched for alone at the pose expected, whatever the branches of
    the others; once all are near, the pose follows.
    """
    pose, best, near, most = scratch.pose, scratch.reached, scratch.answer, int(tables.machine[0]["closing_steps"])
    close_below(tables, scratch, scratch.begin, pose, False, most, -1, best)
    if leg_by_leg and not is_feasible(tables, best):
        close_below(tables, scratch, scratch.begin, pose, True, most, -1, near)
        search_from_random(tables, scratch, pose, True, True, near)
        close_below(tables, scratch, near, pose, False, most, -1, scratch.trial)
        put_better(tables, scratch.trial, best)
    return is_feasible(tables, best) and not is_flipped(tables, scratch, best.poses[0])
