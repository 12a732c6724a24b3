"""`python -m paper`: the experiments of the P-FABRIK paper, next to what it printed."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

NEEDED = ("matplotlib", "scipy")
PAGE = Path(__file__).parents[1] / "docs" / "reproduction.md"
FIRST_PAGE = Path(__file__).parents[1] / "README.md"


def main(line: list[str] | None = None) -> int:
    """Run the experiments: 0 if all holds that must, 1 if not, 2 where something is missing."""
    parser = argparse.ArgumentParser(
        prog="python -m paper",
        description="Run the paper's experiments again: accuracy on paths inside the workspace, cost at random "
        "targets, and circles that leave the workspace, for three mechanisms. report.md with its tables, pictures "
        "and CSV files go to a folder. Ends with 0 if all holds that must.",
    )
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("out"), metavar="FOLDER", help="folder to write (out)"
    )
    parser.add_argument("--quick", action="store_true", help="fewer steps, targets and searches")
    parser.add_argument(
        "--page",
        type=Path,
        nargs="?",
        const=PAGE,
        metavar="FILE",
        help="put the tables between the two marks of a file; where none is named of docs/reproduction.md, and some "
        "lines into README.md",
    )
    given = parser.parse_args(line)
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        parser.error(f"this needs {' and '.join(missing)}; install it with: python -m pip install {' '.join(missing)}")
    if given.page is not None and not given.page.is_file():
        parser.error(f"{given.page}: no such file")
    return reproduce(given.output, given.quick, given.page)


def reproduce(out: Path, quick: bool, page: Path | None) -> int:
    """Run, write, and print what must hold."""
    from . import everything, output, report

    out.mkdir(parents=True, exist_ok=True)
    findings = everything.run(quick, progress() if sys.stderr.isatty() else None)
    with tempfile.TemporaryDirectory(dir=out, prefix=".part-") as part:  # all of it or nothing
        output.write(findings, Path(part))
        for path in sorted(Path(part).iterdir()):
            path.replace(out / path.name)
    if page is not None:
        report.put_into(page, report.page_tables(findings))
        if page == PAGE:
            report.put_into(FIRST_PAGE, report.lines_of_summary(findings))
    promises = report.promises(findings)
    for promise in promises:
        sys.stdout.write(f"{'holds' if promise.holds else 'FAILS'}  {promise.text}: {promise.measured}\n")
    sys.stdout.write(f"\nwrote report.md, pictures and CSV files to {out}/\n")
    return 0 if all(promise.holds for promise in promises) else 1


def progress() -> Callable[[int, int], None]:
    """What to call with (done, total): a line on standard error that is written over."""

    def tell(done: int, total: int) -> None:
        sys.stderr.write(f"\r{done} of {total}" + ("\n" if done == total else ""))
        sys.stderr.flush()

    return tell


if __name__ == "__main__":
    sys.exit(main())
