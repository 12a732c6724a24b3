"""Displacements of a whole machine by carriages next to the base: on rails it is the same machine anywhere."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Floats, Records
from ...common.derived import derived
from ...kernels.legs import records as K
from ...kernels.pose.search_records import Along
from ...machine.decomposition.leg_table import LegTable
from ...tolerances import TOLERANCES


def proximal_coordinates(table: LegTable) -> Records:
    """The coordinates of proximal joints among the known ones."""
    on_rods = table.legs["has_proximal"][table.known["leg"]] == 1
    return np.asarray(table.known[on_rods & (table.known["place"] == K.Q_PROXIMAL)])


def stays_there(table: LegTable) -> Along:
    """No displacement that carriages could take."""
    n = len(table.legs)
    return Along(np.zeros((3, 3)), np.zeros((n, 3)), np.zeros((n, 2)))


@derived
def carriages_along(table: LegTable) -> Along:
    """The displacements d of the whole machine, and what carriages go: on the way from the base to whatever else moves,
    they add up to d."""
    n = len(table.legs)
    rows = np.zeros((n, 3, n + 3))
    for k in range(n):
        way = _carriages_to(table.legs, k)
        if way is None:
            return stays_there(table)
        rows[k, :, way] = table.legs["proximal_axis"][way]
        rows[k, :, n:] = -np.eye(3) if k not in way or not table.is_redundant[k] else 0.0
        if not rows[k, :, n:].any():
            rows[k] = 0.0  # the legs on this carriage tell
    _, sizes, directions = np.linalg.svd(rows.reshape(3 * n, n + 3))
    free = directions[np.count_nonzero(sizes > TOLERANCES.alignment) :].T
    outward, shares, motions = np.linalg.svd(free[n:], full_matrices=False)
    counts = shares > TOLERANCES.alignment  # others are carriages that move within the machine
    outward, motions = outward[:, counts], motions[counts] / shares[counts, None]
    return Along(outward @ outward.T, free[:n] @ motions.T @ outward.T, _room(table))


def _carriages_to(legs: Records, k: int) -> list[int] | None:
    """The carriages next to the base, one on the other, that lead to a leg, itself among them; None where that is not
    how it reaches the base."""
    way: list[int] = []
    at = k
    while at >= 0:
        leg = legs[at]
        is_first = leg["redundant"] < 0
        if leg["at_platform_end"] or leg["mirror_of"] >= 0 or (is_first and leg["frame"] != K.FROM_BASE):
            return None
        if leg["proximal"] == K.SHARED:
            return None
        way, at = [at, *way], int(leg["redundant"])
    others = [place for place, at in enumerate(way) if legs["proximal"][at] != K.CARRIAGE]
    return way[: others[0]] if others else way


def _room(table: LegTable) -> Floats:
    """The least and the most coordinate of each proximal or redundant joint, (legs, 2) [L or rad]."""
    room = np.tile([-np.inf, np.inf], (len(table.legs), 1))
    for proximal in np.concatenate([proximal_coordinates(table), table.redundant]):
        room[proximal["leg"]] = np.sort(proximal["sense"] * np.array([proximal["lo"], proximal["hi"]]))
    return room
