"""How far poses are inside, or beyond, the limits of rods in closed form: in blocks.

Whatever a choice needs is read before it: a loop that reads memory in one of two cases does not vectorise.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Floats, Ints, Record, Records
from .._jit import kernel, routine
from .answer import CLOSE, CLOSED
from .blocks import lay_along_cone, lay_rod, lay_sides, turned_into, turns_of
from .columns import (
    BLOCK,
    EXCESS,
    INVERSE,
    LENGTH,
    MARGIN,
    MORE,
    ROW,
    VALUE,
    VALUES,
    arctangent,
    lay_inverse,
    lay_out,
)
from .feasibility import share_of
from .records import CARRIAGE, CRANK, HINGE, NO_PROXIMAL, SHARED, SLIDE
from .table import open_table

# Of a row whose margin blocks do not tell: its pose is still to be completed, or a leg has no direction there.
UNKNOWN = -2

# Here the least share so far stands in EXCESS. In further rows: which limit that is of, whether all is a number, the
# largest constraint of all legs, whether it is a pose; then, for each cone, the least cosine of all that have the same
# half angle, and whose.
LEAST, BINDING, IS_KNOWN, LARGEST, IS_POSE, CONES = EXCESS, MORE, MORE + 1, MORE + 2, MORE + 3, MORE + 4


@routine
def begin_margins(n_cones: int, n: int, S: Floats) -> None:
    for i in range(n):
        S[LEAST, i], S[BINDING, i], S[IS_KNOWN, i], S[LARGEST, i] = math.inf, -1.0, 1.0, 0.0
        S[IS_POSE, i] = S[MARGIN, i]
    for c in range(n_cones):
        for i in range(n):
            S[CONES + 2 * c, i] = math.inf


@routine
def note_share(column: int, limit: int, n: int, S: Floats) -> None:
    """The share of a limit that stands in a row: the least counts."""
    for i in range(n):
        share, before, binding = S[column, i], S[LEAST, i], S[BINDING, i]
        S[BINDING, i] = float(limit) if share < before else binding
        S[LEAST, i] = share if share < before else before


@routine
def note_bounds(coordinate: Record, limit: int, n: int, S: Floats) -> None:
    """The shares of both bounds of a range, of which the first is called `limit`."""
    lo, hi = coordinate["lo"], coordinate["hi"]
    room = 0.5 * (hi - lo)
    sense, place = coordinate["sense"], VALUES + coordinate["place"]
    more, least, most = turns_of(coordinate)
    for i in range(n):
        value = turned_into(sense * S[place, i] + more, least, most)
        below, above, before, binding = value - lo, hi - value, S[LEAST, i], S[BINDING, i]
        nearer = float(limit + 1) if above < below else float(limit)
        share = share_of(above if above < below else below, room)
        S[BINDING, i] = nearer if share < before else binding
        S[LEAST, i] = share if share < before else before


@routine
def note_cosine(cone: Record, proximal: Record, limit: int, n: int, S: Floats) -> None:
    """The cosine of a rod's angle to the axis of a cone, if it is the least of those with the same half angle."""
    lay_along_cone(cone, proximal, n, S)
    least = CONES + 2 * cone["leader"]
    for i in range(n):
        before, whose = S[least, i], S[least + 1, i]
        cosine = S[VALUE, i] * S[INVERSE, i]
        S[least + 1, i] = float(limit) if cosine < before else whose
        S[least, i] = cosine if cosine < before else before


@routine
def note_cone_group(cones: Records, c: int, n: int, S: Floats) -> None:
    """The share of the narrowest of cones that have the same half angle as this, their leader."""
    least, half_angle = CONES + 2 * c, cones[c]["half_angle"]
    scale = 1.0 / half_angle if half_angle > 0.0 else math.inf
    for i in range(n):
        cosine, whose, before, binding = S[least, i], S[least + 1, i], S[LEAST, i], S[BINDING, i]
        square = (1.0 - cosine) * (1.0 + cosine)
        angle = arctangent(math.sqrt(square if square > 0.0 else 0.0), cosine)
        share = (half_angle - angle) * scale
        S[BINDING, i] = whose if share < before else binding
        S[LEAST, i] = share if share < before else before


