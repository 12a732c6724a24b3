"""Answers compared with those of MuJoCo: on our own export, and on the file that a mechanism was imported from."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...common.checks import require_count
from ...common.printed import Printed, ResultTable, error_text
from ...errors import counted
from ...machine.description.joint_coordinates import JointCoordinate
from ...machine.description.mechanism import Mechanism, checked_mechanism
from ...machine.files.units import metres_of
from ...tolerances import TOLERANCES
from .original import Original, OriginalFile
from .referee import Travelled, on_export, reached_at_random, travelled

FAR = 0.25
"""Share of its range, or of what was tried, that some actuator must have gone through: poses nearer to home than that
hold for machines that do not move at all."""

TOO_NEAR = (
    "too near to home to say anything: farther targets were not reached, and no actuator went through "
    f"{100.0 * FAR:.0f} % of its range; see `pfabrik check` for what may hold the machine"
)

NUMBERS = ("poses", "loop_gap", "position_difference", "rotation_difference", "tolerance")


@dataclass(frozen=True)
class AgainstOriginal:
    """The comparison with the file that a mechanism was imported from: the largest differences over all poses.

    Attributes
    ----------
    loop_gap : float
        How far the file's own loops stay open, by rounding [length; angles as they are].
    position_difference, rotation_difference : float
        Difference between our pose and the file's, with the actuated joints where we have them; or, where it is
        larger, of joints of a description from where a second reader has them [length], [rad].
    position_tolerance, rotation_tolerance : float
        How far what import changes within the digits of the file puts poses off [length], [rad], as found by importing
        it again, up to what digits explain; and rounding.
    """

    loop_gap: float
    position_difference: float
    rotation_difference: float
    position_tolerance: float
    rotation_tolerance: float

    def __bool__(self) -> bool:
        """True if its loops close, and poses agree, as exactly as those of the file imported again."""
        apart = max(self.loop_gap, self.position_difference)
        return apart <= self.position_tolerance and self.rotation_difference <= self.rotation_tolerance


@dataclass(frozen=True)
class Verification(Printed):
    """The comparison with MuJoCo: the largest differences over all poses, lengths in the mechanism's unit.

    Attributes
    ----------
    mechanism : Mechanism
        The machine whose answers they are.
    poses : int
        Number of configurations that were compared, of as many different targets.
    loop_gap : float
        How far MuJoCo finds our answers open, by its own constraint rows [length; angles times L].
    position_difference, rotation_difference : float
        Difference between our pose and the one in which MuJoCo closes the loops by itself, with the actuated joints
        where we have them [length], [rad].
    tolerance : float
        What counts as agreement [length].
    travelled : Travelled
        How far the poses went from home.
    original : AgainstOriginal or None
        The comparison with the original file; None where none was given, or there were no poses.
    """

    mechanism: Mechanism
    poses: int
    loop_gap: float
    position_difference: float
    rotation_difference: float
    tolerance: float
    travelled: Travelled
    original: AgainstOriginal | None = None

    @property
    def agrees(self) -> bool:
        """True if MuJoCo agrees with us on every pose, on our export and on the original."""
        apart = max(self.loop_gap, self.position_difference)
        is_close = apart <= self.tolerance and self.rotation_difference <= TOLERANCES.rotation
        return self.poses > 0 and is_close and (self.original is None or bool(self.original))

    @property
    def goes_far(self) -> bool:
        """True if the poses are far enough from home to say something of the machine."""
        return max(self.travelled.shares.values(), default=0.0) >= FAR

    def __bool__(self) -> bool:
        """True if there were poses that go far, and the two agree on all."""
        return self.agrees and self.goes_far

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and dicts, ready for JSON; None where a number is not known."""
        numbers = {name: getattr(self, name) for name in NUMBERS}
        return {
            "agree": self.agrees,
            "far": self.goes_far,
            **{name: value if value == value else None for name, value in numbers.items()},
            "travelled": self.travelled._asdict(),
            "original": None if self.original is None else asdict(self.original),
        }

    def table(self) -> ResultTable:
        """The largest differences, those from the original file, and how far the poses went."""
        name, unit, size = self.mechanism.name, self.mechanism.length_unit, self.mechanism.characteristic_length
        if not self.poses:
            return ResultTable(name, [f"{name}: no pose was reached"])

        def length(value: float, of: float | None = None) -> str:
            return f"{error_text(value, '.1e', size)} {unit}" + ("" if of is None else f", of {of:.1e}")

        def angle(value: float, of: float | None = None) -> str:
            return f"{error_text(value, '.1e')} rad" + ("" if of is None else f", of {of:.1e}")

        rows = [
            ("largest loop gap", length(self.loop_gap)),
            ("largest position difference", length(self.position_difference)),
            ("largest rotation difference", angle(self.rotation_difference)),
        ]
        if (file := self.original) is not None:
            rows += [
                ("original file", "agrees" if file else "does not agree"),
                ("its own loops, open by", length(file.loop_gap, file.position_tolerance)),
                ("position difference from it", length(file.position_difference, file.position_tolerance)),
                ("rotation difference from it", angle(file.rotation_difference, file.rotation_tolerance)),
            ]
        went, drives = self.travelled, self.mechanism.drives
        shift = f"{went.position / size:.2g} L ({went.position:.3g} {unit})"
        rows += [
            ("actuators went through", ", ".join(_span(drive, went.drives[drive.name], unit) for drive in drives)),
            ("end effector went up to", f"{shift}, {math.degrees(went.rotation):.2g} deg"),
        ]
        agrees = "agrees" if self.agrees else "does not agree"
        lines = [f"{name}: {agrees} with MuJoCo on {counted(self.poses, 'pose')}"]
        lines += [f"{label:<29}{text}" for label, text in rows]
        return ResultTable(name, lines if self.goes_far else [*lines, TOO_NEAR])


