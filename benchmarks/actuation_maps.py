"""Maps between a humanoid's pitch and roll and its motors: `python benchmarks/actuation_maps.py`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import pfabrik as pf
from table import Row, cells, machine, table
from timing import best_times

RANGE = np.radians([20.0, 11.5])


def actuation_rows(rng: np.random.Generator, runs: int, n: int) -> Iterator[Row]:
    """Rows of the maps of an ankle, for n poses at once."""
    a = pf.actuation(pf.load("g1_ankle"), ("pitch_joint", "roll_joint"))
    q = rng.uniform(-RANGE, RANGE, (n, 2))
    x = np.asarray(a.to_actuators(q))
    assert np.abs(np.asarray(a.to_joints(x)) - q).max() < 1e-9
    maps = {
        "joints to motors": lambda: a.to_actuators(q),
        "Jacobian, motors by joints": lambda: a.jacobian(q),
        "motors to joints": lambda: a.to_joints(x),
        "torques of motors": lambda: a.torques_to_actuators(q, q),
        "torque limits": lambda: a.torque_limits(q, 25.0),
    }
    for what, seconds in zip(maps, best_times(runs, *maps.values()), strict=True):
        yield Row(f"G1 ankle, {what}", n, seconds / n)


if __name__ == "__main__":
    print(machine())
    print("\n".join(table([cells(row) for row in actuation_rows(np.random.default_rng(1), 15, 4096)], False)))
