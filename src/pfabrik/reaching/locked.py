"""Assembly by reaching: the legs with their actuators locked, the platform by best fit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..decomposition.plan import Flat, flat_of
from ..description.mechanism import Mechanism
from ..kernels.reaching import plan as P
from ..options import Options
from .completion import positions_of
from .rows import new_rows
from .solve import settings_of

Floats = NDArray[np.float64]

FREE = Options(hold=None, working_mode="any", projection="centroid")


def reached_with_locked_legs(mechanism: Mechanism, coordinates: Floats, poses: Floats, values: Floats) -> P.Rows | None:
    """Answers in positions nearest to given platforms whose actuators have given values, where there are any.

    The range of every actuator shrinks to its value; the reaching engine then projects the platform to where the legs
    let it be.

    Returns
    -------
    Rows that need not be assembled; None if positions cannot express the mechanism.
    """
    from ..kernels.reaching.solve import solve_by_iteration

    flat = flat_of(mechanism)
    if flat is None:
        return None
    rows = new_rows(mechanism, flat, len(values))
    start = new_rows(mechanism, flat, len(values))
    positions_of(mechanism, flat, coordinates, start)
    rows.status[:] = P.PENDING
    settings = settings_of(mechanism, FREE, seeded=False)
    for i in range(len(values)):
        row = slice(i, i + 1)
        seeds = P.Seeds(poses[row].copy(), start.nodes[row], start.trunks[row])
        own = P.Rows._make(array[row] for array in rows)
        solve_by_iteration(_locked(flat, values[i]), poses[row].copy(), seeds, settings, own)
    return rows


def _locked(flat: Flat, values: Floats) -> P.Plan:
    """The plan with every actuator's range shrunk to one value."""
    plan = flat.plan._replace(
        nodes=flat.plan.nodes.copy(),
        branches=flat.plan.branches.copy(),
        trunk_joints=flat.plan.trunk_joints.copy(),
    )
    for coordinate, value in zip(plan.coordinates, values, strict=False):
        reading = coordinate["sign"] * (value - coordinate["offset"])
        place, lo, hi = _BOUNDS[int(coordinate["kind"])]
        records = getattr(plan, place)
        index = coordinate["branch"] if place == "branches" else coordinate["index"]
        records[lo][index] = records[hi][index] = reading
        if coordinate["kind"] == P.HINGE:
            plan.nodes["ranged"][index] = 1
        if coordinate["kind"] == P.END_HINGE:
            plan.branches["end_ranged"][index] = 1
    return plan


# where the bounds of a coordinate are kept, by its kind
_BOUNDS = {
    P.STROKE: ("nodes", "lo", "hi"),
    P.RAIL: ("branches", "rail_lo", "rail_hi"),
    P.HINGE: ("nodes", "angle_lo", "angle_hi"),
    P.END_HINGE: ("branches", "end_angle_lo", "end_angle_hi"),
    P.TRUNK: ("trunk_joints", "lo", "hi"),
}
