"""The table of legs of a mechanism whose chains are all legs in closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce
from operator import add
from typing import Any

import numpy as np

from ...common.arrays import Floats, Mask, Records
from ...kernels.legs import records as K
from ...tolerances import TOLERANCES
from ..description.graph import cone_line
from ..description.joint_coordinates import deviations
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..noted_numbers import largest
from ..noted_vectors import Vector, area, sign
from .decompose import SubChain, sub_chains
from .home_numbers import Fields, FilledRecords, HomeNumbers
from .intermediate_platforms import legs_of_sub_chain
from .leg_forms import ElementaryJoint, LegForm, NoLeg, RedundantJoint, Rod, closed_form_coordinates
from .leg_records import leg_records

NO_PATH = "does not lead to the end effector"
"""The reason of a sub-chain that is on no path to the end effector."""

DEAD_POINTS = ("stretched", "level")
"""Bounds of legs at dead points: links stretched out or folded, or square to a slide; a rod on an upright slide is then
level."""

MOST_WRITTEN = 12
"""Joints of a sub-chain that are all written in a message: more do not fit a line."""

COMPLETED_WITHIN = 2.0
"""How far what a task leaves open may move from its start [L or rad]: farther off there may be other completions."""


@dataclass(frozen=True, eq=False)
class LegTable:
    """Legs as records, in the layout of `kernels.legs.records`.

    Attributes
    ----------
    forms : the form of each leg, with the numbers of the home that it was read at.
    limited : every coordinate that has a range.
    driven : every actuator; its column is that of its value.
    known : every coordinate that legs have in closed form; its column is that among all joint coordinates.
    aimed : `legs`, set to compute the angles of all endings, which reading `known` takes.
    task : one record.
    limits : (joint, bound) of the limits, those of `limited` (two each), then those of `cones`.
    fields : what the records of each array were filled from.
    """

    forms: tuple[LegForm, ...]
    legs: Records
    aimed: Records
    limited: Records
    cones: Records
    driven: Records
    known: Records
    task: Records
    limits: tuple[tuple[str, str], ...]
    fields: dict[str, tuple[Fields, ...]] = field(default_factory=dict)

    @cached_property
    def home_sides(self) -> Floats:
        """The side of each leg at home, and 0 for redundant joints without sides, (1, legs)."""
        return np.array(self.legs["side"], dtype=float)[None]

    @cached_property
    def is_redundant(self) -> Mask:
        """Mask of the legs that are redundant joints."""
        return np.asarray(self.legs["kind"] == K.REDUNDANT)

    @cached_property
    def redundant(self) -> Records:
        """The coordinates of redundant joints; their columns number them."""
        redundant: Records = self.known[self.is_redundant[self.known["leg"]]]
        redundant["column"] = np.arange(len(redundant))
        return redundant

    @property
    def redundant_joints(self) -> tuple[str, ...]:
        """Names of the redundant joints."""
        return tuple(
            form.element.joint.name
            for form in self.forms
            if isinstance(form, RedundantJoint) and form.mirror_of is None
        )

    @cached_property
    def implicit_joints(self) -> Records:
        """The coordinates of implicit joints: in an array of sides their values stand in the place of a side."""
        return np.asarray(self.redundant[self.legs["implicit"][self.redundant["leg"]] == 1])

    @cached_property
    def has_free_redundant(self) -> bool:
        """True if poses leave redundant joints open; else these follow from the constraints of the legs on them."""
        return len(self.redundant) > 0 and not self.task["redundant"][0]

    @cached_property
    def has_sides(self) -> bool:
        """True if some legs have two solutions."""
        return bool(self.home_sides.any())

    @cached_property
    def is_partial(self) -> bool:
        """True if the task leaves some of the pose open."""
        return bool(self.task["unset"][0] > 0)

    @cached_property
    def is_completed(self) -> bool:
        """True if some of the pose, or a redundant joint, is completed from the start."""
        return self.is_partial or self.has_implicit_joints

    @cached_property
    def has_implicit_joints(self) -> bool:
        """True if there are implicit joints: redundant joints that are solved for from the start."""
        return bool(self.task["implicit"][0])

    @cached_property
    def leaves_open(self) -> bool:
        """True if there are implicit joints, or if task and legs leave some of the pose undetermined."""
        return self.has_implicit_joints or bool((self.task["unset"] + self.task["redundant"] > self.task["rows"])[0])

    @cached_property
    def is_for_blocks(self) -> bool:
        """True if the kernels that solve blocks apply: rods read from the base, no angles of crossed hinges."""
        legs = self.legs
        aimed = [(legs[f"{end}_aimed"] == 0) | (legs[end] == K.HINGE) for end in ("base_end", "platform_end")]
        twists = (legs["twists"] == 0) | ((legs["base_end"] == K.HINGE) & (legs["platform_end"] == K.HINGE))
        rods = (legs["kind"] == K.ROD) & (legs["frame"] == 0)
        return bool(np.all([rods, twists, *aimed]) and self.task["rotations"][0] in (0, 3))

    @cached_property
    def measured_limits(self) -> tuple[tuple[str, str], ...]:
        """The limits that feasibility measures: ranges and cones, then dead points of legs, then their closure."""
        closed = tuple(
            dead_point if isinstance(form, Rod) and form.is_shared else (_first_joint(form), "not closed")
            for form, dead_point in zip(self.forms, self.dead_points, strict=True)
        )
        return self.limits + self.dead_points + closed

    @cached_property
    def dead_points(self) -> tuple[tuple[str, str], ...]:
        """The joint and the bound of each leg's dead point, beyond which it does not reach."""
        found: list[tuple[str, str]] = []
        for form in self.forms:
            is_shared = isinstance(form, Rod) and form.is_shared
            found.append(found[-1] if is_shared and found else _dead_point(form))
        return tuple(found)

    def task_within(self, farthest: float) -> Records:
        """The task, with the motion of what it leaves open limited to `farthest` [L or rad]."""
        task = self.task.copy()
        task["farthest"] = farthest
        return task


