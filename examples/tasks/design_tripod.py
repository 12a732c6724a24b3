"""A tripod: how wide, and how long must its struts be?

For a 3-RPS that is not built yet: a table that rises and tilts on three linear actuators. You say how far it rises and
tilts, how strong the actuators are and how much of their length they can push out, and get the smallest table with a
proof. SciPy is needed: `pip install '.[calibrate]'`.
"""

# `pfabrik new 3-RPS` has a tripod whose dimensions we take as the start. Its struts are hinged to the base and carry
# the table on ball joints.
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

command = [sys.executable, "-m", "pfabrik", "new", "3-RPS", "-o", "table.toml"]
subprocess.run(command, check=True, capture_output=True)
table = pf.load("table.toml")

# ## What it must do
#
# Rise by 20 mm to either side of home and tilt by 15° in any direction at each height. Where a table tilts to, it also
# shifts and twists a little: that follows from its legs, and the proof follows it. The load is 400 N, up to 60 mm off
# the middle, and an actuator pushes with 300 N. It is at least 0.6 times as long drawn in as pushed out.
tilts = pf.PoseRegion.box([0, 0, -20], [0, 0, 20], tilt=np.radians(15))
load = [[0, 0, -400, 60 * 400 * x, 60 * 400 * y, 0] for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1))]
vary = {
    "base_radius": (60, 160),
    "platform_radius": (60, 160),
    "height": (100, 300),
    "shortest": (60, 300),
    "longest": (100, 400),
}
found = pf.design(
    table,
    vary,
    tilts,
    keep=[pf.keep.force(load, 300), pf.keep.stroke(1 / 0.6), pf.keep.singularity(None)],
    about="home",
)
print(found.verdict, f"{found.aim:.0f} mm")
print({name: round(value) for name, value in found.dimensions.items()})
print("held by", ", ".join(sorted({each.requirement for each in found.binding if each.share > 0.1})))

# `PROVED`: the table reaches every height and tilt of the region. That its struts hold it everywhere, too, is a second
# proof.
made, at = found.mechanism, found.mechanism.home_pose[:3, 3]
region = pf.PoseRegion.box(at - [0, 0, 20], at + [0, 0, 20], tilt=np.radians(15))
print(pf.certify(made, region, singular=True).verdict)

# Here it is, as steep as it was asked to be:
figure, axes = plt.subplots(1, 2, figsize=(7, 4), layout="constrained")
for ax, tilt in zip(axes, (0, 15), strict=True):
    pf.plot(pf.solve_ik(made, pf.pose(at, rpy=[0, tilt, 0], degrees=True)), ax=ax)
figure.savefig("tilted.png", dpi=110)
