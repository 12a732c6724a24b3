"""A table of legs as the kernels in the platform's pose take it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..decomposition.leg_table import LegTable
from ..kernels.legs import records as K
from ..kernels.platform.records import Table


@lru_cache(maxsize=64)
def kernel_table(table: LegTable) -> Table:
    """The same records, with the unknown that the coordinate of each carrier, then of each arm, is."""
    columns = np.full(len(table.legs), -1)
    carried = (table.legs["kind"] == K.ROD) & np.isin(table.legs["carrier"], (K.CRANK, K.CARRIAGE))
    own = np.concatenate([np.flatnonzero(carried), np.flatnonzero(table.legs["kind"] == K.ARM)])
    columns[own] = 6 + np.arange(len(own))
    return Table(table.legs, table.limited, table.cones, table.driven, table.task, columns)
