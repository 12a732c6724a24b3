"""Further questions of an exported file's self-test, beside actuators at poses, with the library's answers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...answers.differential import forward_jacobian, inverse_jacobian
from ...answers.status import Status
from ...capabilities.dynamics.asked_motion import asked_motion
from ...capabilities.dynamics.weights import weights_of
from ...common.arrays import Floats, Mask
from ...fk import solve_fk
from ...ik import solve_ik
from ...options import Options
from .machine_data import Machine
from .static_data import literal, table

N_FAR, FARTHER = 4, 0.7
"""Targets out of reach, and how far they are from poses around home [L]."""

N_LOADED, WORST_CONDITION = 4, 50.0
"""Poses with torques or forces, and the largest condition number of the Jacobian there."""

LED = 1e-11
"""Distance within which forward kinematics from home must end at a pose for it to be asked [L or entries]."""

LOAD = np.arange(1.0, 7.0)
"""The force and moment of torques; the twist, and its change, of forces."""

GRAVITY = (0.0, 0.0, -9.80665)


class FarChecks(NamedTuple):
    """Targets (n, 4, 4) without an answer, and how far the library's nearest poses are from them (n,) [length]."""

    targets: Floats
    distances: Floats


class LoadChecks(NamedTuple):
    """Poses (n, 4, 4), twists (n, 6), and the torques or forces of actuators there (n, n_a)."""

    poses: Floats
    twists: Floats
    actuators: Floats


def are_led_from_home(machine: Machine, targets: Floats, actuators: Floats) -> Mask:
    """True for poses (n, 4, 4) that the library's forward kinematics goes to from home, without doubt."""
    mechanism = machine.mechanism.without_limits().with_clearance(None)
    found = solve_fk(mechanism, actuators)
    off = np.abs(np.asarray(found.pose) - targets)[:, :3]
    off[..., 3] /= mechanism.characteristic_length
    if mechanism.end_effector_is_joint:
        off[..., :3] = 0.0
    is_there: Mask = (np.asarray(found.status) == Status.REACHED) & (off.max(axis=(1, 2)) <= LED)
    return is_there


def far_checks(machine: Machine, targets: Floats) -> FarChecks:
    """Some poses displaced until they are out of reach."""
    mechanism, options = machine.mechanism, Options(working_mode="keep", hold_price=machine.hold_price)
    random = np.random.default_rng(0)
    away = np.array(targets[: 4 * N_FAR])
    away[:, :3, 3] += FARTHER * mechanism.characteristic_length * random.uniform(-1.0, 1.0, (len(away), 3))
    found = solve_ik(mechanism, away, options=options)
    far = np.flatnonzero(np.asarray(found.status) == Status.PROJECTED)[:N_FAR]
    moved = np.linalg.norm(np.asarray(found.pose)[far, :3, 3] - away[far, :3, 3], axis=1)
    return FarChecks(away[far], moved)


def load_checks(machine: Machine, poses: Floats, *, moves: bool) -> LoadChecks:
    """Torques that give a force and a moment, or with `moves` forces of motion, far from singularities."""
    mechanism = machine.mechanism.without_limits().with_clearance(None)
    size, n_a = mechanism.characteristic_length, len(machine.driven)
    nothing = LoadChecks(np.zeros((0, 4, 4)), np.zeros((0, 6)), np.zeros((0, n_a)))
    solution = solve_ik(mechanism, poses, options=Options(working_mode="keep"))
    solution = solution[np.flatnonzero(np.asarray(solution.status) == Status.REACHED)]
    if not len(solution):
        return nothing
    forward = np.asarray(forward_jacobian(solution))
    scale = np.array([size] * 3 + [1.0] * 3)[: forward.shape[1]]
    conditions = np.linalg.cond(forward / scale[:, None])
    rows = np.flatnonzero(conditions <= WORST_CONDITION * conditions.min())[:N_LOADED]
    if not moves:
        loads = LOAD[: forward.shape[1]] * (scale[0] / scale)
        return LoadChecks(
            np.asarray(solution.pose)[rows],
            np.tile(_widened(loads), (len(rows), 1)),
            np.einsum("nia,i->na", forward[rows], loads),
        )
    solution = solution[rows]
    inverse = np.asarray(inverse_jacobian(solution))
    allowed = np.asarray(forward_jacobian(solution)) @ inverse
    twists = allowed @ (LOAD[: forward.shape[1]] * scale / size)
    motion = replace(
        asked_motion(solution, twists, twists, "task"), weights=weights_of(mechanism), gravity=np.array(GRAVITY)
    )
    found = motion.efforts([])
    made = np.flatnonzero((found.marks == 0) & np.isfinite(found.actuators).all(axis=1))
    widened = np.stack([_widened(twist) for twist in twists[made]]) if len(made) else nothing.twists
    return LoadChecks(np.asarray(solution.pose)[made], widened, found.actuators[made])


def _widened(twist: Floats) -> Floats:
    """A twist of a point as one of a body."""
    return np.concatenate([twist, np.zeros(6 - len(twist))])


def far_lines(checks: FarChecks) -> Iterator[str]:
    """The table of targets out of reach."""
    yield f"enum {{ PFK_FAR_CHECKS = {len(checks.targets)} }};"
    rows = [
        f"    {{{_pose(target)}, {literal(float(distance))}}}"
        for target, distance in zip(checks.targets, checks.distances, strict=True)
    ]
    yield from table("pfk_far_check pfk_far_checks[]", rows)


def load_lines(name: str, checks: LoadChecks) -> Iterator[str]:
    """A table of torques or forces."""
    yield f"enum {{ PFK_{name.upper()}_CHECKS = {len(checks.poses)} }};"
    rows = [
        f"    {{{_pose(pose)}, {literal(twist)}, {literal(actuators)}}}"
        for pose, twist, actuators in zip(checks.poses, checks.twists, checks.actuators, strict=True)
    ]
    yield from table(f"pfk_load_check pfk_{name}_checks[]", rows)


def _pose(pose: Floats) -> str:
    return f"{{{literal(pose[:3, 3])}, {literal(pose[:3, :3])}}}"
