"""Newton's step of a chain, in time linear in its joints.

With the inner freedom i before the outer j, second derivatives of the objective are S_i^T P S_j, where S has the screws
and P is one matrix for all pairs: turning about S_i moves the screw S_j, so that

    P = [W, 0; -[f]x, R - [m]x / 2]

with the weights W of the position, the symmetric second derivative R of the rotation's part, and the total force f and
moment m at the end. The freedoms are then eliminated from the end inwards, as controls of a linear-quadratic problem
whose state x is the twist of the freedoms further in: the cost of those further out is x^T M x / 2 + m^T x. Its pivots
are those of the whole Hessian, so that a pivot that is not positive shows that the Hessian is not positive definite.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats
from .._jit import routine
from ..joints.linearise_loops import price_curvature, turn_of_tilt, yaw_gradient
from ..joints.loops import BASE_AXES, HALF_WAY, LOCKED, TARGET_AXES, PoseObjective
from ..linear import solve_spd
from .chain_constants import HELD_WEIGHT
from .chain_records import ChainScratch, SerialChain

SMALL_TURN = 1e-3
"""Angle below which series replace the second derivative of a rotation's angle [rad]."""


@routine
def fill_curvature(objective: PoseObjective, target: Floats, held: int, bends: float, s: ChainScratch) -> None:
    """Write the matrix P at the present pose, and the total force, from the gradient and the multipliers.

    With `bends` 1.0 its terms in f and m count; without them, 0.0, it is that of Gauss-Newton's method.
    """
    P, total = s.P, s.total
    for i in range(6):
        total[i] = s.gradient.force[i]
        for k in range(held):
            total[i] += s.multipliers[k] * s.gradient.holds[k, i]
        for j in range(6):
            P[i, j] = 0.0
    for i in range(3):
        if objective.platform[i] != LOCKED:
            P[i, i] = objective.platform[i]
    add_rotation(objective, target, s)
    if objective.price > 0.0:
        add_price_curvature(objective, bends == 0.0, s)
    x, y, z = bends * total[0], bends * total[1], bends * total[2]
    P[3, 1] += z
    P[3, 2] -= y
    P[4, 0] -= z
    P[4, 2] += x
    P[5, 0] += y
    P[5, 1] -= x
    x, y, z = 0.5 * bends * total[3], 0.5 * bends * total[4], 0.5 * bends * total[5]
    P[3, 4] += z
    P[3, 5] -= y
    P[4, 3] -= z
    P[4, 5] += x
    P[5, 3] += y
    P[5, 4] -= x
    weight = HELD_WEIGHT
    for i in range(6):
        weight = max(weight, HELD_WEIGHT * abs(total[i]))
    for k in range(held):
        row = s.gradient.holds[k]
        for i in range(6):
            for j in range(6):
                P[i, j] += weight * row[i] * row[j]


@routine
def add_price_curvature(objective: PoseObjective, majorises: bool, s: ChainScratch) -> None:
    """Make the second derivatives of half the squared distance those of half the squared priced distance."""
    P, force, pricing = s.P, s.gradient.force, s.gradient.pricing[0]
    for i in range(3):
        for j in range(3):
            P[i, j] *= pricing["by_place"]
            P[3 + i, 3 + j] *= pricing["by_turn"]
    place, both, turn = price_curvature(objective, majorises, s.gradient)
    for i in range(6):
        for j in range(6):
            share = both if (i < 3) != (j < 3) else place if i < 3 else turn
            P[i, j] += share * force[i] * force[j]


@routine
def add_rotation(objective: PoseObjective, target: Floats, s: ChainScratch) -> None:
    """Add the symmetric second derivative of half the weighted square of the rotation's error."""
    frame, P = objective.frame, s.P
    weight = objective.platform[5] if frame == HALF_WAY else objective.platform[3]
    if weight == LOCKED or weight == 0.0:
        return
    if frame == BASE_AXES:
        error = s.gradient.turn
        x, y, z = error[3], error[4], error[5]
        angle = math.sqrt(x * x + y * y + z * z)
        across = 1.0 - angle * angle / 12.0
        if angle > SMALL_TURN:
            across = 0.5 * angle / math.tan(0.5 * angle)
            add_outer(P, weight * (1.0 - across) / (angle * angle), x, y, z)
        for i in range(3, 6):
            P[i, i] += weight * across
    elif frame == TARGET_AXES:
        axis, angle = turn_of_tilt(target, s.X)
        x, y, z = s.X[0, 2], s.X[1, 2], s.X[2, 2]
        add_outer(P, weight, axis[0], axis[1], axis[2])
        across = max(angle / math.tan(angle), 0.0) if angle > SMALL_TURN else 1.0
        u, v, w = axis[1] * z - axis[2] * y, axis[2] * x - axis[0] * z, axis[0] * y - axis[1] * x
        add_outer(P, weight * across, u, v, w)
    else:
        add_outer(P, weight, yaw_gradient(s.X, 0), yaw_gradient(s.X, 1), yaw_gradient(s.X, 2))


