"""A mechanism as a robot, of which others are made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...common.checks import require_mapping
from ...machine.description.joints import DRIVE_FIELDS
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
    """The mechanism as a robot whose metres are its own unit."""
    places: dict[str, tuple[str, Floats]] = {body: (body, np.eye(4)) for body in mechanism.bodies}
    for joint in mechanism.joints:  # a body that ends a chain is where its joint is, as links of robots are
        if joint.at is not None:
            frame = np.eye(4)
            frame[:3, 3] = joint.at
            places[joint.connects[1]] = joint.connects[1], frame
    if not mechanism.end_effector_is_joint:
        places[mechanism.end_effector] = mechanism.end_effector, np.asarray(mechanism.home_pose)
    return Robot(
        mechanism.name,
        mechanism.joints,
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
