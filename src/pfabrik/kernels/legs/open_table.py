"""The kernel table of a machine's legs, opened from its address."""

from __future__ import annotations

import numpy as np

from .._jit import opener
from .records import CONE, COORDINATE, LEG, TASK, Table

_RECORDS = (LEG, COORDINATE, CONE, COORDINATE, COORDINATE, TASK, np.dtype(np.int64))

SAMPLE = Table._make(np.zeros(1, record) for record in _RECORDS)
"""A table of the array types that kernels are compiled for."""

open_table = opener(SAMPLE)
"""The table at the address of a `Handle`."""
