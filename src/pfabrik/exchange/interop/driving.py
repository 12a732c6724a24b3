"""The drives of a robot: their order, how fast they are, and the refusal of a machine that has none."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ...errors import Fault, InvalidMechanism
from ...machine.description.joints import DRIVE_FIELDS, KINDS, Joint
from ...machine.description.mechanism import Mechanism
from ...machine.files.units import MEASURED
from .opened import OpenMechanism


class Rates(NamedTuple):
    """What the drive of a coordinate can do, as the fields of a joint: None where not known."""

    max_speed: float | None = None
    max_acceleration: float | None = None
    max_torque: float | None = None
    rotor_inertia: float | None = None
    gear: float | None = None
    friction: tuple[float, float] | None = None


def require_drives(opened: OpenMechanism, joints: Sequence[Joint], undriven: str) -> None:
    """Refuse a machine with no driven joint between base and end effector, with the reason and the candidates.

    Parameters
    ----------
    joints, undriven : all joints of the robot, and what its file has in place of driven ones.
    """
    if any(joint.driven for joint in opened.joints):
        return
    elsewhere = [joint.name for joint in joints if joint.driven]
    why = f"drives elsewhere only: {', '.join(elsewhere)}" if elsewhere else undriven
    candidates = [joint for joint in opened.joints if KINDS[joint.type].actuatable]
    candidates.sort(key=lambda joint: opened.base not in joint.connects)
    names = ", ".join(joint.name for joint in candidates) or "none, for nothing here can be driven"
    expected = f"the driven joints by name, `actuated` (--actuated A,B,...), from the base outward: {names}"
    raise InvalidMechanism(
        [Fault("actuated joints", f"none between '{opened.base}' and '{opened.end_effector}': {why}", expected)]
    )


def with_actuators(mechanism: Mechanism, order: Sequence[str], rates: Mapping[str, Rates], metres: float) -> Mechanism:
    """With its actuators in the order of the file, and as fast as it says."""
    place = {name: index for index, name in enumerate(order)}
    drives = {joint.name: [each for each in mechanism.drives if each.joint is joint] for joint in mechanism.joints}

    def rank(joint: Joint) -> int:
        return min(place.get(drive.name, len(place)) for drive in drives[joint.name])

    def said(joint: Joint, field: str) -> Any:
        values = []
        for drive in drives[joint.name]:
            value = getattr(rates.get(drive.name, Rates()), field)
            if value is None:
                return None
            values.append(value / metres if drive.kind == "length" and field in MEASURED else value)
        return tuple(values) if len(values) > 1 else values[0]

    def rated(joint: Joint) -> Joint:
        return dataclasses.replace(joint, **{field: said(joint, field) for field in DRIVE_FIELDS})

    driven = iter(sorted((joint for joint in mechanism.joints if joint.driven), key=rank))
    return mechanism._with_joints(rated(next(driven)) if joint.driven else joint for joint in mechanism.joints)
