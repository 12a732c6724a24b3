"""Frames that legs are read in: the body which a leg's head is on, as the body of its foot sees it.

Frame 0 is the platform as seen from the base, frame 1 the base as seen from the platform, frame 2 the platform as seen
from itself. Each arm makes one more out of another: it moves the body that feet are on there, or the one that heads are
on. With arms where they are, a leg is like any other in its frame; and where an arm moves, all in its frame changes as
if the platform moved with it, if the arm is on the platform, or against it.

A rod between two bodies that arms on the platform place is read in frames made out of the third, by twins of these arms
which have their coordinates; and legs read from the platform where arms are read from the base, out of the second.

Rows 0 to 2 of a frame map head points; row 3 is the point about which the platform turns, as the foot's body sees it;
rows 4 to 6 turn directions of the foot's body to those of the base.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Floats, Record, Records
from .._jit import allocator, routine
from ..vectors import Vec, add, cross, dot, move, put, scale, sub, turn, vec
from .endings import either_angle, turned
from .records import CRANK, FIXED, FROM_BASE, FROM_ITSELF, FROM_PLATFORM, Q_PROXIMAL, RATE, REDUNDANT

NOWHERE: Vec = (0.0, 0.0, 0.0)
# Rows of a frame.
ABOUT, AXES, N_ROWS = 3, 4, 7


@allocator
def new_frames(legs: Records) -> Floats:
    """Memory for the frames of a machine."""
    n = FIXED
    for k in range(legs.shape[0]):
        n += 1 if legs[k]["kind"] == REDUNDANT else 0
    frames = np.zeros((n, N_ROWS, 4))
    for i in range(3):
        frames[FROM_BASE, AXES + i, i] = frames[FROM_ITSELF, i, i] = frames[FROM_ITSELF, AXES + i, i] = 1.0
    return frames


@routine
def set_frames(pose: Floats, task: Record, frames: Floats) -> None:
    """Fill the two frames of a pose [L]; those of arms follow as these are placed."""
    p, reference = (pose[0, 3], pose[1, 3], pose[2, 3]), vec(task["reference"])
    for i in range(3):
        for j in range(3):
            frames[FROM_BASE, i, j] = frames[FROM_PLATFORM, AXES + i, j] = pose[i, j]
            frames[FROM_PLATFORM, i, j] = pose[j, i]
        frames[FROM_BASE, i, 3] = frames[FROM_BASE, ABOUT, i] = p[i]
        frames[FROM_PLATFORM, i, 3] = reference[i] - (pose[0, i] * p[0] + pose[1, i] * p[1] + pose[2, i] * p[2])
        frames[FROM_PLATFORM, ABOUT, i] = reference[i]


@routine
def orienting_coordinate(arm: Record, rod: Record, frame: Floats, side: float) -> tuple[float, float]:
    """The coordinate of an arm at which the plane across the hinge at a rod's foot holds the rod's head, and how sure.

    The second number is as of `endings.either_angle`. With the hinge n through F, which the arm turns about a through
    o, or shifts along a, and the head H: (Rot n) . (H - o) = n . (F - o), or n . (H - F - q a) = 0.
    """
    axis, at, n = vec(arm["proximal_axis"]), vec(arm["proximal_point"]), vec(rod["base_end_axes"][0])
    platform_end, base_end, lean = move(frame, vec(rod["platform_end_point"])), vec(rod["base_end_point"]), dot(axis, n)
    if arm["proximal"] != CRANK:
        return dot(n, sub(platform_end, base_end)) / lean, 1.0
    x = sub(platform_end, at)
    rest = lean * dot(axis, x)
    cosine, sine, singularity_margin = either_angle(
        dot(n, x) - rest, dot(cross(axis, n), x), dot(n, sub(base_end, at)) - rest, side
    )
    return math.atan2(sine, cosine), singularity_margin


@routine
def place_redundant(arm: Record, q: float, frames: Floats, own: Floats) -> None:
    """Fill the frame that an arm makes, and its values, its coordinate given."""
    before, after = frames[arm["frame"]], frames[arm["makes"]]
    axis, at, is_hinge = vec(arm["proximal_axis"]), vec(arm["proximal_point"]), arm["proximal"] == CRANK
    cosine, sine = (math.cos(q), math.sin(q)) if is_hinge else (1.0, 0.0)
    own[Q_PROXIMAL] = q
    put_redundant_rate(arm, before, own)
    for j in range(3):
        platform_ends = (before[0, j], before[1, j], before[2, j])
        base_ends = (before[AXES, j], before[AXES + 1, j], before[AXES + 2, j])
        if is_hinge:
            e = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
            e = turned(e, axis, cosine, sine)
            if arm["at_platform_end"] == 1:
                platform_ends = turn(before, e)
            else:
                platform_ends, base_ends = turned(platform_ends, axis, cosine, -sine), turn(before[AXES:], e)
        for i in range(3):
            after[i, j], after[AXES + i, j] = platform_ends[i], base_ends[i]
    shift = (before[0, 3], before[1, 3], before[2, 3])
    about = vec(before[ABOUT])
    if arm["at_platform_end"] == 1:
        shift = move(before, sub(at, turned(at, axis, cosine, sine)) if is_hinge else scale(q, axis))
    elif is_hinge:
        shift = add(at, turned(sub(shift, at), axis, cosine, -sine))
        about = add(at, turned(sub(about, at), axis, cosine, -sine))
    else:
        shift, about = sub(shift, scale(q, axis)), sub(about, scale(q, axis))
    for i in range(3):
        after[i, 3] = shift[i]
    put(after[ABOUT], about)


@routine
def put_redundant_rate(arm: Record, before: Floats, own: Floats) -> None:
    """Fill the velocity, at its reference point, and the angular velocity with which the platform would change all in
    an arm's frame as the arm does."""
    axis, at = vec(arm["proximal_axis"]), vec(arm["proximal_point"])
    if arm["at_platform_end"] == 1:
        axis, at = turn(before, axis), move(before, at)
    velocity, spin = axis, NOWHERE
    if arm["proximal"] == CRANK:
        velocity, spin = cross(axis, sub(vec(before[ABOUT]), at)), axis
    sense = 1.0 if arm["at_platform_end"] != arm["reversed"] else -1.0
    put(own[RATE : RATE + 3], scale(sense, turn(before[AXES:], velocity)))
    put(own[RATE + 3 : RATE + 6], scale(sense, turn(before[AXES:], spin)))


