"""No module knows a machine, every public name exists, and what needs no kernel loads none: what imports what is
`make check`'s to see."""

from __future__ import annotations

import ast
import importlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pfabrik as pf

PACKAGE = Path(pf.__file__).parent
SOURCES = sorted(path for path in PACKAGE.rglob("*.py") if path.stem != "__main__")
FILES = {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob("*") if path.suffix in (".py", ".toml")}
MAY_NAME_MACHINES = {
    "__init__.py": "the first lines of a session, for who reads the package's help",
    "catalog/": "the machines themselves",
    "cli/demo.toml": "the machines of the demo, with their circles",
    "export/linuxcnc.py": "the kinematics of a firmware, by their names there",
    "export/klipper.py": "the kinematics of a firmware, by their names there",
    "cli/export.py": "the printers that a firmware knows",
}
"""Beginnings of paths, and why names of the catalogue may stand there."""
VOCABULARY = ("delta", "prr", "prs", "psu", "rpr", "rps", "rrr", "ucu")
"""Machines called as their whole family is, by letters of joints, or by another word: so may prose and variables."""


def pattern(machine: str) -> re.Pattern[str]:
    """How a machine of the catalogue is written, in names and in prose: `five_bar`, `FiveBar`, five-bar."""
    written = machine.replace("_", r"[\s_-]?")
    return re.compile(rf"\b{written}\b" if machine in VOCABULARY else written, re.IGNORECASE)


def data(path: Path) -> str:
    """The string constants of a source file that are not docstrings, one a line; of another file, all of it."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text
    tree = ast.parse(text)
    statements = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    constants = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in statements)
    return "\n".join(node.value for node in constants if isinstance(node.value, str))


def test_no_module_knows_a_machine_of_the_catalogue() -> None:
    knowing = [
        (machine, place, line.strip())
        for place, path in FILES.items()
        if not any(place.startswith(allowed) for allowed in MAY_NAME_MACHINES)
        for text, constants in [(path.read_text(encoding="utf-8"), data(path))]
        for machine in pf.catalog()
        for line in (constants if machine in VOCABULARY else text).splitlines()
        if pattern(machine).search(line)
    ]
    assert knowing == []


def test_a_machine_is_found_however_it_is_written() -> None:
    for text in ("five_bar", "FiveBar", "solve_five_bar", "a five-bar's tip", "Five bar"):
        assert pattern("five_bar").search(text)
    for text in ("prsteps", "prs_count", "sprs"):  # a word of the vocabulary within another is no machine
        assert not pattern("prs").search(text)
    assert pattern("prs").search("the 3-PRS")


def test_every_public_name_exists() -> None:
    scope: dict[str, object] = {}
    exec("from pfabrik import *", scope)
    assert set(pf.__all__) <= set(scope)
    for source in SOURCES:
        parts = [part for part in source.relative_to(PACKAGE.parent).with_suffix("").parts if part != "__init__"]
        module = importlib.import_module(".".join(parts))
        assert [name for name in getattr(module, "__all__", ()) if not hasattr(module, name)] == [], source


PROBE = """
import json, sys, warnings
heavy = sys.argv[1].split()
import pfabrik
told = [[None, [name for name in heavy if name in sys.modules]]]
for line in json.loads(sys.argv[2]):
    from pfabrik.cli import main
    code = 0
    try:
        main(line)
    except SystemExit as leaving:
        code = leaving.code or 0
    told.append([code, [name for name in heavy if name in sys.modules]])
sys.stderr.write("\\ntold: " + json.dumps(told))
"""
"""Runs command lines one after the other; reports the exit code of each, and which heavy modules are loaded by then."""


def loaded_by(heavy: str, lines: list[list[str]]) -> tuple[list[tuple[int | None, list[str]]], str]:
    """Exit code and heavy modules after importing the library, and after each command line; what was said on stderr."""
    command = [sys.executable, "-c", PROBE, heavy, json.dumps(lines)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    said, told = done.stderr.rsplit("\ntold: ", 1)
    return [tuple(each) for each in json.loads(told)], said


COMMANDS = (
    *("catalog", "new", "info", "check", "ik", "fk", "track", "travel", "workspace", "plot", "view"),
    *("import", "export", "verify", "demo"),
)
HELP = [["--help"], *[[command, "--help"] for command in COMMANDS]]
WRONG = [
    ["chek"],
    ["ik"],
    ["ik", "stewart"],
    ["ik", "stewart", "--position", "1", "2"],
    ["ik", "stewart", "--position", "1", "2", "three"],
    ["fk"],
    ["fk", "stewart", "1", "two"],
    ["track", "stewart"],
    ["demo", "--steps", "0"],
]


def test_help_and_wrong_input_load_nothing_heavy() -> None:
    told, said = loaded_by("numba matplotlib scipy", [*HELP, *WRONG])
    assert told == [(None, []), *[(0, [])] * len(HELP), *[(2, [])] * len(WRONG)]
    assert "Traceback" not in said


def test_a_mechanism_is_shown_and_checked_and_a_wrong_name_told_without_the_kernels() -> None:
    wrong = [["fk", "stewart", "1", "2"], ["ik", "stewrt", "--rpy", "0", "0", "1"]]
    told, said = loaded_by("numba", [["info", "stewart"], ["check", "stewart"], *wrong])
    assert told == [(None, []), (0, []), (0, []), (2, []), (2, [])]
    assert "did you mean 'stewart'" in said
