"""Half-spaces of feasible motions of a trunk or of the target, from the limits of branches; the least step into them.

A branch exceeds a limit by e [length]. e depends on the target's position t and the platform's rotation, both relative
to the carrier. To first order

    e + g . dt + w . dphi <= 0,

with the gradients g [-] and w [length per rad]. A trunk joint with axis a through p moves the target relative to the
carrier by dt = -a x (t - p), dphi = -a; the platform itself by dt = x + dphi x (t - c).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Records
from .._jit import allocator, routine
from ..qp import QP, new_qp, solve_with_equations
from ..vectors import Vec, add, along, cross, dot, flatten, move, norm, put, scale, sub, turn, vec
from .meet import base_of, is_two_part, reach_end
from .pass_constants import NO_LENGTH, NO_RATE, NO_SIDE, PROBE, STIFF
from .plan import CARRIER_CONE, PLATFORM_CONE, TRANSLATES, TURNS, Configuration, Plan, Settings
from .restrict import any_normal, hinge_angle

# Unknowns of the platform: its translation, and its turn times L.
PLATFORM = 6

PROGRAMME = np.dtype(
    [
        ("n_rows", "i8"),
        ("n_equations", "i8"),  # the first rows
        ("n_unknowns", "i8"),
        ("trunk_column", "i8"),  # of trunk joint 0
        ("free", "i8"),  # motions of the platform: TRANSLATES, TURNS, or both
        ("margin", "f8"),  # how far within limits to aim [length]
        ("window", "f8"),  # limits farther away than this are left out [length]
        ("trunk_scale", "f8"),  # motion of a trunk joint per unit of its unknown: more than 1 makes it cheaper
        ("lever", "f8"),  # how a turn counts beside a distance [length per rad]
    ]
)


class LeastStep(NamedTuple):
    """Half-spaces G x + h <= 0 and the step into them, with the scratch memory of one thread.

    The unknowns are the platform's motion, if it is free, then trunk joints [L or rad], then a slack.
    """

    problem: QP  # H is the identity, g zero; rows G, and h [L], the margin included
    x: Floats  # (n,): the step [L]
    programme: Records  # (1,): PROGRAMME
    normals: Floats  # (n_branches, 3): direction of each branch's last end gap; zero if there was none
    pose: Floats  # (4, 4): the best pose so far
    trunks: Floats  # (n_trunk_joints,): trunk coordinates of the best pose
    start: Floats  # (n_trunk_joints,): trunk coordinates at the start


@allocator
def new_half_spaces(plan: Plan) -> LeastStep:
    """Allocate half-spaces for all branches and trunk joints."""
    joints, branches = plan.trunk_joints.shape[0], plan.branches.shape[0]
    n = PLATFORM + joints
    problem = new_qp(n + 1, 9 * branches + plan.cones.shape[0] + 2 * joints)
    for i in range(n + 1):
        problem.factor[i, i] = 1.0
    return LeastStep(
        problem,
        np.zeros(n),
        np.zeros(1, PROGRAMME),
        np.zeros((branches, 3)),
        np.zeros((4, 4)),
        np.zeros(joints),
        np.zeros(joints),
    )


@routine
def begin_programme(spaces: LeastStep, n: int, trunk_column: int, free: int) -> None:
    """Clear the half-spaces, for n unknowns."""
    programme = spaces.programme[0]
    programme["n_rows"] = programme["n_equations"] = 0
    programme["n_unknowns"] = n
    programme["trunk_column"] = trunk_column
    programme["free"] = free


@routine
def add_half_space(
    plan: Plan, b: int, config: Configuration, spaces: LeastStep, excess: float, g: Vec, w: Vec
) -> float:
    """Add the half-space e + g . dt + w . dphi <= 0 of a branch; return its excess.

    Limits farther away than the window, and half-spaces that no unknown changes, are left out; their excess is 0.
    """
    programme = spaces.programme[0]
    if excess <= -programme["window"]:
        return 0.0
    fill_row(plan, b, config, spaces, g, w)
    return max(excess, 0.0) if keep_row(spaces, (excess + programme["margin"]) / plan.length, False) else 0.0


@routine
def add_equation(plan: Plan, b: int, config: Configuration, spaces: LeastStep, error: float, g: Vec, w: Vec) -> float:
    """Add the equation e + g . dt + w . dphi = 0 of a branch; return |e|, or 0 if no unknown changes it."""
    fill_row(plan, b, config, spaces, g, w)
    return abs(error) if keep_row(spaces, error / plan.length, True) else 0.0


@routine
def fill_row(plan: Plan, b: int, config: Configuration, spaces: LeastStep, g: Vec, w: Vec) -> None:
    """Fill the next row with the rates g . dt + w . dphi of all unknowns [L]."""
    programme, branch = spaces.programme[0], plan.branches[b]
    row = spaces.problem.G[programme["n_rows"]]
    for i in range(programme["n_unknowns"]):
        row[i] = 0.0
    t = move(config.pose, vec(branch["end"]))
    if programme["free"] & TRANSLATES:
        put(row, g)
    if programme["free"] & TURNS:
        lever_arm = sub(t, (config.pose[0, 3], config.pose[1, 3], config.pose[2, 3]))
        put(row[3:], scale(1.0 / programme["lever"], add(cross(lever_arm, g), w)))
    trunk = branch["carrier"] - 1
    if trunk >= 0:
        for j in range(plan.trunks[trunk]["first"], plan.trunks[trunk]["last"]):
            axis = vec(config.screws[j, 1])
            rate = dot(g, axis)
            if plan.trunk_joints[j]["turns"] == 1:
                rate = (dot(g, cross(axis, sub(t, vec(config.screws[j, 0])))) + dot(w, axis)) / plan.length
            row[programme["trunk_column"] + j] = -rate * programme["trunk_scale"]


@routine
def keep_row(spaces: LeastStep, excess: float, is_equation: bool) -> bool:
    """Keep the filled row with its excess [L]; False, and not kept, if no unknown changes it.

    Equations come first: an equation is swapped with the first half-space.
    """
    programme, G, h = spaces.programme[0], spaces.problem.G, spaces.problem.h
    k, n, first = programme["n_rows"], programme["n_unknowns"], programme["n_equations"]
    if dot_of(G[k], G[k], n) <= NO_RATE * NO_RATE:
        return False
    G[k, n] = 0.0 if is_equation else -1.0 / STIFF
    h[k] = excess
    programme["n_rows"] = k + 1
    if is_equation:
        for i in range(n + 1):
            G[k, i], G[first, i] = G[first, i], G[k, i]
        h[k], h[first] = h[first], h[k]
        programme["n_equations"] = first + 1
    return True


@routine
def add_ranges(plan: Plan, first: int, last: int, config: Configuration, spaces: LeastStep) -> None:
    """Add the ranges of trunk joints."""
    programme, rows = spaces.programme[0], spaces.problem.G
    for j in range(first, last):
        joint = plan.trunk_joints[j]
        for bound, sign in ((joint["lo"], -1.0), (joint["hi"], 1.0)):
            if abs(bound) < math.inf:
                for i in range(programme["n_unknowns"]):
                    rows[programme["n_rows"], i] = 0.0
                rows[programme["n_rows"], programme["trunk_column"] + j] = sign * programme["trunk_scale"]
                keep_row(spaces, sign * (config.trunks[j] - bound) / joint["unit"], False)


@routine
def add_branch(plan: Plan, b: int, config: Configuration, settings: Settings, spaces: LeastStep) -> float:
    """Add the limits of a branch; return the largest excess [length]."""
    branch = plan.branches[b]
    parts, t = branch["last"] - branch["first"], move(config.pose, vec(branch["end"]))
    gap = add_planes(plan, b, config, spaces, parts)
    if parts + branch["rail"] == 0:
        d = sub(t, base_of(plan, branch, config))
        for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
            gap = max(gap, add_equation(plan, b, config, spaces, dot(axis, d), axis, (0.0, 0.0, 0.0)))
        return gap
    if parts == 1 and branch["rail"] == 0:
        return max(gap, add_strut(plan, b, config, spaces))
    return max(gap, add_end(plan, b, config, settings, spaces))


@routine
def add_planes(plan: Plan, b: int, config: Configuration, spaces: LeastStep, parts: int) -> float:
    """Add the equations of a planar branch: the end in the hinges' plane, the platform's hinge parallel to theirs."""
    branch, gap, zero = plan.branches[b], 0.0, (0.0, 0.0, 0.0)
    if branch["planar"] == 0:
        return gap
    normal = turn(config.carriers[branch["carrier"]], vec(branch["normal"]))
    if parts > 0 and branch["planar"] >= parts:
        error = dot(normal, sub(move(config.pose, vec(branch["end"])), base_of(plan, branch, config)))
        gap = max(gap, add_equation(plan, b, config, spaces, error, normal, zero))
    hinge = vec(branch["end_normal"])
    if branch["end_plane"] == 0 and dot(hinge, hinge) > 0.0:
        hinge, e = turn(config.pose, hinge), any_normal(normal)
        for across in (e, cross(normal, e)):
            error = plan.length * dot(hinge, across)
            gap = max(gap, add_equation(plan, b, config, spaces, error, zero, scale(plan.length, cross(hinge, across))))
    return gap


@routine
def add_strut(plan: Plan, b: int, config: Configuration, spaces: LeastStep) -> float:
    """Add the limits of a strut: its stroke, its hinge's range, a plane fixed to the platform, cones at both ends."""
    branch, gap, zero = plan.branches[b], 0.0, (0.0, 0.0, 0.0)
    carrier, node = config.carriers[branch["carrier"]], plan.nodes[branch["last"]]
    d = sub(move(config.pose, vec(branch["end"])), base_of(plan, branch, config))
    length = max(norm(d), NO_LENGTH)
    u = scale(1.0 / length, d)
    if node["lo"] == node["hi"]:
        gap = add_equation(plan, b, config, spaces, length - node["hi"], u, zero)
    else:
        gap = add_half_space(plan, b, config, spaces, length - node["hi"], u, zero)
        gap = max(gap, add_half_space(plan, b, config, spaces, node["lo"] - length, scale(-1.0, u), zero))
    base_node = plan.nodes[branch["first"]]
    if base_node["ranged"] == 1:
        normal = turn(carrier, vec(branch["normal"]))
        flat = flatten(d, normal)
        rho = max(norm(flat), NO_LENGTH)
        angle = hinge_angle(plan, branch, branch["first"], carrier, normal, config.nodes, flat)
        g = scale(1.0 / rho, cross(normal, flat))
        gap = max(gap, add_half_space(plan, b, config, spaces, (angle - base_node["angle_hi"]) * rho, g, zero))
        below, g = (base_node["angle_lo"] - angle) * rho, scale(-1.0, g)
        gap = max(gap, add_half_space(plan, b, config, spaces, below, g, zero))
    if branch["end_plane"] == 1:
        p = turn(config.pose, vec(branch["end_normal"]))
        gap = max(gap, add_equation(plan, b, config, spaces, dot(p, d), p, cross(p, d)))
    for c in range(branch["cone_first"], branch["cone_last"]):
        cone = plan.cones[c]
        a = vec(cone["axis"])
        a = turn(carrier, a) if cone["fixed_to"] == CARRIER_CONE else scale(-1.0, turn(config.pose, a))
        excess, g = cone_excess(a, cone["cosine"], cone["sine"], d)
        w = cross(g, d) if cone["fixed_to"] == PLATFORM_CONE else zero
        gap = max(gap, add_half_space(plan, b, config, spaces, excess, g, w))
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
def add_end(plan: Plan, b: int, config: Configuration, settings: Settings, spaces: LeastStep) -> float:
    """Add the half-space tangent to the reach of a branch of several parts, normal to its end gap.

    The tangent point is the reachable end nearest to the target. If the branch reaches, and limits within the window
    count, the tangent point is sought beyond the target in the direction of the last gap.
    """
    branch, zero = plan.branches[b], (0.0, 0.0, 0.0)
    t, base = move(config.pose, vec(branch["end"])), base_of(plan, branch, config)
    if branch["planar"] >= branch["last"] - branch["first"]:
        normal = turn(config.carriers[branch["carrier"]], vec(branch["normal"]))
        t = along(t, -dot(normal, sub(t, base)), normal)
    gap, _passes = reach_end(plan, b, config, t, settings)
    if gap > settings.tolerance:
        n = scale(1.0 / gap, sub(t, vec(config.nodes[branch["last"]])))
        put(spaces.normals[b], n)
        return add_half_space(plan, b, config, spaces, gap, n, zero)
    n = vec(spaces.normals[b])
    if spaces.programme[0]["window"] == 0.0 or dot(n, n) == 0.0 or not is_two_part(plan, b):
        return 0.0
    beyond = along(t, PROBE * spaces.programme[0]["window"], n)
    gap, _passes = reach_end(plan, b, config, beyond, settings)
    if gap > settings.tolerance:
        end = vec(config.nodes[branch["last"]])
        n = scale(1.0 / gap, sub(beyond, end))
        put(spaces.normals[b], n)
        add_half_space(plan, b, config, spaces, dot(n, sub(t, end)), n, zero)
    return 0.0


@routine
def dot_of(a: Floats, b: Floats, n: int) -> float:
    """Inner product of the first n entries."""
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total


@routine
def least_step(spaces: LeastStep) -> None:
    """Move x by the least step into all half-spaces: min |x - x_0|^2 / 2 + s^2 / 2 with G x + h <= s / STIFF.

    The slack s relaxes all half-spaces alike if they contradict each other; equations have no slack.
    """
    problem, x, programme = spaces.problem, spaces.x, spaces.programme[0]
    n = programme["n_unknowns"]
    for c in range(programme["n_rows"]):
        problem.h[c] += dot_of(problem.G[c], x, n)
    solve_with_equations(problem, n + 1, programme["n_equations"], programme["n_rows"])
    for i in range(n):
        x[i] += problem.x[i]
