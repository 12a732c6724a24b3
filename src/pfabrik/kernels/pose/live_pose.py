"""A machine of legs driven along a stream of targets: each tick goes to the nearest pose that drives get to in time.

What a drive may do in a tick is a range of its own, so a tick is a projection like any other: from where the machine
is, within all limits, links apart, on the same sides of dead points. One or two quadratic programmes are enough, for
such ranges are narrow. A target that legs reach within these ranges is met exactly.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Records
from .._jit import opener, routine, search
from ..clearance.link_limits import links_excess
from ..free_motions import along_step
from ..legs.answer import Completion, answer_on_sides, deviation, new_completion
from ..legs.complete_poses import is_pose, put_pose, turn_pose
from ..legs.frames import set_frames
from ..legs.kinds import place_frame
from ..legs.records import CRANK, Q_PROXIMAL, SAMPLE, Table
from ..legs.rods import solve_proximal
from ..projecting import UNBOUNDED, begin_effort, priced_distance
from ..quaternions import difference
from ..rows import INVALID, POSITION_ERROR, PROJECTED, REACHED, ROTATION_ERROR
from ..search_constants import NEARLY_CLOSED, REACH, SAME_DISTANCE
from ..ticks import (
    ATTEMPTS,
    DRIVE,
    STILL,
    TICK,
    attempt_of,
    go_to,
    is_in_time,
    keeps_up,
    kept_of_rate,
    left_of_limit,
    put_bounds,
    share_to_rest,
    slowed,
    ticks_left,
    ticks_to_rest,
    ticks_to_target,
)
from ..vectors import copy_row, copy_table, scale, vec, wrap
from ..vectors import move as moved_by
from .descend_pose import descend
from .equations import LegEvaluation, PlatformState, close_rods, evaluate_legs, has_proximal, new_platform_state
from .limits import place_links
from .linearise import linearise
from .nearest import PLAN, is_other_mode, pose_objective, turned_by
from .pose_constants import BENT, STRETCHED
from .search import SearchScratch, copy_platform_state, fix_held, move, new_search_scratch
from .search_records import MultistartPlan, PlatformObjective
from .starts import load_target, place_proximal, put_sides

AIM, VALUES = 0, 1
"""The objectives of a live machine's plan: of the pose, and of values of drives."""

QUADRATIC_PROGRAMMES, MORE = 2, 12
"""Most steps of a search; and where none of them was taken, for limits bend away from it: shorter ones follow."""


DIRECT = 0.84
"""Least share of a tick at full speed by which drives are to come nearer in it to a target that legs reach."""


STRAIGHT = STRETCHED
"""Difference of the two solutions of a proximal joint below which a tick also begins beside its dead point [rad or L]:
3e-3 in single precision, which has half of its digits there."""


class LivePose(NamedTuple):
    """A machine whose legs are driven, where it is, and the memory of a tick."""

    near: Table  # completes what the task leaves open near its start
    search: Table  # its last limits are the drives', whose ranges are a tick's
    plan: MultistartPlan  # objectives AIM and VALUES
    drives: Records  # (n_a,): DRIVE, in the order of `driven`
    tick: Records  # (1,): TICK
    state: PlatformState  # where the machine is
    step: Floats  # (unknowns,): from where it was a tick before
    begin: Floats  # (4, 4): its pose [length]
    values: Floats  # (1, n_a): where drives that go straight or slow down are to be [L or rad]
    targets: Floats  # (1, 4, 4): that of this tick [length]
    actuators: Floats  # (n_a,) [length or rad]
    pose: Floats  # (4, 4) [length]


class LiveScratch(NamedTuple):
    """Scratch memory of a tick."""

    completion: Completion
    search: SearchScratch
    measures: Floats  # (5,)
    trial: Floats  # (n_a,): actuators
    sides: Floats  # (legs,)
    ahead: Floats  # (4, 4): where `look_ahead` leads [L]
    start: PlatformState  # where a search begins
    before: PlatformState  # where a tick began
    aside: PlatformState  # where it might end
    end: PlatformState  # where the nearest of its searches ends
    no_values: Floats  # (0, n_a)


def new_live_scratch(live: LivePose) -> LiveScratch:
    """Allocate the scratch memory of a tick."""
    search, n, legs = new_search_scratch(live.search, live.plan.links), len(live.drives), len(live.state.q)
    return LiveScratch(
        new_completion(live.near),
        search,
        np.zeros(5),
        np.zeros(n),
        np.zeros(legs),
        np.zeros((4, 4)),
        new_platform_state(legs),
        new_platform_state(legs),
        new_platform_state(legs),
        new_platform_state(legs),
        np.zeros((0, n)),
    )


