"""Kernels for controllers, one call at a time, in memory that is allocated before; exported as C."""
