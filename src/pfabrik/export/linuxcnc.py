"""Settings for LinuxCNC's own kinematics where one fits a machine, else a kinematics module."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..tolerances import TOLERANCES
from .fits import Thigh, Tower, angle_of, struts_of, thighs_of, towers_of
from .linuxcnc_module import module
from .machine_data import Machine
from .wording import comment

TOWERS = (90.0, 210.0, -30.0)
"""Angles of the towers of lineardeltakins [deg]: by its code; its manual page has them reversed."""

THIGHS = (-90.0, 30.0, 150.0)
"""Angles of the thighs of rotarydeltakins [deg]."""


def linuxcnc(mechanism: Mechanism) -> str:
    """HAL lines where one of LinuxCNC's own kinematics fits, else a module with the machine's kinematics.

    Hexapods of struts are genhexkins; deltas whose towers or thighs stand where it has them are lineardeltakins and
    rotarydeltakins. A module is one file of C for halcompile; machines with a clearance have one, because LinuxCNC's
    own kinematics keep none.

    Raises
    ------
    UnsupportedMechanism : no legs in closed form.
    """
    machine, size = Machine(mechanism), mechanism.characteristic_length
    if mechanism.clearance is not None:
        return module(machine)
    struts = struts_of(machine)
    if struts is not None:
        return _genhexkins(mechanism, struts)
    towers = towers_of(machine)
    if towers is not None and _are_towers(towers, size):
        return _lineardeltakins(mechanism, towers)
    thighs = thighs_of(machine)
    if thighs is not None and _are_thighs(thighs, size):
        return _rotarydeltakins(mechanism, thighs)
    return module(machine)


def _are_towers(towers: Sequence[Tower], size: float) -> bool:
    """True if towers are placed as lineardeltakins requires."""
    radii = [math.hypot(*tower.place[:2]) for tower in towers]
    heights = [abs(tower.place[2]) for tower in towers]
    spread = max(np.ptp(radii), np.ptp([tower.rod for tower in towers]), *heights)
    angles = [angle_of(tower.place) for tower in towers]
    return bool(spread <= TOLERANCES.alignment * size and _stand_at(angles, TOWERS))


def _are_thighs(thighs: Sequence[Thigh], size: float) -> bool:
    """True if thighs are placed as rotarydeltakins requires: alike, with hips and ankles at the origin's height."""
    angles = [angle_of(thigh.hip) for thigh in thighs]
    misalignments = [abs(t.hip[0] * t.ankle[1] - t.hip[1] * t.ankle[0]) / math.hypot(*t.hip[:2]) for t in thighs]
    heights = [abs(point[2]) for thigh in thighs for point in (thigh.hip, thigh.ankle)]
    spread = max(*heights, *misalignments, *(np.ptp(column) for column in zip(*map(_radii, thighs), strict=True)))
    return bool(spread <= TOLERANCES.alignment * size and _stand_at(angles, THIGHS))


def _radii(thigh: Thigh) -> tuple[float, float, float, float]:
    """The radius of the hips, the lengths of thigh and shin, and the radius of the ankles."""
    radius = math.hypot(*thigh.hip[:2])
    return radius, thigh.length, thigh.shin, float(thigh.hip[:2] @ thigh.ankle[:2]) / radius


def _stand_at(angles: Sequence[float], places: Sequence[float]) -> bool:
    error = max(abs((angle - place + 180.0) % 360.0 - 180.0) for angle, place in zip(angles, places, strict=True))
    return math.radians(error) <= TOLERANCES.alignment


def _heading(mechanism: Mechanism, module: str) -> list[str]:
    return [
        f"# '{comment(mechanism.name)}' for LinuxCNC, written by pfabrik. Lengths in {comment(mechanism.length_unit)}.",
        f"# Joints in this order: {comment(', '.join(mechanism.actuator_names))}.",
        f"loadrt {module}",
    ]


def _genhexkins(mechanism: Mechanism, struts: list[tuple[Floats, Floats, float]]) -> str:
    lines = _heading(mechanism, "genhexkins")
    for name, (_, _, added) in zip(mechanism.actuator_names, struts, strict=True):
        if abs(added) > TOLERANCES.alignment * mechanism.characteristic_length:
            lines.append(f"# joint {comment(name)} counts {added:.9g} more than the length of its strut")
    for place, (base_end, platform_end, _) in enumerate(struts):
        for part, point in (("base", base_end), ("platform", platform_end)):
            lines += [
                f"setp genhexkins.{part}.{place}.{axis} {value:.12g}" for axis, value in zip("xyz", point, strict=True)
            ]
    lines.append("# it knows no limits of joints U and S: `pfabrik export MECH c` has them")
    return "\n".join([*lines, ""])


def _lineardeltakins(mechanism: Mechanism, towers: Sequence[Tower]) -> str:
    radius = math.hypot(*towers[0].place[:2])
    pins = [f"setp lineardeltakins.R {radius:.12g}", f"setp lineardeltakins.L {towers[0].rod:.12g}"]
    return "\n".join([*_heading(mechanism, "lineardeltakins"), *pins, ""])


def _rotarydeltakins(mechanism: Mechanism, thighs: Sequence[Thigh]) -> str:
    lines = _heading(mechanism, "rotarydeltakins")
    for name, thigh in zip(mechanism.actuator_names, thighs, strict=True):
        if abs(thigh.added) > TOLERANCES.alignment:
            degrees = math.degrees(thigh.added)
            lines.append(f"# joint {comment(name)} counts {degrees:.9g} deg more than its thigh hangs below level")
    names = ("platformradius", "thighlength", "shinlength", "footradius")
    values = zip(names, _radii(thighs[0]), strict=True)
    lines += [f"setp rotarydeltakins.{name} {value:.12g}" for name, value in values]
    lines.append("# it knows no limits of joints U and S: `pfabrik export MECH c` has them")
    return "\n".join([*lines, ""])
