"""Closed forms of inverse kinematics for the topologies that have one: the baseline, and an oracle for the engines.

Nothing here leans on what it checks: a closed form has its own preparation and its own compiled code.
"""

from __future__ import annotations

from .ik import Geometric, solve_ik

__all__ = ["Geometric", "solve_ik"]