@routine
def add_outer(P: Floats, weight: float, x: float, y: float, z: float) -> None:
    """Add a multiple of the product of a rotation vector with itself."""
    P[3, 3] += weight * x * x
    P[3, 4] += weight * x * y
    P[3, 5] += weight * x * z
    P[4, 3] += weight * y * x
    P[4, 4] += weight * y * y
    P[4, 5] += weight * y * z
    P[5, 3] += weight * z * x
    P[5, 4] += weight * z * y
    P[5, 5] += weight * z * z


@routine
def eliminate_freedoms(chain: SerialChain, held: int, damping: float, least_pivot: float, s: ChainScratch) -> bool:
    """Eliminate all freedoms that are not fixed, from the end inwards; False if a pivot is not positive."""
    screws, P, M, sides = s.screws, s.P, s.M, s.sides
    for i in range(6):
        for j in range(6):
            M[i, j] = 0.0
            sides[i, j] = 0.0
    for j in range(6):
        sides[6, j] = 0.0
    for d in range(len(chain.lo) - 1, -1, -1):
        row, b = screws[d], s.couplings[d]
        pivot = damping + s.bend[d]
        for i in range(6):
            share = 0.0
            for j in range(6):
                share += (P[i, j] + M[i, j]) * row[j]
            b[i] = share
            pivot += row[i] * share
        for k in range(held + 1):
            rest = s.force[d] if k == 0 else 0.0
            for i in range(6):
                rest += sides[k, i] * row[i]
                if k > 0:
                    rest += s.gradient.holds[k - 1, i] * row[i]
            s.rests[d, k] = rest
        if s.fixed[d] == 1:
            s.pivots[d] = pivot
            for i in range(6):
                sides[0, i] += s.step[d] * b[i]
            continue
        if not pivot > least_pivot:
            return False
        inverse = 1.0 / pivot
        s.pivots[d] = inverse
        for k in range(held + 1):
            for i in range(6):
                sides[k, i] -= s.rests[d, k] * inverse * b[i]
        for i in range(6):
            share = inverse * b[i]
            for j in range(6):
                M[i, j] -= share * b[j]
    return True


@routine
def substitute(chain: SerialChain, held: int, s: ChainScratch) -> None:
    """Write the step, without and per unit of each multiplier, and the twists that it gives the end effector."""
    shifts = s.shifts
    for k in range(held + 1):
        for i in range(6):
            shifts[k, i] = 0.0
    for d in range(len(chain.lo)):
        row, b = s.screws[d], s.couplings[d]
        for k in range(held + 1):
            slope = s.rests[d, k]
            for i in range(6):
                slope += b[i] * shifts[k, i]
            if s.fixed[d] == 0:
                a = -s.pivots[d] * slope
                s.responses[d, k] = a
            else:
                a = s.step[d] if k == 0 else 0.0
                s.responses[d, k] = slope + s.pivots[d] * a
            for i in range(6):
                shifts[k, i] += a * row[i]


@routine
def plan_newton_step(
    chain: SerialChain, held: int, damping: float, least_pivot: float, sweeps: int, s: ChainScratch
) -> bool:
    """Write Newton's step within bounds that keeps the held components, and update their multipliers.

    Freedoms that would leave their ranges are fixed at the bounds, and those whose slope there leads inward are
    released, until neither is left. `s.fixed` has those that begin at a bound. False if the Hessian is not positive
    definite.
    """
    n = len(chain.lo)
    for _ in range(sweeps):
        if not eliminate_freedoms(chain, held, damping, least_pivot, s):
            return False
        substitute(chain, held, s)
        for i in range(held):
            row = s.gradient.holds[i]
            s.A[i, held] = s.gradient.errors[i]
            for k in range(i + 1):
                s.A[i, k] = 0.0
            for p in range(6):
                s.A[i, held] += row[p] * s.shifts[0, p]
                for k in range(i + 1):
                    s.A[i, k] -= row[p] * s.shifts[k + 1, p]
        solve_spd(s.A, held, 1e-13)
        n_changed = 0
        for d in range(n):
            a = s.responses[d, 0]
            for k in range(held):
                a += s.A[k, held] * s.responses[d, k + 1]
            if s.fixed[d] == 1:  # `a` is the slope of the model there
                if (a < 0.0 and s.step[d] < s.most[d]) or (a > 0.0 and s.step[d] > s.least[d]):
                    s.fixed[d] = 0
                    n_changed += 1
                continue
            s.step[d] = min(max(a, s.least[d]), s.most[d])
            if s.step[d] != a:
                s.fixed[d] = 1
                n_changed += 1
        if n_changed == 0:
            break
    for k in range(held):
        s.multipliers[k] += s.A[k, held]
    return True


@routine
def model_change(chain: SerialChain, s: ChainScratch) -> float:
    """Change of the objective that the step makes, to second order."""
    x, change, curve = s.shifts[0], 0.0, 0.0
    for i in range(6):
        x[i] = 0.0
    for d in range(len(chain.lo)):
        row, a = s.screws[d], s.step[d]
        own = 0.0
        for i in range(6):
            share = 0.0
            for j in range(6):
                share += s.P[i, j] * row[j]
            own += row[i] * share
            curve += 2.0 * a * x[i] * share
        curve += a * a * (own + s.bend[d])
        change += a * s.force[d]
        for i in range(6):
            x[i] += a * row[i]
    return change + 0.5 * curve
