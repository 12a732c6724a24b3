"""A mechanism whose every chain is a leg, as the table that the kernels of legs are given."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ..arrays import Floats, Records
from ..description.graph import cone_line
from ..description.joints import Joint
from ..description.mechanism import Mechanism
from ..description.task import task_of
from ..kernels.legs import records as K
from ..tolerances import TOLERANCES
from .decompose import decompose
from .items import Item, NoLeg
from .leg_forms import LegForm, RedundantJoint, Rod, told_places
from .leg_records import leg_records, row_counts
from .stations import legs_of_sub_chain

NO_WAY = "does not lead to the end effector"
"""The reason of a sub-chain beside every way to the end effector."""

COMPLETED_WITHIN = 2.0
"""How far what a task leaves open may go from where it began [L or rad]: farther off there may be other completions."""


@dataclass(frozen=True, eq=False)
class LegTable:
    """Legs as records, in the layout of `kernels.legs.records`.

    Attributes
    ----------
    forms : what each record is.
    limited : every coordinate that has a range.
    driven : every actuator; its column is that of its value.
    known : every coordinate that legs tell; its column is that among all joint coordinates.
    aimed : the legs with the angles of all endings asked for, to be read with `known`.
    task : one record.
    limits : (joint, bound) of the limits, those of `limited` (two each), then those of `cones`.
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

    @cached_property
    def home_sides(self) -> Floats:
        """Which of two solutions each leg takes at home, and where arms without are, (1, legs)."""
        return np.array(self.legs["side"], dtype=float)[None]

    @cached_property
    def redundant(self) -> Records:
        """The coordinates of arms; their columns count them."""
        redundant: Records = self.known[self.legs["kind"][self.known["leg"]] == K.REDUNDANT]
        redundant["column"] = np.arange(len(redundant))
        return redundant

    @property
    def redundant_joints(self) -> tuple[str, ...]:
        """Names of the joints that are arms."""
        return tuple(
            form.item.joint.name for form in self.forms if isinstance(form, RedundantJoint) and form.mirror_of is None
        )

    @cached_property
    def implicit_joints(self) -> Records:
        """The coordinates of those arms that stand in the place of a side."""
        return np.asarray(self.redundant[self.legs["orients"][self.redundant["leg"]] == 0])

    @cached_property
    def has_free_redundant(self) -> bool:
        """Whether poses leave arms open; else they follow by what the legs on them ask for."""
        return len(self.redundant) > 0 and not self.task["redundant"][0]

    @cached_property
    def has_sides(self) -> bool:
        """Whether some legs have two solutions."""
        return bool(self.home_sides.any())

    @cached_property
    def is_partial(self) -> bool:
        """Whether the task leaves some of the pose open."""
        return bool(self.task["unset"][0] > 0)

    @cached_property
    def is_completed(self) -> bool:
        """Whether some of the pose, or of the arms, follows from where it was."""
        return self.is_partial or self.has_implicit_joints

    @cached_property
    def has_implicit_joints(self) -> bool:
        """Whether some arms follow from where they were."""
        return bool(self.task["implicit"][0])

    @cached_property
    def leaves_open(self) -> bool:
        """Whether task and legs do not tell all of a pose, or arms are led."""
        return self.has_implicit_joints or bool((self.task["unset"] + self.task["redundant"] > self.task["rows"])[0])

    @cached_property
    def is_for_blocks(self) -> bool:
        """Whether blocks of poses serve: rods read from the base, of which no angle of crossed hinges is asked for."""
        legs = self.legs
        aimed = [(legs[f"{end}_aimed"] == 0) | (legs[end] == K.HINGE) for end in ("base_end", "platform_end")]
        twists = (legs["twists"] == 0) | ((legs["base_end"] == K.HINGE) & (legs["platform_end"] == K.HINGE))
        rods = (legs["kind"] == K.ROD) & (legs["frame"] == 0)
        return bool(np.all([rods, twists, *aimed]) and self.task["rotations"][0] in (0, 3))

    def task_within(self, farthest: float) -> Records:
        """The task, with what it leaves open going no farther than that [L or rad]."""
        task = self.task.copy()
        task["farthest"] = farthest
        return task


