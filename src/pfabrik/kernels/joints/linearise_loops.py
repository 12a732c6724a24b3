"""Linearisation of a configuration: the motions that the loops leave free, and objective and limits on them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Record, Records
from .._jit import opener, routine
from ..clearance.link_limits import new_link_limits, pair_excess
from ..clearance.link_records import NO_LINKS, LinkLimits
from ..free_motions import (
    Elimination,
    FreeMotions,
    add_limit,
    eliminate,
    new_elimination,
    new_free_motions,
    project_gradient,
)
from ..qp import QP, new_qp
from ..quaternions import UPSIDE_DOWN, difference, yaw_difference
from ..rows import HOLD_ORIENTATION
from ..search_constants import REACH, UNBOUNDED
from ..sqp import CONTROL, Hessian, new_hessian
from ..vectors import Vec, cross, dot, norm, scale
from .loops import BALL, BASE_AXES, HALF_WAY, LOCKED, TARGET_AXES, Loops, Objective, PoseObjective
from .path_kinematics import (
    LAYOUT,
    LOOPS,
    Equations,
    State,
    add_pair_slope,
    compare_end,
    end_path,
    new_equations,
    new_state,
    place_links,
    pose_cone,
    walk_path,
)

ALIGNED = 1e-9
"""Sine below which two directions have no axis across them."""

BY_DIFFERENCE = True
"""True: the rotation's share of a squared distance is what that of the position leaves of it. In single precision,
where such a rest has no digits below 1e-4 rad, it is False, and the share is summed."""


PRICING = np.dtype(
    [
        ("place", "f8"),  # half the weighted square of the position's error, p
        ("turn", "f8"),  # of the rotation's, r
        ("by_place", "f8"),  # derivatives of half the squared priced distance F by p and r
        ("by_turn", "f8"),
        ("is_fixed", "i8"),  # 1: these are kept, for differences that give second derivatives
        ("held", "f8"),  # p or r of what is held, where second derivatives were last asked for
        ("eases", "i8"),  # 1 if it fell to a quarter since
        ("cost", "f8"),  # where a descent that held a part ended: that of holding it, as in `TALLY`
        ("edge", "f8"),  # error of what is held, as a share of the distance, at which a descent ends; 0: at none
    ]
)
"""The price at a configuration."""


class PoseGradient(NamedTuple):
    """The gradient of the objective in the twist of the end effector, and the components of the twist that are held."""

    force: Floats  # (6,): gradient of the objective in the twist
    holds: Floats  # (6, 6): gradients of the held components in the twist, one per row
    errors: Floats  # (6,): errors of the held components
    unit: Floats  # (1,): factor of the objective that makes its gradient of order one
    turn: Floats  # (6,)
    pricing: Records  # (1,): PRICING


@routine
def pose_gradient(
    objective: PoseObjective, target: Floats, X: Floats, gradient: PoseGradient, turns: bool
) -> tuple[float, int]:
    """The objective, and the number of held components; without `turns` the rotation counts as that of the target."""
    w, force, unit = gradient.turn, gradient.force, gradient.unit[0]
    value, of_turn, held, w[3], w[4], w[5] = 0.0, 0.0, 0, 0.0, 0.0, 0.0
    if turns and objective.frame == BASE_AXES:
        difference(X, target, w[3:])
    for i in range(6):
        force[i] = 0.0
        if i < 3:
            w[i] = X[i, 3] - target[i, 3]
        elif objective.frame != BASE_AXES:
            continue
        if objective.platform[i] == LOCKED:
            held = hold(gradient, held, i, w[i])
        else:
            share = 0.5 * unit * objective.platform[i] * w[i] * w[i]
            value += share
            of_turn += share if i >= 3 else 0.0
            force[i] = unit * objective.platform[i] * w[i]
    if objective.frame == TARGET_AXES and objective.platform[3] == LOCKED:
        held = hold_tilt(target, X, gradient, held)
    elif objective.frame == TARGET_AXES and objective.platform[3] > 0.0:
        of_turn = tilt(target, unit * objective.platform[3], X, force)
        value += of_turn
    elif objective.frame == HALF_WAY and objective.platform[5] == LOCKED:
        held = hold(gradient, held, 5, yaw_difference(X, target))
        for i in range(3):
            gradient.holds[held - 1, 3 + i] = yaw_gradient(X, i)
    elif objective.frame == HALF_WAY and objective.platform[5] > 0.0:
        off, weight = yaw_difference(X, target), unit * objective.platform[5]
        of_turn = 0.5 * weight * off * off
        value += of_turn
        for i in range(3):
            force[3 + i] += weight * off * yaw_gradient(X, i)
    if objective.price > 0.0:
        value = add_price(objective, value, of_turn, gradient)
    return value, held


@routine
def add_price(objective: PoseObjective, value: float, of_turn: float, gradient: PoseGradient) -> float:
    """Half the squared priced distance, its gradient in `force`, from half the squared distance and its gradient.

    Parameters
    ----------
    of_turn : the rotation's share of half the squared distance.
    """
    force, off, pricing, unit, place = gradient.force, gradient.turn, gradient.pricing[0], gradient.unit[0], 0.0
    for i in range(3):
        place += 0.5 * objective.platform[i] * off[i] * off[i] if objective.platform[i] != LOCKED else 0.0
    F = 0.0
    if pricing["is_fixed"] == 0:
        pricing["place"] = place
        pricing["turn"] = max(value / unit - place, 0.0) if BY_DIFFERENCE else of_turn / unit
        pricing["by_place"], pricing["by_turn"] = 1.0, 1.0
        if value > 0.0:
            F, by_place, by_turn, _, _, _, _ = price(objective, pricing["place"], pricing["turn"])
            pricing["by_place"], pricing["by_turn"] = F * by_place, F * by_turn
    for i in range(6):
        force[i] *= pricing["by_place"] if i < 3 else pricing["by_turn"]
    return 0.5 * unit * F * F


@routine
def price(
    objective: PoseObjective, place: float, turn: float
) -> tuple[float, float, float, float, float, float, float]:
    """The priced distance F of half squares p of position and r of rotation, F_p and F_r, and b, k, x, y.

    F = D + price (S - c D), where D = sqrt(2 (p + r)) is the distance and S = sqrt(e^2 + c^2 D^2) the error e of what
    is held, rounded off where it is below a share c of D: a norm, so that F has its least where e is zero if that costs
    no more than the price. Its second derivatives are F_pp = -b - k x x, F_pr = -b - k x y, F_rr = -b - k y y.
    """
    c, square = objective.rounding, 2.0 * (place + turn)
    weight, held = 1.0, place
    if objective.hold == HOLD_ORIENTATION:
        weight, held = max(objective.platform[3], max(objective.platform[4], objective.platform[5])), turn
    D, S = math.sqrt(square), math.sqrt(2.0 * held / weight + c * c * square)
    if not S > 0.0:
        return D, 1.0 / D, 1.0 / D, 1.0 / (D * square), 0.0, 0.0, 0.0
    a, kink, of_place, of_turn = (1.0 - objective.price * c) / D, objective.price / S, c * c, c * c
    if objective.hold == HOLD_ORIENTATION:
        of_turn += 1.0 / weight
    else:
        of_place += 1.0
    value = a * square + kink * S * S
    return value, a + kink * of_place, a + kink * of_turn, a / square, kink / (S * S), of_place, of_turn


@routine
def price_curvature(objective: PoseObjective, majorises: bool, gradient: PoseGradient) -> tuple[float, float, float]:
    """G_pp / G_p^2, G_pr / (G_p G_r) and G_rr / G_r^2 of half the squared priced distance G: of products of forces.

    While the error of what is held falls by half from one step to the next, and where a model is to majorise F, its
    kink counts as the parabola above it, whose least is where the error is zero: steps then end there, not beyond.
    """
    pricing = gradient.pricing[0]
    if not pricing["place"] + pricing["turn"] > 0.0:
        return 0.0, 0.0, 0.0
    held = pricing["turn"] if objective.hold == HOLD_ORIENTATION else pricing["place"]
    if held != pricing["held"]:
        pricing["eases"] = 1 if held < 0.25 * pricing["held"] else 0
        pricing["held"] = held
    F, by_place, by_turn, bend, kink, x, y = price(objective, pricing["place"], pricing["turn"])
    kink = 0.0 if majorises or pricing["eases"] == 1 else kink
    unit = gradient.unit[0] * F * F
    return (
        (by_place * by_place - F * (bend + kink * x * x)) / (unit * by_place * by_place),
        (by_place * by_turn - F * (bend + kink * x * y)) / (unit * by_place * by_turn),
        (by_turn * by_turn - F * (bend + kink * y * y)) / (unit * by_turn * by_turn),
    )


@routine
def is_on_edge(objective: PoseObjective, gradient: PoseGradient) -> bool:
    """True if a descent by a price ends where it is, for what is held is all but held; never without a share of it."""
    pricing, weight = gradient.pricing[0], 1.0
    if not pricing["edge"] > 0.0:
        return False
    held, square = pricing["place"], pricing["place"] + pricing["turn"]
    if objective.hold == HOLD_ORIENTATION:
        weight = max(objective.platform[3], max(objective.platform[4], objective.platform[5]))
        held = pricing["turn"]
    return bool(objective.price > 0.0 and held <= weight * square * pricing["edge"] * pricing["edge"] and square > 0.0)


@routine
def begin_pricing(gradient: PoseGradient) -> None:
    """Reset what was noted of the price, before a descent."""
    gradient.pricing[0]["held"], gradient.pricing[0]["eases"], gradient.pricing[0]["is_fixed"] = math.inf, 1, 0


@routine
def hold(gradient: PoseGradient, held: int, component: int, error: float) -> int:
    """Add a held component of the twist; the number of held components."""
    gradient.errors[held] = error
    for i in range(6):
        gradient.holds[held, i] = 1.0 if i == component else 0.0
    return held + 1


@routine
def hold_tilt(target: Floats, X: Floats, gradient: PoseGradient, held: int) -> int:
    """Hold the z axis along that of the target: its components along the target's x and y axes are zero.

    They are zero for the opposite direction too. So beyond a right angle the held components are the angle, and the
    motion across the shortest rotation to the target.
    """
    axis, angle = turn_of_tilt(target, X)
    if angle > 0.5 * math.pi:
        held = hold(gradient, held, 3, angle)
        held = hold(gradient, held, 3, 0.0)
        sway = cross(axis, (X[0, 2], X[1, 2], X[2, 2]))
        for i in range(3):
            gradient.holds[held - 2, 3 + i] = -axis[i]
            gradient.holds[held - 1, 3 + i] = sway[i]
        return held
    for k in range(2):
        off = 0.0
        for i in range(3):
            off += target[i, k] * X[i, 2]
        held = hold(gradient, held, 3, off)
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            gradient.holds[held - 1, 3 + i] = X[a, 2] * target[b, k] - X[b, 2] * target[a, k]
    return held


@routine
def yaw_gradient(X: Floats, axis: int) -> float:
    """Gradient of the yaw in the rotation about an axis of the base: (z + z') / (1 + z . z'), with both z axes."""
    return (X[axis, 2] + (1.0 if axis == 2 else 0.0)) / max(1.0 + X[2, 2], UPSIDE_DOWN)


@routine
def tilt(target: Floats, weight: float, X: Floats, force: Floats) -> float:
    """Half the weighted square of the angle between the z axes; the gradient is added to `force`."""
    axis, angle = turn_of_tilt(target, X)
    for i in range(3):
        force[3 + i] -= weight * angle * axis[i]
    return 0.5 * weight * angle * angle


@routine
def turn_of_tilt(target: Floats, X: Floats) -> tuple[Vec, float]:
    """Axis and angle of the shortest rotation of the z axis to the target's; half a turn is about its x axis."""
    here, there = (X[0, 2], X[1, 2], X[2, 2]), (target[0, 2], target[1, 2], target[2, 2])
    axis = cross(here, there)
    sine, cosine = norm(axis), dot(here, there)
    angle = math.atan2(sine, cosine)
    if sine > ALIGNED:
        return scale(1.0 / sine, axis), angle
    if cosine > 0.0:
        return scale(1.0 / angle if angle > 0.0 else 0.0, axis), angle
    return (X[0, 0], X[1, 0], X[2, 0]), angle


