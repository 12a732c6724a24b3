"""Parts of a description moved by a rigid motion, or called otherwise: of a machine elsewhere, or in another pose."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...errors import InvalidArgument
from ...tolerances import TOLERANCES
from .body_masses import Mass, as_matrix, as_moments
from .body_shapes import Shape
from .joints import TASK_TURNS, Cone, Joint


def moved_joint(joint: Joint, motion: Floats, axes: Floats | None) -> Joint:
    """A joint moved by a transform (4, 4): its centre, its axes and its cone.

    Parameters
    ----------
    axes : of a universal joint, its own or the default ones, (2, 3).
    """
    turn = motion[:3, :3]
    changes: dict[str, Any] = {}
    if joint.at is not None:
        changes["at"] = turn @ joint.at + motion[:3, 3]
    if joint.axis is not None:
        changes["axis"] = turn @ joint.axis
    if axes is not None:
        changes["axes"] = axes @ turn.T
    if joint.cone is not None:
        changes["cone"] = turned_cone(joint.cone, turn)
    return replace(joint, **changes)


def turned_cone(cone: Cone, turn: Floats) -> Cone:
    """A cone whose axis is turned by a rotation (3, 3)."""
    return Cone(turn @ cone.axis, cone.half_angle, cone.fixed_to)


def moved_shape(shape: Shape, motion: Floats) -> Shape:
    """A shape moved by a transform (4, 4); a capsule between joints moves with these."""
    turn, shift = motion[:3, :3], motion[:3, 3]
    changes: dict[str, Any] = {}
    for name in ("at", "ends"):
        if getattr(shape, name) is not None:
            changes[name] = np.array(getattr(shape, name)) @ turn.T + shift
    if shape.axis is not None:
        changes["axis"] = turn @ shape.axis
    if shape.kind == "mesh" and shape.at is None:
        changes["at"] = shift
    if shape.kind in ("box", "mesh"):
        changes["axes"] = plain_axes(turn @ np.array(shape.axes or np.eye(3)[:2]).T)
    return replace(shape, **changes)


def plain_axes(axes: Floats) -> Floats | None:
    """The first two edges of a box from the columns of a matrix (3, 2 or 3); None where these are x and y."""
    return None if np.array_equal(axes[:, :2], np.eye(3)[:, :2]) else axes[:, :2].T


def moved_mass(mass: Mass, motion: Floats) -> Mass:
    """A mass moved by a transform (4, 4)."""
    turn = motion[:3, :3]
    changes: dict[str, Any] = {}
    if mass.centre is not None:
        changes["centre"] = turn @ mass.centre + motion[:3, 3]
    if mass.inertia is not None:
        changes["inertia"] = as_moments(turn @ as_matrix(mass.inertia) @ turn.T)
    return replace(mass, **changes)


def renamed_joint(joint: Joint, joint_name: Callable[[str], str], body_name: Callable[[str], str]) -> Joint:
    """A joint with other names of joints and of bodies; a universal joint that two hinges became has theirs."""
    cone = joint.cone
    return replace(
        joint,
        name="+".join(map(joint_name, joint.merged or (joint.name,))),
        connects=_both(joint.connects, body_name),
        along=None if joint.along is None else _both(joint.along, joint_name),
        cone=None if cone is None else Cone(cone.axis, cone.half_angle, body_name(cone.fixed_to)),
    )


def _both(pair: tuple[str, str], name: Callable[[str], str]) -> tuple[str, str]:
    """The names of two."""
    return name(pair[0]), name(pair[1])


def renamed_shape(shape: Shape, joint_name: Callable[[str], str], body_name: Callable[[str], str]) -> Shape:
    """A shape with other names of joints and of bodies."""
    between = None if shape.between is None else _both(shape.between, joint_name)
    return replace(shape, body=body_name(shape.body), between=between)


def turned_task(task: Sequence[str], turn: Floats) -> tuple[str, ...]:
    """A task in base coordinates that were turned by a rotation (3, 3); InvalidArgument where it has no words there."""
    counts = turn @ np.diag([1.0 if axis in task else 0.0 for axis in "xyz"]) @ turn.T
    kept = np.diag(counts) > 0.5
    turns = [each for each in task if each in TASK_TURNS]
    is_about_z = abs(turn[2, 2]) >= 1.0 - TOLERANCES.alignment
    off = np.abs(counts - np.diag(kept.astype(float))).max()
    if off > TOLERANCES.alignment or not (is_about_z or turns in ([], ["rotation"])):
        found = f"a turn after which '{' '.join(task)}' is no task in base coordinates"
        raise InvalidArgument("pose", found, "`task`, what targets set there")
    return (*(axis for axis, counted in zip("xyz", kept, strict=True) if counted), *turns)
