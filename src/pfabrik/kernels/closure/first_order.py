"""How configurations of closed loops move to first order: Jacobians, and how near they are to singularities.

On the motions that the loops allow, T gives the twist of the end effector and A the rates of the actuators. The left
singular vectors of [T; A] are pairs (twist, rates) that the mechanism can do. The same orthogonal rotations of pairs
that make their rates orthogonal give the forward Jacobian, those that make their twists orthogonal the inverse one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats
from .._jit import opener, routine, search
from ..quaternions import turn_ball
from .loops import BALL, CONSTRAINT, PARALLEL, PASSIVE, SERIAL, FirstOrder, FirstOrderPlan, Loops
from .path_kinematics import LAYOUT, LOOPS, Equations, State, end_path, new_equations, new_state, open_loops, walk_path

SWEEPS = 40
"""Most sweeps of rotations: they take four to eight."""

ORTHOGONAL, NEARLY = 1e-14, 1e-8
"""Cosine of two rows that count as orthogonal, and cosines that one sweep brings there: it squares them."""


class FirstOrderScratch(NamedTuple):
    """Scratch memory of one thread."""

    state: State
    eq: Equations
    screws: Floats  # (columns, 6)
    table: Floats  # (conditions + width, columns): what the loops ask, and below it twists and rates, of every column
    motions: Floats  # (motions, width): the twists and rates that the loops allow
    pairs: Floats  # (shown, width)
    conditions: Floats  # (rank, conditions)
    sizes: Floats  # (columns,)


def new_first_order_scratch(loops: Loops, plan: FirstOrderPlan) -> FirstOrderScratch:
    """Scratch memory of one thread."""
    n, m, width = len(loops.lo), 6 * plan.loops.shape[0], plan.twists + plan.actuated.shape[0]
    return FirstOrderScratch(
        new_state(loops),
        new_equations(loops, LAYOUT),
        np.zeros((n, 6)),
        np.zeros((m + width, n)),
        np.zeros((n - plan.rank, width)),
        np.zeros((plan.shown, width)),
        np.zeros((plan.rank, m)),
        np.zeros(n),
    )


PLAN = FirstOrderPlan(np.zeros((0, 0)), np.zeros(0), np.zeros((0, 0)), np.zeros(0, np.int64), 0, 0, 0, 0, 0.0, 0)
"""A plan of the types that kernels are compiled for."""

open_scratch = opener(new_first_order_scratch(LOOPS, PLAN))


@search
def first_order(
    machine: int, scratch_address: int, plan: FirstOrderPlan, coordinates: Floats, found: FirstOrder
) -> None:
    """Fill what is told of dimensionless joint coordinates (n, columns); NaN where these are not numbers.

    Parameters
    ----------
    machine, scratch : see `open_loops` and `new_first_order_scratch`.
    """
    loops, scratch = open_loops(machine), open_scratch(scratch_address)
    state, eq, screws, table = scratch.state, scratch.eq, scratch.screws, scratch.table
    motions, pairs, conditions, sizes = scratch.motions, scratch.pairs, scratch.conditions, scratch.sizes
    n, m, shown = coordinates.shape[1], 6 * plan.loops.shape[0], plan.shown
    width = plan.twists + plan.actuated.shape[0]
    for row in range(coordinates.shape[0]):
        if not load_coordinates(loops, coordinates[row], state):
            blank(found, row)
            continue
        put_screws(loops, plan, state, eq, screws)
        lay_out_motions(plan, screws, table)
        triangularise(table, m, plan.rank)
        measures = found.measures[row]
        measures[SERIAL] = measures[PARALLEL] = measures[CONSTRAINT] = measures[PASSIVE] = math.inf
        for k in range(plan.rank if plan.asks_constraint == 1 else 0):
            for i in range(m):
                conditions[k, i] = table[i, k] if i >= k else 0.0
        if plan.asks_constraint == 1 and plan.rank > 0:
            rotate_apart(conditions, 0, m, sizes)
            measures[CONSTRAINT] = sizes[plan.rank - 1]
        for k in range(n - plan.rank):
            for i in range(width):
                motions[k, i] = table[m + i, plan.rank + k]
        rotate_apart(motions, 0, width, sizes)
        for k in range(shown):
            measures[PASSIVE] = sizes[k]
            for i in range(width):
                pairs[k, i] = motions[k, i] / sizes[k] if sizes[k] > plan.least else 0.0
        rotate_apart(pairs, plan.twists, width, sizes)
        put_map(pairs, plan.twists, width, 0, plan.twists, shown, plan.least, sizes, found.forward[row])
        k = least_ratio(pairs, 0, plan.twists, shown, plan.least, sizes)
        for i in range(plan.twists):
            found.gained[row, i] = pairs[k, i] if k >= 0 else math.nan
        measures[PARALLEL] = ratio(pairs, k, 0, plan.twists, sizes)
        rotate_apart(pairs, 0, plan.twists, sizes)
        put_map(pairs, 0, plan.twists, plan.twists, width, plan.freedoms, plan.least, sizes, found.inverse[row])
        k = least_ratio(pairs, plan.twists, width, plan.freedoms, plan.least, sizes)
        for i in range(plan.twists):
            found.lost[row, i] = pairs[k, i] if k >= 0 else math.nan
        measures[SERIAL] = ratio(pairs, k, plan.twists, width, sizes)


@routine
def load_coordinates(loops: Loops, coordinates: Floats, state: State) -> bool:
    """A configuration from its coordinates; False where they are no numbers."""
    for j in range(len(state.q)):
        state.q[j] = coordinates[j]
        if coordinates[j] != coordinates[j]:
            return False
    for k in range(len(loops.kinds)):
        if loops.kinds[k] == BALL:
            j = loops.columns[k]
            state.balls[k, 0] = 1.0
            state.balls[k, 1] = state.balls[k, 2] = state.balls[k, 3] = 0.0
            turn_ball(state.balls[k], state.q[j], state.q[j + 1], state.q[j + 2])
    return True


@routine
def blank(found: FirstOrder, row: int) -> None:
    """Nothing is told of a row."""
    for i in range(found.forward.shape[1]):
        found.lost[row, i] = found.gained[row, i] = math.nan
        for j in range(found.forward.shape[2]):
            found.forward[row, i, j] = found.inverse[row, j, i] = math.nan
    for i in range(4):
        found.measures[row, i] = math.nan


@routine
def put_screws(loops: Loops, plan: FirstOrderPlan, state: State, eq: Equations, screws: Floats) -> None:
    """Present screws of orthonormal joint rates: velocity of the reference point, angular velocity."""
    for j in range(screws.shape[0]):
        for i in range(6):
            screws[j, i] = 0.0  # what is on no path moves neither a loop nor the end effector
    for path in range(len(loops.paths) - 1):
        last = loops.paths[path + 1]
        walk_path(loops, path, last, state, eq)
        end_path(loops, path, last, loops.end, eq)
        for visit in range(loops.paths[path], last):
            sign = float(loops.visits[visit, 1])
            for r in range(loops.visit_rows[visit], loops.visit_rows[visit + 1]):
                for i in range(6):
                    screws[loops.row_columns[r], i] = sign * eq.rows[r, i]
    for j in range(screws.shape[0] - 1, 0, -1):
        if plan.rates[j, j - 1] != 0.0:
            for i in range(6):
                screws[j, i] = plan.rates[j, j] * screws[j, i] + plan.rates[j, j - 1] * screws[j - 1, i]


@routine
def lay_out_motions(plan: FirstOrderPlan, screws: Floats, table: Floats) -> None:
    """By joint rates: the loops' conditions, then the twist of the end effector, then the rates of the actuators."""
    m = 6 * plan.loops.shape[0]
    for j in range(screws.shape[0]):
        for k in range(plan.loops.shape[0]):
            for i in range(6):
                table[6 * k + i, j] = plan.loops[k, j] * screws[j, i]
        for i in range(plan.twists):
            table[m + i, j] = plan.way[j] * screws[j, i]
        for i in range(plan.actuated.shape[0]):
            table[m + plan.twists + i, j] = 1.0 if plan.actuated[i] == j else 0.0


