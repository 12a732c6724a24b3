"""Inputs and results of the passes: the mechanism as flat records, and the configurations of a batch.

Lengths are in the mechanism's unit, angles in radians. Vectors named `home` are in base coordinates at home. The
carrier of a branch is its base body: the mechanism's base, or the last body of a trunk. Vectors fixed to the platform
are relative to the reference point, at home orientation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Records
from .._jit import allocator, routine
from ..legs.complete_poses import turn_pose
from ..vectors import Vec, add, along, copy_row, copy_table, move, put, rotate, scale, sub, turn, vec

# Values of CONE.fixed_to, the body of the cone's axis: the branch's carrier, the previous link, the platform.
CARRIER_CONE, LINK_CONE, PLATFORM_CONE = 0, 1, 2

_vector = ("f8", (3,))

NODE = np.dtype(
    [
        ("home", *_vector),
        ("lo", "f8"),  # length of the segment from the previous node
        ("hi", "f8"),
        ("hinge", "i8"),  # 1: the next segment stays in the branch's plane
        ("ranged", "i8"),  # 1: the hinge's angle from home stays within [angle_lo, angle_hi]
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
        ("planar", "i8"),  # number of leading hinges
        ("normal", *_vector),
        ("reference", *_vector),  # direction of the first segment at home, in the plane
        ("end", *_vector),
        ("end_plane", "i8"),  # 1: the last segment stays in a plane of the platform
        ("end_normal", *_vector),
        ("rail", "i8"),  # 1: the first node slides along rail_axis
        ("rail_axis", *_vector),
        ("rail_lo", "f8"),
        ("rail_hi", "f8"),
        ("cone_first", "i8"),  # cones cone_first ... cone_last - 1
        ("cone_last", "i8"),
    ]
)
CHAIN = np.dtype([("first", "i8"), ("last", "i8"), ("trunk", "i8")])  # branches first ... last - 1; trunk or -1
CONE = np.dtype(
    [
        ("fixed_to", "i8"),
        ("node", "i8"),
        ("axis", *_vector),
        ("half_angle", "f8"),
        ("cosine", "f8"),  # of the half angle
        ("sine", "f8"),
    ]
)
TRUNK_SPAN = np.dtype([("first", "i8"), ("last", "i8")])
TRUNK_JOINT = np.dtype(
    [
        ("turns", "i8"),  # 1: turns about its axis; 0: slides along it
        ("unit", "f8"),  # 1 for angles, L for lengths
        ("point", *_vector),
        ("axis", *_vector),
        ("lo", "f8"),
        ("hi", "f8"),
    ]
)

# Motions of a revised target: bits of Settings.free.
TRANSLATES, TURNS = 1, 2


class Plan(NamedTuple):
    """A mechanism, flattened, and the rules of passes over it."""

    nodes: Records
    branches: Records
    chains: Records
    cones: Records
    trunks: Records
    trunk_joints: Records
    length: float  # L
    is_literal: (
        int  # 1: the paper's text, where clamps to cones keep the length, inward steps know the platform's cones
    )
    # alone, and every branch moves its trunk


class Configuration(NamedTuple):
    """One configuration of the mechanism, changed in place; carriers and screws follow from the trunk values."""

    pose: Floats  # (4, 4)
    nodes: Floats  # (n_nodes, 3)
    trunks: Floats  # (n_trunk_joints,): deviation from home
    carriers: Floats  # (n_trunks + 1, 3, 4); the first is the base
    screws: Floats  # (n_trunk_joints, 2, 3): present point and axis
    base_targets: Floats  # (n_branches, 3): position of each branch's first node after a forward pass
    is_displaced: Ints  # (n_branches,): 1 if that differs from its position on the carrier
    system: Floats  # (n, n + 1): the normal equations of a fit, right-hand side in the last column


@allocator
def new_configuration(plan: Plan) -> Configuration:
    """Allocate a configuration."""
    unknowns = max(plan.trunk_joints.shape[0], 3)
    return Configuration(
        np.zeros((4, 4)),
        np.zeros((plan.nodes.shape[0], 3)),
        np.zeros(plan.trunk_joints.shape[0]),
        np.zeros((plan.trunks.shape[0] + 1, 3, 4)),
        np.zeros((plan.trunk_joints.shape[0], 2, 3)),
        np.zeros((plan.branches.shape[0], 3)),
        np.zeros(plan.branches.shape[0], np.int64),
        np.zeros((unknowns, unknowns + 1)),
    )


class Seeds(NamedTuple):
    """Start configurations: one for all rows, or one per row."""

    poses: Floats
    nodes: Floats
    trunks: Floats


class Settings(NamedTuple):
    """Options as numbers; lengths in the mechanism's unit."""

    tolerance: float  # E: largest end gap with which a target is reached
    max_iterations: int  # K; 0 for a single pass outward
    max_rounds: int
    free: int  # motions of an unreached target: TRANSLATES, TURNS, or both
    keep_mode: int  # 1: branches of two parts keep their working mode; used if accelerated
    lever: float  # weight of a turn beside a distance [length per rad]; used if accelerated
    is_accelerated: int  # 1: with closed-form intersections and half-spaces


