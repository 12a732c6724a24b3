"""C in your own loop: the kinematics on a microcontroller.

For firmware and for control loops. You learn how to write the kinematics as one file of C, how to call it, how to
check it, and what to use in place of it when your loop is in Python.
"""

# ## One file of C
#
# `export_c` writes C99 that needs nothing but the C library's mathematics. It allocates no memory and keeps nothing
# between calls. `precision="float"` suits microcontrollers without double precision. Every name in the file begins with
# `name`.
import shutil
import subprocess
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

machine = pf.load("delta")
pf.export_c(machine, "delta.c", name="delta")

# The functions that your loop calls:
for line in Path("delta.c").read_text().splitlines():
    if line.startswith(("int delta_", "void delta_", "const char *delta_")) and line.endswith(";"):
        print(line)

# ## Call it
#
# `delta_ik` takes a target and the last pose, and writes the actuators. It returns 0 when the target is reached. Any
# other code names the limit or the leg that is in the way; then nothing has been written, and the loop stays where it
# is.
Path("loop.c").write_text(r"""
#define DELTA_DECLARATIONS_ONLY
#include "delta.c"
#include <stdio.h>

int main(void)
{
    const double heights[] = {-200, -210, -220, -400};
    delta_pose pose, target;
    double motors[DELTA_ACTUATORS];
    delta_home(&pose);
    for (int k = 0; k < 4; k++) {
        delta_pose_rpy(20, 10, heights[k], 0, 0, 0, &target);
        int code = delta_ik(&target, &pose, motors);
        if (code == 0)
            printf("z %4.0f: %.5f %.5f %.5f rad\n", heights[k], motors[0], motors[1], motors[2]);
        else
            printf("z %4.0f: %s\n", heights[k], delta_what(code));
    }
    return 0;
}
""")

# Compile it with any C compiler. This program does so if there is one called `cc`.
cc = shutil.which("cc")
if cc:
    subprocess.run([cc, "-std=c99", "-O2", "loop.c", "delta.c", "-lm", "-o", "loop"], check=True)
    print(subprocess.run(["./loop"], capture_output=True, text=True, check=True).stdout)

# The library gives the same motors:
for height in (-200, -210, -220):
    print(f"z {height}:", *(f"{value:.5f}" for value in pf.solve_ik(machine, [20, 10, height]).actuators), "rad")

# For the last target the two differ in kind. C says what is in the way; `solve_ik` also finds the nearest pose that can
# be reached, which takes a search.
far = pf.solve_ik(machine, [20, 10, -400])
print(f"{far.status.name}, {far.position_error:.2f} mm away, at z = {far.pose[2, 3]:.1f} mm")

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
