"""The registry: which topologies have a closed form, and the compiled code of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from pfabrik import Mechanism, SubChain, decompose

from ..arrays import Floats
from .arms import plan_arms, solve_arms
from .dyads import plan_dyads, solve_dyads
from .errors import NoClosedForm
from .facts import Unsuitable, require
from .struts import plan_struts, solve_struts
from .targets import Statuses

Kernel = Callable[[Any, Floats, Floats, bool, Floats, Statuses], int]
"""Takes plan, targets (n, 4, 4), starts (1 or n, n_a) and whether these are home; fills actuators (n, n_a) and status
(n,), and returns how many targets are no poses."""


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
    """A mechanism as its compiled code takes it.

    Attributes
    ----------
    plan, kernel : the compiled code, and what it takes.
    home : actuated coordinates at home, (1, n_a).
    """

    plan: Any
    kernel: Kernel
    home: Floats


@lru_cache(maxsize=64)
def closed_form(mechanism: Mechanism) -> ClosedForm:
    """The closed form of a mechanism; `NoClosedForm` if its topology has none, or if one does not cover it."""
    chains = decompose(mechanism)
    written = {str(chain) for chain in chains}
    topology = next((each for each in TOPOLOGIES if written == {each.chain}), None)
    try:
        if topology is None:
            raise Unsuitable("another topology")
        require(mechanism.task == mechanism.whole_task, "its task leaves out a part of the pose")
        known = {name for chain in chains for name in chain.joints}
        for drive in mechanism.drives:
            require(drive.joint.name in known, f"actuated joint {drive.joint.name} is in no sub-chain")
        plan = topology.plan(mechanism, chains)
    except Unsuitable as reason:
        raise NoClosedForm(mechanism.name, [*map(str, chains)], str(reason), [*map(str, TOPOLOGIES)]) from None
    home = np.array([[drive.home for drive in mechanism.drives]])
    return ClosedForm(plan, topology.kernel, home)
