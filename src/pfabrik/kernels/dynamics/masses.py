"""Masses in motion: twists and accelerations along the trees, and the wrenches that masses resist with.

With the screws s and rates u of its columns, a frame has V = V_before + s u, A = A_before + s u' + V_before x s u, at a
point that rests. The axes of a ball are those of the base; its centre moves with the frame before it. A mass m with
its centre at r, and inertia I about it, resists with the force f = m (g - a_r), and the moment r x f - I w' - w x I w.
"""

from __future__ import annotations

from ...common.arrays import Floats
from .._jit import inlined, routine
from ..joints.loops import BALL
from ..vectors import Vec, add, along, cross, put, scale, sub, turn, vec
from .moving import BASE, COLUMN, END, FIRST, FROM, KIND, PARENT, ROWS, TO, MovingMachine, MovingScratch
from .placing import point_of


@routine
def put_twists(moving: MovingMachine, own: MovingScratch, V: Floats, u: Floats) -> None:
    """Fill the twists of all frames."""
    spread(moving, own, V, u, own.twists)


@routine
def spread(moving: MovingMachine, own: MovingScratch, V: Floats, u: Floats, twists: Floats) -> None:
    """Fill twists of all frames by that of the end effector and by rates."""
    for i in range(6):
        twists[BASE, i], twists[END, i] = 0.0, V[i]
    for k in range(moving.units.shape[0]):
        before, after = twists[moving.units[k, PARENT]], twists[FIRST + k]
        v, w = twist_of(moving, own, k, u)
        put(after, add(vec(before), v))
        put(after[3:], add(vec(before[3:]), w))


@inlined
def twist_of(moving: MovingMachine, own: MovingScratch, k: int, u: Floats) -> tuple[Vec, Vec]:
    """The twist that a unit motion adds."""
    column = moving.units[k, COLUMN]
    v, w = scale(u[column], vec(own.screws[column])), scale(u[column], vec(own.screws[column, 3:]))
    for i in range(1, 3 if moving.units[k, KIND] == BALL else 1):
        v = along(v, u[column + i], vec(own.screws[column + i]))
        w = along(w, u[column + i], vec(own.screws[column + i, 3:]))
    return v, w


@routine
def put_gains(moving: MovingMachine, own: MovingScratch, dV: Floats, u: Floats, du: Floats) -> None:
    """Fill the accelerations of all frames, whose twists are known."""
    for i in range(6):
        own.gains[BASE, i], own.gains[END, i] = 0.0, dV[i]
    for k in range(moving.units.shape[0]):
        parent = moving.units[k, PARENT]
        v, w = twist_of(moving, own, k, u)
        carrier, turning = vec(own.twists[parent]), vec(own.twists[parent, 3:])
        a, b = twist_of(moving, own, k, du)
        if moving.units[k, KIND] == BALL:
            centre = point_of(own, parent, vec(moving.points[k]))
            a = add(a, cross(add(carrier, cross(turning, centre)), w))
        else:
            a, b = add(a, add(cross(turning, v), cross(carrier, w))), add(b, cross(turning, w))
        put(own.gains[FIRST + k], add(vec(own.gains[parent]), a))
        put(own.gains[FIRST + k, 3:], add(vec(own.gains[parent, 3:]), b))


@routine
def add_gains(moving: MovingMachine, own: MovingScratch, dV: Floats, du: Floats) -> None:
    """Add accelerations of parameters and columns to those of all frames."""
    spread(moving, own, dV, du, own.carried)
    for k in range(own.gains.shape[0]):
        for i in range(6):
            own.gains[k, i] += own.carried[k, i]


@routine
def put_opened(moving: MovingMachine, own: MovingScratch) -> None:
    """Fill by how much the accelerations of frames open the cuts."""
    row = 0
    for cut in range(moving.cuts.shape[0] - 1):
        one, other = moving.cuts[cut, FROM], moving.cuts[cut, TO]
        if moving.cuts[cut, ROWS] == 3:
            x = point_of(own, one, vec(moving.cut_points[cut]))
            put(own.opened[row:], sub(point_gain(own, other, x), point_gain(own, one, x)))
            row += 3
        else:
            for i in range(6):
                own.opened[row + i] = own.gains[other, i] - own.gains[one, i]
            row += 6


