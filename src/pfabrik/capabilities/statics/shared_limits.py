"""Limits of redundant actuators as limits of what they do together, along a path.

Forces t do the work A't on the motions, with the actuators' rates A by motions, (n_a, d). Of all forces within limits m
that is a zonotope, whose facets are spanned by d - 1 rows of A: with the minors p of A, for every choice S of d - 1,

    |sum_i p_(S, i) t_i| <= sum_i |p_(S, i)| m_i,

and t with this A't exist within the limits where all hold. At such a bound the actuators that are not in S are at their
limits. The minors are the same but for a common factor whichever motions are taken, and smooth along a path.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from math import comb

import numpy as np

from ...answers.solution import Solution
from ...common.arrays import Floats
from ...errors import UnsupportedMechanism
from .joint_balance import pairs_of

MOST_FACETS = 500
"""Most pairs of half-spaces that a path is given."""


def minors_of(solution: Solution, doing: str) -> tuple[Floats, int]:
    """The minors of A, (n, C(n_a, d)), each row but for its sign, and d.

    Raises
    ------
    UnsupportedMechanism : so many actuators that limits of what they do together are more than 500.
    """
    mechanism = solution.mechanism
    rates = pairs_of(mechanism, solution._coordinates).rates
    n_a, d = rates.shape[1:]
    if comb(n_a, d - 1) > MOST_FACETS:
        raise UnsupportedMechanism(mechanism.name, [f"{n_a} actuators share {d} motions in too many ways"], doing)
    rows = np.array(list(combinations(range(n_a), d)))
    return np.asarray(np.linalg.det(np.linalg.qr(rates)[0][:, rows])), d


def along(minors: Floats) -> Floats:
    """Minors at the places of a path (n, k), with one sign throughout."""
    turned = np.where(np.einsum("nk,nk->n", minors[1:], minors[:-1]) < 0.0, -1.0, 1.0)
    return np.asarray(minors * np.cumprod(np.append(1.0, turned))[:, None])


def facets_of(minors: Floats, n_a: int, d: int) -> Iterator[tuple[tuple[int, ...], Floats]]:
    """Yield the actuators that are not in S, and p_(S, i) of all, (n, n_a), for every choice S."""
    place = {rows: k for k, rows in enumerate(combinations(range(n_a), d))}
    for chosen in combinations(range(n_a), d - 1):
        others, found = tuple(sorted({*range(n_a)} - {*chosen})), np.zeros((len(minors), n_a))
        for i in others:
            sign = (-1.0) ** sum(row > i for row in chosen)
            found[:, i] = sign * minors[:, place[tuple(sorted((*chosen, i)))]]
        yield others, found
