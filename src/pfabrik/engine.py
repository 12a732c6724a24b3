"""The choice of the engine that solves a mechanism, made nowhere else."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

from .closure.closure_engine import ClosureEngine
from .decomposition.decompose import positions_express
from .decomposition.leg_table import LegTable, leg_table
from .description.mechanism import Mechanism
from .options import USUAL, Options
from .platform.legs_engine import LegsEngine
from .reaching.solve import ReachingEngine

Engine: TypeAlias = LegsEngine | ClosureEngine


@lru_cache(maxsize=64)
def engine_of(mechanism: Mechanism) -> Engine:
    """The engine that solves a mechanism.

    Closed forms if every chain is a leg that has one, otherwise joint coordinates; `leg_table` then returns the reason.
    """
    table = leg_table(mechanism)
    return LegsEngine(mechanism, table) if isinstance(table, LegTable) else ClosureEngine(mechanism)


def inverse_engine_of(mechanism: Mechanism, options: Options = USUAL) -> Engine | ReachingEngine:
    """The engine that solves for targets.

    The paper's passes and its projection work on joint positions. They are used if the options ask for them and joint
    positions express all chains and the whole task.
    """
    nearest = options.exact and options.projection == "nearest"
    return engine_of(mechanism) if nearest or not positions_express(mechanism) else _reaching(mechanism)


@lru_cache(maxsize=64)
def _reaching(mechanism: Mechanism) -> ReachingEngine:
    return ReachingEngine(mechanism, engine_of(mechanism))
