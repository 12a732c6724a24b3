"""How configurations of closed loops move to first order: joint rates, Jacobians, and how near singularities are.

With C the conditions of the loops by joint rates, N an orthonormal basis of the motions that they allow, T the twist
of the end effector and A the rates of the actuators: the left singular vectors of [T N; A N] are pairs (twist, rates)
that the mechanism can do. Rows of columns that belong together, a pair with its joint rates, or a condition with the
joint rates that resist it, are turned by orthogonal rotations until they are orthogonal in some of their columns: the
map from these to others is then a sum over the rows. From rates to twists it is the forward Jacobian, to joint rates J;
from twists to rates the inverse one; from conditions to joint rates G = C+, the least that open the loops so.

    Actuators e, of loops that stay closed    joint rates J e
    Geometry that opens the loops by b        joint rates -(1 - J A) G b at actuators that rest
    Wrenches that do work h with joint rates  actuators t = -J' h, and loops transmit -G' (h + A' t)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Floats
from .._jit import opener, routine, search
from ..quaternions import turn_ball
from .loops import BALL, CONSTRAINT, JOINTS, MEASURES, PARALLEL, PASSIVE, SERIAL, FirstOrder, FirstOrderPlan, Loops
from .path_kinematics import LAYOUT, LOOPS, Equations, State, end_path, new_equations, new_state, open_loops, walk_path

SWEEPS = 40
"""Most sweeps of rotations: they take four to eight."""

ORTHOGONAL, NEARLY = 1e-14, 1e-8
"""Cosine of two rows that count as orthogonal, and cosines that one sweep brings there: it squares them."""

REGULAR, ENOUGH = 1e-3, 0.5
"""What has to be left of a row beside others for one pass to make them orthogonal [L or rad], and share from which one
subtraction is enough."""

SHOWS = 1e-6
"""Twist from which a motion that the loops hold back least is said to be gained [L or rad]."""


class FirstOrderScratch(NamedTuple):
    """Scratch memory of one thread; a width for the twist, the actuators and, where asked for, all joints."""

    state: State
    eq: Equations
    screws: Floats  # (columns, 6)
    table: Floats  # (conditions + width, columns): what the loops ask, and below it what every column does
    motions: Floats  # (motions, width): what the motions do that the loops allow
    pairs: Floats  # (shown, width)
    conditions: Floats  # (rank, conditions)
    resisted: Floats  # (rank, conditions + width)
    across: Floats  # (directions, motions + twists)
    sizes: Floats  # (columns,), or of the directions where these are more


def new_first_order_scratch(loops: Loops, plan: FirstOrderPlan) -> FirstOrderScratch:
    """Scratch memory of one thread."""
    n, m, (twists, directions) = len(loops.lo), 6 * plan.loops.shape[0], plan.directions.shape
    width = twists + len(plan.actuated) + (n if plan.asks == JOINTS else 0)
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
"""A plan of the types that kernels are compiled for."""

open_scratch = opener(new_first_order_scratch(LOOPS, PLAN))


@search
def rates(machine: int, scratch_address: int, plan: FirstOrderPlan, coordinates: Floats, found: FirstOrder) -> None:
    """Fill what is asked of dimensionless joint coordinates (n, columns); rows that are no numbers stay as they are.

    Parameters
    ----------
    machine, scratch : see `open_loops` and `new_first_order_scratch`.
    """
    loops, scratch = open_loops(machine), open_scratch(scratch_address)
    table, motions, pairs, sizes = scratch.table, scratch.motions, scratch.pairs, scratch.sizes
    m, twists = 6 * plan.loops.shape[0], plan.directions.shape[0]
    seen = twists + plan.actuated.shape[0]
    for row in range(coordinates.shape[0]):
        if not load_coordinates(loops, coordinates[row], scratch.state):
            continue
        put_screws(loops, plan, scratch.state, scratch.eq, scratch.screws)
        lay_out_motions(plan, scratch.screws, table)
        triangularise(table, m, plan.rank)
        put_columns(table, m, plan.rank, motions)
        rotate_apart(motions, 0, seen, sizes)
        for k in range(pairs.shape[0]):
            for i in range(pairs.shape[1]):
                pairs[k, i] = motions[k, i] / sizes[k] if sizes[k] > plan.least else 0.0
        if plan.asks == JOINTS:
            put_joint_rates(plan, scratch, seen, row, found)
            continue
        measures, shown = found.measures[row], pairs.shape[0]
        measures[CONSTRAINT], measures[PASSIVE] = math.inf, sizes[shown - 1] if shown > 0 else math.inf
        rotate_apart(pairs, twists, seen, sizes)
        put_map(pairs, twists, 0, shown, plan.least, sizes, found.forward[row])
        k = least_ratio(pairs, 0, twists, shown, plan.least, sizes)
        copy_twist(pairs, k, 0, found.gained[row])
        measures[PARALLEL] = sizes[k] / size_of(pairs, k, 0, twists) if k >= 0 else math.inf
        rotate_apart(pairs, 0, twists, sizes)
        put_map(pairs, 0, twists, plan.freedoms, plan.least, sizes, found.inverse[row])
        k = least_ratio(pairs, twists, seen, plan.freedoms, plan.least, sizes)
        copy_twist(pairs, k, 0, found.lost[row])
        measures[SERIAL] = sizes[k] / size_of(pairs, k, twists, seen) if k >= 0 else math.inf
        if plan.asks == MEASURES:
            if plan.rank > 0:
                put_columns(table, 0, 0, scratch.conditions)
                rotate_apart(scratch.conditions, 0, m, sizes)
                measures[CONSTRAINT] = sizes[plan.rank - 1]
            if min(measures[SERIAL], measures[PASSIVE]) < plan.singular and plan.freedoms > 0:
                put_lost(plan, scratch, k, measures, found.lost[row])
            if measures[CONSTRAINT] < min(measures[PARALLEL], plan.singular):
                put_gained(scratch, m, found.forward[row], found.gained[row])


@routine
def put_joint_rates(plan: FirstOrderPlan, scratch: FirstOrderScratch, seen: int, row: int, found: FirstOrder) -> None:
    """Fill joint rates from motions that are turned so that those that show most are first."""
    motions, pairs, resisted, sizes = scratch.motions, scratch.pairs, scratch.resisted, scratch.sizes
    n, m, largest = scratch.screws.shape[0], 6 * plan.loops.shape[0], 0.0
    for j in range(n):
        for i in range(6):
            found.screws[row, j, i] = scratch.screws[j, i]
        for k in range(motions.shape[0]):
            found.motions[row, j, k], found.sizes[row, k] = motions[k, seen + j], sizes[k]
    rotate_apart(pairs, plan.directions.shape[0], seen, sizes)
    put_map(pairs, plan.directions.shape[0], seen, pairs.shape[0], plan.least, sizes, found.joints[row])
    found.measures[row, CONSTRAINT] = math.inf
    put_resisted(plan, scratch, seen)
    is_regular = orthogonalise(resisted, 0, m)
    for k in range(plan.rank):
        sizes[k] = 1.0
        largest += size_of(resisted, k, m + seen, m + seen + n) ** 2
    if not (is_regular and largest * plan.singular**2 < 1.0):
        put_resisted(plan, scratch, seen)
        rotate_apart(resisted, 0, m, sizes)
        found.measures[row, CONSTRAINT] = sizes[plan.rank - 1]
    put_map(resisted, 0, m + seen, plan.rank, plan.least, sizes, found.closing[row])


@routine
def put_resisted(plan: FirstOrderPlan, scratch: FirstOrderScratch, seen: int) -> None:
    """Fill orthonormal motions that loops resist, by how much; the conditions in the order of the loops."""
    table, resisted, m = scratch.table, scratch.resisted, 6 * plan.loops.shape[0]
    put_columns(table, 0, 0, resisted)
    for k in range(plan.rank):
        for i in range(m):
            resisted[k, i] = 0.0
        for loop in range(plan.loops.shape[0]):
            for j in range(scratch.screws.shape[0]):
                share = plan.loops[loop, j] * table[m + seen + j, k]
                for i in range(6 if share != 0.0 else 0):
                    resisted[k, 6 * loop + i] += share * scratch.screws[j, i]


@routine
def put_lost(plan: FirstOrderPlan, scratch: FirstOrderScratch, place: int, measures: Floats, lost: Floats) -> None:
    """Fill the twist that is lost: of pairs that at a place, of all motions the one that they show least of."""
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
    rotate_apart(across, 0, n, scratch.sizes)
    copy_twist(across, plan.freedoms - 1 if is_passive else place, across.shape[1] - len(lost), lost)


@routine
def put_gained(scratch: FirstOrderScratch, m: int, forward: Floats, gained: Floats) -> None:
    """Fill the twist of the motion that the loops hold back least, at locked actuators, where it shows."""
    resisted, twists = scratch.resisted, len(gained)
    rank, size = resisted.shape[0], 0.0
    put_columns(scratch.table, 0, 0, resisted)
    rotate_apart(resisted, 0, m, scratch.sizes)
    for i in range(twists):
        for j in range(forward.shape[1]):
            resisted[rank - 1, m + i] -= forward[i, j] * resisted[rank - 1, m + twists + j]
        size += resisted[rank - 1, m + i] ** 2
    if math.sqrt(size) > SHOWS:
        copy_twist(resisted, rank - 1, m, gained)


@routine
def copy_twist(rows: Floats, k: int, first: int, twist: Floats) -> None:
    """Copy a twist from columns of a row; NaN for none."""
    for i in range(len(twist)):
        twist[i] = rows[k, first + i] if k >= 0 else math.nan


@routine
def put_columns(table: Floats, first: int, column: int, rows: Floats) -> None:
    """Fill rows with columns of a table, from a column and a row on."""
    for k in range(rows.shape[0]):
        for i in range(rows.shape[1]):
            rows[k, i] = table[first + i, column + k]


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
def put_screws(loops: Loops, plan: FirstOrderPlan, state: State, eq: Equations, screws: Floats) -> None:
    """Present screws of orthonormal joint rates: velocity of the reference point, angular velocity."""
    for j in range(screws.shape[0]):
        for i in range(6):
            screws[j, i] = 0.0  # what is on no path moves neither a loop nor the end effector
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
def lay_out_motions(plan: FirstOrderPlan, screws: Floats, table: Floats) -> None:
    """By joint rates: the loops' conditions, the end effector's twist, rates of the actuators, rates of all joints."""
    m, twists = 6 * plan.loops.shape[0], plan.directions.shape[0]
    seen = m + twists + plan.actuated.shape[0]
    for j in range(screws.shape[0]):
        for k in range(plan.loops.shape[0]):
            for i in range(6):
                table[6 * k + i, j] = plan.loops[k, j] * screws[j, i]
        for i in range(twists):
            table[m + i, j] = plan.way[j] * screws[j, i]
        for i in range(plan.actuated.shape[0]):
            table[m + twists + i, j] = 1.0 if plan.actuated[i] == j else 0.0
        for i in range(seen, table.shape[0]):
            table[i, j] = 1.0 if i - seen == j else 0.0


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
def put_map(pairs: Floats, first: int, to: int, most: int, least: float, sizes: Floats, found: Floats) -> None:
    """Fill the map (to, from) from columns of rows, from `first` on and orthogonal there, to others from `to` on."""
    for i in range(found.shape[0]):
        for j in range(found.shape[1]):
            found[i, j] = 0.0
    for k in range(min(most, pairs.shape[0])):
        for i in range(found.shape[0] if sizes[k] > least else 0):
            share = pairs[k, to + i] / (sizes[k] * sizes[k])
            for j in range(found.shape[1]):
                found[i, j] += share * pairs[k, first + j]


@routine
def size_of(pairs: Floats, k: int, first: int, last: int) -> float:
    """Size of a row in the columns from `first` to `last`."""
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


@routine
def orthogonalise(rows: Floats, first: int, last: int) -> bool:
    """Make the columns of all rows from `first` to `last` orthonormal, by Gram and Schmidt; the others go along.

    False where next to nothing is left of one.
    """
    for k in range(rows.shape[0]):
        size = set_apart(rows, k, first, last)
        if not size > REGULAR:
            return False
        for i in range(rows.shape[1]):
            rows[k, i] /= size
    return True


@routine
def set_apart(rows: Floats, k: int, first: int, last: int) -> float:
    """Take from a row what it has of those before, orthonormal from `first` to `last`; the size of what is left."""
    size = size_of(rows, k, first, last)
    for _ in range(2):  # what is left of a row after much of it was taken is not orthogonal yet
        before = size
        for j in range(k):
            share = 0.0
            for i in range(first, last):
                share += rows[j, i] * rows[k, i]
            for i in range(rows.shape[1]):
                rows[k, i] -= share * rows[j, i]
        size = size_of(rows, k, first, last)
        if size > ENOUGH * before:
            break
    return size
