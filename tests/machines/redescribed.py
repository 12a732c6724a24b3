"""The same machine, described otherwise: moved, in another unit, from other bodies, with other names and order."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from pfabrik import Joint, Mechanism


def with_joints(mechanism: Mechanism, change: Callable[[Joint], Joint], **fields: Any) -> Mechanism:
    """The mechanism with every joint changed."""
    return dataclasses.replace(mechanism, joints=tuple(map(change, mechanism.joints)), **fields)


def moved(mechanism: Mechanism, R: np.ndarray, t: np.ndarray) -> Mechanism:
    """Everything turned and shifted."""

    def move(joint: Joint) -> Joint:
        return dataclasses.replace(
            joint,
            at=None if joint.at is None else R @ joint.at + t,
            axis=None if joint.axis is None else R @ joint.axis,
            axes=None if joint.axes is None else tuple(R @ axis for axis in joint.axes),
            cone=joint.cone and dataclasses.replace(joint.cone, axis=R @ joint.cone.axis),
        )

    return with_joints(mechanism, move, reference_point=R @ mechanism.reference_point + t)


def scaled(mechanism: Mechanism, factor: float) -> Mechanism:
    """All lengths in another unit."""
    return with_joints(
        mechanism, lambda each: _scaled(each, factor), reference_point=factor * np.array(mechanism.reference_point)
    )


def _scaled(each: Joint, factor: float) -> Joint:
    changes: dict[str, Any] = {} if each.at is None else {"at": tuple(factor * np.array(each.at))}
    if each.type == "prismatic":
        changes["home"] = factor * each.home
        changes["range"] = each.range and tuple(factor * np.array(each.range))
    if each.type == "cylindrical":
        changes["home"] = (each.home[0], factor * each.home[1])
        changes["range"] = each.range and (each.range[0], tuple(factor * np.array(each.range[1])))
    return dataclasses.replace(each, **changes)


def reversed_joints(mechanism: Mechanism) -> Mechanism:
    """Every joint described from its other body; coordinates change sign."""
    return with_joints(mechanism, reversed_joint)


def reversed_joint(each: Joint) -> Joint:
    """A joint described from its other body."""
    changes: dict[str, Any] = {"connects": each.connects[::-1]}
    if each.along is None and each.type not in ("spherical", "fixed"):
        swap = slice(None, None, -1 if each.type == "universal" else 1)
        home = -np.ravel(each.home)[swap]
        changes["home"] = tuple(home) if len(home) > 1 else float(home[0])
        if each.range is not None:
            pairs = -np.reshape(each.range, (-1, 2))[swap, ::-1]
            changes["range"] = tuple(map(tuple, pairs)) if len(pairs) > 1 else tuple(pairs[0])
    if each.axes is not None:
        changes["axes"] = each.axes[::-1]
    return dataclasses.replace(each, **changes)


def relabelled(
    mechanism: Mechanism, rng: np.random.Generator, swaps: float = 0.5
) -> tuple[Mechanism, dict[str, str], set[str]]:
    """Other names and order, a share of the joints reversed; the new name of each joint, and who is reversed."""
    names = {joint.name: f"j{n}" for joint, n in zip(mechanism.joints, rng.permutation(999), strict=False)}
    bodies = {body: f"b{n}" for body, n in zip(mechanism.bodies, rng.permutation(999), strict=False)}
    swapped = {joint.name for joint in mechanism.joints if rng.random() < swaps}
    joints = []
    for joint in mechanism.joints:
        own = reversed_joint(joint) if joint.name in swapped else joint
        joints.append(
            dataclasses.replace(
                own,
                name=names[joint.name],
                connects=tuple(bodies[body] for body in own.connects),
                along=own.along and tuple(names[other] for other in own.along),
                cone=own.cone and dataclasses.replace(own.cone, fixed_to=bodies[own.cone.fixed_to]),
            )
        )
    order, end = rng.permutation(len(joints)), (bodies | names)[mechanism.end_effector]
    point = None if mechanism.end_effector_is_joint else mechanism.reference_point
    fields = {"base": bodies[mechanism.base], "task": mechanism.task}
    return Mechanism("another", [joints[k] for k in order], end, point, **fields), names, swapped
