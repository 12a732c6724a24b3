"""A delta printer from its probe: what the data determine, and what they do not.

For a printer that prints skewed, or a dish in place of a plane. You learn which of its dimensions the printer's own
measurements determine, how sure each is, and how to write the corrected settings. At the command line all of it is
`pfabrik calibrate printer.cfg --klipper corrected.cfg`; this page needs `pip install ".[calibrate,plot]"`.
"""

# Klipper's `printer.cfg` has the nominal dimensions and, after `DELTA_CALIBRATE` and `SAVE_CONFIG`, what was measured:
# seven heights at which the nozzle touched, and twelve distances on a printed part. These are of a real printer
# (github.com/phnxdrgn536/FLSun-v400, CC0-1.0), with its settings rounded, as before a calibration.
from pathlib import Path

import numpy as np

import pfabrik as pf

Path("printer.cfg").write_text("""\
[printer]
kinematics: delta
delta_radius: 163

[stepper_a]
angle: 210
arm_length: 346
position_endstop: 418
rotation_distance: 40
microsteps: 16

[stepper_b]
angle: 330
arm_length: 346
position_endstop: 418

[stepper_c]
angle: 90
arm_length: 346
position_endstop: 418

#*# <---------------------- SAVE_CONFIG ---------------------->
#*#
#*# [delta_calibrate]
#*# height0 = 16.0
#*# height0_pos = 32216.333,32157.333,32243.333
#*# height1 = 16.0
#*# height1_pos = 38608.000,38504.000,29057.000
#*# height2 = 16.0
#*# height2_pos = 31704.000,42083.000,31723.000
#*# height3 = 16.0
#*# height3_pos = 29125.333,37412.000,37509.333
#*# height4 = 16.0
#*# height4_pos = 31414.333,31361.333,38914.667
#*# height5 = 16.0
#*# height5_pos = 36540.333,29230.333,36555.333
#*# height6 = 16.0
#*# height6_pos = 40448.667,31482.667,31561.667
#*# distance0 = 64.97
#*# distance0_pos1 = 33313.562,33544.532,33622.698
#*# distance0_pos2 = 31268.931,35653.617,35735.432
#*# distance1 = 65.07
#*# distance1_pos1 = 33408.574,33352.998,33719.015
#*# distance1_pos2 = 32656.984,32610.356,37425.475
#*# distance2 = 65.01
#*# distance2_pos1 = 33601.028,33258.043,33622.698
#*# distance2_pos2 = 35715.020,31222.322,35735.432
#*# distance3 = 65.02
#*# distance3_pos1 = 33698.488,33353.507,33431.198
#*# distance3_pos2 = 37427.250,32617.998,32692.256
#*# distance4 = 65.06
#*# distance4_pos1 = 33602.338,33545.045,33336.007
#*# distance4_pos2 = 35737.202,35662.306,31300.632
#*# distance5 = 65.04
#*# distance5_pos1 = 33409.874,33641.124,33431.198
#*# distance5_pos2 = 32676.467,37348.421,32692.256
#*# distance6 = 65.03
#*# distance6_pos1 = 31427.388,35216.031,35609.426
#*# distance6_pos2 = 32806.187,32481.296,37266.571
#*# distance7 = 65.04
#*# distance7_pos1 = 32825.510,32499.947,36952.368
#*# distance7_pos2 = 35779.327,31275.257,35484.199
#*# distance8 = 65.1
#*# distance8_pos1 = 35589.744,31380.972,35297.584
#*# distance8_pos2 = 37267.996,32766.610,32562.952
#*# distance9 = 65.07
#*# distance9_pos1 = 36951.613,32784.975,32581.356
#*# distance9_pos2 = 35484.337,35725.286,31353.324
#*# distance10 = 65.09
#*# distance10_pos1 = 35295.829,35535.688,31459.022
#*# distance10_pos2 = 32545.884,37189.172,32840.818
#*# distance11 = 65.12
#*# distance11_pos1 = 32563.751,36874.893,32859.426
#*# distance11_pos2 = 31321.245,35402.376,35798.667
""")

# `read_printer` makes the machine and the measurements of it; of another firmware's file, the machine alone.
printer = pf.read_printer("printer.cfg")
print(printer.mechanism)
print(printer.measurements)

# ## All nine dimensions
#
# Least squares with exact derivatives: radius, two tower angles (the third fixes the frame), endstops and arms.
found = printer.calibrate()
print(found.table())

# The residuals before and after, and how far each dimension moved with its standard deviation:
pf.plot_calibration(found).savefig("calibrated.png", dpi=110)

# ## Heights alone do not do it
#
# The same without the printed part. Values that explain seven heights exactly would be worth nothing: seven numbers
# cannot determine nine. So all nine stay as described, instead of rods that are wrong by centimetres.
heights = printer.measurements.without(range(7, printer.measurements.rows))
guess = pf.calibrate(printer.mechanism, heights, free=printer.free)
print(repr(guess), guess.determined.sum(), "determined")
print(guess.undetermined)

# Would more heights help? Thirty of them, simulated with a probe that repeats to 0.01 mm, determine radius, angles and
# endstops. The arms stay open: a longer arm and a larger radius touch the bed in the same places. `printer.calibrate`
# knows, and keeps them as described. Deviations of the others reckon with arms that may be off by 3 in 1000.
rng = np.random.default_rng(0)
angles, radii = rng.uniform(0, 2 * np.pi, 30), 100 * np.sqrt(rng.uniform(0, 1, 30))
touched = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(30)], axis=1)
readings = pf.solve_ik(found.mechanism, touched).actuators
probed = pf.Measurements(readings, height=rng.normal(0, 0.01, 30))
thirty = printer.calibrate(probed)
for parameter in thirty.parameters:
    print(f"{parameter.name:18} {parameter.deviation:5.2f}", "" if parameter.determined else " not determined")

# `printer.corrected` is the machine of the corrected settings; `pfabrik export` and `--klipper` write them.
print(printer.corrected(thirty).dimensions["arm_length_a"])

# ## Other firmwares
#
# `pfabrik calibrate config.g data.csv --reprap corrected.g` does the same with a table, and so do `printer.cfg` and
# `Configuration.h`. A row has the carriages' heights (`carriage_a`) as the firmware counts them with the settings of
# the file, and what was measured there: `height`, or `x`, `y`, `z`. A comment at the top of what is written names the
# parameters that stay as described.
#
# Without carriages, `x`, `y` and `height` are what was commanded and the true height there. A log with lines such as
# "probe at 30,40 is z=0.12" (`pfabrik calibrate printer.cfg klippy.log`) and RepRapFirmware's `heightmap.csv` do as
# well: carriages are then where the settings of the file have them. Several files count together, as
# `Measurements + Measurements` in Python. `pfabrik calibrate config.g --list` lists what may be freed.
#
# An endstop is given as Klipper gives it, for the nozzle in the middle: `position_endstop_a` also changes with the
# radius. `--free NAME` frees what you name, and nothing else; then deviations take all the rest to be exact.

# ## Any other machine
#
# A mechanism file and a table do the same for every machine. The columns are the actuators, by name, and what was
# measured: `x`, `y`, `z`, `roll`, `pitch`, `yaw`, `height`, `distance` with `distance_to`, or a joint with a sensor.
# The dimensions of the file are the parameters: `pfabrik calibrate machine.toml data.csv -o calibrated.toml`.
