"""What the commands that solve share: ``--hold``, ``--projection``, and notes of what has no effect."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Literal, cast

import click

import pfabrik as pf

if TYPE_CHECKING:
    from ..description.mechanism import Mechanism
    from ..options import Options

Hold = Literal["orientation", "position"]
Projection = Literal["nearest", "centroid"]

HOLDS: dict[str, Hold | None] = {"orientation": "orientation", "position": "position", "none": None}
PROJECTIONS: tuple[Projection, ...] = ("nearest", "centroid")

hold_option = click.option(
    "--hold",
    type=click.Choice(list(HOLDS)),
    default="orientation",
    show_default=True,
    help="What an answer to a target out of reach keeps exactly, if any pose does.",
)
projection_option = click.option(
    "--projection",
    type=click.Choice(PROJECTIONS),
    default="nearest",
    show_default=True,
    help="Which answer that is: the nearest, or where the chains' ends agree.",
)


def projecting(command: Callable[..., Any]) -> Callable[..., Any]:
    """Both options, in this order."""
    return hold_option(projection_option(command))


def options_projecting(hold: str, projection: str) -> Options:
    """Solver options for the values of both."""
    return pf.Options(hold=HOLDS[hold], projection=cast(Projection, projection))


def note_left_out(given: Iterable[str], mechanism: Mechanism) -> None:
    """Say so when the task leaves out what was given."""
    for each in given:
        click.echo(f"pfabrik: note: {each} has no effect: the task is {' '.join(mechanism.task)}", err=True)


def note_unused(because: str) -> None:
    """Say so when one of them is given where nothing is projected."""
    context = click.get_current_context()
    for name in ("hold", "projection"):
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE:
            click.echo(f"pfabrik: note: --{name} has no effect with {because}: nothing is projected", err=True)
