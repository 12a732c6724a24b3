"""Derivatives of the least distance between links by the actuators."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats, Ints
from ...kinematics import JointRates, actuator_units, column_joints, end_effector_pose, links_of, model_of, tree_of
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES


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
        first, here = JointRates(model_of(mechanism), q[rows]), end_effector_pose(mechanism, q[rows])[:, :3, 3]

        def of_body(body: str, at: Floats, first: JointRates = first, here: Floats = here) -> Floats:
            """Velocities (n, c, 3) of points (n, 3) of a body [length] by joint rates."""
            path = tree_of(mechanism).paths[body][column_joints(mechanism)]
            turned = np.cross(first.screws[..., 3:], (at - here)[:, None])
            return np.asarray(path[:, None] * (mechanism.characteristic_length * first.screws[..., :3] + turned))

        directions = (points[rows, 1] - points[rows, 0]) / distances[rows, None]
        changes = np.zeros(first.screws.shape[:2])
        for end, (shape, sign) in enumerate(zip(links.pairs[which].tolist(), (-1.0, 1.0), strict=True)):
            ends = {name: solution.points[name].reshape(-1, 3)[rows] for name in links.joints[shape]}
            velocities = _velocities(mechanism, shape, ends, points[rows, end], of_body)
            changes += sign * np.einsum("ni,nci->nc", directions, velocities)
        gradients[rows] = np.einsum("nc,nca->na", changes, first.by_actuators) / actuator_units(mechanism)
    return gradients


def _velocities(
    mechanism: Mechanism,
    shape: int,
    ends: Mapping[str, Floats],
    points: Floats,
    of_body: Callable[[str, Floats], Floats],
) -> Floats:
    """Velocities (n, c, 3) of points (n, 3) of a link, which is a body's or between two joints, by joint rates."""
    if not ends:
        return of_body(mechanism.shapes[shape].body, points)
    p, q = ends.values()
    line = q - p
    share = np.clip(((points - p) * line).sum(axis=1) / np.maximum((line * line).sum(axis=1), 1e-300), 0.0, 1.0)
    first, second = (of_body(mechanism.joint(name).connects[0], at) for name, at in ends.items())
    return np.asarray(first + share[:, None, None] * (second - first))
