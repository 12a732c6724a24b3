"""The determinant of a machine with its drivers locked, over a cell: proved not to vanish.

Its rows are what the platform's twist (v, w) must not change: f . v + (r x f) . w, with f the rod of a driven leg, the
hinge that a rod stays across, or a direction that a pivot keeps, and r from the reference point to where it acts. With
J the matrix in the middle of a cell, J^-1 times that of each pose is 1 + D. If |D| <= N, entry by entry, and N w < w
for some positive w (Collatz, Wielandt), no eigenvalue of D is as large as 1 in size: no pose has a singular matrix.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Record
from .._jit import routine
from ..legs.records import COSINE, CRANK, FROM_BASE, HINGE, PIVOT, Q_PROXIMAL, ROD, SHARED, SINE, SLIDE, Table
from ..linear import sign_of_square, solve_square
from ..vectors import Vec, add, cross, norm, put, vec
from .affine_forms import (
    AWAY,
    BOUNDS,
    CENTRE,
    ERROR,
    put_bounds,
    put_difference,
    put_fixed,
    put_turned,
)
from .leg_bounds import put_direction, put_end, put_platform_point, put_proximal_point, put_rod, put_span
from .limit_rows import LimitRows
from .pose_cells import ROUNDING, CellParameters

# Rows of the matrix; trials of w, and its least entry, as a share of the largest.
N_ROWS, TRIALS, LEAST_WEIGHT = 6, 12, 1e-6


class ParallelRows(NamedTuple):
    """Scratch memory: the matrix over a cell."""

    forces: Floats  # (6, 8, 3)
    moments: Floats  # (6, 8, 3)
    lever: Floats  # (8, 3)
    matrix: Floats  # (6, 7)
    inverse: Floats  # (6, 6)
    bounds: Floats  # (6, 6): N
    weights: Floats  # (2, 6): w, and N w
    side: Floats  # (1,): 1 if its determinant in the middle has home's sign, -1 if the other one, 0 if it is not known


def new_parallel() -> ParallelRows:
    """Allocate the matrix of a machine."""
    forces, moments = np.zeros((N_ROWS, BOUNDS + 1, 3)), np.zeros((N_ROWS, BOUNDS + 1, 3))
    six = (N_ROWS, N_ROWS)
    return ParallelRows(
        forces,
        moments,
        np.zeros((BOUNDS + 1, 3)),
        np.zeros((N_ROWS, N_ROWS + 1)),
        np.zeros(six),
        np.zeros(six),
        np.zeros((2, N_ROWS)),
        np.zeros(1),
    )


@routine
def put_cross(v: Floats, w: Floats, n: int, x: Floats) -> None:
    """x = v x w = (c + d) x (b + e), whose part d x e is at most |d| |e|."""
    c, b = vec(v[CENTRE]), vec(w[CENTRE])
    for i in range(n):
        put(x[i], add(cross(c, vec(w[i])), cross(vec(v[i]), b)))
    put(x[CENTRE], cross(c, b))
    first, second = norm(c) + v[BOUNDS, AWAY], norm(b) + w[BOUNDS, AWAY]
    error = v[BOUNDS, AWAY] * w[BOUNDS, AWAY] + norm(c) * w[BOUNDS, ERROR] + norm(b) * v[BOUNDS, ERROR]
    away = norm(c) * w[BOUNDS, AWAY] + norm(b) * v[BOUNDS, AWAY] + v[BOUNDS, AWAY] * w[BOUNDS, AWAY]
    rounded = ROUNDING * first * second
    put_bounds(x, n, error + rounded, away + rounded)


@routine
def is_driven(table: Table, k: int, place: int) -> bool:
    """True if a coordinate of leg `k` is driven."""
    for i in range(table.driven.shape[0]):
        if table.driven[i]["leg"] == k and table.driven[i]["place"] == place:
            return True
    return False


@routine
def has_known_drives(table: Table) -> bool:
    """True if all that is driven are lengths of rods and their proximal joints, and no such joint is passive."""
    for i in range(table.driven.shape[0]):
        drive = table.driven[i]
        if table.legs[drive["leg"]]["kind"] != ROD or not (drive["place"] == Q_PROXIMAL or drive["place"] == SLIDE):
            return False
    for k in range(table.legs.shape[0]):
        leg = table.legs[k]
        if leg["has_proximal"] == 1 and not is_driven(table, k, Q_PROXIMAL):
            return False
        if not (leg["kind"] == PIVOT or (leg["kind"] == ROD and leg["frame"] == FROM_BASE)) or leg["redundant"] >= 0:
            return False
    return True


@routine
def put_force(at: int, force: Floats, lever: Floats, n: int, work: ParallelRows) -> None:
    """Row `at`: f and r x f."""
    for i in range(BOUNDS + 1):
        put(work.forces[at, i], vec(force[i]))
    put_cross(lever, force, n, work.moments[at])


@routine
def put_couple(at: int, first: Floats, last: Floats, n: int, work: ParallelRows) -> None:
    """Row `at`: a turn that is kept, f = 0 and a x b."""
    put_fixed((0.0, 0.0, 0.0), 0.0, n, work.forces[at])
    put_cross(first, last, n, work.moments[at])


@routine
def put_rod_forces(
    table: Table, sides: Floats, k: int, owner: int, n: int, at: int, rows: LimitRows, work: ParallelRows
) -> int:
    """Rows of a rod read from the base, from row `at` on; the next row, or -1 where one is not known."""
    rod, bounds, cell, reference = table.legs[k], rows.bounds, rows.cell, vec(table.task[0]["reference"])
    put_end(rod, reference, cell, n, 0.0, bounds.end)
    if owner < k:
        put_span(rod, table.legs[owner], n, bounds)
    elif not put_rod(rod, sides[k], n, 0.0, bounds):
        return -1
    put_platform_point((0.0, 0.0, 0.0), reference, cell, n, 0.0, bounds.w)
    put_direction(FROM_BASE, vec(rod["platform_end_point"]), cell, n, work.lever)
    if rod["slides"] == 0 or is_driven(table, k, SLIDE):
        put_force(at, bounds.span, work.lever, n, work)
        at += 1
    if rod["base_end"] == HINGE:
        put_base_direction(table.legs[owner], vec(rod["base_end_axes"][0]), n, rows, bounds.v)
        put_force(at, bounds.v, work.lever, n, work)
        at += 1
    if rod["platform_end"] == HINGE:
        put_direction(FROM_BASE, vec(rod["platform_end_axes"][0]), cell, n, bounds.v)
        put_proximal_point(table.legs[owner], vec(rod["base_end_point"]), n, 0.0, bounds, work.forces[at])
        put_difference(work.forces[at], bounds.w, n, work.lever)
        put_force(at, bounds.v, work.lever, n, work)
        at += 1
    if rod["twists"] == 1:
        put_direction(FROM_BASE, vec(rod["platform_end_axes"][0]), cell, n, bounds.v)
        put_fixed(vec(rod["base_end_axes"][0]), 0.0, n, bounds.w)
        put_couple(at, bounds.v, bounds.w, n, work)
        at += 1
    return at


@routine
def put_base_direction(owner: Record, axis: Vec, n: int, rows: LimitRows, v: Floats) -> None:
    """A direction of the body at a rod's base end, which a crank turns."""
    bounds = rows.bounds
    put_fixed(axis, ROUNDING, n, v)
    if owner["proximal"] == CRANK:
        values = bounds.values
        put_turned(axis, vec(owner["proximal_axis"]), values[COSINE], values[SINE], values[Q_PROXIMAL], bounds.q, n, v)


