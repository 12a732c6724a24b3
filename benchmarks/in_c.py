"""The closed forms of `closed_forms` in plain C, compiled for this processor: the least that a row may cost."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from closed_forms import Array, FiveBar, Struts

COMPILER = next((found for name in ("cc", "gcc", "clang") if (found := shutil.which(name))), None)
IS_THERE = COMPILER is not None and os.name != "nt"
FLAGS = ("-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-std=c99", "-shared", "-fPIC")


class InC:
    """A machine's closed form, row by row."""

    def __init__(self, form: Struts | FiveBar) -> None:
        assert COMPILER is not None
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / "leg_table.so"
            source = Path(__file__).with_name("leg_table.c")
            subprocess.run([COMPILER, *FLAGS, str(source), "-o", str(library), "-lm"], check=True)
            loaded = ctypes.CDLL(str(library))
        if isinstance(form, Struts):
            columns = (form.feet, form.tops, form.low, form.high, form.foot_axes, form.foot_cosines)
            self._table = np.column_stack([*columns, form.head_axes, form.head_cosines])
            self._answer = loaded.struts
        else:
            fields = ("plane", "shoulder", "links", "homes", "senses", "ranges")
            self._table = np.array([np.concatenate([np.ravel(getattr(leg, f)) for f in fields]) for leg in form.cranks])
            self._answer = loaded.cranks

    def solve(self, targets: Array) -> tuple[Array, int]:
        """Actuators (n, n_a) at targets (n, 4, 4), and how many of these are beyond a limit."""
        legs, actuators = len(self._table), np.empty((len(targets), len(self._table)))
        given, table, found = (a.ctypes.data_as(ctypes.c_void_p) for a in (targets, self._table, actuators))
        return actuators, self._answer(ctypes.c_long(len(targets)), given, legs, table, found)
