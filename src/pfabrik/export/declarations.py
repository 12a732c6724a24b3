"""What an exported file says of itself: the comment at its head, and its declarations."""

from __future__ import annotations

from collections.abc import Sequence

from .machine import Machine
from .wording import comment

NOTICE = """\
Permission to use, copy, modify, and distribute this file for any purpose with or without fee is hereby granted. It is
provided "as is" and without any warranty; its authors are not liable for anything that comes of its use."""


def header(machine: Machine, parts: Sequence[str]) -> str:
    """What the file is, what it speaks of, and its notice."""
    mechanism = machine.mechanism
    unit = mechanism.length_unit
    lines = [
        f"The kinematics of '{mechanism.name}', written by pfabrik from its description.",
        "",
        "C99, no memory but the stack, nothing that changes between calls, only the C library's mathematics.",
        f"Lengths in {unit}, angles in radians. A pose maps platform coordinates, as at home and from the reference",
        "point, to base coordinates: p is where the reference point is, R the rotation.",
        f"Task: {' '.join(mechanism.task)}."
        + (" What it leaves open follows from the machine." if machine.unset else ""),
        "All of it in the working mode of home: each crank and carriage on the side where it is there.",
        "",
        "Include it with PFK_DECLARATIONS_ONLY defined for the declarations alone; compile it with PFK_SELF_TEST",
        "defined for a program that checks itself.",
        "",
        "actuator  joint                 home",
    ]
    for place, (name, each) in enumerate(zip(mechanism.actuator_names, machine.driven, strict=True)):
        lines.append(f"{place:<9} {name:<21} {each.home:.10g} {unit if each.unit == 'length' else 'rad'}")
    if "limits" in parts:
        lines += ["", "limit     joint                 bound"]
        for place, (joint, bound) in enumerate(machine.limits, 1):
            lines.append(f"{place:<9} {joint:<21} {bound} {_bound(machine, place - 1)}")
    lines += ["", "leg       joints"]
    lines += [f"{place:<9} {', '.join(code.joints)}" for place, code in enumerate(machine.codes, 1)]
    lines += ["", *NOTICE.splitlines()]
    body = [f"   {comment(line)}".rstrip() for line in lines]
    return "\n".join(["/* " + body[0].strip(), *body[1:], "*/"])


def _bound(machine: Machine, place: int) -> str:
    n_ranged = 2 * len(machine.limited)
    if place >= n_ranged:
        return f"{float(machine.table.cones[place - n_ranged]['half_angle']):.10g} rad"
    own = machine.limited[place // 2]
    unit = machine.mechanism.length_unit if own.unit == "length" else "rad"
    return f"{own.home + (own.hi if place % 2 else own.lo):.10g} {unit}"


def declarations(machine: Machine, parts: Sequence[str]) -> str:
    """Types, numbers and functions for who calls the file."""
    n_limits = len(machine.limits) if "limits" in parts else 0
    lines = [
        "typedef double pfk_real;",
        "",
        "typedef struct {",
        "    pfk_real p[3];",
        "    pfk_real R[3][3];",
        "} pfk_pose;",
        "",
        "/* What functions return: 0 where all is well, the number of the limit that is exceeded most, PFK_LEG + the",
        "   number of a leg that does not reach or close, or one of those below. */",
        "enum {",
        f"    PFK_ACTUATORS = {len(machine.driven)},",
        f"    PFK_LIMITS = {n_limits},",
        "    PFK_LEG = 1000,",
        "    PFK_NO_POSE = -1,     /* not finite, or not a rotation */",
        "    PFK_NO_ACTUATORS = -2, /* not finite */",
        "    PFK_OTHER_MODE = -3   /* closed, but not in the working mode of home */",
        "};",
        "",
        "/* The pose at home. */",
        "void pfk_home(pfk_pose *pose);",
        "/* A pose from a position and from turns about the fixed x, y and z axes, in this order [rad]. */",
        "void pfk_pose_rpy(pfk_real x, pfk_real y, pfk_real z, pfk_real roll, pfk_real pitch, pfk_real yaw,",
        "                  pfk_pose *pose);",
        "/* The angles of a pose: roll, pitch, yaw [rad]. */",
        "void pfk_rpy(const pfk_pose *pose, pfk_real angles[3]);",
        "/* What a code that was returned means, in words. */",
        "const char *pfk_what(int code);",
    ]
    if "ik" in parts:
        lines += [
            "/* Actuators for a target. `pose` must hold a pose, the last one or home: what the task leaves open",
            "   is completed from there, and it becomes the pose that is reached. Nothing is written unless 0 is",
            "   returned. */",
            "int pfk_ik(const pfk_pose *target, pfk_pose *pose, pfk_real actuators[PFK_ACTUATORS]);",
        ]
        if any(each.may_turn for each in machine.driven):
            lines += [
                "/* Counts actuators that may turn more than once on from where they were. */",
                "void pfk_count_turns(const pfk_real before[PFK_ACTUATORS], pfk_real now[PFK_ACTUATORS]);",
            ]
    if "limits" in parts:
        size = "PFK_LIMITS" if n_limits else ""
        lines += [
            "/* Fills how far a whole pose is inside every limit, negative beyond it [length or rad]. */",
            f"int pfk_limits(const pfk_pose *pose, pfk_real slack[{size}]);",
        ]
    if "fk" in parts:
        lines += [
            "/* The pose at which actuators are, by Newton's method from `pose`, in at most 40 steps; `steps` may be",
            "   0, or is told how many there were. Limits are not asked for. Nothing is written to `pose` unless 0, or",
            "   PFK_OTHER_MODE, is returned. */",
            "int pfk_fk(const pfk_real actuators[PFK_ACTUATORS], pfk_pose *pose, int *steps);",
        ]
    return "\n".join([*lines, ""])
