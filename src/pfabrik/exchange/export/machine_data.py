"""A machine as it is exported: its legs and their coordinates, in the mechanism's unit of length."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...common.arrays import Floats, Record
from ...common.checks import require_names
from ...common.rotations import nearest_turn
from ...engines.joints.parasitic import has_other_assemblies
from ...engines.pose.links_of_legs import keeps_links
from ...errors import UnsupportedMechanism
from ...kernels.legs import records as K
from ...kinematics import JointPath, generic_of, joint_path, model_of, require_determined
from ...machine.decomposition.leg_table import LegTable
from ...machine.description.mechanism import Mechanism
from ...machine.motion.singularities import loop_blocks
from ...machine.moved_bodies import Motion, MovedBodies
from ...options import USUAL
from .exported_links import ExportedLinks, exported_links

PURPOSE = "exported"


def fitting_path(mechanism: Mechanism, joints: str | Sequence[str]) -> JointPath:
    """The path of named joints, which determine the actuators as these determine them.

    Raises
    ------
    UnsupportedMechanism : they do not, or one of them is a ball, which has no coordinates in files.
    UnknownName, InvalidArgument : no such joints, or not in series.
    """
    path = joint_path(mechanism, require_names("joints", [joints] if isinstance(joints, str) else joints))
    if any(motion.kind == "ball" for motion in path.motions):
        reason = f"joints {', '.join(path.names)}: a ball has no coordinates here, name hinges"
        raise UnsupportedMechanism(mechanism.name, [reason], PURPOSE)
    require_determined(mechanism, path.names, path.rates_of, PURPOSE)
    return path


Number = float | Floats


class Coordinate(NamedTuple):
    """A coordinate of a leg, and the range of its deviation from home.

    Attributes
    ----------
    place : in the leg's values.
    turns : it is an angle; whole turns are added to bring it into its range.
    lo, hi : of the deviation [length or rad].
    home : [length or rad].
    """

    leg: int
    place: int
    is_length: bool
    turns: bool
    sense: float
    lo: float
    hi: float
    home: float

    @property
    def may_turn(self) -> bool:
        """True if it may turn more than once."""
        return self.turns and self.hi - self.lo > 2.0 * np.pi


class ExportedLeg(NamedTuple):
    """A leg as it is exported.

    Attributes
    ----------
    main : the leg whose proximal joint it is on; its own place if it shares none.
    record : as in `LegTable.legs`; lengths in L.
    size : L [length].
    """

    main: int
    record: Record
    joints: tuple[str, ...]
    size: float

    def of(self, name: str) -> Floats:
        """A field of the record that is a length or a place, in the mechanism's unit."""
        return np.asarray(self.record[name] * self.size)

    @property
    def is_pivot(self) -> bool:
        """True for a leg without length."""
        return bool(self.record["kind"] == K.PIVOT)

    @property
    def keeps_its_length(self) -> bool:
        """True for a rigid rod on a proximal joint of its own: with this joint held its length is an equation."""
        return bool(self.record["has_proximal"] and not self.record["slides"])


