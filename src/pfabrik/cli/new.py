"""``pfabrik new``: a starting file for a machine of one's own."""

from __future__ import annotations

from pathlib import Path

import click

from ..catalog import template, templates, title
from .table import aligned
from .whole import whole_file


@click.command()
@click.argument("kind", required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="File to write. Default: print it.")
@click.option("--force", is_flag=True, help="Replace the file if it exists.")
@click.option("--list", "list_all", is_flag=True, help="List the kinds of machines there are files for.")
def new(kind: str | None, output: Path | None, force: bool, list_all: bool) -> int:
    """Write a starting file for a machine of your own.

    KIND is a name from `pfabrik new --list`. The file describes a machine of this kind that works as it is; its
    comments say what to measure and where to put it.
    """
    if list_all:
        click.echo(aligned(("kind", "machine"), [(name, title(name)) for name in templates()]))
        return 0
    if kind is None:
        raise click.UsageError(f"no KIND: give one of {', '.join(templates())}")
    text = template(kind)
    if output is None:
        click.echo(text, nl=False)
        return 0
    if output.is_dir():
        raise click.ClickException(f"{output}: is a folder; expected the name of a file")
    if output.exists() and not force:
        raise click.ClickException(f"{output}: exists already; --force replaces it")
    with whole_file(output) as handle:
        handle.write(text)
    click.echo(f"wrote {output}; next: edit it, then pfabrik check {output}")
    return 0
