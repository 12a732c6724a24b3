"""Half-spaces that branches ask their trunk, or the target, to move into; and the least step that answers them all.

A limit of a branch is exceeded by e [length]; e depends on where the carrier has the target: on the target's position t
and the platform's rotation, both relative to the carrier. To first order

    e + g . dt + w . dphi <= 0,

with the gradients g [-] and w [length per rad]. A trunk joint with axis a through p moves the target relative to the
carrier by dt = -a x (t - p), dphi = -a; the platform itself by dt = x + dphi x (t - c).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats, Ints
from .._jit import allocator, routine
from ..qp import QP, solve_qp
from ..vectors import Vec, add, along, cross, dot, flatten, move, norm, put, scale, sub, turn, vec
from .meet import base_of, is_two_part, reach_end
from .plan import CARRIER_CONE, PLATFORM_CONE, SLIDE, TRANSLATES, TURNS, Configuration, Plan, Settings
from .restrict import NO_LENGTH, NO_SIDE, any_normal, hinge_angle

# What it costs to miss half-spaces by a length beside the same step: those that contradict each other are missed alike,
# those that do not by a millionth of the step.
STIFF = 1e3
# An equation follows from others if they leave less of the square of its row than this share.
DEPENDENT = 1e-6
# A branch of several parts that reaches is probed by this share of the window beyond its target.
PROBE = 0.2
# A half-space that no motion answers: its rates are below this.
NO_RATE = 1e-6
# Unknowns of the platform: its translation, and its turn times L.
PLATFORM = 6


class Asks(NamedTuple):
    """Half-spaces asked for, G x + h <= 0; scratch memory of one thread.

    The unknowns x are the platform's motion, if `frame` has its bits, then trunk joints [L or rad].
    """

    problem: QP  # rows G and what they ask to be undone, h [L], the margin included; one unknown more is a slack
    equal: Ints  # (k,): 1 for an equation
    squares: Floats  # (k,): of the rows
    x: Floats  # (n,): the step [L]
    basis: Floats  # (n, n): directions of the equations
    goal: Floats  # how far within limits to aim; how near a limit still counts; scale of trunk steps; lever [length]
    frame: Ints  # number of rows; number of unknowns; column of trunk joint 0; the platform's free motions
    normals: Floats  # (n_branches, 3): which way each branch's end was missed last; zero if it was not
    pose: Floats  # (4, 4): the best pose so far
    trunks: Floats  # (n_trunk_joints,): its trunks
    start: Floats  # (n_trunk_joints,): where they began


@allocator
def new_asks(plan: Plan) -> Asks:
    """Allocate for all branches and trunk joints at once."""
    joints, branches = plan.trunk_joints.shape[0], plan.branches.shape[0]
    k, n = 9 * branches + plan.cones.shape[0] + 2 * joints, PLATFORM + joints
    n_x = n + 1
    problem = QP(
        np.zeros((n_x, n_x)),
        np.zeros(n_x),
        np.zeros((k, n_x)),
        np.zeros(k),
        np.zeros(n_x),
        np.zeros(k),
        np.zeros((n_x, n_x)),
        np.zeros((n_x + 1, n_x)),
        np.zeros((n_x + 1, n_x + 1)),
        np.zeros(n_x),
        np.zeros(n_x),
        np.zeros(n_x, np.int64),
    )
    return Asks(
        problem,
        np.zeros(k, np.int64),
        np.zeros(k),
        np.zeros(n),
        np.zeros((n, n)),
        np.zeros(4),
        np.zeros(4, np.int64),
        np.zeros((branches, 3)),
        np.zeros((4, 4)),
        np.zeros(joints),
        np.zeros(joints),
    )


@routine
def open_asks(asks: Asks, n: int, column: int, free: int) -> None:
    """Begin with no half-space: n unknowns, trunk joint 0 at a column, and the platform's free motions."""
    asks.frame[0] = 0
    asks.frame[1] = n
    asks.frame[2] = column
    asks.frame[3] = free


