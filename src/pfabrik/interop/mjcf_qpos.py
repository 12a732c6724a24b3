"""Joint positions of exported MuJoCo models, from configurations; MuJoCo itself is not needed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..answers.solution import Solution, checked_solution
from ..arrays import Floats
from ..description.joint_coordinates import JointCoordinate
from ..description.mechanism import Mechanism
from ..files.units import metres_of
from ..motion.displacements import columns
from ..rotations import to_quaternion
from .cuts import Branch, CutTree, cut_tree
from .mjcf_bodies import si_unit


def mjcf_qpos(solution: Solution) -> Floats:
    """The joint positions `qpos` of the model that `to_mjcf` writes, (..., nq) [rad, m; quaternions w, x, y, z].

    Of REACHED answers, loops are closed in that model as they are here.
    """
    return qpos_of(checked_solution(solution).mechanism, solution.q)


def qpos_of(mechanism: Mechanism, q: Floats) -> Floats:
    """The same, (..., nq), at all joint coordinates (..., nq) of a mechanism [rad or length]."""
    metres = metres_of(mechanism.length_unit)
    parts: list[Floats] = []
    for branch in _in_mjcf_order(mechanism, cut_tree(mechanism)):
        span = columns(mechanism)[branch.joint.name]
        if branch.joint.type == "spherical":
            turn = to_quaternion(q[..., span] * (1.0 if branch.forward else -1.0))
            parts.append(np.roll(turn, 1, axis=-1))
            continue
        coordinates: list[JointCoordinate] = [*mechanism.coordinates[span]]
        for each in coordinates if branch.forward else reversed(coordinates):
            parts.append(q[..., each.column, None] * si_unit(each, metres))
    return np.concatenate(parts, axis=-1) if parts else np.empty((*q.shape[:-1], 0))


def _in_mjcf_order(mechanism: Mechanism, tree: CutTree) -> Iterator[Branch]:
    """Branches in the order in which MuJoCo numbers bodies: each body, then all that hangs on it."""
    waiting = [branch for branch in reversed(tree.branches) if branch.parent == mechanism.base]
    while waiting:
        branch = waiting.pop()
        yield branch
        waiting += [each for each in reversed(tree.branches) if each.parent == branch.body]