@routine
def note_leg(rod: Record, reach: int, closed: int, n: int, S: Floats) -> None:
    """Whether a rod reaches, and whether it closes; `reach` and `closed` are what these limits are called."""
    for i in range(n):
        S[IS_KNOWN, i] = S[IS_KNOWN, i] if (S[LENGTH, i] > 0.0) & (S[LENGTH, i] < math.inf) else 0.0
    if rod["proximal"] == CRANK or rod["proximal"] == CARRIAGE:
        for i in range(n):
            share = -abs(S[VALUES + SLIDE, i]) / rod["length"]
            S[VALUE, i] = share if share < -CLOSE else math.inf
        note_share(VALUE, reach, n, S)
    if has_rows(rod):
        for i in range(n):
            row, before = S[ROW, i], S[LARGEST, i]
            S[VALUE, i] = -row if row > CLOSE else math.inf
            S[LARGEST, i] = row if row > before else before
            S[ROW, i] = 0.0
        note_share(VALUE, closed, n, S)


@routine
def has_rows(rod: Record) -> bool:
    """Whether a rod leaves any constraint on the pose."""
    is_rigid = rod["slides"] == 0 and (rod["proximal"] == NO_PROXIMAL or rod["proximal"] == SHARED)
    return bool(is_rigid or rod["base_end"] == HINGE or rod["platform_end"] == HINGE or rod["twists"] == 1)


@kernel
def margins_in_blocks(
    machine: int,
    targets: Floats,
    begins: Floats,
    sides: Floats,
    follows: int,
    margins: Floats,
    bindings: Ints,
) -> int:
    """Fill what `feasibility.feasibility` does, where all legs are rods that blocks serve; how many are UNKNOWN.

    Parameters
    ----------
    machine : see `open_table`.
    targets : (n, 4, 4) [length].
    follows : whether what the task leaves open changes with what it sets. Then a leg that does not reach a pose as it
        is may reach it completed; else it does not, and blocks tell by how much.
    """
    table = open_table(machine)
    legs, limited, cones, task = table.legs, table.limited, table.cones, table.task
    S, pose, unknown = np.empty((CONES + 2 * cones.shape[0], BLOCK)), np.zeros((4, 4)), 0
    n_legs, n_limits = legs.shape[0], 2 * limited.shape[0] + cones.shape[0]
    enough = CLOSED if task[0]["unset"] > 0 else CLOSE
    for start in range(0, margins.shape[0], BLOCK):
        n = min(BLOCK, margins.shape[0] - start)
        lay_out(targets, begins, task[0], start, n, pose, S)
        begin_margins(cones.shape[0], n, S)
        main, a, c = 0, 0, 0
        for k in range(n_legs):
            if legs[k]["proximal"] != SHARED:
                main = k
            if legs[k]["proximal"] == CRANK or legs[k]["proximal"] == CARRIAGE:
                lay_sides(sides, k, 0, n, S)
            lay_rod(legs[k], legs[main], n, S)
            while a < limited.shape[0] and limited[a]["leg"] == k:
                note_bounds(limited[a], 2 * a, n, S)
                a += 1
            if c < cones.shape[0] and cones[c]["leg"] == k:
                lay_inverse(n, S)
            while c < cones.shape[0] and cones[c]["leg"] == k:
                note_cosine(cones[c], legs[main], 2 * limited.shape[0] + c, n, S)
                c += 1
            note_leg(legs[k], n_limits + k, n_limits + n_legs + k, n, S)
        for c in range(cones.shape[0]):
            if cones[c]["leader"] == c:
                note_cone_group(cones, c, n, S)
        for i in range(n):
            margins[start + i], bindings[start + i] = S[LEAST, i], int(S[BINDING, i])
            is_pose = S[IS_POSE, i] == 1.0
            is_open = follows == 1 if S[MARGIN, i] == 0.0 else task[0]["unset"] > 0 and S[LARGEST, i] > enough
            if not is_pose:
                margins[start + i], bindings[start + i] = math.nan, -1
            elif is_open or S[IS_KNOWN, i] == 0.0:
                bindings[start + i] = UNKNOWN
                unknown += 1
    return unknown
