"""Frames that legs are read in: the pose of the body at a leg's platform end, relative to the body at its base end.

Frame 0 is the platform relative to the base, frame 1 the base relative to the platform, frame 2 the platform relative
to itself. Each redundant joint defines one more frame from another: it moves the body of the base ends there, or that
of the platform ends. With the redundant joints fixed, a leg is like any other in its frame; when such a joint moves,
everything in its frame changes as if the platform moved: with the joint, if the joint is on the platform, else against
it.

A rod between two bodies that redundant joints on the platform place is read in frames derived from frame 2, by mirrored
joints that copy the coordinates of these joints; so are, from frame 1, legs read from the platform while the redundant
joints are read from the base.

Rows 0 to 2 of a frame map points at platform ends; row 3 is the point about which the platform turns, in the body of
the base end; rows 4 to 6 rotate directions of that body into the base.
"""

from __future__ import annotations

import math

import numpy as np

from ...common.arrays import Floats, Record, Records
from .._jit import allocator, routine
from ..vectors import Vec, add, cross, dot, move, put, scale, sub, turn, vec
from .endings import solve_angle, turned
from .records import CRANK, FIXED, FROM_BASE, FROM_ITSELF, FROM_PLATFORM, Q_PROXIMAL, RATE

ZERO: Vec = (0.0, 0.0, 0.0)
# Rows of a frame.
CENTRE, AXES, N_ROWS = 3, 4, 7


@allocator
def new_frames(legs: Records) -> Floats:
    """Allocate the frames of a machine."""
    n = FIXED
    for k in range(legs.shape[0]):
        n = max(n, legs[k]["makes"] + 1)
    frames = np.zeros((n, N_ROWS, 4))
    for i in range(3):
        frames[FROM_BASE, AXES + i, i] = frames[FROM_ITSELF, i, i] = frames[FROM_ITSELF, AXES + i, i] = 1.0
    return frames


@routine
def set_frames(pose: Floats, task: Record, frames: Floats) -> None:
    """Fill the two frames of a pose [L]; the frames of redundant joints are filled by `place_redundant`."""
    p, reference = (pose[0, 3], pose[1, 3], pose[2, 3]), vec(task["reference"])
    for i in range(3):
        for j in range(3):
            frames[FROM_BASE, i, j] = frames[FROM_PLATFORM, AXES + i, j] = pose[i, j]
            frames[FROM_PLATFORM, i, j] = pose[j, i]
        frames[FROM_BASE, i, 3] = frames[FROM_BASE, CENTRE, i] = p[i]
        frames[FROM_PLATFORM, i, 3] = reference[i] - (pose[0, i] * p[0] + pose[1, i] * p[1] + pose[2, i] * p[2])
        frames[FROM_PLATFORM, CENTRE, i] = reference[i]


@routine
def orienting_coordinate(joint: Record, rod: Record, frame: Floats, side: float) -> tuple[float, float]:
    """Coordinate of a redundant joint that turns a rod's base hinge towards its platform end; the singularity margin.

    The platform end H lies in the plane across the hinge n through F. If the joint turns about a through o, then
    (Rot n) . (H - o) = n . (F - o); if it shifts along a, then n . (H - F - q a) = 0. The margin is of `solve_angle`.
    """
    axis, point, n = vec(joint["proximal_axis"]), vec(joint["proximal_point"]), vec(rod["base_end_axes"][0])
    platform_end, base_end, axial = (
        move(frame, vec(rod["platform_end_point"])),
        vec(rod["base_end_point"]),
        dot(axis, n),
    )
    if joint["proximal"] != CRANK:
        return dot(n, sub(platform_end, base_end)) / axial, 1.0
    x = sub(platform_end, point)
    axial_offset = axial * dot(axis, x)
    cosine, sine, singularity_margin = solve_angle(
        dot(n, x) - axial_offset, dot(cross(axis, n), x), dot(n, sub(base_end, point)) - axial_offset, side
    )
    return math.atan2(sine, cosine), singularity_margin


