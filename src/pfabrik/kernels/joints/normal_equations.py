"""The normal equations of closing loops, term by term: paths, joint centres, limits, cones and the platform.

The unknowns are the free joint coordinates q, group by group, and the platform's twist V. With X the platform's pose
and FK_i(q) the pose at the end of path i, the residuals are

    paths       position of FK_i - X [L], and the rotation vector of R_i R_X^T [rad]
    centres     centres of joints less their targets [L]
    limits      q_j - hi, lo - q_j and angle - half_angle of cones, where they are positive

and every group adds its J^T J to A (its own coordinates), C (with the twist), and b = J^T r; the twist's own are in G.
"""

from __future__ import annotations

import math

from ...common.arrays import Floats, Ints
from .._jit import inlined, routine
from ..quaternions import UPSIDE_DOWN, difference, exponential
from .loops import BALL, LOCKED, SLIDE, TARGET_AXES, ClosureProblem, Layout, Loops
from .path_kinematics import Equations, State, compare_end, end_path, pose_cone, walk_path


@inlined
def add_path(loops: Loops, slots: Ints, group: int, path: int, eq: Equations) -> float:
    """Add a path to the equations of its group and of the platform; the square of its residual."""
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
                twice = s == s2 and r != r2  # a joint that the path passes twice, out and back
                A[max(s, s2), min(s, s2)] += 2.0 * product if twice else product
    return square


@inlined
def add_last_ball(
    loops: Loops, slots: Ints, group: int, path: int, last: int, state: State, eq: Equations
) -> tuple[float, float]:
    """Add a path whose last ball joint follows the platform, so that only its centre must meet.

    The square of its residual, and the residual [L].
    """
    point = loops.points[loops.visits[last, 0]]
    end_path(loops, path, last, point, eq)
    C, b, e, r, X, G = eq.C[group], eq.b[group], eq.e, eq.lever, state.X, eq.G
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
    """Set the last ball joints to the orientation of the platform."""
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
    """Add joint centres along a path, less their targets, as rows of its group; the sum of their squares."""
    square = 0.0
    A, b, rows, at = eq.A[group], eq.b[group], eq.rows, eq.at
    for mark in range(loops.path_marks[path], loops.path_marks[path + 1]):
        visit, target = loops.marks[mark, 0], centres[loops.marks[mark, 1]]
        if math.isnan(target[0]):
            continue
        here = loops.visit_rows[visit]
        for i in range(3):
            off = at[here, i] - target[i]
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
                        rate = rows[r, i]
                    else:
                        rate = rows[r, 3 + j] * (at[here, k] - at[r, k]) - rows[r, 3 + k] * (at[here, j] - at[r, j])
                    eq.Y[group, s, 6] = rate  # Y is not in use yet; its last column holds a row of the Jacobian here
            for before in range(loops.paths[path], visit):
                for r in range(loops.visit_rows[before], loops.visit_rows[before + 1]):
                    s = slots[loops.row_columns[r]]
                    if s < 0:
                        continue
                    rate = eq.Y[group, s, 6]
                    b[s] += rate * off
                    for r2 in range(loops.visit_rows[loops.paths[path]], r + 1):
                        s2 = slots[loops.row_columns[r2]]
                        if s2 >= 0:
                            A[max(s, s2), min(s, s2)] += rate * eq.Y[group, s2, 6]
    return square


@inlined
def add_ranges(loops: Loops, slots: Ints, state: State, margin: float, eq: Equations) -> float:
    """Add ranges that are exceeded; the sum of the squares of the excesses."""
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
def add_cones(loops: Loops, slots: Ints, state: State, margin: float, eq: Equations) -> float:
    """Add cones that are exceeded, as rows of their groups; the sum of the squares of the excesses."""
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
def hold_platform(problem: ClosureProblem, eq: Equations) -> None:
    """Add LOCKED to the platform's equations for the components of its pose that are held."""
    for i in range(6):
        if problem.platform[i] == LOCKED:
            eq.G[i, i] += LOCKED


@inlined
def pose_frame(state: State, problem: ClosureProblem, eq: Equations) -> None:
    """Write the axes about which the platform's rotation is held to `eq.frame`."""
    F = eq.frame
    if problem.frame == TARGET_AXES:
        for i in range(3):
            for j in range(3):
                F[i, j] = state.X[i, j]
        return
    x, y, z = state.X[0, 2], state.X[1, 2], state.X[2, 2] + 1.0
    length = math.sqrt(x * x + y * y + z * z)
    if length < UPSIDE_DOWN:
        x, y, z, length = 0.0, 0.0, 1.0, 1.0
    a, b, c = x / length, y / length, z / length
    # the shortest rotation of the z axis to half way
    F[0, 0], F[0, 1], F[0, 2] = 1.0 - a * a / (1.0 + c), -a * b / (1.0 + c), a
    F[1, 0], F[1, 1], F[1, 2] = -a * b / (1.0 + c), 1.0 - b * b / (1.0 + c), b
    F[2, 0], F[2, 1], F[2, 2] = -a, -b, c


@inlined
def into_frame(F: Floats, v: Floats) -> None:
    """Transform a vector from base axes to the axes of a pose, in place."""
    x, y, z = v[0], v[1], v[2]
    for i in range(3):
        v[i] = F[0, i] * x + F[1, i] * y + F[2, i] * z


@inlined
def out_of_frame(F: Floats, twist: Floats) -> None:
    """Transform the angular part of a twist from the axes of a pose to base axes, in place."""
    x, y, z = twist[3], twist[4], twist[5]
    for i in range(3):
        twist[3 + i] = F[i, 0] * x + F[i, 1] * y + F[i, 2] * z


@routine
def turn_equations(F: Floats, layout: Layout, eq: Equations) -> None:
    """Express the platform's angular velocity about the axes of a pose, in all equations in which it occurs."""
    for group in range(len(layout.sizes)):
        for s in range(layout.sizes[group]):
            into_frame(F, eq.C[group, s, 3:])
    G = eq.G
    for i in range(3, 6):  # only the lower triangle is filled; complete that of the angular part first
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
    """Set all sums to zero."""
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
def add_paths(loops: Loops, layout: Layout, problem: ClosureProblem, row: int, state: State, eq: Equations) -> float:
    """Add all paths, and the joint centres on them that have targets; the sum of squares."""
    square = 0.0
    for group in range(len(layout.sizes)):
        eq.gaps[group] = eq.misses[group] = 0.0
        for path in range(loops.groups[group], loops.groups[group + 1]):
            last = loops.paths[path + 1]
            follows = problem.balls_follow == 1 and loops.last_balls[path] == 1
            last -= 1 if follows else 0
            walk_path(loops, path, last, state, eq)
            if follows:
                path_square, gap = add_last_ball(loops, layout.slots, group, path, last, state, eq)
                square += path_square
                eq.gaps[group] = max(eq.gaps[group], gap)
                continue
            end_path(loops, path, last, loops.end, eq)
            eq.gaps[group] = max(eq.gaps[group], compare_end(loops, state, eq))
            square += add_path(loops, layout.slots, group, path, eq)
            if problem.centres.shape[1] > 0:
                square += add_centres(loops, layout.slots, group, path, state, problem.centres[row], eq)
    return square
