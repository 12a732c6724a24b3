"""A humanoid's ankle, from CAD to policy.

For a robot that is trained and controlled in joints (pitch, roll), and built with motors that push rods. You learn how
to get from one to the other and back, in batches: positions, speeds, torques, inertia, limits; what a constant map
loses; and how to start a simulation in states that are closed.
"""

# The model comes from CAD as MuJoCo's XML, with its loops closed by `connect`. Here it is the ankle of the catalogue,
# written and read back; of yours, say which bodies the ankle is between: `pfabrik import robot.xml --base shank
# --end-effector foot -o ankle.toml`.
import matplotlib.pyplot as plt
import mujoco
import numpy as np

import pfabrik as pf

pf.interop.to_mjcf(pf.load("g1_ankle"), "robot.xml")
ankle = pf.interop.from_mjcf("robot.xml").mechanism
a = pf.actuation(ankle, joints=("pitch_joint", "roll_joint"))
print(a)

# ## Joints to motors, and back
#
# Coordinates are in the order of the names, angles in radians; any leading shape is a batch. `numpy.asarray` of a
# result is its values; its status says which rows were reached.
q = np.radians([[-8, 4], [10, -6], [0, 25]])
x = a.to_actuators(q)
print(np.degrees(x.values).round(3))
print(x.status, x)

# The last row is more roll than the ankle has. Its motors are those of the nearest pose. The margin of a row says how
# much room is left, as a share of the range; it is negative out of reach, and it names the limit.
margin = a.margin(q)
for row in range(3):
    print(f"{margin.margin[row]:+.2f} {margin.joint[row]} {margin.bound[row]}")

# Encoder values give the joints; `start` is where the robot was.
back = a.to_joints(x.values[:2], start=q[0])
print(np.degrees(back.values).round(3))

# ## Speeds, torques, inertia, gains
#
# `jacobian` is J, motor rates by joint rates. Everything follows from it.
q = np.radians([-8, 4])
print(a.jacobian(q).round(3))
print("motors at a pitch rate of 1 rad/s:", a.velocities(q, [1, 0]).round(3), "rad/s")
print("motors for 10 Nm of pitch:        ", a.torques_to_actuators(q, [10, 0]).round(3), "Nm")
print("joints, by 5 Nm of each motor:    ", a.torques_to_joints(q, [5, 5]).round(3), "Nm")

# The rotors' inertia (behind their gears) as joints feel it is a matrix. So are the gains of servos at the motors:
print(a.armature(q, rotor_inertia=0.01).round(5), "kg m²")
print(a.gains(q, kp=40, kd=1).kp.round(1), "Nm/rad")

# Limits of the motors are limits of the joints that depend on the pose: half-spaces, and the box within them that
# every torque or rate may use.
print("torque box:", a.torque_limits(q, 25).box.round(1), "Nm")
print("speed box: ", a.speed_limits(q, 12).box.round(1), "rad/s")
a.plot_torques(25).figure.savefig("torques.png", dpi=110)

# ## What a constant map loses
#
# Firmware often uses one matrix, the Jacobian of the home pose. This is how wrong its joints are over the range.
pitch, roll = np.meshgrid(np.radians(np.linspace(-45, 28, 74)), np.radians(np.linspace(-15, 15, 61)), indexing="ij")
q = np.stack([pitch, roll], axis=-1)
x = a.to_actuators(q)
linear = (x.values - a.to_actuators(a.home).values) @ np.linalg.inv(a.jacobian(a.home)).T
error = np.degrees(np.abs(linear - q))
error[np.asarray(x.status) != pf.Status.REACHED] = np.nan
figure, axes = plt.subplots(1, 2, figsize=(8, 3), layout="constrained", sharey=True)
for k, ax in enumerate(axes):
    drawn = ax.contourf(np.degrees(pitch), np.degrees(roll), error[..., k], cmap="cividis")
    figure.colorbar(drawn, ax=ax, label=f"error of {a.names[k]} [deg]")
    ax.set(xlabel="pitch [deg]", ylabel="roll [deg]" if k == 0 else "")
figure.savefig("linear.png", dpi=110)
print("largest errors:", np.nanmax(error, axis=(0, 1)).round(1), "deg")

inner = np.radians(np.random.default_rng(0).uniform([-20, -11.5], [20, 11.5], (1000, 2)))
inertia = np.diagonal(a.armature(inner, 1.0), axis1=1, axis2=2)
print("inertia within 20 and 11.5 deg varies by factors of", (inertia.max(axis=0) / inertia.min(axis=0)).round(1))

# ## What is feasible
#
# The box of the joints' ranges is not all reachable. `hull` gives half-spaces within the part that is: clip commands of
# a policy to these.
hull = a.hull()
print(f"{hull.share_lost:.0%} of the box is out of reach; half-spaces leave out {hull.share_cut:.0%}")
print(np.degrees(hull.polygon()).round(1).tolist())

# ## States to start from
#
# A simulation with closed loops must start closed, with all passive joints where they belong. `sample` gives such
# states, as MuJoCo's `qpos` of the exported model; with `model="g1.xml"` of the robot it came from.
sample = a.sample(1000, seed=0)
model = mujoco.MjModel.from_xml_path("robot.xml")
data = mujoco.MjData(model)
gap = 0.0
for qpos in sample.qpos:
    data.qpos[:] = qpos
    mujoco.mj_fwdPosition(model, data)
    gap = max(gap, np.abs(data.efc_pos[: data.ne]).max())
print(f"loops of {len(sample.qpos)} states are closed to 1e-9 m: {gap <= 1e-9}")

# ## A policy's position action, through the map
#
# The policy asks for pitch and roll. The motors' servos get their angles from the map, within the hull:
wanted = np.radians([-12.0, 6.0])
assert hull.contains(wanted)
data.qpos[:] = sample.qpos[0]
data.ctrl[:] = np.asarray(a.to_actuators(wanted))
mujoco.mj_step(model, data, 3000)
print("pitch and roll:", [round(float(np.degrees(data.joint(name).qpos[0])), 3) for name in a.names], "deg")
