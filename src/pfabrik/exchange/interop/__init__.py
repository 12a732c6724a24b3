"""Mechanisms from and for other programs: MuJoCo models (MJCF) and robot descriptions (URDF, SDF).

m = pf.interop.from_mjcf("robot.xml", base="body", end_effector="head").mechanism
pf.interop.to_mjcf(m, "machine.xml")         # starts closed, and stays closed
pf.interop.verify(m)                         # with MuJoCo as the referee
"""

from .assembling import Imported, assemble
from .choices import Choice, Moved, NoEndEffector
from .mjcf_qpos import qpos
from .mjcf_reading import from_mjcf
from .mjcf_writing import to_mjcf
from .notes import Note
from .opened import Loop, OpenMechanism
from .urdf_reading import from_sdf, from_urdf
from .urdf_writing import to_urdf
from .verifying import AgainstOriginal, Verification, verify
from .xml_reading import kind_of

__all__ = [
    "AgainstOriginal",
    "Choice",
    "Imported",
    "Loop",
    "Moved",
    "NoEndEffector",
    "Note",
    "OpenMechanism",
    "Verification",
    "assemble",
    "from_mjcf",
    "from_sdf",
    "from_urdf",
    "kind_of",
    "qpos",
    "to_mjcf",
    "to_urdf",
    "verify",
]
