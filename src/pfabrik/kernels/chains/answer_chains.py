"""Kernels of serial chains: targets reached, or the nearest configurations, each from the start and from seeds."""

from __future__ import annotations

import math

from ...arrays import Floats
from .._jit import routine, search
from ..closure.loops import HALF_WAY, LOCKED, TARGET_AXES, PoseObjective
from ..vectors import copy_row, copy_table
from .chain_records import ChainAim, ChainAnswers, SerialChain
from .chain_state import ChainScratch, ChainState, open_chain, open_chain_scratch
from .descend_chain import descend_chain, pull
from .reach_target import reach_target
from .walk_chain import copy_chain_state, excess_of, load_chain, store_chain, walk_chain

STEPS = 30
"""Most steps of an attempt to reach a target; those that converge need ten."""

DESCENT_STEPS = 200
"""Most steps of a descent, those that are not taken included; most need a dozen."""

NEARER = 0.25
"""The start goes before a seed that is not nearer than this share of its squared distance."""

NEARLY = 1e4
"""Ratio to the least objective up to which a descent's end may become the nearest by way of a target farther out."""

PULLS = 12
"""Most times that an answer is sought by way of a target farther out."""

SAME = 2e-7
"""Relative difference of objectives that count as equal."""


@search
def reach_in_chains(machine: int, scratch_address: int, aim: ChainAim, answers: ChainAnswers) -> int:
    """Reach targets, from each row's start and the seeds nearest to its target; return the number of rows missed.

    A row that is missed gets the configuration with the least error. With `aim.follows` each row starts from the result
    of the one before, and the number of rows is returned up to the first that is missed.

    Parameters
    ----------
    machine, scratch_address : addresses of a `SerialChain` and of its `ChainScratch`.
    """
    chain, s = open_chain(machine), open_chain_scratch(scratch_address)
    n_missed = 0
    for row in range(len(answers.steps)):
        target, least, steps = aim.pose.targets[row], math.inf, 0
        limit = order_seeds(chain, row, aim, answers, s)
        is_tried = False
        for k in range(aim.tries + 1):
            seed = nearest_seed(s, len(aim.seeds) if k < aim.tries or is_tried else 0)
            if not is_tried and (seed < 0 or s.distances[seed] > limit):
                load_chain(chain, answers.coordinates[row], True, s.state)
                is_tried = True
            elif seed < 0:
                break
            else:
                load_chain(chain, aim.seeds[seed], True, s.state)
                s.distances[seed] = math.inf
            error, n_steps = reach_target(chain, target, aim.pose, s.state, s, aim.closeness, STEPS)
            steps += n_steps
            if error < least:
                least = error
                keep_nearest(s)
            if error <= aim.is_held:
                break
        write_answer(chain, row, least, steps, s, answers)
        is_missed = least > aim.is_held
        if aim.follows == 1 and is_missed:
            return row
        if aim.follows == 1 and row + 1 < len(answers.steps):
            copy_row(answers.coordinates[row], answers.coordinates[row + 1])
        n_missed += 1 if is_missed else 0
    return len(answers.steps) if aim.follows == 1 else n_missed