@routine
def triangularise(table: Floats, m: int, rank: int) -> None:
    """Reflect the columns so that the first m rows, the largest first, become triangular; `rank` columns of them.

    In the columns behind, which are motions that these rows allow, stand the others.
    """
    rows, n = table.shape
    for k in range(rank):
        largest, pivot = -1.0, k
        for i in range(k, m):
            size = 0.0
            for j in range(k, n):
                size += table[i, j] * table[i, j]
            if size > largest:
                largest, pivot = size, i
        for j in range(n):
            table[k, j], table[pivot, j] = table[pivot, j], table[k, j]
        size = -math.copysign(math.sqrt(largest), table[k, k])
        # the reflector is the row itself, its first entry less the size
        table[k, k] -= size
        norm = -size * table[k, k]
        if norm > 0.0:
            for i in range(k + 1, rows):
                share = 0.0
                for j in range(k, n):
                    share += table[i, j] * table[k, j]
                share /= norm
                if share != 0.0:
                    for j in range(k, n):
                        table[i, j] -= share * table[k, j]
        for j in range(k, n):
            table[k, j] = size if j == k else 0.0


@routine
def rotate_apart(table: Floats, first: int, last: int, sizes: Floats) -> None:
    """Rotate rows until they are orthogonal in the columns from `first` to `last`, the largest first; their sizes.

    One-sided Jacobi: the other columns go along.
    """
    n, width = table.shape
    for _ in range(SWEEPS):
        worst = 0.0
        for a in range(n - 1):
            for b in range(a + 1, n):
                aa = bb = ab = 0.0
                for i in range(first, last):
                    x, y = table[a, i], table[b, i]
                    aa += x * x
                    bb += y * y
                    ab += x * y
                cosine = abs(ab) / math.sqrt(aa * bb) if aa * bb > 0.0 else 0.0
                if aa < bb or cosine > ORTHOGONAL:
                    c, s = rotation_between(aa, bb, ab, cosine)
                    for i in range(width):
                        x, y = table[a, i], table[b, i]
                        table[a, i], table[b, i] = c * x + s * y, c * y - s * x
                    # two that change places miss some of the other pairs of this sweep
                    worst = max(worst, 1.0 if aa < bb else cosine)
        if worst <= NEARLY:
            break
    for a in range(n):
        size = 0.0
        for i in range(first, last):
            size += table[a, i] * table[a, i]
        sizes[a] = math.sqrt(size)


