"""What a design costs: dimensions by counterexample, with the proof, next to differential evolution without one."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from unittest.mock import patch

import numpy as np
from scipy.optimize import differential_evolution

import pfabrik as pf
from pfabrik.kinematics import VariedMachine, varied
from table import Row
from timing import Array, best_times

VARY = {
    "base_radius": (60.0, 200.0),
    "base_angle": (4.0, 40.0),
    "platform_radius": (30.0, 120.0),
    "platform_angle": (20.0, 55.0),
    "height": (100.0, 400.0),
    "shortest": (80.0, 500.0),
    "longest": (120.0, 600.0),
}
TRAVEL, TURN = 30.0, np.radians(8.0)
MARGIN, RATIO, WIDER = 0.005, 1.82, 1.2
NEAR = 1.01
"""Of the design's aim, at which evolution stops that knows it."""


def designs(runs: int) -> Iterator[Row]:
    """On one core; times are for all of it. Evolution looks at corners alone; `certify` says what that is worth."""
    start = template("6-UPS")
    region = pf.PoseRegion.box([-TRAVEL] * 3, [TRAVEL] * 3, rotation=TURN)
    keep = [
        pf.keep.margin(MARGIN),
        pf.keep.stroke(RATIO),
        f"base_radius >= {WIDER}*platform_radius",
        pf.keep.singularity(None),
    ]

    def design() -> pf.Design:
        return pf.design(start, VARY, region, keep=keep, minimise="longest", about="home")

    found, n_looked = counted(design)
    assert found.verdict == "PROVED"
    (seconds,) = best_times(min(runs, 3), design)
    what = f"6-UPS, 7 dimensions for ±{TRAVEL:g} mm and ±8°, proved, {n_looked:,} machines looked at"
    for enough, words in ((NEAR * found.aim, "until near"), (0.0, "to its end")):
        began = time.perf_counter()
        machine, n_evolved = counted(lambda enough=enough: evolved(start, enough))
        theirs, above = time.perf_counter() - began, machine.dimensions["longest"] / found.aim - 1.0
        home = np.array(machine.reference_point)
        verdict = pf.certify(machine, pf.PoseRegion.box(home - TRAVEL, home + TRAVEL, rotation=TURN)).verdict.lower()
        evolution = f"differential_evolution {words}, {n_evolved:,} machines, {above:+.1%}, {verdict}"
        yield Row(what, 1, seconds, evolution, theirs)


def template(kind: str) -> pf.Mechanism:
    """The machine of a file to start from."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        subprocess.run([sys.executable, "-m", "pfabrik", "new", kind, "-o", path], check=True, capture_output=True)
        return pf.load(path)


def counted(answer: Callable[[], object]) -> tuple[object, int]:
    """An answer, and the number of machines that were looked at for it."""
    at, n = VariedMachine.at, 0

    def counting(machine: VariedMachine, values: Array) -> object:
        nonlocal n
        n += 1
        return at(machine, values)

    with patch.object(VariedMachine, "at", counting):
        return answer(), n


def evolved(start: pf.Mechanism, enough: float) -> pf.Mechanism:
    """A machine with short struts by differential evolution at corners of the region, with a penalty below 0."""
    machines, bounds = varied(start, tuple(VARY)), np.array(list(VARY.values()))
    corners = np.array(list(product(*[(-1.0, 1.0)] * 6))) * [*[TRAVEL] * 3, *[TURN] * 3]
    poses = pf.pose(corners[:, :3], rotvec=corners[:, 3:])

    def penalty(values: Array) -> float:
        machine = machines.at(values)
        moved = poses.copy()
        moved[:, 2, 3] += values[4]
        margins = np.nan_to_num(machine.margins(moved), nan=-1.0, posinf=1.0, neginf=-1.0) - MARGIN
        base, platform, (shortest, longest) = values[0], values[2], values[5:]
        rows = [RATIO * shortest / longest - 1.0, base / (WIDER * platform) - 1.0]
        return float(np.maximum(-margins, 0.0).sum() + np.maximum(-np.array(rows), 0.0).sum())

    def cost(values: Array) -> float:
        return values[6] + 1e4 * penalty(values)

    found = differential_evolution(
        cost, bounds, seed=0, maxiter=2000, polish=False, callback=lambda x, convergence: cost(x) <= enough
    )
    return start.with_dimensions(dict(zip(VARY, found.x.tolist(), strict=True)))
