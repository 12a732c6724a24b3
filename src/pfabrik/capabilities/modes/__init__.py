"""Searches for all assembly modes of actuator values and all working modes of a target."""
