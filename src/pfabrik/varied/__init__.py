"""Machines at other values of their dimensions, without making a mechanism: margins, actuators and their slopes."""

from .varied_machine import MachineAt, VariedMachine, varied

__all__ = ["MachineAt", "VariedMachine", "varied"]
