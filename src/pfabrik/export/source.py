"""The exported file, put together."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from importlib import resources

import numpy as np

from .declarations import declarations, header
from .equations import drive_function, equations_function
from .functions import functions
from .legs import LegCode, PivotShape, RodShape
from .machine import Machine
from .placing import place_function
from .solving import solving
from .wording import ACCURACY, Precision, comment, in_words, literal

ROD_FIELDS = {
    "foot": "[3]",
    "head": "[3]",
    "length": "",
    "line": "[3]",
    "axis": "[3]",
    "centre": "[3]",
    "spoke": "[3]",
    "across": "[3]",
    "side": "",
    "reach": "[3]",
    "foot_axes": "[3][3]",
    "foot_side": "",
    "head_axes": "[3][3]",
    "head_side": "",
    "twist": "",
}
PIVOT_FIELDS = {
    "foot": "[3]",
    "head": "[3]",
    "foot_axes": "[3][3]",
    "foot_side": "",
    "slides": "[3][3]",
    "fixed": "[3][3]",
    "kept": "[3][3]",
    "square": "[3]",
}
LEG_FIELDS = {
    "head": "[3]",
    "foot": "[3]",
    "arm": "[3]",
    "span": "[3]",
    "u": "[3]",
    "length": "",
    "foot_line": "[3]",
    "head_line": "[3]",
    "carrier": "",
    "cosine": "",
    "sine": "",
    "foot_angle": "[3]",
    "head_angle": "[3]",
    "slide": "[3]",
    "follow": "[6]",
}
_NAME = re.compile(r"^(?:static|void) .*?\b(pfk_\w+)\(", re.MULTILINE)
_OFFERED = ("pfk_home", "pfk_pose_rpy", "pfk_rpy")


def source(machine: Machine, name: str, precision: Precision, parts: Sequence[str], self_test: str) -> str:
    """The text of the file."""
    forward = "fk" in parts
    shapes = machine.letters
    texts = [place_function(shape, letter, machine.needs(shape, forward)) for shape, letter in shapes.items()]
    completes = "ik" in parts and bool(machine.unset)
    solves = forward or completes or (bool(machine.rows_at_rest) and ("ik" in parts or "limits" in parts))
    if solves:
        texts += [equations_function(shape, letter) for shape, letter in shapes.items() if _has_rows(machine, shape)]
    if forward:
        drives = {(machine.codes[each.leg].shape, each.drive): None for each in machine.driven}
        texts += [
            drive_function(shape, machine.letters[shape], drive) for shape, drive in drives if drive.what != "carrier"
        ]
    texts += [solving(machine, forward, solves, completes), functions(machine, parts)]
    written = "\n".join(texts)
    routines = "\n".join(_routines(written))
    body = routines + written
    blocks = [
        header(machine, parts),
        "#ifndef PFK_H",
        "#define PFK_H",
        "",
        declarations(machine, parts),
        "#endif",
        "",
        "#ifndef PFK_DECLARATIONS_ONLY",
        "",
        "#include <math.h>",
        "",
        _constants(machine, precision, forward),
        _types(body),
        _tables(machine, body),
        body,
        self_test,
        "#endif",
        "",
    ]
    text = "\n".join(blocks)
    return in_words(re.sub(r"\n{3,}", "\n\n", text), name, precision)


def _has_rows(machine: Machine, shape: RodShape | PivotShape) -> bool:
    return any(machine.codes[row.leg].shape == shape for row in machine.rows)


def _constants(machine: Machine, precision: Precision, forward: bool) -> str:
    accuracy, n_rows = ACCURACY[precision], len(machine.rows) + len(machine.drive_rows) * forward
    unknowns = (3 if machine.mechanism.end_effector_is_joint else 6) if forward else machine.unset
    reference = literal(np.asarray(machine.mechanism.reference_point))
    lines = [
        "/* Lengths are in the unit of the machine; L is the radius of the smallest sphere around its joints. */",
        f"#define PFK_SIZE {literal(machine.mechanism.characteristic_length)}",
        f"#define PFK_REFERENCE {reference}",
        f"#define PFK_TURN {literal(2.0 * np.pi)}",
        f"#define PFK_KEPT {literal(accuracy.kept)}         /* a limit is kept to this [L or rad] */",
        f"#define PFK_CLOSED {literal(accuracy.closed)}       /* equations are closed as well as they can be */",
        f"#define PFK_CLOSE {literal(accuracy.close)}        /* equations count as closed [L or rad] */",
        f"#define PFK_DEAD {literal(accuracy.dead)}         /* square of the sine of an angle from a dead point */",
        f"#define PFK_RANK {literal(accuracy.rank)}         /* share of the largest that says nothing any more */",
        f"#define PFK_NO_ROTATION {literal(accuracy.rotation)}  /* deviation of a target from a rotation */",
        "#define PFK_FARTHEST 2.0        /* what a task leaves open goes no farther than this [L or rad] */",
        "#define PFK_LONGEST_STEP 0.5    /* [L or rad] */",
        "enum {",
        f"    PFK_LEGS = {len(machine.codes)},",
        f"    PFK_OWN_ROWS = {len(machine.rows)},",
        f"    PFK_ROWS = {max(n_rows, 1)},",
        f"    PFK_UNKNOWNS = {max(unknowns, 1)},",
        "    PFK_IK_STEPS = 20,",
        "    PFK_PARTS = 8, /* of the way to a target that is not completed at once */",
        "    PFK_FK_STEPS = 40",
        "};",
        "",
    ]
    return "\n".join(lines)


def _types(body: str) -> str:
    """The structures, with the fields that functions use."""
    frame = ["pfk_real p[3];", "pfk_real R[3][3];", "pfk_real centre[3];", "pfk_real moved[3];", "int is_back;"]
    blocks = ["/* The platform, or the base as seen from it: points map to R x + p, and turn about `centre`. */"]
    blocks += _struct("pfk_frame", frame)
    for kind, variables, fields in (("rod", ("rod", "main"), ROD_FIELDS), ("pivot", ("pivot",), PIVOT_FIELDS)):
        used = _used(body, variables, fields)
        used += ["length"] if kind == "rod" and "length" not in used and "pfk_rods[" in body else []
        if used:
            blocks += [f"/* What a {kind} is, at home. */"]
            blocks += _struct(f"pfk_{kind}", [f"pfk_real {name}{fields[name]};" for name in fields if name in used])
    used = _used(body, ("leg", "lead", r"leg\[\d+\]"), LEG_FIELDS)
    own = [f"pfk_real {name}{LEG_FIELDS[name]};" for name in used]
    own += ["int is_held;"] if "is_held" in body else []
    return "\n".join([*blocks, "/* Where a leg is. */", *_struct("pfk_leg", own)])


def _used(body: str, variables: Iterable[str], fields: Iterable[str]) -> list[str]:
    either = "|".join(variables)
    return [name for name in fields if re.search(rf"\b(?:{either})(?:->|\.){name}\b", body)]


def _struct(name: str, fields: Iterable[str]) -> list[str]:
    return ["typedef struct {", *(f"    {field}" for field in fields), f"}} {name};", ""]


def _tables(machine: Machine, body: str) -> str:
    """The numbers of all legs."""
    lines: list[str] = []
    kinds = ((RodShape, "rod", ("rod", "main"), ROD_FIELDS), (PivotShape, "pivot", ("pivot",), PIVOT_FIELDS))
    for kind, name, variables, fields in kinds:
        own = [code for code in machine.codes if isinstance(code.shape, kind)]
        if not own:
            continue
        used = _used(body, variables, fields)
        used += ["length"] if kind is RodShape and "length" not in used else []
        lines.append(f"static const pfk_{name} pfk_{name}s[{len(own)}] = {{")
        for code in own:
            lines += [f"    {{ /* {comment(', '.join(code.joints))} */", *_initialisers(code, used), "    },"]
        lines += ["};", ""]
    return "\n".join(lines)


def _initialisers(code: LegCode, used: Sequence[str]) -> Iterator[str]:
    for name, value in code.numbers.items():
        if name in used:
            yield f"        .{name} = {literal(value)},"


@lru_cache(maxsize=1)
def _library() -> dict[str, str]:
    """The routines, by name, each with the comment above it."""
    text = resources.files(__package__).joinpath("routines.c").read_text(encoding="utf-8")
    found: dict[str, str] = {}
    for block in re.split(r"\n\n(?=/\*|static|void)", text)[1:]:
        match = _NAME.search(block)
        assert match is not None, block
        found[match.group(1)] = block.strip() + "\n"
    return found


def _routines(written: str) -> list[str]:
    """The routines that a text uses, and those that they use, in their order."""
    library = _library()
    wanted: set[str] = set()
    texts = [written, *_OFFERED]
    while texts:
        text = texts.pop()
        for name in set(re.findall(r"\bpfk_\w+", text)) & library.keys() - wanted:
            wanted.add(name)
            texts.append(library[name])
    return [text for name, text in library.items() if name in wanted]
