"""An installed wheel, tried: every machine, and the command. `--within` refuses slow starts of it [s]."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import warnings

import numpy as np

import pfabrik as pf
from pfabrik.kernels._shipped import LIBRARY

COMMANDS = (
    ("ik stewart --position 10 0 190", 0),
    ("ik stewart --position 400 0 190", 1),
    ("fk five_bar -20 20", 0),
    ("info delta", 0),
)


def ask(name: str) -> None:
    """Ask a machine what it must be able to answer."""
    machine = pf.load(name)
    home, far = pf.solve_ik(machine, machine.home_pose), machine.home_pose.copy()
    far[:3, 3] += 5.0 * machine.characteristic_length
    away = pf.solve_ik(machine, far)
    back = pf.solve_fk(machine, home.actuators)
    path = pf.track(machine, np.stack([machine.home_pose, far]))
    if home.status != pf.Status.REACHED or not np.isfinite(home.q).all():
        sys.exit(f"{name}: home is not reached")
    for answer in (away, back, *path):
        if answer.status not in (pf.Status.REACHED, pf.Status.PROJECTED) or not answer.residual < 1e-6:
            sys.exit(f"{name}: {answer}")


def start(line: str, expected: int) -> float:
    """Run the command in a new process; the processor's time that it takes [s]."""
    before = os.times()
    ran = subprocess.run([sys.executable, "-m", "pfabrik", *line.split()], capture_output=True, text=True, check=False)
    if ran.returncode != expected or "kernels" in ran.stderr:
        sys.exit(f"pfabrik {line}: {ran.returncode}\n{ran.stdout}{ran.stderr}")
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--within", type=float, default=np.inf)
    within = parser.parse_args().within
    if LIBRARY is None:
        sys.exit("expected compiled kernels")
    seconds = [start(*command) for command in COMMANDS for _ in range(2)]
    warnings.simplefilter("ignore")
    for name in pf.catalog():
        ask(name)
    levels = ", ".join(LIBRARY.module.LEVELS) or "one level"
    print(
        f"{len(pf.catalog())} machines, {levels}; processor time of a command: {seconds[0]:.2f} s, {seconds[1]:.2f} s"
    )
    if max(seconds[:2]) > within:
        sys.exit(f"expected at most {within} s")


if __name__ == "__main__":
    main()
