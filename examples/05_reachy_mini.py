"""The head of Reachy Mini: what it can do, what stops it, and the nearest pose where there is no answer."""

import numpy as np

import pfabrik as pf

head = pf.load("reachy_mini")

# Look up and to the side, 5 mm higher: reached, and which motor has the least room left.
look = pf.solve_ik(head, pf.pose([0, 0, 0.182], rpy=[0, -15, 20], degrees=True))
(joint, bound), margin = min(pf.margins(look).items(), key=lambda item: item[1])
print(f"{look.status}: motors at {np.degrees(look.actuators).round(1)} deg; {joint} has {margin:.0%} of its room left")

# Twice as far up: closed forms of the rods have no real solution. The answer is the nearest pose of the head.
far = pf.solve_ik(head, pf.pose([0, 0, 0.23], rpy=[0, -15, 20], degrees=True))
held = ", ".join(f"{limit.joint} at its {limit.bound}" for limit in far.active_limits) or "rods at full stretch"
print(f"{far.status}: {1e3 * far.position_error:.1f} mm short, by {held}")

# A target that the rods reach, but not within the ranges of the motors.
pitched = pf.pose([0.009, 0.003, 0.189], rpy=[-3, 19, -3], degrees=True)
within, beyond = pf.solve_ik(head, pitched), pf.solve_ik(head.without_limits(), pitched)
print(f"without limits {beyond.status}, within them {within.status}:")
for limit in within.active_limits:
    print(f"  {limit.joint} is at its {limit.bound}, {np.degrees(limit.value):.1f} deg")
