"""``pfabrik ik``: one target, one answer."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from .hold import hold_option, options_holding
from .table import aligned

if TYPE_CHECKING:
    from ..mechanism import Mechanism
    from ..solution import Solution

Triple = tuple[float, float, float]


@click.command()
@click.argument("mech")
@click.option("--position", type=float, nargs=3, metavar="X Y Z", help="Of the reference point. Default: at home.")
@click.option("--rpy", type=float, nargs=3, metavar="R P Y", help="Roll, pitch, yaw [deg] from home. Default: 0 0 0.")
@hold_option
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout; angles in radians.")
def ik(mech: str, position: Triple | None, rpy: Triple | None, hold: str, as_json: bool) -> int:
    """Solve for one target.

    A target out of reach gets a feasible answer near it, with the limits that hold it back.
    """
    if position is None and rpy is None:
        raise click.UsageError("no target: give --position, --rpy or both")
    mechanism = pf.load(mech)
    note_ignored(mechanism, position, rpy)
    target = pf.pose(position or mechanism.reference_point, rpy=[math.radians(angle) for angle in rpy or (0, 0, 0)])
    solution = pf.solve_ik(mechanism, target, options=options_holding(hold))
    click.echo(json.dumps(solution.to_dict(), allow_nan=False) if as_json else describe(solution))
    return 0 if solution else 1


def note_ignored(mechanism: Mechanism, position: Triple | None, rpy: Triple | None) -> None:
    """Say so when the task leaves out what the user gave."""
    task = set(mechanism.task)
    left_out = {"--position": position and not task & set("xyz"), "--rpy": rpy and not task & {"rotation", "tilt"}}
    for option in (name for name, ignored in left_out.items() if ignored):
        click.echo(f"pfabrik: note: {option} has no effect: the task is {' '.join(mechanism.task)}", err=True)


def describe(solution: Solution) -> str:
    """The answer for people: what became of the target, the pose, the actuators; angles in degrees."""
    from ..report import as_sentence, loop_gap, rpy_angles

    mechanism = solution.mechanism
    unit, smallest = mechanism.length_unit, 1e-9 * mechanism.characteristic_length
    position = [plain(value, smallest) for value in solution.pose[:3, 3]]
    angles = [plain(math.degrees(angle), 1e-7) for angle in rpy_angles(solution.pose)]
    rows = [
        ("x y z", "   ".join(position), unit),
        ("roll pitch yaw", "   ".join(angles), "deg"),
    ]
    width = max(len(value) for _, value, _ in rows)
    lines = [f"{name:<16}{value:<{width}}   [{label}]" for name, value, label in rows]
    return "\n".join(
        [as_sentence(solution), "", *lines, f"{'loops closed to':<16}{loop_gap(solution)}", "", actuators(solution)]
    )


def actuators(solution: Solution) -> str:
    """Table of the actuator values with their limits."""
    from ..report import readouts

    rows = []
    for readout, value in zip(readouts(solution.mechanism), solution.actuators, strict=True):
        low, high = (f"{bound:.6g}" if math.isfinite(bound) else "-" for bound in readout.limits)
        rows.append((readout.name, f"{plain(float(readout.display(value)), 1e-9)}", low, high, readout.unit))
    return aligned(("actuator", "value", "min", "max", "unit"), rows)


def plain(value: float, smallest: float) -> str:
    """Six digits; what is smaller than `smallest` is noise and reads 0."""
    return f"{value:.6g}" if abs(value) > smallest else "0"
