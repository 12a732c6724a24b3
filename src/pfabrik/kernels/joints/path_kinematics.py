"""Kinematics of paths: poses and Jacobians of their ends, and of the links on them.

Their bodies are numbered by the paths that lead to them from the base.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from .._jit import inlined, opener, routine
from ..clearance.link_limits import links_excess, put_pulls
from ..clearance.link_records import LinkLimits
from ..clearance.solids import CAPSULE, KIND
from ..quaternions import difference, logarithm, rotate_by, turn_ball
from ..vectors import Vec, add, cross, dot, put, sub, turn, vec
from .loops import BALL, SLIDE, Closed, Layout, Loops


class State(NamedTuple):
    """One configuration, changed in place."""

    q: Floats  # (columns,): turns and slides
    balls: Floats  # (units, 4): quaternions of ball joints
    X: Floats  # (3, 4): the platform


class Equations(NamedTuple):
    """Normal equations, group by group, and scratch memory to build and solve them."""

    rows: Floats  # (rows, 6): columns of the Jacobian: velocity of the path's end, angular velocity
    at: Floats  # (rows, 3): a point of the axis of each
    T: Floats  # (3, 4): displacement of the present body of a path
    e: Floats  # (6,)
    lever: Floats  # (3,): from the platform's reference point to a joint of it
    A: Floats  # (groups, m, m)
    C: Floats  # (groups, m, 6)
    b: Floats  # (groups, m)
    factor: Floats  # (m, m)
    Y: Floats  # (groups, m, 7): step of each coordinate per component of the platform's twist, and without twist
    G: Floats  # (6, 7): the platform's equations, right-hand side last
    S: Floats  # (6, 7): their Schur complement
    twist: Floats  # (6,)
    frame: Floats  # (3, 3): axes that the platform turns about, one a column
    gaps: Floats  # (groups,)
    excesses: Floats
    misses: Floats


def new_state(loops: Loops) -> State:
    """Allocate a configuration."""
    return State(np.zeros(len(loops.lo)), np.zeros((len(loops.kinds), 4)), np.zeros((3, 4)))


def new_equations(loops: Loops, layout: Layout) -> Equations:
    """Allocate the equations of one thread."""
    groups, m, rows = len(loops.groups) - 1, max(1, layout.sizes.max(initial=0)), len(loops.row_columns)
    return Equations(
        np.zeros((rows, 6)),
        np.zeros((rows, 3)),
        np.zeros((3, 4)),
        np.zeros(6),
        np.zeros(3),
        np.zeros((groups, m, m)),
        np.zeros((groups, m, 6)),
        np.zeros((groups, m)),
        np.zeros((m, m)),
        np.zeros((groups, m, 7)),
        np.zeros((6, 7)),
        np.zeros((6, 7)),
        np.zeros(6),
        np.zeros((3, 3)),
        np.zeros(groups),
        np.zeros(groups),
        np.zeros(groups),
    )


_TYPES = "i1 f2 f2 i1 i2 i1 i1 i1 i1 i1 i1 f1 f1 f1 i2 f2 f2 f1 i1 i2 i1 f2 i2 i1"

LOOPS = Loops._make(np.zeros((2,) * int(each[1]), f"{each[0]}8") for each in _TYPES.split())
"""Loops of the types that kernels are compiled for."""

LAYOUT = Layout(np.zeros(2, np.int64), np.zeros(1, np.int64))

open_loops, open_layout = opener(LOOPS), opener(LAYOUT)
"""Functions that open the `Loops` and the `Layout` at the address of a `Handle`."""


@inlined
def copy_state(source: State, target: State) -> None:
    """Copy a configuration."""
    for j in range(len(source.q)):
        target.q[j] = source.q[j]
    for k in range(len(source.balls)):
        for i in range(4):
            target.balls[k, i] = source.balls[k, i]
    for i in range(3):
        for j in range(4):
            target.X[i, j] = source.X[i, j]


@inlined
def load_row(loops: Loops, row: int, closed: Closed, state: State) -> None:
    """Load the configuration of the start of a row."""
    for j in range(len(state.q)):
        state.q[j] = closed.coordinates[row, j]
    for k in range(len(loops.kinds)):
        if loops.kinds[k] == BALL:
            j = loops.columns[k]
            state.balls[k, 0] = 1.0
            state.balls[k, 1] = state.balls[k, 2] = state.balls[k, 3] = 0.0
            turn_ball(state.balls[k], state.q[j], state.q[j + 1], state.q[j + 2])
    for i in range(3):
        for j in range(4):
            state.X[i, j] = closed.poses[row, i, j]


@inlined
def store_row(loops: Loops, row: int, state: State, closed: Closed) -> None:
    """Store a configuration as the result of a row."""
    for j in range(len(state.q)):
        closed.coordinates[row, j] = state.q[j]
    for k in range(len(loops.kinds)):
        if loops.kinds[k] == BALL:
            j, ball = loops.columns[k], state.balls[k]
            x, y, z = logarithm(ball[0], ball[1], ball[2], ball[3])
            closed.coordinates[row, j], closed.coordinates[row, j + 1], closed.coordinates[row, j + 2] = x, y, z
    for i in range(3):
        for j in range(4):
            closed.poses[row, i, j] = state.X[i, j]


@inlined
def walk_path(loops: Loops, path: int, last: int, state: State, eq: Equations) -> None:
    """Pose a path's bodies from the base outward up to a visit, and write the axis of every motion on the way."""
    T = eq.T
    for i in range(3):
        for j in range(4):
            T[i, j] = 1.0 if i == j else 0.0
    for visit in range(loops.paths[path], last):
        k, sign = loops.visits[visit, 0], float(loops.visits[visit, 1])
        row, axis, point, kind = loops.visit_rows[visit], loops.axes[k], loops.points[k], loops.kinds[k]
        if kind == SLIDE:
            s = state.q[loops.columns[k]]
            for i in range(3):
                a = sign * (T[i, 0] * axis[0] + T[i, 1] * axis[1] + T[i, 2] * axis[2])
                eq.rows[row, i] = a
                eq.rows[row, i + 3] = 0.0
                T[i, 3] += s * a
            continue
        if kind == BALL:
            w, x, y, z = state.balls[k, 0], state.balls[k, 1], state.balls[k, 2], state.balls[k, 3]
        else:
            half = 0.5 * state.q[loops.columns[k]]
            sine = math.sin(half)
            w, x, y, z = math.cos(half), sine * axis[0], sine * axis[1], sine * axis[2]
        if sign > 0.0:
            note_axes(T, kind == BALL, sign, axis, point, row, eq.rows, eq.at)
        turn_about(T, point, w, sign * x, sign * y, sign * z)
        if sign < 0.0:
            note_axes(T, kind == BALL, sign, axis, point, row, eq.rows, eq.at)


