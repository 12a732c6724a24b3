"""The compiled code, by engine: numbers in, numbers out. Imports NumPy only, and Numba where that compiles."""

import os

IS_INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
"""Kernels run as plain Python, which needs neither a compiler nor Numba."""


class NoKernels(ImportError):
    """Nothing can run the kernels; the message says what to install."""
