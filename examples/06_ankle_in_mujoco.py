"""A position actuator in MuJoCo through the exact map of an ankle: joints are simulated, motors are controlled."""

import importlib.util
import tempfile
from pathlib import Path

import mujoco
import numpy as np

import pfabrik as pf

# Once, where pfabrik is: pfabrik export g1_ankle --numpy ankle.py --joints pitch_joint roll_joint
file = pf.export_numpy(pf.load("g1_ankle"), Path(tempfile.mkdtemp()) / "ankle.py", joints=["pitch_joint", "roll_joint"])

# From here on nothing but NumPy and MuJoCo.
spec = importlib.util.spec_from_file_location("ankle", file)
ankle = importlib.util.module_from_spec(spec)
spec.loader.exec_module(ankle)

MODEL = """
<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <worldbody>
    <body pos="0 0 0.15">
      <joint name="pitch_joint" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="0.05" diaginertia="1e-4 1e-4 1e-4"/>
      <body pos="0 0 -0.017558">
        <joint name="roll_joint" axis="1 0 0"/>
        <geom type="box" size="0.09 0.04 0.01" pos="0.03 0 -0.03" mass="0.6"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
KP, KD = 40.0, 1.0  # of the motors [Nm/rad, Nms/rad]
HOME = np.zeros(2)
WANTED = np.array([-0.45, 0.15])  # pitch, roll [rad]


def exact(q):
    """Motor angles, and their rates by those of the joints."""
    return ankle.with_jacobian(q)


def linear(q):
    """The same by a map that is constant, as firmwares often have it."""
    return ankle.to_actuators(HOME) + ankle.jacobian(HOME) @ q, ankle.jacobian(HOME)


def settled(target_map):
    """Where the joints come to rest under motors that hold what a map makes of the wanted joints."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    target = target_map(WANTED)[0]
    for _ in range(2000):
        motors, jacobian = exact(data.qpos)  # what the machine does, whatever map the controller has
        torques = KP * (target - motors) - KD * jacobian @ data.qvel
        data.qfrc_applied[:] = jacobian.T @ torques
        mujoco.mj_step(model, data)
    return data.qpos.copy()


for name, target_map in (("exact", exact), ("linear", linear)):
    error = np.degrees(settled(target_map) - WANTED)
    print(f"{name:>6} map: pitch off by {error[0]:6.2f} deg, roll by {error[1]:6.2f} deg")
