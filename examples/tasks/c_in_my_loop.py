"""C in your own loop: the kinematics on a microcontroller.

For firmware and for control loops. You learn how to write the kinematics as one file of C, how to call it, how to
check it, and what to use in place of it when your loop is in Python.
"""

# ## One file of C
#
# `export_c` writes C99, a file and its header, that needs nothing but the C library's mathematics. It allocates no
# memory: that of its calls is a `delta_memory` of yours, one for each machine. `precision="float"` suits
# microcontrollers without double precision. Every name in the file begins with `name`.
import shutil
import subprocess
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

machine = pf.load("delta")
pf.export_c(machine, "delta.c", name="delta")

# The functions that your loop calls:
for line in Path("delta.h").read_text().splitlines():
    if line.startswith(("int delta_", "void delta_", "const char *delta_")) and line.endswith(";"):
        print(line)

# ## Call it
#
# `delta_ik_or_nearest` takes a target and the last pose, and writes the actuators. It returns 0 when the target is
# reached. Out of reach it returns `DELTA_PROJECTED` with the nearest feasible pose, and names the limits that the pose
# is at: the loop goes on, and comes back when the target does. It takes at most 40 steps here, and searches from the
# last pose alone. (`delta_ik` writes nothing where the target is not reached, and names what is in the way.)
Path("loop.c").write_text(r"""
#include "delta.h"
#include <stdio.h>

int main(void)
{
    const double heights[] = {-200, -220, -400, -230};
    delta_pose pose, target;
    double motors[DELTA_ACTUATORS];
    char holding[DELTA_LIMITS];
    static delta_memory memory;
    delta_begin(&memory);
    delta_home(&pose);
    for (int k = 0; k < 4; k++) {
        delta_pose_rpy(20, 10, heights[k], 0, 0, 0, &target);
        int code = delta_ik_or_nearest(&memory, &target, &pose, motors, 40, 0, holding);
        printf("z %4.0f: motors %.4f %.4f %.4f rad, ", heights[k], motors[0], motors[1], motors[2]);
        printf("%s\n", delta_what(code));
        for (int limit = 0; limit < DELTA_LIMITS && code == DELTA_PROJECTED; limit++)
            if (holding[limit])
                printf("        at z = %.1f, %s\n", pose.p[2], delta_what(limit + 1));
    }
    return 0;
}
""")

# Compile it with any C compiler. This program does so if there is one called `cc`.
cc = shutil.which("cc")
if cc:
    subprocess.run([cc, "-std=c99", "-O2", "loop.c", "delta.c", "-lm", "-o", "loop"], check=True)
    print(subprocess.run(["./loop"], capture_output=True, text=True, check=True).stdout)

# The library gives the same motors, out of reach too:
for height in (-200, -220, -400, -230):
    found = pf.solve_ik(machine, [20, 10, height])
    print(f"z {height}: motors", *(f"{value:.4f}" for value in found.actuators), f"rad, {found.status.name}")

# ## Check it on your target
#
# The file has a test of its own: compiled with `DELTA_SELF_TEST` it is a program that compares itself with the
# library's answers to 50 poses. Run it on the controller once.
if cc:
    subprocess.run([cc, "-std=c99", "-DDELTA_SELF_TEST", "delta.c", "-lm", "-o", "check"], check=True)
    print("exit code", subprocess.run(["./check"], capture_output=True, check=False).returncode)

# ## A loop in Python
#
# If the loop is in Python, `Solver` prepares the question once. It answers as `solve_ik` does, without a new object
# each time: its arrays are the same ones after every call, so copy what you keep.
solver = pf.Solver(machine)
angle = np.linspace(0, 2 * np.pi, 1000)
circle = np.stack([30 * np.cos(angle), 30 * np.sin(angle), np.full_like(angle, -210)], axis=1)
targets = pf.pose(circle)
motors = np.empty((len(targets), 3))
for row, target in enumerate(targets):
    if solver.ik(target) is not pf.Status.REACHED:
        raise SystemExit(f"row {row} is out of reach")
    motors[row] = solver.actuators
print(f"{len(motors)} rows, first motor from {motors[:, 0].min():.4f} to {motors[:, 0].max():.4f} rad")

# What the three motors do on this circle:
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(np.degrees(angle), np.degrees(motors), label=machine.actuator_names)
axes.set(xlabel="along the circle [deg]", ylabel="motors [deg]")
axes.legend()
figure.savefig("motors.png", dpi=110)

# Such a call takes some microseconds ([benchmarks](../benchmarks.md)). More on both: [Your
# controller](../your-controller.md), [Control loops](../control-loops.md).
