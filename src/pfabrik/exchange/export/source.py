"""The text of the exported file, and the poses of its self-test."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from importlib import resources
from typing import NamedTuple

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats, Mask
from ...configuration import configuration
from ...feasibility import feasibility
from ...ik import solve_ik
from ...kernels.controller.reached import ATTEMPTS, MOST_PARTS
from ...kernels.legs.leg_constants import MOST_STEPS, MOST_STEPS_IMPLICIT
from ...kinematics import JointPath, engine_of, generic_of
from ...machine.description.mechanism import Mechanism
from ...machine.poses import pose
from ...options import Options
from ...tolerances import TOLERANCES
from .controller_tables import ControllerTables, controller_tables
from .finite_results import with_finite_results
from .machine_data import Machine
from .self_test import are_led_from_home, far_checks, far_lines, load_checks, load_lines
from .static_data import Precision, comment, in_words, literal, table, words
from .translated import Translated, translated

N_POSES = 50
FARTHEST = (0.3, 0.5)
"""The largest distance of these poses from home [L, rad]."""

N_TRIED = 400
STEPS_OF_CHECKS = 40
"""Most steps of the library's searches: answers that it reaches count, and of nearest poses that they are feasible; the
search for the nearest of all takes a hundred times as long."""

AGREEMENT: dict[Precision, float] = {"double": 1e-10, "float": 1e-4}
"""Tolerance to which actuators must agree [L or rad]: rounding may leave as much near a dead point."""

BACK: dict[Precision, float] = {"double": 1e-9, "float": 1e-3}
NEAREST: dict[Precision, float] = {"double": 1e-6, "float": 1e-3}
LOADS: dict[Precision, float] = {"double": 1e-8, "float": 2e-3}
"""Tolerances of where actuators lead and of distances from targets [L], and of torques and forces, as a share."""

CLEAR = 1e-3
"""Margin beyond which a pose counts as inside or outside its limits without doubt, a share of the range."""


class Checks(NamedTuple):
    """Targets (n, 4, 4), their actuators (n, n_a), a mask of those within all limits (n,), and the least distances
    between links (n,) [length], of a file that keeps them apart."""

    targets: Floats
    actuators: Floats
    kept: Mask
    distances: Floats | None = None


def checks_of(machine: Machine, limits: bool) -> Checks:
    """Poses around home that a mechanism reaches in home's working mode, some beyond its limits.

    Poses within limits are those alone that the file reaches without doubt: `feasibility` agrees.
    """
    mechanism = machine.mechanism.with_clearance(None)  # distances are measured
    keeps_apart = limits and machine.links is not None
    without_limits = mechanism.without_limits()
    targets, solution = _reached_around_home(without_limits)
    least = least_margins(mechanism, solution.q)
    distances = _distances(solution) if keeps_apart else None
    if distances is not None:
        room = (distances - (machine.mechanism.clearance or 0.0)) / mechanism.characteristic_length
        least = np.minimum(least, room)
    if machine.completes:
        margin = np.asarray(feasibility(mechanism, targets).margin)
        least[((least > 0.0) & (margin < 0.0)) | ~_are_unique(machine, targets, solution, least > 0.0)] = 0.0
    is_reached, is_clear = solution.status == 0, np.abs(least) > CLEAR
    inside = np.flatnonzero(is_reached & is_clear & (least > 0.0))
    beyond = np.flatnonzero(is_reached & is_clear & (least < 0.0)) if limits else inside[:0]
    n_beyond = min(len(beyond), max(N_POSES // 5, N_POSES - len(inside)))
    chosen = np.concatenate([inside[: N_POSES - n_beyond], beyond[:n_beyond]])
    apart = None if distances is None else distances[chosen]
    return Checks(targets[chosen], solution.actuators[chosen], np.isin(chosen, inside), apart)


def _reached_around_home(mechanism: Mechanism) -> tuple[Floats, Solution]:
    """Home and targets around it (n, 4, 4) that are not out of reach, with their answers.

    Of a mechanism with fewer freedoms than its task sets, which reaches home alone of these, the nearest poses.
    """
    asked, targets = _options(mechanism), targets_around_home(mechanism, N_TRIED, np.random.default_rng(0))
    targets[0] = mechanism.home_pose
    within = targets[~(np.asarray(feasibility(mechanism, targets).margin) < 0.0)]
    solution = solve_ik(mechanism, within, options=asked)
    if np.any(np.ravel(solution.status)[1:] == 0):
        return within, solution
    nearest = np.ascontiguousarray(solve_ik(mechanism, targets, options=asked).pose)
    return nearest, solve_ik(mechanism, nearest, options=asked)


def _options(mechanism: Mechanism) -> Options:
    """Options of the library's answers, in home's mode; some of its engines do not count steps."""
    return Options(working_mode="keep", most_steps=STEPS_OF_CHECKS if engine_of(mechanism).is_fast else None)


def _distances(solution: Solution) -> Floats:
    """The least distances between links, (n,) [length]."""
    from ...capabilities.clearance.clearance import clearance

    return np.reshape(clearance(solution).distance, -1)


def _are_unique(machine: Machine, targets: Floats, solution: Solution, is_inside: Mask) -> Mask:
    """True for targets (n,) without another answer than the one found, from several starts.

    The starts are home and, with implicit joints, the answers within limits where each actuator is least or most.
    """
    mechanism = machine.mechanism.with_clearance(None)
    starts: list[Floats | None] = [None]
    if machine.has_implicit_joints and is_inside.any():
        actuators = solution.actuators[is_inside]
        rows = np.flatnonzero(is_inside)[np.unique([actuators.argmin(axis=0), actuators.argmax(axis=0)])]
        starts += list(solution.q[rows])
    is_same = np.ones(len(targets), dtype=bool)
    for start in starts:
        other = solve_ik(mechanism, targets, start=start, options=_options(mechanism))
        is_same &= (other.status != 0) | (
            machine.largest_difference(other.actuators, solution.actuators) <= AGREEMENT["double"]
        )
    return is_same


def targets_around_home(mechanism: Mechanism, n: int, random: np.random.Generator) -> Floats:
    """Random poses (n, 4, 4) around home, displaced in the directions in which the platform can move."""
    directions = generic_of(mechanism).directions
    basis = np.zeros((6, directions.shape[1]))
    basis[: len(directions)] = directions
    projector = basis @ basis.T
    projector[np.abs(projector) < 1e-12] = 0.0
    reach, angle = FARTHEST
    scales = np.repeat([reach * mechanism.characteristic_length, angle], 3)
    twists = random.uniform(-1.0, 1.0, (n, 6)) * scales @ projector
    return pose(mechanism.home_pose[:3, 3] + twists[:, :3], rotvec=twists[:, 3:])


def least_margins(mechanism: Mechanism, q: Floats) -> Floats:
    """The least margin of all limits at joint vectors q, (n,)."""
    from ...answers.margins import margins

    if not len(q):
        return np.zeros(0)
    by_limit = margins(configuration(mechanism, q))
    return np.asarray(np.min([np.ones(len(q)), *(np.asarray(margin) for margin in by_limit.values())], axis=0))


NOTICE = """\
Permission to use, copy, modify, and distribute this file for any purpose with or without fee is hereby granted. It is
provided "as is" and without any warranty; its authors are not liable for anything that comes of its use."""

ACTIVE: dict[Precision, float] = {"double": TOLERANCES.active, "float": 1e-5}
"""Slack below which a pose is at a limit [L or rad]."""

RANK: dict[Precision, float] = {"double": 1e-9, "float": 1e-5}
"""Share of a row of a Jacobian below which it follows from others."""


def source(
    machine: Machine,
    name: str,
    precision: Precision,
    parts: Sequence[str],
    path: JointPath | None = None,
    file: str = "FILE",
) -> str:
    """The text of the file: header, kernels, tables and routines."""
    routines = resources.files(__package__).joinpath("controller.c").read_text(encoding="utf-8")
    checks = checks_of(machine, "limits" in parts) if "ik" in parts else None
    conditions = features(machine, parts, path) | ({"CHECKED"} if checks is not None and len(checks.targets) else set())
    asked = {} if checks is None else _asked(machine, checks, conditions, precision)
    conditions |= {name for name, lines in asked.items() if lines}
    tables = controller_tables(machine, parts, path)
    made = translated(tables, conditions, precision)
    included = {
        "machine.h": _machine_h(machine, tables, parts, path),
        "memory.h": made.types,
        "kernels.h": made.kernels,
        "filling.h": made.filling,
        "tables.h": "\n".join([made.data, *_tables(machine, precision, parts, path, len(tables.reaching.ways))]),
    }
    if checks is not None:
        more = [line for lines in asked.values() for line in lines]
        included["checks.h"] = "\n".join([*more, _checks_h(machine, checks, conditions, precision)])
    text = with_finite_results(selected(routines[routines.index("#ifndef") :], conditions))
    text = re.sub(r'^#include "(.*)"\n', lambda match: included[match[1]], text, flags=re.MULTILINE)
    whole = f"{_header(machine, made, tables, parts, path)}\n{text}"
    body = in_words(re.sub(r"\n{3,}", "\n\n", whole), name, precision)
    body = body.replace(f"{name.upper()}_MEMORY_", f"{name}_memory").replace(
        f"{name.upper()}_MOST_", "the `most_steps`"
    )
    return body.replace("_SELF_TEST FILE -lm", f"_SELF_TEST {comment(file)} -lm", 1)


def features(machine: Machine, parts: Sequence[str], path: JointPath | None = None) -> set[str]:
    """The names of conditions in `controller.c` that hold for a machine, the parts asked for and named joints."""
    conditions: dict[str, object] = {
        "TURNS": "ik" in parts and any(driven.may_turn for driven in machine.driven),
        "CLEARANCE": machine.links_kept(parts) is not None,
        "JOINTS": path is not None,
        "TO_ACTUATORS": path is not None and "ik" in parts,
        "TORQUES": path is None and "rates" in parts,
        "TO_JOINTS": path is not None and "fk" in parts,
        "RESTS": {"limits", "nearest", "live"} & {*parts} or (path is not None and "ik" in parts),
    }
    return {part.upper() for part in parts} | {name for name, holds in conditions.items() if holds}


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


def _machine_h(machine: Machine, tables: ControllerTables, parts: Sequence[str], path: JointPath | None) -> str:
    """Constants for callers of the file."""
    counts = {"PFK_ACTUATORS": len(machine.driven), "PFK_LIMITS": len(machine.limits) if "limits" in parts else 0}
    counts |= {} if path is None else {"PFK_JOINTS": len(path.coordinates)}
    counts |= {"PFK_RATES": 6 if path is None else len(path.coordinates)} if "rates" in parts else {}
    counts |= {} if tables.projecting is None else {"PFK_STARTS": len(tables.projecting.tables.plan.seeds.poses)}
    counts |= {"PFK_BODIES": machine.bodies.count} if "bodies" in parts else {}
    links = machine.links_kept(parts)
    counts |= {} if links is None else {"PFK_PAIRS": len(links.names)}
    constants = f"enum {{ {', '.join(f'{name} = {count}' for name, count in counts.items())} }};\n"
    if links is None:
        return constants
    clearance = literal(machine.mechanism.clearance or 0.0)
    return f"#define PFK_CLEARANCE {clearance} /* least distance between links [length] */\n{constants}"


def _tables(
    machine: Machine, precision: Precision, parts: Sequence[str], path: JointPath | None, n_ways: int
) -> Iterator[str]:
    """Tables for the routines around the kernels."""
    size, turning = machine.mechanism.characteristic_length, not machine.mechanism.end_effector_is_joint
    yield "/* L, the radius of the smallest sphere around the joints; units are L of lengths, 1 of angles. */"
    yield f"#define PFK_SIZE {literal(size)}"
    yield f"#define PFK_ACTIVE {literal(ACTIVE[precision])} /* a pose is at a limit whose slack is less [L or rad] */"
    yield f"#define PFK_RANK {literal(RANK[precision])} /* a row of a Jacobian that is less follows from others */"
    counts = {
        "LEGS": len(machine.legs),
        "COLUMNS": 6 + machine.n_redundant,
        "TURNING": int(turning),
        "ATTEMPTS": n_ways,
    }
    yield f"enum {{ {', '.join(f'PFK_{name} = {count}' for name, count in counts.items())} }};"
    yield f"static const pfk_real pfk_reference[3] = {literal(np.asarray(machine.mechanism.reference_point))};"
    if {"ik", "rates"} & {*parts}:
        yield f"static const pfk_real pfk_units[PFK_ACTUATORS] = {literal(_units(machine))};"
    if "ik" in parts:
        homes = literal(np.array([driven.home for driven in machine.driven]))
        yield f"static const pfk_real pfk_home_actuators[PFK_ACTUATORS] = {homes};"
    if "rates" in parts:
        yield f"static const pfk_real pfk_rate_units[] = {literal(rate_units(machine, path))};"
    if "nearest" in parts:
        of_ranges = [size if each.is_length else 1.0 for each in machine.limited for _ in range(2)]
        values = np.array([*of_ranges, *(1.0 for _ in machine.cones)] or [1.0])
        yield f"static const pfk_real pfk_limit_units[] = {literal(values)};"
    if "limits" in parts:
        yield from words("limit", [f"beyond a limit: joint {joint}, {bound}" for joint, bound in machine.limits])
    if (links := machine.links_kept(parts)) is not None:
        yield from words("pair", [f"links too near: {' and '.join(names)}" for names in links.names])
    joints = [", ".join(leg.joints) for leg in machine.legs]
    yield from words("leg", [f"does not reach, or does not close: the leg of {each}" for each in joints])


def _units(machine: Machine) -> Floats:
    """L of actuators that are lengths, 1 of angles."""
    size = machine.mechanism.characteristic_length
    return np.array([size if driven.is_length else 1.0 for driven in machine.driven])


def rate_units(machine: Machine, path: JointPath | None) -> Floats:
    """The units of rates: L of lengths, 1 of angles."""
    size = machine.mechanism.characteristic_length
    if path is None:
        return np.array([size] * 3 + [1.0] * 3)
    return np.array([1.0 if each.kind == "angle" else size for each in path.coordinates])


def _asked(machine: Machine, checks: Checks, conditions: set[str], precision: Precision) -> dict[str, list[str]]:
    """Lines of the self-test's further questions, by their condition in `controller.c`; none where there are none."""
    asked: dict[str, list[str]] = {}
    if "NEAREST" in conditions and len((far := far_checks(machine, checks.targets)).targets):
        exact = f"#define PFK_EXACT_NEAREST {literal(NEAREST[precision])} /* of distances from targets [L] */"
        asked["FAR_CHECKS"] = [exact, *far_lines(far)]
    inside = checks.targets[checks.kept]
    for part, name, moves in (("TORQUES", "torque", False), ("EFFORT", "effort", True)):
        if part in conditions and len((loads := load_checks(machine, inside, moves=moves)).poses):
            asked[f"{name.upper()}_CHECKS"] = list(load_lines(name, loads))
    if {"TORQUE_CHECKS", "EFFORT_CHECKS"} & {*asked}:
        exact = f"#define PFK_EXACT_LOADS {literal(LOADS[precision])} /* of torques and forces, a share */"
        asked["LOADS"] = [exact]
    return asked


