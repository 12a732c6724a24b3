"""Room for answers."""

from __future__ import annotations

import numpy as np

from ..decomposition.plan import Flat
from ..description.mechanism import Mechanism
from ..kernels.reaching import plan as P


def new_rows(mechanism: Mechanism, flat: Flat | None, n: int) -> P.Rows:
    """Room for n answers; without `flat` (a mechanism for the closure engine) positions have none."""
    nodes, trunks = (0, 0) if flat is None else (flat.home_seed.nodes.shape[1], flat.home_seed.trunks.shape[1])
    return P.Rows(
        status=np.empty(n, np.int64),
        counters=np.zeros((n, 3), np.int64),
        poses=np.empty((n, 4, 4)),
        nodes=np.zeros((n, nodes, 3)),
        trunks=np.zeros((n, trunks)),
        actuators=np.empty((n, len(mechanism.actuators))),
        measures=np.zeros((n, 5)),
    )
