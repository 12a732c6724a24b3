"""The description of a mechanism: bodies joined by joints, in the assembled home configuration, in base coordinates."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias

from numpy.typing import ArrayLike

from ...common.checks import require_mapping, require_type
from ...common.frozen import FrozenMapping
from ...common.printed import ResultTable
from ...errors import Fault, InvalidArgument, InvalidMechanism, MobilityWarning, UnknownName, counted
from ..poses import one_pose
from .body_masses import Mass
from .body_shapes import Shape
from .coercion import items, numbers
from .copies import Pattern
from .expanded import expanded
from .faults import find_faults, joint_index
from .form_faults import shown
from .home_mobility import end_effector_freedom, is_held, unclear_conditions, universal_axes
from .joints import DRIVE_FIELDS, JOINT_TYPES, Cone, Joint, JointType, Range, Vector, set_fields
from .leg_joints import legs_name
from .legs import Leg, as_legs
from .mechanism_table import mechanism_table
from .moved_parts import moved_joint, moved_mass, moved_shape, renamed_joint, renamed_shape, turned_task
from .structure import Structure, as_pairs

__all__ = [
    "JOINT_TYPES",
    "Cone",
    "Joint",
    "JointType",
    "Limit",
    "Mass",
    "Mechanism",
    "Range",
    "Shape",
    "Vector",
    "checked_mechanism",
    "told_apart",
]

MOST_JOINTS_FOR_FREEDOM = 200
"""Most joints for which construction counts freedoms: the cost grows with the cube, and reaches a second here."""


class _Source(Protocol):
    """The file that a mechanism was read from."""

    @property
    def dimensions(self) -> Mapping[str, float]: ...

    @property
    def independent(self) -> tuple[str, ...]: ...

    def sketch_with(self, values: Mapping[str, float]) -> Structure: ...

    def read_with(self, values: Mapping[str, float]) -> Mechanism: ...

    def value_of(self, expression: str, values: Mapping[str, float], argument: str = "expression") -> float: ...


Limit: TypeAlias = Range | tuple[Range, Range] | Cone | None


@dataclass(frozen=True, eq=False, repr=False)
class Mechanism(Structure):
    """A closed-loop machine: joints between named bodies, one body fixed, one body (or joint) to be placed.

    Construction checks everything and raises `InvalidMechanism` with every fault; afterwards nothing changes. A
    `MobilityWarning` says when the actuators do not hold what the task sets of the end effector, or the loops keep it
    from moving.

    Attributes
    ----------
    name : str
        Name of the machine.
    joints : tuple of Joint
        The joints.
    end_effector : str
        A body, or the name of a joint (a 5-bar's tip).
    reference_point : array (3,)
        The point of the end-effector body that targets place, at home [length]; the centre of the joint when the end
        effector is a joint, and then left out.
    base : str
        The body that does not move.
    length_unit, angle_unit : str
        Labels for people and files; nothing is ever converted by them.
    task : tuple of str
        What a target sets: of "x", "y", "z", and one of "rotation", "tilt" (where the platform's z axis points) and
        "yaw" (the twist about z); by default everything. What it leaves out follows from the mechanism.
    shapes : tuple of Shape
        Thickness of bodies, for clearances and pictures.
    ignore : tuple of tuple of str
        Pairs of bodies that may touch each other.
    clearance : float or None
        The least distance that every answer keeps between links [length]; None where links may overlap.
    masses : tuple of Mass
        What bodies weigh; those of shapes with a density need none.
    """

    if TYPE_CHECKING:  # what may be given, which is more than what the fields then are

        def __init__(
            self,
            name: str,
            joints: Iterable[Joint],
            end_effector: str,
            reference_point: ArrayLike | None = None,
            base: str = "base",
            length_unit: str = "mm",
            angle_unit: Literal["deg", "rad"] = "deg",
            task: Sequence[str] | None = None,
            shapes: Iterable[Shape] = (),
            ignore: Iterable[Sequence[str]] = (),
            clearance: float | None = None,
            masses: Iterable[Mass] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check()
        self._warn_of_freedom()

    def __repr__(self) -> str:
        return f"<Mechanism '{self.name}': {self._counts()}, task {' '.join(self.task)}>"

    def table(self) -> ResultTable:
        """Name, counts, task, actuators with their limits and, for notebooks, a small drawing of home."""
        return mechanism_table(self, f"{self._counts()}; task {' '.join(self.task)}")

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def _counts(self) -> str:
        counts = {"joint": len(self.joints), "actuator": len(self.actuator_names)}
        return ", ".join(f"{count} {noun}{'s' * (count != 1)}" for noun, count in counts.items())

    @classmethod
    def from_legs(
        cls,
        legs: str | Leg | Sequence[Leg],
        /,
        *,
        base: ArrayLike | None = None,
        platform: ArrayLike | None = None,
        via: ArrayLike | None = None,
        axis: ArrayLike | None = None,
        stroke: Range | None = None,
        thickness: float | None = None,
        copies: Mapping[str, int | ArrayLike] | None = None,
        name: str | None = None,
        end_effector: str = "platform",
        reference_point: ArrayLike | None = None,
        task: Sequence[str] | None = None,
        base_body: str = "base",
        joints: Iterable[Joint] = (),
        shapes: Iterable[Shape] = (),
        ignore: Iterable[Sequence[str]] = (),
        clearance: float | None = None,
        masses: Iterable[Mass] = (),
        length_unit: str = "mm",
        angle_unit: Literal["deg", "rad"] = "deg",
        **by_letter: Mapping[str, object],
    ) -> Mechanism:
        """A mechanism of legs: chains from its base to its end effector, one for each pair of points.

        Parameters
        ----------
        legs : str or Leg or sequence of Leg
            A chain such as "U-P*-S"; or a `Leg`, or several, which then have the points and all else up to `copies`.
        base, platform : array (3,) or (n, 3), optional
            Points of the legs, as in `Leg` [length].
        via : array, optional
            Points of the joints between, as in `Leg` [length].
        axis : array or str or sequence of str, optional
            Directions, as in `Leg`.
        stroke : tuple of float, optional
            Range of the prismatic joint [length].
        thickness : float, optional
            Diameter of the links, as in `Leg` [length].
        copies : mapping, optional
            Rotational copies, as in `Leg`.
        name : str, optional
            Name of the machine; default what the field calls it, such as "6-UPS".
        end_effector : str, optional
            As in `Mechanism`.
        reference_point : array (3,), optional
            As in `Mechanism`.
        task : sequence of str, optional
            As in `Mechanism`.
        base_body : str, optional
            The name of the body that does not move.
        joints : iterable of Joint, optional
            Joints beside those of the legs, before which they come.
        shapes : iterable of Shape, optional
            Shapes beside those of legs with a `thickness`, before which they come.
        ignore : iterable of tuple of str, optional
            As in `Mechanism`.
        clearance : float, optional
            As in `Mechanism`.
        masses : iterable of Mass, optional
            As in `Mechanism`; bodies of legs are called AB1, BC1 by the joints between which they are.
        length_unit, angle_unit : str, optional
            As in `Mechanism`.
        **by_letter : mapping of str to object
            What is said of single joints of the chain: `A={"axis": "radial", "range": (-1, 1)}`; angles in radians.

        Raises
        ------
        InvalidMechanism
            With every fault; places such as `leg[0].platform` are those of a file.
        InvalidArgument
            Neither a chain nor legs, or both.
        """
        parts: dict[str, Any] = {"base": base, "platform": platform, "via": via, "axis": axis, "stroke": stroke}
        parts |= {"thickness": thickness, "copies": copies, "by_letter": by_letter}
        described = as_legs(legs, parts)
        own, own_shapes = items(joints), items(shapes)
        if not isinstance(own, tuple):
            raise InvalidArgument("joints", shown(own), "a list of joints")
        if not isinstance(own_shapes, tuple) or not all(isinstance(each, Shape) for each in own_shapes):
            raise InvalidArgument("shapes", shown(own_shapes), "a list of Shape")
        own_masses = items(masses)
        if not isinstance(own_masses, tuple) or not all(isinstance(each, Mass) for each in own_masses):
            raise InvalidArgument("masses", shown(own_masses), "a list of Mass")
        head: dict[str, Any] = {"name": legs_name(described) if name is None else name, "end_effector": end_effector}
        head |= {"reference_point": reference_point, "base": base_body, "task": task, "ignore": ignore}
        head |= {"clearance": clearance, "length_unit": length_unit, "angle_unit": angle_unit}
        if not all(isinstance(each, Joint) for each in own):
            return cls(**head, joints=own)  # which names the one that is none
        return expanded(cls, head, ([Pattern(each) for each in own], described, own_shapes, own_masses))

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
        left = end_effector_freedom(self, frozenset(drive.column for drive in self.drives), self.task)
        if left > 0:
            drives, leaves = len(self.actuator_names), "leave" if len(self.actuator_names) > 1 else "leaves"
            yield f"{counted(drives, 'actuator')} {leaves} the end effector {counted(left, 'freedom')} at home"
        missed_by = max(unclear_conditions(self), default=0.0)
        if missed_by > 0.0:
            yield (
                f"the loops all but lock at home, by {missed_by:.0e}: axes that should be parallel, or meet, need more "
                "digits, or home is next to a singularity"
            )
        elif left == 0 and is_held(self):
            yield "the loops hold the end effector at home: it cannot move"

    def __getstate__(self) -> dict[str, Any]:
        """The description, and the dimensions of its file."""
        return super().__getstate__() | {name: self.__dict__[name] for name in ("_source",) if name in self.__dict__}

    @property
    def dimensions(self) -> Mapping[str, float]:
        """Values of the named dimensions of the file that it was read from, in their order; empty without any.

        A machine made from another one in Python has none: its numbers may no longer follow from them.
        """
        source: _Source | None = self.__dict__.get("_source")
        return FrozenMapping(source.dimensions if source is not None else {})

    def with_dimensions(self, values: Mapping[str, float] | None = None, /, **by_name: float) -> Mechanism:
        """The machine with other values of some of its dimensions; what the file computes from them follows.

        Parameters
        ----------
        values : mapping of str to float, optional
            Dimension name -> value, in the units of the file.
        **by_name : float
            The same by keywords.

        Raises
        ------
        UnknownName
            It has no dimension of that name.
        InvalidMechanism
            These values make no mechanism; with every fault, at its place in the file.
        """
        source: _Source | None = self.__dict__.get("_source")
        changed = {**(values or {}), **by_name}
        for name in changed:
            if source is None or name not in source.dimensions:
                raise UnknownName("dimension", name, self.dimensions)
        return self if source is None else source.read_with(changed)

    def with_limits(self, limits: Mapping[str, Limit] | None = None, /, **by_name: Limit) -> Mechanism:
        """A copy with other limits.

        Parameters
        ----------
        limits : mapping of str to tuple or Cone or None, optional
            Joint name -> its new range, its new cone, or None to drop both. What is not named stays. Of a universal
            joint that two hinges of a file became, the name of a hinge -> its new range.
        **by_name : tuple or Cone or None
            The same by keywords.

        Raises
        ------
        UnknownName
            No joint of that name.
        InvalidMechanism
            A limit that does not fit its joint, or that home exceeds.
        """
        changes = {**require_mapping("limits", limits, "limits by the names of joints"), **by_name}
        changed = {joint.name: joint for joint in self.joints}
        for name, limit in changes.items():
            joint = changed[self.joint(name).name]
            changed[joint.name] = _limited(joint, limit if name == joint.name else _of_hinge(joint, name, limit))
        try:
            return self._with_joints(changed.values())
        except InvalidMechanism as error:
            raise InvalidMechanism([self._by_its_joint(fault) for fault in error.faults]) from None

    def _by_its_joint(self, fault: Fault) -> Fault:
        """A fault at the name of its joint, where the places of joints are not known."""
        index = joint_index(fault.place)
        if index < 0:
            return fault
        _, _, part = fault.place.partition("]")
        return dataclasses.replace(fault, place=f"joint '{self.joints[index].name}'{part}")

    def without_limits(self) -> Mechanism:
        """A copy in which no joint has a range or a cone."""
        return self._with_joints(_limited(joint, None) for joint in self.joints)

    def with_shapes(self, shapes: Iterable[Shape], ignore: Iterable[Sequence[str]] = ()) -> Mechanism:
        """A copy with other shapes of bodies, and other pairs of bodies that may touch.

        Parameters
        ----------
        shapes : iterable of Shape
            The shapes, in place of those there are.
        ignore : iterable of tuple of str, optional
            Pairs of bodies that may touch each other.

        Raises
        ------
        InvalidMechanism
            A shape that is none, or links that overlap at home.
        """
        return self._with(shapes=items(shapes), ignore=as_pairs(ignore))

    def with_clearance(self, clearance: float | None) -> Mechanism:
        """A copy whose answers keep another least distance between links [length], or none.

        Raises
        ------
        InvalidMechanism
            A clearance that is none, or links that are nearer at home.
        """
        return self._with(clearance=numbers(clearance))

    def with_masses(self, masses: Iterable[Mass]) -> Mechanism:
        """A copy with other masses of bodies.

        Parameters
        ----------
        masses : iterable of Mass
            The masses, in place of those there are.

        Raises
        ------
        InvalidMechanism
            A mass that none can be, with every fault.
        """
        return self._with(masses=items(masses))

    def at(
        self, pose: ArrayLike, *, prefix: str = "", base: str | None = None, task: Sequence[str] | None = None
    ) -> Mechanism:
        """The machine elsewhere, under other names: to be joined with others by `join`.

        Parameters
        ----------
        pose : array (4, 4) or (3,)
            Where the frame in which it is described comes to be, or where its origin does [length].
        prefix : str, optional
            What the names of all joints and bodies but the base begin with.
        base : str, optional
            Another name of its base, such as that of a body of another machine on which it stands.
        task : sequence of str, optional
            What targets set, in the new base coordinates. Default: the same, as far as the turn leaves words for it.

        Raises
        ------
        InvalidArgument
            No pose, or a task that has no words there.
        """
        motion = one_pose("pose", pose)
        for argument, given in (("prefix", prefix), ("base", self.base if base is None else base)):
            require_type(argument, given, str, "a text")
        ground = self.base if base is None else base

        def joint_name(joint: str) -> str:
            return prefix + joint

        def body_name(body: str) -> str:
            return ground if body == self.base else prefix + body

        axes = {each.name: universal_axes(self, each) for each in self.joints if each.type == "universal"}
        placed = (
            renamed_joint(moved_joint(each, motion, axes.get(each.name)), joint_name, body_name) for each in self.joints
        )
        is_joint, turned = self.end_effector_is_joint, motion[:3, :3] @ self.reference_point
        return Mechanism(
            prefix + self.name,
            placed,
            joint_name(self.end_effector) if is_joint else body_name(self.end_effector),
            None if is_joint else turned + motion[:3, 3],
            ground,
            self.length_unit,
            self.angle_unit,
            turned_task(self.task, motion[:3, :3]) if task is None else task,
            (renamed_shape(moved_shape(each, motion), joint_name, body_name) for each in self.shapes),
            [tuple(map(body_name, pair)) for pair in self.ignore],
            self.clearance,
            (dataclasses.replace(moved_mass(each, motion), body=body_name(each.body)) for each in self.masses),
        )

    def _with_joints(self, joints: Iterable[Joint]) -> Mechanism:
        """A checked copy; freedoms do not depend on limits, so it does not warn of them again."""
        return self._with(joints=tuple(joints))

    def _with(self, **changes: Any) -> Mechanism:
        """A checked copy with other fields that freedoms do not depend on."""
        copy = object.__new__(Mechanism)
        set_fields(copy, **(super().__getstate__() | changes))
        copy._check()
        return copy


def checked_mechanism(mechanism: Any) -> Mechanism:
    """The argument, if it is a Mechanism; raises InvalidArgument otherwise."""
    return require_type("mechanism", mechanism, Mechanism, "a Mechanism, as `load` returns")


def moves_alike(other: Mechanism, mechanism: Mechanism) -> bool:
    """True where mechanisms differ in nothing but their motors and what their bodies weigh."""
    nothing: dict[str, Any] = dict.fromkeys(DRIVE_FIELDS)

    def moving(each: Mechanism) -> list[Any]:
        joints = [dataclasses.replace(joint, **nothing) for joint in each.joints]
        shapes = [dataclasses.replace(shape, density=None) for shape in each.shapes]
        others = {field.name for field in dataclasses.fields(Structure) if field.compare}
        return [joints, shapes, *(getattr(each, name) for name in sorted(others - {"joints", "shapes", "masses"}))]

    return moving(other) == moving(mechanism)


def told_apart(other: Mechanism, mechanism: Mechanism) -> str:
    """Another mechanism, in words; where both have one name, with what they differ in."""
    if other.name != mechanism.name:
        return f"another mechanism, '{other.name}'"
    same = set(mechanism.joints)
    joints = [joint.name for joint in other.joints if joint not in same]
    differ = f"joint{'s' * (len(joints) > 1)} {', '.join(joints[:5])}{', ...' * (len(joints) > 5)}"
    return f"another mechanism of the same name, '{other.name}'{f', with other {differ}' if joints else ''}"


def _of_hinge(joint: Joint, hinge: str, limit: Any) -> Any:
    """The ranges of a universal joint with another one for one of the two hinges that it was made of."""
    if limit is None or isinstance(limit, Cone):
        raise InvalidArgument(f"limits['{hinge}']", str(limit), f"a range; None or a cone is for '{joint.name}'")
    ranges = list(joint.range or ((-math.inf, math.inf),) * 2)
    ranges[joint.merged.index(hinge)] = limit
    return ranges


def _limited(joint: Joint, limit: Limit) -> Joint:
    if limit is None:
        return dataclasses.replace(joint, range=None, cone=None)
    if isinstance(limit, Cone):
        return dataclasses.replace(joint, cone=limit)
    return dataclasses.replace(joint, range=limit)
