"""What all tests share: the same random examples in every run, and kernels that are compiled once for all workers."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Iterator

import pytest
from hypothesis import settings

os.environ.setdefault("MPLBACKEND", "Agg")  # pictures open no window, whatever the user's settings
os.environ.pop("COLUMNS", None)  # workers have that of a terminal, which output would be fitted to
INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")

settings.register_profile("fixed", derandomize=True, deadline=None, database=None, max_examples=2 if INTERPRETED else 8)
settings.register_profile("explore", deadline=None, max_examples=500)
settings.load_profile(os.environ.get("PFABRIK_HYPOTHESIS", "fixed"))

COMPILING = """
import sys
from pfabrik.kernels import ahead
from pfabrik.kernels._numba.decorators import compile_for

of_legs = sys.argv[1] == "legs"
for kernel, arguments in ahead.KERNELS:
    if kernel.py_func.__module__.startswith(("pfabrik.kernels.legs", "pfabrik.kernels.platform")) == of_legs:
        compile_for(kernel, arguments)
"""
"""Compiles all kernels in two parts that share little and take about as long, for two processes."""


def pytest_sessionstart(session: pytest.Session) -> None:
    """Where Numba compiles and workers run in parallel, compile ahead: each would compile everything for itself."""
    if INTERPRETED or not getattr(session.config.option, "numprocesses", None):
        return
    from pfabrik.kernels._shipped import COMPILES

    started = [subprocess.Popen([sys.executable, "-c", COMPILING, part]) for part in ("legs", "the rest") if COMPILES]
    for process in started:
        if process.wait():
            raise pytest.UsageError("the kernels do not compile")


def pytest_collection_finish() -> None:
    """Thousands of tests stay to the end: the garbage collector need not look through them again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def figures_are_closed() -> Iterator[None]:
    """No figure stays open behind a test: pyplot warns of the twenty-first."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
