"""First-order conditions of the feasible pose nearest to a target, from the description alone.

At such a pose every motion that the loops allow, and that would come nearer, is blocked by limits: the slope of the
distance, with the price of what is held, less the slopes of the limits' room times their multipliers, vanishes along
all of these motions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from checks import cone_angle, deviations, placed_bodies, task_offsets, with_axes
from pfabrik import Mechanism, Options, Solution
from pfabrik.machine.description.joints import KINDS
from pfabrik.machine.description.task import task_of

from .search import units
from .turns import Array

STEP = 1e-6
"""Of central differences [L or rad]."""
SINGULAR = 1e-5
"""Singular values of the loops' slopes that count as zero."""


class Conditions(NamedTuple):
    """What holds an answer back, by slopes at its joint coordinates [L or rad]."""

    freedoms: int  # how many motions loops, rigid joints and what is held allow
    slope: Array  # of the distance along these motions
    rest: Array  # what of it the limits that are named, times their multipliers, do not explain


def priced(mechanism: Mechanism, options: Options, away: Array, off: Array) -> Array:
    """The price of what an answer misses of what is to be held [L], rounded off below 1e-3 of the distance."""
    price, points = options.hold_price, mechanism.platform_points
    if options.hold == "orientation" and len(points):
        price += np.linalg.norm(points.mean(axis=0) - mechanism.reference_point) / mechanism.characteristic_length
    rounding = min(1e-3, 0.1 / price) * away
    return np.asarray(price * (np.hypot(off, rounding) - rounding))


def conditions(mechanism: Mechanism, target: Array, answer: Solution, options: Options) -> Conditions:
    """The first-order conditions at a projection of one target (4, 4), asked for with options."""
    explicit, length = with_axes(mechanism), mechanism.characteristic_length
    own = deviations(explicit, answer)
    widths = [len(KINDS[joint.type].coordinates) for joint in explicit.joints]
    scale, ends = units(explicit), np.cumsum(widths)
    x = np.concatenate([own[joint.name][0] for joint in explicit.joints if joint.name in own]) / scale
    first = dict(zip((joint.name for joint in explicit.joints), ends - widths, strict=True))
    points = x + STEP * np.concatenate([np.eye(len(x)), -np.eye(len(x))])
    parts = np.split(points * scale, ends[:-1], axis=1)
    moved = {joint.name: part for joint, part in zip(explicit.joints, parts, strict=True)}
    placed, loops = placed_bodies(explicit, moved)

    def slopes(values: Array) -> Array:
        """Derivatives (len(x), k) of values (2 len(x), k)."""
        return (values[: len(x)] - values[len(x) :]) / (2.0 * STEP)

    body = explicit.end_effector
    body = explicit.joint(body).connects[0] if explicit.end_effector_is_joint else body
    offset, turn = task_offsets(explicit, placed[body] @ explicit.home_pose, target[None])
    parts_off = {"orientation": np.linalg.norm(turn, axis=1), "position": np.linalg.norm(offset, axis=1)}
    rotation_length = options.rotation_length or mechanism.rotation_length
    away = np.hypot(parts_off["position"], rotation_length / length * parts_off["orientation"])
    is_posed = any(task_of(explicit).axes) and task_of(explicit).rotations
    if options.hold and is_posed and answer.held is None:
        away = away + priced(explicit, options, away, parts_off[options.hold])
    held = {"orientation": [turn], "position": [offset]}.get(answer.held or "", [])
    rigid = [
        first[joint.name] + k
        for joint, width in zip(explicit.joints, widths, strict=True)
        for k in range(width * joint.is_rigid)
    ]
    fixed = np.concatenate([slopes(each) for each in [*loops, *held, np.zeros((len(points), 1))]], axis=1)
    fixed = np.concatenate([fixed, np.eye(len(x))[:, rigid]], axis=1)
    left, sizes, _ = np.linalg.svd(fixed)
    free = left[:, np.count_nonzero(sizes > SINGULAR) :]
    slope = length * slopes(away[:, None])[:, 0]
    rest = slope.copy()
    for limit in answer.active_limits:
        joint = explicit.joint(limit.joint)
        if limit.bound == "cone":
            rest += limit.multiplier * slopes(cone_angle(explicit, joint, placed)[:, None])[:, 0]
        elif limit.bound in ("min", "max"):
            column = first[joint.name] + limit.coordinate
            rest[column] += (1.0 if limit.bound == "max" else -1.0) * limit.multiplier * scale[column]
    return Conditions(free.shape[1], slope @ free, rest @ free)
