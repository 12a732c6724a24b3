"""Joint coordinates from platform poses."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats
from ...common.batch import put
from ...common.derived import derived
from ...common.rotations import nearest_turn
from ...machine.decomposition.leg_table import LegTable
from ...machine.model import Model
from ...machine.motion.limited_coordinates import within_turns
from ...machine.motion.loops import Closure
from ...tolerances import TOLERANCES
from ..joints.close import HELD, close
from .table import reading_scratch, reading_table

NO_ROWS, NO_SLOPES = np.zeros((0, 0)), np.zeros((0, 0, 0))

EXACT = 1e-14
"""Gap to which joints are closed [L or rad]: Jacobians at coordinates with a gap of 1e-13 show it."""

RESTARTS = 24
"""Random restarts for joints that no closed form gives and that do not close from their start."""


def joint_coordinates(
    model: Model,
    poses: Floats,
    actuators: Floats,
    sides: Floats,
    start: Floats | None,
    q_proximal: Floats | None = None,
) -> Floats:
    """All joint coordinates at given poses and actuators, as deviations from home, (n, columns).

    Parameters
    ----------
    poses, actuators : (n, 4, 4) [length], (n, n_a).
    sides : of each leg, (n or 1, legs).
    start : joint coordinates, (n or 1, columns). What a pose leaves open (a rod's spin, whole turns of hinges) is
        nearest to the start. None for home.
    q_proximal : coordinates of proximal joints (n, legs) [L or rad] that a search found; NaN, or None, where closed
        forms give them. Near dead points these have half their digits.
    """
    table, closure = model.legs, model.path_closure
    coordinates = np.zeros((len(poses), len(closure.scale)))
    if start is not None:
        coordinates[:] = start
    if not len(poses):
        return coordinates
    read_coordinates(table, poses, sides, coordinates, q_proximal)
    closure.put_actuators(coordinates, actuators)
    coordinates = _closed(closure, known_columns(table), poses, actuators, coordinates)
    if start is not None:
        angles = np.setdiff1d(table.known["column"][table.known["turns"] == 1], closure.actuated)
        coordinates[:, angles] = nearest_turn(coordinates[:, angles], start[:, angles])
    within_turns(model.mechanism, coordinates)
    return coordinates


@derived
def known_columns(table: LegTable) -> frozenset[int]:
    """Columns of the coordinates that closed forms give."""
    return frozenset(table.known["column"].tolist())


def _closed(closure: Closure, known: frozenset[int], poses: Floats, actuators: Floats, start: Floats) -> Floats:
    """Close the loops at fixed poses and actuators, from joint coordinates (n, columns).

    Known coordinates stay while the other joints follow: if all moved at once, a passive leg could close in its other
    branch, whose limits nobody has checked. Only rows that are still open, near dead points, then close with all free.
    """
    locked = closure.driven
    platform = (*HELD[:3], *((0.0,) * 3)) if closure.mechanism.end_effector_is_joint else HELD
    closing = close(closure, start, poses, locked=locked | known, platform=platform, closeness=EXACT)
    still_open = np.flatnonzero(closing.gap > EXACT)
    if len(still_open):
        begin = closing.coordinates[still_open], poses[still_open]
        put(closing, still_open, close(closure, *begin, locked=locked, platform=platform, closeness=EXACT))
    rng = np.random.default_rng(0)
    for _ in range(RESTARTS):
        unsolved = np.flatnonzero(closing.gap > TOLERANCES.position)
        if not len(unsolved):
            break
        restarts = start[unsolved] + rng.uniform(-np.pi, np.pi, start.shape[1]) * closure.turning * ~closure.idle
        closure.put_actuators(restarts, actuators[unsolved])
        candidate = close(closure, restarts, poses[unsolved], locked=locked, platform=platform)
        is_better = candidate.gap < closing.gap[unsolved]
        put(closing, unsolved[is_better], candidate, is_better)
    return closing.coordinates


def read_coordinates(
    table: LegTable, poses: Floats, sides: Floats, coordinates: Floats, q_proximal: Floats | None = None
) -> None:
    """Write the closed-form coordinates of legs at poses (n, 4, 4) [length] into joint coordinates (n, columns).

    Parameters
    ----------
    q_proximal : as of `joint_coordinates`.
    """
    from ...kernels.pose.evaluate import evaluate_poses

    legs, given_q = reading_table(table), NO_ROWS if q_proximal is None else q_proximal
    kernel_poses = np.require(poses, requirements=["C", "W"])
    evaluate_poses(
        legs.address, reading_scratch(table).address, kernel_poses, sides, given_q, coordinates, NO_ROWS, NO_SLOPES
    )
