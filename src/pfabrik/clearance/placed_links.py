"""Where the links of a configuration are."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..answers.solution import Solution
from ..arrays import Floats
from ..description.links import links_of
from ..motion.displacements import displacements


def joint_centres(solution: Solution) -> dict[str, Floats]:
    """The centres (n, 3) [length] of the joints that links run between; of no others, if there are none."""
    names = {name for ends in links_of(solution.mechanism).joints for name in ends}
    return {name: solution.points[name].reshape(-1, 3) for name in names}


def ends_of(solution: Solution) -> Floats:
    """Ends of the axes of all capsules, (shapes, 6, n) [length]; other shapes are left out."""
    links, centres = links_of(solution.mechanism), joint_centres(solution)
    ends = np.zeros((len(links.sizes), 6, len(solution._rows.status)))
    moves = _displacements(solution, slice(None))
    for k, joints in enumerate(links.joints):
        if joints:
            for at, name in ((0, joints[0]), (3, joints[1])):
                ends[k, at : at + 3] = centres[name].T
        elif links.sizes[k, 0] == 0.0:
            ends[k] = _moved(moves[k], links.places[k, :2]).reshape(-1, 6).T
    return ends


def places_of(solution: Solution, centres: Mapping[str, Floats], rows: slice) -> Floats:
    """Places of all shapes in some rows, (n, shapes, 4, 3) [length], as in `kernels.clearance.solids`."""
    links, moves = links_of(solution.mechanism), _displacements(solution, rows)
    places = np.zeros((len(solution._rows.status[rows]), len(links.sizes), 4, 3))
    for k, joints in enumerate(links.joints):
        for at, name in enumerate(joints):
            places[:, k, at] = centres[name][rows]
        if not joints:
            n_points = 2 if links.sizes[k, 0] == 0.0 else 1
            places[:, k, :n_points] = _moved(moves[k], links.places[k, :n_points])
            places[:, k, n_points:] = links.places[k, n_points:] @ np.swapaxes(moves[k][:, :3, :3], 1, 2)
    return places


def _moved(displaced: Floats, points: Floats) -> Floats:
    """Points of a body (k, 3) at home, where they are now, (n, k, 3)."""
    moved: Floats = points @ np.swapaxes(displaced[:, :3, :3], 1, 2) + displaced[:, None, :3, 3]
    return moved


def _displacements(solution: Solution, rows: slice) -> list[Floats]:
    """Displacements (n, 4, 4) of the body of every shape that does not run between two joints; others have none.

    Those of the platform follow from its pose, and those of inner bodies from all joint coordinates.
    """
    mechanism, poses = solution.mechanism, solution._rows.poses[rows]
    base = np.broadcast_to(np.eye(4), poses.shape).copy()
    base[np.isnan(poses[:, 0, 3])] = np.nan
    known = {mechanism.base: base}
    if not mechanism.end_effector_is_joint:
        known[mechanism.end_effector] = poses @ np.linalg.inv(mechanism.home_pose)
    joints = links_of(mechanism).joints
    alone = {shape.body for shape, ends in zip(mechanism.shapes, joints, strict=True) if not ends}
    if alone - set(known):
        known = displacements(mechanism, solution._coordinates[rows]) | known
    none = np.empty((0, 4, 4))
    return [none if ends else known[shape.body] for shape, ends in zip(mechanism.shapes, joints, strict=True)]
