"""A hexapod that tilts while it circles: timed, then its kinematics as C for the controller."""

import tempfile
from pathlib import Path

import numpy as np

import pfabrik as pf

hexapod = pf.load("stewart")
angle = np.linspace(0, 2 * np.pi, 400)
circle = np.stack([20 * np.sin(angle), 20 * (1 - np.cos(angle)), np.full_like(angle, 195)], axis=1)
tilts = np.stack([0.1 * np.sin(angle), 0.1 * np.sin(2 * angle), np.zeros_like(angle)], axis=1)

track = pf.track(hexapod, pf.pose(circle, rotvec=tilts))
timed = pf.time_path(track, speed=50, acceleration=400)
print(f"{timed.duration:.3f} s around; struts up to {np.abs(timed.rates).max():.1f} mm/s")

print("how fast the platform may move at its start:")
for each in pf.platform_speed(track[0], speed=50):
    unit = "mm/s" if each.kind == "along" else "rad/s"
    print(f"  {each.kind} {np.round(each.direction, 2)}: {each.speed:.3g} {unit}, limited by {each.limited_by}")

with tempfile.TemporaryDirectory() as folder:
    file = pf.export_c(hexapod, Path(folder) / "hexapod.c", precision="float", name="hexapod")
    print(f"{file.name}: {len(file.read_text().splitlines())} lines of C")
