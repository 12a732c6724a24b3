"""What one reads who follows a question through the code: the files and functions that it really enters.

`python tools/walk.py` prints a table, in about ten seconds. Each question is asked twice and the second time
counts, with what is derived from the machine at hand. Kernels run as plain Python.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

os.environ["PFABRIK_KERNELS"] = "python"
sys.path.insert(0, str(Path(__file__).parents[1] / "src"))

import pfabrik as pf

ROOT = Path(pf.__file__).parent


class Walk(NamedTuple):
    files: set[Path]
    functions: set[tuple[Path, str]]
    depths: list[int]

    @property
    def depth(self) -> int:
        """The most functions of the package that are in one another."""
        return max(self.depths)


def walk(ask: Callable[[], object]) -> Walk:
    """Files of the package that a question enters, and the named functions in them."""
    entered, within = Walk(set(), set(), [0]), 0

    def enter(frame: object, event: str, _: object) -> None:
        nonlocal within
        code = frame.f_code  # type: ignore[attr-defined]
        path = Path(code.co_filename)
        if event not in ("call", "return") or not path.is_relative_to(ROOT):
            return
        within += 1 if event == "call" else -1
        if event == "call":
            entered.depths.append(within)
            entered.files.add(path)
            if not code.co_name.startswith("<"):
                entered.functions.add((path, getattr(code, "co_qualname", code.co_name)))

    sys.setprofile(enter)
    try:
        ask()
    finally:
        sys.setprofile(None)
    return entered


def questions() -> dict[str, Callable[[], object]]:
    m = pf.load("stewart")
    near, far = pf.pose([5, 3, 176]), pf.pose([400, 0, 180])
    held, actuators = pf.solve_ik(m, far), pf.solve_ik(m, near).actuators
    return {
        "target within reach": lambda: pf.solve_ik(m, near),
        "target out of reach": lambda: pf.solve_ik(m, far),
        "joint coordinates of an answer": lambda: pf.solve_ik(m, far).q,
        "its active limits": lambda: pf.solve_ik(m, far).active_limits,
        "forward kinematics": lambda: pf.solve_fk(m, actuators),
        "how far it can go": lambda: pf.travel(held),
    }


def walks(*names: str) -> dict[str, Walk]:
    asked = {name: ask for name, ask in questions().items() if not names or name in names}
    for ask in asked.values():
        ask()
    return {name: walk(ask) for name, ask in asked.items()}


def main() -> None:
    if "--far" in sys.argv:  # what `tools/counts.py` reads
        far = walks("target out of reach")["target out of reach"]
        print(len(far.functions), far.depth)
        return
    print(f"{'question':32} files  of them kernels  functions  depth  lines of these files")
    for name, walked in walks().items():
        files, functions = walked.files, walked.functions
        lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)
        n_kernels = sum("kernels" in path.relative_to(ROOT).parts for path in files)
        print(f"{name:32} {len(files):5} {n_kernels:16} {len(functions):10} {walked.depth:6} {lines:21}")


if __name__ == "__main__":
    main()
