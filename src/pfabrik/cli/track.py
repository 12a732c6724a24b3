"""``pfabrik track``: a path of targets, each answer starting from the one before."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from .hold import hold_option, options_holding
from .progress import progress
from .whole import whole_file

if TYPE_CHECKING:
    from ..solution import Solution


@click.command()
@click.argument("mech")
@click.argument("path", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="CSV file to write.")
@hold_option
def track(mech: str, path: Path, output: Path, hold: str) -> int:
    """Follow a path of targets.

    Reads the targets from a CSV file and writes the answers to another. Each answer starts from the one before.

    PATH has a header line and the columns x, y, z and, optionally, roll, pitch, yaw [deg]. In the output all angles
    are in radians.
    """
    from .pathfile import read_targets, write_track

    mechanism = pf.load(mech)
    targets = read_targets(path)
    with whole_file(output) as handle:
        with progress(f"tracking {len(targets)} targets") as on_progress:
            solution = pf.track(mechanism, targets, options=options_holding(hold), on_progress=on_progress)
        write_track(handle, targets, solution)
    click.echo(summary(solution))
    return 0 if solution else 1


def summary(solution: Solution) -> str:
    """What became of the targets, in one line."""
    counts = count_statuses(solution)
    told = ", ".join(f"{count} {name}" for name, count in counts.items() if count or name == "reached")
    if not counts["projected"]:
        return told
    return (
        f"{told}; farthest from its target {float(solution.position_error.max()):.3g} {solution.mechanism.length_unit}"
    )


def count_statuses(solution: Solution) -> dict[str, int]:
    """How many targets ended in each status, by its name in lower case."""
    return {status.name.lower(): int((solution.status == status).sum()) for status in pf.Status}
