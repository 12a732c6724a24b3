"""Margins of poses to the limits of rods in closed form, by blocks of poses.

Operands of a conditional are read before it: a loop that reads memory in one branch only does not vectorise.
"""

from __future__ import annotations

import math

import numpy as np

from ...common.arrays import Floats, Ints, Record, Records
from .._jit import kernel, routine
from ..search_constants import CLOSED, NEARLY_CLOSED
from .blocks import counting_range, fill_rod, fill_sides, project_on_cone_axis, wrap_between
from .columns import (
    BLOCK,
    EXCESS,
    INVERSE,
    IS_REGULAR,
    LENGTH,
    MORE,
    ROW,
    VALUE,
    VALUES,
    arctangent,
    fill_inverse,
    fill_poses,
)
from .leg_constants import KEPT
from .margin_rows import relative_margin
from .records import SHARED, SLIDE, open_table

# Difference up to which cosines of one group are equal, so that margins are to `KEPT`, but beside the axis of a cone.
SAME = 1e-12

# Binding of a row that blocks cannot measure: its pose is still to be completed, or a rod there has no direction.
UNKNOWN = -2

# Here EXCESS holds the least margin so far. Further rows: index of its limit, 1 if all lengths are finite and positive,
# the largest constraint of all legs, 1 if it is a pose; then, for each cone, the least cosine of all cones with the
# same half angle, and the index of its limit.
LEAST, BINDING, IS_KNOWN, LARGEST, IS_POSE, CONES = EXCESS, MORE, MORE + 1, MORE + 2, MORE + 3, MORE + 4


@routine
def clear_margins(n_cones: int, n: int, S: Floats) -> None:
    """Reset the rows of a block before its legs are measured."""
    for i in range(n):
        S[LEAST, i], S[BINDING, i], S[IS_KNOWN, i], S[LARGEST, i] = math.inf, -1.0, 1.0, 0.0
        S[IS_POSE, i] = S[IS_REGULAR, i]
    for c in range(n_cones):
        for i in range(n):
            S[CONES + 2 * c, i] = math.inf


@routine
def track_margin(column: int, limit: int, n: int, S: Floats) -> None:
    """Lower LEAST to the margin in a row, and note its limit; of margins equal to `KEPT` the first stays."""
    for i in range(n):
        margin, before, binding = S[column, i], S[LEAST, i], S[BINDING, i]
        S[BINDING, i] = float(limit) if margin < before - KEPT else binding
        S[LEAST, i] = margin if margin < before - KEPT else before


@routine
def track_bounds(coordinate: Record, limit: int, n: int, S: Floats) -> None:
    """Lower LEAST to the margins of both bounds of a range; `limit` is the index of the first."""
    lo, hi = coordinate["lo"], coordinate["hi"]
    half_range = 0.5 * (hi - lo)
    sense, place = coordinate["sense"], VALUES + coordinate["place"]
    shift, lowest, highest = counting_range(coordinate)
    for i in range(n):
        value = wrap_between(sense * S[place, i] + shift, lowest, highest)
        below, above, before, binding = value - lo, hi - value, S[LEAST, i], S[BINDING, i]
        nearer = float(limit + 1) if above < below - KEPT * half_range else float(limit)
        margin = relative_margin(above if above < below else below, half_range)
        S[BINDING, i] = nearer if margin < before - KEPT else binding
        S[LEAST, i] = margin if margin < before - KEPT else before


@routine
def track_cosine(cone: Record, proximal: Record, limit: int, n: int, S: Floats) -> None:
    """Lower the least cosine of a cone's group to that of a rod, and note its limit."""
    project_on_cone_axis(cone, proximal, n, S)
    least = CONES + 2 * cone["leader"]
    for i in range(n):
        before, holder = S[least, i], S[least + 1, i]
        cosine = S[VALUE, i] * S[INVERSE, i]
        S[least + 1, i] = float(limit) if cosine < before - SAME else holder
        S[least, i] = cosine if cosine < before - SAME else before


