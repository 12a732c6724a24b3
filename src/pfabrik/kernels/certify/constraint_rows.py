"""Constraints of legs on the pose over a cell: numbers that are zero where they are kept, in the order of their rows.

These are as in `legs.rods` and `legs.pivots`, but that products stand for angles: a rod between two hinges n and m has
n . R m as at home in place of its twist.
"""

from __future__ import annotations

from ...common.arrays import Floats, Record
from .._jit import routine
from ..legs.records import HINGE, PIVOT, SHARED, Table
from ..vectors import dot, vec
from .affine_forms import CENTRE, least, put_along, put_moved
from .leg_bounds import put_base_line, put_direction, put_end, put_platform_line, put_rod, put_span
from .limit_rows import LimitRows


@routine
def put_constraints(table: Table, sides: Floats, n: int, rows: LimitRows, forms: Floats) -> bool:
    """Fill the constraints of all legs over the cell in `rows`; False where one is not known."""
    legs, bounds, reference, owner = table.legs, rows.bounds, vec(table.task[0]["reference"]), 0
    for k in range(legs.shape[0]):
        leg = legs[k]
        owner = owner if leg["proximal"] == SHARED else k
        if leg["has_rows"] == 0:
            continue
        put_end(leg, reference, rows.cell, n, 0.0, bounds.end)
        if leg["kind"] == PIVOT:
            put_moved(bounds.end, vec(leg["base_end_point"]), n, bounds.span)
            if not put_pivot_constraints(leg, n, rows, forms):
                return False
            continue
        if owner < k:
            put_span(leg, legs[owner], n, bounds)
        elif not put_rod(leg, sides[k], n, 0.0, bounds):
            return False
        put_rod_constraints(leg, legs[owner], n, rows, forms)
    return True


@routine
def put_rod_constraints(rod: Record, owner: Record, n: int, rows: LimitRows, forms: Floats) -> None:
    """|l| - length of a rigid rod, n . l of a hinge n at either end, n . R m of two."""
    bounds, row = rows.bounds, rod["first_row"]
    if rod["slides"] == 0 and rod["has_proximal"] == 0:
        for i in range(9):
            forms[row, i] = bounds.length[i]
        forms[row, CENTRE] -= rod["length"]
        row += 1
    if rod["base_end"] == HINGE:
        put_base_line(rod, owner, n, bounds)
        put_along(bounds.v, vec(rod["base_end_axes"][0]), n, forms[row])
        row += 1
    if rod["platform_end"] == HINGE:
        put_platform_line(rod, rows.cell, n, bounds)
        put_along(bounds.v, vec(rod["platform_end_axes"][0]), n, forms[row])
        row += 1
    if rod["twists"] == 1:
        first, last = vec(rod["base_end_axes"][0]), vec(rod["platform_end_axes"][0])
        put_direction(rod["frame"], last, rows.cell, n, bounds.v)
        put_along(bounds.v, first, n, forms[row])
        forms[row, CENTRE] -= dot(first, last)


@routine
def put_pivot_constraints(pivot: Record, n: int, rows: LimitRows, forms: Floats) -> bool:
    """f . d of directions f in which its centre cannot move, a . R b - value of its hinges; False if turned over."""
    row, n_fixed, bounds = pivot["first_row"], 3 - pivot["slides"], rows.bounds
    for i in range(n_fixed):
        put_along(bounds.span, vec(pivot["fixed_rows"][i]), n, forms[row + i])
    for i in range(pivot["n_rows"] - n_fixed):
        put_direction(pivot["frame"], vec(pivot["moved"][i]), rows.cell, n, bounds.v)
        put_along(bounds.v, vec(pivot["kept"][i]), n, forms[row + n_fixed + i])
        forms[row + n_fixed + i, CENTRE] -= pivot["value"][i]
    for i in range(pivot["upright"]):
        axis = vec(pivot["base_end_axes"][i])
        put_direction(pivot["frame"], axis, rows.cell, n, bounds.v)
        put_along(bounds.v, axis, n, bounds.c)
        if not least(bounds.c, n) > 0.0:
            return False
    return True
