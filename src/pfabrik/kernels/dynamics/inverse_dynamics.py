"""Forces of actuators that move a machine as it is asked to.

With all motions N of the machine, those that show move the end effector or the actuators; others are idle, and N is
made such that no shown motion has momentum along an idle one: N_i' M N_s = 0. So idle parts move on as the forces on
them will, and do nothing to the rest. The rates z of the shown motions follow from what is asked for, D N z = x, and
their accelerations from D N z' = x' - what the motion itself adds; the forces t of the actuators from virtual power,
N_s' (A' (t + f) + h) = 0, with the loads f of rotors and friction and the work h of masses and other loads.
"""

from __future__ import annotations

from ...common.arrays import Floats
from .._jit import routine, search
from ..joints.first_order import fill_map, orthogonalise_rows, orthonormalise_rows
from ..vectors import Vec, copy_row, cross, dot, vec
from .allowed_motions import add_share, close_gains, close_rates
from .masses import (
    add_gains,
    carry_masses,
    carry_momenta,
    carry_none,
    carry_point,
    put_gains,
    put_opened,
    put_twists,
    put_work,
)
from .moving import (
    ALIGNED,
    ALONE,
    DUTY,
    FREE_PART,
    LEAST,
    LEAST_MASS,
    NOT_HELD,
    NOT_MADE,
    SHOWN,
    SINGULAR,
    TWISTS,
    Exerted,
    MovingMachine,
    MovingScratch,
    open_moving,
    open_moving_scratch,
)
from .placing import place, put_screws
from .signs import put_signs

REGULAR = 1e3
"""Norm of a matrix times that of its inverse up to which no singular value is near none."""


@search
def inverse_dynamics(
    machine: int,
    scratch_address: int,
    coordinates: Floats,
    axes: Floats,
    rates: Floats,
    gains: Floats,
    still: Floats,
    results: Exerted,
) -> None:
    """Fill efforts at joint coordinates (n, columns of q), in L.

    Parameters
    ----------
    machine, scratch_address : see `MovingMachine` and `new_moving_scratch`.
    axes : components of the end effector's twist that are asked for, (n, components, 6); then the columns `asked`.
    rates, gains : of these, and their accelerations, (n, k): of the reference point, and angular.
    still : rates up to which actuators are at rest, see `put_signs`, (n, n_a); or no rows.
    """
    moving, own = open_moving(machine), open_moving_scratch(scratch_address)
    for row in range(coordinates.shape[0]):
        if place(moving, own, coordinates[row]):
            put_screws(moving, own)
            least = still[row] if still.shape[0] > 0 else own.z[:0]
            results.marks[row] = put_efforts(moving, own, axes[row], rates[row], gains[row], least, row, results)


