"""A humanoid's ankle with two motors: motors to pitch and roll, and back, with the joints as a controller has them."""

import numpy as np

import pfabrik as pf

ankle = pf.load("g1_ankle")

# Pitch and roll turn about axes that miss each other: first pitch about y, then roll about x.
pitch, roll = np.radians([-8.0, 4.0])
turned = pf.pose([0, 0, 0], rpy=[0, pitch, 0])[:3, :3] @ pf.pose([0, 0, 0], rpy=[roll, 0, 0])[:3, :3]
answer = pf.solve_ik(ankle, pf.pose(ankle.reference_point, rotation=turned))
print(f"{answer.status}: motors at {np.degrees(answer.actuators).round(3)} deg")

# Back from the motors.
back = pf.solve_fk(ankle, answer.actuators)
angles = np.degrees([back.joints["pitch_joint"], back.joints["roll_joint"]])
print(f"{back.status}: pitch and roll {angles.round(6)} deg")

# What the motors make of it: the rates of the foot per rate of each motor, rad/s per rad/s, about x and y.
print(pf.forward_jacobian(answer)[3:5].round(3))

# More roll than the ankle has: the nearest tilt, and what stops it.
steep = pf.pose(ankle.reference_point, rpy=[25, 0, 0], degrees=True)
stopped = pf.solve_ik(ankle, steep)
print(f"{stopped.status}: {np.degrees(stopped.rotation_error):.1f} deg short, by {stopped.active_limits[0].joint}")
