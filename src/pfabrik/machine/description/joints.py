"""One joint of a mechanism, the cone that may limit it, and the joint types with what describes each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, cast, get_args

from numpy.typing import ArrayLike

from .coercion import home_value, numbers, text, texts, truths, unit_vector, unit_vectors

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


DRIVE_FIELDS = ("max_speed", "max_acceleration", "max_torque", "rotor_inertia", "gear", "friction")
"""What can be said of the actuator of a joint, or of both of a C."""


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


__all__ = ["Cone", "Joint", "Range", "Vector", "set_fields"]

Vector: TypeAlias = tuple[float, float, float]
Range: TypeAlias = tuple[float, float]


@dataclass(frozen=True)
class Cone:
    """A limit on a universal or spherical joint: a line of one body stays near an axis of the other.

    The angle between `axis` (a unit vector, given at home, fixed to the body `fixed_to`) and the line from this joint
    to the next joint of the *other* body is at most `half_angle` [rad].

    Attributes
    ----------
    axis : array (3,)
        Axis of the cone at home, a unit vector, fixed to the body `fixed_to`.
    half_angle : float
        Largest angle between the axis and the line from this joint to the next joint of the other body [rad].
    fixed_to : str
        The body that the axis is fixed to.
    """

    axis: Vector
    half_angle: float
    fixed_to: str

    if TYPE_CHECKING:  # what may be given, which is more than what the fields then are

        def __init__(self, axis: ArrayLike, half_angle: float, fixed_to: str) -> None: ...

    def __post_init__(self) -> None:
        set_fields(self, axis=unit_vector(self.axis), half_angle=numbers(self.half_angle), fixed_to=text(self.fixed_to))


@dataclass(frozen=True)
class Joint:
    """A joint between two bodies, at home, in base coordinates. Angles in radians.

    Vectors and pairs may be any sequence or array; they become tuples of floats, and directions become unit vectors.

    Attributes
    ----------
    name : str
        Name of the joint.
    type : {"revolute", "prismatic", "universal", "spherical", "cylindrical", "fixed"}
        Kind of the joint; R, P, U, S and C are the letters of the first five.
    connects : tuple of str
        The two bodies; coordinates move the second relative to the first.
    at : array (3,) or None
        The joint's centre [length]; None only for a prismatic joint, which has no centre of its own.
    axis : array (3,) or None
        The axis of R, P and C.
    axes : tuple of array (3,) or None
        The two axes of U; the first is fixed in the first body. By default they are square to each other and to the
        line on which the next joints are, on the body farther from the base, else on the nearer one: so the joint keeps
        its link from spinning about itself; x and y where there is no such line. Which two of the directions square to
        the line they are is left open: give them where that counts, as in a leg without a spherical joint.
    along : tuple of str or None
        The two joints whose distance is the coordinate of a prismatic joint.
    actuated : bool or tuple of bool
        True if its coordinate is driven; for a C both of them, or two values (angle, displacement).
    home : float or tuple of float
        Value of the coordinate in the home configuration; two values for C (angle, displacement) and U.
    range : tuple of float or None
        Range (lo, hi) for R and P; two such pairs for C (angle, displacement) and U.
    cone : Cone or None
        Limit of a U or S.
    max_speed, max_acceleration : float or tuple of float or None
        Limits of the driven coordinate [rad or length, per s and per s²], two values where a C has both driven; None is
        no limit.
    max_torque : float or tuple of float or None
        The most that the actuator exerts on its coordinate, both ways, in SI units whatever the machine's length: N m,
        of a slide N. Here and below two values where a C has both driven.
    rotor_inertia, gear : float or tuple of float or None
        Moment of inertia of the motor's rotor [kg m²], and how far it turns per radian, or per metre, of the
        coordinate: on that, gear² times the inertia acts. Without a gear it is that of the coordinate, of a slide a
        mass [kg].
    friction : tuple of float or None
        Friction of the coordinate, dry and viscous: a force against the motion [N m, N], none at rest, and one per
        speed [N m s/rad, N s/m]; two such pairs where a C has both driven.
    """

    name: str
    type: JointType
    connects: tuple[str, str]
    at: Vector | None = None
    axis: Vector | None = None
    axes: tuple[Vector, Vector] | None = None
    along: tuple[str, str] | None = None
    actuated: bool | tuple[bool, bool] = False
    home: float | tuple[float, float] = 0.0
    range: Range | tuple[Range, Range] | None = None
    cone: Cone | None = None
    max_speed: float | tuple[float, float] | None = None
    max_acceleration: float | tuple[float, float] | None = None
    max_torque: float | tuple[float, float] | None = None
    rotor_inertia: float | tuple[float, float] | None = None
    gear: float | tuple[float, float] | None = None
    friction: tuple[float, float] | tuple[tuple[float, float], tuple[float, float]] | None = None

    if TYPE_CHECKING:  # what may be given, which is more than what the fields then are

        def __init__(
            self,
            name: str,
            type: JointType,
            connects: Sequence[str],
            at: ArrayLike | None = None,
            axis: ArrayLike | None = None,
            axes: ArrayLike | None = None,
            along: Sequence[str] | None = None,
            actuated: bool | Sequence[bool] = False,
            home: ArrayLike = 0.0,
            range: ArrayLike | None = None,
            cone: Cone | None = None,
            max_speed: ArrayLike | None = None,
            max_acceleration: ArrayLike | None = None,
            max_torque: ArrayLike | None = None,
            rotor_inertia: ArrayLike | None = None,
            gear: ArrayLike | None = None,
            friction: ArrayLike | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        set_fields(
            self,
            name=text(self.name),
            type=text(self.type),
            connects=texts(self.connects),
            at=numbers(self.at),
            axis=unit_vector(self.axis),
            axes=unit_vectors(self.axes),
            along=texts(self.along),
            actuated=truths(self.actuated, self.type),
            home=home_value(self.home, self.type),
            range=numbers(self.range),
            **{field: numbers(getattr(self, field)) for field in DRIVE_FIELDS},
        )

    @property
    def driven(self) -> tuple[int, ...]:
        """Which of its coordinates are driven: (0,) of an actuated R or P."""
        return driven_places(self.type, self.actuated)

    @property
    def merged(self) -> tuple[str, ...]:
        """Names of the two hinges that a universal joint was made of, `pitch` and `roll` of `pitch+roll`; else none."""
        parts = tuple(self.name.split("+")) if self.type == "universal" else ()
        return parts if len(parts) == 2 and all(parts) else ()

    @property
    def is_rigid(self) -> bool:
        """True if its two bodies are as one: it is fixed, or a passive R or P whose range is a single value."""
        if self.type not in ("revolute", "prismatic") or self.actuated or self.range is None:
            return self.type == "fixed"
        low, high = self.range
        return low == high


def set_fields(frozen: object, **values: object) -> None:
    """Set fields of a frozen object that is still being made."""
    for name, value in values.items():
        object.__setattr__(frozen, name, value)
