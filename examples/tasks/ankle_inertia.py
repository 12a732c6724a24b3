"""An ankle's inertia for a policy: what the serial model of a humanoid lacks, and how to give it.

For a robot that is trained in joints (pitch, roll), as a tree without loops, and built with motors that push rods. You
learn how heavy rotors, cranks and rods make the joints, how that changes over the range, what a constant armature
loses, and how to hand it to a simulator.
"""

# The ankle of the catalogue, with masses of its own: a foot, the link between the two axes, cranks and steel rods, and
# rotors behind gears of 16 to 1. In a file they stand in tables `[[body]]` and in the joints of the motors.
import dataclasses

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import pfabrik as pf

bare = pf.load("g1_ankle")
names = ("pitch_joint", "roll_joint")
at = {joint.name: np.array(joint.at) for joint in bare.joints}
foot = [
    pf.Mass("roll_link", 0.55, [0.03, 0, 0.1], [6e-4, 2.2e-3, 2.4e-3]),
    pf.Mass("pitch_link", 0.05, at["pitch_joint"]),
]
links = [pf.Mass(f"{side}_u_link", 0.01, at[f"{side}_u_pitch_joint"]) for side in ("left", "right")]
shapes = [
    pf.Shape(f"{side}_{part}_link", ends=(at[f"{side}_{part}_joint"], at[closure]), thickness=thickness, density=7850)
    for side, closure in (("right", "closure_1"), ("left", "closure_2"))
    for part, thickness in (("connect", 0.008), ("motor", 0.012))
]
joints = [dataclasses.replace(joint, rotor_inertia=4e-5, gear=16) if joint.actuated else joint for joint in bare.joints]
ankle = dataclasses.replace(bare, joints=joints).with_shapes(shapes).with_masses([*foot, *links])
a = pf.actuation(ankle, joints=names)
whole = a.armature(a.home, links=True)
print("all of it at home: ", (1e3 * whole).round(2).tolist(), "g m²")
print("of it the rotors:  ", (1e3 * a.armature(a.home)).round(2).tolist(), "g m²")

# ## What the serial model has, and what it lacks
#
# The tree that a policy is trained with has the foot on two hinges, and knows the foot's inertia. All that it lacks is
# the rest: rotors, cranks and rods, as the joints feel them. That is the inertia of the whole, less the tree's.
hinges = [dataclasses.replace(joint, actuated=True) for joint in bare.joints if joint.name in names]
serial = pf.Mechanism("foot on hinges", hinges, bare.end_effector, bare.reference_point, length_unit="m")
serial = serial.with_masses(foot)


def lacking(q):
    """What rotors, cranks and rods add to the joints, (..., 2, 2) [kg m²]."""
    return a.armature(q, links=True) - pf.mass_matrix(pf.solve_fk(serial, q), "actuators")


home = lacking(a.home)
print("the tree at home:  ", (1e3 * (whole - home)).round(2).tolist(), "g m²")
print("lacking:           ", (1e3 * home).round(2).tolist(), "g m²")

# Most of it is not in the tree, and depends on where the ankle is: the shorter the lever by which a rod turns the foot,
# the faster its motor turns with it, and the heavier that feels.
pitch, roll = np.meshgrid(np.radians(np.linspace(-30, 20, 51)), np.radians(np.linspace(-10, 10, 41)), indexing="ij")
q = np.stack([pitch, roll], axis=-1)
A = lacking(q)
figure, axes = plt.subplots(1, 3, figsize=(10, 3), layout="constrained", sharey=True)
for ax, title, values in zip(
    axes, ("pitch", "roll", "between both"), (A[..., 0, 0], A[..., 1, 1], A[..., 0, 1]), strict=True
):
    drawn = ax.contourf(np.degrees(pitch), np.degrees(roll), 1e3 * values, 12, cmap="cividis")
    figure.colorbar(drawn, ax=ax, label="g m²")
    ax.set(title=title, xlabel="pitch [deg]", ylabel="roll [deg]" if title == "pitch" else "")
figure.savefig("lacking.png", dpi=110)
for k, name in enumerate(names):
    print(
        f"{name}: {1e3 * A[..., k, k].min():.1f} to {1e3 * A[..., k, k].max():.1f} g m², {1e3 * home[k, k]:.1f} at home"
    )
coupling = np.abs(A[..., 0, 1]) / np.sqrt(A[..., 0, 0] * A[..., 1, 1])
print(f"coupling: up to {coupling.max():.0%}, of 100% that tie one joint to the other")

