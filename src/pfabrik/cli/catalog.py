"""``pfabrik catalog``: the machines that come with the library."""

from __future__ import annotations

import click

from ..catalog import catalog as names
from ..catalog import description
from .table import aligned


@click.command()
def catalog() -> int:
    """List the mechanisms supplied.

    Each file begins with more about its mechanism: whose dimensions it has, what home is, what its joints count.
    """
    click.echo(aligned(("name", "mechanism"), [(name, description(name)) for name in names()]))
    return 0
