"""No module knows a machine, every public name exists, and what needs no kernel loads none: what imports what is
`make check`'s to see."""

from __future__ import annotations

import ast
import importlib
import json
import re
import subprocess
import sys
from collections import defaultdict
from functools import cache
from itertools import combinations
from pathlib import Path
from types import ModuleType

import click

import pfabrik as pf
from pfabrik.cli import main

PACKAGE = Path(pf.__file__).parent
SOURCES = sorted(path for path in PACKAGE.rglob("*.py") if path.stem != "__main__")
FILES = {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob("*") if path.suffix in (".py", ".toml")}
MAY_NAME_MACHINES = {
    "__init__.py": "the first lines of a session, for who reads the package's help",
    "machine/catalog/": "the machines themselves",
    "cli/demo.toml": "the machines of the demo, with their circles",
    "exchange/export/linuxcnc.py": "the kinematics of a firmware, by their names there",
    "exchange/export/firmware_settings.py": "the kinematics of firmwares, by their names there",
    "machine/files/printers/": "the kinematics of firmwares, by their names there",
    "machine/files/__init__.py": "what a printer is",
    "capabilities/calibration/printer_settings.py": "the kinematics of a firmware, by their names there",
    "cli/machines.py": "other names of kinds to start from",
    "cli/examples.py": "what may be typed as it is",
    "cli/export.py": "the printers that a firmware knows",
}
"""Beginnings of paths, and why names of the catalogue may stand there."""
VOCABULARY = ("delta", "prr", "prs", "psu", "rpr", "rps", "rrr", "ucu")
"""Machines called as their whole family is, by letters of joints, or by another word: so may prose and variables."""


@cache
def pattern(machine: str) -> re.Pattern[str]:
    """How a machine of the catalogue is written, in names and in prose: `five_bar`, `FiveBar`, five-bar."""
    written = machine.replace("_", r"[\s_-]?")
    return re.compile(rf"\b{written}\b" if machine in VOCABULARY else written, re.IGNORECASE)


@cache
def nodes(source: str) -> tuple[ast.AST, ...]:
    """All nodes of a source text; parsed once for all tests."""
    return tuple(ast.walk(ast.parse(source)))


