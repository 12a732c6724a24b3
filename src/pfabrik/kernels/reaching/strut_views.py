"""What a pose of a platform on struts looks like: the objective and the limits, to first and second order.

Struts close by themselves, whatever the pose: lengths and cones are functions of it, with gradients that can be written
down. So there are as many unknowns as freedoms. Lengths are in units of L.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._jit import allocator, routine
from ..closure.loops import Ints
from ..qp import QP, new_qp
from ..sqp import (
    CLOSED,
    EXCESS,
    GAP,
    LIMITS,
    LONGEST_STEP,
    MOTIONS,
    NEARLY_CLOSED,
    PROBE,
    REACH,
    RESTORING,
    VALUE,
    Hessian,
    Linearisation,
    StepControl,
    is_closed,
    longest,
    new_hessian,
    new_linearisation,
    new_step_control,
    restoring_step,
)
from ..vectors import Vec, add, cross, dot, move, norm, scale, sub, vec
from .frames import move_carriers, rotation_between, turn_pose_by_vector
from .measure import cone_step
from .passes import point_rate
from .plan import CARRIER_CONE, HOLD_ORIENTATION, HOLD_POSITION, LENGTH, ON_STRUTS, TURN, Configuration, Floats, Plan
from .project import copy_configuration
from .restrict import cone_axis
from .rows import new_configuration

MARGIN = 1e-10
"""How far inside their limits answers are put [L or rad]: a tenth of the excess that counts as none."""

LEAST_SINE = 1e-9
"""Sine of an angle below which the way to change it has no direction."""


class Descent(NamedTuple):
    """Room for one search."""

    nearest: Configuration
    best: Configuration
    trial: Configuration
    first: Linearisation
    second: Linearisation
    hessian: Hessian
    control: StepControl
    p: QP
    columns: Ints  # (6 + trunk joints,): unknown of each motion, or -1 for one that is held
    row: Floats  # (6 + trunk joints,): a gradient in all motions
    here: Floats
    there: Floats
    unit: Floats  # (1,): what the objective is multiplied by, so that its gradient is of order one


@allocator
def new_descent(plan: Plan) -> Descent:
    """Room for one search; next to none for a machine that does not stand on struts."""
    n = 6 + plan.trunk_joints.shape[0]
    k = 2 * plan.branches.shape[0] + plan.cones.shape[0] + 2 * plan.trunk_joints.shape[0]
    if plan.scalars[ON_STRUTS] == 0.0:
        n, k = 0, 0
    return Descent(
        new_configuration(plan),
        new_configuration(plan),
        new_configuration(plan),
        new_linearisation(n, k),
        new_linearisation(n, k),
        new_hessian(n, k),
        new_step_control(),
        new_qp(n, k),
        np.zeros(n, np.int64),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.ones(1),
    )


@routine
def unit_of(plan: Plan, j: int) -> float:
    """What one step of a trunk joint's unknown is in its own unit [rad or length]."""
    return 1.0 if plan.trunk_joints[j]["kind"] == TURN else float(plan.scalars[LENGTH])


@routine
def number_motions(plan: Plan, hold: int, search: Descent) -> int:
    """Number the unknowns: what is not held of the platform's motions, then the trunk joints; how many."""
    n = 0
    for i in range(search.columns.shape[0]):
        held = (i < 3 and hold == HOLD_POSITION) or (3 <= i < 6 and hold == HOLD_ORIENTATION)
        search.columns[i] = -1 if held else n
        n += 0 if held else 1
    return n


@routine
def step_to(plan: Plan, now: Configuration, wanted: Floats) -> tuple[Vec, Vec]:
    """How the platform differs from where it is wanted: position [L], rotation [rad]."""
    L = plan.scalars[LENGTH]
    off = (
        (now.pose[0, 3] - wanted[0, 3]) / L,
        (now.pose[1, 3] - wanted[1, 3]) / L,
        (now.pose[2, 3] - wanted[2, 3]) / L,
    )
    return off, rotation_between(wanted, now.pose)


@routine
def objective(plan: Plan, now: Configuration, wanted: Floats, weight: float, search: Descent, out: Floats) -> float:
    """Half the square of the distance, rotations squared counting `weight`; its gradient in all motions."""
    unit = search.unit[0]
    off, turned = step_to(plan, now, wanted)
    for i in range(3):
        out[i] = unit * off[i]
        out[3 + i] = unit * weight * turned[i]
    for i in range(6, out.shape[0]):
        out[i] = 0.0
    return 0.5 * unit * (dot(off, off) + weight * dot(turned, turned))


