"""Searches for every configuration: all assembly modes of actuator values, all working modes of a target."""
