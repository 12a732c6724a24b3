"""How long the margins of 64 poses take at other dimensions: by noted expressions, and of machines made anew.

python benchmarks/varied.py [NAME ...]      # of templates; by default 6-UPS delta 5-bar 6-RUS
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

import pfabrik as pf
from pfabrik.kinematics import varied
from timing import draw

POSES, ROUNDS = 64, 7


def processor_time(function: Callable[[], object], calls: int) -> float:
    """The least processor time of a call in some rounds [µs]."""
    function()
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        for _ in range(calls):
            function()
        times.append((time.process_time() - start) / calls)
    return 1e6 * min(times)


def measure(name: str) -> str:
    """A row of the table."""
    machine = pf.load(Path(pf.__file__).parent / "machine" / "catalog" / "templates" / f"{name}.toml")
    poses, ours = draw(machine, np.random.default_rng(1), POSES, 0.1, 0.1), varied(machine)
    values = np.array([machine.dimensions[each] for each in ours.names])
    by_name = dict(zip(ours.names, values.tolist(), strict=True))
    margins = processor_time(lambda: ours.at(values).margins(poses), 100)
    slopes = processor_time(lambda: ours.at(values).slopes(poses), 50)
    anew = processor_time(lambda: pf.feasibility(machine.with_dimensions(by_name), poses), 3)
    return f"{name:8}{margins:9.0f}{slopes:9.0f} by {len(ours.names)}{anew:9.0f}{anew / margins:9.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=["6-UPS", "delta", "5-bar", "6-RUS"])
    warnings.simplefilter("ignore")
    print(f"{POSES} poses [µs]: margins, slopes by dimensions, margins of the machine made anew, ratio to the first")
    for name in parser.parse_args().names:
        print(measure(name))


if __name__ == "__main__":
    main()