@routine
def put_efforts(
    moving: MovingMachine,
    own: MovingScratch,
    axes: Floats,
    rates: Floats,
    gains: Floats,
    still: Floats,
    row: int,
    results: Exerted,
) -> int:
    """Fill the efforts of a row whose frames and screws are known; its marks."""
    if not close_rates(moving, own):
        return SINGULAR
    put_shown(moving, own)
    let_idle_go(moving, own)
    is_regular = put_following(moving, own, axes)
    marks = put_motion(moving, own, axes, rates, gains)
    wrenches = results.wrenches[row] if results.wrenches.shape[0] > 0 else own.arms[:0]
    put_all_work(moving, own, wrenches)
    n, m = own.z.shape[0], own.work.shape[0]
    size = 0.0
    if m > n or not is_regular:
        for k in range(own.carried.shape[0]):
            for i in range(6):
                size = max(size, abs(own.carried[k, i]))
    if m > n:
        for j in range(n, m):
            own.idle[j - n, m - n] = own.work[j]
        solve_idle(own)
        for i in range(m - n):
            undone = own.work[n + i]
            for j in range(m - n):
                undone -= own.inertia[i, j] * own.idle[j, m - n]
            if abs(undone) > moving.limits[ALIGNED] * size:
                marks |= FREE_PART
        if results.wrenches.shape[0] + results.probes.shape[0] > 0:
            add_motions(own.parameters[:6], n, own.idle, own.dV)
            add_motions(own.by_motions, n, own.idle, own.du)
            put_gains(moving, own, own.dV, own.u, own.du)
            put_all_work(moving, own, wrenches)
    for a in range(own.efforts.shape[0]):
        results.rates[row, a], results.gains[row, a] = own.u[moving.actuated[a]], own.du[moving.actuated[a]]
    put_signs(results.rates[row], still, results.signs[row])
    for a in range(own.efforts.shape[0]):
        taken = moving.drives[a, 1] * results.gains[row, a] + moving.drives[a, 3] * results.rates[row, a]
        taken += moving.drives[a, 2] * results.signs[row, a]
        add_share(-taken / moving.drives[a, 0], own.shown[moving.counts[TWISTS] + a, :n], own.work[:n])
    put_forces(moving, own, results.actuators[row])
    if not is_regular and left_undone(moving, own, results.actuators[row]) > moving.limits[ALIGNED] * size:
        marks |= NOT_HELD
    if results.twists.shape[0] > 0:
        copy_row(own.V[:6], results.twists[row])
    if results.motions.shape[0] > 0:
        for a in range(own.efforts.shape[0]):
            for j in range(n):
                results.motions[row, a, j] = own.shown[moving.counts[TWISTS] + a, j]
    for k in range(moving.probed.shape[0]):
        carry_none(own)
        carry_point(moving, own, moving.probed[k], vec(moving.probes[k]))
        put_work(moving, own)
        put_forces(moving, own, own.efforts)
        for a in range(own.efforts.shape[0]):
            results.probes[row, a, k] = own.efforts[a]
    if results.resting.shape[0] > 0:
        carry_none(own)
        carry_masses(moving, own, own.arms[:0], False)
        put_work(moving, own)
        put_forces(moving, own, results.resting[row])
    if results.matrices.shape[0] > 0:
        put_matrix(moving, own, results.matrices[row])
    return marks


@routine
def put_all_work(moving: MovingMachine, own: MovingScratch, wrenches: Floats) -> None:
    """Fill the work of masses in motion and of other loads."""
    carry_none(own)
    carry_masses(moving, own, wrenches, True)
    put_work(moving, own)


@routine
def put_shown(moving: MovingMachine, own: MovingScratch) -> None:
    """Fill the twist of the end effector and the rates of actuators by motions, and put those that show first.

    By elimination of columns, the largest entry first.
    """
    shown, twists = own.shown, moving.counts[TWISTS]
    m = shown.shape[1]
    for j in range(m):
        for i in range(twists):
            shown[i, j] = own.parameters[i, j]
        for a in range(moving.actuated.shape[0]):
            shown[twists + a, j] = own.by_motions[moving.actuated[a], j]
    for k in range(moving.counts[SHOWN] if moving.counts[SHOWN] < m else 0):
        best, row, at = 0.0, 0, k
        for i in range(shown.shape[0]):
            for j in range(k, m):
                if abs(shown[i, j]) > best:
                    best, row, at = abs(shown[i, j]), i, j
        if best == 0.0:
            return
        if at != k:
            swap_columns(shown, at, k)
            swap_columns(own.parameters[:6], at, k)
            swap_columns(own.by_motions, at, k)
        for j in range(k + 1, m):
            factor = -shown[row, j] / shown[row, k]
            if factor != 0.0:
                add_column(shown, factor, k, j)
                add_column(own.parameters[:6], factor, k, j)
                add_column(own.by_motions, factor, k, j)
                shown[row, j] = 0.0


@routine
def swap_columns(table: Floats, a: int, b: int) -> None:
    """Swap two columns."""
    for i in range(table.shape[0]):
        table[i, a], table[i, b] = table[i, b], table[i, a]