def data(path: Path) -> str:
    """The string constants of a source file that are not docstrings, one a line; of another file, all of it."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text
    statements = {id(node.value) for node in nodes(text) if isinstance(node, ast.Expr)}
    constants = (node for node in nodes(text) if isinstance(node, ast.Constant) and id(node) not in statements)
    return "\n".join(node.value for node in constants if isinstance(node.value, str))


def test_no_module_knows_a_machine_of_the_catalogue() -> None:
    knowing = []
    for place, path in FILES.items():
        if any(place.startswith(allowed) for allowed in MAY_NAME_MACHINES):
            continue
        whole = path.read_text(encoding="utf-8")
        for machine in pf.catalog():
            if pattern(machine).search(whole):  # perhaps in a docstring, or from one line to the next
                text = data(path) if machine in VOCABULARY else whole
                knowing += [(machine, place, line) for line in text.splitlines() if pattern(machine).search(line)]
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


def test_public_names_are_what_type_checkers_see() -> None:
    """Both read `__init__.pyi`: here that each name is where it says, and that none is hidden by a module."""
    for name, home in pf._HOMES.items():
        place = f"pfabrik.{home}" if home else "pfabrik"
        value = getattr(pf, name)
        found = (
            importlib.import_module(f"{place}.{name}")
            if isinstance(value, ModuleType)
            else vars(importlib.import_module(place))[name]
        )
        assert value is found, name


def places_by_class(sources: dict[str, str]) -> dict[str, list[str]]:
    places = defaultdict(list)
    for place, source in sources.items():
        for name in re.findall(r"^ *class (\w+)[(:]", source, re.MULTILINE):
            places[name].append(place)
    return places


def are_twins(one: str, other: str, sources: dict[str, str]) -> bool:
    """True for a command and its verb, and for a kernel file and its caller, of the same room or with an import."""
    inner, outer = sorted((one, other), key=lambda place: not place.startswith(("cli/", "kernels/")))
    is_called = False
    if inner.startswith("kernels/") and not outer.startswith("kernels/"):
        room, stem = ".".join(Path(inner).parent.parts), Path(inner).stem
        is_called = bool(re.search(rf"\.{room}(\.{stem} import| import .*\b{stem}\b)", sources[outer]))
    below = re.sub("^(common|engines|capabilities)/", "", outer)
    return inner in (f"cli/{below}", f"kernels/{below}") or is_called


def shared_file_names(sources: dict[str, str]) -> list[tuple[str, str]]:
    """Pairs of places that have the same file name and are not twins."""
    named = [place for place in sources if Path(place).name != "__init__.py"]
    pairs = ((one, other) for one, other in combinations(named, 2) if Path(one).name == Path(other).name)
    return [(one, other) for one, other in pairs if not are_twins(one, other, sources)]


def test_no_class_name_and_no_file_name_stands_twice_but_of_twins() -> None:
    sources = {path.relative_to(PACKAGE).as_posix(): path.read_text(encoding="utf-8") for path in SOURCES}
    assert {name: places for name, places in places_by_class(sources).items() if len(places) > 1} == {}
    assert shared_file_names(sources) == []


def test_file_names_that_stand_twice_are_found() -> None:
    twins = dict.fromkeys(
        ["__init__.py", "cli/__init__.py", "ik.py", "cli/ik.py", "kernels/x/near.py", "x/near.py"], ""
    )
    twins |= {"kernels/legs/rods.py": "", "x/rods.py": "from ..kernels.legs.rods import place"}
    assert shared_file_names(twins) == []
    assert shared_file_names({**twins, "x/rods.py": ""}) == [("kernels/legs/rods.py", "x/rods.py")]
    for place in ("view/ik.py", "kernels/y/near.py", "y/near.py", "y/rods.py"):  # a third, or beside a stranger
        assert shared_file_names({**twins, place: ""}) != [], place


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


HEAVY = "numpy scipy matplotlib mujoco trimesh yaml http.server"
HELP = [["--help"], *[[command, "--help"] for command in main.subcommands]]
WRONG = [
    ["chek"],
    ["ik"],
    ["ik", "stewart"],
    ["ik", "stewart", "--position", "1", "2"],
    ["ik", "stewart", "--position", "1", "2", "three"],
    ["fk"],
    ["fk", "stewart", "1", "2"],
    ["fk", "stewart", "1", "two"],
    ["ik", "stewrt", "--rpy", "0", "0", "1"],
    ["track", "stewart"],
    ["demo", "--steps", "0"],
]


def test_help_loads_nothing_heavy() -> None:
    told, _ = loaded_by(HEAVY, HELP)
    assert told == [(None, []), *[(0, [])] * len(HELP)]


def test_the_help_of_all_commands_says_what_theirs_says() -> None:
    for name, line in main.subcommands.items():
        command = main.get_command(click.Context(main), name)
        assert command is not None and command.help is not None
        assert line == " ".join(command.help.partition("\n\n")[0].split()), name


def test_wrong_input_loads_no_pictures_and_is_told() -> None:
    told, said = loaded_by("matplotlib scipy", WRONG)
    assert told == [(None, []), *[(2, [])] * len(WRONG)]
    assert "Traceback" not in said and "did you mean 'stewart'" in said


def test_no_command_loads_what_it_does_not_use(tmp_path: Path) -> None:
    """In one process, so those that need least come first."""
    path = tmp_path / "path.csv"
    height = str(pf.load("delta").reference_point[2])
    path.write_text(f"x,y,z\n0,0,{height}\n1,0,{height}\n", encoding="utf-8")
    groups = {
        "": [["catalog"], ["new"], ["new", "hexapod"]],
        "numpy ": [["info", "stewart"], ["check", "stewart"], ["export", "stewart", "mjcf"]],
        "numpy": [
            *(["ik", "delta", "--position", "0", "0", height], ["fk", "delta", "0", "0", "0"], ["travel", "delta"]),
            *(["speed", "delta", "--speed", "5"], ["track", "delta", str(path), "-o", "-"]),
            ["time", "delta", str(path), "--speed", "5", "--acceleration", "50"],
            *(["export", "delta", "c", "--parts", "ik"], ["workspace", "five_bar", "--resolution", "16"]),
        ],
    }
    lines = [line for group in groups.values() for line in group]
    told, _ = loaded_by("numpy matplotlib mujoco trimesh http.server", lines)
    assert [loaded for _, loaded in told[1:]] == [names.split() for names, group in groups.items() for _ in group]
    assert [code for code, _ in told[1:]] == [0] * len(lines)


KIND = re.compile(r'\["kind"\]|\b(ROD|PIVOT|REDUNDANT|IDLE)\b')


def test_the_guide_names_every_file_that_asks_for_the_kind_of_a_leg() -> None:
    """A new kind of leg must be looked after in each of them: `Add a leg kind` in CONTRIBUTING.md."""
    guide = (PACKAGE.parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w/]+\.(?:py|c))`", guide.split("## Add a leg kind")[1].split("\n## ")[0]))
    sources = {path.relative_to(PACKAGE).as_posix(): path.read_text(encoding="utf-8") for path in SOURCES}
    asking = {
        name
        for name, text in sources.items()
        if re.search(r"legs(\.| import )records|\.legs\.legs\b", text) and KIND.search(text)
    }
    assert asking <= named, sorted(asking - named)
    assert all((PACKAGE / name).exists() for name in named)


def test_each_kind_of_leg_answers_what_kinds_ask() -> None:
    """A question that is put to rods is put to pivots, and their files answer it; redundant joints have no rows."""
    folder = PACKAGE / "kernels" / "legs"
    asked = re.findall(r"^from \.(\w+) import (.*)$", (folder / "kinds.py").read_text(encoding="utf-8"), re.MULTILINE)
    questions = {
        kind: {name.replace(kind, "*") for _, names in asked for name in names.split(", ") if kind in name.split("_")}
        for kind in ("rod", "pivot")
    }
    assert questions["rod"] == questions["pivot"] == {"place_*", "*_rows", "*_slopes"}
