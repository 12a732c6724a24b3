"""Searches of a serial chain: a target reached, or the nearest configuration, each from a start and from seeds."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Record
from .._jit import routine
from ..joints.loops import HALF_WAY, LOCKED, TARGET_AXES, PoseObjective
from ..legs.complete_poses import turn_pose
from ..pose.answer_row import errors
from ..projecting import (
    COARSE,
    HELD,
    PRICED,
    clear_tally,
    count_ending,
    is_agreed,
    is_spent,
    note_attempt,
    priced_distance,
    weighted_distance,
)
from ..quaternions import difference
from ..rows import HOLD_NOTHING, HOLD_POSITION
from ..search_constants import BESIDE, CONTINUATION_STEPS, LONGEST_IN_MODE, SAME_DISTANCE, TURNED, WORTH
from ..vectors import copy_table
from .chain_constants import BENT, CLOSENESS, DESCENTS_NEARBY, NEARER, NEARLY, PULLED_FROM, PULLS, STEPS
from .chain_records import ChainScratch, ChainTables, SerialChain
from .descend_chain import descend_chain, pull
from .reach_target import largest, reach_target
from .walk_chain import copy_chain_state, load_chain, walk_chain


@routine
def objective_of(tables: ChainTables, aim: int) -> PoseObjective:
    """The objective with the weights of one aim."""
    hold, price, rounding = tables.holds[aim], tables.prices[aim, 0], tables.prices[aim, 1]
    frame = tables.machine[0]["frame"]
    return PoseObjective(tables.seed_poses, tables.weights[aim], frame, hold, price, rounding, 0.0, 0.0, 0)


@routine
def keep_nearest(s: ChainScratch) -> None:
    """Keep the present configuration, which was walked, as the nearest."""
    copy_chain_state(s.state, s.nearest)
    copy_table(s.X, s.nearest_X)


@routine
def reach(tables: ChainTables, question: Record, s: ChainScratch) -> float:
    """Reach the target, left in `s.nearest`, or the configuration with the least error [L or rad], which is returned.

    From the start, and in any mode from the seeds nearest to the target; in the mode of the start, where the target is
    farther than one step, by way of others between.
    """
    if question["keeps_mode"] == 0:
        return reach_in_any_mode(tables, question["seeds"], s)
    chain, objective = tables.chain, objective_of(tables, 0)
    copy_chain_state(s.start, s.state)
    least = reach_from(tables, objective, -1, s)
    keep_nearest(s)
    position, rotation = distances(tables, s.start_X, s)
    is_near = least <= tables.machine[0]["met"] and math.hypot(position, rotation) <= LONGEST_IN_MODE
    if is_near or is_beyond(tables, s):
        return least
    error = math.inf
    copy_chain_state(s.start, s.state)
    for step in range(1, CONTINUATION_STEPS + 1):
        put_between(step / CONTINUATION_STEPS, s)
        _, held = reach_target(chain, s.between, objective, s.state, s, CLOSENESS, STEPS, False)
        error = largest(s.gradient.errors, held)
    if error < least or error <= tables.machine[0]["met"]:
        keep_nearest(s)
    return min(error, least)


@routine
def reach_from(tables: ChainTables, objective: PoseObjective, seed: int, s: ChainScratch) -> float:
    """Reach the target from `s.state`, and note the attempt; the error."""
    before = s.effort[0]["steps"]
    _, held = reach_target(tables.chain, s.target, objective, s.state, s, CLOSENESS, STEPS, False)
    error = largest(s.gradient.errors, held)
    note_attempt(0, seed, s.effort[0]["steps"] - before, error, s.effort[0], s.log)
    return error


@routine
def reach_in_any_mode(tables: ChainTables, most: int, s: ChainScratch) -> float:
    """`reach` from the start and from the seeds nearest to the target, at most so many."""
    objective, least = objective_of(tables, 0), math.inf
    tries = 0 if is_beyond(tables, s) else min(most, tables.machine[0]["tries"])
    n_seeds = len(tables.seeds) if tries > 0 else 0
    limit, is_tried = 0.0, False
    if tries > 0:
        put_distances(tables, objective, s)
        limit = NEARER * squared_distance(objective, s.target, s.start_X)
    for k in range(tries + 1):
        seed = nearest_seed(s, n_seeds if k < tries or is_tried else 0)
        if not is_tried and (seed < 0 or s.distances[seed] > limit):
            copy_chain_state(s.start, s.state)
            is_tried, seed = True, -1
        elif seed < 0:
            break
        else:
            load_seed(tables, seed, s)
        error = reach_from(tables, objective, seed, s)
        if error < least:
            least = error
            keep_nearest(s)
        if error <= tables.machine[0]["met"] or is_spent(s.effort[0]):
            break
    return least


@routine
def is_beyond(tables: ChainTables, s: ChainScratch) -> bool:
    """True if the target is farther away than the chain is long when it is stretched out."""
    machine, away = tables.machine[0], 0.0
    for i in range(3):
        away = math.hypot(away, s.target[i, 3] - tables.chain.offsets[0, i] if machine["axes"][i] == 1 else 0.0)
    return away > machine["longest"]


@routine
def put_between(share: float, s: ChainScratch) -> None:
    """Fill the pose a share of the way from the start to the target: a straight line, and the shortest turn."""
    between, turn, X = s.between, s.gradient.turn, s.start_X
    difference(s.target, X, turn)
    for i in range(3):
        for j in range(4):
            between[i, j] = X[i, 3] + share * (s.target[i, 3] - X[i, 3]) if j == 3 else X[i, j]
    turn_pose(between, (share * turn[0], share * turn[1], share * turn[2]))


@routine
def distances(tables: ChainTables, X: Floats, s: ChainScratch) -> tuple[float, float]:
    """Distance [L] and angle [rad] of a pose from the target, in what the task sets."""
    position, rotation = errors(tables.machine[0], s.target, X, s.gradient.turn)
    return position * tables.machine[0]["length"], rotation


@routine
def distance_left(tables: ChainTables, X: Floats, s: ChainScratch) -> float:
    """Distance of a pose from the target [L], without any price."""
    position, rotation = distances(tables, X, s)
    return weighted_distance(tables.weights[1 + PRICED if len(tables.holds) > 2 else 1], position, rotation)


@routine
def priced_at(tables: ChainTables, X: Floats, s: ChainScratch) -> float:
    """Distance of a pose from the target with the price of what is held [L]."""
    position, rotation = distances(tables, X, s)
    hold, price = tables.holds[1 + PRICED], tables.prices[1 + PRICED, 0]
    return priced_distance(tables.weights[1 + PRICED], hold, price, position, rotation)


@routine
def project_from(tables: ChainTables, around: bool, n_seeds: int, agreements: int, s: ChainScratch) -> float:
    """Find the configuration that descents from `s.own` lead to; its distance, with the price [L].

    What it misses by rounding alone of what is held is held exactly, where this costs no more.
    """
    aim = 1 + PRICED if len(tables.holds) > 2 else 1
    distance = search_for(tables, aim, around, n_seeds, agreements, s)
    if aim == 1 or distance == math.inf:
        return distance
    distance = priced_at(tables, s.nearest_X, s)
    position, rotation = distances(tables, s.nearest_X, s)
    off = position if tables.holds[aim] == HOLD_POSITION else rotation
    if off <= TURNED * tables.prices[aim, 1] * distance:
        copy_chain_state(s.nearest, s.held)
        copy_table(s.nearest_X, s.held_X)
        copy_chain_state(s.nearest, s.own)
        held = search_for(tables, 1 + HELD, False, 0, 1, s)
        if held <= (1.0 + SAME_DISTANCE) * distance:
            return held
        copy_chain_state(s.held, s.nearest)
        copy_table(s.held_X, s.nearest_X)
    return distance


@routine
def project_anew(tables: ChainTables, around: bool, n_seeds: int, s: ChainScratch) -> float:
    """Find the nearest configuration that searches from the start and seeds lead to; its distance, with the price [L].

    What is held is held at first; where that costs more than its price, it gives way, from there and from the start.
    Where nothing has it, the price counts from the outset.
    """
    machine, agreements = tables.machine[0], tables.machine[0]["agreements"]
    least = search_for(tables, 1 + HELD, around, n_seeds, agreements, s)
    if not around and machine["is_short"] == 1 and least > machine["met"] and least < NEARLY:
        copy_chain_state(s.nearest, s.own)
        least = search_for(tables, 1 + HELD, False, DESCENTS_NEARBY, DESCENTS_NEARBY, s)
    if len(tables.holds) == 2:
        return least
    if is_agreed(s.tally[0], agreements) and s.tally[0]["cost"] <= tables.prices[1 + PRICED, 0]:
        return least
    n_places = 2 if least < math.inf else 1
    if least == math.inf:
        least = search_for(tables, 1 + COARSE, around, n_seeds, agreements, s)
        least = (1.0 + BESIDE) * priced_at(tables, s.nearest_X, s) if least < math.inf else least
    for place in range(n_places):
        copy_chain_state(s.nearest, s.kept)
        copy_table(s.nearest_X, s.kept_X)
        copy_chain_state(s.kept if place == 0 else s.start, s.own)
        distance = project_from(tables, False, 0, 1, s)
        if distance < (1.0 - SAME_DISTANCE) * least:
            least = distance
        else:
            copy_chain_state(s.kept, s.nearest)
            copy_table(s.kept_X, s.nearest_X)
    return least


@routine
def project(tables: ChainTables, question: Record, has_start: bool, s: ChainScratch) -> float:
    """Find the nearest configuration, left in `s.nearest`; its distance, with the price of what is held [L].

    From a start a descent leads there, and one from a little beside it: the start may be no minimum, but a saddle.
    Others are searched for only where they lead nowhere, or so far that the start is no answer to a target before this
    one.
    """
    machine, around, distance = tables.machine[0], question["keeps_mode"] == 1, math.inf
    n_seeds = min(
        machine["bends"] if around else machine["descents"], 1 if question["is_nearby"] == 1 else question["seeds"]
    )
    if has_start:
        copy_chain_state(s.own, s.begin)
        load_bent(tables, 0, s)
        copy_chain_state(s.state, s.own)
        distance = project_from(tables, True, 1, 2, s)
        if around and distance <= machine["met"]:  # steps in the mode that is kept do not lead there
            distance = math.inf
        copy_chain_state(s.begin, s.own)
        before = distance_left(tables, s.start_X, s)
        if distance < math.inf and before - distance_left(tables, s.nearest_X, s) <= WORTH:
            return distance
        copy_chain_state(s.nearest, s.local)
        copy_table(s.nearest_X, s.local_X)
    found = project_anew(tables, around, n_seeds, s)
    if found < (1.0 - SAME_DISTANCE) * distance:
        return found
    if has_start and distance < math.inf:
        copy_chain_state(s.local, s.nearest)
        copy_table(s.local_X, s.nearest_X)
        return distance
    return found


@routine
def search_for(tables: ChainTables, aim: int, around: bool, n_seeds: int, agreements: int, s: ChainScratch) -> float:
    """Find the nearest configuration by one objective, left in `s.nearest`; its distance [L], or infinity.

    Descents begin at `s.own`, then at seeds, until enough ends agree. Those `around` the start begin there, then at
    `s.own`, then where the start is bent a little: where links are stretched out, it is chance which way they bend.
    """
    objective, tally, effort, seed = objective_of(tables, aim), s.tally[0], s.effort[0], -1
    clear_tally(tally)
    if n_seeds > 0 and not around:
        put_distances(tables, objective, s)
    for k in range(n_seeds + 1):
        if k == 0 or (around and k == 1):
            copy_chain_state(s.start if around and k == 0 else s.own, s.state)
        elif around:
            seed = k - 2
            load_bent(tables, seed, s)
        else:
            seed = nearest_seed(s, len(tables.seeds)) if k % 2 == 1 else next_seed(s, k // 2, len(tables.seeds))
            if seed < 0:
                break
            load_seed(tables, seed, s)
        before, least = effort["steps"], tally["least"]
        value = descend_chain(tables.chain, s.target, objective, s, CLOSENESS)
        distance = pull_nearer(tables.chain, objective, math.sqrt(2.0 * value), s)
        note_attempt(aim, seed, effort["steps"] - before, distance, effort, s.log)
        if distance < math.inf and distance <= (1.0 + SAME_DISTANCE) * least and count_ending(distance, tally):
            tally["cost"] = cost_of_hold(s, objective, distance)
            walk_chain(tables.chain, s.state, s)
            keep_nearest(s)
        if is_agreed(tally, agreements) or tally["least"] <= CLOSENESS or is_spent(effort):
            break
    return tally["least"]


@routine
def cost_of_hold(s: ChainScratch, objective: PoseObjective, distance: float) -> float:
    """What holding a part costs where a descent ended: the size of the multipliers, relative to the distance."""
    held = 0.0
    for k in range(s.multipliers.shape[0] if objective.hold != HOLD_NOTHING and objective.price == 0.0 else 0):
        held = math.hypot(held, s.multipliers[k])
    return held / distance if distance > 0.0 else 0.0


@routine
def load_bent(tables: ChainTables, seed: int, s: ChainScratch) -> None:
    """Load the start, moved a little towards a seed."""
    for j in range(len(s.coordinates)):
        s.bent[j] = s.coordinates[j] + BENT * (tables.seeds[seed, j] - s.coordinates[j])
    load_chain(tables.chain, s.bent, True, s.state)


@routine
def pull_nearer(chain: SerialChain, objective: PoseObjective, distance: float, s: ChainScratch) -> float:
    """Bring the configuration `s.state`, at a distance [L], nearer by way of targets farther out; the distance."""
    if not distance < PULLED_FROM * s.tally[0]["least"]:
        return distance
    for _ in range(PULLS):
        if distance <= CLOSENESS or not pull(chain, s.target, objective, distance, s):
            break
        copy_chain_state(s.state, s.unpulled)
        descend_chain(chain, s.pulled, objective, s, CLOSENESS)
        nearer = math.sqrt(2.0 * descend_chain(chain, s.target, objective, s, CLOSENESS))
        if not nearer < (1.0 - SAME_DISTANCE) * distance:
            copy_chain_state(s.unpulled, s.state)
            break
        distance = nearer
    return distance


@routine
def load_seed(tables: ChainTables, seed: int, s: ChainScratch) -> None:
    """Load a seed, and mark it as tried."""
    load_chain(tables.chain, tables.seeds[seed], True, s.state)
    s.distances[seed] = math.inf


@routine
def put_distances(tables: ChainTables, objective: PoseObjective, s: ChainScratch) -> None:
    """Fill the squared distances of all seeds from the target."""
    for k in range(len(tables.seeds)):
        s.distances[k] = squared_distance(objective, s.target, tables.seed_poses[k])


@routine
def nearest_seed(s: ChainScratch, n: int) -> int:
    """The seed that is nearest and not yet tried; -1 if there is none."""
    seed, least = -1, math.inf
    for k in range(n):
        if s.distances[k] < least:
            seed, least = k, s.distances[k]
    return seed


@routine
def next_seed(s: ChainScratch, k: int, n: int) -> int:
    """The first seed from the k-th on that is not yet tried; -1 if there is none."""
    for seed in range(k, n):
        if s.distances[seed] < math.inf:
            return seed
    return -1


@routine
def squared_distance(objective: PoseObjective, target: Floats, X: Floats) -> float:
    """Squared distance of two poses in the components of the objective: lengths in L, rotations by their chords."""
    total, w = 0.0, objective.platform
    for i in range(3):
        weight = 1.0 if w[i] == LOCKED else w[i]
        total += weight * (X[i, 3] - target[i, 3]) ** 2
    turning = w[5] if objective.frame == HALF_WAY else w[3]
    if turning == 0.0 or objective.frame == HALF_WAY:
        return total
    weight = 1.0 if turning == LOCKED else turning
    for i in range(3):
        for j in range(3):
            if j == 2 or objective.frame != TARGET_AXES:
                share = 1.0 if objective.frame == TARGET_AXES else 0.5
                total += share * weight * (X[i, j] - target[i, j]) ** 2
    return total
