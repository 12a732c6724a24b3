"""Poses for the self-test of an exported file, with the library's answers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats, Mask
from ..configuration import configuration
from ..description.mechanism import Mechanism
from ..feasibility import feasibility
from ..ik import solve_ik
from ..kinematics import generic_of
from ..options import Options
from ..poses import pose
from .machine_data import Machine
from .wording import Precision

N_POSES = 50
FARTHEST = (0.3, 0.5)
"""The largest distance of these poses from home [L, rad]."""

N_TRIED = 400
KEEP = Options(working_mode="keep")
AGREEMENT: dict[Precision, float] = {"double": 1e-10, "float": 1e-4}
"""Tolerance to which actuators must agree [L or rad]: rounding may leave as much near a dead point."""

CLEAR = 1e-3
"""Margin beyond which a pose counts as inside or outside its limits without doubt, a share of the range."""


class Checks(NamedTuple):
    """Targets (n, 4, 4), their actuators (n, n_a), a mask of those within all limits (n,), and the least distances
    between links (n,) [length], of a file that keeps them apart."""

    targets: Floats
    actuators: Floats
    kept: Mask
    distances: Floats | None = None


def checks_of(machine: Machine, limits: bool) -> Checks:
    """Poses around home that a mechanism reaches in home's working mode, some beyond its limits.

    Poses within limits are those alone that the file reaches without doubt: `feasibility` agrees.
    """
    mechanism = machine.mechanism.with_clearance(None)  # distances are measured
    keeps_apart = limits and machine.links is not None
    targets = targets_around_home(mechanism, N_TRIED, np.random.default_rng(0))
    targets[0] = mechanism.home_pose
    without_limits = mechanism.without_limits()
    targets = targets[~(np.asarray(feasibility(without_limits, targets).margin) < 0.0)]
    solution = solve_ik(without_limits, targets, options=KEEP)
    least = least_margins(mechanism, solution.q)
    distances = _distances(solution) if keeps_apart else None
    if distances is not None:
        room = (distances - (machine.mechanism.clearance or 0.0)) / mechanism.characteristic_length
        least = np.minimum(least, room)
    if machine.completes:
        margin = np.asarray(feasibility(mechanism, targets).margin)
        least[((least > 0.0) & (margin < 0.0)) | ~_are_unique(machine, targets, solution, least > 0.0)] = 0.0
    is_reached, is_clear = solution.status == 0, np.abs(least) > CLEAR
    inside = np.flatnonzero(is_reached & is_clear & (least > 0.0))
    beyond = np.flatnonzero(is_reached & is_clear & (least < 0.0)) if limits else inside[:0]
    n_beyond = min(len(beyond), max(N_POSES // 5, N_POSES - len(inside)))
    chosen = np.concatenate([inside[: N_POSES - n_beyond], beyond[:n_beyond]])
    apart = None if distances is None else distances[chosen]
    return Checks(targets[chosen], solution.actuators[chosen], np.isin(chosen, inside), apart)


def _distances(solution: Solution) -> Floats:
    """The least distances between links, (n,) [length]."""
    from ..clearance.clearance import clearance

    return np.reshape(clearance(solution).distance, -1)


def _are_unique(machine: Machine, targets: Floats, solution: Solution, is_inside: Mask) -> Mask:
    """True for targets (n,) without another answer than the one found, from several starts.

    The starts are home and, with implicit joints, the answers within limits where each actuator is least or most.
    """
    mechanism = machine.mechanism.with_clearance(None)
    starts: list[Floats | None] = [None]
    if machine.has_implicit_joints and is_inside.any():
        actuators = solution.actuators[is_inside]
        rows = np.flatnonzero(is_inside)[np.unique([actuators.argmin(axis=0), actuators.argmax(axis=0)])]
        starts += list(solution.q[rows])
    is_same = np.ones(len(targets), dtype=bool)
    for start in starts:
        other = solve_ik(mechanism, targets, start=start, options=KEEP)
        is_same &= (other.status != 0) | (
            machine.largest_difference(other.actuators, solution.actuators) <= AGREEMENT["double"]
        )
    return is_same


def targets_around_home(mechanism: Mechanism, n: int, random: np.random.Generator) -> Floats:
    """Random poses (n, 4, 4) around home, displaced in the directions in which the platform can move."""
    directions = generic_of(mechanism).directions
    basis = np.zeros((6, directions.shape[1]))
    basis[: len(directions)] = directions
    projector = basis @ basis.T
    projector[np.abs(projector) < 1e-12] = 0.0
    reach, angle = FARTHEST
    scales = np.repeat([reach * mechanism.characteristic_length, angle], 3)
    twists = random.uniform(-1.0, 1.0, (n, 6)) * scales @ projector
    return pose(mechanism.home_pose[:3, 3] + twists[:, :3], rotvec=twists[:, 3:])


def least_margins(mechanism: Mechanism, q: Floats) -> Floats:
    """The least margin of all limits at joint vectors q, (n,)."""
    from ..answers.margins import margins

    if not len(q):
        return np.zeros(0)
    by_limit = margins(configuration(mechanism, q))
    return np.asarray(np.min([np.ones(len(q)), *(np.asarray(margin) for margin in by_limit.values())], axis=0))