_LIVE = LivePose(
    SAMPLE,
    SAMPLE,
    PLAN,
    np.zeros(1, DRIVE),
    np.zeros(1, TICK),
    new_platform_state(1),
    np.zeros(6),
    np.zeros((4, 4)),
    np.zeros((1, 1)),
    np.zeros((1, 4, 4)),
    np.zeros(1),
    np.zeros((4, 4)),
)
open_live, open_scratch = opener(_LIVE), opener(new_live_scratch(_LIVE))


@routine
def put_ranges(own: LivePose, attempt: int, dt: float) -> None:
    """Fill the ranges of drives in an attempt at a tick, which a search keeps a hair inside."""
    drives, limited, margin = own.drives, own.search.limited, own.plan.settings[AIM]["margin"]
    first = limited.shape[0] - drives.shape[0]
    for i in range(drives.shape[0]):
        put_bounds(drives[i], attempt, own.tick[0]["ticks"], dt)
        limited[first + i]["lo"], limited[first + i]["hi"] = drives[i]["least"] - margin, drives[i]["most"] + margin


@routine
def bend(own: LivePose, state: PlatformState, leg_eval: LegEvaluation) -> bool:
    """Displace drives at dead points a little to their sides, as far as they go; True if there are any.

    See `starts.place_proximal`.
    """
    table, q, sides, drives, is_bent = own.search, state.q, state.sides, own.drives, False
    first = table.limited.shape[0] - drives.shape[0]
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(q.shape[0]):
        leg, values, room = table.legs[k], leg_eval.values[k], BENT
        place_frame(table.legs, k, q, leg_eval.frames, leg_eval.values)
        if has_proximal(leg) and sides[k] != 0.0:
            end = moved_by(leg_eval.frames[leg["frame"]], vec(leg["platform_end_point"]))
            solve_proximal(leg, end, -sides[k], values)
            other = values[Q_PROXIMAL]
            solve_proximal(leg, end, sides[k], values)
            if abs(wrap(values[Q_PROXIMAL] - other, 0.0)) < STRAIGHT:
                for i in range(drives.shape[0]):
                    if table.limited[first + i]["leg"] == k:
                        room = min(room, 0.5 * (drives[i]["most"] - drives[i]["least"]))
                q[k] += room * sides[k]
                is_bent = True
    return is_bent


@routine
def go_to_state(own: LivePose, scratch: LiveScratch, state: PlatformState) -> None:
    """Note the step to another state, and take it."""
    step, columns, turn, before, now = own.step, own.search.columns, scratch.search.gradient.turn, own.state, state
    difference(now.pose, before.pose, turn)
    for i in range(3):
        step[i], step[3 + i] = now.pose[i, 3] - before.pose[i, 3], turn[i]
    for k in range(columns.shape[0]):
        if columns[k] >= 0:
            step[columns[k]] = now.q[k] - before.q[k]
    copy_platform_state(state, own.state)


@routine
def aim_drives(own: LivePose, scratch: LiveScratch) -> bool:
    """Note where drives are on the target, with legs on their sides; False if legs do not reach it within limits."""
    completion, sides, drives, limited = scratch.completion, scratch.sides, own.drives, own.search.limited
    first, measures = limited.shape[0] - drives.shape[0], scratch.measures
    copy_row(own.state.sides, sides)
    status = answer_on_sides(own.near, own.targets[0], own.begin, sides, completion, own.pose, scratch.trial, measures)
    for i in range(drives.shape[0]):
        drives[i]["wished"] = drives[i]["aim"]
        drives[i]["aim"] = deviation(limited[first + i], completion.values) if status == REACHED else math.nan
    return status == REACHED


@routine
def reach_in_time(own: LivePose, scratch: LiveScratch, dt: float) -> bool:
    """Go to the target that legs reach, where drives get there in this tick and links are apart."""
    drives, links, completion, trial = own.drives, scratch.search.links, scratch.completion, scratch.search.trial
    for i in range(drives.shape[0]):
        if not (is_in_time(drives[i], drives[i]["aim"]) and keeps_up(drives[i], dt)):
            return False
    if links.pairs.shape[0] > 0:
        place_links(own.search, links, completion.frames, completion.values)
        if not links_excess(links) <= own.plan.settings[AIM]["limit"]:
            return False
    copy_table(completion.pose, trial.pose)
    copy_row(scratch.sides, trial.sides)
    place_proximal(own.search, trial, 0.0, scratch.search.leg_eval)
    q = trial.q
    for k in range(q.shape[0]):
        q[k] = wrap(q[k], own.state.q[k]) if own.search.legs[k]["proximal"] == CRANK else q[k]
    go_to_state(own, scratch, trial)
    return True


