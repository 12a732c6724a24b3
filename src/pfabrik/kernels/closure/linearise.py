"""What a configuration of closed loops looks like to first order: free motions, the objective and limits on them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._jit import allocator, routine
from ..sqp import (
    EXCESS,
    GAP,
    LIMITS,
    MOTIONS,
    RANK,
    REACH,
    VALUE,
    Hessian,
    Linearisation,
    StepControl,
    new_hessian,
    new_linearisation,
    new_step_control,
)
from .loops import BALL, Floats, Ints, Layout, Loops
from .path_kinematics import Equations, State, compare_end, end_path, new_equations, pose_cone, walk_path
from .pose_objective import PoseGradient, PoseObjective, pose_gradient

DEPENDENT = 1e-6
"""What is left of an equation that follows from the others: descriptions are typed with as many digits."""

SHARED = 0.01
"""By what entries of unknowns that paths have in common count less as pivots: they couple the paths' equations."""


class FreeMotions(NamedTuple):
    """The motions that the loops leave free at a configuration, and objective and limits linearised in them."""

    linear: Linearisation
    basis: Floats  # (columns, columns): free motions, one a column
    shift: Floats  # (columns,): what would close the loops
    transform: Floats  # (rows, rows): how pivot rows are made of the equations
    pivots: Ints  # (rows,): column of each


class Workspace(NamedTuple):
    """Scratch memory of one thread."""

    eq: Equations
    gradient: PoseGradient
    hessian: Hessian
    control: StepControl
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
def new_free_motions(loops: Loops, rows: int) -> FreeMotions:
    """Memory for the linearisation of one configuration."""
    n = len(loops.lo)
    linear = new_linearisation(n, 2 * n + len(loops.cone_angles))
    return FreeMotions(linear, np.zeros((n, n)), np.zeros(n), np.zeros((rows, rows)), np.zeros(rows, np.int64))


