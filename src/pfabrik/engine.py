"""Which engine answers: the only place that decides."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

from .closure.solve import ClosureEngine
from .decomposition.decompose import engine_of as engine_for
from .decomposition.leg_table import LegTable, leg_table, legs_answer
from .description.mechanism import Mechanism
from .platform.solve import LegsEngine
from .reaching.solve import ReachingEngine

Engine: TypeAlias = LegsEngine | ReachingEngine | ClosureEngine


@lru_cache(maxsize=64)
def engine_of(mechanism: Mechanism) -> Engine:
    """The engine that answers for a mechanism.

    Joint positions where these express its chains and its whole task, else joint coordinates: `decompose` says of each
    chain which of them, and why. In front of the latter, closed forms where every chain is a leg that has them.
    """
    inner = ReachingEngine(mechanism) if engine_for(mechanism) == "reaching" else ClosureEngine(mechanism)
    table = leg_table(mechanism)
    return LegsEngine(table, inner) if isinstance(table, LegTable) and legs_answer(mechanism) else inner