@routine
def place_redundant(joint: Record, q: float, frames: Floats, values: Floats) -> None:
    """Fill the frame that a redundant joint defines, and its values, at the coordinate q."""
    before, after = frames[joint["frame"]], frames[joint["makes"]]
    axis, point, is_hinge = vec(joint["proximal_axis"]), vec(joint["proximal_point"]), joint["proximal"] == CRANK
    cosine, sine = (math.cos(q), math.sin(q)) if is_hinge else (1.0, 0.0)
    values[Q_PROXIMAL] = q
    put_redundant_rate(joint, before, values)
    for j in range(3):
        platform_ends = (before[0, j], before[1, j], before[2, j])
        base_ends = (before[AXES, j], before[AXES + 1, j], before[AXES + 2, j])
        if is_hinge:
            e = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
            e = turned(e, axis, cosine, sine)
            if joint["at_platform_end"] == 1:
                platform_ends = turn(before, e)
            else:
                platform_ends, base_ends = turned(platform_ends, axis, cosine, -sine), turn(before[AXES:], e)
        for i in range(3):
            after[i, j], after[AXES + i, j] = platform_ends[i], base_ends[i]
    shift = (before[0, 3], before[1, 3], before[2, 3])
    centre = vec(before[CENTRE])
    if joint["at_platform_end"] == 1:
        shift = move(before, sub(point, turned(point, axis, cosine, sine)) if is_hinge else scale(q, axis))
    elif is_hinge:
        shift = add(point, turned(sub(shift, point), axis, cosine, -sine))
        centre = add(point, turned(sub(centre, point), axis, cosine, -sine))
    else:
        shift, centre = sub(shift, scale(q, axis)), sub(centre, scale(q, axis))
    for i in range(3):
        after[i, 3] = shift[i]
    put(after[CENTRE], centre)


@routine
def put_redundant_rate(joint: Record, before: Floats, values: Floats) -> None:
    """Fill the rate of a redundant joint: the platform twist with the same effect in its frame.

    The twist is the velocity of the reference point and the angular velocity, per unit rate of the joint.
    """
    axis, point = vec(joint["proximal_axis"]), vec(joint["proximal_point"])
    if joint["at_platform_end"] == 1:
        axis, point = turn(before, axis), move(before, point)
    velocity, spin = axis, ZERO
    if joint["proximal"] == CRANK:
        velocity, spin = cross(axis, sub(vec(before[CENTRE]), point)), axis
    sense = 1.0 if joint["at_platform_end"] != joint["reversed"] else -1.0
    put(values[RATE : RATE + 3], scale(sense, turn(before[AXES:], velocity)))
    put(values[RATE + 3 : RATE + 6], scale(sense, turn(before[AXES:], spin)))


@routine
def q_redundant_of(legs: Records, k: int, q: Floats) -> float:
    """Coordinate of a redundant joint, or of the joint that it mirrors."""
    return float(q[legs[k]["mirror_of"] if legs[k]["mirror_of"] >= 0 else k])


@routine
def redundant_slope(slope: Floats, values: Floats) -> float:
    """Derivative by a redundant joint of a quantity in its frame, from the derivative (6,) by the pose."""
    rate: float = dot(vec(slope[:3]), vec(values[RATE : RATE + 3])) + dot(
        vec(slope[3:6]), vec(values[RATE + 3 : RATE + 6])
    )
    return rate


@routine
def put_pose_slope(leg: Record, frame: Floats, a: Vec, c: Vec, slope: Floats) -> None:
    """Derivative (6,) of a . dH + c . w by the platform's velocity (at its reference point) and angular velocity.

    dH is the velocity of the platform end and w the angular velocity of its body, both in the body of the base end.
    """
    spin = add(cross(sub(move(frame, vec(leg["platform_end_point"])), vec(frame[CENTRE])), a), c)
    if leg["frame"] != FROM_BASE:
        sense = -1.0 if leg["reversed"] == 1 else 1.0
        a, spin = scale(sense, turn(frame[AXES:], a)), scale(sense, turn(frame[AXES:], spin))
    put(slope[:3], a)
    put(slope[3:6], spin)