@routine
def rotation_between(aa: float, bb: float, ab: float, cosine: float) -> tuple[float, float]:
    """Cosine and sine of the rotation that makes two rows orthogonal, the larger first."""
    if cosine <= ORTHOGONAL:
        return 0.0, 1.0
    angle = 0.5 * math.atan2(2.0 * ab, aa - bb)
    return math.cos(angle), math.sin(angle)


@routine
def put_map(
    pairs: Floats, first: int, last: int, to: int, end: int, most: int, least: float, sizes: Floats, found: Floats
) -> None:
    """The map from the columns first ... last of pairs, orthogonal there, to the columns to ... end: (to, from)."""
    for i in range(end - to):
        for j in range(last - first):
            found[i, j] = 0.0
            for k in range(min(most, pairs.shape[0])):
                if sizes[k] > least:
                    found[i, j] += pairs[k, to + i] * pairs[k, first + j] / (sizes[k] * sizes[k])


@routine
def ratio(pairs: Floats, k: int, first: int, last: int, sizes: Floats) -> float:
    """Size of a pair where it was made orthogonal, by that of its other columns, first ... last; infinite for none."""
    return sizes[k] / size_of(pairs, k, first, last) if k >= 0 else math.inf


@routine
def size_of(pairs: Floats, k: int, first: int, last: int) -> float:
    size = 0.0
    for i in range(first, last):
        size += pairs[k, i] * pairs[k, i]
    return math.sqrt(size)


@routine
def least_ratio(pairs: Floats, first: int, last: int, most: int, least: float, sizes: Floats) -> int:
    """Which of the first pairs has the least ratio; -1 where none has one."""
    best, found = math.inf, -1
    for k in range(min(most, pairs.shape[0])):
        other = size_of(pairs, k, first, last)
        if other > least and sizes[k] / other < best:
            best, found = sizes[k] / other, k
    return found
