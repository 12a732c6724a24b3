"""The kernels of a machine's file, in C: translated for its tables, under a prefix of their own."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np

from ...kernels.controller.assembled import assemble
from ...kernels.controller.driven import put_exerted
from ...kernels.controller.joints_in_series import put_joints, walk
from ...kernels.controller.projected import project_target
from ...kernels.controller.rates import put_rates
from ...kernels.controller.reached import measure, put_bodies, put_reached, put_turns, reach, rest
from ...kernels.legs import records as K
from ...kernels.pose.search_records import SETTINGS
from ...kernels.pose.tables import MACHINE
from ...to_c import Program
from .controller_tables import ASKED, ControllerTables
from .static_data import Precision, StaticData, fields_read

SINGLE = {
    ("kernels.legs.leg_constants", "DAMPING"): 1e-7,
    ("kernels.legs.leg_constants", "KEPT"): 1e-6,
    ("kernels.legs.leg_constants", "NOT_A_ROTATION"): 2e-5,
    ("kernels.legs.leg_constants", "ROUNDED"): 1e-7,
    ("kernels.legs.leg_constants", "LEAST_MARGIN"): 1e-3,
    ("kernels.pose.pose_constants", "ASSEMBLED"): 1e-6,
    ("kernels.pose.pose_constants", "NEARLY_ASSEMBLED"): 1e-5,
    ("kernels.search_constants", "CLOSED"): 1e-6,
    ("kernels.search_constants", "NEARLY_CLOSED"): 1e-5,
    ("kernels.search_constants", "FINE"): 1e-5,
    ("kernels.search_constants", "ROUNDING"): 1e-6,
    ("kernels.search_constants", "LAST"): 1e-9,
    ("kernels.search_constants", "NEXT"): 1e-10,
    ("kernels.search_constants", "KEPT"): 1e-7,
    ("kernels.search_constants", "ROUNDED"): 1e-5,
    ("kernels.search_constants", "DEPENDENT"): 1e-7,
    ("kernels.search_constants", "PROBE"): 1e-3,
    ("kernels.sqp", "DAMPED"): 2.0,
    ("kernels.joints.linearise_loops", "BY_DIFFERENCE"): False,
    ("kernels.clearance.distance_constants", "TOUCHING"): 1e-5,
    ("kernels.clearance.distance_constants", "NEAR"): 3e-4,
    ("kernels.clearance.distance_constants", "ALONG_AXIS"): 1e-6,
    ("kernels.clearance.distance_constants", "ROUNDING"): 1e-7,
    ("kernels.clearance.distance_constants", "FLAT"): 1e-7,
    ("kernels.clearance.distance_constants", "CLOSE"): 1e-6,
    ("kernels.joints.first_order", "ORTHOGONAL"): 1e-6,
    ("kernels.joints.first_order", "NEARLY"): 1e-3,
    ("kernels.controller.rates", "RANK"): 1e-5,
    ("kernels.dynamics.signs", "STILL"): 1e-5,
    ("kernels.controller.joints_in_series", "FITTED"): 1e-6,
    ("kernels.controller.joints_in_series", "NEARLY_FITTED"): 1e-5,
}
"""Constants of kernels in single precision: what was some hundred times the rounding of a double is so of a float."""

TABLES = (K.LEG, K.COORDINATE, K.CONE, K.TASK, SETTINGS, MACHINE)
"""Records whose integers are known of a machine."""

NOT_CONSTANT = ("Starts",)
"""NamedTuples whose arrays have other lengths where kernels make parts of them."""


class Translated(NamedTuple):
    """The kernels of a file, its static data, and their bytes with integers of four."""

    kernels: str
    data: str
    constants: int
    memory: int


def translated(tables: ControllerTables, conditions: set[str], precision: Precision) -> Translated:
    """The kernels that a file needs, and its static data."""
    program = Program(precision, INTEGER, _facts(tables), _everywhere(SINGLE) if precision == "float" else {})
    matrix, row, number = np.zeros((0, 0)), np.zeros(0), 0
    reaching, assembling = tables.reaching, tables.assembling
    calls: list[tuple[str, Any, tuple[Any, ...]]] = [
        ("IK", reach, (reaching, matrix, matrix, number)),
        ("IK", put_reached, (reaching, matrix, row)),
        ("RESTS", rest, (reaching, matrix)),
        ("TURNS", put_turns, (reaching, row, row)),
        ("CLEARANCE", measure, (reaching,)),
        ("BODIES", put_bodies, (reaching, matrix)),
        ("FK", assemble, (assembling, reaching, row, matrix)),
        ("RATES", put_rates, (tables.rating, reaching, matrix, number, number)),
        ("JOINTS", walk, (tables.series, row)),
        ("TO_JOINTS", put_joints, (tables.series, assembling, reaching, row, row)),
        ("EFFORT", put_exerted, (tables.driving, reaching, matrix, row, row, row, row)),
        ("NEAREST", project_target, (tables.projecting, reaching, matrix, matrix, row, number, number)),
    ]
    names = []
    for condition, kernel, samples in calls:
        if condition in conditions:
            made = program.add(kernel, *samples)
            assert made.name == kernel.__name__ and not made.allocates, made.name
            names.append(made.name)
    used = f"int {', '.join(names)};\n"
    text = _without_unread(program.text(used).removesuffix(used))
    data = _data(tables, program, text, precision)
    lines = _prefixed("\n".join(data.lines), program)
    return Translated(_own(_prefixed(text, program)), lines, data.n_constant, data.n_memory)


def _everywhere(tolerances: dict[tuple[str, str], float]) -> dict[tuple[str, str], float]:
    """The same values for the constants where other modules of kernels import them."""
    package = __package__.partition(".")[0]
    kernels = {name: vars(module) for name, module in sys.modules.items() if name.startswith(f"{package}.kernels.")}
    return {
        (importer.partition(".")[2], name): value
        for (module, name), value in tolerances.items()
        for importer, members in kernels.items()
        if members.get(name) is kernels[f"{package}.{module}"][name]
    }


def _facts(tables: ControllerTables) -> dict[tuple[str, str], set[int]]:
    """Values of the integers in the tables, and lengths of arrays."""
    facts: dict[tuple[str, str], set[int]] = {}
    names = Program().records
    for value in _parts(tables):
        for field, item in zip(value._fields, value, strict=True):
            if isinstance(item, np.ndarray) and type(value).__name__ not in NOT_CONSTANT:
                facts.setdefault((type(value).__name__, field), set()).add(len(item))
            if isinstance(item, np.ndarray) and item.dtype in TABLES:
                for name in item.dtype.names:
                    if item.dtype[name].base.kind == "i":
                        values = facts.setdefault((names[item.dtype], name), set())
                        values.update(np.ravel(item[name]).tolist())
    if tables.projecting is not None:
        asked = tables.projecting.question.asked
        facts |= {(names[asked.dtype], name): {value} for name, value in ASKED.items() if name != "has_start"}
        facts[names[asked.dtype], "has_start"] = {0, 1}
    return facts


def _parts(value: Any) -> Iterator[Any]:
    """A NamedTuple and those in it."""
    if isinstance(value, tuple):
        yield value
        for item in value:
            yield from _parts(item)


def _without_unread(text: str) -> str:
    """C text without the fields of records that it does not read."""
    read = fields_read(text)

    def shortened(struct: re.Match[str]) -> str:
        fields = re.sub(r"    \w+ (\w+).*\n", lambda field: field[0] if field[1] in read else "", struct[1])
        return struct[0].replace(struct[1], fields or struct[1])

    records = "|".join(sorted(Program().records.values()))
    return re.sub(rf"typedef struct \{{\n([^{{}}]*)\}} (?:{records});\n", shortened, text)


def _data(tables: ControllerTables, program: Program, text: str, precision: Precision) -> StaticData:
    data = StaticData(program, text, 8 if precision == "double" else 4)
    reaching, projecting = tables.reaching, tables.projecting
    for name in ("near", "far", "whole_near", "whole_far", "home", "ways", "tilt"):
        data.constants(f"reaching.{name}", getattr(reaching, name))
    for name in ("motions", "numbers", "sizes", "home", "bodies", "pairs", "least"):
        data.constants(f"reaching.links.{name}", getattr(reaching.links, name))
    if tables.assembling is not None:
        data.constants("assembling.stays", tables.assembling.stays)
        data.constants("assembling.seeds", tables.assembling.seeds)
    if tables.series is not None:
        for name in ("motions", "end", "home", "units", "length"):
            data.constants(f"series.{name}", getattr(tables.series, name))
    if tables.driving is not None:
        for name in (each for each in tables.driving.moving._fields if each != "gravity"):
            data.constants(f"driving.moving.{name}", getattr(tables.driving.moving, name))
        for name in ("numbers", "axes", "tilts", "units"):
            data.constants(f"driving.{name}", getattr(tables.driving, name))
    if projecting is not None:
        own = projecting.tables
        groups = ("projecting.tables", own), ("projecting.tables.plan", own.plan)
        for place, group in groups:
            for name in (each for each in group._fields if each not in ("plan", "links")):
                data.constants(f"{place}.{name}", getattr(group, name))
        for name in ("sizes", "home", "bodies", "pairs", "least"):
            data.constants(f"projecting.tables.plan.links.{name}", getattr(own.plan.links, name))
    for name, value in zip(tables._fields, tables, strict=True):
        if value is not None:
            data.variable(name, value)
    return data


OWN = """\
#ifdef __cplusplus
#define PFK_MADE(type) type
#else
#define PFK_MADE(type) (type)
#endif

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-variable" /* what a machine does not need is left out */
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

