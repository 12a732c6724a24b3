"""The paper's method and the default, side by side.

For readers of the P-FABRIK paper. You learn how to ask for the method as it was published, how its answers differ
from those of the default, and on which targets.
"""

# `pf.passes.solve` answers by the method with the paper's constants: up to K = 100 passes over all chains, a tolerance
# E = 0.01 mm (what `tolerance=None` means here, in whatever unit a machine has), and a target that is moved to where
# the chains' ends agree until all of them reach it. The default, `pf.solve_ik`, solves legs in closed form where one
# exists, and finds the nearest feasible pose by optimisation where a target is out of reach. `pf.passes.trace` shows
# the passes one by one, of other machines too ([P-FABRIK](../p-fabrik.md)).
import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

print(pf.passes.Options.paper())
methods = {"paper": pf.passes.solve, "default": pf.solve_ik}
machines = {name: pf.load(name) for name in ("five_bar", "stewart")}

# ## Targets within reach
#
# Poses that are reached for certain: those of random actuator values, by forward kinematics. Both methods get the same
# ones.


def reachable(machine: pf.Mechanism, count: int) -> np.ndarray:
    """Poses of a machine within all of its limits, at random."""
    random = np.random.default_rng(1)
    home = pf.solve_ik(machine, machine.home_pose).actuators
    spread = 0.25 if "p1" in machine.actuator_names else 20.0  # [rad] for the cranks, [mm] for the struts
    poses = pf.solve_fk(machine, home + random.uniform(-spread, spread, (count, len(home))))
    return poses.pose[poses.status == pf.Status.REACHED]


for name, machine in machines.items():
    targets = reachable(machine, 200)
    for label, solve in methods.items():
        answers = solve(machine, targets)
        reached = np.mean(answers.status == pf.Status.REACHED)
        print(
            f"{name:8}  {label:7}  reached {reached:4.0%}, passes {np.mean(answers.iterations):.1f}, "
            f"farthest from its target {answers.position_error.max():.4f} mm"
        )

# Passes are those of the paper's method. The default made none: the legs of both machines have closed forms.

# ## Targets out of reach
#
# Both answers are poses that the machine can take: loops closed, limits kept. The paper's is where the chains' ends
# agree; the default's is the nearest.
away = {"five_bar": [0, 40, 300], "stewart": pf.pose([60, 20, 290], rpy=[0, 10, 0], degrees=True)}
for name, machine in machines.items():
    for label, solve in methods.items():
        each = solve(machine, away[name])
        print(f"{name:8}  {label:7}  {each.status.name}, {each.position_error:.2f} mm away")

# One target proves nothing. So take 100 of them at random, and compare distances: 1 means as near as the default.
random = np.random.default_rng(2)
for name, machine in machines.items():
    offsets = random.normal(size=(100, 3)) * ([0, 1, 1] if name == "five_bar" else 1)
    offsets *= 1.5 * machine.characteristic_length / np.linalg.norm(offsets, axis=1, keepdims=True)
    targets = machine.home_pose[:3, 3] + offsets
    by_paper, nearest = pf.passes.solve(machine, targets), pf.solve_ik(machine, targets)
    is_out = (nearest.status == pf.Status.PROJECTED) & (by_paper.status == pf.Status.PROJECTED)
    ratio = (by_paper.position_error / nearest.position_error)[is_out]
    print(f"{name}: {is_out.sum()} of {len(targets)} out of reach for both; paper's distance / nearest:")
    print(f"    median {np.median(ratio):.2f}, 95 % below {np.quantile(ratio, 0.95):.2f}")

# For the 5-bar, in its plane: grey lines lead from where the default ends to where the paper's method does.
away = [0, 40, 0] + np.column_stack([np.zeros(40), np.linspace(-200, 120, 40), np.full(40, 280)])
both = [solve(machines["five_bar"], away).pose[:, 1:3, 3].T for solve in (pf.solve_ik, pf.passes.solve)]
figure, axes = plt.subplots(figsize=(6.5, 2.8), layout="constrained")
axes.plot(away[:, 1], away[:, 2], ".", label="target")
axes.plot(*both[0], ".", label="default: nearest")
axes.plot(*both[1], ".", label="paper: centroid of the ends")
axes.plot(*np.stack(both, axis=1), color="0.7", linewidth=0.8, zorder=0)
axes.set(xlabel="y [mm]", ylabel="z [mm]", aspect="equal")
figure.legend(loc="outside lower center", ncols=3)
figure.savefig("answers.png", dpi=110)

# ## Which one to use
#
# The default, unless you want to study or compare with the paper. `Options.centroid()` combines the default's
# accuracy with the paper's projection. Times are not shown here, as they differ from computer to computer:
# `make reproduce` runs all experiments of the paper and measures them ([reproduction](../reproduction.md)).
