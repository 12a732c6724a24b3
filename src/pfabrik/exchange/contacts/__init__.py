"""Machines that touch: feet on the ground, hands on an object, machines on each other."""
