"""Inverse kinematics in joint coordinates: a target reached, or the nearest feasible configuration, row by row."""

from __future__ import annotations

import math

import numpy as np

from ...common.arrays import Floats, Ints, Record
from .._jit import opener, routine, search
from ..clearance.link_records import NO_LINKS
from ..legs.complete_poses import is_pose, load_pose, orthonormalise
from ..legs.records import TASK
from ..projecting import COARSE, HELD, PRICED, clear_tally, count_ending, priced_distance, weighted_distance
from ..rows import (
    FAILED,
    HOLD,
    HOLD_NOTHING,
    HOLD_ORIENTATION,
    HOLD_POSITION,
    INVALID,
    ITERATIONS,
    LARGEST_NUMBER,
    LIMIT_EXCESS,
    OPEN,
    POSITION_ERROR,
    PROJECTED,
    REACHED,
    RESIDUAL,
    ROTATION_ERROR,
)
from ..search_constants import BESIDE, LONGEST_IN_MODE, MOST_STEPS, SAME_DISTANCE, SIGHT, TURNED, WORTH
from ..vectors import copy_table
from .close_on_target import (
    close_below,
    close_legs,
    complete,
    copy_closed,
    errors,
    excess_of,
    gap_of,
    is_beyond_reach,
    is_feasible,
    is_flipped,
    measure,
    measure_nearby,
    pose_platform,
    reach,
    start_at,
    take_nearby,
    walk,
)
from .descend import nearest_of
from .joint_constants import (
    AGREEMENTS,
    FEWEST,
    FEWEST_LINEARISED,
    FOLDED,
    LONG_CHAIN_STEPS,
    MOST_CLOSING,
    NEAR,
    NEARLY,
    PATIENCE,
    STEPS,
)
from .joint_tables import (
    ANSWER,
    ASKED,
    AT_END,
    AT_START,
    EXPECTED,
    MACHINE,
    NEAREST,
    PROMPT,
    TO_CLOSE,
    Answered,
    JointQuestion,
    JointScratch,
    JointTables,
    new_joint_scratch,
)
from .linearise_loops import steps_left
from .loops import BASE_AXES, LOCKED, Closed, Objective, PoseObjective
from .path_kinematics import LAYOUT, LOOPS, are_apart, load_row


def _sample() -> JointTables:
    """Tables of the array types that kernels are compiled for."""
    table, row, column, weights = np.zeros((1, 2)), np.zeros(2), np.zeros(2, np.int64), np.zeros(6)
    known = np.zeros(1, MACHINE), np.zeros(1, TASK), LOOPS, LAYOUT, LAYOUT, row, column, row, column, row
    aims = weights, weights, weights, np.zeros((1, 6)), column, np.zeros((1, 2))
    return JointTables(*known, *aims, table, table, table, np.zeros((1, 4, 4)), table)


_TABLES = _sample()
open_tables, open_scratch = opener(_TABLES), opener(new_joint_scratch(_TABLES, NO_LINKS, LOOPS))
open_question = opener(JointQuestion(np.zeros(1, ASKED)))


@routine
def note(scratch: JointScratch, aim: int, start: int, steps: int, distance: float) -> None:
    """Write an attempt to the log, as long as there is room."""
    k = scratch.logged[0]
    if k < scratch.log.shape[0]:
        attempt = scratch.log[k]
        attempt["aim"], attempt["start"], attempt["steps"], attempt["distance"] = aim, start, steps, distance
        scratch.logged[0] = k + 1


@routine
def distance_of(tables: JointTables, scratch: JointScratch, aim: int, closed: Closed) -> float:
    """Distance of a configuration from the target by a projection, with its price [L]; infinite if it is no answer."""
    if not is_feasible(tables, closed) or is_flipped(tables, scratch, closed.poses[0]):
        return math.inf
    position, rotation = errors(tables.task[0], closed.poses[0], scratch.target[0], scratch.turn)
    return priced_distance(tables.weights[aim], tables.holds[aim], tables.prices[aim, 0], position, rotation)


