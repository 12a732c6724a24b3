"""What imports what, and how quickly the command answers: the rules that keep the parts apart."""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

import pfabrik as pf

PACKAGE = Path(pf.__file__).parent
SOURCES = sorted(PACKAGE.rglob("*.py"))
KERNELS = sorted((PACKAGE / "kernels").glob("*.py"))
COMMANDS = ("catalog", "new", "info", "check", "ik", "fk", "track", "demo", "reproduce")
LEAVES = ("cli", "view", "reproduce")
FILES = {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob("*") if path.suffix in (".py", ".toml")}
MAY_NAME_MACHINES = {
    "catalog/": "the machines themselves",
    "reproduce/paper.toml": "the machines of the paper's experiments, with what it printed of them",
    "geometric/": "closed forms, which speak of the machines that are known for theirs",
}
"""Beginnings of paths, and why names of the catalogue may stand there."""
VOCABULARY = ("delta", "prr", "prs", "psu", "rpr", "rps", "rrr", "ucu")
"""Machines called as their whole family is, by letters of joints, or by another word: so may prose and variables."""
HEAVY = ("numba", "matplotlib", "scipy")
QUICK = 0.5  # seconds to start Python, import and answer
# Runs a command line in this process, then reports what it loaded; the exit code is the command's.
PROBE = """
import sys
try:
    import pfabrik
    if sys.argv[1:]:
        from pfabrik.cli import main
        main(sys.argv[1:])
finally:
    sys.stderr.write("\\nloaded: " + " ".join(sys.modules))
"""


def imports(source: Path) -> Iterator[str]:
    """Modules that a source file imports, absolute names; imports for type checkers do not count."""
    tree = ast.parse(source.read_text(encoding="utf-8"))
    checked = {id(node) for branch in ast.walk(tree) if is_type_checking(branch) for node in ast.walk(branch)}
    package = ["pfabrik", *source.relative_to(PACKAGE).parts[:-1]]
    for node in ast.walk(tree):
        if id(node) in checked:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


@pytest.mark.parametrize("source", KERNELS, ids=lambda path: path.name)
def test_kernels_import_only_numpy_numba_and_each_other(source: Path) -> None:
    allowed = {"numpy", "numba", *sys.stdlib_module_names}
    foreign = [
        name for name in imports(source) if name.split(".")[0] not in allowed and not name.startswith("pfabrik.kernels")
    ]
    assert foreign == []


def test_closed_forms_share_only_the_decorator_with_the_kernels() -> None:
    names = {name for source in (PACKAGE / "geometric").glob("*.py") for name in imports(source)}
    shared = {name for name in names if "numba" in name or name.startswith("pfabrik.kernels")}
    assert shared == {f"pfabrik.kernels._jit.{decorator}" for decorator in ("kernel", "routine", "inlined")}
    assert not {
        name
        for name in names
        if name.startswith(("pfabrik.decomposition.plan", "pfabrik.decomposition.positions", "pfabrik.ik"))
    }


def test_the_contract_of_closed_forms_names_every_kernel() -> None:
    settings = tomllib.loads((PACKAGE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = {each["name"]: each for each in settings["tool"]["importlinter"]["contracts"]}
    forbidden = contracts["closed forms do not lean on what they check"]["forbidden_modules"]
    others = {f"pfabrik.kernels.{source.stem}" for source in KERNELS} - {"pfabrik.kernels._jit"}
    assert others - {"pfabrik.kernels.__init__"} <= set(forbidden)


def test_the_library_never_imports_its_command_or_its_pictures() -> None:
    library = [source for source in SOURCES if source.parent.name not in LEAVES and source.stem != "__main__"]
    names = {name for source in library for name in imports(source)}
    assert not [
        name for name in names if name.startswith(("pfabrik.cli", "pfabrik.view", "click", "rich", "matplotlib"))
    ]


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


@pytest.mark.parametrize("machine", pf.catalog())
def test_no_module_knows_a_machine_of_the_catalogue(machine: str) -> None:
    knowing = [
        (place, line.strip())
        for place, path in FILES.items()
        if not any(place.startswith(allowed) for allowed in MAY_NAME_MACHINES)
        for line in (data(path) if machine in VOCABULARY else path.read_text(encoding="utf-8")).splitlines()
        if pattern(machine).search(line)
    ]
    assert knowing == []


@pytest.mark.parametrize("text", ["five_bar", "FiveBar", "solve_five_bar", "a five-bar's tip", "Five bar"])
def test_a_machine_is_found_however_it_is_written(text: str) -> None:
    assert pattern("five_bar").search(text)


@pytest.mark.parametrize("text", ["prsteps", "prs_count", "sprs"])
def test_a_word_of_the_vocabulary_within_another_is_no_machine(text: str) -> None:
    assert not pattern("prs").search(text)
    assert pattern("prs").search("the 3-PRS")


def test_the_list_of_modules_is_complete() -> None:
    page = (PACKAGE.parents[1] / "docs" / "decisions" / "0003-modules.md").read_text(encoding="utf-8")
    modules = {source.stem for source in PACKAGE.glob("*.py")} - {"__init__", "__main__"}
    folders = {source.parent.name for source in PACKAGE.glob("*/__init__.py")}
    listed = re.findall(r"`(\w+)`", page.partition("\n- ")[2].partition("**Consequence")[0])
    assert sorted(listed) == sorted(modules | folders)


def test_every_public_name_exists() -> None:
    scope: dict[str, object] = {}
    exec("from pfabrik import *", scope)
    assert set(pf.__all__) <= set(scope)


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_every_all_names_what_exists(source: Path) -> None:
    if source.stem == "__main__":
        return
    parts = [part for part in source.relative_to(PACKAGE.parent).with_suffix("").parts if part != "__init__"]
    module = importlib.import_module(".".join(parts))
    assert [name for name in getattr(module, "__all__", ()) if not hasattr(module, name)] == []


LINES = [
    [],
    ["--help"],
    *[[command, "--help"] for command in COMMANDS],
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


@pytest.mark.parametrize("line", [pytest.param(line, id=" ".join(line) or "import") for line in LINES])
def test_help_and_wrong_input_answer_at_once_and_load_nothing_heavy(line: list[str]) -> None:
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        done = subprocess.run([sys.executable, "-c", PROBE, *line], capture_output=True, text=True, check=False)
        seconds.append(time.perf_counter() - start)
        if seconds[-1] < QUICK:
            break
    complaint, loaded = done.stderr.rsplit("\nloaded: ", 1)
    assert set(HEAVY) & set(loaded.split()) == set()
    assert done.returncode == (0 if not line or "--help" in line else 2), complaint
    assert "Traceback" not in complaint
    assert min(seconds) < QUICK


def test_wrong_names_are_told_without_the_kernels() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROBE, "ik", "stewrt", "--position", "0", "0", "1"],
        capture_output=True,
        text=True,
        check=False,
    )
    complaint, loaded = done.stderr.rsplit("\nloaded: ", 1)
    assert done.returncode == 2
    assert "did you mean 'stewart'" in complaint
    assert "numba" not in loaded.split()


@pytest.mark.parametrize("line", [["info", "stewart"], ["check", "stewart"], ["fk", "stewart", "1", "2"]])
def test_a_mechanism_is_shown_and_checked_without_the_kernels(line: list[str]) -> None:
    done = subprocess.run([sys.executable, "-c", PROBE, *line], capture_output=True, text=True, check=False)
    complaint, loaded = done.stderr.rsplit("\nloaded: ", 1)
    assert done.returncode == (2 if line[0] == "fk" else 0), complaint
    assert "numba" not in loaded.split()
