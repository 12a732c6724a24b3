"""What tags of URDF and SDF say in numbers: a table with one field for each."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from ...errors import Fault, near_miss
from .couplings import Coupling
from .xml_reading import numbers_in

ENDLESS = 1e9
"""Size from which on a number stands for none [SI units]."""

FAR = 20.0
"""How far [rad or m] the end of a range without one is from the other end: three turns."""

XACRO = "; xacro files want xacro"


class Field(NamedTuple):
    """A number, or several, that a tag has.

    Attributes
    ----------
    path : elements inward; the last is one of them, or an attribute.
    default : the numbers where there are none.
    unit : that they are in.
    absent : True if a number that is not positive, or endless, stands for none.
    """

    path: str
    default: tuple[float, ...] = (0.0,)
    unit: str = ""
    absent: bool = False


UNLIMITED = (-np.inf, np.inf)

DRIVE = {
    "max_speed": Field("limit/velocity", unit="rad/s or m/s", absent=True),
    "max_acceleration": Field("limit/acceleration", unit="rad/s² or m/s²", absent=True),
    "max_torque": Field("limit/effort", unit="N m or N", absent=True),
    "dry": Field("dynamics/friction", unit="N m or N"),
    "viscous": Field("dynamics/damping", unit="N m s/rad or N s/m"),
}
"""Numbers of a joint of URDF, and of an axis of SDF."""

MIMIC = {
    "offset": Field("offset", unit="rad or m"),
    "multiplier": Field("multiplier", (1.0,)),
    "reference": Field("reference", unit="rad or m"),
}
ROTOR = {
    "inertia": Field("rotor_inertia/value|rotor_inertia", unit="kg m²", absent=True),
    "gear": Field("gear_ratio/value|gear_ratio", absent=True),
}
"""Drake's elements of a motor."""


def text_at(element: ET.Element | None, path: str) -> str:
    """The text of the element or attribute at one of some paths, `a/b|c`; "" without."""
    for way in path.split("|"):
        inner, _, key = way.rpartition("/")
        within = element if element is None or not inner else element.find(inner)
        if within is not None and (text := within.get(key) or within.findtext(key)) is not None:
            return text.strip()
    return ""


def read_fields(
    element: ET.Element | None, fields: Mapping[str, Field], place: str, faults: list[Fault]
) -> dict[str, Any]:
    """The numbers of some fields by their names: floats, or arrays of several; None for what stands for none.

    Parameters
    ----------
    place : of the element, for faults, which are added for what is no such number.
    """
    found: dict[str, Any] = {}
    for name, (path, default, _, is_absent) in fields.items():
        text, count = text_at(element, path), len(default)
        values = numbers_in(text, count, is_absent or not np.isfinite(default).all()) if text else np.array(default)
        if values is None:
            what = ("a number" if count == 1 else f"{count} finite numbers") + XACRO * ("$" in text)
            faults.append(Fault(f"{place}.{path.partition('|')[0].replace('/', '.')}", f"'{text}'", what))
            values = np.array(default)
        value = float(values[0])
        found[name] = values if count > 1 else None if is_absent and not 0.0 < value < ENDLESS else value
    return found


def friction_of(dry: float, viscous: float) -> tuple[float, float] | None:
    """Dry and viscous friction of a file's joint; None where it has none, or numbers that stand for none."""
    return (dry, viscous) if min(dry, viscous) >= 0.0 and 0.0 < max(dry, viscous) < ENDLESS else None


def drive_of(
    kind: str,
    element: ET.Element | None,
    place: str,
    faults: list[Fault],
    ends: tuple[float, float] = UNLIMITED,
) -> dict[str, Any]:
    """What limits and brakes a joint of a kind, as fields of `UrdfJoint`.

    Parameters
    ----------
    ends : those of a range of which nothing is said.
    """
    said = read_fields(element, DRIVE, place, faults)
    range_ = {key: Field(f"limit/{key}", (end,), "rad or m") for key, end in zip(("lower", "upper"), ends, strict=True)}
    low, high = read_fields(element, range_, place, faults).values()
    is_limited = kind in ("REVOLUTE", "PRISMATIC") and min(abs(low), abs(high)) < ENDLESS
    limits = (low if low > -ENDLESS else high - FAR, high if high < ENDLESS else low + FAR)
    friction = friction_of(said.pop("dry"), said.pop("viscous"))
    return {**said, "limits": limits if is_limited else None, "friction": friction}


def coupling_of(
    name: str, mimic: ET.Element | None, leaders: Collection[str], place: str, faults: list[Fault]
) -> Coupling | None:
    """How a joint follows another one; None where it does not."""
    if mimic is None:
        return None
    leader = mimic.get("joint", "")
    if leader not in leaders:
        faults.append(Fault(f"{place}.mimic.joint", f"'{leader}'{near_miss(leader, leaders)}", "a joint of the robot"))
    offset, ratio, reference = read_fields(mimic, MIMIC, f"{place}.mimic", faults).values()
    return Coupling(name, leader, (offset - ratio * reference, ratio))


def rotor_of(element: ET.Element | None, place: str, faults: list[Fault]) -> tuple[float | None, float | None]:
    """The inertia of a rotor [kg m²], and its gear; None where they are not said."""
    said = read_fields(element, ROTOR, place, faults)
    return (said["inertia"], said["gear"]) if said["inertia"] else (None, None)
