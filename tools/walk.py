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
os.environ["PFABRIK_KERNELS"] = "python"
sys.path.insert(0, str(Path(__file__).parents[1] / "src"))

import pfabrik as pf

ROOT = Path(pf.__file__).parent


class Walk(NamedTuple):
    files: set[Path]
    functions: set[tuple[Path, str]]


def walk(ask: Callable[[], object]) -> Walk:
    """Files of the package that a question enters, and the named functions in them."""
    entered = Walk(set(), set())

    def enter(frame: object, event: str, _: object) -> None:
        code = frame.f_code  # type: ignore[attr-defined]
        path = Path(code.co_filename)
        if event == "call" and path.is_relative_to(ROOT):
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


def walks() -> dict[str, Walk]:
    asked = questions()
    for ask in asked.values():
        ask()
    return {name: walk(ask) for name, ask in asked.items()}


def main() -> None:
    print(f"{'question':32} files  of them kernels  functions  lines of these files")
    for name, (files, functions) in walks().items():
        lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)
        n_kernels = sum("kernels" in path.relative_to(ROOT).parts for path in files)
        print(f"{name:32} {len(files):5} {n_kernels:16} {len(functions):10} {lines:21}")


if __name__ == "__main__":
    main()
