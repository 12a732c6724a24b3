"""Actuators and limits at poses: targets completed from a start, or step by step from there or from home."""

from __future__ import annotations

from typing import NamedTuple

from ...common.arrays import Floats
from .._jit import routine
from ..legs.answer import Completion, complete_pose, deviation, place_legs, put_rows
from ..legs.complete_poses import is_pose, load_pose, orthonormalise, put_pose, read_target, tilt_to, turn_pose
from ..legs.frames import set_frames
from ..legs.leg_constants import KEPT, LEAST_MARGIN
from ..legs.records import SLIDE, Table
from ..pose.equations import has_proximal, length_row
from ..pose.limits import is_multiturn
from ..pose.search_records import Starts
from ..quaternions import difference
from ..search_constants import NEARLY_CLOSED
from ..vectors import along, angle_between, copy_row, copy_table, dot, norm, scale, vec, wrap
from .links_on_bodies import LinksOnBodies, nearest_pair, place_bodies

LEG, PAIR = 1000, 10000
"""Plus the number of a leg that does not reach or close; plus that of the nearest pair of links, which is too near."""

NO_POSE, NO_ACTUATORS, OTHER_MODE, PROJECTED, BUDGET, JUMPED = -1, -2, -3, -4, -5, -11
"""Not finite, or not a rotation; not finite; closed, but not in home's working mode; the nearest feasible pose; the
same, or none, when the steps were spent; the nearest feasible pose, to which drives jump from the last."""


ATTEMPTS = 3
"""Ways to a target: at once, step by step from the start, and step by step from home; then, with implicit joints, so
that what follows may go farther."""

SHORTEST_SHARE = 1.0 / 32.0
"""The shortest step, as a share of the way."""

MOST_PARTS = 66
"""Most parts of a way of which the next is twice as long where legs close, and half as long where they do not."""

UPRIGHT = 1e-6
"""Sine of the angle between a target's z axis and the only axis of tilt below which the target has no tilt."""


class Reaching(NamedTuple):
    """A machine whose actuators follow from poses, and the memory of a call."""

    near: Table  # as the task has it, completed near its start alone
    far: Table  # completed far from there too
    whole_near: Table  # with the whole pose set: implicit joints alone are completed
    whole_far: Table
    home: Starts  # one: home
    ways: Floats  # (n,): 1 if what the task leaves open follows in one way, at once; else ATTEMPTS or twice as many
    tilt: Floats  # (1 or 0, 3): the only axis about which the end effector tilts
    links: LinksOnBodies
    scratch: Completion
    wanted: Floats  # (4, 4): the target [length]
    present: Floats  # (4, 4): where the platform is on the way there [length]
    step: Floats  # (4, 4): where it is to be next [length]
    begin: Floats  # (legs,): sides where a completion begins
    sides: Floats  # (legs,): on the way
    turn: Floats  # (3,)
    slack: Floats  # (limits,): in every limit [length or rad]
    distance: Floats  # (1,): of the nearest pair of links [L]


@routine
def reach(own: Reaching, target: Floats, pose: Floats, attempts: int) -> int:
    """Complete a target (4, 4) [length] from a pose, into the scratch memory, in so many attempts; a code."""
    task = own.near.task[0]
    copy_table(target, own.wanted)
    for i in range(3):
        if task["axes"][i] == 0:
            own.wanted[i, 3] = own.home.poses[0, i, 3] * task["length"]
        for j in range(3):
            if task["rotations"] == 0:
                own.wanted[i, j] = own.home.poses[0, i, j]
    is_completed = task["unset"] > 0 or task["implicit"] == 1
    if not is_pose(target) or (is_completed and not is_pose(pose)):
        return NO_POSE
    if own.tilt.shape[0] > 0:
        turn_along_tilt(own)
    copy_row(own.home.sides[0], own.begin)
    return complete(own, own.near, own.far, pose, attempts)