@routine
def put_pivot_forces(table: Table, k: int, n: int, at: int, rows: LimitRows, work: ParallelRows) -> int:
    """Rows of a pivot, from row `at` on; the next row.

    Its directions f and `kept` are of the body at its base end, `moved` of the other one. Read from the platform, f
    acts on the platform at the pivot's centre in the base.
    """
    pivot, bounds, cell, reference = table.legs[k], rows.bounds, rows.cell, vec(table.task[0]["reference"])
    n_fixed, is_forward = 3 - pivot["slides"], pivot["frame"] == FROM_BASE
    put_platform_point((0.0, 0.0, 0.0), reference, cell, n, 0.0, bounds.w)
    if is_forward:
        put_direction(FROM_BASE, vec(pivot["platform_end_point"]), cell, n, work.lever)
    else:
        put_fixed(vec(pivot["platform_end_point"]), 0.0, n, bounds.v)
        put_difference(bounds.v, bounds.w, n, work.lever)
    for i in range(n_fixed):
        put_base_side(pivot, vec(pivot["fixed_rows"][i]), n, rows, bounds.v)
        put_force(at, bounds.v, work.lever, n, work)
        at += 1
    for i in range(pivot["n_rows"] - n_fixed):
        put_base_side(pivot, vec(pivot["kept"][i]), n, rows, bounds.v)
        if is_forward:
            put_direction(FROM_BASE, vec(pivot["moved"][i]), cell, n, bounds.w)
        else:
            put_fixed(vec(pivot["moved"][i]), ROUNDING, n, bounds.w)
        put_couple(at, bounds.w, bounds.v, n, work)
        at += 1
    return at


