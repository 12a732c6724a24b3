"""Conversion between the joint positions of the paper's method and joint coordinates."""

from __future__ import annotations

import numpy as np

from ..common.arrays import Floats, Record
from ..common.batch import put
from ..common.derived import derived
from ..common.rotations import from_rotvec
from ..engines.joints.close import HELD, Closing, close, platform_poses
from ..kernels.passes import plan as P
from ..machine.description.mechanism import Mechanism
from ..machine.description.task import Weights
from ..machine.motion.displacements import columns, displacements
from ..machine.motion.loops import Closure
from ..tolerances import TOLERANCES
from .plan import CompiledPlan, compile_plan

RESTARTS = 24
"""Random starts for rows whose joint coordinates do not fit the joint centres; every start fits most legs."""


def positions_of(mechanism: Mechanism, compiled: CompiledPlan, coordinates: Floats) -> P.Seeds:
    """Node positions and trunk coordinates at joint coordinates (n, columns), deviations from home."""
    bodies, n = displacements(mechanism, coordinates), len(coordinates)
    home = compiled.home_seed.nodes[0]
    nodes, trunks = np.repeat(home[None], n, axis=0), np.zeros((n, len(compiled.trunk_joints)))
    for point in compiled.points:
        T = bodies[mechanism.joint(point.joint).connects[0]]
        nodes[:, point.node] = T[:, :3, :3] @ home[point.node] + T[:, :3, 3]
    for place, name in enumerate(compiled.trunk_joints):
        trunks[:, place] = coordinates[:, columns(mechanism)[name].start]
    return P.Seeds(platform_poses(mechanism, coordinates), nodes, trunks)


def holding(mechanism: Mechanism) -> Weights:
    """Weights that hold the platform's pose; a joint end effector has no orientation to hold."""
    return (*HELD[:3], 0.0, 0.0, 0.0) if mechanism.end_effector_is_joint else HELD


def new_pass_results(compiled: CompiledPlan, n: int) -> P.PassResults:
    """Allocate n results."""
    plan = compiled.plan
    return P.PassResults(
        poses=np.empty((n, 4, 4)),
        nodes=np.empty((n, len(plan.nodes), 3)),
        trunks=np.empty((n, len(plan.trunk_joints))),
        gaps=np.empty(n),
        iterations=np.empty(n, np.int64),
        rounds=np.empty(n, np.int64),
    )


def place(closure: Closure, compiled: CompiledPlan, start: Floats, results: P.PassResults) -> Closing:
    """Fit joint coordinates to joint centres and platform poses by least squares from a start (n, columns).

    Coordinates that the centres do not determine (a rod's spin) stay near the start. Loops remain open by about the gap
    of the chains; rows that fit worse are repeated from random starts.
    """
    mechanism, poses = closure.mechanism, results.poses
    platform, centres = holding(mechanism), _centres(mechanism, compiled, results)
    placed = close(closure, start, poses, platform=platform, centres=centres)
    near = 2.0 * results.gaps / mechanism.characteristic_length + TOLERANCES.position
    rng = np.random.default_rng(0)
    for _ in range(RESTARTS):
        unsolved = np.flatnonzero(_misfit(placed) > near)
        if not len(unsolved):
            break
        turns = np.where(closure.idle, 0.0, rng.uniform(-np.pi, np.pi, start.shape[1]) * closure.turning)
        trial = close(closure, start[unsolved] + turns, poses[unsolved], platform=platform, centres=centres[unsolved])
        is_better = _misfit(trial) < _misfit(placed)[unsolved]
        put(placed, unsolved[is_better], trial, is_better)
    return placed


def _misfit(closing: Closing) -> Floats:
    """Largest gap or distance of a joint centre from its target in each row, (n,) [L or rad]."""
    return np.asarray(np.maximum(closing.gap, closing.misses.max(axis=1, initial=0.0)))


def _centres(mechanism: Mechanism, compiled: CompiledPlan, results: P.PassResults) -> Floats:
    """Target positions of joint centres for the closure kernel, (n, joints, 3); NaN for centres that are unknown."""
    joints_with_centre = _joints_with_centre(mechanism)
    centres = np.full((len(results.poses), len(mechanism.joints), 3), np.nan)
    points = joint_points(compiled, results)
    for place, joint in enumerate(mechanism.joints):
        if joint.name in joints_with_centre:
            centres[:, place] = points[joint.name]
    return centres


@derived
def _joints_with_centre(mechanism: Mechanism) -> frozenset[str]:
    """Names of joints whose centres follow from node positions, without those merged into one joint."""
    compiled = compile_plan(mechanism)
    home = new_pass_results(compiled, 1)._replace(**compiled.home_seed._asdict())
    near = TOLERANCES.position * mechanism.characteristic_length
    return frozenset(
        name
        for name, point in joint_points(compiled, home).items()
        if np.abs(point[0] - np.asarray(mechanism.joint(name).at)).max() <= near
    )


def joint_points(compiled: CompiledPlan, results: P.PassResults) -> dict[str, Floats]:
    """Joint name -> position of its centre in the base frame, (n, 3); joints that act as one share a centre."""
    carriers, trunk_centres = carriers_of(compiled.plan, results.trunks)
    points = {name: trunk_centres[joint] for name, joint in compiled.trunk_points}
    for point in compiled.points:
        T = results.poses if point.carrier < 0 else carriers[point.carrier]
        node = _node(compiled.plan, results, point.node, carriers)
        points[point.joint] = node + T[:, :3, :3] @ (point.shift * point.axis)
    return points


def _node(plan: P.Plan, results: P.PassResults, k: int, carriers: list[Floats]) -> Floats:
    """Positions (n, 3) of node k: the last one of a branch is on the platform, the first on its carrier or a rail."""
    branch = plan.branches[np.searchsorted(plan.branches["last"], k)]
    if k == branch["last"]:
        T, point = results.poses, branch["end"]
    elif k == branch["first"] and not branch["rail"]:
        T, point = carriers[branch["carrier"]], plan.nodes[k]["home"]
    else:
        return results.nodes[:, k]
    return np.asarray(T[:, :3, :3] @ point + T[:, :3, 3])


def carriers_of(plan: P.Plan, trunk_values: Floats) -> tuple[list[Floats], list[Floats]]:
    """Poses (n, 4, 4) of the carriers (the base and every trunk's body), and the centres (n, 3) of the trunk joints."""
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


def _motion(joint: Record, values: Floats) -> Floats:
    """The displacements (n, 4, 4) of one trunk joint about or along its axis at home."""
    axis, point = joint["axis"], joint["point"]
    T = np.zeros((len(values), 4, 4))
    T[:] = np.eye(4)
    if not joint["turns"]:
        T[:, :3, 3] = values[:, None] * axis
        return T
    T[:, :3, :3] = from_rotvec(values[:, None] * axis)
    T[:, :3, 3] = point - T[:, :3, :3] @ point
    return T
