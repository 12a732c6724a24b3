"""The distance of a configuration from each kind of singularity.

All motions that the loops allow are combinations of orthonormal joint rates: the null space of the loop conditions C.
On them, T gives the twist of the end effector and A the actuators' rates. The left singular vectors of [T; A], split
into Q_T and Q_A, are the pairs (twist, actuator rates) that the mechanism can do, freed of passive rates and of any
choice of joint coordinates. In suitable bases both are diagonal, cosines c and sines s with c² + s² = 1 (the CS
decomposition): the forward Jacobian has the gains c / s and the inverse Jacobian s / c, which grow without bound as a
sine (type 2) or a cosine (type 1) vanishes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import compress
from typing import Any

import numpy as np

from ...common.arrays import Floats
from ...common.derived import derived
from ...common.printed import Printed, ResultTable, plain
from ...tolerances import TOLERANCES
from ..description.home_mobility import column_moves
from ..description.mechanism import Mechanism
from ..description.task import task_of
from .displacements import displacements
from .loops import actuated_columns, first_order
from .mobility import around_home, generic_of

KINDS = ("serial", "parallel", "constraint", "passive")
NUMBERS = (*KINDS, "lost", "gained")
"""The fields of a `Singularity` that are arrays."""


@dataclass(frozen=True, eq=False)
class Singularity(Printed):
    """Measures of the distance from each kind of singularity: 0 at a singularity, growing with the distance.

    Measures are scale free (lengths in units of L, angles in rad), (...,) each; inf where nothing can be lost
    or gained. Where `constraint` or `passive` is 0, the motions are not determined to first order, and the other
    measures hold for one choice of several that are possible.

    Attributes
    ----------
    serial : float or array (...)
        Platform speed per actuator speed in the most expensive direction, 1 / |inverse Jacobian|. 0 is a type 1
        singularity: actuators move, and the end effector has lost a freedom.
    parallel : float or array (...)
        Actuator speed per platform speed in the softest direction, 1 / |forward Jacobian|. 0 is a type 2 singularity:
        the end effector moves although all actuators are locked; always so where actuators are missing.
    constraint : float or array (...)
        The smallest singular value of the loop conditions that is not zero in general. 0 is a constraint singularity:
        the mechanism as a whole gains a motion.
    passive : float or array (...)
        Speed of end effector and actuators per speed of all joints in the motion that shows least of it. 0 is a
        singularity of passive joints: they move while end effector and actuators, which have lost a freedom, rest.
    lost, gained : array (..., 6)
        Unit twists [velocity of the reference point in L/s; angular velocity in rad/s] nearest to being lost or gained,
        in the base frame, (..., 6); of a joint end effector, the unit velocity of its centre, (..., 3). They belong to
        `serial` and `parallel`, or to `passive` and `constraint` where these are singular, and the smaller.
    kinds : tuple of str or list of tuple of str
        The kinds whose measure is below `TOLERANCES.singular`; for a batch, one tuple a row, in row order.
    """

    serial: float | Floats
    parallel: float | Floats
    constraint: float | Floats
    passive: float | Floats
    lost: Floats
    gained: Floats
    kinds: tuple[str, ...] | list[tuple[str, ...]]
    _in_words: Callable[[Singularity], list[str]] | None = field(default=None, repr=False)

    @property
    def motions(self) -> list[str]:
        """Of one answer, in words: the motion nearest to being lost, with the actuators that make it, and that nearest
        to being gained. Of a batch, none.
        """
        return [] if self._in_words is None else self._in_words(self)

    def to_dict(self) -> dict[str, Any]:
        """Its fields and, of one answer, the motions in words: ready for JSON."""
        return super().to_dict() | {"motions": self.motions}

    def table(self) -> ResultTable:
        """Every measure and whether it is singular; of a batch, the least, and the singular rows."""
        is_one = np.ndim(self.serial) == 0
        rows = []
        for kind in KINDS:
            measure = np.ravel(getattr(self, kind))
            known = measure[~np.isnan(measure)]
            least = plain(min(known, default=np.nan), 0.0, ".3g")
            count = int(np.count_nonzero(known < TOLERANCES.singular))
            rows.append((kind, least, ("yes" if count else "no") if is_one else str(count)))
        header = ("kind", "measure", "singular") if is_one else ("kind", "least measure", "singular rows")
        lines = [] if is_one else [f"batch of shape {np.shape(self.serial)}"]
        return ResultTable("Singularity", lines, header, rows, ["\n".join(self.motions)] if self.motions else [])


def singularity_of(values: Floats, lost: Floats, gained: Floats) -> Singularity:
    """A `Singularity` of measures (n, 4), in the order of `KINDS`, and twists (n, r) of any length."""
    is_singular = TOLERANCES.singular > values
    kinds = [tuple(compress(KINDS, row)) for row in is_singular]
    return Singularity(**dict(zip(KINDS, values.T, strict=True)), lost=_unit(lost), gained=_unit(gained), kinds=kinds)


def parallel_signs(mechanism: Mechanism, q: Floats, forward: Floats) -> Floats:
    """The side of the parallel singularities on which coordinates q (n, c) are, (n,): 1, -1, 0 on one, NaN if unknown.

    It is the sign of det D'F, with D the directions of the end effector's freedoms. It changes at parallel and serial
    singularities. It is known if there are as many actuators as freedoms, and these are the same everywhere or those of
    the task.

    Parameters
    ----------
    forward : F, forward Jacobians (n, r, n_a) [length, rad].
    """
    generic, freedoms = generic_of(mechanism), generic_of(mechanism).mobility.platform
    directions = generic.directions if generic.directions.shape[1] == freedoms else task_twists(mechanism, q)
    if not len(mechanism.actuator_names) == directions.shape[-1] == freedoms:
        return np.full(len(q), np.nan)
    lengths = np.repeat([mechanism.characteristic_length, 1.0], 3)[: forward.shape[1], None]
    return np.asarray(np.sign(np.linalg.det(np.swapaxes(directions, -1, -2) @ (forward / lengths))))


def task_twists(mechanism: Mechanism, q: Floats) -> Floats:
    """The twists that a task sets at coordinates q (n, c), (n, 6, k): of a tilt, about the platform's x and y axes."""
    task = task_of(mechanism)
    twists = np.repeat(np.eye(6)[None], len(q), axis=0)
    if task.rotations == 2:
        displaced = displacements(mechanism, q)[mechanism.end_effector_body]
        twists[:, 3:, 3:] = (displaced @ mechanism.home_pose)[:, :3, :3]
    return twists[:, :, [*task.axes, *task.turns]]


