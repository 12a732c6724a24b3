"""How near projections are: answers to unreachable targets next to the nearest feasible poses of a general optimiser.

python benchmarks/nearest.py [--targets N] [--keep FOLDER] [MACHINE ...]

The optimiser is SciPy's SLSQP on closed-form loops and limits, from the answer judged, home, and six random starts. It
takes from a tenth of a second to a second a target.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import pfabrik as pf
from table import machine
from timing import best_times
from yardstick import one_core

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from checks import gap_of_points
from oracles.nearest import Problem, drawn_targets, nearest

Array = NDArray[np.float64]

MACHINES = ("five_bar", "stewart", "nrpm", "servo_hexapod", "delta")

SAME = 1e-6
"""Share of the distance by which an answer may be farther and still count as nearest."""

FEASIBLE = 1e-9
"""What loops may be open, and limits exceeded [L or rad]."""

COLUMNS = (
    "machine",
    "held",
    "targets",
    "fell back",
    "wrongly",
    "within 1e-6",
    "within 1 %",
    "worst ratio",
    "farther by at most [L]",
    "feasible",
    "us a target",
)


class Judged(NamedTuple):
    """One answer next to the nearest pose found.

    Attributes
    ----------
    ratio, farther : of their distances, and by how much it is farther [L].
    fell_back, wrongly : whether it gave up what it was to hold, and whether a pose that holds it was found.
    excess : by how much it exceeds limits or opens loops [L or rad].
    """

    ratio: float
    farther: float
    fell_back: bool
    wrongly: bool
    excess: float


def unreached(mechanism: pf.Mechanism, n: int, options: pf.Options) -> Array:
    """Targets (n, 4, 4) that are not reached, from 0.05 L to 5 L from home."""
    rng, found = np.random.default_rng(1), np.zeros((0, 4, 4))
    while len(found) < n:
        drawn = drawn_targets(mechanism, rng, 2 * n)
        found = np.concatenate([found, drawn[pf.solve_ik(mechanism, drawn, options=options).status > 0]])
    return found[:n]


def judged(mechanism: pf.Mechanism, target: Array, answer: pf.Solution, hold: str | None) -> Judged:
    """An answer next to the nearest pose found that holds as much; wrong is to give up what some pose could hold."""
    fell_back = hold != answer.held
    problem = Problem(mechanism, target, answer.held, answer)
    excess = max(problem.excess(problem.answer), float(gap_of_points(mechanism, answer)[0]))
    if fell_back and nearest(Problem(mechanism, target, hold, answer)) is not None:
        return Judged(np.inf, np.inf, True, True, excess)
    found = nearest(problem)
    gain = 0.0 if found is None else max(0.0, found.gain)
    distance = problem.distance * problem.model.length
    ratio = distance / (distance - gain) if gain < distance else np.inf
    return Judged(ratio, gain / problem.model.length, fell_back, False, excess)


def row(name: str, hold: str | None, n: int, keep: Path | None) -> list[str]:
    """The line of a machine; what is missed by more than `SAME` is kept."""
    mechanism, options = pf.load(name), pf.Options(hold=hold)
    asked = hold if {"rotation", "tilt"} & set(mechanism.task) else None
    targets = unreached(mechanism, n, options)
    with one_core():
        (seconds,) = best_times(1, lambda: pf.solve_ik(mechanism, targets, options=options))
    answers = pf.solve_ik(mechanism, targets, options=options)
    found = [judged(mechanism, target, answer, asked) for target, answer in zip(targets, answers, strict=True)]
    ratios, farther, fell_back, wrongly, worst = (np.array(column) for column in zip(*found, strict=True))
    missed = (ratios > 1.0 + SAME) | (worst > FEASIBLE)
    if keep is not None and missed.any():
        np.savez(keep / f"{name}-{asked}.npz", targets=targets[missed], ratios=ratios[missed], excess=worst[missed])
    return [
        name,
        asked or "nothing",
        f"{n}",
        f"{fell_back.sum()}",
        f"{wrongly.sum()}",
        f"{100.0 * (ratios <= 1.0 + SAME).mean():.2f} %",
        f"{100.0 * (ratios <= 1.01).mean():.2f} %",
        f"{ratios.max():.8f}",
        f"{farther.max():.1e}",
        f"{100.0 * (worst <= FEASIBLE).mean():.2f} %",
        f"{1e6 * seconds / n:.0f}",
    ]


def rows(names: list[str], n: int, keep: Path | None) -> Iterator[list[str]]:
    for name in names:
        holds = ("orientation", None) if "rotation" in pf.load(name).task else (None,)
        for hold in holds:
            yield row(name, hold, n, keep)


def main() -> None:
    """Print one line for each machine and what is held."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("machines", nargs="*", default=list(MACHINES), metavar="MACHINE")
    parser.add_argument("--targets", type=int, default=1000)
    parser.add_argument("--keep", type=Path, help="folder for targets whose answers are not the nearest found")
    asked = parser.parse_args()
    print(f"{machine()}\n")
    print("| " + " | ".join(COLUMNS) + " |\n|" + " --- |" * len(COLUMNS), flush=True)
    for cells in rows(asked.machines, asked.targets, asked.keep):
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