@lru_cache(maxsize=64)
def leg_table(mechanism: Mechanism) -> LegTable | str:
    """A mechanism's table of legs, or the reason why it has none."""
    try:
        return _table(mechanism)
    except NoLeg as reason:
        return str(reason)


def table_of_poses(mechanism: Mechanism) -> LegTable | str:
    """A mechanism's table of legs if a pose leaves none of their limits open, or the reason why it has none."""
    table = leg_table(mechanism)
    if isinstance(table, str) or not table.has_free_redundant:
        return table
    return f"poses leave joints {', '.join(table.redundant_joints)} open"


def legs_answer(mechanism: Mechanism) -> bool:
    """Whether legs in closed form answer first."""
    return isinstance(leg_table(mechanism), LegTable)


def _table(mechanism: Mechanism) -> LegTable:
    forms = _forms(mechanism)
    legs = leg_records(mechanism, forms)
    told = [(leg, item, place) for leg, form in enumerate(forms) for item, place in told_places(form)]
    _require_all(mechanism, {(item.joint.name, item.place) for _, item, _ in told})
    known = np.array([_coordinate(mechanism, *each) for each in told], K.COORDINATE)
    joints = [item.joint for _, item, _ in told]
    limited = known[[joint.range is not None for joint in joints]]
    drives = {drive.column: number for number, drive in enumerate(mechanism.drives)}
    driven = known[[column in drives for column in known["column"].tolist()]]
    driven["column"] = [drives[column] for column in driven["column"].tolist()]
    coned = [joint for joint in mechanism.joints if joint.cone is not None]
    cones = np.array([_cone(mechanism, forms, joint) for joint in coned], K.CONE)
    by_leg = np.argsort(cones["leg"], kind="stable")
    cones, coned = cones[by_leg], [coned[place] for place in by_leg]
    cones["leader"] = np.argmax(cones["half_angle"] == cones["half_angle"][:, None], axis=1) if len(cones) else 0
    aimed = _aimed(legs, known)
    limits = [(joint.name, bound) for joint in joints if joint.range is not None for bound in ("min", "max")]
    limits += [(joint.name, "cone") for joint in coned]
    task = _task(mechanism, legs)
    legs = _aimed(legs, np.concatenate([limited, driven]))
    return LegTable(tuple(forms), legs, aimed, limited, cones, driven, known, task, tuple(limits))


def _forms(mechanism: Mechanism) -> list[LegForm]:
    """The legs of all sub-chains."""
    forms: list[LegForm] = []
    for chain in decompose(mechanism):
        if chain.reason == NO_WAY:
            raise NoLeg(f"sub-chain {chain} {NO_WAY}")
        try:
            forms += legs_of_sub_chain(mechanism, chain)
        except NoLeg as reason:
            raise NoLeg(f"sub-chain {chain}: {reason}") from None
    return forms


def _aimed(legs: Records, asked: Records) -> Records:
    """Legs with the angles of those endings asked for that coordinates are among, or that keep a rod from spinning.

    And of two crossed hinges that cannot point the rod anywhere, for they are not square to each other, or it to them:
    only their angles tell whether there are any.
    """
    legs = legs.copy()
    for end, start in (("base_end", K.BASE_END), ("platform_end", K.PLATFORM_END)):
        outer, inner = legs[f"{end}_axes"][:, 0], legs[f"{end}_axes"][:, 1]
        along = np.maximum(np.abs((inner * outer).sum(axis=1)), np.abs((inner * legs["line"]).sum(axis=1)))
        wanted = ((legs["twists"] == 1) | (along > TOLERANCES.alignment)) & (legs[end] == K.CROSS)
        wanted[asked["leg"][(asked["place"] >= start) & (asked["place"] < start + 3)]] = True
        legs[f"{end}_aimed"] = wanted & (legs["kind"] == K.ROD)
    return legs


