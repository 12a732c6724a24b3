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
from itertools import combinations, compress
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Floats, Ints, Mask
from ...common.derived import derived
from ...common.printed import Printed, ResultTable, plain
from ...tolerances import TOLERANCES
from ..description.home_mobility import column_joints, column_moves
from ..description.mechanism import Mechanism
from ..description.task import task_of
from .displacements import displacements, joint_centres
from .loops import actuated_columns, loop_slopes, present_screws
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
    """Signs of the blocks of a linkage with one freedom at coordinates q (n, c), (n, blocks); 0 at dead points.

    At dead points and change points of a block the joints that follow from its loops may go on in either of two modes.
    Each block has a sign of its own, for that of a product stays where two change at once: that of det [C N; Z' 0],
    with C its conditions in these joints, N the conditions that no joint breaks, as in a plane, and Z the spins of rods
    between two balls. N is signed as at home, and the sign is 0 too where it has turned away too far for that; a spin
    is signed by the line of its rod. No blocks where none is known.
    """
    blocks = loop_blocks(mechanism)
    if not len(blocks) or not len(q):
        return np.zeros((len(q), len(blocks)))
    invalid = np.asarray(np.isnan(q).any(axis=1))
    conditions = loop_slopes(mechanism, np.where(invalid[:, None], 0.0, q))
    q = np.where(invalid[:, None], 0.0, q)
    spins = _spins(mechanism, q, blocks)
    signs = [_sign_of(block, conditions, own) for block, own in zip(blocks, spins, strict=True)]
    return np.asarray(np.where(invalid[:, None], 0.0, np.stack(signs, axis=1)))


def _spins(mechanism: Mechanism, q: Floats, blocks: tuple[LoopBlock, ...]) -> list[Floats]:
    """Of each block, the speeds of its rods' spins by its joint rates at coordinates q (n, c), (n, rods, columns)."""
    if not any(block.rods for block in blocks):
        return [np.zeros((len(q), 0, len(block.columns))) for block in blocks]
    turns, centres = present_screws(mechanism, q)[:, :, :3], joint_centres(mechanism, q)
    spins = []
    for block in blocks:
        own = np.zeros((len(q), len(block.rods), len(block.columns)))
        for row, (one, other) in enumerate(block.rods):
            line = centres[:, other] - centres[:, one]
            is_of_ball = column_joints(mechanism)[block.columns] == one
            own[:, row, is_of_ball] = np.einsum("nci,ni->nc", turns[:, block.columns[is_of_ball]], line)
        spins.append(own)
    return spins


def _sign_of(block: LoopBlock, conditions: Floats, spins: Floats) -> Floats:
    """The sign of one block at loop conditions (n, 6 loops, c), (n,)."""
    C, N, Z = _parts(conditions, block.rows, block.columns, block.kept.shape[1], len(block.rods))
    bordered = np.zeros((len(C), C.shape[1] + Z.shape[2], C.shape[2] + N.shape[2]))
    bordered[:, : C.shape[1], : C.shape[2]], bordered[:, : C.shape[1], C.shape[2] :] = C, N
    bordered[:, C.shape[1] :, : C.shape[2]] = np.swapaxes(Z, 1, 2)
    alike, along = np.linalg.det(block.kept.T @ N), np.linalg.det(spins @ Z)
    signed = np.sign(np.linalg.det(bordered)) * np.sign(alike) * np.sign(along)
    return np.asarray(np.where(np.abs(alike) > TURNED_AWAY, signed, 0.0))


