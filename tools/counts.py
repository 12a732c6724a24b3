"""Count what stands more than once: `python tools/counts.py`.

Prints docs/decisions/budget.md; `--write` writes it. With `--check` only what is wrong is printed, and the end is
1 where an import runs up or in a cycle, where more imports are ignored than may be, or where an idea that is counted by
name is no longer where this file says: it went, or it has another name.
"""

from __future__ import annotations

import argparse
import ast
import re
import subprocess
import sys
import tokenize
import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple

import grimp

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "pfabrik"
PAGE = ROOT / "docs" / "decisions" / "budget.md"
MOST_IGNORED = 20
"""Ignored imports, each with its reason in pyproject.toml."""

MOST_ARGUMENTS = 10
"""Positional arguments from which on a kernel counts as one that should take records."""

IDEAS = {
    "tables of joints as unit motions": (
        "kernels.joints.loops.Loops machine.motion.loops.ways_to machine.motion.cut_loops.CutLoops "
        "kernels.dynamics.moving.MovingMachine kernels.chains.chain_records.SerialChain "
        "machine.motion.joint_path.PathMotion machine.motion.displacements._Geometry "
        "machine.decomposition.leg_forms.ElementaryJoint"
    ),
    "walkers over such tables": (
        "kernels.joints.path_kinematics.walk_path kernels.chains.walk_chain.walk_chain kernels.walk_path.walk_row "
        "kernels.dynamics.placing.place kernels.controller.links_on_bodies.place_bodies kernels.pose.limits.place_in "
        "kernels.joints.first_order.fill_screws machine.motion.displacements.displacements "
        "kernels.joints.path_kinematics.place_links"
    ),
    "recorders of arithmetic": "machine.noted_numbers.Trace",
    "eliminations of the loops' null space": (
        "kernels.free_motions.eliminate kernels.joints.first_order.rates kernels.dynamics.allowed_motions.eliminate "
        "kernels.controller.rates.eliminate machine.motion.loops.first_order"
    ),
    "records that hold an answer": (
        "kernels.rows.Rows kernels.pose.search_records.PoseSolutions kernels.joints.joint_tables.Answered "
        "engines.pose.single.Answers kernels.pose.search_records.Starts kernels.pose.tables.Start "
        "kernels.pose.equations.PlatformState kernels.joints.loops.Closed "
        "engines.joints.close.Closing engines.joints.configurations.Configurations engines.pose.answers.LegAnswers "
        "answers.solution.Solution"
    ),
    "implementations of the legs' formulas": ("kernels.legs.rods.place_rod paper.geometric.struts tests.oracles"),
    "viewers": "view.page.export_web.web_page",
    "searches for the border of a workspace": (
        "capabilities.workspace.border_search.searched capabilities.workspace.border_search.sliced"
    ),
}
"""Where each idea stands, below the package, or below the repository's folder."""


class Row(NamedTuple):
    """A count and how it is made."""

    name: str
    count: int
    how: str


@cache
def graph() -> grimp.ImportGraph:
    """All imports of the package, lazy ones and those of types among them."""
    return grimp.build_graph("pfabrik", cache_dir=None)


@cache
def layers() -> list[list[str]]:
    """The layers of the package, the highest first, as its import contract has them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (layered,) = (each for each in contracts if each.get("containers") == ["pfabrik"])
    return [re.findall(r"\w+", layer) for layer in layered["layers"]]


def folder_of(module: str) -> str:
    """What a module belongs to at the first level of the package: a folder or a file."""
    return ".".join(module.split(".")[:2])


def dependencies() -> set[tuple[str, str]]:
    """Pairs of entries of the package's first level of which one imports the other."""
    pairs = (
        (folder_of(module), folder_of(imported))
        for module in graph().modules
        for imported in graph().find_modules_directly_imported_by(module)
    )
    return {pair for pair in pairs if pair[0] != pair[1] and "pfabrik" not in pair}


def upward() -> list[str]:
    """Imports that run up."""
    rank = {f"pfabrik.{name}": k for k, names in enumerate(layers()) for name in names}
    return [
        f"{module} -> {imported}"
        for module in sorted(graph().modules)
        for imported in sorted(graph().find_modules_directly_imported_by(module))
        if rank.get(folder_of(module), -1) > rank.get(folder_of(imported), len(rank))
    ]


def cycles() -> int:
    """Pairs of entries of the first level that import each other, by whatever way."""
    reached: dict[str, set[str]] = {}
    pairs = dependencies()
    names = {name for pair in pairs for name in pair}
    for name in names:
        reached[name], new = set(), {name}
        while new:
            new = {b for a, b in pairs if a in new} - reached[name]
            reached[name] |= new
    return sum(name in reached[name] for name in names)


