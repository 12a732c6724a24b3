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
from ...kernels.controller.reached import measure, put_bodies, put_reached, put_turns, reach, rest, stretched_leg
from ...kernels.controller.streamed import begin_stream, drive_to
from ...kernels.legs import records as K
from ...kernels.pose.search_records import SETTINGS
from ...kernels.pose.tables import MACHINE
from ...to_c import Program
from ...to_c.types import StructLayout
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
    ("kernels.pose.live_pose", "STRAIGHT"): 3e-3,
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

    types: str  # of the memory of calls, and this
    kernels: str
    data: str  # constants
    filling: str  # statements that fill the memory
    constants: int
    memory: int


def translated(tables: ControllerTables, conditions: set[str], precision: Precision) -> Translated:
    """The kernels that a file needs, and its static data.

    Values of tables that nothing reads are no facts, and without them less is read: so until nothing more is left out.
    """
    tolerances = _everywhere(SINGLE) if precision == "float" else {}
    facts: dict[tuple[str, str], set[int]] = {}
    layout, loose = StructLayout(), set[tuple[str, str]]()
    while True:
        facts |= _facts(tables, layout.fields)
        program = Program(precision, INTEGER, facts, tolerances, layout)
        used = _translation(program, tables, conditions)
        fields = program.fields_read(program.text(used))
        views = layout.views | {key for key, shapes in program.given.items() if len(shapes) > 1}
        if fields == layout.fields and not program.of_other_shapes and views == layout.views:
            break
        loose |= program.of_other_shapes if fields == layout.fields else set()
        known = {**layout.shapes, **_shapes(tables, fields)}
        shapes = {key: shape for key, shape in known.items() if key not in loose}
        layout = StructLayout(fields, shapes, _constant(tables, fields), views)
    whole = program.text(used)
    data = _data(tables, program, whole, precision)
    read, members = fields_read(whole), "\n".join(data.members)
    types = {name: text for name, text in program.needed(members).items() if TYPE.match(text)}
    kernels = {name: text for name, text in program.needed(used).items() if name not in types}
    told = 20 + (len(tables.reaching.near.driven) + 1) * (8 if precision == "double" else 4)
    memory = f"{MEMORY}typedef struct {{\n{members}\n{TOLD}}} pfk_memory;\n"
    return Translated(
        OWN_INTEGER + _own_types(_prefixed(_without_unread("\n".join(types.values()), read) + memory, program)),
        _own(_prefixed(_without_unread("\n".join([*program.head, *kernels.values()]), read), program)),
        _prefixed("\n".join([*data.lines, PLACES, ",\n".join(data.places), "};"]), program),
        _prefixed("\n".join(data.filling), program) + "\n",
        data.n_constant,
        data.n_memory + told,
    )


def _translation(program: Program, tables: ControllerTables, conditions: set[str]) -> str:
    """Add the kernels that a file needs to a program; C text with their names."""
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
        ("LIVE", begin_stream, (tables.streaming, reaching, matrix, row, row)),
        ("LIVE", drive_to, (tables.streaming, matrix, 0.0)),
        ("NEAREST", stretched_leg, (reaching.near, reaching.scratch)),
        ("NEAREST", project_target, (tables.projecting, reaching, matrix, matrix, row, number, number, number)),
    ]
    names = []
    for condition, kernel, samples in calls:
        if condition in conditions:
            made = program.add(kernel, *samples)
            assert made.name == kernel.__name__ and not made.allocates, made.name
            names.append(made.name)
    return f"int {', '.join(names)};\n"


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


def _facts(tables: ControllerTables, fields: frozenset[tuple[str, str]] | None) -> dict[tuple[str, str], set[int]]:
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


def _shapes(
    tables: ControllerTables, fields: frozenset[tuple[str, str]] | None
) -> dict[tuple[str, str], tuple[int, ...]]:
    """The shapes of arrays that are the same in every NamedTuple of the tables that has them."""
    shapes: dict[tuple[str, str], set[tuple[int, ...]]] = {}
    for value in _parts(tables, fields):
        for field, item in zip(value._fields, value, strict=True):
            if isinstance(item, np.ndarray) and type(value).__name__ not in NOT_CONSTANT:
                shapes.setdefault((type(value).__name__, field), set()).add(item.shape)
    return {key: known.pop() for key, known in shapes.items() if len(known) == 1}


def _parts(value: Any, fields: frozenset[tuple[str, str]] | None) -> Iterator[Any]:
    """A NamedTuple and those in its fields that are read, in all if it is not known which."""
    if isinstance(value, tuple):
        yield value
        for name in type(value)._fields:  # type: ignore[attr-defined]
            if fields is None or isinstance(value, ControllerTables) or (type(value).__name__, name) in fields:
                yield from _parts(getattr(value, name), fields)


def _without_unread(text: str, read: set[str]) -> str:
    """C text without the fields of records that are not read."""

    def shortened(struct: re.Match[str]) -> str:
        fields = re.sub(r"    \w+ (\w+).*\n", lambda field: field[0] if field[1] in read else "", struct[1])
        return struct[0].replace(struct[1], fields or struct[1])

    records = "|".join(sorted(Program().records.values()))
    return re.sub(rf"typedef struct \{{\n([^{{}}]*)\}} (?:{records});\n", shortened, text)


LINKS = ("motions", "numbers", "sizes", "home", "bodies", "pairs", "least")
"""What is constant of links, as far as they have it."""


