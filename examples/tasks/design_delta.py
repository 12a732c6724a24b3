"""A delta for a bed: how tall are the towers, how long the rods?

For a printer that is not built yet. You say how wide and high it prints, how fast, and where its towers stand, and get
the smallest machine with a proof that the nozzle gets everywhere. SciPy is needed: `pip install '.[calibrate]'`.
"""

# `pfabrik new linear-delta` has a printer whose dimensions we take as the start.
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

command = [sys.executable, "-m", "pfabrik", "new", "linear-delta", "-o", "printer.toml"]
subprocess.run(command, check=True, capture_output=True)
printer = pf.load("printer.toml")

# ## What it must do
#
# Print 200 mm across and 200 mm high: a cylinder that stands on the bed. The rails stand outside of it, 20 mm off the
# rim. `radius` and `height` are expressions of the file: how far out the carriages' joints are, and how high up they
# come.
build = pf.PoseRegion.cylinder([0, 0, 100], 100, 200)
vary = {"arm_length": (120, 500), "delta_radius": (40, 250), "position_endstop": (200, 400), "travel": (150, 600)}
keep = [pf.keep.margin(0.02), "radius >= 120"]
towers = "height + arm_length/10"

small = pf.design(printer, vary, build, keep=keep, minimise=towers)


def sizes(found):
    return ", ".join(f"{name} {value:.1f}" for name, value in found.dimensions.items())


print(small.verdict)
print(sizes(small))

# `minimise` is an expression of dimensions: low towers first, then short rods. It is proved that at every pose the rods
# are long enough, the carriages within their travel, the ball joints within their tilt. What holds the size there:
print(*sorted({each.requirement for each in small.binding if each.share > 0.05}), sep="\n")

# ## And how fast
#
# Where rods lie flat, carriages race: one moves many times as fast as the nozzle. Ask for no more than 300 mm/s there
# where the nozzle moves at 200 mm/s, whichever way. Speeds have no proof: samples decide, and the result says so.
angle = np.radians([0, 60, 120])  # and the opposite ways, as fast
ways = 200 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
quick = pf.design(printer, vary, build, keep=[*keep, pf.keep.speed(ways, 300)], minimise=towers)
print(quick.verdict)
print(sizes(quick))
print("by samples:", ", ".join(quick.unproved))

# Steeper rods take longer arms and taller towers. Both machines, mind the scale:
figure, axes = plt.subplots(1, 2, figsize=(7, 5), layout="constrained")
for ax, found in zip(axes, (small, quick), strict=True):
    pf.plot(found.mechanism, ax=ax)
figure.savefig("towers.png", dpi=110)