@routine
def put_margins(own: LivePose, scratch: LiveScratch, objective: PlatformObjective) -> None:
    """Fill how far from each limit this tick stays, so that drives can rest before it.

    With h its excess, x the last step and n the `ticks` to rest, drives that slow down together come to h + h' x n / 2
    and, as limits bend, to more: by what the excess there differs from that. A tick may go a share of what is left.
    """
    search, table, ticks = scratch.search, own.search, own.tick[0]["ticks"]
    margins, here, there, n_drives = search.margins, search.first, search.second, own.drives.shape[0]
    end = 2 * table.limited.shape[0]
    for c in range(margins.shape[0]):
        margins[c] = 0.0
    if ticks == 0.0:
        return
    search.near[0] = REACH
    linearise(table, 0, objective, own.state, search, here)
    copy_platform_state(own.state, search.trial)
    move(table, own.step, 0.5 * ticks, search.trial)
    linearise(table, 0, objective, search.trial, search, there)
    for c in range(here.linear.totals[0]["limits"]):
        number, h, bend, rate = here.linear.which[c], here.linear.h[c], 0.0, along_step(here, c, own.step)
        for d in range(there.linear.totals[0]["limits"]):
            if there.linear.which[d] == number:
                bend = there.linear.h[d] - h - 0.5 * ticks * rate
        margins[number] = left_of_limit(h, bend, rate, ticks)
    for number in range(end - 2 * n_drives, end):
        margins[number] = 0.0


@routine
def look_ahead(own: LivePose, scratch: LiveScratch, dt: float) -> None:
    """Move the target of this tick, where legs do not reach it, to the nearest pose from which drives could still rest.

    That is where they come to at full speed in as many ticks as they take to rest; `come_nearer` slows down for it.
    """
    search, table, drives, limited = scratch.search, own.search, own.drives, own.search.limited
    first, ticks = limited.shape[0] - drives.shape[0], 1.0 / share_to_rest(own.tick[0]["ticks"])
    for i in range(drives.shape[0]):
        value, way = drives[i]["value"], ticks * drives[i]["speed"] * dt
        limited[first + i]["lo"], limited[first + i]["hi"] = value - way, value + way
    for c in range(search.margins.shape[0]):
        search.margins[c] = 0.0
    begin_search(own, scratch, AIM)
    is_target = load_target(table, pose_objective(own.plan, AIM, own.targets, MORE), 0, search)
    if is_target and descend_from_here(own, scratch, AIM, own.state) < math.inf:
        copy_table(search.best.pose, scratch.ahead)
        own.tick[0]["looks"] = 1


@routine
def descend_from_here(own: LivePose, scratch: LiveScratch, aim: int, begin: PlatformState) -> float:
    """Descend from a configuration to `search.best`; its distance [L], infinite without one.

    Where limits bend away from the first steps, so that none is taken, shorter ones follow.
    """
    search, plan, table = scratch.search, own.plan, own.search
    implied, values = plan.settings[aim]["implied"], own.values if aim == VALUES else scratch.no_values
    pose = pose_objective(plan, aim, own.targets, QUADRATIC_PROGRAMMES)
    copy_platform_state(begin, search.best)
    found = descend(table, 0, PlatformObjective(pose, values, implied), math.inf, own.state, search)
    if search.control[0]["is_rejected"] == 1 and is_same(own.state, search.best):
        more = pose_objective(plan, aim, own.targets, MORE)
        copy_platform_state(own.state, search.best)
        found = descend(table, 0, PlatformObjective(more, values, implied), math.inf, own.state, search)
    return found


@routine
def come_nearer(own: LivePose, scratch: LiveScratch) -> None:
    """Move the target of this tick to where drives that come to rest on it are after the tick."""
    share, target, pose = share_to_rest(own.tick[0]["to_target"]), scratch.search.target, own.state.pose
    turn = scratch.search.gradient.turn
    if own.tick[0]["looks"] == 1:
        copy_table(scratch.ahead, target)
    difference(target, pose, turn)
    for i in range(3):
        target[i, 3] = pose[i, 3] + share * (target[i, 3] - pose[i, 3])
        for j in range(3):
            target[i, j] = pose[i, j]
    turn_pose(target, scale(share, vec(turn)))


