"""Gauss-Newton's method from a configuration to held components of the pose, within limits: the least steps that do it.

The held components e have the derivative E in the twist of the end effector and E S in the freedoms, where S has their
screws. The least step that takes them to zero to first order is u = -S^T E^T (E S S^T E^T)^-1 e: a system of as many
equations as components, at most six, whose terms are sums over the joints. Freedoms that would leave their ranges are
set to the bounds, and the others make up for it.
"""

from __future__ import annotations

from ...common.arrays import Floats
from .._jit import routine
from ..joints.linearise_loops import pose_gradient
from ..joints.loops import PoseObjective
from ..linear import solve_spd
from ..projecting import is_spent
from .chain_constants import LONGEST_STEP, PATIENCE, PROGRESS, REACH_DAMPING, REACH_SWEEPS
from .chain_records import ChainScratch, ChainState, SerialChain
from .walk_chain import bound_steps, copy_chain_state, move_chain, walk_chain


@routine
def measure_pose(
    chain: SerialChain, target: Floats, objective: PoseObjective, state: ChainState, s: ChainScratch
) -> tuple[float, int]:
    """The objective at a configuration, and the number of held components; with screws, bounds, force and errors."""
    walk_chain(chain, state, s)
    bound_steps(chain, state, s)
    return pose_gradient(objective, target, s.X, s.gradient, True)


@routine
def reach_target(
    chain: SerialChain,
    target: Floats,
    objective: PoseObjective,
    state: ChainState,
    s: ChainScratch,
    closeness: float,
    most_steps: int,
    keeps: bool,
) -> tuple[float, int]:
    """Move a configuration until the held components are met, or no step brings them nearer; as `measure_pose`.

    The best configuration is left in `state`, with its pose, screws and errors in the scratch memory. With `keeps`,
    freedoms that `s.fixed` has stay where they are.
    """
    errors = s.gradient.errors
    distance, held = measure_pose(chain, target, objective, state, s)
    value = squares(errors, held)
    damping, idle, steps = 1e-3, 0, 0
    while steps < most_steps and largest(errors, held) > closeness and idle < PATIENCE and not is_spent(s.effort[0]):
        steps += 1
        s.effort[0]["steps"] += 1
        plan_least_step(chain, s, held, damping * min(1.0, value), keeps)
        copy_chain_state(state, s.saved)
        move_chain(chain, state, s)
        distance, _ = measure_pose(chain, target, objective, state, s)
        moved = squares(errors, held)
        idle = 0 if moved < PROGRESS * value else idle + 1
        if moved < value:
            value = moved
            damping = max(0.1 * damping, REACH_DAMPING)
            continue
        copy_chain_state(s.saved, state)
        distance, _ = measure_pose(chain, target, objective, state, s)
        damping = max(10.0 * damping, 1e-4)
    return distance, held


@routine
def squares(errors: Floats, held: int) -> float:
    """The sum of squared errors."""
    total = 0.0
    for i in range(held):
        total += errors[i] * errors[i]
    return total


@routine
def largest(errors: Floats, held: int) -> float:
    """The largest error."""
    most = 0.0
    for i in range(held):
        most = max(most, abs(errors[i]))
    return most


@routine
def plan_least_step(chain: SerialChain, s: ChainScratch, held: int, damping: float, keeps: bool) -> None:
    """Write the least step within ranges that takes the held components to zero, to first order."""
    screws, step, least, most, n = s.screws, s.step, s.least, s.most, len(chain.lo)
    turns = has_turns(s, held)
    add_products(screws, s.sums, n, turns)
    for i in range(held):
        s.wanted[i] = -s.gradient.errors[i]
    for d in range(n):
        s.fixed[d] = 1 if keeps and s.fixed[d] == 1 else 0
        if s.fixed[d] == 1:
            step[d] = 0.0
            fix_step(s, d, held, turns)
    for sweep in range(REACH_SWEEPS):
        fill_system(s, held, turns)
        add_damping(s.A, held, damping + REACH_DAMPING)
        solve_spd(s.A, held, 0.0)
        x = y = z = u = v = w = 0.0
        for i in range(held):
            row, share = s.gradient.holds[i], s.A[i, held]
            x += share * row[0]
            y += share * row[1]
            z += share * row[2]
            u += share * row[3]
            v += share * row[4]
            w += share * row[5]
        longest = 0.0
        for d in range(n):
            if s.fixed[d] == 0:
                a = screws[d, 0] * x + screws[d, 1] * y + screws[d, 2] * z
                if turns:
                    a += screws[d, 3] * u + screws[d, 4] * v + screws[d, 5] * w
                step[d] = a
                longest = max(longest, abs(a))
        if sweep == 0 and longest > LONGEST_STEP:
            share = LONGEST_STEP / longest
            for i in range(held):
                s.wanted[i] *= share
            for d in range(n):
                step[d] *= share
        n_fixed = 0
        for d in range(n):
            if s.fixed[d] == 0 and (step[d] < least[d] or step[d] > most[d]):
                step[d] = min(max(step[d], least[d]), most[d])
                s.fixed[d] = 2
                n_fixed += 1
                fix_step(s, d, held, turns)
        if n_fixed == 0 or n_fixed == n:
            return