def ignored() -> int:
    """Imports that `lint-imports` is told to ignore, as it counts them."""
    done = subprocess.run(
        [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"], cwd=ROOT, capture_output=True, text=True
    )
    return sum(map(int, re.findall(r"\((\d+) ignored import", done.stdout)))


def is_there(name: str) -> bool:
    """True if a name of `IDEAS` stands where it says: a file, a folder, or a definition in a file."""
    for top in (PACKAGE, ROOT):
        place = top.joinpath(*name.split("."))
        if place.is_dir() or place.with_suffix(".py").exists():
            return True
        source = place.parent.with_suffix(".py")
        if source.exists():
            kinds = (ast.ClassDef, ast.FunctionDef)
            body = ast.parse(source.read_text("utf-8")).body
            return any(isinstance(node, kinds) and node.name == place.name for node in body)
    return False


def lost() -> list[str]:
    """Names of `IDEAS` that are not where this file says."""
    return [name for names in IDEAS.values() for name in names.split() if not is_there(name)]


def wide_kernels() -> int:
    """Functions of kernels with ten or more positional arguments."""
    trees = (ast.parse(path.read_text("utf-8")) for path in (PACKAGE / "kernels").rglob("*.py"))
    functions = (node for tree in trees for node in tree.body if isinstance(node, ast.FunctionDef))
    return sum(len(node.args.args) >= MOST_ARGUMENTS for node in functions)


def idle_constants() -> int:
    """Constants of searches that the campaign found to change nothing: `GUARDS` of its test."""
    tree = ast.parse((ROOT / "tests" / "test_constants_matter.py").read_text("utf-8"))
    (guards,) = (
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "GUARDS"
    )
    return sum(len(names.split()) for names in guards.values())


def code_lines(path: Path) -> int:
    """Lines of a file that are neither blank nor comment, docstring or import."""
    tree = ast.parse(path.read_text("utf-8"))
    prose = {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    skipped = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    with path.open("rb") as file:
        tokens = [
            token for token in tokenize.tokenize(file.readline) if token.type not in skipped | {tokenize.ENCODING}
        ]
    lines = {line for token in tokens for line in range(token.start[0], token.end[0] + 1)}
    return len(lines - prose)


def rows() -> list[Row]:
    """All counts."""
    top = [path for path in PACKAGE.iterdir() if path.name != "__pycache__"]
    firsts = {folder_of(module) for module in graph().modules} - {"pfabrik"}
    found = [
        Row("entries of `src/pfabrik`", len(top), "`ls src/pfabrik`"),
        Row("modules at the first level", len(firsts), "grimp's graph"),
        Row("dependencies between them", len(dependencies()), "grimp's graph"),
        Row("entries in cycles", cycles(), "grimp's graph"),
        Row("upward imports", len(upward()), "grimp's graph, against the layers of `pyproject.toml`"),
        Row("ignored imports", ignored(), "`lint-imports`"),
    ]
    found += [
        Row(name, sum(map(is_there, names.split())), "by name: `IDEAS` in this script") for name, names in IDEAS.items()
    ]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    walked = subprocess.run(
        [sys.executable, str(ROOT / "tools" / "walk.py"), "--far"], capture_output=True, text=True, check=True
    )
    functions, depth = map(int, walked.stdout.split())
    return [
        *found,
        Row("kernels with ten or more positional arguments", wide_kernels(), "signatures in `kernels`"),
        Row("constants that a campaign changed without effect", idle_constants(), "`tests/test_constants_matter.py`"),
        Row("functions entered by a target out of reach", functions, "`python tools/walk.py`"),
        Row("call depth of a target out of reach", depth, "`python tools/walk.py`"),
        Row("base dependencies", len(project["dependencies"]), "`pyproject.toml`"),
    ]


def lines() -> list[str]:
    """Lines, and of these code, by folder: printed for people, and fail nothing."""
    out = ["| lines | all | code |", "|---|--:|--:|"]
    folders = [PACKAGE / name for name in sorted(path.name for path in PACKAGE.iterdir() if path.is_dir())]
    for folder in [PACKAGE, *folders, *(ROOT / name for name in ("tests", "paper", "tools", "benchmarks"))]:
        files = [path for path in folder.rglob("*.py") if "__pycache__" not in path.parts]
        if files:
            n = sum(len(path.read_text("utf-8").splitlines()) for path in files)
            out.append(f"| {folder.relative_to(ROOT)} | {n:,} | {sum(map(code_lines, files)):,} |")
    return out


HEAD = """# What stands more than once

Every change leaves fewer ideas. `python tools/counts.py --write` counts what stands more than once, on this page;
`make check` fails where an import runs up or in a cycle, and where more imports are ignored than may be. The other
rows are for people, who say in a change which number fell. Lines are printed, and fail nothing.
"""


def page() -> str:
    """The page of counts."""
    table = [
        "| what | count | how |",
        "|---|--:|---|",
        *(f"| {row.name} | {row.count} | {row.how} |" for row in rows()),
    ]
    return "\n".join([HEAD, *table, "", *lines(), ""])


def check() -> int:
    """Print what is wrong; 1 if something is."""
    wrong = [f"runs up: {each}" for each in upward()] + [f"not where tools/counts.py says: {name}" for name in lost()]
    wrong += [f"{cycles()} entries of the package import each other in a circle"] * bool(cycles())
    wrong += [f"{ignored()} imports are ignored, of at most {MOST_IGNORED}"] * (ignored() > MOST_IGNORED)
    print("\n".join(wrong), end="\n" * bool(wrong), file=sys.stderr)
    return int(bool(wrong))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.relative_to(ROOT)}")
    parser.add_argument("--check", action="store_true", help="print only what is wrong")
    asked = parser.parse_args()
    if asked.check:
        return check()
    if asked.write:
        PAGE.write_text(page(), encoding="utf-8")
    else:
        print(page())
    return 0


if __name__ == "__main__":
    sys.exit(main())