@routine
def ask(plan: Plan, b: int, config: Configuration, asks: Asks, excess: float, equal: int, g: Vec, w: Vec) -> float:
    """Add the half-space e + g . dt + w . dphi <= 0 of a branch, or the equation; how far it is exceeded.

    Left out, with 0, are limits that are kept by more than `asks.goal` says, and what no motion answers.
    """
    if equal == 0 and excess <= -asks.goal[1]:
        return 0.0
    k, n, free = asks.frame[0], asks.frame[1], asks.frame[3]
    row, branch = asks.problem.G[k], plan.branches[b]
    for i in range(n):
        row[i] = 0.0
    t = move(config.pose, vec(branch["end"]))
    if free & TRANSLATES:
        put(row, g)
    if free & TURNS:
        arm = sub(t, (config.pose[0, 3], config.pose[1, 3], config.pose[2, 3]))
        put(row[3:], scale(1.0 / asks.goal[3], add(cross(arm, g), w)))
    trunk = branch["carrier"] - 1
    if trunk >= 0:
        for j in range(plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]):
            axis = vec(config.screws[j, 1])
            if plan.trunk_joints[j]["kind"] == SLIDE:
                rate = dot(g, axis)
            else:
                rate = (dot(g, cross(axis, sub(t, vec(config.screws[j, 0])))) + dot(w, axis)) / plan.length
            row[asks.frame[2] + j] = -rate * asks.goal[2]
    if not close_row(asks, (excess if equal == 1 else excess + asks.goal[0]) / plan.length, equal):
        return 0.0
    return abs(excess) if equal == 1 else max(excess, 0.0)


@routine
def close_row(asks: Asks, excess: float, equal: int) -> bool:
    """Count the row that has been filled; False if it is left out, for no motion answers it."""
    k = asks.frame[0]
    square = dot_of(asks.problem.G[k], asks.problem.G[k], asks.frame[1])
    if square <= NO_RATE * NO_RATE:
        return False
    asks.problem.h[k] = excess
    asks.equal[k] = equal
    asks.squares[k] = square
    asks.frame[0] = k + 1
    return True


@routine
def ask_for_ranges(plan: Plan, first: int, last: int, config: Configuration, asks: Asks) -> None:
    """Add the ranges of trunk joints."""
    for j in range(first, last):
        joint = plan.trunk_joints[j]
        unit = plan.length if joint["kind"] == SLIDE else 1.0
        for bound, sign in ((joint["lo"], -1.0), (joint["hi"], 1.0)):
            if abs(bound) < math.inf:
                for i in range(asks.frame[1]):
                    asks.problem.G[asks.frame[0], i] = 0.0
                asks.problem.G[asks.frame[0], asks.frame[2] + j] = sign * asks.goal[2]
                close_row(asks, sign * (config.trunks[j] - bound) / unit, 0)


@routine
def ask_for_branch(plan: Plan, b: int, config: Configuration, settings: Settings, asks: Asks) -> float:
    """Add what a branch asks for; the largest excess of what motions answer [length]."""
    branch = plan.branches[b]
    parts, t = branch["last"] - branch["first"], move(config.pose, vec(branch["end"]))
    gap = ask_for_planes(plan, b, config, asks, parts)
    if parts + branch["rail"] == 0:
        d = sub(t, base_of(plan, branch, config))
        for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
            gap = max(gap, ask(plan, b, config, asks, dot(axis, d), 1, axis, (0.0, 0.0, 0.0)))
        return gap
    if parts == 1 and branch["rail"] == 0:
        return max(gap, ask_for_strut(plan, b, config, asks))
    return max(gap, ask_for_end(plan, b, config, settings, asks))


