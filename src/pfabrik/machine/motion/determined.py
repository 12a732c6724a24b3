"""Whether named coordinates and actuators determine each other, at configurations around home."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.arrays import Floats, Mask
from ...errors import UnsupportedMechanism, counted
from ...tolerances import TOLERANCES
from ..description.mechanism import Mechanism
from .loops import actuated_columns, first_order, right_singular
from .mobility import around_home, generic_of

MOST_NAMED = 6
"""Most coordinates that are named."""

CONFIGURATIONS = 4
"""Configurations around home that are looked at: home itself may be singular, and others hardly all are."""


def require_determined(
    mechanism: Mechanism, names: tuple[str, ...], rates_of: Callable[[Floats, Floats], Floats], purpose: str
) -> None:
    """Refuse coordinates that do not determine the actuators, or that these do not determine.

    The motions that the loops allow are the null space N of their conditions. With Q the rates of the named
    coordinates and A those of the actuators on N, joints determine actuators if Q n = 0 implies A n = 0, and the other
    way round: rank Q = rank [Q; A] = rank A, which is the number of coordinates.

    Parameters
    ----------
    rates_of : rates of the coordinates (n, k, f) by f motions, given as rates of all joints (n, nq, f), with the twists
        of the platform (n, 6, f), or (n, 3, f).
    purpose : what is refused: "exported".

    Raises
    ------
    UnsupportedMechanism : with the reason.
    """
    closure, twists = first_order(mechanism, around_home(mechanism)[:CONFIGURATIONS])
    rank = generic_of(mechanism).rank
    values, right = right_singular(closure)
    regular = np.count_nonzero(values > TOLERANCES.alignment, axis=1) == rank
    motions = np.swapaxes(right[regular, rank:], 1, 2)
    named = rates_of(motions, twists[regular] @ motions)
    actuators = motions[:, actuated_columns(mechanism)]
    reason = _reason(mechanism, names, named, actuators)
    if reason:
        raise UnsupportedMechanism(mechanism.name, [reason], purpose)


def _reason(mechanism: Mechanism, names: tuple[str, ...], named: Floats, actuators: Floats) -> str:
    """Why coordinates and actuators do not determine each other; empty if they do."""
    listed, k = ", ".join(names), len(names)
    n_named, n_driven = _rank(named), _rank(actuators)
    together = _rank(np.concatenate([named, actuators], axis=1))
    if together > n_named:
        moving = _moving(mechanism.actuator_names, named, actuators)
        return f"{listed} do not determine the actuators: with them at rest, {moving} can still move"
    if together > n_driven:
        moving = _moving(names, actuators, named)
        return f"the actuators do not determine the joints: with them locked, {moving} can still move"
    if n_named < k:
        return f"the loops leave {listed} {counted(n_named, 'freedom')}, not {k}: name as many as are independent"
    return ""


def _rank(matrices: Floats) -> int:
    if 0 in matrices.shape:
        return 0
    values = np.linalg.svd(matrices, compute_uv=False)
    return int(np.count_nonzero(values > TOLERANCES.alignment, axis=1).max())


def _moving(names: tuple[str, ...], held: Floats, watched: Floats) -> str:
    """Names of the coordinates that move while others are held, at the first of some configurations."""
    _, values, right = np.linalg.svd(held[0])
    free = right[np.count_nonzero(values > TOLERANCES.alignment) :].T
    speeds = np.linalg.norm(watched[0] @ free, axis=1)
    moves: Mask = speeds > TOLERANCES.alignment
    moving = [name for name, does in zip(names, moves, strict=True) if does]
    more = f" and {len(moving) - MOST_NAMED} others" if len(moving) > MOST_NAMED else ""
    return ", ".join(moving[:MOST_NAMED]) + more
