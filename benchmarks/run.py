"""How fast it is: every time next to a baseline measured in the same run, by turns, so that noise hits both."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

import pfabrik as pf
from actuation_maps import actuation_rows
from calls import calls
from chains import chain_rows
from closed_forms import Array, FiveBar, Struts
from closure_engine import closed_chains, forward, joint_coordinates, modes
from designs import designs
from dynamics import dynamics
from in_c import IS_THERE, InC
from in_placo import peer
from kept_apart import kept_apart
from maps import maps
from passes import passes
from proofs import proofs
from table import Row, cells, machine, table
from timing import Solve, best_times, draw, in_blocks
from viewer import viewer
from workspaces import workspaces
from yardstick import geometric, one_core

CENTROID, NEAREST = pf.passes.Options.centroid(), pf.Options()

USE_EVERYTHING = """
import time, numpy as np
start = time.perf_counter()
import pfabrik as pf
for name in ("five_bar", "nrpm", "stewart"):
    m = pf.load(name)
    pf.solve_ik(m, m.home_pose)
    far = pf.solve_ik(m, np.array(m.reference_point) * 3.0)
    far.active_limits
    pf.track(m, np.array([m.reference_point] * 2))
    pf.solve_fk(m, far.actuators * 1.1).joints
    pf.singularity(far)
