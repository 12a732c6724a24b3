"""Steps of drives that no motion of the mechanism leads along: another basin, branch or hold was taken."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Floats, Mask
from ..engines.joints.configurations import Configurations
from ..engines.joints.engine_contract import InverseEngine
from ..kernels.rows import FAILED, REACHED
from ..kernels.search_constants import MOVED, SUSPICIOUS, UNDONE
from ..machine.description.mechanism import Mechanism
from ..machine.description.task import task_of
from ..machine.motion.displacements import actuator_units
from ..machine.poses import between
from ..options import Options

LEAP = 0.1
"""Motion of drives [L or rad] that is a jump even where it leads back: across a place where links stretch. It is less
where what is held is taken up or let go, by what its price is rounded off."""

SUBSTEPS = 8
"""Parts into which a checked step is divided: a jump stays within one of them, a fast motion spreads over several."""


def are_jumps(
    engine: InverseEngine,
    mechanism: Mechanism,
    starts: Configurations,
    start_targets: Floats,
    answers: Configurations,
    targets: Floats,
    options: Options,
) -> Mask:
    """True for answers to targets (n, 4, 4) to which no motion leads from their starts, as the targets move, (n,).

    The drives move far more than the target, and on the way there a single one of several parts makes most of it. Of
    small steps that only counts where the way back to the target before does not undo them.

    Parameters
    ----------
    starts, start_targets : the answers before, and their targets (n, 4, 4).
    """
    jumps, rows = np.zeros(len(targets), bool), (starts.rows.status < FAILED) & (answers.rows.status < FAILED)
    steps, asked = _steps(mechanism, starts.rows.actuators, answers.rows.actuators), np.zeros(len(targets))
    position, rotation = task_of(mechanism).errors(targets[rows], start_targets[rows])
    asked[rows] = np.hypot(position, mechanism.rotation_length * rotation) / mechanism.characteristic_length
    suspicious = np.flatnonzero(rows & (steps > np.maximum(SUSPICIOUS * asked, MOVED)))
    if not len(suspicious):
        return jumps
    begin, end = starts.at(suspicious), answers.at(suspicious)
    back = engine.answer(start_targets[suspicious], end, options, keep_mode=True)
    left = _steps(mechanism, begin.rows.actuators, back.rows.actuators) > UNDONE * steps[suspicious]
    left |= steps[suspicious] > LEAP
    checked = suspicious[left]
    way = start_targets[checked], targets[checked]
    parts = _parts_at_once(engine, mechanism, starts.at(checked), *way, options)
    for row in checked[~(parts <= UNDONE * steps[checked])].tolist():
        way = start_targets[row : row + 1], targets[row : row + 1]
        part = _largest_part(engine, mechanism, starts.at(np.array([row])), *way, options)
        jumps[row] = part > UNDONE * steps[row]
    return jumps


def _parts_at_once(
    engine: InverseEngine,
    mechanism: Mechanism,
    starts: Configurations,
    targets: Floats,
    next_targets: Floats,
    options: Options,
) -> Floats:
    """As `_largest_part`, of ways from n targets, (n,): all parts as one batch; NaN where some are not reached so."""
    n = len(targets)
    if not n:
        return np.zeros(0)
    rows, shares = np.repeat(np.arange(n), SUBSTEPS), np.tile(np.arange(1, SUBSTEPS + 1), n) / SUBSTEPS
    way = between(targets[rows], next_targets[rows], shares[:, None, None])
    answers = engine.answer(way, starts.at(rows), options, keep_mode=True)
    values = np.concatenate([starts.rows.actuators[:, None], answers.rows.actuators.reshape(n, SUBSTEPS, -1)], axis=1)
    parts = (np.abs(np.diff(values, axis=1)) / actuator_units(mechanism)).max(axis=(1, 2), initial=0.0)
    is_reached = (answers.rows.status == REACHED).reshape(n, SUBSTEPS).all(axis=1)
    return np.asarray(np.where(is_reached, parts, np.nan))


def _largest_part(
    engine: InverseEngine,
    mechanism: Mechanism,
    start: Configurations,
    target: Floats,
    next_target: Floats,
    options: Options,
) -> float:
    """The largest step of a drive [L or rad] where the way from one target (1, 4, 4) to the next is divided."""
    shares = np.arange(1, SUBSTEPS + 1)[:, None, None] / SUBSTEPS
    way = between(np.repeat(target, SUBSTEPS, axis=0), np.repeat(next_target, SUBSTEPS, axis=0), shares)
    followed = engine.follow(way, start, options, None)
    values = np.concatenate([start.rows.actuators, followed.rows.actuators])
    return float(_steps(mechanism, values[:-1], values[1:]).max())


def _steps(mechanism: Mechanism, before: Floats, after: Floats) -> NDArray[np.float64]:
    """The largest step of a drive from each configuration to the next, by actuators (n, n_a), (n,) [L or rad]."""
    return np.asarray((np.abs(after - before) / actuator_units(mechanism)).max(axis=1, initial=0.0))