class DescentScratch(NamedTuple):
    """Scratch memory of one thread."""

    best: State
    trial: State
    first: FreeMotions
    second: FreeMotions
    p: QP
    pulls: Floats  # (limits, columns)
    eq: Equations
    gradient: PoseGradient
    hessian: Hessian
    control: Records  # (1,): CONTROL
    gaps: Floats  # (paths, 6): gap between the end of each path and that of the first
    elimination: Elimination  # `used` counts paths per coordinate, the first path twice: it is in all equations
    row: Floats  # (columns,)
    force: Floats  # (paths, 6): force and moment at the end of each path
    balance: Floats  # (rows,): multipliers of the loops and of the held components
    here: Floats  # (columns,)
    there: Floats  # (columns,)
    full: Floats  # (columns, columns): second derivatives
    turning: Floats  # (3, 3): those of the end effector's rotation
    margins: Floats  # (limits,): how far inside each limit a descent stays, beyond the margin of all [rad or L]
    links: LinkLimits
    ways: Loops  # a path from the base to the body of each link
    way_eq: Equations


def new_descent_scratch(loops: Loops, links: LinkLimits, ways: Loops) -> DescentScratch:
    """Scratch memory of one thread."""
    n, paths, rows = len(loops.lo), len(loops.paths) - 1, 6 * len(loops.paths)
    limits = 2 * n + len(loops.cone_angles) + len(links.pairs)
    elimination = new_elimination(n, rows)
    for r in range(len(loops.row_columns)):
        is_first = r < loops.visit_rows[loops.paths[1]]  # the first path is in all equations
        elimination.used[loops.row_columns[r]] += 2 if is_first else 1
    return DescentScratch(
        new_state(loops),
        new_state(loops),
        new_free_motions(n, rows, limits),
        new_free_motions(n, rows, limits),
        new_qp(limits, limits),
        np.zeros((limits, n)),
        new_equations(loops, LAYOUT),
        PoseGradient(np.zeros(6), np.zeros((6, 6)), np.zeros(6), np.ones(1), np.zeros(6), np.zeros(1, PRICING)),
        new_hessian(n, limits),
        np.zeros(1, CONTROL),
        np.zeros((paths, 6)),
        elimination,
        np.zeros(n),
        np.zeros((paths, 6)),
        np.zeros(rows),
        np.zeros(n),
        np.zeros(n),
        np.zeros((n, n)),
        np.zeros((3, 3)),
        np.zeros(limits),
        new_link_limits(links),
        ways,
        new_equations(ways, LAYOUT),
    )


