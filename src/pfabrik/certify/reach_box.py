"""A box that holds everything within reach, from the reach of each leg."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Floats, Record
from ..decomposition.leg_table import LegTable
from ..kernels.legs import records as K
from ..kinematics import Model
from ..rotations import from_rotvec

PAD = 1e-9
"""Share by which a box is larger than computed, for rounding."""


def reach_box(model: Model, middle: Floats, axes: list[int]) -> tuple[Floats, Floats]:
    """Ends (d,) of a box over some coordinates that holds all that is within reach [length or rad].

    A leg keeps |M (p - c)| <= r: M = I for struts and cranks, across the rail for carriages without ends. The sum of
    all squares is at most the sum of all r^2: an ellipsoid, and each leg with M = I a ball of its own.

    Parameters
    ----------
    middle : the six coordinates, of which those of `axes` vary [length, rad].
    """
    places = [axis for axis in axes if axis < 3]
    low, high = np.full(len(axes), -math.pi), np.full(len(axes), math.pi)
    if not places:
        return low, high
    rotation = from_rotvec(middle[3:][None])[0] if max(axes) < 3 else None
    columns, fixed = np.eye(3)[:, places], middle[:3] / model.length
    fixed[places] = 0.0
    normal, right, total = np.zeros((len(places), len(places))), np.zeros(len(places)), 0.0
    lowest, highest = np.full(len(places), -np.inf), np.full(len(places), np.inf)
    for M, centre, radius in _reaches(model.legs, rotation):
        part, offset = M @ columns, M @ (centre - fixed)
        normal += part.T @ part
        right += part.T @ offset
        total += radius * radius - float(offset @ offset)
        if M.shape == (3, 3) and (np.eye(3) == M).all():
            lowest = np.maximum(lowest, centre[places] - radius)
            highest = np.minimum(highest, centre[places] + radius)
    if np.linalg.cond(normal) < 1e12:
        best = np.linalg.solve(normal, right)
        half = np.sqrt(max(total + float(right @ best), 0.0) * np.diag(np.linalg.inv(normal)))
        lowest, highest = np.maximum(lowest, best - half), np.minimum(highest, best + half)
    pad = PAD * (1.0 + np.abs(lowest) + np.abs(highest))
    is_place = np.array(axes) < 3
    low[is_place], high[is_place] = (lowest - pad) * model.length, (highest + pad) * model.length
    return low, high


def _reaches(table: LegTable, rotation: Floats | None) -> list[tuple[Floats, Floats, float]]:
    """M (k, 3), centre [L] and radius [L] of legs read from the base; without a rotation for any orientation."""
    reaches = []
    for k, leg in enumerate(table.legs):
        if leg["frame"] != 0:
            continue
        ranges = {
            int(each["place"]): max(abs(each["lo"]), abs(each["hi"])) for each in table.limited if each["leg"] == k
        }
        point, slack = leg["platform_end_point"], 0.0
        if rotation is None:
            point, slack = np.zeros(3), float(np.linalg.norm(point))
        else:
            point = rotation @ point
        if leg["kind"] == K.PIVOT:
            for i in range(leg["slides"]):
                row = leg["slide_rows"][i]
                if math.isfinite(bound := ranges.get(K.PLATFORM_END + i, math.inf)):
                    radius = bound + slack * float(np.linalg.norm(row))
                    reaches.append((row[None], leg["base_end_point"] - point, radius))
        elif leg["kind"] == K.ROD and (reach := _reach_of(leg, ranges)) is not None:
            M, centre, radius = reach
            reaches.append((M, centre - point, radius + slack))
    return reaches


def _reach_of(leg: Record, ranges: dict[int, float]) -> tuple[Floats, Floats, float] | None:
    """M, centre and radius of a rod, by its platform end; None if it has no end."""
    length, proximal = float(leg["length"]), leg["proximal"]
    if proximal == K.CRANK:
        return np.eye(3), leg["proximal_point"], length + float(np.linalg.norm(leg["crank"]))
    if proximal == K.CARRIAGE:
        axis, travel = leg["proximal_axis"], ranges.get(K.Q_PROXIMAL, math.inf)
        if math.isfinite(travel):
            return np.eye(3), leg["base_end_point"], length + travel
        return np.eye(3) - np.outer(axis, axis), leg["base_end_point"], length
    if proximal == K.NO_PROXIMAL and math.isfinite(bound := ranges.get(K.SLIDE, math.inf if leg["slides"] else 0.0)):
        return np.eye(3), leg["base_end_point"], length + bound
    return None
