"""Settings for LinuxCNC's own kinematics where one fits a machine, else a kinematics module of its C."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...common.arrays import Floats
from ...machine.description.mechanism import Mechanism
from ...tolerances import TOLERANCES
from .export_c import c_source
from .fits import Thigh, Tower, angle_of, struts_of, thighs_of, towers_of
from .machine_data import Machine
from .static_data import comment

MEMORY = """\
static pfk_memory *memory(void)
{
    static pfk_memory own;
    static int has_begun;
    if (!has_begun)
        pfk_begin(&own);
    has_begun = 1;
    return &own;
}
"""

INVERSE = """\
int kinematicsInverse(const EmcPose *world, double *joints, const KINEMATICS_INVERSE_FLAGS *iflags,
                      KINEMATICS_FORWARD_FLAGS *fflags)
{
    const double turn = 57.295779513082323;
    double actuators[PFK_ACTUATORS];
    pfk_pose target, pose;
    int i;
    (void)iflags;
    (void)fflags;
    pfk_home(&pose);
    pfk_pose_rpy(world->tran.x, world->tran.y, world->tran.z, world->a / turn, world->b / turn, world->c / turn,
                 &target);
    if (pfk_ik(memory(), &target, &pose, actuators) != 0)
        return -1;
    for (i = 0; i < PFK_ACTUATORS; ++i)
        joints[i] = actuators[i] * pfk_shown[i];
    return 0;
}
"""

FORWARD = """\
int kinematicsForward(const double *joints, EmcPose *world, const KINEMATICS_FORWARD_FLAGS *fflags,
                      KINEMATICS_INVERSE_FLAGS *iflags)
{
    const double turn = 57.295779513082323;
    double actuators[PFK_ACTUATORS], angles[3];
    pfk_pose pose;
    int i;
    (void)iflags;
    (void)fflags;
    for (i = 0; i < PFK_ACTUATORS; ++i)
        actuators[i] = joints[i] / pfk_shown[i];
    /* from where it was; if that leads nowhere, from home */
    pfk_pose_rpy(world->tran.x, world->tran.y, world->tran.z, world->a / turn, world->b / turn, world->c / turn,
                 &pose);
    if (pfk_fk(memory(), actuators, &pose, 0) != 0) {
        pfk_home(&pose);
        if (pfk_fk(memory(), actuators, &pose, 0) != 0)
            return -1;
    }
    pfk_rpy(&pose, angles);
    world->tran.x = pose.p[0];
    world->tran.y = pose.p[1];
    world->tran.z = pose.p[2];
    world->a = angles[0] * turn;
    world->b = angles[1] * turn;
    world->c = angles[2] * turn;
    return 0;
}
"""

COMPONENT = """\
KINEMATICS_TYPE kinematicsType(void)
{
    return KINEMATICS_BOTH;
}

KINS_NOT_SWITCHABLE
EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsInverse);
MODULE_LICENSE("Dual MIT/GPL");

static int comp_id;

int rtapi_app_main(void)
{
    comp_id = hal_init("pfabrikkins");
    if (comp_id < 0)
        return comp_id;
    hal_ready(comp_id);
    return 0;
}

void rtapi_app_exit(void)
{
    hal_exit(comp_id);
}
"""


def module(machine: Machine) -> str:
    """A kinematics module for halcompile, around the machine's C."""
    mechanism = machine.mechanism
    angles = ["1.0" if driven.is_length else "57.295779513082323" for driven in machine.driven]
    return f"""\
/* A kinematics module for LinuxCNC: halcompile --install pfabrikkins.c, then loadrt pfabrikkins.
   Joints in this order: {comment(", ".join(mechanism.actuator_names))}.
   Lengths in {comment(mechanism.length_unit)}, angles in degrees.
   X, Y, Z are the reference point; A, B, C turn about x, y and z, in this order. */
#include "rtapi_app.h"
#include "hal.h"
#include "kinematics.h"

{c_source(mechanism)}
static const double pfk_shown[PFK_ACTUATORS] = {{{", ".join(angles)}}};

{MEMORY}
{INVERSE}
{FORWARD}
{COMPONENT}"""


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
