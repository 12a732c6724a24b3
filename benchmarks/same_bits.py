"""Answers of compiled kernels, at every level of the processor, against saved ones: how many numbers differ in a bit.

python benchmarks/same_bits.py --save FILE.npz [--targets 2000] [--only NAME …]
python benchmarks/same_bits.py --against FILE.npz

Every machine of the catalogue is asked for targets near home and for some far away: inverse and forward kinematics, a
path, all joint coordinates, margins. Save before a change, and compare after it, on one processor: the second asks for
what the file has. It ends with 1 where anything differs.
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
    np.savez(path, **kept, **{f"{name}{COUNT}": np.array(n) for name, n in counts.items()})


COUNT = "|targets"
"""Ends the names of what says how many targets a machine is asked for."""


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
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--save", type=Path, metavar="FILE", help="write the answers of the best level")
    what.add_argument("--against", type=Path, metavar="FILE", help="compare the answers of every level with these")
    what.add_argument("--write", nargs="+", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.write:
        path, *counts = given.write
        write(Path(path), {name: int(n) for name, n in (each.split("=") for each in counts)})
        return 0
    from pfabrik.kernels._shipped import LIBRARY

    if LIBRARY is None:
        sys.exit("there are no compiled kernels to compare: run `make`")
    warnings.simplefilter("ignore")
    if given.save:
        asked = {name: affordable(name, given.targets, given.seconds) for name in given.only or pf.catalog()}
        run("compiled", given.save, asked)
        return 0
    return compare(given.against, LIBRARY.module.LEVELS or ("compiled",), given.only)


def compare(path: Path, choices: tuple[str, ...], only: list[str] | None) -> int:
    """Print how many numbers of each choice differ from those of a file; 1 if any does."""
    saved, failed = np.load(path), 0
    asked = {key.removesuffix(COUNT): int(saved[key]) for key in saved.files if key.endswith(COUNT)}
    asked = {name: n for name, n in asked.items() if only is None or name in only}
    keys = [key for key in saved.files if key.partition("|")[0] in asked and not key.endswith(COUNT)]
    print(f"{len(asked)} machines, {sum(asked.values())} targets", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for choice in choices:
            run(choice, Path(folder) / "other.npz", asked)
            other = np.load(Path(folder) / "other.npz")
            off = {key: different(saved[key], other[key]) if key in other else saved[key].size for key in keys}
            told = [f"{key} {count}" for key, count in off.items() if count]
            failed += len(told)
            total = sum(saved[key].size for key in keys)
            print(f"{choice} against {path}: {total} numbers, {sum(off.values())} differ", *told[:8], flush=True)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