@routine
def note_axes(
    T: Floats, is_ball: bool, sign: float, axis: Floats, point: Floats, row: int, rows: Floats, at: Floats
) -> None:
    """Write the present axis of a turn, or the three of a ball joint, and the point they pass through."""
    for i in range(3):
        centre = T[i, 0] * point[0] + T[i, 1] * point[1] + T[i, 2] * point[2] + T[i, 3]
        at[row, i] = centre
        if is_ball:
            at[row + 1, i] = at[row + 2, i] = centre
            for j in range(3):
                rows[row + j, 3 + i] = sign * T[i, j]
        else:
            rows[row, 3 + i] = sign * (T[i, 0] * axis[0] + T[i, 1] * axis[1] + T[i, 2] * axis[2])


@routine
def turn_about(T: Floats, point: Floats, w: float, x: float, y: float, z: float) -> None:
    """Multiply T by the rotation of a quaternion (w, x, y, z) about a point."""
    for i in range(3):
        T[i, 3] += T[i, 0] * point[0] + T[i, 1] * point[1] + T[i, 2] * point[2]
    rotate_by(T, w, x, y, z)
    for i in range(3):
        T[i, 3] -= T[i, 0] * point[0] + T[i, 1] * point[1] + T[i, 2] * point[2]


@inlined
def end_path(loops: Loops, path: int, last: int, end: Floats, eq: Equations) -> None:
    """Set T's last column to a point of the path's last body, and `rows` to its velocities under the path's motions."""
    T = eq.T
    for i in range(3):
        T[i, 3] += T[i, 0] * end[0] + T[i, 1] * end[1] + T[i, 2] * end[2]
    for visit in range(loops.paths[path], last):
        if loops.kinds[loops.visits[visit, 0]] == SLIDE:
            continue
        for r in range(loops.visit_rows[visit], loops.visit_rows[visit + 1]):
            a, at = eq.rows[r], eq.at[r]
            x, y, z = T[0, 3] - at[0], T[1, 3] - at[1], T[2, 3] - at[2]
            a[0], a[1], a[2] = a[4] * z - a[5] * y, a[5] * x - a[3] * z, a[3] * y - a[4] * x


@inlined
def compare_end(loops: Loops, state: State, eq: Equations) -> float:
    """Write the path's residual to `e`; the larger of its position [L] and rotation [rad]."""
    difference(eq.T, state.X, eq.e[3:])
    position = rotation = 0.0
    for i in range(3):
        eq.e[i] = eq.T[i, 3] - state.X[i, 3]
        position += eq.e[i] ** 2
        rotation += eq.e[i + 3] ** 2
    return math.sqrt(max(position, rotation))


