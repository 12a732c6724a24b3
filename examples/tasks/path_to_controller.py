"""A path to the controller: from G-code to a row of motor positions every millisecond.

For a machine that is to follow a tool path. You learn how to read the path, how to see whether all of it can be
reached, how fast it may be driven, and how to write a file that a controller plays.
"""

# The machine is a linear delta of the catalogue. Its file has no speeds of motors, so they are given below; your own
# file can have them, as `max_speed` and `max_acceleration` of each actuated joint.
from pathlib import Path

import numpy as np

import pfabrik as pf

machine = pf.load("linear_delta")
Path("slot.gcode").write_text("""
G21 G90
G0 X-20 Y0 Z2
G1 X20 F6000
G3 X20 Y20 I0 J10
G1 X-20
G3 X-20 Y0 I0 J-10
""")

# ## Read the path
#
# `read_path` reads G-code, or a CSV file with a header such as `x,y,z`. Arcs become short steps. Words that it does not
# know are refused with their line, never skipped.
path = pf.read_path("slot.gcode", machine)
print(len(path.targets), "targets")

# ## Can all of it be reached?
#
# `track` solves each target from the answer before it. Check three things: that all targets are reached, that no answer
# jumps away from the one before, and which limit comes nearest.
track = pf.track(machine, path.targets)
print("all reached:", bool(track), " jumps:", int(track.jumps.sum()))
margins = pf.margins(track)
(joint, bound), least = min(margins.items(), key=lambda item: np.min(item[1]))
print(f"nearest limit: {joint} {bound}, {np.min(least):.0%} left")

# A path that leaves the workspace is no error: every answer is a pose that the machine can take, and tells what stops
# it. Whether to go on is your decision.
far = pf.track(machine, np.linspace([0, 0, 0], [200, 40, 0], 41))
first = int(np.argmax(far.status != pf.Status.REACHED))
print(f"row {first} of {len(far)}:", far[first].status.name, "-", far[first].reason)

# ## How fast?
#
# `time_path` finds the fastest way along the track that keeps speed and acceleration of every motor, here 300 mm/s and
# 3000 mm/s². `platform_speed` is the highest speed of the nozzle; feeds of the file are not looked at. The machine
# starts and ends at rest; `rate` is the number of rows per second.
timed = pf.time_path(track, speed=300, acceleration=3000, platform_speed=200, rate=1000)
print(f"{timed.duration:.3f} s, {len(timed.times)} rows")
print(f"fastest carriage {np.abs(timed.rates).max():.1f} mm/s, {np.abs(timed.accelerations).max():.0f} mm/s²")

# What holds it back, as a share of the time:
for (name, what), share in sorted(timed.held_back.items(), key=lambda item: -item[1]):
    print(f"{name} {what}: {share:.0%}")

timed.plot().savefig("timed.png", dpi=110)

# ## Write it
#
# A row for every millisecond: time, pose, and position, speed and acceleration of each motor.
timed.to_csv("timed.csv")
rows = Path("timed.csv").read_text().splitlines()
print(rows[0])

# Does the file say what the machine would do? Read the positions of one row back, and ask where the nozzle is.
columns = rows[0].split(",")
row = dict(zip(columns, rows[500].split(","), strict=True))
back = pf.solve_fk(machine, [float(row[f"actuator_{name}"]) for name in machine.actuator_names])
print("in the file:", *(f"{float(row[name]):.4f}" for name in "xyz"))
print("by forward kinematics:", *(f"{value:.4f}" for value in back.pose[:3, 3]))

# The same at the command line: `pfabrik track linear_delta slot.gcode -o answers.csv` and `pfabrik time linear_delta
# slot.gcode --speed 300 --acceleration 3000 -o timed.csv`. To compute positions on the controller itself, see [C in
# your own loop](c_in_my_loop.md).
