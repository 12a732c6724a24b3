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


def no_drives(opened: OpenMechanism, joints: Sequence[Joint], undriven: str, enough: Sequence[str]) -> InvalidMechanism:
    """The refusal of a machine with no driven joint between base and end effector, with the reason and a remedy.

    Parameters
    ----------
    joints, undriven : all joints of the robot, and what its file has in place of driven ones.
    enough : joints that drive all of its freedoms, if they are known.
    """
    elsewhere = [joint.name for joint in joints if joint.driven]
    why = f"drives elsewhere only: {', '.join(elsewhere)}" if elsewhere else undriven
    names = [joint.name for joint in candidates(opened.joints, opened.base)]
    others = [name for name in names if name not in enough]
    if enough:
        way = f"(--actuated {','.join(enough)})" + (f"; others here: {', '.join(others)}" if others else "")
    else:
        listed = ", ".join(names) or "none, for nothing here can be driven"
        way = f"(--actuated A,B,...), from the base outward: {listed}"
    found = f"none between '{opened.base}' and '{opened.end_effector}': {why}"
    return InvalidMechanism([Fault("actuated joints", found, f"the driven joints by name, `actuated` {way}")])


def candidates(joints: Sequence[Joint], base: str) -> list[Joint]:
    """The joints that can be driven, those at the base first."""
    return sorted((each for each in joints if KINDS[each.type].actuatable), key=lambda each: base not in each.connects)


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
