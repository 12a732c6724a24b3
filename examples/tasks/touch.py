"""Will it touch itself? The least distance between links, and a clearance that every answer keeps.

For a machine whose rods cross: you learn which two come nearest and where, and how to make a least distance a limit
like all others: what solves, follows paths and maps workspaces then keeps it.
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
# Every step is reached, and every limit is kept. But two rods pass through each other: without a clearance, links may
# overlap, and how far apart they are is only measured.
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

# Pictures and the viewer draw links as thick as they are, the nearest two darker, and orange where they overlap
# or stop the machine.
pf.plot(travelled[-1]).figure.savefig("overlap.png", dpi=150)

# ## A clearance that is kept
#
# `clearance = 2` in a file, or a copy of the machine, makes 2 mm a limit. The end of the path is now out of reach: the
# answer is the nearest pose whose rods are 2 mm apart, and names the two that hold it back.
kept = m.with_clearance(2)
end = pf.solve_ik(kept, path[-1])
print(end.status, "-", end.reason)
print(pf.clearance(end))
for limit in end.active_limits:
    print(limit.joint, limit.bound, round(limit.value, 4), f"multiplier {limit.multiplier:.3f}")

# A path goes on as far as it can, and what stops a travel may be two rods. Between its steps a machine moves too:
# `passing` is the least distance on the straight way from the step before. `margins` say how far every pair is from
# the clearance, as a share of the machine's characteristic length.
followed = pf.track(kept, path)
print(followed)
print(f"least distance at a step: {np.min(pf.clearance(followed).distance):.3f} mm")
print(f"least distance between steps: {np.min(followed.passing):.3f} mm")
print(pf.travel(followed[150], along=[-31.5, -7.1, 15.7], about=[-0.142, 0.189, -0.378]))

(pair, bound), margin = min(
    ((limit, margin) for limit, margin in pf.margins(followed[150]).items() if limit[1] == "clearance"),
    key=lambda item: item[1],
)
print(pair, bound, f"{margin:.4f}")

# ## Over a workspace
#
# Workspaces end where links come too near. Held level, these rods never meet. With the platform turned as at the end of
# the path they do, and form a part of the border, in colours of its own.
turned = {"orientation": path[-1][:3, :3], "fixed": {"z": path[-1][2, 3]}, "resolution": 1}
with_it, without = pf.workspace(kept, **turned), pf.workspace(m, **turned)
print(with_it)
print(without)
for (joint, bound), share in list(with_it.shares.items())[:5]:
    print(f"{share:6.1%} {joint} {bound}")
with_it.plot().figure.savefig("workspace.png", dpi=150, bbox_inches="tight")

# A [proof](guaranteed.md) over all poses of a region counts links too, where they are capsules or spheres; the sizes of
# workspaces are only proved without them.