def _constants(tables: ControllerTables) -> Iterator[tuple[str, Any, tuple[str, ...]]]:
    """What is constant of the tables: NamedTuples by their place, and their fields."""
    reaching, projecting, driving = tables.reaching, tables.projecting, tables.driving
    yield "reaching", reaching, ("near", "far", "whole_near", "whole_far", "home", "ways", "tilt")
    yield "reaching.links", reaching.links, LINKS
    if tables.assembling is not None:
        yield "assembling", tables.assembling, ("stays", "seeds")
    if tables.series is not None:
        yield "series", tables.series, ("motions", "end", "home", "units", "length")
    if driving is not None:
        yield "driving.moving", driving.moving, tuple(each for each in driving.moving._fields if each != "gravity")
        yield "driving", driving, ("numbers", "axes", "tilts", "units")
    if tables.streaming is not None:
        live = tables.streaming.live
        yield "streaming.live", live, ("near",)
        yield "streaming.live.search", live.search, tuple(each for each in live.search._fields if each != "limited")
        yield "streaming.live.plan", live.plan, tuple(each for each in live.plan._fields if each != "links")
        yield "streaming.live.plan.links", live.plan.links, LINKS
    if projecting is not None:
        own, plan = projecting.tables, projecting.tables.plan
        yield "projecting.tables", own, tuple(each for each in own._fields if each != "plan")
        yield "projecting.tables.plan", plan, tuple(each for each in plan._fields if each != "links")
        yield "projecting.tables.plan.links", plan.links, LINKS


def _arrays_in(value: Any) -> Iterator[Any]:
    """All arrays in a NamedTuple."""
    if isinstance(value, tuple):
        for item in value:
            yield from _arrays_in(item)
    elif isinstance(value, np.ndarray):
        yield value


def _read_of(value: Any, fields: frozenset[tuple[str, str]]) -> list[Any]:
    """The arrays of a NamedTuple, without those in it, that are read."""
    names = [name for name in value._fields if (type(value).__name__, name) in fields]
    return [getattr(value, name) for name in names if isinstance(getattr(value, name), np.ndarray)]


def _constant(tables: ControllerTables, fields: frozenset[tuple[str, str]]) -> frozenset[tuple[str, str]]:
    """Fields that are NamedTuples of constants wherever they are."""
    known = {
        id(array)
        for _, owner, names in _constants(tables)
        for name in names
        for array in _arrays_in(getattr(owner, name, ()))
    }
    found: dict[tuple[str, str], bool] = {}
    for value in _parts(tables, fields):
        for name, item in zip(type(value)._fields, value, strict=True):
            if isinstance(item, tuple) and not isinstance(value, ControllerTables):
                read = [array for part in _parts(item, fields) for array in _read_of(part, fields)]
                is_constant = all(id(array) in known or not array.size for array in read)
                key = type(value).__name__, name
                found[key] = found.get(key, True) and is_constant
    return frozenset(key for key, is_constant in found.items() if is_constant)


def _data(tables: ControllerTables, program: Program, text: str, precision: Precision) -> StaticData:
    data = StaticData(program, text, 8 if precision == "double" else 4)
    for place, owner, names in _constants(tables):
        data.constants(place, owner, *names)
    for name, value in zip(tables._fields, tables, strict=True):
        if value is not None:
            data.memory(name, value)
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

TOLD = """\
    pfk_real actuators[PFK_ACTUATORS]; /* of the last answer */
    int most_steps; /* of all searches of a call of pfk_nearest, and of pfk_fk: for its owner to set; 0: no bound */
    pfk_told told;
"""

PLACES = """\
/* Where pointers are in the memory, and the arrays that they are to. */
enum { PFK_UNIT = sizeof(void *) < 4 ? 1 : 4 };
#define PFK_PLACES(pointer, array) \\
    {(uint16_t)(offsetof(pfk_memory, pointer) / PFK_UNIT), (uint16_t)(offsetof(pfk_memory, array) / PFK_UNIT)}
typedef char pfk_has_places[sizeof(pfk_memory) / PFK_UNIT <= UINT16_MAX ? 1 : -1];
static const uint16_t pfk_places[][2] = {"""

TYPE = re.compile(r"(/\*(.(?!\*/))*.\*/\n)?typedef ", re.DOTALL)
"""How the declaration of a type begins."""

MEMORY = """\
/* The memory of the calls of a machine, which `pfk_begin` fills: one for each machine, and for each thread or interrupt
   that calls. For its owner are `told`, what the last call says of itself, and `most_steps`, which bounds the steps of
   a call where it is set, after `pfk_begin`, to more than 0; the rest is of no interest to others. */
"""


def _own_types(text: str) -> str:
    """Declarations of a file without what describes kernels."""
    return re.sub(r"/\* (?!The memory of the calls)[^*]*\*/\n", "", text)


def _own(text: str) -> str:
    """Kernels as part of a file in C and C++."""
    text = re.sub(r"(?m)^typedef \w+ pfk_real;\n", "", text)
    text = text.replace(f"typedef {INTEGER} pfk_integer;\n", "")
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
    names = {
        *program.items,
        *re.findall(r"(?m)^#define (\w+)", "\n".join(program.head)),
        "real",
        "integer",
        "arena",
        "checked",
    }
    names -= {"take"} if "take" not in program.items else set()
    own = {name: own_name(name) for name in names}
    pieces = re.split(r"(/\*.*?\*/|^#include[^\n]*|^#error[^\n]*)", text, flags=re.DOTALL | re.MULTILINE)
    pieces[::2] = [re.sub(r"\w+", lambda word: own.get(word[0], word[0]), piece) for piece in pieces[::2]]
    return re.sub(r"\b(INFINITY|NAN)\b", r"(pfk_real)\1", "".join(pieces))
