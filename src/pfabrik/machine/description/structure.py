"""A mechanism as it is described, and what follows from the description alone; nothing is checked here."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, cast

import numpy as np

from ...common.arrays import Floats
from ...errors import UnknownName
from ..noted_vectors import Vector as NotedVector
from ..noted_vectors import length
from .body_masses import Mass
from .body_shapes import Shape
from .coercion import items, numbers, text, texts
from .enclosing import enclosing_radius
from .joint_coordinates import JointCoordinate
from .joints import KINDS, TASK_COORDINATES, WHOLE_TASK, Joint, Range, Vector, set_fields

_TEXT_FIELDS = ("name", "end_effector", "base", "length_unit", "angle_unit")


@dataclass(frozen=True, eq=False, repr=False)
class Structure:
    """Joints between named bodies, one body fixed, one body (or joint) to be placed: a mechanism before its checks.

    Values become plain and immutable, and what is left out is filled in. Only `Mechanism`, which adds the checks,
    promises that they make sense; what is derived from them may fail for a description with faults.
    """

    name: str
    joints: tuple[Joint, ...]
    end_effector: str
    reference_point: Vector = field(default=cast(Any, None))  # never None once constructed
    base: str = "base"
    length_unit: str = "mm"
    angle_unit: Literal["deg", "rad"] = field(default="deg", compare=False)
    task: tuple[str, ...] = field(default=cast(Any, None))  # never None once constructed
    shapes: tuple[Shape, ...] = ()
    ignore: tuple[tuple[str, str], ...] = ()
    clearance: float | None = None
    masses: tuple[Mass, ...] = ()

    def __post_init__(self) -> None:
        set_fields(self, joints=items(self.joints), reference_point=numbers(self.reference_point))
        set_fields(self, shapes=items(self.shapes), masses=items(self.masses), ignore=as_pairs(self.ignore))
        set_fields(self, clearance=numbers(self.clearance))
        set_fields(self, **{name: text(getattr(self, name)) for name in _TEXT_FIELDS})
        tip = self.end_effector_joint
        if tip is not None and cast(Any, self.reference_point) is None:
            set_fields(self, reference_point=tip.at)
        if cast(Any, self.task) is None:
            set_fields(self, task=self.whole_task)
        set_fields(self, task=_in_order(texts(self.task)))

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if not isinstance(other, Structure) or other.__class__ is not self.__class__:
            return NotImplemented
        if self._compared is not other._compared:
            if self._compared != other._compared:
                return False
            set_fields(self, _compared=other._compared)  # the next time one look tells: what is derived is kept by it
        return True

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _compared(self) -> tuple[Any, ...]:
        """What is to be the same where two are equal."""
        return tuple(getattr(self, each.name) for each in dataclasses.fields(self) if each.compare)

    @cached_property
    def _hash(self) -> int:
        return hash(self._compared)

    def __getstate__(self) -> dict[str, Any]:
        """The description alone: what is derived is computed again, read-only again."""
        return {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}

    @cached_property
    def actuator_names(self) -> tuple[str, ...]:
        """Names of the actuated coordinates, in the order of `joints`, as in `coordinate_names`.

        Those of the actuated joints; of a cylindrical one either coordinate may be driven, or both ("C1[0]", "C1[1]").
        """
        return tuple(drive.name for drive in self.drives)

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of the coordinates of all joints, in the order of `q`, which is that of `joints`.

        One for a revolute or prismatic joint ("A1"), two for a universal or cylindrical one ("A1[0]", "A1[1]"), three
        for a spherical one (its rotation vector), none for a fixed one.
        """
        return tuple(each.name for each in self.coordinates)

    @cached_property
    def coordinates(self) -> tuple[JointCoordinate, ...]:
        """The coordinates of all joints, in the order of `coordinate_names`."""
        found: list[JointCoordinate] = []
        for joint in self.joints:
            home = self.home_coordinate(joint.name)
            homes = home if isinstance(home, tuple) else (home,)
            names = [joint.name] if len(homes) == 1 else [f"{joint.name}[{place}]" for place in range(len(homes))]
            found += [
                JointCoordinate(name, joint, place, len(found) + place, value)
                for place, (name, value) in enumerate(zip(names, homes, strict=True))
            ]
        return tuple(found)

    @cached_property
    def coordinates_by_name(self) -> dict[str, JointCoordinate]:
        """Name of each coordinate, and of the hinge that it was where two became one -> the coordinate."""
        return {each.alias: each for each in self.coordinates} | {each.name: each for each in self.coordinates}

    @cached_property
    def drives(self) -> tuple[JointCoordinate, ...]:
        """The actuated coordinates, in the order of `actuator_names`."""
        return tuple(each for each in self.coordinates if each.place in each.joint.driven)

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies, in the order in which the joints mention them."""
        return tuple(dict.fromkeys(body for joint in self.joints for body in joint.connects))

    @cached_property
    def end_effector_is_joint(self) -> bool:
        """True if `end_effector` names a joint rather than a body."""
        return self.end_effector not in self.bodies

    @cached_property
    def end_effector_body(self) -> str:
        """The body that carries the end effector; of a joint end effector, its first body that is not the base."""
        if not self.end_effector_is_joint:
            return self.end_effector
        first, second = self.joint(self.end_effector).connects
        return second if first == self.base else first

    @cached_property
    def whole_task(self) -> tuple[str, ...]:
        """All that a target can set: the position of the reference point and, for a body, its rotation."""
        return WHOLE_TASK if self.end_effector_joint is None else WHOLE_TASK[:3]

    @cached_property
    def home_pose(self) -> Floats:
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
        centres = self.platform_points
        spread = float(np.sqrt(centres.var(axis=0).sum())) if len(centres) else 0.0
        return spread or self.characteristic_length

    @property
    def platform_points(self) -> Floats:
        """Centres of the joints on the end effector at home, (n, 3) [length]."""
        points = [j.at for j in self.joints if self.end_effector in j.connects and j.at is not None]
        return np.array(points, float).reshape(-1, 3)

    @cached_property
    def _by_name(self) -> dict[str, Joint]:
        hinges = {name: joint for joint in self.joints for name in joint.merged}
        return hinges | {joint.name: joint for joint in self.joints}

    def joint(self, name: str) -> Joint:
        """The joint of that name, or that a hinge of that name is part of; `UnknownName` if there is none."""
        if not isinstance(name, str) or name not in self._by_name:
            raise UnknownName("joint", name, [joint.name for joint in self.joints])
        return self._by_name[name]

    def home_coordinate(self, name: str) -> float | tuple[float, ...]:
        """Value of a joint's coordinate in the home configuration [rad or length].

        One number for R and P (the distance of the two joints, for a P with `along`), two for U and C, the zero
        rotation vector for S, nothing for a fixed joint.
        """
        joint = self.joint(name)
        if joint.along is not None:
            return float(length(self._span_along(joint)))
        return (0.0,) * len(KINDS[joint.type].coordinates) if joint.type in ("spherical", "fixed") else joint.home

    def home_axis(self, name: str) -> Vector:
        """Unit vector of the axis of an R, P or C at home, in base coordinates.

        For a P with `along`, it points from the joint on its first body to the joint on its second, so that a growing
        coordinate moves the second body forward.
        """
        joint = self.joint(name)
        if joint.along is None:
            return cast(Vector, joint.axis)
        span = self._span_along(joint)
        return cast(Vector, tuple(span / length(span)))

    def _span_along(self, joint: Joint) -> NotedVector:
        """From the joint of `along` on the first body to that on the second, at home [length]."""
        start, end = self.ends_along(joint)
        return NotedVector(cast(Vector, end.at)) - cast(Vector, start.at)

    def ends_along(self, joint: Joint) -> tuple[Joint, Joint]:
        """The two joints of `along`: the one on the first body, then the one on the second."""
        first, second = (self.joint(name) for name in joint.along or ())
        if joint.connects[0] not in first.connects or joint.connects[1] not in second.connects:
            first, second = second, first
        return first, second

    @property
    def end_effector_joint(self) -> Joint | None:
        """The joint that the end effector is named after, whatever else may be wrong with the description."""
        joints = self.joints if isinstance(self.joints, tuple) else ()
        return next((each for each in joints if isinstance(each, Joint) and each.name == self.end_effector), None)


def as_pairs(pairs: Any) -> Any:
    """Pairs of names as tuples; anything else as it is."""
    listed = texts(pairs) if isinstance(pairs, str) else items(pairs)
    return tuple(map(texts, listed)) if isinstance(listed, tuple) else listed


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
