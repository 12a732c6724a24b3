"""What a configuration of closed loops looks like to first order: free motions, the objective and limits on them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._jit import allocator, routine
from ..sqp import EXCESS, GAP, LIMITS, MOTIONS, RANK, REACH, VALUE, Curve, Pace, Slope, new_curve, new_pace, new_slope
from .loops import BALL, Floats, Ints, Layout, Loops
from .path_kinematics import Equations, State, compare_end, end_path, new_equations, pose_cone, walk_path
from .pose_objective import Aim, Pull, look_at_aim

DEPENDENT = 1e-6
"""What is left of an equation that follows from the others: descriptions are typed with as many digits."""

SHARED = 0.01
"""By what entries of unknowns that paths have in common count less as pivots: they couple the paths' equations."""


class View(NamedTuple):
    """What a configuration looks like to first order: its unknowns are the motions that the loops leave free."""

    slope: Slope
    basis: Floats  # (columns, columns): free motions, one a column
    shift: Floats  # (columns,): what would close the loops
    transform: Floats  # (rows, rows): how pivot rows are made of the equations
    pivots: Ints  # (rows,): column of each


class Desk(NamedTuple):
    """Room to work in."""

    eq: Equations
    aim: Pull
    curve: Curve
    pace: Pace
    gaps: Floats  # (paths, 6): between the ends of each path and of the first
    A: Floats  # (rows, columns + 1 + rows)
    row: Floats  # (columns,)
    force: Floats  # (paths, 6): what pulls at the end of each path
    balance: Floats  # (rows,): multipliers of the loops and of what is held
    here: Floats  # (columns,)
    there: Floats  # (columns,)
    used: Ints  # (columns,): how many paths pass each, the first counted twice: it is in the equations of all
    filled: Ints  # (columns + 1 + rows,): where a row of A is not zero: legs have few unknowns in common


@allocator
def new_view(loops: Loops, rows: int) -> View:
    """Room for what is seen of one configuration."""
    n = len(loops.lo)
    slope = new_slope(n, 2 * n + len(loops.cone_angles))
    return View(slope, np.zeros((n, n)), np.zeros(n), np.zeros((rows, rows)), np.zeros(rows, np.int64))


@allocator
def new_desk(loops: Loops, layout: Layout, rows: int) -> Desk:
    """Room to work in, for one thread."""
    n, paths = len(loops.lo), len(loops.paths) - 1
    used = np.zeros(n, np.int64)
    for r in range(len(loops.row_columns)):
        used[loops.row_columns[r]] += 2 if r < loops.visit_rows[loops.paths[1]] else 1  # the first is in all equations
    return Desk(
        new_equations(loops, layout),
        Pull(np.zeros(6), np.zeros((6, 6)), np.zeros(6), np.ones(1), np.zeros(6)),
        new_curve(n, 2 * n + len(loops.cone_angles)),
        new_pace(),
        np.zeros((paths, 6)),
        np.zeros((rows, n + 1 + rows)),
        np.zeros(n),
        np.zeros((paths, 6)),
        np.zeros(rows),
        np.zeros(n),
        np.zeros(n),
        used,
        np.zeros(n + 1 + rows, np.int64),
    )


@routine
def walk_all(loops: Loops, state: State, desk: Desk) -> float:
    """Pose the end effector by the first path, and compare the ends of the others with it; the largest gap."""
    eq, gap = desk.eq, 0.0
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
                desk.gaps[path, i] = eq.e[i]
    return gap


@routine
def add_force(loops: Loops, path: int, force: Floats, desk: Desk, out: Floats) -> None:
    """What a force and moment at the end of a path do at every coordinate, added to `out`."""
    rows, columns = desk.eq.rows, loops.row_columns
    for r in range(loops.visit_rows[loops.paths[path]], loops.visit_rows[loops.paths[path + 1]]):
        a = rows[r]
        share = a[0] * force[0] + a[1] * force[1] + a[2] * force[2]
        out[columns[r]] += share + a[3] * force[3] + a[4] * force[4] + a[5] * force[5]


@routine
def look(loops: Loops, row: int, want: Aim, state: State, desk: Desk, view: View) -> None:
    """Look at a configuration."""
    slope, n = view.slope, len(loops.lo)
    basis, here, g, metric = view.basis, desk.here, slope.g, slope.metric
    gap = walk_all(loops, state, desk)
    slope.scalars[VALUE], held = look_at_aim(want, want.targets[row], state.X, desk.aim)
    for k in range(held):
        gap = max(gap, abs(desk.aim.errors[k]))
    slope.scalars[GAP] = gap
    for j in range(n):
        here[j] = 0.0
    add_force(loops, 0, desk.aim.force, desk, desk.here)
    eliminate(lay_out(loops, held, desk), n, desk, view)
    for a in range(slope.counts[MOTIONS]):
        g[a] = 0.0
        for j in range(n):
            g[a] += basis[j, a] * here[j]
        for b in range(a + 1):
            metric[a, b] = 0.0
            for j in range(n):
                metric[a, b] += basis[j, a] * basis[j, b]
    look_at_limits(loops, want.margin, state, desk, view)