@routine
def turn_along_tilt(own: Reaching) -> None:
    """Turn the target so that its z axis is one that the only rotation leads to, as of `motion.fitting_task`."""
    axis, z = vec(own.tilt[0]), (own.wanted[0, 2], own.wanted[1, 2], own.wanted[2, 2])
    height, across = axis[2], along(z, -dot(z, axis), axis)
    length = norm(across)
    if not length > UPRIGHT:
        return
    z = along(scale(norm(along((0.0, 0.0, 1.0), -height, axis)) / length, across), height, axis)
    copy_table(own.wanted, own.step)
    for i in range(3):
        own.step[i, 2] = z[i]
    tilt_to(own.step, 1.0, own.wanted)


@routine
def rest(own: Reaching, pose: Floats) -> int:
    """Place all legs at a whole pose (4, 4) [length], into the scratch memory; a code."""
    copy_row(own.home.sides[0], own.begin)
    return rest_from(own, pose)


@routine
def rest_from(own: Reaching, pose: Floats) -> int:
    """As `rest`, with implicit joints first looked for at `begin`."""
    if not is_pose(pose):
        return NO_POSE
    if own.near.task[0]["implicit"] == 1:
        copy_table(pose, own.wanted)
        return complete(own, own.whole_near, own.whole_far, pose, 2 * ATTEMPTS)
    return place_whole(own, pose)


@routine
def place_whole(own: Reaching, pose: Floats) -> int:
    """Place legs at a whole pose (4, 4) [length] that leaves nothing to complete; a code."""
    table, scratch = own.near, own.scratch
    load_pose(pose, table.task[0]["length"], scratch.pose)
    orthonormalise(scratch.pose)
    copy_row(own.home.sides[0], scratch.sides)
    return beyond(own, table) if closes(table, scratch) else LEG + 1 + open_leg(table, scratch)


@routine
def closes(table: Table, scratch: Completion) -> bool:
    """Place legs at the pose of the scratch memory; True if all close, also those that are stretched to a dead point.

    A pose that is nearest to a target out of reach is at dead points, where rounding decides if a leg reaches it.
    """
    set_frames(scratch.pose, table.task[0], scratch.frames)
    singularity_margin, _ = place_legs(table.legs, scratch.frames, scratch.sides, scratch.values, scratch.lines)
    worst = put_rows(table.legs, scratch.frames, scratch.values, scratch.lines, scratch.rows)
    if not worst <= NEARLY_CLOSED:
        return False
    return singularity_margin > LEAST_MARGIN * LEAST_MARGIN or are_stretched(table, scratch, singularity_margin)


@routine
def are_stretched(table: Table, scratch: Completion, singularity_margin: float) -> bool:
    """True if cranks and carriages that are beyond a dead point end where their rods reach all the same."""
    if not singularity_margin > -NEARLY_CLOSED:
        return False
    for k in range(table.legs.shape[0]):
        if table.legs[k]["has_proximal"] == 1 and not abs(scratch.values[k, SLIDE]) <= NEARLY_CLOSED:
            return False
    return True


@routine
def complete(own: Reaching, near: Table, far: Table, pose: Floats, attempts: int) -> int:
    """Complete `wanted` from a pose by the first attempt within all limits, else by the first that closes; a code.

    More than one pose may close: beyond a limit need not mean that there is none within.
    """
    first = go(own, near, pose)
    code = beyond(own, near) if first == 0 else first
    if own.ways.shape[0] > 1 and code != 0 and code != NO_POSE:
        return complete_otherwise(own, near, far, pose, attempts, first)
    return code


@routine
def complete_otherwise(own: Reaching, near: Table, far: Table, pose: Floats, attempts: int, first: int) -> int:
    """As `complete`, by all attempts but the first, whose code is given."""
    code, closing = first, 0 if first == 0 else -1
    for attempt in range(1, attempts):
        code = try_again(own, near, pose, attempt) if attempt < ATTEMPTS else try_again(own, far, pose, attempt)
        if code == 0:
            code = beyond(own, near)
            if code == 0:
                return 0
            closing = attempt if closing < 0 else closing
    if closing < 0:
        return first
    if closing < ATTEMPTS:
        try_again(own, near, pose, closing)
    else:
        try_again(own, far, pose, closing)
    return beyond(own, near)