@inlined
def point_gain(own: MovingScratch, frame: int, x: Vec) -> Vec:
    """The acceleration of a point of a frame."""
    v, w = vec(own.twists[frame]), vec(own.twists[frame, 3:])
    a = add(vec(own.gains[frame]), cross(vec(own.gains[frame, 3:]), x))
    return add(a, cross(w, add(v, cross(w, x))))


@routine
def carry_none(own: MovingScratch) -> None:
    """Forget what frames carry."""
    for k in range(own.carried.shape[0]):
        for i in range(6):
            own.carried[k, i] = 0.0


@routine
def carry(own: MovingScratch, frame: int, force: Vec, moment: Vec) -> None:
    """Add a wrench on a frame."""
    put(own.carried[frame], add(vec(own.carried[frame]), force))
    put(own.carried[frame, 3:], add(vec(own.carried[frame, 3:]), moment))


@routine
def carry_masses(moving: MovingMachine, own: MovingScratch, wrenches: Floats, moves: bool) -> None:
    """Put on frames what masses resist with, by twists and accelerations or at rest, and other loads."""
    is_asked, b = wrenches.shape[0] > 0, moving.frames.shape[0]
    for k in range(b):
        frame, arm, m = moving.frames[k], vec(own.arms[k]), moving.masses[k]
        force, moment = scale(m, vec(moving.gravity)), (0.0, 0.0, 0.0)
        if moves:
            w, dw = vec(own.twists[frame, 3:]), vec(own.gains[frame, 3:])
            force = along(force, -m, point_gain(own, frame, arm))
            moment = scale(-1.0, add(turn(own.turned[k], dw), cross(w, turn(own.turned[k], w))))
        moment = add(moment, cross(arm, force))
        carry(own, frame, force, moment)
        if is_asked:
            put(wrenches[k], force)
            put(wrenches[k, 3:], moment)
    for k in range(moving.loaded.shape[0]):
        force = vec(moving.loads[k])
        moment = add(
            vec(moving.loads[k, 3:]), cross(point_of(own, moving.loaded[k], vec(moving.load_points[k])), force)
        )
        carry(own, moving.loaded[k], force, moment)
        if is_asked:
            put(wrenches[b + k], force)
            put(wrenches[b + k, 3:], moment)


@routine
def carry_point(moving: MovingMachine, own: MovingScratch, frame: int, point: Vec) -> None:
    """Put on a frame what 1 kg at a point of it, given at home, resists with."""
    arm = point_of(own, frame, point)
    force = sub(vec(moving.gravity), point_gain(own, frame, arm))
    carry(own, frame, force, cross(arm, force))


@routine
def carry_momenta(moving: MovingMachine, own: MovingScratch) -> None:
    """Put on frames the momenta of masses by the twists."""
    for k in range(moving.frames.shape[0]):
        frame, arm = moving.frames[k], vec(own.arms[k])
        w = vec(own.twists[frame, 3:])
        force = scale(moving.masses[k], add(vec(own.twists[frame]), cross(w, arm)))
        carry(own, frame, force, add(cross(arm, force), turn(own.turned[k], w)))


@routine
def put_work(moving: MovingMachine, own: MovingScratch) -> None:
    """Fill the work of what frames carry by columns, h, and by motions; what they carry becomes that of all beyond."""
    for k in range(moving.units.shape[0] - 1, -1, -1):
        column, parent, carried = moving.units[k, COLUMN], moving.units[k, PARENT], own.carried[FIRST + k]
        for i in range(3 if moving.units[k, KIND] == BALL else 1):
            own.h[column + i] = product(own.screws[column + i], carried)
        for i in range(6):
            own.carried[parent, i] += carried[i]
    for j in range(own.work.shape[0]):
        work = 0.0
        for i in range(6):
            work += own.carried[END, i] * own.parameters[i, j]
        for k in range(own.h.shape[0]):
            work += own.h[k] * own.by_motions[k, j]
        own.work[j] = work


@inlined
def product(a: Floats, b: Floats) -> float:
    """a . b of six numbers."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
