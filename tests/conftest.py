"""What all tests share: the same random examples in every run, and kernels that are compiled once for all workers."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from hypothesis import settings

os.environ.setdefault("MPLBACKEND", "Agg")  # pictures open no window, whatever the user's settings
INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")

settings.register_profile(
    "fixed", derandomize=True, deadline=None, database=None, max_examples=2 if INTERPRETED else 15
)
settings.register_profile("explore", deadline=None, max_examples=500)
settings.load_profile(os.environ.get("PFABRIK_HYPOTHESIS", "fixed"))

COMPILING = """
import sys
import numba
from pfabrik.kernels import ahead

of_legs = sys.argv[1] == "legs"
for kernel, arguments in ahead.KERNELS:
    if kernel.py_func.__module__.startswith(("pfabrik.kernels.legs", "pfabrik.kernels.reaching")) == of_legs:
        kernel.compile(tuple(numba.typeof(argument) for argument in arguments))
"""
"""Compiles all kernels in two parts that share little and take about as long, for two processes."""


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile ahead where workers run in parallel: each that found no kernels would compile them for itself."""
    if INTERPRETED or not getattr(session.config.option, "numprocesses", None):
        return
    started = [subprocess.Popen([sys.executable, "-c", COMPILING, part]) for part in ("legs", "the rest")]
    for process in started:
        if process.wait():
            raise pytest.UsageError("the kernels do not compile")
