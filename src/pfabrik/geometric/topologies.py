"""The registry: which topologies have compiled code of their own, which legs any other may consist of."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..decomposition.decompose import SubChain, decompose
from ..description.mechanism import Mechanism
from ..errors import NoClosedForm
from .arms import plan_arms, solve_arms
from .drives import DRIVES
from .dyads import plan_dyads, solve_dyads
from .facts import Array, Unsuitable, home_values, require
from .modes import Legs, legs_of
from .struts import plan_struts, solve_struts
from .targets import Statuses

Kernel = Callable[[Any, Array, Array, bool, Array, Statuses], int]


@dataclass(frozen=True)
class Topology:
    """Mechanisms with compiled code of their own.

    Attributes
    ----------
    chain : what every one of their sub-chains is, as `decompose` prints it.
    end : what the chains end on, in words.
    plan : reads a mechanism with such chains; `Unsuitable` says what else it lacks.
    kernel : solves it.
    one_branch : whether the legs have branches of which the kernel tries home's alone.
    """

    chain: str
    end: str
    plan: Callable[[Mechanism, Sequence[SubChain]], Any]
    kernel: Kernel
    one_branch: bool = False

    def __str__(self) -> str:
        return f"{self.chain} to {self.end}"


TOPOLOGIES = (
    Topology("R*-R-R", "a joint, all axes parallel", plan_dyads, solve_dyads, one_branch=True),
    Topology("U-P*-S", "a body", plan_struts, solve_struts),
    Topology("R*-P*-[U-P*-S, U-P*-S]", "a body", plan_arms, solve_arms),
)
LEGS = " or ".join(f"'{drive.chain}'" for drive in DRIVES)
KNOWN = (*map(str, TOPOLOGIES), f"legs that are {LEGS}")


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """A mechanism as its compiled code takes it, as its legs, or as both.

    Attributes
    ----------
    plan, kernel : the compiled code and what it takes; None where the topology has none.
    home : actuated coordinates at home, (1, n_a).
    legs : tried where the compiled code finds nothing; None where it tries everything.
    """

    plan: Any
    kernel: Any
    home: NDArray[np.float64]
    legs: Legs | None


@lru_cache(maxsize=64)
def closed_form(mechanism: Mechanism) -> ClosedForm:
    """The closed form of a mechanism; `NoClosedForm` if its topology has none, or if one does not cover it."""
    chains = decompose(mechanism)
    written = {str(chain) for chain in chains}
    topology = next((each for each in TOPOLOGIES if written == {each.chain}), None)
    reasons: list[str] = []
    if topology is not None:
        try:
            require(mechanism.task == mechanism.whole_task, "its task leaves out a part of the pose")
            _require_all_actuators(mechanism, chains)
            plan = topology.plan(mechanism, chains)
            legs = legs_of(mechanism) if topology.one_branch else None
            return ClosedForm(plan, topology.kernel, home_values(mechanism), legs)
        except Unsuitable as unsuitable:
            reasons.append(str(unsuitable))
    try:
        return ClosedForm(None, None, home_values(mechanism), legs_of(mechanism))
    except Unsuitable as unsuitable:
        reasons.append(str(unsuitable))
    raise no_closed_form(mechanism, "; ".join(dict.fromkeys(reasons)))


def no_closed_form(mechanism: Mechanism, reason: str) -> NoClosedForm:
    """What to raise of a mechanism that lacks something."""
    return NoClosedForm(mechanism.name, [str(chain) for chain in decompose(mechanism)], reason, KNOWN)


def _require_all_actuators(mechanism: Mechanism, chains: Sequence[SubChain]) -> None:
    known = {name for chain in chains for name in chain.joints}
    for name in mechanism.actuator_names:
        require(name in known, f"actuated joint {name} is in no sub-chain")