@routine
def keeps_clearance(tables: JointTables, scratch: JointScratch, closed: Closed) -> bool:
    """True if no links of a configuration are nearer than the clearance."""
    descent = scratch.descent
    load_row(tables.loops, 0, closed, descent.trial)
    return are_apart(descent.links, descent.ways, descent.trial, descent.way_eq, tables.machine[0]["limit"])


@routine
def move_to_held(tables: JointTables, scratch: JointScratch, aim: int, start: Closed) -> None:
    """Close the loops of a start on an end effector that has the held part of its target.

    A search from there keeps what is held, even if no search leads to it from the start.
    """
    weights, held, begin, wished, turns = tables.weights[aim], scratch.held, start.poses[0], scratch.wished, False
    for i in range(6):
        held[i] = LOCKED if weights[i] == LOCKED else 0.0
        turns = turns or (i > 2 and weights[i] == LOCKED)
    pose_platform(tables, scratch, start)
    complete(tables.task[0], scratch.target[0], begin, wished)
    for i in range(3):
        wished[i, 3] = wished[i, 3] if weights[i] == LOCKED else begin[i, 3]
        for j in range(3):
            wished[i, j] = wished[i, j] if turns else begin[i, j]
    close_legs(tables, scratch, start, wished, held, int(tables.machine[0]["frame"]), MOST_CLOSING, 1, -1, start)


@routine
def descend_from(tables: JointTables, scratch: JointScratch, aim: int, begin: int, steps: int) -> bool:
    """Search from `scratch.start` by a projection, into `scratch.trial`, and count the end; True if it is nearest."""
    machine, trial = tables.machine[0], scratch.trial
    if steps_left(scratch.descent.control[0]) < FEWEST_LINEARISED:
        return False
    pose = PoseObjective(
        scratch.target,
        tables.weights[aim],
        int(machine["frame"]),
        int(tables.holds[aim]),
        tables.prices[aim, 0],
        tables.prices[aim, 1],
        machine["inside"],
        machine["active"],
        steps,
    )
    copy_closed(scratch.start, trial)
    least = scratch.tally[0]["least"]
    scratch.descent.control[0]["least"] = least if least < math.inf else 0.0
    objective = Objective(pose, scratch.no_weights, scratch.no_anchors)
    nearest_of(tables.loops, 0, objective, scratch.descent, trial, scratch.no_multipliers)
    scratch.descent.control[0]["least"] = 0.0
    distance = distance_of(tables, scratch, aim, trial)
    note(scratch, aim, begin, int(trial.iterations[0]), distance)
    if not (distance < math.inf and count_ending(distance, scratch.tally[0])):
        return False
    scratch.tally[0]["cost"] = scratch.descent.gradient.pricing[0]["cost"]
    return True


@routine
def search_by(
    tables: JointTables,
    scratch: JointScratch,
    aim: int,
    n_starts: int,
    n_seeds: int,
    moves_start: bool,
    steps: int,
    best: Closed,
) -> float:
    """The nearest configuration by a projection, from starts and seeds, into `best`; its distance [L].

    Of equal results that of the first start is taken. Seeds are first moved to hold what is to be held; where nothing
    else has an end, so is the start, with `moves_start`.
    """
    tally, start, holds = scratch.tally[0], scratch.start, aim == HELD and tables.holds[aim] != HOLD_NOTHING
    n_near = min(NEAR, scratch.distances.shape[0]) if n_seeds > 0 and is_beyond_reach(tables, scratch.pose) else 0
    last = n_starts + n_seeds + n_near
    clear_tally(tally)
    if n_near > 0:
        measure_nearby(tables, scratch)
    for number in range(last + 1 if moves_start else last):
        is_last, seed = number == last, number - n_starts
        is_spent = steps_left(scratch.descent.control[0]) < FEWEST_LINEARISED
        if is_spent or tally["agreements"] >= AGREEMENTS or (is_last and (tally["least"] < math.inf or not holds)):
            break
        begin = AT_START if is_last or number == 0 else (AT_END if seed < 0 else seed + 1)
        if begin > n_seeds:
            start_at(tables, tables.nearby[take_nearby(scratch)], scratch.begin, start)
        elif begin > 0:
            start_at(tables, tables.seeds[seed], scratch.begin, start)
        else:
            copy_closed(scratch.begin if begin == AT_START else scratch.reached, start)
        if holds and (is_last or begin > 0):
            move_to_held(tables, scratch, aim, start)
        if descend_from(tables, scratch, aim, begin, steps):
            copy_closed(scratch.trial, best)
    least: float = tally["least"]
    return least