@routine
def add_column(table: Floats, factor: float, source: int, to: int) -> None:
    """Add a multiple of a column to another."""
    for i in range(table.shape[0]):
        table[i, to] += factor * table[i, source]


@routine
def let_idle_go(moving: MovingMachine, own: MovingScratch) -> None:
    """Factor the mass matrix of the idle motions, and take off the others what has momentum along these."""
    n, m = own.z.shape[0], own.work.shape[0]
    for i in range(m - n):
        put_column_of(own.parameters[:6], n + i, own.V)
        put_column_of(own.by_motions, n + i, own.u)
        put_twists(moving, own, own.V, own.u)
        carry_none(own)
        carry_momenta(moving, own)
        put_work(moving, own)
        for j in range(m - n):
            own.idle[i, j] = own.inertia[i, j] = own.work[n + j]
        for j in range(n):
            own.coupling[i, j] = own.work[j]
    for j in range(m - n):  # the factors L D L'; what has no inertia stays
        for k in range(j):
            own.idle[j, j] -= own.idle[j, k] * own.idle[j, k] * own.idle[k, k]
        if own.idle[j, j] <= moving.limits[LEAST_MASS]:
            own.idle[j, j] = 0.0
        for i in range(j + 1, m - n):
            for k in range(j):
                own.idle[i, j] -= own.idle[i, k] * own.idle[j, k] * own.idle[k, k]
            own.idle[i, j] = own.idle[i, j] / own.idle[j, j] if own.idle[j, j] > 0.0 else 0.0
    for j in range(n if m > n else 0):
        for i in range(m - n):
            own.idle[i, m - n] = -own.coupling[i, j]
        solve_idle(own)
        for i in range(m - n):
            if own.idle[i, m - n] != 0.0:
                add_column(own.parameters[:6], own.idle[i, m - n], n + i, j)
                add_column(own.by_motions, own.idle[i, m - n], n + i, j)


@routine
def solve_idle(own: MovingScratch) -> None:
    """Solve for the last column of `idle` by the factors before it."""
    A = own.idle
    n = A.shape[0]
    for i in range(n):
        for k in range(i):
            A[i, n] -= A[i, k] * A[k, n]
    for i in range(n - 1, -1, -1):
        A[i, n] = A[i, n] / A[i, i] if A[i, i] > 0.0 else 0.0
        for k in range(i + 1, n):
            A[i, n] -= A[k, i] * A[k, n]


@routine
def put_column_of(table: Floats, j: int, column: Floats) -> None:
    """Copy a column."""
    for i in range(table.shape[0]):
        column[i] = table[i, j]


@routine
def add_motions(table: Floats, first: int, rates: Floats, to: Floats) -> None:
    """Add motions from column `first` on, at rates that are the last column of a table."""
    for i in range(table.shape[0]):
        for j in range(rates.shape[0]):
            to[i] += table[i, first + j] * rates[j, rates.shape[1] - 1]


@routine
def put_following(moving: MovingMachine, own: MovingScratch, axes: Floats) -> bool:
    """Fill the shown motions by what is asked for, and by actuators: the least rates; True where both are inverses."""
    n, first, twists = own.z.shape[0], axes.shape[0], moving.counts[TWISTS]
    drives = own.shown[twists:]
    for k in range(own.asked.shape[0]):
        for j in range(n):
            own.asked[k, j] = own.by_motions[moving.asked[k - first], j] if k >= first else 0.0
        for i in range(6 if k < first else 0):
            add_share(axes[k, i], own.parameters[i, :n], own.asked[k])
    if drives.shape[0] == n and own.asked.shape[0] == n and invert(own, drives, own.by_actuators):
        if moving.counts[ALONE] == 1:
            for i in range(n):
                for j in range(n):
                    own.following[i, j] = own.by_actuators[i, j]
            return True
        if invert(own, own.asked, own.following):
            return True
    put_least(moving, own)
    return False


