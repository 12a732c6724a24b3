"""A delta printer's path from G-code, as fast as its carriages allow, in a row of joints for every millisecond."""

import tempfile
from pathlib import Path

import numpy as np

import pfabrik as pf

printer = pf.load("linear_delta")
program = """
G21 G90
G0 X-20 Y0 Z2
G1 X20 F6000
G3 X20 Y20 I0 J10
G1 X-20
G3 X-20 Y0 I0 J-10
"""
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "slot.gcode"
    file.write_text(program)
    path = pf.read_path(file, printer)

track = pf.track(printer, path.targets)
print(f"{len(track)} steps, all reached: {bool(track)}")

timed = pf.time_path(track, speed=300, acceleration=3000, platform_speed=200, rate=1000)
print(f"{timed.duration:.3f} s, {len(timed.times)} rows")
print(f"  fastest carriage {np.abs(timed.rates).max():.0f} mm/s, {np.abs(timed.accelerations).max():.0f} mm/s²")
for (name, what), share in timed.held_back.items():
    print(f"  held back by the {what} of {name} for {share:.0%} of the time")
