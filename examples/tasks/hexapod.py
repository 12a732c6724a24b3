"""A hexapod: its pivot, its travel, its workspace.

For a Stewart platform with six struts whose length is driven. You learn where the tool may turn, how far it may go, and
what stops it.
"""

# Describe the machine by one pair of legs; it stands for three. `base` and `platform` are the centres of the joints at
# home, `stroke` is the shortest and the longest strut between them; the joints tilt as far as their data sheet says.
import numpy as np

import pfabrik as pf

machine = pf.Mechanism.from_legs(
    "U-P*-S",
    base=[[100, 20, 0], [100, -20, 0]],
    platform=[[40, 40, 195], [40, -40, 195]],
    stroke=(155, 280),
    A={"cone": {"axis": "vertical", "half_angle": np.radians(50)}},
    C={"cone": {"half_angle": np.radians(45)}},
    copies={"count": 3, "axis": [0, 0, 1]},
    reference_point=[0, 0, 195],
    name="hexapod",
)
print(machine)

# ## Struts for a pose
#
# A target is a pose of the platform. The answer says whether it is reached, and how long the struts are.
answer = pf.solve_ik(machine, pf.pose([10, 0, 205], rpy=[0, 5, 0], degrees=True))
print(answer.status.name, answer.actuators.round(2))

# ## Another pivot
#
# The platform turns about its reference point. To turn about the tip of a tool 60 mm above the platform, put the
# reference point there. It is a part of the description, and everything else stays.
with_tool = pf.Mechanism(
    "hexapod with tool", machine.joints, "platform", reference_point=machine.reference_point + np.array([0, 0, 60])
)
print(pf.solve_ik(with_tool, pf.pose(with_tool.reference_point, rpy=[0, 5, 0], degrees=True)).actuators.round(2))

# ## Travel
#
# From a pose, how far along and about each axis, and which limit stops it:
travel = pf.travel(answer)
print(travel)

# ## Workspace
#
# All positions with this orientation, as a solid with a volume. The colours of its faces are the limits. Cells of 3 mm
# at its border are fine enough for a picture; without `resolution` they are smaller, and it takes longer.
space = pf.workspace(machine, resolution=3)
print(space)
space.plot().figure.savefig("workspace.png", dpi=110)
