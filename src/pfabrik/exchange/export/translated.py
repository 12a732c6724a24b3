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
    """The kernels that a file needs, and its static data.

    Values of tables that nothing reads are no facts, and without them less is read: so until nothing more is left out.
    """
    tolerances = _everywhere(SINGLE) if precision == "float" else {}
    fields: set[tuple[str, str]] | None = None
    facts: dict[tuple[str, str], set[int]] = {}
    shapes: dict[tuple[str, str], tuple[int, ...]] = {}
    loose: set[tuple[str, str]] = set()
    while True:
        facts |= _facts(tables, fields)
        program = Program(precision, INTEGER, facts, tolerances, fields, shapes)
        text = _translation(program, tables, conditions)
        before, fields = fields, program.fields_read(text)
        if fields == before and not program.of_other_shapes:
            break
        loose |= program.of_other_shapes if fields == before else set()
        known = shapes | _shapes(tables, fields)
        shapes = {key: shape for key, shape in known.items() if key not in loose}
    text = _without_unread(text)
    data = _data(tables, program, text, precision)
    lines = _prefixed("\n".join(data.lines), program)
    return Translated(_own(_prefixed(text, program)), lines, data.n_constant, data.n_memory)


def _translation(program: Program, tables: ControllerTables, conditions: set[str]) -> str:
    """The kernels that a file needs in C, without its prefix."""
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
    return program.text(used).removesuffix(used)


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


def _facts(tables: ControllerTables, fields: set[tuple[str, str]] | None) -> dict[tuple[str, str], set[int]]:
    """Values of the integers in the tables, and lengths of arrays: of those in the fields that are read, if known."""
    facts: dict[tuple[str, str], set[int]] = {}
    names = Program().records
    for value in _parts(tables, fields):
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


def _shapes(tables: ControllerTables, fields: set[tuple[str, str]] | None) -> dict[tuple[str, str], tuple[int, ...]]:
    """The shapes of arrays that are the same in every NamedTuple of the tables that has them."""
    shapes: dict[tuple[str, str], set[tuple[int, ...]]] = {}
    for value in _parts(tables, fields):
        for field, item in zip(value._fields, value, strict=True):
            if isinstance(item, np.ndarray) and type(value).__name__ not in NOT_CONSTANT:
                shapes.setdefault((type(value).__name__, field), set()).add(item.shape)
    return {key: known.pop() for key, known in shapes.items() if len(known) == 1}


def _parts(value: Any, fields: set[tuple[str, str]] | None) -> Iterator[Any]:
    """A NamedTuple and those in its fields that are read, in all if it is not known which."""
    if isinstance(value, tuple):
        yield value
        for name in type(value)._fields:  # type: ignore[attr-defined]
            if fields is None or isinstance(value, ControllerTables) or (type(value).__name__, name) in fields:
                yield from _parts(getattr(value, name), fields)


def _without_unread(text: str) -> str:
    """C text without the fields of records that it does not read."""
    read = fields_read(text)

    def shortened(struct: re.Match[str]) -> str:
        fields = re.sub(r"    \w+ (\w+).*\n", lambda field: field[0] if field[1] in read else "", struct[1])
        return struct[0].replace(struct[1], fields or struct[1])

    records = "|".join(sorted(Program().records.values()))
    return re.sub(rf"typedef struct \{{\n([^{{}}]*)\}} (?:{records});\n", shortened, text)


LINKS = ("motions", "numbers", "sizes", "home", "bodies", "pairs", "least")
"""What is constant of links, as far as they have it."""


def _data(tables: ControllerTables, program: Program, text: str, precision: Precision) -> StaticData:
    data = StaticData(program, text, 8 if precision == "double" else 4)
    reaching, projecting = tables.reaching, tables.projecting
    data.constants("reaching", reaching, "near", "far", "whole_near", "whole_far", "home", "ways", "tilt")
    data.constants("reaching.links", reaching.links, *LINKS)
    if tables.assembling is not None:
        data.constants("assembling", tables.assembling, "stays", "seeds")
    if tables.series is not None:
        data.constants("series", tables.series, "motions", "end", "home", "units", "length")
    if tables.driving is not None:
        moving = tables.driving.moving
        data.constants("driving.moving", moving, *(each for each in moving._fields if each != "gravity"))
        data.constants("driving", tables.driving, "numbers", "axes", "tilts", "units")
    if projecting is not None:
        own = projecting.tables
        data.constants("projecting.tables", own, *(each for each in own._fields if each != "plan"))
        data.constants("projecting.tables.plan", own.plan, *(each for each in own.plan._fields if each != "links"))
        data.constants("projecting.tables.plan.links", own.plan.links, *LINKS)
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
