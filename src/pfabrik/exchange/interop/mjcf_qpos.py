"""Joint positions of MuJoCo models from configurations; for models that `to_mjcf` writes MuJoCo is not needed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from ...answers.solution import Solution, checked_solution
from ...common.arguments import as_floats
from ...common.arrays import Floats
from ...common.rotations import to_quaternion
from ...errors import InvalidArgument
from ...kinematics import columns
from ...machine.description.joint_coordinates import JointCoordinate
from ...machine.description.mechanism import Mechanism
from ...machine.files.units import metres_of
from .cuts import Branch, CutTree, cut_tree
from .mjcf_bodies import si_unit


def qpos(
    solution: Solution,
    model: object = None,
    qpos: ArrayLike | None = None,
    *,
    configuration: str | ArrayLike | None = None,
) -> Floats:
    """MuJoCo's joint positions of configurations, (..., nq) [rad, m; quaternions w, x, y, z], with the loops closed.

    Of the model that `to_mjcf` writes, or of the model of the robot that the mechanism was read from: joints of the
    mechanism by their names, those that follow them, and all others as they are in `qpos`.

    Parameters
    ----------
    solution : Solution
        One configuration or a batch.
    model : MjModel or str or PathLike, optional
        The model, or the path or the text of one; default what `to_mjcf` writes.
    qpos : array (..., nq), optional
        Positions of the joints that the mechanism does not have; default the configuration's.
    configuration : str or array (nq,), optional
        The mechanism's home in that model: "qpos0", the name of a keyframe, or positions. Default: the first of these
        that has the joints where they are at home, else "qpos0". A body that floats freely in the model is put where
        the mechanism has it: the world is then what the mechanism's base coordinates are.

    Raises
    ------
    UnknownName
        A joint of the mechanism that the model does not have.
    InvalidArgument
        A loop of the model that does not close where the mechanism's joints are.
    """
    mechanism, q = checked_solution(solution).mechanism, np.asarray(solution.q)
    if model is None:
        return qpos_of(mechanism, q)
    from .robot_in_mujoco import RobotInMujoco

    states = RobotInMujoco(mechanism, model, configuration, is_whole=True)
    begin = None
    if qpos is not None:
        begin = as_floats("qpos", qpos, f"positions (..., {states.model.nq})")
        if begin.shape[-1:] != (states.model.nq,) or begin.shape[:-1] not in ((), q.shape[:-1]):
            raise InvalidArgument("qpos", f"shape {begin.shape}", f"(..., {states.model.nq}), for all or for each")
        if not np.isfinite(begin).all():
            raise InvalidArgument("qpos", "a value that is not finite", "finite positions")
    return states.at(q, begin)


def qpos_of(mechanism: Mechanism, q: Floats) -> Floats:
    """Joint positions (..., nq) of the model that `to_mjcf` writes, at joint coordinates (..., nq) [rad or length]."""
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
