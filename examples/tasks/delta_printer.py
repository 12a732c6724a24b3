"""A delta printer: its dimensions, its build volume, its Klipper file.

You have a printer, with its `printer.cfg`, `config.g` or `Configuration.h`? That file is the machine already: see
[From my printer](../from-my-printer.md). This page describes one from nothing.

For a printer with three carriages on upright rails. You learn how to describe it by the numbers that its firmware
uses, how high and how wide it prints, what ends the build volume, and how to write the settings for Klipper.
"""

# The firmware knows a delta by two numbers: the length of the rods (Klipper: `arm_length`), and the horizontal distance
# from the nozzle's axis to the carriages minus that of the effector's joints (`delta_radius`). The file has them as
# dimensions. `clearance` is the height of the carriages' joints above those of the effector while the nozzle stands on
# the bed's centre.
#
# Joints are written for one tower; each stands for three. The rods of a pair are parallel, so the tilt of the left one
# is that of the right one, and one cone, 40 degrees about the rod at home, says how far both may tilt. (`pfabrik new
# linear-delta` writes a similar file.)
import subprocess
import sys
from pathlib import Path

import numpy as np

import pfabrik as pf

ROD = """
[[joint]]
name = "Upper{side}"
type = "spherical"
connects = ["carriage", "rod{side}"]
at = ["delta_radius + offset", "{sign}half_gap", "clearance"]
{cone}copies = {{ count = 3, axis = [0, 0, 1] }}

[[joint]]
name = "Lower{side}"
type = "spherical"
connects = ["rod{side}", "effector"]
at = ["offset", "{sign}half_gap", 0]
copies = {{ count = 3, axis = [0, 0, 1] }}
"""
PRINTER = """
schema = 1
name = "Delta printer"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "effector"
reference_point = [0, 0, 0]
task = ["x", "y", "z"]

[dimensions]
rod = 250
delta_radius = 124
offset = 35
half_gap = 20
top = 480
clearance = "sqrt(rod**2 - delta_radius**2)"

[[joint]]
name = "Tower"
type = "prismatic"
actuated = true
connects = ["base", "carriage"]
axis = [0, 0, 1]
home = "clearance"
range = [60, "top"]
copies = { count = 3, axis = [0, 0, 1] }
"""
CONE = 'cone = { axis = ["-delta_radius", 0, "-clearance"], half_angle = 40, fixed_to = "carriage" }\n'
left, right = ROD.format(side="L", sign="", cone=CONE), ROD.format(side="R", sign="-", cone="")
Path("printer.toml").write_text(PRINTER + left + right)
printer = pf.load("printer.toml")
print(printer)
print(f"carriages at {printer.dimensions['clearance']:.3f} mm when the nozzle is on the bed")

# ## Heights of the carriages
#
# A target is a position of the nozzle. A delta's effector does not turn, so three numbers say all.
answer = pf.solve_ik(printer, [40, 20, 10])
print(answer.status.name, answer.actuators.round(3))

# The textbook formula gives the same: each carriage is as far above the nozzle as its rod reaches.
towers = np.radians([0, 120, 240])
across = printer.dimensions["delta_radius"] * np.stack([np.cos(towers), np.sin(towers)], axis=1) - [40, 20]
print((10 + np.sqrt(250**2 - (across**2).sum(axis=1))).round(3))

# And back: from the heights of the carriages to the nozzle.
print(pf.solve_fk(printer, answer.actuators).pose[:3, 3].round(6))

# ## What it can print
#
# The workspace at the height of the bed and 250 mm above it, and the limits that form its border. `UpperL1 cone` is a
# ball joint that tilts no further, `Tower1 max` the upper end of a rail.
for height in (0, 250):
    layer = pf.workspace(printer, fixed={"z": height})
    by_rails = sum(share for (joint, _), share in layer.shares.items() if joint.startswith("Tower"))
    print(f"z = {height}: {layer.area / 100:.0f} cm², {by_rails:.0%} of the border formed by the ends of the rails,")
    print("    limits:", ", ".join(sorted({f"{joint} {bound}" for joint, bound in layer.shares})))

bed = pf.workspace(printer, fixed={"z": 0})
circle = bed.inscribed("sphere")
print(f"the largest round bed has a diameter of {circle.extents[0]:.0f} mm")
bed.plot().figure.savefig("bed.png", dpi=110)

# ## Longer rods
#
# Would rods of 270 mm make the bed wider?
longer = pf.workspace(printer.with_dimensions(rod=270), fixed={"z": 0})
print(f"{longer.area / bed.area - 1:+.0%} of area, diameter {longer.inscribed('sphere').extents[0]:.0f} mm")

# ## Klipper
#
# The settings that Klipper calculates with, from the same file. At the command line this is `pfabrik export
# printer.toml klipper -o printer.cfg`. What Klipper cannot know, such as pins and motor steps, is listed at the top of
# what it writes.
done = subprocess.run(
    [sys.executable, "-m", "pfabrik", "export", "printer.toml", "klipper"], capture_output=True, text=True, check=True
)
print(done.stdout)
