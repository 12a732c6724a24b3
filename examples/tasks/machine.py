"""Your machine: from a drawing to a first answer.

For a machine that is in no catalogue. You learn how to write it down with named dimensions, how to find slips in the
file, and how to try another size. All you need is a text editor and the positions of the joints.
"""

# Our example is a small press: a platform on six struts whose length is driven. Three numbers of the drawing place the
# joints, two more describe the struts. The height follows from them, so the file has an expression in its place.
#
# A `[[leg]]` table describes legs of one kind. `U-P*-S` reads from the base to the platform: a universal joint, a
# driven (`*`) prismatic joint, a spherical joint. Two legs are written here, `copies` makes three pairs.
from pathlib import Path

import pfabrik as pf

Path("press.toml").write_text("""
schema = 1
name = "Hexapod press"
units = { length = "mm", angle = "deg" }
base = "base"
end_effector = "platform"
reference_point = [0, 0, "height"]

[dimensions]
base_radius = 120
platform_radius = 60
half_gap = 12
strut = 210
stroke = 60
height = "sqrt(strut**2 - (base_radius - platform_radius)**2)"

[[leg]]
chain = "U-P*-S"
base = [["base_radius", "half_gap", 0], ["base_radius", "-half_gap", 0]]
platform = [["platform_radius", "half_gap", "height"], ["platform_radius", "-half_gap", "height"]]
stroke = ["strut - stroke / 2", "strut + stroke / 2"]
copies = { count = 3, axis = [0, 0, 1] }
A.cone = { axis = "vertical", half_angle = 40 }
""")
machine = pf.load("press.toml")
print(machine)

# ## Is it the machine you mean?
#
# Draw it. The picture shows the home configuration: the one that the file describes.
pf.plot(machine, names=True).figure.savefig("press.png", dpi=110)

# Then count. `platform` is the number of independent motions of the platform, `uncontrolled` how many of them are left
# when all actuators are locked. Six and none is what a hexapod should have.
count = pf.mobility(machine)
print(f"{count.platform} motions of the platform, {count.actuators} actuators, {count.uncontrolled} uncontrolled")

# ## A first answer
#
# A target is a pose of the platform: where its reference point is, and how it is turned. `REACHED` means that every
# loop closes and every limit is kept.
answer = pf.solve_ik(machine, pf.pose([5, 0, 205], rpy=[0, 4, 0], degrees=True))
print(answer.status.name)
for name, length in zip(machine.actuator_names, answer.actuators, strict=True):
    print(f"{name}  {length:.2f} mm")

# ## Another size
#
# `with_dimensions` gives the machine with other values. What follows from a dimension follows here too: the height of
# home and the stroke.
longer = machine.with_dimensions(strut=240)
print(f"home is at {machine.reference_point[2]:.1f} mm, with longer struts at {longer.reference_point[2]:.1f} mm")

# Does the longer machine have more travel? Ask both how far they can go up and down from home. They hardly differ: the
# stroke is the same.
for each in (machine, longer):
    up, down = pf.travel(pf.solve_ik(each, each.home_pose), along=[(0, 0, 1), (0, 0, -1)])
    print(f"up {up.distance:.1f} mm, down {down.distance:.1f} mm")

# To keep it, save it. The file that is written has your dimensions and expressions.
pf.save(longer, "longer.toml")
print(pf.load("longer.toml").dimensions["strut"])

# ## Slips
#
# A file with faults is refused. Each fault says where it is, what was found and what was expected.
slips = {'"-half_gap", 0]': '"-half_gab", 0]', "strut - stroke": "strut - strok"}
text = Path("press.toml").read_text()
for right, wrong in slips.items():
    text = text.replace(right, wrong)
Path("slip.toml").write_text(text)
try:
    pf.load("slip.toml")
except pf.errors.InvalidMechanism as error:
    for fault in error.faults:
        print(fault)

# At the command line, `pfabrik check press.toml` does the same, and `pfabrik info press.toml` lists all joints. All
# keys of the file are on [Describing a mechanism](../describing-a-mechanism.md). `pfabrik new --list` names files to
# start from, with dimensions at their top.
