"""Forward kinematics of six rods with given base ends and lengths, by blocks of rows: loops over columns vectorise.

The steps are those of `forward.newton`, and end in the same assembly modes. The legs' closed forms are then asked about
the poses. Rows that do not contract at once, or that these do not reach with the same actuators, are PENDING.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from ...common.arrays import Floats, Ints
from .._jit import inlined, kernel, routine
from ..legs.blocks import answer_blocks
from ..legs.columns import PX, PY, PZ, XX, XY, XZ, YX, YY, YZ, ZX, ZY, ZZ
from ..legs.records import COSINE, N_VALUES, Q_PROXIMAL, SINE, Table, open_table
from ..legs.rods import base_end_of
from ..rows import PENDING, REACHED, RESIDUAL
from ..search_constants import BELIEVED, CONTRACTION, FARTHEST_TURN, NEWTON_STEP
from ..vectors import Vec, add, along, copy_row, cross, dot, move, scale, sub, vec, wrap
from .equations import owner_of
from .forward import open_starts, put_deviations
from .pose_constants import ASSEMBLED, BLOCK_STEPS, NEARLY_ASSEMBLED
from .search_records import Starts

COLUMNS = 32
"""Rows of a block: what is in work fits the first-level cache."""

# Rows of the table, after those of a pose, whose position is that of the joints' centre: a step; the largest residual,
# that before, and the longest step that contracts; its state. Then those of each rod: its line, its moment
# about the reference point, its length times its error; its base end and its length.
VX, VY, VZ, WX, WY, WZ, WORST, PREVIOUS, LONGEST, STATE, RODS = range(12, 23)
DX, DY, DZ, MX, MY, MZ, ERROR, BASE_X, BASE_Y, BASE_Z, LENGTH, OF_ROD = range(12)
FAILED, GOING, DONE = 0.0, 1.0, 2.0

SINES = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(8))
COSINES = tuple((-1.0) ** k / math.factorial(2 * k + 2) for k in range(8))
"""Series of sin(t) / t and (1 - cos t) / t^2 in t^2, to the last digit up to 0.9 rad."""

Three: TypeAlias = tuple[Vec, Vec, Vec]


@routine
def fill_block(
    table: Table, places: Ints, deviations: Floats, starts: Starts, first: int, S: Floats, values: Floats, ends: Starts
) -> None:
    """Fill a block with the starts of its rows and with the rods as their actuators have them; `q` and `sides` of ends.

    Parameters
    ----------
    deviations : of the actuators from home, (n, n_a) [L or rad].
    values : scratch memory, (legs, N_VALUES).
    """
    legs, centre = table.legs, vec(table.task[0]["centre"])
    for i in range(deviations.shape[0]):
        own = first + i if starts.poses.shape[0] > 1 else 0
        pose, q = starts.poses[own], ends.q[first + i]
        copy_row(starts.sides[own], ends.sides[first + i])
        S[PX, i], S[PY, i], S[PZ, i] = move(pose, centre)
        for j in range(9):
            S[XX + j, i] = pose[j // 3, j % 3]
        S[WORST, i], S[PREVIOUS, i], S[LONGEST, i], S[STATE, i] = 0.0, math.inf, math.inf, GOING
        for k in range(legs.shape[0]):
            q[k], S[RODS + OF_ROD * places[k] + LENGTH, i] = 0.0, legs[k]["length"]
        for a in range(table.driven.shape[0]):
            k, change = table.driven[a]["leg"], table.driven[a]["sense"] * deviations[i, table.driven[a]["column"]]
            if table.driven[a]["place"] == Q_PROXIMAL:
                if starts.q.shape[0] > 0:
                    turn = change - starts.q[own, k]
                    if abs(wrap(turn, 0.0) if table.driven[a]["turns"] == 1 else turn) > FARTHEST_TURN:
                        S[STATE, i] = FAILED
                q[k], values[k, Q_PROXIMAL], values[k, COSINE], values[k, SINE] = (
                    change,
                    change,
                    math.cos(change),
                    math.sin(change),
                )
            else:
                S[RODS + OF_ROD * places[k] + LENGTH, i] += change
        for k in range(legs.shape[0]):
            owner, base_end = owner_of(table, k), RODS + OF_ROD * places[k] + BASE_X
            S[base_end, i], S[base_end + 1, i], S[base_end + 2, i] = base_end_of(legs[k], legs[owner], values[owner])


@routine
def fill_rod(point: Vec, centre: Vec, n: int, S: Floats, rod: Floats) -> None:
    """Fill the equation of a rod at the poses of a block, times its length, and raise WORST to its error."""
    arm = sub(point, centre)
    for i in range(n):
        x, y, z = (S[XX, i], S[XY, i], S[XZ, i]), (S[YX, i], S[YY, i], S[YZ, i]), (S[ZX, i], S[ZY, i], S[ZZ, i])
        foot = rod[BASE_X, i], rod[BASE_Y, i], rod[BASE_Z, i]
        line = add(products(arm, (x, y, z)), sub((S[PX, i], S[PY, i], S[PZ, i]), foot))
        moment, length = cross(products(point, (x, y, z)), line), math.sqrt(dot(line, line))
        error, worst = rod[LENGTH, i] - length, S[WORST, i]
        rod[DX, i], rod[DY, i], rod[DZ, i], rod[ERROR, i] = line[0], line[1], line[2], length * error
        rod[MX, i], rod[MY, i], rod[MZ, i] = moment[0], moment[1], moment[2]
        size = abs(error) if abs(error) < math.inf else math.inf
        S[WORST, i] = size if size > worst else worst


@routine
def note_assembled(n: int, S: Floats) -> int:
    """Note which columns are assembled; the number of those that go on."""
    n_going = 0
    for i in range(n):
        worst, state = S[WORST, i], S[STATE, i]
        is_done = (worst <= ASSEMBLED) | ((worst <= NEARLY_ASSEMBLED) & (worst > 0.5 * S[PREVIOUS, i]))
        S[STATE, i] = DONE if (state == GOING) & is_done else state
        n_going += 1 if (state == GOING) & (not is_done) else 0
    return n_going


@inlined
def products(a: Vec, rows: Three) -> Vec:
    """The products of a vector with three others."""
    return dot(a, rows[0]), dot(a, rows[1]), dot(a, rows[2])


@inlined
def combined(shares: Vec, rows: Three) -> Vec:
    """A sum of three vectors with factors."""
    return along(along(scale(shares[0], rows[0]), shares[1], rows[1]), shares[2], rows[2])


@inlined
def dual(a: Vec, b: Vec, c: Vec) -> Three:
    """The vectors whose combination has given products with three others; not numbers if these are in a plane."""
    volume = dot(a, cross(b, c))
    inverse = 1.0 / volume if volume != 0.0 else math.nan
    return scale(inverse, cross(b, c)), scale(inverse, cross(c, a)), scale(inverse, cross(a, b))


@inlined
def three(row: int, i: int, S: Floats) -> Vec:
    """Three rows of a column."""
    return S[row, i], S[row + 1, i], S[row + 2, i]


@routine
def solve_steps(n: int, S: Floats) -> None:
    """Solve the equations for the steps: three rods tell the translation by the rotation, the others the rotation."""
    A, B, C, D, E, F = RODS, RODS + OF_ROD, RODS + 2 * OF_ROD, RODS + 3 * OF_ROD, RODS + 4 * OF_ROD, RODS + 5 * OF_ROD
    for i in range(n):
        u, v, w = three(A + MX, i, S), three(B + MX, i, S), three(C + MX, i, S)
        by = dual(three(A, i, S), three(B, i, S), three(C, i, S))
        shift = combined((S[A + ERROR, i], S[B + ERROR, i], S[C + ERROR, i]), by)
        x, y, z = combined((u[0], v[0], w[0]), by), combined((u[1], v[1], w[1]), by), combined((u[2], v[2], w[2]), by)
        d, e, f = three(D, i, S), three(E, i, S), three(F, i, S)
        g = sub(three(D + MX, i, S), products(d, (x, y, z)))
        h = sub(three(E + MX, i, S), products(e, (x, y, z)))
        k = sub(three(F + MX, i, S), products(f, (x, y, z)))
        errors = sub((S[D + ERROR, i], S[E + ERROR, i], S[F + ERROR, i]), products(shift, (d, e, f)))
        turn = combined(errors, dual(g, h, k))
        shift = sub(shift, combined(turn, (x, y, z)))
        S[VX, i], S[VY, i], S[VZ, i] = shift[0], shift[1], shift[2]
        S[WX, i], S[WY, i], S[WZ, i] = turn[0], turn[1], turn[2]


@inlined
def turned(a: Vec, w: Vec) -> Vec:
    """A vector turned by a rotation vector of at most 0.9 rad."""
    across = cross(w, a)
    return along(along(a, series(SINES, dot(w, w)), across), series(COSINES, dot(w, w)), cross(w, across))


@inlined
def series(a: tuple[float, ...], x: float) -> float:
    """A polynomial of the seventh degree."""
    return ((((((a[7] * x + a[6]) * x + a[5]) * x + a[4]) * x + a[3]) * x + a[2]) * x + a[1]) * x + a[0]


@routine
def take_steps(centre: Vec, n: int, share: float, S: Floats) -> None:
    """Take the steps of columns that go on; where steps do not contract, or are too long, a column fails.

    Parameters
    ----------
    share : of these steps that the next ones are at most long.
    """
    for i in range(n):
        a, b, c = (S[XX, i], S[YX, i], S[ZX, i]), (S[XY, i], S[YY, i], S[ZY, i]), (S[XZ, i], S[YZ, i], S[ZZ, i])
        v, w, worst, state = three(VX, i, S), three(WX, i, S), S[WORST, i], S[STATE, i]
        size = math.sqrt(dot(v, v) + dot(w, w))
        v = add(v, cross(w, combined(centre, (a, b, c))))
        is_short = (abs(v[0]) <= NEWTON_STEP) & (abs(v[1]) <= NEWTON_STEP) & (abs(v[2]) <= NEWTON_STEP)
        is_short = is_short & (abs(w[0]) <= NEWTON_STEP) & (abs(w[1]) <= NEWTON_STEP) & (abs(w[2]) <= NEWTON_STEP)
        moves = (state == GOING) & is_short & ((size <= S[LONGEST, i]) | (worst <= NEARLY_ASSEMBLED))
        S[STATE, i] = state if moves | (state == DONE) else FAILED
        S[PREVIOUS, i], S[LONGEST, i], S[WORST, i] = worst, share * size, (0.0 if moves else worst)
        S[PX, i] += v[0] if moves else 0.0
        S[PY, i] += v[1] if moves else 0.0
        S[PZ, i] += v[2] if moves else 0.0
        w = (w[0] if moves else 0.0, w[1] if moves else 0.0, w[2] if moves else 0.0)
        a, b, c = turned(a, w), turned(b, w), turned(c, w)
        S[XX, i], S[YX, i], S[ZX, i] = a[0], a[1], a[2]
        S[XY, i], S[YY, i], S[ZY, i] = b[0], b[1], b[2]
        S[XZ, i], S[YZ, i], S[ZZ, i] = c[0], c[1], c[2]


@kernel
def assemble_in_blocks(
    machine: int,
    places: Ints,
    values: Floats,
    starts_address: int,
    status: Ints,
    deviations: Floats,
    ends: Starts,
    measures: Floats,
) -> int:
    """Assemble rows as `forward.assemble` does those whose steps contract at once; the number of rows left PENDING.

    Parameters
    ----------
    machine : address of the kernel table, of six rods whose base ends and lengths the actuators give.
    places : the place of each rod; the lines of the three at first places span space.
    """
    table, starts, n_left, n_rows = open_table(machine), open_starts(starts_address), 0, values.shape[0]
    poses, places_rods = ends.poses, False
    for a in range(table.driven.shape[0]):
        places_rods = places_rods or table.driven[a]["place"] == Q_PROXIMAL
    length, centre = table.task[0]["length"], vec(table.task[0]["centre"])
    S, leg_values = np.empty((RODS + 6 * OF_ROD, COLUMNS)), np.zeros((6, N_VALUES))
    found, actuators = np.empty(n_rows, np.int64), np.empty((n_rows, values.shape[1]))
    for first in range(0, n_rows, COLUMNS):
        n = min(COLUMNS, n_rows - first)
        for row in range(first, first + n):
            put_deviations(table, values[row], deviations[row])
        fill_block(table, places, deviations[first : first + n], starts, first, S, leg_values, ends)
        for step in range(BLOCK_STEPS):
            for k in range(6):
                rod = RODS + OF_ROD * places[k]
                fill_rod(vec(table.legs[k]["platform_end_point"]), centre, n, S, S[rod : rod + OF_ROD])
            if note_assembled(n, S) == 0:
                break
            solve_steps(n, S)
            take_steps(centre, n, BELIEVED if places_rods and step == 0 else CONTRACTION, S)
        for i in range(n):
            pose, status[first + i] = poses[first + i], REACHED if S[STATE, i] == DONE else PENDING
            for j in range(3):
                arm = dot(three(XX + 3 * j, i, S), centre)
                pose[j, 0], pose[j, 1], pose[j, 2] = three(XX + 3 * j, i, S)
                pose[j, 3], pose[3, j] = (S[PX + j, i] - arm) * length, 0.0
            pose[3, 3] = 1.0
    answer_blocks(machine, poses, poses, starts.sides, found, poses, actuators, measures)
    for a in range(table.driven.shape[0]):
        column, unit = table.driven[a]["column"], length / table.driven[a]["unit"]
        for row in range(n_rows):
            missed = unit * abs(actuators[row, column] - values[row, column])
            measures[row, RESIDUAL] = max(measures[row, RESIDUAL], missed)
    for row in range(n_rows):
        is_confirmed = found[row] == REACHED and measures[row, RESIDUAL] <= NEARLY_ASSEMBLED * length
        status[row] = status[row] if is_confirmed else PENDING
        n_left += 0 if status[row] == REACHED else 1
    return n_left
