"""The distance of a configuration from each kind of singularity.

All motions that the loops allow are combinations of orthonormal joint rates: the null space of the loop conditions C.
On them, T gives the twist of the end effector and A the actuators' rates. The left singular vectors of [T; A], split
into Q_T and Q_A, are the pairs (twist, actuator rates) that the mechanism can do, freed of passive rates and of any
choice of joint coordinates. In suitable bases both are diagonal, cosines c and sines s with c² + s² = 1 (the CS
decomposition): the forward Jacobian has the gains c / s and the inverse Jacobian s / c, which grow without bound as a
sine (type 2) or a cosine (type 1) vanishes.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import compress

import numpy as np

from ..arrays import Floats, Mask
from ..derived import derived
from ..description.home_mobility import column_moves
from ..description.mechanism import Mechanism
from ..description.mechanism_html import card
from ..description.task import task_of
from ..tolerances import TOLERANCES
from .displacements import displacements
from .joint_rates import actuated_columns, first_order, right_singular
from .mobility import Generic, generic_of
from .walks import around_home

KINDS = ("serial", "parallel", "constraint", "passive")
NUMBERS = (*KINDS, "lost", "gained")
"""The fields of a `Singularity` that are arrays."""


@dataclass(frozen=True, eq=False)
class Singularity:
    """Measures of the distance from each kind of singularity: 0 at a singularity, growing with the distance.

    Measures are scale free (lengths in units of L, angles in rad), (...,) each; inf where nothing can be lost
    or gained. Where `constraint` or `passive` is 0, the motions are not determined to first order, and the other
    measures hold for one choice of several that are possible.

    Attributes
    ----------
    serial : platform speed per actuator speed in the most expensive direction, 1 / |inverse Jacobian|. 0 is a type 1
        singularity: actuators move, and the end effector has lost a freedom.
    parallel : actuator speed per platform speed in the softest direction, 1 / |forward Jacobian|. 0 is a type 2
        singularity: the end effector moves although all actuators are locked; always so where actuators are missing.
    constraint : the smallest singular value of the loop conditions that is not zero in general. 0 is a constraint
        singularity: the mechanism as a whole gains a motion.
    passive : speed of end effector and actuators per speed of all joints in the motion that shows least of it. 0 is a
        singularity of passive joints: they move while end effector and actuators, which have lost a freedom, rest.
    lost, gained : unit twists [velocity of the reference point in L/s; angular velocity in rad/s] nearest to being lost
        or gained, in the base frame, (..., 6); of a joint end effector, the unit velocity of its centre, (..., 3). They
        belong to `serial` and `parallel`, or to `passive` and `constraint` where these are singular, and the smaller.
    kinds : the kinds whose measure is below `TOLERANCES.singular`; for a batch, one tuple a row, in row order.
    """

    serial: float | Floats
    parallel: float | Floats
    constraint: float | Floats
    passive: float | Floats
    lost: Floats
    gained: Floats
    kinds: tuple[str, ...] | list[tuple[str, ...]]

    def _repr_html_(self) -> str:
        """Every measure and whether it is singular, for notebooks; of a batch, the least, and the singular rows."""
        is_one = np.ndim(self.serial) == 0
        rows = []
        for kind in KINDS:
            measure = np.ravel(getattr(self, kind))
            known = measure[~np.isnan(measure)]
            least = f"{known.min():.3g}" if len(known) else "-"
            count = int(np.count_nonzero(known < TOLERANCES.singular))
            rows.append((kind, least, ("yes" if count else "no") if is_one else str(count)))
        header = ("kind", "measure", "singular") if is_one else ("kind", "least measure", "singular rows")
        lines = [] if is_one else [f"batch of shape {np.shape(self.serial)}"]
        return card("Singularity", lines, header, rows, "")


def measures(mechanism: Mechanism, q: Floats) -> Singularity:
    """`singularity` at coordinates q, (n, c): arrays (n,) and (n, 6) or (n, 3), and a list of n tuples."""
    invalid, q = _set_aside(q)
    motion = _motion(mechanism, q)
    serial, lost = _nearest_lost(generic_of(mechanism), motion)
    parallel, gained = _nearest_gained(motion)
    values = np.stack([serial, parallel, motion.constraint, motion.passive])
    for array in (values.T, lost, gained):
        array[invalid] = np.nan
    return singularity_of(values.T, lost, gained)


def singularity_of(values: Floats, lost: Floats, gained: Floats) -> Singularity:
    """A `Singularity` of measures (n, 4), in the order of `KINDS`, and twists (n, r) of any length."""
    is_singular = TOLERANCES.singular > values
    kinds = [tuple(compress(KINDS, row)) for row in is_singular]
    return Singularity(**dict(zip(KINDS, values.T, strict=True)), lost=_unit(lost), gained=_unit(gained), kinds=kinds)


def parallel_signs(mechanism: Mechanism, q: Floats) -> Floats:
    """The side of the parallel singularities on which coordinates q (n, c) are, (n,): 1, -1, 0 on one, NaN if unknown.

    It is the sign of det Q_A det D'Q_T, which does not depend on the basis of the motions, with D the directions of the
    end effector's freedoms. It changes at parallel and serial singularities. It is known if there are as many actuators
    as freedoms, and these are the same everywhere or those of the task.
    """
    invalid, q = _set_aside(q)
    generic, freedoms = generic_of(mechanism), generic_of(mechanism).mobility.platform
    directions = generic.directions if generic.directions.shape[1] == freedoms else _of_task(mechanism, q)
    if not len(mechanism.actuator_names) == directions.shape[-1] == freedoms:
        return np.full(len(q), np.nan)
    motion = _motion(mechanism, q)
    shown = np.swapaxes(directions, -1, -2) @ motion.twists
    signs = np.sign(np.linalg.det(motion.actuators)) * np.sign(np.linalg.det(shown))
    return np.asarray(np.where(invalid, np.nan, signs))


def _of_task(mechanism: Mechanism, q: Floats) -> Floats:
    """The twists that a task sets at coordinates q (n, c), (n, 6, k): of a tilt, about the platform's x and y axes."""
    task = task_of(mechanism)
    twists = np.repeat(np.eye(6)[None], len(q), axis=0)
    if task.rotations == 2:
        displaced = displacements(mechanism, q)[mechanism.end_effector_body]
        twists[:, 3:, 3:] = (displaced @ mechanism.home_pose)[:, :3, :3]
    return twists[:, :, [*task.axes, *task.turns]]