@routine
def q_redundant_of(legs: Records, k: int, q: Floats) -> float:
    """The coordinate of an arm, or of the one whose twin it is."""
    return float(q[legs[k]["mirror_of"] if legs[k]["mirror_of"] >= 0 else k])


@routine
def slope_by_redundant(slope: Floats, own: Floats) -> float:
    """Derivative by an arm of something in its frame, from that by the platform's pose (6,)."""
    rate: float = dot(vec(slope[:3]), vec(own[RATE : RATE + 3])) + dot(vec(slope[3:6]), vec(own[RATE + 3 : RATE + 6]))
    return rate


@routine
def put_pose_slope(leg: Record, frame: Floats, a: Vec, c: Vec, slope: Floats) -> None:
    """Derivative (6,) of a . dH + c . w by the platform's velocity (at its reference point) and angular velocity.

    dH and w are those of the head as the foot's body sees it.
    """
    spin = add(cross(sub(move(frame, vec(leg["platform_end_point"])), vec(frame[ABOUT])), a), c)
    if leg["frame"] != FROM_BASE:
        sense = -1.0 if leg["reversed"] == 1 else 1.0
        a, spin = scale(sense, turn(frame[AXES:], a)), scale(sense, turn(frame[AXES:], spin))
    put(slope[:3], a)
    put(slope[3:6], spin)