@routine
def try_again(own: Reaching, table: Table, pose: Floats, attempt: int) -> int:
    """Complete `wanted` by one of the attempts; a code."""
    if attempt % ATTEMPTS == 0:
        return go(own, table, pose)
    return lead(own, table, pose, attempt % ATTEMPTS == 2)


@routine
def beyond(own: Reaching, table: Table) -> int:
    """Number of the limit exceeded most where legs are placed, or of the links that are too near; 0 if none."""
    code = put_slack(table, own.scratch.values, own.slack)
    if own.links.pairs.shape[0] > 0:
        scratch = own.scratch
        if code == 0:
            return too_near(own.links, table, scratch.frames, scratch.values, scratch.lines, own.distance)
    return code


@routine
def too_near(
    links: LinksOnBodies, table: Table, frames: Floats, values: Floats, lines: Floats, distance: Floats
) -> int:
    """The code of the nearest pair of links if it is nearer than the clearance, else 0; fills its distance [L]."""
    pair = nearest_pair(links, table, frames, values, lines, distance)
    return 0 if distance[0] >= links.least[0] - KEPT else PAIR + pair + 1


@routine
def measure(own: Reaching) -> int:
    """Index of the nearest pair of links where legs are placed; fills their distance."""
    return nearest_pair(own.links, own.near, own.scratch.frames, own.scratch.values, own.scratch.lines, own.distance)


@routine
def put_bodies(own: Reaching, pose: Floats) -> int:
    """Place bodies at a whole pose (4, 4) [length], as near as legs come to it where they do not reach; a code."""
    code = rest(own, pose)
    if code != NO_POSE:
        scratch = own.scratch
        place_bodies(own.links, own.near, scratch.frames, scratch.values, scratch.lines)
    return code


@routine
def go(own: Reaching, table: Table, pose: Floats) -> int:
    """Complete `wanted` from a pose at once; a code."""
    if not read_target(own.wanted, pose, table.task[0], own.scratch.pose):
        return NO_POSE
    return close(own, table, own.begin)


@routine
def close(own: Reaching, table: Table, sides: Floats) -> int:
    """Complete the pose of the scratch memory with legs on given sides (legs,); a code."""
    if complete_pose(table, sides, own.scratch) or closes(table, own.scratch):
        return 0
    return LEG + 1 + open_leg(table, own.scratch)


@routine
def lead(own: Reaching, table: Table, pose: Floats, from_home: bool) -> int:
    """Complete `wanted` from a pose or home, in steps that halve where legs do not close; a code."""
    task, way, share, code = table.task[0], 0.0, 0.5, 0
    copy_table(pose, own.present)
    copy_row(own.begin, own.sides)
    if from_home:
        put_pose(own.home.poses[0], task["length"], own.present)
        copy_row(own.home.sides[0], own.sides)
    while way < 1.0 and share >= SHORTEST_SHARE:
        put_between(own, way, share)
        code = NO_POSE
        if read_target(own.step, own.present, task, own.scratch.pose):
            code = close(own, table, own.sides)
        if code == 0:
            put_pose(own.scratch.pose, task["length"], own.present)
            copy_row(own.scratch.sides, own.sides)
            way += share
            share = min(2.0 * share, 1.0 - way)
        else:
            share *= 0.5
    return code


@routine
def put_between(own: Reaching, way: float, share: float) -> None:
    """Fill `step` with the pose on the way from `present`, which is `way` of it, that is `share` of it further."""
    copy_table(own.wanted, own.step)
    if way + share >= 1.0:
        return
    share /= 1.0 - way
    for i in range(3):
        for j in range(3):
            own.step[i, j] = own.present[i, j]
        own.step[i, 3] = own.present[i, 3] + share * (own.wanted[i, 3] - own.present[i, 3])
    difference(own.wanted, own.present, own.turn)
    turn_pose(own.step, scale(share, vec(own.turn)))


