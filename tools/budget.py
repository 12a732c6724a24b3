"""How large the project is, room by room, against its budget: `python tools/budget.py`.

Prints what stands beside what `docs/decisions/budget.md` allows, and ends with 1 where something is larger. With
`--amend "reason"` the table there takes today's figures, and the reason is written below it.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "decisions" / "budget.md"
ROW = re.compile(r"^\| (?P<what>[^|]+?) \| (?P<figure>[\d,]+) \|$", re.MULTILINE)

CODE, OTHER_CODE = (".py",), (".c", ".h", ".cpp", ".hpp", ".in", ".js", ".html", ".css")
PATTERNS = {
    'tests of `["kind"]` in src': r'\["kind"\]',
    "module constants in src": r"^[A-Z][A-Z0-9_, ]* *(:[^=]*)?= *-?[0-9]",
    "NamedTuples in src": r"\(NamedTuple\)",
}


def room_of(path: Path) -> str:
    """The room of a file: its folder in the package (one deeper among kernels), or the first folder outside it."""
    folders = path.parts[:-1]
    if folders[:2] == ("src", "pfabrik"):
        inside = folders[2:4] if folders[2:3] == ("kernels",) else folders[2:3]
        return "src/" + ("/".join(inside) or "(top)")
    return folders[0]


def tracked() -> dict[Path, str]:
    """Texts of the files that git knows of or would add."""
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "src", "tests", "paper", "building"]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    paths = (Path(name) for name in names if Path(name).suffix in CODE + OTHER_CODE)
    return {path: (ROOT / path).read_text(encoding="utf-8") for path in paths if (ROOT / path).exists()}


def measure() -> dict[str, int]:
    """Figures by their names, in the order of the table."""
    texts = tracked()
    totals: Counter[str] = Counter()
    rooms: Counter[str] = Counter()
    for path, text in texts.items():
        n_lines, kind = text.count("\n"), "Python" if path.suffix in CODE else "C, web and templates"
        totals[f"{path.parts[0]}, {kind}"] += n_lines
        rooms[f"{room_of(path)}, {kind}"] += n_lines
    figures = dict(sorted(totals.items()))
    figures |= {room: n for room, n in sorted(rooms.items()) if room.startswith("src")}
    package = [text for path, text in texts.items() if path.suffix in CODE and path.parts[0] == "src"]
    lines = [line for text in package for line in text.splitlines()]
    for name, pattern in PATTERNS.items():
        figures[name] = sum(re.search(pattern, line) is not None for line in lines)
    from walk import walks

    return figures | {f"files entered: {question}": len(entered.files) for question, entered in walks().items()}


def budget(page: str) -> dict[str, int]:
    return {row["what"]: int(row["figure"].replace(",", "")) for row in ROW.finditer(page)}


def amended(page: str, figures: dict[str, int], reason: str) -> str:
    """The page with these figures in its table, and one more line among its reasons."""
    allowed, rows = budget(page), list(ROW.finditer(page))
    changes = [f"{name} {allowed.get(name, 0):,} → {n:,}" for name, n in figures.items() if n > allowed.get(name, 0)]
    table = "\n".join(f"| {name} | {n:,} |" for name, n in figures.items())
    page = page[: rows[0].start()] + table + page[rows[-1].end() :] if rows else page.rstrip() + "\n" + table + "\n"
    return page.rstrip() + f"\n- {datetime.now(UTC):%Y-%m-%d}: {reason}: {'; '.join(changes) or 'nothing grew'}.\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--amend", metavar="REASON", help="take today's figures into the budget, with the reason")
    reason: str | None = parser.parse_args().amend
    figures, page = measure(), PAGE.read_text(encoding="utf-8")
    if reason:
        PAGE.write_text(amended(page, figures, reason), encoding="utf-8")
        return 0
    allowed = budget(page)
    n_over = 0
    for name, n in figures.items():
        change = n - allowed.get(name, 0)
        n_over += change > 0
        print(f"{name:46} {n:7,}  of {allowed.get(name, 0):7,}{f'  {change:+,}' if change else ''}")
    if n_over:
        print(f"{n_over} grew: take lines away, or say why: python tools/budget.py --amend REASON", file=sys.stderr)
    return 1 if n_over else 0


if __name__ == "__main__":
    sys.exit(main())
