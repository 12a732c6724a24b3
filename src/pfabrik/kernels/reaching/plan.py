"""What the kernels are given and what they fill: the mechanism as flat records, and the rows of a batch.

Lengths are divided by nothing: every array is in the mechanism's own unit, angles in radians. Vectors named `home` are
in base coordinates at home; a branch that hangs on a trunk moves rigidly with it (its carrier); what is fixed to the
platform is given relative to the reference point, at home orientation.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Records: TypeAlias = NDArray[np.void]

# How a branch is reached: by passes, or by closed form (a strut's direct check, a dyad's two circles, a rail and rod).
PASSES, STRUT, DYAD, RAIL_ROD = 0, 1, 2, 3
# What the axis of a cone is fixed to: the branch's carrier, the previous link, the platform.
CARRIER_CONE, LINK_CONE, PLATFORM_CONE = 0, 1, 2
# Where a coordinate is read: a segment's length, a rail, a hinge, the hinge on the platform, a trunk joint.
STROKE, RAIL, HINGE, END_HINGE, TRUNK = 0, 1, 2, 3, 4
# Trunk joints.
TURN, SLIDE = 0, 1
# Status of a row; the same numbers as the public Status.
REACHED, PROJECTED, EXCEEDED, FAILED, INVALID, PENDING = 0, 1, 2, 3, 4, 9

_vector = ("f8", (3,))

NODE = np.dtype(
    [
        ("home", *_vector),
        ("stored", "i8"),  # its place in Rows.nodes; -1 if it follows from the pose and the trunks
        ("lo", "f8"),  # length of the segment from the previous node
        ("hi", "f8"),
        ("hinge", "i8"),  # 1: the next segment stays in the branch's plane
        ("ranged", "i8"),  # 1: and its angle from home stays within [angle_lo, angle_hi]
        ("angle_home", "f8"),  # angle from the previous segment to the next, at home
        ("angle_lo", "f8"),
        ("angle_hi", "f8"),
    ]
)
BRANCH = np.dtype(
    [
        ("first", "i8"),  # nodes first ... last
        ("last", "i8"),
        ("carrier", "i8"),  # 0: the base; k + 1: trunk k
        ("kind", "i8"),
        ("planar", "i8"),  # how many leading hinges
        ("normal", *_vector),
        ("reference", *_vector),  # direction of the first segment at home, in the plane
        ("end", *_vector),
        ("end_plane", "i8"),  # 1: the last segment stays in a plane of the platform
        ("end_normal", *_vector),
        ("end_reference", *_vector),
        ("end_ranged", "i8"),
        ("end_angle_lo", "f8"),
        ("end_angle_hi", "f8"),
        ("align", "i8"),  # 1: the platform's end_normal must equal the branch's normal
        ("rail", "i8"),  # 1: the first node slides along rail_axis
        ("rail_axis", *_vector),
        ("rail_lo", "f8"),
        ("rail_hi", "f8"),
        ("cone_first", "i8"),  # cones cone_first ... cone_last - 1
        ("cone_last", "i8"),
    ]
)
CHAIN = np.dtype([("first", "i8"), ("last", "i8"), ("trunk", "i8")])  # branches first ... last - 1; trunk or -1
CONE = np.dtype([("kind", "i8"), ("node", "i8"), ("axis", *_vector), ("half_angle", "f8"), ("cosine", "f8")])
TRUNK_SPAN = np.dtype([("first", "i8"), ("last", "i8")])
TRUNK_JOINT = np.dtype([("kind", "i8"), ("point", *_vector), ("axis", *_vector), ("lo", "f8"), ("hi", "f8")])
COORDINATE = np.dtype(
    [
        ("kind", "i8"),
        ("index", "i8"),  # node, branch or trunk joint, after `kind`
        ("branch", "i8"),
        ("sign", "f8"),
        ("offset", "f8"),  # coordinate = offset + sign * what is read
        ("lo", "f8"),
        ("hi", "f8"),
        ("scale", "f8"),  # 1 / L for lengths, 1 for angles
    ]
)


class Plan(NamedTuple):
    """A mechanism, flattened. `coordinates` begins with the actuated ones, in order."""

    nodes: Records
    branches: Records
    chains: Records
    cones: Records
    trunks: Records
    trunk_joints: Records
    coordinates: Records
    scalars: Floats  # indexed by the names below


# Plan.scalars
LENGTH, SPAN, POINT_END, HOME_X = 0, 1, 2, 3  # HOME_X and the two behind it: the reference point at home


# Columns of Rows.counters, and of Rows.measures.
ITERATIONS, ROUNDS, HELD = 0, 1, 2
POSITION_ERROR, ROTATION_ERROR, RESIDUAL, LIMIT_EXCESS, ACTUATOR_ERROR = 0, 1, 2, 3, 4


class Rows(NamedTuple):
    """The answers of a batch, row by row."""

    status: NDArray[np.int64]  # (n,)
    counters: NDArray[np.int64]  # (n, 3): iterations, rounds, what a projection held (HOLD_...)
    poses: Floats  # (n, 4, 4)
    nodes: Floats  # (n, n_stored, 3): the nodes that do not follow from the pose and the trunks
    trunks: Floats  # (n, n_trunk_joints): deviation from home
    actuators: Floats  # (n, n_actuators)
    measures: Floats  # (n, 5): position error, rotation error, residual, limit excess, actuator error


class Configuration(NamedTuple):
    """One configuration of the mechanism, worked on in place; carriers and screws follow from the trunk values."""

    pose: Floats  # (4, 4)
    nodes: Floats  # (n_nodes, 3)
    trunks: Floats  # (n_trunk_joints,): deviation from home
    carriers: Floats  # (n_trunks + 1, 3, 4); the first is the base
    screws: Floats  # (n_trunk_joints, 2, 3): present point and axis


class Work(NamedTuple):
    """Scratch memory of one thread; nothing in it outlives a row."""

    pose: Floats  # a configuration to fall back on
    nodes: Floats
    trunks: Floats
    seed_nodes: Floats  # where the row began
    seed_trunks: Floats
    modes: Floats  # (n_branches,)
    wanted: Floats  # (n_branches, 3): where each branch would have its first node
    normal: Floats  # (n + 1, n + 1): the normal equations, right-hand side in the last column
    system: Floats  # the same, being solved
    row: Floats  # (n,)
    weights: Floats  # (n,)
    totals: Floats  # (3,): sum of squares, largest and number of the violations noted
    violations: Floats  # (many, 16): see `violations.enter`
    columns: NDArray[np.int64]  # (n_nodes + n_branches + n_trunk_joints,): first unknown of each, or -1


class Seeds(NamedTuple):
    """Where to start: one configuration for all rows, or one a row."""

    poses: Floats
    nodes: Floats
    trunks: Floats


class Settings(NamedTuple):
    """Options, as numbers; lengths in the mechanism's unit."""

    tolerance: float  # how near a target counts as reached
    enough: float  # E: passes end where the chains' ends are this close to their targets
    rotation_tolerance: float
    slack: float  # length by which a closed form may exceed a limit and count as on it
    exact: int  # 1: chains come as near as they can by exact steps; 0: by the paper's passes alone
    max_iterations: int  # K
    max_rounds: int
    hold: int  # 0 nothing, 1 orientation, 2 position


HOLD_NOTHING, HOLD_ORIENTATION, HOLD_POSITION = 0, 1, 2
