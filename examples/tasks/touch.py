"""Will it touch itself? The least distance between links, over a path and over a workspace.

For a machine whose rods cross: you learn which two come nearest, where, and how far the machine may go if they have to
stay apart. Links are lines to every solver; this page measures how far apart they are once they are thick.
"""

# A hexaglide: six rods that lean across each other, from six carriages on level rails. Its file in the catalogue has no
# thickness, so we give it some: rods of 8 mm, and a round plate on the platform. In a file that is `thickness = 8` on a
# `[[leg]]`, or a `[[body]]` table.
import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

rods = [f"rod{side}{k}" for side in "LR" for k in (1, 2, 3)]
plate = pf.Shape("platform", "disc", at=[0, 0, 190], axis=[0, 0, 1], diameter=130, thickness=8)
m = pf.load("hexaglide").with_shapes([*(pf.Shape(rod, thickness=8) for rod in rods), plate])
home = pf.solve_ik(m, m.home_pose)
print(pf.clearance(home))

# These two rods end side by side on the platform, so they are never farther apart. Links that share a joint, as a rod
# and the plate, are left out.

# ## Along a path
#
# Every step is reached, and every limit is kept. But two rods pass through each other, because no solver looks at that:
# clearance is a measure, which you compare with what you want.
share = np.linspace(0, 1, 201)[:, None]
path = pf.pose(m.reference_point + share * [-31.5, -7.1, 15.7], rotvec=share * [-0.142, 0.189, -0.378])
travelled = pf.track(m, path)
apart = pf.clearance(travelled)
print(travelled)
print(apart)

first = int(np.argmax(np.asarray(apart.distance) < 2))
print(f"nearer than 2 mm from step {first}:", *apart.links[first], apart.points[first].round(1).tolist())

# `points` are where the two are nearest, on their surfaces; once they overlap, the distance says how deep. `gradient`
# is the change of the distance per millimetre of each carriage: it says which of them parts the two.
print(dict(zip(m.actuator_names, apart.gradient[first].round(2).tolist(), strict=True)))

fig, ax = plt.subplots(figsize=(6.4, 3.0), layout="constrained")
ax.plot(share, apart.distance)
ax.axhline(0, color="0.4", linewidth=0.8)
ax.set(xlabel="share of the path", ylabel="least distance between links [mm]")
fig.savefig("path.png", dpi=150)

# Pictures and the viewer draw links as thick as they are, the nearest two darker, and orange where they overlap.
pf.plot(travelled[-1]).figure.savefig("overlap.png", dpi=150)

# ## Over a workspace
#
# A batch of poses is measured in one call: six rods take about a tenth of a microsecond for a pose, on top of the
# answers. Here the platform is moved, tilted and turned at random; what the limits allow is measured.
rng = np.random.default_rng(1)
places, turns = rng.uniform([-40, -40, 140], [40, 40, 220], (5000, 3)), rng.uniform(-0.5, 0.5, (5000, 3))
many = pf.solve_ik(m, pf.pose(places, rotvec=turns))
reached = many[many.status == pf.Status.REACHED]
distance = np.asarray(pf.clearance(reached).distance)
print(f"{len(distance)} reached; {np.sum(distance < 2)} of them nearer than 2 mm, {np.sum(distance < 0)} overlap")
pairs, counts = np.unique(pf.clearance(reached[distance < 2]).links, axis=0, return_counts=True)
for pair, count in zip(pairs, counts, strict=True):
    print(*pair, count)
