"""From MuJoCo and URDF, and back.

For anybody who has a model of the robot already. You learn how to read it, what becomes of its joints, how to have
MuJoCo check the answers, and how to get a model for simulation out of a mechanism. It needs MuJoCo (`pip install
".[mujoco]"` in the folder of the clone).
"""

# Here is a small MuJoCo model: a planar 5-bar. Two cranks are driven, two forearms meet in a loop that `connect`
# closes.
from pathlib import Path

import numpy as np

import pfabrik as pf

Path("five_bar.xml").write_text("""
<mujoco model="five-bar">
  <worldbody>
    <body name="crank_left" pos="-0.05 0 0">
      <joint name="left" axis="0 1 0" range="-60 60"/>
      <geom type="capsule" size="0.005" fromto="0 0 0 -0.05 0 0.09"/>
      <body name="forearm_left" pos="-0.05 0 0.09">
        <joint name="elbow_left" axis="0 1 0"/>
        <geom type="capsule" size="0.005" fromto="0 0 0 0.1 0 0.1"/>
        <site name="tip" pos="0.1 0 0.1"/>
      </body>
    </body>
    <body name="crank_right" pos="0.05 0 0">
      <joint name="right" axis="0 1 0" range="-60 60"/>
      <geom type="capsule" size="0.005" fromto="0 0 0 0.05 0 0.09"/>
      <body name="forearm_right" pos="0.05 0 0.09">
        <joint name="elbow_right" axis="0 1 0"/>
        <geom type="capsule" size="0.005" fromto="0 0 0 -0.1 0 0.1"/>
      </body>
    </body>
  </worldbody>
  <equality>
    <connect body1="forearm_left" body2="forearm_right" anchor="0.1 0 0.1"/>
  </equality>
  <actuator>
    <position joint="left"/>
    <position joint="right"/>
  </actuator>
</mujoco>
""")

# ## A model in
#
# Say which body or site is the end effector, and in which unit you want lengths; the model itself is in metres.
# Everything that was left out or changed is noted.
found = pf.interop.from_mjcf("five_bar.xml", end_effector="tip", length_unit="mm")
machine = found.mechanism
print(machine)
for note in found.notes:
    print("-", note)

# Now it is a mechanism like all others. Joints that have actuators in the model are the driven ones, in its order.
answer = pf.solve_ik(machine, [10, 0, 180])
print(
    answer.status.name, dict(zip(machine.actuator_names, np.degrees(answer.actuators).round(3).tolist(), strict=True))
)

pf.plot(answer, names=True).figure.savefig("imported.png", dpi=110)

# Its capsules have become shapes of the bodies, so the links are as thick as in the model. Answers are the same as
# without them; they say how far links are apart.
print(pf.clearance(answer))

# Save it as a file of its own, to add what the model does not have: cones of ball joints, speeds of motors, a task,
# or the `clearance` that answers are to keep.
pf.save(machine, "five_bar.toml")

# ## MuJoCo as the referee
#
# `verify` takes random poses that are reached, lets MuJoCo close the loops of the *original* model with the same motor
# angles, and compares where the end effector is.
check = pf.interop.verify(machine, poses=20, original="five_bar.xml")
print("agrees:", check.original.position_difference < check.original.position_tolerance)
for name, share in check.travelled.shares.items():
    print(f"{name} moved through {share:.0%} of its range")

# ## A model out
#
# The other way round: any mechanism becomes a MuJoCo model that starts closed. Masses are made up.
model = pf.interop.to_mjcf(pf.load("stewart"))
Path("stewart.xml").write_text(model)
print(model.count("<connect"), "loops closed by connect")

# ## URDF
#
# A URDF is a tree: it cannot say that a loop closes. So the loops, and the motors, come in a second file or as a table.
# This four-bar has one loop: the tips of the coupler and of the rocker meet.
Path("four_bar.urdf").write_text("""
<robot name="four_bar">
  <link name="base"/> <link name="crank"/> <link name="coupler"/> <link name="rocker"/>
  <joint name="motor" type="revolute">
    <parent link="base"/> <child link="crank"/> <origin xyz="0 0 0"/> <axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="5"/>
  </joint>
  <joint name="knee" type="continuous">
    <parent link="crank"/> <child link="coupler"/> <origin xyz="0 0 0.1"/> <axis xyz="0 1 0"/>
  </joint>
  <joint name="pivot" type="continuous">
    <parent link="base"/> <child link="rocker"/> <origin xyz="0.2 0 0"/> <axis xyz="0 1 0"/>
  </joint>
</robot>
""")
loop = {"name": "tip", "type": "ball", "links": ["coupler", "rocker"], "at": [[0.2, 0, 0.05], [0, 0, 0.15]]}
four_bar = pf.interop.from_urdf(
    "four_bar.urdf", loops={"loops": [loop], "actuated": ["motor"]}, end_effector="rocker", length_unit="mm"
)
print(four_bar.mechanism)
for note in four_bar.notes:
    print("-", note)

# The rocker turns, and nothing else of it can be chosen; so import made its tilt the task. To lean it by 5 degrees:
leaning = pf.solve_ik(four_bar.mechanism, pf.pose([0, 0, 0], rpy=[0, 5, 0], degrees=True))
print(leaning.status.name, np.degrees(leaning.actuators).round(3), "deg")

# At the command line: `pfabrik import`, `pfabrik verify` and `pfabrik export ... mjcf`. What becomes of which element
# is on [MuJoCo and URDF](../mujoco-and-urdf.md).
