"""``pfabrik ik``: one target, one answer."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from .mech import MECH, load
from .projecting import note_left_out, note_unused, options_projecting, projecting
from .report import describe, in_units, margins_table, pose_header, pose_texts, tell_modes
from .target import Triple, target_of, targeted

if TYPE_CHECKING:
    from ..answers.solution import Solution
    from ..description.mechanism import Mechanism
    from ..targets import Target


@click.command()
@click.argument("mech", type=MECH)
@targeted
@projecting
@click.option("--margins", "with_margins", is_flag=True, help="List how far off every limit is, nearest first.")
@click.option("--all", "list_all", is_flag=True, help="List every working mode, limits kept or not.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def ik(
    mech: str,
    position: Triple | None,
    rpy: Triple | None,
    joint: str | None,
    hold: str,
    projection: str,
    with_margins: bool,
    list_all: bool,
    as_json: bool,
) -> int:
    """Solve for one target.

    A target out of reach gets the feasible answer nearest to it, with the limits that hold it back, the hardest first.

    A margin is a share of the room there is: 1 in the middle of a range, 0 on the limit.

    With --all only what reaches the target is listed, and the exit code is 0 if some mode keeps all limits.
    """
    if list_all and with_margins:
        raise click.UsageError("--margins is of one answer: it does not go with --all")
    if position is None and rpy is None and joint is None:
        raise click.UsageError("no target: give --position, --rpy or both, or --joint")
    mechanism = load(mech)
    target = target_of(mechanism, position, rpy, joint)
    note_ignored(mechanism, position, rpy)
    if list_all:
        note_unused("--all")
        return list_modes(mechanism, target, as_json)
    solution = pf.solve_ik(mechanism, target, options=options_projecting(hold, projection))
    if as_json:
        answer = solution.to_dict() | ({} if solution else {"reason": solution.reason})
        if with_margins:
            from ..answers.margins import nearest_first

            names = ("joint", "bound", "margin")
            answer["margins"] = [dict(zip(names, limit, strict=True)) for limit in nearest_first(solution)]
        click.echo(json.dumps(answer, allow_nan=False))
    else:
        click.echo(describe(solution))
        if with_margins:
            click.echo(f"\n{margins_table(solution)}")
    return 0 if solution else 1


def note_ignored(mechanism: Mechanism, position: Triple | None, rpy: Triple | None) -> None:
    """Say so when the task leaves out what the user gave."""
    task, left_out = set(mechanism.task), []
    if position and not task & set("xyz"):
        left_out.append("--position")
    elif position:
        off = zip("xyz", position, mechanism.reference_point, strict=True)
        left_out += [f"{axis} of --position" for axis, asked, home in off if axis not in task and asked != home]
    if rpy and not task & {"rotation", "tilt", "yaw"}:
        left_out.append("--rpy")
    elif rpy and "yaw" in task and any(rpy[:2]):
        left_out.append("the tilt in --rpy")
    elif rpy and "tilt" in task and any(rpy) and not any(rpy[:2]):
        left_out.append("the yaw of --rpy")
    note_left_out(left_out, mechanism)


def list_modes(mechanism: Mechanism, target: Target, as_json: bool) -> int:
    """Print all working modes, each with its actuator values, and its pose where the task leaves it open."""
    from ..description.readouts import readouts

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
