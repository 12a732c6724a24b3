"""Legs that, with all actuators given, keep points of the platform on spheres, as those of most machines do.

The equations are then |R h + p - f| = l, with h in the platform, and the centres f and radii l set by the actuators.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints
from .._jit import routine
from ..legs.frames import AXES, set_frames
from ..legs.kinds import place_frame
from ..legs.records import COSINE, FROM_BASE, HINGE, IDLE, NO_PROXIMAL, PIVOT, Q_PROXIMAL, ROD, SINE, SLIDE, Table
from ..legs.rods import base_end_of
from ..vectors import add, cross, dot, norm, put, scale, sub, turn, vec
from .equations import LegEvaluation, PlatformState, has_proximal, owner_of


class Spheres(NamedTuple):
    """Spheres of the equations, one each."""

    legs: Ints  # (e,): the rod along the radius
    drivers: Ints  # (e,): the actuator that changes the radius; -1 if none
    platform_ends: Floats  # (e, 3): points of the platform
    base_ends: Floats  # (e, 3): centres
    lengths: Floats  # (e,): radii


def new_spheres(table: Table) -> Spheres:
    """Allocate the spheres; none unless all equations are spheres."""
    driven = {(actuator["leg"], actuator["place"]): i for i, actuator in enumerate(table.driven)}
    radii = [
        k for k, leg in enumerate(table.legs) if leg["kind"] == ROD and (leg["slides"] == 0 or (k, SLIDE) in driven)
    ]
    rods = radii if _are_spheres(table, driven) else []
    drivers = np.array([driven.get((k, SLIDE), -1) for k in rods], dtype=np.int64)
    platform_ends, e = table.legs["platform_end_point"][rods], len(rods)
    return Spheres(np.array(rods, dtype=np.int64), drivers, platform_ends, np.zeros((e, 3)), np.zeros(e))


def _are_spheres(table: Table, driven: Collection[tuple[int, int]]) -> bool:
    """True if all equations are spheres.

    Legs are then rods without hinges or twist constraints, read from the base; their proximal and redundant joints are
    actuated, and no other joints but slides.
    """
    for k, leg in enumerate(table.legs):
        is_loose = leg["proximal"] != NO_PROXIMAL and (owner_of(table, k), Q_PROXIMAL) not in driven
        turns = leg["base_end"] == HINGE or leg["platform_end"] == HINGE or leg["twists"] == 1
        is_on_base = leg["frame"] == FROM_BASE or leg["redundant"] >= 0
        is_read = is_on_base and leg["at_platform_end"] == leg["reversed"] == leg["inner"] == 0
        if leg["kind"] == PIVOT or (leg["kind"] != IDLE and (is_loose or turns or not is_read)):
            return False
    return all(entry in (Q_PROXIMAL, SLIDE) for _, entry in driven)


@routine
def set_spheres(table: Table, values: Floats, state: PlatformState, leg_eval: LegEvaluation, spheres: Spheres) -> None:
    """Fill centres and radii at the state's proximal and redundant coordinates and the actuators' values.

    Values (n_actuators,) are deviations from home [L or rad].
    """
    legs, leg_values, q, frames, pose = table.legs, leg_eval.values, state.q, leg_eval.frames, state.pose
    p = (pose[0, 3], pose[1, 3], pose[2, 3])
    set_frames(state.pose, table.task[0], leg_eval.frames)
    for k in range(q.shape[0]):
        place_frame(legs, k, q, leg_eval.frames, leg_values)
        if has_proximal(legs[k]):
            leg_values[k, Q_PROXIMAL], leg_values[k, COSINE], leg_values[k, SINE] = q[k], math.cos(q[k]), math.sin(q[k])
    for e in range(spheres.legs.shape[0]):
        k, i = spheres.legs[e], spheres.drivers[e]
        leg, owner = legs[k], owner_of(table, k)
        base_end = base_end_of(leg, legs[owner], leg_values[owner])
        if leg["redundant"] >= 0:
            frame = frames[leg["frame"]]
            base_end = add(p, turn(frame[AXES:], sub(base_end, (frame[0, 3], frame[1, 3], frame[2, 3]))))
        put(spheres.base_ends[e], base_end)
        spheres.lengths[e] = leg["length"]
        if i >= 0:
            spheres.lengths[e] += table.driven[i]["sense"] * values[table.driven[i]["column"]]


@routine
def put_spheres(pose: Floats, spheres: Spheres, equations: Floats) -> float:
    """Fill the equations (e, m + 1), right-hand side last, at a pose; the largest residual, infinite if not finite."""
    platform_ends, base_ends, lengths, worst = spheres.platform_ends, spheres.base_ends, spheres.lengths, 0.0
    p, m = (pose[0, 3], pose[1, 3], pose[2, 3]), equations.shape[1] - 1
    for e in range(lengths.shape[0]):
        lever, equation = turn(pose, vec(platform_ends[e])), equations[e]
        x = sub(add(lever, p), vec(base_ends[e]))
        length = math.sqrt(dot(x, x))
        u, off = scale(1.0 / length, x), length - lengths[e]
        put(equation, u)
        if m > 3:
            put(equation[3:], cross(lever, u))
        equation[m] = -off
        worst = max(worst, abs(off)) if abs(off) < math.inf else math.inf
    return worst


@routine
def put_sphere_errors(pose: Floats, spheres: Spheres, equations: Floats) -> float:
    """Fill the right-hand sides of the equations alone, as `put_spheres` does."""
    platform_ends, base_ends, lengths, worst = spheres.platform_ends, spheres.base_ends, spheres.lengths, 0.0
    p, m = (pose[0, 3], pose[1, 3], pose[2, 3]), equations.shape[1] - 1
    for e in range(lengths.shape[0]):
        off = norm(sub(add(turn(pose, vec(platform_ends[e])), p), vec(base_ends[e]))) - lengths[e]
        equations[e, m] = -off
        worst = max(worst, abs(off)) if abs(off) < math.inf else math.inf
    return worst
