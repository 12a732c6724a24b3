"""The joint types, with the fields that describe each, its coordinates and its limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, cast, get_args

JointType: TypeAlias = Literal["revolute", "prismatic", "universal", "spherical", "cylindrical", "fixed"]
JOINT_TYPES: tuple[JointType, ...] = get_args(JointType)

WHOLE_TASK = ("x", "y", "z", "rotation")
TASK_TURNS: dict[str, int] = {"rotation": 3, "tilt": 2, "yaw": 1}
"""What a target may set of a rotation, at most one, and how many freedoms that are: all of it, the direction of the
platform's z axis, or the twist about z."""

TASK_COORDINATES = (*WHOLE_TASK, "tilt", "yaw")
"""What a target may set of a pose: its position, and its rotation or a part of it."""

Coordinate: TypeAlias = Literal["angle", "length"]


@dataclass(frozen=True)
class JointKind:
    """The contents of the description of one joint type.

    Attributes
    ----------
    letter : the short name in chains such as `U-P*-S`.
    coordinates : whether each coordinate is an angle [rad] or a length; as many as the joint has freedoms.
    direction : the field that holds its direction: `axis`, `axes`, or None.
    ranged, coned, actuatable : whether it may have a range or a cone, and whether it may be actuated.
    """

    letter: str
    coordinates: tuple[Coordinate, ...]
    direction: Literal["axis", "axes"] | None = None
    ranged: bool = False
    coned: bool = False
    actuatable: bool = False


KINDS: dict[JointType, JointKind] = {
    "revolute": JointKind("R", ("angle",), "axis", ranged=True, actuatable=True),
    "prismatic": JointKind("P", ("length",), "axis", ranged=True, actuatable=True),
    "universal": JointKind("U", ("angle", "angle"), "axes", ranged=True, coned=True),
    "spherical": JointKind("S", ("angle", "angle", "angle"), coned=True),
    "cylindrical": JointKind("C", ("angle", "length"), "axis", ranged=True, actuatable=True),
    "fixed": JointKind("fixed", ()),
}


def driven_places(joint_type: Any, actuated: Any) -> tuple[int, ...]:
    """Indices of the driven coordinates of a joint of some type, as far as its description is valid.

    Parameters
    ----------
    actuated : true for all of its coordinates, or a pair, one for each.
    """
    kind = KINDS.get(cast(Any, joint_type)) if isinstance(joint_type, str) else None
    if kind is None or not kind.actuatable:
        return ()
    each = (actuated,) * len(kind.coordinates) if isinstance(actuated, bool) else actuated
    if not isinstance(each, tuple) or len(each) != len(kind.coordinates):
        return ()
    return tuple(place for place, drives in enumerate(each) if drives is True)
