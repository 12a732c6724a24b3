"""An ankle: cranks or struts, and how large?

For a walking robot's ankle that is not built yet. You say how far the foot tilts, how strong and how fast it is, and
what the motors do, and get the smallest ankle of either kind and what holds its size where it is. SciPy is needed:
`pip install '.[calibrate]'`.
"""

# Two motors on the shank tilt a foot that hangs on a universal joint: with cranks and rods (RSU), or as struts that
# spindles drive (SPU). `pfabrik new ankle` has the first kind.
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

subprocess.run([sys.executable, "-m", "pfabrik", "new", "ankle", "-o", "cranks.toml"], check=True, capture_output=True)
cranks = pf.load("cranks.toml")

# The second we write: the pivot is the origin, and one strut is the mirror image of the other.
head = """
schema = 1
name = "Ankle with struts"
units = { length = "mm", angle = "deg" }
base = "shank"
end_effector = "foot"
reference_point = [0, 0, 0]
task = ["tilt"]

[dimensions]
side = 40
upper = 45
lower = 60
height = 120
shortest = 90
longest = 150

[[joint]]
name = "Pivot"
type = "universal"
connects = ["shank", "foot"]
at = [0, 0, 0]
axes = [[0, 1, 0], [1, 0, 0]]
range = [[-30, 30], [-20, 20]]
"""
strut = """
[[joint]]
name = "UpperL"
type = "universal"
connects = ["shank", "cylinderL"]
at = ["-upper", "side", "height"]

[[joint]]
name = "StrutL"
type = "prismatic"
actuated = true
connects = ["cylinderL", "rodL"]
along = ["UpperL", "LowerL"]
range = ["shortest", "longest"]

[[joint]]
name = "LowerL"
type = "spherical"
connects = ["rodL", "foot"]
at = ["-lower", "side", 0]
"""
with open("struts.toml", "w", encoding="utf-8") as file:
    file.write(head + strut + strut.replace('L"', 'R"').replace('"side"', '"-side"'))
struts = pf.load("struts.toml")

# ## What an ankle must do
#
# Pitch by 25° and roll by 15° either way, at once: a region of the pivot's angles. At every such pose hold 60 Nm of
# pitch with 20 Nm of roll to either side, and turn at 6 rad/s about one with 3 rad/s about the other. Moments are in N
# mm, as lengths are in mm.
tilts = pf.PoseRegion.joints({"Pivot[0]": np.radians([-25, 25]), "Pivot[1]": np.radians([-15, 15])})
moments = [[0, 0, 0, 20e3, 60e3, 0], [0, 0, 0, -20e3, 60e3, 0]]
turns = [[0, 0, 0, 3, 6, 0], [0, 0, 0, -3, 6, 0]]

# Either kind has motors of the same power: a crank turns with 40 Nm at up to 12 rad/s, a spindle pushes with 1000 N at
# up to 480 mm/s. A spindle's strut is at least 0.6 times as long drawn in as pushed out. `size` is the diameter of the
# sphere around all joints.
with_cranks = pf.design(
    cranks,
    {
        "back": (15, 70),
        "crank": (15, 60),
        "side": (20, 50),
        "height": (60, 200),
        "turn": (30, 85),
        "pitch": (26, 40),
        "roll": (16, 30),
    },
    tilts,
    keep=[pf.keep.force(moments, 40e3), pf.keep.speed(turns, 12), pf.keep.singularity(None)],
    minimise="size",
)
with_struts = pf.design(
    struts,
    {
        "upper": (15, 80),
        "lower": (20, 80),
        "side": (20, 50),
        "height": (60, 250),
        "shortest": (60, 250),
        "longest": (80, 300),
    },
    tilts,
    keep=[
        pf.keep.force(moments, 1000),
        pf.keep.speed(turns, 480),
        pf.keep.stroke(1 / 0.6),
        pf.keep.singularity(None),
    ],
    minimise="size",
)
for kind, found in {"cranks": with_cranks, "struts": with_struts}.items():
    print(f"{kind}: {found.verdict}, {found.aim:.0f} mm")
    print("  held by", ", ".join(sorted({each.requirement for each in found.binding if each.share > 0.1})))

# Cranks make the smaller ankle, and a strut's stroke is why: a spindle needs its own length again. `PROVED` says that
# every pose of the region is reached within all limits. Forces and speeds are kept at many samples, the worst of them
# looked at more closely. No distance from singularities was asked for, as forces keep one; that the motors hold the
# foot everywhere is proved afterwards.
for found in (with_cranks, with_struts):
    print(pf.certify(found.mechanism, tilts, singular=True).verdict)

# Mind the scale:
figure, axes = plt.subplots(1, 2, figsize=(7, 4), layout="constrained")
for ax, found in zip(axes, (with_cranks, with_struts), strict=True):
    pf.plot(found.mechanism, ax=ax)
figure.savefig("ankles.png", dpi=110)
