"""Two arms, one box: arms, or fingers, that hold an object as a parallel mechanism.

For people with two arms on one bench, or a hand on an object. You learn how `pf.grasp` closes the loop, how far the box
goes with both hands on it, how any stream of targets drives it, and how machines stand on each other.
"""

# ## Both hands on a box
#
# An arm is moved to where it stands by `at`. A grasp is the pose of the hand in the frame of the object, to which the
# arm is moved by its own kinematics; or a contact where the hand is at home: "flat", or a "point" of a finger.
import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

arm = pf.load("panda")
machine = pf.grasp(
    "box",
    {
        "left": (arm.at([0.0, 300.0, 0.0]), pf.pose([0.0, 150.0, 0.0])),
        "right": (arm.at([0.0, -300.0, 0.0]), pf.pose([0.0, -150.0, 0.0])),
    },
    at=[450.0, 0.0, 450.0],
)
counts = pf.mobility(machine)
print(f"{counts.platform} freedoms of {counts.actuators} drives, {counts.redundancy} more than it needs")

# `pfabrik join panda panda --at 0,300,0 --at 0,-300,0 --prefix left_ --prefix right_ --hold box` writes such a file,
# with the hands where the arms have them at home.
#
# ## Where may the box go?
#
# The box is the end effector: targets are its poses, and `reason` names the joint of either arm that stops it.
tilted = pf.solve_ik(machine, pf.pose([500.0, 40.0, 420.0], rpy=[0, 0, 20], degrees=True))
print(tilted.status.name, "with all loops closed:", bool(np.max(pf.closure_residual(tilted)) < 1e-9))
high = pf.solve_ik(machine, pf.pose([450.0, 0.0, 1300.0]))
print(high.status.name, f"{high.position_error:.0f} mm off")

# Each arm alone, asked with the joints of the answer, has its hand where the box is held:
place = [machine.actuator_names.index(f"left_{name}") for name in arm.actuator_names]
hand = pf.solve_fk(arm.at([0.0, 300.0, 0.0]), tilted.actuators[place]).pose
print("the left hand is there:", np.allclose(hand, tilted.pose @ pf.pose([0.0, 150.0, 0.0]), atol=1e-6))

# ## Driven by a stream
#
# `Live` drives both arms from targets that nobody checked: no drive is faster than it may, nothing leaps, and the box
# stays in both hands; out of reach it goes as far as it can.
live = pf.Live(machine, speed=2.0)
dt, time = 0.01, np.arange(0.0, 4.0, 0.01)
wanted = np.stack([450 + 50 * np.sin(2 * time), 100 * np.sin(3 * time), 450 + 400 * np.sin(time)], axis=1)
driven = live.follow(pf.pose(wanted), sample_time=dt)
off = np.linalg.norm(driven.pose[:, :3, 3] - wanted, axis=1)
print(f"within 1 mm in {(off < 1.0).mean():.0%} of the ticks, at most {off.max():.0f} mm off")
print(f"highest speed {np.abs(driven.speeds).max():.2f} rad/s")

# ## A machine on another
#
# `join` puts machines together that share a body: here a hexapod on the platform of a linear delta.
delta, hexapod = pf.load("linear_delta"), pf.load("stewart")
seat = delta.home_pose[:3, 3]
hybrid = pf.join(delta, hexapod.at(seat, prefix="h_", base=delta.end_effector), end_effector="h_platform")
print(len(hybrid.actuator_names), "drives,", pf.mobility(hybrid).platform, "freedoms")

figure, axes = plt.subplots(1, 2, figsize=(8.0, 3.2), layout="constrained", width_ratios=(1.0, 1.3))
pf.plot(tilted, ax=axes[0])
for row, axis in enumerate("xyz"):
    axes[1].plot(time, wanted[:, row], ":", color=f"C{row}")
    axes[1].plot(time, driven.pose[:, row, 3], color=f"C{row}", label=axis)
axes[1].set(xlabel="time [s]", ylabel="mm", title="the box; dotted: asked for")
axes[1].legend(frameon=False)
figure.savefig("two_arms.png", dpi=120)

# And in motion:
pf.animate(driven, "held.gif", seconds=1.5, size=(3.2, 2.4), dpi=80)