def _parts(conditions: Floats, rows: Ints, columns: Ints, n_kept: int, n_idle: int) -> tuple[Floats, Floats, Floats]:
    """C, N and Z of a block, of `assembly_signs`, at loop conditions (n, 6 loops, c)."""
    C = conditions[:, rows][:, :, columns]
    C = C * np.tile(np.repeat([1.0, AS_FORCES], 3), len(rows) // 6)[:, None]
    left, _, right = np.linalg.svd(C)
    right = np.swapaxes(right, 1, 2)
    return C, left[:, :, left.shape[2] - n_kept :], right[:, :, right.shape[2] - n_idle :]


def are_opposite(signs: Floats, kept: Floats) -> Mask:
    """True for rows of signs (n, blocks) of which one is the opposite of that which is kept, (blocks,): (n,)."""
    return np.asarray((signs * kept < 0.0).any(axis=1))


class LoopBlock(NamedTuple):
    """Loops that, once the joints of earlier blocks are placed, place as many more as they have conditions.

    Attributes
    ----------
    rows, columns : their conditions, and these joints, as of `loop_slopes`.
    kept : N at home, (rows, k): conditions that no joint of these loops breaks.
    rods : pairs of balls, by their places among the joints, of rods that spin.
    """

    rows: Ints
    columns: Ints
    kept: Floats
    rods: tuple[tuple[int, int], ...]


@derived
def loop_blocks(mechanism: Mechanism) -> tuple[LoopBlock, ...]:
    """The blocks of a linkage whose driven joint is its only freedom, from the drive outward; none of others.

    They are Assur's groups.
    """
    generic, actuated = generic_of(mechanism), actuated_columns(mechanism)
    passive = np.setdiff1d(np.flatnonzero(column_moves(mechanism) > 0.0), actuated)
    if not len(passive) or generic.mobility.platform != 1 or len(actuated) != 1:
        return ()
    conditions = loop_slopes(mechanism, around_home(mechanism))
    joints = conditions.reshape(len(conditions), -1, 6, conditions.shape[2])
    is_on = np.abs(joints).max(axis=(0, 2)) > TOLERANCES.alignment  # (loops, joints)
    left, blocks = np.flatnonzero(is_on[:, passive].any(axis=1)), list[LoopBlock]()
    while len(left):
        block = _next_block(mechanism, conditions, is_on, left, passive)
        if block is None:
            return ()
        blocks.append(block)
        left, passive = np.setdiff1d(left, block.rows // 6), np.setdiff1d(passive, block.columns)
    return tuple(blocks) if not len(passive) else ()


def _next_block(mechanism: Mechanism, conditions: Floats, is_on: Mask, left: Ints, passive: Ints) -> LoopBlock | None:
    """The smallest block of the loops that are left, whose joints are among those not yet placed."""
    for size in range(1, min(len(left), MOST_TOGETHER) + 1):
        for chosen in combinations(left.tolist(), size):
            block = _block(mechanism, conditions, is_on, np.array(chosen), passive)
            if block is not None:
                return block
    return _block(mechanism, conditions, is_on, left, passive)


def _block(mechanism: Mechanism, conditions: Floats, is_on: Mask, loops: Ints, passive: Ints) -> LoopBlock | None:
    """The block of some loops, if they place all of their joints that are not placed yet, but for the spins of rods."""
    columns = passive[is_on[loops][:, passive].any(axis=0)]
    rows = (6 * loops[:, None] + np.arange(6)).ravel()
    ranks = np.linalg.matrix_rank(conditions[:, rows][:, :, columns], tol=TOLERANCES.alignment)
    rank, rods = int(ranks.max(initial=0)), _rods(mechanism, columns)
    if len(rods) != len(columns) - rank:
        return None  # not as many joints as conditions
    kept = _parts(conditions, rows, columns, len(rows) - rank, 0)[1]
    return LoopBlock(rows, columns, kept[int((ranks == rank).argmax())], rods)


def _rods(mechanism: Mechanism, columns: Ints) -> tuple[tuple[int, int], ...]:
    """Pairs of balls, by their places among the joints, that alone hold a body, among the joints of some columns."""
    places = np.unique(column_joints(mechanism)[columns]).tolist()
    rods = []
    for body in mechanism.bodies:
        ends = [place for place, joint in enumerate(mechanism.joints) if body in joint.connects]
        are_balls = all(mechanism.joints[place].type == "spherical" for place in ends)
        if len(ends) == 2 and are_balls and set(ends) <= set(places) and body != mechanism.end_effector_body:
            rods.append((ends[0], ends[1]))
    return tuple(rods)


AS_FORCES = 0.1
"""Scale of lengths, so that forces count for more in N than their moments, which turn as the points of balls move."""

TURNED_AWAY = 0.2
"""Volume that N spans with its directions at home, below which nothing is said of its sign."""

MOST_TOGETHER = 4
"""Most loops that are tried together before all that are left are."""
