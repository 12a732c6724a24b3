"""``pfabrik ik``: one target, one answer."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from .answer import describe, in_units, pose_header, pose_texts, tell_modes
from .hold import hold_option, options_holding

if TYPE_CHECKING:
    from ..mechanism import Mechanism
    from ..report import Floats
    from ..solution import Solution

Triple = tuple[float, float, float]


@click.command()
@click.argument("mech")
@click.option("--position", type=float, nargs=3, metavar="X Y Z", help="Of the reference point. Default: at home.")
@click.option("--rpy", type=float, nargs=3, metavar="R P Y", help="Roll, pitch, yaw [deg] from home. Default: 0 0 0.")
@hold_option
@click.option("--all", "list_all", is_flag=True, help="List every working mode, limits kept or not.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def ik(mech: str, position: Triple | None, rpy: Triple | None, hold: str, list_all: bool, as_json: bool) -> int:
    """Solve for one target.

    A target out of reach gets a feasible answer near it, with the limits that hold it back.

    With --all only what reaches the target is listed, and the exit code is 0 if some mode keeps all limits.
    """
    if position is None and rpy is None:
        raise click.UsageError("no target: give --position, --rpy or both")
    mechanism = pf.load(mech)
    note_ignored(mechanism, position, rpy)
    target = pf.pose(position or mechanism.reference_point, rpy=[math.radians(angle) for angle in rpy or (0, 0, 0)])
    if list_all:
        note_hold()
        return list_modes(mechanism, target, as_json)
    solution = pf.solve_ik(mechanism, target, options=options_holding(hold))
    click.echo(json.dumps(solution.to_dict(), allow_nan=False) if as_json else describe(solution))
    return 0 if solution else 1


def note_ignored(mechanism: Mechanism, position: Triple | None, rpy: Triple | None) -> None:
    """Say so when the task leaves out what the user gave."""
    task = set(mechanism.task)
    left_out = {"--position": position and not task & set("xyz"), "--rpy": rpy and not task & {"rotation", "tilt"}}
    for option in (name for name, ignored in left_out.items() if ignored):
        click.echo(f"pfabrik: note: {option} has no effect: the task is {' '.join(mechanism.task)}", err=True)


def note_hold() -> None:
    """Say so when `--hold` is given where nothing is projected."""
    source = click.get_current_context().get_parameter_source("hold")
    if source is click.core.ParameterSource.COMMANDLINE:
        click.echo("pfabrik: note: --hold has no effect with --all: nothing is projected", err=True)


def list_modes(mechanism: Mechanism, target: Floats, as_json: bool) -> int:
    """Print all working modes, each with its actuator values, and its pose where the task leaves it open."""
    from ..report import readouts

    shown = readouts(mechanism)
    header = [f"{readout.name} [{readout.unit}]" for readout in shown]
    is_open = mechanism.task != mechanism.whole_task

    def cells(mode: Solution) -> list[str]:
        position, angles = pose_texts(mode) if is_open else ([], [])
        return [*in_units(shown, mode.actuators), *position, *angles]

    return tell_modes(
        lambda: pf.working_modes(mechanism, target),
        "working",
        header + (pose_header(mechanism) if is_open else []),
        cells,
        as_json,
    )
