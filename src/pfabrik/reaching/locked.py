"""Plans whose actuators are locked."""

from __future__ import annotations

from ..arrays import Floats
from ..kernels.reaching import plan as P


def with_locked_actuators(plan: P.Plan, values: Floats) -> P.Plan:
    """A plan in which the range of every actuator has shrunk to one value, (n_a,) [length or rad]."""
    plan = plan._replace(
        nodes=plan.nodes.copy(),
        branches=plan.branches.copy(),
        trunk_joints=plan.trunk_joints.copy(),
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
