"""Closed forms of inverse kinematics for the legs and topologies that have one: the baseline, an oracle, all branches.

Nothing here leans on what it checks: a closed form has its own preparation and its own compiled code.
"""

from __future__ import annotations

from .branches import WorkingModes, working_modes
from .ik import Geometric, solve_ik

__all__ = ["Geometric", "WorkingModes", "solve_ik", "working_modes"]
