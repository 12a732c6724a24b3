"""A target out of reach: the nearest feasible pose, what holds it back, and what a path makes of it."""

import numpy as np

import pfabrik as pf

mechanism = pf.load("stewart")
target = pf.pose([0, 150, 120], rpy=np.radians([8, -5, 0]))

# Of all poses that keep every limit, the nearest one that has the target's orientation; and, farther away, the paper's.
nearest = pf.solve_ik(mechanism, target)
centroid = pf.passes.solve(mechanism, target, pf.passes.Options.centroid())
print(f"{nearest.status}, {nearest.held} held: {nearest.position_error:.2f} mm from the target")
print(f"where the chains' ends agree: {centroid.position_error:.2f} mm and {centroid.rotation_error:.2f} rad")

# The limits that hold it back, the most restrictive first: a cone wider by a radian would bring it so many mm nearer.
for limit in nearest.active_limits:
    print(f"  {limit.joint} at its {limit.bound}: {limit.multiplier:.3g} mm per rad")

# How much room there is to the limits within reach, and how far the platform can go from there.
within = pf.solve_ik(mechanism, (0, 20, 200))
(joint, bound), margin = min(pf.margins(within).items(), key=lambda item: item[1])
print(f"{within.status}: {joint} is nearest to its {bound}, {margin:.0%} of the room left")
for each in pf.travel(within, along=[(0, 1, 0), (0, -1, 0)]):
    print(f"  {each.distance:.2f} mm along {each.direction}, then {each.stopped_by[0].joint} stops it")

# A path that leaves the workspace and comes back, a target every 20 ms; no strut may be faster than 200 mm/s.
angle = np.linspace(0, 2 * np.pi, 181)
path = np.stack([0 * angle, 60 * np.cos(angle), 220 + 60 * np.sin(angle)], axis=1)
followed = pf.track(mechanism, path, sample_time=0.02, speed_limits=200)
print(followed, "jumps:", int(followed.jumps.sum()))
print("too fast:", sorted({name for names in followed.too_fast for name in names}))
