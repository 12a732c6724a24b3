"""``pfabrik catalog``: the machines that come with the library."""

from __future__ import annotations

import json

import click

from ..answers.aligned_text import aligned
from ..catalog import catalog as names
from ..catalog import description


@click.command()
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout.")
def catalog(as_json: bool) -> int:
    """List the mechanisms supplied.

    Each file begins with more about its mechanism: whose dimensions it has, what home is, what its joints count.
    """
    described = {name: description(name) for name in names()}
    click.echo(json.dumps(described) if as_json else aligned(("name", "mechanism"), described.items()))
    return 0
