"""Loops closed in rates: all motions of a machine, and the least that its geometry adds to accelerations.

The cuts of a group give G u + H V = d with the rates u of its own columns, the end effector's twist V, and, of
accelerations, what the motion itself opens, d. Elimination of u, the largest pivot first, leaves some columns free and
some rows without a column: these bind the parameters p, V and the free columns, by B p = e, eliminated in the same way.
What remains is a basis of all motions. The factors stay in place of what they eliminate, for later right-hand sides.
"""

from __future__ import annotations

from ...common.arrays import Floats
from .._jit import inlined, routine
from ..vectors import add, cross, vec
from .moving import FROM, LEAST, MOTIONS, OF_END, ROWS, VISITS, MovingMachine, MovingScratch
from .placing import point_of

FREE, GONE = -1, -2
"""Slots of columns that are not eliminated yet, and of those that are."""


@routine
def close_rates(moving: MovingMachine, own: MovingScratch) -> bool:
    """Fill all motions by columns and by parameters; False where the loops gain a motion."""
    for k in range(own.slots.shape[0]):
        own.slots[k] = FREE
    n_left = n_free = 0
    for group in range(moving.groups.shape[0] - 1):
        put_rows(moving, own, group)
        eliminate(moving, own, group)
        first, last = moving.groups[group, 0], moving.groups[group + 1, 0]
        before = n_free
        for k in range(first, last):
            if own.slots[k] == FREE:
                own.slots[k] = 6 + n_free
                n_free += 1
        for i in range(moving.groups[group, 2], moving.groups[group + 1, 2]):
            if own.pivot_of[i] < 0:
                for j in range(own.left.shape[1]):
                    own.left[n_left, j] = own.rows[i, own.rows.shape[1] - 6 + j] if j < 6 else 0.0
                for k in range(first, last if n_free > before else first):
                    if own.slots[k] >= 0:
                        own.left[n_left, own.slots[k]] = own.rows[i, k - first]
                own.left_of[n_left] = i
                n_left += 1
    n = 6 + n_free
    if not bind(own, n_left, n, n - moving.counts[MOTIONS], moving.limits[LEAST]):
        return False
    put_motions(moving, own, n)
    return True


@routine
def put_rows(moving: MovingMachine, own: MovingScratch, group: int) -> None:
    """Fill the conditions of a group's cuts."""
    rows, width, row = own.rows, own.rows.shape[1], moving.groups[group, 2]
    first = moving.groups[group, 0]
    n = moving.groups[group + 1, 0] - first
    for cut in range(moving.groups[group, 1], moving.groups[group + 1, 1]):
        of_end, count = float(moving.cuts[cut, OF_END]), moving.cuts[cut, ROWS]
        for i in range(row, row + count):
            own.pivot_of[i] = -1
            for j in range(n):
                rows[i, j] = 0.0
            for j in range(width - 6, width):
                rows[i, j] = of_end if j - (width - 6) == i - row else 0.0
        x, y, z = point_of(own, moving.cuts[cut, FROM], vec(moving.cut_points[cut]))
        if count == 3 and of_end != 0.0:
            rows[row, width - 2], rows[row, width - 1] = of_end * z, -of_end * y
            rows[row + 1, width - 3], rows[row + 1, width - 1] = -of_end * z, of_end * x
            rows[row + 2, width - 3], rows[row + 2, width - 2] = of_end * y, -of_end * x
        for visit in range(moving.cuts[cut, VISITS], moving.cuts[cut + 1, VISITS]):
            column, sign = moving.visits[visit, 0], float(moving.visits[visit, 1])
            screw = own.screws[column]
            if count == 3:
                at = add(vec(screw), cross(vec(screw[3:]), (x, y, z)))
                for i in range(3):
                    rows[row + i, column - first] = sign * at[i]
            else:
                for i in range(6):
                    rows[row + i, column - first] = sign * screw[i]
        row += count


@routine
def eliminate(moving: MovingMachine, own: MovingScratch, group: int) -> None:
    """Eliminate the columns of a group, the largest entry first, as far as they are larger than none."""
    rows, width = own.rows, own.rows.shape[1]
    first, last = moving.groups[group, 2], moving.groups[group + 1, 2]
    slots, count = own.slots[moving.groups[group, 0] : moving.groups[group + 1, 0]], 0
    n = slots.shape[0]
    while count < min(n, last - first):
        best, pivot, at = moving.limits[LEAST], -1, -1
        for i in range(first, last):
            if own.pivot_of[i] < 0:
                for j in range(n):
                    if slots[j] == FREE and abs(rows[i, j]) > best:
                        best, pivot, at = abs(rows[i, j]), i, j
        if pivot < 0:
            break
        own.pivot_of[pivot], own.pivots[first + count] = at, pivot
        slots[at] = GONE
        count += 1
        inverse = 1.0 / rows[pivot, at]
        for i in range(first, last):
            factor = rows[i, at] * inverse
            if i != pivot and factor != 0.0:
                for j in range(n):
                    if slots[j] == FREE:
                        rows[i, j] -= factor * rows[pivot, j]
                for j in range(width - 6, width):
                    rows[i, j] -= factor * rows[pivot, j]
                rows[i, at] = factor
    own.n_pivots[group] = count


