"""The common case of a batch, block by block: struts alone, no limit touched, in loops that vectorise.

Poses lie side by side, one array an entry, so that each line of arithmetic serves many targets at once. A row that
exceeds any limit is left to the general code, which knows about tolerances and other ways.
"""

from __future__ import annotations

import math

from .._jit import routine
from ..vectors import Vec, move, turn, vec
from .plan import CARRIER_CONE, LINK_CONE, STROKE, STRUT, Configuration, Floats, Plan

# Targets side by side: few enough for the nearest cache, many enough to pay for the loop.
BLOCK = 64
# Rows of the scratch table: twelve entries of the poses, the strut, the worst slack, then a length for each branch.
POSES, STRUT_X, WORST, LENGTHS = 0, 12, 15, 16


@routine
def is_all_struts(plan: Plan) -> bool:
    """Whether every branch is one plain segment, every limit a stroke or a cone at either end."""
    for b in range(plan.branches.shape[0]):
        branch = plan.branches[b]
        if branch["kind"] != STRUT or branch["first"] == branch["last"] or branch["planar"] > 0:
            return False
        if branch["end_plane"] == 1 or branch["align"] == 1 or branch["rail"] == 1:
            return False
    for c in range(plan.cones.shape[0]):
        if plan.cones[c]["kind"] == LINK_CONE:
            return False
    return True


@routine
def lay_out_pose(pose: Floats, table: Floats, i: int) -> None:
    """Put a pose into column `i` of the table, and forget the slack of the target before it."""
    for k in range(3):
        for j in range(4):
            table[POSES + 4 * k + j, i] = pose[k, j]
    table[WORST, i] = -math.inf


@routine
def measure_struts(plan: Plan, b: int, now: Configuration, table: Floats, n: int) -> None:
    """Lengths of strut `b` for the first `n` columns, and the worst excess yet over any limit; <= 0 keeps all."""
    branch = plan.branches[b]
    carrier = now.carriers[branch["carrier"]]
    foot = move(carrier, vec(plan.nodes[branch["first"]]["home"]))
    head = vec(branch["end"])
    lo, hi = plan.nodes[branch["last"]]["lo"], plan.nodes[branch["last"]]["hi"]
    x, y, z, worst, lengths = table[STRUT_X], table[STRUT_X + 1], table[STRUT_X + 2], table[WORST], table[LENGTHS + b]
    place_along(table, 0, head, foot[0], x, n)
    place_along(table, 4, head, foot[1], y, n)
    place_along(table, 8, head, foot[2], z, n)
    for i in range(n):
        length = math.sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i])
        lengths[i] = length
        worst[i] = max(worst[i], max(lo - length, length - hi))
    for c in range(branch["cone_first"], branch["cone_last"]):
        cosine = plan.cones[c]["cosine"]
        a = vec(plan.cones[c]["axis"])
        if plan.cones[c]["kind"] == CARRIER_CONE:
            a = turn(carrier, a)
            for i in range(n):
                worst[i] = max(worst[i], cosine * lengths[i] - (a[0] * x[i] + a[1] * y[i] + a[2] * z[i]))
        else:
            for i in range(n):  # the line of a cone on the platform points inward
                ax = table[0, i] * a[0] + table[1, i] * a[1] + table[2, i] * a[2]
                ay = table[4, i] * a[0] + table[5, i] * a[1] + table[6, i] * a[2]
                az = table[8, i] * a[0] + table[9, i] * a[1] + table[10, i] * a[2]
                worst[i] = max(worst[i], cosine * lengths[i] + (ax * x[i] + ay * y[i] + az * z[i]))


@routine
def place_along(table: Floats, row: int, point: Vec, origin: float, to: Floats, n: int) -> None:
    """One coordinate of a platform point less `origin`, for the first `n` columns; rounded as the general code does."""
    a, b, c, p = table[row], table[row + 1], table[row + 2], table[row + 3]
    for i in range(n):
        to[i] = (a[i] * point[0] + b[i] * point[1] + c[i] * point[2] + p[i]) - origin


@routine
def read_actuator(plan: Plan, j: int, now: Configuration, table: Floats, i: int) -> float:
    """The value of actuated coordinate `j` for column `i`."""
    coordinate = plan.coordinates[j]
    if coordinate["kind"] == STROKE:
        reading = table[LENGTHS + coordinate["branch"], i]
    else:
        reading = now.trunks[coordinate["index"]]
    return float(coordinate["offset"] + coordinate["sign"] * reading)