@routine
def choose_start(tables: JointTables, scratch: JointScratch, n_starts: int) -> None:
    """Replace the start by what is nearest to the target of the starts, closed within limits.

    Used for long chains, for which a search from each start takes too long.
    """
    least, last, start = math.inf, tables.weights.shape[0] - 1, scratch.start
    copy_closed(scratch.begin, scratch.answer)
    for k in range(n_starts):
        copy_closed(scratch.begin if k == 0 else scratch.reached, start)
        pose_platform(tables, scratch, start)
        close_legs(
            tables, scratch, start, start.poses[0], tables.nothing, BASE_AXES, LONG_CHAIN_STEPS, 1, -1, scratch.trial
        )
        distance = distance_of(tables, scratch, last, scratch.trial)
        if distance < least:
            least = distance
            copy_closed(scratch.trial, scratch.answer)
    copy_closed(scratch.answer, scratch.begin)


@routine
def project_from(tables: JointTables, scratch: JointScratch, begin: Closed, steps: int, best: Closed) -> float:
    """Fill the configuration that one descent leads to; its distance, with the price of what is held [L].

    Where it comes to have what is held, it goes on with that held exactly: along the edge that the price has there,
    steps would be short. That ends the descent if holding costs no more than the price. Else it goes on without.
    """
    aim = PRICED if tables.holds.shape[0] > 1 else 0
    start, tally, pricing = scratch.start, scratch.tally[0], scratch.descent.gradient.pricing[0]
    share, distance = tables.prices[aim, 1], math.inf
    copy_closed(begin, best)
    for turn in range(2):
        copy_closed(best, start)
        clear_tally(tally)
        pricing["edge"] = TURNED * share if aim == PRICED and turn == 0 else 0.0
        is_ended = descend_from(tables, scratch, aim, AT_START, steps)
        pricing["edge"] = 0.0
        if not is_ended:
            return distance
        distance = tally["least"]
        copy_closed(scratch.trial, best)
        position, rotation = errors(tables.task[0], best.poses[0], scratch.target[0], scratch.turn)
        if aim != PRICED or (position if tables.holds[aim] == HOLD_POSITION else rotation) > TURNED * share * distance:
            return distance
        copy_closed(best, start)
        move_to_held(tables, scratch, HELD, start)
        clear_tally(tally)
        if descend_from(tables, scratch, HELD, AT_START, steps) and tally["least"] <= (1.0 + SAME_DISTANCE) * distance:
            copy_closed(scratch.trial, best)
            distance = tally["least"]
            if tally["cost"] <= tables.prices[aim, 0]:
                return distance
    return distance


@routine
def project_anew(
    tables: JointTables,
    scratch: JointScratch,
    n_starts: int,
    n_seeds: int,
    moves_start: bool,
    is_begun: bool,
    steps: int,
    best: Closed,
) -> float:
    """Fill the nearest configuration that searches from starts and seeds find; its distance, with the price [L].

    What is held is held at first; where that costs more than its price, it gives way, from there and from the start,
    unless a descent is known to have begun there. Where nothing has it, the price counts from the outset.
    """
    least = search_by(tables, scratch, HELD, n_starts, n_seeds, moves_start, steps, best)
    tally = scratch.tally[0]
    if tables.holds.shape[0] == 1:
        return least
    if tally["agreements"] >= AGREEMENTS and tally["cost"] <= tables.prices[PRICED, 0]:
        return least
    n_places = 2 if least < math.inf else 1
    if least == math.inf:
        least = (1.0 + BESIDE) * search_by(tables, scratch, COARSE, n_starts, n_seeds, moves_start, steps, best)
    for place in range(1 if is_begun and least < math.inf else n_places):
        distance = project_from(tables, scratch, best if place == 0 else scratch.begin, steps, scratch.priced)
        if distance < (1.0 - SAME_DISTANCE) * least:
            least = distance
            copy_closed(scratch.priced, best)
    return least