@routine
def add_line(
    plan: Plan, b: int, now: Configuration, g: Vec, on_carrier: Vec, on_platform: Vec, factor: float, out: Floats
) -> None:
    """Add to `out` a gradient in the line from foot to head [1/L], and in rotations of what carries its two ends."""
    branch, L = plan.branches[b], plan.scalars[LENGTH]
    foot, head = vec(now.nodes[branch["first"]]), vec(now.nodes[branch["last"]])
    arm = scale(1.0 / L, sub(head, (now.pose[0, 3], now.pose[1, 3], now.pose[2, 3])))
    moment = add(cross(arm, g), on_platform)
    for i in range(3):
        out[i] += factor * g[i]
        out[3 + i] += factor * moment[i]
    if branch["carrier"] == 0:
        return
    span = plan.trunks[branch["carrier"] - 1]
    for j in range(span["first"], span["last"]):
        rate = dot(g, point_rate(plan, now, j, foot))
        if plan.trunk_joints[j]["kind"] == TURN:
            rate = rate / L - dot(on_carrier, vec(now.screws[j, 1]))
        out[6 + j] -= factor * rate


@routine
def cone_excess(plan: Plan, b: int, c: int, now: Configuration) -> tuple[float, Vec, Vec, Vec]:
    """Excess over a cone [rad], its gradient in the line from foot to head, and in turns of carrier and platform."""
    branch, cone = plan.branches[b], plan.cones[c]
    zero = (0.0, 0.0, 0.0)
    axis = cone_axis(cone, now.carriers[branch["carrier"]], now.pose, zero, now.nodes)
    d = scale(1.0 / plan.scalars[LENGTH], cone_step(cone, now.nodes))
    size = norm(d)
    u = scale(1.0 / size, d)
    across, cosine = cross(axis, u), dot(axis, u)
    sine = norm(across)
    excess = math.atan2(sine, cosine) - cone["half_angle"] + MARGIN
    if sine < LEAST_SINE:
        return excess, zero, zero, zero
    g = scale(-1.0 / (size * sine), sub(axis, scale(cosine, u)))
    moment = scale(-1.0 / sine, across)  # the axis turned toward the line makes the angle less
    if cone["kind"] == CARRIER_CONE:
        return excess, g, moment, zero
    return excess, scale(-1.0, g), zero, moment


@routine
def strut_excess(plan: Plan, b: int, now: Configuration, side: int) -> tuple[float, Vec]:
    """Excess of a strut over its shortest (side 0) or longest length [L], and its gradient in the line."""
    branch, L = plan.branches[b], plan.scalars[LENGTH]
    node = plan.nodes[branch["last"]]
    d = sub(vec(now.nodes[branch["last"]]), vec(now.nodes[branch["first"]]))
    length = norm(d)
    if side == 0:
        return (node["lo"] - length) / L + MARGIN, scale(-1.0 / length, d)
    return (length - node["hi"]) / L + MARGIN, scale(1.0 / length, d)


@routine
def trunk_excess(plan: Plan, j: int, now: Configuration, side: int) -> float:
    """Excess of a trunk joint over its lower (side 0) or upper bound [L or rad]."""
    joint = plan.trunk_joints[j]
    over = joint["lo"] - now.trunks[j] if side == 0 else now.trunks[j] - joint["hi"]
    return float(over / unit_of(plan, j) + MARGIN)


@routine
def enter_limit(search: Descent, linear: Linearisation, k: int, h: float, number: int) -> int:
    """Note a limit whose gradient in all motions is in `row`; the next free place."""
    linear.h[k], linear.which[k] = h, number
    linear.scalars[EXCESS] = max(linear.scalars[EXCESS], h)
    for i in range(search.row.shape[0]):
        if search.columns[i] >= 0:
            linear.G[k, search.columns[i]] = search.row[i]
        search.row[i] = 0.0
    return k + 1


@routine
def linearise(
    plan: Plan, now: Configuration, wanted: Floats, weight: float, search: Descent, linear: Linearisation
) -> None:
    """Objective and limits at a pose, to first order."""
    n, B, C = search.row.shape[0], plan.branches.shape[0], plan.cones.shape[0]
    zero = (0.0, 0.0, 0.0)
    linear.scalars[VALUE] = objective(plan, now, wanted, weight, search, search.row)
    linear.scalars[GAP], linear.scalars[EXCESS] = 0.0, -math.inf
    for i in range(n):
        if search.columns[i] >= 0:
            linear.g[search.columns[i]] = search.row[i]
        search.row[i] = 0.0
    k = 0
    for b in range(B):
        for side in range(2):
            h, g = strut_excess(plan, b, now, side)
            if h > -REACH:
                add_line(plan, b, now, g, zero, zero, 1.0, search.row)
                k = enter_limit(search, linear, k, h, 2 * b + side)
        for c in range(plan.branches[b]["cone_first"], plan.branches[b]["cone_last"]):
            h, g, on_carrier, on_platform = cone_excess(plan, b, c, now)
            if h > -REACH:
                add_line(plan, b, now, g, on_carrier, on_platform, 1.0, search.row)
                k = enter_limit(search, linear, k, h, 2 * B + c)
    for j in range(plan.trunk_joints.shape[0]):
        for side in range(2):
            h = trunk_excess(plan, j, now, side)
            if h > -REACH:
                search.row[6 + j] = -1.0 if side == 0 else 1.0
                k = enter_limit(search, linear, k, h, 2 * B + C + 2 * j + side)
    linear.counts[LIMITS] = k


