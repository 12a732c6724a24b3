"""Every limited quantity of an answered batch: coordinates, then the angles at the cones."""

from __future__ import annotations

from ._jit import kernel, routine
from .measure import cone_step, read_coordinate
from .plan import Configuration, Floats, Plan, Rows
from .restrict import cone_axis
from .rows import load_configuration, new_configuration
from .vectors import angle_between, turn, vec


@kernel
def read_limited(plan: Plan, rows: Rows, values: Floats) -> None:
    """Fill `values` (n, n_coordinates + n_cones) from the configurations of `rows`."""
    now = new_configuration(plan)
    n_coordinates = plan.coordinates.shape[0]
    for i in range(values.shape[0]):
        load_configuration(plan, rows.poses[i], rows.nodes[i], rows.trunks[i], now)
        for j in range(n_coordinates):
            values[i, j] = read_coordinate(plan, j, now)
        for b in range(plan.branches.shape[0]):
            read_cones(plan, b, now, values[i, n_coordinates:])


@routine
def read_cones(plan: Plan, b: int, now: Configuration, angles: Floats) -> None:
    branch = plan.branches[b]
    carrier = now.carriers[branch["carrier"]]
    normal = turn(carrier, vec(branch["normal"]))
    for c in range(branch["cone_first"], branch["cone_last"]):
        axis = cone_axis(plan.cones[c], carrier, now.pose, normal, now.nodes)
        angles[c] = angle_between(axis, cone_step(plan.cones[c], now.nodes))
