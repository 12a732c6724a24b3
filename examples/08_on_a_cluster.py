"""A million poses on the processes of a cluster, chunk by chunk, and a study of designs: with Dask.

python examples/08_on_a_cluster.py                                   # on two processes of this machine
python examples/08_on_a_cluster.py 1e9 tcp://scheduler:8786 margins  # a billion poses, on a cluster, into a folder

Of each pose six bytes are kept: its margin, and the number of the limit that has it. Each worker writes its own chunks
into the folder, and this program sees sums alone.
"""

import sys
import time
from pathlib import Path

import dask.array as da
import numpy as np
from dask.distributed import Client, LocalCluster

import pfabrik as pf

HEXAPOD = """
schema = 1
name = "hexapod"
units = { length = "mm", angle = "deg" }
end_effector = "platform"
reference_point = [0, 0, 195]

[dimensions]
platform_radius = 56.5

[[leg]]
chain = "U-P*-S"
base = [[100, 20, 0], [100, -20, 0]]
platform = [["0.7*platform_radius", "0.7*platform_radius", 195], ["0.7*platform_radius", "-0.7*platform_radius", 195]]
stroke = [155, 280]
copies = { count = 3, axis = [0, 0, 1] }
"""
KEPT = np.dtype([("margin", "f4"), ("binding", "i2")])
CHUNK = 250_000
"""Poses of a chunk: a task of a tenth of a second or more, some 100 MB while it is computed."""


def margins_of(rows, machine):
    """The margins and binding limits of rows (n, 6): x, y, z, roll, pitch, yaw."""
    margins = pf.feasibility(machine, pf.pose(rows[:, :3], rpy=rows[:, 3:]))
    kept = np.empty(len(rows), KEPT)
    kept["margin"], kept["binding"] = margins.margin, margins.binding
    return kept


def volume_of(machine, radius):
    """The volume that the hexapod reaches without turning, with a platform of this radius [mm³]."""
    return pf.workspace(machine.with_dimensions(platform_radius=radius), resolution=8.0).size


def main(n=1_000_000, scheduler=None, folder=None):
    """Measure n random poses, then seven designs, on the workers of a scheduler, or on two of this machine."""
    Path("hexapod.toml").write_text(HEXAPOD, encoding="utf-8")
    machine = pf.load("hexapod.toml")
    here = None if scheduler else LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with Client(here or scheduler) as client:
        low, high = np.array([[-60, -60, 150, -0.35, -0.35, -0.35], [60, 60, 270, 0.35, 0.35, 0.35]])
        rows = low + (high - low) * da.random.default_rng(0).random((n, 6), chunks=(CHUNK, 6))
        kept = rows.map_blocks(margins_of, machine, dtype=KEPT, drop_axis=1)

        began = time.perf_counter()
        if folder is not None:
            da.to_npy_stack(folder, kept)
            kept = da.from_npy_stack(folder)
        limits = pf.feasibility(machine, machine.home_pose).limits
        is_within = kept["margin"] >= 0
        reached, missed_by = da.compute(
            is_within.sum(), da.bincount(kept["binding"][~is_within], minlength=len(limits))
        )
        print(f"{time.perf_counter() - began:.2f} s", file=sys.stderr)
        print(f"{reached / n:.1%} of {n:,} poses are within all limits; the others exceed first")
        for place in np.argsort(missed_by)[:-4:-1]:
            print(f"  {' '.join(limits[place])}: {missed_by[place] / n:.1%}")

        radii = np.arange(40, 71, 5)
        volumes = client.gather(client.map(volume_of, [machine] * len(radii), radii.tolist()))
        for radius, volume in zip(radii, volumes, strict=True):
            print(f"platform radius {radius} mm: {volume / 1e6:.2f} l")
    if here is not None:
        here.close()


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if sys.argv[1:] else 1_000_000, *sys.argv[2:4])
