"""Where joint centres are in an answer in positions."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from ..arrays import Floats
from ..decomposition.plan import CompiledPlan
from ..kernels.reaching import plan as P


def joint_points(compiled: CompiledPlan, rows: P.Rows) -> dict[str, Floats]:
    """Joint name -> position of its centre in the base frame, (n, 3); joints that act as one share a centre."""
    carriers, screw_points = _carriers(compiled.plan, rows.trunks)
    found = {name: screw_points[joint] for name, joint in compiled.trunk_points}
    for point in compiled.points:
        turning = rows.poses[:, :3, :3] if point.carrier < 0 else carriers[point.carrier][:, :3, :3]
        found[point.joint] = _node(compiled.plan, rows, point.node, carriers) + turning @ (point.shift * point.axis)
    return found


def _node(plan: P.Plan, rows: P.Rows, k: int, carriers: list[Floats]) -> Floats:
    """Positions (n, 3) of node k: stored, on the platform, or on its carrier."""
    node = plan.nodes[k]
    if node["stored"] >= 0:
        return rows.nodes[:, node["stored"]]
    branch = plan.branches[np.searchsorted(plan.branches["last"], k)]
    if k == branch["last"]:
        T, point = rows.poses, branch["end"]
    else:
        T, point = carriers[branch["carrier"]], node["home"]
    return cast(Floats, T[:, :3, :3] @ point + T[:, :3, 3])


def _carriers(plan: P.Plan, trunk_values: Floats) -> tuple[list[Floats], list[Floats]]:
    """Poses (n, 4, 4) of the base and of every trunk's body, and the present centres (n, 3) of the trunk joints."""
    n = len(trunk_values)
    carriers = [np.broadcast_to(np.eye(4), (n, 4, 4))]
    centres: list[Floats] = []
    for trunk in plan.trunks:
        T = carriers[0]
        for j in range(trunk["first"], trunk["last"]):
            joint = plan.trunk_joints[j]
            centres.append(T[:, :3, :3] @ joint["point"] + T[:, :3, 3])
            T = T @ _motion(joint, trunk_values[:, j])
        carriers.append(T)
    return carriers, centres


def _motion(joint: Any, values: Floats) -> Floats:
    """The motions (n, 4, 4) of one trunk joint at its home place."""
    axis, point = joint["axis"], joint["point"]
    moved = np.zeros((len(values), 4, 4))
    moved[:] = np.eye(4)
    if joint["kind"] == P.SLIDE:
        moved[:, :3, 3] = values[:, None] * axis
        return moved
    K = np.cross(np.eye(3), axis).T * -1.0
    sine, versine = np.sin(values)[:, None, None], (1.0 - np.cos(values))[:, None, None]
    moved[:, :3, :3] = np.eye(3) + sine * K + versine * (K @ K)
    moved[:, :3, 3] = point - moved[:, :3, :3] @ point
    return moved