@routine
def ask_for_planes(plan: Plan, b: int, config: Configuration, asks: Asks, parts: int) -> float:
    """Add equations: the end in the plane of the hinges, and the platform's hinge parallel to them."""
    branch, gap, zero = plan.branches[b], 0.0, (0.0, 0.0, 0.0)
    if branch["planar"] == 0:
        return gap
    normal = turn(config.carriers[branch["carrier"]], vec(branch["normal"]))
    if parts > 0 and branch["planar"] >= parts:
        off = dot(normal, sub(move(config.pose, vec(branch["end"])), base_of(plan, branch, config)))
        gap = max(gap, ask(plan, b, config, asks, off, 1, normal, zero))
    hinge = vec(branch["end_normal"])
    if branch["end_plane"] == 0 and dot(hinge, hinge) > 0.0:
        hinge, e = turn(config.pose, hinge), any_normal(normal)
        for across in (e, cross(normal, e)):
            off = plan.length * dot(hinge, across)
            gap = max(gap, ask(plan, b, config, asks, off, 1, zero, scale(plan.length, cross(hinge, across))))
    return gap


@routine
def ask_for_strut(plan: Plan, b: int, config: Configuration, asks: Asks) -> float:
    """Add the limits of a strut: its stroke, its hinge's range, a plane of the platform, cones at both ends."""
    branch, gap, zero = plan.branches[b], 0.0, (0.0, 0.0, 0.0)
    carrier, node = config.carriers[branch["carrier"]], plan.nodes[branch["last"]]
    d = sub(move(config.pose, vec(branch["end"])), base_of(plan, branch, config))
    length = max(norm(d), NO_LENGTH)
    u = scale(1.0 / length, d)
    if node["lo"] == node["hi"]:
        gap = ask(plan, b, config, asks, length - node["hi"], 1, u, zero)
    else:
        gap = ask(plan, b, config, asks, length - node["hi"], 0, u, zero)
        gap = max(gap, ask(plan, b, config, asks, node["lo"] - length, 0, scale(-1.0, u), zero))
    foot = plan.nodes[branch["first"]]
    if foot["ranged"] == 1:
        normal = turn(carrier, vec(branch["normal"]))
        flat = flatten(d, normal)
        rho = max(norm(flat), NO_LENGTH)
        angle = hinge_angle(plan, branch, branch["first"], carrier, normal, config.nodes, flat)
        g = scale(1.0 / rho, cross(normal, flat))
        gap = max(gap, ask(plan, b, config, asks, (angle - foot["angle_hi"]) * rho, 0, g, zero))
        below, g = (foot["angle_lo"] - angle) * rho, scale(-1.0, g)
        gap = max(gap, ask(plan, b, config, asks, below, 0, g, zero))
    if branch["end_plane"] == 1:
        p = turn(config.pose, vec(branch["end_normal"]))
        gap = max(gap, ask(plan, b, config, asks, dot(p, d), 1, p, cross(p, d)))
    for c in range(branch["cone_first"], branch["cone_last"]):
        cone = plan.cones[c]
        a = vec(cone["axis"])
        a = turn(carrier, a) if cone["kind"] == CARRIER_CONE else scale(-1.0, turn(config.pose, a))
        excess, g = cone_excess(a, cone["cosine"], cone["sine"], d)
        w = cross(g, d) if cone["kind"] == PLATFORM_CONE else zero
        gap = max(gap, ask(plan, b, config, asks, excess, 0, g, w))
    return gap


@routine
def cone_excess(axis: Vec, c: float, s: float, d: Vec) -> tuple[float, Vec]:
    """Distance of the tip of `d` from the surface of a cone, positive outside; and its gradient.

    c and s : cosine and sine of the cone's half angle.
    """
    x = dot(axis, d)
    radial = along(d, -x, axis)
    r = norm(radial)
    across = scale(1.0 / r, radial) if r > NO_SIDE * norm(d) else any_normal(axis)
    return r * c - x * s, along(scale(c, across), -s, axis)


