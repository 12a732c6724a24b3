"""Motors of a motion rig: forces over a motion, peak and rms of each.

For a platform on six electric cylinders that heaves and rolls with a cabin on it. You learn what each cylinder has to
push and pull, what of that is weight, what motion and what its own motor, what the joints carry, and how much force is
left for the unexpected.
"""

# The rig: six cylinders between pairs of joints, lengths in millimetres. Each has a screw that moves 10 mm a turn, so a
# gear of 200 pi radians per metre, a motor whose rotor has 3 kg cm², and exerts 3 kN at most. Forces are in N, torques
# in N m.
import numpy as np

import pfabrik as pf

gear = 2 * np.pi / 0.010
legs = pf.Leg(
    "U-P*-S",
    base=[[1100, 150, 0], [1100, -150, 0]],
    platform=[[450, 700, 1100], [450, -700, 1100]],
    by_letter={"B": {"range": (1080, 1680), "rotor_inertia": 3e-4, "gear": gear, "max_torque": 3000}},
    copies={"count": 3, "axis": [0, 0, 1]},
)
rig = pf.Mechanism.from_legs(legs, reference_point=[0, 0, 1100], name="motion rig")

# ## What its bodies weigh
#
# The cabin has 600 kg and its centre above the platform. Every cylinder and every rod has 25 kg, in the middle between
# its joints. Points are where they are at home; moments of inertia are about them, in kg mm².
masses = [pf.Mass("platform", 600.0, (50, 0, 1700), np.array([180.0, 160.0, 120.0]) * 1e6)]
for leg in range(1, 7):
    foot, top = (np.array(rig.joint(f"{letter}{leg}").at) for letter in "AC")
    for body, share in zip(rig.joint(f"B{leg}").connects, (0.25, 0.75), strict=True):
        masses.append(pf.Mass(body, 25.0, foot + share * (top - foot), [25 * 700**2 / 12] * 3))
rig = rig.with_masses(masses)

# ## The motion
#
# Ten seconds of heave and roll at 0.4 Hz, with a little surge. All of it is one batch of targets.
times = np.linspace(0, 10, 1001)
phase = 2 * np.pi * 0.4 * times
position = np.stack([60 * np.sin(0.5 * phase), 0 * phase, 1100 + 90 * np.sin(phase)], axis=1)
roll = np.radians(9) * np.sin(phase + 0.8)
motion = pf.track(rig, pf.pose(position, rotvec=np.stack([roll, 0 * roll, 0 * roll], axis=1)), times=times)
print(motion)

# ## What the cylinders exert
#
# `inverse_dynamics` takes rates and accelerations from the times of the track. Positive pushes.
found = pf.inverse_dynamics(motion)
print(found)

# Peaks are positive: no cylinder pulls more than it pushes. The motor's rms torque decides how warm it gets, its peak
# how large it must be: those of the second table, of a screw without losses. For all six alike:
print(f"motors: peak {abs(found.sizing.motor_peak).max():.1f} N m, rms up to {found.sizing.motor_rms.max():.1f} N m")

# Over time on the left, over the rate on the right: a drive whose curve goes round each cloud will do.
found.plot().savefig("forces.png", dpi=80)

# ## What is it for?
#
# With `twists` of zero the rig stands still at each step: that is its weight. A rotor is a mass too, seen through its
# screw: here of 118 kg. At the peak of each cylinder:
still = pf.inverse_dynamics(motion, twists=np.zeros(6)).actuators
rotor = 3e-4 * gear**2 * found.accelerations / 1000
print("cylinder   weight   cabin and legs in motion   rotor")
for place, name in enumerate(rig.actuator_names):
    row = np.argmax(found.actuators[:, place])
    moving = (found.actuators - still - rotor)[row, place]
    print(f"{name:8} {still[row, place]:6.0f} N {moving:24.0f} N {rotor[row, place]:5.0f} N")

# ## What the joints carry
#
# The force in the lower joint of a leg, over the motion.
lower = np.linalg.norm(found.reactions["A1"][:, :3], axis=1)
print(f"lower joint A1: at most {lower.max():.0f} N")

# ## What is left
#
# The largest force that may come on top of all this from any direction, at the worst moment of the five seconds after
# which the motion is repeated: what each cylinder still has of its 3 kN, up and down, is its limit there.
rows = range(0, 500, 10)
spare = np.stack([-3000 - found.actuators, 3000 - found.actuators], axis=-1)
left = [pf.wrench_capacity(motion[row], spare[row]) for row in rows]
worst = np.argmin([each.radius for each in left])
direction = np.round(left[worst].weakest, 2) + 0.0
print(f"{left[worst].radius:.0f} N, at {times[rows[worst]]:.1f} s in the direction {direction}")
