"""Settings and modules for controllers that bring kinematics of their own, or take a module: LinuxCNC and Klipper."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..description.mechanism import Mechanism
from ..errors import UnsupportedMechanism
from ..tolerances import TOLERANCES
from .export_c import c_source
from .legs import LegCode, RodShape
from .machine import Machine
from .wording import comment

LINEAR_DELTA_ANGLES = (90.0, -30.0, 210.0)
"""Where lineardeltakins has its towers [deg]."""

KLIPPER_LETTERS = "abc"


def linuxcnc(mechanism: Mechanism) -> str:
    """What LinuxCNC needs: HAL lines where one of its own kinematics fits, else a module with the machine's own.

    Hexapods of struts are genhexkins, printers' deltas with towers where it has them lineardeltakins. A module is one
    file of C for halcompile.

    Raises
    ------
    UnsupportedMechanism : no legs in closed form.
    """
    machine = Machine(mechanism)
    struts = _struts(machine)
    if struts is not None:
        return _genhexkins(mechanism, struts)
    towers = _towers(machine)
    if towers is not None and _are_alike(towers, mechanism.characteristic_length):
        return _lineardeltakins(mechanism, towers)
    return _module(machine)


def klipper(mechanism: Mechanism) -> str:
    """`[printer]` and `[stepper_*]` of a delta for Klipper, with what it cannot know of this machine listed.

    Raises
    ------
    UnsupportedMechanism : a machine that Klipper has no kinematics for.
    """
    machine = Machine(mechanism)
    towers = _towers(machine)
    if towers is None:
        reason = (
            "Klipper's delta has three upright rails, each with one pair of parallel rods, and this machine has not"
        )
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    return _delta(mechanism, towers)


class Tower(NamedTuple):
    """A rail of a delta, moved inward by where its rods are on the platform.

    Attributes
    ----------
    place : (3,) [length], of the carriage at value 0.
    rod : its length.
    highest : of the carriage's value; infinite without a range.
    """

    place: Floats
    rod: float
    highest: float


def _struts(machine: Machine) -> list[tuple[Floats, Floats, float]] | None:
    """Ends of six struts, on the base and on the platform, and what their actuators add to lengths; None for others."""
    mechanism = machine.mechanism
    whole = not machine.unset and not mechanism.end_effector_is_joint
    if not whole or len(machine.codes) != 6 or [each.drive.what for each in machine.driven] != ["slide"] * 6:
        return None
    found = []
    for each in machine.driven:
        code = machine.codes[each.leg]
        shape = code.shape
        if not isinstance(shape, RodShape) or shape.is_reversed or shape.carrier or machine.rows:
            return None
        found.append((np.asarray(code.numbers["foot"]), np.asarray(code.numbers["head"]), each.home - _length(code)))
    return found


def _length(code: LegCode) -> float:
    return float(np.asarray(code.numbers["length"]))


def _towers(machine: Machine) -> list[Tower] | None:
    """The rails of a delta in the order of its actuators; None for other machines."""
    mechanism, size = machine.mechanism, machine.mechanism.characteristic_length
    if set(mechanism.task) != {"x", "y", "z"} or len(machine.driven) != 3 or len(machine.codes) != 6:
        return None
    towers = []
    for each in machine.driven:
        pair = [code for code in machine.codes if code.main == each.leg]
        shapes = [code.shape for code in pair]
        if len(pair) != 2 or not all(isinstance(s, RodShape) and s.carrier == "carriage" for s in shapes):
            return None
        axis = np.asarray(pair[0].numbers["axis"]) * each.sense
        spans = [np.asarray(code.numbers["foot"]) - np.asarray(code.numbers["head"]) for code in pair]
        lengths = [_length(code) for code in pair]
        off = max(np.abs(spans[0] - spans[1]).max() / size, abs(lengths[0] - lengths[1]) / size)
        if (
            off > TOLERANCES.alignment
            or np.linalg.norm(np.cross(axis, [0, 0, 1])) > TOLERANCES.alignment
            or axis[2] < 0
        ):
            return None
        towers.append(Tower(spans[0] - each.home * axis, lengths[0], each.home + each.hi))
    return towers


def _angles(towers: list[Tower]) -> list[float]:
    """Where towers stand [deg]."""
    return [math.degrees(math.atan2(tower.place[1], tower.place[0])) % 360.0 for tower in towers]


def _are_alike(towers: list[Tower], size: float) -> bool:
    """Whether towers are where lineardeltakins has them."""
    radii = [math.hypot(*tower.place[:2]) for tower in towers]
    angles = zip(_angles(towers), LINEAR_DELTA_ANGLES, strict=True)
    turned = max(abs((own - wanted + 180.0) % 360.0 - 180.0) for own, wanted in angles)
    spread = max(np.ptp(radii), np.ptp([tower.rod for tower in towers]), *(abs(tower.place[2]) for tower in towers))
    return bool(math.radians(turned) <= TOLERANCES.alignment and spread <= TOLERANCES.alignment * size)


def _heading(mechanism: Mechanism, module: str) -> list[str]:
    return [
        f"# '{comment(mechanism.name)}' for LinuxCNC, written by pfabrik. Lengths in {mechanism.length_unit}.",
        f"# Joints in this order: {comment(', '.join(mechanism.actuator_names))}.",
        f"loadrt {module}",
    ]


def _genhexkins(mechanism: Mechanism, struts: list[tuple[Floats, Floats, float]]) -> str:
    lines = _heading(mechanism, "genhexkins")
    for name, (_, _, added) in zip(mechanism.actuator_names, struts, strict=True):
        if abs(added) > TOLERANCES.alignment * mechanism.characteristic_length:
            lines.append(f"# joint {comment(name)} counts {added:.9g} more than the length of its strut")
    for place, (foot, head, _) in enumerate(struts):
        for part, point in (("base", foot), ("platform", head)):
            lines += [
                f"setp genhexkins.{part}.{place}.{axis} {value:.12g}" for axis, value in zip("xyz", point, strict=True)
            ]
    lines.append("# it knows no limits of joints U and S: `pfabrik export --c` has them")
    return "\n".join([*lines, ""])


def _lineardeltakins(mechanism: Mechanism, towers: list[Tower]) -> str:
    radius = math.hypot(*towers[0].place[:2])
    pins = [f"setp lineardeltakins.R {radius:.12g}", f"setp lineardeltakins.L {towers[0].rod:.12g}"]
    return "\n".join([*_heading(mechanism, "lineardeltakins"), *pins, ""])


def _delta(mechanism: Mechanism, towers: list[Tower]) -> str:
    radii = [math.hypot(*tower.place[:2]) for tower in towers]
    unknown = ["pins, steps and currents of the steppers", "limits of the rods' joints"]
    if np.ptp(radii) > TOLERANCES.alignment * mechanism.characteristic_length:
        places = ", ".join(f"{radius:.6g}" for radius in radii)
        reason = f"Klipper's delta has one radius for its three towers, and these have {places}"
        raise UnsupportedMechanism(mechanism.name, [reason], "exported")
    if mechanism.length_unit != "mm":
        unknown.append(f"lengths in {mechanism.length_unit}: it counts in mm")
    lines = [
        f"# '{comment(mechanism.name)}' for Klipper, written by pfabrik.",
        "# What it cannot know of this machine, or pfabrik of the printer:",
        *(f"# - {each}" for each in unknown),
        "[printer]",
        "kinematics: delta",
        f"delta_radius: {radii[0]:.9g}",
    ]
    speeds = [mechanism.joint(name).max_speed for name in mechanism.actuator_names]
    known = [speed for speed in speeds if speed is not None]
    lines.append(
        f"# the carriages' own: at most {min(known):.9g} a second" if known else "# max_velocity, max_accel: yours"
    )
    for letter, tower, angle in zip(KLIPPER_LETTERS, towers, _angles(towers), strict=True):
        lines += ["", f"[stepper_{letter}]", f"arm_length: {tower.rod:.9g}", f"angle: {angle:.9g}"]
        height = tower.place[2] + tower.highest - math.sqrt(max(tower.rod**2 - radii[0] ** 2, 0.0))
        if math.isfinite(height):
            lines.append(f"position_endstop: {height:.9g}")
        else:
            lines.append("# position_endstop: the carriage has no upper end of its range")
    return "\n".join([*lines, ""])


def _module(machine: Machine) -> str:
    """A kinematics module for halcompile, around the machine's own C."""
    mechanism = machine.mechanism
    angles = ["1.0" if each.unit == "length" else "57.295779513082323" for each in machine.driven]
    return f"""\
/* A kinematics module for LinuxCNC: halcompile --install pfabrikkins.c, then loadrt pfabrikkins.
   Joints in this order: {comment(", ".join(mechanism.actuator_names))}.
   Lengths in {mechanism.length_unit}, angles in degrees.
   X, Y, Z are the reference point; A, B, C turn about x, y and z, in this order. */
#include "rtapi_app.h"
#include "hal.h"
#include "kinematics.h"

{c_source(mechanism)}
static const double pfk_shown[PFK_ACTUATORS] = {{{", ".join(angles)}}};

int kinematicsInverse(const EmcPose *world, double *joints, const KINEMATICS_INVERSE_FLAGS *iflags,
                      KINEMATICS_FORWARD_FLAGS *fflags)
{{
    const double turn = 57.295779513082323;
    double actuators[PFK_ACTUATORS];
    pfk_pose target, pose;
    int i;
    (void)iflags;
    (void)fflags;
    pfk_home(&pose);
    pfk_pose_rpy(world->tran.x, world->tran.y, world->tran.z, world->a / turn, world->b / turn, world->c / turn,
                 &target);
    if (pfk_ik(&target, &pose, actuators) != 0)
        return -1;
    for (i = 0; i < PFK_ACTUATORS; ++i)
        joints[i] = actuators[i] * pfk_shown[i];
    return 0;
}}

int kinematicsForward(const double *joints, EmcPose *world, const KINEMATICS_FORWARD_FLAGS *fflags,
                      KINEMATICS_INVERSE_FLAGS *iflags)
{{
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
    if (pfk_fk(actuators, &pose, 0) != 0) {{
        pfk_home(&pose);
        if (pfk_fk(actuators, &pose, 0) != 0)
            return -1;
    }}
    pfk_rpy(&pose, angles);
    world->tran.x = pose.p[0];
    world->tran.y = pose.p[1];
    world->tran.z = pose.p[2];
    world->a = angles[0] * turn;
    world->b = angles[1] * turn;
    world->c = angles[2] * turn;
    return 0;
}}

KINEMATICS_TYPE kinematicsType(void)
{{
    return KINEMATICS_BOTH;
}}

KINS_NOT_SWITCHABLE
EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsInverse);
MODULE_LICENSE("Dual MIT/GPL");

static int comp_id;

int rtapi_app_main(void)
{{
    comp_id = hal_init("pfabrikkins");
    if (comp_id < 0)
        return comp_id;
    hal_ready(comp_id);
    return 0;
}}

void rtapi_app_exit(void)
{{
    hal_exit(comp_id);
}}
"""