"""
"""What the kernels of a machine need to be C++ too, and no warning."""


INTEGER = "int_fast32_t"
"""The C type of integers: of 32 bits on a controller, of 64 where these are as fast."""

OWN_INTEGER = f"""\
#ifndef PFK_INTEGER
#define PFK_INTEGER {INTEGER} /* int32_t computes on any machine what a controller of 32 bits does */
#endif
typedef PFK_INTEGER pfk_integer;
"""


def _own(text: str) -> str:
    """Kernels as part of a file in C and C++."""
    text = re.sub(r"(?m)^typedef \w+ pfk_real;\n", "", text)
    text = text.replace(f"typedef {INTEGER} pfk_integer;\n", OWN_INTEGER)
    text = re.sub(r"(?m)^ *(\w+) = \1;\n", "", text)
    text = re.sub(r"/\* Memory of one call: .*?\n\}\n", "", text, flags=re.DOTALL)
    text = re.sub(r"\((pfk_\w+)\)\{", r"PFK_MADE(\1){", text)
    text = re.sub(r"(?m)^enum \{ (pfk_\w+) = (-?\w+) \};$", r"#define \1 \2", text)
    return f"{OWN}{text}\n#if defined(__GNUC__)\n#pragma GCC diagnostic pop\n#endif\n"


@cache
def _around() -> frozenset[str]:
    """Names of the functions around the kernels, without their prefix."""
    text = resources.files(__package__).joinpath("controller.c").read_text(encoding="utf-8")
    return frozenset(re.findall(r"(?m)^(?:static )?(?:inline )?(?:const )?\w+ \**pfk_(\w+)\(", text))


def own_name(name: str) -> str:
    """The name of a kernel in a file: another one where a function around the kernels has it."""
    return f"pfk_kernel_{name}" if name in _around() else f"pfk_{name}"


def _prefixed(text: str, program: Program) -> str:
    """C text with the prefix pfk in the names that it declares."""
    names = {*program.items, *re.findall(r"(?m)^#define (\w+)", text), "real", "integer", "arena", "checked"}
    names -= {"take"} if "take" not in program.items else set()
    own = {name: own_name(name) for name in names}
    pieces = re.split(r"(/\*.*?\*/|^#include[^\n]*|^#error[^\n]*)", text, flags=re.DOTALL | re.MULTILINE)
    pieces[::2] = [re.sub(r"\w+", lambda word: own.get(word[0], word[0]), piece) for piece in pieces[::2]]
    return re.sub(r"\b(INFINITY|NAN)\b", r"(pfk_real)\1", "".join(pieces))
