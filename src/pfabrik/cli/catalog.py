"""``pfabrik catalog``: the machines that come with the library."""

from __future__ import annotations

import click

import pfabrik as pf

from .table import aligned


@click.command()
def catalog() -> int:
    """List the mechanisms supplied."""
    rows = [(name, pf.load(name).name) for name in pf.catalog()]
    click.echo(aligned(("name", "mechanism"), rows))
    return 0
