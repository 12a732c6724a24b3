"""States to reset a simulation to: joints within all limits of motors and linkage, and what the motors do then."""

import importlib.util
import tempfile
from pathlib import Path

import numpy as np

import pfabrik as pf

# Once, where pfabrik is: pfabrik export g1_ankle --torch ankle.py --joints pitch_joint roll_joint
folder = Path(tempfile.mkdtemp())
file = pf.export_numpy(pf.load("g1_ankle"), folder / "ankle.py", joints=["pitch_joint", "roll_joint"])

# From here on nothing but NumPy; with PyTorch the functions have the same names, and take tensors on any device.
spec = importlib.util.spec_from_file_location("ankle", file)
ankle = importlib.util.module_from_spec(spec)
spec.loader.exec_module(ankle)

random = np.random.default_rng(0)
low, high = np.array([-0.87, -0.26]), np.array([0.52, 0.26])  # the box of the joints [rad]
q = random.uniform(low, high, (20_000, 2))
margin, nearest = ankle.margin(q)
inside = margin > 0.01  # [rad]
print(f"{inside.mean():.1%} of the box can be reached; what stops the rest:")
for place, count in zip(*np.unique(nearest[~inside], return_counts=True), strict=True):
    print(f"  {ankle.LIMITS[place]:<32} {count / len(q):.1%}")

q = q[inside][:4096]
speeds = random.normal(0.0, 0.5, q.shape)  # of the joints [rad/s]
motors, jacobian = ankle.with_jacobian(q)
states = {
    "joint_pos": q,  # what an environment writes to its joints on reset
    "joint_vel": speeds,
    "motor_pos": motors,
    "motor_vel": (jacobian @ speeds[..., None])[..., 0],
}
np.savez(folder / "resets.npz", **states)
assert all(np.isfinite(each).all() for each in states.values())
print(f"{len(q)} states, motors from {np.degrees(motors.min()):.1f} to {np.degrees(motors.max()):.1f} deg")

# What a rotor adds to the joints: J' I J, which a constant armature is not.
armature = np.swapaxes(jacobian, -1, -2) * 1e-4 @ jacobian
ratio = armature.diagonal(axis1=-2, axis2=-1).max(axis=0) / armature.diagonal(axis1=-2, axis2=-1).min(axis=0)
print(f"reflected inertia varies {ratio[0]:.1f}-fold in pitch, {ratio[1]:.1f}-fold in roll")
