"""What an exported file says of a machine: its legs, in the mechanism's unit of length, and what is asked of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Floats, Record
from ..decomposition.leg_forms import RedundantJoint, Rod
from ..decomposition.leg_records import row_counts
from ..decomposition.leg_table import LegTable, table_of_poses
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..kernels.legs import records as K
from ..motion.mobility import generic_of
from ..rotations import square_to

Number = float | Floats


class Coordinate(NamedTuple):
    """A coordinate of a leg, and what is said of its deviation from home.

    Attributes
    ----------
    place : in the leg's values.
    turns : whether it is an angle that counts into its range by whole turns.
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
        """Whether it may turn more than once."""
        return self.turns and self.hi - self.lo > 2.0 * np.pi


class ExportedLeg(NamedTuple):
    """A leg as it is written.

    Attributes
    ----------
    main : the leg whose carrier it is on; its own place if it shares none.
    record : as in `LegTable.legs`; lengths in L.
    numbers : constants by the name of their field in C, in the mechanism's unit.
    """

    main: int
    record: Record
    numbers: dict[str, Number]
    joints: tuple[str, ...]

    @property
    def keeps_its_length(self) -> bool:
        """Whether it is a rigid rod on a carrier of its own: it has an equation for its length where that is held."""
        has_proximal = self.record["kind"] == K.ROD and self.record["proximal"] in (K.CRANK, K.CARRIAGE)
        return bool(has_proximal and not self.record["slides"])


class Machine:
    """A mechanism whose every chain is a leg, as it is exported.

    Attributes
    ----------
    limited, driven : coordinates with a range, and those of the actuators in their order.
    cones : records, as in `LegTable`.
    limits : (joint, bound) of every limit: two of each range, then cones.
    axes, rotations, unset : what the task sets, and how many coordinates of a pose it leaves open; see `K.TASK`.
    n_arms, leads_arms : how many coordinates arms have; whether some follow from where they were.
    equations : how many the legs have.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        table = table_of_poses(mechanism)
        if not isinstance(table, LegTable):
            raise UnsupportedMechanism(mechanism.name, [f"no legs in closed form, {table}"], "exported")
        self.mechanism, self.limits, self.cones = mechanism, table.limits, table.cones
        task = table.task[0]
        self.axes, self.rotations, self.unset = task["axes"].tolist(), int(task["rotations"]), int(task["unset"])
        self.n_arms, self.has_implicit_joints = len(table.redundant), table.has_implicit_joints
        if self.has_implicit_joints and generic_of(mechanism).home_is_singular:
            reason = (
                f"its loops are singular at home, where joints {', '.join(table.redundant_joints)} follow from no pose"
            )
            raise UnsupportedMechanism(mechanism.name, [reason], "exported")
        self.legs = _legs(mechanism, table)
        ordered = table.driven[np.argsort(table.driven["column"])]
        self.limited = [_coordinate(each, mechanism.coordinates[each["column"]].kind) for each in table.limited]
        self.driven = [_coordinate(each, mechanism.drives[each["column"]].kind) for each in ordered]
        self.equations = sum(row_counts(table.legs)) + sum(leg.keeps_its_length for leg in self.legs)

    @property
    def completes(self) -> bool:
        """Whether more follows from a target than the coordinates of its legs."""
        return self.unset > 0 or self.has_implicit_joints

    @property
    def n_frames(self) -> int:
        """How many frames legs are read in, see `kernels.legs.frames`."""
        return max(K.FROM_ITSELF, *(int(leg.record["makes"]) + 1 for leg in self.legs))

    @property
    def drive_equations(self) -> int:
        """How many equations there are more where actuators are given: of all but what carries rods."""
        return sum(each.place != K.Q_PROXIMAL for each in self.driven)

    @property
    def uncontrolled(self) -> int:
        """Freedoms of the end effector that its actuators leave."""
        return generic_of(self.mechanism).mobility.uncontrolled

    def apart(self, actuators: Floats, others: Floats) -> Floats:
        """How far actuators are at most from others (n, n_a) each, but for whole turns, (n,) [L or rad]."""
        off, size = actuators - others, self.mechanism.characteristic_length
        turned = np.remainder(off + np.pi, 2.0 * np.pi) - np.pi
        off = np.where([each.is_length for each in self.driven], off / size, turned)
        return np.asarray(np.abs(off).max(axis=1))


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
    main, length = 0, mechanism.characteristic_length
    for place, (form, record) in enumerate(zip(table.forms, table.legs, strict=True)):
        main = main if record["proximal"] == K.SHARED else place
        if isinstance(form, Rod):
            numbers = _rod_numbers(form, record, length)
        else:
            numbers = (_arm_numbers if isinstance(form, RedundantJoint) else _pivot_numbers)(record, length)
        legs.append(ExportedLeg(main, record, numbers, tuple(dict.fromkeys(item.joint.name for item in form.items))))
    return legs


def _rod_numbers(rod: Rod, record: Record, length: float) -> dict[str, Number]:
    """What is to be reached at home counts from a crank's axis, or from the foot on a carriage."""
    numbers: dict[str, Number] = {
        "base_end": record["base_end_point"] * length,
        "platform_end": record["platform_end_point"] * length,
    }
    numbers |= {name: record[name] for name in ("line", "base_end_side", "platform_end_side", "twist")}
    numbers |= {
        f"{end}_axes": record[f"{end}_axes"]
        for end in ("base_end", "platform_end")
        if record[end] in (K.HINGE, K.CROSS)
    }
    numbers["length"] = record["length"] * length
    if rod.proximal is not None:
        begin = record["proximal_point"] if record["proximal"] == K.CRANK else rod.base_end
        numbers |= {
            "axis": record["proximal_axis"],
            "side": record["side"],
            "reach": (rod.platform_end - begin) * length,
        }
        fields = {"centre": "proximal_point", "crank": "crank", "across": "crank_across"}
        numbers |= {name: record[field] * length for name, field in fields.items()}
    return numbers


def _arm_numbers(record: Record, length: float) -> dict[str, Number]:
    return {"axis": record["proximal_axis"], "centre": record["proximal_point"] * length, "side": record["side"]}


def _pivot_numbers(record: Record, length: float) -> dict[str, Number]:
    slides, last = int(record["slides"]), {K.CROSS: 1, K.TRIPLE: 2}.get(int(record["base_end"]))
    return {
        "base_end": record["base_end_point"] * length,
        "platform_end": record["platform_end_point"] * length,
        "base_end_axes": record["base_end_axes"],
        "side": record["side"],
        "rows": np.concatenate([record["slide_rows"][:slides], record["fixed_rows"][: 3 - slides]]),
        "kept": record["kept"],
        "moved": record["moved"],
        "square": np.zeros(3) if last is None else square_to(record["base_end_axes"][last])[0],
    }
