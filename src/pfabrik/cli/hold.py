"""The option ``--hold`` of the commands that solve."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import click

import pfabrik as pf

if TYPE_CHECKING:
    from ..options import Options

HOLDS: dict[str, Literal["orientation", "position"] | None] = {
    "orientation": "orientation",
    "position": "position",
    "none": None,
}

hold_option = click.option(
    "--hold",
    type=click.Choice(list(HOLDS)),
    default="orientation",
    show_default=True,
    help="What an answer to a target out of reach keeps exactly.",
)


def options_holding(hold: str) -> Options:
    """Solver options for a value of ``--hold``."""
    return pf.Options(hold=HOLDS[hold])
