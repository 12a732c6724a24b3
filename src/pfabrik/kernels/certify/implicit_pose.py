"""Coordinates of the pose that follow from the legs, over a cell: to first order, with a bound on the rest.

The task's coordinates x span a cell; the others, y, solve as many constraints F(x, y) = 0. With y0 the solution in the
middle, F_y and F_x the slopes there and Y = -F_y^-1 F_x, every pose of the cell is to have y = y0 + Y (x - x0) + t,
|t_j| <= e_j. The constraints are affine forms over this oblique cell, in x and t, and so is G = F_y^-1 F = t + r. If
|r_j| <= d_j < e_j for all j and all its poses, then G_j has the sign of t_j where |t_j| = e_j: for each x there is a
solution (Poincare, Miranda), of the degree that F_y has, and each one has |t_j| <= d_j. That any matrix may stand for
F_y^-1 needs no proof: a singular one leaves some G_j without t_j.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats
from .._jit import routine
from ..legs.records import Table
from ..linear import sign_of_square, solve_square
from .affine_forms import ABOVE, BELOW, CENTRE
from .constraint_rows import put_constraints
from .limit_rows import LimitRows
from .pose_cells import N_PARAMETERS, ROUNDING, CellParameters, put_cell, put_oblique

# Half size [L or rad] of the cell whose forms give values and slopes in the middle; steps of Newton's method, the
# longest one [L or rad], and the one after which the next would be below rounding.
PROBE, NEWTON_STEPS, LONGEST_STEP, LAST_STEP = 1e-6, 12, 0.3, 1e-8
# Trials of an error; the factor by which one is above what the last asks for; the largest [L or rad].
TRIALS, ROOM, LARGEST_ERROR = 6, 1.25, 0.5
# Error [L or rad] of the first trial: that of rounding.
LEAST_ERROR = 1e-13


class ImplicitPose(NamedTuple):
    """Scratch memory: implicit coordinates over a cell."""

    forms: Floats  # (constraints, 9)
    matrix: Floats  # (6, 7)
    inverse: Floats  # (6, 6): F_y^-1, its rows in the order of the implicit coordinates
    slopes: Floats  # (6, 6): Y, in rows and columns of all coordinates
    errors: Floats  # (6,): bounds of t
    found: Floats  # (6,)
    box: Floats  # (12,)


def new_implicit(n_constraints: int) -> ImplicitPose:
    """Allocate the implicit coordinates of a machine."""
    six = N_PARAMETERS
    return ImplicitPose(
        np.zeros((max(n_constraints, six), 9)),
        np.zeros((six, six + 1)),
        np.zeros((six, six)),
        np.zeros((six, six)),
        np.zeros(six),
        np.zeros(six),
        np.zeros(2 * six),
    )


@routine
def put_pose(
    table: Table, sides: Floats, region: CellParameters, box: Floats, rows: LimitRows, implicit: ImplicitPose
) -> bool:
    """Fill the cell of a box, with the middle of its implicit coordinates; False if they are not enclosed."""
    if table.task[0]["rows"] == 0 or not has_implicit(region):
        put_cell(region, box, rows.cell)
        return True
    return solve_middle(table, sides, region, box, rows, implicit) and enclose_pose(
        table, sides, region, box, rows, implicit
    )


@routine
def has_implicit(region: CellParameters) -> bool:
    """True if some coordinates follow from the legs."""
    for j in range(N_PARAMETERS):
        if region.implicit[j] == 1:
            return True
    return False


@routine
def solve_middle(
    table: Table, sides: Floats, region: CellParameters, box: Floats, rows: LimitRows, implicit: ImplicitPose
) -> bool:
    """Solve for the implicit coordinates in the middle of a box, from those in it; with the slopes and F_y^-1."""
    m = 0
    for j in range(N_PARAMETERS):
        implicit.box[N_PARAMETERS + j] = PROBE
        m += region.implicit[j]
    for _ in range(NEWTON_STEPS):
        for j in range(N_PARAMETERS):
            implicit.box[j] = box[j]
        put_cell(region, implicit.box, rows.cell)
        if not put_constraints(table, sides, N_PARAMETERS, rows, implicit.forms) or not put_inverse(
            region, m, implicit
        ):
            return False
        largest, row = 0.0, 0
        for j in range(N_PARAMETERS):
            if region.implicit[j] == 0:
                continue
            step = 0.0
            for k in range(m):
                step -= implicit.inverse[row, k] * implicit.forms[k, CENTRE]
            box[j] += min(max(step, -LONGEST_STEP), LONGEST_STEP)
            largest, row = max(largest, abs(step)), row + 1
        if not largest < math.inf:
            return False
        if largest < LAST_STEP:
            put_slopes(region, m, implicit)
            return True
    return False


@routine
def put_inverse(region: CellParameters, m: int, implicit: ImplicitPose) -> bool:
    """Fill F_y^-1 from the forms of a small cell; False if it is singular, or its determinant has not home's sign."""
    matrix, sign = implicit.matrix, 0
    for column in range(m + 1):
        for k in range(m):
            place = 0
            for j in range(N_PARAMETERS):
                if region.implicit[j] == 1:
                    matrix[k, place] = implicit.forms[k, j] / PROBE
                    place += 1
            matrix[k, m] = 1.0 if k == column else 0.0
        if column == m:
            sign = sign_of_square(matrix, m)
        elif not solve_square(matrix, m):
            return False
        else:
            for k in range(m):
                implicit.inverse[k, column] = matrix[k, m]
    return float(sign) * region.signs[0] >= 0.0


