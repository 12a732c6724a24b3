"""The nearest feasible pose of a platform on struts: descents on its pose, and on arms that carry struts."""

from __future__ import annotations

import math

from .._jit import routine
from ..sqp import DONE, LARGEST, MOTIONS, begin_descent, judge_step, plan_step
from ..vectors import add, cross, norm, scale, sub, vec
from .frames import turn_pose_by_vector
from .plan import HOLD_ORIENTATION, HOLD_POSITION, LENGTH, Configuration, Floats, Plan, Settings
from .project import copy_configuration
from .strut_views import (
    Descent,
    lagrangian_hessian,
    move_all,
    number_motions,
    objective,
    restore_feasibility,
    step_to,
    take,
    unit_of,
)

MOST_STEPS = 200
"""Steps of a search, including those that are taken back; most need a dozen."""

STARTS, HITS = 12, 4
"""Most starts of a search where arms carry the struts, and how often they find the best pose before it is believed."""

TRIES = 5
"""Most starts where struts stand on the base: as long as nothing is found, and for far targets."""

FAR = 1.0
"""Distance from which a target may have another nearest pose than the first found, if no arms move [L]."""

TWIST = 0.5
"""How far the platform is turned for other starts [rad]: hexapods have further nearest poses that are twisted."""

ASIDE, TURN_ASIDE = 0.4, 2.0 * math.pi / 3.0
"""How far to the side of the nearest pose so far others are looked for [L], and by what angle from one side to the
next [rad]."""

SPREAD = (0.38196601, 0.61803399, 0.75487767, 0.56984029)
"""Irrational shares, by whose multiples starts are spread over the ranges of the arms' joints."""

SAME = 1e-7
"""Share by which a later start must come nearer to be preferred to an earlier one."""


@routine
def descend(plan: Plan, wanted: Floats, weight: float, search: Descent) -> bool:
    """From `best`, a pose that has what is held, down to the nearest; False where it finds no feasible one."""
    view, other, hessian, control, p = search.first, search.second, search.hessian, search.control, search.p
    search.unit[0] = 1.0
    value = objective(plan, search.best, wanted, weight, search, search.here)
    search.unit[0] = 1.0 / max(math.sqrt(2.0 * value), 1e-12)
    if not restore_feasibility(plan, search.best, wanted, weight, search, view):
        return False
    begin_descent(view, hessian, control)
    while control.counts[DONE] == 0:
        control.scalars[LARGEST] = lagrangian_hessian(plan, wanted, weight, search, view)
        led_down = False
        while not led_down and control.counts[DONE] == 0:
            if plan_step(view, hessian, control, MOST_STEPS, p):
                copy_configuration(plan, search.best, search.trial)
                share = take(plan, search, p.x, search.trial)
                feasible = restore_feasibility(plan, search.trial, wanted, weight, search, other)
                led_down = judge_step(view, other, feasible, share, control)
                if led_down:
                    copy_configuration(plan, search.trial, search.best)
                    view, other = other, view
    return True


@routine
def begin(
    plan: Plan, start: int, now: Configuration, safe: Configuration, wanted: Floats, hold: int, search: Descent
) -> None:
    """Put a start into `best`: where a projection ended, or where all was feasible, or beside the nearest pose so far.

    Starts after the first are turned, if the orientation is free, and have other arms.
    """
    best, arms = search.best, plan.trunk_joints.shape[0] > 0
    if start >= 2 and not arms:
        copy_configuration(plan, search.nearest, best)
        step_aside(plan, best, wanted, TURN_ASIDE * (start - 2))
    else:
        copy_configuration(plan, now if start == 0 else safe, best)
    if start > 0 and hold != HOLD_ORIENTATION:
        turn_about_struts(plan, best, TWIST if start % 2 == 1 else -TWIST)
    for i in range(3):
        if hold == HOLD_POSITION:
            best.pose[i, 3] = wanted[i, 3]
        if hold == HOLD_ORIENTATION:
            for j in range(3):
                best.pose[i, j] = wanted[i, j]
    for j in range(plan.trunk_joints.shape[0] if start >= 2 else 0):
        joint = plan.trunk_joints[j]
        lo, hi = max(joint["lo"], -math.pi * unit_of(plan, j)), min(joint["hi"], math.pi * unit_of(plan, j))
        share = (SPREAD[j % 4] * (start - 1 + j // 4)) % 1.0
        best.trunks[j] = lo + share * (hi - lo)
    for i in range(search.row.shape[0]):
        search.row[i] = 0.0
    move_all(plan, search.row, 0.0, best)


@routine
def step_aside(plan: Plan, now: Configuration, wanted: Floats, angle: float) -> None:
    """Move the platform across the direction of its target, to a side given by an angle."""
    off, _ = step_to(plan, now, wanted)
    across = cross(off, (1.0, 0.0, 0.0) if abs(off[0]) <= max(abs(off[1]), abs(off[2])) else (0.0, 1.0, 0.0))
    other = cross(off, across)
    if norm(other) == 0.0:
        return
    one = scale(ASIDE * plan.scalars[LENGTH] * math.cos(angle) / norm(across), across)
    two = scale(ASIDE * plan.scalars[LENGTH] * math.sin(angle) / norm(other), other)
    for i in range(3):
        now.pose[i, 3] += one[i] + two[i]


@routine
def turn_about_struts(plan: Plan, now: Configuration, angle: float) -> None:
    """Turn the platform about the mean direction of its struts."""
    axis = (0.0, 0.0, 0.0)
    for b in range(plan.branches.shape[0]):
        branch = plan.branches[b]
        axis = add(axis, sub(vec(now.nodes[branch["last"]]), vec(now.nodes[branch["first"]])))
    size = norm(axis)
    if size > 0.0:
        turn_pose_by_vector(now.pose, scale(angle / size, axis))


@routine
def find_nearest(
    plan: Plan,
    now: Configuration,
    safe: Configuration,
    wanted: Floats,
    hold: int,
    settings: Settings,
    search: Descent,
) -> bool:
    """The nearest feasible pose that has what is held, into `now`; False where none is found.

    From where the projection ended, and from where all was feasible; where arms carry the struts, or nothing is found
    yet, from other starts too.
    """
    weight = (settings.rotation_length / plan.scalars[LENGTH]) ** 2
    n = number_motions(plan, hold, search)
    for linear in (search.first, search.second):
        linear.counts[MOTIONS] = n
        for a in range(n):
            for b in range(a):
                linear.metric[a, b] = 0.0
            linear.metric[a, a] = 1.0
    arms = plan.trunk_joints.shape[0] > 0
    copy_configuration(plan, safe, search.nearest)
    hits, least = 0, math.inf
    for start in range(STARTS if arms else TRIES):
        if (hits >= HITS) if arms else (hits > 0 and least < 0.5 * FAR * FAR):
            break
        begin(plan, start, now, safe, wanted, hold, search)
        if descend(plan, wanted, weight, search):
            search.unit[0] = 1.0
            value = objective(plan, search.best, wanted, weight, search, search.here)
            if value < (1.0 - SAME) * least:
                hits, least = 1, value
                copy_configuration(plan, search.best, search.nearest)
            elif value <= (1.0 + SAME) * least:
                hits += 1
    if hits > 0:
        copy_configuration(plan, search.nearest, now)
    return hits > 0