@routine
def lay_out(loops: Loops, held: int, desk: Desk) -> int:
    """The equations of the loops and of what is held, with an identity beside them; how many."""
    paths, n, A, eq = len(loops.paths) - 1, len(loops.lo), desk.A, desk.eq
    first = 6 * (paths - 1)
    rows, holds = eq.rows, desk.aim.holds
    for r in range(first + held):
        for j in range(A.shape[1]):
            A[r, j] = 0.0
        A[r, n] = -desk.gaps[1 + r // 6, r % 6] if r < first else -desk.aim.errors[r - first]
        A[r, n + 1 + r] = 1.0
    for path in range(paths):
        for r in range(loops.visit_rows[loops.paths[path]], loops.visit_rows[loops.paths[path + 1]]):
            j = loops.row_columns[r]
            for i in range(6):
                if path > 0:
                    A[6 * (path - 1) + i, j] += rows[r, i]
                    continue
                for other in range(paths - 1):
                    A[6 * other + i, j] -= rows[r, i]
                for k in range(held):
                    A[first + k, j] += holds[k, i] * rows[r, i]
    return first + held


@routine
def eliminate(rows: int, n: int, desk: Desk, view: View) -> None:
    """Gauss-Jordan elimination, the largest entry of each row its pivot: free motions, and what closes the loops."""
    A, rank, width = desk.A, 0, n + 1 + rows
    taken, used, filled_at, basis, shift, pivots = desk.row, desk.used, desk.filled, view.basis, view.shift, view.pivots
    for j in range(n):
        shift[j] = 0.0
        taken[j] = 0.0  # 1 for pivot columns
    for row in range(rows):
        largest, pivot = 0.0, -1
        for j in range(n):
            size = abs(A[row, j])
            if size > DEPENDENT and taken[j] == 0.0:
                size *= SHARED if used[j] > 1 else 1.0
                if size > largest:
                    largest, pivot = size, j
        if pivot < 0:  # it follows from those before
            continue
        factor, filled = 1.0 / A[row, pivot], 0
        for j in range(width):
            A[row, j], A[rank, j] = A[rank, j], factor * A[row, j]
            if A[rank, j] != 0.0:
                filled_at[filled] = j
                filled += 1
        for i in range(rows):
            share = A[i, pivot]
            if i != rank and share != 0.0:
                for k in range(filled):
                    A[i, filled_at[k]] -= share * A[rank, filled_at[k]]
                A[i, pivot] = 0.0
        taken[pivot] = 1.0
        pivots[rank] = pivot
        rank += 1
    motions = 0
    for j in range(n):
        if taken[j] == 0.0 and used[j] > 0:
            for i in range(n):
                basis[i, motions] = 0.0
            basis[j, motions] = 1.0
            for r in range(rank):
                basis[pivots[r], motions] = -A[r, j]
            motions += 1
    for r in range(rank):
        shift[pivots[r]] = A[r, n]
        for i in range(rows):
            view.transform[r, i] = A[r, n + 1 + i]
    view.slope.counts[MOTIONS], view.slope.counts[RANK] = motions, rank


@routine
def look_at_limits(loops: Loops, margin: float, state: State, desk: Desk, view: View) -> None:
    """Excess and gradient of every limit within reach."""
    slope = view.slope
    basis, shift, G, row = view.basis, view.shift, slope.G, desk.row
    n, k, excess = len(loops.lo), 0, -math.inf
    for j in range(n):
        for side in range(2):
            h = loops.lo[j] + margin - state.q[j] if side == 0 else state.q[j] - loops.hi[j] + margin
            if h > -REACH and desk.used[j] > 0:
                for a in range(slope.counts[MOTIONS]):
                    G[k, a] = -basis[j, a] if side == 0 else basis[j, a]
                slope.drift[k] = -shift[j] if side == 0 else shift[j]
                slope.h[k], slope.which[k] = h, 2 * j + side
                excess = max(excess, h)
                k += 1
    for cone in range(len(loops.cone_angles)):
        h = cone_excess(loops, cone, margin, state, desk)
        if h > -REACH and desk.used[loops.columns[loops.cone_units[cone, 0]]] > 0:
            for j in range(n):
                row[j] = 0.0
            add_cone(loops, cone, 1.0, desk, desk.row)
            for a in range(slope.counts[MOTIONS]):
                G[k, a] = 0.0
                for j in range(n):
                    G[k, a] += row[j] * basis[j, a]
            slope.drift[k] = 0.0
            for j in range(n):
                slope.drift[k] += row[j] * shift[j]
            slope.h[k], slope.which[k] = h, 2 * n + cone
            excess = max(excess, h)
            k += 1
    slope.counts[LIMITS] = k
    slope.scalars[EXCESS] = excess


@routine
def cone_excess(loops: Loops, cone: int, margin: float, state: State, desk: Desk) -> float:
    """Excess over a cone; its joint is posed for `add_cone`."""
    pose_cone(loops, cone, state, desk.eq)
    moved, stayed = desk.eq.twist[:3], desk.eq.twist[3:]
    x = moved[1] * stayed[2] - moved[2] * stayed[1]
    y = moved[2] * stayed[0] - moved[0] * stayed[2]
    z = moved[0] * stayed[1] - moved[1] * stayed[0]
    cosine = moved[0] * stayed[0] + moved[1] * stayed[1] + moved[2] * stayed[2]
    return math.atan2(math.sqrt(x * x + y * y + z * z), cosine) - (loops.cone_angles[cone] - margin)


@routine
def add_cone(loops: Loops, cone: int, factor: float, desk: Desk, out: Floats) -> None:
    """The gradient of a cone's excess, times a factor, added to `out`."""
    eq = desk.eq
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
    # a slide moves the line; the angle changes with what of that is across the line, toward the axis
    outward = loops.cone_outward[cone] == 1
    line, axis = (a, b) if outward else (b, a)
    square = line[0] ** 2 + line[1] ** 2 + line[2] ** 2
    for slide in range(loops.cone_slides[cone, 0], loops.cone_slides[cone, 1]):
        rate = 0.0
        for i in range(3):
            own = loops.slide_axes[slide, i]
            if outward:
                own = 0.0
                for j in range(3):
                    own += eq.T[i, j] * loops.slide_axes[slide, j]
            rate -= own * (axis[i] - cosine / square * line[i])
        out[loops.slides[slide]] += factor * rate / sine