def _set_aside(q: Floats) -> tuple[Mask, Floats]:
    """Mask of rows that are NaN, and q with home in their place."""
    invalid = np.asarray(np.isnan(q).any(axis=1))
    return invalid, np.where(invalid[:, None], 0.0, q)


@dataclass(frozen=True)
class _Motion:
    """First-order motions at n configurations; r rows of a twist, d motions that show at platform or actuators.

    Attributes
    ----------
    twists, actuators : Q_T (n, r, d) and Q_A (n, n_a, d): orthonormal together; a column is zero where it is lost.
    all_twists : T on orthonormal joint rates, (n, r, motions).
    passive, constraint : the measures of these names, (n,).
    extra_twist, extra_rates : twist (n, r) and actuator rates (n, n_a) of the motion that the loops hold back least.
    """

    twists: Floats
    actuators: Floats
    all_twists: Floats
    passive: Floats
    constraint: Floats
    extra_twist: Floats
    extra_rates: Floats


def _motion(mechanism: Mechanism, q: Floats) -> _Motion:
    generic = generic_of(mechanism)
    closure, twist = first_order(mechanism, q)
    actuated = actuated_columns(mechanism)
    rank, shown = generic.rank, generic.mobility.platform + generic.mobility.internal
    values, right = right_singular(closure)
    motions = np.swapaxes(right[:, rank:], -1, -2)
    left, sizes, _ = np.linalg.svd(np.concatenate([twist @ motions, motions[:, actuated]], axis=1), full_matrices=False)
    pairs = left[..., :shown] * (sizes[:, None, :shown] > TOLERANCES.rank)
    extra = right[:, rank - 1] if rank else np.zeros(q.shape)
    return _Motion(
        twists=pairs[:, : twist.shape[1]],
        actuators=pairs[:, twist.shape[1] :],
        all_twists=twist @ motions,
        passive=sizes[:, shown - 1] if shown else np.full(len(q), np.inf),
        constraint=values[:, rank - 1] if rank else np.full(len(q), np.inf),
        extra_twist=np.einsum("nrc,nc->nr", twist, extra),
        extra_rates=extra[:, actuated],
    )


def _nearest_lost(generic: Generic, motion: _Motion) -> tuple[Floats, Floats]:
    """The serial measure (n,), and the direction (n, r) in which the platform is nearest to losing a freedom."""
    freedoms = generic.mobility.platform
    if freedoms == 0:
        return np.full(len(motion.twists), np.inf), np.full(motion.twists.shape[:2], np.nan)
    left, cosines, right = np.linalg.svd(generic.directions.T @ motion.twists)
    sines = np.linalg.norm(motion.actuators @ np.swapaxes(right, -1, -2), axis=1)
    ratios = _ratios(cosines[:, :freedoms], sines[:, :freedoms])
    serial, lost = _least(ratios, left[..., :freedoms])
    slowest = np.linalg.svd(generic.directions.T @ motion.all_twists)[0][..., freedoms - 1]
    lost = np.where(_is_nearer(motion.passive, serial)[:, None], slowest, lost)
    return serial, lost @ generic.directions.T


