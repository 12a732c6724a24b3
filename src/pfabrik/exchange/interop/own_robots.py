"""A mechanism as a robot, of which others are made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_mapping
from ...errors import InvalidArgument
from ...kinematics import tree_of
from ...machine.description.joints import DRIVE_FIELDS, Joint
from ...machine.description.mechanism import Mechanism
from .collision import Collision, Solid
from .driving import Rates
from .notes import Note
from .robot_tree import Robot
from .robots import ImportOptions, mechanism_of
from .standing import posed


def mechanism_on_feet(
    mechanism: Mechanism, body: str | None, values: Mapping[str, float] | None, fixed: Iterable[str], **asked: Any
) -> Mechanism:
    """A robot that is described as a mechanism, on its feet; arguments as in `stand`."""
    named = require_mapping("at", values, "values by the names of joints")
    notes: list[Note] = []
    found = mechanism_of(posed(_as_robot(mechanism), named), None, body, ImportOptions(**asked), notes, fixed).mechanism
    return found._with(length_unit=mechanism.length_unit, angle_unit=mechanism.angle_unit)


def _as_robot(mechanism: Mechanism) -> Robot:
    """The mechanism, a tree, as a robot whose metres are its own unit."""
    tree = tree_of(mechanism)
    if tree.closing:
        found = f"'{mechanism.name}', whose loops are closed already"
        raise InvalidArgument("robot", found, "a robot whose joints are a tree")
    outward = [_outward(mechanism.joints[index], is_forward) for index, is_forward in tree.steps]
    places: dict[str, tuple[str, Floats]] = {body: (body, np.eye(4)) for body in mechanism.bodies}
    for joint in outward:  # a body that ends a chain is where its joint is, as links of robots are
        if joint.at is not None:
            frame = np.eye(4)
            frame[:3, 3] = joint.at
            places[joint.connects[1]] = joint.connects[1], frame
    if not mechanism.end_effector_is_joint:
        places[mechanism.end_effector] = mechanism.end_effector, np.asarray(mechanism.home_pose)
    return Robot(
        mechanism.name,
        outward,
        (),
        mechanism.base,
        places,
        order=mechanism.actuator_names,
        rates={drive.name: Rates(**{field: drive.said(field) for field in DRIVE_FIELDS}) for drive in mechanism.drives},
        collision=Collision(
            tuple(Solid(shape, shape.body) for shape in mechanism.shapes),
            excluded=mechanism.ignore,
            clearance=mechanism.clearance,
            masses=mechanism.masses,
        ),
    )


def _outward(joint: Joint, is_forward: bool) -> Joint:
    """A joint from the body nearer to the base; one that says otherwise counts alike about a turned axis."""
    first, second = joint.connects
    if is_forward:
        return joint
    if joint.axis is None and joint.type not in ("fixed", "spherical"):
        raise InvalidArgument("robot", f"joint '{joint.name}' inward, from '{first}'", "joints from the base outward")
    x, y, z = joint.axis or (0.0, 0.0, 0.0)
    return replace(joint, connects=(second, first), axis=None if joint.axis is None else (-x, -y, -z))
