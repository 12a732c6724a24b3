"""How the least distance between links changes with the actuators."""

from __future__ import annotations

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats, Ints
from ..description.graph import tree_of
from ..description.home_mobility import body_twist, column_joints, column_moves, loop_conditions
from ..description.links import Links, links_of
from ..description.mechanism import Mechanism
from ..motion.displacements import actuator_units, screws
from ..motion.joint_rates import actuated_columns, graph_of
from ..tolerances import TOLERANCES


def gradients_of(solution: Solution, nearest: Ints, distances: Floats, points: Floats) -> Floats:
    """Change of distances (n,) per actuator rate, (n, n_a) [length per rad or length].

    With n the unit vector from the first point to the second and v their velocities as points of their links, the
    distance grows by n (v2 - v1): where the two points are on their links is at its best, and counts only to second
    order. Joint rates follow from those of the actuators by the loops' conditions.

    Parameters
    ----------
    nearest : the nearest pair of every row, (n,); -1 for rows to be left NaN.
    points : of that pair, (n, 2, 3) [length].
    """
    mechanism = solution.mechanism
    gradients = np.full((len(distances), len(mechanism.drives)), np.nan)
    links, q = links_of(mechanism), solution._coordinates
    is_clear = (nearest >= 0) & (np.abs(distances) > TOLERANCES.limit * mechanism.characteristic_length)
    for which in np.unique(nearest[is_clear]):
        rows = np.flatnonzero(is_clear & (nearest == which))
        present = screws(mechanism, q[rows])
        directions = (points[rows, 1] - points[rows, 0]) / distances[rows, None]
        changes = np.zeros(present.shape[:2])
        for end, (shape, sign) in enumerate(zip(links.pairs[which].tolist(), (-1.0, 1.0), strict=True)):
            velocities = _velocities(mechanism, links, shape, present, points[rows, end], solution, rows)
            changes += sign * np.einsum("ni,nic->nc", directions, velocities)
        gradients[rows] = np.einsum("nc,nca->na", changes, _rates(mechanism, present))
    return gradients


def _velocities(
    mechanism: Mechanism, links: Links, shape: int, present: Floats, points: Floats, solution: Solution, rows: Ints
) -> Floats:
    """Velocities (n, 3, c) of points (n, 3) of a link by rates of all coordinates."""
    names = links.joints[shape]
    if not names:
        return _of_body(mechanism, mechanism.shapes[shape].body, present, points)
    p, q = (solution.points[name].reshape(-1, 3)[rows] for name in names)
    line = q - p
    share = np.clip(((points - p) * line).sum(axis=1) / np.maximum((line * line).sum(axis=1), 1e-300), 0.0, 1.0)
    first, second = (
        _of_body(mechanism, mechanism.joint(name).connects[0], present, at)
        for name, at in zip(names, (p, q), strict=True)
    )
    velocities: Floats = first + share[:, None, None] * (second - first)
    return velocities


def _of_body(mechanism: Mechanism, body: str, present: Floats, points: Floats) -> Floats:
    """Velocities (n, 3, c) of points (n, 3) of a body [length per rate]."""
    path = tree_of(mechanism).paths[body][column_joints(mechanism)] * column_moves(mechanism)
    twist = body_twist(path, present)
    turning = np.swapaxes(twist[:, :3], 1, 2)
    velocities = mechanism.characteristic_length * np.swapaxes(twist[:, 3:], 1, 2) + np.cross(
        turning, points[:, None, :]
    )
    return np.swapaxes(velocities, 1, 2)


def _rates(mechanism: Mechanism, present: Floats) -> Floats:
    """Rates of all coordinates per actuator rate, (n, c, n_a): those that keep the loops closed, and the least of them
    where actuators leave some open, as the spin of a rod between two ball joints."""
    columns = actuated_columns(mechanism)
    loops = loop_conditions(graph_of(mechanism).fundamental, present)
    driven = np.zeros((len(present), len(columns), present.shape[1]))
    driven[:, range(len(columns)), columns] = 1.0
    inverse = np.linalg.pinv(np.concatenate([loops, driven], axis=1), rcond=TOLERANCES.alignment)
    rates: Floats = inverse[:, :, loops.shape[1] :] / np.array(actuator_units(mechanism))
    return rates
