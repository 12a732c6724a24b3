"""Which engine answers: the only place that decides."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

from .closure.solve import ClosureEngine
from .decomposition.decompose import engine_of as engine_for
from .decomposition.leg_table import LegTable, leg_table
from .description.mechanism import Mechanism
from .options import USUAL, Options
from .platform.solve import LegsEngine
from .reaching.solve import ReachingEngine

Engine: TypeAlias = LegsEngine | ReachingEngine | ClosureEngine


def engine_of(mechanism: Mechanism, options: Options = USUAL) -> Engine:
    """The engine that answers for a mechanism.

    Closed forms where every chain is a leg that has them, else joint positions where these express its chains and its
    whole task, else joint coordinates: `decompose` says of each chain which of them, and why. The paper's passes and
    its projection are on joint positions, closed forms or not.
    """
    return _engine_of(mechanism, options.exact and options.projection == "nearest")


@lru_cache(maxsize=64)
def _engine_of(mechanism: Mechanism, nearest: bool) -> Engine:
    on_positions, table = engine_for(mechanism) == "reaching", leg_table(mechanism)
    if isinstance(table, LegTable) and not (on_positions and not nearest):
        return LegsEngine(mechanism, table)
    return ReachingEngine(mechanism) if on_positions else ClosureEngine(mechanism)
