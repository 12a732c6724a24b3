"""A redundant machine: twelve motors for six freedoms.

For a machine with more actuators than its platform has freedoms. You learn what the additional motors are free to do,
how to choose, and how to keep them from moving at will along a path.
"""

# In the machine `nrpm` of the catalogue three arms swing (`A`) and extend (`B`). Each carries two struts (`DL`, `DR`)
# up to the platform. That makes twelve driven coordinates.
import numpy as np

import pfabrik as pf

machine = pf.load("nrpm")
print(machine)
print(*machine.actuator_names)

# `internal` counts the motions of the actuators while the platform rests. This is the kinematic redundancy.
count = pf.mobility(machine)
print(f"mobility {count.mobility}: {count.platform} of the platform, {count.internal} internal")

# ## One pose, many answers
#
# For one pose the six struts follow from where the arms are, and the arms may be anywhere in a range. `solve_ik` gives
# one answer: it starts from home and moves the arms only if the pose or a limit asks for it.
target = pf.pose([10, 0, 190], rpy=[0, 5, 0], degrees=True)
answer = pf.solve_ik(machine, target)


def arms(solution: pf.Solution) -> str:
    """Swing [deg] and extension [mm] of the three arms."""
    swing = [np.degrees(solution.joints[f"A{k}"]) for k in (1, 2, 3)]
    extension = [solution.joints[f"B{k}"] for k in (1, 2, 3)]
    return f"swing {np.round(swing, 2)} deg, extension {np.round(extension, 2)} mm"


print(answer.status.name, arms(answer))

# Higher up, the struts alone do not reach. Now the arms extend and lean, by hardly more than the limits of the struts
# ask for: the steps that lead there are the least to first order.
high = pf.solve_ik(machine, [0, 0, 270])
print(high.status.name, arms(high))

# ## Choose the arms yourself
#
# The arms stay where the start has them. A start is an earlier answer, or a vector `q` of all joint coordinates. Take
# the one of home, write your values for the arms into it, and ask again. Such a start need not be a closed
# configuration.
q = pf.solve_ik(machine, machine.home_pose).q.copy()
for name in ("A1", "A2", "A3"):
    q[machine.coordinate_names.index(name)] = np.radians(80)
leaning = pf.solve_ik(machine, target, start=q)
print(leaning.status.name, arms(leaning))

# Both answers have the platform in the same pose; the struts differ.
for label, each in (("upright", answer), ("leaning", leaning)):
    struts = [float(each.joints[name].round(1)) for name in machine.actuator_names if name.startswith("D")]
    print(label, struts)
pf.plot(leaning, names=machine.actuator_names).figure.savefig("leaning.png", dpi=110)

# ## Which is better?
#
# That is for you to say: the library has no preference. Here we compare three leans by two measures. `parallel` is the
# distance from a singularity where the struts lose hold of the platform, and the margin says how far the nearest limit
# is off (1: middle of the range, 0: on the limit).
for lean in (70, 80, 90):
    for name in ("A1", "A2", "A3"):
        q[machine.coordinate_names.index(name)] = np.radians(lean)
    each = pf.solve_ik(machine, target, start=q)
    (joint, bound), margin = min(pf.margins(each).items(), key=lambda item: item[1])
    print(f"{lean} deg: parallel {pf.singularity(each).parallel:.3f}, {margin:.0%} left to {joint} {bound}")

# ## Along a path
#
# On a path each answer starts from the one before. Arms that were moved by a limit stay where they are afterwards. So a
# closed path need not bring them back:
angle = np.linspace(0, 2 * np.pi, 121)
circle = np.stack([0 * angle, 50 * np.cos(angle), 210 + 50 * np.sin(angle)], axis=1)
free = pf.track(machine, circle)
print("reached" if free else "not reached")
print("begin", arms(free[0]))
print("end  ", arms(free[-1]))

# If something must not move, hold it. A range of a single value locks a joint; home must be inside it. Hold the swings
# first, then the extensions too: with six struts on resting arms, half of this circle is out of reach.
at_home = dict(zip(machine.actuator_names, pf.solve_ik(machine, machine.home_pose).actuators, strict=True))
for letters in ("A", "AB"):
    ranges = {f"{letter}{k}": (at_home[f"{letter}{k}"],) * 2 for letter in letters for k in (1, 2, 3)}
    held = pf.track(machine.with_limits(ranges), circle)
    print(f"{letters} held: {int((held.status == pf.Status.REACHED).sum())} of {len(held)} reached;", arms(held[-1]))

# ## All motions that leave the platform at rest
#
# The internal motions are the null space of the forward Jacobian: 12 actuators, 6 freedoms of the platform, 6 left.
_, sizes, rows = np.linalg.svd(pf.forward_jacobian(answer))
print(f"rank {int((sizes > 1e-6 * sizes[0]).sum())}, null space of {len(rows) - len(sizes)}")