# ## What a constant armature loses
#
# Simulators have one number for each joint. How wrong is the acceleration that a torque makes, over this range and all
# directions of the torque, with the numbers of home, of the middle of the range, or of the pose?
tree = pf.mass_matrix(pf.solve_fk(serial, q), "actuators")
angle = np.linspace(0, np.pi, 24, endpoint=False)
torque = np.stack([np.cos(angle), np.sin(angle)])
true = np.linalg.solve(tree + A, torque)
diagonal = np.eye(2) * A
middle = np.sqrt(diagonal.min(axis=(0, 1)) * diagonal.max(axis=(0, 1)))
for what, model in (
    ("none", 0 * A),
    ("of home", np.eye(2) * home),
    ("of the middle", middle),
    ("of the pose", diagonal),
):
    wrong = np.linalg.norm(np.linalg.solve(tree + model, torque) - true, axis=-2) / np.linalg.norm(true, axis=-2)
    print(f"armature {what:13s}  acceleration off by {np.median(wrong):4.0%}, at most {wrong.max():4.0%}")

# The last line is what a simulator can have at best whose armature may be set in every step. Where it takes one number
# for each joint for all time, take those of the poses that the policy visits, and randomise them over their range.
#
# ## Into MuJoCo, and Isaac
#
# MuJoCo takes it as `armature` of the joints, in kg m²; `model.dof_armature` may be set anew in every step. In Isaac
# Lab it is `armature` of an actuator's configuration, by the names of joints. The closed machine with its rotors is
# here to compare with: all swing by the same torques of pitch and roll, back and forth, from rest at home.
#
# An inertia that changes takes a torque of its own, which no armature has: for the rotors, with motors that accelerate
# by J q'' + J' q', it is Jᵀ I J' q'. The last model has that too, and what a joint feels of the other's acceleration.
rotor = 4e-5 * 16**2


def swing(mechanism, armature, more=None):
    """Pitch and roll [deg] over half a second, (500, 2), by the armature of joints, and what resists beside it."""
    model = mujoco.MjModel.from_xml_string(pf.interop.to_mjcf(mechanism))
    data = mujoco.MjData(model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    model.opt.timestep, model.dof_damping[:], model.dof_armature[:] = 0.001, 0, 0
    joints = [model.joint(name) for name in names]
    at, dof = (np.concatenate([getattr(joint, of) for joint in joints]) for of in ("qposadr", "dofadr"))
    mujoco.mj_resetDataKeyframe(model, data, 0)
    rows = []
    for _ in range(500):
        for name, value in armature(data.qpos[at]).items():
            model.dof_armature[model.joint(name).dofadr] = value
        torque = np.array([2.2, 0.4]) * np.cos(8 * np.pi * data.time)
        data.qfrc_applied[dof] = torque - (more(data.qpos[at], data.qvel[dof], data.qacc[dof]) if more else 0)
        mujoco.mj_step(model, data)
        rows.append(np.degrees(data.qpos[at]))
    return np.array(rows)


def of_pose(q):
    """The diagonal of what the tree lacks, by joints."""
    return dict(zip(names, np.diag(lacking(q)), strict=True))


def beside(q, rates, accelerations):
    """What no armature has: torques of the other joint's acceleration, and of rotors as their levers change."""
    A = lacking(q)
    return (A - np.diag(np.diag(A))) @ accelerations + a.jacobian(q).T @ (rotor * a.jacobian_rate(q, rates) @ rates)


closed = swing(ankle, lambda _: dict.fromkeys(ankle.actuator_names, rotor))
print("the closed machine swings to", closed[np.abs(closed).argmax(axis=0), [0, 1]].round(1), "deg")
constant = dict(zip(names, np.diag(home), strict=True))
for what, *model in (
    ("no armature", lambda q: {}),
    ("that of home", lambda q: constant),
    ("that of the pose", of_pose),
    ("and what is beside it", of_pose, beside),
):
    wrong = np.abs(swing(serial, *model) - closed).max(axis=0)
    print(f"tree with {what:22s} off by up to {wrong[0]:4.1f} deg of pitch, {wrong[1]:4.1f} of roll")

# In pitch an armature that follows the pose is no better than that of home, for it comes without its torque: give both,
# or a constant that is randomised. Of all this the foot is the small part: rotors count with the square of their gears.
#
# That policies trained on the serial model alone do worse on the robot is [known](https://arxiv.org/abs/2507.10164);
# S3N ([arXiv 2608.01697](https://arxiv.org/abs/2608.01697)) puts the inertia of links into the serial model. More of
# the map between joints and motors: [actuator space](../actuator-space.md); of masses: [inverse
# dynamics](../dynamics.md).
