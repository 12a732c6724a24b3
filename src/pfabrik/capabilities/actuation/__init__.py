"""Actuator space: the joints that a serial model has, and the motors of a parallel mechanism that move them."""