def _dead_point(form: LegForm) -> tuple[str, str]:
    """The proximal joint of a leg, or its first one, and the bound: a rod on a vertical slide is level there."""
    proximal = form.proximal if isinstance(form, Rod) else None
    if proximal is None:
        return _first_joint(form), "stretched"
    is_upright = proximal.kind == "P" and area(proximal.axis, Vector((0.0, 0.0, 1.0))) <= TOLERANCES.implied
    return proximal.joint.name, "level" if is_upright else "stretched"


def _first_joint(form: LegForm) -> str:
    return form.elements[0].joint.name if form.elements else ""


def leg_table(mechanism: Mechanism, numbers: Sequence[Any] = ()) -> LegTable:
    """A mechanism's table of legs.

    Parameters
    ----------
    numbers : those of its home and its limits, as of `HomeNumbers`, if they note their steps.

    Raises
    ------
    NoLeg : some chain is no leg in closed form; the text says why.
    """
    home = HomeNumbers(mechanism, numbers)
    forms = _forms(home)
    recorded_legs = leg_records(home, forms)
    legs = recorded_legs.records
    coordinates = [
        (leg, element, place) for leg, form in enumerate(forms) for element, place in closed_form_coordinates(form)
    ]
    _require_all(mechanism, {(element.joint.name, element.place) for _, element, _ in coordinates})
    known = FilledRecords.of([_coordinate(home, *coordinate) for coordinate in coordinates], K.COORDINATE)
    joints = [element.joint for _, element, _ in coordinates]
    limited = known.chosen([joint.range is not None for joint in joints])
    drives = {drive.column: number for number, drive in enumerate(mechanism.drives)}
    driven = known.chosen([column in drives for column in known.records["column"].tolist()])
    driven.records["column"] = [drives[column] for column in driven.records["column"].tolist()]
    cone_joints = [joint for joint in mechanism.joints if joint.cone is not None]
    by_leg = sorted(((_cone(home, forms, joint), joint) for joint in cone_joints), key=lambda each: each[0]["leg"])
    cones = FilledRecords.of([fields for fields, _ in by_leg], K.CONE)
    half_angles = cones.records["half_angle"]
    cones.records["leader"] = np.argmax(half_angles == half_angles[:, None], axis=1) if len(half_angles) else 0
    limits = [(joint.name, bound) for joint in joints if joint.range is not None for bound in ("min", "max")]
    limits += [(joint.name, "cone") for _, joint in by_leg]
    parts = {
        "legs": recorded_legs._replace(records=_aimed(legs, np.concatenate([limited.records, driven.records]))),
        "aimed": recorded_legs._replace(records=_aimed(legs, known.records)),
        "limited": limited,
        "cones": cones,
        "driven": driven,
        "known": known,
        "task": _task(home, legs),
    }
    arrays = {name: part.records for name, part in parts.items()}
    fields = {name: part.fields for name, part in parts.items()}
    return LegTable(tuple(forms), **arrays, limits=tuple(limits), fields=fields)


def _forms(home: HomeNumbers) -> list[LegForm]:
    """The legs of all sub-chains."""
    forms: list[LegForm] = []
    for chain in sub_chains(home):
        if chain.reason == NO_PATH:
            raise NoLeg(f"sub-chain {_name_of(chain)} {NO_PATH}")
        try:
            forms += legs_of_sub_chain(home, chain)
        except NoLeg as reason:
            raise NoLeg(f"sub-chain {_name_of(chain)}: {reason}") from None
    return forms


def _name_of(chain: SubChain) -> str:
    """A sub-chain in the field's notation; a long one by its ends."""
    joints = chain.joints
    return str(chain) if len(joints) <= MOST_WRITTEN else f"of {len(joints)} joints, {joints[0]} to {joints[-1]}"