def _checks_h(machine: Machine, checks: Checks, conditions: set[str], precision: Precision) -> str:
    """What the self-test asks and compares, and tolerances."""
    lines = [f"#define PFK_EXACT {literal(AGREEMENT[precision])} /* of actuators [L or rad] */"]
    lines.append(f"enum {{ PFK_CHECKS = {len(checks.targets)} }};")
    if "FK" in conditions:
        lines.append(f"#define PFK_EXACT_BACK {literal(BACK[precision])} /* of where actuators lead [L] */")
    led = np.zeros(len(checks.targets), dtype=bool)
    if "FK" in conditions:
        led = are_led_from_home(machine, checks.targets, checks.actuators)
    distances = [""] * len(checks.targets)
    if checks.distances is not None:
        distances = [f", {literal(float(distance))}" for distance in checks.distances]
    rows = (
        f"    {{{{{literal(target[:3, 3])}, {literal(target[:3, :3])}}}, {literal(actuators)}, "
        f"{int(kept)}, {int(is_led)}{distance}}}"
        for target, actuators, kept, is_led, distance in zip(*checks[:3], led, distances, strict=True)
    )
    return "\n".join([*lines, *table("pfk_check pfk_checks[PFK_CHECKS]", rows)])


def steps_in_words(machine: Machine, tables: ControllerTables, parts: Sequence[str]) -> Iterator[str]:
    """The most Newton steps of calls, and what bounds them."""
    if "ik" in parts and (machine.completes or machine.has_implicit_joints):
        each = MOST_STEPS_IMPLICIT if machine.has_implicit_joints else MOST_STEPS
        ways = len(tables.reaching.ways)
        most = each * (1 if ways == 1 else ways // ATTEMPTS * (1 + (ATTEMPTS - 1) * MOST_PARTS))
        yield f"pfk_ik takes at most {most:,} Newton steps, mostly less than six."
    if tables.assembling is not None:
        yield "pfk_fk takes mostly five Newton steps, and hundreds where it is led far in parts: `most_steps` in its"
        yield "memory bounds them."
    yield ""


SELF_TEST = (
    "With PFK_SELF_TEST defined it is a program that checks itself:",
    "    cc -std=c99 -D PFK_SELF_TEST FILE -lm -o check && ./check",
)


def _header(
    machine: Machine, made: Translated, tables: ControllerTables, parts: Sequence[str], path: JointPath | None
) -> str:
    """The comment at the top: conventions, actuators, limits and legs, and the notice."""
    mechanism, unit = machine.mechanism, machine.mechanism.length_unit
    lines = [
        f"The kinematics of '{mechanism.name}', written by pfabrik from its description.",
        "",
        "C99, and C++ as it is; only the C library's mathematics. Nothing is allocated, and nothing is static but",
        "constants: the memory of calls is the caller's, one PFK_MEMORY_ for each machine and each thread or interrupt",
        "that calls. `pfk_begin` fills it, and it may not be moved then. No answer depends on an earlier one, but that",
        "it is told whether drives jump, and how far they move.",
        f"On 32 bits this memory is {made.memory:,} bytes, and tables are {made.constants:,} bytes of constants.",
        f"Lengths in {unit}, angles in radians. A pose maps platform coordinates, as at home and from the reference",
        "point, to base coordinates: p is where the reference point is, R the rotation.",
        f"Task: {' '.join(mechanism.task)}."
        + (" What it leaves open follows from the machine." if machine.unset else ""),
        "All of it in the working mode of home: each crank and carriage on the side where it is there.",
        "",
        "The tables are of this machine; of the functions, what it never needs is left out.",
        *(SELF_TEST if "ik" in parts else []),
        "",
        *steps_in_words(machine, tables, parts),
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
        for place, ((joint, bound), (at, is_length)) in enumerate(zip(machine.limits, machine.bounds, strict=True), 1):
            lines.append(f"{place:<9} {joint:<21} {bound} {at:.10g} {unit if is_length else 'rad'}")
    if (links := machine.links_kept(parts)) is not None:
        lines += ["", "pair      links that are at least this far apart"]
        least = f"{mechanism.clearance:.10g} {unit}"
        lines += [f"{place:<9} {' and '.join(names):<33} {least}" for place, names in enumerate(links.names, 1)]
    elif mechanism.clearance is not None:
        lines += ["", "Links may be too near: the clearance of the machine is kept where limits are."]
    if "bodies" in parts:
        lines += ["", "body      name"]
        lines += [f"{place:<9} {name}" for place, name in enumerate(machine.bodies.names)]
    if machine.equal_rods:
        lines += ["", f"Rods that count as equal to the other of their pair: {', '.join(machine.equal_rods)}."]
    lines += ["", "leg       joints"]
    lines += [f"{place:<9} {', '.join(leg.joints)}" for place, leg in enumerate(machine.legs, 1)]
    body = [f"   {comment(line)}".rstrip() for line in [*lines, "", *NOTICE.splitlines()]]
    return "\n".join(["/* " + body[0].strip(), *body[1:], "*/"])
