"""Joint rates, Jacobians and singularity measures of closed loops, to first order.

Let C be the conditions of the loops by joint rates, N an orthonormal basis of the null space of C, T the twist of the
end effector and A the rates of the actuators. The left singular vectors of [T N; A N] are feasible pairs (twist,
actuator rates). A table row holds a pair with its joint rates, or a condition with the joint rates that resist it.
Orthogonal rotations make the rows orthogonal in some columns; the linear map from these columns to others is then a sum
over the rows. From actuator rates to twists it is the forward Jacobian, to joint rates J; from twists to actuator rates
the inverse Jacobian; from conditions to joint rates G = C+, the least joint rates.

    Actuator rates e, loops closed            joint rates J e
    Geometry that opens the loops by b        joint rates -(1 - J A) G b, actuators locked
    Wrenches that do work h with joint rates  actuator forces t = -J' h, loop wrenches -G' (h + A' t)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from .._jit import opener, routine, search
from ..quaternions import turn_ball
from .loops import BALL, CONSTRAINT, JOINTS, MEASURES, PARALLEL, PASSIVE, SERIAL, FirstOrder, FirstOrderPlan, Loops
from .path_kinematics import LAYOUT, LOOPS, Equations, State, end_path, new_equations, new_state, open_loops, walk_path

SWEEPS = 40
"""Most sweeps of rotations; four to eight are usual."""

ORTHOGONAL, NEARLY = 1e-14, 1e-8
"""Largest cosine of two orthogonal rows, and largest cosine before a last sweep: a sweep squares cosines."""

REGULAR, ENOUGH = 1e-3, 0.5
"""Least remainder of a regular row after projections are subtracted [L or rad]; share of a row that must remain for one
subtraction to be enough."""

SHOWS = 1e-6
"""Least twist of a motion that counts as gained [L or rad]."""


class FirstOrderScratch(NamedTuple):
    """Scratch memory of one thread; the width is that of the twist, the actuators and, if requested, all joints."""

    state: State
    eq: Equations
    screws: Floats  # (columns, 6)
    table: Floats  # (conditions + width, columns): conditions of the loops, below them the rates of every column
    motions: Floats  # (motions, width): rates of the motions that the loops allow
    pairs: Floats  # (shown, width)
    conditions: Floats  # (rank, conditions)
    resisted: Floats  # (rank, conditions + width)
    across: Floats  # (directions, motions + twists)
    sizes: Floats  # (columns,), or (directions,) if these are more


def new_first_order_scratch(loops: Loops, plan: FirstOrderPlan) -> FirstOrderScratch:
    """Scratch memory of one thread."""
    n, m, (twists, directions) = len(loops.lo), 6 * plan.loops.shape[0], plan.directions.shape
    width = twists + len(plan.actuated) + (n if plan.outputs == JOINTS else 0)
    shapes = (
        (n, 6),
        (m + width, n),
        (n - plan.rank, width),
        (plan.shown, width),
        (plan.rank, m),
        (plan.rank, m + width),
        (directions, n - plan.rank + twists),
        (max(n, directions),),
    )
    return FirstOrderScratch(new_state(loops), new_equations(loops, LAYOUT), *(np.zeros(shape) for shape in shapes))


NONE = np.zeros((0, 0))
PLAN = FirstOrderPlan(NONE, np.zeros(0), NONE, np.zeros(0, np.int64), NONE, 0, 0, 0, 0.0, 0.0, 0)
"""Plan whose types the kernels are compiled for."""

open_scratch = opener(new_first_order_scratch(LOOPS, PLAN))


@search
def rates(machine: int, scratch_address: int, plan: FirstOrderPlan, coordinates: Floats, results: FirstOrder) -> None:
    """Fill the requested outputs at dimensionless joint coordinates (n, columns); rows with NaN are skipped.

    Parameters
    ----------
    machine, scratch : see `open_loops` and `new_first_order_scratch`.
    """
    loops, scratch = open_loops(machine), open_scratch(scratch_address)
    table, motions, pairs, sizes = scratch.table, scratch.motions, scratch.pairs, scratch.sizes
    m, twists = 6 * plan.loops.shape[0], plan.directions.shape[0]
    pair_width = twists + plan.actuated.shape[0]
    for row in range(coordinates.shape[0]):
        if not load_coordinates(loops, coordinates[row], scratch.state):
            continue
        fill_screws(loops, plan, scratch.state, scratch.eq, scratch.screws)
        fill_table(plan, scratch.screws, table)
        triangularise(table, m, plan.rank)
        copy_columns(table, m, plan.rank, motions)
        orthogonalise_rows(motions, 0, pair_width, sizes)
        for k in range(pairs.shape[0]):
            for i in range(pairs.shape[1]):
                pairs[k, i] = motions[k, i] / sizes[k] if sizes[k] > plan.least else 0.0
        if plan.outputs == JOINTS:
            fill_joint_rates(plan, scratch, pair_width, row, results)
            continue
        measures, shown = results.measures[row], pairs.shape[0]
        measures[CONSTRAINT], measures[PASSIVE] = math.inf, sizes[shown - 1] if shown > 0 else math.inf
        orthogonalise_rows(pairs, twists, pair_width, sizes)
        fill_map(pairs, twists, 0, shown, plan.least, sizes, results.forward[row])
        k = index_of_least_ratio(pairs, 0, twists, shown, plan.least, sizes)
        copy_twist(pairs, k, 0, results.gained[row])
        measures[PARALLEL] = sizes[k] / row_norm(pairs, k, 0, twists) if k >= 0 else math.inf
        orthogonalise_rows(pairs, 0, twists, sizes)
        fill_map(pairs, 0, twists, plan.freedoms, plan.least, sizes, results.inverse[row])
        k = index_of_least_ratio(pairs, twists, pair_width, plan.freedoms, plan.least, sizes)
        copy_twist(pairs, k, 0, results.lost[row])
        measures[SERIAL] = sizes[k] / row_norm(pairs, k, twists, pair_width) if k >= 0 else math.inf
        if plan.outputs == MEASURES:
            if plan.rank > 0:
                copy_columns(table, 0, 0, scratch.conditions)
                orthogonalise_rows(scratch.conditions, 0, m, sizes)
                measures[CONSTRAINT] = sizes[plan.rank - 1]
            if min(measures[SERIAL], measures[PASSIVE]) < plan.singular and plan.freedoms > 0:
                fill_lost(plan, scratch, k, measures, results.lost[row])
            if measures[CONSTRAINT] < min(measures[PARALLEL], plan.singular):
                fill_gained(scratch, m, results.forward[row], results.gained[row])


@routine
def fill_joint_rates(
    plan: FirstOrderPlan, scratch: FirstOrderScratch, pair_width: int, row: int, results: FirstOrder
) -> None:
    """Fill joint rates; the motions are orthogonal, those with the largest twists and actuator rates first."""
    motions, pairs, resisted, sizes = scratch.motions, scratch.pairs, scratch.resisted, scratch.sizes
    n, m, largest = scratch.screws.shape[0], 6 * plan.loops.shape[0], 0.0
    for j in range(n):
        for i in range(6):
            results.screws[row, j, i] = scratch.screws[j, i]
        for k in range(motions.shape[0]):
            results.motions[row, j, k], results.sizes[row, k] = motions[k, pair_width + j], sizes[k]
    orthogonalise_rows(pairs, plan.directions.shape[0], pair_width, sizes)
    fill_map(pairs, plan.directions.shape[0], pair_width, pairs.shape[0], plan.least, sizes, results.joints[row])
    results.measures[row, CONSTRAINT] = math.inf
    fill_resisted(plan, scratch, pair_width)
    is_regular = orthonormalise_rows(resisted, 0, m)
    for k in range(plan.rank):
        sizes[k] = 1.0
        largest += row_norm(resisted, k, m + pair_width, m + pair_width + n) ** 2
    if not (is_regular and largest * plan.singular**2 < 1.0):
        fill_resisted(plan, scratch, pair_width)
        orthogonalise_rows(resisted, 0, m, sizes)
        results.measures[row, CONSTRAINT] = sizes[plan.rank - 1]
    fill_map(resisted, 0, m + pair_width, plan.rank, plan.least, sizes, results.closing[row])


@routine
def fill_resisted(plan: FirstOrderPlan, scratch: FirstOrderScratch, pair_width: int) -> None:
    """Fill the orthonormal motions that the loops resist, with their conditions in the order of the loops."""
    table, resisted, m = scratch.table, scratch.resisted, 6 * plan.loops.shape[0]
    copy_columns(table, 0, 0, resisted)
    for k in range(plan.rank):
        for i in range(m):
            resisted[k, i] = 0.0
        for loop in range(plan.loops.shape[0]):
            for j in range(scratch.screws.shape[0]):
                share = plan.loops[loop, j] * table[m + pair_width + j, k]
                for i in range(6 if share != 0.0 else 0):
                    resisted[k, 6 * loop + i] += share * scratch.screws[j, i]


@routine
def fill_lost(plan: FirstOrderPlan, scratch: FirstOrderScratch, place: int, measures: Floats, lost: Floats) -> None:
    """Fill the lost twist: of pair number `place`, or, at a passive singularity, of the motion with the least rates."""
    is_passive, across = measures[PASSIVE] < min(measures[SERIAL], plan.singular), scratch.across
    rows = scratch.motions if is_passive else scratch.pairs
    n = rows.shape[0]
    for k in range(across.shape[0]):
        for j in range(across.shape[1]):
            across[k, j] = 0.0
        for i in range(len(lost)):
            across[k, across.shape[1] - len(lost) + i] = plan.directions[i, k]
            for j in range(n):
                across[k, j] += plan.directions[i, k] * rows[j, i]
    orthogonalise_rows(across, 0, n, scratch.sizes)
    copy_twist(across, plan.freedoms - 1 if is_passive else place, across.shape[1] - len(lost), lost)


@routine
def fill_gained(scratch: FirstOrderScratch, m: int, forward: Floats, gained: Floats) -> None:
    """Fill the gained twist: of the motion that the loops resist least at locked actuators, if it has one."""
    resisted, twists = scratch.resisted, len(gained)
    rank, size = resisted.shape[0], 0.0
    copy_columns(scratch.table, 0, 0, resisted)
    orthogonalise_rows(resisted, 0, m, scratch.sizes)
    for i in range(twists):
        for j in range(forward.shape[1]):
            resisted[rank - 1, m + i] -= forward[i, j] * resisted[rank - 1, m + twists + j]
        size += resisted[rank - 1, m + i] ** 2
    if math.sqrt(size) > SHOWS:
        copy_twist(resisted, rank - 1, m, gained)


@routine
def copy_twist(rows: Floats, k: int, first: int, twist: Floats) -> None:
    """Copy a twist from columns of row `k`; NaN if k is -1."""
    for i in range(len(twist)):
        twist[i] = rows[k, first + i] if k >= 0 else math.nan


@routine
def copy_columns(table: Floats, first: int, column: int, rows: Floats) -> None:
    """Copy columns of a table to rows, from row `first` and column `column` on."""
    for k in range(rows.shape[0]):
        for i in range(rows.shape[1]):
            rows[k, i] = table[first + i, column + k]


@routine
def load_coordinates(loops: Loops, coordinates: Floats, state: State) -> bool:
    """Load joint coordinates; False if one is NaN."""
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
def fill_screws(loops: Loops, plan: FirstOrderPlan, state: State, eq: Equations, screws: Floats) -> None:
    """Fill the present screws of orthonormal joint rates: velocity of the reference point, angular velocity."""
    for j in range(screws.shape[0]):
        for i in range(6):
            screws[j, i] = 0.0  # a joint on no path moves neither a loop nor the end effector
    for path in range(len(loops.paths) - 1):
        last = loops.paths[path + 1]
        walk_path(loops, path, last, state, eq)
        for visit in range(loops.paths[path], last):
            if loops.kinds[loops.visits[visit, 0]] == BALL:  # its rates are about the base's axes
                for j in range(3):
                    for i in range(3):
                        eq.rows[loops.visit_rows[visit] + j, 3 + i] = float(loops.visits[visit, 1]) if i == j else 0.0
        end_path(loops, path, last, loops.end, eq)
        for visit in range(loops.paths[path], last):
            sign = float(loops.visits[visit, 1])
            for r in range(loops.visit_rows[visit], loops.visit_rows[visit + 1]):
                for i in range(6):
                    screws[loops.row_columns[r], i] = sign * eq.rows[r, i]
    for j in range(screws.shape[0] - 1, -1, -1):
        for i in range(6):
            screws[j, i] *= plan.rates[j, j]
            if j > 0 and plan.rates[j, j - 1] != 0.0:
                screws[j, i] += plan.rates[j, j - 1] * screws[j - 1, i]


@routine
def fill_table(plan: FirstOrderPlan, screws: Floats, table: Floats) -> None:
    """Fill the table by joint rates: conditions of loops, twist, actuator rates and, if requested, all joint rates."""
    m, twists = 6 * plan.loops.shape[0], plan.directions.shape[0]
    joint_rows = m + twists + plan.actuated.shape[0]
    for j in range(screws.shape[0]):
        for k in range(plan.loops.shape[0]):
            for i in range(6):
                table[6 * k + i, j] = plan.loops[k, j] * screws[j, i]
        for i in range(twists):
            table[m + i, j] = plan.path[j] * screws[j, i]
        for i in range(plan.actuated.shape[0]):
            table[m + twists + i, j] = 1.0 if plan.actuated[i] == j else 0.0
        for i in range(joint_rows, table.shape[0]):
            table[i, j] = 1.0 if i - joint_rows == j else 0.0


@routine
def triangularise(table: Floats, m: int, rank: int) -> None:
    """Make the first m rows lower triangular by Householder reflections of columns, the largest row first.

    The first `rank` columns then span the motions that these rows resist, the others the motions that they allow.
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
def orthogonalise_rows(table: Floats, first: int, last: int, sizes: Floats) -> None:
    """Rotate rows until they are orthogonal in the columns from `first` to `last`, the largest first; fill their norms.

    One-sided Jacobi rotations, applied to all columns.
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
                    # rows that are swapped miss some other pairs of this sweep
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
    """Cosine and sine of the rotation that makes two rows orthogonal, with the larger first."""
    if cosine <= ORTHOGONAL:
        return 0.0, 1.0
    angle = 0.5 * math.atan2(2.0 * ab, aa - bb)
    return math.cos(angle), math.sin(angle)


@routine
def fill_map(pairs: Floats, first: int, to: int, most: int, least: float, sizes: Floats, out: Floats) -> None:
    """Fill the linear map from the columns at `first`, in which rows are orthogonal, to those at `to`: (to, from)."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = 0.0
    for k in range(min(most, pairs.shape[0])):
        for i in range(out.shape[0] if sizes[k] > least else 0):
            share = pairs[k, to + i] / (sizes[k] * sizes[k])
            for j in range(out.shape[1]):
                out[i, j] += share * pairs[k, first + j]


