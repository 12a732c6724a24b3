"""The `pfabrik` command. Each subcommand is the module of its name and is loaded on demand."""

from __future__ import annotations

import click

from .. import __version__
from .group import CommandGroup

__all__ = ["main"]


@click.command(
    cls=CommandGroup,
    subcommands=(
        *("catalog", "new", "info", "check"),
        *("ik", "fk", "track", "travel", "workspace", "time", "speed"),
        *("plot", "view"),
        *("import", "export", "verify"),
        *("compile", "demo"),
    ),
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, message="pfabrik %(version)s", help="Show the version.")
@click.pass_context
def main(context: click.Context) -> int:
    """Kinematics of parallel mechanisms, with every limit kept.

    MECH is a name from `pfabrik catalog` or the path of a mechanism file.

    Exit codes: 0 reached or ok, 1 projected or anything else not reached, 2 wrong input.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
    return 0
