"""Jacobians and singularities of configurations of closed loops, compiled."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats, Mask
from ..description.mechanism import Mechanism
from ..kernels.closure.loops import FirstOrder, FirstOrderPlan
from ..kernels.handle import Scratch
from ..kernels.threads import in_blocks
from ..motion.displacements import rate_units
from ..motion.joint_rates import actuated_columns, graph_of
from ..motion.mobility import generic_of
from ..motion.singularities import KINDS, Singularity, measures, singularity_of
from ..tolerances import TOLERANCES
from .close import closure_of

if TYPE_CHECKING:
    from ..kernels.closure.first_order import Tables

ROWS_A_BLOCK = 64


def forward_map(mechanism: Mechanism, q: Floats) -> Floats:
    """Twists per actuator rate at coordinates q, (n, c): (n, 6, n_a) or (n, 3, n_a); NaN where q is."""
    twists, actuators = units_of(mechanism)
    return np.asarray(twists[:, None] * _first_order(mechanism, q, whole=False).forward / actuators)


def inverse_map(mechanism: Mechanism, q: Floats) -> Floats:
    """Actuator rates per twist at coordinates q, (n, c): (n, n_a, 6) or (n, n_a, 3); NaN where q is."""
    twists, actuators = units_of(mechanism)
    return np.asarray(actuators[:, None] * _first_order(mechanism, q, whole=False).inverse / twists)


def singularities(mechanism: Mechanism, q: Floats) -> Singularity:
    """How near coordinates q, (n, c), are to singularities: arrays (n,) and (n, 6) or (n, 3), and n tuples.

    In a singularity, or next to one, what is lost and gained takes all singular vectors: NumPy finds them there.
    """
    found = _first_order(mechanism, q, whole=True)
    near = np.flatnonzero(found.measures.min(axis=1) < TOLERANCES.singular)
    if len(near):
        exactly = measures(mechanism, q[near])
        found.measures[near] = np.stack([getattr(exactly, kind) for kind in KINDS], axis=1)
        found.lost[near], found.gained[near] = exactly.lost, exactly.gained
    return singularity_of(found.measures, found.lost, found.gained)


def are_stretched(mechanism: Mechanism, q: Floats) -> Mask:
    """Whether links are stretched out or folded at coordinates q (n, c), so that they may bend either way, (n,)."""
    found = singularities(mechanism, q)
    return np.asarray(np.minimum(found.serial, found.passive) < TOLERANCES.stretched)


def _first_order(mechanism: Mechanism, q: Floats, *, whole: bool) -> FirstOrder:
    """What the kernel tells of coordinates q, (n, c), lengths in L; `whole`: the constraint measure too."""
    from ..kernels.closure.first_order import first_order

    closure, plan = closure_of(mechanism), _plan(mechanism, whole)
    n, coordinates = len(q), q * closure.scale
    twists, actuators = plan.twists, len(plan.actuated)
    found = FirstOrder(
        np.empty((n, twists, actuators)),
        np.empty((n, actuators, twists)),
        np.empty((n, 4)),
        np.empty((n, twists)),
        np.empty((n, twists)),
    )
    scratch = _scratch(mechanism, whole)

    def run(block: slice) -> None:
        own = FirstOrder._make(each[block] for each in found)
        first_order(closure.machine.address, scratch.address, plan, coordinates[block], own)

    in_blocks(run, n, ROWS_A_BLOCK)
    return found


@lru_cache(maxsize=128)
def _scratch(mechanism: Mechanism, whole: bool) -> Scratch[Tables]:
    from ..kernels.closure.first_order import new_tables

    return Scratch(new_tables, closure_of(mechanism).loops, _plan(mechanism, whole))


@lru_cache(maxsize=128)
def _plan(mechanism: Mechanism, whole: bool) -> FirstOrderPlan:
    graph, generic = graph_of(mechanism), generic_of(mechanism)
    counts = generic.mobility
    return FirstOrderPlan(
        loops=np.ascontiguousarray(graph.orthonormal),
        way=np.array(graph.path, float),
        rates=np.array(graph.rates),
        actuated=np.array(actuated_columns(mechanism), np.int64),
        rank=generic.rank,
        shown=counts.platform + counts.internal,
        freedoms=counts.platform,
        twists=3 if mechanism.end_effector_is_joint else 6,
        least=TOLERANCES.rank,
        asks_constraint=int(whole),
    )


@lru_cache(maxsize=64)
def units_of(mechanism: Mechanism) -> tuple[Floats, Floats]:
    """What one stands for in a twist, (r,), and in actuator rates, (n_a,): L for a length, 1 for an angle."""
    twists = np.ones(3 if mechanism.end_effector_is_joint else 6)
    twists[:3] = mechanism.characteristic_length
    return twists, rate_units(mechanism)[actuated_columns(mechanism)]
