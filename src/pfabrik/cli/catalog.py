"""``pfabrik catalog``: the machines that come with the library."""

from __future__ import annotations

import click

from ..catalog import catalog as names
from ..catalog import description
from ..printed import aligned
from .printing import json_option, print_answer


@click.command()
@json_option("One JSON object on stdout.")
def catalog(as_json: bool) -> int:
    """List the mechanisms supplied.

    Each file begins with more about its mechanism: whose dimensions it has, what home is, what its joints count.
    """
    described = {name: description(name) for name in names()}
    print_answer(as_json, lambda: described, lambda: aligned(("name", "mechanism"), described.items()))
    return 0