@routine
def begin_search(own: LivePose, scratch: LiveScratch, aim: int) -> None:
    """Prepare a search: all cones and links count, dead points are kept, and multipliers but those of drives."""
    search, table, kept_sides = scratch.search, own.search, scratch.search.kept_sides
    search.n_cones[0] = table.cones.shape[0]
    search.links.kept[0] = search.links.pairs.shape[0]
    for k in range(kept_sides.shape[0]):
        kept_sides[k] = own.state.sides[k] if has_proximal(table.legs[k]) else 0.0
    fix_held(pose_objective(own.plan, aim, own.targets, QUADRATIC_PROGRAMMES), True, search)
    begin_effort(UNBOUNDED, UNBOUNDED, search.effort[0])
    search.control[0]["is_warm"], end = 1, 2 * table.limited.shape[0]
    for number in range(end - 2 * own.drives.shape[0], end):
        search.hessian.multipliers[number] = 0.0


@routine
def is_same(one: PlatformState, other: PlatformState) -> bool:
    """True if two configurations have one pose, but for rounding."""
    for i in range(3):
        for j in range(4):
            if abs(one.pose[i, j] - other.pose[i, j]) > NEARLY_CLOSED:
                return False
    return True


@routine
def search_in_time(own: LivePose, scratch: LiveScratch, aim: int) -> bool:
    """Go to the nearest pose that limits, links and dead points leave, and drives get to in this tick, from here."""
    search, table, plan, trial = scratch.search, own.search, own.plan, scratch.start
    pose = pose_objective(plan, aim, own.targets, QUADRATIC_PROGRAMMES)
    values, ticks = own.values if aim == VALUES else scratch.no_values, own.tick[0]["ticks"]
    if not load_target(table, pose, 0, search):
        return False
    begin_search(own, scratch, aim)
    if aim == AIM:
        come_nearer(own, scratch)
    put_margins(own, scratch, PlatformObjective(pose, values, plan.settings[aim]["implied"]))
    distance = math.inf
    for bends in range(2):
        copy_platform_state(own.state, trial)
        if ticks > 0.0:  # where drives slow down together, which they can
            move(table, own.step, kept_of_rate(ticks), trial)
            close_rods(table, trial, search.leg_eval)
        if bends == 1 and not bend(own, trial, search.leg_eval):
            break
        found = descend_from_here(own, scratch, aim, trial)
        if found < (1.0 - SAME_DISTANCE) * distance:
            put_sides(table, search.best, search.leg_eval)
            if not is_other_mode(table.legs, own.state.sides, search.best.sides):
                distance = found
                copy_platform_state(search.best, scratch.end)
    if distance == math.inf:
        return False
    go_to_state(own, scratch, scratch.end)
    return True


@routine
def put_outputs(own: LivePose, scratch: LiveScratch, dt: float) -> None:
    """Fill pose and actuators from the state, where drives have gone in dt seconds; or are, where these are none."""
    search, table, drives, exceeded = scratch.search, own.search, own.drives, 0.0
    evaluate_legs(table, own.state, search.leg_eval)
    first = table.limited.shape[0] - drives.shape[0]
    for i in range(drives.shape[0]):
        driven = table.driven[i]
        value = deviation(table.limited[first + i], search.leg_eval.values)
        if dt > 0.0:
            exceeded = max(exceeded, go_to(drives[i], value, dt))
        else:
            drives[i]["value"] = value
        own.actuators[driven["column"]] = driven["home"] + value * driven["unit"]
    own.tick[0]["exceeded"] = exceeded
    put_pose(own.state.pose, table.task[0]["length"], own.begin)
    copy_table(own.begin, own.pose)


@routine
def measure_lag(own: LivePose, scratch: LiveScratch) -> None:
    """Fill the distance from the target, and the status."""
    tick, task, target, pose = own.tick[0], own.search.task[0], own.targets[0], own.pose
    setting, measures, distance = own.plan.settings[AIM], scratch.measures, 0.0
    for i in range(3):
        distance = math.hypot(distance, pose[i, 3] - target[i, 3] if task["axes"][i] == 1 else 0.0)
    measures[POSITION_ERROR] = distance
    measures[ROTATION_ERROR] = turned_by(task["rotations"], pose, target, scratch.search.gradient.turn)
    tick["lag"] = priced_distance(
        own.plan.weights[AIM], setting["hold"], setting["price"], distance / task["length"], measures[ROTATION_ERROR]
    )
    is_reached = distance <= setting["position"] and measures[ROTATION_ERROR] <= setting["rotation"]
    tick["status"] = REACHED if is_reached else PROJECTED


