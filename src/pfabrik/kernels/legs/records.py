"""A mechanism as a table of legs: what the kernels are given.

Lengths are divided by the characteristic length L, angles are in radians, axes are unit vectors; all of it at home, in
base coordinates. A leg read from the base ends on the platform; one that is reversed is read from the platform and
ends on the base. Its *foot* is the end it is read from, its *head* the other one.

A rod is [carrier] + foot ending + rigid or sliding rod + head ending; a pivot is [slides] + one ending of no length. An
arm is a hinge or a slide next to the base or the platform that other legs are on, and that the pose alone does not
tell: its coordinate is given, or found with what a target leaves open.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Ints, Records

# An idle leg has nothing to say of a platform that does not turn.
ROD, PIVOT, REDUNDANT, IDLE = 0, 1, 2, 3
# What carries the foot: nothing, a hinge, a slide; or what carries the rod before (a second forearm). Of an arm, what
# it is.
NO_PROXIMAL, CRANK, CARRIAGE, SHARED = 0, 1, 2, 3
# Endings: a weld, a hinge, two hinges that cross, three hinges through one point, a ball.
WELD, HINGE, CROSS, TRIPLE, BALL = 0, 1, 2, 3, 4
# Frames that legs are read in, see `frames`, and how many there are without arms.
FROM_BASE, FROM_PLATFORM, FROM_ITSELF, FIXED = 0, 1, 2, 3

_vector = ("f8", (3,))

LEG = np.dtype(
    [
        ("kind", "i8"),
        ("reversed", "i8"),
        ("redundant", "i8"),  # the leg which is the arm that it is on; -1 if it is on none
        ("frame", "i8"),  # that it is read in, see `frames`
        ("makes", "i8"),  # of an arm: the frame that it makes
        ("mirror_of", "i8"),  # of an arm: the leg whose coordinate it has, -1 if its own; see `frames`
        ("column", "i8"),  # of an arm: where derivatives by its coordinate are, after the six by the pose
        ("inner", "i8"),  # 1: it is between bodies that arms on the platform place, and says nothing of the pose
        ("at_platform_end", "i8"),  # of an arm, 1: it moves the body that heads are on
        ("orients", "i8"),  # of an arm, 1: it brings the hinge at the foot of the rod after it to face the head
        ("proximal", "i8"),
        ("slides", "i8"),  # 1: a rod that changes its length; of a pivot, how many slides there are
        ("twists", "i8"),  # 1: both endings hold the rod against spinning about itself
        ("base_end", "i8"),  # ending of a rod's foot, or of a pivot
        ("platform_end", "i8"),
        ("base_end_aimed", "i8"),  # 1: the angles of this ending are asked for
        ("platform_end_aimed", "i8"),
        ("proximal_axis", *_vector),
        ("proximal_point", *_vector),  # of a crank: where on its axis the spoke stands
        ("crank", *_vector),  # from there to the foot
        ("crank_across", *_vector),  # the spoke a quarter turn on
        ("side", "f8"),  # which of two solutions is home's: of carrier, arm, or a pivot's three hinges
        ("base_end_point", *_vector),
        ("platform_end_point", *_vector),  # as `frames` map it: seen from the reference point, if not reversed
        ("length", "f8"),
        ("line", *_vector),  # unit vector from foot to head
        ("base_end_axes", "f8", (3, 3)),  # hinges in order from the body that the foot is on
        ("platform_end_axes", "f8", (3, 3)),  # hinges in order from the body that the head is on
        ("base_end_side", "f8"),  # which of the two ways to aim two crossed hinges is home's
        ("platform_end_side", "f8"),
        ("twist", "f8"),  # angle between the marks of the two endings, about the line
        ("slide_rows", "f8", (3, 3)),  # of a pivot: the first `slides` give these from the centre's displacement
        ("fixed_rows", "f8", (3, 3)),  # of a pivot: directions in which its centre cannot move, 3 - slides of them
        ("axis_rows", "i8"),  # of a pivot: how many conditions kept . R moved = value its ending makes
        ("kept", "f8", (3, 3)),
        ("moved", "f8", (3, 3)),
        ("value", *_vector),
        ("first_row", "i8"),  # place of its first constraint among all
        ("has_rows", "i8"),  # 1: it, or a rod on its carrier, leaves a constraint; of an arm, a leg on it
        ("upright", "i8"),  # of a pivot: how many of its `base_end_axes` R must not turn over
    ]
)

# What is told of a leg at a pose: places in its row of `values`.
Q_PROXIMAL, BASE_END, SLIDE, PLATFORM_END = (
    0,
    1,
    4,
    5,
)  # three angles at FOOT and at HEAD; the slides of a pivot at HEAD
# The rod's direction as seen by the body its foot, or its head, is on; the third hinge of a pivot by that of its foot.
BASE_LINE, PLATFORM_LINE = 8, 11
COSINE, SINE = 14, 15  # of the crank's angle
RATE = 1  # of an arm: the velocity and angular velocity of the platform that would change as much in its frame
N_VALUES = 16

COORDINATE = np.dtype(
    [
        ("leg", "i8"),
        ("place", "i8"),  # in the leg's values
        ("column", "i8"),  # among what is filled with it: actuators, or joint coordinates
        ("turns", "i8"),  # 1: an angle that counts into its range by whole turns
        ("sense", "f8"),  # deviation from home = sense * value
        ("lo", "f8"),  # of the deviation [L or rad]
        ("hi", "f8"),
        ("home", "f8"),  # [length or rad]
        ("unit", "f8"),  # L for lengths, 1 for angles
    ]
)

CONE = np.dtype(
    [
        ("leg", "i8"),
        ("place", "i8"),
        ("axis", *_vector),  # as seen by the body, toward the head
        ("half_angle", "f8"),
        ("least_cosine", "f8"),  # of the half angle and its tolerance
        ("leader", "i8"),  # the first of the cones that have the same half angle
    ]
)

TASK = np.dtype(
    [
        ("length", "f8"),
        ("reference", *_vector),  # at home [L]
        ("centre", *_vector),  # from there to the middle of the joints on the platform, at home [L]
        ("axes", "i8", (3,)),  # 1: this coordinate of the position is set
        ("rotations", "i8"),  # 3: the rotation is set, 2: the direction of the z axis, 1: the yaw, 0: nothing
        ("unset", "i8"),  # how many coordinates of the pose are not
        ("redundant", "i8"),  # how many arms there are, if these follow from what the legs on them ask for
        ("implicit", "i8"),  # 1: some of them by no closed form, but from where they were
        ("rows", "i8"),  # how many constraints the legs have
        ("farthest", "f8"),  # what is not set may not go farther from where it began [L or rad]
    ]
)


class Table(NamedTuple):
    """A mechanism's legs, as `decomposition.leg_table` has them."""

    legs: Records
    limited: Records
    cones: Records
    driven: Records
    known: Records
    task: Records  # one
    columns: Ints  # (legs,): the unknown that a leg's own carrier, or the arm, has; -1 where there is none
