"""Mobility: the number of independent motions of a mechanism, counted at generic configurations around home."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Floats
from ...common.derived import derived
from ...common.printed import Printed, ResultTable
from ...tolerances import TOLERANCES
from ..description.home_mobility import column_joints
from ..description.mechanism import Mechanism
from .displacements import actuator_units, gaps
from .loops import actuated_columns, first_order, loop_errors_here, loop_slopes, moved, right_singular

SAMPLES, STEPS, STEP = 8, 3, 0.1
"""Number of walks from home to generic configurations, steps of a walk, largest joint motion of a step [rad or L]."""
NEWTON_STEPS = 20
"""Most steps to close the loops after a step of a walk; a walk that needs more is left out."""


@derived
def around_home(mechanism: Mechanism) -> Floats:
    """Home and closed configurations some steps away from it, (n, c), the same in every call."""
    random = np.random.default_rng(0)
    q = np.zeros((SAMPLES, len(column_joints(mechanism))))
    for _ in range(STEPS):
        conditions, _ = first_order(mechanism, q)
        step = random.standard_normal(q.shape)
        step -= np.einsum("nij,nj->ni", np.linalg.pinv(conditions, TOLERANCES.alignment) @ conditions, step)
        largest = np.abs(step).max(axis=1, keepdims=True)
        q = _closed(mechanism, moved(mechanism, q, STEP * step / np.maximum(largest, TOLERANCES.alignment)))
    closed = gaps(mechanism, q) <= TOLERANCES.position * mechanism.characteristic_length
    return np.concatenate([np.zeros((1, q.shape[1])), q[closed]])


def _closed(mechanism: Mechanism, q: Floats) -> Floats:
    """Close the loops by Gauss-Newton steps of the smallest joint motions, and take one more step when they are closed.

    Directions in which the loops hardly resist are not corrected, so that a walk may start in a singularity.
    """
    for _ in range(NEWTON_STEPS):
        open_gaps = gaps(mechanism, q) / mechanism.characteristic_length
        inverses = np.linalg.pinv(loop_slopes(mechanism, q), TOLERANCES.alignment)
        step = np.einsum("nij,nj->ni", inverses, -loop_errors_here(mechanism, q))
        q = moved(mechanism, q, step)
        if (open_gaps <= TOLERANCES.position).all():
            break
    return q


def stepped_freely(mechanism: Mechanism, q: Floats, step: float) -> Floats:
    """Coordinates (k, c) after a step from q (c,) along each free motion.

    A free motion moves the end effector with locked actuators; the loops resist it, to first order, by less than
    `TOLERANCES.singular`. The caller tests whether it is a finite motion.

    Parameters
    ----------
    step : of the end effector [L or rad].
    """
    closure, twist = first_order(mechanism, q[None])
    free = np.setdiff1d(np.arange(q.size), actuated_columns(mechanism))
    values, right = right_singular(closure[..., free])
    motions = right[0, np.count_nonzero(values > TOLERANCES.singular) :].T
    _, sizes, axes = np.linalg.svd(twist[0][:, free] @ motions, full_matrices=False)
    shown = sizes > TOLERANCES.singular
    rates = np.zeros((int(shown.sum()), q.size))
    rates[:, free] = axes[shown] @ motions.T / sizes[shown, None]
    return moved(mechanism, np.repeat(q[None], len(rates), axis=0), step * rates)


COUNTING, FEWEST = 4e9, 2
"""Largest sum of the cubed number of joint coordinates over configurations, which takes seconds for the longest chains;
and the fewest configurations, as home may be special."""

MOST_NAMED, TAKES_PART = 6, 0.1
"""Most joints that are named for a motion, and the least of their rates as a share of the largest."""


@dataclass(frozen=True)
class NearlyFree:
    """A motion that the loops hardly resist at generic configurations: by rounded axes, or near a singularity.

    Attributes
    ----------
    singular_value : float
        The largest resistance found around home [L and rad per rate]; exact loops resist by 0, others by 0.02 and more.
    joints : tuple of str
        Names of the joints that take part in it most, the fastest first.
    """

    singular_value: float
    joints: tuple[str, ...]


@dataclass(frozen=True)
class Mobility(Printed):
    """Numbers of independent motions of a mechanism at generic configurations; home may be special.

    Attributes
    ----------
    mobility : int
        Motions of the whole mechanism: platform + internal + idle.
    platform : int
        Freedoms of the end effector.
    internal : int
        Motions that move actuators while the end effector rests (kinematic redundancy).
    idle : int
        Motions in which neither the end effector nor an actuator moves (the spin of a rod between ball joints).
    actuators : int
        Number of actuated joints.
    uncontrolled : int
        Freedoms that the end effector keeps with all actuators locked.
    over_constraints : int
        Loop conditions that follow from the others.
    nearly_free : tuple of NearlyFree
        Motions that the loops hardly resist, the freest first; those with a resistance up to `TOLERANCES.alignment` are
        counted as motions, the others are not.
    """

    mobility: int
    platform: int
    internal: int
    idle: int
    actuators: int
    uncontrolled: int
    over_constraints: int
    nearly_free: tuple[NearlyFree, ...] = ()

    @property
    def redundancy(self) -> int:
        """Actuators beyond the freedoms of the end effector; negative where there are too few."""
        return self.actuators - self.platform

    def to_dict(self) -> dict[str, Any]:
        """Its counts, the redundancy too, as plain numbers."""
        return super().to_dict() | {"redundancy": self.redundancy}

    def table(self) -> ResultTable:
        """Every count with its meaning."""
        rows = [(name.replace("_", "-"), str(getattr(self, name)), words) for name, words in _IN_WORDS.items()]
        return ResultTable("Mobility", (), ("", "count", "of"), rows)


_IN_WORDS = {
    "mobility": "independent motions of the whole mechanism",
    "platform": "freedoms of the end effector",
    "internal": "motions of actuators while the end effector rests",
    "idle": "motions of neither the end effector nor an actuator",
    "actuators": "actuated coordinates",
    "redundancy": "actuators beyond the freedoms of the end effector",
    "uncontrolled": "freedoms left with all actuators locked",
    "over_constraints": "loop conditions that follow from the others",
}


@dataclass(frozen=True)
class Generic:
    """Properties at generic configurations.

    Attributes
    ----------
    mobility : the counts of motions.
    directions : orthonormal basis (r, k) of all twists that the platform ever has.
    rank : number of independent loop conditions.
    home_is_singular : True if the loops allow more motions at home than at generic configurations.
    """

    mobility: Mobility
    directions: Floats
    rank: int
    home_is_singular: bool


@derived
def generic_of(mechanism: Mechanism) -> Generic:
    """Mobility, twists of the platform, and rank of the loop conditions at generic configurations."""
    q = around_home(mechanism)
    closure, twist = first_order(mechanism, q[: max(FEWEST, int(COUNTING / max(1, q.shape[1]) ** 3))])
    locked = sum(coordinate.joint.is_rigid for coordinate in mechanism.coordinates)
    values, right = right_singular(closure)
    ranks = _rank(values)
    rank = int(ranks.max())
    motions = np.swapaxes(right[ranks == rank, rank:], -1, -2)
    twists, actuators = twist[ranks == rank] @ motions, motions[:, actuated_columns(mechanism)]
    shown, platform, driven = (
        int(_rank(np.linalg.svd(matrices, compute_uv=False)).max())
        for matrices in (np.concatenate([twists, actuators], axis=1), twists, actuators)
    )
    counts = Mobility(
        mobility=motions.shape[-1] - locked,
        platform=platform,
        internal=shown - platform,
        idle=motions.shape[-1] - locked - shown,
        actuators=len(mechanism.actuator_names),
        uncontrolled=shown - driven,
        over_constraints=closure.shape[1] - rank,
        nearly_free=_nearly_free(mechanism, values, right),
    )
    left, sizes, _ = np.linalg.svd(np.hstack(list(twists)), full_matrices=False)
    return Generic(counts, left[:, : int(_rank(sizes))], rank, bool(ranks[0] < rank))


def internal_rates(mechanism: Mechanism, q: Floats) -> Floats:
    """Rates of the actuators in internal motions at coordinates q (1, c): (n_a, k) [rad or length]."""
    generic, actuated = generic_of(mechanism), actuated_columns(mechanism)
    closure, twist = first_order(mechanism, q)
    motions = right_singular(closure)[1][0, generic.rank :].T
    still = motions @ right_singular(twist @ motions)[1][0, generic.mobility.platform :].T
    rates = np.linalg.svd(still[actuated])[0][:, : generic.mobility.internal]
    return np.asarray(rates * actuator_units(mechanism)[:, None])


def _nearly_free(mechanism: Mechanism, values: Floats, right: Floats) -> tuple[NearlyFree, ...]:
    """The motions that are nearly free in every configuration, from singular values (n, k) and vectors (n, c, c)."""
    small = np.count_nonzero(values < TOLERANCES.nearly_implied, axis=1).min()
    exact = np.count_nonzero(values <= TOLERANCES.rank, axis=1).min()
    motions = []
    for place in range(values.shape[1] - exact - 1, values.shape[1] - small - 1, -1):
        row = int(values[:, place].argmax())
        motions.append(NearlyFree(float(values[row, place]), _fastest(mechanism, right[row, place])))
    return tuple(motions)


def _fastest(mechanism: Mechanism, motion: Floats) -> tuple[str, ...]:
    """Names of the joints that take part in a motion (c,), the fastest first."""
    speeds = np.zeros(len(mechanism.joints))
    np.add.at(speeds, column_joints(mechanism), motion**2)
    order = np.argsort(-speeds, kind="stable")[:MOST_NAMED]
    return tuple(mechanism.joints[place].name for place in order if speeds[place] >= TAKES_PART**2 * speeds.max())


def _rank(values: NDArray[Any]) -> Any:
    return np.count_nonzero(values > TOLERANCES.alignment, axis=-1)
