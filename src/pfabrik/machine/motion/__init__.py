"""Poses of bodies and their first-order motion, in plain NumPy: an independent check of the kernels."""
