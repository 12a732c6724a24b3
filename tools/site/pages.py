"""Pages of the documentation from programs: every file of `examples/tasks` is run, and becomes a page.

    python tools/site/pages.py              # writes docs/tasks/*.md and their pictures
    python tools/site/pages.py hexapod      # one of them

A program is prose and code. Its docstring has the title and the first lines. Comments at the margin that stand alone
are paragraphs, what is between them is code. Under each piece of code stands what it printed, and what it drew.
"""

from __future__ import annotations

import ast
import contextlib
import io
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS, PAGES = ROOT / "examples" / "tasks", ROOT / "docs" / "tasks"
PICTURES = (".png", ".svg", ".gif")


class Piece(NamedTuple):
    """A paragraph, or a piece of code with the line that it begins on."""

    text: str
    line: int
    is_code: bool


class Page(NamedTuple):
    """A page, and the pictures that its program saved: name -> content."""

    text: str
    pictures: dict[str, bytes]


def programs() -> list[Path]:
    """The programs that become pages."""
    return sorted(PROGRAMS.glob("*.py"))


def pieces_of(source: str) -> Iterator[Piece]:
    """The paragraphs and pieces of code of a program, after its docstring."""
    first = ast.parse(source).body[0]
    lines = source.splitlines()
    piece: list[str] = []
    begin, is_code = 0, False
    for number, line in enumerate([*lines[first.end_lineno :], "#"], start=(first.end_lineno or 0) + 1):
        is_prose = line == "#" or line.startswith("# ")
        before = lines[number - 2] if number > 1 else ""
        starts_prose = is_prose and (not before.strip() or not is_code or number > len(lines))
        if is_prose and is_code and not starts_prose:
            is_prose = False  # a comment above its line of code
        if is_prose == is_code or number > len(lines):
            text = "\n".join(piece).strip("\n")
            if text.strip():
                yield Piece(text, begin, is_code)
            piece, begin, is_code = [], number, not is_prose
        piece.append(line.removeprefix("#").removeprefix(" ") if is_prose else line)


def page_of(program: Path) -> Page:
    """Run a program in an empty folder, and make its page."""
    source = program.read_text(encoding="utf-8")
    title, _, introduction = (ast.get_docstring(ast.parse(source)) or "").partition("\n")
    name = program.stem
    parts = [f"# {title.rstrip('.')}", introduction.strip()]
    namespace: dict[str, object] = {"__name__": "__main__"}  # no file: what a reader pastes has none
    pictures: dict[str, bytes] = {}
    with _empty_folder() as folder:
        for piece in pieces_of(source):
            if not piece.is_code:
                parts.append(piece.text)
                continue
            parts.append(f"```python\n{piece.text}\n```")
            known, printed = set(folder.iterdir()), io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile("\n" * (piece.line - 1) + piece.text, str(program), "exec"), namespace)
            if printed.getvalue().strip():
                parts.append(f"```text\n{printed.getvalue().rstrip()}\n```")
            for path in sorted(set(folder.iterdir()) - known):
                if path.suffix in PICTURES:
                    pictures[f"{name}-{path.name}"] = path.read_bytes()
                    parts.append(f"![{path.stem.replace('_', ' ')}]({name}-{path.name})")
    parts.append(f"*The program of this page is `examples/tasks/{program.name}` in the repository.*")
    return Page("\n\n".join(part for part in parts if part) + "\n", pictures)


@contextlib.contextmanager
def _empty_folder() -> Iterator[Path]:
    """An empty folder as the working directory."""
    before, folder = Path.cwd(), Path(tempfile.mkdtemp())
    try:
        os.chdir(folder)
        yield folder
    finally:
        os.chdir(before)
        shutil.rmtree(folder)


def write(program: Path) -> None:
    """Write the page of a program and its pictures."""
    page = page_of(program)
    PAGES.mkdir(exist_ok=True)
    for old in PAGES.glob(f"{program.stem}-*"):
        old.unlink()
    for name, content in page.pictures.items():
        (PAGES / name).write_bytes(content)
    (PAGES / f"{program.stem}.md").write_text(page.text, encoding="utf-8")


if __name__ == "__main__":
    for each in programs():
        if len(sys.argv) < 2 or each.stem in sys.argv[1:]:
            write(each)
            sys.stderr.write(f"docs/tasks/{each.stem}.md\n")