@routine
def row_norm(pairs: Floats, k: int, first: int, last: int) -> float:
    """Norm of row `k` in the columns from `first` to `last`."""
    size = 0.0
    for i in range(first, last):
        size += pairs[k, i] * pairs[k, i]
    return math.sqrt(size)


@routine
def index_of_least_ratio(pairs: Floats, first: int, last: int, most: int, least: float, sizes: Floats) -> int:
    """Index of the pair with the least ratio of `sizes` to its norm in other columns; -1 if there is none."""
    best, index = math.inf, -1
    for k in range(min(most, pairs.shape[0])):
        other = row_norm(pairs, k, first, last)
        if other > least and sizes[k] / other < best:
            best, index = sizes[k] / other, k
    return index


@routine
def orthonormalise_rows(rows: Floats, first: int, last: int) -> bool:
    """Make rows orthonormal in the columns from `first` to `last` by Gram-Schmidt steps, applied to all columns.

    False if a row nearly depends on those before it.
    """
    for k in range(rows.shape[0]):
        size = subtract_projections(rows, k, first, last)
        if not size > REGULAR:
            return False
        for i in range(rows.shape[1]):
            rows[k, i] /= size
    return True


@routine
def subtract_projections(rows: Floats, k: int, first: int, last: int) -> float:
    """Subtract the projections of row `k` on the rows before it, orthonormal there; return the remaining norm."""
    size = row_norm(rows, k, first, last)
    for _ in range(2):  # a small remainder is not orthogonal yet
        before = size
        for j in range(k):
            share = 0.0
            for i in range(first, last):
                share += rows[j, i] * rows[k, i]
            for i in range(rows.shape[1]):
                rows[k, i] -= share * rows[j, i]
        size = row_norm(rows, k, first, last)
        if size > ENOUGH * before:
            break
    return size
