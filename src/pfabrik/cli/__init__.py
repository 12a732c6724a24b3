"""The `pfabrik` command. The modules of subcommands are loaded on demand."""

from __future__ import annotations

import click

from .. import __version__
from .group import CommandGroup

__all__ = ["main"]


@click.command(
    cls=CommandGroup,
    subcommands={
        "catalog": ("machines", "List the mechanisms supplied."),
        "new": ("machines", "Write a starting file for a machine of your own."),
        "info": ("machines", "Show what a mechanism is made of."),
        "check": ("machines", "Check a mechanism file."),
        "ik": ("questions", "Solve for one target."),
        "fk": ("questions", "Find the pose that has given actuator values."),
        "track": ("track", "Follow a path of targets."),
        "travel": ("questions", "Tell how far the end effector can go along and about axes."),
        "workspace": ("workspace", "Tell how big the workspace is, and which limits form its border."),
        "certify": ("certify", "Prove that every pose of a region is reached, or find one that is not."),
        "design": ("design", "Find dimensions with which a machine does what it must, as small as can be."),
        "calibrate": ("calibrate", "Find the parameters of a machine from measurements."),
        "time": ("track", "Find the fastest way along a path."),
        "effort": ("motor_forces", "Tell what motors exert along a path."),
        "identify": ("motor_forces", "Find masses and friction from efforts measured in motion."),
        "speed": ("questions", "Tell how fast the platform may move."),
        "singularities": ("workspace", "Tell how near singularities are, at a pose or over a workspace."),
        "forces": ("statics", "Tell what the actuators exert to hold a load."),
        "stiffness": ("statics", "Tell how stiff a machine is whose actuators and rods give."),
        "accuracy": ("statics", "Tell how far off a pose is if actuators are off and joints have play."),
        "transmission": ("statics", "Tell the velocity and force of the end effector per actuator."),
        "clearance": ("statics", "Tell how far apart links are, and which two are nearest."),
        "plot": ("show", "Draw a machine at home, or where a target takes it."),
        "view": ("show", "Show a machine in the browser: drag its target, drive its actuators, see what stops it."),
        "import": ("import_", "Turn a MuJoCo model (MJCF), a URDF or an SDF into a mechanism file."),
        "join": ("join", "Join machines, or have arms hold an object, as one mechanism file."),
        "export": ("export", "Write a mechanism for another program."),
        "verify": ("import_", "Compare answers with those of MuJoCo."),
        "demo": ("demo", "Follow circles that leave the workspace."),
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
