"""A long chain: an arm of seven joints, a snake of sixty, a hundred hinges.

For arms, trunks and snakes: chains with more joints than the pose needs. You learn how to choose among their many
answers, how to describe a chain of a hundred joints in a few lines, what you get out of reach, and how to follow a
path.
"""

# The catalogue has an arm of seven joints. It needs six for a pose; the seventh lets its elbow swing about the line
# from shoulder to wrist while the hand rests.
import numpy as np

import pfabrik as pf

arm = pf.load("panda")
print(arm)
print("motions that leave the hand at rest:", pf.mobility(arm).internal)

# ## Many answers for one pose
#
# `solve_ik` starts from home and moves the joints no more than it must. Rotations are relative to home.
target = pf.pose([420, 150, 450], rpy=[0, 10, 20], degrees=True)
answer = pf.solve_ik(arm, target)
print(answer.status.name, *np.degrees(answer.actuators).round(1), "deg")

# From another start you get another answer. So give the posture that you like best as `start`: here the upper arm is
# turned inward. A start is a vector `q` of all joint coordinates, and its end effector may be anywhere.
q = answer.q.copy()
q[arm.coordinate_names.index("J3")] += np.radians(40)
inward = pf.solve_ik(arm, target, start=q)
print(inward.status.name, *np.degrees(inward.actuators).round(1), "deg")

# The hand is in the same place, the elbow is not:
for label, each in (("from home", answer), ("inward", inward)):
    print(label, "- upper arm turned by", f"{np.degrees(each.joints['J3']):.0f} deg")

# ## A hundred hinges
#
# A chain this long is quicker written in Python than in a file. Every joint says which two bodies it connects, where it
# is at home and about which axis it turns. Here are 100 links of 10 mm in a plane. Each may bend by 10 degrees.
bend = np.radians(10)
hinges = [
    pf.Joint(
        f"J{k}",
        "revolute",
        connects=(f"link{k - 1}", f"link{k}"),
        at=(10 * k, 0, 0),
        axis=(0, 1, 0),
        range=(-bend, bend),
        actuated=True,
    )
    for k in range(1, 101)
]
chain = pf.Mechanism("hundred hinges", hinges, base="link0", end_effector="link100", reference_point=(1010, 0, 0))
print(chain)

# A target is a pose of the end, here below the base and turned back by 150 degrees. In its plane the chain reaches it
# with 97 motions to spare.
curl = pf.solve_ik(chain, pf.pose([300, 0, -450], rpy=[0, 150, 0], degrees=True))
print(curl.status.name, f"- largest bend {np.degrees(np.abs(curl.actuators).max()):.0f} deg")
pf.plot(curl).figure.savefig("curl.png", dpi=110)

# ## Out of reach
#
# A target out of reach gives the nearest pose that the chain can take, as for every mechanism. By default it has the
# orientation of the target. With `hold=None` position and orientation may both give way.
far = pf.pose([900, 0, -700], rpy=[0, 90, 0], degrees=True)
for hold in ("orientation", None):
    each = pf.solve_ik(chain, far, options=pf.Options(hold=hold))
    away = f"{each.position_error:.0f} mm and {np.degrees(each.rotation_error):.0f} deg away"
    print(f"hold={hold!r}: {each.status.name}, {away}; {each.reason.partition(';')[0]}")

# ## Along a path
#
# On a path each answer starts from the one before, so the chain moves on without a jump. The snake of the catalogue has
# 60 hinges, about z and y by turns. Here its head draws a circle and keeps its orientation.
snake = pf.load("snake60")
angle = np.linspace(0, 2 * np.pi, 73)
circle = np.stack([2500 + 0 * angle, 300 * np.cos(angle), 300 * np.sin(angle)], axis=1)
path = pf.track(snake, circle)
print(len(path), "steps,", "all reached" if path else "not all reached", "- jumps:", int(path.jumps.sum()))
print(f"largest step of a joint: {np.degrees(np.abs(np.diff(path.actuators, axis=0)).max()):.2f} deg")

# With that many joints to spare, a closed path need not bring them back to where they began. Track it twice to see:
twice = pf.track(snake, np.concatenate([circle, circle[1:]]))
drift = np.degrees(np.abs(twice.actuators[[0, -1]] - twice.actuators[72]).max(axis=1))
print(f"after one turn {drift[0]:.1f} deg off the begin; the second turn adds {drift[1]:.1f} deg")

# If it has to repeat, give the joints of one turn to the controller again, rather than the poses. How the engine works,
# what it promises and how fast it is: [Long chains](../long-chains.md).