class Machine:
    """A mechanism whose chains are all legs in closed form, as it is exported.

    Attributes
    ----------
    limited, driven : coordinates with a range, and those of the actuators in their order.
    cones : records, as in `LegTable`.
    limits : (joint, bound) of every limit: two of each range, then cones.
    axes, rotations, unset : what the task sets, and the number of pose coordinates that it leaves open, as of `K.TASK`.
    n_redundant, has_implicit_joints : the number of redundant joints, and if some of them are implicit.
    equations : the number of equations of the legs.
    hold_price : as of `Options`.
    equal_rods : names of rods that were made equal to the other of their pair.
    """

    def __init__(
        self, mechanism: Mechanism, hold_price: float = USUAL.hold_price, equal_rods: Sequence[str] = ()
    ) -> None:
        self.hold_price, self.equal_rods = hold_price, equal_rods
        model = model_of(mechanism)
        if model.why_poses_do_not_suffice:
            raise UnsupportedMechanism(mechanism.name, [model.why_poses_do_not_suffice], "exported")
        table = model.legs
        self.mechanism, self.limits, self.cones = mechanism, table.limits, table.cones
        task = table.task[0]
        self.axes, self.rotations, self.unset = task["axes"].tolist(), int(task["rotations"]), int(task["unset"])
        self.n_redundant, self.has_implicit_joints = len(table.redundant), table.has_implicit_joints
        if self.has_implicit_joints and generic_of(mechanism).home_is_singular:
            reason = (
                f"its loops are singular at home, where joints {', '.join(table.redundant_joints)} follow from no pose"
            )
            raise UnsupportedMechanism(mechanism.name, [reason], "exported")
        self.legs = _legs(mechanism, table)
        drives = table.driven[np.argsort(table.driven["column"])]
        self.limited = [_coordinate(record, mechanism.coordinates[record["column"]].kind) for record in table.limited]
        self.driven = [_coordinate(record, mechanism.drives[record["column"]].kind) for record in drives]
        self.equations = int(table.legs["n_rows"].sum()) + sum(leg.keeps_its_length for leg in self.legs)

    @property
    def bounds(self) -> list[tuple[float, bool]]:
        """The value of every limit, and if it is a length [length or rad]."""
        ranges = [(each.home + bound, each.is_length) for each in self.limited for bound in (each.lo, each.hi)]
        return ranges + [(float(cone["half_angle"]), False) for cone in self.cones]

    @cached_property
    def links(self) -> ExportedLinks | None:
        """The links that stay apart; None of a machine without a clearance."""
        return exported_links(self.mechanism, MovedBodies(self.mechanism))

    @cached_property
    def bodies(self) -> MovedBodies:
        """All bodies whose places follow, rods between balls among them."""
        bodies = MovedBodies(self.mechanism)
        bodies.number_all()
        return bodies

    @cached_property
    def _links_on_all(self) -> ExportedLinks | None:
        return exported_links(self.mechanism, self.bodies)

    def links_kept(self, parts: Sequence[str]) -> ExportedLinks | None:
        """The links that the parts of a file keep apart: the clearance is one of its limits."""
        if "limits" not in parts:
            return None
        return self._links_on_all if self.places_bodies(parts) else self.links

    def places_bodies(self, parts: Sequence[str]) -> bool:
        """True if a part needs the places of all bodies."""
        return bool({"bodies", "effort"} & {*parts})

    def motions(self, parts: Sequence[str]) -> list[Motion]:
        """The motions of the bodies that the parts of a file place."""
        links = self.links_kept(parts)
        if self.places_bodies(parts):
            return self.bodies.motions
        return [] if links is None else links.motions

    @property
    def why_no_nearest(self) -> str:
        """The reason why no search in the platform's pose finds the nearest feasible poses; empty if one does."""
        model = model_of(self.mechanism)
        if has_other_assemblies(model.path_closure):
            return "its nearest feasible poses are searched for in all joint coordinates"
        return "" if keeps_links(model) else "its links are kept apart by searches in all joint coordinates alone"

    @property
    def why_no_live(self) -> str:
        """The reason why no ticks along a stream are written; empty if they are."""
        loops = loop_blocks(self.mechanism)
        return self.why_no_nearest or ("ticks in C do not see the dead points of its loops" if loops else "")

    @property
    def completes(self) -> bool:
        """True if a target must be completed: some of the pose, or implicit joints, follow from the legs' equations."""
        return self.unset > 0 or self.has_implicit_joints

    @property
    def uncontrolled(self) -> int:
        """The number of freedoms of the end effector that its actuators leave."""
        return generic_of(self.mechanism).mobility.uncontrolled

    def largest_difference(self, actuators: Floats, others: Floats) -> Floats:
        """The largest difference between two arrays of actuators (n, n_a), modulo whole turns, (n,) [L or rad]."""
        difference, size = actuators - others, self.mechanism.characteristic_length
        is_length = [coordinate.is_length for coordinate in self.driven]
        difference = np.where(is_length, difference / size, nearest_turn(difference))
        return np.asarray(np.abs(difference).max(axis=1))


def _coordinate(record: Record, kind: str) -> Coordinate:
    unit = float(record["unit"])
    return Coordinate(
        leg=int(record["leg"]),
        place=int(record["place"]),
        is_length=kind != "angle",
        turns=bool(record["turns"]),
        sense=float(record["sense"]),
        lo=float(record["lo"]) * unit,
        hi=float(record["hi"]) * unit,
        home=float(record["home"]),
    )


def _legs(mechanism: Mechanism, table: LegTable) -> list[ExportedLeg]:
    legs: list[ExportedLeg] = []
    first, length = 0, mechanism.characteristic_length
    for place, (form, record) in enumerate(zip(table.forms, table.legs, strict=True)):
        first = first if record["proximal"] == K.SHARED else place
        joints = tuple(dict.fromkeys(element.joint.name for element in form.elements))
        legs.append(ExportedLeg(first, record, joints, length))
    return legs