@routine
def put_base_side(pivot: Record, v: Vec, n: int, rows: LimitRows, w: Floats) -> None:
    """A direction of the body at a pivot's base end, in base coordinates."""
    if pivot["frame"] == FROM_BASE:
        put_fixed(v, ROUNDING, n, w)
    else:
        put_direction(FROM_BASE, v, rows.cell, n, w)


@routine
def put_parallel(table: Table, sides: Floats, n: int, rows: LimitRows, work: ParallelRows) -> bool:
    """Fill all rows over the cell in `rows`; False where one is not known, or they are not six."""
    if not has_known_drives(table):
        return False
    owner, at = 0, 0
    for k in range(table.legs.shape[0]):
        leg = table.legs[k]
        owner = owner if leg["proximal"] == SHARED else k
        is_rigid_rod = leg["kind"] == ROD and (leg["has_proximal"] == 1 or is_driven(table, k, SLIDE))
        if at + leg["n_rows"] + (1 if is_rigid_rod else 0) > N_ROWS:
            return False
        if leg["kind"] == PIVOT:
            at = put_pivot_forces(table, k, n, at, rows, work)
        else:
            at = put_rod_forces(table, sides, k, owner, n, at, rows, work)
        if at < 0:
            return False
    return at == N_ROWS


@routine
def is_regular(region: CellParameters, n: int, work: ParallelRows) -> bool:
    """True if no matrix of the cell is singular, and home's determinant has the sign of the one in the middle."""
    matrix, inverse = work.matrix, work.inverse
    work.side[0] = 0.0
    for column in range(N_ROWS + 1):
        put_middle(work)
        if column == N_ROWS:
            continue
        for k in range(N_ROWS):
            matrix[k, N_ROWS] = 1.0 if k == column else 0.0
        if not solve_square(matrix, N_ROWS):
            return False
        for k in range(N_ROWS):
            inverse[k, column] = matrix[k, N_ROWS]
    work.side[0] = float(sign_of_square(matrix, N_ROWS)) * region.signs[1]
    if work.side[0] <= 0.0:
        return False
    put_bounds_of_deviation(n, work)
    return has_weights(work)


@routine
def has_weights(work: ParallelRows) -> bool:
    """True if N w < w for a positive w: it begins with ones, and N turns it towards the largest eigenvector."""
    weights, bounds = work.weights, work.bounds
    for j in range(N_ROWS):
        weights[0, j] = 1.0
    for _ in range(TRIALS):
        largest, most = 0.0, 0.0
        for j in range(N_ROWS):
            weights[1, j] = 0.0
            for c in range(N_ROWS):
                weights[1, j] += bounds[j, c] * weights[0, c]
            largest, most = max(largest, weights[1, j] / weights[0, j]), max(most, weights[1, j])
        if largest < 1.0 - ROUNDING:
            return True
        if not most < math.inf:
            return False
        for j in range(N_ROWS):
            weights[0, j] = max(weights[1, j] / most, LEAST_WEIGHT)
    return False


@routine
def put_middle(work: ParallelRows) -> None:
    """Fill the matrix in the middle of the cell."""
    for k in range(N_ROWS):
        for c in range(3):
            work.matrix[k, c], work.matrix[k, 3 + c] = work.forces[k, CENTRE, c], work.moments[k, CENTRE, c]


@routine
def put_bounds_of_deviation(n: int, work: ParallelRows) -> None:
    """Fill N, which bounds the entries of J^-1 times the matrix of a pose, less those of 1."""
    inverse = work.inverse
    for j in range(N_ROWS):
        for c in range(N_ROWS):
            part, total, size = -1.0 if c == j else 0.0, 0.0, 0.0
            for k in range(N_ROWS):
                entry = work.forces[k, CENTRE, c] if c < 3 else work.moments[k, CENTRE, c - 3]
                error = work.forces[k, BOUNDS, ERROR] if c < 3 else work.moments[k, BOUNDS, ERROR]
                part += inverse[j, k] * entry
                total += abs(inverse[j, k]) * error
                size += abs(inverse[j, k] * entry)
            total += abs(part)
            for i in range(n):
                part = 0.0
                for k in range(N_ROWS):
                    entry = work.forces[k, i, c] if c < 3 else work.moments[k, i, c - 3]
                    part += inverse[j, k] * entry
                    size += abs(inverse[j, k] * entry)
                total += abs(part)
            work.bounds[j, c] = (total + ROUNDING * size) * (1.0 + ROUNDING)