@routine
def lagrangian_gradient(
    plan: Plan, now: Configuration, wanted: Floats, weight: float, search: Descent, out: Floats
) -> None:
    """Gradient of the Lagrangian in all motions, but for ranges of trunk joints, which have no curvature."""
    multipliers, B = search.hessian.multipliers, plan.branches.shape[0]
    zero = (0.0, 0.0, 0.0)
    objective(plan, now, wanted, weight, search, out)
    for b in range(B):
        for side in range(2):
            if multipliers[2 * b + side] > 0.0:
                _, g = strut_excess(plan, b, now, side)
                add_line(plan, b, now, g, zero, zero, multipliers[2 * b + side], out)
        for c in range(plan.branches[b]["cone_first"], plan.branches[b]["cone_last"]):
            if multipliers[2 * B + c] > 0.0:
                _, g, on_carrier, on_platform = cone_excess(plan, b, c, now)
                add_line(plan, b, now, g, on_carrier, on_platform, multipliers[2 * B + c], out)


@routine
def lagrangian_hessian(plan: Plan, wanted: Floats, weight: float, search: Descent, linear: Linearisation) -> float:
    """Curvature of the objective and of the active limits, by differences of gradients; the largest on its diagonal."""
    n, H, columns = search.row.shape[0], search.hessian.H, search.columns
    lagrangian_gradient(plan, search.best, wanted, weight, search, search.here)
    largest = 0.0
    for i in range(n):
        if columns[i] < 0:
            continue
        copy_configuration(plan, search.best, search.trial)
        search.row[i] = PROBE
        move_all(plan, search.row, 1.0, search.trial)
        search.row[i] = 0.0
        lagrangian_gradient(plan, search.trial, wanted, weight, search, search.there)
        for j in range(n):
            if columns[j] >= 0:
                H[columns[j], columns[i]] = (search.there[j] - search.here[j]) / PROBE
        largest = max(largest, abs(H[columns[i], columns[i]]))
    for a in range(linear.counts[MOTIONS]):
        for b in range(a):
            H[a, b] = H[b, a] = 0.5 * (H[a, b] + H[b, a])
    return largest


@routine
def move_all(plan: Plan, step: Floats, share: float, now: Configuration) -> None:
    """Take a share of a step of all motions; the struts follow."""
    for i in range(3):
        now.pose[i, 3] += share * step[i] * plan.scalars[LENGTH]
    turn_pose_by_vector(now.pose, (share * step[3], share * step[4], share * step[5]))
    for j in range(plan.trunk_joints.shape[0]):
        now.trunks[j] += share * step[6 + j] * unit_of(plan, j)
    if plan.trunk_joints.shape[0] > 0:
        move_carriers(plan, now)
    for b in range(plan.branches.shape[0]):
        branch = plan.branches[b]
        foot = move(now.carriers[branch["carrier"]], vec(plan.nodes[branch["first"]]["home"]))
        head = move(now.pose, vec(branch["end"]))
        for i in range(3):
            now.nodes[branch["first"], i] = foot[i]
            now.nodes[branch["last"], i] = head[i]


@routine
def take(plan: Plan, search: Descent, x: Floats, now: Configuration) -> float:
    """Take a step of the unknowns; the share of it that is not too long."""
    n = search.row.shape[0]
    for i in range(n):
        search.row[i] = x[search.columns[i]] if search.columns[i] >= 0 else 0.0
    share = LONGEST_STEP / max(longest(search.row, n), LONGEST_STEP)
    move_all(plan, search.row, share, now)
    for i in range(n):
        search.row[i] = 0.0
    return share


@routine
def restore_feasibility(
    plan: Plan, now: Configuration, wanted: Floats, weight: float, search: Descent, linear: Linearisation
) -> bool:
    """Bring a pose within all limits, by the shortest way; it is looked at where it ends."""
    for _step in range(RESTORING):
        linearise(plan, now, wanted, weight, search, linear)
        if is_closed(linear, CLOSED):
            return True
        if not restoring_step(linear, search.p):
            return False
        take(plan, search, search.p.x, now)
    linearise(plan, now, wanted, weight, search, linear)
    return is_closed(linear, NEARLY_CLOSED)
