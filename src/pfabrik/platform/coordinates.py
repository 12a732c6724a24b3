"""Between legs in closed form and joint coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..closure.close import HELD, close, closure_of
from ..closure.configurations import Configurations
from ..decomposition.leg_table import LegTable
from ..description.mechanism import Mechanism
from ..kernels.legs import records as K
from ..kernels.reaching import plan as P
from ..motion.displacements import gaps
from ..motion.limits import within_turns
from ..motion.meeting import meeting_joints, put_meeting_joints
from ..tolerances import TOLERANCES
from .table import machine_aimed

Floats = NDArray[np.float64]

RESTARTS = 24
"""Random starts for joints that closed forms do not tell and that do not close from where they began."""


class LegAnswers(Configurations):
    """Configurations of legs that are told by their platforms.

    Attributes
    ----------
    sides : which of its two solutions each leg takes, (n, legs).
    carriers : coordinates of the legs' carriers, (n, legs) [L or rad], where closed forms tell them less exactly: near
        dead points; NaN elsewhere, None where nowhere.
    """

    def __init__(
        self, rows: P.Rows, coordinates: Floats | Callable[[], Floats], sides: Floats, carriers: Floats | None = None
    ) -> None:
        super().__init__(rows, coordinates)
        self.sides, self.carriers = sides, carriers

    def __reduce__(self) -> tuple[Any, ...]:
        return LegAnswers, (self.rows, self.coordinates, self.sides, self.carriers)

    def at(self, places: NDArray[np.intp]) -> Configurations:
        """The configurations at some places, copied."""
        rows = super().at(places).rows
        carriers = None if self.carriers is None else self.carriers[places]
        return LegAnswers(rows, lambda: self.coordinates[places], self.sides[places], carriers)


def settled(
    mechanism: Mechanism,
    table: LegTable,
    poses: Floats,
    actuators: Floats,
    sides: Floats,
    begin: Floats | None,
    carriers: Floats | None = None,
) -> Floats:
    """All joint coordinates, as deviations from home, (n, columns), of platforms and actuators at rest.

    Parameters
    ----------
    poses, actuators : (n, 4, 4) [length], (n, n_a).
    sides : which of its two solutions each leg takes, (n or 1, legs).
    begin : where to start, (n or 1, columns): what a configuration leaves open (a rod's spin) is nearest to there.
        None for home.
    carriers : coordinates of the legs' carriers (n, legs) [L or rad] where they were found otherwise than by closed
        forms, which tell half their digits near dead points; NaN, or None, where not.
    """
    closure = closure_of(mechanism, whole=False)
    found = np.zeros((len(poses), len(closure.scale)))
    if begin is not None:
        found[:] = begin
    if not len(poses):
        return found
    read_into(table, poses, sides, found)
    if carriers is not None:
        rows = np.flatnonzero(np.isfinite(carriers).all(axis=1))
        found[rows] = _read_with(mechanism, table, poses[rows], sides[rows], carriers[rows], found[rows])
    closure.put_actuators(found, actuators)
    rest = np.flatnonzero(~_put_others(mechanism, table, poses, found))
    if len(rest):
        found[rest] = _closed(mechanism, poses[rest], actuators[rest], found[rest])
    within_turns(mechanism, found)
    return found


def _put_others(mechanism: Mechanism, table: LegTable, poses: Floats, found: Floats) -> NDArray[np.bool_]:
    """Write what legs do not tell, where it is where bodies meet, into joint coordinates (n, columns); which close."""
    known = frozenset(table.known["column"].tolist()) | closure_of(mechanism, whole=False).driven
    meeting = meeting_joints(mechanism, known)
    if meeting is None:
        return np.zeros(len(found), bool)
    put_meeting_joints(mechanism, meeting, poses, found)
    return gaps(mechanism, found) <= TOLERANCES.meeting * mechanism.characteristic_length


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
        closing.take(rest[better], tried, better)
    return closing.coordinates


def read_into(table: LegTable, poses: Floats, sides: Floats, found: Floats) -> None:
    """Write the coordinates that legs tell at poses (n, 4, 4) [length] into joint coordinates (n, columns)."""
    from ..kernels.legs.answer import read_coordinates

    legs = machine_aimed(table)
    read_coordinates(legs.address, np.require(poses, requirements=["C", "W"]), sides, found)


def _read_with(
    mechanism: Mechanism, table: LegTable, poses: Floats, sides: Floats, carriers: Floats, found: Floats
) -> Floats:
    """The same into joint coordinates (n, columns), with the carriers where they are told to be."""
    from ..kernels.platform.nearest import read_configurations

    scaled = poses.copy()
    scaled[:, :3, 3] /= mechanism.characteristic_length
    legs = machine_aimed(table)
    read_configurations(legs.address, scaled, carriers, sides, found)
    return found


def sides_at(mechanism: Mechanism, table: LegTable, start: Configurations) -> Floats:
    """Which of its two solutions each leg takes in configurations, (n, legs), 0 where it has but one; of arms, where
    they are."""
    if isinstance(start, LegAnswers):
        return start.sides
    sides = np.repeat(table.home_sides, len(start), axis=0)
    if len(table.led_arms):
        arms = table.led_arms
        columns = [table.known["column"][table.known["leg"] == k][0] for k in arms["leg"]]
        sides[:, arms["leg"]] = arms["sense"] * start.coordinates[:, columns] / arms["unit"]
    choosing = np.flatnonzero(table.home_sides[0])
    if not len(choosing):
        return sides
    closure = closure_of(mechanism, whole=False)
    places = np.where(table.legs["kind"] == K.PIVOT, K.FOOT, K.CARRIER)
    own = [table.known[(table.known["leg"] == k) & (table.known["place"] == places[k])]["column"][0] for k in choosing]
    if set(own) <= set(closure.actuated.tolist()):
        present = np.zeros((len(start), len(closure.scale)))
        closure.put_actuators(present, start.rows.actuators)
    else:
        present = start.coordinates
    turning = closure.turning[own] > 0.0
    off = []
    for factor in (1.0, -1.0):
        found = np.zeros_like(present)
        read_into(table, start.rows.poses, factor * sides, found)
        away = found[:, own] - present[:, own]
        off.append(np.abs(np.where(turning, np.remainder(away + np.pi, 2.0 * np.pi) - np.pi, away)))
    sides[:, choosing] *= np.where(off[0] <= off[1], 1.0, -1.0)
    return sides
