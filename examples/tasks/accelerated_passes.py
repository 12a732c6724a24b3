"""Accelerated passes: P-FABRIK with exact steps.

For readers of the paper who ask what its passes can do at best. You learn how to call them, how many passes they need
next to the published ones, how near they come out of reach, and when they are of use.
"""

# `pf.passes.solve` answers like `pf.solve_ik`, by the method of the paper. `Options.paper()` is that method as it was
# published: FABRIK on every leg, again and again, until all ends agree within 0.01 mm. `Options.accelerated()` keeps
# the plan, with two exact steps. A leg of two parts does not approach its target: a circle and a sphere *meet* in one
# step. And where several struts hang on an arm, they do not ask for points, whose mean the arm then takes. Each asks
# for a *half-space*, anywhere nearer, and the arm takes the least step that suits all of them.
import matplotlib.pyplot as plt
import numpy as np

import pfabrik as pf

machine = pf.load("nrpm")
ways = {"paper": pf.passes.Options.paper(), "accelerated": pf.passes.Options.accelerated()}
target = pf.pose([60, 20, 210], rpy=[5, 10, 0], degrees=True)
first = {label: pf.passes.solve(machine, target, options) for label, options in ways.items()}
for label, each in {**first, "default": pf.solve_ik(machine, target)}.items():
    print(f"{label:12} {each.status.name}, passes: {each.iterations}, loops closed: {each.residual < 1e-9}")

# The default makes no passes. It has closed forms, and moves the arms by optimisation where limits ask for it.

# ## How many passes
#
# The machine has three arms with two struts each. These are 300 targets that the default reaches: each method answers
# all of them, from home.
random = np.random.default_rng(3)
box = random.uniform([-80, -80, 160], [80, 80, 260], (400, 3))
targets = pf.pose(box, rpy=random.uniform(-8, 8, (400, 3)), degrees=True)
targets = targets[pf.solve_ik(machine, targets).status == pf.Status.REACHED][:300]
passes = {}
for label, options in ways.items():
    answers = pf.passes.solve(machine, targets, options)
    reached = answers.status == pf.Status.REACHED
    passes[label] = answers.iterations
    print(f"{label:12} reached {reached.mean():.0%}, {answers.iterations.mean():.1f} passes on average")

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
most = 12
axes.hist([np.minimum(each, most) for each in passes.values()], bins=np.arange(0.5, most + 1), label=list(passes))
axes.set(xlabel=f"passes ({most}: or more)", ylabel="targets of 300", xticks=range(1, most + 1))
axes.legend()
figure.savefig("passes.png", dpi=110)

# A pass is not a unit of time. One of these does more than one of the paper's; [the page on the
# method](../p-fabrik.md) has times.

# ## Machines without arms
#
# With two parts a leg, everything is closed by the first meeting. Here are a 5-bar, a hexapod with servo cranks and one
# with struts.
for name in ("five_bar", "servo_hexapod", "stewart"):
    each = pf.load(name)
    home = pf.solve_ik(each, each.home_pose).actuators
    spread = 0.05 * each.characteristic_length if name == "stewart" else 0.15
    poses = pf.solve_fk(each, home + random.uniform(-spread, spread, (200, len(home))))
    aims = poses.pose[poses.status == pf.Status.REACHED]
    counts = [pf.passes.solve(each, aims, options).iterations.mean() for options in ways.values()]
    print(f"{name}: {counts[0]:.1f} passes with the paper's steps, {counts[1]:.1f} with exact ones")

# ## Out of reach
#
# The paper moves a target that is out of reach to the centroid of where the legs end. Here the target follows the
# half-spaces of all legs instead, and settles at the nearest pose, or close to it.
five_bar = pf.load("five_bar")
away = np.column_stack([np.zeros(60), random.uniform(-150, 150, 60), random.uniform(230, 330, 60)])
nearest = pf.solve_ik(five_bar, away)
out = nearest.status == pf.Status.PROJECTED
for label, options in ways.items():
    ratio = pf.passes.solve(five_bar, away[out], options).position_error / nearest.position_error[out]
    middle, high = np.median(ratio), np.quantile(ratio, 0.95)
    print(f"{label:12} distance / nearest distance: median {middle:.2f}, 95 % below {high:.2f}")

# ## When to use it
#
# To study passes, or to follow the arms of a machine step by step. For answers use the default: where legs have closed
# forms it is faster, and its nearest pose is the nearest. Where passes get stuck another engine answers, so whatever
# you choose, REACHED is reached and every limit is kept. The steps, their rate and their failures are on
# [P-FABRIK](../p-fabrik.md), the paper's own numbers on [the paper's method](compare_with_paper.md).
