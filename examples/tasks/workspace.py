"""Workspace and singularities: where a machine can go, and where it must not.

For a planar 5-bar, because two dimensions are easy to see; everything here works for machines in space. You learn how
large the workspace is, what ends it, how much fits in, and where in it the motors lose control.
"""

# The machine has two cranks and two forearms. Its limits keep it away from all singularities.
import numpy as np

import pfabrik as pf

machine = pf.load("five_bar")
space = pf.workspace(machine, resolution=2)
print(space)
space.plot().figure.savefig("workspace.png", dpi=110)

# ## What ends it
#
# `shares` says how much of the border each limit forms. Here stops of the cranks and of the elbows do.
print(sorted({f"{joint} {bound}" for joint, bound in space.shares}))
by_cranks = sum(share for (joint, _), share in space.shares.items() if joint in machine.actuator_names)
print(f"cranks: {by_cranks:.0%}, elbows: {1 - by_cranks:.0%}")

# ## What fits in
#
# The largest square (in space: box), and whether some points are inside. A point is asked anew, exactly; it is not read
# from the picture.
square = space.inscribed("box")
print(f"a square of {square.extents[0]:.0f} mm")
print(space.contains([[0, 200], [0, 260]]))

# ## Would freer elbows help?
#
# Compare the same machine with elbows that bend ten degrees further and stretch five degrees further.
wider = machine.with_limits(p2=np.radians([-150, -5]), p4=np.radians([5, 150]))
print(f"{pf.workspace(wider, resolution=2).area / space.area - 1:+.0%} of area")

# ## Singularities
#
# Two kinds matter. At a **serial** singularity a leg is stretched out: however the motors turn, the tip goes no further
# that way. It is the border of what can be reached. At a **parallel** singularity the tip can move although both motors
# are locked: the machine gives way. This may be in the middle of the workspace.
#
# `singularity` measures how far both are; each measure is 0 at its singularity.
free = machine.without_limits()
for height in (250, 175, 60):
    near = pf.singularity(pf.solve_ik(free, [0, 0, height]))
    print(f"z = {height} mm: serial {near.serial:.3f}, parallel {near.parallel:.3f}")

# On a map: the line where the parallel measure is 0, in the workspace without limits. A machine cannot cross this line
# under control.
without_limits = pf.singularity_map(free, pf.workspace(free, resolution=5), resolution=5)
without_limits.plot().figure.savefig("singularities.png", dpi=110)

# With its limits, the machine never comes near. The least parallel measure in its workspace:
with_limits = pf.singularity_map(machine, space, resolution=5)
print(f"{np.nanmin(with_limits.measures.parallel):.2f}")

# ## On a path
#
# A path down the middle crosses the line. `crossings` has the steps before which it does.
path = np.stack([np.zeros(40), np.full(40, 3.0), np.linspace(150, 20, 40)], axis=1)
track = pf.track(free, path)
along = pf.singularity_map(free, track)
print(along.crossings, track.pose[along.crossings, 2, 3].round(1))

# `time_path` refuses such a path: no controller could follow it.
try:
    pf.time_path(track, speed=1, acceleration=10)
except pf.errors.PfabrikError as error:
    print(error)
