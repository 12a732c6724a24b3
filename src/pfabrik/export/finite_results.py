"""Functions of a file around what computes: nothing is given to a caller that is not finite, whatever is asked."""

from __future__ import annotations

import re
from typing import NamedTuple

LENGTHS = {"actuators": "PFK_ACTUATORS", "now": "PFK_ACTUATORS", "joints": "PFK_JOINTS", "slack": "PFK_LIMITS"}
"""Of arrays whose declaration has no length."""

_DECLARED = re.compile(r"^int (pfk_\w+)\(([^()]*)\);", re.MULTILINE)
_PARAMETER = re.compile(r"(const )?(\w+) (\*?)(\w+)((?:\[\w*\])*)")


class Result(NamedTuple):
    """An argument that a function fills: its type and name, how it is stored, and how many numbers it is."""

    type: str
    name: str
    lengths: str
    count: str
    is_read: bool


def with_finite_results(text: str) -> str:
    """The text of a file in which every function that returns a code checks its results, in the words of the template.

    A function's results are what it takes by a pointer (read and written) or as an array (written), and that is not
    constant. It computes in memory of its own: where a number there is not finite nothing is given, and 0 becomes
    `PFK_NOT_FINITE`.
    """
    head, own, body = text.partition("#ifndef PFK_DECLARATIONS_ONLY")
    for name, parameters in _DECLARED.findall(head):
        results = [each for each in map(_result, parameters.split(",")) if each is not None]
        body, n = re.subn(
            rf"^int {name}(\([^()]*\)\n\{{\n.*?^\}}\n)",
            lambda found, name=name, results=results: _checked(name, found[1], results),
            body,
            flags=re.MULTILINE | re.DOTALL,
        )
        assert n == 1, name
    return head + own + body


def _result(parameter: str) -> Result | None:
    """What a parameter is filled with; None of one that is only read, and of counts and flags."""
    found = _PARAMETER.fullmatch(" ".join(parameter.split()))
    assert found is not None, parameter
    constant, kind, star, name, lengths = found.groups()
    if constant or kind not in ("pfk_real", "pfk_pose") or not (star or lengths):
        return None
    if star:
        lengths = "[1]" if kind == "pfk_pose" else f"[{LENGTHS[name]}]"
    counts = re.findall(r"\w+", lengths) or [f"{LENGTHS[name]}"]
    room = lengths if re.search(r"\w", lengths) else f"[{counts[0]} + 1]"  # C has no empty arrays
    return Result(kind, name, room, " * ".join([*counts, *(["12"] if kind == "pfk_pose" else [])]), bool(star))


def _checked(name: str, definition: str, results: list[Result]) -> str:
    """A function that computes, and the one of its name that checks what it did."""
    computes = f"pfk_compute_{name.removeprefix('pfk_')}"
    parameters = definition[1 : definition.index(")")]
    given = []
    for parameter in parameters.split(","):
        found = _PARAMETER.fullmatch(" ".join(parameter.split()))
        assert found is not None
        given.append(f"own_{found[4]}" if any(found[4] == each.name for each in results) else found[4])
    lines = [f"    {each.type} own_{each.name}{each.lengths};" for each in results]
    lines.append("    int code;")
    for each in results:
        how = f"pfk_give({each.name}, own_{each.name}, " if each.is_read else f"pfk_unset(own_{each.name}, "
        lines.append(f"    {how}{each.count});")
    lines.append(f"    code = {computes}({', '.join(given)});")
    finite = " && ".join(f"pfk_is_finite(own_{each.name}, {each.count})" for each in results)
    lines += [f"    if (!({finite}))", "        return code ? code : PFK_NOT_FINITE;"]
    lines += [f"    pfk_give(own_{each.name}, {each.name}, {each.count});" for each in results]
    body = "\n".join([*lines, "    return code;"])
    return f"static int {computes}{definition}\nint {name}({parameters})\n{{\n{body}\n}}\n"
