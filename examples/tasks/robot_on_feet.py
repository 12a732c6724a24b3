"""A robot on its feet: a quadruped as a parallel mechanism.

For people with a legged robot who want its trunk somewhere while its feet stay. You learn how `pf.stand` makes a
machine of a robot's file, what its feet, and a sole, are to it, how far the trunk goes, and how the answers go back to
the simulator.
"""

# ## A robot's file
#
# Any URDF, SDF or MuJoCo model does; here a small dog, written on the spot: four legs of three hinges, a ball at the
# end of each, a keyframe in which it crouches.
import matplotlib.pyplot as plt
import mujoco
import numpy as np

import pfabrik as pf

LEGS = {"FL": (0.2, 0.1), "FR": (0.2, -0.1), "RL": (-0.2, 0.1), "RR": (-0.2, -0.1)}


def leg(name, x, y):
    return f"""
    <body name="{name}_hip" pos="{x} {y} 0"><inertial pos="0 0 0" mass="0.6" diaginertia="1e-3 1e-3 1e-3"/>
      <joint name="{name}_hip" axis="1 0 0" range="-60 60"/>
      <body name="{name}_thigh" pos="0 {0.8 * y} 0"><inertial pos="0 0 -0.1" mass="1" diaginertia="5e-3 5e-3 1e-3"/>
        <joint name="{name}_thigh" axis="0 1 0" range="-90 200"/>
        <body name="{name}_calf" pos="0 0 -0.2"><inertial pos="0 0 -0.1" mass="0.2" diaginertia="1e-3 1e-3 1e-4"/>
          <joint name="{name}_calf" axis="0 1 0" range="-155 -48"/>
          <geom name="{name}" type="sphere" size="0.02" pos="0 0 -0.2"/>
    </body></body></body>"""


robot = f"""<mujoco model="dog"><worldbody><body name="trunk"><freejoint/>
  <inertial pos="0 0 0" mass="7" diaginertia="0.1 0.1 0.02"/>{"".join(leg(name, *at) for name, at in LEGS.items())}
</body></worldbody>
<actuator>{"".join(f'<motor joint="{name}_{part}"/>' for name in LEGS for part in ("hip", "thigh", "calf"))}</actuator>
<keyframe><key name="home" qpos="0 0 0.28 1 0 0 0 {4 * "0 0.8 -1.6 "}"/></keyframe></mujoco>"""

# ## On its feet
#
# `stand` takes away what lets the trunk float, and holds the feet where they are at home: the keyframe `home`, as the
# model has one. What comes out is a machine as any other, which `pf.save` writes to a file. A foot alone is a point,
# which stays and turns; `{"left_sole": "flat"}` holds all of a sole, `"pinned"` lets it turn about the vertical.
dog = pf.stand(robot, ["FL", "FR", "RL", "RR"])
counts = pf.mobility(dog)
print(f"{dog.end_effector}: {counts.platform} freedoms of {counts.actuators} drives")

# On the command line, `pfabrik import dog.xml` tells that it stands on these four, and
# `pfabrik import dog.xml --stand FL,FR,RL,RR -o dog.toml` writes the file.
#
# ## Where may the trunk go?
#
# A target is a pose of the trunk. In reach, all feet stay and every joint is within its range; out of reach the answer
# is the nearest pose that keeps both, and the joints that stop it.
leaning = pf.solve_ik(dog, pf.pose([0.04, 0.02, 0.24], rpy=[5, 10, 15], degrees=True))
front_left = np.degrees(leaning.actuators[:3]).round().tolist()
print(leaning.status.name, dict(zip(dog.actuator_names, front_left, strict=False)))
print(pf.solve_ik(dog, pf.pose([0.0, 0.0, 0.5])).reason)
print(pf.travel(pf.solve_ik(dog, dog.home_pose)))

# ## Would a foot slip?
#
# Twelve motors hold six freedoms in many ways. With a coefficient of friction they share the weight so that the foot
# that is the first to slip or lift has most to spare; a push that no forces hold is told.
weights = {each.body: (each.mass, each.centre) for each in dog.masses}
spare = pf.forces(leaning, loads=weights, friction=0.6).spare
print({name: round(float(value), 2) for name, value in spare.items()}, "N to spare")
print(pf.forces(leaning, [0.0, 90.0, 0.0], loads=weights, friction=0.6).reason)

# ## Back to the robot
#
# `interop.qpos` gives MuJoCo's positions, of the trunk that floats and of all joints, in the order of the model: of one
# answer or of a path, ready for `data.qpos`, or for a file.
time = np.linspace(0.0, 4.0, 401)
swing = np.stack([0.06 * np.sin(2 * time), 0.05 * np.sin(3 * time), 0.28 + 0.03 * np.cos(5 * time)], axis=1)
turns = np.stack([0.2 * np.sin(3 * time), 0.25 * np.sin(2 * time), 0.3 * np.sin(time)], axis=1)
path = pf.track(dog, pf.pose(swing, rotvec=turns))
states = pf.interop.qpos(path, robot)
np.savetxt("qpos.csv", states, delimiter=",")
print(states.shape, "of", (path.status == pf.Status.REACHED).sum(), "poses reached")

# Where MuJoCo itself puts the feet then:
model = mujoco.MjModel.from_xml_string(robot)
data, feet = mujoco.MjData(model), []
for state in states:
    data.qpos[:] = state
    mujoco.mj_kinematics(model, data)
    feet.append([data.geom(name).xpos.copy() for name in LEGS])
print("feet move by < 1e-12 m:", bool(np.ptp(feet, axis=0).max() < 1e-12))

figure, axes = plt.subplots(1, 2, figsize=(8.0, 3.2), layout="constrained", width_ratios=(1.0, 1.3))
pf.plot(leaning, ax=axes[0])
for name, column in zip(dog.actuator_names[:3], path.actuators.T[:3], strict=True):
    axes[1].plot(time, np.degrees(column), label=name)
axes[1].set(xlabel="time [s]", ylabel="deg")
axes[1].legend(frameon=False)
figure.savefig("robot_on_feet.png", dpi=120)

# And in motion:
pf.animate(path, "swinging.gif", seconds=1.5, size=(3.2, 2.4), dpi=80)
