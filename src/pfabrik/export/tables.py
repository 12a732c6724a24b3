"""What is a machine's own in an exported file: numbers, tables of its legs, and poses that it checks itself with."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from ..arrays import Record
from ..decomposition.leg_table import COMPLETED_WITHIN
from ..kernels.legs import records as K
from .machine_data import Coordinate, ExportedLeg, Machine
from .self_test import Checks
from .wording import ACCURACY, Precision, comment, literal, quoted

KINDS = {K.ROD: "PFK_ROD", K.PIVOT: "PFK_PIVOT", K.REDUNDANT: "PFK_ARM"}
FRAMES = {K.FROM_BASE: "PFK_FROM_BASE", K.FROM_PLATFORM: "PFK_FROM_PLATFORM", K.FROM_ITSELF: "PFK_FROM_ITSELF"}
CARRIERS = {K.CRANK: "PFK_CRANK", K.CARRIAGE: "PFK_CARRIAGE", K.SHARED: "PFK_SHARED"}
ENDINGS = {K.WELD: "PFK_WELD", K.HINGE: "PFK_HINGE", K.CROSS: "PFK_CROSS", K.TRIPLE: "PFK_TRIPLE", K.BALL: "PFK_BALL"}
TOGETHER = 6
"""Short values in a line at most."""

FAR = 1e30
"""Stands for a bound that there is not."""


def features(machine: Machine, parts: Sequence[str]) -> set[str]:
    """What of the routines a machine and the parts that are asked for have a use for."""
    records = [leg.record for leg in machine.legs]
    found = {part.upper() for part in parts}
    completes = "ik" in parts and machine.completes
    asked: dict[str, object] = {
        "ARMS": machine.n_arms > 0,
        "LED": machine.has_implicit_joints,
        "YAW": completes and machine.rotations == 1,
        "TURNS": "ik" in parts and any(each.may_turn for each in machine.driven),
        "PIVOTS": any(record["kind"] == K.PIVOT for record in records),
        "CONES": "limits" in parts and len(machine.cones) > 0,
        "TWISTS": any(record["twists"] for record in records),
        "COMPLETES": completes,
        "LEADS": completes or machine.has_implicit_joints,
        "MOVES": completes or machine.has_implicit_joints or "fk" in parts,
        "RESTS": "limits" in parts or (machine.n_arms and "fk" in parts) or ("ik" in parts and not completes),
        "SOLVES": machine.equations > 0 or "fk" in parts,
    }
    return found | {name for name, is_asked in asked.items() if is_asked}


def machine_h(machine: Machine, parts: Sequence[str]) -> str:
    """Numbers for who calls the file."""
    limits = len(machine.limits) if "limits" in parts else 0
    return f"enum {{ PFK_ACTUATORS = {len(machine.driven)}, PFK_LIMITS = {limits} }};\n"


def tables_h(machine: Machine, precision: Precision, parts: Sequence[str], routines: str) -> str:
    """Numbers and tables for the routines, which declare what a leg is."""
    lines, members = [*_numbers(machine, precision, parts)], _members(routines, "pfk_leg")
    lines += _table("pfk_leg pfk_legs[PFK_LEGS]", (_leg(leg, members) for leg in machine.legs))
    lines += _table("pfk_coordinate pfk_driven[PFK_ACTUATORS]", map(_coordinate, machine.driven))
    if "limits" in parts:
        lines += _table("pfk_coordinate pfk_limited[]", map(_coordinate, machine.limited))
        lines += _table("pfk_cone pfk_cones[]", map(_cone, machine.cones)) if len(machine.cones) else []
        lines += _words("limit", [f"beyond a limit: joint {joint}, {bound}" for joint, bound in machine.limits])
    joints = [", ".join(leg.joints) for leg in machine.legs]
    lines += _words("leg", [f"does not reach, or does not close: the leg of {each}" for each in joints])
    return "\n".join(lines)


def checks_h(checks: Checks, exact: float) -> str:
    """Poses that the file checks itself with, and how exactly actuators must agree [L or rad]."""
    lines = [f"#define PFK_EXACT {literal(exact)}", f"enum {{ PFK_CHECKS = {len(checks.targets)} }};", ""]
    rows = (
        f"    {{{{{literal(target[:3, 3])}, {literal(target[:3, :3])}}}, {literal(actuators)}, {int(kept)}}}"
        for target, actuators, kept in zip(*checks, strict=True)
    )
    return "\n".join([*lines, *_table("pfk_check pfk_checks[PFK_CHECKS]", rows)])


def _numbers(machine: Machine, precision: Precision, parts: Sequence[str]) -> Iterator[str]:
    accuracy, turning = ACCURACY[precision], not machine.mechanism.end_effector_is_joint
    forward = "fk" in parts
    unknowns = machine.n_arms + ((6 if turning else 3) if forward else machine.unset)
    yield "/* Lengths are in the unit of the machine; L is the radius of the smallest sphere around its joints. */"
    yield f"#define PFK_SIZE {literal(machine.mechanism.characteristic_length)}"
    yield f"#define PFK_KEPT {literal(accuracy.kept)}         /* a limit is kept to this [L or rad] */"
    yield f"#define PFK_CLOSED {literal(accuracy.closed)}       /* equations are closed as well as they can be */"
    yield f"#define PFK_CLOSE {literal(accuracy.close)}        /* equations count as closed [L or rad] */"
    yield f"#define PFK_DEAD {literal(accuracy.dead)}         /* square of the sine of an angle from a dead point */"
    yield f"#define PFK_RANK {literal(accuracy.rank)}         /* share of the largest that says nothing any more */"
    yield f"#define PFK_NO_ROTATION {literal(accuracy.rotation)}  /* deviation of a target from a rotation */"
    near = 0.5 if machine.has_implicit_joints else COMPLETED_WITHIN  # with arms there are more poses that close
    yield f"#define PFK_NEAR {near}            /* what follows goes no farther at once [L or rad] */"
    yield f"#define PFK_FARTHEST {COMPLETED_WITHIN}        /* nor than this where nothing nearer closes */"
    yield "enum {"
    yield f"    PFK_LEGS = {len(machine.legs)},"
    yield f"    PFK_FRAMES = {machine.n_frames},"
    yield f"    PFK_ARMS = {machine.n_arms},"
    yield f"    PFK_COLUMNS = {6 + machine.n_arms}, /* what equations have derivatives by */"
    yield f"    PFK_RANGES = {len(machine.limited)},"
    yield f"    PFK_CONES = {len(machine.cones)},"
    yield f"    PFK_ROTATIONS = {machine.rotations}, /* of the pose's three that the task sets */"
    yield f"    PFK_WAYS = {6 if machine.has_implicit_joints else 3}, /* in which a target is led to */"
    yield f"    PFK_TURNING = {int(turning)}, /* 0: the end effector is a point */"
    yield f"    PFK_OWN_ROWS = {machine.equations}, /* equations of the legs */"
    yield f"    PFK_ROWS = {machine.equations + machine.drive_equations * forward}, /* and of actuators */"
    yield f"    PFK_UNKNOWNS = {unknowns}"
    yield "};"
    if {"IK", "MOVES"} & features(machine, parts):
        yield f"static const int pfk_axes[3] = {{{', '.join(map(str, machine.axes))}}}; /* 1: the task sets x, y, z */"
    yield f"static const pfk_real pfk_reference[3] = {literal(np.asarray(machine.mechanism.reference_point))};"
    yield ""


def _table(declared: str, rows: Iterable[str]) -> Iterator[str]:
    yield f"static const {declared} = {{"
    yield ",\n".join(rows) or "    {0}"
    yield "};"
    yield ""


def _words(name: str, words: Sequence[str]) -> Iterator[str]:
    """Text in rows of the same width: pointers would have to be set when the file is loaded."""
    said = [quoted(each) for each in words] or ['""']
    yield f"static const char pfk_{name}_words[][{max(map(len, said)) - 1}] = {{"
    yield from (f"    {each}," for each in said)
    yield "};"
    yield ""


def _members(routines: str, struct: str) -> dict[str, str]:
    """The members of a structure in the order of its declaration, and what is zero of the type of each."""
    plain = re.sub(r"/\*.*?\*/", "", routines, flags=re.DOTALL)
    end = plain.index(f"}} {struct};")
    found = {}
    for declared in plain[plain.rindex("{", 0, end) + 1 : end].split(";")[:-1]:
        kind, names = declared.split(None, 1)
        for name in names.split(","):
            depth = name.count("[")
            found[name.split("[")[0].strip()] = "{" * depth + ("0" if kind == "int" else "0.0") + "}" * depth
    return found


def _leg(leg: ExportedLeg, members: Mapping[str, str]) -> str:
    """A leg, member by member in their order: C++ knows other ways only since 2020."""
    record = leg.record
    told = {"kind": KINDS[int(record["kind"])], "proximal": CARRIERS.get(int(record["proximal"]), "")}
    told["frame"] = FRAMES.get(int(record["frame"]), str(record["frame"]))
    if record["kind"] != K.REDUNDANT:
        told["foot_end"] = ENDINGS[int(record["base_end"])]
    if record["kind"] == K.ROD:
        told["head_end"] = ENDINGS[int(record["platform_end"])]
    whole = {name: record[name] for name in ("slides", "twists", "base_end_aimed", "platform_end_aimed", "upright")}
    whole |= {"main": leg.main, "is_back": record["reversed"], "pairs": record["axis_rows"]}
    whole |= {"on": record["redundant"] + 1, "is_inner": record["inner"]}
    if record["kind"] == K.REDUNDANT:
        whole |= {name: record[name] for name in ("makes", "column", "at_platform_end", "orients", "has_rows")}
        whole |= {"is_twin": record["mirror_of"] >= 0}
    told |= {name: str(int(value)) for name, value in whole.items() if value}
    told |= {name: literal(value) for name, value in leg.numbers.items() if np.any(value)}
    values = {name: told.pop(name, "") or zero for name, zero in members.items()}
    assert not any(told.values()), f"no members of pfk_leg: {told}"
    lines = [f"    {{ /* {comment(', '.join(leg.joints))} */"]
    together: list[str] = []
    for name, value in values.items():
        is_long = value.startswith("{") and value != members[name]
        if together and (is_long or len(together) == TOGETHER):
            lines.append(_labelled(together, values))
            together = []
        together.append(name)
        if is_long:
            lines.append(_labelled(together, values))
            together = []
    return "\n".join([*lines, *([_labelled(together, values)] if together else []), "    }"])


def _labelled(names: Sequence[str], values: Mapping[str, str]) -> str:
    """A line of values behind their names."""
    return f"        /* {', '.join(names)} */ {', '.join(values[name] for name in names)},"


def _coordinate(each: Coordinate) -> str:
    lo, hi = (literal(float(np.clip(bound, -FAR, FAR))) for bound in (each.lo, each.hi))
    whole = f"{each.leg}, {each.place}, {int(each.is_length)}, {int(each.turns)}"
    return f"    {{{whole}, {literal(each.sense)}, {lo}, {hi}, {literal(each.home)}}}"


def _cone(cone: Record) -> str:
    is_head = int(cone["place"] == K.PLATFORM_LINE)
    return f"    {{{int(cone['leg'])}, {is_head}, {literal(cone['axis'])}, {literal(float(cone['half_angle']))}}}"