def _nearest_gained(motion: _Motion) -> tuple[Floats, Floats]:
    """The parallel measure (n,), and the twist (n, r) that locked actuators and loops resist least."""
    _, right = right_singular(motion.actuators)
    axes = np.swapaxes(right, -1, -2)
    sines, twists = np.linalg.norm(motion.actuators @ axes, axis=1), motion.twists @ axes
    parallel, gained = _least(_ratios(sines, np.linalg.norm(twists, axis=1)), twists)
    held = np.einsum("nra,na->nr", motion.twists @ _pseudo_inverse(motion.actuators), motion.extra_rates)
    freed = motion.extra_twist - held
    moves = _is_nearer(motion.constraint, parallel) & (np.linalg.norm(freed, axis=1) > TOLERANCES.alignment)
    return parallel, np.where(moves[:, None], freed, gained)


def _is_nearer(measure: Floats, other: Floats) -> Mask:
    """True where the first measure is singular and less than the other."""
    return np.asarray(measure < np.minimum(other, TOLERANCES.singular))


def _ratios(small: Floats, large: Floats) -> Floats:
    """small / large; inf where the large one vanishes."""
    return np.asarray(np.divide(small, large, out=np.full(small.shape, np.inf), where=large > TOLERANCES.rank))


def _least(ratios: Floats, vectors: Floats) -> tuple[Floats, Floats]:
    """The least of the ratios (n, k), and its column of the vectors (n, r, k); inf and NaN where there is none."""
    ratios = np.concatenate([ratios, np.full((len(ratios), 1), np.inf)], axis=1)
    vectors = np.concatenate([vectors, np.full((*vectors.shape[:2], 1), np.nan)], axis=2)
    least = np.argmin(ratios, axis=1)
    return np.min(ratios, axis=1), np.take_along_axis(vectors, least[:, None, None], axis=2)[..., 0]


def _unit(vectors: Floats) -> Floats:
    """Unit vectors (n, r), signed so that the largest component is positive; NaN for zero."""
    largest = np.take_along_axis(vectors, np.argmax(np.abs(vectors), axis=1)[:, None], axis=1)
    norms = np.linalg.norm(vectors, axis=1, keepdims=True) * np.where(largest < 0.0, -1.0, 1.0)
    return vectors / np.where(norms == 0.0, np.nan, norms)


def _pseudo_inverse(matrices: Floats) -> Floats:
    """Pseudo-inverses of (n, a, b), without singular values that are lost."""
    left, values, right = np.linalg.svd(matrices, full_matrices=False)
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=values > TOLERANCES.rank)
    return np.asarray(np.swapaxes(right, -1, -2) @ (inverse[..., None] * np.swapaxes(left, -1, -2)))


def assembly_signs(mechanism: Mechanism, q: Floats) -> Floats:
    """The sign of det C_P of a linkage with one freedom at coordinates q (n, c), (n,); 0 at a dead point or if unknown.

    C_P are the loop conditions in the joints that are not driven: where it is singular, at dead points of the drive and
    at change points, these may go on in either of two modes. It is known if the driven joint is the only freedom, and
    the independent conditions are the same everywhere, as of loops in a plane.
    """
    basis, passive = _loop_basis(mechanism)
    if not len(basis) or not len(q):
        return np.zeros(len(q))
    invalid, q = _set_aside(q)
    closure, _ = first_order(mechanism, q)
    return np.asarray(np.where(invalid, 0.0, np.sign(np.linalg.det(basis @ closure[:, :, passive]))))


def is_at_dead_point(mechanism: Mechanism, q: Floats) -> bool:
    """True if a linkage with one freedom is at a dead point of its drive or a change point at coordinates q (1, c)."""
    if not len(_loop_basis(mechanism)[0]):
        return False
    near = measures(mechanism, q)
    return bool(np.minimum(near.parallel, near.constraint)[0] < TOLERANCES.stretched)


@derived
def _loop_basis(mechanism: Mechanism) -> tuple[Floats, list[int]]:
    """Orthonormal combinations of loop conditions, independent everywhere, and the columns of passive joints."""
    generic, actuated = generic_of(mechanism), actuated_columns(mechanism)
    passive = [k for k in np.flatnonzero(column_moves(mechanism) > 0.0).tolist() if k not in actuated]
    if generic.mobility.platform != 1 or len(actuated) != 1 or len(passive) != generic.rank:
        return np.zeros((0, 0)), passive
    closure, _ = first_order(mechanism, around_home(mechanism))
    left, sizes, _ = np.linalg.svd(np.concatenate(list(closure), axis=1), full_matrices=False)
    basis = left[:, sizes > TOLERANCES.alignment].T
    return (basis if len(basis) == generic.rank else np.zeros((0, 0))), passive