@routine
def invert(own: MovingScratch, A: Floats, inverse: Floats) -> bool:
    """Fill the inverse of the first columns of A; False where this is not regular."""
    square = own.square
    n, one, other = square.shape[0], 0.0, 0.0
    for i in range(n):
        for j in range(n):
            square[i, j] = A[i, j]
            square[i, n + j] = 1.0 if i == j else 0.0
            one += A[i, j] * A[i, j]
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(square[i, j]) > abs(square[best, j]):
                best = i
        if not abs(square[best, j]) > 0.0:
            return False
        if best != j:
            for k in range(2 * n):
                square[j, k], square[best, k] = square[best, k], square[j, k]
        factor = 1.0 / square[j, j]
        for k in range(j, 2 * n):
            square[j, k] *= factor
        for i in range(n):
            factor = square[i, j]
            if i != j and factor != 0.0:
                for k in range(j, 2 * n):
                    square[i, k] -= factor * square[j, k]
    for i in range(n):
        for j in range(n):
            inverse[i, j] = square[i, n + j]
            other += inverse[i, j] * inverse[i, j]
    return one * other < REGULAR**2 and other < REGULAR**4


@routine
def put_least(moving: MovingMachine, own: MovingScratch) -> None:
    """Fill the least motions, by their twists and actuator rates, for what is asked for, and by actuators."""
    table, sizes, twists, least = own.table, own.sizes, moving.counts[TWISTS], moving.limits[LEAST]
    width, n, k = own.shown.shape[0], own.z.shape[0], own.asked.shape[0]
    fill_table(own)
    if not orthonormalise_rows(table, 0, width):
        fill_table(own)
        orthogonalise_rows(table, 0, width, sizes)
        for i in range(n):
            for j in range(table.shape[1]):
                table[i, j] = table[i, j] / sizes[i] if sizes[i] > least else 0.0
    orthogonalise_rows(table, width, width + k, sizes)
    fill_map(table, width, width + k, n, least * max(least, sizes[0]) if n > 0 else 0.0, sizes, own.following)
    orthogonalise_rows(table, twists, width, sizes)
    fill_map(table, twists, width + k, n, least, sizes, own.by_actuators)


@routine
def fill_table(own: MovingScratch) -> None:
    """Fill a row for each shown motion: what it shows, what of it is asked for, and itself."""
    width, k = own.shown.shape[0], own.asked.shape[0]
    for i in range(own.table.shape[0]):
        for j in range(own.table.shape[1]):
            own.table[i, j] = 0.0
        for j in range(width):
            own.table[i, j] = own.shown[j, i]
        for j in range(k):
            own.table[i, width + j] = own.asked[j, i]
        own.table[i, width + k + i] = 1.0


@routine
def put_motion(moving: MovingMachine, own: MovingScratch, axes: Floats, rates: Floats, gains: Floats) -> int:
    """Fill rates and accelerations of all columns and frames; NOT_MADE where they are not those asked for."""
    first, marks = axes.shape[0], 0
    for j in range(own.V.shape[0]):
        own.V[j] = own.dV[j] = 0.0
    for j in range(own.u.shape[0]):
        own.u[j] = own.du[j] = 0.0
    marks |= follow(moving, own, rates, own.V, own.u)
    put_twists(moving, own, own.V, own.u)
    put_gains(moving, own, own.dV, own.u, own.du)
    put_opened(moving, own)
    close_gains(moving, own)
    turning = cross(vec(own.V[3:]), vec(own.V))
    if own.asked.shape[0] < own.z.shape[0]:
        rest(moving, own, turning)
    for k in range(own.asked.shape[0]):
        if k >= first:
            own.wanted[k] = gains[k] - own.du[moving.asked[k - first]]
        else:
            own.wanted[k] = gains[k] - dot(vec(axes[k]), turning)
        for i in range(6 if k < first else 0):
            own.wanted[k] -= axes[k, i] * own.dV[i]
    marks |= follow(moving, own, own.wanted, own.dV, own.du)
    add_gains(moving, own, own.dV, own.du)
    return marks