def _unit(vectors: Floats) -> Floats:
    """Unit vectors (n, r), signed so that the largest component is positive; NaN for zero."""
    largest = np.take_along_axis(vectors, np.argmax(np.abs(vectors), axis=1)[:, None], axis=1)
    norms = np.linalg.norm(vectors, axis=1, keepdims=True) * np.where(largest < 0.0, -1.0, 1.0)
    return vectors / np.where(norms == 0.0, np.nan, norms)


def assembly_signs(mechanism: Mechanism, q: Floats) -> Floats:
    """The sign of det C_P of a linkage with one freedom at coordinates q (n, c), (n,); 0 at a dead point or if unknown.

    C_P are the loop conditions in the joints that are not driven: where it is singular, at dead points of the drive and
    at change points, these may go on in either of two modes. It is known if the driven joint is the only freedom, and
    the independent conditions are the same everywhere, as of loops in a plane.
    """
    basis, passive = loop_basis(mechanism)
    if not len(basis) or not len(q):
        return np.zeros(len(q))
    invalid = np.asarray(np.isnan(q).any(axis=1))
    closure, _ = first_order(mechanism, np.where(invalid[:, None], 0.0, q))
    return np.asarray(np.where(invalid, 0.0, np.sign(np.linalg.det(basis @ closure[:, :, passive]))))


@derived
def loop_basis(mechanism: Mechanism) -> tuple[Floats, list[int]]:
    """Orthonormal combinations of loop conditions, independent everywhere, and the columns of passive joints."""
    generic, actuated = generic_of(mechanism), actuated_columns(mechanism)
    passive = [k for k in np.flatnonzero(column_moves(mechanism) > 0.0).tolist() if k not in actuated]
    if generic.mobility.platform != 1 or len(actuated) != 1 or len(passive) != generic.rank:
        return np.zeros((0, 0)), passive
    closure, _ = first_order(mechanism, around_home(mechanism))
    left, sizes, _ = np.linalg.svd(np.concatenate(list(closure), axis=1), full_matrices=False)
    basis = left[:, sizes > TOLERANCES.alignment].T
    return (basis if len(basis) == generic.rank else np.zeros((0, 0))), passive