@routine
def farthest(tables: JointTables, closed: Closed, other: Closed) -> float:
    """Largest difference of two configurations in a coordinate [L or rad]."""
    most = 0.0
    for j in range(closed.coordinates.shape[1]):
        if tables.idle[j] == 0:
            most = max(most, abs(closed.coordinates[0, j] - other.coordinates[0, j]))
    return most


@routine
def stays_in_mode(tables: JointTables, scratch: JointScratch, question: Record, closed: Closed) -> bool:
    """True if a configuration is in the start's working mode, where that is kept: it is near, or steps lead there.

    Else `scratch.reached` is where they end.
    """
    target, wished = scratch.target[0], scratch.aside
    if question["keeps_mode"] == 0 or farthest(tables, closed, scratch.begin) <= LONGEST_IN_MODE:
        return True
    copy_table(target, wished)
    copy_table(closed.poses[0], target)
    walk(tables, scratch, -1)
    copy_table(wished, target)
    return farthest(tables, closed, scratch.reached) <= FOLDED


@routine
def distance_left(tables: JointTables, scratch: JointScratch, closed: Closed) -> float:
    """Distance of a configuration from the target [L], without any price."""
    position, rotation = errors(tables.task[0], closed.poses[0], scratch.target[0], scratch.turn)
    return weighted_distance(tables.weights[PRICED if tables.holds.shape[0] > 1 else 0], position, rotation)


