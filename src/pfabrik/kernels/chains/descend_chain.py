"""The nearest configuration of a chain to a target: Newton's steps within limits that keep the held components."""

from __future__ import annotations

import math

from ...common.arrays import Floats
from .._jit import routine
from ..joints.linearise_loops import begin_pricing
from ..joints.loops import BASE_AXES, LOCKED, PoseObjective
from ..legs.complete_poses import turn_pose
from ..linear import solve_spd
from ..projecting import is_spent
from ..quaternions import difference
from ..search_constants import MOST_STEPS
from ..vectors import copy_table, norm, vec
from .chain_constants import (
    CONVERGED,
    EXACT,
    FINE,
    FIRST_DAMPING,
    GOOD,
    LEAST_DAMPING,
    LEAST_PIVOT,
    LONGEST_STEP,
    MOST_DAMPING,
    NOTHING,
    ON_BOUND,
    PULL,
    PULLED_TURN,
    RESTORED,
    RESTORING,
    SUFFICIENT,
    SWEEPS,
)
from .chain_records import ChainScratch, SerialChain
from .curvature import fill_curvature, model_change, plan_newton_step
from .reach_target import largest, measure_pose, reach_target
from .walk_chain import copy_chain_state, move_chain


@routine
def descend_chain(
    chain: SerialChain, target: Floats, objective: PoseObjective, s: ChainScratch, closeness: float
) -> float:
    """Descend from `s.state` to a local minimum, left there with its pose in `s.X`; the objective, or infinity.

    It is infinite where the held components cannot be met from here.
    """
    state, best = s.state, s.best
    begin_pricing(s.gradient)
    value, held = reach_target(chain, target, objective, state, s, closeness, 3 * RESTORING, False)
    if largest(s.gradient.errors, held) > RESTORED:
        return math.inf
    estimate_multipliers(chain, held, s)
    damping, predicted, is_kept = FIRST_DAMPING, math.inf, True
    for _ in range(MOST_STEPS):
        if is_spent(s.effort[0]):
            break
        s.effort[0]["steps"] += 1
        if value <= NOTHING or abs(predicted) <= CONVERGED * value or damping > MOST_DAMPING:
            break
        if not is_kept:
            copy_chain_state(best, state)
            measure_pose(chain, target, objective, state, s)
            is_kept = True
        fill_curvature(objective, target, held, 1.0, s)
        scale = lay_out_step(chain, s)
        for k in range(held):
            s.wanted[k] = s.multipliers[k]
        is_definite = plan_newton_step(chain, held, damping * scale, LEAST_PIVOT * scale, SWEEPS, s)
        if not is_definite and damping < FIRST_DAMPING:
            damping = FIRST_DAMPING
            continue
        if not is_definite:
            fill_curvature(objective, target, held, 0.0, s)
            lay_out_step(chain, s)
            is_definite = plan_newton_step(chain, held, damping * scale, LEAST_PIVOT * scale, SWEEPS, s)
        if not is_definite or longest_step(s) > LONGEST_STEP:
            for k in range(held):
                s.multipliers[k] = s.wanted[k]
            damping = max(10.0 * damping, FIRST_DAMPING)
            continue
        predicted = -model_change(chain, s)
        if predicted < -CONVERGED * value:  # freedoms at their bounds leave too few to keep what is held
            for k in range(held):
                s.multipliers[k] = s.wanted[k]
            damping = max(10.0 * damping, FIRST_DAMPING)
            continue
        copy_chain_state(state, best)
        move_chain(chain, state, s)
        trial, _ = reach_target(chain, target, objective, state, s, closeness, RESTORING, True)
        actual = value - trial
        enough = max(SUFFICIENT * predicted, 0.0) if predicted > FINE * value else -CONVERGED * value
        is_kept = largest(s.gradient.errors, held) <= RESTORED and actual >= enough
        if is_kept:
            value = trial
            if abs(actual - predicted) < EXACT * predicted:
                damping = max(0.05 * damping, LEAST_DAMPING)
            elif actual > GOOD * predicted:
                damping *= 0.4
        else:
            damping *= 5.0
    if not is_kept:
        copy_chain_state(best, state)
        measure_pose(chain, target, objective, state, s)
    return value


@routine
def pull(chain: SerialChain, target: Floats, objective: PoseObjective, distance: float, s: ChainScratch) -> bool:
    """Write to `s.pulled` a target farther out than a near one, in the direction of the error; False if it is not near.

    Where the workspace ends next to a target, its pull is as weak as the distance, and bends of many joints change it
    only to second order. The farther target has the same nearest configuration, and pulls.
    """
    X, turn, pulled = s.X, s.gradient.turn, s.pulled
    if not 0.0 < distance < PULL:
        return False
    copy_table(target, pulled)
    share, is_turned = PULL / distance, objective.frame == BASE_AXES and 0.0 < objective.platform[3] < LOCKED
    if is_turned:
        difference(target, X, turn[3:])
        share = min(share, PULLED_TURN / max(norm(vec(turn[3:])), 1e-300))
    for i in range(3):
        if 0.0 < objective.platform[i] < LOCKED:
            pulled[i, 3] = X[i, 3] + share * (target[i, 3] - X[i, 3])
        for j in range(3 if is_turned else 0):
            pulled[i, j] = X[i, j]
    if is_turned:
        turn_pose(pulled, (share * turn[3], share * turn[4], share * turn[5]))
    return True


@routine
def longest_step(s: ChainScratch) -> float:
    """The longest step of a freedom."""
    longest = 0.0
    for d in range(len(s.step)):
        longest = max(longest, abs(s.step[d]))
    return longest


@routine
def lay_out_step(chain: SerialChain, s: ChainScratch) -> float:
    """Write the gradient in all freedoms, and fix those that a bound holds; the square of the longest screw."""
    scale = 0.0
    for d in range(len(chain.lo)):
        row, force, square = s.screws[d], 0.0, 0.0
        for i in range(6):
            force += s.total[i] * row[i]
            square += row[i] * row[i]
        s.force[d], s.fixed[d], s.step[d] = force, 0, 0.0
        scale = max(scale, square)
        if (force > 0.0 and s.least[d] > -ON_BOUND) or (force < 0.0 and s.most[d] < ON_BOUND):
            s.fixed[d] = 1
    for cone in range(len(chain.cone_angles)):
        if s.cones[cone, 3] == 1.0:
            d = chain.freedoms[chain.cone_motions[cone]]
            s.bend[d + 2] = -s.force[d] * s.cones[cone, 4] if s.fixed[d] == 1 else 0.0
    return scale


@routine
def estimate_multipliers(chain: SerialChain, held: int, s: ChainScratch) -> None:
    """Multipliers of the held components that best balance the gradient in freedoms away from their bounds."""
    if held == 0:
        return
    for i in range(held):
        for k in range(held + 1):
            s.A[i, k] = 0.0
    for d in range(len(chain.lo)):
        if s.least[d] > -ON_BOUND or s.most[d] < ON_BOUND:
            continue
        row, force = s.screws[d], 0.0
        for i in range(6):
            force += s.gradient.force[i] * row[i]
        for k in range(held):
            s.wanted[k] = 0.0
            for i in range(6):
                s.wanted[k] += s.gradient.holds[k, i] * row[i]
        for i in range(held):
            s.A[i, held] -= s.wanted[i] * force
            for k in range(i + 1):
                s.A[i, k] += s.wanted[i] * s.wanted[k]
    solve_spd(s.A, held, 1e-10)
    for k in range(held):
        s.multipliers[k] = s.A[k, held]
