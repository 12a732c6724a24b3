"""Reachy Mini: the head on six motors.

For who programs the head of this robot, or another six-motor head. You learn how to get motor angles for a look, what
the head can do, how to keep it within its limits, and how to follow a nod at the rate of the motors.
"""

# The catalogue has the head, with the geometry and the ranges of its maker. Lengths are in metres, and a pose is that
# of the head in the body.
import numpy as np

import pfabrik as pf

head = pf.load("reachy_mini")
print(head)
print("motors:", *head.actuator_names)

# ## A look, and its motors
#
# Roll, pitch and yaw are relative to home, where the head is level, 177 mm above the origin of the body. Positive
# pitch is a look down.


def look(roll: float = 0, pitch: float = 0, yaw: float = 0, up: float = 0) -> np.ndarray:
    """The target for three angles [deg] and a height above home [mm]."""
    return pf.pose([0, 0, 0.177 + 1e-3 * up], rpy=[roll, pitch, yaw], degrees=True)


answer = pf.solve_ik(head, look(pitch=-15, yaw=20, up=5))
print(answer.status.name, np.degrees(answer.actuators).round(1), "deg")
(joint, bound), margin = min(pf.margins(answer).items(), key=lambda item: item[1])
print(f"nearest limit: {joint} {bound}, {margin:.0%} left")
pf.plot(answer).figure.savefig("look.png", dpi=110)

# The other way round, from the motors' angles to the pose of the head:
back = pf.solve_fk(head, answer.actuators)
print(back.status.name, f"{1e3 * np.linalg.norm(back.pose[:3, 3] - answer.pose[:3, 3]):.6f} mm off")

# ## How far it can look
#
# From home, about each axis and up, until something stops it:
for each in pf.travel(pf.solve_ik(head, look()), about=[(1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)]):
    print("about", each.direction, f"{np.degrees(each.distance):.1f} deg, {each.why}")

# The ranges depend on each other: the higher the head, the less it can pitch.
for up in (0, 5, 10, 20):
    start = pf.solve_ik(head, look(up=up))
    down, back = (np.degrees(each.distance) for each in pf.travel(start, about=[(0, 1, 0), (0, -1, 0)]))
    print(f"{up:2d} mm: pitch from {-back:.0f} to {down:.0f} deg")

# ## Too much
#
# You need no table of what is allowed. A look that is too far gives the nearest one that the head can take, and says
# what stops it. By default it keeps the angles and gives up height; `hold="position"` does the opposite.
far = look(pitch=25, yaw=30, up=25)
for hold in ("orientation", "position"):
    each = pf.solve_ik(head, far, options=pf.Options(hold=hold))
    print(f"hold={hold!r}: {1e3 * each.position_error:.1f} mm, {np.degrees(each.rotation_error):.1f} deg off")
    print("   ", each.reason)

# ## A nod
#
# A motion is a path of targets. Each answer starts from the one before. Where a part of it is out of reach, the head
# goes along its limits. `jumps` tells whether motors would have to leap.
time = np.linspace(0, 2, 101)
nod = np.stack([look(pitch=20 * np.sin(2 * np.pi * t), yaw=10 * np.sin(np.pi * t), up=-5) for t in time])
motion = pf.track(head, nod)
speed = np.degrees(np.abs(np.diff(motion.actuators, axis=0)).max()) / (time[1] - time[0])
print(f"{int((motion.status == pf.Status.REACHED).sum())} of {len(motion)} reached, {int(motion.jumps.sum())} jumps")
print(f"fastest motor: {speed:.0f} deg/s")

# In a loop of your own, ask a `Solver`: it is prepared once, and takes microseconds a call ([Control
# loops](../control-loops.md)).
solver = pf.Solver(head)
if solver.ik(nod[30]) is pf.Status.REACHED:
    print(np.degrees(solver.actuators).round(1), "deg")

# Other robots of your own come from their [MuJoCo model or URDF](mujoco_and_urdf.md).
