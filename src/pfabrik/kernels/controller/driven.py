"""Forces of actuators that move a machine at a pose, by the places of its bodies."""

from __future__ import annotations

from typing import NamedTuple

from ...common.arrays import Floats, Ints
from .._jit import routine
from ..dynamics.effort_at_pose import put_asked, put_components
from ..dynamics.inverse_dynamics import put_efforts
from ..dynamics.moving import FREE_PART, NOT_MADE, SINGULAR, Exerted, MovingMachine, MovingScratch
from ..dynamics.placing import put_screws
from ..vectors import add, along, copy_row, cross, dot, move, scale, sub, turn, vec
from .links_on_bodies import AXIS, FIRST_MOVED, KIND_OF, POINT, WITH_BASE_END, LinksOnBodies
from .reached import LEG, NO_POSE, Reaching, put_bodies

GAINS_MOTION, NEVER_MADE, LEFT_FREE, GIVES_WAY = -6, -7, -8, -9
"""Codes: the loops gain a motion; the machine cannot move so; loads move a part without inertia that nothing holds;
actuators do not hold the machine."""


class Driving(NamedTuple):
    """A machine with masses, and the memory of a call."""

    moving: MovingMachine
    scratch: MovingScratch
    numbers: Ints  # (frames,): the body with each frame
    axes: Floats  # (k, 6): components of twists that the task sets
    tilts: Ints  # (1,): 1 if rotations are about the axes of the platform
    shown: Floats  # (k, 6): the same where the platform is
    rates: Floats  # (k,)
    gains: Floats
    results: Exerted
    units: Floats  # (2,): of lengths in L, and of gravity


@routine
def put_exerted(
    own: Driving, reaching: Reaching, pose: Floats, twist: Floats, gain: Floats, gravity: Floats, effort: Floats
) -> int:
    """Fill the actuators' forces [N, N m] at a whole pose that moves with a twist and its change; a code."""
    code = put_bodies(reaching, pose)
    if code == NO_POSE or (code >= LEG and code < 10 * LEG):
        return code
    moving, links = own.moving, reaching.links
    put_frames(own, links)
    put_screws(moving, own.scratch)
    for i in range(3):
        moving.gravity[i] = gravity[i] / own.units[1]
    put_asked(own.axes, own.tilts[0], pose, own.shown)
    put_components(own.shown, twist, own.units[0], own.rates)
    put_components(own.shown, gain, own.units[0], own.gains)
    marks = put_efforts(moving, own.scratch, own.shown, own.rates, own.gains, own.rates[:0], 0, own.results)
    if marks != 0:
        if marks & SINGULAR != 0:
            return GAINS_MOTION
        if marks & NOT_MADE != 0:
            return NEVER_MADE
        return LEFT_FREE if marks & FREE_PART != 0 else GIVES_WAY
    copy_row(own.results.actuators[0], effort)
    return 0


@routine
def put_frames(own: Driving, links: LinksOnBodies) -> None:
    """Fill the frames by the bodies; a rod between balls has some spin, which does not matter."""
    for frame in range(own.numbers.shape[0]):
        number, T = own.numbers[frame], own.scratch.T[frame]
        body = links.displaced[number]
        for i in range(3):
            copy_row(body[i], T[i])
        motion = number - FIRST_MOVED
        if motion >= 0 and links.motions[motion, KIND_OF] >= WITH_BASE_END:
            line, point = vec(links.numbers[motion, AXIS:]), vec(links.numbers[motion, POINT:])
            at, u = move(body, point), turn(body, line)
            about, cosine = cross(line, u), dot(line, u)
            for i in range(3):
                e = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
                turned = add(scale(cosine, e), cross(about, e))
                turned = along(turned, dot(about, e) / (1.0 + cosine), about)
                for j in range(3):
                    T[j, i] = turned[j]
            at = sub(at, turn(T, point))
            for i in range(3):
                T[i, 3] = at[i]
