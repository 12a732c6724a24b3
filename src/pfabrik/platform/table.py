"""A table of legs as the kernels in the platform's pose take it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..decomposition.leg_table import LegTable
from ..kernels.legs import records as K
from ..kernels.platform.records import Table


@lru_cache(maxsize=64)
def kernel_table(table: LegTable) -> Table:
    """The same records, with the unknown that each carrier's coordinate is."""
    columns = np.full(len(table.legs), -1)
    n = main = 0
    for k, leg in enumerate(table.legs):
        main = main if leg["carrier"] == K.SHARED else k
        if leg["kind"] == K.ROD and leg["carrier"] in (K.CRANK, K.CARRIAGE):
            columns[k] = 6 + n
            n += 1
        columns[k] = columns[main] if leg["kind"] == K.ROD else -1
    return Table(table.legs, table.limited, table.cones, table.driven, table.task, columns)
