"""Which engine answers: the only place that decides."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

from .closure.solve import ClosureEngine
from .decomposition.decompose import engine_of as engine_for
from .description.mechanism import Mechanism
from .reaching.solve import ReachingEngine

Engine: TypeAlias = ReachingEngine | ClosureEngine


@lru_cache(maxsize=64)
def engine_of(mechanism: Mechanism) -> Engine:
    """The engine that answers for a mechanism: joint positions where these express its chains and its whole task.

    `decompose` says of each chain which engine that is, and why.
    """
    return ReachingEngine(mechanism) if engine_for(mechanism) == "reaching" else ClosureEngine(mechanism)
