"""Free motions: the null space of the equations at a configuration, found by elimination."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..common.arrays import Floats, Ints
from ._jit import routine
from .qp import QP, factorise, solve_qp
from .search_constants import FILLED, IMPLIED, LOOSE, SHARED
from .sqp import Linearisation, new_linearisation


class FreeMotions(NamedTuple):
    """Free motions at a configuration, with the objective and the limits linearised in them."""

    linear: Linearisation
    basis: Floats  # (unknowns, unknowns): free motions, by columns
    shift: Floats  # (unknowns,): the step that meets the equations
    transform: Floats  # (rows, rows): pivot rows as combinations of the equations
    pivots: Ints  # (rows,): unknown of each pivot row
    free: Ints  # (unknowns,): the unknown that only this free motion moves


class Elimination(NamedTuple):
    """Equations under elimination."""

    A: Floats  # (rows, unknowns + 1 + rows): equations, right-hand side, identity
    taken: Floats  # (unknowns,): 1 for pivots, and for fixed unknowns
    filled: Ints  # (unknowns + 1 + rows,): columns where a row of A is not zero
    used: Ints  # (unknowns,): 0 for fixed unknowns, more than 1 for those that legs have in common


def new_free_motions(n: int, rows: int, limits: int) -> FreeMotions:
    """Allocate the free motions of a configuration."""
    linear = new_linearisation(n, limits)
    pivots, free = np.zeros(rows, np.int64), np.zeros(n, np.int64)
    return FreeMotions(linear, np.zeros((n, n)), np.zeros(n), np.zeros((rows, rows)), pivots, free)


def new_elimination(n: int, rows: int) -> Elimination:
    """Allocate equations; `used` is to be filled."""
    width = n + 1 + rows
    return Elimination(np.zeros((rows, width)), np.zeros(n), np.zeros(width, np.int64), np.zeros(n, np.int64))


@routine
def eliminate(rows: int, elimination: Elimination, reduced: FreeMotions, first: int, implied: int) -> None:
    """Solve the equations for the free motions and the step that meets them, by Gauss-Jordan elimination.

    The pivot of a row is its largest entry. An equation f = a f1 + b f2 that follows from others if these are met no
    longer does so when they are open: its slope then keeps a part of first order in the gap, and would wrongly bar free
    motions.

    Parameters
    ----------
    first, implied : of the first equations, this many follow from others in general. Those of them that seem to follow
        from the others at this gap are postponed, and as many as do so in general are left out.
    """
    A, taken, used = elimination.A, elimination.taken, elimination.used
    basis, shift, pivots = reduced.basis, reduced.shift, reduced.pivots
    n, rank = used.shape[0], 0
    for j in range(n):
        shift[j] = 0.0
        taken[j] = 0.0 if used[j] > 0 else 1.0
    least, n_postponed = IMPLIED, 0
    if implied > 0:
        least, n_postponed = max(IMPLIED, LOOSE * reduced.linear.totals[0]["gap"]), first
    for turn in range(rows + n_postponed):
        row = turn if turn < first else turn - first if turn < first + n_postponed else turn - n_postponed
        if not first <= turn < first + n_postponed or rank <= min(row, first - implied - 1):
            rank += solve_row(row, rank, rows, least if turn < first else IMPLIED, elimination, reduced)
    motions = 0
    for j in range(n):
        if taken[j] == 0.0:
            for i in range(n):
                basis[i, motions] = 0.0
            basis[j, motions] = 1.0
            reduced.free[motions] = j
            for r in range(rank):
                basis[pivots[r], motions] = -A[r, j]
            motions += 1
    for r in range(rank):
        shift[pivots[r]] = A[r, n]
        for i in range(rows):
            reduced.transform[r, i] = A[r, n + 1 + i]
    totals = reduced.linear.totals[0]
    totals["motions"], totals["rank"], totals["rows"] = motions, rank, rows


@routine
def solve_row(row: int, rank: int, rows: int, least: float, elimination: Elimination, reduced: FreeMotions) -> int:
    """Solve a row for its pivot unknown, as pivot row number `rank`; 1, or 0 if it follows from those before."""
    A, taken, columns, used = elimination.A, elimination.taken, elimination.filled, elimination.used
    n, largest, pivot = used.shape[0], 0.0, -1
    for j in range(n):
        size = abs(A[row, j])
        if size > least and taken[j] == 0.0:
            size *= SHARED if used[j] > 1 else 1.0
            if size > largest:
                largest, pivot = size, j
    if pivot < 0:
        return 0
    factor, n_filled = 1.0 / A[row, pivot], 0
    for j in range(n + 1 + rows):
        A[row, j], A[rank, j] = A[rank, j], factor * A[row, j]
        if A[rank, j] != 0.0:
            columns[n_filled] = j
            n_filled += 1
    width = n + 1 + rows
    is_dense = width < FILLED * n_filled
    for i in range(rows):
        entry = A[i, pivot]
        if i != rank and entry != 0.0 and is_dense:  # a loop over all of them is a vector
            for k in range(width):
                A[i, k] -= entry * A[rank, k]
            A[i, pivot] = 0.0
        elif i != rank and entry != 0.0:
            for k in range(n_filled):
                A[i, columns[k]] -= entry * A[rank, columns[k]]
            A[i, pivot] = 0.0
    taken[pivot] = 1.0
    reduced.pivots[rank] = pivot
    return 1


@routine
def put_multipliers(gradient: Floats, reduced: FreeMotions, multipliers: Floats) -> float:
    """Fill the multipliers of the equations that balance a gradient at the pivot unknowns; the sum of their sizes."""
    totals, pivots, transform, total = reduced.linear.totals[0], reduced.pivots, reduced.transform, 0.0
    for i in range(multipliers.shape[0]):
        multipliers[i] = 0.0
    for r in range(totals["rank"]):
        for i in range(totals["rows"]):
            multipliers[i] -= gradient[pivots[r]] * transform[r, i]
    for i in range(totals["rows"]):
        total += abs(multipliers[i])
    return total


@routine
def project(gradient: Floats, reduced: FreeMotions, out: Floats) -> None:
    """Project a gradient in the unknowns onto the free motions, (motions,)."""
    basis, pivots, free, totals = reduced.basis, reduced.pivots, reduced.free, reduced.linear.totals[0]
    motions = totals["motions"]
    for a in range(motions):
        out[a] = gradient[free[a]]
    for r in range(totals["rank"]):
        p = pivots[r]
        if gradient[p] != 0.0:
            for a in range(motions):
                out[a] += gradient[p] * basis[p, a]


@routine
def project_gradient(force: Floats, reduced: FreeMotions) -> None:
    """Fill the gradient of the objective in the free motions, from that in the unknowns, and the metric."""
    basis, metric, pivots, totals = reduced.basis, reduced.linear.metric, reduced.pivots, reduced.linear.totals[0]
    totals["closing"] = along_shift(force, reduced)
    project(force, reduced, reduced.linear.g)
    for a in range(totals["motions"]):
        for b in range(a + 1):
            metric[a, b] = 1.0 if a == b else 0.0
        for r in range(totals["rank"]):
            share = basis[pivots[r], a]
            for b in range(a + 1):
                metric[a, b] += share * basis[pivots[r], b]


@routine
def along_shift(gradient: Floats, reduced: FreeMotions) -> float:
    """Change of a quantity with this gradient by the step that meets the equations."""
    total = 0.0
    for r in range(reduced.linear.totals[0]["rank"]):
        total += gradient[reduced.pivots[r]] * reduced.shift[reduced.pivots[r]]
    return total


@routine
def along_step(reduced: FreeMotions, c: int, step: Floats) -> float:
    """Change of limit c by a step of the unknowns that meets the equations."""
    total = 0.0
    for a in range(reduced.linear.totals[0]["motions"]):
        total += reduced.linear.G[c, a] * step[reduced.free[a]]
    return total


@routine
def put_step(x: Floats, reduced: FreeMotions, step: Floats) -> None:
    """Fill a step of the unknowns: one of the free motions plus the one that meets the equations."""
    basis, pivots, free, totals = reduced.basis, reduced.pivots, reduced.free, reduced.linear.totals[0]
    for j in range(step.shape[0]):
        step[j] = 0.0
    for a in range(totals["motions"]):
        step[free[a]] = x[a]
    for r in range(totals["rank"]):
        p = pivots[r]
        step[p] = reduced.shift[p]
        for a in range(totals["motions"]):
            step[p] += basis[p, a] * x[a]


@routine
def add_limit(k: int, h: float, number: int, slope: Floats, reduced: FreeMotions) -> int:
    """Add a limit by its excess, its number and its derivative by the unknowns; the number of limits then."""
    linear = reduced.linear
    linear.drift[k] = along_shift(slope, reduced)
    project(slope, reduced, linear.G[k])
    linear.h[k], linear.which[k] = h, number
    return k + 1


@routine
def restoring_step(reduced: FreeMotions, by_all: bool, p: QP) -> bool:
    """Fill `p.x` with the shortest step of the free motions within all limits, to be added to `shift`; False if none.

    Shortest by itself or, if `by_all`, in sum with `shift`: equations are then met by all unknowns, not by pivots
    alone.
    """
    linear = reduced.linear
    motions, k = linear.totals[0]["motions"], linear.totals[0]["limits"]
    for a in range(motions):
        p.g[a] = 0.0
    if by_all:
        project(reduced.shift, reduced, p.g)
    for c in range(k):
        p.h[c] = linear.h[c] + linear.drift[c]
        for a in range(motions):
            p.G[c, a] = linear.G[c, a]
    return factorise(linear.metric, motions, 0.0, p.factor) and solve_qp(p, motions, k)
