"""``pfabrik reproduce``: the experiments of the P-FABRIK paper, next to what it printed."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import click

from ..answers.table import aligned
from ..telling import telling
from .whole import whole_folder

NEEDED = ("matplotlib", "scipy")


@click.command()
@click.option("--out", type=click.Path(path_type=Path), default=Path("out"), show_default=True, help="Folder to write.")
@click.option("--quick", is_flag=True, help="Fewer steps, targets and searches.")
@click.option(
    "--readme",
    type=click.Path(path_type=Path, exists=True, dir_okay=False, writable=True),
    help="Put the summary between the two marks of this file.",
)
def reproduce(out: Path, quick: bool, readme: Path | None) -> int:
    """Run the paper's experiments again.

    Accuracy on paths inside the workspace, cost at random targets, and circles that leave the workspace, for three
    mechanisms: report.md with its tables, pictures and CSV files go to a folder. Ends with 0 if all holds that must.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        found = " and ".join(missing)
        raise click.UsageError(f"this needs {found}; install it with: pip install 'pfabrik[reproduce]'")
    from ..reproduce import everything, output, report

    with whole_folder(out) as folder, telling("reproduce") as on_progress:
        findings = everything.run(quick, on_progress)
        output.write(findings, folder)
    if readme is not None:
        report.put_into(readme, report.summary(findings))
    promises = report.promises(findings)
    rows = [("yes" if promise.holds else "NO", promise.text, promise.measured) for promise in promises]
    click.echo(aligned(("holds", "promise", "measured"), rows))
    click.echo(f"\nwrote report.md, pictures and CSV files to {out}/")
    return 0 if all(promise.holds for promise in promises) else 1
