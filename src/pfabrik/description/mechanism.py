"""The description of a mechanism: bodies joined by joints, in the assembled home configuration, in base coordinates."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from ..errors import InvalidArgument, InvalidMechanism, MobilityWarning, UnknownName
from .coercion import items, numbers, text, texts, unit_vector
from .enclosing import enclosing_radius
from .faults import find_faults, in_order, merged
from .form_faults import joint_faults
from .home_mobility import end_effector_freedom, inexactness
from .joint_types import JOINT_TYPES, KINDS, TASK_COORDINATES, WHOLE_TASK, JointType
from .joints import Cone, Joint, Range, Vector, set_fields
from .leg_joints import at_legs, legs_name, placed_joints
from .legs import Leg, as_legs

__all__ = ["JOINT_TYPES", "Cone", "Joint", "JointType", "Limit", "Mechanism", "Range", "Vector", "checked_mechanism"]

MOST_JOINTS_FOR_FREEDOM = 200
"""Most joints for which construction counts freedoms: the cost grows with the cube, and reaches a second here."""


Limit: TypeAlias = Range | tuple[Range, Range] | Cone | None


@dataclass(frozen=True)
class Mechanism:
    """A closed-loop machine: joints between named bodies, one body fixed, one body (or joint) to be placed.

    Construction checks everything and raises `InvalidMechanism` with every fault; afterwards nothing changes. A
    `MobilityWarning` says when the actuators do not hold the end effector, or the loops keep it from moving.

    Attributes
    ----------
    end_effector : a body, or the name of a joint (a 5-bar's tip).
    reference_point : the point of the end-effector body that targets place, at home [length]; the centre of the joint
        when the end effector is a joint, and then left out.
    length_unit, angle_unit : labels for people and files; nothing is ever converted by them.
    task : what a target sets, of "x", "y", "z", "rotation" and "tilt" (the direction of the platform's z axis); by
        default everything. What it leaves out follows from the mechanism.
    """

    name: str
    joints: tuple[Joint, ...]
    end_effector: str
    reference_point: Vector = None  # type: ignore[assignment]  # never None once constructed
    base: str = "base"
    length_unit: str = "mm"
    angle_unit: Literal["deg", "rad"] = field(default="deg", compare=False)
    task: tuple[str, ...] = None  # type: ignore[assignment]  # never None once constructed

    def __post_init__(self) -> None:
        joints = items(self.joints)
        set_fields(self, joints=joints, reference_point=numbers(self.reference_point))
        set_fields(self, **{name: text(getattr(self, name)) for name in _TEXT_FIELDS})
        if cast(Any, self.reference_point) is None:
            set_fields(self, reference_point=_centre_of(joints, self.end_effector))
        if cast(Any, self.task) is None:
            set_fields(self, task=self.whole_task)
        set_fields(self, task=_in_order(texts(self.task)))
        self._check()
        self._warn_of_freedom()

    @classmethod
    def from_legs(
        cls,
        legs: str | Leg | Sequence[Leg],
        /,
        *,
        base: Any = None,
        platform: Any = None,
        via: Any = None,
        axis: Any = None,
        stroke: Range | None = None,
        copies: Mapping[str, Any] | None = None,
        name: str | None = None,
        end_effector: str = "platform",
        reference_point: Any = None,
        task: Sequence[str] | None = None,
        base_body: str = "base",
        joints: Iterable[Joint] = (),
        length_unit: str = "mm",
        angle_unit: Literal["deg", "rad"] = "deg",
        **by_letter: Mapping[str, Any],
    ) -> Mechanism:
        """A mechanism of legs: chains from its base to its end effector, one for each pair of points.

        Parameters
        ----------
        legs : a chain such as "U-P*-S"; or a `Leg`, or several, which then have the points and all else up to `copies`.
        base, platform, via, axis, stroke, copies : as of a `Leg`; lengths, and angles in radians.
        by_letter : what is said of single joints of the chain: `A={"axis": "radial", "range": (-1, 1)}`.
        name : by default what the field calls it, such as "6-UPS".
        end_effector, reference_point, task, length_unit, angle_unit : as of a `Mechanism`.
        base_body : the name of the body that does not move.
        joints : joints beside those of the legs, before which they come.

        Raises
        ------
        InvalidMechanism : with every fault; places such as `leg[0].platform` are those of a file.
        InvalidArgument : neither a chain nor legs, or both.
        """
        parts = {"base": base, "platform": platform, "via": via, "axis": axis, "stroke": stroke, "copies": copies}
        described = as_legs(legs, parts | {"by_letter": by_letter})
        own = tuple(joints)
        tips = [joint.name for joint in own if isinstance(joint, Joint)]
        placed, faults = placed_joints(described, base_body, end_effector, tips)
        made = own + tuple(each.joint for each in placed)
        if faults:
            sound = ((index, joint) for index, joint in enumerate(made) if isinstance(joint, Joint))
            alone = [fault for index, joint in sound for fault in joint_faults(f"joint[{index}]", joint)]
            raise InvalidMechanism(merged(faults, at_legs(alone, len(own), placed)))
        try:
            return cls(
                name=legs_name(described, placed) if name is None else name,
                joints=made,
                end_effector=end_effector,
                reference_point=reference_point,
                base=base_body,
                length_unit=length_unit,
                angle_unit=angle_unit,
                task=cast(Any, task),
            )
        except InvalidMechanism as error:
            raise InvalidMechanism(in_order(at_legs(error.faults, len(own), placed))) from None

    def _check(self) -> None:
        faults = find_faults(self)
        if faults:
            raise InvalidMechanism(faults)

    def _warn_of_freedom(self) -> None:
        if len(self.joints) > MOST_JOINTS_FOR_FREEDOM:
            return
        for doubt in self._doubts_of_freedom():
            warnings.warn(f"'{self.name}': {doubt}", MobilityWarning, stacklevel=4)

    def _doubts_of_freedom(self) -> Iterator[str]:
        left = end_effector_freedom(self, frozenset(self.actuator_names))
        if left > 0:
            freedoms = "1 freedom" if left == 1 else f"{left} freedoms"
            yield f"{len(self.actuator_names)} actuators leave the end effector {freedoms} at home"
        missed_by = inexactness(self)
        if missed_by > 0.0:
            yield (
                f"the loops all but lock at home, by {missed_by:.0e}: axes that should be parallel, or meet, need more "
                "digits, or home is next to a singularity"
            )
        elif left == 0 and end_effector_freedom(self, frozenset()) == 0:
            yield "the loops hold the end effector at home: it cannot move"

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(tuple(getattr(self, each.name) for each in dataclasses.fields(self) if each.compare))

    def __getstate__(self) -> dict[str, Any]:
        """The description alone: what is derived is computed again, read-only again."""
        return {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}

    @cached_property
    def actuator_names(self) -> tuple[str, ...]:
        """Names of the actuated joints, in the order of `joints`."""
        return tuple(joint.name for joint in self.joints if joint.actuated)

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies, in the order in which the joints mention them."""
        return tuple(dict.fromkeys(body for joint in self.joints for body in joint.connects))

    @cached_property
    def end_effector_is_joint(self) -> bool:
        """Whether `end_effector` names a joint rather than a body."""
        return self.end_effector not in self.bodies

    @cached_property
    def whole_task(self) -> tuple[str, ...]:
        """All that a target can set: the position of the reference point and, for a body, its rotation."""
        return WHOLE_TASK[:3] if _has_joint(self.joints, self.end_effector) else WHOLE_TASK

    @cached_property
    def home_pose(self) -> NDArray[np.float64]:
        """Pose of the end effector at home, T_base_platform, shape (4, 4) [length]: the reference point, unrotated."""
        T_base_platform = np.eye(4)
        T_base_platform[:3, 3] = self.reference_point
        T_base_platform.setflags(write=False)
        return T_base_platform

    @cached_property
    def characteristic_length(self) -> float:
        """Radius of the smallest sphere around the home joint centres [length].

        Where all centres coincide (a spherical wrist), the reference point is included. Where that coincides too (a
        gantry of slides), the longest stroke stands for it. Without one the description contains no length, nothing
        scales with it, and 1 stands for "the unit".
        """
        centres = [joint.at for joint in self.joints if joint.at is not None]
        size = enclosing_radius(centres) or enclosing_radius([*centres, self.reference_point])
        return size or max(map(_stroke, self.joints), default=0.0) or 1.0

    @cached_property
    def rotation_length(self) -> float:
        """Length by which a rotation of the end effector counts as a distance [length per rad].

        The root mean square distance of the joints on the end effector from their centre: turning it by a small angle
        moves them by about that much. The characteristic length where it has fewer than two, or all in one place.
        """
        centres = np.array([j.at for j in self.joints if self.end_effector in j.connects and j.at is not None])
        spread = float(np.sqrt(centres.var(axis=0).sum())) if len(centres) else 0.0
        return spread or self.characteristic_length

    @cached_property
    def _by_name(self) -> dict[str, Joint]:
        return {joint.name: joint for joint in self.joints}

    def joint(self, name: str) -> Joint:
        """The joint of that name; `UnknownName` if there is none."""
        if name not in self._by_name:
            raise UnknownName("joint", name, self._by_name)
        return self._by_name[name]

    def home_coordinate(self, name: str) -> float | tuple[float, ...]:
        """Value of a joint's coordinate in the home configuration [rad or length].

        One number for R and P (the distance of the two joints, for a P with `along`), two for U and C, the zero
        rotation vector for S, nothing for a fixed joint.
        """
        joint = self.joint(name)
        if joint.along is not None:
            return math.dist(*self._centres_along(joint))
        return (0.0,) * len(KINDS[joint.type].coordinates) if joint.type in ("spherical", "fixed") else joint.home

    def home_axis(self, name: str) -> Vector:
        """Unit vector of the axis of an R, P or C at home, in base coordinates.

        For a P with `along`, it points from the joint on its first body to the joint on its second, so that a growing
        coordinate moves the second body forward.
        """
        joint = self.joint(name)
        if joint.along is None:
            return cast(Vector, joint.axis)
        start, end = self._centres_along(joint)
        return cast(Vector, unit_vector(tuple(b - a for a, b in zip(start, end, strict=True))))

    def _centres_along(self, joint: Joint) -> tuple[Vector, Vector]:
        """Centres of the two joints of `along`: of the one on the first body, then of the one on the second."""
        first, second = (self.joint(name) for name in joint.along or ())
        if joint.connects[0] not in first.connects or joint.connects[1] not in second.connects:
            first, second = second, first
        return cast(Vector, first.at), cast(Vector, second.at)

    def with_limits(self, limits: Mapping[str, Limit] | None = None, /, **by_name: Limit) -> Mechanism:
        """A copy with other limits.

        Parameters
        ----------
        limits, by_name : joint name to its new range, its new cone, or None to drop both. What is not named stays.

        Raises
        ------
        UnknownName : no joint of that name.
        InvalidMechanism : a limit that does not fit its joint, or that home exceeds.
        """
        changes = {**(limits or {}), **by_name}
        for name in changes:
            self.joint(name)
        return self._with_joints(
            _limited(joint, changes[joint.name]) if joint.name in changes else joint for joint in self.joints
        )

    def without_limits(self) -> Mechanism:
        """A copy in which no joint has a range or a cone."""
        return self._with_joints(_limited(joint, None) for joint in self.joints)

    def _with_joints(self, joints: Iterable[Joint]) -> Mechanism:
        """A checked copy; freedoms do not depend on limits, so it does not warn of them again."""
        copy = object.__new__(Mechanism)
        set_fields(copy, **(self.__getstate__() | {"joints": tuple(joints)}))
        copy._check()
        return copy


def checked_mechanism(mechanism: Any) -> Mechanism:
    """What was passed as a mechanism; InvalidArgument where it is none."""
    if not isinstance(mechanism, Mechanism):
        raise InvalidArgument("mechanism", type(mechanism).__name__, "a Mechanism, as `load` returns")
    return mechanism


_TEXT_FIELDS = ("name", "end_effector", "base", "length_unit", "angle_unit")


def _limited(joint: Joint, limit: Limit) -> Joint:
    if limit is None:
        return dataclasses.replace(joint, range=None, cone=None)
    if isinstance(limit, Cone):
        return dataclasses.replace(joint, cone=limit)
    return dataclasses.replace(joint, range=limit)


def _has_joint(joints: Any, name: str) -> bool:
    joints = joints if isinstance(joints, tuple) else ()
    return any(isinstance(joint, Joint) and joint.name == name for joint in joints)


def _in_order(task: Any) -> Any:
    """A task's coordinates in their usual order; anything else as it is, for `find_faults` to name."""
    known = isinstance(task, tuple) and all(each in TASK_COORDINATES for each in task)
    return tuple(sorted(task, key=TASK_COORDINATES.index)) if known else task


def _stroke(joint: Joint) -> float:
    """Length of a prismatic joint's range; 0 where it has none."""
    if joint.type != "prismatic" or joint.range is None:
        return 0.0
    low, high = cast(Range, joint.range)
    return high - low if math.isfinite(high - low) else 0.0


def _centre_of(joints: Any, name: str) -> Vector | None:
    joints = joints if isinstance(joints, tuple) else ()
    return next((joint.at for joint in joints if isinstance(joint, Joint) and joint.name == name), None)
