"""What an exported file says of a machine: its legs, what their coordinates are in C, and what is asked of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..decomposition.leg_table import LegTable, table_of_poses
from ..description.mechanism import Mechanism
from ..description.task import Task, task_of
from ..errors import UnsupportedMechanism
from ..kernels.legs import records as K
from ..motion.mobility import generic_of
from ..tolerances import TOLERANCES
from .equations import Drive, Unit, drive_unit, units
from .legs import LegCode, PivotShape, RodShape, leg_codes
from .placing import Needs


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of a leg as it stands in C.

    Attributes
    ----------
    value : C expression of the deviation from home.
    lo, hi : of the deviation [length or rad].
    home : [length or rad].
    """

    leg: int
    drive: Drive
    value: str
    sense: float
    turns: bool
    lo: float
    hi: float
    home: float
    unit: Unit

    @property
    def may_turn(self) -> bool:
        """Whether it may turn more than once."""
        return self.turns and self.hi - self.lo > 2.0 * math.pi


@dataclass(frozen=True)
class Row:
    """An equation: the leg it is of, and what it is measured in."""

    leg: int
    unit: Unit


class Machine:
    """A mechanism whose every chain is a leg, as it is exported.

    Attributes
    ----------
    codes : its legs.
    letters : of each shape of leg, how its functions are called.
    limited, driven : coordinates with a range, and those of the actuators in their order.
    limits : (joint, bound) of every limit: two of each range, then cones.
    rows, drive_rows : the legs' equations, and those that driven coordinates add in forward kinematics.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        table = table_of_poses(mechanism)
        if not isinstance(table, LegTable):
            raise UnsupportedMechanism(mechanism.name, [f"no legs in closed form, {table}"], "exported")
        if len(table.arms):
            reason = f"other legs are on joints {', '.join(table.arm_joints)}"
            raise UnsupportedMechanism(mechanism.name, [reason], "exported")
        self.mechanism = mechanism
        self.table = table
        self.task: Task = task_of(mechanism)
        if self.task.rotations == 1:
            raise UnsupportedMechanism(mechanism.name, ["its task sets the yaw alone of the rotation"], "exported")
        self.codes = leg_codes(mechanism, table)
        shapes = dict.fromkeys(code.shape for code in self.codes)
        self.letters = {shape: chr(ord("a") + place) for place, shape in enumerate(shapes)}
        self.limited = [self._coordinate(record) for record in table.limited]
        ordered = table.driven[np.argsort(table.driven["column"])]
        self.driven = [self._coordinate(record) for record in ordered]
        self.limits = table.limits
        self.rows = [Row(place, unit) for place, code in enumerate(self.codes) for unit in units(code.shape)]
        self.drive_rows = [
            Row(each.leg, drive_unit(self.codes[each.leg].shape, each.drive))
            for each in self.driven
            if each.drive.what != "carrier"
        ]

    @property
    def unset(self) -> int:
        """How many coordinates of a pose its task leaves open."""
        if self.mechanism.end_effector_is_joint:
            return 0
        return 6 - sum(self.task.axes) - self.task.rotations

    @property
    def rows_at_rest(self) -> list[int]:
        """Places of the equations that a whole pose may break: all but the length of a rod that a carrier is on."""
        found, place = [], 0
        for code in self.codes:
            for own in range(len(units(code.shape))):
                shape = code.shape
                carries = isinstance(shape, RodShape) and bool(shape.carrier) and not shape.is_shared
                if not (own == 0 and carries):
                    found.append(place)
                place += 1
        return found

    @property
    def uncontrolled(self) -> int:
        """Freedoms of the end effector that its actuators leave."""
        return generic_of(self.mechanism).mobility.uncontrolled

    def needs(self, shape: RodShape | PivotShape, forward: bool) -> Needs:
        """What is asked of the legs of a shape."""
        own = {place for place, code in enumerate(self.codes) if code.shape == shape}
        lines = {"foot" if cone["place"] == K.FOOT_LINE else "head" for cone in self.table.cones if cone["leg"] in own}
        asked = {each.drive.what for each in (*self.limited, *self.driven) if each.leg in own}
        angles = {end for end in ("foot", "head") if end in asked}
        if isinstance(shape, RodShape):
            for place in own:
                for end in ("foot", "head"):
                    if getattr(shape, end) == "cross" and (shape.twists or _may_miss(self.codes[place], end)):
                        angles.add(end)
        elif shape.ending == "triple":
            angles.add("foot")
        given = forward and any(each.leg in own and each.drive.what == "carrier" for each in self.driven)
        return Needs(given, frozenset(lines), frozenset(angles))

    def _coordinate(self, record: NDArray[np.void]) -> Coordinate:
        leg, unit = int(record["leg"]), float(record["unit"])
        drive = self._drive(leg, int(record["place"]))
        own = f"leg[{leg}]"
        value = {
            "carrier": f"{own}.carrier",
            "slide": f"({own}.length - pfk_rods[{self.table_place(leg)}].length)",
            "pivot slide": f"{own}.slide[{drive.place}]",
        }.get(drive.what, f"{own}.{drive.what}_angle[{drive.place}]")
        sense, turns = float(record["sense"]), bool(record["turns"])
        lo, hi = float(record["lo"]) * unit, float(record["hi"]) * unit
        signed = value if sense > 0 else f"-{value}"
        is_length = drive.what in ("slide", "pivot slide") or self._is_carriage(leg, drive)
        return Coordinate(
            leg,
            drive,
            _within(signed, lo, hi) if turns else signed,
            sense,
            turns,
            lo,
            hi,
            float(record["home"]),
            "length" if is_length else "angle",
        )

    def _is_carriage(self, leg: int, drive: Drive) -> bool:
        shape = self.codes[leg].shape
        return drive.what == "carrier" and isinstance(shape, RodShape) and shape.carrier == "carriage"

    def _drive(self, leg: int, place: int) -> Drive:
        """What a place in a leg's values is."""
        is_pivot = isinstance(self.codes[leg].shape, PivotShape)
        if place >= K.HEAD:
            return Drive("pivot slide" if is_pivot else "head", place - K.HEAD)
        if place == K.SLIDE:
            return Drive("slide", 0)
        return Drive("foot", place - K.FOOT) if place >= K.FOOT else Drive("carrier", 0)

    def cone_line(self, cone: NDArray[np.void]) -> str:
        """C expression of the direction that a cone limits."""
        return f"leg[{int(cone['leg'])}].{'foot' if cone['place'] == K.FOOT_LINE else 'head'}_line"

    def table_place(self, leg: int) -> int:
        """A leg's place among the rods, or among the pivots."""
        kind = type(self.codes[leg].shape)
        return sum(isinstance(code.shape, kind) for code in self.codes[:leg])


def _may_miss(code: LegCode, end: str) -> bool:
    """Whether there are directions that two crossed hinges cannot point their rod in."""
    outer, inner, _ = np.asarray(code.numbers[f"{end}_axes"])
    line = np.asarray(code.numbers["line"])
    return bool(max(abs(outer @ inner), abs(inner @ line)) > TOLERANCES.alignment)


def _within(value: str, lo: float, hi: float) -> str:
    """An angle counted into its range by whole turns."""
    if hi - lo <= 2.0 * math.pi:
        return f"pfk_wrap({value}, {0.5 * (lo + hi)!r})"
    return f"pfk_wrap_into({value}, {lo!r}, {hi!r})" if math.isfinite(hi - lo) else f"pfk_wrap({value}, 0.0)"
