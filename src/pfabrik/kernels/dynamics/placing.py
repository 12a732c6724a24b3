"""Frames and screws of moving bodies at joint coordinates."""

from __future__ import annotations

import math

from ...common.arrays import Floats, Ints
from .._jit import inlined, routine
from ..joints.loops import BALL, SLIDE
from ..joints.path_kinematics import turn_about
from ..quaternions import exponential
from ..vectors import Vec, cross, dot, move, put, scale, sub, turn, vec
from .moving import BASE, COLUMN, COORDINATE, END, FIRST, KIND, PARENT, SENSE, MovingMachine, MovingScratch


@routine
def place(moving: MovingMachine, own: MovingScratch, q: Floats) -> bool:
    """Pose all frames at coordinates (columns of q,), in L; False if one is NaN."""
    for k in range(q.shape[0]):
        if q[k] != q[k]:
            return False
    for i in range(3):
        for j in range(4):
            own.T[END, i, j] = 1.0 if i == j else 0.0
    for k in range(moving.way.shape[0]):
        step(moving.way[k], moving.way_axes[k], moving.way_points[k], q, own.T[END])
    place_beyond(moving, own, q)
    return True


@routine
def place_beyond(moving: MovingMachine, own: MovingScratch, q: Floats) -> None:
    """Pose all frames but that of the end effector, which is there, at the coordinates of their unit motions, in L."""
    for i in range(3):
        for j in range(4):
            own.T[BASE, i, j] = 1.0 if i == j else 0.0
    for k in range(moving.units.shape[0]):
        before, after = own.T[moving.units[k, PARENT]], own.T[FIRST + k]
        for i in range(3):
            for j in range(4):
                after[i, j] = before[i, j]
        step(moving.units[k], moving.axes[k], moving.points[k], q, after)


@inlined
def step(unit: Ints, axis: Floats, point: Floats, q: Floats, T: Floats) -> None:
    """Move a frame by a unit motion."""
    sense, first = float(unit[SENSE]), unit[COORDINATE]
    if unit[KIND] == SLIDE:
        for i in range(3):
            T[i, 3] += sense * q[first] * (T[i, 0] * axis[0] + T[i, 1] * axis[1] + T[i, 2] * axis[2])
        return
    if unit[KIND] == BALL:
        w, x, y, z = exponential(q[first], q[first + 1], q[first + 2])
    else:
        half = 0.5 * q[first]
        sine = math.sin(half)
        w, x, y, z = math.cos(half), sine * axis[0], sine * axis[1], sine * axis[2]
    turn_about(T, point, w, sense * x, sense * y, sense * z)


@routine
def put_screws(moving: MovingMachine, own: MovingScratch) -> None:
    """Fill the reference point, the screws of all columns, and where masses are; positions are from this point."""
    put(own.reference, move(own.T[END], vec(moving.end)))
    for k in range(moving.units.shape[0]):
        unit = moving.units[k]
        column, sense = unit[COLUMN], float(unit[SENSE])
        if unit[KIND] == BALL:
            centre = point_of(own, unit[PARENT], vec(moving.points[k]))
            for i in range(3):
                axis = (sense if i == 0 else 0.0, sense if i == 1 else 0.0, sense if i == 2 else 0.0)
                put(own.screws[column + i], cross(centre, axis))
                put(own.screws[column + i, 3:], axis)
            continue
        axis = scale(sense, turn(own.T[unit[PARENT]], vec(moving.axes[k])))
        if unit[KIND] == SLIDE:
            put(own.screws[column], axis)
            put(own.screws[column, 3:], (0.0, 0.0, 0.0))
        else:
            put(own.screws[column], cross(point_of(own, unit[PARENT], vec(moving.points[k])), axis))
            put(own.screws[column, 3:], axis)
    for k in range(moving.frames.shape[0]):
        put(own.arms[k], point_of(own, moving.frames[k], vec(moving.centres[k])))
        put_turned(own.T[moving.frames[k]], moving.inertias[k], own.turned[k])


@inlined
def point_of(own: MovingScratch, frame: int, point: Vec) -> Vec:
    """A point of a frame, given at home, from the reference point."""
    return sub(move(own.T[frame], point), vec(own.reference))


@routine
def put_turned(T: Floats, inertia: Floats, turned: Floats) -> None:
    """Fill T I T', the symmetric inertia of a body as it stands."""
    for i in range(3):
        axis = vec(T[i])
        pulled = (dot(vec(inertia[0]), axis), dot(vec(inertia[1]), axis), dot(vec(inertia[2]), axis))
        for j in range(i + 1):
            turned[i, j] = turned[j, i] = dot(pulled, vec(T[j]))