open_scratch = opener(new_descent_scratch(LOOPS, NO_LINKS, LOOPS))


@routine
def walk_all(loops: Loops, state: State, scratch: DescentScratch) -> float:
    """Pose the end effector by the first path, and fill the gaps of the other paths; return the largest."""
    eq, gap = scratch.eq, 0.0
    for path in range(len(loops.paths) - 1):
        last = loops.paths[path + 1]
        walk_path(loops, path, last, state, eq)
        end_path(loops, path, last, loops.end, eq)
        if path == 0:
            for i in range(3):
                for j in range(4):
                    state.X[i, j] = eq.T[i, j]
        else:
            gap = max(gap, compare_end(loops, state, eq))
            for i in range(6):
                scratch.gaps[path, i] = eq.e[i]
    return gap


@routine
def add_force(loops: Loops, path: int, force: Floats, scratch: DescentScratch, out: Floats) -> None:
    """Add the generalised forces of a force and moment at the end of a path to `out`: J^T f."""
    rows, columns = scratch.eq.rows, loops.row_columns
    for r in range(loops.visit_rows[loops.paths[path]], loops.visit_rows[loops.paths[path + 1]]):
        a = rows[r]
        share = a[0] * force[0] + a[1] * force[1] + a[2] * force[2]
        out[columns[r]] += share + a[3] * force[3] + a[4] * force[4] + a[5] * force[5]


