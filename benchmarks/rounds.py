"""How many rounds of the paper's projection pay: distance to targets out of reach, and time, by `max_rounds`.

python benchmarks/rounds.py
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import pfabrik as pf
from closed_forms import Struts
from table import machine
from timing import best_times, draw
from yardstick import one_core

TARGETS, SIZE, TILT = 2000, 1.0, 0.5
ROUNDS = (1, 2, 4, 8, 12, 25, 50, 1000)


def main() -> None:
    """Print one line for each number of rounds, for either choice of what is held."""
    mechanism = pf.load("stewart")
    drawn = draw(mechanism, np.random.default_rng(1), 8 * TARGETS, SIZE, TILT)
    far = drawn[~Struts(mechanism).solve(drawn)[1]][:TARGETS]
    print(f"{machine()}\n6-UPS, {len(far)} targets out of reach, one core; distances relative to L\n")
    print("hold         max_rounds  mean distance  99 %    mean rotation [rad]  us a target")
    for hold in ("orientation", None):
        for rounds in ROUNDS:
            options = replace(pf.passes.Options.centroid(), hold=hold, max_rounds=rounds)
            with one_core():
                (seconds,) = best_times(3, lambda options=options: pf.passes.solve(mechanism, far, options))
            solution = pf.passes.solve(mechanism, far, options)
            distance = solution.position_error / mechanism.characteristic_length
            print(
                f"{hold or 'nothing':<11}  {rounds:>10}  {distance.mean():>13.4f}  {np.quantile(distance, 0.99):.4f}"
                f"  {solution.rotation_error.mean():>19.4f}  {1e6 * seconds / len(far):>11.1f}"
            )


if __name__ == "__main__":
    main()