@routine
def bind(own: MovingScratch, n_left: int, n: int, count: int, least: float) -> bool:
    """Eliminate `count` of n parameters by the rows left; False where that many do not follow."""
    left = own.left
    for j in range(n):
        own.left_pivot[j] = -1
    for i in range(n_left):
        own.pivots_left[i] = -1
    for k in range(count):
        best, pivot, at = least, -1, -1
        for i in range(n_left):
            if own.pivots_left[i] < 0:
                for j in range(n):
                    if own.left_pivot[j] < 0 and abs(left[i, j]) > best:
                        best, pivot, at = abs(left[i, j]), i, j
        if pivot < 0:
            return False
        own.left_pivot[at], own.pivots_left[pivot], own.order[k] = pivot, at, at
        inverse = 1.0 / left[pivot, at]
        for i in range(n_left):
            factor = left[i, at] * inverse
            if i != pivot and factor != 0.0:
                for j in range(n):
                    if own.left_pivot[j] < 0:
                        left[i, j] -= factor * left[pivot, j]
                left[i, at] = factor
    return True


@routine
def put_motions(moving: MovingMachine, own: MovingScratch, n: int) -> None:
    """Fill the motions by parameters, and by columns."""
    motions, k = own.parameters, 0
    m = motions.shape[1]
    for j in range(n):
        for i in range(m):
            motions[j, i] = 0.0
    for j in range(n):
        if own.left_pivot[j] < 0:
            motions[j, k] = 1.0
            for i in range(n):
                pivot = own.left_pivot[i]
                if pivot >= 0 and own.left[pivot, j] != 0.0:
                    motions[i, k] = -own.left[pivot, j] / own.left[pivot, i]
            k += 1
    for group in range(moving.groups.shape[0] - 1):
        first, last = moving.groups[group, 0], moving.groups[group + 1, 0]
        for j in range(first, last):
            for i in range(m):
                own.by_motions[j, i] = motions[own.slots[j], i] if own.slots[j] >= 0 else 0.0
        for k in range(own.n_pivots[group]):
            row = own.pivots[moving.groups[group, 2] + k]
            put_column(own, first, last, row, n == m, own.by_motions[first + own.pivot_of[row]])


@inlined
def put_column(own: MovingScratch, first: int, last: int, row: int, is_free: bool, column: Floats) -> None:
    """Fill the rate of an eliminated column by motions, which are the parameters where these are free."""
    rows, width = own.rows, own.rows.shape[1]
    inverse = -1.0 / rows[row, own.pivot_of[row]]
    for j in range(6):
        if is_free:
            column[j] = rows[row, width - 6 + j] * inverse
        else:
            add_share(rows[row, width - 6 + j] * inverse, own.parameters[j], column)
    for j in range(first, last):
        if own.slots[j] >= 0:
            add_share(rows[row, j - first] * inverse, own.parameters[own.slots[j]], column)


@inlined
def add_share(share: float, row: Floats, to: Floats) -> None:
    """Add a multiple of a row."""
    if share != 0.0:
        for i in range(to.shape[0]):
            to[i] += share * row[i]


@routine
def close_gains(moving: MovingMachine, own: MovingScratch) -> None:
    """Fill accelerations dV and du that close what is `opened`, with nothing in the parameters that are free."""
    opened, n = own.opened, 6
    for j in range(own.slots.shape[0]):
        n = max(n, own.slots[j] + 1)
    for group in range(moving.groups.shape[0] - 1):
        first, last = moving.groups[group, 2], moving.groups[group + 1, 2]
        for k in range(own.n_pivots[group]):
            pivot = own.pivots[first + k]
            for i in range(first, last):
                if i != pivot:
                    opened[i] -= own.rows[i, own.pivot_of[pivot]] * opened[pivot]
    n_bound = n - moving.counts[MOTIONS]
    for k in range(n_bound):
        at = own.order[k]
        pivot = own.left_pivot[at]
        value = opened[own.left_of[pivot]]
        for j in range(n_bound):
            if j != k:
                i = own.left_pivot[own.order[j]]
                opened[own.left_of[i]] -= own.left[i, at] * value
    for j in range(n):
        pivot = own.left_pivot[j]
        own.dV[j] = -opened[own.left_of[pivot]] / own.left[pivot, j] if pivot >= 0 else 0.0
    for group in range(moving.groups.shape[0] - 1):
        first, last, width = moving.groups[group, 0], moving.groups[group + 1, 0], own.rows.shape[1]
        for j in range(first, last):
            own.du[j] = own.dV[own.slots[j]] if own.slots[j] >= 0 else 0.0
        for k in range(own.n_pivots[group]):
            row = own.pivots[moving.groups[group, 2] + k]
            value = opened[row]
            for j in range(6):
                value += own.rows[row, width - 6 + j] * own.dV[j]
            for j in range(first, last):
                if own.slots[j] >= 0:
                    value += own.rows[row, j - first] * own.dV[own.slots[j]]
            own.du[first + own.pivot_of[row]] = -value / own.rows[row, own.pivot_of[row]]