@routine
def add_anchors(row: int, objective: Objective, state: State, unit: float, out: Floats) -> float:
    """Add the gradient of half the weighted sum of squared distances from anchors to `out`; return the value."""
    value = 0.0
    for j in range(objective.weights.shape[0]):
        if objective.weights[j] > 0.0:
            off, weight = state.q[j] - objective.anchors[row, j], unit * objective.weights[j]
            value += 0.5 * weight * off * off
            out[j] += weight * off
    return value


@routine
def linearise(
    loops: Loops, row: int, objective: Objective, state: State, scratch: DescentScratch, reduced: FreeMotions
) -> None:
    """Linearise loops, objective and limits at a configuration into `reduced`."""
    linear, n, here = reduced.linear, len(loops.lo), scratch.here
    scratch.control[0]["linearised"] += 1
    gap = walk_all(loops, state, scratch)
    value, held = pose_gradient(objective.pose, objective.pose.targets[row], state.X, scratch.gradient, True)
    for k in range(held):
        gap = max(gap, abs(scratch.gradient.errors[k]))
    linear.totals[0]["gap"] = gap
    for j in range(n):
        here[j] = 0.0
    add_force(loops, 0, scratch.gradient.force, scratch, scratch.here)
    linear.totals[0]["value"] = value + add_anchors(row, objective, state, scratch.gradient.unit[0], scratch.here)
    rows = lay_out(loops, held, scratch)
    eliminate(rows, scratch.elimination, reduced, rows, 0)
    project_gradient(scratch.here, reduced)
    linearise_limits(loops, objective.pose.margin, state, scratch, reduced)