class PassResults(NamedTuple):
    """Results of the passes: configurations whose loops are closed up to the gap."""

    poses: Floats  # (n, 4, 4)
    nodes: Floats  # (n, n_nodes, 3)
    trunks: Floats  # (n, n_trunk_joints): deviation from home
    gaps: Floats  # (n,): largest distance of a chain's end from its place on the platform
    iterations: Ints  # (n,)
    rounds: Ints  # (n,): number of revisions of the target


@routine
def identity_pose(T: Floats) -> None:
    """Set a pose, (3, 4) or (4, 4), to the identity."""
    for i in range(T.shape[0]):
        for j in range(4):
            T[i, j] = 1.0 if i == j else 0.0


@routine
def move_carriers(plan: Plan, config: Configuration) -> None:
    """Pose every carrier from its trunk's joint values, and write each trunk joint's point and axis to `screws`."""
    carriers, screws, trunk_values = config.carriers, config.screws, config.trunks
    identity_pose(carriers[0])
    for k in range(plan.trunks.shape[0]):
        T = carriers[k + 1]
        identity_pose(T)
        for j in range(plan.trunks[k]["first"], plan.trunks[k]["last"]):
            axis = turn(T, vec(plan.trunk_joints[j]["axis"]))
            point = add(turn(T, vec(plan.trunk_joints[j]["point"])), (T[0, 3], T[1, 3], T[2, 3]))
            put(screws[j, 0], point)
            put(screws[j, 1], axis)
            if plan.trunk_joints[j]["turns"] == 1:
                turn_pose(T, scale(trunk_values[j], axis))
                moved = rotate(sub((T[0, 3], T[1, 3], T[2, 3]), point), axis, trunk_values[j])
                set_position(T, add(point, moved))
            else:
                set_position(T, along((T[0, 3], T[1, 3], T[2, 3]), trunk_values[j], axis))


@routine
def set_position(T: Floats, p: Vec) -> None:
    """Set the position of a pose."""
    T[0, 3] = p[0]
    T[1, 3] = p[1]
    T[2, 3] = p[2]


@routine
def place_ends(plan: Plan, c: int, config: Configuration) -> None:
    """Place the first node of each branch of a chain on its carrier, and the last one on the platform."""
    for b in range(plan.chains[c]["first"], plan.chains[c]["last"]):
        branch = plan.branches[b]
        first, last = branch["first"], branch["last"]
        if branch["rail"] == 0:
            put(config.nodes[first], move(config.carriers[branch["carrier"]], vec(plan.nodes[first]["home"])))
        put(config.nodes[last], move(config.pose, vec(branch["end"])))


@routine
def load_seed(plan: Plan, seeds: Seeds, i: int, config: Configuration) -> None:
    """Load seed `i`, or the only one, and place carriers and ends of branches."""
    row = i if seeds.poses.shape[0] > 1 else 0
    copy_table(seeds.poses[row], config.pose)
    copy_table(seeds.nodes[row], config.nodes)
    copy_row(seeds.trunks[row], config.trunks)
    move_carriers(plan, config)
    for c in range(plan.chains.shape[0]):
        place_ends(plan, c, config)
