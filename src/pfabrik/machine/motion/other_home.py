"""The same machine with another configuration as its home."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ..description.joints import KINDS, Joint
from ..description.mechanism import Mechanism
from ..description.moved_parts import moved_mass, moved_shape, turned_cone
from ..description.structure import Structure
from .displacements import centres, columns, displacements, home_coordinates, screws


def joints_at(structure: Structure, q: Floats) -> list[Joint]:
    """The joints where they are in a configuration, which is their home from now on.

    Parameters
    ----------
    q : coordinates as deviations from home, (c,) [rad or length].
    """
    rows = q[None]
    points, directions, bodies = centres(structure, rows), screws(structure, rows)[0], displacements(structure, rows)
    moved = []
    for joint in structure.joints:
        span, kind = columns(structure)[joint.name], KINDS[joint.type]
        changes: dict[str, Any] = {"at": points[joint.name][0]} if joint.at is not None else {}
        if kind.direction == "axis" and joint.axis is not None:
            changes["axis"] = directions[span][0, 3:] if joint.type == "prismatic" else directions[span][0, :3]
        if kind.direction == "axes":
            changes["axes"] = directions[span][:, :3]
        if kind.ranged and joint.along is None and q[span].any():
            values = np.ravel(structure.home_coordinate(joint.name)) + q[span]
            changes["home"] = values[0] if len(values) == 1 else values
        if joint.cone is not None:
            changes["cone"] = turned_cone(joint.cone, bodies[joint.cone.fixed_to][0, :3, :3])
        moved.append(replace(joint, **changes))
    return moved


def with_home(mechanism: Mechanism, q: Floats) -> Mechanism:
    """The machine whose home is a closed configuration (c,) [rad or length], as joints count."""
    deviation = q - home_coordinates(mechanism)
    bodies = {body: motion[0] for body, motion in displacements(mechanism, deviation[None]).items()}
    platform, is_joint = bodies[mechanism.end_effector_body], mechanism.end_effector_is_joint
    reference = platform[:3, :3] @ mechanism.reference_point + platform[:3, 3]
    return mechanism._with(
        joints=tuple(joints_at(mechanism, deviation)),
        reference_point=None if is_joint else tuple(reference.tolist()),
        shapes=tuple(moved_shape(each, bodies[each.body]) for each in mechanism.shapes),
        masses=tuple(moved_mass(each, bodies[each.body]) for each in mechanism.masses),
    )