@routine
def put_slopes(region: CellParameters, m: int, implicit: ImplicitPose) -> None:
    """Y = -F_y^-1 F_x."""
    row = 0
    for j in range(N_PARAMETERS):
        for i in range(N_PARAMETERS):
            implicit.slopes[j, i] = 0.0
        if region.implicit[j] == 0:
            continue
        for i in range(N_PARAMETERS):
            if region.implicit[i] == 0:
                for k in range(m):
                    implicit.slopes[j, i] -= implicit.inverse[row, k] * implicit.forms[k, i] / PROBE
        row += 1


@routine
def enclose_pose(
    table: Table, sides: Floats, region: CellParameters, box: Floats, rows: LimitRows, implicit: ImplicitPose
) -> bool:
    """Find errors of the implicit coordinates that are proved, and fill the cell with them; False if none are."""
    errors, found = implicit.errors, implicit.found
    for j in range(N_PARAMETERS):
        errors[j] = LEAST_ERROR
    for _ in range(TRIALS):
        put_oblique(region, box, implicit.slopes, errors, implicit.box, rows.cell)
        if not put_constraints(table, sides, N_PARAMETERS, rows, implicit.forms):
            return False
        put_deviations(region, implicit)
        is_proved = True
        for j in range(N_PARAMETERS):
            if region.implicit[j] == 0:
                continue
            if not found[j] < LARGEST_ERROR:
                return False
            is_proved = is_proved and found[j] < errors[j]
        for j in range(N_PARAMETERS):
            errors[j] = found[j] if is_proved else ROOM * found[j]
        if is_proved:
            put_oblique(region, box, implicit.slopes, errors, implicit.box, rows.cell)
            return True
    return False


@routine
def put_deviations(region: CellParameters, implicit: ImplicitPose) -> None:
    """Fill d_j, the bound of G_j - t_j over the cell."""
    m, row = 0, 0
    for j in range(N_PARAMETERS):
        m += region.implicit[j]
    for j in range(N_PARAMETERS):
        implicit.found[j] = 0.0
        if region.implicit[j] == 0:
            continue
        total, size = 0.0, 0.0
        for i in range(N_PARAMETERS):
            part = -implicit.errors[j] if i == j else 0.0
            for k in range(m):
                part += implicit.inverse[row, k] * implicit.forms[k, i]
                size += abs(implicit.inverse[row, k] * implicit.forms[k, i])
            total += abs(part)
        part = 0.0
        for k in range(m):
            share = implicit.inverse[row, k]
            part += share * implicit.forms[k, CENTRE]
            size += abs(share * implicit.forms[k, CENTRE])
            total += abs(share) * max(-implicit.forms[k, BELOW], implicit.forms[k, ABOVE])
        implicit.found[j] = (total + abs(part) + ROUNDING * size) * (1.0 + ROUNDING) + ROUNDING * LEAST_ERROR
        row += 1
