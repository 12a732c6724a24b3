"""The part of an exported file that belongs to one machine: constants, tables of its legs, and poses to check."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..arrays import Floats, Record
from ..closure.assemble import is_over_determined
from ..decomposition.leg_table import COMPLETED_WITHIN
from ..kernels.legs import records as K
from ..model import model_of
from ..motion.joint_path import JointPath, PathMotion
from ..motion.tilt_axis import tilt_axis
from .exported_links import ExportedLinks, angles_needed
from .link_tables import link_tables
from .machine_data import Coordinate, ExportedLeg, Machine
from .self_test import Checks
from .wording import ACCURACY, Precision, comment, literal, table, words

KINDS = {K.ROD: "PFK_ROD", K.PIVOT: "PFK_PIVOT", K.REDUNDANT: "PFK_REDUNDANT"}
FRAMES = {K.FROM_BASE: "PFK_FROM_BASE", K.FROM_PLATFORM: "PFK_FROM_PLATFORM", K.FROM_ITSELF: "PFK_FROM_ITSELF"}
PROXIMAL_JOINTS = {K.CRANK: "PFK_CRANK", K.CARRIAGE: "PFK_CARRIAGE", K.SHARED: "PFK_SHARED"}
ENDINGS = {K.WELD: "PFK_WELD", K.HINGE: "PFK_HINGE", K.CROSS: "PFK_CROSS", K.TRIPLE: "PFK_TRIPLE", K.BALL: "PFK_BALL"}
VALUES_A_LINE = 6
"""Most short values in a line."""

FAR = 1e30
"""The bound of a coordinate without one [L or rad]."""


def features(machine: Machine, parts: Sequence[str], path: JointPath | None = None) -> set[str]:
    """The names of conditions in `kinematics.c` that hold for a machine, the parts asked for and named joints."""
    records = [leg.record for leg in machine.legs]
    names = {part.upper() for part in parts}
    completes = "ik" in parts and machine.completes
    conditions: dict[str, object] = {
        "REDUNDANT": machine.n_redundant > 0,
        "IMPLICIT": machine.has_implicit_joints,
        "ONE_TILT": completes and tilt_axis(machine.mechanism) is not None,
        "YAW": completes and machine.rotations == 1,
        "TURNS": "ik" in parts and any(driven.may_turn for driven in machine.driven),
        "PIVOTS": any(record["kind"] == K.PIVOT for record in records),
        "CLEARANCE": (links := machine.links_kept(parts)) is not None,
        "BODIES": links is not None and len(links.motions) > 0,
        "SOLIDS": links is not None and links.has_solids,
        "CONES": "limits" in parts and len(machine.cones) > 0,
        "TWISTS": any(record["twists"] for record in records),
        "COMPLETES": completes,
        "CONTINUES": completes or machine.has_implicit_joints,
        "MOVES": completes or machine.has_implicit_joints or "fk" in parts,
        "RESTS": {"limits", "rates"} & {*parts}
        or path is not None
        or (machine.n_redundant and "fk" in parts)
        or ("ik" in parts and not completes),
        "STAYS": "fk" in parts and not is_over_determined(model_of(machine.mechanism).closure),
        "SOLVES": machine.equations > 0 or "fk" in parts or "rates" in parts,
        "JOINTS": path is not None,
        "TO_ACTUATORS": path is not None and "ik" in parts,
        "TO_JOINTS": path is not None and "fk" in parts,
    }
    return names | {name for name, holds in conditions.items() if holds}


def machine_h(machine: Machine, parts: Sequence[str], path: JointPath | None = None) -> str:
    """Constants for callers of the file."""
    limits = len(machine.limits) if "limits" in parts else 0
    counts = {"PFK_ACTUATORS": len(machine.driven), "PFK_LIMITS": limits}
    counts |= {} if path is None else {"PFK_JOINTS": len(path.coordinates)}
    counts |= {"PFK_RATES": 6 if path is None else len(path.coordinates)} if "rates" in parts else {}
    links = machine.links_kept(parts)
    counts |= {} if links is None else {"PFK_PAIRS": len(links.pairs)}
    constants = f"enum {{ {', '.join(f'{name} = {count}' for name, count in counts.items())} }};\n"
    if links is None:
        return constants
    return f"#define PFK_CLEARANCE {literal(links.clearance)} /* least distance between links [length] */\n{constants}"


def tables_h(
    machine: Machine, precision: Precision, parts: Sequence[str], routines: str, path: JointPath | None = None
) -> str:
    """Constants and tables for the routines, in the members of the structures that these declare."""
    lines, members = [*_numbers(machine, precision, parts, path)], _members(routines, "pfk_leg")
    links = machine.links_kept(parts)
    lines += table(
        "pfk_leg pfk_legs[PFK_LEGS]",
        (_leg(leg, _aimed(machine, place, links), members) for place, leg in enumerate(machine.legs)),
    )
    lines += table("pfk_coordinate pfk_driven[PFK_ACTUATORS]", map(_coordinate, machine.driven))
    if path is not None:
        lines += table("pfk_joint pfk_joints[PFK_JOINTS]", (_joint(motion, path) for motion in path.motions))
    if path is not None or "rates" in parts:
        lines += [f"static const pfk_real pfk_rate_units[] = {literal(rate_units(machine, path))};", ""]
    if "limits" in parts:
        lines += table("pfk_coordinate pfk_limited[]", map(_coordinate, machine.limited))
        lines += table("pfk_cone pfk_cones[]", map(_cone, machine.cones)) if len(machine.cones) else []
        lines += words("limit", [f"beyond a limit: joint {joint}, {bound}" for joint, bound in machine.limits])
    if links is not None:
        lines += link_tables(links)
    joints = [", ".join(leg.joints) for leg in machine.legs]
    lines += words("leg", [f"does not reach, or does not close: the leg of {each}" for each in joints])
    return "\n".join(lines)


def checks_h(checks: Checks, exact: float) -> str:
    """Poses for the self-test, and the tolerance of actuators [L or rad]."""
    lines = [f"#define PFK_EXACT {literal(exact)}", f"enum {{ PFK_CHECKS = {len(checks.targets)} }};", ""]
    distances = [""] * len(checks.targets)
    if checks.distances is not None:
        distances = [f", {literal(float(distance))}" for distance in checks.distances]
    rows = (
        f"    {{{{{literal(target[:3, 3])}, {literal(target[:3, :3])}}}, {literal(actuators)}, {int(kept)}{distance}}}"
        for target, actuators, kept, distance in zip(*checks[:3], distances, strict=True)
    )
    return "\n".join([*lines, *table("pfk_check pfk_checks[PFK_CHECKS]", rows)])


def rate_units(machine: Machine, path: JointPath | None) -> Floats:
    """The units of rates: L of lengths, 1 of angles."""
    size = machine.mechanism.characteristic_length
    if path is None:
        return np.array([size] * 3 + [1.0] * 3)
    return np.array([1.0 if each.kind == "angle" else size for each in path.coordinates])


def _joint(motion: PathMotion, path: JointPath) -> str:
    numbers = ", ".join(map(literal, (motion.sign, path.home[motion.place], motion.axis, motion.point)))
    return f"    {{{motion.place}, {int(motion.kind == 'turn')}, {numbers}}}"


def _numbers(
    machine: Machine, precision: Precision, parts: Sequence[str], path: JointPath | None = None
) -> Iterator[str]:
    accuracy, turning = ACCURACY[precision], not machine.mechanism.end_effector_is_joint
    forward, drives = "fk" in parts, "fk" in parts or "rates" in parts
    unknowns = machine.n_redundant + ((6 if turning else 3) if forward else machine.unset)
    unknowns = max(unknowns, len(path.coordinates) if path is not None and forward else 0)
    yield "/* Lengths are in the unit of the machine; L is the radius of the smallest sphere around its joints. */"
    yield f"#define PFK_SIZE {literal(machine.mechanism.characteristic_length)}"
    yield f"#define PFK_KEPT {literal(accuracy.kept)}         /* a limit is kept to this [L or rad] */"
    yield f"#define PFK_CLOSED {literal(accuracy.closed)}       /* equations are closed as well as they can be */"
    yield f"#define PFK_CLOSE {literal(accuracy.close)}        /* equations count as closed [L or rad] */"
    yield f"#define PFK_DEAD {literal(accuracy.dead)}         /* square of the sine of an angle from a dead point */"
    yield f"#define PFK_RANK {literal(accuracy.rank)}         /* rows below this share of the largest do not count */"
    yield f"#define PFK_NO_ROTATION {literal(accuracy.rotation)}  /* deviation of a target from a rotation */"
    farthest_at_once = 0.5 if machine.has_implicit_joints else COMPLETED_WITHIN  # implicit joints allow more poses
    yield f"#define PFK_NEAR {farthest_at_once}            /* what is completed goes no farther at once [L or rad] */"
    yield f"#define PFK_FARTHEST {COMPLETED_WITHIN}        /* nor than this where nothing nearer closes */"
    yield "enum {"
    yield f"    PFK_LEGS = {len(machine.legs)},"
    yield f"    PFK_FRAMES = {machine.n_frames},"
    yield f"    PFK_N_REDUNDANT = {machine.n_redundant},"
    yield f"    PFK_COLUMNS = {6 + machine.n_redundant}, /* derivatives: by the pose, by redundant joints */"
    yield f"    PFK_RANGES = {len(machine.limited)},"
    yield f"    PFK_CONES = {len(machine.cones)},"
    yield f"    PFK_ROTATIONS = {machine.rotations}, /* of the pose's three that the task sets */"
    yield f"    PFK_ATTEMPTS = {6 if machine.has_implicit_joints else 3}, /* to reach a target */"
    yield f"    PFK_TURNING = {int(turning)}, /* 0: the end effector is a point */"
    yield f"    PFK_OWN_ROWS = {machine.equations}, /* equations of the legs */"
    yield f"    PFK_ROWS = {machine.equations + machine.drive_equations * drives}, /* and of actuators */"
    yield f"    PFK_UNKNOWNS = {unknowns}"
    yield "};"
    if {"IK", "MOVES"} & features(machine, parts, path):
        yield f"static const int pfk_axes[3] = {{{', '.join(map(str, machine.axes))}}}; /* 1: the task sets x, y, z */"
    axis = tilt_axis(machine.mechanism)
    if axis is not None and "ONE_TILT" in features(machine, parts, path):
        yield f"static const pfk_real pfk_tilt_axis[3] = {literal(axis)}; /* the only one of its turns */"
    yield f"static const pfk_real pfk_reference[3] = {literal(np.asarray(machine.mechanism.reference_point))};"
    yield ""


def _members(routines: str, struct: str) -> dict[str, str]:
    """The members of a structure in the order of its declaration, with a zero of the type of each."""
    plain = re.sub(r"/\*.*?\*/", "", routines, flags=re.DOTALL)
    end = plain.index(f"}} {struct};")
    members = {}
    for declaration in plain[plain.rindex("{", 0, end) + 1 : end].split(";")[:-1]:
        kind, variables = declaration.split(None, 1)
        for variable in variables.split(","):
            depth = variable.count("[")
            members[variable.split("[")[0].strip()] = "{" * depth + ("0" if kind == "int" else "0.0") + "}" * depth
    return members


def _aimed(machine: Machine, place: int, links: ExportedLinks | None = None) -> dict[str, int]:
    """Of both ends of a leg: 1 where angles have limits or place links, 2 where rates need them, for a driven hinge or
    a twist."""
    record = machine.legs[place].record
    driven = [each.place for each in machine.driven if each.leg == place]
    aimed = {}
    for end, start in (("base_end", K.BASE_END), ("platform_end", K.PLATFORM_END)):
        is_driven = any(start <= each < start + 3 for each in driven)
        aimed[f"{end}_aimed"] = (
            2
            if is_driven or (record["twists"] and record[end] == K.CROSS)
            else int(record[f"{end}_aimed"] or (record["kind"] == K.ROD and angles_needed(links, place, start)))
        )
    return aimed


def _leg(leg: ExportedLeg, aimed: Mapping[str, int], members: Mapping[str, str]) -> str:
    """A leg, member by member in order: C++ has had designated initialisers only since 2020."""
    record = leg.record
    fields = {"kind": KINDS[int(record["kind"])], "proximal": PROXIMAL_JOINTS.get(int(record["proximal"]), "")}
    fields["frame"] = FRAMES.get(int(record["frame"]), str(record["frame"]))
    if record["kind"] != K.REDUNDANT:
        fields["base_ending"] = ENDINGS[int(record["base_end"])]
    if record["kind"] == K.ROD:
        fields["platform_ending"] = ENDINGS[int(record["platform_end"])]
    integers = {name: record[name] for name in ("slides", "twists", "upright")} | {**aimed}
    integers |= {"main": leg.main, "is_back": record["reversed"], "pairs": record["axis_rows"]}
    integers |= {"on": record["redundant"] + 1, "is_inner": record["inner"]}
    if record["kind"] == K.REDUNDANT:
        integers |= {name: record[name] for name in ("makes", "column", "at_platform_end", "orients", "has_rows")}
        integers |= {"is_mirror": record["mirror_of"] >= 0}
    fields |= {name: str(int(value)) for name, value in integers.items() if value}
    fields |= {name: literal(value) for name, value in leg.numbers.items() if np.any(value)}
    values = {name: fields.pop(name, "") or zero for name, zero in members.items()}
    assert not any(fields.values()), f"no members of pfk_leg: {fields}"
    lines = [f"    {{ /* {comment(', '.join(leg.joints))} */"]
    group: list[str] = []
    for name, value in values.items():
        is_long = value.startswith("{") and value != members[name]
        if group and (is_long or len(group) == VALUES_A_LINE):
            lines.append(_labelled(group, values))
            group = []
        group.append(name)
        if is_long:
            lines.append(_labelled(group, values))
            group = []
    return "\n".join([*lines, *([_labelled(group, values)] if group else []), "    }"])


def _labelled(names: Sequence[str], values: Mapping[str, str]) -> str:
    """A line of values after a comment with their names."""
    return f"        /* {', '.join(names)} */ {', '.join(values[name] for name in names)},"


def _coordinate(coordinate: Coordinate) -> str:
    lo, hi = (literal(float(np.clip(bound, -FAR, FAR))) for bound in (coordinate.lo, coordinate.hi))
    integers = f"{coordinate.leg}, {coordinate.place}, {int(coordinate.is_length)}, {int(coordinate.turns)}"
    return f"    {{{integers}, {literal(coordinate.sense)}, {lo}, {hi}, {literal(coordinate.home)}}}"


def _cone(cone: Record) -> str:
    is_platform_end = int(cone["place"] == K.PLATFORM_LINE)
    return (
        f"    {{{int(cone['leg'])}, {is_platform_end}, {literal(cone['axis'])}, {literal(float(cone['half_angle']))}}}"
    )
