"""Motors of a motion rig: forces over a motion, peak and rms of each.

For a platform on six electric cylinders that heaves and rolls with a cabin on it. You learn what each cylinder has to
push and pull, how fast, what the joints carry, and how much force is left for the unexpected.
"""

# The rig: six cylinders between pairs of joints, lengths in millimetres, masses in kilograms, so forces are in newtons
# and moments in N mm. Points of bodies are given where they are at home.
import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

rig = pf.Mechanism.from_legs(
    "U-P*-S",
    base=[[1100, 150, 0], [1100, -150, 0]],
    platform=[[450, 700, 1100], [450, -700, 1100]],
    stroke=(1080, 1680),
    copies={"count": 3, "axis": [0, 0, 1]},
    reference_point=[0, 0, 1100],
    name="motion rig",
)
mass, centre, inertia = 600.0, np.array([50.0, 0.0, 1700.0]), np.diag([180.0, 160.0, 120.0]) * 1e6  # kg, mm, kg mm²

# ## The motion
#
# Ten seconds of heave and roll at 0.4 Hz, with a little surge. All of it is one batch of targets.
times = np.linspace(0, 10, 1001)
phase = 2 * np.pi * 0.4 * times
position = np.stack([60 * np.sin(0.5 * phase), 0 * phase, 1100 + 90 * np.sin(phase)], axis=1)
roll = np.radians(9) * np.sin(phase + 0.8)
motion = pf.track(rig, pf.pose(position, rotvec=np.stack([roll, 0 * roll, 0 * roll], axis=1)), sample_time=times[1])
print(motion)


# ## What acts on the platform
#
# Weight, and by d'Alembert's principle the inertia of the cabin: m (g - a) in its centre of mass, and -(I w)' for its
# rotation. Accelerations are in mm/s², so forces come in mN: divide by 1000.
def rate(values):
    return np.gradient(values, times, axis=0, edge_order=2)


R = motion.pose[:, :3, :3]
arm = R @ (centre - rig.reference_point)
acceleration = rate(rate(position + arm))
spin = np.stack([rate(roll), 0 * roll, 0 * roll], axis=1)
momentum = np.einsum("nij,jk,nlk,nl->ni", R, inertia, R, spin)
force = mass * ([0, 0, -9810] - acceleration) / 1000
moment = -rate(momentum) / 1000

# ## What the cylinders exert
#
# Positive pushes. `at` says where the force acts; moments are about that point too.
load = np.concatenate([force, moment], axis=1)
found = pf.forces(motion, load, at=motion.pose[:, :3, 3] + arm)
speeds = rate(motion.actuators)
print("cylinder   peak push   peak pull   rms force   top speed")
for name, exerted, speed in zip(rig.actuator_names, found.actuators.T, speeds.T, strict=True):
    rms, pull = np.sqrt(np.mean(exerted**2)), max(0, -exerted.min())
    print(f"{name:8} {exerted.max():9.0f} N {pull:9.0f} N {rms:9.0f} N {abs(speed).max():6.0f} mm/s")

# The motor's rms torque decides how warm it gets, its peak how large it must be; both follow from these by the pitch
# of the screw and its efficiency.
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
axes.plot(times, found.actuators / 1000, linewidth=1.0, label=rig.actuator_names)
axes.axhline(0, color="0.6", linewidth=0.8)
axes.set(xlabel="time [s]", ylabel="force [kN], positive pushes", xlim=(0, 5), ylim=(-0.1, 2.6))
axes.legend(ncols=6, frameon=False, fontsize=8)
figure.savefig("forces.png", dpi=110)

# ## Are the cylinders' own weights worth a thought?
#
# Each body may have a load of its own: a mass, and its centre at home. Here every cylinder and every rod has 25 kg, in
# the middle between its joints.
weights = {}
for leg in range(1, 7):
    foot, top = (np.array(rig.joint(f"{letter}{leg}").at) for letter in "AC")
    cylinder, rod = rig.joint(f"B{leg}").connects
    weights |= {cylinder: (25.0, foot + 0.25 * (top - foot)), rod: (25.0, foot + 0.75 * (top - foot))}
heavier = pf.forces(motion, load, at=motion.pose[:, :3, 3] + arm, loads=weights)
print(f"the legs' weights add up to {abs(heavier.actuators - found.actuators).max():.0f} N at a cylinder")

# ## What the joints carry
#
# The force in the lower joint of a leg, over the motion.
lower = np.linalg.norm(heavier.reactions["A1"][:, :3], axis=1)
print(f"lower joint A1: at most {lower.max():.0f} N")

# ## What is left
#
# With cylinders of 3 kN, the largest force that may come on top of all this from any direction, at the worst moment.
left = pf.wrench_capacity(motion, 3000, wrench=load, at=motion.pose[:, :3, 3] + arm)
worst = np.argmin(left.radius)
print(f"{left.radius[worst]:.0f} N, at {times[worst]:.2f} s in the direction {np.round(left.weakest[worst], 2) + 0.0}")
