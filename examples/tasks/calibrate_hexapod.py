"""A hexapod from a tracker: 42 parameters, and the poses to measure next.

For a hexapod whose joints are not where they were drawn. You learn which poses determine the centres of all joints and
the zeros of all legs, what happens without tilt, and how to find a bad measurement. This page needs
`pip install ".[calibrate]"`.
"""

# A machine that is built: every joint is half a millimetre or so off the drawing, and so are the zeros of the encoders.
# What a laser tracker would measure is simulated here. For a real machine, `pf.read_measurements("data.csv", drawing)`
# reads a table of readings and poses.
import numpy as np

import pfabrik as pf

drawing = pf.load("stewart")
everything = pf.parameters(drawing, ["points", "offsets"])
print(everything)

rng = np.random.default_rng(1)
truth = everything.values + rng.normal(0, 0.5, len(everything))
built = everything.apply(truth)


def measured(tilt, noise, n=40):
    """Readings, and the poses that a tracker saw then."""
    positions = [0, 0, 180] + rng.uniform(-1, 1, (n, 3)) * [30, 30, 20]
    solution = pf.solve_ik(built, pf.pose(positions, rotvec=rng.uniform(-tilt, tilt, (n, 3))))
    assert solution
    seen = solution.pose.copy()
    seen[:, :3, 3] += rng.normal(0, 1, (n, 3)) * noise
    seen[:, :3, :3] = pf.pose([0, 0, 0], rotvec=rng.normal(0, 1, (n, 3)) * noise / 100)[:, :3, :3] @ seen[:, :3, :3]
    return solution.actuators, seen


# ## Exact data
#
# Without noise, all 42 are found to the last digits.
readings, poses = measured(tilt=0.15, noise=0)
found = pf.calibrate(drawing, pf.Measurements(readings, pose=poses), free=everything)
print(f"rank {found.rank}, largest error below 1e-9: {np.abs(found.values - truth).max() < 1e-9}")

# ## Without tilt
#
# The same number of poses, all of one orientation. A leg then has the same length if its two ends move together, so 18
# of the 42 directions change nothing. The result names them: of two ends the one named last stays as described, and
# the other is where the leg's length says. `flat.mechanism` does what the built machine does at this orientation.
readings, poses = measured(tilt=0, noise=0)
flat = pf.calibrate(drawing, pf.Measurements(readings, pose=poses), free=everything)
print(f"rank {flat.rank}, {flat.determined.sum()} determined")
print(*flat.undetermined[:3], sep="\n")

# ## Noise, and one bad row
#
# A tracker good to 0.01 mm and 0.1 mrad, and one pose noted down wrongly.
readings, poses = measured(tilt=0.15, noise=0.01)
poses[12, 0, 3] += 0.5
sigma = {"position": 0.01, "orientation": 1e-4}
spoiled = pf.calibrate(drawing, pf.Measurements(readings, pose=poses, sigma=sigma), free=everything)
worst = spoiled.outliers[0]
print(f"{worst.quantity} {worst.row}: off by {worst.residual:.1f} standard deviations")
weights = np.ones(40)
weights[12] = 0
cleaned = pf.calibrate(drawing, pf.Measurements(readings, pose=poses, sigma=sigma), free=everything, weights=weights)
print(f"rms {spoiled.rms:.1f} with the bad row, {cleaned.rms:.1f} without, in standard deviations")
print(f"least sure: {cleaned.deviations.max():.3f} mm, most: {cleaned.deviations.min():.3f} mm")
pf.plot_calibration(cleaned).savefig("parameters.png", dpi=110)

# ## What to measure next
#
# Twenty more poses that make the worst deviation small, as actuator values. They reach farther and tilt more than the
# first forty, so they say much more.
more = cleaned.suggest(20)
added = pf.solve_fk(built, more)
joined = pf.Measurements(
    np.concatenate([readings[weights > 0], more]), pose=np.concatenate([poses[weights > 0], added.pose]), sigma=sigma
)
better = pf.calibrate(drawing, joined, free=everything)
print(f"least sure: {better.deviations.max():.3f} mm")
