"""The text of the exported file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import resources

from ..motion.joint_path import JointPath
from .machine_data import Machine
from .self_test import AGREEMENT, checks_of
from .tables import checks_h, features, machine_h, tables_h
from .wording import Precision, comment, in_words

NOTICE = """\
Permission to use, copy, modify, and distribute this file for any purpose with or without fee is hereby granted. It is
provided "as is" and without any warranty; its authors are not liable for anything that comes of its use."""


def source(
    machine: Machine,
    name: str,
    precision: Precision,
    parts: Sequence[str],
    path: JointPath | None = None,
    file: str = "FILE",
) -> str:
    """The text of the file: header, tables and routines."""
    routines = resources.files(__package__).joinpath("kinematics.c").read_text(encoding="utf-8")
    checks = checks_of(machine, "limits" in parts) if "ik" in parts else None
    is_checked = {"CHECKED"} if checks is not None and len(checks.targets) else set()
    text = selected(routines[routines.index("#ifndef") :], features(machine, parts, path) | is_checked)
    included = {
        "machine.h": machine_h(machine, parts, path),
        "tables.h": tables_h(machine, precision, parts, text, path),
    }
    if checks is not None:
        included["checks.h"] = checks_h(checks, AGREEMENT[precision])
    text = re.sub(r'^#include "(.*)"\n', lambda match: included[match[1]], text, flags=re.MULTILINE)
    words = in_words(re.sub(r"\n{3,}", "\n\n", f"{_header(machine, parts, path)}\n{text}"), name, precision)
    return words.replace("_SELF_TEST FILE -lm", f"_SELF_TEST {comment(file)} -lm", 1)


def selected(routines: str, conditions: set[str]) -> str:
    """The routines whose conditions hold; `#ifdef` and `#ifndef` stay for the preprocessor."""
    lines: list[str] = []
    blocks: list[bool | None] = []  # of each open block, if it is kept; None of the preprocessor's own
    for line in routines.splitlines():
        if line.startswith("#if "):
            blocks.append(bool(conditions & set(line.removeprefix("#if ").split(" || "))))
        elif line == "#else":
            blocks[-1] = not blocks[-1]
        elif line != "#endif" or blocks.pop() is None:
            if line.startswith(("#ifdef", "#ifndef")):
                blocks.append(None)
            if False not in blocks:
                lines.append(line)
    return "\n".join([*lines, ""])


def _header(machine: Machine, parts: Sequence[str], path: JointPath | None) -> str:
    """The comment at the top: conventions, actuators, limits and legs, and the notice."""
    mechanism, unit = machine.mechanism, machine.mechanism.length_unit
    lines = [
        f"The kinematics of '{mechanism.name}', written by pfabrik from its description.",
        "",
        "C99, and C++ as it is; no memory but the stack, nothing that changes between calls, only the C library's",
        "mathematics.",
        f"Lengths in {unit}, angles in radians. A pose maps platform coordinates, as at home and from the reference",
        "point, to base coordinates: p is where the reference point is, R the rotation.",
        f"Task: {' '.join(mechanism.task)}."
        + (" What it leaves open follows from the machine." if machine.unset else ""),
        "All of it in the working mode of home: each crank and carriage on the side where it is there.",
        "",
        "The tables are of this machine alone; the functions are the same for all machines with such legs.",
        "Include it with PFK_DECLARATIONS_ONLY defined for the declarations alone; with PFK_SELF_TEST defined it is a",
        "program that checks itself:",
        "    cc -std=c99 -D PFK_SELF_TEST FILE -lm -o check && ./check",
        "",
        "actuator  joint                 home",
    ]
    for place, (name, driven) in enumerate(zip(mechanism.actuator_names, machine.driven, strict=True)):
        lines.append(f"{place:<9} {name:<21} {driven.home:.10g} {unit if driven.is_length else 'rad'}")
    if path is not None:
        lines += ["", "coordinate joint               home"]
        for place, (coordinate, home) in enumerate(zip(path.coordinates, path.home, strict=True)):
            lines.append(
                f"{place:<10} {coordinate.name:<20} {home:.10g} {'rad' if coordinate.kind == 'angle' else unit}"
            )
    if "limits" in parts:
        lines += ["", "limit     joint                 bound"]
        bounds = [
            (driven.home + bound, driven.is_length) for driven in machine.limited for bound in (driven.lo, driven.hi)
        ]
        bounds += [(float(cone["half_angle"]), False) for cone in machine.cones]
        for place, ((joint, bound), (at, is_length)) in enumerate(zip(machine.limits, bounds, strict=True), 1):
            lines.append(f"{place:<9} {joint:<21} {bound} {at:.10g} {unit if is_length else 'rad'}")
    if (links := machine.links_kept(parts)) is not None:
        lines += ["", "pair      links that are at least this far apart"]
        least = f"{links.clearance:.10g} {unit}"
        lines += [f"{place:<9} {' and '.join(names):<33} {least}" for place, (*_, names) in enumerate(links.pairs, 1)]
    elif mechanism.clearance is not None:
        lines += ["", "Links may be too near: the clearance of the machine is kept where limits are."]
    lines += ["", "leg       joints"]
    lines += [f"{place:<9} {', '.join(leg.joints)}" for place, leg in enumerate(machine.legs, 1)]
    body = [f"   {comment(line)}".rstrip() for line in [*lines, "", *NOTICE.splitlines()]]
    return "\n".join(["/* " + body[0].strip(), *body[1:], "*/"])
