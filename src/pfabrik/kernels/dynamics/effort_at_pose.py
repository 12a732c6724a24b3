"""Forces of actuators in one state of a machine of legs: at a pose that moves."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from .._jit import opener, routine, search
from ..legs.answer import deviation, place_legs
from ..legs.complete_poses import load_pose
from ..legs.frames import set_frames
from ..legs.records import FROM_BASE, open_table
from ..pose.evaluate import open_evaluation_scratch
from ..vectors import copy_row, dot, turn, vec
from .inverse_dynamics import put_efforts
from .moving import END, MOVING_MACHINE, Exerted, MovingMachine, new_exerted, open_moving, open_moving_scratch
from .placing import place_beyond, put_screws

TOO_LARGE = -1
"""Code of a state with numbers that are not finite, or that overflow."""


class MovingState(NamedTuple):
    """A state, and the memory of a call."""

    pose: Floats  # (4, 4) [length]
    sides: Floats  # (legs,)
    twist: Floats  # (6,): of the reference point, and angular [length/s, rad/s]
    gain: Floats  # (6,): its change
    length: Floats  # (1,): L
    axes: Floats  # (k, 6): components of twists that the task sets
    tilts: Ints  # (1,): 1 if rotations are about the axes of the platform
    shown: Floats  # (k, 6): the same where the platform is
    rates: Floats  # (k,)
    gains: Floats  # (k,)
    q: Floats  # (columns,): coordinates of joints [L or rad]
    results: Exerted


def new_moving_state(
    moving: MovingMachine, sides: Floats, axes: Floats, tilts: bool, columns: int, length: float
) -> MovingState:
    """A state of a machine with legs on some sides (legs,), at rest, of no pose."""
    k = len(axes)
    return MovingState(
        pose=np.zeros((4, 4)),
        sides=sides,
        twist=np.zeros(6),
        gain=np.zeros(6),
        length=np.array([length]),
        axes=axes,
        tilts=np.array([int(tilts)], np.int64),
        shown=axes.copy(),
        rates=np.zeros(k),
        gains=np.zeros(k),
        q=np.zeros(columns),
        results=new_exerted(moving, 1, k),
    )


open_moving_state = opener(new_moving_state(MOVING_MACHINE, np.zeros(0), np.zeros((0, 6)), False, 0, 1.0))


@search
def effort_at_pose(legs: int, legs_address: int, machine: int, scratch_address: int, state_address: int) -> int:
    """Fill the efforts of a state whose legs are on given sides; its marks, or a code.

    Parameters
    ----------
    legs, legs_address : addresses of the kernel table and of `EvaluationScratch`.
    machine, scratch_address : as of `inverse_dynamics`; coordinates of all its unit motions are those of legs.
    state_address : of a `MovingState`.
    """
    table, read, state = open_table(legs), open_evaluation_scratch(legs_address), open_moving_state(state_address)
    moving, own, evaluation = open_moving(machine), open_moving_scratch(scratch_address), read.leg_eval
    load_pose(state.pose, table.task[0]["length"], read.state.pose)
    set_frames(read.state.pose, table.task[0], evaluation.frames)
    place_legs(table.legs, evaluation.frames, state.sides, evaluation.values, evaluation.lines)
    for i in range(table.known.shape[0]):
        state.q[table.known[i]["column"]] = deviation(table.known[i], evaluation.values)
    put_end(evaluation.frames[FROM_BASE], own.T[END], moving.end)
    place_beyond(moving, own, state.q)
    put_screws(moving, own)
    put_asked(state.axes, state.tilts[0], state.pose, state.shown)
    put_components(state.shown, state.twist, state.length[0], state.rates)
    put_components(state.shown, state.gain, state.length[0], state.gains)
    marks = put_efforts(moving, own, state.shown, state.rates, state.gains, state.rates[:0], 0, state.results)
    total = 0.0
    for i in range(6):
        total += abs(state.twist[i]) + abs(state.gain[i])
    for a in range(state.results.actuators.shape[1]):
        total += abs(state.results.actuators[0, a])
    return marks if total < math.inf else TOO_LARGE


@routine
def put_end(frame: Floats, T: Floats, reference: Floats) -> None:
    """Fill the displacement of the end effector from home, whose reference point is where the frame has it."""
    for i in range(3):
        copy_row(frame[i], T[i])
    arm = turn(T, vec(reference))
    for i in range(3):
        T[i, 3] -= arm[i]


@routine
def put_asked(axes: Floats, tilts: int, pose: Floats, shown: Floats) -> None:
    """Fill the components of twists that a task sets, at a pose (4, 4): rotations may be about its own axes."""
    for k in range(axes.shape[0]):
        copy_row(axes[k], shown[k])
        if tilts == 1:
            for i in range(3):
                shown[k, 3 + i] = dot(vec(axes[k, 3:]), (pose[i, 0], pose[i, 1], pose[i, 2]))


@routine
def put_components(shown: Floats, twist: Floats, length: float, components: Floats) -> None:
    """Fill components of a twist (6,) [length, rad], in L."""
    for k in range(shown.shape[0]):
        components[k] = dot(vec(shown[k]), vec(twist)) / length + dot(vec(shown[k, 3:]), vec(twist[3:]))
