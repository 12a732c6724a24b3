"""Reachy Mini: the head on six motors.

For who programs the head of this robot, or another six-motor head. You learn how to get motor angles for a look, what
the head can do, how to keep it within its limits and off the body, and how to follow a nod at the rate of the motors.
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

# ## Keep the head off the body
#
# A look can be within the motors' ranges and yet push the head into the body. The catalogue's file says where both are
# thick, by the solids of the maker's own collision check: two round plates and two boxes in the body, a lying cylinder
# in the head. By itself that changes no answer; `pf.clearance` measures it:
deep = look(pitch=30, up=-20)
free = pf.solve_ik(head, deep)
print(free.status.name, pf.clearance(free))

# With a clearance it is a limit like all others. Here answers keep 5 mm. Orientation is kept, height gives way:
careful = head.with_clearance(0.005)
answer = pf.solve_ik(careful, deep)
print(f"{answer.status.name}, {1e3 * answer.position_error:.1f} mm off: {answer.reason}")
print(pf.clearance(answer))
pf.plot(answer).figure.savefig("apart.png", dpi=110)

# No target wedges the head. One that is 200 mm too low is answered, and a path that goes there comes back:
dip = np.stack([look(pitch=5, up=-200 * np.sin(np.pi * t) ** 2) for t in np.linspace(0, 1, 61)])
motion = pf.track(careful, dip)
print(" ".join(pf.Status(each).name for each in motion.status[[0, 5, 30, 55, 60]]))
print(f"lowest {1e3 * (motion.pose[:, 2, 3].min() - 0.177):.1f} mm, {int(motion.jumps.sum())} jumps")

# The solids are simpler than the shells. The maker's model also has convex pieces of the shells. Of 2,346 random looks
# that the motors can reach (up to 35 deg of roll and pitch, 55 of yaw, 50 mm down, 30 up):
#
# | clearance | of looks in which the shells touch, not refused | of looks in which they do not touch, refused |
# |--:|--:|--:|
# | 1 mm | 9.6 % | 4.9 % |
# | 5 mm | 4.3 % | 15 % |
# | 10 mm | 0.9 % | 39 % |
#
# Where that is not enough, give the pieces themselves, each a [mesh](../describing-a-mechanism.md#meshes). Rods, horns
# and antennas are not among the solids.

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
