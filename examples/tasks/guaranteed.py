"""Is it guaranteed? Every pose of a region proved, or one that is not reached

A grid of points, or a million random ones, says nothing about the points between. `certify` bounds every limit over
whole boxes of poses, halves those that it cannot decide, and ends with a proof, or with a pose that breaks a limit.
"""

# A Stewart platform is to work within ±35 mm and ±8° of a pose. Random poses of that region are all within its limits.
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import PatchCollection
from matplotlib.patches import Rectangle

import pfabrik as pf

machine = pf.load("stewart")
middle = np.array([0, 0, 210])
wide = pf.PoseRegion.box(middle - 35, middle + 35, rotation=np.radians(8))
random = wide.pose(np.random.default_rng(0).uniform(wide.low, wide.high, (200_000, 6)))
print((pf.feasibility(machine, random).margin < 0).sum(), "of 200,000 poses are beyond a limit")

# And yet one is. `rotation` is a box of rotation vectors: R = from_rotvec(r), each component up to 8° to either side.
certificate = pf.certify(machine, wide)
print(certificate)
print("the nearest pose is", round(certificate.refutation.answer.position_error, 2), "mm away")

# ## A proof
#
# A little less is proved: `solve_ik` reaches every pose, without a change of working mode. `margin` is what is left at
# least on every limit, as a share of half its range; with a `tolerance` the bound is as tight as that.
narrow = pf.PoseRegion.box(middle - 34, middle + 34, rotation=np.radians(7.5))
proof = pf.certify(machine, narrow, tolerance=0.001)
print(proof)

# A proof consists of boxes that cover the region. `replay` checks that they do, proves each anew by itself, and solves
# for random poses in them.
print(len(proof.boxes), "boxes", proof.replay())

# ## Other regions
#
# Balls and cylinders of positions, with a cone of tilts; every pose of a path, also between its steps; and all machines
# whose joints are up to 0.1 mm from where the file says.
print(pf.certify(machine, pf.PoseRegion.ball(middle, 30, tilt=np.radians(10), yaw=np.radians([-5, 5]))).verdict)
angle = np.linspace(0, 2 * np.pi, 100)
circle = np.stack([30 * np.cos(angle), 30 * np.sin(angle), np.full(100, 205)], axis=1)
print(pf.certify(machine, pf.track(machine, circle)).verdict)
print(pf.certify(machine, pf.PoseRegion.cylinder(middle, 30, 40), uncertain=0.1).verdict)

# ## How large it is, for certain
#
# The size of a workspace between two proved bounds, here of a planar 5-bar, and the largest box that is proved.
five_bar = pf.load("five_bar")
enclosure = pf.workspace(five_bar, resolution=2, certified=0.001).enclosure
print(f"between {enclosure.lower:.0f} and {enclosure.upper:.0f} mm²")
square = pf.largest(five_bar, "box")
print(np.round(square.extents, 1), square.certificate.verdict)

# A square that is a tenth larger is refuted. In the picture: boxes that are wholly within reach (green), boxes of the
# border (grey), the square that is proved, and the pose that is not reached.
half = 0.55 * square.extents
refuted = pf.certify(five_bar, pf.PoseRegion.box(square.centre - half, square.centre + half))
print(refuted)

_, ax = plt.subplots(figsize=(7, 5))
for boxes, colour in ((enclosure.inside, "#a6dba0"), (enclosure.border, "#bbbbbb")):
    patches = [Rectangle(low, *(high - low)) for low, high in boxes]
    ax.add_collection(PatchCollection(patches, facecolor=colour, edgecolor="white", linewidth=0.3))
low, side = square.region.low[1:3], square.extents[1:]
ax.add_patch(Rectangle(low, *side, fill=False, edgecolor="#1b7837", linewidth=2, label="proved"))
y, z = refuted.refutation.pose[1:3, 3]
where = "not reached: " + " ".join(refuted.refutation.limit)
ax.plot(y, z, "x", color="#b2182b", markersize=10, markeredgewidth=3, label=where)
ax.set(xlabel="y [mm]", ylabel="z [mm]", aspect="equal")
ax.autoscale_view()
ax.legend()
ax.figure.savefig("proved.png", dpi=110)

# ## Tilts, and joints' angles
#
# Of a tripod the task sets a height and a tilt; where its platform shifts and twists to follows from the legs.
# `certify` encloses that too. An ankle may be asked in tilts, or in the angles of its pivot.
tripod, ankle = pf.load("rps"), pf.load("ankle_rss")
for degrees in (20, 24):
    tilts = pf.PoseRegion.box([0, 0, 184], [0, 0, 224], tilt=np.radians(degrees))
    print(pf.certify(tripod, tilts).verdict, f"up to {degrees} degrees")
turns = pf.PoseRegion.joints({"pivot[0]": (-0.2, 0.2), "pivot[1]": (-0.15, 0.15)})
print(pf.certify(ankle, turns).verdict, "in the pivot's angles")

# With `singular=True` it proves too that locked drives hold the platform everywhere: no pose of the region is a
# parallel singularity.
print(pf.certify(ankle, turns, singular=True))

# ## What has no proof
#
# Machines without closed forms are refused by name. Legs that others carry, rods that two crossed hinges keep from
# spinning, tracks of machines whose tasks leave something open, and poses beside dead points are refuted or left open,
# never proved; so is what only another working mode than home's reaches.
try:
    pf.certify(pf.load("panda"), narrow)
except pf.errors.UnsupportedMechanism as error:
    print(error)
print(pf.certify(ankle, turns, uncertain=0.1).reason)