@routine
def open_leg(table: Table, scratch: Completion) -> int:
    """Index of the first leg that does not reach, else of the one that is farthest from closing."""
    set_frames(scratch.pose, table.task[0], scratch.frames)
    stretched = stretched_leg(table, scratch)
    if stretched > 0:
        return stretched - 1
    put_rows(table.legs, scratch.frames, scratch.values, scratch.lines, scratch.rows)
    return farthest_leg(table, scratch.rows)


@routine
def stretched_leg(table: Table, scratch: Completion) -> int:
    """Number, from 1, of the first leg that is at a dead point or beyond, with frames placed; 0 if there is none."""
    legs = table.legs
    for k in range(legs.shape[0]):
        n = k + 2 if legs[k]["orients"] == 1 else k + 1
        margin, _ = place_legs(legs[:n], scratch.frames, scratch.sides, scratch.values, scratch.lines)
        if not margin > LEAST_MARGIN * LEAST_MARGIN:
            return k + 1
    return 0


@routine
def farthest_leg(table: Table, rows: Floats) -> int:
    """Index of the leg with the largest equation, lengths of rods on proximal joints among them if they have rows."""
    worst, leg = 0.0, 0
    for k in range(table.legs.shape[0]):
        for row in range(table.legs[k]["first_row"], table.legs[k]["first_row"] + table.legs[k]["n_rows"]):
            if not abs(rows[row]) <= worst:
                worst, leg = abs(rows[row]), k
        if rows.shape[0] > table.task[0]["rows"] and has_proximal(table.legs[k]):
            row = length_row(table, k)
            if not abs(rows[row]) <= worst:
                worst, leg = abs(rows[row]), k
    return leg


@routine
def put_slack(table: Table, values: Floats, slack: Floats) -> int:
    """Fill the slack in every limit [length or rad]; the number of the one exceeded most, 0 if all are kept.

    Two of each range, then cones, as in `LegTable.limits`.
    """
    worst, number, n = KEPT, 0, 2 * table.limited.shape[0]
    for i in range(table.limited.shape[0]):
        limited = table.limited[i]
        value = deviation(limited, values)
        for end in range(2):
            left = value - limited["lo"] if end == 0 else limited["hi"] - value
            slack[2 * i + end] = left * limited["unit"]
            if not -left <= worst:
                worst, number = -left, 2 * i + end + 1
    for i in range(table.cones.shape[0]):
        cone = table.cones[i]
        line, place = values[cone["leg"]], cone["place"]
        left = cone["half_angle"] - angle_between(vec(cone["axis"]), (line[place], line[place + 1], line[place + 2]))
        slack[n + i] = left
        if not -left <= worst:
            worst, number = -left, n + i + 1
    return number


@routine
def put_reached(own: Reaching, pose: Floats, actuators: Floats) -> None:
    """Write the pose (4, 4) [length] at which legs are placed, and the actuators there."""
    task = own.near.task[0]
    put_pose(own.scratch.pose, task["length"], pose)
    for i in range(own.near.driven.shape[0]):
        driven = own.near.driven[i]
        actuators[driven["column"]] = driven["home"] + deviation(driven, own.scratch.values) * driven["unit"]


@routine
def put_turns(own: Reaching, before: Floats, now: Floats) -> None:
    """Add whole turns to actuators that may turn more than once: nearest to those before."""
    for i in range(own.near.driven.shape[0]):
        driven = own.near.driven[i]
        column = driven["column"]
        nearest = wrap(now[column], before[column])
        is_inside = nearest >= driven["home"] + driven["lo"] and nearest <= driven["home"] + driven["hi"]
        if is_multiturn(driven) and is_inside:
            now[column] = nearest
