"""How fast can this delta go? Cycle time over the torque of its motors.

For a pick-and-place robot whose motors are to be chosen, or are there already. You learn what a motion takes from each
motor, how short a cycle a torque allows, what a heavier part costs, and which motor to buy for a cycle time.
"""

# The delta of the catalogue, with what its bodies weigh: arms and rods from their thickness and material, the platform
# and its gripper as a mass. Motors have an inertia too: here that of a rotor, through a gear of 5 to 1. A file says the
# same in tables `[[body]]` and in its joints, see [what bodies weigh](../describing-a-mechanism.md#what-bodies-weigh).
import dataclasses

import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

delta = pf.load("delta")
arms = []
for leg in (1, 2, 3):
    hip, *elbows = (np.array(delta.joint(f"{name}{leg}").at) for name in ("A", "BL", "BR"))
    arms.append(pf.Shape(f"arm{leg}", ends=(hip, np.mean(elbows, axis=0)), thickness=12, density=1600))
rods = [pf.Shape(f"rod{side}{leg}", thickness=6, density=1600) for side in "LR" for leg in (1, 2, 3)]
delta = delta.with_shapes([*arms, *rods]).with_masses([pf.Mass("platform", 0.15, delta.reference_point)])
joints = [dataclasses.replace(joint, rotor_inertia=5e-6, gear=5) if joint.actuated else joint for joint in delta.joints]
delta = dataclasses.replace(delta, joints=joints)

# ## The cycle
#
# Lift a part by 25 mm, carry it 120 mm to the side, and put it down: an arch, in steps of half a degree. The
# way back takes as long.
angle = np.radians(np.linspace(180, 0, 361))
arch = np.stack([60 * np.cos(angle), 0 * angle, -190 + 25 * np.sin(angle) ** 2], axis=1)
path = pf.track(delta, arch)
print(path)

# ## What torque allows
#
# `time_path` finds the fastest way along the path with some motor at its torque all the time. At rest the motors need
# some torque already: with less than that, the machine cannot even wait.
part = {"platform": (0.1, delta.reference_point)}
at_rest = np.abs(pf.inverse_dynamics(path, twists=np.zeros(3), loads=part).actuators).max()
print(f"to hold it: {at_rest:.3f} N m")
torques = np.array([0.3, 0.4, 0.6, 0.8, 1.2, 1.6, 2.4, 3.2])
times = {
    what: np.array([pf.time_path(path, torque=torque, loads=loads).duration for torque in torques])
    for what, loads in (("empty", None), ("with 100 g", part))
}
print("torque    empty    with 100 g")
for torque, empty, loaded in zip(torques, *times.values(), strict=True):
    print(f"{torque:.1f} N m  {empty * 1000:4.0f} ms  {loaded * 1000:4.0f} ms")

# Four times the torque halves the time, once weight hardly counts: the dashed line. So the last torque is the dearest.
figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
for what, values in times.items():
    axes.plot(torques, 1000 * values, "o-", markersize=4, linewidth=1.2, label=what)
axes.plot(torques, 1000 * times["empty"][-1] * np.sqrt(torques[-1] / torques), "--", color="0.6", linewidth=0.8)
axes.set(xlabel="torque of each motor [N m]", ylabel="one way [ms]", xlim=(0, 3.4), ylim=(0, None))
axes.legend(frameon=False)
figure.savefig("times.png", dpi=110)

# ## Which motor for sixty picks a minute?
#
# There and back in a second, with 0.3 s each for the gripper, leaves 0.2 s a way: halve the interval until it is met.
low, high = 0.3, 3.2
while high - low > 0.005:
    middle = (low + high) / 2
    low, high = (low, middle) if pf.time_path(path, torque=middle, loads=part).duration < 0.2 else (middle, high)
print(f"{high:.2f} N m")

# What that motion takes of each motor. The root mean square is what warms it where it does not pause; its peak and
# highest rate say whether a motor and its gear fit. `efforts.sizing` has the numbers.
fast = pf.time_path(path, torque=high, loads=part)
efforts = pf.inverse_dynamics(fast, loads=part)
print(efforts)

# Arms 2 and 3 carry the part across, and take turns at their limit. On the right, each torque over the rate at which
# it is exerted: a motor whose curve goes round that will do.
efforts.plot().savefig("torques.png", dpi=80)

# ## Where does the torque go?
#
# Without its rotors the machine would be quicker, with heavier arms slower: change what is yours to change.
print(f"all of it     {1000 * fast.duration:.0f} ms")
bare = dataclasses.replace(delta, joints=pf.load("delta").joints)
print(f"no rotors     {1000 * pf.time_path(pf.track(bare, arch), torque=high, loads=part).duration:.0f} ms")
heavy = delta.with_shapes([*(dataclasses.replace(arm, density=2700) for arm in arms), *rods])
print(f"aluminium     {1000 * pf.time_path(pf.track(heavy, arch), torque=high, loads=part).duration:.0f} ms")

# At the command line: `pfabrik time delta.toml arch.csv --torque 1.2`. More about masses and motions: [inverse
# dynamics](../dynamics.md).
