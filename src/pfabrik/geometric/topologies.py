"""The registry: which topologies have a closed form here, and what solves each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..decompose import SubChain, decompose
from ..errors import NoClosedForm
from ..mechanism import Mechanism
from .arms import plan_arms, solve_arms
from .dyads import plan_dyads, solve_dyads
from .facts import Array, Unsuitable, home_values, require
from .struts import plan_struts, solve_struts
from .targets import Statuses

Kernel = Callable[[Any, Array, Array, bool, Array, Statuses], int]


@dataclass(frozen=True)
class Topology:
    """Mechanisms with a closed form.

    Attributes
    ----------
    chain : what every one of their sub-chains is, as `decompose` prints it.
    end : what the chains end on, in words.
    plan : reads a mechanism with such chains; `Unsuitable` says what else it lacks.
    kernel : solves it.
    """

    chain: str
    end: str
    plan: Callable[[Mechanism, Sequence[SubChain]], Any]
    kernel: Kernel

    def __str__(self) -> str:
        return f"{self.chain} to {self.end}"


TOPOLOGIES = (
    Topology("R*-R-R", "a joint, all axes parallel", plan_dyads, solve_dyads),
    Topology("U-P*-S", "a body", plan_struts, solve_struts),
    Topology("R*-P*-[U-P*-S, U-P*-S]", "a body", plan_arms, solve_arms),
)


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """A mechanism as its kernel takes it; `home` are its actuated coordinates at home, (1, n_a)."""

    plan: Any
    kernel: Kernel
    home: NDArray[np.float64]


@lru_cache(maxsize=64)
def closed_form(mechanism: Mechanism) -> ClosedForm:
    """The closed form of a mechanism; `NoClosedForm` if its topology has none, or if one does not cover it."""
    chains = decompose(mechanism)
    written = [str(chain) for chain in chains]
    reason = "no such topology is known"
    for topology in TOPOLOGIES:
        if set(written) == {topology.chain}:
            try:
                _require_all_actuators(mechanism, chains)
                return ClosedForm(topology.plan(mechanism, chains), topology.kernel, home_values(mechanism))
            except Unsuitable as unsuitable:
                reason = str(unsuitable)
    raise NoClosedForm(mechanism.name, written, reason, [str(topology) for topology in TOPOLOGIES])


def _require_all_actuators(mechanism: Mechanism, chains: Sequence[SubChain]) -> None:
    known = {name for chain in chains for name in chain.joints}
    for name in mechanism.actuators:
        require(name in known, f"actuated joint {name} is in no sub-chain")
