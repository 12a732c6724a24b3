"""Poses of the carriers (the base and the last bodies of trunks), and positions of the ends of branches."""

from __future__ import annotations

from ...arrays import Floats
from .._jit import routine
from ..legs.complete_poses import turn_pose
from ..vectors import Vec, add, along, copy_row, copy_table, move, put, rotate, scale, sub, turn, vec
from .plan import Configuration, Plan, Seeds


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