def _span(drive: JointCoordinate, value: float, unit: str) -> str:
    """The travel of an actuator, with its share of the range if there is one."""
    shown = f"{math.degrees(value):.3g} deg" if drive.kind == "angle" else f"{value:.3g} {unit}"
    width = drive.limits[1] - drive.limits[0]
    return f"{drive.name} {shown}" + (f" ({100.0 * value / width:.0f} %)" if math.isfinite(width) else "")


def verify(
    mechanism: Mechanism,
    *,
    poses: int = 100,
    seed: int = 0,
    original: str | os.PathLike[str] | None = None,
    loops: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    configuration: str = "qpos0",
) -> Verification:
    """Compare answers with MuJoCo's, over random targets that are reached.

    The mechanism is written as a MuJoCo model. At each answer MuJoCo's constraint rows say how far the loops are open;
    then the passive joints are moved off, and Newton's method on these rows closes the loops again, with the actuated
    joints held: that must lead to the same pose. An original closes its own loops, from its joints put there by name.
    MuJoCo reads an original that is its own itself; of a URDF, MuJoCo's reading of it says where joints are, and of an
    SDF a reader that shares nothing with the importer's. A file of loops is read once.

    Parameters
    ----------
    mechanism : Mechanism
        The machine.
    poses : int, optional
        Number of targets.
    seed : int, optional
        Seed of the random targets.
    original : str or PathLike, optional
        The path of the MuJoCo model or robot description (URDF) that the mechanism was imported from.
    loops : str or PathLike or mapping, optional
        Loops that the original was imported with, as in `from_urdf`.
    configuration : str, optional
        Configuration that the original was imported with, as in `from_mjcf`.

    Raises
    ------
    MissingLibrary
        MuJoCo is not installed.
    InvalidArgument
        Less than one pose.
    UnknownName
        An actuator, a joint or the end effector, where the original does not have it.
    """
    checked_mechanism(mechanism)
    poses, rng = require_count("poses", poses), np.random.default_rng(require_count("seed", seed, 0, 2**63 - 1))
    metres, size = metres_of(mechanism.length_unit), mechanism.characteristic_length
    file = None if original is None else OriginalFile(original, loops, configuration)
    robot = None if file is None else Original(mechanism, file)
    solutions = reached_at_random(mechanism, poses, rng)
    tolerance = TOLERANCES.position * size
    if not solutions:
        return Verification(mechanism, 0, np.nan, np.nan, np.nan, tolerance, Travelled({}, {}, 0.0, 0.0))
    units, against = np.array([metres, metres, 1.0]), None
    gap, position, rotation = (on_export(mechanism, solutions, rng) / units).tolist()
    if robot is not None and file is not None:
        largest = np.max([robot.compare(each) for each in solutions], axis=0)
        misread = file.misread(mechanism.actuator_names)
        open_by, apart, turned = (np.maximum(largest, [0.0, *misread]) / units).tolist()
        explained = TOLERANCES.file_digits * np.array([size, size, 1.0])
        changed = np.minimum(robot.changes_of_import(file, solutions) / units, explained)
        nearest = float(max(changed[:2])) + tolerance
        against = AgainstOriginal(open_by, apart, turned, nearest, float(changed[2]) + TOLERANCES.rotation)
    went = travelled(mechanism, solutions)
    return Verification(mechanism, len(solutions), gap, position, rotation, tolerance, went, against)
