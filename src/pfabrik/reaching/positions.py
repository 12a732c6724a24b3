"""Between the paper's method and joint coordinates: positions of nodes from coordinates, and coordinates from them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, cast

import numpy as np

from ..arrays import Floats
from ..closure.close import HELD, Closing, close, closure_of, platform_poses
from ..decomposition.plan import CompiledPlan, compile_plan
from ..description.mechanism import Mechanism
from ..description.task import Weights
from ..kernels.reaching import plan as P
from ..motion.displacements import columns, displacements
from ..rotations import from_rotvec
from ..tolerances import TOLERANCES

RESTARTS = 24
"""Random starts for coordinates that do not follow joint centres from where they began: each finds most legs' turns."""


def positions_of(mechanism: Mechanism, compiled: CompiledPlan, coordinates: Floats) -> P.Seeds:
    """The nodes and trunks of joint coordinates (n, columns), deviations from home."""
    plan, bodies = compiled.plan, displacements(mechanism, coordinates)
    home, n = compiled.home_seed, len(coordinates)
    nodes, trunks = np.repeat(home.nodes, n, axis=0), np.zeros((n, home.trunks.shape[1]))
    for point in compiled.points:
        node = plan.nodes[point.node]
        if node["stored"] >= 0:
            T = bodies[mechanism.joint(point.joint).connects[0]]
            nodes[:, node["stored"]] = T[:, :3, :3] @ node["home"] + T[:, :3, 3]
    for place, name in enumerate(compiled.trunk_joints):
        trunks[:, place] = coordinates[:, columns(mechanism)[name].start]
    return P.Seeds(platform_poses(mechanism, coordinates), nodes, trunks)


def holding(mechanism: Mechanism) -> Weights:
    """What holds the platform where it is; of a joint end effector nothing holds its body's orientation."""
    return (*HELD[:3], 0.0, 0.0, 0.0) if mechanism.end_effector_is_joint else HELD


def new_pass_results(compiled: CompiledPlan, n: int) -> P.PassResults:
    """Room for where n rows end."""
    home = compiled.home_seed
    return P.PassResults(
        poses=np.empty((n, 4, 4)),
        nodes=np.empty((n, *home.nodes.shape[1:])),
        trunks=np.empty((n, home.trunks.shape[1])),
        gaps=np.empty(n),
        iterations=np.empty(n, np.int64),
        rounds=np.empty(n, np.int64),
    )


def place(mechanism: Mechanism, compiled: CompiledPlan, begin: Floats, reached: P.PassResults) -> Closing:
    """Joint coordinates that follow where joint centres and platforms are, from others (n, columns).

    What centres leave open (a rod's spin) stays next to where it began. Loops are open by about the gap of the chains;
    rows that follow worse are tried from elsewhere.
    """
    closure, poses = closure_of(mechanism, whole=False), reached.poses
    platform, centres = holding(mechanism), _centres(mechanism, compiled, reached)
    placed = close(closure, begin, poses, platform=platform, centres=centres)
    near = 2.0 * reached.gaps / mechanism.characteristic_length + TOLERANCES.position
    rng = np.random.default_rng(0)
    for _ in range(RESTARTS):
        rest = np.flatnonzero(_off(placed) > near)
        if not len(rest):
            break
        turns = np.where(closure.idle, 0.0, rng.uniform(-np.pi, np.pi, begin.shape[1]) * closure.turning)
        tried = close(closure, begin[rest] + turns, poses[rest], platform=platform, centres=centres[rest])
        better = _off(tried) < _off(placed)[rest]
        placed.put(rest[better], tried, better)
    return placed


def _off(placed: Closing) -> Floats:
    """Largest gap or miss of each row [L or rad]."""
    return np.asarray(np.maximum(placed.gap, placed.misses.max(axis=1, initial=0.0)))


def _centres(mechanism: Mechanism, compiled: CompiledPlan, reached: P.PassResults) -> Floats:
    """Joint centres as the closure kernel wishes for them, (n, joints, 3); NaN for those that cannot be read."""
    readable = _readable_centres(mechanism)
    wished = np.full((len(reached.poses), len(mechanism.joints), 3), np.nan)
    points = joint_points(compiled, reached)
    for place, joint in enumerate(mechanism.joints):
        if joint.name in readable:
            wished[:, place] = points[joint.name]
    return wished


@lru_cache(maxsize=64)
def _readable_centres(mechanism: Mechanism) -> frozenset[str]:
    """Joints whose centres positions tell: not those merged with others into one at a common centre."""
    compiled = compile_plan(mechanism)
    home = new_pass_results(compiled, 1)._replace(**compiled.home_seed._asdict())
    near = TOLERANCES.position * mechanism.characteristic_length
    return frozenset(
        name
        for name, point in joint_points(compiled, home).items()
        if np.abs(point[0] - np.asarray(mechanism.joint(name).at)).max() <= near
    )


def joint_points(compiled: CompiledPlan, reached: P.PassResults) -> dict[str, Floats]:
    """Joint name -> position of its centre in the base frame, (n, 3); joints that act as one share a centre."""
    carriers, screw_points = _carriers(compiled.plan, reached.trunks)
    found = {name: screw_points[joint] for name, joint in compiled.trunk_points}
    for point in compiled.points:
        turning = reached.poses[:, :3, :3] if point.carrier < 0 else carriers[point.carrier][:, :3, :3]
        found[point.joint] = _node(compiled.plan, reached, point.node, carriers) + turning @ (point.shift * point.axis)
    return found


def _node(plan: P.Plan, reached: P.PassResults, k: int, carriers: list[Floats]) -> Floats:
    """Positions (n, 3) of node k: stored, on the platform, or on its carrier."""
    node = plan.nodes[k]
    if node["stored"] >= 0:
        return reached.nodes[:, node["stored"]]
    branch = plan.branches[np.searchsorted(plan.branches["last"], k)]
    if k == branch["last"]:
        T, point = reached.poses, branch["end"]
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
    moved[:, :3, :3] = from_rotvec(values[:, None] * axis)
    moved[:, :3, 3] = point - moved[:, :3, :3] @ point
    return moved
