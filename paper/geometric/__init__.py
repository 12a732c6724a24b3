"""The paper's geometric approach: inverse kinematics by hand-made formulas, for three topologies.

It is the yardstick of speed and an oracle: nothing here leans on what it checks, and every topology has its own
preparation and its own compiled code.
"""

from __future__ import annotations

from .compiled import IS_COMPILED
from .errors import NoClosedForm
from .ik import Geometric, solve_ik
from .single import one_by_one

__all__ = ["IS_COMPILED", "Geometric", "NoClosedForm", "one_by_one", "solve_ik"]
