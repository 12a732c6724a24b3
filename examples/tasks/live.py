"""A loop that never leaps: a machine driven from any stream of targets.

For teleoperation, motion rigs, and whatever follows a hand, a camera or a network. You learn how `Live` drives a
machine from targets that nobody checked, so that it never exceeds a limit or a speed, never leaps, and says what holds
it.
"""

# ## What happens without
#
# A stream of targets leaves the reach of a hexapod by far and comes back. Each target is answered by itself here, from
# the answer before, with the nearest feasible pose. Every one of these poses is right; what lies between two of them is
# what motors would have to do in a tick.
import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

machine = pf.load("stewart")
L = machine.characteristic_length

n, dt = 600, 0.01  # six seconds, a hundred targets a second
phase = np.arange(n) / n * 2.0 * np.pi
shift = np.stack([0.9 * np.sin(phase), 0.8 * np.sin(2 * phase + 0.4), 0.9 * np.sin(3 * phase + 1.0)], axis=1)
turn = np.stack([0.7 * np.sin(2 * phase), 0.7 * np.sin(phase + 0.7), 0.5 * np.sin(3 * phase)], axis=1)
targets = pf.pose(machine.home_pose[:3, 3] + L * shift, rotvec=turn)

alone = pf.track(machine, targets, sample_time=dt)
print(f"{(alone.status == pf.Status.REACHED).sum()} of {n} targets are in reach")
print(f"highest speed of a strut {np.abs(alone.speeds).max():.0f} mm/s, median {np.median(np.abs(alone.speeds)):.0f}")

# ## The same stream, live
#
# `Live` needs to know how fast the drives may go: here 150 mm/s, and they need a quarter of a second to get there. In
# the file of a machine these are `max_speed` and `max_acceleration` of its joints. Each tick goes to the nearest pose
# that the drives get to in time.
live = pf.Live(machine, speed=150.0, acceleration=600.0)
fastest, held = 0.0, set()
for target in targets:
    live.tick(target, dt)
    fastest = max(fastest, np.abs(live.speeds).max())
    held.update(live.holding)
print(f"highest speed {fastest:.0f} mm/s; what held it at times: {sorted(held)[0]}, and others")

# The whole stream at once, as `track` gives it, for pictures and checks:
live.reset()
driven = live.follow(targets, sample_time=dt)
kept = (np.abs(driven.accelerations) <= 600.0 * (1.0 + 1e-6)).all(axis=1)
print(f"highest speed {np.abs(driven.speeds).max():.0f} mm/s; accelerations kept in most ticks:", kept.mean() > 0.95)

# Limits and loops come first, then speeds, then accelerations: where a limit bends away faster than the drives may
# brake, `live.exceeded` tells by how much they have to all the same.
#
# Every tick is a configuration of the machine like any other, with its loops closed and its limits kept:
every = pf.configuration(machine, driven.q)
print((every.status == pf.Status.REACHED).sum(), "of", n, "closed and within limits")

figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained", figsize=(6.0, 3.6))
time = dt * np.arange(n)
above.plot(time, alone.actuators[:, 0], lw=1, label="each target alone")
above.plot(time, driven.actuators[:, 0], lw=2, label="live")
above.set_ylabel("a strut [mm]")
above.legend()
below.plot(time, np.abs(alone.speeds).max(axis=1), lw=1)
below.plot(time, np.abs(driven.speeds).max(axis=1), lw=2)
below.set(xlabel="time [s]", ylabel="fastest strut [mm/s]", yscale="log", ylim=(1.0, None))
figure.savefig("live.png", dpi=90)

# ## What a stream may do
#
# A target that is no pose, from a camera that lost its marker, lets the drives slow down, and the tick says INVALID.
# The stream may go on at any time.
lost = np.full((4, 4), np.nan)
print(live.tick(lost, dt), live.tick(targets[0], dt))

# A target that rests is reached, or the machine comes to rest as near to it as it gets:
far = pf.pose([0.0, 0.0, 500.0])
while live.tick(far, dt) is not pf.Status.REACHED and np.abs(live.speeds).max() > 1e-9:
    pass
print(f"{live.lag:.0f} mm from the target, at rest; held by {', '.join(sorted(live.holding))}")

# Where drives are measured elsewhere, tell it before the tick: `live.to(measured)`. `live.reset(start)` begins anew, at
# home or at any feasible configuration.
#
# ## A recording, from the command line
#
#     pfabrik track stewart recording.csv --live --speed 150 -o driven.csv --plot driven.png
#
# ## On a controller
#
# `pf.export_c(machine, "rig.c", parts=["ik", "limits", "live"], name="rig")`, or `pfabrik export stewart c -o rig.c
# --parts ik,limits,live --name rig`, writes the same ticks in C: `rig_live_begin` and `rig_live_tick`, in memory of
# yours. In double precision they are those of the library. A ROS 2 node (`pfabrik export stewart --ros2-node rig_node`)
# is live by default.
#
# ## By hand
#
# The page of a machine (`pfabrik export stewart --web stewart.html`, `pfabrik view stewart`) has a switch, *Live*, and
# a slider of the speed beside it: drag the platform far away, and see how the machine follows and what holds it.
#
# ## What it costs
#
# A tick takes as long as a few answers of `Solver.ik`, near or out of reach, and allocates nothing. It looks around
# itself alone: where a workspace falls into parts, or an arm has folded into a corner, another part may be nearer to
# the target; `solve_ik` finds it, and only a motion that you plan leads there. Parallel singularities are passed as the
# target leads, although drives do not hold the platform there: keep streams away from them (`pf.singularity_map`).
#
# What else holds along a motion, and what does not: [Safety](../safety.md).
