"""Mobility, Jacobians, and the configurations where a machine gains a motion, loses one, or was never held at all."""

import warnings

import numpy as np

import pfabrik as pf

# How many motions a machine has in general: of all its parts, and of its end effector.
for name in pf.catalog():
    count = pf.mobility(pf.load(name))
    print(f"{name}: mobility {count.mobility}, platform {count.platform}, actuators {count.actuators}")

# The inverse Jacobian says what the actuators do for a small motion of the platform.
stewart = pf.load("stewart")
here = pf.solve_ik(stewart, pf.pose([10, 0, 190]))
there = pf.solve_ik(stewart, pf.pose([10.1, 0, 190.05], rotvec=[0, 1e-3, 0]))
twist = [0.1, 0, 0.05, 0, 1e-3, 0]  # the same motion: of the reference point [mm], and rotation [rad]
predicted = pf.inverse_jacobian(here) @ twist
print(f"strut lengths predicted to {np.abs(predicted - (there.actuators - here.actuators)).max():.0e} mm")

# A 5-bar on the line between its cranks. Far down, its forearms lie in one line: locked, it still gives way up and down
# (parallel, type 2). Far up, both legs are stretched: no actuator moves it any further up (serial, type 1).
five_bar = pf.load("five_bar").without_limits()
aligned, stretched = np.sqrt(110**2 - 95**2), np.sqrt(255**2 - 50**2)
heights = np.array([175, 100, 60, aligned + 1e-3, 175, 220, 249, stretched - 1e-7])
path = pf.track(five_bar, np.stack([0 * heights, 0 * heights, heights], axis=1))
near = pf.singularity(path)
print("height   serial     parallel   singular      lost          gained")
for row, height in enumerate(heights):
    directions = f"{np.abs(near.lost[row]).round(2)}  {np.abs(near.gained[row]).round(2)}"
    named = ", ".join(near.kinds[row]) or "-"
    print(f"{height:7.3f}  {near.serial[row]:.3e}  {near.parallel[row]:.3e}  {named:<12}  {directions}")

# A hexapod between similar hexagons, corner above corner, is singular in every pose: building it warns, and its strut
# lengths belong to a whole curve of poses, so that there is nothing to list.
angles = np.radians([0, 40, 120, 160, 240, 280])
corners = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
placed = pf.pose([5, 3, 150], rotvec=[0.2, -0.1, 0.3])
legs = []
for k, corner in enumerate(corners, start=1):
    ends = (f"A{k}", f"C{k}")
    legs += [
        pf.Joint(f"A{k}", "universal", ("base", f"cylinder{k}"), at=100 * corner),
        pf.Joint(f"B{k}", "prismatic", (f"cylinder{k}", f"rod{k}"), along=ends, actuated=True),
        pf.Joint(f"C{k}", "spherical", (f"rod{k}", "platform"), at=placed[:3, :3] @ (60 * corner) + placed[:3, 3]),
    ]
with warnings.catch_warnings(record=True) as raised:
    warnings.simplefilter("always")
    similar = pf.Mechanism("similar hexagons", legs, "platform", reference_point=placed[:3, 3])
print(raised[0].message)
home = pf.solve_ik(similar, similar.home_pose)
print(f"parallel measure {pf.singularity(home).parallel:.0e}")
try:
    pf.assembly_modes(similar, home.actuators)
except pf.errors.ContinuumOfSolutions as error:
    print(error)
