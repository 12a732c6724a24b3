"""Every argument of every function of an exported file, as what no caller should give: a header for drivers in C."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

ASKING = Path(__file__).parent / "data" / "hostile.h"
LENGTHS = {"actuators": "PFK_ACTUATORS", "now": "PFK_ACTUATORS", "joints": "PFK_JOINTS", "slack": "PFK_LIMITS"}
"""Of arrays that are declared without."""


class Argument(NamedTuple):
    """How a parameter is declared in the driver, given to the function, and described; counts are there already."""

    declared: str
    given: str
    row: str = ""


def argument_of(parameter: str, function: str, *, has_joints: bool) -> Argument:
    """A parameter in the driver: what is no constant is written, what is an array and no constant is not read."""
    parameter = parameter.replace("pfk_at at", f"const {'pfk_real at[PFK_JOINTS]' if has_joints else 'pfk_pose *at'}")
    words = re.fullmatch(r"(const )?(\w+) (\*?)(\w+)((?:\[\w*\])*)", " ".join(parameter.split()))
    assert words is not None, parameter
    constant, kind, star, name, lengths = words.groups()
    if kind == "pfk_memory":
        return Argument("", f"&hostile_{name}")
    if kind in ("int", "char"):
        return Argument("", f"{'&' if kind == 'int' and star else ''}hostile_{name}")
    counts = re.findall(r"\w+", lengths) or [LENGTHS.get(name, "1") if kind == "pfk_real" else "1"]
    n, own = " * ".join([*counts, *(["12"] if kind == "pfk_pose" else [])]), f"{function}_{name}"
    is_value = not star and not lengths
    room = lengths if len(counts) > 1 else f"[{counts[0]} + 1]"  # C has no empty arrays
    is_read, is_written = bool(constant or star or is_value), not constant and not is_value
    row = f'{{"{name}", (pfk_real *){own}, {n}, {int(is_read)}, {int(is_written)}}}'
    return Argument(f"static {kind} {own}{room};\n", f"{own}[0]" if is_value else own, row)


def header(text: str) -> str:
    """The header that asks all functions of a file: `hostile_all` returns how many answers were wrong."""
    declarations, lines, calls = text.partition("#ifndef PFK_DECLARATIONS_ONLY")[0], [f'#include "{ASKING}"\n'], ""
    for name, parameters in re.findall(r"^int pfk_(\w+)\(([^()]*)\);", declarations, re.MULTILINE):
        function, has_joints = f"hostile_{name}", "PFK_JOINTS =" in text
        arguments = [argument_of(each, function, has_joints=has_joints) for each in parameters.split(",")]
        given = ", ".join(each.given for each in arguments)
        rows = ", ".join([*(each.row for each in arguments if each.row), "{0, 0, 0, 0, 0}"])
        lines += [each.declared for each in arguments]
        lines.append(f"static int {function}(void)\n{{\n    return pfk_{name}({given});\n}}\n")
        lines.append(f"static const hostile_argument {function}_arguments[] = {{{rows}}};\n")
        calls += f'    hostile_ask("{name}", {function}, {function}_arguments);\n'
    body = f"    pfk_begin(&hostile_memory);\n{calls}    return hostile_wrong;\n"
    return "".join([*lines, f"static int hostile_all(void)\n{{\n{body}}}\n"])
