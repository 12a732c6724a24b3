"""Configurations of closed loops to first order: Jacobians, singularities, and joint rates by whatever moves them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..arrays import Floats, Mask
from ..batch import take
from ..derived import derived
from ..description.home_mobility import body_twist, loop_conditions
from ..kernels.closure.loops import CONSTRAINT, JACOBIANS, JOINTS, MEASURES, FirstOrder, FirstOrderPlan
from ..kernels.handle import Scratch
from ..kernels.threads import in_blocks
from ..model import Model
from ..motion.displacements import rate_units
from ..motion.joint_rates import actuated_columns, cycle_basis, present_screws
from ..motion.mobility import generic_of
from ..motion.singularities import Singularity, loop_basis, singularity_of
from ..tolerances import TOLERANCES

if TYPE_CHECKING:
    from ..kernels.closure.first_order import FirstOrderScratch

ROWS_A_BLOCK = 64


def forward_map(model: Model, q: Floats) -> Floats:
    """Twists per actuator rate at coordinates q, (n, c): (n, 6, n_a) or (n, 3, n_a); NaN where q is."""
    twists, actuators = units_of(model)
    return np.asarray(twists[:, None] * rates(model, q, JACOBIANS).forward / actuators)


def inverse_map(model: Model, q: Floats) -> Floats:
    """Actuator rates per twist at coordinates q, (n, c): (n, n_a, 6) or (n, n_a, 3); NaN where q is."""
    twists, actuators = units_of(model)
    return np.asarray(actuators[:, None] * rates(model, q, JACOBIANS).inverse / twists)


def singularities(model: Model, q: Floats) -> Singularity:
    """Distances of coordinates q, (n, c), from singularities: arrays (n,) and (n, 6) or (n, 3), and n tuples."""
    found = rates(model, q, MEASURES)
    return singularity_of(found.measures, found.lost, found.gained)


def are_stretched(model: Model, q: Floats) -> Mask:
    """Mask of coordinates q (n, c) with links stretched out or folded, so that they may bend either way, (n,)."""
    found = singularities(model, q)
    return np.asarray(np.minimum(found.serial, found.passive) < TOLERANCES.stretched)


def is_at_dead_point(model: Model, q: Floats) -> bool:
    """True if a linkage with one freedom is at a dead point of its drive or a change point at coordinates q (1, c)."""
    if not len(loop_basis(model.mechanism)[0]):
        return False
    near = singularities(model, q)
    return bool(np.minimum(near.parallel, near.constraint)[0] < TOLERANCES.stretched)


class JointRates:
    """Rates of joints at configurations: by actuators, by the geometry, and under loads.

    By orthonormal joint rates, lengths in L; twists are [velocity of the reference point; angular velocity], and
    wrenches [force times L; moment about the reference point].

    Parameters
    ----------
    q : coordinates as deviations from home, (n, c) [rad or length].
    like : a machine of almost the same geometry, whose mobility is known.

    Attributes
    ----------
    screws : of joint rates, (n, c, 6).
    by_actuators : joint rates per rate of each actuator, (n, c, n_a).
    is_singular : True in constraint singularities, in which the rest means nothing, (n,).
    """

    def __init__(self, model: Model, q: Floats, like: Model | None = None) -> None:
        mechanism = model.mechanism
        self._graph, self._found = cycle_basis(mechanism), rates(model, q, JOINTS, like)
        self.actuated, counts = actuated_columns(mechanism), generic_of((like or model).mechanism).mobility
        self._most = counts.platform + counts.internal
        self.screws, self.by_actuators, self.motions = self._found.screws, self._found.joints, self._found.motions
        self.is_singular = np.asarray(self._found.measures[:, CONSTRAINT] < TOLERANCES.singular)
        idle = model.closure.idle
        if idle.any():  # on no path, as a tool's hinge: what it carries works on it
            self.screws[:, idle] = present_screws(mechanism, q)[:, idle][..., [3, 4, 5, 0, 1, 2]]

    @cached_property
    def twists(self) -> Floats:
        """Of the end effector, (n, 6, c)."""
        return body_twist(self._graph.path, self.screws)

    @cached_property
    def conditions(self) -> Floats:
        """What loops ask to vanish, (n, 6 loops, c)."""
        return loop_conditions(self._graph.orthonormal, self.screws)

    def geometry(self, openings: Floats, actuators: Floats | None = None) -> Floats:
        """Joint rates (n, c, p) that close loops which a geometry opens, (n, 6 loops, p): the least.

        Parameters
        ----------
        actuators : their rates, if they are given, (n, n_a, p) or (n_a, p).
        """
        rates = -self._found.closing @ openings
        if actuators is not None:
            rates += self.by_actuators @ (actuators - rates[:, self.actuated])
        return np.asarray(rates)

    def wrench(self, work: Floats) -> tuple[Floats, Floats]:
        """The least forces of actuators (n, n_a, k) against loads that do work (n, c, k), and wrenches in the loops."""
        actuators = -np.swapaxes(self.by_actuators, -1, -2) @ work
        work = work.copy()
        work[:, self.actuated] += actuators
        return np.asarray(actuators), np.asarray(-np.swapaxes(self._found.closing, -1, -2) @ work)

    @cached_property
    def open(self) -> Floats:
        """Wrenches in the loops that no joint notices, (n, 6 loops, 6 loops): a projection; 0 in singularities."""
        m = self.conditions.shape[1]
        if self.motions.shape[2] == len(self._graph.path) - m:
            return np.zeros((len(self.screws), m, 0))
        left = np.eye(m) - self.conditions @ self._found.closing
        return np.where(self.is_singular[:, None, None], 0.0, left)

    @cached_property
    def pairs(self) -> Floats:
        """Motions that show, (n, c, d): twists and actuator rates are orthonormal together; zero for what is lost."""
        shown, is_shown = self.motions[..., : self._most], self._is_shown[:, None, : self._most]
        return np.divide(shown, self._found.sizes[:, None, : self._most], out=np.zeros(shown.shape), where=is_shown)

    @cached_property
    def unseen(self) -> Floats:
        """Motions (n, c, k) that neither end effector nor actuators show; zero for the others."""
        return np.where(self._is_shown[:, None], 0.0, self.motions)

    @cached_property
    def _is_shown(self) -> Mask:
        sizes = self._found.sizes
        return np.asarray((sizes > TOLERANCES.singular) & (np.arange(sizes.shape[1]) < self._most))


def rates(model: Model, q: Floats, asks: int, like: Model | None = None) -> FirstOrder:
    """Run the kernel at coordinates q, (n, c), lengths in L; NaN where q is.

    Parameters
    ----------
    asks : JACOBIANS, MEASURES or JOINTS.
    like : see `JointRates`.
    """
    from ..kernels.closure.first_order import rates

    own = _prepared(model, asks) if like is None else _made(model, asks, like)
    closure, n = model.closure, len(q)
    coordinates = q * closure.scale
    found = FirstOrder(*(none if shape is None else np.full((n, *shape), np.nan) for shape, none in own.results))

    def run(block: slice) -> None:
        part = found if n <= ROWS_A_BLOCK else take(found, block)
        rates(closure.machine.address, own.scratch.address, own.plan, coordinates[block], part)

    in_blocks(run, n, ROWS_A_BLOCK)
    return found


class _Prepared(NamedTuple):
    """What the kernel takes; shapes of what is asked for, row by row, and arrays without rows for all else."""

    plan: FirstOrderPlan
    scratch: Scratch[FirstOrderScratch]
    results: list[tuple[tuple[int, ...] | None, Floats]]


@derived
def _prepared(model: Model, asks: int) -> _Prepared:
    return _made(model, asks, model)


def _made(model: Model, asks: int, like: Model) -> _Prepared:
    from ..kernels.closure.first_order import new_first_order_scratch

    mechanism, generic = model.mechanism, generic_of(like.mechanism)
    graph, counts, actuated = cycle_basis(mechanism), generic.mobility, actuated_columns(mechanism)
    plan = FirstOrderPlan(
        loops=np.ascontiguousarray(graph.orthonormal),
        way=np.array(graph.path, float),
        rates=np.array(graph.rates),
        actuated=np.array(actuated, np.int64),
        directions=np.ascontiguousarray(generic.directions),
        rank=generic.rank,
        shown=counts.platform + counts.internal,
        freedoms=counts.platform,
        least=TOLERANCES.singular if asks == JOINTS else TOLERANCES.rank,
        singular=TOLERANCES.singular,
        asks=asks,
    )
    r, c, n_a = len(plan.directions), len(plan.way), len(actuated)
    of_pose = {"forward": (r, n_a), "inverse": (n_a, r), "measures": (4,), "lost": (r,), "gained": (r,)}
    of_joints = {"screws": (c, 6), "motions": (c, c - plan.rank), "sizes": (c - plan.rank,), "joints": (c, n_a)}
    of_joints |= {"closing": (c, 6 * len(plan.loops)), "measures": (4,)}
    asked, shapes = of_joints if asks == JOINTS else of_pose, of_pose | of_joints
    results = [(asked.get(name), np.empty((0, *shapes[name]))) for name in FirstOrder._fields]
    return _Prepared(plan, Scratch(new_first_order_scratch, model.closure.loops, plan), results)


@derived
def units_of(model: Model) -> tuple[Floats, Floats]:
    """Units of a twist, (r,), and of actuator rates, (n_a,): L for a length, 1 for an angle."""
    mechanism = model.mechanism
    twists = np.ones(3 if mechanism.end_effector_is_joint else 6)
    twists[:3] = mechanism.characteristic_length
    return twists, rate_units(mechanism)[actuated_columns(mechanism)]
