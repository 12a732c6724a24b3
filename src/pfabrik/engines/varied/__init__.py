"""Machines at other values of their dimensions, without making a mechanism: margins, actuators and their slopes."""

from .leg_slopes import LegSlopes, leg_slopes
from .noted_reading import VariedGeometry
from .varied_machine import MachineAt, VariedMachine, varied

__all__ = ["LegSlopes", "MachineAt", "VariedGeometry", "VariedMachine", "leg_slopes", "varied"]