@search
def nearest_in_chains(machine: int, scratch_address: int, aim: ChainAim, answers: ChainAnswers) -> int:
    """Find the nearest configurations to targets, from each row's start and from seeds; return how many have none.

    Parameters
    ----------
    machine, scratch_address : addresses of a `SerialChain` and of its `ChainScratch`.
    """
    chain, s = open_chain(machine), open_chain_scratch(scratch_address)
    n_missed = 0
    for row in range(len(answers.steps)):
        target, least, agreements, steps = aim.pose.targets[row], math.inf, 0, 0
        load_chain(chain, answers.coordinates[row], True, s.state)
        walk_chain(chain, s.state, s)
        keep_nearest(s)
        order_seeds(chain, row, aim, answers, s)
        for k in range(aim.tries + 1):
            if k == 0:
                load_chain(chain, answers.coordinates[row], True, s.state)
            else:
                seed = nearest_seed(s, len(aim.seeds)) if k % 2 == 1 else next_seed(s, k // 2, len(aim.seeds))
                if seed < 0:
                    break
                load_chain(chain, aim.seeds[seed], True, s.state)
                s.distances[seed] = math.inf
            value = descend_chain(chain, target, aim.pose, s, aim.closeness, DESCENT_STEPS)
            if value < NEARLY * least:
                value = pull_nearer(chain, target, aim, value, s)
            steps += 1
            if value < (1.0 - SAME) * least:
                least, agreements = value, 1
                walk_chain(chain, s.state, s)
                keep_nearest(s)
            elif value <= (1.0 + SAME) * least:
                agreements += 1
            if agreements >= aim.agreements or least <= 0.5 * aim.closeness * aim.closeness:
                break
        n_missed += 1 if least == math.inf else 0
        write_answer(chain, row, math.sqrt(2.0 * least), steps, s, answers)
    return n_missed


@routine
def pull_nearer(chain: SerialChain, target: Floats, aim: ChainAim, value: float, s: ChainScratch) -> float:
    """Bring the configuration `s.state`, of a given objective, nearer by way of targets farther out; the objective."""
    for _ in range(PULLS):
        if value <= 0.5 * aim.closeness * aim.closeness or not pull(chain, target, aim.pose, value, s):
            break
        copy_chain_state(s.state, s.unpulled)
        descend_chain(chain, s.pulled, aim.pose, s, aim.closeness, DESCENT_STEPS)
        nearer = descend_chain(chain, target, aim.pose, s, aim.closeness, DESCENT_STEPS)
        if not nearer < (1.0 - SAME) * value:
            copy_chain_state(s.unpulled, s.state)
            break
        value = nearer
    return value


@search
def walk_chains(machine: int, scratch_address: int, answers: ChainAnswers, screws: Floats) -> None:
    """Pose the end effectors of configurations, and measure their limits; coordinates are kept as they are.

    Parameters
    ----------
    machine, scratch_address : addresses of a `SerialChain` and of its `ChainScratch`.
    screws : output, of all freedoms, (n, freedoms, 6), or without rows.
    """
    chain, s = open_chain(machine), open_chain_scratch(scratch_address)
    for row in range(len(answers.steps)):
        load_chain(chain, answers.coordinates[row], False, s.state)
        walk_chain(chain, s.state, s)
        write_pose(row, s.X, answers.poses)
        answers.excesses[row] = excess_of(chain, s.state, s)
        if len(screws) > 0:
            copy_table(s.screws, screws[row])


@routine
def write_pose(row: int, X: Floats, poses: Floats) -> None:
    """Write the pose of the end effector."""
    for i in range(3):
        for j in range(4):
            poses[row, i, j] = X[i, j]


@routine
def keep_nearest(s: ChainScratch) -> None:
    """Keep the present configuration, which was walked, as the nearest."""
    copy_chain_state(s.state, s.nearest)
    copy_table(s.X, s.nearest_X)


@routine
def write_answer(
    chain: SerialChain, row: int, distance: float, steps: int, s: ChainScratch, answers: ChainAnswers
) -> None:
    """Write the nearest configuration of a row."""
    write_pose(row, s.nearest_X, answers.poses)
    store_chain(chain, s.nearest, answers.coordinates[row])
    answers.excesses[row] = excess_of(chain, s.nearest, s)
    answers.distances[row] = distance
    answers.steps[row] = steps


@routine
def order_seeds(chain: SerialChain, row: int, aim: ChainAim, answers: ChainAnswers, s: ChainScratch) -> float:
    """Write the squared distances of all seeds from a target; the one below which a seed goes before the start."""
    target, near = aim.pose.targets[row], math.inf
    if aim.tries > 0:
        for k in range(len(aim.seeds)):
            s.distances[k] = squared_distance(aim.pose, target, aim.seed_poses[k])
        load_chain(chain, answers.coordinates[row], True, s.state)
        if row == 0 or not are_same(s.state, s.start):
            walk_chain(chain, s.state, s)
            copy_chain_state(s.state, s.start)
            copy_table(s.X, s.start_X)
        near = NEARER * squared_distance(aim.pose, target, s.start_X)
    return near


@routine
def are_same(one: ChainState, other: ChainState) -> bool:
    """True if two configurations are equal, as the starts of most batches are."""
    for j in range(len(one.q)):
        if one.q[j] != other.q[j]:
            return False
    for k in range(len(one.balls)):
        for i in range(4):
            if one.balls[k, i] != other.balls[k, i]:
                return False
    return True


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
