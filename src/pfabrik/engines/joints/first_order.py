"""First-order kinematics of closed loops: Jacobians, singularity measures, and joint rates."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...common.arrays import Floats, Mask
from ...common.batch import take
from ...common.derived import derived
from ...kernels.handle import Scratch
from ...kernels.joints.loops import CONSTRAINT, JACOBIANS, JOINTS, MEASURES, FirstOrder, FirstOrderPlan
from ...kernels.threads import in_blocks
from ...machine.description.home_mobility import body_twist, loop_conditions
from ...machine.model import Model
from ...machine.motion.displacements import rate_units
from ...machine.motion.loops import actuated_columns, cycle_basis, present_screws
from ...machine.motion.mobility import generic_of
from ...machine.motion.singularities import Singularity, loop_blocks, singularity_of
from ...tolerances import TOLERANCES

if TYPE_CHECKING:
    from ...kernels.joints.first_order import FirstOrderScratch

ROWS_A_BLOCK = 64


def forward_map(model: Model, q: Floats) -> Floats:
    """Twists per actuator rate at coordinates q (n, c), (n, 6, n_a) or (n, 3, n_a); NaN where q is NaN."""
    twists, actuators = units_of(model)
    return np.asarray(twists[:, None] * rates(model, q, JACOBIANS).forward / actuators)


def inverse_map(model: Model, q: Floats) -> Floats:
    """Actuator rates per twist at coordinates q (n, c), (n, n_a, 6) or (n, n_a, 3); NaN where q is NaN."""
    twists, actuators = units_of(model)
    return np.asarray(actuators[:, None] * rates(model, q, JACOBIANS).inverse / twists)


def singularities(model: Model, q: Floats) -> Singularity:
    """Distances of coordinates q (n, c) from singularities, (n,), and lost and gained twists, (n, 6) or (n, 3)."""
    measured = rates(model, q, MEASURES)
    return singularity_of(measured.measures, measured.lost, measured.gained)


def are_stretched(model: Model, q: Floats) -> Mask:
    """Mask of coordinates q (n, c) with links stretched out or folded, which may bend either way, (n,)."""
    distances = singularities(model, q)
    return np.asarray(np.minimum(distances.serial, distances.passive) < TOLERANCES.stretched)


def is_at_dead_point(model: Model, q: Floats) -> bool:
    """True if a linkage with one freedom is at a dead point of its drive or a change point at coordinates q (1, c)."""
    if not loop_blocks(model.mechanism):
        return False
    distances = singularities(model, q)
    return bool(np.minimum(distances.parallel, distances.constraint)[0] < TOLERANCES.stretched)


class JointRates:
    """Joint rates at configurations: by actuators, by changes of the geometry, and under loads.

    Joint rates are orthonormal, lengths in L; twists are [velocity of the reference point; angular velocity], and
    wrenches [force times L; moment about the reference point].

    Parameters
    ----------
    q : coordinates as deviations from home, (n, c) [rad or length].
    like : a machine of nearly the same geometry; its mobility is used.

    Attributes
    ----------
    screws : screws of the joint rates, (n, c, 6).
    by_actuators : joint rates per actuator rate, (n, c, n_a).
    is_singular : True in constraint singularities, (n,); all other values are undefined there.
    """

    def __init__(self, model: Model, q: Floats, like: Model | None = None) -> None:
        mechanism = model.mechanism
        self._graph, self._rates = cycle_basis(mechanism), rates(model, q, JOINTS, like)
        self.actuated, counts = actuated_columns(mechanism), generic_of((like or model).mechanism).mobility
        self._n_shown = counts.platform + counts.internal
        self.screws, self.by_actuators, self.motions = self._rates.screws, self._rates.joints, self._rates.motions
        self.is_singular = np.asarray(self._rates.measures[:, CONSTRAINT] < TOLERANCES.singular)
        idle = model.closure.idle
        if idle.any():  # on no path (a tool's hinge): the loads that it carries do work on it
            self.screws[:, idle] = present_screws(mechanism, q)[:, idle][..., [3, 4, 5, 0, 1, 2]]

    @cached_property
    def twists(self) -> Floats:
        """Twists of the end effector by joint rates, (n, 6, c)."""
        return body_twist(self._graph.path, self.screws)

    @cached_property
    def conditions(self) -> Floats:
        """Conditions C of the loops by joint rates, (n, 6 loops, c)."""
        return loop_conditions(self._graph.orthonormal, self.screws)

    def geometry(self, openings: Floats, actuators: Floats | None = None) -> Floats:
        """Least joint rates (n, c, p) that close the loops after a change of geometry opens them, (n, 6 loops, p).

        Parameters
        ----------
        actuators : actuator rates (n, n_a, p) or (n_a, p); None for free actuators.
        """
        rates = -self._rates.closing @ openings
        if actuators is not None:
            rates += self.by_actuators @ (actuators - rates[:, self.actuated])
        return np.asarray(rates)

    def wrench(self, work: Floats) -> tuple[Floats, Floats]:
        """Actuator forces (n, n_a, k) against loads of work (n, c, k) by joint rates, and wrenches in the loops."""
        actuators = -np.swapaxes(self.by_actuators, -1, -2) @ work
        work = work.copy()
        work[:, self.actuated] += actuators
        return np.asarray(actuators), np.asarray(-np.swapaxes(self._rates.closing, -1, -2) @ work)

    @cached_property
    def open(self) -> Floats:
        """Projection onto the loop wrenches that do no work at any joint, (n, 6 loops, 6 loops); 0 in singularities."""
        m = self.conditions.shape[1]
        if self.motions.shape[2] == len(self._graph.path) - m:
            return np.zeros((len(self.screws), m, 0))
        projection = np.eye(m) - self.conditions @ self._rates.closing
        return np.where(self.is_singular[:, None, None], 0.0, projection)

    @cached_property
    def pairs(self) -> Floats:
        """Motions (n, c, d) with orthonormal pairs of twist and actuator rates; zero for motions without."""
        shown, is_shown = self.motions[..., : self._n_shown], self._is_shown[:, None, : self._n_shown]
        return np.divide(shown, self._rates.sizes[:, None, : self._n_shown], out=np.zeros(shown.shape), where=is_shown)

    @cached_property
    def unseen(self) -> Floats:
        """Motions (n, c, k) that move neither the end effector nor the actuators; zero for the others."""
        return np.where(self._is_shown[:, None], 0.0, self.motions)

    @cached_property
    def _is_shown(self) -> Mask:
        sizes = self._rates.sizes
        return np.asarray((sizes > TOLERANCES.singular) & (np.arange(sizes.shape[1]) < self._n_shown))


def rates(model: Model, q: Floats, outputs: int, like: Model | None = None) -> FirstOrder:
    """Compute first-order results at coordinates q (n, c), lengths in L; NaN where q is NaN.

    Parameters
    ----------
    outputs : JACOBIANS, MEASURES or JOINTS.
    like : see `JointRates`.
    """
    from ...kernels.joints.first_order import rates

    prepared = _prepared(model, outputs) if like is None else _new_prepared(model, outputs, like)
    closure, n = model.closure, len(q)
    coordinates = q * closure.scale
    results = FirstOrder(*(none if shape is None else np.full((n, *shape), np.nan) for shape, none in prepared.results))

    def run(block: slice) -> None:
        block_results = results if n <= ROWS_A_BLOCK else take(results, block)
        rates(closure.machine.address, prepared.scratch.address, prepared.plan, coordinates[block], block_results)

    in_blocks(run, n, ROWS_A_BLOCK)
    return results


class _Prepared(NamedTuple):
    """Arguments of the kernel; per field of `FirstOrder` the shape of a row, None if not requested, and no rows."""

    plan: FirstOrderPlan
    scratch: Scratch[FirstOrderScratch]
    results: list[tuple[tuple[int, ...] | None, Floats]]


@derived
def _prepared(model: Model, outputs: int) -> _Prepared:
    return _new_prepared(model, outputs, model)


def _new_prepared(model: Model, outputs: int, like: Model) -> _Prepared:
    from ...kernels.joints.first_order import new_first_order_scratch

    mechanism, generic = model.mechanism, generic_of(like.mechanism)
    graph, counts, actuated = cycle_basis(mechanism), generic.mobility, actuated_columns(mechanism)
    plan = FirstOrderPlan(
        loops=np.ascontiguousarray(graph.orthonormal),
        path=np.array(graph.path, float),
        rates=np.array(graph.rates),
        actuated=np.array(actuated, np.int64),
        directions=np.ascontiguousarray(generic.directions),
        rank=generic.rank,
        shown=counts.platform + counts.internal,
        freedoms=counts.platform,
        least=TOLERANCES.singular if outputs == JOINTS else TOLERANCES.rank,
        singular=TOLERANCES.singular,
        outputs=outputs,
    )
    r, c, n_a = len(plan.directions), len(plan.path), len(actuated)
    of_pose = {"forward": (r, n_a), "inverse": (n_a, r), "measures": (4,), "lost": (r,), "gained": (r,)}
    of_joints = {"screws": (c, 6), "motions": (c, c - plan.rank), "sizes": (c - plan.rank,), "joints": (c, n_a)}
    of_joints |= {"closing": (c, 6 * len(plan.loops)), "measures": (4,)}
    requested, shapes = of_joints if outputs == JOINTS else of_pose, of_pose | of_joints
    results = [(requested.get(name), np.empty((0, *shapes[name]))) for name in FirstOrder._fields]
    return _Prepared(plan, Scratch(new_first_order_scratch, model.closure.loops, plan), results)


@derived
def units_of(model: Model) -> tuple[Floats, Floats]:
    """Units of a twist, (r,), and of actuator rates, (n_a,): L for a length, 1 for an angle."""
    mechanism = model.mechanism
    twists = np.ones(3 if mechanism.end_effector_is_joint else 6)
    twists[:3] = mechanism.characteristic_length
    return twists, rate_units(mechanism)[actuated_columns(mechanism)]
