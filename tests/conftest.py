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

COMPILING = (
    # positions: reached, and beyond reach
    "import pfabrik as pf; m = pf.load('stewart'); pf.solve_ik(m, [[0, 0, 195], [0, 0, 900]])",
    # all joints, and closed forms
    "import pfabrik as pf; pf.warm_up(pf.load('delta'))\n"
    "for m in map(pf.load, ('stewart', 'five_bar', 'nrpm')): pf.geometric.solve_ik(m, m.home_pose)",
)
"""Questions that need all kernels, in two parts that share none, for two processes."""


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile ahead where workers run in parallel: each that found no kernels would compile them for itself."""
    if INTERPRETED or not getattr(session.config.option, "numprocesses", None):
        return
    started = [subprocess.Popen([sys.executable, "-c", questions]) for questions in COMPILING]
    for process in started:
        if process.wait():
            raise pytest.UsageError(f"the kernels do not compile: {process.args[-1]}")
