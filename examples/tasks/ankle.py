"""A humanoid's ankle: pitch and roll to motors, and back.

For an ankle that two motors turn through cranks and rods. You learn how to get the motor angles for a pitch and a
roll, which limit is nearest, how fast and how strong the foot is, and what happens when it is asked for too much.
"""

# The catalogue has an ankle of this kind. Its end effector is the foot; its task is a tilt: where the foot's z axis
# points.
import numpy as np

import pfabrik as pf

ankle = pf.load("g1_ankle")
print(ankle)
print("motors:", *ankle.actuator_names)

# ## Pitch and roll to motors
#
# The foot turns about the joint `pitch_joint` first, and about `roll_joint` after it. So the rotation of the target is
# pitch times roll. The position of the target does not matter: the task has no position.


def foot(pitch: float, roll: float) -> np.ndarray:
    """The target for a pitch and a roll [deg]."""
    about_y = pf.pose([0, 0, 0], rpy=[0, pitch, 0], degrees=True)
    about_x = pf.pose([0, 0, 0], rpy=[roll, 0, 0], degrees=True)
    return about_y @ about_x


answer = pf.solve_ik(ankle, foot(-8, 4))
print(answer.status.name, np.degrees(answer.actuators).round(3), "deg")

# ## Motors to pitch and roll
#
# From encoder readings to the joints of the foot:
back = pf.solve_fk(ankle, answer.actuators)
print(f"pitch {np.degrees(back.joints['pitch_joint']):.3f}, roll {np.degrees(back.joints['roll_joint']):.3f} deg")

# Encoders that do not read 0 in the home configuration have an offset: add it to `actuators` when you send them,
# subtract it when you read them.

# ## A whole range at once
#
# A batch of targets gives a batch of answers. These are the motors for a pitch from -30 to 20 degrees, without roll.
pitches = np.arange(-30, 21, 10)
sweep = pf.solve_ik(ankle, np.stack([foot(pitch, 0) for pitch in pitches]))
for pitch, (left, right) in zip(pitches, np.degrees(sweep.actuators).round(6) + 0.0, strict=True):
    print(f"pitch {pitch:3d}  left {left:7.2f}  right {right:7.2f} deg")

# ## Limits
#
# A margin says how far a limit is off: 1 in the middle of the range, 0 on the limit.
(joint, bound), margin = min(pf.margins(answer).items(), key=lambda item: item[1])
print(f"nearest limit: {joint} {bound}, {margin:.0%} left")

# How far the foot can roll from here, both ways:
for each in pf.travel(answer, about=[(1, 0, 0), (-1, 0, 0)]):
    print(f"about {each.direction}: {np.degrees(each.distance):.2f} deg, stopped by {each.why}")

# ## Speed and torque
#
# The forward Jacobian maps motor rates to the foot's twist. Rows 3 and 4 are its rotation about x and y: what an equal
# rate of both motors does, and what opposite rates do.
jacobian = pf.forward_jacobian(answer)[3:5]
for label, rates in (("equal", [1, 1]), ("opposite", [1, -1])):
    about_x, about_y = jacobian @ rates
    print(f"{label} rates of 1 rad/s: {about_x:+.3f} rad/s about x, {about_y:+.3f} rad/s about y")

# Its transpose maps a torque at the foot to the torques that the motors have to hold (without friction and weight):
# here for 10 Nm about y.
print((jacobian.T @ [0, 10]).round(2), "Nm")

# ## Too much
#
# 25 degrees of roll are more than the ankle has. You get the nearest tilt that it can take, and what stops it.
steep = pf.solve_ik(ankle, foot(0, 25))
print(f"{steep.status.name}: {np.degrees(steep.rotation_error):.2f} deg short")
print(steep.reason)
pf.plot(steep).figure.savefig("steep.png", dpi=110)