@routine
def left_of(own: LivePose, scratch: LiveScratch, dt: float) -> float:
    """How many ticks drives take at full speed from where the state has them to where they are on the target."""
    table, drives, ticks = own.search, own.drives, 0.0
    first = table.limited.shape[0] - drives.shape[0]
    evaluate_legs(table, own.state, scratch.search.leg_eval)
    for i in range(drives.shape[0]):
        value = deviation(table.limited[first + i], scratch.search.leg_eval.values)
        ticks = max(ticks, abs(drives[i]["aim"] - value) / (drives[i]["speed"] * dt))
    return ticks


@routine
def go_straight(own: LivePose, scratch: LiveScratch, dt: float) -> None:
    """Let drives go straight to a target that legs reach, where the nearest pose of a tick is a long way round."""
    left = left_of(own, scratch, dt)
    if ticks_left(own.drives, dt) - left >= DIRECT:
        return
    copy_platform_state(own.state, scratch.aside)
    copy_platform_state(scratch.before, own.state)
    for i in range(own.drives.shape[0]):
        own.values[0, own.search.driven[i]["column"]] = own.drives[i]["aim"]
    if not (search_in_time(own, scratch, VALUES) and left_of(own, scratch, dt) < left):
        copy_platform_state(scratch.before, own.state)
        go_to_state(own, scratch, scratch.aside)


@routine
def go_on(own: LivePose, scratch: LiveScratch, dt: float) -> None:
    """One tick of dt seconds towards the target, or to rest where that is no pose."""
    tick, drives, is_target, is_known = own.tick[0], own.drives, is_pose(own.targets[0]), False
    tick["attempt"], tick["searched"], tick["ticks"] = STILL, 0, ticks_to_rest(drives, 1.0, dt)
    if is_target:
        is_known = aim_drives(own, scratch)
        tick["to_target"] = ticks_to_target(drives, dt)
    else:
        copy_table(own.begin, own.targets[0])
        for i in range(drives.shape[0]):
            drives[i]["aim"] = math.nan
            own.values[0, own.search.driven[i]["column"]] = slowed(drives[i], tick["ticks"], dt)
    copy_platform_state(own.state, scratch.before)
    tick["looks"] = 0
    if is_target and not is_known and tick["ticks"] > 0.0:
        look_ahead(own, scratch, dt)
    for attempt in range(ATTEMPTS):
        factor, _ = attempt_of(attempt)
        tick["ticks"] = ticks_to_rest(drives, factor, dt)
        put_ranges(own, attempt, dt)
        is_reached = is_known and reach_in_time(own, scratch, dt)
        if is_reached or search_in_time(own, scratch, AIM if is_target else VALUES):
            tick["attempt"], tick["searched"] = attempt, 0 if is_reached else 1
            if is_known and not is_reached and tick["ticks"] == 0.0:
                go_straight(own, scratch, dt)
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
def tick_pose(live: int, scratch_address: int, dt: float) -> int:
    """Drive a machine for dt seconds towards `LivePose.targets`; the status.

    Parameters
    ----------
    live, scratch_address : addresses of `LivePose` and `LiveScratch`.
    """
    own, scratch = open_live(live), open_scratch(scratch_address)
    go_on(own, scratch, dt)
    return int(own.tick[0]["status"])


@routine
def place(own: LivePose, scratch: LiveScratch) -> None:
    """Fill pose, actuators and the values of drives of a machine at its state, as far as pose and sides go."""
    drives, limited = own.drives, own.search.limited
    for i in range(drives.shape[0]):
        place_of_drive = limited.shape[0] - drives.shape[0] + i
        limited[place_of_drive]["lo"] = own.search.driven[i]["lo"]
        limited[place_of_drive]["hi"] = own.search.driven[i]["hi"]
    place_proximal(own.search, own.state, 0.0, scratch.search.leg_eval)
    put_outputs(own, scratch, 0.0)


@search
def place_pose(live: int, scratch_address: int) -> None:
    """Let a machine rest where `LivePose.state` has it; parameters as of `tick_pose`."""
    place(open_live(live), open_scratch(scratch_address))