def _aimed(legs: Records, coordinates: Records) -> Records:
    """Legs set to compute the angles of rods' endings that have one of the coordinates too."""
    legs = legs.copy()
    coordinates = coordinates[legs["kind"][coordinates["leg"]] == K.ROD]
    for end, start in (("base_end", K.BASE_END), ("platform_end", K.PLATFORM_END)):
        is_at_end = (coordinates["place"] >= start) & (coordinates["place"] < start + 3)
        legs[f"{end}_aimed"][coordinates["leg"][is_at_end]] = 1
    return legs


def _require_all(mechanism: Mechanism, available: set[tuple[str, int]]) -> None:
    """Raise unless legs have closed forms for every coordinate with a range or a motor."""
    for coordinate in mechanism.coordinates:
        joint = coordinate.joint
        limited = joint.range is not None and not joint.is_rigid
        if (limited or coordinate.place in joint.driven) and (joint.name, coordinate.place) not in available:
            raise NoLeg(f"joint {joint.name} has a motor or a limit that no closed form gives")


def _coordinate(home: HomeNumbers, leg: int, element: ElementaryJoint, place: int) -> Fields:
    """Fields of a `COORDINATE`, its column that among all joint coordinates."""
    key = element.joint.name, element.place
    coordinate = next(c for c in home.mechanism.coordinates if (c.joint.name, c.place) == key)
    unit = 1.0 if coordinate.kind == "angle" else home.length
    lo, hi = deviations(home.bounds(coordinate), home.coordinate(coordinate), unit)
    return {
        "leg": leg,
        "place": place,
        "column": coordinate.column,
        "turns": coordinate.joint.type in ("revolute", "cylindrical") and coordinate.kind == "angle",
        "sense": element.sense,
        "lo": lo,
        "hi": hi,
        "home": home.coordinate(coordinate),
        "unit": unit,
    }


def _cone(home: HomeNumbers, forms: Sequence[LegForm], joint: Joint) -> dict[str, Any]:
    """Fields of a `CONE`: at an end of a rod, about its line, fixed to the body that the end is on."""
    reason = f"the cone of joint {joint.name} does not limit a rod's line against what its end is on"
    assert joint.cone is not None
    start, end = cone_line(home.mechanism, joint)
    for leg, form in enumerate(forms):
        if not isinstance(form, Rod):
            continue
        for place, ending, at_platform_end in (
            (K.BASE_LINE, form.base_ending, False),
            (K.PLATFORM_LINE, form.platform_ending, True),
        ):
            elements_here = [element for element in ending.elements if element.joint is joint]
            if not elements_here:
                continue
            body = elements_here[-1].outward if at_platform_end else elements_here[0].inward
            ends = home.point(start), home.point(end)
            line = form.platform_end - form.base_end
            distance = largest(area(point - form.base_end, line) for point in ends)
            is_outermost = (
                elements_here[-1] is ending.elements[-1] if at_platform_end else elements_here[0] is ending.elements[0]
            )
            other_joints = {element.joint.name for element in form.elements} - {joint.name}
            if (
                joint.cone.fixed_to != body
                or distance > TOLERANCES.implied
                or not is_outermost
                or end.name not in other_joints
            ):
                raise NoLeg(reason)
            axis, half_angle = home.cone(joint)
            return {
                "leg": leg,
                "place": place,
                "axis": axis * sign((ends[1] - ends[0]) @ line),
                "half_angle": half_angle,
                "least_cosine": math.cos(joint.cone.half_angle + TOLERANCES.limit),
            }
    raise NoLeg(reason)


def _task(home: HomeNumbers, legs: Records) -> FilledRecords:
    mechanism, description = home.mechanism, task_of(home.mechanism)
    recorded: Fields = {"length": home.length, "reference": home.reference_point}
    on_platform = [joint for joint in mechanism.joints if mechanism.end_effector in joint.connects]
    centres = [home.centre(joint) for joint in on_platform if joint.at is not None]
    if centres:
        recorded["centre"] = reduce(add, centres) / len(centres) / home.length - home.reference_point
    recorded_task = FilledRecords.of([recorded], K.TASK)
    task = recorded_task.records
    task["axes"], task["rotations"] = description.axes, description.rotations
    task["unset"] = 0 if mechanism.end_effector_is_joint else 6 - sum(description.axes) - description.rotations
    if mechanism.end_effector_is_joint:  # it has no orientation: home's
        task["rotations"] = 0
    task["rows"], task["farthest"] = legs["n_rows"].sum(), COMPLETED_WITHIN
    redundant = legs[(legs["makes"] > 0) & (legs["mirror_of"] < 0)]
    task["redundant"] = len(redundant) if redundant["has_rows"].any() else 0
    task["implicit"] = bool((redundant["has_rows"] & redundant["implicit"]).any())
    return recorded_task
