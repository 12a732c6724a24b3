"""The compiled code, by engine: numbers in, numbers out. Imports NumPy only."""

from ._shipped import LIBRARY
from ._shipped import NoKernels as NoKernels

IS_INTERPRETED = LIBRARY is None
"""Kernels run as plain Python, which needs no compiler: the same answers, far slower."""
