"""Between legs in closed form and joint coordinates."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..closure.close import HELD, close, closure_of
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..motion.limits import within_turns
from ..tolerances import TOLERANCES
from .table import reading_of, reading_table

NO_ROWS, NO_SLOPES = np.zeros((0, 0)), np.zeros((0, 0, 0))

RESTARTS = 24
"""Random starts for joints that closed forms do not tell and that do not close from where they began."""


def settled(
    mechanism: Mechanism,
    table: LegTable,
    poses: Floats,
    actuators: Floats,
    sides: Floats,
    begin: Floats | None,
    q_proximal: Floats | None = None,
) -> Floats:
    """All joint coordinates, as deviations from home, (n, columns), of platforms and actuators at rest.

    Parameters
    ----------
    poses, actuators : (n, 4, 4) [length], (n, n_a).
    sides : which of its two solutions each leg takes, (n or 1, legs).
    begin : where to start, (n or 1, columns): what a configuration leaves open (a rod's spin, whole turns of hinges) is
        nearest to there. None for home.
    carriers : coordinates of the legs' carriers (n, legs) [L or rad] where they were found otherwise than by closed
        forms, which tell half their digits near dead points; NaN, or None, where not.
    """
    closure = closure_of(mechanism, whole=False)
    found = np.zeros((len(poses), len(closure.scale)))
    if begin is not None:
        found[:] = begin
    if not len(poses):
        return found
    read_into(table, poses, sides, found, q_proximal)
    closure.put_actuators(found, actuators)
    found = _closed(mechanism, poses, actuators, found)
    if begin is not None:
        angles = np.setdiff1d(table.known["column"][table.known["turns"] == 1], closure.actuated)
        found[:, angles] += 2.0 * np.pi * np.round((begin - found)[:, angles] / (2.0 * np.pi))
    within_turns(mechanism, found)
    return found


def _closed(mechanism: Mechanism, poses: Floats, actuators: Floats, found: Floats) -> Floats:
    """Joint coordinates (n, columns) closed on platforms and actuators at rest, from given ones."""
    closure = closure_of(mechanism, whole=False)
    locked = closure.driven
    platform = (*HELD[:3], *((0.0,) * 3)) if mechanism.end_effector_is_joint else HELD
    closing = close(closure, found, poses, locked=locked, platform=platform)
    rng = np.random.default_rng(0)
    for _ in range(RESTARTS):
        rest = np.flatnonzero(closing.gap > TOLERANCES.position)
        if not len(rest):
            break
        elsewhere = found[rest] + rng.uniform(-np.pi, np.pi, found.shape[1]) * closure.turning * ~closure.idle
        closure.put_actuators(elsewhere, actuators[rest])
        tried = close(closure, elsewhere, poses[rest], locked=locked, platform=platform)
        better = tried.gap < closing.gap[rest]
        closing.put(rest[better], tried, better)
    return closing.coordinates


def read_into(table: LegTable, poses: Floats, sides: Floats, found: Floats, q_proximal: Floats | None = None) -> None:
    """Write the coordinates that legs tell at poses (n, 4, 4) [length] into joint coordinates (n, columns).

    Parameters
    ----------
    carriers : as of `settled`.
    """
    from ..kernels.platform.read import read

    legs, given = reading_table(table), NO_ROWS if q_proximal is None else q_proximal
    own = np.require(poses, requirements=["C", "W"])
    read(legs.address, reading_of(table).address, own, sides, given, found, NO_ROWS, NO_SLOPES)