@routine
def steps_left(control: Record) -> int:
    """How many configurations may still be linearised."""
    return int(max(control["bound"] - control["linearised"], 0)) if control["bound"] > 0 else UNBOUNDED


@routine
def lay_out(loops: Loops, held: int, scratch: DescentScratch) -> int:
    """Write the equations of the loops and held components, an identity beside them; return their number."""
    paths, n, A, eq = len(loops.paths) - 1, len(loops.lo), scratch.elimination.A, scratch.eq
    first = 6 * (paths - 1)
    rows, holds = eq.rows, scratch.gradient.holds
    for r in range(first + held):
        for j in range(A.shape[1]):
            A[r, j] = 0.0
        A[r, n] = -scratch.gaps[1 + r // 6, r % 6] if r < first else -scratch.gradient.errors[r - first]
        A[r, n + 1 + r] = 1.0
    for path in range(paths):
        for r in range(loops.visit_rows[loops.paths[path]], loops.visit_rows[loops.paths[path + 1]]):
            j = loops.row_columns[r]
            for i in range(6):
                if path > 0:
                    A[6 * (path - 1) + i, j] += rows[r, i]
                    continue
                for loop in range(paths - 1):
                    A[6 * loop + i, j] -= rows[r, i]
                for k in range(held):
                    A[first + k, j] += holds[k, i] * rows[r, i]
    return first + held


@routine
def linearise_limits(loops: Loops, margin: float, state: State, scratch: DescentScratch, reduced: FreeMotions) -> None:
    """Fill excess and reduced gradient of every limit that a step may reach."""
    linear = reduced.linear
    basis, shift, G, row = reduced.basis, reduced.shift, linear.G, scratch.row
    n, k, excess = len(loops.lo), 0, -math.inf
    for j in range(n):
        for is_upper in range(2):
            h = loops.lo[j] + margin - state.q[j] if is_upper == 0 else state.q[j] - loops.hi[j] + margin
            h += scratch.margins[2 * j + is_upper]
            if h > -REACH and scratch.elimination.used[j] > 0:
                for a in range(linear.totals[0]["motions"]):
                    G[k, a] = -basis[j, a] if is_upper == 0 else basis[j, a]
                linear.drift[k] = -shift[j] if is_upper == 0 else shift[j]
                linear.h[k], linear.which[k] = h, 2 * j + is_upper
                excess = max(excess, h)
                k += 1
    for cone in range(len(loops.cone_angles)):
        h = cone_excess(loops, cone, margin + scratch.margins[2 * n + cone], state, scratch)
        if h > -REACH and scratch.elimination.used[loops.columns[loops.cone_units[cone, 0]]] > 0:
            for j in range(n):
                row[j] = 0.0
            add_cone(loops, cone, 1.0, scratch, scratch.row)
            excess = max(excess, h)
            k = add_limit(k, h, 2 * n + cone, scratch.row, reduced)
    offset, links = 2 * n + len(loops.cone_angles), scratch.links
    if links.kept[0] > 0:
        place_links(scratch.ways, state, scratch.way_eq, scratch.links)
    for pair in range(links.kept[0]):
        own_margin = margin + scratch.margins[offset + pair]
        h = pair_excess(scratch.links, pair, REACH) + own_margin
        if h > -REACH:
            for j in range(n):
                row[j] = 0.0
            add_pair_slope(scratch.ways, scratch.links, pair, h - own_margin, 1.0, scratch.way_eq, scratch.row)
            excess = max(excess, h)
            k = add_limit(k, h, offset + pair, scratch.row, reduced)
    linear.totals[0]["limits"] = k
    linear.totals[0]["excess"] = excess


@routine
def cone_excess(loops: Loops, cone: int, margin: float, state: State, scratch: DescentScratch) -> float:
    """Excess over a cone [rad]; also poses its joint, for `add_cone`."""
    pose_cone(loops, cone, state, scratch.eq)
    moved, stayed = scratch.eq.twist[:3], scratch.eq.twist[3:]
    x = moved[1] * stayed[2] - moved[2] * stayed[1]
    y = moved[2] * stayed[0] - moved[0] * stayed[2]
    z = moved[0] * stayed[1] - moved[1] * stayed[0]
    cosine = moved[0] * stayed[0] + moved[1] * stayed[1] + moved[2] * stayed[2]
    return math.atan2(math.sqrt(x * x + y * y + z * z), cosine) - (loops.cone_angles[cone] - margin)


@routine
def add_cone(loops: Loops, cone: int, factor: float, scratch: DescentScratch, out: Floats) -> None:
    """Add the gradient of a cone's excess, times a factor, to `out`."""
    eq = scratch.eq
    a, b = eq.twist[:3], eq.twist[3:]
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    sine = math.sqrt(x * x + y * y + z * z)
    cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if sine < 1e-12 * abs(cosine):  # straight along or against the axis: no direction leads in or out
        return
    first = loops.cone_units[cone, 0]
    column = loops.columns[first]
    for m in range(3 if loops.kinds[first] == BALL else 2):
        out[column + m] -= factor * (eq.S[m, 0] * x + eq.S[m, 1] * y + eq.S[m, 2] * z) / sine
    # a slide moves the line; the angle changes with the part of this motion across the line, towards the axis
    outward = loops.cone_outward[cone] == 1
    line, axis = (a, b) if outward else (b, a)
    square = line[0] ** 2 + line[1] ** 2 + line[2] ** 2
    for slide in range(loops.cone_slides[cone, 0], loops.cone_slides[cone, 1]):
        rate = 0.0
        for i in range(3):
            motion = loops.slide_axes[slide, i]
            if outward:
                motion = 0.0
                for j in range(3):
                    motion += eq.T[i, j] * loops.slide_axes[slide, j]
            rate -= motion * (axis[i] - cosine / square * line[i])
        out[loops.slides[slide]] += factor * rate / sine
