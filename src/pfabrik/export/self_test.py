"""Poses that an exported file checks itself with: what the library answers to them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats, Mask
from ..configuration import configuration
from ..description.mechanism import Mechanism
from ..feasibility import feasibility
from ..ik import solve_ik
from ..motion.mobility import generic_of
from ..options import Options
from ..poses import pose
from .machine_data import Machine
from .wording import Precision

POSES = 50
FARTHEST = (0.3, 0.5)
"""How far the poses are from home [L, rad] at most."""

TRIED = 400
KEEP = Options(working_mode="keep")
EXACT: dict[Precision, float] = {"double": 1e-10, "float": 1e-4}
"""To what share of L, or to how many rad, actuators must agree: what rounding may leave near a dead point."""

SURE = 1e-3
"""How far from its limits a pose is kept or not beyond doubt, as a share of the room there is."""


class Checks(NamedTuple):
    """Targets (n, 4, 4), the actuators there (n, n_a), and whether they are within all limits (n,)."""

    targets: Floats
    actuators: Floats
    kept: Mask


def checks_of(machine: Machine, limits: bool) -> Checks:
    """Poses around home that a mechanism reaches in home's working mode, some beyond its limits.

    Within limits are those alone that the file reaches for sure: `feasibility` tells that they are.
    """
    mechanism = machine.mechanism
    targets = targets_around_home(mechanism, TRIED, np.random.default_rng(0))
    targets[0] = mechanism.home_pose
    free = mechanism.without_limits()
    targets = targets[~(np.asarray(feasibility(free, targets).margin) < 0.0)]
    found = solve_ik(free, targets, options=KEEP)
    least = least_margins(mechanism, found.q)
    if machine.completes:
        told = np.asarray(feasibility(mechanism, targets).margin)
        least[((least > 0.0) & (told < 0.0)) | ~_are_all_answers(machine, targets, found, least > 0.0)] = 0.0
    reached, sure = found.status == 0, np.abs(least) > SURE
    kept = np.flatnonzero(reached & sure & (least > 0.0))
    beyond = np.flatnonzero(reached & sure & (least < 0.0)) if limits else kept[:0]
    n_beyond = min(len(beyond), max(POSES // 5, POSES - len(kept)))
    chosen = np.concatenate([kept[: POSES - n_beyond], beyond[:n_beyond]])
    return Checks(targets[chosen], found.actuators[chosen], np.isin(chosen, kept))


def _are_all_answers(machine: Machine, targets: Floats, found: Solution, kept: Mask) -> Mask:
    """Whether no other answer to targets (n,) is within limits than those found: from home, and where arms follow from
    where they were, from the answers kept where each actuator is least, and where it is most."""
    starts: list[Floats | None] = [None]
    if machine.has_implicit_joints and kept.any():
        ends = found.actuators[kept]
        some = np.flatnonzero(kept)[np.unique([ends.argmin(axis=0), ends.argmax(axis=0)])]
        starts += list(found.q[some])
    same = np.ones(len(targets), dtype=bool)
    for start in starts:
        other = solve_ik(machine.mechanism, targets, start=start, options=KEEP)
        same &= (other.status != 0) | (machine.apart(other.actuators, found.actuators) <= EXACT["double"])
    return same


def targets_around_home(mechanism: Mechanism, count: int, random: np.random.Generator) -> Floats:
    """Poses (n, 4, 4) around home, displaced as the platform can move at all."""
    directions = generic_of(mechanism).directions
    basis = np.zeros((6, directions.shape[1]))
    basis[: len(directions)] = directions
    onto = basis @ basis.T
    onto[np.abs(onto) < 1e-12] = 0.0
    reach, turn = FARTHEST
    scales = np.repeat([reach * mechanism.characteristic_length, turn], 3)
    moved = random.uniform(-1.0, 1.0, (count, 6)) * scales @ onto
    return pose(mechanism.home_pose[:3, 3] + moved[:, :3], rotvec=moved[:, 3:])


def least_margins(mechanism: Mechanism, q: Floats) -> Floats:
    """The least margin of all limits at joint vectors q, (n,)."""
    from ..answers.margins import margins

    if not len(q):
        return np.zeros(0)
    found = margins(configuration(mechanism, q))
    return np.asarray(np.min([np.ones(len(q)), *(np.asarray(each) for each in found.values())], axis=0))