@routine
def project(tables: JointTables, scratch: JointScratch, question: Record, n_starts: int) -> None:
    """Fill `scratch.answer` with the nearest feasible configuration.

    From a start, and in a mode that is to be kept, one descent leads to it, in the latter by steps that keep the mode.
    Others are searched for only where it leads nowhere; in any mode also where it leads so far that the start is no
    answer to a target before this one. The fallback is the start, which is feasible, or nearly.
    """
    machine, answer, nearest, last = tables.machine[0], scratch.answer, scratch.nearest, tables.weights.shape[0] - 1
    keeps_mode = question["keeps_mode"] == 1
    n_seeds = 0 if keeps_mode else tables.seeds.shape[0]
    count, moves_start = min(n_starts + n_seeds, machine["descents"]), True
    steps, distance = min(MOST_STEPS, machine["descent_steps"] // count), math.inf
    steps = steps if steps >= FEWEST else 0
    n_seeds = n_seeds if count == n_starts + n_seeds else 0
    if count < n_starts or steps == 0:
        choose_start(tables, scratch, n_starts)
        n_starts, n_seeds, moves_start = 1, 0, False
    is_begun = (question["has_start"] == 1 or keeps_mode) and steps > 0
    if is_begun:
        before = distance_left(tables, scratch, scratch.begin)
        scratch.descent.control[0]["stays"] = question["keeps_mode"]
        distance = project_from(tables, scratch, scratch.begin, steps, answer)
        scratch.descent.control[0]["stays"] = 0
        if keeps_mode and distance < math.inf and machine["is_redundant"] == 0:
            distance = distance if stays_in_mode(tables, scratch, question, answer) else math.inf
        if distance < math.inf and (keeps_mode or before - distance_left(tables, scratch, answer) <= WORTH):
            return
    if steps > 0:
        found = project_anew(tables, scratch, n_starts, n_seeds, moves_start, is_begun, steps, nearest)
        if found < math.inf and not stays_in_mode(tables, scratch, question, nearest):
            found = project_from(tables, scratch, scratch.reached, steps, nearest)
        if found < (1.0 - SAME_DISTANCE) * distance:
            copy_closed(nearest, answer)
            return
    if distance == math.inf:
        measure(tables, scratch, scratch.begin)
        copy_closed(scratch.begin, answer)
        if distance_of(tables, scratch, last, answer) == math.inf:
            close_legs(tables, scratch, scratch.begin, scratch.target[0], tables.whole, BASE_AXES, 0, 1, -1, answer)


@routine
def finish(tables: JointTables, scratch: JointScratch) -> None:
    """Bring an answer that is all but on its target onto it, if that is near."""
    answer, pose, machine = scratch.answer, scratch.pose, tables.machine[0]
    is_whole = machine["is_whole"] == 1
    if not distance_left(tables, scratch, answer) <= NEARLY or (machine["follows"] == 1 and not is_whole):
        return
    complete(tables.task[0], scratch.target[0], answer.poses[0], pose)
    close_below(tables, scratch, answer, pose, is_whole, STEPS, PATIENCE, scratch.trial)
    if is_feasible(tables, scratch.trial) and farthest(tables, scratch.trial, answer) <= LONGEST_IN_MODE:
        copy_closed(scratch.trial, answer)


@routine
def put_answer(
    tables: JointTables, scratch: JointScratch, row: int, target: Floats, closed: Closed, hold: int, answers: Answered
) -> int:
    """Write a configuration as the answer of a row, and what it misses of its target; its status."""
    machine, task, wished, pose = tables.machine[0], tables.task[0], scratch.wished, answers.poses[row]
    counters, measures, coordinates = answers.counters[row], answers.measures[row], answers.coordinates[row]
    for j in range(coordinates.shape[0]):
        coordinates[j] = closed.coordinates[0, j] / tables.scale[j]
    for i in range(tables.actuated.shape[0]):
        answers.actuators[row, i] = coordinates[tables.actuated[i]] + tables.home[i]
    copy_table(closed.poses[0], pose)
    copy_table(scratch.target[0], wished)
    for i in range(3):
        pose[i, 3] *= task["length"]
        wished[i, 3] = target[i, 3]
        for j in range(3 if machine["is_point"] == 1 else 0):
            pose[i, j] = 1.0 if i == j else 0.0
    position, rotation = errors(task, pose, wished, scratch.turn)
    is_held = not (hold == HOLD_ORIENTATION and rotation > machine["held"])
    is_held = is_held and not (hold == HOLD_POSITION and position > machine["held"] * task["length"])
    for k in range(counters.shape[0]):
        counters[k] = 0
    counters[ITERATIONS], counters[HOLD] = closed.iterations[0], hold if is_held else HOLD_NOTHING
    for k in range(measures.shape[0]):
        measures[k] = 0.0
    measures[POSITION_ERROR], measures[ROTATION_ERROR] = min(position, LARGEST_NUMBER), rotation
    measures[RESIDUAL], measures[LIMIT_EXCESS] = gap_of(closed) * task["length"], excess_of(closed)
    if not is_feasible(tables, closed):
        return FAILED
    return REACHED if position <= machine["position"] and rotation <= machine["rotation"] else PROJECTED


@routine
def put_invalid(row: int, answers: Answered) -> int:
    """Write that a row's target is no pose; the status."""
    for j in range(answers.coordinates.shape[1]):
        answers.coordinates[row, j] = math.nan
    for i in range(answers.actuators.shape[1]):
        answers.actuators[row, i] = math.nan
    for k in range(answers.measures.shape[1]):
        answers.measures[row, k] = math.nan
    for k in range(answers.counters.shape[1]):
        answers.counters[row, k] = 0
    for i in range(4):
        for j in range(4):
            answers.poses[row, i, j] = math.nan
    return INVALID


@routine
def clip(tables: JointTables, target: Floats) -> None:
    """Move a target beyond sight towards home."""
    far = SIGHT
    for i in range(3):
        far = max(far, abs(target[i, 3] - tables.loops.end[i]))
    for i in range(3):
        target[i, 3] = tables.loops.end[i] + (target[i, 3] - tables.loops.end[i]) * min(1.0, SIGHT / far)


@routine
def answer_row(
    tables: JointTables,
    scratch: JointScratch,
    row: int,
    begin: Floats,
    target: Floats,
    question: Record,
    answers: Answered,
) -> int:
    """Answer a target (4, 4) [length] from a start (columns,) [length or rad]; the status, OPEN if it takes seeds."""
    verb, follows, links = question["verb"], tables.machine[0]["follows"] == 1, scratch.descent.links
    control = scratch.descent.control[0]
    if not is_pose(target):
        return put_invalid(row, answers)
    load_pose(target, tables.task[0]["length"], scratch.target[0])
    orthonormalise(scratch.target[0])
    for j in range(tables.scale.shape[0]):
        scratch.begin.coordinates[0, j] = begin[j] * tables.scale[j]
    control["bound"], control["linearised"] = question["most_steps"], 0
    pose_platform(tables, scratch, scratch.begin)
    scratch.logged[0] = 0
    n_starts = 1 if question["keeps_mode"] == 1 or follows or verb == NEAREST else 2
    links.kept[0] = links.pairs.shape[0] if verb == NEAREST else 0
    if verb != NEAREST:
        is_hurried = verb == PROMPT or (verb == ANSWER and question["keeps_mode"] == 1)
        control["bound"] = (question["most_steps"] + 1) // 2
        is_reached = reach(tables, scratch, question, PATIENCE if is_hurried else -1)
        control["bound"] = question["most_steps"]
        if is_reached and not keeps_clearance(tables, scratch, scratch.reached):
            is_reached, n_starts, links.kept[0] = False, 1, links.pairs.shape[0]
        note(scratch, TO_CLOSE, AT_START, int(scratch.reached.iterations[0]), 0.0 if is_reached else math.inf)
        if is_reached or verb != ANSWER:
            status = put_answer(tables, scratch, row, target, scratch.reached, HOLD_NOTHING, answers)
            if verb == ANSWER or (verb == EXPECTED and is_reached):
                return status
            return REACHED if is_reached else FAILED
    if question["keeps_mode"] == 0 and tables.machine[0]["has_seeds"] == 0:
        return OPEN
    clip(tables, scratch.target[0])
    project(tables, scratch, question, n_starts)
    if verb == ANSWER and question["keeps_mode"] == 1 and links.kept[0] == 0:
        finish(tables, scratch)
    if links.kept[0] < links.pairs.shape[0] and not keeps_clearance(tables, scratch, scratch.answer):
        links.kept[0] = links.pairs.shape[0]
        project(tables, scratch, question, 1)
    status = put_answer(tables, scratch, row, target, scratch.answer, int(tables.holds[0]), answers)
    if control["bound"] > 0:
        answers.counters[row, ITERATIONS] = control["linearised"]
    return status if links.kept[0] == 0 or keeps_clearance(tables, scratch, scratch.answer) else FAILED


@search
def note_near(tables_address: int, scratch_address: int, coordinates: Floats, is_near: Ints) -> None:
    """Note which rows of joint coordinates (n, columns) have links nearer than the clearance, (n,)."""
    tables, scratch = open_tables(tables_address), open_scratch(scratch_address)
    for row in range(is_near.shape[0]):
        for j in range(tables.scale.shape[0]):
            scratch.begin.coordinates[0, j] = coordinates[row, j] * tables.scale[j]
        is_near[row] = 0 if keeps_clearance(tables, scratch, scratch.begin) else 1


@search
def answer_joints(
    tables_address: int,
    scratch_address: int,
    question_address: int,
    targets: Floats,
    begins: Floats,
    answers: Answered,
    status: Ints,
) -> int:
    """Answer targets (n, 4, 4) [length] as `answer_row` does, from one start (1, columns) or one for each.

    Parameters
    ----------
    tables_address, scratch_address, question_address : of `JointTables`, `JointScratch` and `JointQuestion`.
    status : (n,); rows that are not OPEN are left.

    Returns
    -------
    The number of rows that are left OPEN.
    """
    tables, scratch, n_open = open_tables(tables_address), open_scratch(scratch_address), 0
    question = open_question(question_address).asked[0]
    for row in range(targets.shape[0]):
        if status[row] == OPEN:
            begin = begins[row if begins.shape[0] > 1 else 0]
            status[row] = answer_row(tables, scratch, row, begin, targets[row], question, answers)
            n_open += 1 if status[row] == OPEN else 0
    return n_open
