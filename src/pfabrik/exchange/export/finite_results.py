"""Functions of a file around what computes: nothing is given to a caller that is not finite, whatever is asked."""

from __future__ import annotations

import re
from typing import NamedTuple

LENGTHS = {"actuators": "PFK_ACTUATORS", "now": "PFK_ACTUATORS", "joints": "PFK_JOINTS", "slack": "PFK_LIMITS"}
"""Of arrays that are declared without."""

_DECLARED = re.compile(r"^int (pfk_\w+)\(([^()]*)\);", re.MULTILINE)
_PARAMETER = re.compile(r"(const )?(\w+) (\*?)(\w+)((?:\[\w*\])*)")


class Written(NamedTuple):
    """An argument that a function fills: how it is stored, and how many numbers it is."""

    name: str
    stored: str
    n: str
    is_read: bool


def with_finite_results(text: str) -> str:
    """The text of a file in which every function that returns a code checks its results, in the words of the template.

    The results are arguments that are not constant: what is taken by a pointer is read and written, an array is written
    alone. A function computes in memory of its own: where a number there is not finite nothing is given, and 0 becomes
    `PFK_NOT_FINITE`.
    """
    head, only, body = text.partition("#ifndef PFK_DECLARATIONS_ONLY")
    for name, parameters in _DECLARED.findall(head):
        found = re.search(rf"^int {name}(\([^()]*\)\n\{{\n.*?^\}}\n)", body, re.MULTILINE | re.DOTALL)
        assert found is not None, name
        body = body[: found.start()] + _checked(name, parameters, found[1]) + body[found.end() :]
    return head + only + body


def _checked(name: str, parameters: str, definition: str) -> str:
    """A function that computes, and the one of its name that checks what it did."""
    computes, takes = f"pfk_compute_{name.removeprefix('pfk_')}", [_parameter(each) for each in parameters.split(",")]
    results = [each for _, each in takes if each is not None]
    given = [parameter if result is None else f"own_{parameter}" for parameter, result in takes]
    lines = [f"    {each.stored};" for each in results] + ["    int code;"]
    for each in results:
        begin = f"pfk_give({each.name}, own_{each.name}, " if each.is_read else f"pfk_unset(own_{each.name}, "
        lines.append(f"    {begin}{each.n});")
    is_finite = " && ".join(f"pfk_is_finite(own_{each.name}, {each.n})" for each in results)
    lines += [f"    code = {computes}({', '.join(given)});", f"    if (!({is_finite}))"]
    lines += ["        return code ? code : PFK_NOT_FINITE;"]
    lines += [f"    pfk_give(own_{each.name}, {each.name}, {each.n});" for each in results]
    body = "\n".join([*lines, "    return code;"])
    head = definition[: definition.index(")") + 1]
    return f"static int {computes}{definition}\nint {name}{head}\n{{\n{body}\n}}\n"


def _parameter(parameter: str) -> tuple[str, Written | None]:
    """The name of a parameter, and what is filled; None of one that is only read, and of counts and flags."""
    found = _PARAMETER.fullmatch(" ".join(parameter.split()))
    assert found is not None, parameter
    constant, kind, star, name, lengths = found.groups()
    if constant or kind not in ("pfk_real", "pfk_pose") or not (star or lengths):
        return name, None
    counts = re.findall(r"\w+", lengths) or ["1" if kind == "pfk_pose" else LENGTHS[name]]
    room = lengths if len(counts) > 1 else f"[{counts[0]}{' + 1' if lengths == '[]' else ''}]"  # no array is empty
    n = " * ".join([*counts, *(["12"] if kind == "pfk_pose" else [])])
    return name, Written(name, f"{kind} own_{name}{room}", n, bool(star))
