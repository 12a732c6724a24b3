"""Closed forms leg by leg: all legs of one crank or carriage and a rod, struts and guides, with all their branches.

What the library answers is compared with them. Plain NumPy; of the library they use the description and its
decomposition, never an engine or a kernel.
"""

from __future__ import annotations

from .branches import WorkingModes, working_modes
from .facts import Unsuitable
from .ik import Answer, solve_ik

__all__ = ["Answer", "Unsuitable", "WorkingModes", "solve_ik", "working_modes"]
