"""A hexapod for a travel: how long must its struts be?

For a machine that is not built yet. You say what it must reach and keep, and get the dimensions, a proof that every
pose is reached, and what holds the size where it is. SciPy is needed: `pip install '.[calibrate]'`.
"""

# `pfabrik new` has files of machines with dimensions to start from. This one has the size of no job in particular.
import subprocess
import sys

import numpy as np

import pfabrik as pf

command = [sys.executable, "-m", "pfabrik", "new", "6-UPS", "-o", "hexapod.toml"]
subprocess.run(command, check=True, capture_output=True)
hexapod = pf.load("hexapod.toml")
print(hexapod.dimensions)

# ## What it must do
#
# Move by 30 mm along every axis and turn by 8° about every axis, all at once, from home: wherever home will be. A
# cylinder is at least 0.55 as long retracted as it is extended, and all limits keep half a percent of half their range.
travel = pf.PoseRegion.box([-30, -30, -30], [30, 30, 30], rotation=np.radians(8))
vary = {
    "base_radius": (60, 200),
    "platform_radius": (30, 120),
    "height": (100, 400),
    "shortest": (80, 500),
    "longest": (120, 600),
}
cylinder = pf.keep.stroke(1 / 0.55)


def designed(margin):
    keep = [pf.keep.margin(margin), cylinder, "base_radius >= 1.2*platform_radius"]
    return pf.design(hexapod, vary, travel, keep=keep, minimise="longest", about="home")


# ## What was found
#
# `minimise="longest"`: the shortest struts that do. The proof is over all poses of the region, not over samples of it.
found = designed(0.005)
print(found.verdict)
for name, value in found.dimensions.items():
    print(f"{name:16}{hexapod.dimensions[name]:4.0f} -> {value:4.0f} mm")

# What holds the size there: to have shorter struts, ask for less of these.
print(sorted({each.requirement for each in found.binding if each.share > 0.05}))

# Distances from singularities have no proof; samples decide, and the result says so.
print("by samples:", *found.unproved)

# The machine as it came, and as it is now, at one scale, with the positions that it is to reach:
found.plot().savefig("struts.png", dpi=110)

# ## Joints that are not where the drawing says
#
# Made with joints up to 0.1 mm off their points, does it still reach everything? `certify` proves it for all such
# machines, refutes it or leaves it open. A larger margin is room for that: raise it until the proof holds.
margin, made = 0.005, None
while not made:
    middle = np.array(found.mechanism.reference_point)
    region = pf.PoseRegion.box(middle - 30, middle + 30, rotation=np.radians(8))
    made = pf.certify(found.mechanism, region, uncertain=0.1)
    longest = np.ceil(found.dimensions["longest"])
    print(f"margin {margin:5.3f}: struts up to {longest:.0f} mm, {made.verdict} for 0.1 mm")
    if not made:
        margin *= 4
        found = designed(margin)

# ## To have it
#
# The file that is written keeps its expressions; its dimensions are the ones found.
found.save("mine.toml")
print(pf.load("mine.toml"))

# On the command line: `pfabrik design hexapod.toml --vary longest=120:600 … -o mine.toml`. [Design](../design.md) lists
# all requirements, and says what is guaranteed.
