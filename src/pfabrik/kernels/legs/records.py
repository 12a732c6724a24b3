"""A mechanism as a table of legs: the input of the kernels.

Lengths are divided by the characteristic length L, angles are in radians, axes are unit vectors; all of it at home, in
base coordinates. A leg read from the base ends on the platform; a reversed leg is read from the platform and ends on
the base. Its *base end* is the end that it is read from, its *platform end* the other one.

A rod leg is [crank or carriage] + ending + rigid or sliding rod + ending; a pivot is [slides] + one ending, without
length. A redundant joint is a hinge or a slide next to the base or the platform that carries other legs and that the
pose alone does not determine: its coordinate is given, or solved for with what a target leaves open.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Ints, Records
from .._jit import opener

# Kinds of legs. An idle leg does not constrain a platform that cannot turn.
ROD, PIVOT, REDUNDANT, IDLE = 0, 1, 2, 3
# The proximal joint of a rod: none, a hinge, a slide, or that of the rod before (a second forearm). Of a redundant
# joint, its own kind.
NO_PROXIMAL, CRANK, CARRIAGE, SHARED = 0, 1, 2, 3
# Endings: a weld, a hinge, two hinges that cross, three hinges through one point, a ball.
WELD, HINGE, CROSS, TRIPLE, BALL = 0, 1, 2, 3, 4
# Frames that legs are read in, defined in `frames`; FIXED is their number without redundant joints.
FROM_BASE, FROM_PLATFORM, FROM_ITSELF, FIXED = 0, 1, 2, 3

_vector = ("f8", (3,))

LEG = np.dtype(
    [
        ("kind", "i8"),
        ("reversed", "i8"),
        ("redundant", "i8"),  # index of the redundant joint that it is on; -1 if none
        ("frame", "i8"),  # the frame that it is read in
        ("makes", "i8"),  # of a redundant joint: the frame that it defines; 0 of other legs
        ("mirror_of", "i8"),  # of a redundant joint: the leg whose coordinate it copies; -1 if none
        ("column", "i8"),  # of a redundant joint: column of its derivatives, after the six of the pose
        ("inner", "i8"),  # 1: it connects bodies placed by redundant joints, and does not depend on the pose
        ("at_platform_end", "i8"),  # of a redundant joint, 1: it moves the body of the platform ends
        ("orients", "i8"),  # of a redundant joint, 1: it turns the base hinge of the next rod towards the platform end
        ("implicit", "i8"),  # of a redundant joint, 1: without a closed form; its coordinate stands in place of a side
        ("proximal", "i8"),
        ("has_proximal", "i8"),  # 1: a rod with a proximal joint of its own
        ("slides", "i8"),  # 1: a rod that changes its length; of a pivot, how many slides there are
        ("twists", "i8"),  # 1: both endings keep the rod from spinning about its line
        ("base_end", "i8"),  # ending of a rod at its base end, or of a pivot
        ("platform_end", "i8"),
        ("base_end_aimed", "i8"),  # 1: the angles of this ending are needed, as always of three hinges of a pivot
        ("platform_end_aimed", "i8"),
        ("proximal_axis", *_vector),
        ("proximal_point", *_vector),  # of a crank: the point of its axis where the lever starts
        ("crank", *_vector),  # the lever: from there to the base end of the rod
        ("crank_across", *_vector),  # the lever turned by a quarter turn
        ("side", "f8"),  # home's side: of the proximal or redundant joint, or of a pivot's three hinges
        ("base_end_point", *_vector),
        ("platform_end_point", *_vector),  # as mapped by the frame: from the reference point, if not reversed
        ("length", "f8"),
        ("line", *_vector),  # unit vector from base end to platform end; the last of three hinges of a pivot
        ("base_end_axes", "f8", (3, 3)),  # hinges in order from the body of the base end
        ("platform_end_axes", "f8", (3, 3)),  # hinges in order from the body of the platform end
        ("base_end_side", "f8"),  # home's side of two crossed hinges
        ("platform_end_side", "f8"),
        ("twist", "f8"),  # angle between the twist marks of the two endings, about the line
        (
            "slide_rows",
            "f8",
            (3, 3),
        ),  # of a pivot: the first `slides` rows give the slides from the centre's displacement
        ("fixed_rows", "f8", (3, 3)),  # of a pivot: directions in which its centre cannot move, 3 - slides of them
        ("kept", "f8", (3, 3)),  # of a pivot: the conditions kept . R moved = value of its ending
        ("moved", "f8", (3, 3)),
        ("value", *_vector),
        ("first_row", "i8"),  # index of its first constraint
        ("n_rows", "i8"),  # number of its constraints; of a pivot, 3 - slides and then the conditions of its ending
        ("has_rows", "i8"),  # 1: it, a rod on its proximal joint, or a leg on this redundant joint has constraint rows
        ("upright", "i8"),  # of a pivot: number of its `base_end_axes` that R must not turn over
    ]
)

# Columns of a leg's `values` at a pose: proximal coordinate, up to three angles of the ending at the base end, slide,
# up to three angles of the ending at the platform end; the slides of a pivot start at PLATFORM_END.
Q_PROXIMAL, BASE_END, SLIDE, PLATFORM_END = 0, 1, 4, 5
# Direction of the rod in the body of its base end, and of its platform end; the third hinge of a pivot at BASE_LINE.
BASE_LINE, PLATFORM_LINE = 8, 11
COSINE, SINE = 14, 15  # of the crank angle
RATE = 1  # of a redundant joint: the equivalent velocity and angular velocity of the platform, per unit rate
N_VALUES = 16

COORDINATE = np.dtype(
    [
        ("leg", "i8"),
        ("place", "i8"),  # column of the leg's values
        ("column", "i8"),  # of the output: actuators, or joint coordinates
        ("turns", "i8"),  # 1: an angle, taken modulo whole turns into its range
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
        ("axis", *_vector),  # in the body, towards the platform end
        ("half_angle", "f8"),
        ("least_cosine", "f8"),  # cosine of the half angle plus its tolerance
        ("leader", "i8"),  # index of the first cone with the same half angle
    ]
)

TASK = np.dtype(
    [
        ("length", "f8"),
        ("reference", *_vector),  # at home [L]
        ("centre", *_vector),  # from there to the centre of the joints on the platform, at home [L]
        ("axes", "i8", (3,)),  # 1: this coordinate of the position is set
        ("rotations", "i8"),  # 3: the rotation is set, 2: the direction of the z axis, 1: the yaw, 0: nothing
        ("unset", "i8"),  # number of pose coordinates that the task does not set
        ("redundant", "i8"),  # number of redundant joints that are solved for
        ("implicit", "i8"),  # 1: some of these are implicit
        ("rows", "i8"),  # number of constraints of all legs
        ("farthest", "f8"),  # how far unset coordinates may move from the start [L or rad]
    ]
)


class Table(NamedTuple):
    """The kernel table of a mechanism's legs, built by `decomposition.leg_table`."""

    legs: Records
    limited: Records
    cones: Records
    driven: Records
    known: Records
    task: Records  # one
    columns: Ints  # (legs,): the unknown of the proximal or redundant joint; -1 if none


_RECORDS = (LEG, COORDINATE, CONE, COORDINATE, COORDINATE, TASK, np.dtype(np.int64))

SAMPLE = Table._make(np.zeros(1, record) for record in _RECORDS)
"""A table of the array types that kernels are compiled for."""

open_table = opener(SAMPLE)
"""The table at the address of a `Handle`."""
