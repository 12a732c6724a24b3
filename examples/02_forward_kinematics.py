"""Forward kinematics: from what the encoders read to the pose, to all poses, and to what impossible readings mean."""

import numpy as np

import pfabrik as pf

stewart = pf.load("stewart")

# From a pose to the six strut lengths, and from the lengths back to the pose.
target = pf.pose([10, -5, 200], rpy=[0.05, 0.1, 0])
lengths = pf.solve_ik(stewart, target).actuators
back = pf.solve_fk(stewart, lengths)
print(f"{back.status}: {np.abs(back.pose - target).max():.0e} {stewart.length_unit} from where it began")
print(f"  joint AL1 turned by {np.degrees(back.joints['AL1']).round(2)} deg about its two axes")

# One strut longer than its neighbours allow. The answer is a machine that exists, its struts as near as they come.
asked = [205, 205, 205, 205, 205, 260]
near = pf.solve_fk(stewart, asked)
print(f"{near.status}: struts up to {np.abs(near.actuators - asked).max():.1f} mm from what was asked")
for limit in near.active_limits:
    print(f"  held by joint {limit.joint}, its {limit.bound} at {np.degrees(limit.limit):.0f} deg")

# The same six lengths fit other poses. All of them, limits or not: EXCEEDED marks those beyond a limit.
modes = pf.assembly_modes(stewart, lengths)
kept = [mode for mode in modes if mode.status is pf.Status.REACHED]
print(f"{len(modes)} assembly modes, {len(kept)} of them within all limits")
print(f"  {modes.starts} starts; the rarest mode found {min(modes.hits)} times")


# A triangle on three struts in the plane (Sauer, Numerical Analysis, Reality Check 1): four poses for lengths 5, 5, 3.
def planar_3rpr() -> pf.Mechanism:
    feet = [(0, 0, 0), (5, 0, 0), (0, 6, 0)]
    corners = [(1, 2, 0), (4, 2, 0), (4, 5, 0)]  # any place will do: home need not have these lengths
    joints = []
    for k, (foot, corner) in enumerate(zip(feet, corners, strict=True), start=1):
        ends = (f"A{k}", f"C{k}")
        joints += [
            pf.Joint(f"A{k}", "revolute", ("base", f"cylinder{k}"), at=foot, axis=(0, 0, 1)),
            pf.Joint(f"B{k}", "prismatic", (f"cylinder{k}", f"rod{k}"), along=ends, actuated=True),
            pf.Joint(f"C{k}", "revolute", (f"rod{k}", "triangle"), at=corner, axis=(0, 0, 1)),
        ]
    return pf.Mechanism("3-RPR", joints, "triangle", reference_point=corners[0])


for mode in pf.assembly_modes(planar_3rpr(), [5, 5, 3]):
    angle = np.arctan2(mode.pose[1, 0], mode.pose[0, 0])
    print(f"  theta {angle:+.4f}, x {mode.pose[0, 3]:+.4f}, y {mode.pose[1, 3]:+.4f}")