print(time.perf_counter() - start)
"""
FIRST_ANSWER = """
import time
start = time.process_time()
import pfabrik as pf
m = pf.load("{}")
pf.solve_ik(m, m.home_pose)
print(time.process_time() - start)
"""
IMPORT = "import time; start = time.perf_counter(); import pfabrik; print(time.perf_counter() - start)"


NOTE = """\
Times are the shortest of several runs, subject and baseline by turns; a ratio below 1 is faster than the baseline.
The closed forms (benchmarks/closed_forms.py) know their machine, use one core and blocks of 4096 poses, and return
numbers and a flag; pfabrik also measures pose error, loop gap and limit excess, and works out joint centres only when
`points` is read. C is benchmarks/leg_table.c, compiled with -O3 -march=native: it knows its machine, looks at every
limit, and goes row by row. Reachable targets lie within 0.2 L and 0.2 rad of home (NRPM: 0.4), those out of reach
within 1 L and 0.5 rad; these are projected exactly where a row does not say "centroid", which is the paper's method
on joint positions; a delta has no other way than exactly. Kernels of passes leave joint coordinates and measures out;
accelerated passes have exact meetings and half-spaces (docs/p-fabrik.md). Newton's method in NumPy
(benchmarks/newton.py) knows the hexapod, solves six equations in the pose for whole batches at a time, and looks at
no passive joint and no limit; forward kinematics here closes all loops in all joint coordinates, and measures limits.
Starts are answers up to 0.01 L and 0.01 rad away. Targets of chains are those of smooth bends, and the same 1.5 reaches
farther out; the engine in joint coordinates answers a few of them. PlaCo is a C++ solver of tasks with closed loops
(benchmarks/in_placo.py); its rows are left out where it is not installed, as are those of the viewer without headless
Chromium. Forces of a motion close the loops and share them among the actuators; Pinocchio (benchmarks/dynamics.py), as
the baseline where it is installed, has those of the open tree, with the rates of all joints as given. The platform with
40 modes is that of Dietmaier (1998). Designs are next to SciPy's differential evolution on the same rows at the corners
of the region, with a penalty, until it is within 1% of the design's aim, and until it ends by itself. Times of modes,
of designs, of workspaces and of new processes are for all of it, not for a pose; first answers count the processor's
time. The viewer's motions are timed in a page of Chromium, which draws without a graphics card, from the motion of the
mouse until the answer has been drawn."""


def agree(solution: pf.Solution, values: Array) -> None:
    """Stop where the closed form answers differently: the comparison would mean nothing."""
    if not solution or np.abs(solution.actuators - values).max() > 1e-6 * solution.mechanism.characteristic_length:
        sys.exit(f"the closed form disagrees with {solution!r}")


def batches(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """Reachable batches: on one core and on all, next to vectorised closed forms on one."""
    for name, closed, what in (("stewart", Struts, "6-UPS"), ("five_bar", FiveBar, "5-bar")):
        mechanism = pf.load(name)
        form = closed(mechanism)
        drawn = draw(mechanism, rng, 4 * n, 0.2, 0.2)
        targets = drawn[form.solve(drawn)[1]][:n]
        agree(pf.solve_ik(mechanism, targets), form.solve(targets)[0])
        baselines = {"NumPy, all limits": partial(in_blocks, form.solve, targets)}
        if IS_THERE:
            in_c = InC(form)
            agree(pf.solve_ik(mechanism, targets), in_c.solve(targets)[0])
            baselines["C, all limits"] = partial(in_c.solve, targets)
        baselines["geometric approach"] = partial(geometric.solve_ik, mechanism, targets)
        if isinstance(form, Struts):
            baselines["NumPy, lengths only"] = partial(in_blocks, form.lengths, targets)
        yield from batch_rows(mechanism, f"{what}, batch, reachable", targets, baselines, runs)
    mechanism = pf.load("nrpm")
    drawn = draw(mechanism, rng, n // 2, 0.4, 0.4)
    found = pf.solve_ik(mechanism, drawn)
    arms = [name[0] in "AB" for name in mechanism.actuator_names]
    rests = (np.abs(found.actuators - pf.solve_ik(mechanism, mechanism.home_pose).actuators)[:, arms] < 1e-9).all(
        axis=1
    )
    struts = Struts(mechanism)
    for what, which in (("arms rest", rests), ("arms move", ~rests)):
        targets = drawn[which & (found.status == pf.Status.REACHED)][: n // 50]
        baselines = {
            "NumPy, six lengths, arms unmoved": partial(in_blocks, struts.lengths, targets),
            "geometric approach": partial(geometric.solve_ik, mechanism, targets),
        }
        yield from batch_rows(mechanism, f"NRPM, batch, reachable within 0.4 L, {what}", targets, baselines, runs)


def batch_rows(
    mechanism: pf.Mechanism, what: str, targets: Array, baselines: dict[str, Solve], runs: int
) -> Iterator[Row]:
    n, solve = len(targets), partial(pf.solve_ik, mechanism, targets)
    with one_core():
        ours, *theirs = best_times(runs, solve, *baselines.values())
        with_points, *_ = best_times(runs, lambda: solve().points)
    for baseline, seconds in zip(baselines, theirs, strict=True):
        yield Row(f"{what}, one core", n, ours / n, baseline, seconds / n)
    ours, *theirs = best_times(runs, solve, *baselines.values())
    yield Row(f"{what}, with points, one core", n, with_points / n, next(iter(baselines)), theirs[0] / n)
    yield Row(f"{what}, all cores", n, ours / n, next(iter(baselines)), theirs[0] / n)


def projections(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """Targets out of reach, on one core: the paper's projection next to reachable targets, and the exact one to it."""
    mechanism = pf.load("stewart")
    drawn = draw(mechanism, rng, 8 * n, 1.0, 0.5)
    far = drawn[~Struts(mechanism).solve(drawn)[1]][:n]
    near = draw(mechanism, rng, n, 0.05, 0.05)
    agree(pf.solve_ik(mechanism, near), Struts(mechanism).lengths(near))
    yield from projected("6-UPS, batch, out of reach, hold orientation", mechanism, far, near, "orientation", runs)
    yield from projected("6-UPS, batch, out of reach, hold nothing", mechanism, far, near, None, runs)
    for name, what in (("five_bar", "5-bar"), ("nrpm", "NRPM"), ("servo_hexapod", "6-RUS"), ("delta", "delta")):
        mechanism = pf.load(name)
        drawn = draw(mechanism, rng, n // 5, 1.0, 0.5)
        far = drawn[pf.passes.solve(mechanism, drawn, CENTROID).status == pf.Status.PROJECTED][: n // 10]
        near = np.tile(mechanism.home_pose, (len(far), 1, 1))
        held = ", hold orientation" if "rotation" in mechanism.task else ""
        yield from projected(f"{what}, batch, out of reach{held}", mechanism, far, near, "orientation", min(runs, 3))


def projected(
    what: str, mechanism: pf.Mechanism, far: Array, near: Array, hold: str | None, runs: int
) -> Iterator[Row]:
    """Targets out of reach projected in either way, and targets within reach."""
    centroid, nearest = replace(CENTROID, hold=hold), replace(NEAREST, hold=hold)
    with one_core():
        reached, by_centroid, exactly = best_times(
            runs,
            lambda: pf.solve_ik(mechanism, near),
            lambda: pf.passes.solve(mechanism, far, centroid),
            lambda: pf.solve_ik(mechanism, far, options=nearest),
        )
    n = len(far)
    yield Row(f"{what}, centroid, one core", n, by_centroid / n, "reachable batch", reached / len(near))
    yield Row(f"{what}, nearest, one core", n, exactly / n, "centroid", by_centroid / n)


def start_up(runs: int) -> Iterator[Row]:
    """New processes."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}

    def measured(code: str) -> float:
        command = [sys.executable, "-c", code]
        return float(subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout)

    def run(*arguments: str) -> None:
        subprocess.run([sys.executable, *arguments], env=environment, check=True, capture_output=True)

    for name, what in (("stewart", "6-UPS"), ("delta", "delta")):
        first = min(measured(FIRST_ANSWER.format(name)) for _ in range(runs))
        yield Row(f"{what}: first answer of a process", 1, first)
    yield Row("what most questions need, in a new process", 1, min(measured(USE_EVERYTHING) for _ in range(runs)))
    command_line = partial(run, "-m", "pfabrik", "ik", "stewart", "--position", "10", "0", "190")
    ours, theirs = best_times(runs, command_line, partial(run, "-c", "import numpy"))
    yield Row("pfabrik ik stewart --position 10 0 190", 1, ours, 'python -c "import numpy"', theirs)
    yield Row("import pfabrik", 1, min(measured(IMPORT) for _ in range(runs)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer poses and runs, no new processes")
    parser.add_argument("--markdown", action="store_true", help="the table as the page docs/benchmarks.md")
    given = parser.parse_args()
    where, runs, rng = machine(), (3 if given.quick else 15), np.random.default_rng(1)
    rows = [
        *calls(rng, runs),
        *batches(rng, runs, 10_000 if given.quick else 100_000),
        *peer(np.random.default_rng(2), runs),
        *passes(np.random.default_rng(3), min(runs, 7), 200 if given.quick else 1000),
        *projections(rng, runs, 100 if given.quick else 1000),
        *forward(rng, runs, 200 if given.quick else 2000),
        *joint_coordinates(rng, runs, 200 if given.quick else 2000),
        *closed_chains(rng, runs, 100 if given.quick else 1000),
        *actuation_rows(rng, runs, 4096),
        *chain_rows(rng, runs, 100 if given.quick else 1000),
        *modes(min(runs, 5)),
        *workspaces(rng, runs, 20_000 if given.quick else 200_000),
        *proofs(runs),
        *designs(runs),
        *kept_apart(runs),
        *maps(rng, min(runs, 5), 2000 if given.quick else 10_000),
        *dynamics(np.random.default_rng(4), min(runs, 5), 500 if given.quick else 2000),
        *viewer(min(runs, 5)),
        *([] if given.quick else start_up(5)),
    ]
    if given.markdown:
        print("# Benchmarks\n\nWritten by `python benchmarks/run.py --markdown`.\n")
    print(where, end="\n\n")
    print("\n".join(table([cells(row) for row in rows], given.markdown)))
    print(f"\n{NOTE}")


if __name__ == "__main__":
    main()
