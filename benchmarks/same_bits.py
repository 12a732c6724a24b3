"""Answers of compiled kernels, at every level of the processor, against Numba's: how many numbers differ in a bit.

python benchmarks/same_bits.py [--targets 2000] [--only NAME …] [--against numba]

Every machine of the catalogue is asked for targets near home and for some far away: inverse and forward kinematics, a
path, all joint coordinates, margins. It ends with 1 where anything differs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

import pfabrik as pf
from timing import Array, draw

SIZE, TILT, FAR = 0.35, 0.4, 3.0
"""How far targets are from home [L], [rad]; how many times as far away those are that nothing reaches."""


def answers(name: str, n: int) -> dict[str, Array]:
    """What a machine answers to about n targets."""
    machine, rng = pf.load(name), np.random.default_rng(5)
    near = draw(machine, rng, n, SIZE, TILT)
    found = pf.solve_ik(machine, near)
    far = pf.solve_ik(machine, draw(machine, rng, max(n // 4, 1), FAR, TILT))
    back = pf.solve_fk(machine, found.actuators)
    path = pf.track(machine, near[: max(n // 10, 2)])
    told = {"ik": found, "far": far, "fk": back, "track": path}
    fields = ("status", "actuators", "pose", "position_error", "rotation_error", "residual", "limit_excess")
    arrays = {f"{what} {field}": np.asarray(getattr(each, field)) for what, each in told.items() for field in fields}
    arrays["q"] = found.q
    arrays |= {f"margins {joint}": np.asarray(margin) for joint, margin in pf.margins(found).items()}
    return arrays


def affordable(name: str, n: int, seconds: float) -> int:
    """How many of n targets a machine is asked for: slow ones for fewer, with every choice for the same."""
    answers(name, 8)  # what is done for the first time
    began = -time.process_time()
    answers(name, 8)
    began += time.process_time()
    return n if began * n / 8 < seconds else max(8, int(8 * seconds / began))


def write(path: Path, counts: dict[str, int]) -> None:
    """Answer in this process, and write what was answered."""
    warnings.simplefilter("ignore")
    kept = {f"{name}|{what}": array for name, n in counts.items() for what, array in answers(name, n).items()}
    np.savez(path, **kept)


def run(choice: str, path: Path, counts: dict[str, int]) -> None:
    """Answer in a process that runs the kernels of a choice."""
    given = [f"{name}={n}" for name, n in counts.items()]
    command = [sys.executable, __file__, "--write", str(path), *given]
    subprocess.run(command, env=os.environ | {"PFABRIK_KERNELS": choice}, check=True)


def different(one: Array, other: Array) -> int:
    """How many numbers of two arrays differ in any bit."""
    if one.shape != other.shape or one.dtype != other.dtype:
        return max(one.size, other.size)
    kind = f"V{one.dtype.itemsize}"
    return int((np.ascontiguousarray(one).view(kind) != np.ascontiguousarray(other).view(kind)).sum())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", type=int, default=2000)
    parser.add_argument("--seconds", type=float, default=20.0, help="most for a machine, about")
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--against", default="numba", help="a value of PFABRIK_KERNELS")
    parser.add_argument("--write", nargs="+", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.write:
        path, *counts = given.write
        write(Path(path), {name: int(n) for name, n in (each.split("=") for each in counts)})
        return 0
    from pfabrik.kernels._shipped import LIBRARY

    if LIBRARY is None:
        sys.exit("there are no compiled kernels to compare: run `make`")
    warnings.simplefilter("ignore")
    counts = {name: affordable(name, given.targets, given.seconds) for name in given.only or pf.catalog()}
    print(f"{len(counts)} machines, {sum(counts.values())} targets", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        run(given.against, Path(folder) / "one.npz", counts)
        one, failed = np.load(Path(folder) / "one.npz"), 0
        for choice in LIBRARY.module.LEVELS or ("compiled",):
            run(choice, Path(folder) / "other.npz", counts)
            other = np.load(Path(folder) / "other.npz")
            off = {key: different(one[key], other[key]) for key in one.files}
            told = [f"{key} {count}" for key, count in off.items() if count]
            failed += len(told)
            total = sum(one[key].size for key in one.files)
            print(
                f"{choice} against {given.against}: {total} numbers, {sum(off.values())} differ", *told[:8], flush=True
            )
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
