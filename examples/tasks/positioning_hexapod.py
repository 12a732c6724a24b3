"""Accuracy of a positioning hexapod: from the resolution of its struts to the error of its pose.

For a hexapod that aligns optics. You learn how far off its pose may be, in which direction and where in its workspace,
what its joints add, and how stiff it is.
"""

# Six struts, lengths in millimetres. An encoder counts in steps of half a micrometre, so a strut is off by up to a
# quarter; the drive's backlash of 0.4 µm adds 0.2 on either side.
import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

machine = pf.Mechanism.from_legs(
    "U-P*-S",
    base=[[120, 25, 0], [120, -25, 0]],
    platform=[[50, 60, 160], [50, -60, 160]],
    stroke=(155, 215),
    copies={"count": 3, "axis": [0, 0, 1]},
    reference_point=[0, 0, 190],
    name="alignment hexapod",
)
off = 0.5e-3 / 2 + 0.4e-3 / 2
here = pf.solve_ik(machine, machine.home_pose)

# ## How far off the pose may be
#
# `worst` is the largest error that any strut errors within these bounds make, position and rotation apart; `rms` is
# what to expect if they are independent, with standard deviations in place of bounds (of an even spread: bound / √3).
worst, usual = pf.accuracy(here, off), pf.accuracy(here, off / np.sqrt(3), "rms")
print(f"position {worst.position * 1e3:.2f} µm at worst, {usual.position * 1e3:.2f} µm rms")
print(f"rotation {worst.rotation * 1e6:.1f} µrad at worst, {usual.rotation * 1e6:.1f} µrad rms")
print("x, y, z at worst:", (worst.components[:3] * 1e3).round(2), "µm")

# The answer also has the strut errors that do it. Put on the struts, exact forward kinematics shows the same.
moved = pf.solve_fk(machine, here.actuators + worst.actuators[0], start=here)
print(f"{np.linalg.norm(moved.pose[:3, 3] - here.pose[:3, 3]) * 1e3:.2f} µm")

# ## Where it is better and worse
#
# Every verb takes batches: a slice of the workspace is one of them. Targets that are not reached are left blank.
x, y = np.meshgrid(np.linspace(-60, 60, 121), np.linspace(-60, 60, 121))
slice_ = pf.solve_ik(machine, np.stack([x, y, np.full_like(x, 190)], axis=-1))
position = np.where(slice_.status == pf.Status.REACHED, pf.accuracy(slice_, off).position * 1e3, np.nan)
print(f"from {np.nanmin(position):.2f} to {np.nanmax(position):.2f} µm in the slice")
figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
drawn = axes.pcolormesh(x, y, position, cmap="cividis")
figure.colorbar(drawn, label="worst position error [µm]")
axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
figure.savefig("error.png", dpi=110)

# ## What the joints add
#
# A ball joint whose centre may be off by 0.1 µm in any direction counts by its name, beside the actuators.
play = dict.fromkeys(machine.actuator_names, off) | {f"C{leg}": 1e-4 for leg in range(1, 7)}
print(f"{pf.accuracy(here, play).position * 1e3:.2f} µm with play in the upper joints")

# Places of the joints are known to 20 µm at best after calibration. Parameters count by their names, with the pose's
# sensitivity to them; `pf.sensitivity` has the derivatives, here by the centres of the six lower joints.
centres = pf.parameters(machine, [f"A{leg}" for leg in range(1, 7)])
built = dict.fromkeys(centres.names, 0.02)
placed = pf.accuracy(here, built, "rms", sensitivity=pf.sensitivity(here, centres))
print(f"{placed.position * 1e3:.0f} µm rms by joints that are off by 20 µm rms")

# ## How fine the struts must be
#
# To first order, errors grow in proportion: for one micrometre everywhere in the slice, the struts may be off by
print(f"{off * 1e3 / np.nanmax(position):.3f} µm")

# ## How stiff it is
#
# With struts of 20 N/µm. The diagonal has forces per displacement and moments per rotation; the compliance says how far
# a force of 10 N pushes it.
stiff = pf.stiffness(here, 20e3)
print((np.diag(stiff.matrix)[:3] / 1e3).round(1), "N/µm along x, y, z")
print(((stiff.compliance @ [10, 0, 0, 0, 0, 0])[:3] * 1e3).round(3) + 0.0, "µm by 10 N along x")
