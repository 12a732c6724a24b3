"""Mobility: the number of independent motions of a mechanism, counted at generic configurations around home."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..derived import derived
from ..description.home_mobility import column_joints
from ..description.mechanism import Mechanism
from ..printed import Printed, ResultTable
from ..tolerances import TOLERANCES
from .displacements import actuator_units
from .joint_rates import actuated_columns, first_order, right_singular
from .walks import around_home

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
    singular_value : the largest resistance found around home [L and rad per rate]; exact loops resist by 0, others by
        0.02 and more.
    joints : names of the joints that take part in it most, the fastest first.
    """

    singular_value: float
    joints: tuple[str, ...]


@dataclass(frozen=True)
class Mobility(Printed):
    """Numbers of independent motions of a mechanism at generic configurations; home may be special.

    Attributes
    ----------
    mobility : motions of the whole mechanism: platform + internal + idle.
    platform : freedoms of the end effector.
    internal : motions that move actuators while the end effector rests (kinematic redundancy).
    idle : motions in which neither the end effector nor an actuator moves (the spin of a rod between ball joints).
    actuators : number of actuated joints.
    uncontrolled : freedoms that the end effector keeps with all actuators locked.
    over_constraints : loop conditions that follow from the others.
    nearly_free : motions that the loops hardly resist, the freest first; those with a resistance up to
        `TOLERANCES.alignment` are counted as motions, the others are not.
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
