"""A machine driven along a stream of targets in joint coordinates: the method of `pose.live_pose`, for every mechanism.

The ranges of a tick take the place of those of the drives' own coordinates.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Records
from .._jit import opener, routine, search
from ..clearance.link_records import NO_LINKS
from ..free_motions import along_step
from ..legs.complete_poses import is_pose, turn_pose
from ..legs.records import TASK
from ..projecting import priced_distance
from ..quaternions import difference
from ..rows import INVALID, PROJECTED, REACHED
from ..search_constants import CLOSED, NEARLY_CLOSED, SIGHT
from ..sqp import is_closed
from ..ticks import (
    ATTEMPTS,
    DRIVE,
    STILL,
    TICK,
    attempt_of,
    go_to,
    kept_of_rate,
    left_of_limit,
    put_bounds,
    share_to_rest,
    slowed,
    ticks_to_rest,
)
from ..vectors import scale, vec
from .close_on_target import errors
from .descend import descend, move, restore_feasibility
from .linearise_loops import DescentScratch, begin_pricing, linearise, new_descent_scratch, walk_all
from .loops import BALL, Loops, Objective, PoseObjective
from .path_kinematics import LOOPS, State, copy_state, new_state

QUADRATIC_PROGRAMMES, MORE = 4, 12
"""Most steps of a tick: no closed form meets a target exactly, as of legs; and where none of them was taken."""

AIM = np.dtype(
    [
        ("frame", "i8"),  # and what follows, as in `PoseObjective`
        ("hold", "i8"),
        ("price", "f8"),
        ("rounding", "f8"),
        ("margin", "f8"),
        ("near", "f8"),
        ("position", "f8"),  # tolerance of REACHED [L]
        ("rotation", "f8"),  # tolerance of REACHED [rad]
    ]
)
"""What a target is approached by."""


class LiveJoints(NamedTuple):
    """A machine whose joints are driven, where it is, and the memory of a tick."""

    loops: Loops  # of which the ranges of drives are a tick's
    task: Records  # (1,): TASK
    aim: Records  # (1,): AIM
    weights: Floats  # (6,): of the pose
    nothing: Floats  # (6,): weights of no part of the pose
    drives: Records  # (n_a,): DRIVE
    columns: Ints  # (n_a,): coordinate of each
    units: Floats  # (n_a,): L for lengths, 1 for angles
    homes: Floats  # (n_a,) [length or rad]
    tick: Records  # (1,): TICK
    state: State  # where the machine is
    step: Floats  # (columns,): from where it was a tick before
    targets: Floats  # (1, 4, 4): that of this tick [length]
    scaled: Floats  # (1, 4, 4): in [L], within sight
    free: Floats  # (columns,): no weight on any coordinate
    drives_alone: Floats  # (columns,): weights of drives alone
    anchors: Floats  # (1, columns): where drives that slow down are to be
    actuators: Floats  # (n_a,) [length or rad]
    pose: Floats  # (4, 4) [length]


_LIVE = LiveJoints(
    LOOPS,
    np.zeros(1, TASK),
    np.zeros(1, AIM),
    np.zeros(6),
    np.zeros(6),
    np.zeros(1, DRIVE),
    np.zeros(1, np.int64),
    np.zeros(1),
    np.zeros(1),
    np.zeros(1, TICK),
    new_state(LOOPS),
    np.zeros(1),
    np.zeros((1, 4, 4)),
    np.zeros((1, 4, 4)),
    np.zeros(1),
    np.zeros(1),
    np.zeros((1, 1)),
    np.zeros(1),
    np.zeros((4, 4)),
)
open_live, open_scratch = opener(_LIVE), opener(new_descent_scratch(LOOPS, NO_LINKS, LOOPS))


@routine
def put_ranges(own: LiveJoints, attempt: int, dt: float) -> None:
    """Fill the ranges of drives in an attempt at a tick, which a search keeps a hair inside."""
    drives, lo, hi, margin = own.drives, own.loops.lo, own.loops.hi, own.aim[0]["margin"]
    for i in range(drives.shape[0]):
        put_bounds(drives[i], attempt, own.tick[0]["ticks"], dt)
        lo[own.columns[i]], hi[own.columns[i]] = drives[i]["least"] - margin, drives[i]["most"] + margin


@routine
def load_scaled(own: LiveJoints) -> None:
    """Fill the target in L, brought within range of sight."""
    target, scaled, task, farthest = own.targets[0], own.scaled[0], own.task[0], 0.0
    for i in range(3):
        farthest = max(farthest, abs(target[i, 3] / task["length"] - task["reference"][i]))
    for i in range(3):
        home = task["reference"][i]
        for j in range(3):
            scaled[i, j] = target[i, j]
        scaled[i, 3] = home + (target[i, 3] / task["length"] - home) * min(1.0, SIGHT / max(farthest, SIGHT))


@routine
def put_margins(own: LiveJoints, scratch: DescentScratch, objective: Objective) -> None:
    """As of `pose.live_pose`."""
    loops, columns, ticks, margins = own.loops, own.columns, own.tick[0]["ticks"], scratch.margins
    here, there = scratch.first, scratch.second
    for c in range(margins.shape[0]):
        margins[c] = 0.0
    if ticks == 0.0:
        return
    scratch.gradient.unit[0] = 1.0
    linearise(loops, 0, objective, own.state, scratch, here)
    copy_state(own.state, scratch.trial)
    move(loops, own.step, 0.5 * ticks, scratch.trial)
    linearise(loops, 0, objective, scratch.trial, scratch, there)
    for c in range(here.linear.totals[0]["limits"]):
        number, h, bend, rate = here.linear.which[c], here.linear.h[c], 0.0, along_step(here, c, own.step)
        for d in range(there.linear.totals[0]["limits"]):
            if there.linear.which[d] == number:
                bend = there.linear.h[d] - h - 0.5 * ticks * rate
        margins[number] = left_of_limit(h, bend, rate, ticks)
    for i in range(columns.shape[0]):
        margins[2 * columns[i]] = margins[2 * columns[i] + 1] = 0.0


@routine
def go_to_state(own: LiveJoints, state: State) -> None:
    """Note the step to another state, and take it."""
    loops, step, before = own.loops, own.step, own.state
    for k in range(len(loops.kinds)):
        j = loops.columns[k]
        if loops.kinds[k] == BALL:
            a, b = state.balls[k], before.balls[k]
            step[j] = 2.0 * (-a[0] * b[1] + a[1] * b[0] - a[2] * b[3] + a[3] * b[2])
            step[j + 1] = 2.0 * (-a[0] * b[2] + a[1] * b[3] + a[2] * b[0] - a[3] * b[1])
            step[j + 2] = 2.0 * (-a[0] * b[3] - a[1] * b[2] + a[2] * b[1] + a[3] * b[0])
        else:
            step[j] = state.q[j] - before.q[j]
    copy_state(state, own.state)


@routine
def come_nearer(own: LiveJoints, scratch: DescentScratch) -> None:
    """Move the target of this tick to where drives that come to rest on it are after the tick."""
    share, target, pose, turn = (
        share_to_rest(own.tick[0]["to_target"]),
        own.scaled[0],
        own.state.X,
        scratch.gradient.turn,
    )
    difference(target, pose, turn)
    for i in range(3):
        target[i, 3] = pose[i, 3] + share * (target[i, 3] - pose[i, 3])
        for j in range(3):
            target[i, j] = pose[i, j]
    turn_pose(target, scale(share, vec(turn)))


@routine
def objective_of(own: LiveJoints, aims: bool, steps: int) -> Objective:
    """The objective of a tick: of the target, or of drives that slow down."""
    aim = own.aim[0]
    price = aim["price"] if aims else 0.0
    weights, kinds = own.weights if aims else own.nothing, own.free if aims else own.drives_alone
    pose = PoseObjective(
        own.scaled,
        weights,
        aim["frame"],
        aim["hold"],
        price,
        aim["rounding"],
        aim["margin"],
        aim["near"],
        steps,
    )
    return Objective(pose, kinds, own.anchors)


@routine
def descend_from_here(own: LiveJoints, scratch: DescentScratch, objective: Objective) -> bool:
    """Descend from where the machine is; False if it is not feasible within the ranges of this tick."""
    copy_state(own.state, scratch.best)
    if own.tick[0]["ticks"] > 0.0:  # where drives slow down together, which they can
        move(own.loops, own.step, kept_of_rate(own.tick[0]["ticks"]), scratch.best)
    begin_pricing(scratch.gradient)
    scratch.gradient.unit[0] = 1.0
    linearise(own.loops, 0, objective, scratch.best, scratch, scratch.first)
    if not restore_feasibility(own.loops, 0, objective, scratch.best, CLOSED, scratch, scratch.first):
        return False
    if scratch.first.linear.totals[0]["value"] > 0.0:
        descend(own.loops, 0, objective, scratch)
        linearise(own.loops, 0, objective, scratch.best, scratch, scratch.first)
    return is_closed(scratch.first.linear, NEARLY_CLOSED)


@routine
def has_moved(own: LiveJoints, state: State) -> bool:
    """True if some drive has."""
    for i in range(own.columns.shape[0]):
        if abs(state.q[own.columns[i]] - own.state.q[own.columns[i]]) > NEARLY_CLOSED:
            return True
    return False


@routine
def search_from_here(own: LiveJoints, scratch: DescentScratch, aims: bool) -> bool:
    """Descend from where the machine is; where limits bend away from the first steps, shorter ones follow."""
    scratch.control[0]["is_warm"], multipliers = 1, scratch.hessian.multipliers
    for i in range(own.columns.shape[0]):
        multipliers[2 * own.columns[i]] = multipliers[2 * own.columns[i] + 1] = 0.0
    is_found = descend_from_here(own, scratch, objective_of(own, aims, QUADRATIC_PROGRAMMES))
    if is_found and scratch.control[0]["is_rejected"] == 1 and not has_moved(own, scratch.best):
        is_found = descend_from_here(own, scratch, objective_of(own, aims, MORE))
    return is_found


@routine
def look_ahead(own: LiveJoints, scratch: DescentScratch, dt: float) -> None:
    """As of `pose.live_pose`, for any target."""
    drives, lo, hi, scaled, X = own.drives, own.loops.lo, own.loops.hi, own.scaled[0], scratch.best.X
    ticks = 1.0 / share_to_rest(own.tick[0]["ticks"])
    for i in range(drives.shape[0]):
        value, way, j = drives[i]["value"], ticks * drives[i]["speed"] * dt, own.columns[i]
        lo[j], hi[j] = max(drives[i]["lo"], value - way), min(drives[i]["hi"], value + way)
    for c in range(scratch.margins.shape[0]):
        scratch.margins[c] = 0.0
    if search_from_here(own, scratch, True):
        walk_all(own.loops, scratch.best, scratch)
        for i in range(3):
            for j in range(4):
                scaled[i, j] = X[i, j]


@routine
def search_in_time(own: LiveJoints, scratch: DescentScratch, aims: bool) -> bool:
    """Go to the nearest configuration that loops, limits and links leave, and drives get to in this tick, from here."""
    put_margins(own, scratch, objective_of(own, aims, QUADRATIC_PROGRAMMES))
    is_found = search_from_here(own, scratch, aims)
    if is_found:
        go_to_state(own, scratch.best)
    return is_found


@routine
def put_outputs(own: LiveJoints, scratch: DescentScratch, dt: float) -> None:
    """Fill pose and actuators from the state, where drives have gone in dt seconds; or are, where these are none."""
    drives, task, exceeded = own.drives, own.task[0], 0.0
    walk_all(own.loops, own.state, scratch)
    for i in range(drives.shape[0]):
        value = own.state.q[own.columns[i]]
        if dt > 0.0:
            exceeded = max(exceeded, go_to(drives[i], value, dt))
        else:
            drives[i]["value"] = value
        own.actuators[i] = own.homes[i] + value * own.units[i]
    own.tick[0]["exceeded"] = exceeded
    for i in range(3):
        own.pose[i, 3] = own.state.X[i, 3] * task["length"]
        for j in range(3):
            own.pose[i, j] = own.state.X[i, j]


@routine
def measure_lag(own: LiveJoints, scratch: DescentScratch) -> None:
    """Fill the distance from the target, and the status."""
    tick, aim, task = own.tick[0], own.aim[0], own.task[0]
    position, rotation = errors(task, own.pose, own.targets[0], scratch.gradient.turn)
    position /= task["length"]
    tick["lag"] = priced_distance(own.weights, aim["hold"], aim["price"], position, rotation)
    tick["status"] = REACHED if position <= aim["position"] and rotation <= aim["rotation"] else PROJECTED


@routine
def go_on(own: LiveJoints, scratch: DescentScratch, dt: float) -> None:
    """One tick of dt seconds towards the target, or to rest where that is no pose."""
    tick, is_target = own.tick[0], is_pose(own.targets[0])
    tick["attempt"], tick["searched"], tick["ticks"] = STILL, 0, ticks_to_rest(own.drives, 1.0, dt)
    tick["to_target"] = tick["ticks"]  # no closed form says how drives go with a target that moves
    if is_target:
        load_scaled(own)
        if tick["ticks"] > 0.0:
            look_ahead(own, scratch, dt)
            come_nearer(own, scratch)
    else:
        for i in range(own.drives.shape[0]):
            own.anchors[0, own.columns[i]] = slowed(own.drives[i], tick["ticks"], dt)
    for attempt in range(ATTEMPTS):
        factor, _ = attempt_of(attempt)
        tick["ticks"] = ticks_to_rest(own.drives, factor, dt)
        put_ranges(own, attempt, dt)
        if search_in_time(own, scratch, is_target):
            tick["attempt"], tick["searched"] = attempt, 1
            break
    if tick["attempt"] == STILL:
        for j in range(own.step.shape[0]):
            own.step[j] = 0.0
    put_outputs(own, scratch, dt)
    if is_target:
        measure_lag(own, scratch)
    else:
        tick["status"] = INVALID


@search
def tick_joints(live: int, scratch_address: int, dt: float) -> int:
    """Drive a machine for dt seconds towards `LiveJoints.targets`; the status.

    Parameters
    ----------
    live, scratch_address : addresses of `LiveJoints` and `DescentScratch`.
    """
    own, scratch = open_live(live), open_scratch(scratch_address)
    go_on(own, scratch, dt)
    return int(own.tick[0]["status"])


@search
def place_joints(live: int, scratch_address: int) -> None:
    """Fill pose, actuators and the values of drives of a machine at `LiveJoints.state`."""
    own, scratch = open_live(live), open_scratch(scratch_address)
    put_outputs(own, scratch, 0.0)