def _require_all(mechanism: Mechanism, seen: set[tuple[str, int]]) -> None:
    """Every range and every motor is one that legs tell."""
    for each in mechanism.coordinates:
        joint = each.joint
        limited = joint.range is not None and not joint.is_rigid
        if (limited or each.place in joint.driven) and (joint.name, each.place) not in seen:
            raise NoLeg(f"joint {joint.name} has a motor or a limit that no closed form tells")


def _coordinate(mechanism: Mechanism, leg: int, item: Item, place: int) -> tuple[float, ...]:
    """A record of `COORDINATE`, its column that among all joint coordinates."""
    key = item.joint.name, item.place
    own = next(each for each in mechanism.coordinates if (each.joint.name, each.place) == key)
    unit = 1.0 if own.kind == "angle" else mechanism.characteristic_length
    return (
        leg,
        place,
        own.column,
        int(own.joint.type in ("revolute", "cylindrical") and own.kind == "angle"),
        item.sense,
        *own.room(unit),
        own.home,
        unit,
    )


def _cone(mechanism: Mechanism, forms: Sequence[LegForm], joint: Joint) -> tuple[object, ...]:
    """A record of `CONE`: a cone at an end of a rod, fixed to the body which that end is on, about the rod's line."""
    reason = f"the cone of joint {joint.name} does not limit a rod's line against what its end is on"
    assert joint.cone is not None
    start, end = cone_line(mechanism, joint)
    length = mechanism.characteristic_length
    for leg, form in enumerate(forms):
        if not isinstance(form, Rod):
            continue
        for place, ending, outer in (
            (K.BASE_LINE, form.base_ending, False),
            (K.PLATFORM_LINE, form.platform_ending, True),
        ):
            own = [item for item in ending.items if item.joint is joint]
            if not own:
                continue
            body = own[-1].outward if outer else own[0].inward
            ends = np.array([start.at, end.at]) / length
            line = form.platform_end - form.base_end
            off = [np.linalg.norm(np.cross(point - form.base_end, line)) for point in ends]
            is_last = own[-1] is ending.items[-1] if outer else own[0] is ending.items[0]
            others = {item.joint.name for item in form.items} - {joint.name}
            if joint.cone.fixed_to != body or max(off) > TOLERANCES.implied or not is_last or end.name not in others:
                raise NoLeg(reason)
            sense = math.copysign(1.0, (ends[1] - ends[0]) @ line)
            half_angle = joint.cone.half_angle
            least = math.cos(half_angle + TOLERANCES.limit)
            return leg, place, tuple(sense * np.array(joint.cone.axis)), half_angle, least, 0
    raise NoLeg(reason)


def _task(mechanism: Mechanism, legs: Records) -> Records:
    task, asked = np.zeros(1, K.TASK), task_of(mechanism)
    task["length"] = mechanism.characteristic_length
    task["reference"] = np.asarray(mechanism.reference_point) / mechanism.characteristic_length
    points = mechanism.platform_points
    if len(points):
        task["centre"] = points.mean(axis=0) / mechanism.characteristic_length - task["reference"]
    task["axes"], task["rotations"] = asked.axes, asked.rotations
    task["unset"] = 0 if mechanism.end_effector_is_joint else 6 - sum(asked.axes) - asked.rotations
    if mechanism.end_effector_is_joint:  # it has no orientation: home's
        task["rotations"] = 0
    task["rows"], task["farthest"] = sum(row_counts(legs)), COMPLETED_WITHIN
    redundant = legs[(legs["kind"] == K.REDUNDANT) & (legs["mirror_of"] < 0)]
    task["redundant"] = len(redundant) if redundant["has_rows"].any() else 0
    task["implicit"] = bool((redundant["has_rows"] & (redundant["orients"] == 0)).any())
    return task
