"""The `pfabrik` command. Each subcommand is the module of its name and is loaded on demand."""

from __future__ import annotations

import click

from .. import __version__
from .group import CommandGroup

__all__ = ["main"]


@click.command(
    cls=CommandGroup,
    subcommands={
        "catalog": "List the mechanisms supplied.",
        "new": "Write a starting file for a machine of your own.",
        "info": "Show what a mechanism is made of.",
        "check": "Check a mechanism file.",
        "ik": "Solve for one target.",
        "fk": "Find the pose that has given actuator values.",
        "track": "Follow a path of targets.",
        "travel": "Tell how far the end effector can go along and about axes.",
        "workspace": "Tell how big the workspace is, and which limits form its border.",
        "certify": "Prove that every pose of a region is reached, or find one that is not.",
        "calibrate": "Find the parameters of a machine from measurements.",
        "time": "Find the fastest way along a path.",
        "speed": "Tell how fast the platform may move.",
        "plot": "Draw a machine at home, or where a target takes it.",
        "view": "Show a machine in the browser: drag its target, drive its actuators, see what stops it.",
        "import": "Turn a MuJoCo model (MJCF), a URDF or an SDF into a mechanism file.",
        "export": "Write a mechanism for another program.",
        "verify": "Compare answers with those of MuJoCo.",
        "demo": "Follow circles that leave the workspace.",
    },
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
