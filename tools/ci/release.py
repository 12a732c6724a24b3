"""What a release needs: one version everywhere, and the README of a package that is on an index.

python tools/ci/release.py v0.1.0       # what is missing for this tag; nothing is published
python tools/ci/release.py --readme     # write the README's lines on installation from pyproject.toml
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BEGIN, END = "<!-- install: begin -->\n", "<!-- install: end -->\n"
RESERVED = ".example"
"""The end of names that nobody can have: that of the site until a person has an account for it."""


def main(words: list[str]) -> int:
    """Write the README's lines, or say what is missing for a tag; 0 if nothing is."""
    if words == ["--readme"]:
        readme = ROOT / "README.md"
        readme.write_text(with_install_lines(readme.read_text(encoding="utf-8")), encoding="utf-8")
        return 0
    if len(words) != 1:
        print(__doc__)
        return 2
    missing = list(missing_for(words[0]))
    print("\n".join(missing) or f"{words[0]}: nothing is missing")
    return int(bool(missing))


def project() -> dict[str, object]:
    """The table of pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def install_lines(table: dict) -> str:
    """The one line that installs the package, and the address of the site, as the README has them."""
    name, address = table["project"]["name"], table["project"]["urls"]["Documentation"]
    if table["tool"]["pfabrik"]["released"]:
        line, since = f'pip install "{name}[plot]"', ""
    else:
        line = 'pip install ".[plot]"       # in a clone, where it compiles for half a minute'
        since = ", from the first release on"
    return f"```\n{line}\n```\n\nThe documentation, with machines to drag: <{address}>{since}.\n"


def with_install_lines(readme: str) -> str:
    """The README with the lines that follow from pyproject.toml."""
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        sys.exit(f"README.md: found no {BEGIN.strip()} and {END.strip()}")
    return before + BEGIN + install_lines(project()) + END + after


def missing_for(tag: str) -> Iterator[str]:
    """What is missing for a release of this tag, one a line."""
    table, readme = project(), (ROOT / "README.md").read_text(encoding="utf-8")
    version = re.search(r'__version__ = "(.*)"', (ROOT / "src/pfabrik/__init__.py").read_text(encoding="utf-8"))[1]
    if tag != f"v{version}":
        yield f"found the tag {tag}; expected v{version}, as src/pfabrik/__init__.py has it"
    if f"\nversion: {version}\n" not in (ROOT / "CITATION.cff").read_text(encoding="utf-8"):
        yield f"CITATION.cff: expected version {version}"
    if f"\n## [{version}]" not in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"):
        yield f"CHANGELOG.md: expected a heading [{version}], with the date"
    if table["project"]["urls"]["Documentation"].rstrip("/").endswith(RESERVED):
        yield "pyproject.toml: project.urls.Documentation is nobody's; expected the address of the site"
    if not table["tool"]["pfabrik"]["released"]:
        yield "pyproject.toml: tool.pfabrik.released is false"
    if readme != with_install_lines(readme):
        yield "README.md: expected what pyproject.toml says; python tools/ci/release.py --readme"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