@routine
def rest(moving: MovingMachine, own: MovingScratch, turning: Vec) -> None:
    """Take off the accelerations what moves end effector and actuators, as far as the machine may."""
    table, twists, width = own.table, moving.counts[TWISTS], own.shown.shape[0]
    for j in range(own.z.shape[0]):
        own.z[j] = 0.0
    for i in range(table.shape[0]):
        share = table[i, 0] * turning[0] + table[i, 1] * turning[1] + table[i, 2] * turning[2]
        for j in range(width):
            share += table[i, j] * (own.dV[j] if j < twists else own.du[moving.actuated[j - twists]])
        for j in range(own.z.shape[0]):
            own.z[j] -= share * table[i, width + own.asked.shape[0] + j]
    add_motion(own, own.dV, own.du)


@routine
def add_motion(own: MovingScratch, V: Floats, u: Floats) -> None:
    """Add the shown motions at rates z."""
    add_rates(own.parameters[:6], own.z, V)
    add_rates(own.by_motions, own.z, u)


@routine
def add_rates(motions: Floats, z: Floats, to: Floats) -> None:
    """Add what the first motions of a table move."""
    for i in range(motions.shape[0]):
        rate = to[i]
        for j in range(z.shape[0]):
            rate += motions[i, j] * z[j]
        to[i] = rate


@routine
def follow(moving: MovingMachine, own: MovingScratch, wanted: Floats, V: Floats, u: Floats) -> int:
    """Add the motion that makes what is wanted; NOT_MADE where none does."""
    n, largest, worst = own.z.shape[0], 0.0, 0.0
    for j in range(n):
        own.z[j] = 0.0
    add_rates(own.following, wanted, own.z)
    add_motion(own, V, u)
    for k in range(wanted.shape[0] if moving.counts[DUTY] == 1 else 0):
        made = -wanted[k]
        for j in range(n):
            made += own.asked[k, j] * own.z[j]
        largest, worst = max(largest, abs(wanted[k])), max(worst, abs(made))
    return NOT_MADE if worst > moving.limits[ALIGNED] * largest else 0


@routine
def put_forces(moving: MovingMachine, own: MovingScratch, forces: Floats) -> None:
    """Fill the least forces that balance the work, in N and N m."""
    for a in range(forces.shape[0]):
        force = 0.0
        for j in range(own.z.shape[0]):
            force -= own.by_actuators[j, a] * own.work[j]
        forces[a] = force * moving.drives[a, 0]


@routine
def left_undone(moving: MovingMachine, own: MovingScratch, forces: Floats) -> float:
    """The largest work by a shown motion that the forces leave."""
    worst = 0.0
    for j in range(own.z.shape[0]):
        undone = own.work[j]
        for a in range(forces.shape[0]):
            undone += own.shown[moving.counts[TWISTS] + a, j] * forces[a] / moving.drives[a, 0]
        worst = max(worst, abs(undone))
    return worst


@routine
def put_matrix(moving: MovingMachine, own: MovingScratch, matrix: Floats) -> None:
    """Fill the mass matrix of what is asked for, rotors included."""
    n, k = own.z.shape[0], matrix.shape[0]
    for j in range(n):
        put_column_of(own.parameters[:6], j, own.V)
        put_column_of(own.by_motions, j, own.u)
        put_twists(moving, own, own.V, own.u)
        carry_none(own)
        carry_momenta(moving, own)
        put_work(moving, own)
        for a in range(own.efforts.shape[0]):
            rates = own.shown[moving.counts[TWISTS] + a, :n]
            add_share(moving.drives[a, 1] / moving.drives[a, 0] * rates[j], rates, own.work[:n])
        for i in range(k):
            own.product[j, i] = 0.0
            for other in range(n):
                own.product[j, i] += own.work[other] * own.following[other, i]
    for i in range(k):
        for j in range(k):
            matrix[i, j] = 0.0
            for other in range(n):
                matrix[i, j] += own.following[other, i] * own.product[other, j]