@routine
def track_cone_group(cones: Records, c: int, n: int, S: Floats) -> None:
    """Lower LEAST to the least margin of a group of cones with equal half angle, led by cone `c`."""
    least, half_angle = CONES + 2 * c, cones[c]["half_angle"]
    scale = 1.0 / half_angle if half_angle > 0.0 else math.inf
    for i in range(n):
        cosine, holder, before, binding = S[least, i], S[least + 1, i], S[LEAST, i], S[BINDING, i]
        square = (1.0 - cosine) * (1.0 + cosine)
        angle = arctangent(math.sqrt(square if square > 0.0 else 0.0), cosine)
        margin = (half_angle - angle) * scale
        S[BINDING, i] = holder if margin < before - KEPT else binding
        S[LEAST, i] = margin if margin < before - KEPT else before


@routine
def track_leg(rod: Record, reach: int, closed: int, n: int, S: Floats) -> None:
    """Lower LEAST to the margins of reaching and of closing of a rod; `reach` and `closed` are their limits."""
    for i in range(n):
        S[IS_KNOWN, i] = S[IS_KNOWN, i] if (S[LENGTH, i] > 0.0) & (S[LENGTH, i] < math.inf) else 0.0
    if rod["has_proximal"] == 1:
        for i in range(n):
            margin = -abs(S[VALUES + SLIDE, i]) / rod["length"]
            S[VALUE, i] = margin if margin < -NEARLY_CLOSED else math.inf
        track_margin(VALUE, reach, n, S)
    if rod["n_rows"] > 0:
        for i in range(n):
            row, before = S[ROW, i], S[LARGEST, i]
            S[VALUE, i] = -row if row > NEARLY_CLOSED else math.inf
            S[LARGEST, i] = row if row > before else before
            S[ROW, i] = 0.0
        track_margin(VALUE, closed, n, S)


@kernel
def margins_in_blocks(
    machine: int,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    is_coupled: int,
    margins: Floats,
    bindings: Ints,
) -> int:
    """Fill margins and bindings as `feasibility.feasibility` does, for legs that are all rods; the number UNKNOWN.

    Parameters
    ----------
    machine : address of the kernel table.
    targets : (n, 4, 4) [length].
    is_coupled : 1 if unset coordinates depend on the set ones. A leg that does not reach a pose may then reach it
        completed; otherwise it does not, and blocks measure by how much.
    """
    table = open_table(machine)
    legs, limited, cones, task = table.legs, table.limited, table.cones, table.task
    S, pose, n_unknown = np.empty((CONES + 2 * cones.shape[0], BLOCK)), np.zeros((4, 4)), 0
    n_legs, n_limits = legs.shape[0], 2 * limited.shape[0] + cones.shape[0]
    tolerance = CLOSED if task[0]["unset"] > 0 else NEARLY_CLOSED
    for start in range(0, margins.shape[0], BLOCK):
        n = min(BLOCK, margins.shape[0] - start)
        fill_poses(targets, begins, task[0], start, n, pose, S)
        clear_margins(cones.shape[0], n, S)
        owner, a, c = 0, 0, 0
        for k in range(n_legs):
            if legs[k]["proximal"] != SHARED:
                owner = k
            if legs[k]["has_proximal"] == 1:
                fill_sides(sides, k, 0, n, S)
            fill_rod(legs[k], legs[owner], n, S)
            while a < limited.shape[0] and limited[a]["leg"] == k:
                track_bounds(limited[a], 2 * a, n, S)
                a += 1
            if c < cones.shape[0] and cones[c]["leg"] == k:
                fill_inverse(n, S)
            while c < cones.shape[0] and cones[c]["leg"] == k:
                track_cosine(cones[c], legs[owner], 2 * limited.shape[0] + c, n, S)
                c += 1
            track_leg(legs[k], n_limits + k, n_limits + n_legs + k, n, S)
        for c in range(cones.shape[0]):
            if cones[c]["leader"] == c:
                track_cone_group(cones, c, n, S)
        for i in range(n):
            margins[start + i], bindings[start + i] = S[LEAST, i], int(S[BINDING, i])
            is_pose = S[IS_POSE, i] == 1.0
            is_open = is_coupled == 1 if S[IS_REGULAR, i] == 0.0 else task[0]["unset"] > 0 and S[LARGEST, i] > tolerance
            if not is_pose or is_open or S[IS_KNOWN, i] == 0.0:
                bindings[start + i] = UNKNOWN
                n_unknown += 1
    return n_unknown