@allocator
def new_workspace(loops: Loops, layout: Layout, rows: int) -> Workspace:
    """Scratch memory of one thread."""
    n, paths = len(loops.lo), len(loops.paths) - 1
    used = np.zeros(n, np.int64)
    for r in range(len(loops.row_columns)):
        used[loops.row_columns[r]] += 2 if r < loops.visit_rows[loops.paths[1]] else 1  # the first is in all equations
    return Workspace(
        new_equations(loops, layout),
        PoseGradient(np.zeros(6), np.zeros((6, 6)), np.zeros(6), np.ones(1), np.zeros(6)),
        new_hessian(n, 2 * n + len(loops.cone_angles)),
        new_step_control(),
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
def walk_all(loops: Loops, state: State, work: Workspace) -> float:
    """Pose the end effector by the first path, and compare the ends of the others with it; the largest gap."""
    eq, gap = work.eq, 0.0
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
                work.gaps[path, i] = eq.e[i]
    return gap


@routine
def add_force(loops: Loops, path: int, force: Floats, work: Workspace, out: Floats) -> None:
    """What a force and moment at the end of a path do at every coordinate, added to `out`."""
    rows, columns = work.eq.rows, loops.row_columns
    for r in range(loops.visit_rows[loops.paths[path]], loops.visit_rows[loops.paths[path + 1]]):
        a = rows[r]
        share = a[0] * force[0] + a[1] * force[1] + a[2] * force[2]
        out[columns[r]] += share + a[3] * force[3] + a[4] * force[4] + a[5] * force[5]


@routine
def linearise(
    loops: Loops, row: int, objective: PoseObjective, state: State, work: Workspace, view: FreeMotions
) -> None:
    """Look at a configuration."""
    linear, n = view.linear, len(loops.lo)
    basis, here, g, metric = view.basis, work.here, linear.g, linear.metric
    gap = walk_all(loops, state, work)
    linear.scalars[VALUE], held = pose_gradient(objective, objective.targets[row], state.X, work.gradient)
    for k in range(held):
        gap = max(gap, abs(work.gradient.errors[k]))
    linear.scalars[GAP] = gap
    for j in range(n):
        here[j] = 0.0
    add_force(loops, 0, work.gradient.force, work, work.here)
    eliminate(lay_out(loops, held, work), n, work, view)
    for a in range(linear.counts[MOTIONS]):
        g[a] = 0.0
        for j in range(n):
            g[a] += basis[j, a] * here[j]
        for b in range(a + 1):
            metric[a, b] = 0.0
            for j in range(n):
                metric[a, b] += basis[j, a] * basis[j, b]
    linearise_limits(loops, objective.margin, state, work, view)


@routine
def lay_out(loops: Loops, held: int, work: Workspace) -> int:
    """The equations of the loops and of what is held, with an identity beside them; how many."""
    paths, n, A, eq = len(loops.paths) - 1, len(loops.lo), work.A, work.eq
    first = 6 * (paths - 1)
    rows, holds = eq.rows, work.gradient.holds
    for r in range(first + held):
        for j in range(A.shape[1]):
            A[r, j] = 0.0
        A[r, n] = -work.gaps[1 + r // 6, r % 6] if r < first else -work.gradient.errors[r - first]
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
def eliminate(rows: int, n: int, work: Workspace, view: FreeMotions) -> None:
    """Gauss-Jordan elimination, the largest entry of each row its pivot: free motions, and what closes the loops."""
    A, rank, width = work.A, 0, n + 1 + rows
    taken, used, filled_at, basis, shift, pivots = work.row, work.used, work.filled, view.basis, view.shift, view.pivots
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
    view.linear.counts[MOTIONS], view.linear.counts[RANK] = motions, rank


@routine
def linearise_limits(loops: Loops, margin: float, state: State, work: Workspace, view: FreeMotions) -> None:
    """Excess and gradient of every limit within reach."""
    linear = view.linear
    basis, shift, G, row = view.basis, view.shift, linear.G, work.row
    n, k, excess = len(loops.lo), 0, -math.inf
    for j in range(n):
        for side in range(2):
            h = loops.lo[j] + margin - state.q[j] if side == 0 else state.q[j] - loops.hi[j] + margin
            if h > -REACH and work.used[j] > 0:
                for a in range(linear.counts[MOTIONS]):
                    G[k, a] = -basis[j, a] if side == 0 else basis[j, a]
                linear.drift[k] = -shift[j] if side == 0 else shift[j]
                linear.h[k], linear.which[k] = h, 2 * j + side
                excess = max(excess, h)
                k += 1
    for cone in range(len(loops.cone_angles)):
        h = cone_excess(loops, cone, margin, state, work)
        if h > -REACH and work.used[loops.columns[loops.cone_units[cone, 0]]] > 0:
            for j in range(n):
                row[j] = 0.0
            add_cone(loops, cone, 1.0, work, work.row)
            for a in range(linear.counts[MOTIONS]):
                G[k, a] = 0.0
                for j in range(n):
                    G[k, a] += row[j] * basis[j, a]
            linear.drift[k] = 0.0
            for j in range(n):
                linear.drift[k] += row[j] * shift[j]
            linear.h[k], linear.which[k] = h, 2 * n + cone
            excess = max(excess, h)
            k += 1
    linear.counts[LIMITS] = k
    linear.scalars[EXCESS] = excess


@routine
def cone_excess(loops: Loops, cone: int, margin: float, state: State, work: Workspace) -> float:
    """Excess over a cone; its joint is posed for `add_cone`."""
    pose_cone(loops, cone, state, work.eq)
    moved, stayed = work.eq.twist[:3], work.eq.twist[3:]
    x = moved[1] * stayed[2] - moved[2] * stayed[1]
    y = moved[2] * stayed[0] - moved[0] * stayed[2]
    z = moved[0] * stayed[1] - moved[1] * stayed[0]
    cosine = moved[0] * stayed[0] + moved[1] * stayed[1] + moved[2] * stayed[2]
    return math.atan2(math.sqrt(x * x + y * y + z * z), cosine) - (loops.cone_angles[cone] - margin)


@routine
def add_cone(loops: Loops, cone: int, factor: float, work: Workspace, out: Floats) -> None:
    """The gradient of a cone's excess, times a factor, added to `out`."""
    eq = work.eq
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