@routine
def has_turns(s: ChainScratch, held: int) -> bool:
    """True if some held component varies with rotations of the end effector."""
    for i in range(held):
        row = s.gradient.holds[i]
        if row[3] != 0.0 or row[4] != 0.0 or row[5] != 0.0:
            return True
    return False


@routine
def add_products(screws: Floats, sums: Floats, n: int, turns: bool) -> None:
    """Sum the products of every screw with itself, lower triangle; without `turns` of their velocities alone."""
    a00 = a10 = a11 = a20 = a21 = a22 = 0.0
    for d in range(n):
        x, y, z = screws[d, 0], screws[d, 1], screws[d, 2]
        a00 += x * x
        a10 += y * x
        a11 += y * y
        a20 += z * x
        a21 += z * y
        a22 += z * z
    sums[0, 0], sums[1, 0], sums[1, 1], sums[2, 0], sums[2, 1], sums[2, 2] = a00, a10, a11, a20, a21, a22
    if not turns:
        return
    b00 = b01 = b02 = b10 = b11 = b12 = b20 = b21 = b22 = 0.0
    a00 = a10 = a11 = a20 = a21 = a22 = 0.0
    for d in range(n):
        x, y, z, u, v, w = screws[d, 0], screws[d, 1], screws[d, 2], screws[d, 3], screws[d, 4], screws[d, 5]
        b00 += u * x
        b01 += u * y
        b02 += u * z
        b10 += v * x
        b11 += v * y
        b12 += v * z
        b20 += w * x
        b21 += w * y
        b22 += w * z
        a00 += u * u
        a10 += v * u
        a11 += v * v
        a20 += w * u
        a21 += w * v
        a22 += w * w
    sums[3, 0], sums[3, 1], sums[3, 2], sums[3, 3] = b00, b01, b02, a00
    sums[4, 0], sums[4, 1], sums[4, 2], sums[4, 3], sums[4, 4] = b10, b11, b12, a10, a11
    sums[5, 0], sums[5, 1], sums[5, 2], sums[5, 3], sums[5, 4], sums[5, 5] = b20, b21, b22, a20, a21, a22


@routine
def fix_step(s: ChainScratch, d: int, held: int, turns: bool) -> None:
    """Take a freedom with a given step out of the system."""
    row, k, a = s.screws[d], 6 if turns else 3, s.step[d]
    for i in range(k):
        for j in range(i + 1):
            s.sums[i, j] -= row[i] * row[j]
    for i in range(held):
        share = 0.0
        for j in range(k):
            share += s.gradient.holds[i, j] * row[j]
        s.wanted[i] -= a * share


@routine
def fill_system(s: ChainScratch, held: int, turns: bool) -> None:
    """Write the system of the held components, with what they are to change by."""
    holds, sums, A, k = s.gradient.holds, s.sums, s.A, 6 if turns else 3
    for i in range(held):
        for j in range(i + 1):
            total = 0.0
            for p in range(k):
                share = 0.0
                for q in range(k):
                    share += (sums[p, q] if p >= q else sums[q, p]) * holds[j, q]
                total += holds[i, p] * share
            A[i, j] = total
        A[i, held] = s.wanted[i]


@routine
def add_damping(A: Floats, held: int, damping: float) -> None:
    """Add a share of the sum of the diagonal to the diagonal."""
    total = 0.0
    for i in range(held):
        total += A[i, i]
    for i in range(held):
        A[i, i] += damping * total
