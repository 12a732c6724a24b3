"""Mechanisms from and for other programs: MuJoCo models (MJCF) and robot descriptions (URDF).

m = pf.interop.from_mjcf("robot.xml", base="body", end_effector="head").mechanism
pf.interop.to_mjcf(m, "machine.xml")         # starts closed, and stays closed
"""

from .mjcf_writing import to_mjcf

__all__ = ["to_mjcf"]
