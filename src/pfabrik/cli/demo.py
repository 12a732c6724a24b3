"""``pfabrik demo``: three mechanisms follow circles that leave their workspaces."""

from __future__ import annotations

import time
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import click

import pfabrik as pf

from ..common.extras import require
from ..common.printed import aligned, error_text
from .outputs import check_outputs, new_folder, real, whole_folder, write_picture
from .printing import print_text

if TYPE_CHECKING:
    from ..common.arrays import Floats

QUICK_STEPS = 36


@dataclass(frozen=True)
class Run:
    """One mechanism's circle, followed."""

    key: str
    targets: Floats
    solution: pf.Track
    seconds: float


@click.command()
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), default=Path("out"), show_default=True, help="Folder to write."
)
@click.option("--steps", type=click.IntRange(min=3), default=360, show_default=True, help="Targets on each circle.")
@click.option("--quick", is_flag=True, help=f"{QUICK_STEPS} targets on each circle.")
def demo(output: Path, steps: int, quick: bool) -> int:
    """Follow circles that leave the workspace.

    Three mechanisms track the circles of the P-FABRIK paper; pictures and CSV files go to a folder.

    The upper arc of each circle is out of reach: there the answer is the feasible pose that is nearest
    to the target, and every limit is still kept.
    """
    require("pictures", "matplotlib", "plot")
    check_outputs([("-o", output)])
    with new_folder(real(output)):  # what cannot be written is found before the work begins
        runs = []
    count = QUICK_STEPS if quick else steps
    for key, targets in circles(count):
        runs.append(follow(key, targets))
        with whole_folder(output) as folder:
            write_picture(folder / f"{key}.png", partial(pf.plot_track, runs[-1].solution))
        click.echo(f"wrote {output / key}.png", err=True)
    with whole_folder(output) as folder:
        for run in runs:
            write(run, folder)
    header = ("mechanism", "reached", "projected", "failed", "farthest", "loop gap", "limit excess", "per step")
    print_text(aligned(header, map(row, runs)))
    click.echo(f"\nwrote {', '.join(f'{run.key}.png, {run.key}.csv' for run in runs)} to {output}/")
    return 0 if all(holds(run.solution) for run in runs) else 1


def circles(steps: int) -> Iterator[tuple[str, Floats]]:
    """Each mechanism's name in the catalogue and its circle, poses (steps, 4, 4) from the lowest and back.

    The mechanism whose kernels are compiled soonest comes first.
    """
    import numpy as np

    turn = np.linspace(0, 2 * np.pi, steps)
    around = np.stack([np.zeros(steps), np.sin(turn), -np.cos(turn)], axis=-1)
    text = files(__package__).joinpath("demo.toml").read_text(encoding="utf-8")
    for key, circle in tomllib.loads(text).items():
        yield key, pf.pose(circle["center"] + circle["radius"] * around)


def follow(key: str, targets: Floats) -> Run:
    """Track one circle, and time it without the compilation of the kernels."""
    mechanism, steps = pf.load(key), len(targets)
    pf.track(mechanism, targets[:: max(1, steps // 12)])  # inside and outside: each has kernels of its own
    start = time.perf_counter()
    solution = pf.track(mechanism, targets)
    seconds = time.perf_counter() - start
    return Run(key, targets, solution, seconds)


def write(run: Run, folder: Path) -> None:
    """Write the CSV file of one run, with the active limits: these take joint coordinates, and more kernels."""
    from ..capabilities.paths.follow import TrackPart
    from ..capabilities.paths.path import Path as Targets
    from ..capabilities.paths.track_rows import TrackRows

    with (folder / f"{run.key}.csv").open("w", newline="", encoding="utf-8") as handle:
        TrackRows(handle).write(TrackPart(Targets.of(run.targets), run.solution, first=0))


def row(run: Run) -> tuple[str, ...]:
    """One line of the table; the worst of the run in every column."""
    solution = run.solution
    unit, size = solution.mechanism.length_unit, solution.mechanism.characteristic_length
    counts = Counter(solution.status.tolist())
    return (
        solution.mechanism.name,
        str(counts[pf.Status.REACHED]),
        str(counts[pf.Status.PROJECTED]),
        str(counts[pf.Status.FAILED] + counts[pf.Status.INVALID]),
        f"{error_text(solution.position_error.max(), '.3g', size)} {unit}",
        f"{error_text(solution.residual.max(), '.1e', size)} {unit}",
        error_text(solution.limit_excess.max(), ".1e"),
        f"{1e3 * run.seconds / len(solution):.3f} ms",
    )


def holds(solution: pf.Track) -> bool:
    """True if every step has an answer with its loops closed and its limits kept."""
    from ..tolerances import TOLERANCES

    answered = (solution.status < pf.Status.FAILED).all()
    closed = solution.residual.max() <= TOLERANCES.position * solution.mechanism.characteristic_length
    kept = solution.limit_excess.max() <= TOLERANCES.limit
    return bool(answered and closed and kept)
