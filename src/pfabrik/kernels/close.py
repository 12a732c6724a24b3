"""Closing loops: Levenberg-Marquardt on all joint coordinates and the platform's pose at once.

The residual of a path is how its last body differs from the platform: position [L] and rotation vector [rad]. Every
group of paths has coordinates of its own, so its share of the normal equations is eliminated by itself, and six
equations in the platform's twist remain: the work grows with the number of legs, not with its cube.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._jit import allocator, inlined, kernel, routine
from .loops import BALL, LOCKED, SLIDE, Closed, Floats, Ints, Layout, Loops, Wishes
from .spin import difference, exponential, logarithm, rotate_by, turn_ball

LONGEST_STEP = 0.5
"""Longest step of any coordinate [rad or L]: beyond it the linear model says nothing."""

# What the next look at the equations is for: a step just tried, the way back from a bad one, or the last measures.
TRY, RETURN, MEASURE = 0, 1, 2

DAMPING = 0.01
"""Damping at the start, relative to the sum of squares."""

LEAST_DAMPING, MOST_DAMPING = 1e-14, 1e6
"""Damping of the normal equations, whose entries are of order one: the least keeps idle motions (a rod's own spin)
still without slowing convergence, the most ends a search that finds no way down."""


class State(NamedTuple):
    """One configuration under work."""

    q: Floats  # (columns,): turns and slides
    balls: Floats  # (units, 4): quaternions of ball joints
    X: Floats  # (3, 4): the platform


class Equations(NamedTuple):
    """Normal equations, group by group, and what they are made of."""

    rows: Floats  # (rows, 6): columns of the Jacobian: velocity of the path's end, angular velocity
    at: Floats  # (rows, 3): a point of the axis of each
    T: Floats  # (3, 4): the body a path has come to
    e: Floats  # (6,)
    arm: Floats  # (3,): from the platform's reference point to a joint of it
    A: Floats  # (groups, m, m)
    C: Floats  # (groups, m, 6)
    b: Floats  # (groups, m)
    factor: Floats  # (m, m)
    Y: Floats  # (groups, m, 7): what the platform's twist does to each coordinate, and what is left for it to do
    G: Floats  # (6, 7): the platform's equations, right-hand side last
    S: Floats  # (6, 7): the same, being solved
    twist: Floats  # (6,)
    gaps: Floats  # (groups,)
    excesses: Floats
    misses: Floats


@allocator
def new_state(loops: Loops) -> State:
    """Room for a configuration."""
    return State(np.zeros(len(loops.lo)), np.zeros((len(loops.kinds), 4)), np.zeros((3, 4)))


@allocator
def new_equations(loops: Loops, layout: Layout) -> Equations:
    """Room for the equations of one thread."""
    groups, m, rows = len(loops.groups) - 1, max(1, layout.sizes.max()), len(loops.row_columns)
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
        np.zeros(groups),
        np.zeros(groups),
        np.zeros(groups),
    )


@inlined
def copy_state(source: State, target: State) -> None:
    for j in range(len(source.q)):
        target.q[j] = source.q[j]
    for k in range(len(source.balls)):
        for i in range(4):
            target.balls[k, i] = source.balls[k, i]
    for i in range(3):
        for j in range(4):
            target.X[i, j] = source.X[i, j]


@inlined
def load_row(loops: Loops, layout: Layout, chained: bool, row: int, closed: Closed, state: State) -> None:
    """The configuration where a row starts."""
    for j in range(len(state.q)):
        if chained and layout.slots[j] >= 0:
            closed.coordinates[row, j] = closed.coordinates[row - 1, j]
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
    """The configuration where a row ended."""
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
    """Pose a path's bodies from the base outward up to a visit, noting the axis of every motion as it is passed."""
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
    """The present axis of a turn, or the three of a ball joint, and the point they pass through."""
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
    """T = T times the rotation of a quaternion about a point."""
    for i in range(3):
        T[i, 3] += T[i, 0] * point[0] + T[i, 1] * point[1] + T[i, 2] * point[2]
    rotate_by(T, w, x, y, z)
    for i in range(3):
        T[i, 3] -= T[i, 0] * point[0] + T[i, 1] * point[1] + T[i, 2] * point[2]


@inlined
def end_path(loops: Loops, path: int, last: int, end: Floats, eq: Equations) -> None:
    """T's last column becomes a point of the body a path has come to; its velocities under the path's motions."""
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
    """The path's residual; its largest part."""
    difference(eq.T, state.X, eq.e[3:])
    position = rotation = 0.0
    for i in range(3):
        eq.e[i] = eq.T[i, 3] - state.X[i, 3]
        position += eq.e[i] ** 2
        rotation += eq.e[i + 3] ** 2
    return math.sqrt(max(position, rotation))


@inlined
def add_path(loops: Loops, slots: Ints, group: int, path: int, eq: Equations) -> float:
    """The path's share of its group's equations and of the platform's; the square of its residual."""
    first, last = loops.visit_rows[loops.paths[path]], loops.visit_rows[loops.paths[path + 1]]
    A, C, b, e, rows = eq.A[group], eq.C[group], eq.b[group], eq.e, eq.rows
    square = 0.0
    for i in range(6):
        square += e[i] ** 2
        eq.G[i, i] += 1.0
        eq.G[i, 6] += e[i]
    for r in range(first, last):
        s = slots[loops.row_columns[r]]
        if s < 0:
            continue
        for i in range(6):
            C[s, i] += rows[r, i]
            b[s] += rows[r, i] * e[i]
        for r2 in range(first, r + 1):
            s2 = slots[loops.row_columns[r2]]
            if s2 >= 0:
                product = 0.0
                for i in range(6):
                    product += rows[r, i] * rows[r2, i]
                twice = s == s2 and r != r2  # a joint that the path passes on its way out and back
                A[max(s, s2), min(s, s2)] += 2.0 * product if twice else product
    return square


@inlined
def add_last_ball(
    loops: Loops, slots: Ints, group: int, path: int, last: int, state: State, eq: Equations
) -> tuple[float, float]:
    """The share of a path whose last ball joint follows the platform: its centre is all that must meet.

    The square of its residual, and the residual.
    """
    point = loops.points[loops.visits[last, 0]]
    end_path(loops, path, last, point, eq)
    C, b, e, r, X, G = eq.C[group], eq.b[group], eq.e, eq.arm, state.X, eq.G
    square = 0.0
    for i in range(3):
        r[i] = 0.0
        for j in range(3):
            r[i] += X[i, j] * (point[j] - loops.end[j])
        e[i] = eq.T[i, 3] - X[i, 3] - r[i]
        square += e[i] ** 2
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        G[i, i] += 1.0
        G[i, 6] += e[i]
        # the centre moves with the platform by v + w x r
        G[3 + i, 6] += r[j] * e[k] - r[k] * e[j]
        G[3 + i, j] -= r[k]
        G[3 + i, k] += r[j]
        G[3 + i, 3 + i] += r[j] ** 2 + r[k] ** 2
        for j in range(i):
            G[3 + i, 3 + j] -= r[i] * r[j]
    A, rows = eq.A[group], eq.rows
    first, stop = loops.visit_rows[loops.paths[path]], loops.visit_rows[last]
    for q in range(first, stop):
        s = slots[loops.row_columns[q]]
        if s < 0:
            continue
        a = rows[q]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            C[s, i] += a[i]
            C[s, 3 + i] += r[j] * a[k] - r[k] * a[j]
            b[s] += a[i] * e[i]
        for q2 in range(first, q + 1):
            s2 = slots[loops.row_columns[q2]]
            if s2 >= 0:
                product = a[0] * rows[q2, 0] + a[1] * rows[q2, 1] + a[2] * rows[q2, 2]
                A[max(s, s2), min(s, s2)] += product
    return square, math.sqrt(square)


@inlined
def follow_platform(loops: Loops, state: State, eq: Equations) -> None:
    """Turn the last ball joints to where the platform has them."""
    T, w = eq.T, eq.e
    for path in range(len(loops.last_balls)):
        if loops.last_balls[path] == 1:
            last = loops.paths[path + 1] - 1
            walk_path(loops, path, last, state, eq)
            difference(state.X, T, w)
            sign = float(loops.visits[last, 1])
            x = sign * (T[0, 0] * w[0] + T[1, 0] * w[1] + T[2, 0] * w[2])
            y = sign * (T[0, 1] * w[0] + T[1, 1] * w[1] + T[2, 1] * w[2])
            z = sign * (T[0, 2] * w[0] + T[1, 2] * w[1] + T[2, 2] * w[2])
            ball = state.balls[loops.visits[last, 0]]
            ball[0], ball[1], ball[2], ball[3] = exponential(x, y, z)


@inlined
def add_centres(
    loops: Loops, slots: Ints, group: int, path: int, state: State, centres: Floats, eq: Equations
) -> float:
    """Wishes for joint centres along a path, as rows of its group; the square of their residuals."""
    square = 0.0
    A, b, rows, at = eq.A[group], eq.b[group], eq.rows, eq.at
    for mark in range(loops.path_marks[path], loops.path_marks[path + 1]):
        visit, wish = loops.marks[mark, 0], centres[loops.marks[mark, 1]]
        if math.isnan(wish[0]):
            continue
        here = loops.visit_rows[visit]
        for i in range(3):
            off = at[here, i] - wish[i]
            square += off * off
            eq.misses[group] = max(eq.misses[group], abs(off))
            j, k = (i + 1) % 3, (i + 2) % 3
            for before in range(loops.paths[path], visit):
                slides = loops.kinds[loops.visits[before, 0]] == SLIDE
                for r in range(loops.visit_rows[before], loops.visit_rows[before + 1]):
                    s = slots[loops.row_columns[r]]
                    if s < 0:
                        continue
                    if slides:
                        own = rows[r, i]
                    else:
                        own = rows[r, 3 + j] * (at[here, k] - at[r, k]) - rows[r, 3 + k] * (at[here, j] - at[r, j])
                    eq.Y[group, s, 6] = own  # Y is not in use yet: a row of the Jacobian, for a moment
            for before in range(loops.paths[path], visit):
                for r in range(loops.visit_rows[before], loops.visit_rows[before + 1]):
                    s = slots[loops.row_columns[r]]
                    if s < 0:
                        continue
                    own = eq.Y[group, s, 6]
                    b[s] += own * off
                    for r2 in range(loops.visit_rows[loops.paths[path]], r + 1):
                        s2 = slots[loops.row_columns[r2]]
                        if s2 >= 0:
                            A[max(s, s2), min(s, s2)] += own * eq.Y[group, s2, 6]
    return square


@inlined
def add_anchors(loops: Loops, slots: Ints, row: int, state: State, wishes: Wishes, eq: Equations) -> float:
    """Distances of single coordinates from their anchors; the sum of their weighted squares."""
    square = 0.0
    for j in range(len(slots)):
        s, group, weight = slots[j], loops.group_of[j], wishes.weights[j]
        if s >= 0 and weight > 0.0:
            off = state.q[j] - wishes.anchors[row, j]
            square += weight * off * off
            eq.A[group, s, s] += weight
            eq.b[group, s] += weight * off
    return square


@inlined
def add_ranges(loops: Loops, slots: Ints, state: State, margin: float, eq: Equations) -> float:
    """Ranges that are exceeded; the sum of the squares of the excesses."""
    square = 0.0
    for j in range(len(slots)):
        low, high = loops.lo[j] + margin, loops.hi[j] - margin
        over = state.q[j] - high if state.q[j] > high else min(state.q[j] - low, 0.0)
        s, group = slots[j], loops.group_of[j]
        if over != 0.0:
            square += over * over
            eq.excesses[group] = max(eq.excesses[group], abs(over) - margin)
            if s >= 0:
                eq.A[group, s, s] += 1.0
                eq.b[group, s] += over
    return square


@inlined
def pose_cone(loops: Loops, cone: int, state: State, eq: Equations) -> float:
    """Pose the joint of a cone in its first body; the length of its line.

    T's rotation becomes the joint's, S's first rows the axes of its motions, at most three. The first half of the twist
    becomes what turns with the second body, the line or the cone's axis, and the second half the one that stays.
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
                own = T[i, 0] * axis[0] + T[i, 1] * axis[1] + T[i, 2] * axis[2]
                eq.S[k - loops.cone_units[cone, 0], i] = own
            sine = math.sin(half)
            w, x, y, z = math.cos(half), sine * axis[0], sine * axis[1], sine * axis[2]
        rotate_by(T, w, x, y, z)
    outward = loops.cone_outward[cone] == 1
    for i in range(3):
        moved = line if outward else loops.cone_axes[cone]
        pair[i] = T[i, 0] * moved[0] + T[i, 1] * moved[1] + T[i, 2] * moved[2]
        pair[3 + i] = loops.cone_axes[cone, i] if outward else line[i]
    return math.sqrt(line[0] ** 2 + line[1] ** 2 + line[2] ** 2)


@inlined
def add_cones(loops: Loops, slots: Ints, state: State, margin: float, eq: Equations) -> float:
    """Cones that are exceeded, as rows of their groups; the sum of the squares of the excesses."""
    square = 0.0
    for cone in range(len(loops.cone_angles)):
        length = pose_cone(loops, cone, state, eq)
        moved, stayed = eq.twist[:3], eq.twist[3:]
        x = moved[1] * stayed[2] - moved[2] * stayed[1]
        y = moved[2] * stayed[0] - moved[0] * stayed[2]
        z = moved[0] * stayed[1] - moved[1] * stayed[0]
        sine = math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, moved[0] * stayed[0] + moved[1] * stayed[1] + moved[2] * stayed[2])
        over = angle - (loops.cone_angles[cone] - margin)
        if over <= 0.0:
            continue
        first = loops.cone_units[cone, 0]
        column = loops.columns[first]
        group = loops.group_of[column]
        square += over * over
        eq.excesses[group] = max(eq.excesses[group], over - margin)
        if sine < 1e-12 * length:  # straight against the axis: no direction leads out
            continue
        # d angle = -(rate x moved) . stayed / sine = -rate . (moved x stayed) / sine
        gradient, A = eq.S[5], eq.A[group]
        for m in range(3 if loops.kinds[first] == BALL else 2):
            gradient[m] = -(eq.S[m, 0] * x + eq.S[m, 1] * y + eq.S[m, 2] * z) / sine
            s = slots[column + m]
            if s < 0:
                continue
            eq.b[group, s] += gradient[m] * over
            for m2 in range(m + 1):
                s2 = slots[column + m2]
                if s2 >= 0:
                    A[max(s, s2), min(s, s2)] += gradient[m] * gradient[m2]
    return square


@inlined
def add_platform(row: int, state: State, wishes: Wishes, eq: Equations) -> float:
    """The platform's distance from its target, in its own equations; the weighted square."""
    square = 0.0
    difference(state.X, wishes.targets[row], eq.e[3:])
    if wishes.framed == 1:
        into_frame(wishes.targets[row], eq.e[3:])
    for i in range(6):
        weight = wishes.platform[i]
        if weight == LOCKED:
            eq.G[i, i] += weight
        elif weight > 0.0:
            off = state.X[i, 3] - wishes.targets[row, i, 3] if i < 3 else eq.e[i]
            square += weight * off * off
            eq.G[i, i] += weight
            eq.G[i, 6] -= weight * off
    return square


@inlined
def into_frame(F: Floats, v: Floats) -> None:
    """Three components of a vector in base axes, in place, as those along the axes of a pose."""
    x, y, z = v[0], v[1], v[2]
    for i in range(3):
        v[i] = F[0, i] * x + F[1, i] * y + F[2, i] * z


@inlined
def out_of_frame(F: Floats, twist: Floats) -> None:
    """The angular part of a twist along the axes of a pose, in place, in base axes."""
    x, y, z = twist[3], twist[4], twist[5]
    for i in range(3):
        twist[3 + i] = F[i, 0] * x + F[i, 1] * y + F[i, 2] * z


@routine
def turn_equations(F: Floats, layout: Layout, eq: Equations) -> None:
    """Make the platform's angular velocity one about the axes of a pose, in all equations in which it occurs."""
    for group in range(len(layout.sizes)):
        for s in range(layout.sizes[group]):
            into_frame(F, eq.C[group, s, 3:])
    G = eq.G
    for i in range(3, 6):  # only the lower triangle is filled: that of the angular part is completed first
        for j in range(i + 1, 6):
            G[i, j] = G[j, i]
    for j in range(7):
        if j < 3 or j == 6:
            into_frame(F, G[3:, j])
    for j in range(3, 6):
        into_frame(F, G[3:, j])
    for i in range(3, 6):
        into_frame(F, G[i, 3:6])


@inlined
def clear(layout: Layout, eq: Equations) -> None:
    """Equations of nothing."""
    for group in range(len(layout.sizes)):
        for s in range(layout.sizes[group]):
            eq.b[group, s] = 0.0
            for i in range(6):
                eq.C[group, s, i] = 0.0
            for t in range(s + 1):
                eq.A[group, s, t] = 0.0
        eq.excesses[group] = 0.0
    for i in range(6):
        for j in range(7):
            eq.G[i, j] = 0.0


@inlined
def add_paths(loops: Loops, layout: Layout, wishes: Wishes, row: int, state: State, eq: Equations) -> float:
    """All paths, and the joint centres wished on them; the sum of their squares."""
    square = 0.0
    for group in range(len(layout.sizes)):
        eq.gaps[group] = eq.misses[group] = 0.0
        for path in range(loops.groups[group], loops.groups[group + 1]):
            last = loops.paths[path + 1]
            follows = wishes.balls_follow == 1 and loops.last_balls[path] == 1
            last -= 1 if follows else 0
            walk_path(loops, path, last, state, eq)
            if follows:
                own, gap = add_last_ball(loops, layout.slots, group, path, last, state, eq)
                square += own
                eq.gaps[group] = max(eq.gaps[group], gap)
                continue
            end_path(loops, path, last, loops.end, eq)
            eq.gaps[group] = max(eq.gaps[group], compare_end(loops, state, eq))
            square += add_path(loops, layout.slots, group, path, eq)
            if wishes.centres.shape[1] > 0:
                square += add_centres(loops, layout.slots, group, path, state, wishes.centres[row], eq)
    return square


@inlined
def note(eq: Equations, row: int, closed: Closed) -> None:
    """What was measured of the configuration that is the best so far."""
    for group in range(len(eq.gaps)):
        closed.gaps[row, group] = eq.gaps[group]
        closed.excesses[row, group] = eq.excesses[group]
        closed.misses[row, group] = eq.misses[group]


@inlined
def eliminate(A: Floats, C: Floats, b: Floats, size: int, damping: float, L: Floats, Y: Floats) -> None:
    """Y = (A + damping)^-1 [C, -b], by Cholesky."""
    for i in range(size):
        for k in range(6):
            Y[i, k] = C[i, k]
        Y[i, 6] = -b[i]
        for j in range(i + 1):
            value = A[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if j < i:
                L[i, j] = value * L[j, j]
            else:
                L[i, i] = 1.0 / math.sqrt(max(value + damping, damping))
        for k in range(7):
            value = Y[i, k]
            for j in range(i):
                value -= L[i, j] * Y[j, k]
            Y[i, k] = value * L[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(7):
            value = Y[i, k]
            for j in range(i + 1, size):
                value -= L[j, i] * Y[j, k]
            Y[i, k] = value * L[i, i]


@inlined
def solve_platform(S: Floats, damping: float, twist: Floats) -> None:
    """Solve the six symmetric positive equations S (lower triangle, right-hand side last) in place."""
    for i in range(6):
        for j in range(i + 1):
            value = S[i, j]
            for k in range(j):
                value -= S[i, k] * S[j, k]
            S[i, j] = value * S[j, j] if j < i else 1.0 / math.sqrt(max(value + damping, damping))
        value = S[i, 6]
        for j in range(i):
            value -= S[i, j] * twist[j]
        twist[i] = value * S[i, i]
    for i in range(5, -1, -1):
        value = twist[i]
        for j in range(i + 1, 6):
            value -= S[j, i] * twist[j]
        twist[i] = value * S[i, i]


@inlined
def solve(layout: Layout, damping: float, eq: Equations) -> None:
    """The platform's twist, and in Y's last column the step of every free coordinate."""
    for i in range(6):
        for j in range(7):
            eq.S[i, j] = eq.G[i, j]
    for group in range(len(layout.sizes)):
        size, C, Y = layout.sizes[group], eq.C[group], eq.Y[group]
        eliminate(eq.A[group], C, eq.b[group], size, damping, eq.factor, Y)
        for i in range(6):
            for s in range(size):
                for j in range(i + 1):
                    eq.S[i, j] -= C[s, i] * Y[s, j]
                eq.S[i, 6] += C[s, i] * Y[s, 6]
    solve_platform(eq.S, damping, eq.twist)
    for i in range(6):
        if eq.G[i, i] >= LOCKED:
            eq.twist[i] = 0.0
    for group in range(len(layout.sizes)):
        for s in range(layout.sizes[group]):
            for i in range(6):
                eq.Y[group, s, 6] += eq.Y[group, s, i] * eq.twist[i]


@inlined
def move(loops: Loops, layout: Layout, eq: Equations, state: State) -> float:
    """Take the step, shortened where it turns too far; its largest part."""
    longest = 0.0
    for i in range(6):
        longest = max(longest, abs(eq.twist[i]))
    for group in range(len(layout.sizes)):
        for s in range(layout.sizes[group]):
            longest = max(longest, abs(eq.Y[group, s, 6]))
    scale = min(1.0, LONGEST_STEP / longest) if longest > 0.0 else 1.0
    for k in range(len(loops.kinds)):
        j = loops.columns[k]
        Y = eq.Y[loops.group_of[j]]
        if loops.kinds[k] != BALL:
            if layout.slots[j] >= 0:
                state.q[j] += scale * Y[layout.slots[j], 6]
        elif layout.slots[j] >= 0:
            s = layout.slots[j]
            turn_ball(state.balls[k], scale * Y[s, 6], scale * Y[s + 1, 6], scale * Y[s + 2, 6])
    X, V = state.X, eq.twist
    for i in range(3):
        X[i, 3] += scale * V[i]
    # the platform turns about base axes: its rotation is multiplied from the left, column by column
    w, x, y, z = exponential(scale * V[3], scale * V[4], scale * V[5])
    for j in range(3):
        a, b, c = X[0, j], X[1, j], X[2, j]
        p, q, r = y * c - z * b, z * a - x * c, x * b - y * a
        X[0, j] = a + 2.0 * (w * p + y * r - z * q)
        X[1, j] = b + 2.0 * (w * q + z * p - x * r)
        X[2, j] = c + 2.0 * (w * r + x * q - y * p)
    return scale * longest


@inlined
def is_close(wishes: Wishes, eq: Equations) -> bool:
    """Whether all that must hold does."""
    largest = 0.0
    for group in range(len(eq.gaps)):
        largest = max(largest, eq.gaps[group], eq.misses[group])
        if wishes.limits:
            largest = max(largest, eq.excesses[group])
    return largest <= wishes.closeness


@kernel
def close(loops: Loops, layout: Layout, wishes: Wishes, closed: Closed) -> None:
    """Close the loops of every row, nearest to what is wished.

    A row ends when all that must hold is within `wishes.closeness`, when its steps or gains vanish, or after
    `wishes.max_iterations`; what was measured of it tells how far it came.
    """
    best, trial = new_state(loops), new_state(loops)
    eq = new_equations(loops, layout)
    plunging = wishes.plunging == 1
    for row in range(len(closed.coordinates)):
        load_row(loops, layout, wishes.chained == 1 and row > 0, row, closed, trial)
        copy_state(trial, best)
        cost, factor, step = math.inf, 1.0, math.inf
        iterations, turn = 0, TRY
        while True:
            clear(layout, eq)
            found = 0.0
            if turn != MEASURE:
                found += add_paths(loops, layout, wishes, row, trial, eq)
            if wishes.limits == 1 or turn == MEASURE:
                found += add_ranges(loops, layout.slots, trial, wishes.margin, eq)
                found += add_cones(loops, layout.slots, trial, wishes.margin, eq)
            if turn == MEASURE:
                for group in range(len(layout.sizes)):
                    closed.excesses[row, group] = eq.excesses[group]
                break
            found += add_anchors(loops, layout.slots, row, trial, wishes, eq)
            if wishes.framed == 1:
                turn_equations(wishes.targets[row], layout, eq)
            found += add_platform(row, trial, wishes, eq)
            if turn == TRY:
                if found < cost or plunging:
                    gained, cost = cost - found, found
                    copy_state(trial, best)
                    note(eq, row, closed)
                    factor = max(factor / 4.0, 1e-3)
                    if is_close(wishes, eq) or (gained <= 1e-13 * cost and not plunging):
                        turn = MEASURE
                else:
                    factor *= 8.0
                    turn = MEASURE if step < 1e-12 else RETURN
                    copy_state(best, trial)
            elif turn == RETURN:
                turn = TRY
            damping = LEAST_DAMPING if plunging else max(LEAST_DAMPING, DAMPING * factor * cost)
            if turn == TRY and (iterations == wishes.max_iterations or not damping < MOST_DAMPING):
                turn = MEASURE
            if turn == TRY:
                solve(layout, damping, eq)
                if wishes.framed == 1:
                    out_of_frame(wishes.targets[row], eq.twist)
                step = move(loops, layout, eq, trial)
                iterations += 1
            elif turn == MEASURE:
                if wishes.balls_follow == 1:
                    follow_platform(loops, best, eq)
                copy_state(best, trial)
        store_row(loops, row, best, closed)
        closed.iterations[row] = iterations