@routine
def ask_for_end(plan: Plan, b: int, config: Configuration, settings: Settings, asks: Asks) -> float:
    """Add the half-space beyond the nearest end of a branch of several parts, square to what it misses its target by.

    A branch that reaches is probed beyond its target, where it was missed last, if limits that are kept count.
    """
    branch, zero = plan.branches[b], (0.0, 0.0, 0.0)
    t, base = move(config.pose, vec(branch["end"])), base_of(plan, branch, config)
    if branch["planar"] >= branch["last"] - branch["first"]:
        normal = turn(config.carriers[branch["carrier"]], vec(branch["normal"]))
        t = along(t, -dot(normal, sub(t, base)), normal)
    gap, _passes = reach_end(plan, b, config, t, settings)
    if gap > settings.enough:
        n = scale(1.0 / gap, sub(t, vec(config.nodes[branch["last"]])))
        put(asks.normals[b], n)
        return ask(plan, b, config, asks, gap, 0, n, zero)
    n = vec(asks.normals[b])
    if asks.goal[1] == 0.0 or dot(n, n) == 0.0 or not is_two_part(plan, b):
        return 0.0
    beyond = along(t, PROBE * asks.goal[1], n)
    gap, _passes = reach_end(plan, b, config, beyond, settings)
    if gap > settings.enough:
        end = vec(config.nodes[branch["last"]])
        n = scale(1.0 / gap, sub(beyond, end))
        put(asks.normals[b], n)
        ask(plan, b, config, asks, dot(n, sub(t, end)), 0, n, zero)
    return 0.0


@routine
def keep_equations(asks: Asks) -> None:
    """Move x to the nearest point that keeps all equations, and let the other rows push it along these only.

    Gram and Schmidt's directions, one for each equation that does not follow from those before.
    """
    k, n, m = asks.frame[0], asks.frame[1], 0
    rows, h, x, basis = asks.problem.G, asks.problem.h, asks.x, asks.basis
    for i in range(k):
        if asks.equal[i] == 0:
            continue
        off = h[i] + dot_of(rows[i], x, n)
        for j in range(n):
            basis[m, j] = rows[i, j]
        for p in range(m):
            share = dot_of(basis[m], basis[p], n)
            for j in range(n):
                basis[m, j] -= share * basis[p, j]
        square = dot_of(basis[m], basis[m], n)
        if square <= DEPENDENT * asks.squares[i]:
            continue
        for j in range(n):
            basis[m, j] /= math.sqrt(square)
            x[j] -= off / math.sqrt(square) * basis[m, j]
        m += 1
        if m == n:
            break
    for i in range(k):
        if m > 0 and asks.equal[i] == 0:
            h[i] += dot_of(rows[i], x, n)
            for p in range(m):
                share = dot_of(rows[i], basis[p], n)
                for j in range(n):
                    rows[i, j] -= share * basis[p, j]
            h[i] -= dot_of(rows[i], x, n)


@routine
def dot_of(a: Floats, b: Floats, n: int) -> float:
    """Inner product of the first n entries."""
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total


@routine
def least_step(asks: Asks) -> None:
    """Move x by the least step that keeps all equations and answers all half-spaces.

    One more unknown, that costs `STIFF` times as much, is by how much all of them may be missed where they contradict.
    """
    keep_equations(asks)
    k, n, problem = asks.frame[0], asks.frame[1], asks.problem
    inequalities = 0
    for i in range(k):
        if asks.equal[i] == 0:
            problem.h[inequalities] = problem.h[i] + dot_of(problem.G[i], asks.x, n)
            for j in range(n):
                problem.G[inequalities, j] = problem.G[i, j]
            problem.G[inequalities, n] = -1.0 / STIFF
            inequalities += 1
    for i in range(n + 1):
        problem.g[i] = 0.0
        for j in range(n + 1):
            problem.factor[i, j] = 1.0 if i == j else 0.0
    solve_qp(problem, n + 1, inequalities)
    for i in range(n):
        asks.x[i] += problem.x[i]