@inlined
def pose_cone(loops: Loops, cone: int, state: State, eq: Equations) -> float:
    """Pose the joint of a cone in its first body; the length of its line.

    T's rotation is set to the joint's, S's first rows to the axes of its motions, at most three. The first half of the
    twist is set to the vector that turns with the second body, the line or the cone's axis; the second half to the
    other one.
    """
    T, line, pair = eq.T, eq.e, eq.twist
    for i in range(3):
        for j in range(3):
            T[i, j] = 1.0 if i == j else 0.0
        line[i] = loops.cone_lines[cone, i]
    for slide in range(loops.cone_slides[cone, 0], loops.cone_slides[cone, 1]):
        for i in range(3):
            line[i] += state.q[loops.slides[slide]] * loops.slide_axes[slide, i]
    for k in range(loops.cone_units[cone, 0], loops.cone_units[cone, 1]):
        if loops.kinds[k] == BALL:
            for i in range(3):
                for j in range(3):
                    eq.S[j, i] = 1.0 if i == j else 0.0
            w, x, y, z = state.balls[k, 0], state.balls[k, 1], state.balls[k, 2], state.balls[k, 3]
        else:
            axis, half = loops.axes[k], 0.5 * state.q[loops.columns[k]]
            for i in range(3):
                turned = T[i, 0] * axis[0] + T[i, 1] * axis[1] + T[i, 2] * axis[2]
                eq.S[k - loops.cone_units[cone, 0], i] = turned
            sine = math.sin(half)
            w, x, y, z = math.cos(half), sine * axis[0], sine * axis[1], sine * axis[2]
        rotate_by(T, w, x, y, z)
    outward = loops.cone_outward[cone] == 1
    for i in range(3):
        moved = line if outward else loops.cone_axes[cone]
        pair[i] = T[i, 0] * moved[0] + T[i, 1] * moved[1] + T[i, 2] * moved[2]
        pair[3 + i] = loops.cone_axes[cone, i] if outward else line[i]
    return math.sqrt(line[0] ** 2 + line[1] ** 2 + line[2] ** 2)


@routine
def place_links(ways: Loops, state: State, eq: Equations, links: LinkLimits) -> None:
    """Fill the places of all links, and the axes of the joints on the ways to their bodies."""
    for i in range(len(links.home)):
        for k in range(4):
            put(links.places[i, k], vec(links.home[i, k]))
    for body in range(len(ways.paths) - 1):
        walk_path(ways, body, ways.paths[body + 1], state, eq)
        T = eq.T
        shift = (T[0, 3], T[1, 3], T[2, 3])
        for i in range(len(links.home)):
            is_capsule = links.sizes[i, KIND] == CAPSULE
            for k in range(4):
                if links.bodies[i, 1 if is_capsule and k == 1 else 0] == body:
                    turned = turn(eq.T, vec(links.home[i, k]))
                    put(links.places[i, k], add(turned, shift) if is_capsule or k == 0 else turned)


@routine
def are_apart(links: LinkLimits, ways: Loops, state: State, eq: Equations, tolerance: float) -> bool:
    """True if no links are nearer than the clearance, but for a tolerance [L]."""
    if links.pairs.shape[0] == 0:
        return True
    place_links(ways, state, eq, links)
    return bool(links_excess(links) <= tolerance)


@routine
def add_pair_slope(
    ways: Loops, links: LinkLimits, pair: int, excess: float, factor: float, eq: Equations, out: Floats
) -> None:
    """Add a factor times the derivative of the excess of the pair that was measured last."""
    put_pulls(links, pair, excess, factor)
    for end in range(4):
        body = links.bodies[links.pairs[pair, end // 2], end % 2]
        add_force(ways, body, vec(links.pulls[end]), vec(links.pulls[end, 3:]), eq, out)


@routine
def add_force(ways: Loops, body: int, x: Vec, force: Vec, eq: Equations, out: Floats) -> None:
    """Add the generalised force of a force at a point of a body."""
    for visit in range(ways.paths[body] if body >= 0 else 0, ways.paths[body + 1] if body >= 0 else 0):
        is_slide = ways.kinds[ways.visits[visit, 0]] == SLIDE
        for r in range(ways.visit_rows[visit], ways.visit_rows[visit + 1]):
            rate = vec(eq.rows[r]) if is_slide else cross(vec(eq.rows[r, 3:]), sub(x, vec(eq.at[r])))
            out[ways.row_columns[r]] += dot(force, rate)
