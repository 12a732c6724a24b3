"""A delta printer from its probe: what the data determine, and what they do not.

For a printer that prints skewed, or a dish in place of a plane. You learn which of its dimensions the printer's own
measurements determine, how sure each is, and how to write the corrected settings. At the command line all of it is
`pfabrik calibrate printer.cfg --klipper corrected.cfg`; this page needs `pip install ".[calibrate,plot]"`.
"""

# Klipper's `printer.cfg` has the nominal dimensions and, after `DELTA_CALIBRATE` and `SAVE_CONFIG`, what was measured:
# heights at which the nozzle touched, and distances on a printed part. This one is of a real printer, with its settings
# rounded. `read_klipper` makes the machine and the measurements of it.
from pathlib import Path

import numpy as np

import pfabrik as pf

data = Path(__file__).parents[1] / "data" / "printer.cfg"
printer = pf.read_klipper(data)
print(printer.mechanism)
print(printer.measurements)

# ## All nine dimensions
#
# Least squares with exact derivatives: radius, two tower angles (the third fixes the frame), endstops and arms.
found = pf.calibrate(printer.mechanism, printer.measurements, free=printer.free)
print(found.table())

# The residuals before and after, and how far each dimension moved with its standard deviation:
pf.plot_calibration(found).savefig("calibrated.png", dpi=110)

# ## Heights alone do not do it
#
# The same without the printed part. The residual is zero, and the answer would be worth nothing: seven numbers cannot
# determine nine. A small residual is no proof. The result says so, instead of rods that are wrong by centimetres.
heights = printer.measurements.without(range(7, printer.measurements.rows))
guess = pf.calibrate(printer.mechanism, heights, free=printer.free)
print(repr(guess), guess.determined.sum(), "determined")
print(guess.undetermined)

# Would more heights help? Thirty of them, simulated with a probe that repeats to 0.01 mm, determine radius, angles and
# endstops. The arms stay open: a longer arm and a larger radius touch the bed in the same places.
rng = np.random.default_rng(0)
angles, radii = rng.uniform(0, 2 * np.pi, 30), 100 * np.sqrt(rng.uniform(0, 1, 30))
touched = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(30)], axis=1)
readings = pf.solve_ik(found.mechanism, touched).actuators
probed = pf.Measurements(readings, height=rng.normal(0, 0.01, 30))
thirty = pf.calibrate(printer.mechanism, probed, free=printer.free)
for parameter in thirty.parameters:
    print(f"{parameter.name:18} {parameter.deviation:5.2f}", "" if parameter.determined else " not determined")

# ## Any other machine
#
# A mechanism file and a table do the same for every machine. The columns are the actuators, by name, and what was
# measured: `x`, `y`, `z`, `roll`, `pitch`, `yaw`, `height`, `distance` with `distance_to`, or a joint with a sensor.
# The dimensions of the file are the parameters: `pfabrik calibrate machine.toml data.csv -o calibrated.toml`.
