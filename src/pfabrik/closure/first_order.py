"""Jacobians and singularities of configurations of closed loops, compiled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Floats, Mask
from ..batch import take
from ..derived import derived
from ..kernels.closure.loops import FirstOrder, FirstOrderPlan
from ..kernels.handle import Scratch
from ..kernels.threads import in_blocks
from ..model import Model
from ..motion.displacements import rate_units
from ..motion.joint_rates import actuated_columns, graph_of
from ..motion.mobility import generic_of
from ..motion.singularities import KINDS, Singularity, measures, singularity_of
from ..tolerances import TOLERANCES

if TYPE_CHECKING:
    from ..kernels.closure.first_order import FirstOrderScratch

ROWS_A_BLOCK = 64


def forward_map(model: Model, q: Floats) -> Floats:
    """Twists per actuator rate at coordinates q, (n, c): (n, 6, n_a) or (n, 3, n_a); NaN where q is."""
    twists, actuators = units_of(model)
    return np.asarray(twists[:, None] * _first_order(model, q, whole=False).forward / actuators)


def inverse_map(model: Model, q: Floats) -> Floats:
    """Actuator rates per twist at coordinates q, (n, c): (n, n_a, 6) or (n, n_a, 3); NaN where q is."""
    twists, actuators = units_of(model)
    return np.asarray(actuators[:, None] * _first_order(model, q, whole=False).inverse / twists)


def singularities(model: Model, q: Floats) -> Singularity:
    """Measures of how near coordinates q, (n, c), are to singularities: arrays (n,) and (n, 6) or (n, 3), and n tuples.

    In a singularity, or next to one, what is lost and gained takes all singular vectors: NumPy finds them there.
    """
    found = _first_order(model, q, whole=True)
    near = np.flatnonzero(found.measures.min(axis=1) < TOLERANCES.singular)
    if len(near):
        exactly = measures(model.mechanism, q[near])
        found.measures[near] = np.stack([getattr(exactly, kind) for kind in KINDS], axis=1)
        found.lost[near], found.gained[near] = exactly.lost, exactly.gained
    return singularity_of(found.measures, found.lost, found.gained)


def are_stretched(model: Model, q: Floats) -> Mask:
    """Mask of coordinates q (n, c) with links stretched out or folded, so that they may bend either way, (n,)."""
    found = singularities(model, q)
    return np.asarray(np.minimum(found.serial, found.passive) < TOLERANCES.stretched)


def _first_order(model: Model, q: Floats, *, whole: bool) -> FirstOrder:
    """Jacobians and measures at coordinates q, (n, c), lengths in L; `whole`: the constraint measure too."""
    from ..kernels.closure.first_order import first_order

    closure, plan = model.closure, _plan(model, whole)
    n, coordinates = len(q), q * closure.scale
    twists, actuators = plan.twists, len(plan.actuated)
    found = FirstOrder(
        np.empty((n, twists, actuators)),
        np.empty((n, actuators, twists)),
        np.empty((n, 4)),
        np.empty((n, twists)),
        np.empty((n, twists)),
    )
    scratch = _scratch(model, whole)

    def run(block: slice) -> None:
        own = take(found, block)
        first_order(closure.machine.address, scratch.address, plan, coordinates[block], own)

    in_blocks(run, n, ROWS_A_BLOCK)
    return found


@derived
def _scratch(model: Model, whole: bool) -> Scratch[FirstOrderScratch]:
    from ..kernels.closure.first_order import new_first_order_scratch

    return Scratch(new_first_order_scratch, model.closure.loops, _plan(model, whole))


@derived
def _plan(model: Model, whole: bool) -> FirstOrderPlan:
    mechanism = model.mechanism
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


@derived
def units_of(model: Model) -> tuple[Floats, Floats]:
    """Units of a twist, (r,), and of actuator rates, (n_a,): L for a length, 1 for an angle."""
    mechanism = model.mechanism
    twists = np.ones(3 if mechanism.end_effector_is_joint else 6)
    twists[:3] = mechanism.characteristic_length
    return twists, rate_units(mechanism)[actuated_columns(mechanism)]
